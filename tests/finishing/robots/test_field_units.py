"""Units of a problem's fields in pages and notebooks: those of its own robot and placement."""

from sdpgrind import finishing
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.base.sheets.origin import problem_blocks

PATH = finishing.hilbert(finishing.preset("nominal").surface, 1)
PLACE = (1200.0, -300.0, 600.0)  # mm


def shown(**changes):
    """Units on the page by field; those in a notebook are alike."""
    problem = finishing.FinishingProblem(PATH, **changes)
    (table,) = (block for block in problem_blocks(problem) if isinstance(block, AmountTable))
    units = {row.name: row.unit for row in table.amounts}
    assert f"<td>{units['robot.speed_max']}</td>" in problem._repr_html_()
    return units


def test_joints_that_all_turn():
    units = shown(robot=finishing.robot("ur10"), placement=(*PLACE, -1.74))
    assert units["placement"] == "mm, mm, mm, rad"
    assert (units["robot.position_min"], units["robot.position_max"]) == ("rad", "rad")
    assert (units["robot.speed_max"], units["robot.acceleration_max"]) == ("rad/s", "rad/s^2")
    assert shown(robot=finishing.robot("ur10"), placement=PLACE)["placement"] == "mm"


def test_joints_of_an_arm_with_a_table():
    units = shown(placement=PLACE)
    assert units["robot.position_max"] == "rad, rad, rad, rad, rad, mm, mm"
    assert units["robot.jerk_max"] == ", ".join(["rad/s^3"] * 5 + ["mm/s^3"] * 2)
