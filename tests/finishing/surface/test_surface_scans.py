"""Surfaces from files of scans: regions, loops around triangles, tables with units, and what is refused."""

import importlib

import numpy as np
import pytest
import trimesh
from finishing_inside import SCANS, read_scan, scan_triangles
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import units
from sdpgrind.finishing import Region, Surface
from sdpgrind.finishing.surface import nominal_surface

NOMINAL = nominal_surface()
FINE = 41  # points each way
TOP = Region(seed=(10.0, 20.0, 5.0), crease=units.deg(30))


def block(n=FINE):
    """A solid whose top is the nominal surface: corners, and triangles that face outward."""
    at = np.linspace(0.0, 1.0, n)
    top = NOMINAL.grid(at, at).point.reshape(-1, 3)
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
    ring = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    low, onward = n * n + np.arange(len(ring)), np.roll(ring, -1)
    beside, middle = np.roll(low, -1), np.full(len(ring), n * n + len(ring))
    faces += [
        np.stack(each, axis=-1)
        for each in ((ring, low, beside), (ring, beside, onward), (beside, low, middle))
    ]
    floor = top[ring] * [1.0, 1.0, 0.0] - [0.0, 0.0, 20.0]
    return np.concatenate([top, floor, [[25.0, 25.0, -20.0]]]), np.concatenate(faces)


def written(path, corners, faces, kind=None):
    """Write triangles by trimesh; STL repeats the corners of each."""
    path.write_bytes(raw(corners, faces, kind or path.suffix[1:]))
    return path


def raw(corners, faces, kind):
    exported = trimesh.Trimesh(corners, faces, process=False).export(file_type=kind)
    return exported if isinstance(exported, bytes) else exported.encode()


def turned_area(loop):
    """Signed area of a polygon of the unit square."""
    x, y = loop.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


@pytest.mark.parametrize(
    ("name", "kind"), [("a.stl", None), ("a.STL", "stl_ascii"), ("a.ply", None), ("a.obj", None)]
)
def test_the_top_of_a_solid(tmp_path, name, kind):
    path = written(tmp_path / name, *block(), kind or name[2:].lower())
    (found,) = read_scan(path, TOP)
    surface = found.surface
    assert surface.fit.distances.size == FINE**2 and surface.fit.error < 0.005
    assert surface.normal(0.5, 0.5)[2] > 0.9  # the triangles' outside
    (loop,) = found.loops
    assert len(loop) == 4 * (FINE - 1)
    # the loop lies on the edges of the top, and leaves out what the rectangle has too much
    edge = surface.point(*loop.T)
    beside = np.minimum(np.abs(edge[:, :2]), np.abs(edge[:, :2] - 50.0)).min(axis=1)
    assert beside.max() < 0.005
    assert covered(surface, loop) == pytest.approx(NOMINAL.area, rel=1e-3)


def covered(surface, loop, n=600):
    """Area within a loop, mm^2, by the middles of cells; its error is of the order of a cell's width."""
    from matplotlib.path import Path

    at = (np.arange(n) + 0.5) / n
    u, v = np.meshgrid(at, at, indexing="ij")
    inside = Path(loop).contains_points(np.stack([u.ravel(), v.ravel()], axis=-1)).reshape(n, n)
    return float((surface.area_density(u, v) * inside).mean())


def test_a_disk_with_a_hole(tmp_path):
    """A flat ring: areas of its loops are those of its polygons, the hole runs the other way around."""
    ring = trimesh.creation.annulus(8.0, 30.0, 5.0, sections=60).subdivide_to_size(4.0)
    path = written(tmp_path / "ring.stl", ring.vertices, ring.faces)
    above, below = read_scan(path, [Region(seed=(20.0, 0.0, 2.5)), Region(seed=(20.0, 0.0, -2.5))])
    polygon = 30 * np.sin(2 * np.pi / 60)
    for found, side in ((above, 1.0), (below, -1.0)):
        np.testing.assert_allclose(found.surface.normal(0.5, 0.5), [0.0, 0.0, side], atol=1e-9)
        areas = sorted(turned_area(loop) * found.surface.area for loop in found.loops)
        np.testing.assert_allclose(areas, [-64.0 * polygon, 900.0 * polygon], rtol=1e-6)


