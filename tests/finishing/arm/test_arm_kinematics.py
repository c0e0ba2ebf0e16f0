"""Forward, Jacobian, inverse and least squares of the arm against products of links and differences."""

import numpy as np
import pytest
from arm_twins import GENERIC, WIDE, chain, inverse, random_poses, turned
from finishing_inside import kinematics_kernels as kernels
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.base import stored
from sdpgrind.finishing import Arm

LOW, HIGH = np.array(GENERIC.position_min), np.array(GENERIC.position_max)


def joints_within(rng, count):
    return rng.uniform(LOW, HIGH, (count, 7))


def test_generic_arm_is_the_one_that_is_documented():
    assert GENERIC.lengths == (400.0, 300.0, 250.0, 100.0)
    assert np.degrees(LOW[:5]) == pytest.approx([-165, -30, -150, -150, -180])
    assert np.degrees(HIGH[:5]) == pytest.approx([165, 110, 0, 150, 180])
    assert (GENERIC.position_min[5:], GENERIC.position_max[5:]) == ((-200.0, -200.0), (200.0, 200.0))
    assert GENERIC.speed_max == (1.5,) * 5 + (200.0,) * 2
    assert GENERIC.acceleration_max == (8.0,) * 5 + (2000.0,) * 2
    assert GENERIC.jerk_max == pytest.approx((80.0,) * 5 + (20000.0,) * 2)
    assert dict(zip(GENERIC.names, GENERIC.units, strict=True)) == {
        **dict.fromkeys(GENERIC.names[:5], "rad"),
        "X": "mm",
        "Y": "mm",
    }


def test_arm_survives_a_file():
    arm = GENERIC.replace(d5=123.4)
    assert stored.decode(stored.encode(arm)) == arm
    assert hash(stored.decode(stored.encode(arm))) == hash(arm)


def test_forward_is_the_product_of_links():
    joints = joints_within(np.random.default_rng(1), 300)
    expected = np.array([chain(q) for q in joints])
    # some ten roundings of 1000 mm
    assert np.abs(GENERIC.forward_work(joints) - expected).max() < 1e-12 * 1000
    at_zero = joints * ([1.0] * 5 + [0.0] * 2)
    assert np.array_equal(GENERIC.forward(joints), GENERIC.forward_work(at_zero))
    assert np.array_equal(GENERIC.forward(joints[:, :5]), GENERIC.forward(joints))


def test_forward_takes_any_shape():
    joints = joints_within(np.random.default_rng(2), 6)
    assert np.array_equal(GENERIC.forward(joints.reshape(2, 3, 7)).reshape(6, 4, 4), GENERIC.forward(joints))
    assert GENERIC.forward(joints[0]).shape == (4, 4)


def test_tool_frame_stands_on_the_last_axis():
    """z_P is the axis of the fifth joint, y_P at q5 = 0 that of the three parallel ones: it lies level."""
    q = joints_within(np.random.default_rng(3), 1)[0]
    frames = chain(q, frames=True)
    assert GENERIC.forward(q)[:3, 2] == pytest.approx(frames[3][:3, 2], abs=1e-14)
    level = GENERIC.forward(q * ([1.0] * 4 + [0.0] + [1.0] * 2))[:3, 1]
    assert level == pytest.approx(frames[0][:3, 2], abs=1e-14)  # z1, of the second joint
    assert level[2] == 0.0


def test_jacobian_is_that_of_differences():
    """Central differences of 1e-4: truncation 1e-9 of 1000 mm, rounding 1e-13/1e-4 of it."""
    step = 1e-4
    for q in joints_within(np.random.default_rng(4), 20):
        found = GENERIC.jacobian(q, motor=True)
        pose = chain(q)
        for j in range(8):
            move = step * np.eye(8)[j]
            ahead, behind = chain(q + move[:7], move[7]), chain(q - move[:7], -move[7])
            slope = (ahead - behind) / (2 * step)
            spin = slope[:3, :3] @ pose[:3, :3].T
            assert found[:3, j] == pytest.approx(slope[:3, 3], abs=1e-5)
            assert found[3:, j] == pytest.approx([spin[2, 1], spin[0, 2], spin[1, 0]], abs=1e-8)
        assert np.array_equal(GENERIC.jacobian(q), found[:, :7])


