"""Faces swept by each kind of profile, from texts written by hand: areas, places, sides, and refusals."""

import re

import numpy as np
import pytest
from step_areas import integral
from swept_texts import (
    ELLIPSE,
    INCH,
    PROFILES,
    arc,
    by_pcurves,
    closed_spline,
    extruded,
    revolved,
    revolved_whole,
    straight,
    trimmed,
)

from sdpgrind.finishing import read_surfaces

AREA = 1e-4  # relative; source: the requirements
EXACT = 1e-9  # mm; source: the requirements
WAY = np.array([1.0, 5.0, 2.0])


@pytest.fixture
def face(tmp_path):
    def of(text):
        file = tmp_path / "part.step"
        file.write_text(text)
        (patch,) = read_surfaces(file)
        return patch

    return of


def grid(patch):
    """Places and normals of a grid."""
    u, v = (np.linspace(*ends, 13) for ends in patch.surface.domain)
    return patch.surface.grid(u, v).point, patch.surface.normal(*np.meshgrid(u, v, indexing="ij"))


@pytest.mark.parametrize("name", PROFILES)
def test_extruded(face, name):
    """Any place less its way along the direction is on the profile; the area is that of |C' x D|."""
    profile = PROFILES[name]
    patch = face(extruded(profile))
    points, normals = grid(patch)
    there = points - points[..., 1:2] / WAY[1] * WAY
    assert not patch.trim
    assert np.abs(profile.off(there[..., 0], there[..., 2])).max() <= EXACT
    assert points[..., 1].min() == pytest.approx(0, abs=EXACT) and points[..., 1].max() == pytest.approx(5)
    told = integral(lambda t: np.linalg.norm(np.cross(profile.rate(t), WAY)), *profile.ends)
    assert patch.area == pytest.approx(told, rel=AREA)
    first = np.cross(profile.rate(profile.ends[0]), WAY)
    assert normals[0, 0] @ first == pytest.approx(np.linalg.norm(first), rel=1e-6)


@pytest.mark.parametrize("name", PROFILES)
def test_revolved(face, name):
    """Distance from the axis and height of any place are on the profile; Pappus gives the area."""
    profile = PROFILES[name]
    patch = face(revolved(profile))
    points, normals = grid(patch)
    away = np.hypot(points[..., 0], points[..., 1])
    assert not patch.trim and np.abs(profile.off(away, points[..., 2])).max() <= EXACT
    assert np.abs(points[0] - points[-1]).max() <= EXACT
    told = 2 * np.pi * integral(lambda t: profile.at(t)[0] * np.linalg.norm(profile.rate(t)), *profile.ends)
    assert patch.area == pytest.approx(told, rel=AREA)
    first = np.cross([0, 1, 0], profile.rate(profile.ends[0]))
    assert np.abs(normals[0, 0] @ first) == pytest.approx(np.linalg.norm(first), rel=1e-6)
    assert normals[0, 0] @ first > 0


def test_a_closed_spline_over_its_seam(face):
    """The part's parameters are those of the file, those past the seam a period more."""
    profile = closed_spline()
    patch = face(extruded(profile))
    (u0, u1), (v0, _) = patch.surface.domain
    u = np.linspace(u0, u1, 21)
    own = np.array([profile.at(t) for t in u]) + v0 * WAY / np.linalg.norm(WAY)
    assert (u0, u1) == pytest.approx((1.5, 2.5)) and not patch.trim
    assert np.abs(patch.surface.point(u, v0) - own).max() <= EXACT


def test_a_line_askew_sweeps_a_hyperboloid(face):
    line = straight((1, 2, 2), start=(12.0, 0.0, 0.0))
    patch = face(revolved(line))
    points, _ = grid(patch)
    height = points[..., 2]
    squared = (12 + height / 2) ** 2 + height**2  # x and y of the line at a height z
    assert np.abs(np.hypot(points[..., 0], points[..., 1]) - np.sqrt(squared)).max() <= EXACT

    def ring(t):
        return np.linalg.norm(np.cross(np.cross([0, 0, 1], line.at(t)), line.rate(t)))

    assert patch.area == pytest.approx(2 * np.pi * integral(ring, *line.ends), rel=AREA)


