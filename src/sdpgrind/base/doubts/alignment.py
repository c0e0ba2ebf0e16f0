"""Alignment of commands that the data prefer, of `sdpgrind.base.columns.commands.ALIGNMENTS`.

Filters make residuals alike from reading to reading; sums of squares are compared after a first-order filter
that makes them independent, the same for all alignments.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sdpgrind.base.doubts.words import amount, share

NOT_SURE = "not sure"
_DECISIVE = 4.0  # chosen: F of two standard deviations; by chance 1 of 20 exceeds it


class Alignment(NamedTuple):
    """Preferred alignment, and how much worse the next best one fits.

    Attributes
    ----------
    preferred : str
        "begin", "centre", "end" or "not sure".
    decisiveness : float
        F, unit 1: excess of the second-best sum of squares in variances of the noise.
    best, second : str
        The two alignments of least sum of squares.
    excess : float
        Second-best sum of squares over the least, less 1.
    needed : float
        Excess from which on the data decide.
    """

    preferred: str
    decisiveness: float
    best: str = ""
    second: str = ""
    excess: float = np.nan
    needed: float = np.nan

    @property
    def sure(self) -> bool:
        """Whether the data tell it."""
        return self.preferred != NOT_SURE


def preferred(squares: Mapping[str, float], readings: int, spread: float = 1.0) -> Alignment:
    """Alignment of least sum of squares, if F = (second - least)/(least/(n - 2)) is at least 4.

    `spread`: variance of the difference of the two sums over that by independent noise, unit 1.
    """
    least, second = sorted(squares, key=lambda each: squares[each])[:2]
    freedom = max(readings - 2, 1)
    apart = squares[second] - squares[least]
    excess = apart / squares[least] if squares[least] > 0 else np.inf if apart > 0 else 0.0
    decisive = excess * freedom / spread
    found = least if decisive >= _DECISIVE else NOT_SURE
    return Alignment(found, float(decisive), least, second, float(excess), spread * _DECISIVE / freedom)


def alignment_sentence(
    found: Alignment, commands_at: str, name: str, values: Mapping[str, float], unit: str
) -> str:
    """Sentence on the preferred alignment, on its margin, and on the value of a field with each."""
    each = ", ".join(f"{amount(value, unit, 4)} with {way!r}" for way, value in values.items())
    margin = f"leaves a sum of squared residuals {share(found.excess)} larger than {found.best!r}"
    known = f"{name} would be {each}."
    if not found.sure and found.excess >= found.needed:
        return (
            f"Commands were read with commands_at={commands_at!r}, which these data can neither confirm nor"
            f" reject: the law of the model fits them with no alignment; {known}"
        )
    if not found.sure:
        return (
            f"Commands were read with commands_at={commands_at!r}, which these data can neither confirm nor"
            f" reject: {found.second!r} {margin}, and {share(found.needed)} would decide; {known}"
        )
    decided = f"{found.second!r}, the next best, {margin} ({share(found.needed)} would be enough); {known}"
    if found.preferred == commands_at:
        return f"Commands were read with commands_at={commands_at!r}, and the data confirm it: {decided}"
    return (
        f"Commands were read with commands_at={commands_at!r}, but the data reject that for"
        f" {found.preferred!r}: {decided} If the control records them so, read again with"
        f" commands_at={found.preferred!r}."
    )
