"""Calibrated robots: each Denavit-Hartenberg entry is off by up to 1 mm, 2 mrad; the inverse is numeric."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from robot_twins import LIMITS, UR10, apart, dh
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from sdpgrind import finishing
from sdpgrind.finishing import FinishingProblem, plan, zigzag
from sdpgrind.finishing.arm import _polish_kernels as kernels
from sdpgrind.finishing.placement._reach import reach_of
from sdpgrind.finishing.surface import flat_surface

Q = np.pi / 2
ROWS = {
    "axes 2, 3, 4 parallel": np.array([
        (0, 127.3, 0, Q), (0, 0, -612.0, 0), (0, 0, -572.3, 0), (0, 163.941, 0, Q), (0, 115.7, 0, -Q), (0, 92.2, 0, 0),
    ]),
    "spherical wrist": np.array([
        (0, 615.0, 100, -Q), (-Q, 0, 705.0, 0), (0, 0, 135.0, -Q), (0, 755.0, 0, Q), (0, 0, 0, -Q), (0, 85.0, 0, 0),
    ]),
}  # fmt: skip
MOST = np.array([2e-3, 1.0, 1.0, 2e-3])
FAR = np.sin(0.05)
CLOSE = 1e-8
"""rad: an error of 1e-9 mm at a link of 100 mm, over a sine of 0.05 in each of two factors, is 4e-9."""


def robot_of(rows):
    return finishing.SerialRobot.from_dh(rows, **LIMITS)


def calibrated(form, seed):
    """Rows off by up to the most; of seed 0 all by the most."""
    share = np.random.default_rng(seed).uniform(-1, 1, (6, 4))
    return ROWS[form] + MOST * (np.sign(share) if seed == 0 else share)


def pose_of(rows, q):
    """Pose of the flange by products of rows."""
    out = np.eye(4)
    for (theta, d, a, alpha), angle in zip(rows, q, strict=True):
        out = out @ dh(theta + angle, d, a, alpha)
    return out


def away(robot, joints):
    return np.min(list(robot.singularities(joints).values()), axis=0) > FAR


def joints_away(robot, count, seed):
    joints = np.random.default_rng(seed).uniform(-np.pi, np.pi, (4 * count, 6))
    return joints[away(robot, joints)][:count]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("form", ROWS)
def test_own_joints_are_among_solutions_that_all_reach_the_pose(form, seed):
    rows = calibrated(form, seed)
    robot, nominal = robot_of(rows), robot_of(ROWS[form])
    assert robot.closed_form == f"{form}, calibrated: numeric" and nominal.closed_form == form
    joints = joints_away(nominal, 300, seed)
    poses = np.array([pose_of(rows, q) for q in joints])
    found = robot.solutions(poses)
    assert np.nanmin(apart(found, joints[:, None]), axis=1).max() <= CLOSE
    for k in range(0, 300, 15):
        those = found[k][~np.isnan(found[k, :, 0])]
        for i, q in enumerate(those):
            np.testing.assert_allclose(pose_of(rows, q), poses[k], rtol=0, atol=1e-9)
            assert i == 0 or apart(those[:i], q).min() > 1e-6
    # branches of the nominal robot, but for those at the very end of reach
    about = nominal.solutions(poses)
    there = ~np.isnan(about[..., 0])
    there[there] = np.abs(np.sin(nominal._form.zeros[2] + about[there][:, 2])) > 0.25
    there[there] = away(nominal, about[there])
    assert there.sum() > 1500 and not np.isnan(found[there]).any()


@pytest.mark.parametrize("form", ROWS)
def test_a_branch_that_is_lost_is_not_there(form):
    """Nearly straight arms: from many starts nothing of the branch is found by another solver either."""
    rows = calibrated(form, 0)
    robot, nominal = robot_of(rows), robot_of(ROWS[form])
    joints = joints_away(nominal, 300, 3)
    joints[:, 2] = 0.07 - nominal._form.zeros[2]
    poses = np.array([pose_of(ROWS[form], q) for q in joints])
    lost = np.argwhere(np.isnan(robot.solutions(poses)[..., 0]) & ~np.isnan(nominal.solutions(poses)[..., 0]))
    assert len(lost) > 5
    rng = np.random.default_rng(0)
    for i, b in lost[:: len(lost) // 3]:
        start = nominal.solutions(poses[i : i + 1])[0, b]
        for move in rng.normal(0, 0.2, (2, 6)):
            found = least_squares(
                left, start + move, args=(rows, poses[i]), xtol=1e-14, ftol=1e-14, max_nfev=50
            )
            new = np.abs(found.fun).max() < 1e-6
            assert not new or np.nanmin(apart(robot.solutions(poses[i : i + 1])[0], found.x)) < 1e-4


def left(q, rows, target):
    """Remaining translation, mm, and rotation vector, times 100 mm."""
    pose = pose_of(rows, q)
    turn = Rotation.from_matrix(target[:3, :3] @ pose[:3, :3].T).as_rotvec()
    return np.concatenate([target[:3, 3] - pose[:3, 3], 100 * turn])


@settings(max_examples=30, deadline=None)
@given(
    form=st.sampled_from(list(ROWS)),
    share=arrays(float, (6, 4), elements=st.floats(-1, 1)),
    seed=st.integers(0, 2**31),
)
def test_whatever_the_calibration(form, share, seed):
    rows = ROWS[form] + MOST * share
    robot = robot_of(rows)
    joints = joints_away(robot_of(ROWS[form]), 20, seed)
    found = robot.solutions(robot.forward(joints))
    assert np.nanmin(apart(found, joints[:, None]), axis=1).max() <= CLOSE


@pytest.mark.parametrize("form", ROWS)
def test_the_nearest_closed_form(form):
    """As near as the calibration: a sum of 1 mm and 2 mrad times what is left of the arm, joint by joint."""
    robot = robot_of(calibrated(form, 1))
    near = robot.nearest_closed_form
    assert near.closed_form == form and near.names == robot.names and near.nearest_closed_form is near
    rest = np.zeros(6)
    np.testing.assert_allclose(near.forward(rest), robot.forward(rest), rtol=0, atol=1e-11)
    joints = np.random.default_rng(1).uniform(-3, 3, (200, 6))
    off = near.forward(joints) - robot.forward(joints)
    bound = sum(1.8 + 2.9e-3 * np.abs(ROWS[form][k:, 1:3]).sum() for k in range(6))
    assert 0.1 < np.linalg.norm(off[:, :3, 3], axis=1).max() < bound
    # the form of the robot nearby is that of its links: they solve its poses exactly
    found = near.solutions(near.forward(joints))
    assert np.nanmin(apart(found, joints[:, None]), axis=1)[away(near, joints)].max() < 1e-10


def test_the_nearest_closed_form_is_the_robot_itself_where_it_has_it():
    assert UR10.nearest_closed_form is UR10


def test_offsets_along_parallel_axes_do_not_matter():
    """Vendors' calibrations put hundreds of mm along axis 2 and take them back along axis 3."""
    rows = calibrated("axes 2, 3, 4 parallel", 1)
    rows[1, 1] += 250.0
    rows[2, 1] -= 250.0
    robot = robot_of(rows)
    joints = joints_away(robot, 200, 5)
    found = robot.solutions(np.array([pose_of(rows, q) for q in joints]))
    assert np.nanmin(apart(found, joints[:, None]), axis=1).max() <= CLOSE


