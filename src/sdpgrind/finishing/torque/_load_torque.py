"""Load torque, in contact indistinguishable from the contact torque: from weight, or before touch-down."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks, means, serial
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.torque._axis import GRAVITY, TorqueAxis

_QUANTITIES = {"motor_angle": "rad", "current": "A"}
_LEAST = 8  # chosen: readings for three values and an estimate of their noise
_FREE = 1.75  # derived: rms of residuals over that of rounding; rounding alone gives at most sqrt(3)
# phases of the counts, and motions each way within a count; chosen: fewer miss the worst, more cost time
_PLACES, _NEAR = 64, 9
# chosen: correlation of readings that noise stays below; the tool in contact gives 0.957 to 0.98
_SMOOTH = 0.95
_SIGMAS = 4.5  # chosen: rejects one good Gaussian reading in 150 000
_COMPONENTS = 4  # measured: polynomials that tell the noise; 8 hold 92 % at a correlation of 0.8, 3 tell less
_BEAT = 2.0  # chosen: variance over that of random rounding from which a beat of the counts is feared


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
    part: int | str | Sequence[int | str] | None = None,
    until: float | None = None,
    throw: bool = True,
) -> idf.Estimate:
    """Estimate the load torque T_L from motion before touch-down: least squares, J theta'' = k_t i - T_L.

    The motor's angle is a parabola plus the exact double integral of the current. The polynomials of third to
    sixth degree in the residuals tell the noise at the parabola's frequencies, white or of filters, with four
    degrees of freedom a part. In slow or even motion rounding to counts is not independent from reading to
    reading: there the variance is its effect on the worst motion that the readings allow, over all phases of
    the counts.

    Parameters
    ----------
    data : mapping of arrays, table of a log, or log
        Arrays by name: time (s), motor_angle (rad; NaN: no reading), current (A, from that time on); or a log
        whose only table, or table "controller", holds them, or that table.
    axis : TorqueAxis
        Believed J and k_t: a relative error of J acts on T_L less the torque of the current, one of k_t on
        that torque.
    part : int, str or sequence of them, optional
        Parts of a log: numbers (unit 1), or words of the file. Default: all, pooled by their variances.
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
    good = [one for one in found if isinstance(one, _Motion)]
    reasons = [one for one in found if isinstance(one, str)]
    result = _pooled(good) if good else _not_identified((reasons or ["there is no part"])[0])
    if throw and not result.ok:
        raise ValueError(result.message)
    return result


class _Motion(NamedTuple):
    """Load torque of a part, N m.

    Its variance for white noise of 1 rad, the variance of the noise (rad^2), and the freedom of that.
    """

    load: float
    gain: float
    noise: float
    freedom: float


def _of_part(one: idf.Series, axis: TorqueAxis, end: float) -> _Motion | str:
    """Load torque of a part, or the reason why it tells none."""
    rows = one.time < end
    time, shown = one.time[rows], one["motor_angle"][rows]
    read = np.isfinite(shown)
    if read.sum() < _LEAST:
        return f"{read.sum()} readings of the angle are too few: at least {_LEAST} are needed"
    time, driven = (time - time[0])[read], driven_angle(time, one["current"][rows], axis)[read]
    if np.ptp(time) == 0:
        return "the readings are all at one time"
    matrix = np.stack([np.ones_like(time), time, -0.5 * time**2 / axis.inertia], axis=1)
    inverse, goal = np.linalg.pinv(matrix), shown[read] - driven
    values = inverse @ goal
    left = goal - matrix @ values
    if reason := _not_free(time, left, axis.angle_step):
        return reason
    weights, gain = inverse[2], float(inverse[2] @ inverse[2])
    noise = _noise(time, left, weights)
    beat = _beat(weights, shown[read] - left, left, axis.angle_step) / gain
    if beat > max(noise, _BEAT * axis.angle_step**2 / 12):
        return _Motion(float(values[2]), gain, beat, np.inf)
    return _Motion(float(values[2]), gain, noise, float(_COMPONENTS))