def rank(jacobian):
    """Rank with lengths in units of 300 mm."""
    scaled = (
        jacobian
        / np.array([300.0] * 3 + [1.0] * 3)[:, None]
        * np.array([1.0] * 5 + [300.0] * 2 + [1.0])[: jacobian.shape[1]]
    )
    return int(np.linalg.matrix_rank(scaled, tol=1e-9))


def place_and_axis(q, jacobian):
    """Velocities of the position and of the direction of the tool's axis."""
    axis = chain(q)[:3, 2]
    cross = np.array([[0, axis[2], -axis[1]], [-axis[2], 0, axis[0]], [axis[1], -axis[0], 0]])
    return np.vstack([jacobian[:3], cross @ jacobian[3:]])


def test_ranks_are_the_mobility_of_arm_table_and_motor():
    for q in joints_within(np.random.default_rng(5), 20):
        full = GENERIC.jacobian(q, motor=True)
        assert [rank(full[:, :5]), rank(full[:, :7]), rank(full)] == [5, 6, 6]
        assert rank(place_and_axis(q, full[:, :5])) == 4
        assert rank(place_and_axis(q, full[:, :7])) == 5  # all there is: three of place, two of direction


def test_one_freedom_in_excess_is_the_radius_of_the_wrist():
    """Along the null space the pose stays and the wrist's radius changes."""
    q = np.array([0.3, 0.4, -1.2, 0.2, 0.5, 10.0, -20.0])
    null = np.linalg.svd(GENERIC.jacobian(q))[2][-1]

    def radius(joints):
        return 300 * np.cos(joints[1]) + 250 * np.cos(joints[1] + joints[2])

    step = 1e-3 * null / np.abs(null[:5]).max()
    drift = np.abs(chain(q + step) - chain(q - step)).max()
    assert abs(radius(q + step) - radius(q - step)) > 100 * drift


def test_a_vertical_tool_loses_one_freedom():
    q = np.array([0.3, 0.4, -1.2, 0.8 - np.pi / 2, 0.5, 10.0, -20.0])
    assert chain(q)[2, 2] == pytest.approx(-1.0, abs=1e-15)
    assert rank(GENERIC.jacobian(q)) == 5


def test_every_branch_takes_random_poses():
    """1e5 poses, each in four branches: forward of inverse."""
    poses = random_poses(np.random.default_rng(6), 100_000)
    joints, reachable = WIDE.branches(poses, continuous=False)
    assert reachable.all()
    for branch in range(4):
        back = WIDE.forward_work(joints[branch])
        assert np.abs(back[:, :3, 3] - poses[:, :3, 3]).max() <= 1e-9
        assert np.abs(back[:, :3, :3] - poses[:, :3, :3]).max() <= 1e-12


def test_branches_are_the_equations():
    poses = random_poses(np.random.default_rng(7), 300)
    joints, _ = WIDE.branches(poses, continuous=False)
    for branch in range(4):
        for pose, found in zip(poses, joints[branch], strict=True):
            expected = inverse(pose, 350.0, branch)
            # arcsin and arccos lose half the digits at 1
            assert np.abs(turned(found[:5] - expected[:5])).max() < 1e-6
            assert found[5:] == pytest.approx(expected[5:], abs=1e-8)


def test_branches_are_what_they_are_called():
    poses = random_poses(np.random.default_rng(8), 500)
    joints, _ = WIDE.branches(poses, continuous=False)
    azimuth, pitch = np.arctan2(poses[:, 1, 2], poses[:, 0, 2]), np.cos(joints[:, :, 1:4].sum(axis=2))
    assert np.all(joints[::2, :, 2] <= 0) and np.all(joints[1::2, :, 2] >= 0)
    assert np.all(pitch[:2] >= 0) and np.all(pitch[2:] <= 0)
    assert np.abs(turned(joints[:2, :, 0] - azimuth)).max() < 1e-12
    assert np.abs(np.abs(turned(joints[2:, :, 0] - azimuth)) - np.pi).max() < 1e-12


