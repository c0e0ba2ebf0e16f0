"""Design the gain of a controller: stable, without violation from the start to any optimum."""

from collections.abc import Callable, Mapping
from typing import Any, overload

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._path.single_valued import placed
from sdpgrind.locus._path.stretch import Stretch
from sdpgrind.locus.gains._analysis import GainDesign, tight_end
from sdpgrind.locus.gains._area_design import CONFIDENCE, AreaDesign, design_area
from sdpgrind.locus.gains._least_value import least

NEAR = 0.999  # chosen: share of the way to the optimum searched; beyond, the ratio is that of the loop slope
TOUCHING = 1e-9  # chosen: share of a range that is rounding
CLOSE = 1e-6  # chosen: share of a range too short to divide by


@overload
def design_gain(
    curve: Area,
    *,
    noise: Mapping[str, float] | None = None,
    drift: Mapping[str, float] | None = None,
    confidence: float = CONFIDENCE,
) -> AreaDesign: ...


@overload
def design_gain(
    curve: Any,
    *,
    along: str | None = None,
    x: tuple[float, float] | None = None,
    start: str | float = "feasible",
) -> GainDesign: ...


def design_gain(
    curve: Any,
    *,
    along: str | None = None,
    x: tuple[float, float] | None = None,
    start: str | float = "feasible",
    noise: Mapping[str, float] | None = None,
    drift: Mapping[str, float] | None = None,
    confidence: float = CONFIDENCE,
) -> GainDesign | AreaDesign:
    """Design the gain of a controller on a locus with one measured response, or on an area with several.

    Koren's k = 0.6, found by trial, is stable in a part of his range only. Here the loop slope e_s gives
    stability and noise gain; the ways from the start to every optimum of the range give the greatest gain
    without violation at a constant hidden state. On an area the share theta of the errors is designed: the
    one whose margins, against noise and drift of the readings, cost least on average.

    Parameters
    ----------
    curve : Locus, Stretch or Area
        The traced optima.
    along : str
        Locus: coordinate, a control or the hidden state, single-valued on the locus.
    x : (float, float), optional
        Locus: range of the hidden state, in its unit. Default: that of the stretch.
    start : "feasible" or float
        Locus: initial coordinate, in its unit. "feasible": optimum of the tightest hidden state.
    noise, drift : mapping, optional
        Area: standard deviation of each reading, and greatest fall of each slack from one reading to the
        next, by name of the response, in its unit.
    confidence : float
        Area: probability [0.5, 1) that a sample keeps a limit.

    Returns
    -------
    GainDesign or AreaDesign
        Design of a locus, or of an area.

    Raises
    ------
    ValueError
        When the range has a fold or a jump, `along` turns in it, or the start violates the limit in it; when
        nothing drifts on an area, where the least theta is best; for an argument of the other kind.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> curve = locus.plan(locus.preset("koren-example"))
    >>> design = locus.gains.design_gain(curve, along="v", x=(0.758, 1.721))
    >>> round(design.violation_free, 3), round(design.gain, 3), round(design.start, 3)
    (0.6, 0.54, 1.878)
    """
    if isinstance(curve, Area):
        _left_out("an area, whose coordinates are all hidden states", along=along, x=x)
        return design_area(curve, noise, drift, confidence)
    _left_out("a locus: see GainDesign.noise_gain_at and drift_margin", noise=noise, drift=drift)
    stretch = stretch_of(curve, along, x)
    declared = declared_range(stretch, x)
    _check_slope(stretch, declared)
    begin = _start(stretch, declared, start)
    low, high = sorted(stretch.coordinate_of(np.array(declared)).tolist())

    def slope(s: Floats) -> Floats:
        return np.abs(stretch.slopes.at(s)[..., 0])

    stable = 2 * least(lambda s: 1 / slope(s), (low, high))[0]
    free = _free(stretch, begin, (low, high), lambda s: np.ones(s.shape), 0.5 * stable)
    theta = _free(stretch, begin, (low, high), slope, 1.0)
    return GainDesign(stretch, declared, begin, stable, free, theta)


def _left_out(where: str, **given: Any) -> None:
    """Refuse arguments that mean nothing for a kind of optima."""
    for name, value in given.items():
        if value is not None:
            raise ValueError(f"{name} must be left out for {where}; got {value!r}")


def stretch_of(curve: Any, along: str | None, x: tuple[float, float] | None) -> Stretch:
    """Return the stretch of a locus, or the given one."""
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
        try:  # the whole stretch gives the controller more room
            return checks.kind("curve.stretch(along)", curve.stretch(along), Stretch)
        except ValueError:  # fold or jump outside x
            pass
    return checks.kind("curve.stretch(along)", curve.stretch(along, x=x), Stretch)


def declared_range(stretch: Stretch, x: Any) -> tuple[float, float]:
    """Return a range of the hidden state, cut to the stretch at an interior end: the clamp is optimal."""
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
    """Refuse a slack that is not strictly monotone along the locus."""
    low, high = sorted(stretch.coordinate_of(np.array(x)).tolist())
    slopes = stretch.slopes.at(np.linspace(low, high, 257))[:, 0]
    if np.any(slopes == 0) or np.any(np.sign(slopes) != np.sign(slopes[0])):
        raise ValueError(
            "along must be a coordinate along which the slack changes one way;"
            f" along {stretch.along!r} it does not"
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
            f"start must have slack for every {stretch.hidden_name} in {x[0]:g}..{x[1]:g}, as {best:.6g} has;"
            f" got {place:g}, with {slack[worst]:.4g} at {states[worst]:.4g}"
        )
    return place


def _free(
    stretch: Stretch,
    start: float,
    places: tuple[float, float],
    weight: Callable[[Floats], Floats],
    at_optimum: float,
) -> float:
    """Return the least weight(s) (s* - s)/e(s) from the start to every optimum s*, at most `at_optimum`."""
    room = CLOSE * (stretch.high - stretch.low)

    def allowed(best: Floats, share: Floats) -> Floats:
        s = start + share * (best - start)
        each, back = np.unique(best, return_inverse=True)  # a lattice has few
        x = stretch.rows(each)[:, len(stretch.names)]
        slack = stretch.slack(s, x[back]) - stretch.slack(each, x)[back]  # less the rounding of the tables
        way = np.abs(best - s)
        ratio = weight(s) * way / np.where(slack > 0, slack, np.inf)
        return np.where(way > room, ratio, np.inf)

    found = min(at_optimum, least(allowed, places, (0.0, NEAR), places=129)[0])
    if found == 0:
        raise ValueError(
            "start must have slack all the way to the optimum, or no gain leads there;"
            f" from {start:.6g} it has not"
        )
    return found
