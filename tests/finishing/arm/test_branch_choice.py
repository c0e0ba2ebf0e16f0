"""Choice of branches and wrist radii against all combinations; what corners cost a heading that follows the
feed.
"""

import itertools

import numpy as np
import pytest
from arm_twins import GENERIC, WIDE, chain, turned
from finishing_inside import check_corners, pitch_cosine

from sdpgrind.finishing.arm import choose_branches, corner_jumps, tool_poses

SPEED = np.array(GENERIC.speed_max)
HELD = {"contact_angle": np.radians(30), "lever_arm": 95.0}
REACH = 350.0 + 195.0 * np.cos(np.radians(30))  # from the base's axis to the contact


def run(rng, count=6):
    """Poses along a short, smooth way of an arm's joints about a random place."""
    q = np.array([0.0, 0.4, -1.2, 0.3, 0.0, 0.0, 0.0]) + rng.uniform(-0.7, 0.7, 7) * ([1.0] * 5 + [100.0] * 2)
    return np.array([chain(q + step * rng.uniform(-1, 1, 7)) for step in [0.0, *np.full(count - 1, 0.02)]])


def time(way):
    return float(np.sum(np.max(np.abs(way) / SPEED, axis=-1)))


def costs(arm, runs, pairs):
    """Joints of each run in each pair, or None where a limit is broken."""
    out = []
    for poses in runs:
        row = []
        for branch, radius in pairs:
            try:
                row.append(arm.inverse(poses, wrist_radius=radius, branch=branch))
            except ValueError:
                row.append(None)
        out.append(row)
    return out


def total(joints):
    inside = sum(time(np.diff(each, axis=0)) for each in joints)
    return inside + sum(time(after[:1] - before[-1:]) for before, after in itertools.pairwise(joints))


@pytest.mark.parametrize(("arm", "seed"), [(WIDE, 1), (WIDE, 2), (WIDE, 3), (GENERIC, 2), (GENERIC, 6)])
def test_choice_is_the_best_of_all_combinations(arm, seed):
    rng = np.random.default_rng(seed)
    runs = [run(rng) for _ in range(4)]
    radii = [280.0, 330.0, 400.0] if arm is GENERIC else [300.0, 380.0]
    arm = arm.replace(
        position_min=(*arm.position_min[:5], -900.0, -900.0),
        position_max=(*arm.position_max[:5], 900.0, 900.0),
    )
    pairs = list(itertools.product(range(4), radii))
    joints = costs(arm, runs, pairs)
    open_to = [[p for p, q in enumerate(row) if q is not None] for row in joints]
    best = min(
        total([row[p] for row, p in zip(joints, picked, strict=True)])
        for picked in itertools.product(*open_to)
    )
    found = choose_branches(arm, runs, wrist_radii=radii)
    assert total([chosen.joints for chosen in found]) == pytest.approx(best, rel=1e-12)
    for poses, chosen in zip(runs, found, strict=True):
        assert np.array_equal(
            chosen.joints, arm.inverse(poses, wrist_radius=chosen.wrist_radius, branch=chosen.branch)
        )


def test_greedy_choice_would_be_worse():
    """The nearest to the first run is not the best for all: dynamic programming looks ahead."""
    worse = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        runs = [run(rng) for _ in range(4)]
        joints = [
            [q for q in row if q is not None]
            for row in costs(WIDE, runs, list(itertools.product(range(4), [300.0, 380.0])))
        ]
        taken = [min(joints[0], key=lambda q: time(np.diff(q, axis=0)))]
        for row in joints[1:]:
            taken.append(min(row, key=lambda q: total([taken[-1], q])))
        worse += total(taken) > total(
            [each.joints for each in choose_branches(WIDE, runs, wrist_radii=[300.0, 380.0])]
        ) * (1 + 1e-9)
    assert worse >= 6


def test_one_run_takes_the_way_of_least_travel():
    poses = np.array([chain([0.1, 0.4, -1.2, -0.2, a, a, 3.0]) for a in np.linspace(0, 0.5, 20)])
    (found,) = choose_branches(GENERIC, [poses], wrist_radii=np.linspace(250, 450, 9))
    ways = {}
    for radius in np.linspace(250, 450, 9).tolist():
        joints, reachable = GENERIC.branches(poses, wrist_radius=radius)
        ways |= {(b, radius): time(np.diff(joints[b], axis=0)) for b in range(4) if reachable[b].all()}
    assert (found.branch, found.wrist_radius) in ways
    assert ways[found.branch, found.wrist_radius] == pytest.approx(min(ways.values()), rel=1e-12)


