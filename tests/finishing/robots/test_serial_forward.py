"""Forward kinematics and Jacobian of serial robots: against chains written out, and Pinocchio."""

import numpy as np
import pytest
from robot_twins import BOTH, CHAINS, FLANGE, IRB2400, LIMITS, UR10, chain, read, urdf

from sdpgrind import finishing, units
from sdpgrind.finishing.arm import Robot

MM, RAD = 1e-9, 1e-12
"""Bars; rounding of products of ten matrices at 3000 mm is 3000 * 10 * 1e-16 = 3e-12 mm."""


def turned(one, other):
    """Angle between rotations, rad, for small ones."""
    turn = one[:3, :3].T @ other[:3, :3]
    return np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2


def joints_of(robot, count, seed):
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


@pytest.mark.parametrize("name", CHAINS)
def test_poses_are_those_of_the_chain_in_the_file(name, tmp_path):
    robot = read(tmp_path, CHAINS[name])
    joints = joints_of(robot, 40, 3)
    for q, pose in zip(joints, robot.forward(joints), strict=True):
        wanted = chain(CHAINS[name], q)
        assert np.abs(pose - wanted)[:3, 3].max() <= MM and turned(pose, wanted) <= RAD
        assert pose[3].tolist() == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("name", CHAINS)
def test_poses_are_those_of_pinocchio(name, tmp_path):
    pin = pytest.importorskip("pinocchio")
    robot, joints = read(tmp_path, CHAINS[name]), CHAINS[name]
    model = pin.buildModelFromXML(urdf(joints))
    data, tip = model.createData(), model.getFrameId(f"l{len(joints)}")
    for q, pose in zip(rows := joints_of(robot, 40, 5), robot.forward(rows), strict=True):
        state = pin.neutral(model)
        for name_of, value, slides in zip(robot.names, q, robot.sliding, strict=True):
            joint = model.joints[model.getJointId(name_of)]
            if joint.nq == 2:  # continuous: cosine and sine
                state[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                state[joint.idx_q] = value / 1000 if slides else value
        pin.framesForwardKinematics(model, data, state)
        wanted = data.oMf[tip].homogeneous
        assert np.abs(pose[:3, 3] - 1000 * wanted[:3, 3]).max() <= MM and turned(pose, wanted) <= RAD


def test_published_poses():
    pose = UR10.forward([0.3, -1.5, 1.8, -1.8, -1.5, 0.1])
    np.testing.assert_allclose(pose[:3, 3], [-617.342645, -369.398845, 468.717769], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 0], [-0.193415, 0.979083, -0.063146], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 2], [0.088313, -0.046726, -0.994996], atol=1e-6)
    pose = IRB2400.forward([0.3, 0.2, -0.4, 0.5, 0.6, -0.7])
    np.testing.assert_allclose(pose[:3, 3], [977.497366, 326.460958, 1560.908972], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 0], [0.786806, 0.526747, -0.321674], atol=1e-6)


def test_the_irb2400_is_that_of_its_rows():
    quarter = np.pi / 2
    rows = [
        (0, 615, 100, -quarter), (-quarter, 0, 705, 0), (0, 0, 135, -quarter),
        (0, 755, 0, quarter), (0, 0, 0, -quarter), (0, 85, 0, 0),
    ]  # fmt: skip
    by_rows = finishing.SerialRobot.from_dh(rows, **LIMITS, tool=FLANGE)
    joints = joints_of(IRB2400, 200, 1)
    np.testing.assert_allclose(by_rows.forward(joints), IRB2400.forward(joints), atol=1e-11)
    assert by_rows.closed_form == IRB2400.closed_form == "spherical wrist"


@pytest.mark.parametrize("name", CHAINS)
def test_the_jacobian_is_the_derivative_of_the_pose(name, tmp_path):
    """Central differences, by the protocol's own default: h^2/6 of third derivatives, 1e-10/6 * 3000 mm = 5e-8,
    and rounding 1e-16 * 3000/1e-5 = 3e-8.
    """
    robot = read(tmp_path, CHAINS[name])
    joints = joints_of(robot, 20, 7).reshape(4, 5, -1)
    np.testing.assert_allclose(robot.jacobian(joints), Robot.jacobian(robot, joints), atol=3e-7)


def test_a_tool_moves_the_pose_by_its_frame():
    for robot in BOTH.values():
        held = robot.replace(tool=finishing.tool(length=150.0, tilt=0.4))
        joints = joints_of(robot, 10, 2)
        c, s = np.cos(0.4), np.sin(0.4)
        frame = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 150.0], [0, 0, 0, 1]])
        np.testing.assert_allclose(held.forward(joints), robot.forward(joints) @ frame, atol=1e-11)
        np.testing.assert_array_equal(held.forward_work(joints), held.forward(joints))
    ahead = finishing.tool(length=150.0, axis="x")
    np.testing.assert_allclose(ahead[:3, 3], [150.0, 0, 0], atol=1e-13)
    np.testing.assert_allclose(ahead[:3, 2], [1.0, 0, 0], atol=1e-15)


def test_a_problem_warns_of_a_tool_across_the_last_axis_and_tells_the_one_along_it():
    """The flange of the IRB 2400 points along x: a tool along its z would stand sideways."""
    abb, ur = finishing.robot("irb2400"), finishing.robot("ur10")
    assert (abb.flange_axis, ur.flange_axis) == ("x", "z")
    assert abb.tool_across == abb.replace(tool=finishing.tool(150.0, axis="x")).tool_across == ""
    assert ur.replace(tool=finishing.tool(150.0, tilt=units.deg(45))).tool_across == ""
    path = finishing.zigzag(finishing.surface.flat_surface(30.0), 10.0)
    with pytest.warns(UserWarning, match=r"across the axis of the last joint.*tool\(length, axis='x'\)"):
        finishing.FinishingProblem(path, robot=abb.replace(tool=finishing.tool(150.0)))


def test_a_continuous_joint_has_two_turns_and_metres_become_mm(tmp_path):
    robot = read(tmp_path, CHAINS["kr210"])
    assert robot.position_max[0] == 4 * np.pi == -robot.position_min[0]
    assert robot.position_max[1] == 2.5 and robot.speed_max == (1.5,) * 6
    track = read(tmp_path, CHAINS["iiwa14 on a track"])
    assert track.units == ("mm", *("rad",) * 7) and track.position_max[0] == 2500.0
    assert track.speed_max[0] == 1500.0 and track.acceleration_max[:2] == (2000.0, 10.0)
