"""What the arm refuses, and what it says."""

import numpy as np
import pytest
from arm_twins import GENERIC, WIDE, chain

from sdpgrind.finishing import Arm
from sdpgrind.finishing.arm import choose_branches, corner_jumps, feed_angle, tool_poses, torque_per_force

CONTACT = {"point": [[0.0, 0.0, 0.0]], "tangent": [[1.0, 0.0, 0.0]], "normal": [[0.0, 0.0, 1.0]]}
HELD = {"contact_angle": 0.5, "lever_arm": 95.0}
JOINTS = np.array([0.1, 0.3, -1.0, -0.2, 0.4, 10.0, 20.0])
RADIUS = float(300 * np.cos(0.3) + 250 * np.cos(-0.7))


def tilted(i, j, value):
    pose = chain(JOINTS)
    pose[i, j] = value
    return pose


def test_out_of_reach():
    poses = np.array([chain(JOINTS), chain(JOINTS)])
    poses[1, 2, 3] += 500.0
    height = 300 * np.sin(0.3) + 250 * np.sin(-0.7) + 500
    far = np.hypot(RADIUS, height)
    with pytest.raises(
        ValueError,
        match=rf"poses\[1\] is out of reach by {far - 550:.4g} mm: its wrist is {far:.6g} mm from the"
        r" shoulder, where q2 and q3 span 50 to 550 mm \(wrist_radius 477\.8",
    ):
        GENERIC.inverse(poses, wrist_radius=RADIUS)


def test_too_near():
    pose = chain(JOINTS)
    pose[2, 3] = 400 + 100 * pose[2, 2]
    with pytest.raises(ValueError, match=r"poses\[0\] is out of reach by 20 mm: its wrist is 30 mm"):
        WIDE.inverse([pose], wrist_radius=30.0)


@pytest.mark.parametrize(("joint", "value", "message"), [
    (0, 2.95, r"q1 must be in \[-2\.87979, 2\.87979\] \(rad\); got 2\.95 at poses\[1\], beyond by 0\.07021 rad"),
    (1, -0.6, r"q2 must be in \[-0\.523599, 1\.91986\] \(rad\); got -0\.6 at poses\[1\], beyond by 0\.0764 rad"),
    (3, 2.7, r"q4 must be in \[-2\.61799, 2\.61799\] \(rad\); got 2\.7 at poses\[1\], beyond by 0\.08201 rad"),
    (5, 230.0, r"X must be in \[-200, 200\] \(mm\); got 230 at poses\[1\], beyond by 30 mm"),
    (6, -201.5, r"Y must be in \[-200, 200\] \(mm\); got -201\.5 at poses\[1\], beyond by 1\.5 mm"),
])  # fmt: skip
def test_beyond_a_limit(joint, value, message):
    q = np.array([JOINTS, JOINTS])
    q[1, joint] = value
    branch = 2 if np.cos(q[1, 1:4].sum()) < 0 else 0
    radius = float(300 * np.cos(q[1, 1]) + 250 * np.cos(q[1, 1] + q[1, 2]))
    q[0] = q[1]
    q[0, joint] = JOINTS[joint]
    first = GENERIC.forward_work(q[0]) if joint in (0, 5, 6) else GENERIC.forward_work(q[1])
    poses = [first, GENERIC.forward_work(q[1])]
    if joint not in (0, 5, 6):
        message = message.replace(r"poses\[1\]", r"poses\[0\]")
    with pytest.raises(ValueError, match=message):
        GENERIC.inverse(poses, wrist_radius=radius, branch=branch)


def test_elbow_that_the_arm_does_not_have():
    with pytest.raises(
        ValueError, match=r"q3 must be in \[-2\.61799, 0\] \(rad\); got 1 at poses\[0\], beyond by 1 rad"
    ):
        GENERIC.inverse([chain(JOINTS)], wrist_radius=RADIUS, branch=1)


@pytest.mark.parametrize(("poses", "message"), [
    (np.eye(4), r"poses must be of shape \(m, 4, 4\); got \(4, 4\)"),
    ([tilted(0, 0, np.nan)], r"poses\[0\] must be finite \(mm\); got \[\[nan, "),
    ([chain(JOINTS), tilted(2, 3, np.inf)], r"poses\[1\] must be finite \(mm\); got .*inf"),
    ([chain(JOINTS), tilted(0, 0, 0.5)], r"poses\[1\] must be a right-handed rotation and a place .* 0, 0, 0, 1; got \[\[0\.5, "),
    ([chain(JOINTS) @ np.diag([1.0, 1.0, -1.0, 1.0])], r"poses\[0\] must be a right-handed rotation"),
    ([tilted(3, 3, 2.0)], r"poses\[0\] must be a right-handed rotation"),
    *[([np.diag([-1.0, 1.0, 1.0, 1.0])[[*order, 3]]], r"poses\[0\] must be a right-handed rotation")
      for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))],
])  # fmt: skip
def test_what_is_no_pose(poses, message):
    for ask in (GENERIC.inverse, GENERIC.branches):
        with pytest.raises(ValueError, match=message):
            ask(poses)
    if np.ndim(poses) == 3:
        with pytest.raises(ValueError, match=r"runs\[1\]: .*" + message):
            choose_branches(GENERIC, [[chain(JOINTS)], poses])


