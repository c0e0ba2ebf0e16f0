"""Proofs: numbers found again without the code that proves, and placements of all kinds that try to break them."""

import numpy as np
import pytest
from placement_inside import ToolHold, proof_of, reach_of, task_of
from scipy.spatial.distance import pdist

from sdpgrind import finishing
from sdpgrind.finishing import FinishingProblem
from sdpgrind.finishing.surface import cylinder_surface, flat_surface, nominal_surface, sphere_surface

ARM = finishing.Arm.generic()
UR10 = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
IRB2400 = finishing.robot("irb2400").replace(tool=finishing.tool(length=150.0, axis="x"))
WIDE = finishing.zigzag(flat_surface(500.0), pitch=50.0)


def task(path, robot, **hold):
    held = {"contact_angle": np.pi / 6, "lever_arm": 95.0, "heading": "fixed", "pushed": False} | hold
    return task_of(robot, path.sample(per_leg=1), ToolHold(**held))


def proof(path, robot, sides=None, **hold):
    free = ((-np.inf, np.inf),) * 3
    return proof_of(task(path, robot, **hold), free if sides is None else sides)


def random_poses(given, rng):
    """Poses in the base but for the origin: a random azimuth and turn."""
    azimuth, turn = rng.uniform(-np.pi, np.pi, 2)
    poses, c, s = given.poses(azimuth), np.cos(turn), np.sin(turn)
    around = np.eye(4)
    around[:2, :2] = [[c, -s], [s, c]]
    return around @ poses


def table_spans(arm, poses):
    """Travel of the table's axes in all branches, by the arm's own inverse."""
    joints, _ = arm.branches(poses, wrist_radius=arm.wrist_radii[0], continuous=False)
    return np.ptp(joints[:, :, 5:], axis=1)


def test_a_wide_flat_needs_more_table_than_there_is():
    """The case of the spec: 450 mm of path each way, a table of 400 mm, and q1 that does not turn."""
    found = proof(WIDE, ARM)
    assert (found.condition, found.unit) == ("span", "mm")
    assert found.needed == pytest.approx(450.0, abs=1e-4) and found.available == pytest.approx(400.0)
    assert str(found) == found.text and "450 mm of the table" in found.text and "it has 400 mm" in found.text
    points = WIDE.sample(per_leg=1).point[:, :2]
    turns = np.linspace(0, np.pi / 2, 1001)
    along = np.stack([points @ [np.cos(t), np.sin(t)] for t in turns])
    assert np.ptp(along, axis=1).min() == pytest.approx(450.0)  # the least extent at any turn


def test_a_larger_table_has_no_proof():
    low, high = list(ARM.position_min), list(ARM.position_max)
    low[5:], high[5:] = (-225.0, -225.0), (225.0, 225.0)
    assert proof(WIDE, ARM.replace(position_min=tuple(low), position_max=tuple(high))) is None
    low[5], high[5] = -224.9, 224.9  # a tenth of a millimetre on either side is missing
    found = proof(WIDE, ARM.replace(position_min=tuple(low), position_max=tuple(high)))
    assert found.needed == pytest.approx(450.0, abs=1e-4) and found.available == pytest.approx(449.8)


LARGE = {
    "flat": WIDE,
    "ridge": finishing.zigzag(finishing.Surface.bspline(12.0 * nominal_surface().control_points), pitch=80.0),
    "cylinder": finishing.zigzag(cylinder_surface(300.0, 700.0), pitch=80.0),
    "ball": finishing.zigzag(sphere_surface(1000.0), pitch=130.0),
}


@pytest.mark.parametrize("name", LARGE)
def test_no_turn_and_azimuth_breaks_a_span(name):
    """At random turns and azimuths an axis of the table needs at least what the proof says, in each branch."""
    found, given, rng = proof(LARGE[name], ARM), task(LARGE[name], ARM), np.random.default_rng(0)
    assert found.condition == "span" and found.needed > found.available
    for _ in range(300):
        spans = table_spans(ARM, random_poses(given, rng))
        assert spans.max(axis=1).min() >= found.needed - 1e-9


def test_a_tall_path_needs_more_wrist_than_there_is():
    """A wall: heights of all wrists are apart by those of the contacts, as the tool is held alike."""
    wall = finishing.Surface.bspline(
        [[[0, 0, 0], [0, 60, 0]], [[300, 0, 1200], [300, 60, 1200]]], degree=(1, 1)
    )
    path = finishing.zigzag(wall, pitch=20.0, along="v")
    found = proof(path, ARM)
    assert found.condition == "height"
    assert found.needed == pytest.approx(np.ptp(path.points[:, 2]), rel=0.1)
    assert found.needed <= np.ptp(path.points[:, 2]) + 1e-9
    # stretched at the radius of 350 mm: 2 sqrt(550^2 - 350^2), less where q2 and q3 end before
    assert 0 < found.available <= 2 * np.sqrt(550.0**2 - 350.0**2) + 1e-4


