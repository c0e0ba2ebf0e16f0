"""What is refused of robots: chains, limits, units, URDF files, poses; each in one sentence with its name."""

import numpy as np
import pytest
from robot_twins import CHAINS, LIMITS, UR10, read, urdf

from sdpgrind import finishing

QUARTER = np.pi / 2
ROWS = [
    (0, 127.3, 0, QUARTER), (0, 0, -612.0, 0), (0, 0, -572.3, 0),
    (0, 163.9, 0, QUARTER), (0, 115.7, 0, -QUARTER), (0, 92.2, 0, 0),
]  # fmt: skip
IRB = CHAINS["irb2400"]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([(0, 1.3, 0, QUARTER)] * 6, r"links must be in mm, .*metres\? units.m\(...\); got 7.8"),
        ([(0, 1.3e5, 0, QUARTER)] * 6, r"links must be in mm, .*is a file in mm where metres are meant\?"),
        (
            [(90.0, 100, 0, 0)] * 6,
            r"offset of theta in rows\[0\] must be within a turn; units.deg\(90\) .*got 90.0",
        ),
        ([(0, 100, 0, -90.0)] * 6, r"alpha in rows\[0\] must be within a turn; .* \(rad\); got -90.0"),
        ([(0, 100, 0)] * 6, r"rows must be of shape \(n, 4\): offset of theta .*; got \(6, 3\)"),
        ([(0, np.nan, 0, 0)] * 6, r"rows\[1\] must be finite"),
        ([], r"rows must be of shape \(n, 4\)"),
    ],
)
def test_rows(rows, said):
    with pytest.raises(ValueError, match=said):
        finishing.SerialRobot.from_dh(rows, **LIMITS)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"position_max": [-400.0] + [6.0] * 5},
            r"position_max of q1 must be within two turns; units.deg\(90\)",
        ),
        ({"position_min": [0, 0, 7, 0, 0, 0]}, r"position_max of q3 must be > position_min \(rad\); got 6.1"),
        ({"speed_max": [3.0] * 5 + [0.0]}, r"speed_max of q6 must be > 0 \(rad/s\); got 0.0"),
        ({"acceleration_max": [-1.0] * 6}, r"acceleration_max of q1 must be > 0 \(rad/s\^2\); got -1.0"),
        ({"jerk_max": [0.0] * 6}, r"jerk_max of q1 must be > 0 \(rad/s\^3\); got 0.0"),
        ({"speed_max": [3.0] * 5}, r"speed_max must be one for each of the 6 joints; got 5"),
        ({"names": ["a", "b", "c", "d", "e", "a"]}, r"names must be without repeats; got 'a' twice"),
        (
            {"names": ["a", "b"]},
            r"links must be of shape \(3, 4, 4\), one more than joints; got \(7, 4, 4\)",
        ),
        ({"tool": np.eye(3)}, r"tool must be of shape \(4, 4\) \(mm\); got \(3, 3\)"),
        (
            {"tool": np.diag([1.0, 1, 1.1, 1])},
            r"tool must be a rigid motion, R\^T R = 1 to 1e-06; got off by 0.21",
        ),
        ({"tool": np.diag([1.0, 1, -1, 1])}, r"tool must be a rigid motion, .*got a mirror image"),
    ],
)
def test_limits_and_tools(change, said):
    with pytest.raises(ValueError, match=said):
        finishing.SerialRobot.from_dh(ROWS, **{**LIMITS, **change})


def test_a_pose_needs_six_joints():
    limits = {name: values[:5] for name, values in LIMITS.items()}
    five = finishing.SerialRobot.from_dh(ROWS[:5], **limits)
    assert five.forward([0.1] * 5).shape == (4, 4)  # its poses are known all the same
    with pytest.raises(
        ValueError,
        match=r"robot must have six joints for a pose; got 5, whose Jacobian has rank 5: 1 of the six",
    ):
        _ = five.closed_form
    flat = finishing.SerialRobot.from_dh([(0, 0, 300, 0)] * 4, **{k: v[:4] for k, v in LIMITS.items()})
    with pytest.raises(
        ValueError, match=r"got 4, whose Jacobian has rank 3: 3 of the six freedoms are missing"
    ):
        flat.solutions([np.eye(4)])


