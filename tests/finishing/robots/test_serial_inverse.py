"""Inverse of serial robots in closed form: all branches, against printed equations; singular sets; recognition."""

import numpy as np
import pytest
from robot_twins import (
    BOTH,
    CHAINS,
    IRB2400,
    LIMITS,
    UR10,
    about,
    apart,
    printed_ur,
    printed_wrist,
    read,
    within_a_turn,
)

from sdpgrind import finishing

PRINTED = {"ur10": printed_ur, "irb2400": printed_wrist}
FAR = 1e-3
"""Distance from singular sets, unit 1, from which on joints are asked for: the error of an angle is that of its
cosine, some 1e-15, over its sine."""


def nearest(found, joints):
    """Distance of joints (m, 6) from the nearest of the solutions (m, b, 6), whole turns aside."""
    return np.nanmin(apart(found, joints[:, None]), axis=1)


def errors(robot, found, poses):
    """Errors of the poses (mm, and of rotations) of all solutions that there are."""
    there = ~np.isnan(found[..., 0])
    assert np.array_equal(there, ~np.isnan(found).any(axis=-1))
    off = robot.forward(found[there]) - np.broadcast_to(poses[:, None], (*found.shape[:2], 4, 4))[there]
    return np.linalg.norm(off[:, :3, 3], axis=1).max(), np.abs(off[:, :3, :3]).max()


@pytest.mark.parametrize("name", BOTH)
def test_own_joints_are_among_the_solutions_and_all_reach_the_pose(name):
    robot = BOTH[name]
    joints = within_a_turn(robot, 20_000, np.random.default_rng(0))
    poses = robot.forward(joints)
    found = robot.solutions(poses)
    far = np.min(list(robot.singularities(joints).values()), axis=0) > FAR
    assert found.shape == (20_000, 8, 6) and 0.99 < far.mean() < 1
    assert nearest(found, joints)[far].max() <= 1e-8
    place, turn = errors(robot, found, poses)
    assert place <= 1e-9 and turn <= 1e-12


@pytest.mark.parametrize("name", BOTH)
def test_there_are_as_many_solutions_as_the_printed_equations_have_and_the_same(name):
    robot = BOTH[name]
    for pose in robot.forward(within_a_turn(robot, 200, np.random.default_rng(4))):
        wanted, found = PRINTED[name](pose), robot.solutions([pose])[0]
        found = found[~np.isnan(found[:, 0])]
        assert len(found) == len(wanted)
        assert max(apart(found, each).min() for each in wanted) < 1e-6  # arccos near 1 loses half the digits


def test_published_solutions_of_the_ur10():
    joints = (0.3, -1.5, 1.8, -1.8, -1.5, 0.1)
    found = UR10.solutions([UR10.forward(joints)])[0]
    assert not np.isnan(found).any()
    for wanted in (
        joints,
        (0.3, -1.126651, 1.351591, 1.416652, 1.5, -3.041593),
        (-2.384908, 2.918563, 1.806130, 3.097003, 1.665541, 0.557662),
        (-2.384908, -2.013682, -1.345475, 1.756074, -1.665541, -2.583931),
    ):
        assert np.abs(found - wanted).max(axis=1).min() < 1e-6
    assert min(apart(one, other) for k, one in enumerate(found) for other in found[:k]) > 0.1


