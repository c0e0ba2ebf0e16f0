"""Phases of a push: duration, next mode, peak force (Mears 5.26-5.27, with a contact that never pulls)."""

import numpy as np

from centering.push._contact.energy_kernels import _flight_energies, _swing_energies
from centering.push._contact.swing_kernels import (
    _first_negative,
    _flight,
    _gap_at,
    _later_flight,
    _later_swing,
    _swing,
    _swing_bound,
    _swing_change,
)
from sdpgrind.base.compiling.compiled import compiled

REST, STICK, SLIP, FREE = range(4)
"""Modes: apart and at rest; touching and at rest; touching and moving; moving without contact."""
_SETTLED = 40.0  # derived: time constants after which an overdamped part rests at a resting tip, to rounding
_SPARE_TURNS = 4  # chosen: allowance for stationary points of the force beyond one per half period


@compiled
def _mode_of(law, gap, closing, speed, acceleration):
    """Mode of a state: gap (mm), its rate (mm/s), speed of part (mm/s), acceleration of tip (mm/s^2)."""
    mass, k, b, static, coulomb, viscous = law
    force = k * gap + b * closing
    change = acceleration + ((coulomb + viscous * speed) / mass if speed > 0.0 else 0.0)
    rise = k * closing + b * change  # of the force, where there is none yet
    if gap > 0.0:
        touching = force > 0.0 or (force == 0.0 and rise > 0.0)
    else:
        touching = gap == 0.0 and (closing > 0.0 or (closing == 0.0 and change > 0.0))
    if speed > 0.0:
        return SLIP if touching else FREE
    if not touching:
        return REST
    breaks = force > static or (force == static and k * closing + b * acceleration > 0.0)
    return SLIP if breaks else STICK


@compiled
def _horizon(law, mode, gap, tip_speed, speed):
    """Time (s) in which the motion ends while the tip keeps its speed (mm/s, <= 0); 0: the part rests."""
    if mode in (REST, STICK):
        return 0.0  # a tip that recedes only clears the spring
    if mode == FREE:
        return 2.0 * _stop(law, speed)
    motion = _swing(gap, tip_speed - speed, tip_speed, 0.0, law)
    return 2.0 * np.pi / motion[7] if motion[7] > 0.0 else _SETTLED / motion[8]


@compiled
def _phase(law, mode, gap, tip_speed, acceleration, speed, left, peak):
    """Duration of a phase (s, at most `left`), next mode, gap and speed at its end, peak force."""
    if mode == SLIP:
        return _slip(law, gap, tip_speed, acceleration, speed, left, peak)
    if mode == STICK:
        return _stick(law, gap, tip_speed, acceleration, left)
    if mode == FREE:
        return _free(law, gap, tip_speed, acceleration, speed, left)
    return _rest(law, gap, tip_speed, acceleration, left)


@compiled
def _rest(law, gap, tip_speed, acceleration, left):
    """Apart, at rest: until the tip touches, or comes back before the spring has relaxed."""
    motion = _flight(gap, tip_speed, 0.0, acceleration, 0.0, 0.0)
    taken, touched = _contact(law, motion, left)
    if taken == np.inf:
        return left, REST, _gap_at(left, motion)[0], 0.0, 0.0
    force = law[1] * touched + law[2] * (tip_speed + acceleration * taken)
    return taken, SLIP if force > law[3] else STICK, touched, 0.0, max(force, 0.0)


@compiled
def _stick(law, gap, tip_speed, acceleration, left):
    """Touching, at rest: until the force reaches the breakaway force or falls to 0."""
    _, k, b, static, _, _ = law
    motion = _flight(gap, tip_speed, 0.0, acceleration, 0.0, 0.0)
    force, rise = k * gap + b * tip_speed, k * tip_speed + b * acceleration
    breaks = _first_negative(motion, -k, -b, static, 0.0, max(static - force, 0.0), -rise, left)
    clears = _first_negative(motion, k, b, 0.0, 0.0, force, rise, min(left, breaks))
    taken = min(breaks, clears, left)
    after = SLIP if breaks < clears else REST
    gap_after, closing, _ = _gap_at(taken, motion)
    peak = static if breaks <= taken else max(force, k * gap_after + b * closing)
    turn = -rise / (k * acceleration) if acceleration < 0.0 else -1.0
    if 0.0 < turn < taken:
        gap_turn, closing, _ = _gap_at(turn, motion)
        peak = max(peak, k * gap_turn + b * closing)
    return taken, after, gap_after, 0.0, peak


