"""`finishing.place`: the cases of the spec, what is found is planned, best tries, boxes, refusals; what `plan` says."""

import numpy as np
import pytest
from placement_inside import PlacementRows, on_work, placing_task, rated, spread

from sdpgrind import finishing
from sdpgrind.finishing import FinishingProblem
from sdpgrind.finishing.placement import Placement, Proof
from sdpgrind.finishing.surface import cylinder_surface, flat_surface, nominal_surface, sphere_surface

ARM = finishing.Arm.generic()
UR10 = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
DIE = finishing.hilbert(nominal_surface(), 2)
BOX = [(600.0, -50.0, 100.0), (700.0, 0.0, 100.0)]
WIDE = FinishingProblem(finishing.zigzag(flat_surface(500.0), pitch=50.0))
CYLINDER = FinishingProblem(finishing.zigzag(cylinder_surface(40.0, 60.0), pitch=15.0))
FREE = ((-np.inf, np.inf),) * 3


@pytest.fixture(scope="module")
def placed():
    return finishing.place(FinishingProblem(DIE, robot=UR10), box=BOX)


def test_a_flat_too_wide_for_the_table():
    found = finishing.place(WIDE)
    assert not found.found and found.problem is None and found.best is None
    assert isinstance(found, Placement) and isinstance(found.proof, Proof) and np.isnan(found.worth)
    assert (found.proof.condition, round(found.proof.needed, 3)) == ("span", 450.0)
    assert repr(found).startswith("Placement(there is none: span: at any turn")


def test_a_cylinder_on_which_the_tool_passes_through_the_vertical():
    """Not at the azimuth of 0, wherever the table is: q1 would turn by half a turn."""
    with pytest.raises(ValueError, match=r"; finishing.place would search another origin, turn and azimuth"):
        finishing.plan(CYLINDER)
    found = finishing.place(CYLINDER)
    motion = finishing.plan(found.problem)
    assert found.found and found.problem == found.best and found.proof is None and not found.why
    assert motion.worst_violation.held and motion.error < 1e-3
    assert motion.worst_singularity.distance >= 0.9 * found.worth  # 30 poses stand for the path
    assert abs(np.sin(found.problem.azimuth)) > 0.1


def test_a_ball_out_of_the_arms_table_on_the_ur10():
    ball = FinishingProblem(finishing.zigzag(sphere_surface(25.0), pitch=8.0), robot=UR10)
    found = finishing.place(ball, box=[(500.0, -100.0, 0.0), (600.0, 0.0, 0.0)])
    assert found.found and finishing.plan(found.problem).worst_violation.held


def test_without_a_box_the_work_is_not_below_the_base():
    """Where the margin is greatest: 0.8 m below it. If nothing is found above, the search goes on there."""
    problem = FinishingProblem(DIE, robot=UR10)
    found = finishing.place(problem)
    lowest = found.problem.placement[2] + DIE.sample(per_leg=1).point[:, 2].min()
    assert found.found and found.worth > 0.3 and lowest > -1e-9


def test_below_the_base_where_it_cannot_be_above():
    """A stretched arm that hangs down from the shoulder reaches nothing above."""
    low, high = list(UR10.position_min), list(UR10.position_max)
    low[1:3], high[1:3] = (1.2, 0.0), (1.9, 0.6)
    down = UR10.replace(position_min=tuple(low), position_max=tuple(high))
    found = finishing.place(FinishingProblem(DIE, robot=down))
    assert found.found and found.problem.placement[2] < -1000.0


def test_the_worth_is_the_least_margin_at_thirty_poses(placed):
    """Found again from the joints of each branch at each pose, and no better at places nearby on a grid."""
    problem, task = placed.problem, placing_task(placed.problem)
    few = task.at(spread(task))
    x, y, z, turn = problem.placement
    poses, c, s = few.poses(on_work(problem.azimuth, turn)), np.cos(turn), np.sin(turn)
    around = np.eye(4)
    around[:2, :2], around[:3, 3] = [[c, -s], [s, c]], [x, y, z]
    joints = UR10.solutions(around @ poses)
    ends = np.array(UR10.position_max)
    share = ((ends - np.abs(joints)) / (2 * ends)).min(axis=2)
    filled = np.nan_to_num(joints)
    each = np.minimum(share, np.min(list(UR10.singularities(filled).values()), axis=0))
    each[np.isnan(share)] = -np.inf
    assert placed.worth == pytest.approx(each.min(axis=0).max(), abs=1e-12)
    assert len(few.point) == 16  # all nodes of this path, fewer than 30
    grid = [(x, y, z) for x in (600.0, 650.0, 700.0) for y in (-50.0, 0.0) for z in (100.0,)]
    turns = np.arange(8) * np.pi / 4
    for t in turns:
        for a in turns:
            many = PlacementRows(np.array(grid), np.full(6, t), np.full(6, on_work(a, t)))
            assert rated(few, many, FREE).worth.max() <= placed.worth + 1e-9


def test_the_origin_stays_in_the_box(placed):
    low, high = np.array(BOX)
    assert (low - 1e-12 <= placed.problem.placement[:3]).all()
    assert (placed.problem.placement[:3] <= high + 1e-12).all()
    assert placed.problem.replace(placement=None, azimuth=0.0) == FinishingProblem(DIE, robot=UR10)


def test_a_search_gives_the_same_again(placed):
    assert finishing.place(FinishingProblem(DIE, robot=UR10), box=BOX) == placed
    told = repr(placed)
    assert told.startswith("Placement(origin at (") and told.endswith("; collisions are not looked at)")
    assert f"worth {placed.worth:.3g}" in told and "\n" not in told


