"""Lines a pitch apart: closed forms, a slow twin, gaps integrated anew, and no line too many."""

import numpy as np
import pytest
from finishing_inside import Square, _value, march, spacing
from scipy.integrate import quad
from scipy.optimize import brentq

from sdpgrind.base.compiling.compiled import opened
from sdpgrind.finishing import zigzag
from sdpgrind.finishing.surface import cylinder_surface, flat_surface, nominal_surface, uneven_surfaces

value = opened(_value)

SURFACES = {"nominal": nominal_surface(), **uneven_surfaces()}
CASES = [(name, along) for name in SURFACES for along in "uv"]


def gap_at(surface, along, s, low, high):
    """Distance of two lines at one place, by adaptive quadrature of sqrt(EG - F^2)/sqrt(E)."""

    def density(c):
        d = surface.derivatives(*((s, c) if along == "u" else (c, s)))
        return np.linalg.norm(np.cross(d.u, d.v)) / np.linalg.norm(d.u if along == "u" else d.v)

    return quad(density, low, high, epsabs=1e-10, limit=100)[0]


@pytest.mark.parametrize(("name", "along"), CASES)
def test_gaps_by_quadrature(name, along):
    gaps = Square(SURFACES[name], "parametric", along).gaps()
    for row, s in ((0, 0.0), (-1, 1.0)):
        for low, high in ((0.0, 0.013), (0.3, 0.4), (0.9, 1.0)):
            found = np.diff(gaps.at(np.array([low, high])))[row, 0]
            assert found == pytest.approx(gap_at(SURFACES[name], along, s, low, high), rel=1e-6)


@pytest.mark.parametrize("mapping", ["equal_spacing", "parametric", "equal_area"])
@pytest.mark.parametrize(("name", "along"), CASES)
def test_no_gap_is_wider_than_the_pitch_on_other_rows(name, along, mapping):
    """On 150 rows that were not looked at; and one line less does not do."""
    square = Square(SURFACES[name], "equal_area" if mapping == "equal_area" else "parametric", along)
    gaps, pitch = square.gaps(), 1.7
    place = spacing.equal_spacing if mapping == "equal_spacing" else spacing.even_spacing
    lines = place(gaps, pitch)
    rows, c = np.random.default_rng(1).uniform(0, 1, 150), spacing.with_middles(np.linspace(0, 1, 301))
    other = spacing.gaps_of(*square.tangents(rows[:, None], c), c)
    assert spacing.largest_gap(other, lines) <= pitch * (1 + 2e-4)
    if mapping == "equal_spacing":
        assert spacing._marched(gaps, pitch, len(lines) - 1)[-1] < 1
        assert spacing._excess(gaps, pitch, len(lines) - 1) > 0
    else:
        fewer = (np.arange(len(lines) - 1) + 0.5) / (len(lines) - 1)
        assert spacing.largest_gap(gaps, fewer) > pitch


@pytest.mark.parametrize(("name", "along"), CASES)
def test_widest_gaps_are_equal(name, along):
    gaps = Square(SURFACES[name], "parametric", along).gaps()
    distance = gaps.at(spacing.equal_spacing(gaps, 2.3))
    widest = np.diff(distance, axis=1).max(axis=0)
    borders = 2 * distance[:, 0].max(), 2 * (gaps.total[:, -1] - distance[:, -1]).max()
    np.testing.assert_allclose([*widest, *borders], widest[0], rtol=1e-8)


@pytest.mark.parametrize("pitch", [1.0, 0.37, 20.0, 49.99])
def test_flat(pitch):
    gaps = Square(flat_surface(50.0), "parametric", "u").gaps()
    count = int(np.ceil(50 / pitch - 1e-9))
    for place in (spacing.equal_spacing, spacing.even_spacing):
        np.testing.assert_allclose(place(gaps, pitch), (np.arange(count) + 0.5) / count, atol=1e-11)


