"""Motions of a tool that turns about its own axis: poses, travel, laws, files, programs, and the arm."""

import numpy as np
import pytest
from finishing_inside import lifted, read_text
from scipy.spatial.transform import Rotation
from spin_motions import PLACE, STRAIGHT, TILTED, planned, problem

import sdpgrind
from sdpgrind import finishing, units
from sdpgrind.base.stored import encode


def about_z(angle):
    """Rotations about z, rad."""
    return Rotation.from_rotvec(np.multiply.outer(angle, [0.0, 0.0, 1.0])).as_matrix()


def travel(joints, robot):
    return float((np.abs(np.diff(joints, axis=0)) / robot.speed_max).max(axis=1).sum())


@pytest.mark.parametrize("angle", [90, 60])
def test_poses_are_those_of_the_problem_turned_about_their_axis(angle):
    motion = planned(contact_angle=units.deg(angle))
    there = motion.problem.path.at(motion.length)
    wanted = motion.problem.tool_poses(there)
    wanted[:, :3, 3] += PLACE
    turned = wanted[:, :3, :3] @ about_z(motion.spin)
    np.testing.assert_allclose(motion.poses[:, :3, 3], wanted[:, :3, 3], atol=2e-4)
    np.testing.assert_allclose(motion.poses[:, :3, :3], turned, atol=1e-5)
    assert np.ptp(motion.spin) > 0.2 and motion.error < 1e-4 and motion.worst_violation.held
    assert min(motion.worst_singularity.each.values()) >= 0.1
    np.testing.assert_array_equal(motion.posture.free["spin"], motion.spin)


def test_travel_is_less_than_with_any_turn_that_is_held():
    """24 turns and all branches, followed pose by pose in plain numpy."""
    motion, robot = planned(pitch=12.0), TILTED
    samples = motion.problem.path.sample(per_leg=8)
    poses = motion.problem.tool_poses(samples)
    poses[:, :3, 3] += PLACE
    times = []
    for angle in np.arange(24) * np.pi / 12:
        turned = poses.copy()
        turned[:, :3, :3] = poses[:, :3, :3] @ about_z(angle)
        courses = np.unwrap(np.moveaxis(robot.solutions(turned), 1, 0), axis=1)
        times += [travel(course, robot) for course in courses if np.isfinite(course).all()]
    assert travel(motion.joints, robot) < 0.96 * min(times)


def test_a_straight_tool_leaves_the_last_joint_at_rest():
    """Its axis is that of joint 6: the others are given by the path, and none of them can be spared."""
    motion, held = planned(robot=STRAIGHT), planned(robot=STRAIGHT, spin=())
    assert motion.posture.branch == held.posture.branch
    inner = motion.joints[:, :5] * np.ones(5)
    assert travel(motion.joints, STRAIGHT) == pytest.approx(
        float((np.abs(np.diff(inner, axis=0)) / STRAIGHT.speed_max[:5]).max(axis=1).sum()), rel=2e-3
    )
    assert np.ptp(motion.joints[:, 5]) < 0.01 < 0.5 < np.ptp(held.joints[:, 5])
    assert travel(motion.joints, STRAIGHT) < 0.96 * travel(held.joints, STRAIGHT)


def test_steps_of_the_candidates_do_not_show():
    """Laws of limited jerk with 24 and 96 turns, and faster than a tool that is held."""
    base = problem(pitch=25.0, feed_rate=100.0)
    coarse, fine, held = (
        finishing.plan(base.replace(spin=spin), method="min_time").duration for spin in (24, 96, ())
    )
    assert coarse <= 1.01 * fine
    assert max(coarse, fine) < 0.99 * held


def test_turns_stay_between_given_angles():
    free, bound = planned(), planned(spin=(0.0, 0.1, 0.2, 0.3))
    assert free.spin.max() > 0.3 + 0.1 or free.spin.min() < -0.1
    assert bound.spin.min() >= -1e-9 and bound.spin.max() <= 0.3 + 1e-9


