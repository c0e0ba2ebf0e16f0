"""Doubts about finishing: the roughness model against finished parts, the load torque against free motion."""

from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.doubts.alignment import Alignment
from sdpgrind.base.doubts.assumed import reader_of
from sdpgrind.base.doubts.record import Doubts
from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.tables import table_of
from sdpgrind.finishing._doubts import cost, motion, parts
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.study._study import Study
from sdpgrind.finishing.torque._axis import TorqueAxis


def doubts(problem: FinishingProblem, data: Any, axis: TorqueAxis | None = None) -> Doubts:
    """Compare a problem with finished parts or with motion of the axis; see `FinishingProblem.doubts`."""
    if axis is not None:
        checks.kind("axis", axis, TorqueAxis)
    table: Any = {} if isinstance(data, Study) else table_of(data, "controller")[0]
    reader = reader_of(data, table)
    rows: list[Doubt] = []
    sentences: list[str] = []
    aligned: Alignment | None = None
    fitted: parts.FittedRoughness | None = None
    subject = []
    if isinstance(data, Study) or "roughness_ra" in table:
        rows, sentences, fitted = parts.of_parts(problem, data)
        subject.append("finished parts")
    if "motor_angle" in table:
        row, aligned, words = motion.of_motion(problem, data, reader.commands_at, axis)
        rows, sentences = [*rows, row], [*sentences, *words]
        subject.append("motion of the axis")
    if not subject:
        raise ValueError(
            "data must hold roughness_ra (mm) of finished parts, or motor_angle (rad) and current (A);"
            f" they hold {', '.join(map(str, table))}"
        )
    every = (*rows, *parts.untold_rows(problem, rows))
    figure, stakes = cost.of_roughness(problem, every, fitted)
    return Doubts(
        f"finishing, {' and '.join(subject)}", (*every, *reader.rows), sentences, aligned, figure, stakes
    )
