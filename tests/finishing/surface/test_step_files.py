"""Faces of STEP files that the Open CASCADE kernel wrote: nets, areas, loops, units, placements."""

from pathlib import Path

import numpy as np
import pytest
from step_areas import (
    ball_without_corner,
    barrel_with_hole,
    over_disk,
    over_rectangle,
    segment,
)

from sdpgrind.finishing import Region, Surface, read_surfaces
from sdpgrind.finishing.surface import Patch, Patches, nominal_surface

FILES = Path(__file__).parents[2] / "data" / "step"
DIE = nominal_surface()
AREA = 1e-4  # relative; source: the requirements, chords of 0.5 um leave less
NET = 1e-9  # mm; source: the requirements


def part(name):
    return read_surfaces(FILES / f"{name}.step")


def areas(name):
    return sorted(patch.area for patch in part(name))


def test_an_untrimmed_face_keeps_its_net():
    (patch,) = part("nominal")
    assert isinstance(patch, Patch) and not patch.trim and patch.surface.degree == (3, 3)
    assert np.abs(patch.surface.control_points - DIE.control_points).max() <= NET
    assert patch.area == pytest.approx(2604.0760, rel=1e-7)
    assert Surface.read(FILES / "nominal.step") == patch.surface


@pytest.mark.parametrize("name", ["nominal_hole", "nominal_hole_inch", "nominal_hole_no_pcurves"])
def test_a_hole_in_the_nominal_surface(name):
    (patch,) = part(name)
    own = DIE.area - over_disk(DIE, 25.0, 25.0, 8.0)
    assert own == pytest.approx(2399.799, abs=0.0005)  # source: the requirements
    assert patch.area == pytest.approx(own, rel=AREA)
    assert np.abs(patch.surface.control_points - DIE.control_points).max() <= NET
    outer, hole = patch.outline()
    assert len(patch.trim) == 2 and np.ptp(outer[:, :2], axis=0) == pytest.approx([50.0, 50.0])
    assert np.hypot(*(hole[:, :2] - 25.0).T) == pytest.approx(8.0, abs=1e-6)


def test_a_notch_at_the_edge():
    (patch,) = part("notch")
    assert patch.area == pytest.approx(DIE.area - over_rectangle(DIE, (0, 15), (20, 32)), rel=AREA)
    uv = np.array([[0.1, 0.5], [0.29, 0.41], [0.31, 0.5], [0.1, 0.39]])
    scaled = 3.0 * uv if patch.surface.domain[0][1] == 3.0 else uv
    assert patch.contains(*scaled.T).tolist() == [False, False, True, True]


def test_two_holes():
    (patch,) = part("two_holes")
    whole = patch.surface
    taken = over_disk(whole, 20, 20, 6) + over_disk(whole, 42, 18, 4)
    assert whole.degree == (3, 2) and whole.control_points.shape == (7, 5, 3)
    assert patch.area == pytest.approx(whole.area - taken, rel=AREA)


def test_a_rational_surface():
    (patch,) = part("rational")
    assert patch.area == pytest.approx(barrel_with_hole(), rel=AREA)
    assert patch.surface.weights is not None and patch.surface.control_points.shape == (3, 4, 3)


def test_a_closed_surface_has_its_seam_twice():
    (patch,) = part("seam")
    assert not patch.trim
    (u0, u1), (v0, v1) = patch.surface.domain
    net = patch.surface.grid(np.linspace(u0, u1, 801), np.linspace(v0, v1, 201)).point
    across, along = np.diff(net, axis=0), np.diff(net, axis=1)
    across, along = (across[:, 1:] + across[:, :-1]) / 2, (along[1:] + along[:-1]) / 2
    facets = np.linalg.norm(np.cross(across, along), axis=-1).sum()
    assert patch.area == pytest.approx(facets, rel=AREA)
    assert patch.surface.point(u0, v0) == pytest.approx(patch.surface.point(u1, v0), abs=1e-9)


def test_planes_and_a_bore_in_metres():
    plane = 600 - 16 * np.pi
    assert areas("plate_metre") == pytest.approx(
        sorted([200, 200, 300, 300, plane, plane, 80 * np.pi]), rel=AREA
    )
    bore = part("plate_metre")[-1]
    middle = bore.surface.point(np.mean(bore.surface.domain[0]), np.mean(bore.surface.domain[1]))
    normal = bore.surface.normal(np.mean(bore.surface.domain[0]), np.mean(bore.surface.domain[1]))
    assert np.hypot(*(middle[:2] - [15, 10])) == pytest.approx(4.0, abs=1e-9)
    assert normal[:2] @ (middle[:2] - [15, 10]) == pytest.approx(-4.0, abs=1e-9)  # out of the steel