SINGULAR = {
    "ur10": [  # wrist, elbow stretched and folded (in the frame of the flange p5 stays over axis 1), several
        (0.3, -1.5, 1.8, -1.8, 0.0, 0.1), (0.3, -1.5, 1.8, -1.8, np.pi, 0.1), (0.3, -1.5, 0.0, -1.8, -1.5, 0.1),
        (0.3, -1.5, 0.0, 0.4, 0.0, 0.1), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0),
    ],
    "irb2400": [
        (0.3, 0.2, -0.4, 0.5, 0.0, -0.7), (0.0,) * 6, (0.3, 0.2, -np.arctan2(755, 135), 0.5, 0.0, -0.7),
        (0.3, 0.2, np.pi - np.arctan2(755, 135), 0.5, 0.3, -0.7),
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize("away", [0.0, 1e-13, 1e-9, 1e-5])
def test_at_and_near_singular_poses_some_solution_reaches_and_none_is_wrong(name, away):
    robot = BOTH[name]
    joints = np.array(SINGULAR[name]) + away * np.random.default_rng(2).normal(size=6)
    poses = robot.forward(joints)
    found = robot.solutions(poses)
    assert (~np.isnan(found[..., 0])).any(axis=1).all()
    place, turn = errors(robot, found, poses)
    assert place <= 1e-6 and turn <= 1e-9
    assert np.min(list(robot.singularities(joints).values()), axis=0).max() < 1e-4


@pytest.mark.parametrize("name", BOTH)
def test_with_the_wrist_over_the_first_axis(name):
    """A pose made so: the wrist on axis 1 (spherical), or as far from it as the offset of the arm (UR)."""
    robot = BOTH[name]
    joints = shoulder(robot)
    assert robot.singularities(joints)["shoulder"] < 1e-12
    pose = robot.forward(joints)
    found = robot.solutions([pose])
    assert (~np.isnan(found[0, :, 0])).any()
    assert errors(robot, found, pose[None])[0] <= 1e-6


def shoulder(robot):
    """Joints at which the wrist has no azimuth: joint 2 on ever finer grids around the least distance."""
    third = 1.1 if robot is UR10 else -0.2
    second, width = 0.0, 3.0
    while width > 1e-17:
        grid = np.tile([0.4, 0.0, third, 0.3, 0.7, 0.2], (601, 1))
        grid[:, 1] = np.linspace(second - width, second + width, 601)
        second = grid[np.argmin(robot.singularities(grid)["shoulder"]), 1]
        width /= 100
    return np.array([0.4, second, third, 0.3, 0.7, 0.2])


@pytest.mark.parametrize("name", BOTH)
def test_out_of_reach_by_a_millionth_of_a_micrometre_is_out_of_reach(name):
    """The arm stretched along a line, and the pose drawn away along that line: 1e-9 mm more, none of the rest."""
    robot = BOTH[name]
    joints = np.array([0.3, -0.9, 0.0, 0.5, 0.7, 0.1]) if name == "ur10" else np.array(
        [0.3, 0.4, -np.pi / 2 + np.arctan2(135, 755), 0.5, 0.7, 0.1]
    )  # fmt: skip
    assert robot.singularities(joints)["elbow"] < 1e-15
    pose = robot.forward(joints)
    # along the stretched links, from axis 2 to the point that joint 3 carries: where joint 2 moves, across it
    along = about(second_axis(robot, joints), -np.pi / 2) @ unit(carried(robot, joints))
    stay = np.isnan(robot.solutions([pose])[0, :, 0])
    for far, gone in ((1e-13, False), (1e-9, True), (1e-6, True)):
        moved = pose.copy()
        moved[:3, 3] += far * along
        found = robot.solutions([moved])[0]
        near = [k for k in range(8) if not stay[k] and apart(robot.solutions([pose])[0, k], joints) < 1e-6]
        assert near and all(np.isnan(found[k, 0]) == gone for k in near)
        if gone:
            beyond = robot._solved([moved])[1][0, near]
            np.testing.assert_allclose(beyond, far, rtol=0.05 if far > 1e-7 else 0.5)


def unit(vector):
    return vector / np.linalg.norm(vector)


def second_axis(robot, joints):
    return robot.jacobian(joints)[3:, 1]


def carried(robot, joints):
    """Velocity of the end of the stretched links by joint 2: of the pose, less that by the turn behind them."""
    slopes = robot.jacobian(joints)
    return slopes[:3, 1] - slopes[:3, 3] if robot is UR10 else wrist_velocity(robot, joints)


def wrist_velocity(robot, joints):
    """Velocity of the wrist centre of the IRB 2400 by joint 2; it is 85 mm behind the flange along x."""
    slopes, pose = robot.jacobian(joints), robot.forward(joints)
    return slopes[:3, 1] - 85.0 * np.cross(slopes[3:, 1], pose[:3, 0])


def rigid(rng):
    out = np.eye(4)
    out[:3, :3] = about(rng.normal(size=3), rng.uniform(-3, 3))
    out[:3, 3] = rng.uniform(-300, 300, 3)
    return out


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("name", ["ur10", "irb2400", "kr16", "kr210"])
def test_a_closed_form_is_found_whatever_the_frames_signs_and_zeros(name, seed, tmp_path):
    """The same robot with another base, flange, zeros of the joints and directions of its axes."""
    rng = np.random.default_rng(seed)
    robot = read(tmp_path, CHAINS[name])
    links, quarter = robot.links.copy(), np.diag([1.0, -1.0, -1.0, 1.0])
    for k in range(6):  # turn each frame about its axis, and some upside down
        turn = np.eye(4)
        turn[:3, :3] = about([0, 0, 1], rng.uniform(-3, 3))
        turn[2, 3] = rng.uniform(-200, 200)
        turn = turn @ quarter if rng.random() < 0.5 else turn
        links[k], links[k + 1] = links[k] @ turn, np.linalg.inv(turn) @ links[k + 1]
        zero = np.eye(4)
        zero[:3, :3] = about([0, 0, 1], rng.uniform(-3, 3))
        links[k + 1] = zero @ links[k + 1]
    links[0], links[6] = rigid(rng) @ links[0], links[6] @ rigid(rng)
    other = finishing.SerialRobot(robot.names, links, **LIMITS, tool=rigid(rng))
    assert other.closed_form == ("axes 2, 3, 4 parallel" if name == "ur10" else "spherical wrist")
    joints = within_a_turn(other, 200, rng)
    poses = other.forward(joints)
    far = np.min(list(other.singularities(joints).values()), axis=0) > FAR
    found = other.solutions(poses)
    assert nearest(found, joints)[far].max() <= 1e-8 and errors(other, found, poses)[0] <= 1e-8


def test_offsets_of_shoulder_and_wrist_are_allowed():
    """a1, a3, a shoulder offset (spherical); a1 and a4 (parallel axes)."""
    quarter, rng = np.pi / 2, np.random.default_rng(8)
    wrist = [(0.1, 300, 80, -quarter), (0.2, 45, 500, 0), (0, -20, 60, -quarter),
             (0, 400, 0, quarter), (0, 0, 0, -quarter), (0, 90, 0, 0)]  # fmt: skip
    parallel = [(0.1, 300, 80, quarter), (0.2, 45, 500, 0), (0, -20, 450, 0),
                (0, 120, 35, quarter), (0, 110, 0, -quarter), (0, 90, 0, 0)]  # fmt: skip
    for rows in (wrist, parallel):
        robot = finishing.SerialRobot.from_dh(rows, **LIMITS)
        joints = within_a_turn(robot, 500, rng)
        poses = robot.forward(joints)
        far = np.min(list(robot.singularities(joints).values()), axis=0) > FAR
        found = robot.solutions(poses)
        assert nearest(found, joints)[far].max() <= 1e-8 and errors(robot, found, poses)[0] <= 1e-9


@pytest.mark.parametrize("name", BOTH)
def test_singular_distances_are_the_factors_of_the_determinant(name):
    """Their product over the determinant of the Jacobian is one constant, whatever the joints."""
    robot = BOTH[name]
    joints = within_a_turn(robot, 50, np.random.default_rng(6))
    product = np.prod(list(robot.singularities(joints).values()), axis=0)
    ratio = np.abs(np.linalg.det(robot.jacobian(joints))) / product
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_each_angle_is_the_turn_nearest_to_the_middle_of_its_limits():
    robot = UR10.replace(position_min=(1.0,) * 6, position_max=(1.0 + 2 * np.pi,) * 6)
    joints = np.random.default_rng(1).uniform(1.01, 1.0 + 2 * np.pi - 0.01, (100, 6))
    found = robot.solutions(robot.forward(joints))
    there = found[~np.isnan(found[..., 0])]
    assert there.min() >= 1.0 - 1e-9 and there.max() <= 1.0 + 2 * np.pi + 1e-9
    assert np.nanmin(np.abs(found - joints[:, None]).max(axis=2), axis=1).max() < 1e-8


def test_a_tool_is_taken_off_first():
    held = IRB2400.replace(tool=finishing.tool(length=150.0, tilt=0.4, axis="x"))
    joints = within_a_turn(held, 50, np.random.default_rng(3))
    np.testing.assert_allclose(
        held.solutions(held.forward(joints)), IRB2400.solutions(IRB2400.forward(joints)), atol=1e-9
    )
