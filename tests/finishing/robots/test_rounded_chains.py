"""Robots whose files are rounded: the closed form of a robot nearby, polished on the chain as it is written."""

import numpy as np
import pytest
from robot_twins import apart, chain, read, within_a_turn

from sdpgrind.finishing import FinishingProblem, plan, zigzag
from sdpgrind.finishing.surface import flat_surface

FAR = 0.02  # of singular sets, unit 1; there a branch of the robot nearby may be another one
Z = "0 0 1"
FORMS = {
    "near spherical wrist": [
        ("0 0 0.4", "0 0 0"), ("0.15 0 0.2", "{q} 0 0"), ("0 0.6 0", "0 0 0"), ("0.05 0.1 0", "0 {q} 0"),
        ("0 0 0.55", "-{q} 0 0"), ("0 0 0", "{q} 0 0"), ("0 0 0.1", "0 0 {q}"),
    ],
    "near axes 2, 3, 4 parallel": [
        ("0 0 0.1273", "0 0 0"), ("0 0 0", "{q} 0 0"), ("-0.612 0 0", "0 0 0"), ("-0.5723 0 0.163941", "0 0 0"),
        ("0 -0.1157 0", "{q} 0 0"), ("0 0.0922 0", "-{q} 0 0"), ("0 0 0", "0 0 {q}"),
    ],
}  # fmt: skip
"""Origins (m) and roll, pitch, yaw of a quarter turn q of both kinds."""


def joints_of(form, quarter):
    """Joints of a URDF with its quarter turns as they are written."""
    kinds = ["revolute"] * 6 + ["fixed"]
    rows = [(xyz, rpy.format(q=quarter)) for xyz, rpy in FORMS[form]]
    return [(kind, *row, Z if kind == "revolute" else None) for kind, row in zip(kinds, rows, strict=True)]


@pytest.mark.parametrize("quarter", ["1.5708", "1.570796", "1.57079633"])
@pytest.mark.parametrize("form", FORMS)
def test_all_branches_reach_the_pose_as_the_file_has_it(tmp_path, form, quarter):
    """Poses by products of rotations; the ideal robot gives how many branches there are, and where about."""
    written = joints_of(form, quarter)
    robot, ideal = read(tmp_path, written), read(tmp_path, joints_of(form, repr(np.pi / 2)))
    assert robot.closed_form == form and ideal.closed_form == form.removeprefix("near ")
    joints = within_a_turn(robot, 400, np.random.default_rng(1))
    poses = np.array([chain(written, each) for each in joints])
    found, about = robot.solutions(poses), ideal.solutions(poses)
    far = np.min(list(robot.singularities(joints).values()), axis=0) > FAR
    assert far.mean() > 0.8
    assert np.nanmin(apart(found, joints[:, None]), axis=1)[far].max() <= 1e-9
    assert np.array_equal(np.isnan(found), np.isnan(about)) or np.isnan(found[far]).mean() < 0.2
    for k in range(0, 400, 40):
        for q in found[k][~np.isnan(found[k, :, 0])]:
            np.testing.assert_allclose(chain(written, q)[:3], poses[k, :3], rtol=0, atol=1e-9)
    near = np.nanmax(apart(found, about)[far], axis=1)
    assert np.median(near) < 1e-3


def test_solutions_are_turned_to_the_middle_of_the_limits(tmp_path):
    robot = read(tmp_path, joints_of("near axes 2, 3, 4 parallel", "1.5708"))
    shifted = robot.replace(position_min=(3.0,) * 6, position_max=(9.0,) * 6)
    found = shifted.solutions(robot.forward(within_a_turn(robot, 50, np.random.default_rng(2))))
    assert np.nanmax(np.abs(found - 6.0)) <= np.pi + 1e-12


def test_out_of_reach_is_told_as_before(tmp_path):
    robot = read(tmp_path, joints_of("near spherical wrist", "1.5708"))
    pose = robot.forward([[0.1, 0.4, -0.3, 0.2, 0.5, 0.1]])
    pose[:, :3, 3] *= 3.0
    assert np.isnan(robot.solutions(pose)).all()


def test_a_motion_of_a_rounded_robot_keeps_its_points(tmp_path):
    written = joints_of("near spherical wrist", "1.5708")
    robot = read(tmp_path, written)
    path = zigzag(flat_surface(20.0), 8.0)
    motion = plan(FinishingProblem(path, robot=robot, placement=(700.0, -10.0, 500.0), feed_rate=20.0))
    assert motion.worst_violation.held
    poses = np.array([chain(written, q) for q in motion.joints[::20]])
    np.testing.assert_allclose(poses, motion.poses[::20], rtol=0, atol=1e-6)


@pytest.mark.parametrize(("form", "quarter"), [(form, "1.5768") for form in FORMS])
def test_a_robot_that_is_crooked_is_still_refused(tmp_path, form, quarter):
    robot = read(tmp_path, joints_of(form, quarter))
    with pytest.raises(ValueError, match=r"axes 1, 2 must be perpendicular, off by 0\.006"):
        _ = robot.closed_form
