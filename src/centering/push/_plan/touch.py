"""Position of the ring at first touch for which the push on the turning table ends on the axis.

From first touch on the rigid tip keeps the ring's centre on a circle about the tip's face, and the table
carries the ring along. Without inertia the centre moves over the table along the contact normal only;
followed backward from the axis, that gives one direction, Mears (5.17) made exact. With inertia the ring also
drifts across, by about w v/(mu_k g) of the push, since friction brakes sideways speed only at mu_k g over the
sliding speed. And it runs ahead of the tip or lags behind it by its inertia, its friction and the table's
centrifugal force. The exact push accounts for all of these.
"""

import warnings
from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from centering._problem.problem import CenteringProblem
from centering.push._profile.gentle import gentle_limits
from centering.push._profile.profile import TipProfile
from centering.push._profile.row_kernels import ROWS, push_rows
from centering.push._profile.rows import after, forward, lasting_rows, remaining, trapezoid
from centering.push.turning import _quasi_static_kernels as at
from centering.push.turning._lead import too_fast
from centering.push.turning._quasi_static_kernels import touch_back
from centering.push.turning._rim_kernels import ahead, reach
from centering.push.turning._shooting import Aim, aimed
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import forgotten, trusted
from sdpgrind.base.stored import stored

DIRECTIONS = ("exact", "quasi-static", "contact", "end")
SHAPES = ("trapezoid", "gentle")

_SLOWEST = 1e-3  # chosen: share of the greatest push speed; a converted speed below it was not meant
_ROUNDS = 3  # chosen: a gentle profile depends little on the angle; each round gains a digit or more
_FINE, _SMALL = 1e-3, 0.1  # chosen: misses beyond these shares of offset and tolerance warn
# chosen: share of the offset beyond which a miss is refused, unless the ring sticks or is thrown
_SHARE = 0.1
# chosen: offset over F_s/k below which a ring may stick; share of the offset left by a ring that sticks
_CLOSES, _STUCK = 2.0, 0.98
_LOOKS, _NEAR = 400, 1e-6  # chosen: samples of a run-up; lead of the rim over the tip that is contact, mm


@stored("centering.touch")
@dataclass(frozen=True, eq=False, repr=False)
class Touch(ByValue):
    """Push from its start near the rim: motion of the tip, position of the ring at first touch.

    Attributes
    ----------
    angle : float
        Angle from first touch to the offset's alignment with the push line, rad.
    time, travel : float
        Of the tip from first touch to the end of the stroke, s, mm.
    run_up, run_up_time : float
        Of the tip from its start to first touch, mm, s.
    profile, push_profile : TipProfile
        Motion of the tip from its start on, and from first touch on.
    miss : float
        Final distance of the ring from the axis by the model, mm; NaN unless the direction is ``"exact"``.
    """

    angle: float
    time: float
    travel: float
    run_up: float
    run_up_time: float
    profile: TipProfile
    push_profile: TipProfile
    miss: float = nan


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
    """Return the push of a tip that starts just out of the rim's reach: `plan_push` without approach.

    Parameters
    ----------
    problem, offset, spindle_speed, push_speed, direction, shape
        See `plan_push`; mm, rad/s, mm/s.
    stroke_offset : float
        Running correction of the stroke, mm: position of the tip outside the reading of the slide.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from centering import preset
    >>> from sdpgrind import units
    >>> task = {"offset": 1.0, "spindle_speed": units.rpm(20), "push_speed": 10.0}
    >>> touch = plan_touch(preset("printed"), **task, direction="quasi-static")
    >>> round(touch.angle / units.deg(1), 3), round(touch.travel, 5), round(touch.run_up, 5)  # deg, mm, mm
    (5.925, 0.9946, 0.5054)
    """
    checks.kind("problem", problem, CenteringProblem)
    w, d = checks.positive("spindle_speed", spindle_speed, "rad/s"), checks.positive("offset", offset, "mm")
    if d >= problem.model.part.radius:
        raise checks.refuse("offset", f"< the radius of the part = {problem.model.part.radius:g}", d, "mm")
    v = checks.positive("push_speed", push_speed, "mm/s")
    if v > problem.limits.push_speed_max * (1 + 1e-12):
        most = problem.limits.push_speed_max
        meant = forgotten(v, "mm/s", (_SLOWEST * most, most), most)
        raise ValueError(f"push_speed must be <= push_speed_max = {most:g} (mm/s){meant}; got {v!r}")
    checks.one_of("direction", direction, DIRECTIONS)
    checks.one_of("shape", shape, SHAPES)
    most = problem.limits.stroke_offset_max
    shift = checks.within("stroke_offset", stroke_offset, -most, most, "mm")
    total = d + problem.limits.safety + shift
    if total <= 0.0:
        raise checks.refuse(
            "stroke_offset", f"> {-d - problem.limits.safety:g}, so that a stroke is left", shift, "mm"
        )
    return _Task(problem, d, w, v, total, shape).touch(direction)


