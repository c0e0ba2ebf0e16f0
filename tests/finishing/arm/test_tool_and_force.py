"""Tool frames against Wang (1) as it is printed, force from torque against moments."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.finishing.arm import feed_angle, tool_poses, torque_per_force

LEVER = 95.0
ANGLE = np.radians(30)
UP = np.array([[0.0, 0.0, 1.0]])


def random_contacts(rng, count):
    """Points, feeds and normals, the normals in the upper half."""
    point, normal, feed = (
        rng.uniform(-50, 50, (count, 3)),
        rng.normal(size=(count, 3)),
        rng.normal(size=(count, 3)),
    )
    normal[:, 2] = np.abs(normal[:, 2]) + 0.3
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    feed -= np.einsum("ij,ij->i", feed, normal)[:, None] * normal
    return point, feed / np.linalg.norm(feed, axis=1)[:, None], normal


def contact_in_tool(angle, sign):
    """A_C^P = [R^T | (0, 0, R)] with the columns of R in the contact frame."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.eye(4)
    out[:3, :3] = np.column_stack([(-s, 0, -sign * c), (0, 1, 0), (sign * c, 0, -s)]).T
    out[2, 3] = LEVER
    return out


@pytest.mark.parametrize("pushed", [False, True])
@pytest.mark.parametrize("angle", [0.0, ANGLE, np.radians(80)])
def test_tool_poses_are_equation_1(angle, pushed):
    point, feed, normal = random_contacts(np.random.default_rng(1), 40)
    found = tool_poses(
        point, feed, normal, contact_angle=angle, lever_arm=LEVER, pushed=pushed, heading="feed_aligned"
    )
    inverse = np.linalg.inv(contact_in_tool(angle, 1 if pushed else -1))
    for p, t, n, pose in zip(point, feed, normal, found, strict=True):
        contact = np.eye(4)
        contact[:3] = np.column_stack([t, np.cross(n, t), n, p])
        assert pose == pytest.approx(contact @ inverse, abs=1e-12)


@pytest.mark.parametrize("pushed", [False, True])
def test_frames_are_right_handed_and_the_tool_ends_in_the_contact(pushed):
    point, feed, normal = random_contacts(np.random.default_rng(2), 40)
    for heading in ("fixed", "feed_aligned"):
        pose = tool_poses(
            point,
            feed,
            normal,
            contact_angle=ANGLE,
            lever_arm=LEVER,
            pushed=pushed,
            heading=heading,
            azimuth=0.7,
        )
        turn = pose[:, :3, :3]
        assert np.abs(turn @ np.swapaxes(turn, 1, 2) - np.eye(3)).max() < 1e-14
        assert np.linalg.det(turn) == pytest.approx(np.ones(40), abs=1e-14)
        assert pose[:, :3, 3] + LEVER * pose[:, :3, 2] == pytest.approx(point, abs=1e-12)
        into = np.einsum("ij,ij->i", pose[:, :3, 2], normal)
        assert into == pytest.approx(np.full(40, -np.sin(ANGLE)), abs=1e-14)  # the angle to the surface


def test_the_tip_leads_where_pushed_and_trails_where_dragged():
    point, feed, normal = random_contacts(np.random.default_rng(3), 10)
    for pushed in (True, False):
        pose = tool_poses(
            point, feed, normal, contact_angle=ANGLE, lever_arm=LEVER, pushed=pushed, heading="feed_aligned"
        )
        ahead = np.einsum("ij,ij->i", pose[:, :3, 3] - point, feed)  # of the motor, before the tip
        assert np.all(ahead < 0) if pushed else np.all(ahead > 0)


def test_fixed_heading_is_one_direction_seen_from_above():
    """The heading lies in the plane of azimuth and normal, whatever the feed."""
    point, feed, normal = random_contacts(np.random.default_rng(4), 40)
    azimuth = 2.2
    pose = tool_poses(point, feed, normal, contact_angle=ANGLE, lever_arm=LEVER, azimuth=azimuth)
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    heading = np.cross(pose[:, :3, 1], normal)
    assert np.linalg.norm(heading, axis=1) == pytest.approx(np.ones(40), abs=1e-14)
    assert np.abs(np.einsum("ij,ij->i", heading, np.cross(level, normal))).max() < 1e-14
    assert np.all(heading @ level > 0)
    other = tool_poses(
        point, np.cross(normal, feed), normal, contact_angle=ANGLE, lever_arm=LEVER, azimuth=azimuth
    )
    assert np.array_equal(other, pose)


