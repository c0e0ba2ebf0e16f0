"""Estimates from logs of parts: time constant, sharpness, contact, deflection, a whole machine, roundness."""

from collections.abc import Sequence
from typing import Any

from sdpgrind.base import checks
from sdpgrind.identify import Estimate
from sdpgrind.plunge._identify import contact as _contact
from sdpgrind.plunge._identify import sharpness as _sharpness
from sdpgrind.plunge._identify import time_constant as _time_constant
from sdpgrind.plunge._identify.cycles import cycles, mean_of_parts, not_identified
from sdpgrind.plunge._identify.declared_units import another_unit_told
from sdpgrind.plunge._identify.machine import machine
from sdpgrind.plunge._identify.roundness import roundness
from sdpgrind.plunge._model.problem import CycleProblem

_METHODS = {
    "time_constant": ("output_error", "recursive", "printed"),
    "wear_flat_area": ("mean",),
    "contact_zero": ("output_error",),
    "normal_force_ratio": ("output_error",),
    "machine": ("output_error",),
    "roundness": ("least_squares",),
    "B": ("inspection",),
}
_B = (
    "B",
    "J/(mm^2 s^(1/2))",
    "needs inspection: plunge.BurnThreshold learns it; no size and no power shows it",
)


def identify(
    data: Any,
    what: str,
    *,
    method: str | None = None,
    problem: CycleProblem | None = None,
    part: int | Sequence[int] | None = None,
    forgetting: float = 1.0,
    power_max: float | None = None,
    throw: bool = False,
) -> Estimate:
    """Estimate from cycles a quantity that `CycleProblem.updated` takes, or the contact zero.

    ==================== ===================================================================================
    `what`               result and methods (the first is the default)
    ==================== ===================================================================================
    "time_constant"      lag of the actual behind the commanded rate, s. "output_error": least squares of the
                         size of the linear model, offset of the gauge, touch-in, first-order noise.
                         "recursive": reading by reading, with forgetting, with the touch-in of the first;
                         least squares as if white, variance of first-order noise. "printed": (4); noise of
                         the size makes it too short, an offset ruins it
    "wear_flat_area"     0..1. "mean": of the areas by (6), over the samples in which sliding takes more than
                         a quarter of the power; needs `problem`. 1 % of power is some 2.5 % of area
    "contact_zero"       command lacking at contact, mm (negative: contact after the command is 0), from
                         command, deflection and size with an offset of the gauge; needs `problem`
    "normal_force_ratio" force ratio of the model times the scale of its deflection, unit 1; needs `problem`
    "machine"            all that sizes and powers tell of a machine, in one fit of the parts; needs `problem`
                         and its declared noise; see below
    "roundness"          R_0 (mm) and k_r (unit 1) by the roundness of parts that end at different rates: a
                         column or the outcome of a log; needs `problem`, three parts, rates a factor 2 apart
    "B"                  never identified: the burn threshold needs inspection, `BurnThreshold`
    ==================== ===================================================================================

    The linear model holds about one rate: its time constant is shorter while roughing than in spark-out. With
    `problem` "output_error" fits the deflection of the model and returns the time constant of its spark-out.

    A machine is ``normal_force_ratio`` (of a linear model ``linear_time_constant``, s), ``wear_flat_area``,
    ``specific_energy`` (J/mm^3), ``ploughing_force`` (N/mm), ``idle_power`` (W), ``wheel_wear`` (radial, over
    radial stock), ``feed_lag``, ``power_lag`` (s), and the ``contact_zero`` (mm) of each part (several:
    ``contact_zero_0``, ...). 20 powers in the air, before contact or before the first feed, tell idle
    power from ploughing (without them the message tells the power of both together), holds at several rates
    chips from sliding. What the parts do not tell stays as believed, with an infinite standard deviation and
    a sentence in the message. ``fit`` holds squares of the residuals over the declared noise and their order;
    the status is "does not fit" outside 0.8 ... 1.25, and ``plot`` draws the residuals. The gain of the power
    monitor cannot be told: it goes into energies and forces, and out of the force ratio.

    Parameters
    ----------
    data : mapping of arrays, table of a log, or log
        Arrays of one length: time (s), command_rate (mm/s, from that time on), size (radial stock removed,
        mm; NaN: no reading), grinding_power (W), and part if there are several. Or a log whose only table, or
        table "controller", holds them, or that table; the command is command_rate_command there. At the start
        of a part the wheel must be unloaded.
    what : str
        Quantity of the table.
    method : str, optional
        Method of the table.
    problem : CycleProblem, optional
        Problem whose model is corrected.
    part : int or sequence of int, optional
        Parts of the log, unit 1. Default: all, each with its own offset; the result is their mean.
    forgetting : float
        For "recursive" and "printed": weight of a reading relative to the next one, in (0, 1], unit 1.
    power_max : float, optional
        Greatest power of the monitor, W: readings near it are clipped and not used. Default: the greatest
        power of a part if it is read at least three times.
    throw : bool
        Raise if the readings do not identify the value.

    Returns
    -------
    Estimate
        Value with its variance; or the status "not identified" with its reason: a gauge that is frozen or
        jumps back, fewer than 10 readings of a moving size, clipped power only, a' of (4) outside (0, 1), a
        positive value below its standard deviation. Of a machine the status may be "does not fit".

    Raises
    ------
    ValueError, TypeError
        For missing or bad arguments; of a machine, for a column in another unit, with the call of
        `hwsim.Log.read` that converts it; with `throw`, for a value that is not identified.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(0.0, 6.4, 0.04)
    >>> size = 0.0448 * (time - 1.935 * (1 - np.exp(-time / 1.935)))
    >>> data = {"time": time, "command_rate": np.full(160, 0.0448), "size": size + 0.01}
    >>> print(round(identify(data, "time_constant")["time_constant"], 6))  # s
    1.935
    >>> identify({name: values[:5] for name, values in data.items()}, "time_constant").message
    'not identified: 2 readings of a moving size are too few: at least 10 are needed (0 are missing)'
    """
    methods = _METHODS[checks.one_of("what", what, _METHODS)]
    method = checks.one_of("method", methods[0] if method is None else method, methods)
    checks.share("forgetting", forgetting, "1")
    if power_max is not None:
        checks.positive("power_max", power_max, "W")
    if problem is not None or what != "time_constant":
        checks.kind("problem", problem, CycleProblem, f", whose model is corrected, for {what!r}")
    if problem is not None and method in ("recursive", "printed"):
        raise checks.refuse("problem", f"left out with method {method!r}, which has no model", problem)
    found = _with_units(_found(data, what, method, problem, part, float(forgetting), power_max), data, part)
    if throw and not found.ok:
        raise ValueError(found.message)
    return found


