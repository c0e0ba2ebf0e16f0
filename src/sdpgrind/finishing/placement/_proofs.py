"""Proofs that no placement brings a robot along a path.

Each is a necessary condition, held against every origin (in the box, where one is given), every turn of the
work and every azimuth of the tool; only positions of joints count. What remains free is what makes them
proofs: see `_table`, `_reach` and `_box` for the conditions and `_azimuths` for the azimuths.
"""

from functools import partial
from typing import NamedTuple

from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.placement._box import height_from_box, table_from_box, wrist_from_box
from sdpgrind.finishing.placement._carried import swept_sides
from sdpgrind.finishing.placement._grid import FREE
from sdpgrind.finishing.placement._proof import Condition, Proof, Shortfall, failing
from sdpgrind.finishing.placement._reach import Reach, ball_needed, reach_of
from sdpgrind.finishing.placement._table import table_room, wrist_extent
from sdpgrind.finishing.placement._task import PlacingTask
from sdpgrind.finishing.placement._worth import Sides


class _ProofRule(NamedTuple):
    """A condition, its name, and the sentence that says what fails."""

    name: str
    holds: Condition
    sentence: str


def proof_of(task: PlacingTask, sides: Sides) -> Proof | None:
    """Return a proof that there is no placement with its origin within the sides; None: none was found."""
    for rule in _rules(task, sides):
        found = failing(task, rule.holds)
        if found is not None:
            return Proof(rule.name, found.needed, found.available, "mm", _sentence(task, rule, found))
    return None


def _sentence(task: PlacingTask, rule: _ProofRule, found: Shortfall) -> str:
    free = (
        "at any turn of the work and azimuth of the tool" if task.turns_freely else "at any turn of the work"
    )
    numbers = {"needed": f"{found.needed:.6g}", "available": f"{found.available:.6g}", "axis": found.axis}
    return f"{rule.name}: {rule.sentence.format(**numbers, free=free)}"


def _rules(task: PlacingTask, sides: Sides) -> list[_ProofRule]:
    """Conditions that concern a robot: without a box, then with it."""
    robot, boxed = task.robot, sides != FREE
    if isinstance(robot, Arm):
        if task.hold.spins and len(robot.wrist_radii) > 1:
            return []  # the radius varies along the path
        return _of_table(robot) + (_of_table_in_box(robot, sides) if boxed else [])
    if isinstance(robot, MountedRobot):
        return _of_carried(robot, sides)
    reach = reach_of(robot)
    if reach is None:
        return []
    return [_of_reach(reach)] + ([_of_reach_in_box(reach, sides)] if boxed else [])


def _of_carried(robot: MountedRobot, sides: Sides) -> list[_ProofRule]:
    """Conditions where axes carry the work: each contact may be reached with the axes elsewhere."""
    reach, swept = reach_of(robot.robot), swept_sides(robot, sides)
    if reach is None or swept is None or sides == FREE:
        return []
    return [_of_reach_in_box(reach, swept, "in the box and the axes anywhere")]


def _of_table(arm: Arm) -> list[_ProofRule]:
    span = "{free} the path needs {needed} mm of the table along {axis}; it has {available} mm"
    height = "{free} the wrist has to rise by {needed} mm at its radius; q2 and q3 leave {available} mm"
    return [
        _ProofRule("span", partial(table_room, arm), span),
        _ProofRule("height", partial(wrist_extent, arm), height),
    ]


def _of_table_in_box(arm: Arm, sides: Sides) -> list[_ProofRule]:
    beyond = "with the origin in the box, {free} some contact is {needed} mm beyond the travel of the "
    return [
        _ProofRule("reach", partial(table_from_box, arm, sides), beyond + "table"),
        _ProofRule("height", partial(height_from_box, arm, sides), beyond + "wrist"),
    ]


def _of_reach(reach: Reach) -> _ProofRule:
    sentence = (
        "{free} the smallest ball around the wrist along the path has a radius of {needed} mm; the links"
        " reach {available} mm"
    )
    return _ProofRule("reach", partial(ball_needed, reach), sentence)


def _of_reach_in_box(reach: Reach, sides: Sides, where: str = "in the box") -> _ProofRule:
    sentence = (
        f"with the origin {where}, {{free}} the wrist is {{needed}} mm from the shoulder on axis 1 at some"
        " contact; the links reach {available} mm"
    )
    return _ProofRule("reach", partial(wrist_from_box, reach, sides), sentence)