def test_a_lost_branch_begins_at_the_pose_before():
    robot = robot_of(calibrated("axes 2, 3, 4 parallel", 1))
    course = np.linspace([0.3, -1.5, 1.8, -1.8, -1.5, 0.1], [0.5, -1.3, 1.5, -1.9, -1.3, 0.4], 30)
    poses = robot.forward(course)
    poses[20:, 0, 3] += 60.0  # a jump
    joints, left_over = np.full((30, 2, 6), np.nan), np.zeros((30, 2))
    joints[0, 0] = course[0]
    kernels.pursue(robot.links, robot._slides, poses, joints, left_over, 1e-9)
    np.testing.assert_allclose(joints[:20, 0], course[:20], rtol=0, atol=CLOSE)
    assert np.isnan(joints[20:]).all() and np.isnan(joints[:, 1]).all()
    joints[1:20, 0], joints[0, 1], joints[1:20, 1] = np.nan, course[0], course[1:20]
    kernels.pursue(robot.links, robot._slides, poses, joints, left_over, 1e-9)
    assert np.isnan(joints[1:20, 0]).all()  # it is the other branch


def test_a_motion_of_a_calibrated_robot_keeps_its_points():
    rows = calibrated("axes 2, 3, 4 parallel", 2)
    path = zigzag(flat_surface(20.0), 8.0)
    motion = plan(
        FinishingProblem(path, robot=robot_of(rows), placement=(650.0, -25.0, 100.0), feed_rate=20.0)
    )
    assert motion.worst_violation.held
    poses = np.array([pose_of(rows, q) for q in motion.joints[::20]])
    np.testing.assert_allclose(poses, motion.poses[::20], rtol=0, atol=1e-6)


@pytest.mark.parametrize("form", ROWS)
def test_no_pose_is_farther_than_the_reach_of_proofs(form):
    robot = robot_of(calibrated(form, 0))
    reach = reach_of(robot)
    joints = np.random.default_rng(4).uniform(-np.pi, np.pi, (2000, 6))
    joints[:1000, 2:4] = 0.0
    poses = robot.forward(joints)
    there = poses[:, :3, :3] @ reach.point + poses[:, :3, 3] - reach.foot
    assert np.linalg.norm(there, axis=1).max() <= reach.distance


def test_an_offset_wrist_is_refused_by_its_axes():
    rows = ROWS["spherical wrist"].copy()
    rows[4, 2] = 30.0
    with pytest.raises(
        ValueError,
        match=r"robot must have, to 0\.005 rad and 5 mm, a spherical wrist \(axes 4, 5, 6 must meet in a point, off by 30 mm\)",
    ):
        _ = robot_of(rows).nearest_closed_form