def test_dragging_one_way_is_pushing_the_other_after_half_a_turn():
    point, feed, normal = random_contacts(np.random.default_rng(5), 20)
    held = {"contact_angle": ANGLE, "lever_arm": LEVER}
    dragged = tool_poses(point, feed, normal, azimuth=0.4, **held)
    pushed = tool_poses(point, feed, normal, azimuth=0.4 + np.pi, pushed=True, **held)
    assert pushed @ np.diag([-1.0, -1.0, 1.0, 1.0]) == pytest.approx(dragged, abs=1e-12)


def moment(angle, psi, ratio, pushed):
    """Torque (N m/N) of normal force and friction about the motor's axis, by r x F, in the base."""
    feed = np.array([[np.cos(psi), np.sin(psi), 0.0]])
    pose = tool_poses(
        np.zeros((1, 3)), feed, UP, contact_angle=angle, lever_arm=LEVER, pushed=pushed, azimuth=0.0
    )[0]
    force = UP[0] - ratio * feed[0]
    return np.cross(-pose[:3, 3], force) @ pose[:3, 1] / 1000


@pytest.mark.parametrize(
    ("pushed", "ratio", "expected"), [(False, 0.3, 0.984), (True, 0.3, 1.397), (False, 0.0, 1.155)]
)
def test_force_of_the_specified_cases(pushed, ratio, expected):
    assert LEVER / 1000 / torque_per_force(
        ANGLE, LEVER, friction_ratio=ratio, pushed=pushed
    ) == pytest.approx(expected, abs=5e-4)


def test_source_is_right_at_contact_angle_zero():
    for pushed in (False, True):
        assert torque_per_force(0.0, LEVER, friction_ratio=0.9, pushed=pushed) == pytest.approx(
            0.095, rel=1e-15
        )


@settings(max_examples=100, deadline=None)
@given(st.floats(0, 1.2), st.floats(-7, 7), st.floats(0, 0.35), st.booleans())
def test_torque_is_the_moment_of_the_contact_force(angle, psi, ratio, pushed):
    """The load turns a pushed tool about -y_P, a dragged one about +y_P."""
    found = torque_per_force(angle, LEVER, friction_ratio=ratio, feed_angle=psi, pushed=pushed)
    assert found == pytest.approx((-1 if pushed else 1) * moment(angle, psi, ratio, pushed), abs=1e-14)
    assert found == pytest.approx(
        torque_per_force(angle, LEVER, friction_ratio=ratio, feed_angle=-psi, pushed=pushed), abs=1e-15
    )
    assert found == pytest.approx(
        torque_per_force(angle, LEVER, friction_ratio=ratio, feed_angle=psi + np.pi, pushed=not pushed),
        abs=1e-14,
    )


def test_motor_presses_on_by_the_sign_that_is_documented():
    """A small turn of the motor about s y_P moves the tip into the surface."""
    for pushed, sign in ((True, 1.0), (False, -1.0)):
        pose = tool_poses(
            np.zeros((1, 3)), [[1.0, 0.0, 0.0]], UP, contact_angle=ANGLE, lever_arm=LEVER, pushed=pushed
        )[0]
        assert (np.cross(sign * pose[:3, 1], -pose[:3, 3]) @ UP[0]) < 0


def test_feed_angle_is_measured_from_the_heading():
    point, feed, normal = random_contacts(np.random.default_rng(6), 40)
    for pushed in (False, True):
        held = {"contact_angle": ANGLE, "lever_arm": LEVER, "pushed": pushed}
        aligned = tool_poses(point, feed, normal, heading="feed_aligned", **held)
        assert feed_angle(feed, normal, aligned) == pytest.approx(np.zeros(40), abs=1e-14)
        fixed = tool_poses(point, feed, normal, azimuth=0.3, **held)
        psi = feed_angle(feed, normal, fixed)
        heading = np.cross(fixed[:, :3, 1], normal)
        assert np.cos(psi) == pytest.approx(np.einsum("ij,ij->i", heading, feed), abs=1e-14)
        assert np.sin(psi) == pytest.approx(np.einsum("ij,ij->i", np.cross(heading, feed), normal), abs=1e-14)
    flat = tool_poses(
        np.zeros((1, 3)), [[0.0, 1.0, 0.0]], UP, contact_angle=0.0, lever_arm=LEVER, azimuth=0.25 * np.pi
    )
    assert feed_angle([[0.0, 1.0, 0.0]], UP, flat) == pytest.approx([0.25 * np.pi], abs=1e-15)


def test_torque_takes_arrays():
    psi = np.linspace(-3, 3, 7)
    found = torque_per_force(ANGLE, LEVER, friction_ratio=0.3, feed_angle=psi)
    assert found == pytest.approx(
        [torque_per_force(ANGLE, LEVER, friction_ratio=0.3, feed_angle=each) for each in psi.tolist()],
        rel=1e-15,
    )
    assert isinstance(torque_per_force(ANGLE, LEVER, friction_ratio=0.3, feed_angle=0.1), float)
