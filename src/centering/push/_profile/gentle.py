"""Pushes that leave the part where the tip stops, and taps that move a heavy part by a few µm."""

from math import pi, sqrt

import numpy as np

from centering._problem.model import GRAVITY, PushModel
from centering.push._profile.profile import TipProfile
from centering.push._profile.row_kernels import ROWS, gentle_rows
from centering.push._profile.rows import retraction
from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import trusted

# chosen: closing over F_s/k at which a gentle push speeds up: friction may be 12 % above the model
_OVERLOAD = 1.12
_GAIN, _BRAKE = 0.5, 0.7  # chosen: accelerations over mu_k g; beyond 1 a braked part leaves the tip


def gentle_profile(
    model: PushModel,
    distance: float,
    speed: float,
    *,
    acceleration_max: float = 2560.0,
    whole_periods: bool = False,
) -> TipProfile:
    """Return a push that leaves the part near the stop of the tip: slow breakaway, soft stop, retraction.

    The tip moves at 1 mm/s until the contact has closed by 1.12 F_s/k, accelerates at 0.5 mu_k g and stops at
    0.7 mu_k g; a stop above mu_k g throws the part off. A part of 0.8 kg stays on the tip. A heavy part
    swings on the contact after each change of acceleration and may leave the tip meanwhile: 18.9 kg of the
    printed preset by up to 0.006 mm at 10 mm/s, 0.08 at 20, 0.29 at 40. With `whole_periods` it stays, where
    the distance allows them. The profile begins at first touch and ends 0.5 mm before the furthest point.

    Parameters
    ----------
    model : PushModel
        Model of part and contact.
    distance, speed : float
        Travel of the tip after first touch, mm, where the part stops to some µm; greatest speed, mm/s.
    acceleration_max : float
        Greatest acceleration of the slide, mm/s^2; the tip retracts with it.
    whole_periods : bool
        Stretch both ramps to whole periods of the part on the contact, so that it does not swing after them.
        The push is slower, but friction shifts the stop of the part by the closing F_k/k only.

    Raises
    ------
    ValueError
        When distance, speed or acceleration is not > 0.

    Examples
    --------
    >>> from centering import preset, simulate_push
    >>> model = preset("printed").model
    >>> trace = simulate_push(model, gentle_profile(model, 5.0, 40.0))  # mm, mm/s
    >>> round(1000 * (trace.final_position - 5.0), 1), round(trace.peak_force, 1)  # µm, N
    (-1.0, 48.6)
    """
    checks.kind("model", model, PushModel)
    d, v = checks.positive("distance", distance, "mm"), checks.positive("speed", speed, "mm/s")
    most = checks.positive("acceleration_max", acceleration_max, "mm/s^2")
    return profile_of(gentle_push(model, d, v, most, _period(model) if whole_periods else 0.0))


def gentle_push(model: PushModel, distance: float, speed: float, most: float, period: float = 0.0) -> Floats:
    """Rows of `gentle_profile`, without its checks: duration (s), velocity (mm/s), acceleration (mm/s^2)."""
    out = np.empty((ROWS, 3))
    return _whole_rows(out[: gentle_rows(distance, speed, *gentle_limits(model, most), period, most, out)])


def gentle_limits(model: PushModel, acceleration_max: float) -> tuple[float, float, float]:
    """Closing up to which a gentle push stays slow (mm), accelerations of start and stop (mm/s^2)."""
    limit = model.mu_kinetic * GRAVITY
    closing = _OVERLOAD * model.breakaway_force / model.contact_stiffness
    return closing, min(_GAIN * limit, acceleration_max), min(_BRAKE * limit, acceleration_max)


def tap_profile(distance: float, speed: float, *, acceleration_max: float = 2560.0) -> TipProfile:
    """Return a push at constant speed from first touch that stops and retracts at full acceleration.

    The finest push of a heavy part: the tip already recedes when the part breaks away, so that the smallest
    travel is an eighth of 2 (F_s - F_k)/k, and the travel grows steadily with `distance`. Below 0.3 mm, 2 to
    5 mm/s is best: slower taps jump as slow pushes do, faster ones throw the part by a distance that depends
    on friction. The profile begins at first touch and ends 0.5 mm before the furthest point.

    Parameters
    ----------
    distance, speed : float
        Of the tip after first touch, mm, mm/s; a tap shorter than its stop begins at a lower speed.
    acceleration_max : float
        Greatest acceleration of the slide, mm/s^2.

    Raises
    ------
    ValueError
        When distance, speed or acceleration is not > 0.

    Examples
    --------
    >>> from centering import preset, simulate_push
    >>> model = preset("printed").model  # 18.9 kg: 2 (F_s - F_k)/k is 15.4 µm
    >>> taps = [simulate_push(model, tap_profile(stroke, 5.0)) for stroke in (0.03, 0.031, 0.04)]  # mm, mm/s
    >>> [round(1000 * tap.final_position, 1) for tap in taps]  # µm
    [0.0, 3.7, 15.8]
    """
    d, v = checks.positive("distance", distance, "mm"), checks.positive("speed", speed, "mm/s")
    most = checks.positive("acceleration_max", acceleration_max, "mm/s^2")
    return profile_of(tap(d, v, most))


def tap(distance: float, speed: float, most: float) -> Floats:
    """Rows of `tap_profile`, without its checks: duration (s), velocity (mm/s), acceleration (mm/s^2)."""
    top = min(speed, sqrt(2.0 * most * distance))
    cruise = (distance - top * top / (2.0 * most)) / top
    return _whole_rows(np.array([(cruise, top, 0.0), (top / most, top, -most), *retraction(most).tolist()]))


def _period(model: PushModel) -> float:
    """Period of the part on the contact, s; 0 where it is overdamped."""
    alpha = 0.5 * (model.contact_damping + model.viscous_coefficient) / model.inertia
    square = model.contact_stiffness / model.inertia - alpha * alpha
    return 2.0 * pi / sqrt(square) if square > 0.0 else 0.0


def _whole_rows(rows: Floats) -> Floats:
    """Rows of positive duration."""
    return np.asarray(rows[rows[:, 0] > 1e-12 * sum(rows[:, 0].tolist())])


def profile_of(rows: Floats) -> TipProfile:
    """Return the profile of rows whose numbers are checked."""
    duration, velocity, acceleration = map(lasting, rows.T)
    return trusted(TipProfile, duration=duration, velocity=velocity, acceleration=acceleration)
