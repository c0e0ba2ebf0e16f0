"""Programs of robots: every target follows four motions, few points, feeds, numbers, files."""

import dataclasses
import json
import re
from functools import cache

import numpy as np
import pytest
from program_motions import IRB2400, PLACE, PROBLEMS, planned
from scipy.spatial.transform import Rotation

from sdpgrind import finishing
from sdpgrind.finishing._program.blocks import fits
from sdpgrind.finishing._program.course import Run, frames_of
from sdpgrind.finishing._program.form import turn_vectors
from sdpgrind.finishing._program.krl import euler_angles
from sdpgrind.finishing._program.turns import turns_of

pytestmark = pytest.mark.filterwarnings("ignore:.* is not the language of the")

TARGETS = ["urscript", "rapid", "krl", "csv", "ros", "stream"]
ENDINGS = {
    "urscript": "script",
    "rapid": "mod",
    "krl": "src",
    "csv": "csv",
    "ros": "json",
    "stream": "script",
}
LINES = ["urscript", "rapid", "krl"]


def written(target, motion, **options):
    if target == "stream":
        return motion.program("urscript", timing=True, **options)
    return motion.program(target, **options)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_a_program_keeps_its_deviation_and_no_feed_is_exceeded(target, name, tmp_path):
    motion = planned(name)
    program = written(target, motion, name="face1", deviation=0.02)
    found = program.check()
    assert found.deviation <= 0.02 and found.angle_deviation * motion.problem.lever_arm <= 0.02
    assert found.feed_excess <= 1e-6 * motion.problem.feed_rate and found.joint_speed_excess <= 0.0
    file = tmp_path / f"face1.{ENDINGS[target]}"
    program.save(file)
    assert file.read_bytes() == program.text.encode("ascii")
    assert finishing.read_program(file).check(motion) == found


def test_the_motions_are_what_they_are_called():
    def norms(name):
        turns = Rotation.from_matrix(planned(name).poses[:, :3, :3])
        return np.linalg.norm(turns.as_rotvec(), axis=1)

    corners = planned("corners")
    assert np.count_nonzero(np.diff(corners.time) == 0) >= 4
    assert np.count_nonzero(np.diff(planned("blends").time) == 0) == 0
    turned = planned("full turn")
    assert np.ptp(turned.joints[:, 5]) > 2 * np.pi * 0.95
    assert norms("near pi").max() > 3.1 and norms("corners").max() > np.pi - 1e-3


@pytest.mark.parametrize("deviation", [0.005, 0.02, 0.2])
def test_every_deviation_is_kept_and_costs_points(deviation):
    program = planned("blends").program("rapid", deviation=deviation)
    assert 0.3 * deviation < program.check().deviation <= deviation


def test_points_grow_as_the_inverse_root_of_the_deviation():
    """A chord of h leaves a curve by h^2 / 8 of its curvature."""
    counts = [planned("blends").program("krl", deviation=each).text.count("LIN ") for each in (0.005, 0.08)]
    assert counts[0] / counts[1] == pytest.approx(4.0, rel=0.25)  # ends of runs need a point each


@pytest.mark.parametrize("name", PROBLEMS)
def test_no_point_can_be_left_out(name):
    """Chord of each two neighbours of a point, against the motion, by scipy's Slerp and distances to a line."""
    from scipy.spatial.transform import Slerp

    motion, deviation = planned(name), 0.02
    path = finishing_path(motion.program("urscript", deviation=deviation))
    tips = motion.problem.robot.forward(motion.at(fine(motion)).joints)
    tips[:, :3, 3] += motion.problem.lever_arm * tips[:, :3, 2]
    points = path.points[1:-1] @ path.work[:3, :3].T + path.work[:3, 3]  # without lifts
    exact = {0, *np.flatnonzero(path.radii[:-1] == 0.0)}
    at, last = [], 0
    for point in points:  # the first near place after that of the point before
        gaps = np.linalg.norm(tips[last:, :3, 3] - point, axis=1)
        last += int(np.flatnonzero(gaps <= gaps[: max(4000, 1)].min() + 1e-9)[0])
        at.append(last)
    for k in range(len(at) - 2):
        if k + 2 in exact:
            continue
        a, b = at[k], at[k + 2]
        chord = tips[b, :3, 3] - tips[a, :3, 3]
        inner = tips[a + 1 : b]
        share = np.clip((inner[:, :3, 3] - tips[a, :3, 3]) @ chord / (chord @ chord), 0, 1)
        off = np.linalg.norm(inner[:, :3, 3] - tips[a, :3, 3] - share[:, None] * chord, axis=1).max()
        turns = Slerp([0, 1], Rotation.from_matrix(tips[[a, b], :3, :3]))(share)
        turned = (turns.inv() * Rotation.from_matrix(inner[:, :3, :3])).magnitude().max()
        assert max(off, motion.problem.lever_arm * turned) > 0.9 * deviation / 2