def test_without_a_closed_form_the_axes_are_named(tmp_path):
    """Axes off by more than a calibration leaves: 5e-3 rad, 5 mm; what is off by less is not named."""
    rows = [list(row) for row in ROWS]
    rows[1][3], rows[4][2], rows[2][3] = 6e-3, 8.0, 1e-3
    crooked = finishing.SerialRobot.from_dh(rows, **LIMITS)
    with pytest.raises(
        ValueError,
        match=r"robot must have, to 0.005 rad and 5 mm, a spherical wrist \(axes 2, 3 must be parallel, off by 0.006 rad; axes 4, 5, 6 must meet in a"
        r" point, off by .* mm\), or axes 2, 3, 4 parallel \(axes 2, 3 must be parallel, off by 0.006 rad; axes 5, 6 must"
        r" meet in a point, off by 8 mm\)",
    ):
        finishing.FinishingProblem(finishing.preset("specimen").path, robot=crooked)
    with pytest.raises(
        ValueError, match=r"six turning joints for an inverse in closed form; got j1 that slides"
    ):
        _ = read(tmp_path, CHAINS["iiwa14 on a track"]).closed_form
    slack = [list(row) for row in ROWS]
    slack[1][3] = 5e-10  # within the tolerance
    assert finishing.SerialRobot.from_dh(slack, **LIMITS).closed_form == "axes 2, 3, 4 parallel"


def test_poses():
    pose = UR10.forward([0.3, -1.5, 1.8, -1.8, -1.5, 0.1])
    skewed = pose.copy()
    skewed[0, 0] += 2e-6
    with pytest.raises(
        ValueError, match=r"poses\[1\] must be a rigid motion, R\^T R = 1 to 1e-06; got off by"
    ):
        UR10.solutions([pose, skewed])
    with pytest.raises(ValueError, match=r"poses must be of shape \(m, 4, 4\); got \(4, 4\)"):
        UR10.solutions(pose)
    with pytest.raises(ValueError, match=r"joints must be of shape \(..., 6\) \(rad, mm\); got \(7,\)"):
        UR10.forward([0.0] * 7)


JOINT = IRB[0]
SLIDER = ("prismatic", "0 0 0.5", "0 0 0", "0 0 1")


def with_text(folder, text, base="l0", tip="l1"):
    path = folder / "cell.urdf"
    path.write_text(text)
    return finishing.SerialRobot.from_urdf(path, base=base, tip=tip, acceleration_max=10.0)


def changed(old, new, joints=(("revolute", "0 0 0.5", "0 0 0", "0 0 1"),)):
    text = urdf(joints)
    assert old in text
    return text.replace(old, new)