def test_holes_of_a_scan_are_told(tmp_path):
    ring = trimesh.creation.annulus(16.0, 30.0, 5.0, sections=60).subdivide_to_size(2.0)
    path = written(tmp_path / "ring.ply", ring.vertices, ring.faces)
    region = Region(seed=(20.0, 0.0, 2.5))
    with pytest.raises(ValueError, match="empty at a net of 24 x 24"):
        read_scan(path, region, net=(24, 24))
    (found,) = read_scan(path, region.replace(empty_max=0.2), net=(24, 24))
    assert 0.05 < found.surface.fit.empty < 0.2 and len(found.loops) == 2


def test_a_box_of_a_solid(tmp_path):
    path = written(tmp_path / "a.stl", *block())
    (found,) = read_scan(path, Region(box=((-1.0, -1.0, -0.1), (25.1, 51.0, 30.0))))
    assert found.surface.fit.distances.size == 21 * FINE
    (both,) = read_scan(path, TOP.replace(box=((-1.0, -1.0, -30.0), (25.1, 51.0, 30.0))))
    assert both.surface == found.surface


@pytest.mark.parametrize(
    ("first", "last", "loops"), [(85, 110, 1), (0, 25, 0)], ids=["amidst", "at the edge"]
)
def test_triangles_inside_out(tmp_path, first, last, loops):
    """A region spreads over them all the same; the outside is that of most."""
    corners, faces = block()
    faces[first:last] = faces[first:last, ::-1]
    (found,) = read_scan(written(tmp_path / "a.ply", corners, faces), TOP)
    assert found.surface.fit.distances.size == FINE**2 and found.surface.normal(0.5, 0.5)[2] > 0.9
    assert len(found.loops) == loops


def test_triangles_without_area_are_left_out():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [1, 0, -0.0]])
    found = scan_triangles.merged(corners, np.array([[0, 1, 2], [0, 3, 1], [4, 2, 4]]))
    assert found.faces.shape == (1, 3) and len(found.corners) == 3


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_the_nearest_triangle(seed):
    """Against the least distance over many places of each triangle."""
    rng = np.random.default_rng(seed)
    triangles = scan_triangles.Triangles(rng.normal(size=(6, 3)), np.array([[0, 1, 2], [3, 4, 5], [0, 4, 2]]))
    point = rng.normal(size=3)
    a, b = (each.ravel() for each in np.meshgrid(*[np.linspace(0.0, 1.0, 201)] * 2))
    weights = np.stack([a, b, 1.0 - a - b], axis=-1)[a + b <= 1.0]
    far = [
        np.linalg.norm(weights @ triangles.corners[face] - point, axis=1).min() for face in triangles.faces
    ]
    best, distance = scan_triangles.nearest(triangles, point)
    # a place is at most half a cell's diagonal from the nearest one
    assert distance <= min(far) + 1e-12 and far[best] - distance < 0.03


def test_flat_faces_of_few_corners(tmp_path):
    """The faces of a box are two triangles each: as exact as the file, with their edges as loops."""
    box = trimesh.creation.box((40.0, 30.0, 10.0))
    path = written(tmp_path / "box.stl", box.vertices, box.faces)
    seeds = {(1.0, 1.0, 5.0): 1200.0, (1.0, -15.0, 1.0): 400.0, (20.0, 1.0, 1.0): 300.0}
    for found, (seed, area) in zip(
        read_scan(path, [Region(seed=s) for s in seeds]), seeds.items(), strict=True
    ):
        outward = np.array(seed) * (np.abs(seed) > 4.0)
        np.testing.assert_allclose(
            found.surface.normal(0.3, 0.6), outward / np.linalg.norm(outward), rtol=0, atol=1e-9
        )
        assert found.surface.fit.error < 1e-6 and found.surface.area == pytest.approx(area, rel=1e-6)
        assert len(found.loops) == 1 and len(found.loops[0]) == 4
    with pytest.raises(
        ValueError, match=r"region must have at least 16 corners of triangles, or be flat; it has 8,"
    ):
        read_scan(path)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_finer_triangles_are_the_same_surface(seed):
    """Area and outside stay; the corners of before come first; common sides get one corner."""
    rng = np.random.default_rng(seed)
    before = scan_triangles.Triangles(rng.normal(size=(5, 3)), np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2]]))
    after = scan_triangles.finer(before)
    assert after.faces.shape == (12, 3) and len(after.corners) == 5 + 7
    np.testing.assert_array_equal(after.corners[:5], before.corners)
    areas = [np.linalg.norm(each.normals, axis=1).sum() for each in (before, after)]
    assert areas[0] == pytest.approx(areas[1], rel=1e-12)
    np.testing.assert_allclose(after.normals.sum(axis=0), before.normals.sum(axis=0), rtol=0, atol=1e-12)


