"""Planned push: trigger, approach, pause, stroke and their times."""

from dataclasses import dataclass
from math import pi
from typing import Any, Self

import numpy as np
import xarray as xr

from centering._problem.model import PushModel
from centering._problem.problem import CenteringLimits, CenteringProblem
from centering.push._plan import record as plan_record
from centering.push._plan.arrival import Arrival, arrival
from centering.push._plan.touch import Touch, plan_touch, profile_of
from centering.push._profile.profile import TipProfile
from centering.push._profile.rows import trapezoid
from centering.push._profile.timing import printed_time, rest_to_rest
from centering.push.turning._lead import Lead, find_lead
from centering.push.turning._limits import check_speed
from centering.push.turning._table_profile import turning_profile
from centering.push.turning._table_trace import TablePushTrace, simulate_table_push
from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.plans import Plan
from sdpgrind.base.stored import decode, stored

_KIND = "centering.push"
_LEAST = 1e-9  # mm, chosen: a shorter approach is rounding


@stored(_KIND)
@dataclass(frozen=True, eq=False, repr=False)
class Push(ByValue, Plan):
    """Planned push: approach, pause, push. The slide starts at the trigger, `lead_angle` before alignment.

    Attributes
    ----------
    problem, offset, spindle_speed, push_speed, direction, timing, shape
        Arguments of `plan_push`; mm, rad/s, mm/s.
    lead_angle : float
        Angle from the trigger to the offset's alignment with the push line, rad, Mears (5.17).
    turns : int
        Whole turns of waiting beyond the next half turn; 0 where lead_angle <= pi.
    lead_distance : float
        Advance of the rim toward the tip during the lead, mm, Mears (5.5).
    rough, fine : float
        Travel of approach and push, mm, Mears (5.9).
    time : float
        From the trigger to the end of the stroke, s, Mears (5.16).
    touch : Touch
        Push from its start near the rim.
    profile : TipProfile
        Motion of the slide from the trigger on, positive toward the axis.
    """

    kind = _KIND
    problem: CenteringProblem
    offset: float
    spindle_speed: float
    push_speed: float
    direction: str
    timing: str
    shape: str
    lead_angle: float
    turns: int
    lead_distance: float
    rough: float
    fine: float
    time: float
    touch: Touch
    profile: TipProfile

    @property
    def stroke(self) -> float:
        """Travel of the slide from the trigger to its furthest point, mm, Mears (5.6)."""
        return self.rough + self.fine

    @property
    def push_profile(self) -> TipProfile:
        """Motion of the tip from first touch on (s, mm/s)."""
        return self.touch.push_profile

    @property
    def miss(self) -> float:
        """Final distance of the ring from the axis by the model, mm; NaN unless the direction is ``"exact"``.

        An exact push that is solved misses by rounding only. `arrival` gives the distance for all directions.
        """
        return self.touch.miss

    def simulate(self, model: PushModel | None = None) -> TablePushTrace:
        """Simulate the push (mm, s, N): the part along the contact normal, Mears (5.26) and (5.27).

        The rim's own advance and the centrifugal force of the turning table are included, see
        `turning_profile`. The tip stays at the end of the stroke. Positions are travel over the table along
        the turning normal and differ by some percent from the change of the offset; `arrival` gives the final
        position.

        Parameters
        ----------
        model : PushModel, optional
            Model of the simulation. Default: that of the problem.

        Examples
        --------
        >>> from centering import preset
        >>> push = plan_push(preset("printed"), offset=1.0, spindle_speed=2.0, push_speed=10.0)
        >>> round(push.simulate().peak_force, 1)  # N
        70.5
        """
        model = self.problem.model if model is None else model
        place = {"offset": self.offset, "touch_angle": self.touch.angle, "spindle_speed": self.spindle_speed}
        return simulate_table_push(model, turning_profile(self.push_profile, model, **place))

    def arrival(self, model: PushModel | None = None) -> Arrival:
        """Return the expected final position of the ring's centre on the table (mm) with its covariance.

        The push is followed in the plane, with contact, friction and inertia. The covariance follows from the
        scatter of the problem: friction of part and push together, direction, stop of the slide, measuring.

        Parameters
        ----------
        model : PushModel, optional
            Model of the prediction. Default: that of the problem.

        Examples
        --------
        >>> from centering import preset
        >>> there = plan_push(preset("printed"), offset=1.0, spindle_speed=2.0, push_speed=10.0).arrival()
        >>> there.offset < 0.001, there.sd.round(4)  # mm; the direction scatters by 1.5 deg
        (True, array([0.0036, 0.0262]))
        """
        model = self.problem.model if model is None else checks.kind("model", model, PushModel)
        return arrival(model, self.problem.scatter, self.touch, self.offset, self.spindle_speed)

    @property
    def dataset(self) -> xr.Dataset:
        """Motion of the slide and planned values, labelled (mm, s, rad); the whole push as attribute."""
        return plan_record.push_dataset(self, self.profile)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        return checks.kind("push", decode(dataset.attrs["push"]), cls)

    def plot(self, ax: Any = None) -> Any:
        """Draw the distance of tip and rim from the axis (mm) over time (ms); return the figure.

        The rim is drawn until first touch. Zero is the rim of a ring on the axis.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw on. Default: those of a new figure.
        """
        return pictures.drawn("centering.push._plan.picture:plot", self, ax)

    def _told(self) -> str:
        lead = f"lead {self.lead_angle * 180 / pi:.4g} deg"
        return f"{lead}, stroke {self.stroke:.5g} mm in {self.time:.4g} s, {self.direction}, {self.shape}"


