"""Doubts as a page of text: values from the data first, then assumptions, sentences and stakes."""

import re
from collections.abc import Sequence
from textwrap import fill, indent

import numpy as np

from sdpgrind.base.brief import counted, listed
from sdpgrind.base.doubts.rows import ASSUMED, DIFFERS, NOT_TOLD, Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake
from sdpgrind.base.doubts.words import probability, significant, to_spread
from sdpgrind.base.text_table import aligned

_NUMBER = re.compile(r"(?<=\d) (?=[^\W\d_]|%)")
_ROUNDING = 1e-12  # chosen: relative; a plan that was solved again and is the same
_WIDE = 110  # chosen: width of the page, characters


def page(
    subject: str,
    rows: Sequence[Doubt],
    sentences: Sequence[str],
    figure: Figure | None,
    stakes: Sequence[Stake],
    data: Sequence[str] = (),
) -> str:
    """Return the page of doubts; see `Doubts` for its parts; `data`: lines on their origin."""
    verdict_lines = [f"Doubts: {subject}", *data, fill(summary(rows), _WIDE)]
    blocks = ["\n".join(verdict_lines), _table(told_rows(rows))]
    blocks += ["\n".join(map(_filled, group)) for group in remarks(rows, sentences)]
    if figure:
        cells = stake_cells(figure, stakes)
        blocks.append(
            "\n".join([*map(_filled, stake_lines(figure, stakes)), *([_aligned(cells)] if cells else [])])
        )
    return "\n\n".join(filter(None, blocks))


def told_rows(rows: Sequence[Doubt]) -> list[Doubt]:
    """Return the rows with a value of the data."""
    return [row for row in rows if row.measured or np.isfinite(row.told)]


def remarks(rows: Sequence[Doubt], sentences: Sequence[str]) -> list[list[str]]:
    """Return the lines on what is assumed, on what is not told, and the sentences; items begin with "- "."""
    assumed = [row for row in rows if row.verdict == ASSUMED]
    besides = ["What the data show besides:", *map(_item, sentences)] if sentences else []
    groups = [_assumptions(assumed), _untold(rows), besides]
    return [group for group in groups if group]


def summary(rows: Sequence[Doubt]) -> str:
    """Return how many values the data tell, and which differ from what is believed."""
    measured = [row for row in rows if row.measured]
    off = [row.name for row in measured if row.verdict == DIFFERS]
    numbers = [row for row in rows if row.verdict != ASSUMED]
    known = f"The data tell {len(measured) or 'none'} of {counted(len(numbers), 'value')} of the model"
    if not measured:
        return f"{known}."
    names = f"{listed(off)} {'differs' if len(off) == 1 else 'differ'}" if off else "none differs"
    return f"{known}; {names} from what the problem holds (column believed)."


def _table(rows: Sequence[Doubt]) -> str:
    if not rows:
        return ""
    cells = [("", "believed", "told by the data (95 %)", "verdict")]
    cells += [(named(row), believed(row), told(row), verdict(row)) for row in rows]
    return _aligned(cells)


def _aligned(cells: Sequence[tuple[str, ...]]) -> str:
    return indent("\n".join(aligned(cells)), "  ")


def named(row: Doubt | Stake) -> str:
    """Return name and unit."""
    return row.name if row.unit in ("", "1") else f"{row.name} [{row.unit}]"


def believed(row: Doubt) -> str:
    """Return the believed value as text."""
    return row.believed if isinstance(row.believed, str) else f"{row.believed:.4g}"


def told(row: Doubt) -> str:
    """Return value and interval of the data as text."""
    half = (row.high - row.low) / 2
    value, low, high = (to_spread(each, half) for each in (row.told, row.low, row.high))
    return f"{value}  ({low} to {high})"


def verdict(row: Doubt) -> str:
    """Return the verdict, with the probability of a difference by chance, or what would tell the value."""
    if row.verdict == NOT_TOLD and np.isfinite(row.told):
        return f"{row.verdict}: its standard deviation exceeds it"
    if row.verdict in (NOT_TOLD, ASSUMED) and row.note:
        return f"{row.verdict}: {row.note}"
    return f"{row.verdict} ({probability(row.chance)})" if row.verdict == DIFFERS else row.verdict


def _assumptions(rows: Sequence[Doubt]) -> list[str]:
    if not rows:
        return []
    lines = [_item(f"{row.name}: {row.believed}" + (f"; {row.note}" if row.note else "")) for row in rows]
    return ["Assumed by the reader; the file does not say it:", *lines]


def _untold(rows: Sequence[Doubt]) -> list[str]:
    """Names of the values that the data do not tell, by what would tell them."""
    groups: dict[str, list[str]] = {}
    for row in rows:
        if row.verdict == NOT_TOLD and not np.isfinite(row.told):
            groups.setdefault(row.note, []).append(row.name)
    if not groups:
        return []
    lines = [_item(", ".join(names) + (f": {note}" if note else "")) for note, names in groups.items()]
    return ["Not told by the data, and what would tell it:", *lines]


def _item(sentence: str) -> str:
    return f"- {sentence}"


def _filled(line: str) -> str:
    glued = _NUMBER.sub("\u00a0", line)  # a number stays with its unit
    return fill(glued, _WIDE, subsequent_indent="  ").replace("\u00a0", " ")


def stake_lines(figure: Figure, stakes: Sequence[Stake]) -> list[str]:
    """Return the lines above the table of stakes."""
    solved = f" ({figure.solved})" if figure.solved else ""
    value = f"{figure.name} = {significant(figure.value, 4)} {figure.unit}{solved}"
    head = f"The plan of the problem as it is: {value}."
    if not stakes:
        return [f"{head} It depends on no value that the data tell."]
    return [head, "Solved again at both ends of each interval, largest change first:"]


def stake_cells(figure: Figure, stakes: Sequence[Stake]) -> list[tuple[str, ...]]:
    """Return the table of stakes with its heads; empty: there are none."""
    if not stakes:
        return []
    cells: list[tuple[str, ...]] = [("with", "at the low end", "at the high end", "change at most")]
    return cells + [_stake(figure, stake) for stake in stakes]


def _stake(figure: Figure, stake: Stake) -> tuple[str, ...]:
    half, found = (
        (stake.high - stake.low) / 2,
        [at for at in (stake.at_low, stake.at_high) if np.isfinite(at)],
    )
    spread = max(float(np.ptp(found)) if found else 0.0, 1e-3 * abs(figure.value))
    shown = [
        f"{to_spread(at, spread)} {figure.unit}" if np.isfinite(at) else "no plan"
        for at in (stake.at_low, stake.at_high)
    ]
    ends = [f"{to_spread(end, half)}: {at}" for end, at in zip((stake.low, stake.high), shown, strict=True)]
    if np.isnan(stake.low):
        ends = [f"each as told: {shown[0]}", ""]
    most = max((at - figure.value for at in found), key=abs, default=np.nan)
    most = 0.0 if abs(most) < _ROUNDING * abs(figure.value) else most
    words = f"{most:{'+' if most else ''}.2g} {figure.unit}" if found else ""
    return named(stake), *ends, f"{words} {stake.reason}".strip()