def test_a_branch_never_changes_inside_a_run():
    """Poses that the arm can take one by one only, some forward and some backward: refused, though each is
    within reach.
    """
    forward, backward = (
        chain([2.6, 0.4, -1.2, 0.0, 0.0, 0.0, 0.0]),
        chain([-2.6, 0.4, -1.2, 0.0, 0.0, 0.0, 0.0]),
    )
    between = chain([np.pi, 0.4, -1.2, 0.0, 0.0, 0.0, 0.0])
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    arm = GENERIC.replace(position_min=(*GENERIC.position_min[:5], -900.0, -900.0),
                          position_max=(*GENERIC.position_max[:5], 900.0, 900.0))  # fmt: skip
    for pose in (forward, backward):
        assert choose_branches(arm, [[pose]], wrist_radii=radius)[0].branch == 0
    with pytest.raises(ValueError, match=r"runs\[0\] has no branch within limits; nearest comes"):
        choose_branches(arm, [[forward, between, backward]], wrist_radii=radius)


def test_coming_through_the_vertical_is_no_smooth_way():
    poses = np.array(
        [chain([0.1, 0.4, -1.2, 0.8 - np.pi / 2 + a, 0.0, 0.0, 0.0]) for a in (-0.1, -0.05, 0.04, 0.1)]
    )
    radius = float(300 * np.cos(0.4) + 250 * np.cos(-0.8))
    with pytest.raises(
        ValueError, match=r"q1 must turn by at most 1 \(rad\) .* got 3\.142 between poses\[1\] and poses\[2\]"
    ):
        choose_branches(WIDE, [poses], wrist_radii=radius)


def hilbert(order):
    """Nodes of a Hilbert curve, by its four copies."""
    if order == 0:
        return np.zeros((1, 2))
    inner, side = hilbert(order - 1), 2 ** (order - 1)
    return np.vstack(
        [inner[:, ::-1], inner + np.array([0, side]), inner + side, [2 * side - 1, side - 1] - inner[:, ::-1]]
    )


def legs(nodes, pushed=False):
    """Poses at both ends of every straight leg of a flat path, feed-aligned."""
    out = []
    for begin, end in itertools.pairwise(np.column_stack([nodes, np.zeros(len(nodes))])):
        feed = np.tile((end - begin) / np.linalg.norm(end - begin), (2, 1))
        out.append(
            tool_poses([begin, end], feed, [[0, 0, 1.0]] * 2, heading="feed_aligned", pushed=pushed, **HELD)
        )
    return out


def contact_in_base(pose, joints):
    """Where the contact is, from forward kinematics alone."""
    frame = chain([*joints[:5], 0.0, 0.0])
    return frame[:3, 3] + 95.0 * frame[:3, 2]


def test_feed_aligned_hilbert_path_makes_the_table_jump_734_mm_at_every_corner():
    path = hilbert(3)
    runs = legs(path)
    jumps = corner_jumps(GENERIC, runs)
    steps = np.diff(path, axis=0)
    corner = np.einsum("ij,ij->i", steps[1:], steps[:-1]) == 0
    assert corner.sum() == 50  # of order 3
    assert np.abs(jumps.turn[corner]) == pytest.approx(np.full(50, np.pi / 2), abs=1e-12)
    moved = np.hypot(*jumps.table[corner].T)
    assert moved == pytest.approx(np.full(50, np.sqrt(2) * REACH), abs=1e-9)
    assert moved[0] == pytest.approx(734, abs=0.5)
    assert np.abs(jumps.turn[~corner]).max() == pytest.approx(0.0, abs=1e-12)
    assert np.abs(jumps.table[~corner]).max() == pytest.approx(0.0, abs=1e-9)


