"""Gaps of geodesic passes where fronts collide: within 1.03 pitches, measured anew on the surface."""

import numpy as np
import pytest
from finishing_inside import Square, distance_field
from scipy.spatial import cKDTree

from sdpgrind.finishing import Lift, Surface, zigzag
from sdpgrind.finishing.path import LiftedPath
from sdpgrind.finishing.path._geodesic_passes import _closer, geodesic_nodes
from sdpgrind.finishing.path._shocks import shocks
from sdpgrind.finishing.surface import nominal_surface, uneven_surfaces


def over(low):
    """A flat between a border through control points and the same 45 mm farther."""
    return Surface.bspline(
        [[[x, y + 45 * c, 0.0] for c in (0.0, 1.0)] for x, y in low],
        degree=(len(low) - 1 if len(low) < 4 else 3, 1),
    )


PARABOLA = over([(-25.0, 25.0), (0.0, -25.0), (25.0, 25.0)])
WAVY = over(
    list(zip(np.linspace(0.0, 60.0, 10), (0.0, 0.0, -8.0, 0.0, 0.0, 6.0, -4.0, -4.0, 0.0, 0.0), strict=True))
)
STEEP = uneven_surfaces()["steep"]


def bumpy(seed):
    side = np.linspace(0.0, 50.0, 9)
    x, y = np.meshgrid(side, side, indexing="ij")
    return Surface.bspline(
        np.stack([x, y, 9.0 * np.random.default_rng(seed).uniform(-1, 1, (9, 9))], axis=-1)
    )


def gap(path, pitch, count=401):
    """Widest gap in pitches, a pitch and more away from the border: chords are 1/50 of one, 1e-4 of it off."""
    (a, b), (c, d) = path.surface.domain
    point = path.surface.grid(np.linspace(a, b, count), np.linspace(c, d, count)).point
    border = cKDTree(np.concatenate([point[0], point[-1], point[:, 0], point[:, -1]]))
    inner = point.reshape(-1, 3)[border.query(point.reshape(-1, 3))[0] > 1.01 * pitch]
    return 2 * cKDTree(path.sample(pitch / 50).point).query(inner)[0].max() / pitch


@pytest.mark.parametrize(
    ("surface", "pitch"),
    [
        (PARABOLA, 2.0),
        (PARABOLA, 1.0),
        (WAVY, 1.0),
        (STEEP, 1.0),
        (bumpy(0), 2.0),
    ],
)
def test_gaps_where_fronts_collide(surface, pitch):
    """Before: 1.36 and 1.97 pitches in the parabola, 1.30, 1.20 on the steep surface, 1.12."""
    assert gap(zigzag(surface, pitch, mapping="geodesic"), pitch) <= 1.03


@pytest.mark.parametrize(("pitches", "count"), [(0.5, 3), (1.0, 3), (2.0, 5)])
def test_long_legs_are_cut_at_smaller_turns(pitches, count):
    """A leg of 2 pitches that turns by 0.1 rad cuts off as much as one of a pitch that turns by 0.2."""
    s = np.linspace(0.0, 1.0, 101)
    bend, way = np.full((2, s.size), [[0.1], [pitches]]) / 50
    assert _closer(np.array([0.0, 0.5, 1.0]), s, bend, way).size == count


def test_the_shock_of_a_parabola_is_its_axis():
    """From y = 0.04 x^2 fronts meet on the axis above the focal length 12.5; kinks begin some mm before."""
    square = Square(PARABOLA, "parametric", "u")
    (course,) = shocks(square, distance_field(square), 0.25)
    point = square.points(*course.T)
    assert np.abs(point[:, 0]).max() < 0.05  # half of a column of the field
    assert 10.0 < point[0, 1] < 12.5 and point[-1, 1] > 44.0


def test_no_shock_no_pass():
    """Without shocks nothing is added, and nodes are those of the columns."""
    columns = (np.arange(25) + 0.5) / 25
    found = geodesic_nodes(Square(nominal_surface(), "parametric", "u"), 2.0, columns, 0.98, 0.0)
    assert not found.shocks
    assert np.isin(found.places[:, 0], columns).all()


def test_with_lifts_they_are_pieces():
    path, lifted = (
        zigzag(PARABOLA, 2.0, mapping="geodesic", lift=lift) for lift in (None, Lift(height=10.0))
    )
    assert isinstance(lifted, LiftedPath) and len(lifted.pieces) == 2
    shock = lifted.pieces[1].points
    assert np.abs(shock[:, 0]).max() < 0.05 and np.ptp(shock[:, 1]) > 25
    assert lifted.contact_length < path.length
    np.testing.assert_allclose(cKDTree(path.points).query(shock)[0], 0.0, atol=1e-9)


def test_its_corners_can_be_rounded():
    path = zigzag(PARABOLA, 2.0, mapping="geodesic").blended()
    assert len(path.runs) == 1


@pytest.mark.parametrize("surface", [WAVY, bumpy(0)])
def test_no_move_to_a_shock_turns_right_back(surface):
    """Between a pass and a move the feed turns by less than 170 degrees."""
    path, lifted = (zigzag(surface, 2.0, mapping="geodesic", lift=lift) for lift in (None, Lift(height=10.0)))
    passes = len(lifted.pieces[0].nodes)
    assert len(path.nodes) > passes
    line = path.sample(per_leg=1)
    corner = np.flatnonzero(np.diff(line.run) > 0)
    beyond = line.length[corner] > lifted.pieces[0].length * (1 - 1e-9)
    cosine = np.einsum("ij,ij->i", line.tangent[corner], line.tangent[corner + 1])
    assert beyond.sum() > 2 and cosine[beyond].min() > np.cos(np.deg2rad(170))
