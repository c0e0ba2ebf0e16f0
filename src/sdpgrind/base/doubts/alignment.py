"""Alignment of commands that the data prefer, of `sdpgrind.base.columns.commands.ALIGNMENTS`.

Filters make residuals alike from reading to reading; sums of squares are compared after a first-order filter
that makes them independent, the same for all alignments.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

NOT_SURE = "not sure"
_DECISIVE = 4.0  # source: F of the specification, 1 wrong of 200 files at the most
_ENDLESS = 1e6  # chosen: F beyond which its digits say nothing


class Alignment(NamedTuple):
    """Preferred alignment, and the excess of the second-best sum of squares in variances of the noise."""

    preferred: str
    decisiveness: float

    @property
    def sure(self) -> bool:
        """Whether the data tell it."""
        return self.preferred != NOT_SURE


def preferred(squares: Mapping[str, float], readings: int) -> Alignment:
    """Alignment of least sum of squares, if F = (second - least)/(least/(n - 2)) is at least 4."""
    least, second = sorted(squares, key=lambda each: squares[each])[:2]
    noise = squares[least] / max(readings - 2, 1)
    excess = squares[second] - squares[least]
    decisive = excess / noise if noise > 0 else np.inf if excess > 0 else 0.0
    return Alignment(least if decisive >= _DECISIVE else NOT_SURE, float(decisive))


def alignment_sentence(found: Alignment, commands_at: str, values: Mapping[str, float], unit: str) -> str:
    """Sentence on the preferred alignment, and on the value of a field with each."""
    read = f"Commands were read as at the {commands_at!r} of their row"
    each = ", ".join(f"{value:.4g} {unit} with {way!r}" for way, value in values.items())
    if not found.sure:
        return f"{read}; the data do not tell whether they are ({each})."
    sure = f"F = {min(found.decisiveness, _ENDLESS):.0f}, {_DECISIVE:.0f} is enough"
    if found.preferred == commands_at:
        return f"{read}, and the data prefer it ({sure}; {each})."
    return (
        f"{read}, but the data prefer {found.preferred!r} ({sure}; {each}). If the control records them so,"
        f" read again with commands_at={found.preferred!r}."
    )
