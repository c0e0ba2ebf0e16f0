"""Pieces of paths in sequence: lengths in the air, several patches, times of a robot, motions."""

import re
from itertools import permutations, product
from pathlib import Path as File

import numpy as np
import pytest

import sdpgrind
from sdpgrind import finishing as fin
from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing._problem.travel_times import rest_to_rest
from sdpgrind.finishing.path import SequencedPath
from sdpgrind.finishing.surface import Patch, flat_surface

STEP = File(__file__).parents[2] / "data" / "step"
DIE = fin.read_surfaces(STEP / "nominal_hole.step")[0]
FLAT = flat_surface(40.0)
LIFT = fin.Lift(height=10.0, radius=3.0, air_feed=60.0)


def shifted(x, y=0.0, z=0.0, side=40.0):
    """A flat elsewhere."""
    flat = flat_surface(side)
    return flat.replace(control_points=flat.control_points + np.array([x, y, z]))


def row(surface, *ends):
    return fin.Path(surface, np.array(ends))


def sequence_of(path, states):
    """The same pieces in another sequence."""
    return path.replace(
        order=tuple(k // 2 for k in states), backwards=tuple(bool(k % 2) for k in states), exact=False
    )


def air_between(path):
    """Length of the straight moves at the height, from samples: of runs that stay there."""
    samples = path.sample(per_leg=1)
    runs = [samples.run == k for k in range(samples.run[-1] + 1)]
    level = [
        each for each in runs if np.ptp(samples.clearance[each]) == 0 and not samples.contact[each].any()
    ]
    return sum(np.linalg.norm(samples.point[each][-1] - samples.point[each][0]) for each in level)


def tops(ends, radius):
    """Places of the tool (n, 2, 3) over both ends of straight rows (n, 2, 3): outside by the radius of the arc."""
    along = np.diff(ends, axis=1) / np.linalg.norm(np.diff(ends, axis=1), axis=-1, keepdims=True)
    return ends + radius * along * np.array([[-1.0], [1.0]])


def test_no_sequence_is_shorter():
    """Six rows at random places, in all orders and directions; the way between them is that of the samples."""
    nodes = np.random.default_rng(8).uniform(0.05, 0.95, (6, 2, 2))
    path = fin.sequence([row(FLAT, *each) for each in nodes], lift=LIFT)
    over = tops(np.pad(40.0 * nodes, ((0, 0), (0, 0), (0, 1))), LIFT.radius)
    over = np.stack([over, over[:, ::-1]], axis=1)  # of piece and direction: start, end
    orders, ways = np.array(list(permutations(range(6)))), np.array(list(product((0, 1), repeat=6)))
    done = over[orders[:, None], ways[None]]
    between = np.linalg.norm(done[:, :, 1:, 0] - done[:, :, :-1, 1], axis=-1).sum(axis=-1)
    assert path.exact and path.travel == pytest.approx(between.min(), abs=1e-9)
    assert path.travel_given == pytest.approx(between[0, 0], abs=1e-9) and between[0, 0] > between.min() + 1.0
    assert path.travel == pytest.approx(air_between(path), abs=1e-9)


@pytest.mark.parametrize("order", [4, 5])
def test_pieces_of_a_curve_on_a_die(order):
    given = fin.hilbert(DIE, order, lift=LIFT)
    path = fin.sequence(given)
    assert path.exact and path.travel_given == pytest.approx(air_between(given), abs=1e-9)
    assert path.travel < path.travel_given - 2.0
    saved = path.travel_given - path.travel
    # lifts come down and leave as before; two neighbours closer than 0.1 mm have no move between them
    assert given.length - path.length == pytest.approx(saved, abs=0.1 * (order == 5) + 1e-6)
    assert path.contact_length == pytest.approx(given.contact_length)
    coverage = [each.metrics(2.5, surface_step=0.5).coverage for each in (given, path)]
    assert coverage[1] == pytest.approx(coverage[0], abs=1e-9)
    assert path.lift == LIFT and fin.sequence(path) == path


def test_place_and_tool_go_on_where_two_pieces_end_close_together():
    """On the die of order 5 some ends are 0.08 mm apart, too near for a move of its own."""
    path = fin.sequence(fin.hilbert(DIE, 5, lift=LIFT))
    assert len(path.crossings) < len(path.order) - 1
    samples = path.sample(per_leg=1)
    ends = np.flatnonzero(np.diff(samples.run) > 0)
    quiet = ends[~samples.contact[ends]]
    for column in (samples.point, samples.normal):
        assert np.abs(column[quiet + 1] - column[quiet]).max() < 1e-9


def test_many_pieces_are_put_in_sequence_by_small_moves():
    rng = np.random.default_rng(2)
    rows = [row(FLAT, (0.1, b), (0.9, b)) for b in rng.permutation(np.linspace(0.05, 0.95, 19))]
    path = fin.sequence(rows, lift=LIFT)
    assert not path.exact and path.travel == pytest.approx(18 * 40 * 0.05)
    assert sum(path.backwards) in (9, 10)


TWO = [
    fin.zigzag(FLAT, 9.0),
    fin.zigzag(Patch(shifted(50.0), [[(0.3, 0.3), (0.3, 0.7), (0.7, 0.3), (0.3, 0.3)]]), 9.0),
]


@pytest.fixture(scope="module")
def motion():
    path = fin.sequence(TWO, lift=LIFT).blended()
    return fin.plan(fin.FinishingProblem(path, feed_rate=20.0))


def test_a_motion_over_two_patches(motion, tmp_path):
    path = motion.problem.path
    assert len(path.patches) == 2 and path.pattern == "zigzag" and path.deviation > 0
    assert motion.worst_violation.held and motion.error < 0.01
    told = path.at(motion.length).contact
    assert np.array_equal(told, motion.contact) and 20.0 < motion.feed_rate[~told].max() <= 60.0 * (1 + 1e-9)
    assert path.points[:, 0].min() < 10 and path.points[:, 0].max() > 80
    motion.save(tmp_path / "motion.nc")
    again = sdpgrind.load(tmp_path / "motion.nc")
    assert again.problem == motion.problem and np.array_equal(again.joints, motion.joints)
    assert motion.program("ros").check().feed_excess < 1e-6 * 20.0


def test_a_path_over_two_patches_and_its_motion_are_drawn(motion, pyplot):
    assert motion.problem.path.plot().axes
    (feed,) = (axis for axis in motion.plot().axes if axis.get_title().startswith("mean "))
    assert feed.get_ylim()[1] > motion.feed_rate.max() > 1.08 * motion.problem.feed_rate  # in the air


def test_runs_and_frames_count_the_nodes_of_all_pieces():
    path = fin.sequence(TWO)
    frames, count = path.frames(), len(path.nodes)
    assert path.runs[-1, 1] == count - 1 and path.runs[0, 0] == 0 and len(path.points) == count
    assert len(frames) >= count and np.allclose(frames[:, 2, 2], 1.0)
    assert path.pitch == pytest.approx(sum(each.area for each in path.patches) / path.contact_length)


def test_of_several_patches_metrics_and_surface_are_asked_for_one_by_one():
    path = fin.sequence(TWO)
    with pytest.raises(ValueError, match=r"path must be on one patch for metrics.*got 'one on 2 patches'"):
        path.metrics(2.0)
    with pytest.raises(ValueError, match="path must be on one surface for that"):
        _ = fin.FinishingProblem(path).surface
    assert fin.FinishingProblem(fin.sequence(TWO[0])).surface == FLAT
    assert path.paths[1].metrics(7.0, surface_step=0.5).coverage > 0.99


def test_a_path_is_a_value_and_turns_round():
    path = fin.sequence(TWO, lift=LIFT)
    assert decode(encode(path)) == path and hash(decode(encode(path))) == hash(path)
    back = path.reversed()
    assert back.reversed() == path and back.length == pytest.approx(path.length)
    assert back.pieces[0].points[0] == pytest.approx(path.pieces[-1].points[-1])
    assert repr(path).startswith("SequencedPath(zigzag, ") and " of 2 patches, " in repr(path)


def test_the_least_clearance_is_told():
    """A step of 12 mm between two flats, over which the tool goes at 20 mm; chords of 1 mm on both."""
    low = [row(shifted(x), (0.1, 0.5), (0.9, 0.5)) for x in (0.0, 100.0)]
    step = row(shifted(60.0, 10.0, 12.0, side=20.0), (0.1, 0.5), (0.9, 0.5))
    path = fin.sequence([*low, step], lift=fin.Lift(height=20.0))
    over = sequence_of(path, [0, 2, 4])
    assert over.least_clearance == pytest.approx(8.0, abs=(0.5**2 + 0.5**2) / 16)
    assert path.order == (0, 2, 1) and fin.sequence(low[0]).least_clearance == np.inf


UR10 = fin.robot("ur10").replace(tool=fin.tool(length=150.0))
PLACE = (650.0, -25.0, 100.0)


def crossing_times(motion):
    """Time of each straight move at the height, by the rows of a motion."""
    clear, length = motion.problem.path.at(motion.length).clearance, motion.length
    level = np.isclose(clear, motion.problem.path.lift.height) & ~motion.contact
    ends = np.flatnonzero(np.diff(np.concatenate([[False], level, [False]]).astype(int)))
    times = [motion.time[b - 1] - motion.time[a] for a, b in ends.reshape(-1, 2) if length[b - 1] > length[a]]
    return np.array(times)


@pytest.mark.parametrize("robot", ["ur10", "generic"])
def test_no_motion_is_faster_between_pieces_than_the_times(robot):
    rng = np.random.default_rng(4)
    rows = [row(FLAT, *rng.uniform(0.1, 0.9, (2, 2))) for _ in range(4)]
    held = {"robot": UR10, "placement": PLACE} if robot == "ur10" else {"robot": fin.Arm.generic()}
    path = fin.sequence(rows, lift=LIFT, acceleration=500.0, **held)
    assert path.times is not None and path.times[1] < path.times[0] - 0.1
    spent = [
        crossing_times(fin.plan(fin.FinishingProblem(each, acceleration=500.0, **held))).sum()
        for each in (sequence_of(path, [0, 2, 4, 6]), path)
    ]
    for least, took in zip(path.times, spent, strict=True):
        assert least * (1 - 1e-3) <= took <= 1.5 * least


def test_a_slow_axis_is_spared():
    """Four short rows at the corners of a rectangle: its short sides are along x, which the table has slowly."""
    arm = fin.Arm.generic()
    slow = arm.replace(speed_max=(*arm.speed_max[:5], 2.0, arm.speed_max[6]))
    rows = [row(FLAT, (a, b), (a, b + 0.05)) for a in (0.2, 0.4) for b in (0.2, 0.75)]
    short, fast = (fin.sequence(rows, lift=LIFT, robot=robot) for robot in (None, slow))
    across = [[abs(each.at(np.array([0.0, each.length])).point @ [1.0, 0.0, 0.0]) for each in path.crossings]
              for path in (short, fast)]  # fmt: skip
    along_x = [sum(float(np.ptp(each)) for each in path) for path in across]
    assert along_x == pytest.approx([16.0, 8.0]) and fast.travel > short.travel + 1.0
    assert decode(encode(fast)) == fast and fast.exact
    assert fast.reversed().times is None and not fast.reversed().exact and short.reversed().exact
    assert short.times is None and 4.0 < fast.times[1] < 6.0 and "s between pieces" in repr(fast)


def test_a_tool_along_the_feed_turns_between_pieces():
    """Two rows whose ends are at one place: one goes on, the other would turn the tool about by pi."""
    held = {"robot": UR10, "placement": PLACE, "heading": "feed_aligned", "contact_angle": 1.2}
    rows = [row(FLAT, (0.2, 0.5), (0.4, 0.5)), row(FLAT, (0.9, 0.5), (0.7, 0.5))]
    path = fin.sequence(rows, lift=LIFT, **held)
    assert path.backwards[0] != path.backwards[1] and path.times[1] < path.times[0]
    assert not path.exact  # its pose at an end depends on the piece that follows


def test_times_from_rest_to_rest():
    """1 mm/s and 2 mm/s^2: half a second of each ramp over 0.25 mm; below that, ramps alone."""
    assert rest_to_rest([0.0, 0.5, 3.0, 0.02], 1.0, 2.0) == pytest.approx([0.0, 1.0, 3.5, 0.2])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fin.sequence(FLAT), "paths[0] must be a Path, LiftedPath or SequencedPath (see finishing.zigzag); got"),
        (lambda: fin.sequence([]), "paths must be one path or more; got ()"),
        (lambda: fin.sequence(TWO, lift=20.0), "lift must be a Lift; got 20.0"),
        (lambda: fin.sequence(TWO, placement=PLACE), "robot must be given for placement; got None"),
        (lambda: fin.sequence(TWO, robot=UR10), "placement must be given for a robot without a table"),
        (lambda: fin.sequence(TWO, robot=UR10, placement=PLACE, spin=24), "spin must be left to plan"),
        (lambda: fin.sequence(TWO, robot=UR10, placement=(5e3, 0.0, 0.0)), "the robot must reach the path"),
        (lambda: fin.sequence([fin.hilbert(DIE, 2, lift=LIFT), fin.hilbert(FLAT, 2, lift=fin.Lift())]),
         "lift must be given: those of the paths are 2 different ones"),
        (lambda: SequencedPath(TWO[:1] * 3, order=(0, 0, 1), backwards=(False,) * 3), "order must be each of 0 to 2 once"),
        (lambda: SequencedPath(TWO[:1], order=(0,), backwards=()), "backwards must be 1 truth values"),
        (lambda: SequencedPath([FLAT], order=(0,), backwards=(False,)), "paths[0] must be a Path or a LiftedPath"),
    ],
)  # fmt: skip
def test_refused_sequences(make, words):
    with pytest.raises((ValueError, TypeError), match=re.escape(words)):
        make()