def _found(
    data: Any,
    what: str,
    method: str,
    problem: CycleProblem | None,
    part: int | Sequence[int] | None,
    forgetting: float,
    power_max: float | None,
) -> Estimate:
    if problem is not None and what in ("machine", "roundness", "B"):
        return _of_machine(data, what, problem, part, power_max)
    if what == "wear_flat_area" and problem is not None:
        each = cycles(data, power=True, size=False, part=part)
        return mean_of_parts(
            each, lambda cycle: _sharpness.wear_flat_area(cycle, problem, power_max), what, _sharpness.UNIT
        )
    each = cycles(data, part=part)
    if method == "recursive":
        return _time_constant.recursively(each, forgetting)
    if method == "printed":
        return _time_constant.as_printed(each, forgetting)
    if problem is None:
        return mean_of_parts(each, _time_constant.by_output_error, what, _time_constant.UNIT)
    one, unit = {
        "time_constant": (_contact.secant, "s"),
        "contact_zero": (_contact.contact_zero, "mm"),
        "normal_force_ratio": (_contact.normal_force_ratio, "1"),
    }[what]
    return mean_of_parts(each, lambda cycle: one(cycle, problem), what, unit)


def _with_units(found: Estimate, data: Any, part: int | Sequence[int] | None) -> Estimate:
    """Estimate; failed for another unit where sizes that say too little contradict the commands."""
    if found.ok or _time_constant.FAINT not in found.message:
        return found
    told = another_unit_told(cycles(data, part=part), data)
    return not_identified(found.names[0], found.units[0], told) if told else found


def _of_machine(
    data: Any, what: str, problem: CycleProblem, part: int | Sequence[int] | None, power_max: float | None
) -> Estimate:
    if what == "machine":
        return machine(data, problem, part, power_max)
    return roundness(data, problem, part) if what == "roundness" else not_identified(*_B)
