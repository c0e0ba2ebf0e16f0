"""Wear flat areas and limits B at which the work burns at every infeed rate, and the nearest at which not."""

from collections.abc import Callable
from math import exp

import numpy as np

from sdpgrind import physics
from sdpgrind.plunge._model.model import PlungeModel

_HALVINGS = 40  # chosen: far below the last digit shown
_DIGITS = 3  # chosen: of the limits in a message


def always_burns(model: PlungeModel) -> str:
    """Sentence with the greatest wear flat area, or the least B, at which some rate does not burn."""
    area, unit = model.wear_flat_area, "J/(mm^2 s^(1/2))"
    got = f"got wear_flat_area = {area:g}, B = {model.burning.B:g}"
    least = _shown(_least_limit(model, area), up=True)
    if _burns(model, 0.0, model.burning.B):
        new = _shown(_least_limit(model, 0.0), up=True)
        return (
            f"burning.B must be >= {least} {unit}, or >= {new} with a new wheel: even with wear_flat_area = 0"
            " the work burns at every infeed rate;"
            f" replace(burning=physics.BurningLimit({model.burning.u0:g}, B)); {got}"
        )
    most = _shown(_edge(lambda value: not _burns(model, value, model.burning.B), 0.0, area), up=False)
    return (
        f"wear_flat_area must be <= {most}, or burning.B >= {least} {unit}: the work burns at every infeed"
        f" rate; {got}"
    )


def cooled(before: PlungeModel, learned: PlungeModel, reserve: float) -> PlungeModel:
    """Learned model; where its work burns at every rate, with an area and a B nearer those before.

    They go as far as some rate stays `reserve` (ln of temperature) below burning, which one does `before`.
    """
    first, last = (np.array([m.wear_flat_area, m.burning.B]) for m in (before, learned))

    def allowed(share: float) -> bool:
        area, B = first + share * (last - first)
        return not _burns(learned, float(area), float(B) * exp(-reserve))

    if allowed(1.0):
        return learned
    area, B = first + _edge(allowed, 0.0, 1.0) * (last - first)
    return learned.replace(wear_flat_area=float(area), burning=learned.burning.replace(B=float(B)))


def _burns(model: PlungeModel, area: float, B: float) -> bool:
    """Whether the work burns at every rate."""
    onset = physics.burn_onset(
        model.power, model.burning.replace(B=B), work_speed=model.work_speed,
        wheel_speed=model.wheel_speed, equivalent_diameter=model.equivalent_diameter, wear_flat_area=area,
    )  # fmt: skip
    return onset.lower > onset.upper


def _least_limit(model: PlungeModel, area: float) -> float:
    """Least B, J/(mm^2 s^(1/2)), at which some rate does not burn."""
    enough = model.burning.B
    while _burns(model, area, enough):
        enough *= 2
    return _edge(lambda value: not _burns(model, area, value), enough, enough / 2)


def _edge(allowed: Callable[[float], bool], inside: float, outside: float) -> float:
    """Value nearest to `outside` that is allowed, by bisection."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if allowed(middle) else (inside, middle)
    return inside


def _shown(value: float, *, up: bool) -> str:
    """Return a limit in few digits, rounded to the side on which it still does."""
    from decimal import ROUND_CEILING, ROUND_FLOOR, Context

    rounding = ROUND_CEILING if up else ROUND_FLOOR
    return f"{float(Context(prec=_DIGITS, rounding=rounding).create_decimal(repr(value))):g}"
