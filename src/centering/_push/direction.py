"""Where the ring must be when the tip touches it, so that the push on the turning table ends on the axis.

From first touch on the rigid tip keeps the ring's centre on a circle of its radius about the tip's face, and the table carries
the ring along. Without inertia the centre then moves over the table along the contact normal only; followed backward from the
axis, that gives the one direction, Mears (5.17) made exact. With inertia the ring also drifts across: friction wears sideways
speed off only at the rate mu_k g over the sliding speed, and the drift is about w v/(mu_k g) of the push. And it goes beyond the
tip, or lags behind it, by its inertia, its friction and the table's centrifugal force. The exact push holds all of these.
"""

import warnings
from dataclasses import dataclass
from functools import partial
from math import cos, inf, isfinite, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from centering._push import direction_kernels as at
from centering._push.direction_kernels import touch_back
from centering._push.gentle import gentle_profile
from centering._push.problem import CenteringProblem
from centering._push.profile import TipProfile
from centering._push.shooting import Aim, aimed, missed
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.stored import stored

DIRECTIONS = ("exact", "quasi-static", "contact", "end")
SHAPES = ("trapezoid", "gentle")

_ROUNDS = 3  # a gentle profile depends little on the angle: each round is one digit or more
_FINE, _SHARE = 0.01, 0.1  # of the offset: what is told when it is left, and what is too much unless the ring sticks or is thrown
_CLOSES, _STUCK = 2.0, 0.98  # times F_s/k: a ring nearer than that may stick; share of the offset that is left where it does
_LOOKS, _NEAR = 400, 1e-6  # at a run-up, and mm: a rim that is ahead of the tip by more has met it
_SLIVER = 1e-9  # s: what rounding leaves of a row


@stored("centering.touch")
@dataclass(frozen=True, eq=False, repr=False)
class Touch(ByValue):
    """A push from its start near the rim: what the tip does, and where the ring is at first touch.

    Attributes
    ----------
    angle : float
        From first touch until the offset would be on the push line, rad.
    time : float
        From first touch to the end of the stroke, s.
    travel : float
        Of the tip from first touch to the end of the stroke, mm.
    run_up, run_up_time : float
        Travel (mm) and time (s) from the start of the tip to first touch.
    profile : TipProfile
        From the start of the tip on.
    push_profile : TipProfile
        From first touch on.
    """

    angle: float
    time: float
    travel: float
    run_up: float
    run_up_time: float
    profile: TipProfile
    push_profile: TipProfile


def plan_touch(
    problem: CenteringProblem,
    *,
    offset: float,
    spindle_speed: float,
    push_speed: float,
    direction: str = "exact",
    shape: str = "trapezoid",
    stroke_offset: float = 0.0,
) -> Touch:
    """Return the push of a tip that starts from rest just out of the rim's reach: `plan_push` without its approach.

    Parameters
    ----------
    problem : CenteringProblem
        Model, limits.
    offset : float
        That is to be brought to the axis, mm.
    spindle_speed, push_speed : float
        rad/s, mm/s.
    direction : {"exact", "quasi-static", "contact", "end"}
        As `plan_push` has it.
    shape : {"trapezoid", "gentle"}
        Of the speed of the tip.
    stroke_offset : float
        Running correction of the stroke, mm: so far the tip stands outside the place that the slide tells.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from centering._push.presets import preset
    >>> from sdpgrind import units
    >>> touch = plan_touch(preset("printed"), offset=1.0, spindle_speed=units.rpm(20), push_speed=10.0, direction="quasi-static")
    >>> round(touch.angle * 180 / 3.141592653589793, 3), round(touch.travel, 5), round(touch.run_up, 5)  # deg, mm, mm
    (5.925, 0.9946, 0.5054)
    """
    checks.kind("problem", problem, CenteringProblem)
    w, d = checks.positive("spindle_speed", spindle_speed, "rad/s"), checks.positive("offset", offset, "mm")
    if d >= problem.model.part.radius:
        raise checks.refuse("offset", f"< the radius of the part = {problem.model.part.radius:g}", d, "mm")
    v = checks.positive("push_speed", push_speed, "mm/s")
    if v > problem.limits.push_speed_max * (1 + 1e-12):
        raise checks.refuse("push_speed", f"<= push_speed_max = {problem.limits.push_speed_max:g}", v, "mm/s")
    checks.one_of("direction", direction, DIRECTIONS)
    checks.one_of("shape", shape, SHAPES)
    most = problem.limits.stroke_offset_max
    shift = checks.within("stroke_offset", stroke_offset, -most, most, "mm")
    total = d + problem.limits.safety + shift
    if total <= 0.0:
        raise checks.refuse("stroke_offset", f"> {-d - problem.limits.safety:g}, so that a stroke is left", shift, "mm")
    return _Task(problem, d, w, v, total).touch(direction, shape)