def test_branches_radii_and_joints():
    pose = [chain(JOINTS)]
    with pytest.raises(ValueError, match="branch must be one of 0, 1, 2, 3; got 4"):
        GENERIC.inverse(pose, branch=4)
    for ask in (GENERIC.inverse, GENERIC.branches):
        with pytest.raises(ValueError, match=r"wrist_radius must be > 0 \(mm\); got 0\.0"):
            ask(pose, wrist_radius=0.0)
    for ask in (GENERIC.forward, GENERIC.forward_work, GENERIC.jacobian):
        with pytest.raises(ValueError, match=r"joints\[2\] must be finite \(rad, mm\); got nan"):
            ask([0.0, 0.0, np.nan, 0.0, 0.0, 0.0, 0.0])
        with pytest.raises(
            ValueError, match=r"joints must be of shape .*\(\.\.\., 7\) \(rad, mm\); got \(3,\)"
        ):
            ask([0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"of shape \(\.\.\., 7\)"):
        GENERIC.forward_work([0.0] * 5)


def test_least_squares_that_find_nothing():
    pose = chain(JOINTS)
    pose[2, 3] += 900.0
    with pytest.raises(
        ValueError,
        match=r"pose must be within reach of joints in their limits; from this start \d+(\.\d+)? mm and",
    ):
        GENERIC.solve(pose, JOINTS)


def test_start_of_least_squares():
    with pytest.raises(
        ValueError, match=r"start: q3 must be in \[-2\.61799, 0\] \(rad\); got 0\.2 at poses\[0\]"
    ):
        GENERIC.solve(chain(JOINTS), [0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"start must be of shape \(7,\); got \(1, 7\)"):
        GENERIC.solve(chain(JOINTS), JOINTS[None])
    with pytest.raises(ValueError, match=r"poses must be of shape"):
        GENERIC.solve(np.eye(3), JOINTS)


def test_an_arm_that_is_none():
    with pytest.raises(ValueError, match=r"a2 must be > 0 \(mm\); got 0\.0"):
        GENERIC.replace(a2=0.0)
    with pytest.raises(ValueError, match=r"d5 must be >= 0 \(mm\); got -1\.0"):
        GENERIC.replace(d5=-1.0)
    with pytest.raises(
        ValueError, match=r"position_max of q2 must be > position_min \(rad\); got -1\.0 and -0\.5"
    ):
        GENERIC.replace(
            position_max=(2.0, -1.0, 0.0, 2.0, 2.0, 1.0, 1.0),
            position_min=(-2.0, -0.5, -1.0, -2.0, -2.0, -1.0, -1.0),
        )
    with pytest.raises(ValueError, match=r"speed_max of Y must be > 0 \(mm\); got 0\.0"):
        GENERIC.replace(speed_max=(1.0,) * 6 + (0.0,))
    with pytest.raises(
        ValueError, match=r"jerk_max must be seven numbers, of q1, q2, q3, q4, q5, X, Y \(rad, mm\)"
    ):
        GENERIC.replace(jerk_max=(1.0,) * 5)
    with pytest.raises(
        ValueError,
        match=r"position_max of q1 must be within two turns; units\.deg\(90\) for degrees \(rad\); got 165",
    ):
        GENERIC.replace(position_max=(165.0, *GENERIC.position_max[1:]))
    with pytest.raises(ValueError, match=r"Arm has no field 'd6'"):
        GENERIC.replace(d6=1.0)
    assert isinstance(GENERIC, Arm)


@pytest.mark.parametrize(("change", "message"), [
    ({"contact_angle": 1.571}, r"contact_angle must be in \[0, pi/2\]; units\.deg\(30\) for degrees \(rad\); got 1\.571"),
    ({"contact_angle": -0.1}, r"contact_angle must be in \[0, pi/2\]"),
    ({"contact_angle": np.nan}, r"contact_angle must be finite \(rad\); got nan"),
    ({"lever_arm": 0.0}, r"lever_arm must be > 0 \(mm\); got 0\.0"),
    ({"heading": "free"}, "heading must be one of fixed, feed_aligned; got 'free'"),
    ({"azimuth": np.inf}, r"azimuth must be finite \(rad\); got inf"),
    ({"point": [[0.0, np.nan, 0.0]]}, r"point\[1\] must be finite \(mm\); got nan"),
    ({"point": [[0.0, 0.0]]}, r"point must be of shape \(m, 3\), as many as points; got \(1, 2\)"),
    ({"normal": [[0.0, 0.0, 1.0]] * 2}, r"normal must be of shape \(m, 3\), as many as points; got \(2, 3\)"),
    ({"tangent": [[2.0, 0.0, 0.0]]}, r"tangent\[0\] must be of length 1; got 2\.0"),
    ({"normal": [[0.0, 0.0, 0.5]]}, r"normal\[0\] must be of length 1; got 0\.5"),
    ({"tangent": [[0.6, 0.0, 0.8]]}, r"the cosine of tangent\[0\] and normal must be 0; got 0\.8"),
    ({"normal": [[1.0, 0.0, 0.0]], "tangent": [[0.0, 1.0, 0.0]]},
     r"azimuth must not be along the normal of the surface, where it tells no direction; got 0\.0 rad at contact 0"),
])  # fmt: skip
def test_tool_poses_refuse(change, message):
    given = {**CONTACT, **HELD, **change}
    with pytest.raises(ValueError, match=message):
        tool_poses(given.pop("point"), given.pop("tangent"), given.pop("normal"), **given)


def test_a_steep_wall_is_finished_with_another_azimuth_or_along_the_feed():
    wall = [[0.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]]
    assert np.isfinite(tool_poses(*wall, azimuth=np.pi / 2, **HELD)).all()
    assert np.isfinite(tool_poses(*wall, heading="feed_aligned", **HELD)).all()


def test_words_where_numbers_are_wanted():
    with pytest.raises(TypeError, match=r"pushed must be True or False; got 'yes'"):
        tool_poses(*CONTACT.values(), **HELD, pushed="yes")
    with pytest.raises(TypeError, match=r"lever_arm must be a number \(mm\); got '95 mm'"):
        torque_per_force(0.5, "95 mm")
    with pytest.raises(TypeError, match=r"poses must be numbers \(mm\); got"):
        GENERIC.inverse("somewhere")


def test_self_locking():
    angle = np.radians(75)
    limit = 1 / np.tan(angle)
    torque_per_force(angle, 95.0, friction_ratio=0.999 * limit, pushed=True)
    with pytest.raises(ValueError, match=r"friction_ratio must be < 0\.2679 at contact_angle 1\.309 rad: from there on the tool"
                                         r" locks itself; got 0\.3"):  # fmt: skip
        torque_per_force(angle, 95.0, friction_ratio=0.3, pushed=True)
    assert torque_per_force(angle, 95.0, friction_ratio=0.3) > 0  # dragged, it does not
    with pytest.raises(ValueError, match="locks itself"):
        torque_per_force(
            angle, 95.0, friction_ratio=0.3, feed_angle=np.array([0.0, 1.0, np.pi])
        )  # but against the heading it does
    with pytest.raises(ValueError, match=r"friction_ratio must be >= 0; got -0\.1"):
        torque_per_force(angle, 95.0, friction_ratio=-0.1)
    with pytest.raises(ValueError, match=r"feed_angle\[1\] must be finite \(rad\); got nan"):
        torque_per_force(0.3, 95.0, friction_ratio=0.3, feed_angle=[0.0, np.nan])


def test_feed_angle_refuses():
    with pytest.raises(ValueError, match=r"poses must be of shape \(1, 4, 4\), one for each tangent"):
        feed_angle(CONTACT["tangent"], CONTACT["normal"], [[0.0] * 4])
    with pytest.raises(ValueError, match=r"tangent\[0\] must be of length 1"):
        feed_angle([[3.0, 0.0, 0.0]], CONTACT["normal"], [np.eye(4)])


def test_no_branch_says_which_comes_nearest():
    poses = np.array([chain(JOINTS + np.array([0, 0, 0, 0, 0, 0, y])) for y in (0.0, 100.0, 181.25)])
    with pytest.raises(
        ValueError,
        match=r"runs\[1\] has no branch within limits; nearest comes branch 0"
        r" \(forward, elbow up\) at wrist radius 477\.811 mm: Y must be in \[-200, 200\]"
        r" \(mm\); got 201\.25 at poses\[2\], beyond by 1\.25 mm",
    ):
        choose_branches(GENERIC, [poses[:2], poses], wrist_radii=RADIUS)


def test_runs_and_radii():
    with pytest.raises(ValueError, match=r"runs must be at least one; got none"):
        choose_branches(GENERIC, [])
    with pytest.raises(ValueError, match=r"runs\[0\] must have at least one pose; got none"):
        choose_branches(GENERIC, [np.empty((0, 4, 4))])
    with pytest.raises(ValueError, match=r"wrist_radii\[1\] must be > 0 \(mm\); got -5\.0"):
        choose_branches(GENERIC, [[chain(JOINTS)]], wrist_radii=[300.0, -5.0])
    with pytest.raises(
        ValueError, match=r"wrist_radii must be one number or a list of them \(mm\); got \[\]"
    ):
        choose_branches(GENERIC, [[chain(JOINTS)]], wrist_radii=[])
    with pytest.raises(ValueError, match=r"branch must be one of 0, 1, 2, 3; got -1"):
        corner_jumps(GENERIC, [[chain(JOINTS)]], branch=-1)
    with pytest.raises(ValueError, match=r"runs\[0\] must have at least one pose"):
        corner_jumps(GENERIC, [np.empty((0, 4, 4))])