def test_creases_end_a_region():
    """A roof of 40 deg at the ridge, by triangles that share its edge."""
    tilt = np.tan(units.deg(20.0))
    corners = np.array([[x, y, -abs(x) * tilt] for x in (-1.0, 0.0, 1.0) for y in (0.0, 1.0)])
    faces = np.array([[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]])
    roof = scan_triangles.Triangles(corners, faces)
    for crease, count in ((39.9, 2), (40.1, 4)):
        assert scan_triangles.reached(roof, 0, units.deg(crease)).sum() == count


POINTS = np.random.default_rng(1).uniform(0.0, 30.0, (60, 2)) @ np.array([[1.0, 0, 0.2], [0, 1, 0.1]])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "\n".join("{:.9g} {:.9g} {:.9g}".format(*row) for row in POINTS)),
        ("a.xyz", "# scanner\n\n" + "\n".join("{:.9g}\t{:.9g}\t{:.9g}\t0\t0\t1".format(*row) for row in POINTS)),
        ("a.csv", "x,y,z\n" + "\n".join("{:.9g},{:.9g},{:.9g}".format(*row) for row in POINTS)),
        ("a.csv", "\n".join("{:.9g}, {:.9g}, {:.9g} // end".format(*row) for row in POINTS)),
        ("a.csv", "no;z [mm];Y (cm);X [m]\n" + "\n".join(f"7;{z:.9g};{y / 10:.9g};{x / 1000:.9g}" for x, y, z in POINTS)),
        ("a.csv", "\ufeffx;y;z\n" + "\n".join(f"{x:.9g};{y:.9g};{z:.9g}".replace(".", ",") for x, y, z in POINTS)),
        ("a.csv", "\n".join(f"{x:.9g};{y:.9g};{z:.9g}".replace(".", ",") for x, y, z in POINTS)),
        ("a.xyz", "\n".join(f"{x:.9g}  {y:.9g} {z:.9g}".replace(".", ",") for x, y, z in POINTS)),
        ("a.xyz", "\n".join(f"{x:.9g}\t{y:.9g}\t{z:.9g}".replace(".", ",") for x, y, z in POINTS)),
    ],
    ids=["blanks", "tabs, comment, more columns", "names", "no names", "units", "decimal comma",
         "decimal commas without names", "decimal commas between blanks", "decimal commas between tabs"],
)  # fmt: skip
def test_tables_of_points(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    (found,) = read_scan(path)
    np.testing.assert_allclose(found.surface.control_points, Surface.fit(POINTS).control_points, atol=1e-6)
    assert found.loops == ()


def test_an_array_of_numpy(tmp_path):
    np.save(tmp_path / "a.npy", POINTS)
    (found,) = read_scan(tmp_path / "a.npy", Region(box=((0.0, 0.0, -9.0), (30.0, 20.0, 99.0))))
    assert found.surface == Surface.fit(POINTS[POINTS[:, 1] <= 20.0])


def test_points_of_a_ply(tmp_path):
    (tmp_path / "a.ply").write_bytes(trimesh.PointCloud(POINTS).export(file_type="ply"))
    (found,) = read_scan(tmp_path / "a.ply")
    np.testing.assert_allclose(found.surface.fit.distances, 0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.stl", raw(*block(5), "stl")[:-7], r"'a\.stl' must be an STL, whole: 84 \+ 50 x 80 = 4084 bytes.*got 4077"),
        ("a.stl", raw(*block(5), "stl_ascii")[:-2000], r"it ends in line \d+ before 'endsolid'"),
        ("a.stl", b"\x89PNG\r\n" * 90, r"'a\.stl' must be an STL"),
        ("a.stl", b"", r"'a\.stl' must be an STL"),
        ("a.stl", bytes(84), r"0 triangles"),
        ("a.stl", b"solid a\nendsolid a\n", r"'a\.stl' must be an STL"),
        ("a.ply", raw(*block(5), "ply")[:-7], r"'a\.ply' must be a PLY, whole; got"),
        ("a.ply", b"solid a\nendsolid a\n", r"'a\.ply' must be a PLY, whole; got"),
        ("a.obj", raw(*block(5), "obj")[:1000], r"'a\.obj' must"),
        ("a.obj", b"hello\n" * 9, r"'a\.obj' must hold triangles or points; got none: is it an OBJ, and whole\?"),
        ("a.xyz", b"1 2 3\n4 5 6\n7 8\n", r"'a\.xyz', line 3 must hold 3 cells as the first one does; got 2: '7 8'"),
        ("a.xyz", b"1 2 3\nC 5 6 8\n", r"line 2 must hold 3 cells as the first one does; got 4"),
        ("a.csv", b"0,5,0,25,1,0\n1,5,0,25,2,0\n", r"must show its decimal sign; '0,5,0,25,1,0' has none but commas: where commas"),
        ("a.csv", b"x,y,z\n0,5,0,25,1,0\n", r"line 2 must hold 3 cells as the first one does; got 6: .*: where commas are decimal"),
        ("a.csv", b"0.5,0.25,1\n1,5,0,25,2\n", r"line 2 must hold 3 cells as the first one does; got 5"),
        ("a.xyz", b"\x89PNG\r\n\xff", r"'a\.xyz' must be a text of numbers, x y z \(mm\), in UTF-8"),
        ("a.csv", b"# nothing\n", r"'a\.csv' must hold points, a line x y z each \(mm\); got none"),
        ("a.csv", b"x,y,height\n1,2,3\n", r"'a\.csv' must have columns x, y and z, each once, or numbers only"),
        ("a.csv", b"x,y,z [s]\n1,2,3\n", r"'a\.csv', column z must have a unit like mm .*; got 's'"),
        ("a.csv", b"1,2,3\n4,nan,6\n", r"'a\.csv'\[4\] must be finite \(mm\); got nan"),
        ("a.npy", b"\x93NUMPY\x01\x00", r"'a\.npy' must be an array of NumPy, whole; got"),
        ("a.npy", b"1 2 3", r"'a\.npy' must be an array of NumPy, whole; got"),
        ("a.step", b"", r"path must be a scan, \.stl, \.ply, \.obj, \.xyz, \.csv, \.npy; got 'a\.step'"),
        ("a.xyz", b"0 0 0\n0.1 0 0\n0 0.1 0\n", r"must be in mm where no unit is given; it is 0\.141 mm across\. In metres or inches\?.*unit=.m"),
        ("a.xyz", b"0 0 0\n10 0 0\n0 10 0\n", r"points must be no fewer than the control points"),
    ],
)  # fmt: skip
def test_files_that_are_refused(tmp_path, name, data, message):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=message):
        read_scan(tmp_path / name)


