"""Load torque, in contact indistinguishable from the contact torque: from weight, or before touch-down."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.torque._axis import GRAVITY, TorqueAxis

_QUANTITIES = {"motor_angle": "rad", "current": "A"}
_LEAST = 8  # chosen: readings for three values and an estimate of their noise
_FREE = 1.75  # derived: rms of residuals over that of rounding; rounding alone gives at most sqrt(3)
# phases of the counts, and motions each way within a count; chosen: fewer miss the worst, more cost time
_PLACES, _NEAR = 64, 9


def gravity_torque(mass: float, centre_distance: float, angle: Any) -> Any:
    """Return the torque of a tool's weight about the motor's axis, m g d cos(angle), N m: part of the load.

    Not in the source. Its inertia would be that of 0.44 kg at 50 mm, more than its motor can hold: balance
    the tool. The rest changes with the pose; pass it to the controller as `load_torque`.

    Parameters
    ----------
    mass : float
        Mass of the tool, kg.
    centre_distance : float
        Distance from the motor's axis to the centre of mass, mm.
    angle : float or array
        Angle of the centre of mass above the horizontal plane through the horizontal axis, rad. For a tilted
        axis multiply by the cosine of its tilt.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> round(fin.torque.gravity_torque(0.44, 50.0, 0.0), 3)  # more than the motor's 0.185 N m
    0.216
    """
    checks.nonnegative("mass", mass, "kg")
    checks.nonnegative("centre_distance", centre_distance, "mm")
    lever = 1e-3 * centre_distance * np.cos(checks.finite_array("angle", angle, "rad"))
    return mass * GRAVITY * lever if np.ndim(angle) else float(mass * GRAVITY * lever)


def identify_load_torque(
    data: Any,
    axis: TorqueAxis,
    *,
    part: int | Sequence[int] | None = None,
    until: float | None = None,
    throw: bool = True,
) -> idf.Estimate:
    """Estimate the load torque T_L from motion before touch-down: least squares, J theta'' = k_t i - T_L.

    The motor's angle is a parabola plus the exact double integral of the current; readings are rounded to
    counts. In slow or even motion these errors are not independent: the covariance is the effect of rounding
    on this motion, over all phases of the counts, and larger where the fit is worse than rounding explains.

    Parameters
    ----------
    data : mapping of arrays, or log
        Arrays by name: time (s), motor_angle (rad; NaN: no reading), current (A, from that time on); or a log
        with a table "controller".
    axis : TorqueAxis
        Believed J and k_t: a relative error of J acts on T_L less the torque of the current, one of k_t on
        that torque.
    part : int or sequence of int, optional
        Parts of a log. Default: all, pooled by their variances.
    until : float, optional
        End of the free motion (touch-down), s.
    throw : bool
        Raise where the readings do not identify it; else the status says so.

    Returns
    -------
    Estimate
        ``load_torque`` (N m) with its variance; with ``throw=False`` also the status "not identified" with
        the reason: fewer than 8 readings, or a motion that is not free.

    Raises
    ------
    ValueError, TypeError
        Missing or bad data; with `throw`, the load torque is not identified.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> axis = fin.TorqueAxis()
    >>> time = np.arange(100) * axis.sample_time
    >>> angle = 0.5 * (0.185 * 0.05 - 0.02) / 0.0011 * time**2  # 50 mA against 20 mN m
    >>> shown = np.round(angle / axis.angle_step) * axis.angle_step
    >>> data = {"time": time, "motor_angle": shown, "current": np.full(100, 0.05)}
    >>> found = fin.identify(data, "load_torque", axis=axis)
    >>> round(found["load_torque"], 4), bool(found.sd[0] < 1e-4)  # N m
    (0.02, True)
    """
    checks.kind("axis", axis, TorqueAxis)
    each = idf.series(data, _QUANTITIES, tier="controller", commands=("current",), part=part)
    end = np.inf if until is None else checks.positive("until", until, "s")
    found = [_of_part(one, axis, end) for one in each]
    good = [one for one in found if one.ok]
    result = _pooled(good) if good else found[0] if found else _not_identified("there is no part")
    if throw and not result.ok:
        raise ValueError(result.message)
    return result


def _of_part(one: idf.Series, axis: TorqueAxis, end: float) -> idf.Estimate:
    rows = one.time < end
    time, shown = one.time[rows], one["motor_angle"][rows]
    read = np.isfinite(shown)
    if read.sum() < _LEAST:
        return _not_identified(
            f"{read.sum()} readings of the angle are too few: at least {_LEAST} are needed"
        )
    time, driven = (time - time[0])[read], _driven(time, one["current"][rows], axis)[read]
    shown = shown[read]
    matrix = np.stack([np.ones_like(time), time, -0.5 * time**2 / axis.inertia], axis=1)
    rounding = axis.angle_step / np.sqrt(12.0)
    fit = idf.least_squares(matrix, shown - driven, noise_sd=rounding, throw=False)
    rms = float(np.sqrt(np.mean((shown - driven - matrix @ fit.value) ** 2)))
    if not fit.ok:
        return _not_identified("the readings are all at one time")
    worst = float(np.abs(shown - driven - matrix @ fit.value).max())
    if rms > _FREE * rounding or worst > axis.angle_step:
        told = f"readings are off by {rms:.2g} rad, rounding explains {rounding:.2g}"
        return _not_identified(
            f"the motion is not free ({told}): end it before touch-down, or look at the current"
        )
    variance = _variance(matrix, driven + matrix @ fit.value, axis) * max(1.0, (rms / rounding) ** 2)
    return _estimate(float(fit.value[2]), max(variance, float(fit.covariance[2, 2])), "from free motion")


def _driven(time: Floats, current: Floats, axis: TorqueAxis) -> Floats:
    """Angle due to the current alone, rad; the current is constant between times."""
    step, gain = np.diff(time), axis.torque_constant / axis.inertia * current[:-1]
    speed = np.concatenate([[0.0], np.cumsum(gain * step)])
    return np.concatenate([[0.0], np.cumsum(speed[:-1] * step + 0.5 * gain * step**2)])


def _variance(matrix: Floats, angle: Floats, axis: TorqueAxis) -> float:
    """Variance of the estimate; rounding is far from random in even motion.

    The mean over all phases of the counts, for the worst motion within a count of the fitted one, since no
    readings separate those.
    """
    share = np.linspace(0.0, 1.0, angle.size)
    weights = np.linalg.pinv(matrix)[2]
    begin = ((np.arange(_PLACES) + 0.5) / _PLACES)[:, np.newaxis]
    found = 0.0
    for turned in np.linspace(-1.0, 1.0, _NEAR):
        for bent in np.linspace(-1.0, 1.0, _NEAR):
            places = angle / axis.angle_step + begin + turned * share + bent * 4 * share * (1 - share)
            rounding = (np.rint(places) - places) * axis.angle_step
            found = max(found, float(np.mean((rounding @ weights) ** 2)))
    return found


def _estimate(value: float, variance: float, message: str) -> idf.Estimate:
    return idf.Estimate(
        ("load_torque",), np.array([value]), np.array([[variance]]), message=message, units=("N m",)
    )


def _not_identified(reason: str) -> idf.Estimate:
    status = idf.Status.NOT_IDENTIFIED
    unknown = np.zeros(1), np.full((1, 1), np.inf)
    return idf.Estimate(("load_torque",), *unknown, status, f"{status}: {reason}", ("N m",))


def _pooled(each: list[idf.Estimate]) -> idf.Estimate:
    """Mean by inverse variances, with at least the scatter of the parts."""
    if len(each) == 1:
        return each[0]
    values = np.array([one.value[0] for one in each])
    weights = np.array([1 / one.covariance[0, 0] for one in each])
    mean = float(weights @ values / weights.sum())
    scatter = float(weights @ (values - mean) ** 2) / (len(each) - 1)
    return _estimate(mean, max(scatter, 1.0) / float(weights.sum()), f"from free motion of {len(each)} parts")
