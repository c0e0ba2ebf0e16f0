"""Page of a study: its text in sections, mean ratios with intervals, the picture, readings as data."""

import os
from typing import Any

from sdpgrind.base.rng import Seed
from sdpgrind.base.sheets import page
from sdpgrind.base.sheets.amounts import Amounts, Interval
from sdpgrind.base.sheets.blocks import (
    AmountTable,
    Blanks,
    Block,
    Embedded,
    Heading,
    Listing,
    Picture,
    Sentences,
)
from sdpgrind.base.sheets.origin import versions, versions_table
from sdpgrind.finishing.study._report import report
from sdpgrind.finishing.study._texts import level


def sheet(study: Any, rng: Seed, path: str | os.PathLike[str]) -> str:
    """Write the page of a study and return its path."""
    first, *sections = report(study, rng).split("\n\n")
    best = study.best().items() if study.ratio != "none" else ()
    told = [f"{name} {level(value)} {study.units.get(name, '')}".rstrip() for name, value in best]
    blocks: list[Block] = [
        Sentences(
            [first.splitlines()[0], *([f"best levels: {', '.join(told)}"] if told else [])], strong=True
        ),
        _means(study),
        Picture("Mean ratio at the levels of each factor", study.plot),
        Heading("Analysis"),
        *(Listing(section) for section in sections),
        Heading("Origin"),
        versions_table(),
        Embedded("study", _data(study) | versions()),
        Blanks(("name", "date", "signature")),
    ]
    return page.report(f"Study of {study.name}", blocks, path)


def _means(study: Any) -> AmountTable:
    rows = study.level_means().rows
    halves = [float("nan") if row.half_width is None else row.half_width for row in rows]
    columns = (
        Amounts.of("factor", [row.factor for row in rows]),
        Amounts.of("level", [f"{level(r.level)} {study.units.get(r.factor, '')}".rstrip() for r in rows]),
        Amounts.of("mean", [Interval(r.mean, half) for r, half in zip(rows, halves, strict=True)], "dB"),
    )
    return AmountTable("Mean ratio at each level, 95 % interval", columns)


def _data(study: Any) -> dict[str, Any]:
    settings = {name: values.tolist() for name, values in study.settings.items()}
    return {
        "settings": settings,
        "readings": study.readings.tolist(),
        "unit": study.unit,
        "ratio": study.ratio,
    }
