"""Pushes that leave the part where the tip stops, and taps that move a heavy part by a few µm."""

from math import pi, sqrt

import numpy as np

from centering._problem.model import GRAVITY, PushModel
from centering.push._profile.profile import TipProfile
from centering.push._profile.row_kernels import ROWS, gentle_rows
from sdpgrind.base import checks

_OVERLOAD = (
    1.12  # closing of the contact over F_s/k until which it stays slow: friction may be higher than believed
)
_GAIN, _BRAKE = (
    0.5,
    0.7,
)  # accelerations over mu_k g: the contact stays closed while the part is braked by friction
_CLEAR = 0.5  # chosen: mm that the tip is drawn back by

Row = tuple[float, float, float]


def gentle_profile(
    model: PushModel,
    distance: float,
    speed: float,
    *,
    acceleration_max: float = 2560.0,
    whole_periods: bool = False,
) -> TipProfile:
    """Return a push after which the part rests near the tip's stop: slow until it breaks away, stopped below mu_k g, drawn back.

    The tip moves at 1 mm/s until the contact has closed by 1.12 F_s/k, gains speed at 0.5 mu_k g and stops at 0.7 mu_k g. A slide
    that stops harder than mu_k g throws the part off. A part of 0.8 kg stays on the tip. A heavy one swings on the contact after
    each change of acceleration, and may leave the tip for a moment while that gains speed or brakes: 18.9 kg of the printed
    preset by up to 0.006 mm at 10 mm/s, 0.08 at 20, 0.29 at 40. In whole periods it stays, where there is room for them.

    Parameters
    ----------
    model : PushModel
        What is pushed.
    distance : float
        How far the tip goes after first touch, mm; the part comes to rest within some µm of that.
    speed : float
        Greatest speed of the tip, mm/s; a short push does not reach it.
    acceleration_max : float
        Of the slide, mm/s^2: no acceleration is above it, and the tip is drawn back with it.
    whole_periods : bool
        Stretch both ramps to whole periods of the part on the contact, so that it does not swing after them. The push is slower,
        but where the part stops depends on friction only by what the contact stays closed by, F_k/k.

    Returns
    -------
    TipProfile
        From first touch on; it ends 0.5 mm before the furthest point.

    Raises
    ------
    ValueError
        When distance, speed or acceleration are not > 0.

    Examples
    --------
    >>> from centering import preset, simulate_push
    >>> model = preset("printed").model
    >>> trace = simulate_push(model, gentle_profile(model, 5.0, 40.0))  # mm, mm/s
    >>> round(1000 * (trace.final_position - 5.0), 1), round(trace.peak_force, 1)  # µm, N; at constant speed 277 µm, 192 N
    (-1.0, 48.6)
    """
    checks.kind("model", model, PushModel)
    d, v = checks.positive("distance", distance, "mm"), checks.positive("speed", speed, "mm/s")
    most = checks.positive("acceleration_max", acceleration_max, "mm/s^2")
    period, out = _period(model) if whole_periods else 0.0, np.empty((ROWS, 3))
    count = gentle_rows(d, v, *gentle_limits(model, most), period, most, out)
    return _profile(out[:count].tolist())


def gentle_limits(model: PushModel, acceleration_max: float) -> tuple[float, float, float]:
    """Closing of the contact until which a gentle push stays slow (mm), and how fast it gains speed and stops (mm/s^2)."""
    limit = model.mu_kinetic * GRAVITY
    closing = _OVERLOAD * model.breakaway_force / model.contact_stiffness
    return closing, min(_GAIN * limit, acceleration_max), min(_BRAKE * limit, acceleration_max)


def tap_profile(distance: float, speed: float, *, acceleration_max: float = 2560.0) -> TipProfile:
    """Return a push at constant speed from first touch that stops at full deceleration and is drawn back at once with the same.

    The finest push of a heavy part: the tip is already leaving when the part gives way, so that the smallest move is an eighth of
    2 (F_s - F_k)/k, and the travel grows steadily with `distance`. 2 to 5 mm/s is best below 0.3 mm: slower, jumps come back;
    faster, the part is thrown further, and that depends on friction.

    Parameters
    ----------
    distance : float
        How far the tip goes after first touch, mm.
    speed : float
        Of the tip, mm/s; a tap shorter than its stop begins at the speed from which it stops in time.
    acceleration_max : float
        Of the slide, mm/s^2.

    Returns
    -------
    TipProfile
        From first touch on; it ends 0.5 mm before the furthest point.

    Raises
    ------
    ValueError
        When distance, speed or acceleration are not > 0.

    Examples
    --------
    >>> from centering import preset, simulate_push
    >>> model = preset("printed").model  # 18.9 kg: 2 (F_s - F_k)/k is 15.4 µm
    >>> [round(1000 * simulate_push(model, tap_profile(stroke, 5.0)).final_position, 1) for stroke in (0.03, 0.031, 0.04)]  # µm
    [0.0, 3.7, 15.8]
    """
    d, v = checks.positive("distance", distance, "mm"), checks.positive("speed", speed, "mm/s")
    most = checks.positive("acceleration_max", acceleration_max, "mm/s^2")
    top = min(v, sqrt(2.0 * most * d))
    cruise = (d - top * top / (2.0 * most)) / top
    return _profile([(cruise, top, 0.0), (top / most, top, -most), *_drawn_back(most)])


def _period(model: PushModel) -> float:
    """Period of the part on the contact, s; 0 where it does not swing."""
    alpha = 0.5 * (model.contact_damping + model.viscous_coefficient) / model.inertia
    square = model.contact_stiffness / model.inertia - alpha * alpha
    return 2.0 * pi / sqrt(square) if square > 0.0 else 0.0


def _drawn_back(acceleration: float) -> list[Row]:
    """Away from the part, from rest to rest."""
    half = sqrt(_CLEAR / acceleration)
    return [(half, 0.0, -acceleration), (half, -acceleration * half, acceleration)]


def _profile(rows: list[Row]) -> TipProfile:
    """The rows that have a length."""
    least = 1e-12 * sum(t for t, _, _ in rows)
    return TipProfile(*np.array([row for row in rows if row[0] > least]).T)