def test_reachable_says_whether_limits_are_kept():
    poses = random_poses(np.random.default_rng(9), 5000, radius=300.0)
    joints, reachable = GENERIC.branches(poses, wrist_radius=300.0, continuous=False)
    kept = np.all((joints >= LOW) & (joints <= HIGH), axis=2)
    assert np.array_equal(reachable, kept)
    assert reachable[0].any() and reachable[2].any() and not reachable[1].any() and not reachable[3].any()
    for branch in (0, 2):
        some = poses[reachable[branch]]
        assert np.array_equal(
            GENERIC.inverse(some, wrist_radius=300.0, branch=branch, continuous=False),
            joints[branch][kept[branch]],
        )


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=7, max_size=7))
def test_joints_come_back(shares):
    """Inverse of forward, at the wrist radius the joints have, in the branch they are in."""
    q = np.array(shares) * [2.5, 1.2, 2.5, 2.9, 2.9, 100.0, 100.0]
    radius = 300 * np.cos(q[1]) + 250 * np.cos(q[1] + q[2])
    pitch = np.cos(q[1] + q[2] + q[3])
    if radius < 20 or abs(pitch) < 0.05 or abs(np.sin(q[2])) < 0.05:
        return
    branch = (2 if pitch < 0 else 0) + (1 if q[2] > 0 else 0)
    found = WIDE.inverse([chain(q)], wrist_radius=radius, branch=branch)[0]
    assert np.abs(turned(found[:5] - q[:5])).max() < 1e-9
    assert found[5:] == pytest.approx(q[5:], abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.floats(-3, 3), st.integers(0, 3))
def test_turning_the_work_about_the_base_turns_the_first_joint(angle, branch):
    poses = random_poses(np.random.default_rng(10), 5)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    before, after = (
        WIDE.branches(poses, continuous=False)[0][branch],
        WIDE.branches(turn @ poses, continuous=False)[0][branch],
    )
    assert np.abs(turned(after[:, 0] - before[:, 0] - angle)).max() < 1e-9
    assert np.abs(turned(after[:, 1:5] - before[:, 1:5])).max() < 1e-9
    assert after[:, 5:] == pytest.approx(before[:, 5:] @ turn[:2, :2].T, abs=1e-9)


def circle(count, tilt=-0.5, turns=1.0, begin=0.0):
    """Poses whose axis goes around, tilted out of the vertical."""
    q = np.zeros((count, 7))
    q[:, 0] = begin + np.linspace(0, 2 * np.pi * turns, count)
    q[:, 1:4] = 0.4, -1.2, tilt + 0.8
    q[:, 5:] = 1.0, 2.0
    return WIDE.forward_work(q), q


def test_angles_go_on_from_pose_to_pose():
    poses, q = circle(200, turns=0.9, begin=2.0)
    arm = WIDE.replace(
        position_min=(-1.0, *WIDE.position_min[1:]), position_max=(9.0, *WIDE.position_max[1:])
    )
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    assert arm.inverse(poses, wrist_radius=radius) == pytest.approx(q, abs=1e-9)


@pytest.mark.parametrize("begin", [-9.0, -3.0, 0.0, 3.0, 8.0])
def test_a_path_lies_as_near_to_the_middle_of_the_limits_as_whole_turns_let_it(begin):
    poses, _ = circle(100, turns=0.4, begin=begin)
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    two_turns = WIDE.replace(
        position_min=(-6.5, *WIDE.position_min[1:]), position_max=(6.5, *WIDE.position_max[1:])
    )
    found = two_turns.inverse(poses, wrist_radius=radius)[:, 0]
    assert np.abs(np.diff(found)).max() < 0.1
    assert abs(found[0] + found[-1]) / 2 <= np.pi


def test_one_and_a_half_turns_fit_no_range_of_one():
    poses, _ = circle(400, turns=1.5)
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    joints, reachable = WIDE.branches(poses, wrist_radius=radius)
    assert np.ptp(joints[0, :, 0]) == pytest.approx(3 * np.pi, abs=1e-9)
    assert not reachable[0].all()
    assert WIDE.branches(poses, wrist_radius=radius, continuous=False)[1][0].all()


