"""A motion: where it goes, that it keeps its limits, what it costs to rest at corners; saved and loaded; what
is refused.
"""

from pathlib import Path

import numpy as np
import pytest

import sdpgrind
from sdpgrind import finishing, units
from sdpgrind.finishing._problem.joint_runs import check_ends, posture_of
from sdpgrind.finishing.timing import _laws
from sdpgrind.finishing.timing._limits import LawError

STEP = Path(__file__).parents[1] / "data" / "step"
FLAT = finishing.hilbert(finishing.surface.flat_surface(16.0), 3, mapping="parametric")
DIE = finishing.hilbert(finishing.surface.nominal_surface(), 3)
SHARP = finishing.hilbert(finishing.surface.nominal_surface(), 2)
EASY = finishing.FinishingProblem(FLAT)


@pytest.fixture(scope="module")
def motion():
    return finishing.plan(finishing.FinishingProblem(DIE))


def tips(problem, motion, joints):
    """Where a chain of links puts the tip, over the work: written out from the Denavit-Hartenberg table."""
    out = []
    for q1, q2, q3, q4, q5, x, y in joints:
        pose = np.eye(4)
        for theta, d, a, alpha in (
            (q1, 400, 0, np.pi / 2), (q2, 0, 300, 0), (q3, 0, 250, 0), (q4 + np.pi / 2, 0, 0, np.pi / 2), (q5, 100, 0, 0),
        ):  # fmt: skip
            c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
            pose = pose @ [
                [c, -s * ca, s * sa, a * c],
                [s, c * ca, -c * sa, a * s],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
        out.append(pose[:3, 3] + problem.lever_arm * pose[:3, 2] - [x, y, 0] - motion.posture.placement)
    return np.array(out)


def test_the_tip_is_on_the_path_at_the_rows_and_between(motion):
    at = np.linspace(0, motion.duration, 400)
    there = motion.at(at)
    wanted = motion.problem.path.at(there.length).point
    np.testing.assert_allclose(tips(motion.problem, motion, there.joints), wanted, atol=5e-5)
    assert motion.error < 5e-5
    np.testing.assert_allclose(motion.points, tips(motion.problem, motion, motion.joints), atol=1e-9)


def test_the_tool_stands_at_the_contact_angle(motion):
    """In the frame of the work: the axis leans by the contact angle against the tangent plane, y_P lies in
    it.
    """
    axis, shaft = motion.poses[:, :3, 2], motion.poses[:, :3, 1]
    normal = motion.problem.path.at(motion.length).normal
    lean = np.arcsin(-np.einsum("ij,ij->i", axis, normal))
    np.testing.assert_allclose(lean, motion.problem.contact_angle, atol=1e-6)
    np.testing.assert_allclose(np.einsum("ij,ij->i", shaft, normal), 0.0, atol=1e-6)


def test_rest_at_corners_is_a_trapezoid_for_each_run():
    """Flat, and joints that can follow: every run takes L/v + v/a or 2 sqrt(L/a), added up by hand."""
    fast = EASY.replace(robot=EASY.robot.replace(acceleration_max=(1e4,) * 5 + (1e6,) * 2))
    motion = finishing.plan(fast)
    runs = np.diff(np.flatnonzero(np.concatenate([[True], turns(FLAT.nodes), [True]]))) * 2.0  # mm, pitch 2
    v, a = fast.feed_rate, fast.acceleration
    times = np.where(runs >= v**2 / a, runs / v + v / a, 2 * np.sqrt(runs / a))
    assert motion.duration == pytest.approx(times.sum(), rel=1e-9)
    assert motion.mean_feed_rate == pytest.approx(FLAT.length / times.sum(), rel=1e-9)


def turns(nodes):
    ways = np.diff(nodes, axis=0)
    return np.abs(ways[1:, 0] * ways[:-1, 1] - ways[1:, 1] * ways[:-1, 0]) > 1e-12


def test_limits_are_held_between_the_rows(motion):
    """Differences of the joints on a grid of its own, not what the plan says of itself."""
    arm, step = motion.problem.robot, 1e-4
    inner = np.concatenate(
        [np.linspace(a + 3 * step, b - 3 * step, 20) for a, b in zip(*pieces(motion), strict=True)]
    )
    before, here, after = (motion.at(inner + shift).joints for shift in (-step, 0.0, step))
    speed, force = (after - before) / (2 * step), (after - 2 * here + before) / step**2
    assert np.abs(speed / arm.speed_max).max() <= 1.001
    assert np.abs(force / arm.acceleration_max).max() <= 1.01
    assert motion.worst_violation.ratio <= 1 + 1e-9


def pieces(motion):
    """Begin and end of the rows that last long enough for differences."""
    t = motion.profile[:, 0]
    long = np.diff(t) > 1e-3
    return t[:-1][long][::7], t[1:][long][::7]


def test_force_needs_another_torque_in_every_direction_of_feed():
    motion = finishing.plan(EASY)
    angle, mu, lever = EASY.contact_angle, EASY.friction_ratio, EASY.lever_arm / 1000
    shares = lever * (np.cos(angle) - mu * np.array([1, 0, -1]) * np.sin(angle))  # pushed, across, dragged
    np.testing.assert_allclose(np.unique(motion.torque_per_force.round(12)), np.sort(shares), rtol=1e-9)
    twice = np.flatnonzero(np.diff(motion.time) == 0)
    assert len(twice) == turns(FLAT.nodes).sum()
    assert np.all(motion.torque_per_force[twice] != motion.torque_per_force[twice + 1])


def test_the_work_is_put_where_the_table_works_about_its_middle(motion):
    table = motion.joints[:, 5:]
    np.testing.assert_allclose(table.min(axis=0), -table.max(axis=0), atol=1e-2)
    moved = motion.problem.replace(placement=tuple(np.add(motion.posture.placement, (10.0, 0.0, 0.0))))
    np.testing.assert_allclose(finishing.plan(moved).joints[:, 5], motion.joints[:, 5] - 10.0, atol=1e-9)


def test_rows_are_whole_and_the_profile_has_each_time_once(motion):
    assert motion.time[0] == 0 and motion.length[-1] == pytest.approx(DIE.length, rel=1e-9)
    assert np.all(np.diff(motion.time) >= 0) and np.all(np.diff(motion.profile[:, 0]) > 0)
    assert motion.poses.shape == (len(motion.time), 4, 4) and motion.profile.shape[1] == 8
    np.testing.assert_allclose(
        np.interp(motion.time, motion.profile[:, 0], motion.profile[:, 6]), motion.joints[:, 5]
    )


def test_saved_and_loaded(motion, tmp_path):
    motion.save(tmp_path / "motion.nc")
    back = sdpgrind.load(tmp_path / "motion.nc")
    assert back.problem == motion.problem and back.posture == motion.posture
    assert back.worst_violation == motion.worst_violation and back.method == motion.method
    for name in ("time", "joints", "joint_speed", "feed_rate", "torque_per_force"):
        np.testing.assert_array_equal(getattr(back, name), getattr(motion, name))
    assert repr(back) == repr(motion)


def test_no_law_is_faster_than_the_bound(motion, tmp_path):
    """Rest at every corner of straight legs: the trapezoids are the fastest laws but for joints that slow them."""
    assert 0.5 * motion.duration < motion.lower_bound <= motion.duration
    assert motion.gap == 1 - motion.lower_bound / motion.duration
    faster = motion.problem.replace(feed_rate=1.5 * motion.problem.feed_rate)
    assert motion.lower_bound >= finishing.plan(faster).lower_bound
    motion.save(tmp_path / "motion.nc")
    assert sdpgrind.load(tmp_path / "motion.nc").lower_bound == motion.lower_bound


def test_a_law_of_thousands_of_knots_has_a_row_a_millisecond():
    """And the joints between the rows are as before: the tip stays on the path."""
    found = finishing.plan(finishing.FinishingProblem(SHARP), method="min_time")
    runs = len(SHARP.runs)
    assert found.time.size <= found.duration / 0.001 + 10 * runs
    assert np.diff(found.time).max() <= 0.004 * (1 + 1e-9) and found.error < 5e-5


def test_the_bound_holds_for_every_method_and_the_page_of_a_trimmed_patch_is_written(tmp_path):
    """A limit of acceleration along the path is of the trapezoid alone."""
    hole = [(0.4, 0.4), (0.4, 0.6), (0.6, 0.6), (0.6, 0.4), (0.4, 0.4)]
    patch = finishing.surface.Patch(
        finishing.surface.flat_surface(40.0), [hole, [(0.1, 0.1), (0.1, 0.2), (0.2, 0.1), (0.1, 0.1)]]
    )
    path = finishing.zigzag(patch, pitch=12.0)
    problem = finishing.FinishingProblem(path, acceleration=100.0)
    slow, fast = (finishing.plan(problem, method=method) for method in ("trapezoid", "min_time"))
    assert slow.lower_bound == fast.lower_bound < fast.duration < slow.duration
    slow.report(tmp_path / "motion.html")
    assert "2 arrays" in (tmp_path / "motion.html").read_text()


def test_another_law_than_asked_for_is_told_and_kept(monkeypatch, tmp_path):
    def failed(*given):
        raise LawError("no step was found")

    monkeypatch.setattr(_laws, "jerk_limited_law", failed)
    motion = finishing.plan(finishing.preset("nominal").replace(path=DIE.blended()), method="min_time")
    assert "; run 0: no step was found; this law has seven pieces" in motion.status
    motion.save(tmp_path / "motion.nc")
    assert sdpgrind.load(tmp_path / "motion.nc").status == motion.status


def test_a_picture(motion):
    pytest.importorskip("matplotlib").use("agg")
    figure = motion.plot()
    assert {axis.get_ylabel() for axis in figure.axes} >= {"feed [mm/s]", "used of limits [%]", "y [mm]"}


def test_aligned_with_the_feed_a_corner_asks_for_a_jump():
    aligned = EASY.replace(heading="feed_aligned")
    with pytest.raises(ValueError, match=r"table jumps by 7\d\d mm|table jumps by 7\d\d\.\d mm"):
        finishing.plan(aligned)
    with pytest.raises(
        ValueError,
        match=r"without wrist yaw q1 turns with the path where heading is 'feed_aligned'; take heading=",
    ):
        finishing.plan(aligned.replace(path=FLAT.blended()))


REFUSED = [
    ({"feed_rate": 0.0}, r"feed_rate must be > 0 \(mm/s\); got 0.0"),
    ({"feed_rate": 25000.0}, r"feed_rate must be in mm/s, some 25; .*; got 25000.0"),
    (
        {"feed_rate": 1800},
        r"feed_rate must be in mm/s, some 25; units.mm_per_min\(...\) for mm/min; got 1800",
    ),
    ({"feed_rate": 0.025}, r"feed_rate must be in mm/s, some 25; units.m_per_s\(...\) for m/s; got 0.025"),
    ({"azimuth": 90.0}, r"azimuth must be within a turn; units.deg\(90\) for degrees \(rad\); got 90.0"),
    ({"lever_arm": 0.095}, r"lever_arm must be >= 1; 95.0 for 0.095 m \(mm\); got 0.095"),
    ({"acceleration": -1.0}, r"acceleration must be > 0 \(mm/s\^2\); got -1.0"),
    ({"lever_arm": 0.0}, r"lever_arm must be > 0 \(mm\); got 0.0"),
    (
        {"contact_angle": 30.0},
        r"contact_angle must be in \[0, pi/2\]; units.deg\(30\) for degrees \(rad\); got 30.0",
    ),
    ({"contact_angle": -0.1}, r"contact_angle must be in \[0, pi/2\]; .*; got -0.1"),
    (
        {"contact_angle": units.deg(80), "friction_ratio": 0.3},
        r"friction_ratio must be < 0.1763.*locks itself; got 0.3",
    ),
    ({"heading": "free"}, r"heading must be one of fixed, feed_aligned; got 'free'"),
    ({"pushed": True}, r"pushed must be False where heading is 'fixed'"),
    (
        {"placement": (0.0, 1.0)},
        r"placement must be three coordinates \(mm\), and a turn .*; got \(0.0, 1.0\)",
    ),
    ({"speed": 1.0}, r"FinishingProblem has no field 'speed'"),
]


@pytest.mark.parametrize(("changes", "said"), REFUSED)
def test_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        EASY.replace(**changes)


def test_a_feed_that_the_motion_nowhere_reaches_warns():
    """Legs of 6 mm at 1000 mm/s^2 reach sqrt(6000) = 77.5 mm/s at most."""
    said = r"feed_rate of 900 mm/s is reached nowhere: .* at most 77.5 mm/s .* It would be 15 mm/s"
    with pytest.warns(UserWarning, match=said):
        finishing.plan(EASY.replace(feed_rate=900.0))
    finishing.plan(EASY.replace(feed_rate=200.0))  # none
    with pytest.raises(ValueError, match=r"air_feed must be in mm/s, some 100; units.mm_per_min"):
        finishing.Lift(air_feed=6000.0)


def only_ends(path, *, per_leg, sample=finishing.Path.sample):
    assert per_leg == 1
    return sample(path, per_leg=per_leg)


def test_refused_at_the_planner(monkeypatch):
    with pytest.raises(
        TypeError, match=r"problem must be a FinishingProblem \(see finishing.preset\); got 3"
    ):
        finishing.plan(3)
    with pytest.raises(ValueError, match=r"method must be one of trapezoid, toppra, min_time; got 'fast'"):
        finishing.plan(EASY, method="fast")
    with pytest.raises(
        ValueError,
        match=r"no branch within limits; nearest comes branch \d .*: q1 must be in .* at poses\[0\]",
    ):
        finishing.plan(EASY.replace(placement=(0.0, 0.0, 100.0)))
    great = finishing.FinishingProblem(finishing.hilbert(finishing.surface.flat_surface(6400.0), 5))
    with (
        monkeypatch.context() as patch,
        pytest.raises(ValueError, match=r"the arm must reach the path: .*Y must be in"),
    ):
        patch.setattr(finishing.Path, "sample", only_ends)  # a step of 0.2 mm makes millions of samples
        finishing.plan(great)
    upside = FLAT.replace(surface=FLAT.surface.replace(outward=-1))
    with pytest.raises(
        ValueError, match=r"surface must have its outward normals up; outward=-1 turns them \(runs\[0\] has"
    ):
        finishing.plan(EASY.replace(path=upside))
    with pytest.raises(
        ValueError, match=r"try another azimuth \(now 0 rad\), placement or wrist_radius \(.*out of reach by"
    ):
        finishing.plan(EASY.replace(robot=EASY.robot.replace(wrist_radius=700.0)))
    with pytest.raises(ValueError, match=r"time must be in \[0, .*\] \(s\); got -1.0"):
        finishing.plan(EASY).at(-1.0)


def test_without_limits_of_jerk_nothing_is_faster_than_min_time(motion):
    """Slower with them than the trapezoid, whose acceleration jumps; without, the fastest of the three."""
    problem = EASY.replace(robot=EASY.robot.replace(jerk_max=None))
    free, held = finishing.plan(problem, method="min_time"), finishing.plan(EASY, method="min_time")
    assert free.duration < finishing.plan(problem).duration < held.duration
    assert held.worst_violation.ratio <= 1.001 and free.worst_violation.ratio <= 1.001
    third = np.array(EASY.robot.jerk_max) * 1e-3
    step = np.diff(held.at(np.arange(0.0, held.duration, 1e-3)).joints, 3, axis=0) / 1e-9
    assert np.all(np.abs(step) * 1e-3 <= 1.02 * third)


def test_through_rounded_corners_is_faster():
    problem = EASY.replace(robot=EASY.robot.replace(jerk_max=None))
    stops = finishing.plan(problem, method="min_time")
    through = finishing.plan(problem.replace(path=FLAT.blended()), method="min_time")
    assert through.duration < 0.9 * stops.duration and through.feed_rate[1:-1].min() > 0
    assert through.worst_violation.ratio <= 1.001


def test_a_job_tells_every_path_from_every_other():
    flat, nurbs = finishing.surface.flat_surface(16.0), finishing.Surface.nurbs
    bent = nurbs(flat.control_points, [[1.0, 1.0], [1.0, 2.0]], degree=(1, 1))
    changes = [
        {"surface": flat.replace(outward=-1)},
        {"surface": bent},
        {"mapping": "equal_area"},
        {"pattern": "mine"},
    ]
    paths = [FLAT, FLAT.blended(0.01), FLAT.reversed(), *(FLAT.replace(**change) for change in changes)]
    jobs = [EASY.replace(path=path).job["path_digest"] for path in paths]
    assert len(set(jobs)) == len(jobs)
    assert EASY.replace(path=finishing.hilbert(flat, 3, mapping="parametric")).job == EASY.job


def test_nothing_in_a_motion_changes(motion, tmp_path):
    motion.save(tmp_path / "motion.nc")
    for one in (motion, sdpgrind.load(tmp_path / "motion.nc")):
        for array in (
            one.time,
            one.joints,
            one.torque_per_force,
            one.poses,
            one.points,
            one.dataset["joints"].values,
        ):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 77.0
    assert motion.profile.flags.writeable  # one's own


def test_a_problem_is_told_in_a_line():
    text = "FinishingProblem(hilbert3 of 64 nodes at 25 mm/s, tool of 4 mm at 0.5236 rad, fixed heading)"
    assert repr(EASY) == text


def test_a_turn_from_leg_to_leg_is_none_where_samples_are_close():
    """A rounded edge of 2 mm of a block: at ends of legs of 1 mm, and in the air of 2 mm, a joint of the robot
    turns by more than a radian; between samples of 0.25 mm by less.
    """
    block = {face.name: face for face in finishing.read_surfaces(STEP / "fillets.step")}
    path = finishing.zigzag(block["#242"], pitch=1.0, lift=finishing.Lift(air_feed=100.0))
    robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
    problem = finishing.FinishingProblem(
        path, robot=robot, placement=(650.0, -25.0, 100.0), azimuth=units.deg(90)
    )
    with pytest.raises(ValueError, match=r"must turn by at most 1 \(rad\) from pose to pose"):
        posture_of(problem, path.sample(per_leg=1))
    motion = finishing.plan(problem)
    assert motion.worst_violation.held and motion.error < 0.02
    with pytest.raises(ValueError, match=r"poses.* is out of reach"):
        check_ends(problem.replace(placement=(2000.0, 0.0, 0.0)))
    with pytest.raises(ValueError, match=r"must turn by at most 1 \(rad\) from pose to pose"):
        finishing.plan(
            problem.replace(azimuth=0.0)
        )  # there the heading has a corner, however close one looks
