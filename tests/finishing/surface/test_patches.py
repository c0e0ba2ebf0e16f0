"""Trimmed patches: areas against closed forms, places inside, and what is refused."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing.surface import Patch, cylinder_surface, flat_surface, nominal_surface, sphere_surface

FLAT = flat_surface(50.0)
SQUARE = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9), (0.1, 0.1)]
HOLE = [(0.4, 0.4), (0.4, 0.6), (0.6, 0.6), (0.6, 0.4), (0.4, 0.4)]


def test_area_of_polygons_on_a_flat():
    assert Patch(FLAT).area == pytest.approx(2500.0)
    assert Patch(FLAT, [SQUARE]).area == pytest.approx(1600.0, rel=1e-12)
    assert Patch(FLAT, [SQUARE, HOLE]).area == pytest.approx(1500.0, rel=1e-12)
    assert Patch(FLAT, [HOLE]).area == pytest.approx(2400.0, rel=1e-12)


def test_area_across_knots_of_a_curved_surface():
    """A rectangle in the parameters: by the sub-grid of Gauss points, and by its border."""
    die = nominal_surface()
    (u0, u1), (v0, v1) = (0.13, 0.77), (0.21, 0.94)
    border = [(u0, v0), (u1, v0), (u1, v1), (u0, v1), (u0, v0)]
    x, weight = np.polynomial.legendre.leggauss(80)
    ends = [np.concatenate([[low], np.array([1, 2]) / 3, [high]]) for low, high in ((u0, u1), (v0, v1))]
    nodes = [((a[1:, None] + a[:-1, None] + np.diff(a)[:, None] * x) / 2).ravel() for a in ends]
    weights = [(np.diff(a)[:, None] / 2 * weight).ravel() for a in ends]
    own = weights[0] @ die.area_density(*np.meshgrid(*nodes, indexing="ij")) @ weights[1]
    assert Patch(die, [border]).area == pytest.approx(own, rel=1e-10)


def test_area_of_a_strip_of_a_sphere_and_a_cylinder():
    """A strip between two lines of constant v is a zone: its area is that of the same share of height."""
    ball = sphere_surface(10.0)
    (u0, u1), (v0, _) = ball.domain
    for side in ((v0, 0.5), (0.2, 0.7)):
        strip = [(u0, side[0]), (u1, side[0]), (u1, side[1]), (u0, side[1]), (u0, side[0])]
        height = np.abs(np.diff(ball.point(u0, np.array(side))[:, 2]))[0]
        zone = 2 * np.pi * 10.0 * height
        assert Patch(ball, [strip]).area / zone == pytest.approx(
            ball.area / (4 * np.pi * 100) * _share(ball), rel=1e-9
        )
    tube = cylinder_surface(20.0, 50.0)
    half = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0), (0.0, 0.0)]
    assert Patch(tube, [half]).area == pytest.approx(tube.area / 2, rel=1e-10)


def _share(ball):
    """Zone of the whole ball over that of the patch, of the same height."""
    (u0, _), v = ball.domain
    height = np.abs(np.diff(ball.point(u0, np.array(v))[:, 2]))[0]
    return 4 * np.pi * 100 / (2 * np.pi * 10 * height)


@settings(max_examples=60)
@given(st.floats(0.05, 0.95), st.floats(0.05, 0.95))
def test_inside_is_even_and_odd(u, v):
    patch = Patch(FLAT, [SQUARE, HOLE])
    told = 0.1 < u < 0.9 and 0.1 < v < 0.9 and not (0.4 < u < 0.6 and 0.4 < v < 0.6)
    if min(abs(x - edge) for x in (u, v) for edge in (0.1, 0.4, 0.6, 0.9)) > 1e-9:
        assert bool(patch.contains(u, v)) == told


def test_inside_of_many_sides_is_a_turn_of_the_angle_about_the_place():
    """The sides of other bands of v are not looked at; here all of them are."""
    rng = np.random.default_rng(2)
    angle = 2 * np.pi * (np.arange(60) + rng.uniform(0, 0.9, 60)) / 60
    ends = 0.5 + rng.uniform(0.1, 0.45, 60)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    star = np.append(ends, ends[:1], axis=0)
    places = rng.random((2000, 2))
    seen = np.unwrap(np.angle((star[:, None] - places) @ [1.0, 1.0j]), axis=0)
    np.testing.assert_array_equal(Patch(FLAT, [star]).contains(*places.T), abs(seen[-1] - seen[0]) > 1.0)


def test_a_patch_is_a_value():
    patch = Patch(FLAT, [HOLE, SQUARE], name="top")
    assert patch == Patch(FLAT, [SQUARE, HOLE], name="top") and hash(patch) == hash(decode(encode(patch)))
    assert decode(encode(patch)) == patch and patch != Patch(FLAT, [SQUARE], name="top")
    assert patch.moved((0.0, 0.0, 3.0)).outline()[1][:, 2] == pytest.approx(3.0)
    assert repr(patch).startswith("Patch(top, 2 trimming loops, 1500 mm^2, Surface(")
    assert not patch.trim[0].flags.writeable


def test_a_patch_is_drawn(pyplot):
    patch = Patch(FLAT, [SQUARE, HOLE])
    (axes,) = patch.plot().axes
    assert len(axes.lines) == 4 + 2  # knot lines, loops
    clear = axes.collections[0].get_facecolor()[:, 3] == 0
    assert abs(1 - clear.mean() - patch.area / FLAT.area) < 0.02  # 60 x 60 facets, loops along their sides


BOW = [(0.1, 0.1), (0.9, 0.9), (0.9, 0.1), (0.1, 0.8), (0.1, 0.1)]
REFUSED = [
    ([SQUARE[:-1]], "trim[0] must be closed: its last place its first, within 0.001 of the domain; got 'a gap of 0.8'"),
    ([SQUARE[:3]], "trim[0] must be of shape (n, 2), n >= 4, its last place its first; got (3, 2)"),
    ([[(0.1, 0.1), (0.5, 0.5), (0.9, 0.9), (0.1, 0.1)]], "trim[0] must be a polygon with an area"),
    ([BOW], "trim[0] must not cross itself; its side 0, from (0.1, 0.1), crosses side 2"),
    ([SQUARE, [(x + 0.4, y) for x, y in HOLE][::-1]], "trim[1] must not cross trim[0]"),
    ([SQUARE, HOLE[::-1]], "trim[1] must be clockwise, as a hole is: trim[0] is the outer one"),
    ([SQUARE, HOLE, [(0.5 + (x - 0.5) / 2, 0.5 + (y - 0.5) / 2) for x, y in HOLE]], "trim[2] must be outside of trim[1]"),
    ([HOLE, [(x * 0.2, y * 0.2 + 0.01) for x, y in SQUARE]], "trim[0] must be inside of trim[1]; got 'a hole outside'"),
    ([[(x + 0.2, y) for x, y in SQUARE]], "trim[0][1] must be in the surface's domain; got (1.1, 0.1)"),
    ([[(np.nan, y) for _, y in SQUARE]], "trim[0][0] must be finite; got nan"),
    ("loop", "trim must be a sequence of polygons (n, 2); got 'loop'"),
]  # fmt: skip


@pytest.mark.parametrize(("trim", "words"), REFUSED)
def test_refused_trimming(trim, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        Patch(FLAT, trim)


def test_the_border_of_a_curved_patch_is_drawn_along_it():
    """Round sides of a cylinder, not the chords of their ends."""
    pytest.importorskip("matplotlib")
    figure = Patch(cylinder_surface(40.0, 60.0)).plot()
    line = np.array(figure.axes[0].lines[-1].get_data_3d()).T
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).max() < 2.0  # corners alone: 60 mm
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 2]), 40.0, rtol=1e-9)
