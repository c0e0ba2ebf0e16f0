"""Motions of any robot: where they go, that another way to plan gives the same, files, placement, face-on tools."""

import numpy as np
import pytest
from robot_twins import CHAINS, IRB2400, UR10, about, chain, dh

import hwsim
import sdpgrind
from sdpgrind import finishing
from sdpgrind.finishing import FinishingProblem, Posture, Robot
from sdpgrind.finishing.arm import Redundancy
from sdpgrind.finishing.arm._choice import choose

FLAT = finishing.hilbert(finishing.surface.flat_surface(8.0), 2, mapping="parametric")
DIE = finishing.hilbert(finishing.surface.nominal_surface(), 2)
PLACE = (650.0, -25.0, 100.0)
HELD = {
    "ur10": UR10.replace(tool=finishing.tool(length=150.0)),
    "irb2400": IRB2400.replace(tool=finishing.tool(length=150.0, axis="x")),
}
PROBLEMS = {
    "ur10": FinishingProblem(DIE, robot=HELD["ur10"], placement=PLACE),
    "irb2400": FinishingProblem(DIE, robot=HELD["irb2400"], placement=(900.0, -25.0, 0.0)),
}


@pytest.fixture(scope="module")
def motions():
    return {name: finishing.plan(problem) for name, problem in PROBLEMS.items()}


def flange(name, q):
    """Pose of frame P, written out: rows of the UR10, the URDF chain of the IRB 2400, and the tool."""
    ahead = np.eye(4)
    ahead[:3, 3] = [0, 0, 150.0]
    if name == "irb2400":
        turn = np.eye(4)
        turn[:3, :3] = about([0, 1, 0], np.pi / 2)
        return chain(CHAINS[name], q) @ turn @ ahead
    d, a = (127.3, 0, 0, 163.941, 115.7, 92.2), (0, -612.0, -572.3, 0, 0, 0)
    pose = np.eye(4)
    for k, alpha in enumerate((np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0)):
        pose = pose @ dh(q[k], d[k], a[k], alpha)
    return pose @ ahead


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_tip_is_on_the_path_and_the_tool_at_its_angle(name, motions):
    motion, problem = motions[name], PROBLEMS[name]
    there = motion.at(np.linspace(0, motion.duration, 60))
    on = problem.path.at(there.length)
    for q, point, normal in zip(there.joints, on.point, on.normal, strict=True):
        pose = flange(name, q)
        tip = pose[:3, 3] + problem.lever_arm * pose[:3, 2] - problem.placement
        assert np.abs(tip - point).max() < 1e-4  # splines of the joints, steps of 0.25 mm
        assert np.arcsin(-pose[:3, 2] @ normal) == pytest.approx(problem.contact_angle, abs=1e-5)
    assert motion.error < 1e-4 and motion.worst_violation.ratio <= 1 + 1e-9
    assert motion.joints.shape[1] == 6 and motion.profile.shape[1] == 7


@pytest.mark.parametrize("name", PROBLEMS)
def test_no_branch_travels_less(name, motions):
    """All eight branches, followed pose by pose in plain Python."""
    motion, problem = motions[name], PROBLEMS[name]
    robot, poses = problem.robot, problem.robot.forward(motion.joints[::5])
    found, times = robot.solutions(poses), {}
    for branch in range(8):
        course = found[:, branch]
        if np.isnan(course).any():
            continue
        course = np.unwrap(course, axis=0)
        inside = [
            any(
                low <= (course[:, j] + 2 * np.pi * k).min() and (course[:, j] + 2 * np.pi * k).max() <= high
                for k in range(-3, 4)
            )
            for j, (low, high) in enumerate(zip(robot.position_min, robot.position_max, strict=True))
        ]
        if all(inside) and np.abs(np.diff(course, axis=0)).max() < 1:
            times[branch] = (np.abs(np.diff(course, axis=0)) / robot.speed_max).max(axis=1).sum()
    assert motion.posture.branch in times
    assert times[motion.posture.branch] == pytest.approx(min(times.values()), rel=1e-6)
    assert motion.posture.free == {} and motion.posture.placement == problem.placement