@compiled
def _free(law, gap, tip_speed, acceleration, speed, left):
    """Moving without contact: until the part touches again or rests."""
    mass, _, b, _, coulomb, viscous = law
    stop = _stop(law, speed)
    motion = _flight(gap, tip_speed - speed, speed, acceleration, coulomb / mass, viscous / mass)
    taken, touched = _contact(law, motion, min(left, stop))
    if taken < np.inf:
        _, closing, _ = _gap_at(taken, motion)
        force = law[1] * touched + b * closing
        return taken, SLIP, touched, max(tip_speed + acceleration * taken - closing, 0.0), max(force, 0.0)
    taken = min(left, stop)
    gap_after, closing, _ = _gap_at(taken, motion)
    speed_after = max(tip_speed + acceleration * taken - closing, 0.0) if taken < stop else 0.0
    return taken, REST, gap_after, speed_after, 0.0


@compiled
def _stop(law, speed):
    """Time (s) in which friction alone stops a part of a speed (mm/s)."""
    mass, _, _, _, coulomb, viscous = law
    share = viscous * speed / coulomb
    return mass * speed / coulomb * (np.log1p(share) / share if share > 0.0 else 1.0)


@compiled
def _contact(law, motion, end):
    """First time (s, at most `end`) at which gap and force are positive, else infinite; the gap then (mm)."""
    k, b = law[1], law[2]
    gap, rate, change = _gap_at(0.0, motion)
    begun = 0.0
    if gap >= 0.0 and b > 0.0:
        force, rise = k * gap + b * rate, k * rate + b * change
        begun = _first_negative(motion, -k, -b, 0.0, 0.0, max(-force, 0.0), -rise, end)
        if begun == np.inf:
            return np.inf, 0.0
        gap, rate, change = _gap_at(begun, motion)
        if gap >= 0.0:
            return begun, gap
        later = _touch(_later_flight(motion, begun), gap, rate, end - begun)
        return begun + later, 0.0
    return _touch(motion, gap, rate, end), 0.0


@compiled
def _touch(motion, gap, rate, end):
    """First time (s, at most `end`) at which a gap <= 0 turns positive."""
    return _first_negative(motion, -1.0, 0.0, 0.0, 0.0, max(-gap, 0.0), -rate, end)


@compiled
def _slip(law, gap, tip_speed, acceleration, speed, left, peak):
    """Touching, moving: until the part stops or leaves the tip."""
    mass, k, b, _, coulomb, viscous = law
    closing = tip_speed - speed
    force = k * gap + b * closing
    gained = (force - coulomb - viscous * speed) / mass
    rise = k * closing + b * (acceleration - gained)
    motion = _swing(gap, closing, tip_speed, acceleration, law)
    if speed == 0.0:
        gained = max(gained, 0.0)  # it has just broken away
    stops = _first_negative(motion, 0.0, -1.0, tip_speed, acceleration, speed, gained, left)
    leaves = _first_negative(motion, k, b, 0.0, 0.0, max(force, 0.0), rise, min(left, stops))
    taken = min(stops, leaves, left)
    gap_after, closing_after, _ = _gap_at(taken, motion)
    speed_after = max(tip_speed + acceleration * taken - closing_after, 0.0)
    force_after = k * gap_after + b * closing_after
    greatest = _greatest_force(law, motion, rise, taken, max(peak, force, force_after))
    if leaves < stops:
        return taken, FREE, gap_after, speed_after, greatest
    return (
        taken,
        STICK if force_after > 0.0 else REST,
        gap_after,
        0.0 if stops <= taken else speed_after,
        greatest,
    )


@compiled
def _greatest_force(law, motion, rise, left, peak):
    """Greatest force (N) of a swing over a time (s), at least `peak`; exact at its stationary points."""
    k, b = law[1], law[2]
    sign = 1.0 if rise > 0.0 else -1.0
    _, second, third = _gap_at(0.0, _swing_change(motion))
    slope = sign * (k * second + b * third)
    for _ in range(_SPARE_TURNS + int(max(motion[7], 0.0) * left / np.pi)):
        if _swing_bound(motion, k, b, left) <= peak:
            break
        turn = _first_negative(
            _swing_change(motion), sign * k, sign * b, 0.0, 0.0, max(sign * rise, 0.0), slope, left
        )
        if turn == np.inf:
            break
        motion, left, rise = _later_swing(motion, turn), left - turn, 0.0
        if sign > 0.0:
            gap, closing, _ = _gap_at(0.0, motion)
            peak = max(peak, k * gap + b * closing)
            if motion[7] > 0.0 and left * motion[7] <= np.pi:
                break  # the next maximum is more than half a period away
        _, second, third = _gap_at(0.0, _swing_change(motion))
        sign = -sign
        slope = max(sign * (k * second + b * third), 0.0)
    return peak


@compiled
def _phase_energies(law, mode, gap, tip_speed, acceleration, speed, duration):
    """Work of the contact and of the part against drag, N mm, over a phase in which the part moves."""
    if mode == SLIP:
        motion = _swing(gap, tip_speed - speed, tip_speed, acceleration, law)
        return _swing_energies(motion, tip_speed, acceleration, law, duration)
    return 0.0, _flight_energies(speed, law[4] / law[0], law[5] / law[0], law[5], duration)