def test_sphere_cone_and_torus():
    told = [400 * np.pi, np.pi * 8 * np.hypot(8, 10), 64 * np.pi, 4 * np.pi**2 * 30]
    assert areas("round") == pytest.approx(sorted(told), rel=AREA)
    for patch in part("round"):
        u, v = (np.linspace(*ends, 7)[1:-1] for ends in patch.surface.domain)
        assert _off(patch.surface.grid(u, v).point.reshape(-1, 3)) < 1e-9


def _off(points):
    """Distance from the sphere, the cone, its foot or the torus of the file, whichever is the nearest."""
    ball = np.abs(np.linalg.norm(points, axis=1) - 10)
    x, y, z = points.T
    cone = np.abs(np.hypot(x - 40, y) - 0.8 * (10 - z))
    torus = np.abs(np.hypot(np.hypot(x - 80, y) - 10, z) - 3)
    return min(each.max() for each in (ball, cone, np.abs(z), torus))


def test_a_cut_ball():
    flat = [segment(75.0, 2.0), 96 * np.pi - segment(96.0, 5.0)]
    assert areas("cut_ball") == pytest.approx(sorted([ball_without_corner(), *flat]), rel=AREA)


def test_fillets_that_meet_in_a_corner():
    lost = 4 - np.pi
    told = [600 - lost, 300 - lost, 200 - lost, 504, 224, 144, 28 * np.pi, 18 * np.pi, 8 * np.pi, 2 * np.pi]
    assert areas("fillets") == pytest.approx(sorted(told), rel=AREA)


def test_parts_of_an_assembly_stand_at_their_places():
    found = part("assembly")
    rod = next(each for each in found if each.area == pytest.approx(120 * np.pi, rel=1e-9))
    cone = next(each for each in found if each.area == pytest.approx(11 * np.pi * np.hypot(5, 10), rel=1e-9))
    assert _box(rod) == pytest.approx(np.array([[35, -5, 5], [45, 5, 17]]), abs=1e-6)
    assert _box(cone) == pytest.approx(np.array([[-8, 42, 0], [8, 58, 10]]), abs=1e-6)
    assert rod.surface.point(0.0, 0.0)[:2] == pytest.approx([40.0, 5.0])  # turned by a quarter
    assert isinstance(found, Patches) and repr(found).startswith("Patches(12 patches, ")


def _box(patch):
    points = patch.surface.grid(*(np.linspace(*ends, 9) for ends in patch.surface.domain)).point.reshape(
        -1, 3
    )
    return np.stack([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize(
    ("name", "loop", "centre", "radius"),
    [("nominal_hole", 1, (25, 25), 8), ("two_holes", 1, (20, 20), 6), ("two_holes", 2, (42, 18), 4)],
)
def test_sides_of_a_polygon_are_within_a_chord_of_the_edge(name, loop, centre, radius):
    (patch,) = part(name)
    polygon = patch.trim[loop]
    middle = patch.surface.point(*((polygon[1:] + polygon[:-1]) / 2).T)
    off = np.abs(np.hypot(*(middle[:, :2] - centre).T) - radius)
    assert off.max() <= 0.0006  # mm; 0.5 um of the reader, and the slope of the surface


def test_regions_of_a_scan_are_trimmed_patches(tmp_path):
    """Triangles over the nominal surface with a hole: one patch with its border and the hole."""
    trimesh = pytest.importorskip("trimesh")
    side, count = np.linspace(0.05, 0.95, 60), 60
    points = DIE.grid(side, side).point.reshape(-1, 3)
    index = np.arange(count**2).reshape(count, count)
    a, b, c, d = (each.ravel() for each in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    faces = faces[np.hypot(*(points[faces].mean(axis=1)[:, :2] - 25.0).T) > 8.0]
    trimesh.Trimesh(points, faces, process=False).export(tmp_path / "scan.stl")
    (patch,) = read_surfaces(tmp_path / "scan.stl", region=Region(seed=(10, 10, 3), empty_max=0.2))
    facets = (
        np.linalg.norm(np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))), axis=1).sum()
        / 2
    )
    assert len(patch.trim) == 2 and patch.area == pytest.approx(facets, rel=1e-3)
    assert patch.fit.error < 0.01 and patch.fit is patch.surface.fit