def test_the_nearest_singular_pose(motions):
    motion = motions["ur10"]
    worst = motion.worst_singularity
    q = motion.joints
    a2, a3, d5 = -612.0, -572.3, 115.7
    rho = a2 * np.cos(q[:, 1]) + a3 * np.cos(q[:, 1] + q[:, 2]) + d5 * np.sin(q[:, 1:4].sum(axis=1))
    by_hand = {
        "shoulder": np.abs(rho) / 1184.3,
        "elbow": np.abs(np.sin(q[:, 2])),
        "wrist": np.abs(np.sin(q[:, 4])),
    }
    assert worst.distance == pytest.approx(min(each.min() for each in by_hand.values()), abs=1e-12)
    assert worst.each == pytest.approx({key: value.min() for key, value in by_hand.items()}, abs=1e-12)
    row = int(np.argmin(by_hand[worst.name]))
    assert worst.time == motion.time[row] and worst.length == motion.length[row]
    assert str(worst).startswith(f"{worst.distance:.3g} from {worst.name} singularity at")


def test_saved_loaded_drawn_and_told(motions, tmp_path):
    pytest.importorskip("matplotlib").use("agg")
    for name, motion in motions.items():
        motion.save(tmp_path / "motion.nc")
        back = sdpgrind.load(tmp_path / "motion.nc")
        assert back.problem == motion.problem and back.posture == motion.posture
        assert hash(back.problem.robot) == hash(motion.problem.robot)
        np.testing.assert_array_equal(back.joints, motion.joints)
        assert repr(back) == repr(motion) and back.worst_singularity == motion.worst_singularity
        legend = motion.plot().axes[-1].get_legend() or motion.plot().axes[3].get_legend()
        told = {
            text.get_text() for axis in motion.plot().axes if (box := axis.get_legend()) for text in box.texts
        }
        assert legend and set(motion.problem.robot.names) <= told, name


class Mine(Robot):
    """A user's robot: the generic arm, told in the words of the protocol alone."""

    def __init__(self, arm):
        self.arm = arm

    names = property(lambda self: self.arm.names)
    units = property(lambda self: self.arm.units)
    position_min = property(lambda self: self.arm.position_min)
    position_max = property(lambda self: self.arm.position_max)
    speed_max = property(lambda self: self.arm.speed_max)
    acceleration_max = property(lambda self: self.arm.acceleration_max)
    jerk_max = property(lambda self: self.arm.jerk_max)
    redundancy = property(lambda self: (Redundancy("wrist_radius", (320.0, 380.0)),))

    def forward(self, joints):
        return self.arm.forward(joints)

    def forward_work(self, joints):
        return self.arm.forward_work(joints)

    def solutions(self, poses):
        return self.arm.replace(wrist_radius=(320.0, 380.0)).solutions(poses)


def test_a_robot_of_the_users_own_class_is_planned_as_the_arm_is():
    """The same robot through the protocol: another code chooses branch and radius, with the same result."""
    arm = finishing.Arm.generic().replace(wrist_radius=(320.0, 380.0))
    place = (480.0, -10.0, 100.0)
    one = finishing.plan(FinishingProblem(FLAT, robot=arm, placement=place))
    other = finishing.plan(FinishingProblem(FLAT, robot=Mine(arm), placement=place))
    np.testing.assert_allclose(other.joints, one.joints, atol=1e-9)
    assert other.duration == pytest.approx(one.duration, rel=1e-9)
    for name in ("branch", "placement"):
        told = getattr(one.posture, name), getattr(other.posture, name)
        assert told[0] == told[1] % 4 if name == "branch" else told[0] == told[1]
    assert one.posture.free["wrist_radius"].tolist() == other.posture.free["wrist_radius"].tolist()
    assert len(one.posture.free["wrist_radius"]) == len(one.time)
    np.testing.assert_allclose(Mine(arm).jacobian(one.joints[:5]), arm.jacobian(one.joints[:5]), atol=1e-6)
    assert 0 < other.worst_singularity.distance < 1 and other.worst_singularity.name == "pose"