def test_jumps_are_those_of_the_joints():
    """From the inverse of an arm without limits, and from where its forward kinematics say the contact is."""
    runs = legs(hilbert(2))
    for branch in (0, 2):
        jumps = corner_jumps(GENERIC, runs, branch=branch)
        for k, (before, after) in enumerate(itertools.pairwise(runs)):
            q0 = WIDE.inverse(before, branch=branch)[-1]
            q1 = WIDE.inverse(after, branch=branch)[0]
            flipped = WIDE.inverse(after, branch=2 - branch)[0]
            assert jumps.turn[k] == pytest.approx(turned(q1[0] - q0[0]), abs=1e-12)
            assert jumps.table[k] == pytest.approx(q1[5:] - q0[5:], abs=1e-9)
            apart = contact_in_base(after[0], q1) - contact_in_base(before[-1], q0)
            assert jumps.table[k] == pytest.approx(apart[:2], abs=1e-9)
            assert jumps.flip_table[k] == pytest.approx(flipped[5:] - q0[5:], abs=1e-9)
            assert abs(turned(jumps.flip_turn[k] - flipped[0] + q0[0])) < 1e-12
            assert abs(turned(jumps.flip[k] - (flipped - q0)[1:4].sum())) < 1e-12


def test_a_reversal_takes_1038_mm_or_120_degrees_of_pitch():
    feeds = ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0])
    there, back = (
        tool_poses([[3.0, 4.0, 5.0]], [feed], [[0, 0, 1.0]], heading="feed_aligned", **HELD) for feed in feeds
    )
    jumps = corner_jumps(GENERIC, [there, back])
    assert np.hypot(*jumps.table[0]) == pytest.approx(2 * REACH, abs=1e-9)
    assert np.hypot(*jumps.table[0]) == pytest.approx(1038, abs=0.5)
    assert abs(jumps.turn[0]) == pytest.approx(np.pi, abs=1e-12)
    assert np.degrees(abs(jumps.flip[0])) == pytest.approx(120, abs=1e-9)
    assert jumps.flip_turn[0] == pytest.approx(0.0, abs=1e-12)
    assert np.hypot(*jumps.flip_table[0]) == pytest.approx(2 * 195 * np.cos(np.radians(30)), abs=1e-9)


def test_corners_are_refused_by_the_limits_of_the_table():
    jumps = corner_jumps(GENERIC, legs(hilbert(1)))
    with pytest.raises(ValueError, match=r"at corner 0 q1 turns by 90 deg and the table jumps by 733\.8 mm, X beyond its range of"
                                         r" 400 mm by 118\.9 mm \(the arm has no wrist yaw"):  # fmt: skip
        check_corners(GENERIC, jumps)
    check_corners(WIDE, jumps)
    check_corners(GENERIC, corner_jumps(GENERIC, legs(hilbert(1))[:1]))
    assert len(corner_jumps(GENERIC, legs(hilbert(1))[:1]).turn) == 0


def test_a_whole_feed_aligned_path_as_one_run_is_refused_at_its_corner():
    with pytest.raises(
        ValueError, match=r"between poses\[1\] and poses\[2\], where the heading has a corner"
    ):
        choose_branches(WIDE, [np.concatenate(legs(hilbert(1)))])


def test_fixed_heading_needs_no_turn_on_a_flat():
    nodes = np.column_stack([hilbert(3), np.zeros(64)])
    feed = np.diff(nodes, axis=0)
    poses = tool_poses(nodes[:-1], feed, np.tile([0, 0, 1.0], (63, 1)), azimuth=np.pi, **HELD)
    poses[:, 0, 3] += 518.0
    poses[:, 2, 3] += 100.0
    (chosen,) = choose_branches(GENERIC, [poses])
    assert np.ptp(chosen.joints[:, :5], axis=0) == pytest.approx(np.zeros(5), abs=1e-12)
    assert chosen.joints[:, 5:] - chosen.joints[0, 5:] == pytest.approx(
        -nodes[:-1, :2] + nodes[0, :2], abs=1e-9
    )


def test_pitch_cosine_is_how_much_faster_the_first_joint_turns():
    """Turning the tool's axis about the vertical by a small angle at the cost of its level part."""
    for tilt in (0.0, 0.5, 1.2):
        pose = chain([0.3, 0.4, -1.2, 0.8 + tilt, 0.0, 0.0, 0.0])
        nearby = chain([0.3 + 1e-6, 0.4, -1.2, 0.8 + tilt, 0.0, 0.0, 0.0])
        assert np.linalg.norm(nearby[:3, 2] - pose[:3, 2]) / 1e-6 == pytest.approx(
            pitch_cosine(pose[None])[0], abs=1e-6
        )
        assert pitch_cosine(pose[None])[0] == pytest.approx(abs(np.cos(tilt)), abs=1e-12)
