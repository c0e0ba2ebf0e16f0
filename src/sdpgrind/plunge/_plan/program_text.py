"""Text of a cycle's program: RS274NGC, as LinuxCNC reads it, and a table of positions."""

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from sdpgrind.base.quantities import units_of
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._model.uncertainty import Uncertainty
from sdpgrind.plunge._plan.axis_blocks import AxisBlock
from sdpgrind.plunge._plan.axis_course import AxisCourse

if TYPE_CHECKING:
    import xarray as xr

# chosen: decimals of mm, mm/min and s from a deviation (mm) on; two positions of 4 decimals, which a control
# takes, lie in the band of 1e-4 mm; in a narrower one more of them leave longer blocks
_DIGITS = {1e-4: 4, 1e-5: 6, 0.0: 7}
TABLE_DIGITS = 6  # chosen: decimals of mm in a table; they round by half a nanometre


class PlannedCycle(Protocol):
    """What a program is made of: a `CyclePlan`, mm and s."""

    problem: CycleProblem
    method: str
    safety_margin: float
    confidence: float | None
    gauge: bool
    error: float

    @property
    def time(self) -> float:
        """Time, s."""

    @property
    def trajectory(self) -> "xr.Dataset":
        """Course over time, s."""

    @property
    def status(self) -> str:
        """Quality in one sentence."""


class ProgramForm(NamedTuple):
    """Deviation stated (mm), letter of the axis, millimetres of its words for one of radius."""

    deviation: float
    axis: str
    scale: int

    @property
    def digits(self) -> int:
        """Decimals of positions, feeds and dwells."""
        return next(digits for least, digits in _DIGITS.items() if self.deviation >= least)


def ngc_text(plan: PlannedCycle, form: ProgramForm, blocks: Iterable[AxisBlock]) -> str:
    """Write the program of RS274NGC."""
    lines = [f"({line})" for line in _comments(plan, form)]
    lines += ["G21 G90 G94", *(_line(block, form) for block in blocks), "M2"]
    return "\n".join(lines) + "\n"


def _line(block: AxisBlock, form: ProgramForm) -> str:
    if block.feed == 0.0:
        return f"G4 P{block.dwell:.{form.digits}f}"
    position, feed = (f"{form.scale * value:.{form.digits}f}" for value in (block.position, block.feed))
    return f"G1 {form.axis}{position} F{feed}"


def csv_text(course: AxisCourse, form: ProgramForm, sample_time: float) -> str:
    """Write positions at whole samples (s), from 0 to the first at or after the end."""
    time = np.arange(np.ceil(course.time[-1] / sample_time - 1e-9) + 1.0) * sample_time
    rows = (f"{t:.10g},{form.scale * x:.{TABLE_DIGITS}f}" for t, x in zip(time, course(time), strict=True))
    return "\n".join(["time_s,position_mm", *rows]) + "\n"


def _comments(plan: PlannedCycle, form: ProgramForm) -> Iterator[str]:
    """Lines of the head; none has brackets, which would end a comment."""
    from sdpgrind import __version__

    problem, model = plan.problem, plan.problem.model
    shape = "bore" if model.internal else "shaft"
    yield f"plunge cycle of {plan.time:.4f} s, method {plan.method}, sdpgrind {__version__}"
    yield f"problem: radial stock {problem.stock:g} mm, infeed at most {problem.command_rate_max:g} mm/s"
    yield f"problem: out of round by {problem.roundness_max:g} mm at most"
    yield f"{shape} of {model.work_diameter:g} mm at {model.work_rotation:g} rad/s, {model.width:g} mm wide"
    yield f"wheel of {model.wheel_diameter:g} mm at {model.wheel_speed:g} mm/s"
    yield from _safety(plan)
    yield "open loop: no gauge, so every doubt of contact and deflection counts in full"
    yield f"deviation: within {form.deviation:g} mm of the planned infeed at all times, rounding included"
    yield f"RS274NGC as LinuxCNC reads it: {form.axis} in mm, F in mm/min, G4 P in s"
    measure = "diameter, twice the radial infeed" if form.scale == 2 else "radial infeed"
    yield f"{form.axis}: {measure} from first contact in mm, positive into the work"
    if form.scale == 2:
        yield "F: of the diameter, too; not for a control in diameter mode G7, whose F is of the radius"
    yield f"{form.axis}0 is first contact of wheel and work, where the program begins"
    if model.wheel_wear > 0.0:
        yield f"wheel wear is fed in addition: {model.wheel_wear * problem.stock:.5f} mm of radius"
    yield "lag and dead time of the drive are not made up for: dwell before the retract"
    yield "add approach, spindles and coolant before G1, and the retract before M2, which ends the program"


def _safety(plan: PlannedCycle) -> Iterator[str]:
    """Lines on what is kept against burning."""
    if plan.confidence is None:
        yield "certain: all values are taken as exact, none is doubted; the least error may burn the part"
    else:
        yield f"confidence: {plan.confidence:g} that no finished surface is burned"
        yield from _doubts(plan.problem.uncertainty)
    if plan.confidence is None or not plan.problem.uncertainty.burning_sd:
        yield "burn threshold taken as exactly known"
    if plan.safety_margin > 0.0:
        yield f"safety margin: {plan.safety_margin:g} mm"


def _doubts(uncertainty: Uncertainty) -> Iterator[str]:
    """Lines on the doubts of a plan without a gauge."""
    units = units_of(Uncertainty)
    names = ("burning_sd", "diffusivity_sd", "sharpness_sd", "deflection_sd", "contact_zero_sd")
    for name in names:
        value = getattr(uncertainty, name)
        if value:
            yield f"doubt: {name} = {value:g}" + ("" if units[name] == "1" else f" {units[name]}")
