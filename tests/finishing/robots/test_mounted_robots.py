"""Robots with axes that carry the work: poses, inverse, Jacobian, and motions along which the work moves."""

import numpy as np
import pytest
from finishing_inside import WEIGHT, course_of, joint_runs
from mounted_cells import HELD, RAIL, STAND, TABLE, moved, planned, ring
from robot_twins import IRB2400, UR10, about
from scipy.spatial import cKDTree

import hwsim
import sdpgrind
from sdpgrind import finishing
from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing.timing import time_laws, worst_violation

CELLS = {
    "ur10": finishing.arm.mounted(UR10, rail=RAIL, turntable=STAND),
    "irb2400": finishing.arm.mounted(IRB2400, turntable=STAND, rail=RAIL),
    "arm": finishing.arm.mounted(finishing.Arm.generic(), turntable=STAND),
}


def drawn(cell, count, seed):
    """Joints within the limits."""
    low, high = np.array(cell.position_min), np.array(cell.position_max)
    return low + (high - low) * np.random.default_rng(seed).random((count, len(low)))


@pytest.mark.parametrize("name", CELLS)
def test_the_work_sees_the_tool_from_where_it_was_moved(name):
    """Against products of shifts and turns, inverted as matrices; the table of an arm moves the axes on it."""
    cell = CELLS[name]
    count = len(cell.axes)
    for q in drawn(cell, 20, 1):
        work = np.eye(4)
        if name == "arm":
            work[:2, 3] = q[5:7]
        for axis, value in zip(cell.axes, q[-count:], strict=True):
            work = work @ moved(axis, value)
        tool = cell.robot.forward(q[:-count])
        np.testing.assert_array_equal(cell.forward(q), tool)
        np.testing.assert_allclose(cell.forward_work(q), np.linalg.inv(work) @ tool, atol=1e-9)
    np.testing.assert_allclose(
        cell.forward_work(drawn(cell, 6, 1).reshape(2, 3, -1)).reshape(6, 4, 4),
        cell.forward_work(drawn(cell, 6, 1)),
        atol=1e-12,
    )


@pytest.mark.parametrize("name", CELLS)
def test_own_joints_are_among_the_solutions(name):
    """At the positions of the axes that they have, between others; all solutions have the pose."""
    cell = CELLS[name]
    count = len(cell.axes)
    for q in drawn(cell, 12, 2):
        if name == "arm":  # an elbow that bends up, and the radius that it has
            q[2] = -abs(q[2])
            reach = 300 * np.cos(q[1]) + 250 * np.cos(q[1] + q[2])
            if reach < 1.0:
                continue
            inner = cell.robot.replace(wrist_radius=float(reach))
        else:
            inner = cell.robot
        axes = tuple(
            axis.replace(**{"angles" if axis.unit == "rad" else "positions": (0.1 + 0.5 * value, value)})
            for axis, value in zip(cell.axes, q[-count:], strict=True)
        )
        there = cell.replace(robot=inner, axes=axes)
        pose = there.forward_work(q)
        found = there.solutions([pose])[0]
        assert len(found) == 2**count * (4 if name == "arm" else 8)
        off = found - q
        turns = np.array([unit == "rad" for unit in cell.units])
        off[:, turns] -= 2 * np.pi * np.round(off[:, turns] / (2 * np.pi))
        assert np.nanmin(np.abs(off).max(axis=1)) < 1e-8  # some 1e-10, more next to singular poses
        known = found[~np.isnan(found).any(axis=1)]
        assert np.abs(there.forward_work(known) - pose).max() < 1e-6
        assert (np.isnan(found).any(axis=1) == np.isnan(found).all(axis=1)).all()


def test_candidates_of_the_first_axis_vary_slowest():
    cell = CELLS["ur10"]
    rail, angle = cell.redundancy
    assert (rail.name, len(rail.values), angle.name, len(angle.values)) == ("rail", 17, "turntable", 24)
    found = cell.solutions([cell.forward_work([0.3, -1.5, 1.8, -1.8, -1.5, 0.1, 0.0, 0.0])])[0]
    held = found.reshape(17, 24, 8, 8)
    there = ~np.isnan(held[..., 0])
    wanted = np.meshgrid(rail.values, angle.values, range(8), indexing="ij")
    for k in range(2):
        np.testing.assert_array_equal(held[..., 6 + k][there], wanted[k][there])


@pytest.mark.parametrize("name", CELLS)
def test_jacobian_against_differences(name):
    """Central differences over 1e-5: rounding of 1e-13 mm and the third derivative leave some 1e-7."""
    cell, step = CELLS[name], 1e-5
    for q in drawn(cell, 8, 3):
        found = cell.jacobian(q)
        for j in range(q.size):
            shift = step * np.eye(q.size)[j]
            after, before = cell.forward_work(q + shift), cell.forward_work(q - shift)
            turn = (after[:3, :3] - before[:3, :3]) @ cell.forward_work(q)[:3, :3].T / (2 * step)
            assert found[:3, j] == pytest.approx((after - before)[:3, 3] / (2 * step), abs=1e-6)
            assert found[3:, j] == pytest.approx([turn[2, 1], turn[0, 2], turn[1, 0]], abs=1e-9)