def finishing_path(program):
    from sdpgrind.finishing._program.read_program import read_text

    return read_text(program.text)


def fine(motion):
    time, length = motion.profile[:, 0], motion.at(motion.profile[:, 0]).length
    parts = np.maximum(np.ceil(np.diff(length) / 0.02), 1)
    return np.interp(np.arange(parts.sum() + 1), np.append(0, np.cumsum(parts)), time)


def test_a_chord_on_an_arc_by_its_closed_form():
    """0.2 mm steps on a radius of 0.3 mm: 0.3 (1 - cos(asin(1/3))) = 0.017157 mm."""
    angle = np.linspace(0.0, 2 * np.arcsin(1 / 3), 201)
    points = 0.3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    level = np.tile([0.0, 0.0, 0.0, 1.0], (201, 1))
    run = Run(angle, angle, points, level, level, np.empty((201, 0)))
    assert np.linalg.norm(points[-1] - points[0]) == pytest.approx(0.2)
    assert fits(run, 0, 200, 0.017157 + 1e-6, 95.0) and not fits(run, 0, 200, 0.017157 - 1e-6, 95.0)


@pytest.mark.parametrize("target", LINES)
def test_a_blend_leaves_a_corner_by_the_printed_amount(target):
    """A blend of r before a corner of turning angle t leaves it by r tan(t / 4)."""
    path = finishing_path(planned("blends").program(target))
    before, here, after = path.points[:-2], path.points[1:-1], path.points[2:]
    u, v = here - before, after - here
    sizes = np.linalg.norm(u, axis=1), np.linalg.norm(v, axis=1)
    turn = np.arccos(np.clip(np.sum(u * v, axis=1) / sizes[0] / sizes[1], -1, 1))
    radii = path.radii[1:-1]
    assert (radii * np.tan(turn / 4)).max() <= 0.01 and np.all(radii <= 0.45 * np.minimum(*sizes) + 1e-4)
    assert np.count_nonzero(radii) > 0.9 * len(radii)


def test_the_tool_is_the_contact_in_the_flange_of_the_controller():
    motion = planned("near pi")
    there = frames_of(motion)
    assert np.allclose(there.tool[:3, 3], [0, 0, 150.0 + motion.problem.lever_arm])
    problem = finishing.FinishingProblem(
        finishing.hilbert(motion.problem.surface, 2), robot=IRB2400, placement=(900.0, -25.0, 0.0)
    )
    other = finishing.plan(problem)
    assert np.allclose(
        frames_of(other).tool[:3, 3], [0, 0, 150.0 + problem.lever_arm]
    )  # z of tool0 is axis 6
    assert np.allclose(frames_of(other).tool[:3, :3], np.eye(3))
    for target in LINES:
        assert other.program(target).check().deviation <= 0.02


def test_an_arm_over_a_table_has_a_table_of_joints_alone(tmp_path):
    path = finishing.hilbert(finishing.surface.flat_surface(8.0), 2, mapping="parametric")
    motion = finishing.plan(finishing.FinishingProblem(path))
    program = motion.program("csv")
    names = next(line for line in program.text.splitlines() if line.startswith("time_s")).split(",")
    assert names == ["time_s", "q1_rad", "q2_rad", "q3_rad", "q4_rad", "q5_rad", "X_mm", "Y_mm"]
    assert program.check().deviation <= 0.02
    with pytest.raises(ValueError, match=r"robot must be a SerialRobot.*for krl.*take csv or ros"):
        motion.program("krl")