def plan_push(
    problem: CenteringProblem,
    *,
    offset: float,
    follow_gap: float | None = None,
    spindle_speed: float,
    push_speed: float,
    direction: str = "exact",
    timing: str = "exact",
    shape: str = "trapezoid",
    stroke_offset: float = 0.0,
) -> Push:
    """Plan a push that brings an offset ring to the axis of a turning table, Mears (5.1) to (5.17).

    The slide approaches to `CenteringLimits.safety` before the furthest point of the rim, rests for the
    settle time, and pushes until the tip is a radius away from the axis; ``direction="exact"`` corrects this
    stroke. The lead solves lead = speed x time, where the time depends on the lead.

    Parameters
    ----------
    problem : CenteringProblem
        Model and limits.
    offset : float
        Offset of the ring, mm.
    follow_gap : float, optional
        Distance from the rim to the pusher tip at the trigger, mm. Default: that of the limits.
    spindle_speed, push_speed : float
        Speeds of table and push, rad/s, mm/s.
    direction : {"exact", "quasi-static", "contact", "end"}
        ``"exact"``: the ring, carried by the table, drifting and thrown by its inertia, comes to rest at the
        axis; where no stroke achieves that (a ring thrown by more than its offset), it passes through the
        axis, with a warning. ``"quasi-static"``: through the axis, without inertia. ``"contact"``: alignment
        at first contact (Mears, chapter 7). ``"end"``: alignment at the end, Mears (5.17).
    timing : {"exact", "printed"}
        ``"printed"``: times of Mears (5.13) to (5.16), which are too long.
    shape : {"trapezoid", "gentle"}
        Speed of the push over time; see `gentle_profile`.
    stroke_offset : float
        Running correction of the stroke, mm, Mears (6.16).

    Raises
    ------
    ValueError
        When a value is out of range, the table is too fast for the offset, the rim would arrive before the
        push, or no exact push brings the ring near the axis: the rim is faster than the tip.

    Warns
    -----
    UserWarning
        When an exact push leaves more than 0.1 % of the offset and a tenth of the tolerance, with the
        distance (`Push.miss`): the ring sticks, or is thrown beyond the axis.

    Examples
    --------
    >>> from centering import preset
    >>> from sdpgrind import units
    >>> task = {"offset": 1.0, "spindle_speed": units.rpm(20), "push_speed": 10.0}
    >>> plan_push(preset("printed"), **task, direction="end")
    Push(lead 38.75 deg, stroke 8.7057 mm in 0.3229 s, end, trapezoid)
    """
    checks.kind("problem", problem, CenteringProblem)
    limits = problem.limits
    gap = limits.follow_gap if follow_gap is None else checks.positive("follow_gap", follow_gap, "mm")
    checks.one_of("timing", timing, ("exact", "printed"))
    check_speed(
        problem,
        checks.positive("offset", offset, "mm"),
        checks.positive("spindle_speed", spindle_speed, "rad/s"),
    )
    touch = plan_touch(
        problem,
        offset=offset,
        spindle_speed=spindle_speed,
        push_speed=push_speed,
        direction=direction,
        shape=shape,
        stroke_offset=stroke_offset,
    )
    fine = touch.run_up + touch.travel
    lead, rough_time, fine_time = _lead(problem, touch, fine, gap, offset, spindle_speed, push_speed, timing)
    return Push(
        problem=problem,
        offset=float(offset),
        spindle_speed=float(spindle_speed),
        push_speed=float(push_speed),
        direction=direction,
        timing=timing,
        shape=shape,
        lead_angle=lead.lead_angle,
        turns=lead.turns,
        lead_distance=lead.lead_distance,
        rough=lead.rough,
        fine=fine,
        time=rough_time + limits.settle_time + fine_time,
        touch=touch,
        profile=_whole(limits, lead.rough, touch),
    )


def _lead(
    problem: CenteringProblem,
    touch: Touch,
    fine: float,
    gap: float,
    d: float,
    w: float,
    v: float,
    timing: str,
) -> tuple[Lead, float, float]:
    """Lead, and the times of approach and push; the excess of printed times turns the table further."""
    limits = problem.limits
    rapid, a = limits.approach_speed, limits.acceleration_max
    exact = touch.run_up_time + touch.time
    fine_time = exact if timing == "exact" else printed_time(fine, v, a)
    approach = rest_to_rest if timing == "exact" else printed_time
    beyond = w * (limits.settle_time + touch.run_up_time + fine_time - exact) + touch.angle
    radius = problem.model.part.radius
    lead = find_lead(
        lambda rough: approach(rough, rapid, a),
        beyond,
        offset=d,
        radius=radius,
        room=gap - limits.safety,
        spindle_speed=w,
    )
    return lead, approach(lead.rough, rapid, a), fine_time


def _whole(limits: CenteringLimits, rough: float, touch: Touch) -> TipProfile:
    """Approach, pause and push; position counts from first touch."""
    parts = [touch.profile.segments]
    if limits.settle_time > 0.0:
        parts.insert(0, np.array([[limits.settle_time, 0.0, 0.0]]))
    if rough > _LEAST:
        parts.insert(0, trapezoid(rough, limits.approach_speed, limits.acceleration_max))
    return profile_of(np.vstack(parts), -rough - touch.run_up)