def of_unit(text, factor):
    """Points of a table in another unit."""
    return "\n".join(" ".join(repr(float(x) / factor) for x in row) for row in text)


@pytest.mark.parametrize(("unit", "factor"), [("m", 1000.0), ("in", 25.4), ("cm", 10.0), (None, 1.0)])
def test_scans_in_a_unit_that_is_given(tmp_path, unit, factor):
    (tmp_path / "a.xyz").write_text(of_unit(POINTS, factor), encoding="utf-8")
    np.save(tmp_path / "a.npy", POINTS / factor)
    corners, faces = block(5)
    written(tmp_path / "a.ply", corners[:25] / factor, faces[:32])
    wanted = {"a.xyz": POINTS, "a.npy": POINTS, "a.ply": corners[:25]}
    for name, points in wanted.items():
        (found,) = read_scan(tmp_path / name, unit=unit)
        assert found.surface.area == pytest.approx(Surface.fit(points).area, rel=1e-5)


def test_whole_numbers_with_names_are_no_decimals(tmp_path):
    rows = [f"{x},{y},{x + y},255,0,0" for x in range(5) for y in range(5)]
    (tmp_path / "a.csv").write_text("x,y,z,r,g,b\n" + "\n".join(rows), encoding="utf-8")
    assert read_scan(tmp_path / "a.csv")[0].surface.fit.error < 1e-9