def cubic(points, name, seconds):
    """Value of one joint on the cubic between the points around a time (s), by Hermite's formula."""
    time = [each["time_from_start"]["sec"] + 1e-9 * each["time_from_start"]["nanosec"] for each in points]
    k = min(int(np.searchsorted(time, seconds, side="right")) - 1, len(time) - 2)
    step = time[k + 1] - time[k]
    u = (seconds - time[k]) / step
    (p, v), (q, w) = ((each["positions"][name], each["velocities"][name]) for each in points[k : k + 2])
    hermite = (
        (1 + 2 * u) * (1 - u) ** 2,
        u * (1 - u) ** 2 * step,
        u * u * (3 - 2 * u),
        -u * u * (1 - u) * step,
    )
    return hermite[0] * p + hermite[1] * v + hermite[2] * q + hermite[3] * w


def test_a_trajectory_of_ros_is_the_motion_in_m_and_rad():
    """Between its points, too: nanoseconds at 1 rad/s and ten decimals are 1e-9 rad."""
    path = finishing.hilbert(finishing.surface.flat_surface(8.0), 2, mapping="parametric")
    motion = finishing.plan(finishing.FinishingProblem(path))
    told = json.loads(motion.program("ros").text)
    message = told["trajectory"]
    assert message["joint_names"] == ["q1", "q2", "q3", "q4", "q5", "X", "Y"]
    assert told["units"] == ["rad"] * 5 + ["m"] * 2 and set(message) == {"header", "joint_names", "points"}
    scale = np.array([1.0] * 5 + [1e-3] * 2)
    for seconds in np.linspace(0.0, motion.duration, 97)[:-1]:
        found = [cubic(message["points"], k, seconds) for k in range(7)]
        assert found == pytest.approx(motion.at(seconds).joints * scale, abs=5e-9)
    assert message["points"][-1]["velocities"] == pytest.approx([0.0] * 7, abs=1e-9)  # or it is refused
    assert motion.program("ros").check().deviation < 1e-5
    assert not re.search(r"\de[+-]?\d", motion.program("ros").text)  # a number to readers of YAML, too


def test_a_table_has_more_rows_where_the_deviation_asks_for_them():
    coarse, near = (planned("near pi").program("csv", deviation=each) for each in (0.02, 0.002))
    assert near.text.count("\n") > 1.5 * coarse.text.count("\n") and near.check().deviation <= 0.002


def test_rotation_vectors_continue():
    angle = np.linspace(0.2, 2 * np.pi - 0.2, 50)
    turns = Rotation.from_rotvec(angle[:, None] * [0.0, 0.6, 0.8]).as_quat()
    vectors = turn_vectors(turns)
    assert np.linalg.norm(np.diff(vectors, axis=0), axis=1).max() < 0.13
    assert (Rotation.from_rotvec(vectors) * Rotation.from_quat(turns).inv()).magnitude().max() < 1e-12


def test_euler_angles_of_krl_at_the_pole():
    """At B = +-90 deg A stays, C takes the rest; elsewhere as scipy's."""
    rng = np.random.default_rng(0)
    turns = Rotation.random(200, rng=rng)
    ours = euler_angles(turns.as_quat())
    assert (Rotation.from_euler("ZYX", ours) * turns.inv()).magnitude().max() < 1e-12
    for sign in (-1, 1):
        pole = Rotation.from_euler("ZYX", [[0.3, 0.1, 0.2], [0.7, sign * np.pi / 2, 0.4]])
        ours = euler_angles(pole.as_quat())
        assert ours[1, 0] == pytest.approx(ours[0, 0]) and ours[1, 1] == pytest.approx(sign * np.pi / 2)
        assert (Rotation.from_euler("ZYX", ours) * pole.inv()).magnitude().max() < 1e-7


def test_a_program_starts_and_ends_off_the_work():
    motion = planned("near pi")
    path = finishing_path(motion.program("rapid"))
    normal = motion.problem.path.sample(per_leg=1).normal
    assert path.points[-1] - path.points[-2] == pytest.approx(20.0 * normal[-1], abs=2e-3)
    start = motion.problem.robot.forward(path.approach[0])
    contact = start[:3, 3] + motion.problem.lever_arm * start[:3, 2] - PLACE
    assert contact - path.points[0] == pytest.approx(20.0 * normal[0], abs=2e-3)


@cache
def out_of_reach():
    """A feed of 600 mm/s is asked for; corners and joints allow a quarter of it."""
    return finishing.plan(planned("small").problem.replace(feed_rate=600.0))