def test_a_profile_against_its_curve_turns_the_face(face):
    """The same loop on a surface whose profile runs the other way: the other side is outward."""
    against = trimmed(ELLIPSE, (150.0, 10.0), ".F.")
    points, normals = grid(face(extruded(ELLIPSE, basis=against)))
    there = points - points[..., 1:2] / WAY[1] * WAY
    first = np.cross(ELLIPSE.rate(ELLIPSE.ends[0]), WAY)
    lowest = np.linalg.norm(points - ELLIPSE.at(ELLIPSE.ends[0]), axis=-1).argmin()
    assert np.abs(ELLIPSE.off(there[..., 0], there[..., 2])).max() <= EXACT
    assert normals.reshape(-1, 3)[lowest] @ first == pytest.approx(-np.linalg.norm(first), rel=1e-6)


def test_half_a_circle_around_its_diameter_is_a_ball(face):
    half = trimmed(arc("CIRCLE", 6.0, 6.0, (-np.pi / 2, np.pi / 2)), (-90.0, 90.0), ".T.")
    text = revolved_whole(half).replace("(20.0,0.0,0.0)", "(0.0,0.0,0.0)")
    patch = face(text)
    assert patch.area == pytest.approx(4 * np.pi * 36, rel=1e-9)
    assert np.abs(np.linalg.norm(grid(patch)[0], axis=-1) - 6).max() <= EXACT


def test_in_inches(face):
    for text in (extruded(PROFILES["trimmed"]), revolved(PROFILES["trimmed line"])):
        large = re.sub(r"#3 = .*;", f"#3 = {INCH};", text)
        assert face(large).area == pytest.approx(25.4**2 * face(text).area, rel=AREA)


def cylinder(lines):
    frame = lines.frame((0, 0, 0), (0, 0, 1), (1, 0, 0))
    return lines.add(f"CYLINDRICAL_SURFACE('',{frame},2.0)")


def on_cylinder(u, v):
    return 2 * np.cos(np.deg2rad(u)), 2 * np.sin(np.deg2rad(u)), v


def slab(lines):
    """A line told in steps of 2 inches, moved in steps of 3 inches."""
    foot = lines.line((0, 0, 0), (1, 0, 0), 2.0)
    return lines.add(f"SURFACE_OF_LINEAR_EXTRUSION('',{foot},{lines.vector((0, 0, 1), 3.0)})")


def wheel(lines):
    """A circle of 1 inch, 5 inches from the z axis."""
    circle = lines.conic("CIRCLE", (5, 0, 0), (0, -1, 0), 1.0)
    axis = lines.add(f"AXIS1_PLACEMENT('',{lines.point((0, 0, 0))},{lines.direction((0, 0, 1))})")
    return lines.add(f"SURFACE_OF_REVOLUTION('',{circle},{axis})")


def on_wheel(u, v):
    away = 5 + np.cos(np.deg2rad(v))
    return away * np.cos(np.deg2rad(u)), away * np.sin(np.deg2rad(u)), np.sin(np.deg2rad(v))


@pytest.mark.parametrize(
    ("surface", "box", "at", "told"),
    [
        (cylinder, ((350, 0), (400, 5)), on_cylinder, 2 * np.deg2rad(50) * 5),
        (slab, ((1, 1), (3, 2)), lambda u, v: (2 * u, 0, 3 * v), 4 * 3),
        (wheel, ((-20, 330), (100, 390)), on_wheel, np.deg2rad(120) * (5 * np.pi / 3 + 1)),
    ],
)
def test_parameters_of_pcurves_have_units(face, surface, box, at, told):
    """Degrees, inches and the lengths of vectors, across the seams; the wheel by Pappus, sin 30 deg = 1/2."""
    (u0, v0), (u1, v1) = box
    patch = face(by_pcurves(surface, [(u0, v0), (u1, v0), (u1, v1), (u0, v1)], at))
    assert not patch.trim and patch.area == pytest.approx(25.4**2 * told, rel=AREA)


