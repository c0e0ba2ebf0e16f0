"""Design the gain of a controller on the locus: stable, and without violation on the way to every optimum."""

from collections.abc import Callable
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._stretch.single_valued import placed
from sdpgrind.locus._stretch.stretch import Stretch
from sdpgrind.locus.gains._gain_design import GainDesign, tight_end
from sdpgrind.locus.gains._least_value import least

NEAR = 0.999
"""Share of the way to the optimum up to which the slack is divided by; there the loop slope takes over."""
TOUCHING, CLOSE = 1e-9, 1e-6
"""Shares of a range that are rounding, and too short to divide by."""


def design_gain(
    curve: Any,
    *,
    along: str | None = None,
    x: tuple[float, float] | None = None,
    start: str | float = "feasible",
) -> GainDesign:
    """Design the gain of a controller that walks along a locus by one measurement.

    Koren found k = 0.6 by trial; it is stable for part of his range only, and violates the limit in more of it. Here the loop
    slope e_s along the locus tells what is stable and how noise passes through, and the way from the start to every optimum of
    the range tells up to which gain the limit is never violated while the hidden state stands still.

    Parameters
    ----------
    curve : Locus or Stretch
        The traced locus.
    along : str
        The coordinate: a control, or the hidden state, that is single-valued on the locus.
    x : (float, float), optional
        Range of the hidden state for which it shall hold, in its unit; else that of the stretch.
    start : "feasible" or float
        Coordinate of the start, in its unit; "feasible": the optimum of the tightest hidden state, which has slack for all.

    Raises
    ------
    ValueError
        When the range holds a fold or a jump, the coordinate is not single-valued, or the start has no slack for a hidden state
        of the range.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> curve = locus.plan(locus.preset("koren-example"))
    >>> design = locus.gains.design_gain(curve, along="v", x=(0.758, 1.721))
    >>> round(design.violation_free, 3), round(design.gain, 3), round(design.start, 3)
    (0.6, 0.54, 1.878)
    """
    stretch = stretch_of(curve, along, x)
    declared = declared_range(stretch, x)
    _check_slope(stretch, declared)
    begin = _start(stretch, declared, start)
    low, high = sorted(stretch.coordinate_of(np.array(declared)).tolist())

    def slope(s: Floats) -> Floats:
        return np.abs(stretch.rows(s)[..., -1])

    stable = 2 * least(lambda s: 1 / slope(s), (low, high))[0]
    free = _free(stretch, begin, (low, high), lambda s: np.ones(s.shape), 0.5 * stable)
    theta = _free(stretch, begin, (low, high), slope, 1.0)
    return GainDesign(stretch, declared, begin, stable, free, theta)


def stretch_of(curve: Any, along: str | None, x: tuple[float, float] | None) -> Stretch:
    """The stretch of a locus, or the one given."""
    if isinstance(curve, Stretch):
        if along not in (None, curve.along):
            raise checks.refuse("along", f"{curve.along!r}, the coordinate of the stretch", along)
        return curve
    checks.able(
        "curve",
        curve,
        "a locus of one hidden state, as locus.plan gives it (several: locus.AreaController), or a stretch",
        "stretch",
    )
    if along is None:
        raise checks.refuse("along", "the name of a control or of the hidden state", along)
    if x is not None:
        try:  # the more there is to walk on, the further a controller may draw back
            return checks.kind("curve.stretch(along)", curve.stretch(along), Stretch)
        except ValueError:  # a fold or a jump elsewhere
            pass
    return checks.kind("curve.stretch(along)", curve.stretch(along, x=x), Stretch)


def declared_range(stretch: Stretch, x: Any) -> tuple[float, float]:
    """A range of the hidden state within the stretch; beyond an interior end the clamped place is the optimum anyway."""
    low, high = stretch.x
    if x is None:
        return low, high
    name = stretch.hidden_name
    if np.shape(x) != (2,):
        raise checks.refuse("x", f"a least and a greatest {name}", x)
    a, b = (checks.number(f"x[{k}]", value) for k, value in enumerate(x))
    if not a < b:
        raise checks.refuse("x", f"a least and a greatest {name}, rising", (a, b))
    ends = stretch.ends if stretch.hidden[0] < stretch.hidden[-1] else stretch.ends[::-1]
    room = TOUCHING * (high - low)
    below, above = a < low - room and ends[0] != "interior", b > high + room and ends[1] != "interior"
    if below or above or min(b, high) <= max(a, low):
        raise ValueError(
            f"x must lie in {low:g}..{high:g}, where the stretch ends ({ends[0]}, {ends[1]}); got {(a, b)}"
        )
    return max(a, low), min(b, high)


def _check_slope(stretch: Stretch, x: tuple[float, float]) -> None:
    """The slack must change one way along the locus, or no gain works."""
    low, high = sorted(stretch.coordinate_of(np.array(x)).tolist())
    slopes = stretch.rows(np.linspace(low, high, 257))[:, -1]
    if np.any(slopes == 0) or np.any(np.sign(slopes) != np.sign(slopes[0])):
        raise ValueError(
            f"along must be a coordinate along which the slack changes one way; along {stretch.along!r} it does not"
        )


def _start(stretch: Stretch, x: tuple[float, float], start: Any) -> float:
    if start == "feasible":
        return float(stretch.coordinate_of(tight_end(stretch, x)))
    if isinstance(start, str):
        raise checks.refuse("start", '"feasible" or a coordinate', start)
    place = placed("start", start, stretch.low, stretch.high, stretch.unit)
    states = np.linspace(*x, 257)
    slack = stretch.slack(place, states)
    worst = int(np.argmin(slack))
    if slack[worst] < -TOUCHING * float(np.ptp(stretch.limit) + np.abs(slack).max()):
        best = stretch.coordinate_of(tight_end(stretch, x))
        raise ValueError(
            f"start must have slack for every {stretch.hidden_name} in {x[0]:g}..{x[1]:g}, as {best:.6g} has; got {place:g}, with"
            f" {slack[worst]:.4g} at {states[worst]:.4g}"
        )
    return place


def _free(
    stretch: Stretch,
    start: float,
    places: tuple[float, float],
    weight: Callable[[Floats], Floats],
    at_optimum: float,
) -> float:
    """The least of weight(s) (s* - s)/e(s) between the start and every optimum s*; next to it this is `at_optimum` or more."""
    room = CLOSE * (stretch.high - stretch.low)

    def allowed(best: Floats, share: Floats) -> Floats:
        s = start + share * (best - start)
        x = stretch.rows(best)[:, len(stretch.names)]
        slack = stretch.slack(s, x) - stretch.slack(best, x)  # the second is rounding of the tables only
        way = np.abs(best - s)
        ratio = weight(s) * way / np.where(slack > 0, slack, np.inf)
        return np.where(way > room, ratio, np.inf)

    found = min(at_optimum, least(allowed, places, (0.0, NEAR), places=129)[0])
    if found == 0:
        raise ValueError(
            f"start must have slack all the way to the optimum, or no gain leads there; from {start:.6g} it has not"
        )
    return found