def test_vertical_tool_keeps_the_first_joint_and_turns_the_last():
    """The path tilts up to the vertical and then spins: q1 rests where it was, q5 takes the spin."""
    tilt = np.concatenate([np.linspace(-0.9, -np.pi / 2, 30), np.full(30, -np.pi / 2)])
    q = np.zeros((60, 7))
    q[:, 0], q[:, 1], q[:, 2], q[:, 3] = 0.7, 0.4, -1.2, tilt + 0.8
    q[:30, 0] = np.linspace(0.2, 0.7, 30)
    q[30:, 4] = np.linspace(0, 1.0, 30)
    poses = np.array([chain(each) for each in q])
    poses[29:, :2, 2] = 0.0  # rounding of cos(pi/2) taken off: nothing is left to tell the azimuth
    poses[29:, 2, :2] = 0.0
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    for branch in (0, 2):
        found = WIDE.branches(poses, wrist_radius=radius)[0][branch]
        assert np.ptp(found[28:, 0]) < 0.02  # one step of the first 30
        assert np.ptp(found[29:, 0]) == 0.0
        assert np.diff(found[30:, 4]) == pytest.approx(np.diff(q[30:, 4]), abs=1e-9)
        assert np.abs(WIDE.forward_work(found) - poses).max() < 1e-9
    poses[29:] = poses[28]  # without the spin: the same joints throughout
    poses[29:, :3, :3] = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
    resting = WIDE.inverse(poses, wrist_radius=radius)[29:]
    assert np.ptp(resting, axis=0) == pytest.approx(np.zeros(7), abs=1e-12)


def test_vertical_tool_at_the_begin_takes_the_azimuth_to_come():
    tilt = np.concatenate([np.full(5, np.pi / 2), np.linspace(1.4, 0.9, 5)])
    q = np.zeros((10, 7))
    q[:, 0], q[:, 1], q[:, 2], q[:, 3] = -2.0, 0.4, -1.2, tilt + 0.8
    poses = np.array([chain(each) for each in q])
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    assert WIDE.inverse(poses, wrist_radius=radius)[:, 0] == pytest.approx(np.full(10, -2.0), abs=1e-9)
    always = WIDE.inverse(poses[:5], wrist_radius=radius)  # vertical throughout: the middle of the limits
    assert always[:, 0] == pytest.approx(np.zeros(5), abs=1e-12)
    assert np.abs(WIDE.forward_work(always) - poses[:5]).max() < 1e-9


@pytest.mark.parametrize("size", [550.0, 50.0])
def test_a_stretched_and_a_folded_arm(size):
    """|cos q3| = 1: elbow up and down meet; beyond by more than rounding is out of reach."""
    radius = 0.6 * size
    pose = chain([0.2, 0.1, -0.5, 0.3, 0.4, 0.0, 0.0])
    pose[2, 3] = 400.0 + 100.0 * pose[2, 2] + 0.8 * size
    joints, reachable = WIDE.branches([pose], wrist_radius=radius)
    assert reachable.all()
    assert np.abs(turned(joints[0, 0, :5] - joints[1, 0, :5])).max() < 1e-5  # sqrt of rounding
    assert np.abs(WIDE.forward_work(joints) - pose).max() < 1e-9
    pose[2, 3] += 1e-6 if size > 300 else -1e-6
    joints, reachable = WIDE.branches([pose], wrist_radius=radius)
    assert not reachable.any() and np.isfinite(joints).all()


def test_nothing_is_done_for_no_pose():
    assert GENERIC.inverse(np.empty((0, 4, 4))).shape == (0, 7)
    assert GENERIC.branches(np.empty((0, 4, 4)))[1].shape == (4, 0)


def test_kernels_along_a_path_are_sums_and_comparisons():
    rng = np.random.default_rng(13)
    speed = np.array(GENERIC.speed_max)
    for _ in range(50):
        joints, reached = rng.uniform(1.02 * LOW, 0.98 * HIGH, (8, 7)), rng.random(8) > 0.05
        bad = np.flatnonzero(~reached | np.any((joints < LOW) | (joints > HIGH), axis=1))
        assert kernels.first_beyond(joints, reached, LOW, HIGH) == (bad[0] if bad.size else -1)
        way = np.abs(np.diff(joints, axis=0))
        jumps = np.flatnonzero(np.any(way[:, :5] > 4.0, axis=1))
        time, at = kernels.travel(joints, speed, np.arange(7) < 5, 4.0)
        assert time == pytest.approx(np.sum(np.max(way / speed, axis=1)), rel=1e-14)
        assert at == (jumps[0] if jumps.size else -1)