def test_cylinder_by_its_angle():
    """A rational quarter of a cylinder, whose parameter is not its angle: lines along the axis stand at even
    angles.
    """
    surface = cylinder_surface(30.0, 50.0)
    along = "u" if surface.degree == (1, 2) else "v"
    lines = spacing.equal_spacing(Square(surface, "parametric", along).gaps(), 2.0)
    count = int(np.ceil(30 * np.pi / 2 / 2.0))
    uv = (0.5, lines) if along == "u" else (lines, 0.5)
    normal = surface.normal(*uv)
    angles = np.arccos(np.clip(np.einsum("ij,ij->i", normal[1:], normal[:-1]), -1, 1))
    np.testing.assert_allclose(angles, np.pi / 2 / count, rtol=1e-7)


def test_kernel_is_its_slow_twin():
    """Each line by a root finder in every row."""
    gaps = Square(SURFACES["steep"], "parametric", "u").gaps()
    thin = spacing.Gaps(gaps.across, gaps.total[::32].copy(), gaps.slope[::32].copy())

    def place(row, wanted):
        return brentq(lambda c: thin.at(np.array([c]))[row, 0] - wanted, 0.0, 1.0, xtol=1e-13)

    lines, reached = [], np.zeros(len(thin.total))
    for k in range(6):
        lines.append(min(place(row, far + (2.0 if k else 1.0)) for row, far in enumerate(reached)))
        reached = thin.at(np.array(lines[-1:]))[:, 0]
    np.testing.assert_allclose(march(thin.total, thin.slope, thin.across, 2.0, 6), lines, atol=1e-10)
    each = [
        value(total, slope, thin.across, lines[2])
        for total, slope in zip(thin.total, thin.slope, strict=True)
    ]
    np.testing.assert_allclose(each, thin.at(np.array(lines))[:, 2], rtol=1e-13)


def test_flat_zigzag():
    path = zigzag(flat_surface(8.0), 1.0)
    assert (
        path.pattern == "zigzag"
        and path.nodes.shape == (64, 2)
        and path.length == pytest.approx(63.0, abs=1e-9)
    )
    x, y = path.points.T[:2]
    np.testing.assert_allclose(x[:16], [*np.arange(0.5, 8), *np.arange(0.5, 8)[::-1]], atol=1e-9)
    np.testing.assert_allclose(y, np.repeat(np.arange(0.5, 8), 8), atol=1e-9)
    other = zigzag(flat_surface(8.0), 1.0, along="v")
    np.testing.assert_allclose(other.nodes, path.nodes[:, ::-1], atol=1e-12)


def test_equal_spacing_comes_near_the_least_length():
    """Area over pitch is the least; border to border it would be 97 % of that, and half a pitch inside it is
    more.
    """
    surface = nominal_surface()
    path = zigzag(surface, 1.0)
    assert surface.area / path.length == pytest.approx(0.988, abs=2e-3)
    lines = np.unique(path.nodes[:, 1].round(12))
    passes = surface.grid(np.linspace(0, 1, 2001), lines).point
    whole = (
        np.linalg.norm(np.diff(passes, axis=0), axis=2).sum()
        + np.linalg.norm(np.diff(passes[0], axis=0), axis=1).sum()
    )
    assert surface.area / whole == pytest.approx(0.97, abs=2e-3)
    assert zigzag(surface, 1.0, mapping="parametric").length > path.length


@pytest.mark.parametrize("mapping", ["equal_spacing", "equal_area", "geodesic"])
def test_rounded_connectors(mapping):
    """One smooth run whose arcs have the radius asked for, next to what a spline through an arc's end
    overshoots.
    """
    path = zigzag(nominal_surface(), 3.0, mapping=mapping, radius=1.0)
    bend = np.linalg.norm(path.sample(per_leg=4).curvature_vector, axis=1)
    assert len(path.runs) == 1 and 1.0 < bend.max() < 1.25
    arcs = bend[bend > 0.5]
    assert np.median(arcs) == pytest.approx(1.0, rel=0.03)
    sharp = zigzag(nominal_surface(), 3.0, mapping=mapping)
    corners = len(sharp.runs) - 1
    assert sharp.length - path.length == pytest.approx(corners * (2 - np.pi / 2), rel=0.05)


def test_half_a_pitch_makes_half_circles():
    path = zigzag(flat_surface(8.0), 1.0, radius=0.5)
    assert path.length == pytest.approx(8 * 7 + 7 * (np.pi / 2 - 1), abs=2e-3)
    top = path.sample(per_leg=8).point[:, 0].max()
    assert top == pytest.approx(7.5, abs=1e-3)