class _Task(NamedTuple):
    """Checked arguments; the tip travels `total`, from total - offset before the furthest rim."""

    problem: CenteringProblem
    offset: float
    spindle_speed: float
    push_speed: float
    total: float
    shape: str

    def touch(self, direction: str) -> Touch:
        """Find the place of first touch; a gentle profile begins there and is found with it."""
        rows, angle, longer, miss, found = self._rows(self.offset, 0.0), 0.0, 0.0, nan, ""
        for _ in range(_ROUNDS if self.shape == "gentle" and direction != "exact" else 1):
            angle = self._angle(direction, forward(rows))
            rows = self._rows(self._reach(angle), 0.0) if self.shape == "gentle" else rows
        if direction == "exact":
            aim = aimed(self.problem.model, self.spindle_speed, self._asked(), self.offset, angle)
            found = self._found(aim)
            angle, longer, miss = aim.angle, aim.longer, aim.left
            rows = self._rows(self._reach(angle), longer)
        touch = self._described(angle, longer, rows, miss)
        if found:
            warnings.warn(found, stacklevel=4)
        return touch

    def _asked(self) -> Floats:
        """The push in the form of `push_rows`."""
        most = self.problem.limits.acceleration_max
        gentle = 1.0 if self.shape == "gentle" else 0.0
        return np.array([gentle, self.total, self.push_speed, most, *gentle_limits(self.problem.model, most)])

    def _rows(self, reach: float, longer: float) -> Floats:
        """The tip from its start on; it first touches the ring `reach` (mm) from the axis."""
        most = self.problem.limits.acceleration_max
        if self.shape == "trapezoid":
            return trapezoid(self.total + longer, self.push_speed, most)
        out = np.empty((ROWS, 3))
        push = out[: push_rows(self._asked(), reach, longer, out)]
        return np.vstack((trapezoid(self.total - reach, self.push_speed, most), lasting_rows(push)))

    def _found(self, aim: Aim) -> str:
        """Refuse a push that misses the axis; return the reason where the ring sticks or is thrown."""
        d, left = self.offset, aim.left
        if aim.rests and left <= max(_FINE * d, _SMALL * self.problem.tolerance):
            return ""
        model = self.problem.model
        overrun = self.spindle_speed * d >= self.push_speed  # the rim may be faster than the tip
        sticks = aim.along > _STUCK * d and d <= _CLOSES * model.breakaway_force / model.contact_stiffness
        thrown = aim.along < 0.0 and not overrun
        where = f"for an offset of {d:.4g} mm at push_speed = {self.push_speed:.4g} mm/s"
        if not (sticks or thrown or left <= max(_SHARE * d, self.problem.tolerance)):
            raise self._no_push(where, left)
        why = "it is thrown beyond, push slower" if thrown else "it chatters on the tip"
        why = why if aim.rests else "it does not come to rest on the turning table, slow the spindle"
        why = "it sticks" if sticks else why
        why = "the rim is as fast as the tip, slow the spindle or push faster" if overrun else why
        return f"the push leaves the ring {left:.3g} mm from the axis {where}: {why}"

    def _no_push(self, where: str, left: float) -> ValueError:
        found = f"leaves {left:.3g} mm" if isfinite(left) else "has no push toward the axis"
        cure = "the rim runs into the tip or away from it; slow the spindle or push faster"
        rule = f"lower {where}, which {found}: {cure}"
        return checks.refuse("spindle_speed", rule, self.spindle_speed, "rad/s")

    @property
    def _faster(self) -> str:
        """Rule for a push speed that is too low."""
        task = f"an offset of {self.offset:g} mm at spindle_speed = {self.spindle_speed:.4g} rad/s"
        return f"higher for {task}"

    def _reach(self, angle: float) -> float:
        """Distance of the rim at an angle (rad, before alignment) from its place on the axis, mm."""
        way = float(reach(angle, self.offset, self.problem.model.part.radius))
        if not way > 0.0:
            raise checks.refuse(
                "push_speed",
                f"{self._faster}: the ring would be pushed from its side",
                self.push_speed,
                "mm/s",
            )
        return way

    def _angle(self, direction: str, rows: Floats) -> float:
        """Angle of first touch before the push line, without inertia, rad."""
        if direction == "contact":
            return 0.0
        return self._aligned_at_end(rows) if direction == "end" else self._quasi_static(rows)

    def _quasi_static(self, rows: Floats) -> float:
        out = np.zeros(at.TOUCHES)
        touch_back(self.problem.model.part.radius, self.spindle_speed, rows, self.offset, out)
        if not out[at.FOUND]:
            raise ValueError(
                f"the stroke must reach the rim at an offset of {self.offset:g} mm; {self.total:g} mm do not"
            )
        return -float(out[at.ANGLE])

    def _aligned_at_end(self, rows: Floats) -> float:
        """Angle at which the rim meets a tip whose stroke ends at the alignment, rad."""
        time, radius = float(rows[:, 0].sum()), self.problem.model.part.radius

        def apart(angle: float) -> float:
            return float(reach(angle, self.offset, radius)) - remaining(
                rows, time - angle / self.spindle_speed
            )

        most = min(self.spindle_speed * time, pi / 2)
        return float(brentq(apart, 0.0, most, xtol=1e-13)) if apart(most) < 0.0 else most

    def _described(self, angle: float, longer: float, rows: Floats, miss: float) -> Touch:
        way = self._reach(angle)
        push = after(rows, way + longer)
        time, run_up = float(forward(push)[:, 0].sum()), self.total - way
        before = float(forward(rows)[:, 0].sum()) - time
        if run_up > 0.0:  # else a correction has shortened the stroke by more than its run-up
            self._refuse_early(rows, before, angle)
        return Touch(
            angle=angle,
            time=time,
            travel=way + longer,
            run_up=run_up,
            run_up_time=before,
            profile=profile_of(rows, -run_up),
            push_profile=profile_of(push, 0.0),
            miss=miss,
        )

    def _refuse_early(self, rows: Floats, before: float, angle: float) -> None:
        """Refuse a push so slow that the rim meets the tip on its run-up, `before` (s) the planned touch."""
        ring = angle, self.offset, self.problem.model.part.radius, self.spindle_speed
        if ahead(rows, before, *ring, self.total, _LOOKS) > _NEAR:
            rule = f"{self._faster}: the rim arrives before the push"
            raise too_fast("push_speed", rule, self.push_speed, "mm/s")


def profile_of(rows: Floats, start: float) -> TipProfile:
    """Profile of rows (duration, velocity, acceleration), unchecked."""
    duration, velocity, acceleration = (lasting(column) for column in rows.T)
    return trusted(
        TipProfile, duration=duration, velocity=velocity, acceleration=acceleration, start=float(start)
    )