@pytest.mark.parametrize("curve", ["CIRCLE", "ELLIPSE"])
def test_a_closed_pcurve(face, curve):
    radii = (0.4,) if curve == "CIRCLE" else (0.4, 0.2)

    def flat(lines):
        frame = lines.frame((1.5, 1.5), (1, 0))
        return lines.add(f"{curve}('',{frame},{','.join(map(repr, radii))})")

    patch = face(by_pcurves(slab, [(1.9, 1.5)], lambda u, v: (2 * u, 0, 3 * v), curve=flat))
    assert patch.area == pytest.approx(6 * np.pi * radii[0] * radii[-1] * 25.4**2, rel=AREA)


WHOLE_CIRCLE = arc("CIRCLE", 6.0, 6.0, (0.0, 1.0))
LEVEL_LINE = straight((1, 0, 0))
REFUSED = {
    "profile": (
        re.sub(r"\n(#\d+) = ELLIPSE\(", r"\n\1 = HYPERBOLA(", extruded(PROFILES["line"], basis=ELLIPSE)),
        "HYPERBOLA is not read as a profile; export the face as B-spline; no face of the file is read",
    ),
    "unbounded": (
        revolved_whole(straight((0, 0, 1))),
        "#10 SURFACE_OF_REVOLUTION must have loops that bound it",
    ),
    "across the axis": (
        revolved_whole(WHOLE_CIRCLE).replace("(20.0,0.0,0.0)", "(0.0,0.0,0.0)"),
        "#10 SURFACE_OF_REVOLUTION must have a profile on one side of its axis; trim the profile there",
    ),
    "level": (
        revolved_whole(LEVEL_LINE),
        "#10 SURFACE_OF_REVOLUTION must have a profile on one side of its axis; trim the profile there",
    ),
    "along itself": (extruded(LEVEL_LINE, way=(2.0, 0.0, 0.0)), "must move its line aside, not along itself"),
    "radius": (revolved(PROFILES["ellipse"]).replace("6.0,3.0", "6.0,-3.0"), "must have radii > 0; got 6 and -3 mm"),
    "no angle": (
        extruded(PROFILES["trimmed"]).replace("((#3,#5))", "((#3))"),
        "has an angle, and the file names no unit of angles; a unit is never guessed",
    ),
    "trim": (
        extruded(PROFILES["trimmed line"]).replace("(PARAMETER_VALUE(5.0))", "(PARAMETER_VALUE(-1.0))"),
        "must run along its curve from its first end to its second",
    ),
    "no trim": (
        extruded(PROFILES["trimmed line"]).replace("(PARAMETER_VALUE(5.0))", "$"),
        "must have a point or a parameter as value 4",
    ),
    "away": (
        extruded(PROFILES["circle"], basis=ELLIPSE),
        "EDGE_CURVE must lie on the surface of its face",
    ),
    "pcurve without angle": (
        by_pcurves(cylinder, [(0, 0), (50, 0), (50, 5), (0, 5)], on_cylinder).replace("((#3,#5))", "((#3))"),
        "PCURVE has an angle, and the file names no unit of angles; a unit is never guessed",
    ),
    "pcurve on another surface": (
        re.sub(r"PCURVE\('',#\d+", "PCURVE('',#3", by_pcurves(slab, [(0, 0), (1, 0), (1, 1)], lambda u, v: (u, 0, v))),
        "PCURVE is not read; export the edge as B-spline curve",
    ),
    "around twice": (
        by_pcurves(wheel, [(0, 330), (400, 350), (400, 390), (0, 370)], on_wheel),
        "ADVANCED_FACE must not go around its surface more than once; split the face there",
    ),
    "itself": (
        re.sub(r"(#\d+) = TRIMMED_CURVE\('',#\d+", r"\1 = TRIMMED_CURVE('',\1", extruded(PROFILES["line"], basis=PROFILES["trimmed"])),
        "must not stand on itself",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused(face, name):
    text, words = REFUSED[name]
    with pytest.raises(ValueError, match=re.escape(words)) as caught:
        face(text)
    assert re.search(r"#\d+ [A-Z_]+", str(caught.value))
