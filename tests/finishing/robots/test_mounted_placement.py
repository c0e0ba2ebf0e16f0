"""`finishing.place` where axes carry the work: found and planned, worth by hand, and proofs against draws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mounted_cells import HELD, RAIL, TABLE, moved, ring

from sdpgrind import finishing
from sdpgrind.finishing._problem.place import placing_task, worth_of
from sdpgrind.finishing.placement._carried import compared, swept_sides
from sdpgrind.finishing.placement._proofs import proof_of
from sdpgrind.finishing.placement._task import spread

UPRIGHT = TABLE.replace(axis=(0, 0, 1))
TURNED = UPRIGHT.replace(angles=(-0.45, -0.15, 0.15, 0.45))
DIE = finishing.hilbert(finishing.surface.nominal_surface(), 1)
BOX = [(1020.0, 0.0, 300.0), (1080.0, 0.0, 300.0)]
FAR = [(2800.0, -100.0, 0.0), (2900.0, 100.0, 100.0)]
"""Beyond 1.3 m of the robot and 0.4 m of the rail, and 1.75 m from the axis of the turntable."""


def on(*axes):
    """The die on axes under the robot."""
    robot = finishing.arm.mounted(HELD, **{f"axis{k}": axis for k, axis in enumerate(axes)})
    return finishing.FinishingProblem(DIE, robot=robot, azimuth=0.3)


@pytest.fixture(scope="module")
def placed():
    return finishing.place(on(TURNED), box=BOX)


def test_a_die_is_placed_on_its_turntable(placed, pyplot):
    """The axis stays, the work lies in the box; along the whole path the robot keeps its limits."""
    assert placed.found and placed.problem.robot == on(TURNED).robot
    assert (np.array(BOX[0]) <= placed.problem.placement[:3]).all()
    assert (placed.problem.placement[:3] <= np.array(BOX[1])).all()
    motion = finishing.plan(placed.problem)
    assert motion.worst_violation.held and motion.worst_singularity.distance >= 0.1
    figure = placed.plot()
    assert figure.axes[0].get_legend_handles_labels()[1][0] == "path, axes at zero"


def test_the_worth_is_of_the_best_place_of_the_axes_at_each_pose(placed):
    """Found again branch by branch and candidate by candidate; the robot keeps its branch, the axes do not."""
    problem = placed.problem
    task = placing_task(problem)
    few, robot = task.at(spread(task)), problem.robot
    x, y, z, turn = problem.placement
    around, (c, s) = np.eye(4), (np.cos(turn), np.sin(turn))
    around[:2, :2], around[:3, 3] = [[c, -s], [s, c]], [x, y, z]
    poses = around @ few.poses((problem.azimuth + np.pi - turn) % (2 * np.pi))
    ends = np.array(robot.position_max)
    best = np.full((len(poses), 8), -1.0)
    for angle in robot.axes[0].candidates:
        joints = HELD.solutions(moved(robot.axes[0], angle) @ poses)
        every = np.concatenate([joints, np.full((*joints.shape[:2], 1), angle)], axis=2)
        share = ((ends - np.abs(every)) / (2 * ends)).min(axis=2)
        singular = np.min(list(HELD.singularities(np.nan_to_num(joints)).values()), axis=0)
        found = np.where(np.isnan(joints).any(axis=2), -1.0, np.minimum(share, singular))
        best = np.maximum(best, found)
    assert worth_of(problem) == pytest.approx(best.min(axis=0).max(), abs=1e-9)
    assert placed.worth == pytest.approx(worth_of(problem), abs=1e-9) and placed.worth > 0.1


def test_few_candidates_are_compared():
    assert compared(HELD) is HELD
    one, two = compared(ring().robot), compared(finishing.arm.mounted(HELD, rail=RAIL, table=TABLE))
    assert one.combinations == 8 and two.combinations == 9
    some = compared(finishing.arm.mounted(HELD, rail=RAIL.replace(positions=tuple(range(0, 200, 10)))))
    assert some.axes[0].positions == (0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0)
    held = finishing.arm.mounted(HELD, rail=RAIL.replace(positions=(5.0,)))
    assert compared(held) == held


NUMBER = st.floats(-1.0, 1.0)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER)


@given(
    start=VECTOR, size=VECTOR, share=VECTOR, at=st.lists(NUMBER, min_size=2, max_size=2), down=st.booleans()
)
@settings(max_examples=60, deadline=None)
def test_the_axes_leave_no_origin_outside_of_what_they_sweep(start, size, share, at, down):
    """Draws of a box, an origin in it, and positions of a rail askew and of an upright turntable, each on other."""
    rail = RAIL.replace(direction=(0.6, -0.3, 0.5))
    table = UPRIGHT.replace(axis=(0, 0, -1 if down else 1))
    low = 1000.0 * np.array(start)
    high = low + 300.0 * np.abs(size)
    sides = tuple(zip(low.tolist(), high.tolist(), strict=True))
    origin = np.append(low + np.abs(share) * (high - low), 1.0)
    for axes in ((rail, table), (table, rail)):
        robot = finishing.arm.mounted(HELD, **{f"axis{k}": axis for k, axis in enumerate(axes)})
        there = origin
        for axis, value in zip(reversed(axes), at, strict=True):
            there = moved(axis, 400.0 * value if axis is rail else 6.0 * value) @ there
        for place, (least, most) in zip(there, swept_sides(robot, sides), strict=False):
            assert least - 1e-9 <= place <= most + 1e-9


def test_a_proof_counts_what_the_axes_travel():
    """On the rail alone it is out of reach, at every draw, too; a turntable brings it near: no proof."""
    rail = on(RAIL)
    found = finishing.place(rail, box=FAR)
    assert found.proof.condition == "reach" and found.proof.needed > found.proof.available
    assert "with the origin in the box and the axes anywhere, at any turn" in str(found.proof)
    task, rng = placing_task(rail), np.random.default_rng(4)
    for _ in range(200):
        turn, way = rng.uniform(-np.pi, np.pi), rng.uniform(-400.0, 400.0)
        place = np.eye(4)
        place[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        place[:3, 3] = rng.uniform(*FAR) + np.array([0.0, way, 0.0])
        poses = place @ task.poses(rng.uniform(-np.pi, np.pi))
        assert np.isnan(HELD.solutions(poses)).all(axis=(1, 2)).any()
    assert proved(on(RAIL.replace(direction=(1, 0, 0), travel=(-2500.0, 0.0)))) is None
    assert proved(on(UPRIGHT)) is None and proved(on(RAIL)) == found.proof
    beside = UPRIGHT.replace(origin=(2850.0, 0.0, 300.0))  # turns it where it is
    assert proved(on(beside)).condition == "reach"
    assert proved(on(beside.replace(axis=(0, 1, 10)))) is None  # tilted


def proved(problem):
    return proof_of(placing_task(problem), tuple(zip(*FAR, strict=True)))


def test_what_is_refused():
    with pytest.raises(
        ValueError, match=r"box must be given where axes carry the work: .* turntable at zero; got None"
    ):
        finishing.place(ring())
