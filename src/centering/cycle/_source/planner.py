"""Push of the source: speed by energy balance, free slide subtracted, one running correction."""

from centering._problem.problem import CenteringProblem
from centering.cycle._source.correction import StrokeCorrection
from centering.push._contact.free_slide import free_slide_table
from centering.push._contact.impact import energy_balance_speed
from centering.push._plan.push import Push, plan_push
from centering.push._profile.timing import move_time
from centering.push.turning._lead import TooFastError, rim_advance

_LEAST_SHARE = 0.1  # chosen: least stroke over the offset after subtraction of the free slide
_SLOWER = 0.9  # chosen: factor on the table speed where the rim would arrive before the push
_SLOWEST = 0.2  # chosen: smallest such factor
_SLOWEST_PUSH = 0.1  # mm/s, chosen: lower bound of the push speed
_STALE, _CHANGED = (
    0.02,
    2e-3,
)  # chosen: relative change of offset or table speed, and mm, that make a push stale


class PrintedPlanner:
    """Plans the push of Mears (2006), chapters 5 and 6, and keeps it until its assumptions change.

    Parameters
    ----------
    problem : CenteringProblem
        Part, limits, tolerance.
    push_speed : float or None
        Speed of all pushes, mm/s. None: by energy balance.
    timing : {"printed", "exact"}
        Form of the lead.
    """

    def __init__(self, problem: CenteringProblem, push_speed: float | None, timing: str) -> None:
        self._push_speed, self._timing = push_speed, timing
        self._slides = free_slide_table(problem.model)
        # What free sliding takes off a stroke is no correction: its limit does not hold for that.
        self._problem = problem.replace(
            limits=problem.limits.replace(stroke_offset_max=2.0 * problem.offset_max)
        )
        self.correction = StrokeCorrection(problem.limits.stroke_offset_max)
        self.reset()

    def reset(self) -> None:
        """Forget the part."""
        self.correction.reset()
        self.slower = 1.0  # share of the table speed that leaves time to begin a push
        self.push: Push | None = None

    def plan(self, offset: float, gap: float, spindle_speed: float) -> None:
        """Plan a push; none where the rim would arrive before it, and the table must slow down.

        Parameters
        ----------
        offset, gap : float
            Offset of the part, and distance from tip to rim at the trigger, mm.
        spindle_speed : float
            Table speed at the trigger, rad/s.
        """
        try:
            self.push = self._planned(offset, gap, spindle_speed)
        except TooFastError:
            self.slow_down()

    def plan_from(self, offset: float, room: float, spindle_speed: float) -> None:
        """Plan a push from a standing slide.

        Parameters
        ----------
        offset, room : float
            Offset of the part, and distance from the tip to the furthest rim, mm.
        spindle_speed : float
            Table speed at the trigger, rad/s.
        """
        far = room + 2.0 * offset  # gap on the other side: makes the lead too long by the approach
        self.plan(offset, far, spindle_speed)
        if self.push is None:
            return
        limits, radius = self._problem.limits, self._problem.model.part.radius
        spared = self._approach(self.push.rough) - self._approach(room - limits.safety)
        lead = self.push.lead_angle - spindle_speed * spared
        self.plan(offset, room + rim_advance(lead, offset=offset, radius=radius), spindle_speed)

    def _approach(self, way: float) -> float:
        """Time of an approach over a distance (mm), s."""
        limits = self._problem.limits
        return move_time(
            way, speed=limits.approach_speed, acceleration=limits.acceleration_max, timing=self._timing
        )

    def slow_down(self) -> None:
        """Drop the push and reduce the table speed."""
        if self.slower < _SLOWEST:
            raise RuntimeError(
                f"the rim arrives before the push even at {self.slower:.2g} of the table speed"
            )
        self.slower *= _SLOWER
        self.push = None

    def stale(self, offset: float, spindle_speed: float) -> bool:
        """Return whether there is no push, or its offset (mm) or table speed (rad/s) changed."""
        if self.push is None or abs(self.push.spindle_speed - spindle_speed) > _STALE * spindle_speed:
            return True
        return abs(self.push.offset - offset) > max(_STALE * offset, _CHANGED)

    def _planned(self, offset: float, gap: float, spindle_speed: float) -> Push:
        """Push at the speed of Mears (5.25), limited to a whole free slide; slide off, correction added."""
        speed = self._push_speed
        if speed is None:
            balanced = energy_balance_speed(self._problem, offset)
            speed = max(self._slides.augmented_speed(offset, balanced), _SLOWEST_PUSH)
        slid = float(self._slides.distance_at(speed))
        return plan_push(
            self._problem,
            offset=offset,
            follow_gap=gap,
            spindle_speed=spindle_speed,
            push_speed=speed,
            direction="end",
            timing=self._timing,
            stroke_offset=max(self.correction.value - slid, -(1.0 - _LEAST_SHARE) * offset),
        )