def test_what_is_no_robot_is_refused():
    class Half:
        names, units = ("a",), ("rad",)

    with pytest.raises(
        TypeError, match=r"robot must be a robot: an Arm, a SerialRobot, .*without acceleration_max, forward"
    ):
        FinishingProblem(FLAT, robot=Half())
    with pytest.raises(TypeError, match=r"robot must be a robot: .*; got 'ur10'"):
        FinishingProblem(FLAT, robot="ur10")
    for robot in (finishing.Arm.generic(), UR10, Mine(finishing.Arm.generic())):
        assert isinstance(robot, Robot)

    class Flat(Mine):
        def solutions(self, poses):
            return super().solutions(poses)[:, 0]

    with pytest.raises(
        ValueError, match=r"solutions of the robot must be of shape \(\d+, b, 7\); got \(\d+, 7\)"
    ):
        finishing.plan(
            FinishingProblem(FLAT, robot=Flat(finishing.Arm.generic()), placement=(480.0, -10.0, 100.0))
        )


def test_a_turn_of_the_work_turns_it_below_the_tool():
    """Turned by a right angle, the path goes along y: the place of every point, and the azimuth in the base."""
    problem = FinishingProblem(FLAT, robot=HELD["ur10"], placement=(650.0, -25.0, 100.0, np.pi / 2))
    motion = finishing.plan(problem)
    poses = np.array([flange("ur10", q) for q in motion.joints[::7]])
    tips = poses[:, :3, 3] + problem.lever_arm * poses[:, :3, 2] - PLACE
    on = FLAT.at(motion.length[::7]).point
    np.testing.assert_allclose(tips, np.column_stack([-on[:, 1], on[:, 0], on[:, 2]]), atol=1e-4)
    assert motion.error < 1e-4
    ahead = poses[:, :3, 2] @ [1.0, 0.0, 0.0]  # the azimuth 0 is along x of the base: z_P leans along it
    np.testing.assert_allclose(ahead, np.cos(problem.contact_angle), atol=1e-5)
    plain = finishing.plan(problem.replace(placement=PLACE))
    assert set(plain.torque_per_force.round(9)) == set(motion.torque_per_force.round(9))
    with pytest.raises(
        ValueError, match=r"turn of placement must be within a turn; units.deg\(90\) \(rad\); got 90.0"
    ):
        problem.replace(placement=(650.0, -25.0, 100.0, 90.0))


def test_a_tool_face_on_is_planned_but_not_pressed_by_a_torque():
    problem = FinishingProblem(DIE, robot=HELD["ur10"], placement=PLACE, contact_angle=np.pi / 2)
    motion = finishing.plan(problem)
    normal = problem.path.at(motion.length[::9]).normal
    np.testing.assert_allclose(motion.poses[::9, :3, 2], -normal, atol=1e-4)
    said = r"contact_angle must be < pi/2: no torque of the axis presses a tool that is face-on \(rad\); got 1.57"
    with pytest.raises(ValueError, match=said):
        _ = motion.torque_per_force
    with pytest.raises(ValueError, match=said):
        finishing.TorqueController(finishing.TorqueAxis(), motion, normal_force=1.1)
    with pytest.raises(ValueError, match=r"contact_angle of the problem must be < pi/2: no torque"):
        hwsim.FinishingCell(problem)
    with pytest.raises(ValueError, match=r"contact_angle must be < pi/2: a tool face-on locks itself"):
        problem.torque_per_force(0.0)