@pytest.mark.parametrize("robot", [UR10, IRB2400], ids=["ur10", "irb2400"])
def test_the_reach_is_not_exceeded_at_any_joints(robot):
    """The point of the tool stays within the distance of the foot, and gets within some percent of it."""
    reach = reach_of(robot)
    joints = np.random.default_rng(0).uniform(-np.pi, np.pi, (100_000, 6))
    poses = robot.forward(joints)
    away = np.linalg.norm(poses[:, :3, :3] @ reach.point + poses[:, :3, 3] - reach.foot, axis=1)
    assert 0.97 * reach.distance < away.max() <= reach.distance


def test_a_calibrated_robot_reaches_no_farther_than_its_links():
    rows = np.array([[0, 127.3, 0, 1.57], [0, 3.0, -612, 0.001], [0, 0, -572.3, 0], [0, 164, 0, 1.571],
                     [0, 115.7, 0.4, -1.57], [0, 92.2, 0, 0]])  # fmt: skip
    limits = dict.fromkeys(("speed_max", "acceleration_max", "position_max"), [3.0] * 6)
    robot = finishing.SerialRobot.from_dh(rows, position_min=[-3.0] * 6, **limits)
    reach = reach_of(robot)
    poses = robot.forward(np.random.default_rng(0).uniform(-3, 3, (100_000, 6)))
    away = np.linalg.norm(poses[:, :3, :3] @ reach.point + poses[:, :3, 3] - reach.foot, axis=1)
    assert 0.8 * reach.distance < away.max() <= reach.distance
    assert reach_of(ARM) is None


FAR = finishing.zigzag(flat_surface(2400.0), pitch=400.0)


def test_a_path_wider_than_the_reach():
    """Two corners of a flat are a diagonal apart: no point is nearer to both than half of it."""
    found = proof(FAR, UR10)
    half = pdist(FAR.sample(per_leg=1).point).max() / 2
    assert found.condition == "reach" and found.needed == pytest.approx(half, rel=1e-9)
    assert found.available == pytest.approx(np.hypot(612 + 572.3 + np.hypot(115.7, 0), 163.941), rel=1e-3)
    assert half > found.available


@pytest.mark.parametrize("name", ["sphere", "inside"])
def test_no_placement_breaks_a_reach(name):
    """Wherever the work lies, some wrist is as far from the foot as the proof says, at each turn and azimuth."""
    path = finishing.zigzag(sphere_surface(2600.0, inside=name == "inside"), pitch=500.0)
    found, given, rng = proof(path, UR10), task(path, UR10), np.random.default_rng(0)
    assert found.condition == "reach"
    reach = reach_of(UR10)
    for _ in range(300):
        poses = random_poses(given, rng)
        wrists = poses[:, :3, :3] @ reach.point + poses[:, :3, 3]
        foot = wrists.mean(axis=0) + rng.normal(size=3) * 200.0
        assert np.linalg.norm(wrists - foot, axis=1).max() >= found.needed - 1e-9


SMALL = finishing.zigzag(nominal_surface(), pitch=10.0)
BOXES = {
    "far": (UR10, [(1900.0, 2100.0), (-200.0, 200.0), (0.0, 300.0)], "reach"),
    "high": (UR10, [(-100.0, 300.0), (0.0, 200.0), (1700.0, 1800.0)], "reach"),
    "beside the table": (ARM, [(1100.0, 1400.0), (0.0, 100.0), (100.0, 100.0)], "reach"),
    "above the wrist": (ARM, [(300.0, 500.0), (-100.0, 100.0), (800.0, 900.0)], "height"),
    "below the wrist": (ARM, [(300.0, 500.0), (-100.0, 100.0), (-900.0, -500.0)], "height"),
}


@pytest.mark.parametrize("name", BOXES)
def test_no_origin_in_the_box_breaks_its_proof(name):
    """Neither random origins nor corners of the box give the robot joints within its limits everywhere."""
    robot, sides, condition = BOXES[name]
    found, given, rng = proof(SMALL, robot, tuple(sides)), task(SMALL, robot), np.random.default_rng(0)
    assert found.condition == condition and found.needed > found.available
    low, high = np.transpose(sides)
    for _ in range(200):
        poses = random_poses(given, rng)
        share = rng.uniform(size=3) if rng.uniform() < 0.5 else rng.integers(0, 2, 3)
        poses[:, :3, 3] += low + share * (high - low)
        joints = robot.solutions(poses)
        held = (joints >= np.array(robot.position_min)) & (joints <= np.array(robot.position_max))
        assert not held.all(axis=2).all(axis=0).any()  # NaN is not held


