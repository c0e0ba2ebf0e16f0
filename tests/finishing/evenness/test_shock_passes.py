"""Gaps of geodesic passes where fronts collide: within 1.03 pitches, measured anew on the surface."""

from functools import cache

import numpy as np
import pytest
from finishing_inside import Square, distance_field
from scipy.spatial import cKDTree

from sdpgrind.finishing import Lift, Surface, zigzag
from sdpgrind.finishing.path import LiftedPath
from sdpgrind.finishing.path._geodesic_passes import _closer, geodesic_nodes
from sdpgrind.finishing.path._shocks import shocks
from sdpgrind.finishing.surface import nominal_surface, uneven_surfaces


def over(low, width):
    """A flat between a border through control points and the same a width (mm) farther."""
    return Surface.bspline(
        [[[x, y + width * c, 0.0] for c in (0.0, 1.0)] for x, y in low],
        degree=(len(low) - 1 if len(low) < 4 else 3, 1),
    )


def bumpy(seed):
    side = np.linspace(0.0, 50.0, 9)
    x, y = np.meshgrid(side, side, indexing="ij")
    return Surface.bspline(
        np.stack([x, y, 9.0 * np.random.default_rng(seed).uniform(-1, 1, (9, 9))], axis=-1)
    )


# both with grids that are hardly less skewed than those that take twice as many nodes
WAVES = (0.0, 0.0, -7.4, 0.0, 0.0, 5.5, -3.7, -3.7, 0.0, 0.0)
SURFACES = {
    "parabola": over([(-12.5, 12.5), (0.0, -12.5), (12.5, 12.5)], 52.0),
    "wavy": over(list(zip(np.linspace(0.0, 60.0, 10), WAVES, strict=True)), 45.0),
    "steep": uneven_surfaces()["steep"],
    "bumpy": bumpy(0),
}


@cache
def passes(name, pitch, lifted=False):
    lift = Lift(height=10.0) if lifted else None
    return zigzag(SURFACES[name], pitch, mapping="geodesic", lift=lift)


def gap(path, pitch, count=401):
    """Widest gap in pitches, a pitch and more away from the border: chords are 1/50 of one, 1e-4 of it off.

    Places that cannot have it by the distance from every tenth sample are left out.
    """
    (a, b), (c, d) = path.surface.domain
    point = path.surface.grid(np.linspace(a, b, count), np.linspace(c, d, count)).point
    border = cKDTree(np.concatenate([point[0], point[-1], point[:, 0], point[:, -1]]))
    line, inner = path.sample(pitch / 50).point, point.reshape(-1, 3)
    most = cKDTree(line[::10]).query(inner)[0]
    inner = inner[most > 0.45 * pitch]
    inner = inner[border.query(inner)[0] > 1.01 * pitch]
    return 2 * cKDTree(line).query(inner)[0].max() / pitch


@pytest.mark.parametrize(
    ("surface", "pitch"),
    [("parabola", 1.0), ("parabola", 0.5), ("wavy", 2.0), ("steep", 2.0), ("bumpy", 2.0)],
)
def test_gaps_where_fronts_collide(surface, pitch):
    """Before: 1.35 and 1.91 pitches in the parabola, 1.20, 1.09 on the steep surface, 1.12."""
    assert 0.9 < gap(passes(surface, pitch), pitch) <= 1.03


@pytest.mark.parametrize(("pitches", "count"), [(0.5, 3), (1.0, 3), (2.0, 5)])
def test_long_legs_are_cut_at_smaller_turns(pitches, count):
    """A leg of 2 pitches that turns by 0.1 rad cuts off as much as one of a pitch that turns by 0.2."""
    s = np.linspace(0.0, 1.0, 101)
    bend, way = np.full((2, s.size), [[0.1], [pitches]]) / 50
    assert _closer(np.array([0.0, 0.5, 1.0]), s, bend, way).size == count


def test_the_shock_of_a_parabola_is_its_axis():
    """From y = 0.08 x^2 fronts meet on the axis above the centre of curvature, 6.25 mm; kinks begin before."""
    square = Square(SURFACES["parabola"], "parametric", "u")
    (course,) = shocks(square, distance_field(square), 0.25)
    point = square.points(*course.T)
    assert np.abs(point[:, 0]).max() < 0.05  # half of a column of the field
    assert 5.0 < point[0, 1] < 6.25 and point[-1, 1] > 51.0


def test_no_shock_no_pass():
    """Without shocks nothing is added, and nodes are those of the columns."""
    columns = (np.arange(25) + 0.5) / 25
    found = geodesic_nodes(Square(nominal_surface(), "parametric", "u"), 2.0, columns, 0.98, 0.0)
    assert not found.shocks
    assert np.isin(found.places[:, 0], columns).all()


def test_with_lifts_they_are_pieces():
    path, lifted = (passes("parabola", 1.0, lift) for lift in (False, True))
    assert isinstance(lifted, LiftedPath) and len(lifted.pieces) == 2
    shock = lifted.pieces[1].points
    assert np.abs(shock[:, 0]).max() < 0.05 and np.ptp(shock[:, 1]) > 25
    assert lifted.contact_length < path.length
    np.testing.assert_allclose(cKDTree(path.points).query(shock)[0], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("surface", "pitch"), [("parabola", 1.0), ("wavy", 2.0), ("steep", 2.0), ("bumpy", 2.0)]
)
def test_its_corners_can_be_rounded(surface, pitch):
    """Without a way aside the last pass along the edge turned right back on that to its start."""
    path = passes(surface, pitch).blended()
    assert len(path.runs) == 1


@pytest.mark.parametrize("surface", ["wavy", "bumpy"])
def test_no_move_to_a_shock_turns_right_back(surface):
    """Between a pass and a move the feed turns by less than 170 degrees."""
    path = passes(surface, 2.0)
    along, across = path.nodes.T
    ends = np.isin(along, [along.min(), along.max()]) & (across == across.max())  # of the edge
    line = path.sample(per_leg=1)
    at = np.flatnonzero(np.diff(line.run) > 0)
    cosine = np.einsum("ij,ij->i", line.tangent[at], line.tangent[at + 1])
    moves = np.flatnonzero(path.corners) >= np.flatnonzero(ends)[-1]
    assert moves.sum() > 2 and cosine[moves].min() > np.cos(np.deg2rad(170))