def test_in_the_cell_the_contact_follows_the_path():
    for placement in (PLACE, (*PLACE, 0.3)):
        problem = FinishingProblem(FLAT, robot=HELD["ur10"], placement=placement)
        motion = finishing.plan(problem)
        controller = finishing.TorqueController(finishing.TorqueAxis(), motion, normal_force=1.1, kind="lqg")
        log = hwsim.run(hwsim.FinishingCell(problem), controller, rng=0)
        assert float(log.outcome.normal_force[0]) == pytest.approx(1.1, abs=0.01)
        assert float(log.outcome.path_deviation[0]) < 1e-4  # no table, no error of its loop
        ends = log.outcome.true_x.values[0, -1], log.outcome.true_y.values[0, -1]
        np.testing.assert_allclose(ends, FLAT.at(FLAT.length).point.ravel()[:2], atol=1e-2)
    with pytest.raises(ValueError, match=r"motion must be an array \(m, 7\) of times and 6 joints, m >= 2"):
        machine = hwsim.FinishingCell(problem).start(np.random.default_rng(0))
        machine.step({"motion": np.zeros((3, 8))}, 1)


def test_a_table_has_the_same_error_in_a_turned_work():
    """Arm and table with the work turned: the deviation of the contact is that of the path run in that direction."""
    arm = finishing.Arm.generic()
    placement = (*finishing.plan(FinishingProblem(FLAT)).posture.placement, np.pi / 2)
    problem = FinishingProblem(FLAT, robot=arm, placement=placement)
    motion = finishing.plan(problem)
    controller = finishing.TorqueController(finishing.TorqueAxis(), motion, normal_force=1.1, kind="lqg")
    outcome = hwsim.run(hwsim.FinishingCell(problem), controller, rng=0).outcome
    flat = finishing.plan(FinishingProblem(FLAT))
    plain = hwsim.run(
        hwsim.FinishingCell(FinishingProblem(FLAT)),
        finishing.TorqueController(finishing.TorqueAxis(), flat, normal_force=1.1, kind="lqg"),
        rng=0,
    ).outcome
    assert float(outcome.path_deviation[0]) == pytest.approx(float(plain.path_deviation[0]), rel=0.05)


def test_where_no_branch_serves():
    problem = PROBLEMS["ur10"]
    with pytest.raises(
        ValueError,
        match=r"the robot must reach the path: try another placement or azimuth \(now 0 rad\) \(no branch is within limits;"
        r" nearest comes branch \d: poses\[0\] is out of reach by \d+\.?\d* mm",
    ):
        finishing.plan(problem.replace(placement=(1650.0, -25.0, 100.0)))
    tight = HELD["ur10"].replace(position_min=(2.0,) * 6, position_max=(2.2,) * 6)
    with pytest.raises(
        ValueError, match=r"q\d must be in \[2, 2.2\] \(rad\); got .* at poses\[\d+\], beyond by .* rad"
    ):
        finishing.plan(problem.replace(robot=tight))


def test_through_a_singular_pose_no_branch_goes():
    """Axis 6 passes axis 4 on the way: joints 4 and 6 would jump by half a turn. Another shoulder and another
    elbow could go, but for narrow limits of joints 1 and 3.
    """
    low, high = list(IRB2400.position_min), list(IRB2400.position_max)
    low[0], high[0], low[2], high[2] = -1.0, 1.0, -0.45, -0.35
    robot = IRB2400.replace(position_min=tuple(low), position_max=tuple(high))
    joints = np.tile([0.3, 0.2, -0.4, 0.5, 0.0, -0.7], (21, 1))
    joints[:, 4] = np.linspace(-0.1, 0.1, 21) + 1e-4
    poses = robot.forward(joints)
    with pytest.raises(
        ValueError, match=r"q\d must turn by at most 1 \(rad\) .* or the robot comes through a singular pose"
    ):
        choose(robot, poses)
    np.testing.assert_allclose(choose(robot, poses[11:]).joints, joints[11:], atol=1e-9)
    assert abs(choose(IRB2400, poses).joints[0, 0] - 0.3) > 1  # over its head


