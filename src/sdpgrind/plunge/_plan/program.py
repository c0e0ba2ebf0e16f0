"""A planned cycle as a program of a control."""

from dataclasses import dataclass

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.programs import Program, ProgramCheck
from sdpgrind.base.quantities import another_unit
from sdpgrind.base.warned import warn
from sdpgrind.plunge._plan.axis_blocks import blocks_of
from sdpgrind.plunge._plan.axis_course import AxisCourse, axis_course
from sdpgrind.plunge._plan.program_reader import read_csv, read_ngc
from sdpgrind.plunge._plan.program_text import PlannedCycle, ProgramForm, csv_text, ngc_text

TARGETS = ("ngc", "csv")
_AXES = tuple("XYZUVW")  # source: RS274NGC; letters of linear axes
_USUAL, _TYPICAL = (1e-6, 0.01), 1e-4  # chosen: mm; a nanometre to some 3 % of a stock
_LOST = 1e-5  # chosen: deviation, mm, below which a control of four decimals makes it greater


@dataclass(frozen=True, repr=False)
class CycleProgram(Program):
    """Program of the feed axis for one part; immutable.

    Attributes
    ----------
    text : str
        The program, ASCII.
    deviation : float
        Greatest distance of the axis from the plan that the program states, mm of radius.
    target : {"ngc", "csv"}
        Form of the text.
    course : AxisCourse
        Planned position of the axis, mm, over time, s.
    axis : str
        Letter of the axis.
    scale : int
        Millimetres in the text for one of radius: 2 where it is programmed by the diameter.
    """

    target: str
    course: AxisCourse
    axis: str
    scale: int

    def check(self) -> ProgramCheck:
        """Read the text back and follow it: greatest distance from the plan (mm), and time of the end (s).

        A table is compared at its rows.
        """
        path = read_ngc(self.text, self.axis) if self.target == "ngc" else read_csv(self.text)
        position = path.position / self.scale
        if self.target == "ngc":
            away = self.course.deviation(path.time, position)
        else:
            away = float(np.max(np.abs(position - self.course(path.time))))
        return ProgramCheck(away, float(path.time[-1]))


def program_of(
    plan: PlannedCycle, target: str, deviation: float, axis: str, diameter: bool, certain: bool
) -> CycleProgram:
    """Write a plan as a program after a check of the arguments, see `CyclePlan.program`."""
    checks.one_of("target", target, TARGETS)
    checks.one_of("axis", axis, _AXES)
    form = ProgramForm(_deviation(deviation), axis, 2 if checks.kind("diameter", diameter, bool) else 1)
    _check_safety(plan, checks.kind("certain", certain, bool))
    _check_solved(plan)
    worn, straight = plan.problem.model.wheel_wear, plan.method != "exact"
    course = axis_course(plan.trajectory, worn, straight=straight)
    if target == "ngc":
        text = ngc_text(plan, form, blocks_of(course, form.deviation - course.error, form.digits))
    else:
        text = csv_text(course, form, plan.problem.sample_time)
    return CycleProgram(text, form.deviation, target, course, axis, form.scale)


def _deviation(value: float) -> float:
    number = checks.positive("deviation", value, "mm")
    if not _USUAL[0] <= number <= _USUAL[1]:
        raise ValueError(another_unit("deviation", value, "mm", _USUAL, _TYPICAL))
    if number < _LOST:
        warn(f"deviation = {number:g} mm is lost in a control that takes four decimals of a millimetre")
    return number


def _check_safety(plan: PlannedCycle, certain: bool) -> None:
    """A program has no gauge: its plan counts the doubts in full, or the user says that there are none."""
    call = "plunge.plan(problem, confidence=0.999, gauge=False)"
    if plan.confidence is None and not certain:
        raise ValueError(
            f"certain must be True for a plan that takes all values as exact; {call} counts their doubts;"
            " got False"
        )
    if plan.confidence is not None and certain:
        raise ValueError(
            f"certain must be False for a plan with a confidence, which is {plan.confidence:g}; got True"
        )
    if plan.confidence is not None and plan.gauge:
        call = call.replace("0.999", f"{plan.confidence:g}")
        raise ValueError(f"gauge must be False in a plan for a program, which has no gauge: {call}; got True")


def _check_solved(plan: PlannedCycle) -> None:
    if np.isinf(plan.error):
        raise ValueError(f"plan must be solved before it becomes a program; it was {plan.status}")
    turning = plan.trajectory.work_rotation.values
    if np.ptp(turning) > 0.0:
        raise ValueError(
            "plan must have one rotation of the work (rad/s), which a program of the axis does not set;"
            f" got {turning.min():.4g} to {turning.max():.4g}"
        )