def test_one_turn_is_held():
    one, held = planned(spin=(0.4,)), planned(spin=())
    np.testing.assert_allclose(one.spin, 0.4, atol=1e-12)
    assert one.duration > 0.0 and "spin" in one.dataset and "spin" not in held.dataset
    assert np.array_equal(held.spin, np.zeros(len(held.time)))


def test_the_arm_is_held_where_that_is_faster():
    """A turn of the tool is joint 5 of the generic arm, whose radius a path then keeps, as without spin."""
    path = finishing.zigzag(finishing.preset("nominal").surface, pitch=24.0)
    arm = finishing.Arm.generic().replace(wrist_radius=(300.0, 350.0, 400.0))
    base = finishing.FinishingProblem(path, robot=arm)
    held, free = finishing.plan(base), finishing.plan(base.replace(spin=(-0.2, 0.0, 0.2)))
    assert free.duration <= held.duration * (1 + 1e-9) and free.error < 1e-3
    assert set(free.posture.free) == {"spin", "wrist_radius"}
    radius = np.hypot(*(free.joints[:, 5:] + free.poses[:, :2, 3] - free.joints[:, 5:]).T)
    reach = radius - arm.d5 * np.hypot(*free.poses[:, :2, 2].T)
    np.testing.assert_allclose(reach, free.posture.free["wrist_radius"], atol=1e-6)


def test_files(tmp_path):
    motion = planned()
    motion.save(tmp_path / "spun.nc")
    loaded = sdpgrind.load(tmp_path / "spun.nc")
    assert loaded.problem.spin == 24 and loaded.posture == motion.posture
    np.testing.assert_array_equal(loaded.spin, motion.spin)
    assert loaded.dataset["spin"].attrs["units"] == "rad"


def test_a_tool_that_is_held_is_written_as_before():
    text = encode(problem(spin=()))
    assert "spin" not in text and '"spin": 24' in encode(problem())
    assert sdpgrind.base.stored.decode(text).spin == ()


def test_picture_and_report(tmp_path, pyplot):
    spun, held = planned(), planned(spin=())
    labels = {axis.get_ylabel() for axis in spun.plot().axes} - {
        axis.get_ylabel() for axis in held.plot().axes
    }
    assert labels == {"turn of tool [rad]"}
    spun.report(tmp_path / "spun.html")
    assert "turn of the tool" in (tmp_path / "spun.html").read_text()


@pytest.mark.filterwarnings("ignore:.* is not the language of the")
@pytest.mark.parametrize("target", ["urscript", "rapid", "krl", "csv"])
@pytest.mark.parametrize("angle", [90, 60])
def test_programs(target, angle):
    motion = planned(contact_angle=units.deg(angle))
    program = motion.program(target, deviation=0.1)
    found = program.check()
    assert found.deviation <= 0.1 and found.angle_deviation < 1e-3 and found.feed_excess < 1e-4


def test_programs_of_another_turn_are_found():
    """A program is compared with the poses as planned: with another turn of the tool it is off, or in joints."""
    motion, other = planned(), planned(spin=(0.4,))
    read = read_text(motion.program("urscript", deviation=0.1).text)
    turned = np.abs(motion.spin - 0.4).max()
    assert read.check(other).angle_deviation == pytest.approx(turned, abs=0.02)
    assert read.check(motion).angle_deviation < 1e-3


def test_programs_start_above_the_work():
    """20 mm along the normal, of which a turned tool that leans knows by its turn alone."""
    motion = planned(contact_angle=units.deg(60))
    program = motion.program("urscript", timing=True)
    assert program.check().deviation < 0.02
    tip = [
        TILTED.forward(q) @ [0, 0, motion.problem.lever_arm, 1] for q in (motion.joints[0], lifted(motion, 0))
    ]
    normal = motion.problem.path.at([0.0]).normal[0]
    np.testing.assert_allclose(tip[1][:3] - tip[0][:3], 20.0 * normal, atol=1e-3)
