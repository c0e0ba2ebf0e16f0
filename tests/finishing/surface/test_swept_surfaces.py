"""Extruded and revolved faces that the Open CASCADE kernel wrote, and edges known by their PCURVEs alone."""

import re
from pathlib import Path

import numpy as np
import pytest
from cox_de_boor import row
from step_areas import integral

from sdpgrind.finishing import read_surfaces, zigzag

FILES = Path(__file__).parents[2] / "data" / "step"
AREA = 1e-4  # relative; source: the requirements, chords of 0.5 um leave less
EXACT = 1e-9  # mm; source: the requirements
# control points of the files' profiles, (x, z), mm; see make_step_files.py
WAVE = np.array([[0, 0], [10, 6], [20, -3], [30, 4], [40, 0]], dtype=float)
VASE = np.array([[12, 0], [16, 10], [9, 20], [13, 30]], dtype=float)
BOWL = np.array([[0, 0], [8, 0.5], [14, 6], [15, 15]], dtype=float)


def part(name):
    return read_surfaces(FILES / f"{name}.step")


def spline(nodes, t, order=0):
    """Place of a cubic with knots from 0 to 1, or its derivative, by the recursion."""
    knots = np.concatenate([np.zeros(3), np.linspace(0, 1, len(nodes) - 2), np.ones(3)])
    return row(list(knots), 3, t, order) @ nodes


def speed(nodes, t):
    return np.hypot(*spline(nodes, t, 1))


def net(patch, count=9):
    """Parameters and places of a grid."""
    u, v = (np.linspace(*ends, count) for ends in patch.surface.domain)
    return u, v, patch.surface.grid(u, v).point


def test_an_extruded_wave_with_a_hole():
    """x = X(t) + 3 s, y = 30 s, z = Z(t); the area by chords over t, the hole's row by row of y."""
    (patch,) = part("extruded_hole")
    x, z = np.array([spline(WAVE, t) for t in np.linspace(0, 1, 401)]).T
    area = np.append(0, np.cumsum(np.sqrt(900 * np.diff(x) ** 2 + 909 * np.diff(z) ** 2)))  # of s from 0 to 1
    angle = (np.arange(200) + 0.5) / 200 * np.pi - np.pi / 2
    s, half = (15 + 5 * np.sin(angle)) / 30, 5 * np.cos(angle)
    row_area = np.interp(20 + half - 3 * s, x, area) - np.interp(20 - half - 3 * s, x, area)
    hole = np.sum(row_area * half / 30) * np.pi / 200
    assert len(patch.trim) == 2 and patch.surface.degree == (3, 1) and patch.surface.weights is None
    assert patch.area == pytest.approx(area[-1] - hole, rel=AREA)
    u, _, points = net(patch)
    own = np.array([spline(WAVE, t / 2) for t in u])  # the file's knots end at 2
    assert np.abs(points[..., 0] - points[..., 1] / 10 - own[:, :1]).max() <= EXACT
    assert np.abs(points[..., 2] - own[:, 1:]).max() <= EXACT
    assert np.hypot(*(patch.outline()[1][:, :2] - [20, 15]).T) == pytest.approx(5.0, abs=1e-6)


def test_an_elliptic_wall_with_a_notch():
    wall = part("ellipse_notch")[0]

    def rate(t):
        return np.hypot(12 * np.sin(t), 7 * np.cos(t))

    notch = np.arcsin(3 / 7)
    assert wall.area == pytest.approx(
        20 * 4 * integral(rate, 0, np.pi / 2) - 16 * integral(rate, 0, notch), rel=AREA
    )
    x, y = net(wall)[2].reshape(-1, 3).T[:2]
    assert np.abs(np.hypot(x / 12, y / 7) - 1).max() * 12 <= EXACT
    u, v, points = net(wall, 41)
    kept = wall.contains(*np.meshgrid(u, v, indexing="ij"))
    in_notch = (
        (points[..., 0] > 5)
        & (np.abs(points[..., 1]) < 3 - 1e-3)
        & (points[..., 2] > 5 + 1e-3)
        & (points[..., 2] < 13 - 1e-3)
    )
    assert not (kept & in_notch).any() and kept.mean() > 0.8