def test_members_and_files():
    cell = CELLS["ur10"]
    assert isinstance(cell, finishing.Robot) and decode(encode(cell)) == cell
    assert cell.names == (*UR10.names, "rail", "turntable") and cell.units == ("rad",) * 6 + ("mm", "rad")
    assert cell.position_max[-2:] == (400.0, 2 * np.pi) and cell.speed_max[-2:] == (400.0, 1.0)
    assert cell.jerk_max == (*UR10.jerk_max, 2e4, 50.0)
    assert finishing.arm.mounted(finishing.arm.mounted(UR10, rail=RAIL), turntable=STAND) == cell
    loose = UR10.replace(jerk_max=None)
    assert finishing.arm.mounted(loose, rail=RAIL.replace(jerk_max=None)).jerk_max is None
    joints = drawn(cell, 3, 4)
    for key, value in cell.singularities(joints).items():
        np.testing.assert_array_equal(value, UR10.singularities(joints[:, :6])[key])


def test_candidates():
    assert np.ptp(TABLE.candidates) == pytest.approx(2 * np.pi * 23 / 24) and 0.0 in TABLE.candidates
    part = TABLE.replace(position_min=-0.5, position_max=1.0, angles=4)
    assert part.candidates == pytest.approx((-0.5, 0.0, 0.5, 1.0)) and not part.around
    assert part.replace(angles=1).candidates == (0.25,)
    assert RAIL.candidates[::8] == (-400.0, 0.0, 400.0)
    assert RAIL.replace(positions=(3.0, 1.0)).candidates == (3.0, 1.0)


@pytest.mark.parametrize("angles", [(3.5,), (3.5, 3.8), (-6.1, -5.9, -5.6), (-3.1, 3.1)])
def test_a_table_stays_between_the_angles_that_are_given(angles):
    """Not a whole turn beside them, where a cable would be wound; nor by the way round from one to another."""
    table = STAND.replace(axis=(0, 0, 1), angles=angles)
    path = finishing.hilbert(finishing.surface.flat_surface(12.0), 1)
    problem = finishing.FinishingProblem(
        path, robot=finishing.arm.mounted(HELD, table=table), placement=(650.0, -25.0, 100.0)
    )
    found = finishing.plan(problem, method="trapezoid").joints[:, -1]
    assert min(angles) - 1e-9 <= found.min() and found.max() <= max(angles) + 1e-9


def test_all_round_where_a_robot_whose_work_rests_does_not_reach():
    """The tip along the ring, by the rows of the chain and the angle of the turntable alone."""
    with pytest.raises(ValueError, match=r"poses\[0\] is out of reach by 1\d\d\.?\d* mm, with \d\d.* %"):
        planned(robot=HELD)
    motion = planned()
    problem = motion.problem
    there = motion.at(np.linspace(0, motion.duration, 50))
    on = problem.path.at(there.length)
    for q, point, normal in zip(there.joints, on.point, on.normal, strict=True):
        back = np.linalg.inv(moved(TABLE, q[6]))
        pose = back @ HELD.forward(q[:6])
        tip = pose[:3, 3] + problem.lever_arm * pose[:3, 2] - problem.placement
        assert np.abs(tip - point).max() < 1e-4  # splines of the joints, steps of 0.25 mm
        assert np.arcsin(-pose[:3, 2] @ normal) == pytest.approx(problem.contact_angle, abs=1e-6)
    assert motion.error < 1e-4 and np.ptp(motion.joints[:, 6]) > 1.0
    around = on.point[:, [0, 2]] / 20.0
    assert np.linalg.norm(around, axis=1) == pytest.approx(np.ones(50), abs=1e-6)
    least = problem.path.length / problem.feed_rate
    assert least < motion.duration < 1.25 * least  # two rests at corners, without steps of the candidates
    assert min(motion.worst_singularity.each.values()) >= 0.1


def test_limits_at_40_places_a_piece():
    problem = ring()
    samples = joint_runs.samples_of(problem.path)
    runs = joint_runs.runs_of(samples, joint_runs.posture_of(problem, samples)[0].joints)
    limits, _ = joint_runs.limits_of(problem, "min_time")
    laws = time_laws(runs, limits, feed_rate=problem.feed_rate, method="min_time")
    worst = worst_violation(runs, laws, limits=limits, feed_rate=problem.feed_rate, refine=40)
    assert worst.ratio <= 1 + 1e-6 and limits.names[-1] == "turntable"


def test_steps_of_the_candidates_do_not_show():
    coarse, fine = (
        planned(robot=finishing.arm.mounted(HELD, turntable=TABLE.replace(angles=count))).duration
        for count in (24, 96)
    )
    assert coarse == pytest.approx(fine, rel=0.02)


