"""STEP files at the door: what is read however it is written, and what is refused in which words."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from step_texts import NODES, plate, saddle, step_text

from sdpgrind.finishing import Surface, read_surfaces
from sdpgrind.finishing.surface import Patch

PLATE = step_text(plate())
AREA = 1200.0  # mm^2, of the plate


@pytest.fixture
def read(tmp_path):
    def of(text, name="part.step"):
        file = tmp_path / name
        file.write_text(text, encoding="latin-1")
        return read_surfaces(file)

    return of


def test_a_flat_face(read):
    (patch,) = read(PLATE)
    assert patch.area == pytest.approx(AREA, rel=1e-12) and patch.name == "plate" and not patch.trim
    assert patch.surface.normal(1.0, 1.0) == pytest.approx([0, 0, 1])


def test_a_face_against_its_surface_is_turned(read):
    turned = step_text(plate(NODES[::-1], sense=".F."))
    (patch,) = read(turned)
    assert patch.surface.normal(1.0, 1.0) == pytest.approx([0, 0, -1])
    assert patch.area == pytest.approx(AREA, rel=1e-12)


def test_an_outline_with_corners_is_a_polygon(read):
    nodes = [(0, 0, 0), (40, 0, 0), (40, 30, 0), (20, 10, 0), (0, 30, 0)]
    (patch,) = read(step_text(plate(nodes)))
    assert patch.area == pytest.approx(800.0, rel=1e-12) and len(patch.trim) == 1
    assert patch.contains([20.0, 20.0], [9.0, 11.0]).tolist() == [True, False]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(",", "\n,\n").replace("(0.,", "(0.E-06,"),
        lambda text: text.replace("DATA;", "/* ';' \n */ DATA;").replace("'plate'", "'a;b''c /* d'"),
        lambda text: text.replace(" = ", "=").replace("ENDSEC;\nEND", "ENDSEC;\nDATA;\nENDSEC;\nEND"),
        lambda text: text.replace("ADVANCED_FACE", "advanced_face").replace("\n", "\r\n"),
    ],
)
def test_however_it_is_written(read, change):
    (patch,) = read(change(PLATE))
    assert patch.area == pytest.approx(AREA, rel=1e-12)


@pytest.mark.parametrize("name", ["part.STEP", "part.stp", "part.p21"])
def test_by_any_ending(read, name):
    assert len(read(PLATE, name)) == 1


@pytest.mark.parametrize(
    ("unit", "scale"),
    [
        ("( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )", 1000.0),
        ("( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.CENTI.,.METRE.) )", 10.0),
        (
            "( CONVERSION_BASED_UNIT('INCH',#4) LENGTH_UNIT() NAMED_UNIT(*) );\n"
            "#4 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#5);\n"
            "#5 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )",
            25.4,
        ),
    ],
)
def test_units(read, unit, scale):
    small = [tuple(x / 1000 for x in node) for node in NODES]
    (patch,) = read(step_text(plate(small), unit=unit))
    assert patch.area == pytest.approx(AREA * (scale / 1000) ** 2, rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "degree"), [("QUASI_UNIFORM", 1), ("BEZIER", 2), ("UNIFORM", 1), ("BEZIER", 1)]
)
def test_implicit_knots(read, kind, degree):
    """z = x y / 10 is the same surface for each; that of degree 2 in 3 points is one Bezier patch."""
    (patch,) = read(step_text(saddle(f"{kind}_SURFACE", degree)))
    (u0, u1), (v0, v1) = patch.surface.domain
    x, y, z = patch.surface.point(0.3 * u0 + 0.7 * u1, 0.6 * v0 + 0.4 * v1)
    assert (x, y, z) == pytest.approx((7.0, 4.0, 2.8)) and patch.surface.degree == (degree, degree)


def test_a_surface_of_a_file_of_its_own(tmp_path):
    file = tmp_path / "saddle.step"
    file.write_text(step_text(saddle()))
    assert Surface.read(file).point(0.0, 2.0) == pytest.approx([0, 10, 0])
    file.write_text(step_text([*plate(), *saddle()], items="#10,#10").replace("#10 = QUASI", "#900 = QUASI"))
    with pytest.raises(
        ValueError, match=r"path must be a file of one face that is not trimmed; .*; got '2 faces'"
    ):
        Surface.read(file)


def lacking(text, entity):
    return re.sub(rf"#{entity} = .*\n", "", text)


REFUSED = {
    "another format": ("solid cube", "line 1: a STEP file begins with ISO-10303-21; got 'solid'"),
    "empty": ("", "line 1: the file ends before END-ISO-10303-21: it is truncated"),
    "truncated": (PLATE[: PLATE.index("#300")], "line 18: the file ends before END-ISO-10303-21: it is truncated"),
    "string": (PLATE.replace("'plate'", "'plate"), "line 44: a string is not closed"),
    "comment": (PLATE.replace("DATA;", "DATA; /*"), "line 7: a comment is not closed"),
    "comma": (PLATE.replace("(#11),#13", "(#11)#13"), "line 11: a comma or a closing bracket must stand there; got '#13'"),
    "token": (PLATE.replace("#13,", "#13?,"), "line 11: '?,.T.);"),
    "twice": (PLATE.replace("#12 =", "#11 ="), "line 13: #11 is there twice; the first one is in line 12"),
    "dangling": (lacking(PLATE, 12), "#12 is not in the file, but other entities refer to it"),
    "unit": (
        step_text(plate(), unit="( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) )"),
        "REPRESENTATION_CONTEXT must name a unit of length (LENGTH_UNIT); a unit is never guessed",
    ),
    "unit of mass": (PLATE.replace(".METRE.", ".GRAM."), "line 10: #3 SI_UNIT must be in METRE; got .MILLI. .GRAM."),
    "no faces": (step_text([]).replace("#10", ""), "the file must hold faces or surfaces; it has none"),
    "offset": (
        step_text([*plate(surface="OFFSET_SURFACE('',#20,1.,.F.)"), *saddle()[1:]], items="#10"),
        "#13 OFFSET_SURFACE is not read; export it as B-spline; no face of the file is read",
    ),
    "solid": (step_text(["#10 = CSG_SOLID('',$);"]), "#10 CSG_SOLID is not read; export faces with B-spline"),
    "curve": (PLATE.replace("= LINE(", "= HYPERBOLA("), "#500 HYPERBOLA is not read; export the edge as B-spline"),
    "type": (PLATE.replace("PLANE('',#12)", "PLANE('',7.)"), "#13 PLANE must have a reference (#number) as value 2; got '7.0'"),
    "number": (PLATE.replace("(40.0", "('x'"), "CARTESIAN_POINT must have a number as value 2; got 'x'"),
    "flag": (PLATE.replace("#13,.T.", "#13,$"), "#10 ADVANCED_FACE must have .T. or .F. as value 4; got 'None'"),
    "open": (step_text(plate(closed=False)), "#14 EDGE_LOOP must be closed; there is a gap of 0.75 of its extent"),
    "crossing": (
        step_text(plate((NODES[0], NODES[2], NODES[1], NODES[3]))),
        "#10 ADVANCED_FACE has loops that bound no face: trim[0] must ",
    ),
    "away": (
        step_text(plate(((0, 0, 0), (40, 0, 0), (40, 30, 2), (0, 30, 0)))),
        "EDGE_CURVE must lie on the surface of its face; it is 2 mm away",
    ),
    "itself": (
        step_text(["#10 = SHELL_BASED_SURFACE_MODEL('',(#11));", "#11 = OPEN_SHELL('',(#11));"]),
        "#11 OPEN_SHELL must not be a part of itself",
    ),
    "cone": (
        step_text(plate(surface="CONICAL_SURFACE('',#12,5.,0.5)")),
        "#13 CONICAL_SURFACE has an angle, and the file names no unit of angles; a unit is never guessed",
    ),
    "radius": (
        step_text(plate(surface="CYLINDRICAL_SURFACE('',#12,-5.)")),
        "#13 CYLINDRICAL_SURFACE must have a radius > 0; got -5 mm",
    ),
    "net": (step_text(saddle("BEZIER_SURFACE", 3)), "must have more control points than its degree; got 3 and 3"),
    "scaled": (
        step_text(["#10 = MAPPED_ITEM('',#11,#12);", "#11 = REPRESENTATION_MAP(#15,#16);", "#12 = CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,#13,2.,$);",
                   "#13 = CARTESIAN_POINT('',(0.,0.,0.));", "#15 = AXIS2_PLACEMENT_3D('',#13,$,$);", "#16 = SHAPE_REPRESENTATION('',(#15),#2);"]),
        "#12 CARTESIAN_TRANSFORMATION_OPERATOR_3D must be a AXIS2_PLACEMENT_3D",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused(read, name):
    text, words = REFUSED[name]
    with pytest.raises(ValueError, match=re.escape(words)) as caught:
        read(text)
    assert str(caught.value).startswith("path must be a STEP file that can be read; part.step: ")


def test_faces_beside_one_that_is_not_read_are_named(read):
    text = step_text(
        [*plate(), "#800 = ADVANCED_FACE('',(#11),#801,.T.);", "#801 = BOUNDED_SURFACE('');"],
        items="#800,#10",
    )
    with pytest.raises(
        ValueError,
        match=r"#801 BOUNDED_SURFACE is not read; export it as B-spline; 1 of 2 faces are read: #10",
    ):
        read(text)


def test_the_door(tmp_path):
    with pytest.raises(ValueError, match=r"path must be a file of \.step, .*; got 'part\.igs'"):
        read_surfaces("part.igs")
    with pytest.raises(TypeError, match="path must be a path; got 3"):
        read_surfaces(3)
    with pytest.raises(FileNotFoundError):
        read_surfaces(tmp_path / "none.step")
    with pytest.raises(ValueError, match="region must be None for a STEP file"):
        read_surfaces(tmp_path / "none.step", region=3)


EDITS = st.tuples(
    st.integers(0, len(PLATE) - 1),
    st.integers(0, 30),
    st.sampled_from(["", "'", ";", "(", ")", ",", "$", "#11", "0.", "-1E300", ".T.", "/*", "DATA;", "é"]),
)


@settings(max_examples=150)
@given(st.lists(EDITS, min_size=1, max_size=3))
def test_a_mangled_file_is_read_or_refused_by_its_line(tmp_path_factory, edits):
    """Only the clear error, whatever is damaged: a line, or the entity by its number."""
    text = PLATE
    for at, lost, more in edits:
        text = text[:at] + more + text[at + lost :]
    file = tmp_path_factory.mktemp("mangled") / "part.step"
    file.write_text(text, encoding="latin-1")
    try:
        found = read_surfaces(file)
    except ValueError as error:
        told = str(error)
        assert told.startswith("path must be a STEP file that can be read; part.step: ")
        assert re.search(r"line \d|#\d|it has none", told)
    else:
        assert all(isinstance(each, Patch) and np.isfinite(each.area) for each in found)
