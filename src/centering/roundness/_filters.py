"""Linear filters for closed profiles: Gaussian, spline, phase-corrected 2RC, and bands of them.

ISO 16610-21 (Gaussian), -22 (spline), with the cut-offs of ISO 12181-2. On an even turn a filter is a factor
for each harmonic, its transmission.
"""

import warnings
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from centering.roundness._harmonic_fit import even_harmonics, even_values
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

CUT_OFFS = (15, 50, 150, 500, 1500)
"""Source: ISO 12181-2, usual cut-offs, undulations per revolution."""
BANDS = {
    **{f"1-{high}": (1.0, float(high)) for high in CUT_OFFS[:4]},
    "2-15": (2.0, 15.0),
    "15-150": (15.0, 150.0),
    "15-500": (15.0, 500.0),
}
"""Usual bands, undulations per revolution."""
PRACTICE = 7  # chosen: samples for each undulation at the cut-off
_PASSED = 5  # derived: cut-offs up to which a Gaussian keeps harmonics; beyond, less than 3e-8 passes


def gaussian(upr: Floats, cut_off: float) -> Floats:
    """Transmission of the Gaussian, exp(-pi (alpha upr/cut_off)^2), alpha^2 = ln 2/pi: half at cut-off."""
    return np.asarray(np.exp2(-((upr / cut_off) ** 2)))


def spline(upr: Floats, cut_off: float, points: int, tension: float) -> Floats:
    """Transmission of the smoothing spline on so many points of a turn; one half at the cut-off."""
    square = (np.sin(np.pi * upr / points) / np.sin(np.pi * cut_off / points)) ** 2  # 4 a^2 sin^2
    return np.asarray(1 / (1 + tension * square + (1 - tension) * square**2))


def two_rc(upr: Floats, cut_off: float) -> Floats:
    """Transmission of two RC members without their phase; three quarters at the cut-off."""
    return np.asarray(1 / (1 + (upr / cut_off) ** 2 / 3))


class Filter(NamedTuple):
    """A filter that passes harmonics from `low` (1: all) up to `high` (inf: all), upr.

    A high pass takes off what the low pass lets through; that of 2RC has a transmission of its own, three
    quarters at its cut-off, too.
    """

    kind: str
    low: float
    high: float
    tension: float = 0.0

    def transmission(self, upr: npt.ArrayLike, points: int) -> Floats:
        """Factor of each harmonic on so many points of a turn."""
        upr = np.asarray(upr, dtype=float)
        passed = self._low_pass(upr, self.high, points) if self.high < np.inf else np.ones_like(upr)
        return passed if self.low <= 1 else passed * self._high_pass(upr, points)

    def _low_pass(self, upr: Floats, cut_off: float, points: int) -> Floats:
        if self.kind == "spline":
            return spline(upr, cut_off, points, self.tension)
        return two_rc(upr, cut_off) if self.kind == "2rc" else gaussian(upr, cut_off)

    def _high_pass(self, upr: Floats, points: int) -> Floats:
        if self.kind == "2rc":
            return np.asarray(upr**2 / (upr**2 + self.low**2 / 3))
        return 1 - self._low_pass(upr, self.low, points)

    def applied(self, values: Floats) -> Floats:
        """Values on an even turn, filtered; exact, as the circular convolution is a product of harmonics."""
        coef = even_harmonics(values)
        return even_values(coef * self.transmission(np.arange(coef.size), values.size), values.size)

    @property
    def cut_off(self) -> float:
        """Higher cut-off, or that of a high pass, upr."""
        return self.high if self.high < np.inf else self.low

    @property
    def needed(self) -> float:
        """Harmonics that count, upr: all where the transmission falls slowly, or outliers are weighed."""
        return _PASSED * np.ceil(self.high) if self.kind == "gaussian" else np.inf

    def __str__(self) -> str:
        named = {"gaussian": "Gaussian", "robust": "robust Gaussian", "2rc": "2RC"}.get(self.kind, self.kind)
        told = f", tension {self.tension:g}" if self.tension else ""
        if self.low <= 1:
            return f"{named} low-pass, {self.high:g} upr{told}"
        if self.high == np.inf:
            return f"{named} high-pass, {self.low:g} upr{told}"
        return f"{named} band-pass, {self.low:g} to {self.high:g} upr{told}"


KINDS = ("gaussian", "spline", "2rc", "robust")


def filter_of(kind: str, upr: Any, tension: float, nyquist: float) -> Filter:
    """The filter that is asked for, checked."""
    checks.one_of("kind", kind, KINDS)
    low, high = _band(upr)
    if kind == "robust" and low > 1:
        raise checks.refuse("upr", "one cut-off for kind robust, which is a low pass", upr, "upr")
    for cut_off in (low, high):
        if 1 < cut_off < np.inf and cut_off >= nyquist:
            rule = f"< {nyquist:.6g}, half of the points of one turn"
            raise checks.refuse("upr", rule, cut_off, "upr")
    share = checks.within("tension", tension, 0.0, 1.0)
    if share and kind != "spline":
        raise ValueError(f"tension must be left out of kind {kind}: it belongs to spline; got {tension:g}")
    return Filter(kind, low, high, share)


def _band(upr: Any) -> tuple[float, float]:
    """Lower and higher cut-off of a number, a pair or a name of a usual band, upr."""
    if isinstance(upr, str):
        return BANDS[checks.one_of("upr", upr, BANDS)]
    if not isinstance(upr, tuple | list):
        return 1.0, checks.positive("upr", upr, "upr")
    if len(upr) != 2:
        raise checks.refuse("upr", "a cut-off or a pair of them, as (15, 150) or (15, None)", upr, "upr")
    low, high = (None if each is None else checks.positive("upr", each, "upr") for each in upr)
    found = (1.0 if low is None else low, np.inf if high is None else high)
    if found[0] < 1 or found[0] >= found[1] or found == (1.0, np.inf):
        raise checks.refuse("upr", "a pair (low, high) with 1 <= low < high, one of them given", upr, "upr")
    return found


def warn_if_sparse(points: float, cut_off: float) -> None:
    """Warn where a turn has fewer points than good practice requires."""
    if points * (1 + 1e-6) < PRACTICE * cut_off:
        warnings.warn(
            f"{points:.4g} points a turn are {points / cut_off:.2g} for each undulation at the cut-off of"
            f" {cut_off:g} upr; good practice is {PRACTICE}:"
            f" a cut-off of {points / PRACTICE:.3g} upr at most",
            stacklevel=3,
        )
