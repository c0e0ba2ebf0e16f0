"""Paths on trimmed patches: inside the trimming, joined by lifts, covered area, motions in the air."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing import (
    FinishingProblem,
    Lift,
    TorqueAxis,
    TorqueController,
    hilbert,
    plan,
    read_surfaces,
    zigzag,
)
from sdpgrind.finishing.path import LiftedPath
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.path._trimmed import TrimmedSquare
from sdpgrind.finishing.surface import Patch, cylinder_surface, flat_surface, nominal_surface

FLAT = flat_surface(30.0)
TURN = np.linspace(0, -2 * np.pi, 181)
DISK = np.stack([0.5 + 0.2 * np.cos(TURN), 0.5 + 0.2 * np.sin(TURN)], axis=1)  # 6 mm around the middle
ROUND = Patch(FLAT, [DISK])
DIE = read_surfaces(Path(__file__).parents[2] / "data" / "step" / "nominal_hole.step")[0]


def on_work(path, per_leg=16):
    found = path.sample(per_leg=per_leg)
    return found.point[found.contact]


@pytest.mark.parametrize("along", ["u", "v"])
@pytest.mark.parametrize("mapping", ["equal_spacing", "equal_area", "parametric"])
def test_a_path_stays_inside_and_away_from_the_ends_of_its_passes(mapping, along):
    path = zigzag(DIE, 3.0, mapping=mapping, along=along)
    away = np.hypot(*(on_work(path)[:, :2] - 25.0).T)
    assert away.min() >= 8.0 - 0.01  # mm; source: the requirements


def test_rounded_corners_stay_inside():
    away = np.hypot(*(on_work(zigzag(DIE, 4.0).blended())[:, :2] - 25.0).T)
    assert away.min() >= 8.0 - 0.01


@pytest.mark.parametrize("margin", [0.0, 0.4, 1.5])
def test_passes_are_pulled_in_by_the_margin(margin):
    """On a flat every pass that meets the disk ends on a circle that is wider by the margin, or before it by
    what a straight move around it needs: at the side 2^2/(8 x 6) mm, doubled for the steps in which it is
    found, more above and below, and for the two of six ends beside it that join a bend along the disk.
    """
    path = zigzag(ROUND, 2.0, margin=margin)
    ends = np.concatenate([piece.points for piece in path.pieces])
    own, beside = [], []
    for y in np.arange(1.0, 30.0, 2.0)[int(margin > 1.0) : 15 - int(margin > 1.0)]:  # others follow the disk
        half = np.sqrt(max((6.0 + margin) ** 2 - (y - 15.0) ** 2, 0.0))
        x = ends[np.abs(ends[:, 1] - y) < 1e-6, 0]
        assert x.min() == pytest.approx(margin, abs=1e-6) and x.max() == pytest.approx(30 - margin, abs=1e-6)
        if half > 3.5:
            own += [15 - half - x[x < 15].max(), x[x > 15].min() - 15 - half]
            assert max(own[-2:]) < 1.0  # half a pitch
            beside += own[-2:] if abs(y - 15.0) < 3.0 else []
    assert min(own) > -2e-3 and len(own) >= 8  # the polygon has 180 sides
    assert len(beside) == 6 and np.sort(beside)[:4].max() < 4 / 24


SLANTED = np.array([(0.1, 0.05), (0.95, 0.13), (0.9, 0.93), (0.06, 0.95), (0.1, 0.05)])
SHEARED = Patch(nominal_surface(), [SLANTED, DISK])  # an edge nearly along the passes


def least_distance(points, patch, step=0.001):
    """Least distance from places along the trimming, mm; they are at most a 1000th of the domain apart, 0.05
    mm, so at 0.3 mm the distance is told to 0.05^2/(8 x 0.3) = 1 um.
    """
    edges = [
        a + np.linspace(0.0, 1.0, int(np.abs(b - a).max() / step) + 2)[:, None] * (b - a)
        for each in patch.polygons
        for a, b in pairwise(each)
    ]
    return cKDTree(np.concatenate([patch.surface.point(*each.T) for each in edges])).query(points)[0].min()


@pytest.mark.parametrize("margin", [0.3, 2.5])
@pytest.mark.parametrize(
    "laid", [lambda m: zigzag(SHEARED, 3.0, margin=m), lambda m: zigzag(SHEARED, 3.0, along="v", margin=m),
             lambda m: hilbert(SHEARED, 5, margin=m)], ids=["u", "v", "hilbert"]
)  # fmt: skip
def test_a_margin_is_kept_along_and_across(laid, margin):
    """Everywhere on the work, moves between passes included; 1 um is the chord of the trimming."""
    path = laid(margin)
    away = least_distance(on_work(path, 8), SHEARED)
    assert margin - 0.002 < away < margin + 3.0
    assert path.metrics(1.5, surface_step=0.5, path_step=0.5).coverage > 0.5


def test_by_default_a_quarter_of_a_pitch_is_kept():
    away = least_distance(on_work(zigzag(SHEARED, 3.0)), SHEARED)
    assert 0.75 - 0.002 < away < 0.9


def box(low, high, slant=0.0):
    """Four sides in the unit square; those along u rise by the slant."""
    a, b = low, high
    return np.array([(a, a), (b, a + slant), (b, b), (a, b - slant), (a, a)])


@pytest.mark.parametrize("along", ["u", "v"])
@pytest.mark.parametrize(
    ("patch", "pitch"),
    [(ROUND, 2.0), (ROUND, 3.1), (SHEARED, 3.0), (DIE, 1.5)]
    + [(Patch(FLAT, [box(edge, 0.9, slant)]), 2.0) for edge in (0.08, 0.095, 0.11) for slant in (0.0, 0.2)],
)
def test_a_trimmed_face_is_covered(patch, pitch, along):
    """Footprints of three quarters of a pitch, as corners of a zigzag on a flat are 0.71 pitches from it; edges
    along the passes and nearly so, wherever they lie between two passes.
    """
    path = zigzag(patch, pitch, along=along)
    assert path.metrics(0.75 * pitch).coverage > 1 - 2e-3
    assert least_distance(on_work(path), patch) > pitch / 4 - 0.002


def test_a_tab_between_two_lines_is_covered():
    """A tab of 0.7 pitch leaves a tenth of a pitch to the contact, and no line of the passes meets it."""
    corners = [(2, 1), (16, 1), (16, 4.95), (28, 4.95), (28, 7.05), (16, 7.05), (16, 29), (2, 29), (2, 1)]
    path = zigzag(Patch(FLAT, [np.array(corners) / 30.0]), 3.0)
    assert on_work(path)[:, 0].max() == pytest.approx(28.0 - 0.75 - 0.15, abs=0.1)  # an eighth of a pitch
    assert path.metrics(2.25).coverage > 0.999


NOTCH = np.array([(1, 1), (28, 1), (28, 7.6), (8, 7.6), (9.5, 11.8), (28, 12.3), (28, 29), (1, 29), (1, 1)])


@pytest.mark.parametrize("along", ["u", "v"])
def test_where_a_lift_is_given_moves_between_passes_are_short(along):
    """From the end of the pass that follows the notch's slanting side back to the next pass it is 7 pitches;
    nodes of passes are at most one and a half pitches apart.
    """
    patch = Patch(FLAT, [NOTCH / 30.0 if along == "u" else NOTCH[::-1, ::-1] / 30.0])
    paths = [zigzag(patch, 2.0, along=along, lift=lift) for lift in (None, Lift())]
    moves = [
        np.concatenate([np.linalg.norm(np.diff(each.points, axis=0), axis=1) for each in path.pieces])
        for path in paths
    ]
    long = moves[0][moves[0] > 3 * 2.0]
    assert long.size == 1 and long[0] > 13.0 and moves[1].max() <= 3 * 2.0
    assert len(paths[1].pieces) == len(paths[0].pieces) + 1
    assert paths[0].contact_length - paths[1].contact_length == pytest.approx(long[0], abs=2.0)  # a pitch
    assert min(path.metrics(1.5).coverage for path in paths) > 1 - 2e-3


def test_the_way_of_a_move_is_its_length_on_the_surface():
    """A quarter of a circle by eight chords, each of at most 1.66/8 rad: that squared over 24 is missing."""
    rod = cylinder_surface(20.0, 50.0)
    region = TrimmedSquare(Patch(rod), Square(rod, "parametric", "v"))
    way = region.way(np.array([0.0, 0.3]), np.array([1.0, 0.3]))
    assert 10 * np.pi * (1 - 0.0018) < way < 10 * np.pi


def test_a_small_hole_is_passed_without_a_lift():
    hole = Patch(FLAT, [0.5 + (DISK - 0.5) / 10])  # 0.6 mm around the middle, beside which a pass leads
    path = zigzag(hole, 2.0)
    away = np.hypot(*(on_work(path)[:, :2] - 15.0).T)
    assert len(path.pieces) == 1 and 1.1 - 1e-6 < away.min() < 1.3


@pytest.mark.parametrize("margin", [0.0, 0.7, 2.0])
@pytest.mark.parametrize(
    "laid", [lambda m: zigzag(FLAT, 2.0, margin=m), lambda m: hilbert(FLAT, 5, margin=m)]
)
def test_a_margin_counts_at_the_border_of_a_whole_surface(laid, margin):
    """Where it leaves one piece that is a path without lifts."""
    path = laid(margin)
    points = path.points[:, :2] if isinstance(path, LiftedPath) else path.sample(per_leg=8).point[:, :2]
    assert margin - 1e-6 <= min(points.min(), (30.0 - points).min()) < margin + 30 / 32
    assert not isinstance(path, LiftedPath) or len(path.pieces) > 1


def test_one_hole_needs_few_pieces():
    """Passes below and on one side of the hole, on the other side, and above it: not one a pass."""
    path = zigzag(ROUND, 2.0)
    assert len(path.pieces) in (2, 3) and isinstance(path, LiftedPath)
    assert path.runs[-1, 1] == len(path.nodes) - 1 and len(path.points) == len(path.nodes)


def test_lines_of_a_lift_have_their_lengths():
    lift = Lift(height=12.0, radius=3.0)
    path = zigzag(FLAT, 5.0, lift=lift)
    samples = path.sample()
    first, last = samples.point[[0, -1]]
    assert first == pytest.approx([2.5 - 3.0, 2.5, 12.0]) and samples.clearance[[0, -1]] == pytest.approx(
        12.0
    )
    assert last[2] == pytest.approx(12.0)
    runs = [samples.length[samples.run == k] for k in range(samples.run[-1] + 1)]
    assert np.ptp(runs[0]) == pytest.approx(9.0) and np.ptp(runs[-1]) == pytest.approx(9.0)
    assert not samples.contact[samples.run == 0].any() and samples.contact[samples.run == 1].any()
    arcs = (path.length - path.contact_length - 18.0) / 2
    assert 3 * np.sqrt(2) < arcs < 6.0  # between the chord and two sides of the square
    assert zigzag(FLAT, 5.0).length == pytest.approx(path.contact_length)


def test_a_slanted_lift():
    lift = Lift(height=10.0, angle=0.5, radius=4.0)
    path = zigzag(FLAT, 5.0, lift=lift)
    samples = path.sample()
    line = samples.point[samples.run == samples.run[-1]]
    way = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
    assert way[2] == pytest.approx(np.sin(0.5)) and line[-1, 2] == pytest.approx(10.0)
    assert line[0, 2] == pytest.approx(4.0 * (1 - np.cos(0.5))) and line[0, 2] == pytest.approx(lift.rise)


def test_length_is_that_of_the_arc():
    path = zigzag(DIE, 12.0).blended()
    at = np.linspace(0, path.length, 4001)[1:-1]
    here, ahead = path.at(at), path.at(at + 1e-5)
    same = here.run == ahead.run
    speed = np.linalg.norm(ahead.point - here.point, axis=1)[same] / 1e-5
    assert speed == pytest.approx(1.0, abs=1e-6)
    assert path.at(path.sample().length[::7]).point == pytest.approx(path.sample().point[::7], abs=1e-6)


def frames(samples):
    columns = [samples.tangent, np.cross(samples.normal, samples.tangent), samples.normal]
    return Rotation.from_matrix(np.stack(columns, axis=-1))


@pytest.mark.parametrize("end", ["off", "onto"])
def test_place_and_tool_go_on_at_a_contact(end):
    """Speed and acceleration of place and turn, a mm, by differences on both sides of the contact."""
    path = zigzag(DIE, 6.0).blended()
    samples = path.sample()
    flips = np.flatnonzero(
        (samples.contact[1:] != samples.contact[:-1]) & (samples.run[1:] == samples.run[:-1])
    )
    k = next(k for k in flips if samples.contact[k] == (end == "off"))
    join = samples.length[k if end == "off" else k + 1]
    h = 0.02
    before, after = (
        path.at(join + h * np.array([-4, -3, -2, -1, 0])),
        path.at(join + h * np.array([0, 1, 2, 3, 4])),
    )
    one = np.array([3, -16, 36, -48, 25]) / (12 * h)  # first derivative at the end of five places
    two = np.array([11, -56, 114, -104, 35]) / (12 * h**2)
    for weights, sign, least in ((one, -1, 1e-4), (two, 1, 2e-2)):
        left, right = weights @ before.point, sign * weights[::-1] @ after.point
        assert left == pytest.approx(right, abs=least)
    turns = [frames(path.at(np.array([join + h * step])))[0] for step in (-2, -1, 0, 1, 2)]
    rates = [(a.inv() * b).as_rotvec() / h for a, b in pairwise(turns)]
    steps = np.linalg.norm(np.diff(rates, axis=0), axis=1)
    assert steps.max() < 3 * max(steps[0], steps[2], 1e-4)  # no jump of the rate at the join


def test_the_tool_settles_in_the_air():
    path = zigzag(DIE, 6.0)
    samples = path.sample()
    up = samples.run == samples.run[-1]
    assert np.ptp(samples.normal[up], axis=0).max() < 1e-12
    over = next(k for k in range(samples.run[-1]) if not samples.contact[samples.run == k].any() and k > 0)
    assert samples.clearance[samples.run == over + 1][0] == pytest.approx(20.0)
    assert np.linalg.norm(samples.normal, axis=1) == pytest.approx(1.0)


def test_metrics_count_the_trimmed_area():
    """The hole is not covered, and does not count; on the surface around it gaps are those of the passes."""
    path = zigzag(ROUND, 2.0)
    found = path.metrics(1.5)
    assert found.coverage == pytest.approx(1.0, abs=2e-3) and found.length == path.contact_length
    assert found.largest_gap < 4.4 and found.cell_area_cv is None
    assert path.pitch == pytest.approx(ROUND.area / path.contact_length)
    assert zigzag(FLAT, 6.0, lift=Lift()).metrics(4.0) == zigzag(FLAT, 6.0).metrics(4.0)


def test_nodes_of_a_hilbert_curve_outside_are_dropped():
    path = hilbert(DIE, 4)
    away = np.hypot(*(on_work(path)[:, :2] - 25.0).T)
    whole = hilbert(DIE.surface, 4)
    kept = np.hypot(*(whole.points[:, :2] - 25.0).T) > 8.0
    assert away.min() > 7.99 and len(path.nodes) <= kept.sum() and len(path.nodes) > 0.9 * kept.sum()
    assert {tuple(node) for node in path.nodes} <= {tuple(node) for node in whole.nodes}
    assert hilbert(Patch(FLAT), 3) == hilbert(FLAT, 3)


def across(one, other):
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


@settings(max_examples=8)
@given(
    st.lists(st.tuples(st.floats(0.15, 0.85), st.floats(0.15, 0.85)), min_size=3, max_size=3, unique=True),
    st.floats(3.0, 6.0),
)
def test_around_any_triangle(corners, pitch):
    """All samples on the work are outside of a triangular hole, by its three sides."""
    a, b, c = np.array(corners)
    turn = across(b - a, c - a)
    if abs(turn) < 1e-3:
        return
    hole = np.array([a, b, c, a] if turn < 0 else [a, c, b, a])
    path = zigzag(Patch(FLAT, [hole]), pitch)
    uv = np.concatenate([piece.sample(per_leg=8).uv for piece in path.pieces])
    ends, starts = hole[1:], hole[:-1]
    side = across(ends - starts, uv[:, None] - starts) / np.linalg.norm(ends - starts, axis=1)
    assert (side.max(axis=1) > -0.01 / 30).all()  # clockwise: outside is on the left of a side


def test_a_path_is_a_value_and_turns_round():
    path = zigzag(ROUND, 3.0)
    assert decode(encode(path)) == path and hash(path) == hash(decode(encode(path)))
    back = path.reversed()
    assert back.length == pytest.approx(path.length) and back.reversed() == path
    assert back.pieces[0].points[0] == pytest.approx(path.pieces[-1].points[-1])
    assert repr(path).startswith("LiftedPath(zigzag, ")


def test_a_path_with_lifts_is_drawn(pyplot):
    assert zigzag(ROUND, 3.0).plot().axes


REFUSED = [
    (lambda: zigzag(ROUND, 2.0, mapping="geodesic"), "mapping must be one of equal_spacing, parametric, equal_area on a trimmed patch"),
    (lambda: zigzag(ROUND, 2.0, radius=0.5), "radius must be 0 on a trimmed patch; blended() rounds its corners (mm); got 0.5"),
    (lambda: zigzag(ROUND, 2.0, margin=-1.0), "margin must be >= 0 (mm); got -1.0"),
    (lambda: zigzag(ROUND, 2.0, margin=15.0), "surface must be wide enough for a path: its trimming leaves no part"),
    (lambda: zigzag(FLAT, 2.0, margin=1.0, mapping="geodesic"), "mapping must be one of equal_spacing, parametric, equal_area with a margin"),
    (lambda: zigzag(FLAT, 2.0, margin=1.0, radius=0.5), "radius must be 0 with a margin; blended() rounds its corners"),
    (lambda: hilbert(FLAT, 3, margin=-1.0), "margin must be >= 0 (mm); got -1.0"),
    (lambda: hilbert(FLAT, 3, margin=15.0), "surface must be wide enough for a path: its trimming leaves no part"),
    (lambda: zigzag(ROUND, 2.0, lift=20.0), "lift must be a Lift; got 20.0"),
    (lambda: zigzag([ROUND], 2.0), "surface must be a Surface or a Patch; got "),
    (lambda: Lift(height=3.0), "height must be > 5, the rise of the arc (mm); got 3.0"),
    (lambda: Lift(angle=90.0), "angle must be <= pi/2; units.deg(90) for degrees (rad); got 90.0"),
    (lambda: Lift(height=0.02), "height must be in mm, some 20; units.m(...) for metres; got 0.02"),
    (lambda: LiftedPath(ROUND, zigzag(FLAT, 3.0), starts=(0, 1)), "starts must be first nodes of pieces of two or more"),
    (lambda: LiftedPath(Patch(nominal_surface()), zigzag(FLAT, 3.0)), "path must be on the surface of the patch; got "),
    (lambda: LiftedPath(ROUND, zigzag(FLAT, 3.0), starts=(0, 9999)), "starts must be <= 98, two nodes before the last"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "words"), REFUSED)
def test_refused_lifts(make, words):
    with pytest.raises((ValueError, TypeError), match=re.escape(words)):
        make()


@pytest.fixture(scope="module")
def motion():
    path = zigzag(ROUND, 6.0, lift=Lift(height=10.0, radius=3.0, air_feed=60.0)).blended()
    return plan(FinishingProblem(path, feed_rate=20.0))


def test_a_motion_keeps_its_limits_in_the_air(motion):
    assert motion.worst_violation.held and motion.error < 0.01
    assert motion.feed_rate[motion.contact].max() == pytest.approx(20.0, rel=1e-6)
    assert 20.0 < motion.feed_rate[~motion.contact].max() <= 60.0 * (1 + 1e-9)
    assert not motion.contact[0] and not motion.contact[-1] and motion.contact.any()
    told = motion.problem.path.at(motion.length).contact
    assert np.array_equal(told, motion.contact)


def test_a_motion_with_lifts_is_kept_in_a_file(motion, tmp_path):
    motion.save(tmp_path / "motion.nc")
    again = type(motion).from_file(tmp_path / "motion.nc")
    assert np.array_equal(again.contact, motion.contact) and again.problem == motion.problem


def test_the_controller_does_not_press_in_the_air(motion):
    told = TorqueController(TorqueAxis(), motion, normal_force=1.0).reference
    assert np.array_equal(told.torque > 0, motion.contact) and told.per_force.min() > 0