def test_along_the_feed_a_wrist_turns_the_tool_without_a_table():
    problem = FinishingProblem(
        FLAT.blended(0.2), robot=HELD["ur10"], placement=PLACE, heading="feed_aligned", pushed=True
    )
    with pytest.warns(UserWarning, match=r"0.569 mm/s \('trapezoid': all along as slow"):
        motion = finishing.plan(problem)
    on = problem.path.at(motion.length)
    along = np.einsum("ij,ij->i", motion.poses[:, :3, 2], on.tangent)
    np.testing.assert_allclose(along, np.cos(problem.contact_angle), atol=1e-2)
    with pytest.raises(
        ValueError, match=r"path must be without sharp corners where heading is 'feed_aligned', .*got 12 of"
    ):
        finishing.plan(problem.replace(path=FLAT))


def test_former_names_warn_and_mean_the_same():
    arm = finishing.Arm.generic().replace(d5=120.0)
    wanted = FinishingProblem(FLAT, robot=arm.replace(wrist_radius=(340.0, 360.0)))
    with pytest.warns(DeprecationWarning, match=r"FinishingProblem\(arm=\) is now robot") as told:
        old = FinishingProblem(FLAT, arm=arm.replace(wrist_radius=(340.0, 360.0)))
    assert old == wanted and told[0].filename == __file__
    with pytest.warns(DeprecationWarning) as told:
        both = FinishingProblem(FLAT, arm=arm, wrist_radius=(340.0, 360.0))
    assert both == wanted and len(told) == 2
    with pytest.warns(
        DeprecationWarning, match=r"wrist_radius=\) is now robot=arm.replace\(wrist_radius=...\)"
    ):
        assert FinishingProblem(FLAT, robot=arm).replace(wrist_radius=(340.0, 360.0)) == wanted
    with pytest.warns(DeprecationWarning, match=r"FinishingProblem.arm is now FinishingProblem.robot"):
        assert wanted.arm is wanted.robot
    with pytest.warns(DeprecationWarning, match=r"FinishingProblem.wrist_radius is now robot.wrist_radius"):
        assert wanted.wrist_radius == (340.0, 360.0)
    with pytest.warns(
        DeprecationWarning, match=r"Posture.wrist_radius is now Posture.free\['wrist_radius'\]"
    ):
        assert Posture(0, PLACE, {"wrist_radius": np.full(3, 340.0)}).wrist_radius == 340.0
    with (
        pytest.warns(DeprecationWarning),
        pytest.raises(ValueError, match=r"robot must be given once; got arm= as well"),
    ):
        FinishingProblem(FLAT, arm=arm, robot=arm)
    with (
        pytest.warns(DeprecationWarning),
        pytest.raises(TypeError, match=r"robot must be an Arm where wrist_radius is given"),
    ):
        PROBLEMS["ur10"].replace(wrist_radius=350.0)
    with pytest.raises(ValueError, match=r"wrist_radius\[1\] must be > 0 \(mm\); got -1.0"):
        arm.replace(wrist_radius=(350.0, -1.0))
    with pytest.raises(ValueError, match=r"wrist_radius must be one number or several \(mm\); got \[\]"):
        arm.replace(wrist_radius=[])


def test_solutions_of_the_arm_are_its_branches():
    arm = finishing.Arm.generic().replace(wrist_radius=(300.0, 700.0))
    poses = arm.forward_work(
        np.random.default_rng(0).uniform(-0.3, 0.3, (20, 7)) + np.array([0, 0.4, -1.2, 0, 0, 0, 0])
    )
    found = arm.solutions(poses)
    joints, _ = arm.branches(poses, wrist_radius=300.0, continuous=False)
    there = ~np.isnan(found[:, :4, 0])
    np.testing.assert_array_equal(found[:, :4][there], joints.swapaxes(0, 1)[there])
    assert found.shape == (20, 8, 7) and np.isnan(found[:, 4:]).all()  # 700 mm is beyond both links
    assert arm.redundancy == (Redundancy("wrist_radius", (300.0, 700.0)),)


def test_presets_say_where_they_come_from():
    told = {info.name: info for info in finishing.robots()}
    assert told.keys() == {"generic", "ur10", "irb2400"}
    assert finishing.robot("generic") == finishing.Arm.generic()
    assert "calibration" in told["ur10"].calibrated and "lever" in told["irb2400"].calibrated