class _Task(NamedTuple):
    """What is asked: `total` travel of the tip, from a start at total - offset before the farthest place of the rim."""

    problem: CenteringProblem
    offset: float
    spindle_speed: float
    push_speed: float
    total: float

    def touch(self, direction: str, shape: str) -> Touch:
        """Find the place of first touch; a gentle profile begins there, and is therefore found with it."""
        profile, gentle = self._profile(shape, self.offset), shape == "gentle"
        angle, longer = 0.0, 0.0
        for _ in range(_ROUNDS if gentle and direction != "exact" else 1):
            angle = self._angle(direction, forward(profile.segments))
            profile = self._profile(shape, self._travel(angle)) if gentle else profile
        if direction == "exact":
            aim = aimed(partial(self._missed, shape), angle, self.offset)
            self._tell(aim)
            angle, longer = aim.angle, aim.longer
            profile = self._profile(shape, self._travel(angle), longer)
        return self._described(angle, longer, profile)

    def _profile(self, shape: str, travel: float, longer: float = 0.0) -> TipProfile:
        """The tip from its start on, which first touches the ring where it has `travel` left to the axis."""
        a = self.problem.limits.acceleration_max
        if shape == "trapezoid":
            return TipProfile.move(self.total + longer, self.push_speed, a)
        reach = TipProfile.move(self.total - travel, self.push_speed, a)
        return reach.then(self._gentle(travel + longer))

    def _gentle(self, travel: float) -> TipProfile:
        """The tip from first touch on; neither it nor its way back asks more than the slide can do."""
        most = self.problem.limits.acceleration_max
        return gentle_profile(self.problem.model, travel, self.push_speed, acceleration_max=most)

    def _missed(self, shape: str, angle: float, longer: float, coarse: bool) -> Floats:
        """What such a push misses; infinite where there is none."""
        travel = self._reach(angle) if isfinite(angle) else -inf
        if not min(travel, travel + longer, self.total - travel) > 0.0:
            return np.full(2, inf)
        if shape == "gentle":
            rows = self._gentle(travel + longer).segments
        else:
            rows = after(_trapezoid(self.total + longer, self.push_speed, self.problem.limits.acceleration_max), travel + longer)
        return missed(self.problem.model, self.spindle_speed, self.offset, angle, rows, coarse)

    def _tell(self, aim: Aim) -> None:
        """Refuse a push that does not bring the ring near the axis; warn of one that leaves some, as it sticks or is thrown."""
        d, left = self.offset, aim.left(self.offset)
        if aim.solved or left <= max(_FINE * d, self.problem.tolerance):
            return
        model, along = self.problem.model, aim.missed[1]
        overrun = self.spindle_speed * d >= self.push_speed  # the rim may come and go faster than the tip
        sticks = along > _STUCK * d and d <= _CLOSES * model.breakaway_force / model.contact_stiffness
        thrown = along < 0.0 and not overrun
        where = f"for an offset of {d:.4g} mm at push_speed = {self.push_speed:.4g} mm/s"
        if not (sticks or thrown or left <= _SHARE * d):
            found = f"leaves {left:.3g} mm" if isfinite(left) else "has no push toward the axis"
            rule = f"lower {where}, which {found}: the rim runs into the tip or away from it; slow the spindle or push faster"
            raise checks.refuse("spindle_speed", rule, self.spindle_speed, "rad/s")
        why = "it is thrown beyond, push slower" if thrown else "it chatters on the tip"
        why = "the rim is as fast as the tip, slow the spindle or push faster" if overrun else "it sticks" if sticks else why
        warnings.warn(f"the push leaves the ring {left:.3g} mm from the axis {where}: {why}", stacklevel=4)

    def _reach(self, angle: float) -> float:
        """Distance of the rim from where it is at an angle (rad, before alignment) to where it is on the axis, mm."""
        across = self.offset * sin(angle)
        r = self.problem.model.part.radius
        return self.offset * cos(angle) - across * across / (r + sqrt(r * r - across * across))

    def _travel(self, angle: float) -> float:
        """Travel of the tip from first touch at an angle to the axis, mm."""
        travel = self._reach(angle)
        if not travel > 0.0:
            rule = f"higher for an offset of {self.offset:g} mm at spindle_speed = {self.spindle_speed:.4g} rad/s"
            raise checks.refuse("push_speed", f"{rule}: the ring would be pushed from its side", self.push_speed, "mm/s")
        return travel

    def _angle(self, direction: str, rows: Floats) -> float:
        """Angle of first touch before the push line, without inertia, rad."""
        if direction == "contact":
            return 0.0
        return self._aligned_at_end(rows) if direction == "end" else self._quasi_static(rows)

    def _quasi_static(self, rows: Floats) -> float:
        out = np.zeros(at.TOUCHES)
        touch_back(self.problem.model.part.radius, self.spindle_speed, rows, self.offset, out)
        if not out[at.FOUND]:
            raise ValueError(f"the stroke must reach the rim at an offset of {self.offset:g} mm; {self.total:g} mm do not")
        return -float(out[at.ANGLE])

    def _aligned_at_end(self, rows: Floats) -> float:
        """Angle at which the rim meets a tip that ends its stroke when the offset would be on the push line."""
        time = float(rows[:, 0].sum())

        def apart(angle: float) -> float:
            return self._reach(angle) - remaining(rows, time - angle / self.spindle_speed)

        most = min(self.spindle_speed * time, pi / 2)
        return float(brentq(apart, 0.0, most, xtol=1e-13)) if apart(most) < 0.0 else most

    def _described(self, angle: float, longer: float, profile: TipProfile) -> Touch:
        rows = forward(profile.segments)
        reach = self._travel(angle)
        travel = reach + longer
        push = after(profile.segments, travel)
        time = float(forward(push)[:, 0].sum())
        if self.total > reach:  # else a correction has shortened the stroke by more than its run-up
            self._refuse_early(angle, rows, time)
        return Touch(
            angle=angle,
            time=time,
            travel=travel,
            run_up=self.total - reach,
            run_up_time=float(rows[:, 0].sum()) - time,
            profile=profile_of(profile.segments, reach - self.total),
            push_profile=profile_of(push, 0.0),
        )

    def _refuse_early(self, angle: float, rows: Floats, time: float) -> None:
        """Refuse a push so slow that the rim meets the tip on its run-up, `time` (s) before whose end it shall be touched."""
        ends = np.cumsum(rows[:, 0])
        t = np.linspace(0.0, ends[-1] - time, _LOOKS)[:-1]
        row = np.searchsorted(ends, t, side="right")
        begins, moved = ends - rows[:, 0], (rows[:, 1] + 0.5 * rows[:, 2] * rows[:, 0]) * rows[:, 0]
        into = t - begins[row]
        gone = (np.cumsum(moved) - moved)[row] + (rows[row, 1] + 0.5 * rows[row, 2] * into) * into
        turned = angle + self.spindle_speed * (ends[-1] - time - t)
        across, r = self.offset * np.sin(turned), self.problem.model.part.radius
        rim = self.offset * np.cos(turned) - across**2 / (r + np.sqrt(r * r - across**2))
        if np.any(rim - (self.total - gone) > _NEAR):
            rule = f"higher for an offset of {self.offset:g} mm at spindle_speed = {self.spindle_speed:.4g} rad/s"
            raise checks.refuse("push_speed", f"{rule}: the rim arrives before the push", self.push_speed, "mm/s")