@pytest.mark.parametrize("target", LINES)
def test_a_program_comes_down_and_leaves_no_faster_than_the_plan_drives(target):
    """Also 1800, meant in mm/min: the plan drives at 19 mm/s, the tool came down at the commanded feed."""
    motion = out_of_reach()
    fastest = float(motion.feed_rate.max())
    assert fastest < 200.0
    program = motion.program(target)
    feeds = finishing_path(program).feeds
    assert feeds[[0, -1]] == pytest.approx(fastest, abs=2e-4) and feeds.max() <= fastest * (1 + 1e-6)
    assert f"planned feed at most {fastest:g} mm/s of 600 commanded" in program.text
    assert "commanded" not in planned("small").program(target).text
    assert finishing_path(planned("small").program(target)).feeds[[0, -1]] == pytest.approx(25.0, rel=1e-6)


def test_a_program_that_comes_down_at_the_commanded_feed_is_refused(tmp_path):
    program = out_of_reach().program("urscript")
    feed = re.search(r"v=(0\.\d+), r=0.0000000", program.text)[1]
    changed = dataclasses.replace(program, text=program.text.replace(f"v={feed}", "v=0.6000000", 1))
    assert changed.check().feed_excess == pytest.approx(600.0 - out_of_reach().feed_rate.max(), rel=1e-6)
    with pytest.raises(ValueError, match=r"text must not be faster than the plan \(mm/s\)"):
        changed.save(tmp_path / "finishing.script")


def test_joint_moves_around_a_stream_are_no_faster_than_the_plan():
    """Contact in a joint move, by its leading joint at the speed told, in steps of a thousandth."""
    motion = planned("small")
    program = motion.program("urscript", timing=True)
    found = re.findall(r"movej\(\[(.*)\], a=0.5, v=(.*)\)", program.text)
    joints = [np.array(each.split(","), dtype=float) for each, _ in found]
    assert found[0][1] == "0.25"  # to the start, above the work
    ways = (joints[0], joints[1]), (motion.joints[-1], joints[2])
    for (start, end), (_, pace) in zip(ways, found[1:], strict=True):
        between = start + np.linspace(0, 1, 1001)[:, None] * (end - start)
        tips = motion.problem.robot.forward(between)
        tips = tips[:, :3, 3] + motion.problem.lever_arm * tips[:, :3, 2]
        turn = np.abs(end - start).max() / 1000
        speed = float(pace) * np.linalg.norm(np.diff(tips, axis=0), axis=1) / turn
        assert 0.99 * 25.0 < speed.max() < 25.0 * (1 + 1e-3)
    assert -0.1 < program.check().feed_excess <= 0.0
    faster = dataclasses.replace(program, text=program.text.replace(f"v={found[1][1]}", "v=0.25", 1))
    assert faster.check().feed_excess > 25.0


def test_what_the_files_say():
    motion = planned("near pi")
    for target in LINES:
        text = motion.program(target, name="face1", date="2026-11-29").text
        assert "time is not kept" in text and "2026-11-29" in text and text.isascii()
        assert ("\r\n" in text) == (target != "urscript")
        assert "2026" not in motion.program(target, name="face1").text.split("frames")[0]
    assert "time is kept" in motion.program("urscript", timing=True).text
    assert max(map(len, motion.program("krl").text.splitlines())) <= 140
    assert (
        re.search(r"^stopl", motion.program("urscript").text, re.MULTILINE) is None
    )  # inside of the program


def test_a_killed_save_leaves_the_old_file(tmp_path, monkeypatch):
    program = planned("near pi").program("krl", name="face1")
    file = tmp_path / "face1.src"
    file.write_text("old")

    def killed(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("sdpgrind.base.whole_files.durable", killed)
    with pytest.raises(KeyboardInterrupt):
        program.save(file)
    assert file.read_text() == "old" and list(tmp_path.iterdir()) == [file]


def test_quaternions_are_those_of_scipy_also_of_half_turns_and_of_what_is_no_rotation():
    poses = np.tile(np.eye(4), (300, 1, 1))
    poses[:, :3, :3] = Rotation.random(300, random_state=1).as_matrix()
    poses[:3, :3, :3] = Rotation.from_rotvec(np.pi * np.eye(3)).as_matrix()
    np.testing.assert_allclose(turns_of(poses), Rotation.from_matrix(poses[:, :3, :3]).as_quat(), atol=1e-15)
    poses[7, :3, :3] *= 1.0 + 1e-6
    np.testing.assert_array_equal(turns_of(poses), Rotation.from_matrix(poses[:, :3, :3]).as_quat())