BAD = [
    ("no xml", r"'cell.urdf' must be a URDF, an XML file; got syntax error"),
    ("<sdf/>", r"'cell.urdf' must be a URDF with the root <robot>; got <sdf>"),
    (changed("<link name", "<xacro:macro/><link name"), r"must be a URDF without xacro: run xacro first"),
    (
        changed('<robot name="a">', '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="m"/>'),
        r"must be a URDF without xacro: run xacro first; got <xacro:macro>",
    ),
    (changed('<link name="l1"/>', '<link name="l1"/><link name="l1"/>'), r"must have each link once; got 'l1' twice"),
    (
        changed("</robot>", urdf([JOINT]).split("\n")[-2] + "</robot>"),
        r"'cell.urdf' must have each joint once; got 'j1' twice",
    ),
    (
        changed("</robot>", urdf([JOINT]).split("\n")[-2].replace('"j1"', '"jx"') + "</robot>"),
        r"must have one chain to 'l1'; j1, jx all lead to 'l1'",
    ),
    (changed('type="revolute"', 'type="floating"'), r"joint 'j1' must be revolute, continuous, prismatic, fixed; got 'floating'"),
    (changed('type="revolute"', 'type="planar"'), r"joint 'j1' must be .*; got 'planar'"),
    (changed("</joint>", '<mimic joint="other"/></joint>'), r"joint 'j1' must move by itself; got a <mimic> of 'other'"),
    (changed('velocity="1.5"', 'velocity="0"'), r"velocity of joint 'j1' must be > 0 \(rad/s, m/s\); got 0.0"),
    (changed('velocity="1.5"', 'velocity="fast"'), r"velocity of joint 'j1' must be a number; got 'fast'"),
    (
        changed('<limit effort="0" lower="-2.5" upper="2.5" velocity="1.5"/>', ""),
        r"joint 'j1' must have a <limit> with a velocity; got none",
    ),
    (changed('upper="2.5"', 'upper="-3"'), r"upper of joint 'j1' must be > lower \(rad, m\); got -3.0 and -2.5"),
    (changed('upper="2.5"', 'upper="150"'), r"position_max of j1 must be within two turns; units.deg\(90\) for degrees"),
    (changed('axis xyz="0 0 1"', 'axis xyz="0 0 0"'), r"<axis> of joint 'j1' must have a direction; got 0 0 0"),
    (changed('xyz="0 0 0.5"', 'xyz="0 0"'), r"xyz of <origin> of joint 'j1' must be three numbers; got '0 0'"),
    (changed('xyz="0 0 0.5"', 'xyz="0 0 nan"'), r"xyz of <origin> of joint 'j1' must be three numbers"),
    (changed('xyz="0 0 0.5"', 'xyz="0 0 500"'), r"is a file in mm where metres are meant\?; got 5e\+05"),
    (changed('<parent link="l0"/>', ""), r"joint 'j1' must have a parent link; got none"),
    (changed('type="revolute"', 'type="fixed"'), r"'cell.urdf' must have joints that move between 'l0' and 'l1'; got none"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said"), BAD)
def test_files(text, said, tmp_path):
    with pytest.raises(ValueError, match=said):
        with_text(tmp_path, text)


def test_ends_of_the_chain(tmp_path):
    text = urdf([JOINT, SLIDER])
    with pytest.raises(ValueError, match=r"base must be a link of 'cell.urdf': l0, l1, l2; got 'world'"):
        with_text(tmp_path, text, base="world")
    with pytest.raises(ValueError, match=r"tip must be a link of 'cell.urdf': l0, l1, l2; got 'tool0'"):
        with_text(tmp_path, text, tip="tool0")
    with pytest.raises(ValueError, match=r"tip must be below base 'l2' in 'cell.urdf'; got 'l1', below 'l0'"):
        with_text(tmp_path, text, base="l2", tip="l1")
    circle = urdf([JOINT]).replace('<parent link="l0"/>', '<parent link="l1"/>')
    with pytest.raises(ValueError, match=r"tip must be below base 'l0'"):
        with_text(tmp_path, circle)


def test_a_limit_of_acceleration_for_each_kind_of_joint(tmp_path):
    with pytest.raises(
        ValueError,
        match=r"acceleration_max must be one number for each joint where some turn and some slide; got 10.0",
    ):
        with_text(tmp_path, urdf([JOINT, SLIDER]), tip="l2")
    with pytest.raises(TypeError, match=r"missing 1 required keyword-only argument: 'acceleration_max'"):
        finishing.SerialRobot.from_urdf(tmp_path / "cell.urdf", base="l0", tip="l1")


def test_names_and_tools():
    with pytest.raises(ValueError, match=r"name must be one of generic, ur10, irb2400; got 'ur5'"):
        finishing.robot("ur5")
    with pytest.raises(
        ValueError, match=r"length must be in mm, some 150; units.m\(...\) for metres; got 0.15"
    ):
        finishing.tool(0.15)
    with pytest.raises(
        ValueError, match=r"tilt must be within a turn; units.deg\(45\) for degrees \(rad\); got 45.0"
    ):
        finishing.tool(150.0, 45.0)
    with pytest.raises(ValueError, match=r"axis must be one of z, x; got 'y'"):
        finishing.tool(150.0, axis="y")
    with pytest.raises(ValueError, match=r"length must be >= 0 \(mm\); got -3.0"):
        finishing.tool(-3.0)