def _trapezoid(distance: float, speed: float, acceleration: float) -> Floats:
    """The rows of `TipProfile.move`, without its checks."""
    top = min(speed, sqrt(acceleration * distance))
    rise, cruise = top / acceleration, distance / top - top / acceleration
    rows = [(rise, 0.0, acceleration), (cruise, top, 0.0), (rise, top, -acceleration)]
    return np.array([row for row in rows if row[0] > _SLIVER])


def profile_of(rows: Floats, start: float) -> TipProfile:
    """The profile of rows of duration, velocity and acceleration."""
    return TipProfile(rows[:, 0], rows[:, 1], rows[:, 2], start=start)


def forward(rows: Floats) -> Floats:
    """The rows of a profile up to its farthest place, where it begins to withdraw."""
    back = np.flatnonzero((rows[:, 1] < 0.0) | ((rows[:, 1] == 0.0) & (rows[:, 2] < 0.0)))
    return rows[: back[0]] if back.size else rows


def remaining(rows: Floats, time: float) -> float:
    """Travel that forward rows still have before them at a time, mm."""
    left = 0.0
    for duration, velocity, acceleration in rows[::-1]:
        left += (velocity + acceleration * duration / 2.0) * duration
    for duration, velocity, acceleration in rows:
        t = min(max(time, 0.0), duration)
        left -= (velocity + acceleration * t / 2.0) * t
        time -= duration
        if time <= 0.0:
            break
    return left


def after(segments: Floats, travel: float) -> Floats:
    """The rows of a profile from where its way forward has `travel` left, with what follows its farthest place."""
    rows = forward(segments)
    left = travel
    for k in range(len(rows) - 1, -1, -1):
        duration, velocity, acceleration = rows[k]
        way = (velocity + acceleration * duration / 2.0) * duration
        if way >= left or k == 0:
            end = velocity + acceleration * duration
            root = sqrt(max(end * end - 2.0 * acceleration * left, 0.0))
            kept = min(2.0 * left / (end + root), duration)
            first = np.array([[kept, end - acceleration * kept, acceleration]])
            return np.vstack((first, segments[k + 1 :])) if kept > _SLIVER else segments[k + 1 :]
        left -= way
    return rows
