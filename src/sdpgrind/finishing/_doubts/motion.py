"""Load torque and alignment of the current, from free motion of the torque axis."""

from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.commands import ALIGNMENTS, read_as
from sdpgrind.base.doubts.alignment import Alignment, alignment_sentence, preferred
from sdpgrind.base.doubts.rows import Doubt, compared
from sdpgrind.base.doubts.words import significant
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._load_torque import driven_angle, identify_load_torque

_OTHERS = "; of another: problem.doubts(log, axis=finishing.TorqueAxis(inertia=..., torque_constant=...))"
_UNITS = {"motor_angle": "rad", "current": "A"}
_FITTED = 3  # derived: angle, speed and load torque
_FACTOR = 3.0  # chosen: friction, which the motion holds too, makes less; the least wrong unit makes 57
_LEAST = 8  # chosen: readings for four values and an estimate of their noise
_SURE = 3.0  # chosen: standard errors; 1 of 400 right files is named by chance


def of_motion(
    problem: FinishingProblem, data: Any, commands_at: str, given: TorqueAxis | None
) -> tuple[Doubt, Alignment | None, list[str]]:
    """Row of the load torque (believed: none), alignment of the current, sentences.

    `given`: the axis; None: that of the source.
    """
    axis = TorqueAxis(lever_arm=problem.lever_arm) if given is None else given
    whose, others = ("axis of the source", _OTHERS) if given is None else ("given axis", "")
    estimate = identify_load_torque(data, axis, throw=False)
    held = axis.torque_constant * axis.current_limit  # by the motor: a load has either sign, and may be 0
    note = f"with inertia and torque constant of the {whose}"
    row = compared(estimate, "load_torque", 0.0, scale=held, note=note)
    words = [
        f"The load torque rests on the {whose}: inertia {axis.inertia:g} kg m^2, torque constant"
        f" {axis.torque_constant:g} N m/A{others}."
    ]
    each = idf.series(data, _UNITS, tier="controller", commands=("current",))
    words += _against_the_current(each, axis)
    if not estimate.ok:
        return row, None, [*words, "Free motion of the axis before touch-down would tell the load torque."]
    found, torques = _aligned(each, axis, commands_at)
    return row, found, [*words, alignment_sentence(found, commands_at, "load_torque", torques, "N m")]


def _against_the_current(each: tuple[idf.Series, ...], axis: TorqueAxis) -> list[str]:
    """Sentence on angles that do not move as the current drives them, by the median over the parts."""
    gains = [gain for one in each if np.isfinite(gain := _gain(one, axis))]
    if not gains or 1 / _FACTOR <= (gain := float(np.median(gains))) <= _FACTOR:
        return []
    return [
        f"motor_angle moves {significant(gain)} times as far as torque_constant x current / inertia says:"
        " a unit, or a constant of the axis, is wrong."
    ]


def _gain(one: idf.Series, axis: TorqueAxis) -> float:
    """Motion driven by the current, as read over as computed; NaN: its noise hides a difference from 1."""
    read = np.isfinite(one["motor_angle"])
    time = (one.time - one.time[0])[read]
    driven = driven_angle(one.time, one["current"], axis)[read]
    if time.size < _LEAST:
        return float("nan")
    fit = idf.least_squares(
        np.stack([np.ones_like(time), time, time**2, driven], axis=1), one["motor_angle"][read], throw=False
    )
    gain, sd = float(fit.value[-1]), float(fit.sd[-1])
    return gain if fit.ok and abs(gain - 1) > _SURE * sd else float("nan")


def _aligned(
    each: tuple[idf.Series, ...], axis: TorqueAxis, commands_at: str
) -> tuple[Alignment, dict[str, float]]:
    """Alignment that the angles prefer, and the mean load torque (N m) with each."""
    given = {
        way: [_fit(one, axis, read_as(one["current"], commands_at, way)) for one in each]
        for way in ALIGNMENTS
    }
    best = min(given.values(), key=lambda fits: sum(float(left @ left) for _, left, _ in fits))
    rho = float(np.mean([serial.correlation(left, _FITTED, apart) for _, left, apart in best]))
    squares = {
        way: sum(float(np.sum(serial.filtered(left, rho, apart) ** 2)) for _, left, apart in fits)
        for way, fits in given.items()
    }
    count = sum(left.size for _, left, _ in best)
    return preferred(squares, count), {
        way: float(np.mean([fit[0] for fit in fits])) for way, fits in given.items()
    }


def _fit(one: idf.Series, axis: TorqueAxis, current: Floats) -> tuple[float, Floats, Floats]:
    """Load torque (N m) of a part, residuals (rad) and their distances."""
    read = np.isfinite(one["motor_angle"])
    time = (one.time - one.time[0])[read]
    matrix = np.stack([np.ones_like(time), time, -0.5 * time**2 / axis.inertia], axis=1)
    target = (one["motor_angle"] - driven_angle(one.time, current, axis))[read]
    value, *_ = np.linalg.lstsq(matrix, target, rcond=None)
    return float(value[2]), target - matrix @ value, serial.gaps(time, time.size)