def test_a_turned_vase_with_a_hole():
    (patch,) = part("revolved_hole")
    profile = np.polynomial.Polynomial(
        [12.0, 12.0, -33.0, 22.0]
    )  # the cubic of 12, 16, 9, 13 over t = z / 30

    def ring(t):
        return profile(t) * np.hypot(30.0, profile.deriv()(t))

    def hole(angle):  # z = 15 + 4 sin(angle)
        t = 0.5 + 4 * np.sin(angle) / 30
        return 2 * np.arcsin(4 * np.cos(angle) / profile(t)) * ring(t) * 4 * np.cos(angle) / 30

    told = 2 * np.pi * integral(ring, 0, 1) - integral(hole, -np.pi / 2, np.pi / 2)
    assert len(patch.trim) == 2 and patch.area == pytest.approx(told, rel=AREA)
    _, v, points = net(patch)
    own = np.array([spline(VASE, t) for t in v])
    assert np.abs(np.hypot(points[..., 0], points[..., 1]) - own[:, 0]).max() <= EXACT
    assert np.abs(points[..., 2] - own[:, 1]).max() <= EXACT
    assert patch.surface.point(0.0, 0.5)[:2] == pytest.approx(
        patch.surface.point(2 * np.pi, 0.5)[:2], abs=EXACT
    )


def test_a_bowl_whose_profile_begins_at_its_axis():
    (patch,) = part("bowl")
    told = 2 * np.pi * integral(lambda t: spline(BOWL, t)[0] * speed(BOWL, t), 0, 1)
    assert not patch.trim and patch.area == pytest.approx(told, rel=AREA)


def test_a_part_of_an_elliptic_ring():
    (patch,) = part("ellipse_ring")

    def ring(t):
        return (20 + 6 * np.cos(t)) * np.hypot(6 * np.sin(t), 3 * np.cos(t))

    assert not patch.trim and patch.area == pytest.approx(2.0 * integral(ring, 0.3, 2.5), rel=AREA)
    x, y, z = net(patch)[2].reshape(-1, 3).T
    assert np.abs(np.hypot((np.hypot(x, y) - 20) / 6, z / 3) - 1).max() * 6 <= EXACT
    assert np.ptp(np.arctan2(y, x)) == pytest.approx(2.0, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "away", "radius"),
    [
        ("extruded_hole", lambda x, y, z: np.hypot(x - 20, y - 15), 5.0),
        (
            "revolved_hole",
            lambda x, y, z: np.where(x + y > 0, np.hypot((x - y) / 2**0.5, z - 15), np.inf),
            4.0,
        ),
    ],
)
def test_a_path_stays_off_the_hole(name, away, radius):
    (patch,) = part(name)
    found = zigzag(patch, 3.0).sample(per_leg=16)
    from_axis = away(*found.point[found.contact].T)
    assert radius - 0.01 <= from_axis.min() <= radius + 3.0  # mm; source: the requirements, and the pitch


@pytest.mark.parametrize(
    "name",
    [
        "extruded_hole",
        "ellipse_notch",
        "revolved_hole",
        "bowl",
        "ellipse_ring",
        "round",
        "cut_ball",
        "seam",
        "rational",
    ],
)
@pytest.mark.parametrize("instead", ["$", "#9999"])
def test_edges_by_their_pcurves_alone(tmp_path, name, instead):
    """Without a curve in space, or with one of a kind that is not read, areas are those with it."""
    text = (FILES / f"{name}.step").read_text()
    text, count = re.subn(r"(SURFACE_CURVE|SEAM_CURVE)\('',#\d+,", rf"\1('',{instead},", text)
    file = tmp_path / "part.step"
    file.write_text(text.replace("DATA;", "DATA;\n#9999 = HYPERBOLA('',$,1.,1.);"))
    areas = [patch.area for patch in read_surfaces(file)]
    assert count and areas == pytest.approx([patch.area for patch in part(name)], rel=AREA)