def test_nothing_found_is_not_impossible():
    """A robot whose first joint hardly turns: no proof knows that, and the best try says what stops it."""
    low, high = list(UR10.position_min), list(UR10.position_max)
    low[0], high[0] = 3.1, 3.101
    stiff = UR10.replace(position_min=tuple(low), position_max=tuple(high))
    found = finishing.place(FinishingProblem(DIE, robot=stiff), box=BOX)
    assert not found.found and found.proof is None and found.problem is None
    assert found.best.placement is not None and found.worth < 0 and "q1 must be in [3.1, 3.101]" in found.why
    assert repr(found).startswith("Placement(not found; best try: origin at (") and "impossible" not in repr(
        found
    )


def test_a_tool_along_the_feed_keeps_its_azimuth():
    path = finishing.hilbert(flat_surface(8.0), 2, mapping="parametric").blended(0.2)
    problem = FinishingProblem(path, robot=UR10, heading="feed_aligned", pushed=True, azimuth=0.5)
    found = finishing.place(problem, box=BOX)
    assert found.found and found.problem.azimuth == 0.5
    with pytest.raises(ValueError, match="path must be without sharp corners"):
        finishing.place(problem.replace(path=DIE))


@pytest.mark.parametrize(
    ("box", "said"),
    [
        ([(0, 0, 0)], r"box must be two corners, \(2, 3\) \(mm\); got \(1, 3\)"),
        ([(0, 0, 0), (1, -1, 1)], r"box must be two corners, none of the first above those of the second"),
        ([(0, 0, 0), (1, np.nan, 1)], r"box\[1, 1\] must be finite|box.* must be finite"),
    ],
)
def test_boxes_that_are_none(box, said):
    with pytest.raises(ValueError, match=said):
        finishing.place(CYLINDER, box=box)
    with pytest.raises(TypeError, match="problem must be a FinishingProblem"):
        finishing.place(DIE)


def test_metres_would_put_the_work_into_the_robot():
    """Unless the work itself is told in the base of the robot, as a scan is: then mm correct it."""
    said = r"must be in mm, some 800 from the base; metres\? units.m\(...\)"
    problem = FinishingProblem(DIE, robot=UR10)
    with pytest.raises(ValueError, match=f"box {said}"):
        finishing.place(problem, box=[(0.45, -0.2, 0.05), (0.75, 0.2, 0.05)])
    with pytest.raises(ValueError, match=f"placement {said}"):
        problem.replace(placement=(0.65, -0.025, 0.1))
    net = nominal_surface().control_points + np.array([650.0, -25.0, 100.0])
    scan = finishing.hilbert(finishing.Surface.bspline(net), 2)
    assert problem.replace(path=scan, placement=(0.65, -0.025, 0.1)).turn == 0.0
    assert FinishingProblem(DIE, placement=(0.65, -0.025, 0.1)).turn == 0.0  # the arm has a table


def test_plan_places_a_robot_without_a_table_and_says_so(monkeypatch, placed):
    monkeypatch.setattr("sdpgrind.finishing._problem.placing.place", lambda problem, progress: placed)
    with pytest.warns(UserWarning, match=r"placement was None: finishing.place took origin at .* collisions"):
        motion = finishing.plan(FinishingProblem(DIE, robot=UR10))
    assert motion.problem == placed.problem and motion.posture.placement == placed.problem.placement
    assert motion.lower_bound <= motion.duration
    stuck = Placement(False, None, None, placed.problem, -0.1, "q1 ends")
    monkeypatch.setattr("sdpgrind.finishing._problem.placing.place", lambda problem, progress: stuck)
    with pytest.raises(ValueError, match=r"placement must be given .*its best try: origin .*, where q1 ends"):
        finishing.plan(FinishingProblem(DIE, robot=UR10))


def test_plan_tells_of_a_proof():
    with pytest.raises(
        ValueError, match=r"beyond by .*; no placement would do: span: .* 450 mm of the table"
    ):
        finishing.plan(WIDE)
    far = FinishingProblem(finishing.zigzag(flat_surface(2400.0), pitch=400.0), robot=UR10)
    with pytest.raises(
        ValueError, match=r"placement cannot be found, as there is none: reach: .* links reach"
    ):
        finishing.plan(far)


def test_pictures(pyplot, placed):
    figure = placed.plot()
    assert [axis.get_title() for axis in figure.axes[:2]] == ["from above", "from the side"]
    robot = figure.axes[0].get_lines()[0]
    tip = np.array([robot.get_xdata()[-1], robot.get_ydata()[-1]])
    path = next(line for line in figure.axes[0].get_lines() if line.get_label() == "path")
    nearest = np.hypot(path.get_xdata() - tip[0], path.get_ydata() - tip[1]).min()
    assert nearest < 1e-6  # the drawn tool ends on the path
    bars = finishing.place(WIDE).plot().axes[0].patches
    assert [round(bar.get_width()) for bar in bars] == [450, 400]


def test_a_spinning_tool_is_placed():
    """Of 24 turns every third is compared; the plan takes all."""
    ball = FinishingProblem(finishing.hilbert(nominal_surface(), 1), robot=UR10, spin=24)
    assert placing_task(ball).hold.spins == pytest.approx(np.arange(8) * np.pi / 4)
    found = finishing.place(ball, box=[(650.0, -25.0, 100.0), (650.0, -25.0, 100.0)])
    assert found.found and found.problem.spin == 24 and found.worth > 0.1