@pytest.mark.parametrize(
    ("unit", "message"),
    [
        ("s", r"unit: numbers of a scan must have a unit like mm \(.*; got 's'"),
        ("mil", r"'mil' may mean several units"),
        ("in", r"unit must be None, as 'a\.csv' names its own; got 'in'"),
    ],
)
def test_units_that_are_refused(tmp_path, unit, message):
    (tmp_path / "a.csv").write_text("x (mm),y,z\n1,2,3\n", encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_scan(tmp_path / "a.csv", unit=unit)


def test_a_small_part_has_its_unit_given(tmp_path):
    np.save(tmp_path / "a.npy", POINTS / 100.0)
    with pytest.raises(ValueError, match=r"a part so small: unit=\"mm\""):
        read_scan(tmp_path / "a.npy")
    assert read_scan(tmp_path / "a.npy", unit="mm")[0].surface.area > 0.05


def test_an_array_of_objects_is_not_unpickled(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}], dtype=object))
    with pytest.raises(ValueError, match="must be an array of NumPy"):
        read_scan(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", np.zeros((5, 2)))
    with pytest.raises(ValueError, match=r"'b\.npy' must be of shape \(m, 3\) \(mm\); got \(5, 2\)"):
        read_scan(tmp_path / "b.npy")


@pytest.mark.parametrize(
    ("region", "message"),
    [
        (None, r"points must be a sheet over their plane.*Region\(box="),
        (TOP.replace(seed=(100.0, 0.0, 0.0)), r"seed must be on the scan \(mm\), its nearest triangle is 50 mm away; got \[100"),
        (Region(box=((90.0, 0.0, 0.0), (99.0, 9.0, 9.0))), r"box must be around part of 'a\.stl', which is within \[\[0\.0"),
    ],
)  # fmt: skip
def test_regions_that_are_refused(tmp_path, region, message):
    path = written(tmp_path / "a.stl", *block())
    with pytest.raises(ValueError, match=message):
        read_scan(path, region)


def test_a_region_is_one(tmp_path):
    path = written(tmp_path / "a.stl", *block(5))
    with pytest.raises(TypeError, match="region must be a Region"):
        read_scan(path, [(0.0, 0.0, 0.0)])


def test_points_have_no_seed(tmp_path):
    np.save(tmp_path / "a.npy", POINTS)
    with pytest.raises(
        ValueError, match=r"region must be a box, Region\(box=\.\.\.\): 'a\.npy' holds points"
    ):
        read_scan(tmp_path / "a.npy", TOP)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, r"a region must have a box or a seed \(mm\); got neither"),
        ({"seed": (1.0, 2.0)}, r"seed must be a point, three numbers \(mm\)"),
        ({"box": (1.0, 2.0)}, r"box must be two corners, \(2, 3\) \(mm\)"),
        ({"box": ((0, 0, 0), (1, -1, 1))}, r"box must be two corners, all of the first less"),
        ({"seed": (0, 0, np.inf)}, r"seed\[2\] must be finite"),
        ({"seed": (0, 0, 0), "crease": 30.0}, r"crease must be .*; got 30"),
        ({"seed": (0, 0, 0), "crease": 0.0}, "crease must be"),
        ({"seed": (0, 0, 0), "empty_max": 1.5}, r"empty_max must be in \(0, 1\]"),
    ],
)  # fmt: skip
def test_regions_are_checked(fields, message):
    with pytest.raises(ValueError, match=message):
        Region(**fields)


def test_regions_are_compared_by_value():
    assert TOP.replace() == TOP and hash(TOP) == hash(TOP.replace()) and TOP.replace(crease=0.4) != TOP


def test_the_extra_that_is_missing_is_named(tmp_path, monkeypatch):
    path = written(tmp_path / "a.stl", *block(5))
    real = importlib.import_module

    def missing(name, *more):
        if name == "trimesh":
            raise ImportError(name)
        return real(name, *more)

    monkeypatch.setattr("sdpgrind.base.extras.import_module", missing)
    with pytest.raises(ImportError, match=r"trimesh is not installed: pip install 'sdpgrind\[cad\]'"):
        read_scan(path, TOP)
    np.save(tmp_path / "a.npy", POINTS)
    assert read_scan(tmp_path / "a.npy")[0].surface.fit.error < 1e-9


def test_every_kind_is_tried():
    assert set(SCANS) == {".stl", ".ply", ".obj", ".xyz", ".csv", ".npy"}