def test_the_numbers_of_a_box():
    """One contact: circle and box by plain geometry."""
    found = proof(SMALL, UR10, ((1900.0, 2100.0), (-200.0, 200.0), (0.0, 300.0)))
    reach, given = reach_of(UR10), task(SMALL, UR10)
    least = np.inf
    for azimuth in np.linspace(0, 2 * np.pi, 721):
        poses = given.poses(azimuth)
        wrists = poses[:, :3, :3] @ reach.point + poses[:, :3, 3]
        away = 1900.0 - np.hypot(wrists[:, 0], wrists[:, 1])
        drop = np.maximum(0, np.maximum(wrists[:, 2] - reach.foot[2], reach.foot[2] - wrists[:, 2] - 300.0))
        least = min(least, np.hypot(away, drop).max())
    excess = least - reach.distance
    assert 0.7 * excess <= found.needed - found.available <= excess + 1e-6


def test_where_a_placement_exists_there_is_no_proof():
    """Random problems that a robot plans somewhere, with boxes around that place: none is proved impossible."""
    rng = np.random.default_rng(5)
    for robot in (ARM, UR10, IRB2400):
        for _ in range(25):
            joints = _inner(robot, rng)
            pose = robot.forward_work(joints)
            given = task(SMALL, robot).at([int(rng.integers(0, 20))])
            azimuth = rng.uniform(-np.pi, np.pi)
            turn = pose[:3, :3] @ given.poses(azimuth)[0, :3, :3].T
            # a work that is tilted as this pose needs it: turned about z alone the surface may not be, so tilt it
            tilted = given._replace(
                point=given.point @ turn.T, normal=given.normal @ turn.T, tangent=given.tangent @ turn.T
            )
            origin = pose[:3, 3] + 95.0 * pose[:3, 2] - tilted.point[0]
            sides = tuple((at - rng.uniform(0, 50), at + rng.uniform(0, 50)) for at in origin)
            if isinstance(robot, finishing.Arm):
                sides = (*sides[:2], sides[2])
            assert proof_of(tilted, sides) is None


def _inner(robot, rng):
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    joints = low + rng.uniform(0.05, 0.95, len(low)) * (high - low)
    if not isinstance(robot, finishing.Arm):
        return joints
    for _ in range(1000):  # q2 and q3 that hold the wrist at its radius
        q2 = rng.uniform(low[1], high[1])
        share = (350.0 - robot.a2 * np.cos(q2)) / robot.a3
        q3 = -np.arccos(np.clip(share, -1, 1)) - q2
        if abs(share) < 1 and low[2] < q3 < high[2]:
            break
    joints[1:3] = q2, q3
    return joints


def test_a_robot_of_another_kind_has_no_proof():
    class Mine(finishing.Robot):
        names = UR10.names
        units = UR10.units
        position_min, position_max = UR10.position_min, UR10.position_max
        speed_max, acceleration_max, jerk_max = UR10.speed_max, UR10.acceleration_max, None

        def forward(self, joints):
            return UR10.forward(joints)

        def forward_work(self, joints):
            return UR10.forward(joints)

        def solutions(self, poses):
            return UR10.solutions(poses)

    assert proof(FAR, Mine()) is None


def test_a_tool_along_the_feed_has_no_azimuth():
    """Its proof holds for every turn; it says nothing of azimuths."""
    path = WIDE.blended(2.0)
    found = proof(path, ARM, heading="feed_aligned", pushed=True)
    given, rng = task(path, ARM, heading="feed_aligned", pushed=True), np.random.default_rng(0)
    assert found.condition == "span" and "azimuth" not in found.text
    for _ in range(100):
        assert table_spans(ARM, random_poses(given, rng)).max(axis=1).min() >= found.needed - 1e-9
    assert FinishingProblem(path).heading == "fixed"


def test_a_tool_that_spins_breaks_no_reach():
    """Each wrist may turn about its tool's axis: still one is as far from any foot as the proof says."""
    bent = UR10.replace(tool=finishing.tool(length=150.0, tilt=0.5))
    path = finishing.zigzag(sphere_surface(2600.0), pitch=500.0)
    spins = tuple(np.arange(8) * np.pi / 4)
    found, held = proof(path, bent, spins=spins), proof(path, bent)
    given, rng, reach = task(path, bent, spins=spins), np.random.default_rng(0), reach_of(bent)
    assert found.available < found.needed < held.needed
    for _ in range(100):
        poses = random_poses(given, rng)
        spin = rng.choice(spins, len(poses))
        turns = np.tile(np.eye(4), (len(poses), 1, 1))
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(spin)
        turns[:, 1, 0], turns[:, 0, 1] = np.sin(spin), -np.sin(spin)
        poses = poses @ turns
        wrists = poses[:, :3, :3] @ reach.point + poses[:, :3, 3]
        foot = wrists.mean(axis=0) + rng.normal(size=3) * 200.0
        assert np.linalg.norm(wrists - foot, axis=1).max() >= found.needed - 1e-9