def test_one_angle_is_a_turn_of_the_placement():
    """A turntable that is held, against the work turned about it by hand."""
    path = finishing.zigzag(finishing.preset("nominal").surface, pitch=24.0)
    place, turn = (650.0, -25.0, 100.0), 0.4
    upright = STAND.replace(axis=(0, 0, 1), angles=(turn,))
    base = finishing.FinishingProblem(path, robot=HELD, placement=place)
    motion = finishing.plan(base.replace(robot=finishing.arm.mounted(HELD, turntable=upright)))
    origin = moved(upright, turn) @ [*place, 1.0]
    turned = finishing.plan(base.replace(placement=(*origin[:3], turn), azimuth=turn))
    assert motion.posture.branch == turned.posture.branch
    np.testing.assert_allclose(motion.joints[:, 6], turn, atol=1e-13)
    assert motion.duration == pytest.approx(turned.duration, rel=1e-6)
    np.testing.assert_allclose(
        motion.at(np.linspace(0, 1, 9)).joints[:, :6], turned.at(np.linspace(0, 1, 9)).joints, atol=1e-6
    )


def test_a_rail_reaches_a_long_strip():
    """1300 mm across at 1400 mm ahead: both ends are out of reach, the middle is not."""
    net = [[[x, y, 0.0] for y in (0.0, 650.0, 1300.0)] for x in (0.0, 20.0)]
    path = finishing.zigzag(finishing.Surface.bspline(net, (1, 2)), pitch=15.0, along="v")
    base = finishing.FinishingProblem(path, robot=HELD, placement=(1400.0, -650.0, 100.0), feed_rate=100.0)
    with pytest.raises(ValueError, match="out of reach"):
        finishing.plan(base)
    motion = finishing.plan(base.replace(robot=finishing.arm.mounted(HELD, rail=RAIL)))
    assert motion.error < 1e-4 and np.ptp(motion.joints[:, 6]) > 100.0


def test_an_arm_over_its_table_on_a_turntable(tmp_path):
    """Eight joints; radius of the wrist and angle are chosen together."""
    path = finishing.zigzag(finishing.preset("nominal").surface, pitch=24.0)
    arm = finishing.Arm.generic().replace(wrist_radius=(320.0, 380.0))
    upright = STAND.replace(origin=(500.0, 0.0, 0.0), axis=(0, 0, 1))
    robot = finishing.arm.mounted(arm, turntable=upright)
    motion = finishing.plan(finishing.FinishingProblem(path, robot=robot, placement=(475.0, -25.0, 100.0)))
    assert motion.error < 1e-4 and motion.joints.shape[1] == 8 and motion.worst_violation.held
    motion.save(tmp_path / "arm.nc")
    back = sdpgrind.load(tmp_path / "arm.nc")
    assert back.posture == motion.posture and set(back.posture.free) == {"wrist_radius", "turntable"}


def test_saved_loaded_drawn(tmp_path):
    pytest.importorskip("matplotlib").use("agg")
    motion = planned()
    motion.save(tmp_path / "ring.nc")
    back = sdpgrind.load(tmp_path / "ring.nc")
    assert back.problem == motion.problem and back.posture == motion.posture
    assert set(back.posture.free) == {"turntable"}
    np.testing.assert_array_equal(back.posture.free["turntable"], motion.joints[:, 6])
    told = {
        text.get_text() for axis in motion.plot().axes if (box := axis.get_legend()) for text in box.texts
    }
    assert set(motion.problem.robot.names) <= told


def test_programs_over_time():
    motion = planned(method="trapezoid")
    for target in ("csv", "ros"):
        program = motion.program(target, name="ring")
        check = program.check()
        assert check.deviation <= 0.02 and check.joint_speed_excess <= 1e-6 and "turntable" in program.text


def test_the_cell_grinds_the_ring():
    motion = planned()
    controller = finishing.TorqueController(finishing.TorqueAxis(), motion, normal_force=1.0)
    outcome = hwsim.run(hwsim.FinishingCell(motion.problem), controller).outcome.isel(part=0)
    assert float(outcome["normal_force"]) == pytest.approx(1.0, abs=0.05)
    assert np.hypot(outcome["true_x"], 0).max() > 19.0


def test_weight_pulls_down_in_the_base():
    """Gravity does not turn with the work: the torque of a tool follows from its pose in the base."""
    motion = planned()
    problem = motion.problem
    tree = cKDTree(problem.path.sample().point)
    course = course_of(problem, motion.profile, tree, 2.0)
    pulls = [HELD.forward(q[:6])[2, 0] for q in motion.profile[:, 1:]]
    np.testing.assert_allclose(course[:, WEIGHT], 2.0 * np.array(pulls), atol=1e-12)
    assert np.abs(problem.robot.forward_work(motion.joints)[:, 2, 0] - motion.poses[:, 2, 0]).max() > 0.1


def test_turns_of_axis_are_by_the_right_hand():
    np.testing.assert_allclose(STAND.motions(0.7)[:3, :3], about(STAND.axis, 0.7), atol=1e-15)