def test_least_squares_find_poses_from_nearby():
    rng = np.random.default_rng(11)
    q = rng.uniform(0.8 * LOW + 0.2 * HIGH, 0.2 * LOW + 0.8 * HIGH, (40, 7))
    for each in q:
        start = np.clip(each + rng.normal(size=7) * ([0.15] * 5 + [20.0] * 2), LOW, HIGH)
        found = GENERIC.solve(chain(each), start)
        assert np.abs(chain(found) - chain(each)).max() < 1e-9
        assert np.all((found >= LOW) & (found <= HIGH))


def test_least_squares_find_the_wrist_radius_that_is_nearest():
    """The closed form at all radii: none of its joints lies much nearer to the start."""
    start = np.array([0.1, 0.5, -1.3, 0.2, 0.1, 5.0, 5.0])
    pose = chain(start + np.array([0.05, 0.04, -0.06, 0.05, 0.03, 3.0, -4.0]))
    weights = np.array([1.0] * 5 + [100.0] * 2)
    found = GENERIC.solve(pose, start)
    ways = [
        np.linalg.norm((WIDE.inverse([pose], wrist_radius=r)[0] - start) / weights)
        for r in np.linspace(300, 450, 601)
    ]
    assert np.linalg.norm((found - start) / weights) <= 1.02 * min(ways)


def test_least_squares_beside_a_singular_pose():
    """A tool nearly vertical whose azimuth goes the other way: the closed form turns q1 by half a turn, these
    do not.
    """
    q = np.array([0.3, 0.4, -1.2, 0.8 - np.pi / 2 + 1e-4, 0.5, 10.0, -20.0])
    beyond = q - [0, 0, 0, 2e-4, 0, 0, 0]
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    assert abs(WIDE.inverse([chain(beyond)], wrist_radius=radius)[0, 0] - q[0]) > 3
    found = GENERIC.solve(chain(beyond), q)
    assert found[:5] == pytest.approx(q[:5], abs=1e-3)
    assert found[5:] == pytest.approx(q[5:], abs=0.1)
    assert np.abs(chain(found) - chain(beyond)).max() < 1e-9


def test_least_squares_stay_within_limits():
    """The start's shortest way leads through a limit of q3: another wrist radius is taken."""
    q = np.array([0.0, 0.5, -0.05, -0.5, 0.0, 0.0, 0.0])
    narrow = GENERIC.replace(position_max=(*GENERIC.position_max[:2], -0.3, *GENERIC.position_max[3:]))
    found = narrow.solve(chain(q), [0.0, 0.5, -0.4, -0.5, 0.0, 0.0, 0.0])
    assert found[2] <= -0.3
    assert np.abs(chain(found) - chain(q)).max() < 1e-9


def test_least_squares_with_joints_at_their_limits():
    """Two joints in seven of what is looked for are at a limit; clipping the steps alone finds three in four."""
    rng, missed = np.random.default_rng(3), 0
    for _ in range(60):
        q = rng.uniform(LOW, HIGH)
        q = np.where(rng.random(7) < 0.3, np.where(rng.random(7) < 0.5, LOW, HIGH), q)
        start = np.clip(q + rng.normal(size=7) * ([0.3] * 5 + [40.0] * 2), LOW, HIGH)
        try:
            found = GENERIC.solve(chain(q), start)
        except ValueError:
            missed += 1
        else:
            assert np.all((found >= LOW) & (found <= HIGH))
    assert missed <= 3


def test_half_a_turn_is_made():
    q = np.array([0.0, 0.5, -1.0, 0.2, 1.5, 0.0, 0.0])
    found = GENERIC.solve(chain(q), q - [0, 0, 0, 0, np.pi, 0, 0])
    assert np.abs(chain(found) - chain(q)).max() < 1e-9


def test_an_arm_of_other_lengths():
    arm = Arm(350.0, 280.0, 320.0, 0.0, position_min=WIDE.position_min, position_max=WIDE.position_max, speed_max=WIDE.speed_max,
              acceleration_max=WIDE.acceleration_max, jerk_max=WIDE.jerk_max)  # fmt: skip
    poses = random_poses(np.random.default_rng(12), 50, 200.0, arm.lengths)
    joints, reachable = arm.branches(poses, wrist_radius=200.0, continuous=False)
    assert reachable.all()
    for branch in range(4):
        for q, pose in zip(joints[branch], poses, strict=True):
            assert np.abs(chain(q, lengths=arm.lengths) - pose).max() < 1e-9