def _not_free(time: Floats, left: Floats, count: float) -> str:
    """Reason why residuals are no noise: too smooth for their size, or one far off; empty: they are."""
    rounding, rms = count / np.sqrt(12.0), float(np.sqrt(np.mean(left**2)))
    rho = serial.correlation(left, 3, serial.gaps(time, time.size))
    smooth = rho > _SMOOTH or serial.effective(left.size, 3, rho) <= 1
    if not (smooth and rms > _FREE * rounding) and np.abs(left).max() <= max(count, _SIGMAS * rms):
        return ""
    told = f"readings are off by {rms:.2g} rad, rounding explains {rounding:.2g}"
    return f"the motion is not free ({told}): end it before touch-down, or look at the current and the axis"


def _noise(time: Floats, left: Floats, weights: Floats) -> float:
    """Variance of white noise with the effect on the load torque that the noise of these residuals has.

    Noise of filters is greatest at low frequencies, where the parabola is. The polynomials next to it tell
    it: the ratio of their variances to that of the load torque is that of first-order noise.
    """
    apart = serial.gaps(time, time.size)
    rho = serial.correlation(left, 3, apart)
    powers = np.polynomial.legendre.legvander(2 * (time - time[0]) / np.ptp(time) - 1, 2 + _COMPONENTS)
    near = np.linalg.qr(powers)[0][:, 3:]
    each = np.array([serial.variance(one, rho, apart) for one in near.T])
    ratio = serial.variance(weights, rho, apart) / float(weights @ weights)
    return ratio * float(np.mean((left @ near) ** 2 / each))


def driven_angle(time: Floats, current: Floats, axis: TorqueAxis) -> Floats:
    """Angle due to the current alone, rad; the current is constant between times."""
    step, gain = np.diff(time), axis.torque_constant / axis.inertia * current[:-1]
    speed = np.concatenate([[0.0], np.cumsum(gain * step)])
    return np.concatenate([[0.0], np.cumsum(speed[:-1] * step + 0.5 * gain * step**2)])


def _beat(weights: Floats, angle: Floats, left: Floats, count: float) -> float:
    """Variance of the load torque by rounding, which is far from random in even motion.

    The mean over all phases of the counts, for the worst motion within a count of the fitted one that the
    readings allow: from which they deviate by no wider a range than a count, or than from the fitted one.
    """
    wide = max(count, float(np.ptp(left)))
    share = np.linspace(0.0, 1.0, angle.size)
    begin = ((np.arange(_PLACES) + 0.5) / _PLACES)[:, np.newaxis]
    found = 0.0
    for turned in np.linspace(-1.0, 1.0, _NEAR):
        for bent in np.linspace(-1.0, 1.0, _NEAR):
            moved = turned * share + bent * 4 * share * (1 - share)
            if np.ptp(left - moved * count) > wide * (1 + 1e-9):
                continue
            places = angle / count + begin + moved
            rounding = (np.rint(places) - places) * count
            found = max(found, float(np.mean((rounding @ weights) ** 2)))
    return found


def _not_identified(reason: str) -> idf.Estimate:
    status = idf.Status.NOT_IDENTIFIED
    unknown = np.zeros(1), np.full((1, 1), np.inf)
    return idf.Estimate(("load_torque",), *unknown, status, f"{status}: {reason}", ("N m",))


def _pooled(each: list[_Motion]) -> idf.Estimate:
    """Mean of parts with one noise by least squares, with at least the scatter of the parts."""
    load, gain, noise, freedom = (np.array(column) for column in zip(*each, strict=True))
    level = float(np.average(noise, weights=np.minimum(freedom, 1e9)))
    mean, variance, free = means.pooled(load, level * gain, float(freedom.sum()))
    told = "from free motion" + f" of {len(each)} parts" * (len(each) > 1)
    covariance = np.full((1, 1), variance)
    return idf.Estimate(
        ("load_torque",), np.array([mean]), covariance, message=told, units=("N m",), freedom=free
    )
