"""Page of a separation: limits, the part's roundness, harmonics of part and spindle, setups, origin."""

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from centering.roundness._harmonic_verdicts import harmonic_verdicts, measured_for, split_limits
from centering.roundness._profile_sheet import FORM, limit_of
from centering.roundness._ront_verdict import without_interval
from centering.roundness._roundness import Roundness
from centering.roundness._spindle_error import told_lost
from sdpgrind.base.by_name import called
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Listing, Sentences
from sdpgrind.base.units import UM

_SPINDLE = "spindle"  # its error from valley to peak
_LARGEST = 8  # harmonics in a table; chosen: as on the page of a profile


def report(separation: Any, path: str | os.PathLike[str] | None, limits: Mapping[Any, float] | None) -> str:
    """Write the page of a separation, or return its text."""
    named, waves = split_limits(limits)
    given = {name: limit_of(name, each, FORM | {_SPINDLE: ""}) for name, each in named.items()}
    circle = separation.part.roundness()
    verdicts = [_verdict(separation, circle, name, each) for name, each in given.items()]
    verdicts += harmonic_verdicts(measured_for(separation.part, waves))
    more = (*_blocks(separation, circle, verdicts), *_origin(separation))
    return str(called("sdpgrind.base.sheets.record_page:report", separation, path, more))


def _verdict(separation: Any, circle: Roundness, name: str, limit: float) -> str:
    """Sentence on a limit (mm); RONt of the part has an interval where its noise is known."""
    if name == "RONt":
        return circle.verdict(limit)
    value = separation.spindle.range if name == _SPINDLE else getattr(circle, FORM[name])
    told = f"{name} {UM * value:.4g} µm, limit {UM * limit:.4g} µm"
    return f"{told}: {without_interval(value, limit)}"


def _blocks(separation: Any, circle: Roundness, verdicts: list[str]) -> Iterator[Block]:
    if verdicts:
        yield Sentences(verdicts, strong=True)
    yield _part(circle)
    yield Sentences([circle.why_no_interval or _method(circle), *circle.remarks])
    yield _harmonics(separation)
    yield Sentences([f"harmonics: {told_lost(separation.lost)}; 1 upr is never separated"])


def _part(circle: Roundness) -> AmountTable:
    """Parameters of the part about the least squares circle, with the interval of RONt."""
    rows = [(name, f"{UM * getattr(circle, field):.4g}") for name, field in FORM.items()]
    if not circle.why_no_interval:
        rows.append(("95 % interval of RONt", circle.interval().ends))
    amounts = [Amounts.of(name, [value]) for name, value in rows]
    return AmountTable("Roundness of the part about its least squares circle", amounts, ("parameter", "µm"))


def _method(circle: Roundness) -> str:
    return f"95 % interval by noise and what is lost; method {circle.interval().method}"


def _harmonics(separation: Any) -> AmountTable:
    """The largest harmonics of part or spindle, with the sd of both and the singular value."""
    spindle, upr = separation.spindle.harmonics, separation.upr
    part = separation.part.harmonics(int(upr.max())).amplitude[1:]
    order = np.argsort(-np.maximum(part, spindle.amplitude), kind="stable")[:_LARGEST]
    rows = np.sort(order)
    columns = [
        Amounts.of("upr", upr[rows].astype(int), heading="undulations per revolution"),
        Amounts.of("amplitude", part[rows], "mm", "part"),
        Amounts.of("amplitude", spindle.amplitude[rows], "mm", "spindle"),
        Amounts.of("sd", spindle.sd[rows], "mm", "sd of each"),
        Amounts.of("singular", separation.singular[rows], "1", "singular value"),
    ]
    return AmountTable("Largest amplitudes of part and spindle", columns)


def _origin(separation: Any) -> Iterator[Block]:
    """Setups, filter, steps and files."""
    part = separation.part
    sides = ["usual" if sense > 0 else "other" for sense in separation.senses]
    turns = [f"{each:.4g}" for each in np.degrees(separation.turns) % 360]
    yield Heading("How it was measured")
    yield AmountTable(
        "Setups",
        [
            Amounts.of("setup", range(1, len(sides) + 1)),
            Amounts.of("turn", turns, heading="turn of the part [degrees]"),
            Amounts.of("side", sides, heading="side of the probe"),
        ],
    )
    told = part._origin.filter or "none: all undulations"
    yield Sentences([f"filter: {told}", *(f"step: {step}" for step in part.steps)])
    yield Heading("Source of the data")
    yield Listing(str(part.source) if part.source else "not read from files: arrays of a program")
