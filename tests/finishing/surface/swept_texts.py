"""STEP texts of faces swept by profiles in the plane y = 0: along a direction, or all around the z axis."""

import numpy as np
from step_texts import step_text

ROOT = 0.5**0.5
INCH = (
    "( CONVERSION_BASED_UNIT('INCH',#4) LENGTH_UNIT() NAMED_UNIT(*) );\n"
    "#4 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#8);\n"
    "#8 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
)
DEGREES = (
    "( CONVERSION_BASED_UNIT('DEGREE',#6) NAMED_UNIT(*) PLANE_ANGLE_UNIT() );\n"
    "#6 = PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199432957),#7);\n"
    "#7 = ( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) )"
)


class Lines(list):
    """Lines of a text, numbered from 21 on."""

    def add(self, text):
        self.append(f"#{21 + len(self)} = {text};")
        return f"#{20 + len(self)}"

    def point(self, place):
        return self.add(f"CARTESIAN_POINT('',({','.join(repr(float(x)) for x in place)}))")

    def direction(self, way):
        return self.add(f"DIRECTION('',({','.join(repr(float(x)) for x in way)}))")

    def vector(self, way, length=1.0):
        return self.add(f"VECTOR('',{self.direction(way)},{length})")

    def vertex(self, place):
        return self.add(f"VERTEX_POINT('',{self.point(place)})")

    def line(self, place, way, length=1.0):
        return self.add(f"LINE('',{self.point(place)},{self.vector(way, length)})")

    def frame(self, centre, *ways):
        """A placement in space by its z and x axes, or in a plane by its x axis."""
        place = ",".join([self.point(centre), *(self.direction(way) for way in ways)])
        return self.add(f"AXIS2_PLACEMENT_{len(centre)}D('',{place})")

    def conic(self, kind, centre, axis, *radii):
        frame = self.frame(centre, axis, (1, 0, 0))
        return self.add(f"{kind}('',{frame},{','.join(map(repr, radii))})")

    def spline(self, degree, nodes, shift, knots, weights=None):
        """A B-spline through nodes (x, z), of multiplicities and knots."""
        named = ",".join(self.point(np.array([x, 0, z]) + shift) for x, z in nodes)
        told = f"{degree},({named}),.UNSPECIFIED.,.F.,.F."
        knots = ",".join(f"({','.join(map(repr, each))})" for each in knots) + ",.UNSPECIFIED."
        if weights is None:
            return self.add(f"B_SPLINE_CURVE_WITH_KNOTS('',{told},{knots})")
        rational = f"RATIONAL_B_SPLINE_CURVE(({','.join(map(repr, weights))}))"
        return self.add(
            f"( BOUNDED_CURVE() B_SPLINE_CURVE({told}) B_SPLINE_CURVE_WITH_KNOTS({knots}) CURVE()"
            f" GEOMETRIC_REPRESENTATION_ITEM() {rational} REPRESENTATION_ITEM('') )"
        )

    def edge(self, start, end, curve):
        return self.add(f"EDGE_CURVE('',{start},{end},{curve},.T.)")


class Profile:
    """A curve over its ends: `write` it, moved by a shift; `off` is the distance of places (x, z) from it."""

    def __init__(self, write, at, ends, off):
        self.write, self.at, self.ends, self.off = write, at, ends, off

    def rate(self, t):
        return (self.at(t + 1e-5) - self.at(t - 1e-5)) / 2e-5


def arc(kind, a, b, ends):
    radii = (a,) if kind == "CIRCLE" else (a, b)
    return Profile(
        lambda lines, shift: lines.conic(kind, np.array([20.0, 0, 0]) + shift, (0, -1, 0), *radii),
        lambda t: np.array([20 + a * np.cos(t), 0, b * np.sin(t)]),
        ends,
        lambda x, z: a * (np.hypot((x - 20) / a, z / b) - 1),
    )


def straight(way, start=(12.0, 0.0, 1.0)):
    way = np.array(way) / np.linalg.norm(way)
    normal = np.array([way[2], -way[0]])
    return Profile(
        lambda lines, shift: lines.line(np.array(start) + shift, way, 2.0),
        lambda t: np.array(start) + t * way,
        (0.0, 10.0),
        lambda x, z: normal[0] * (x - start[0]) + normal[1] * (z - start[2]),
    )


def casteljau(nodes, weights, t):
    row = np.column_stack([nodes, np.ones(len(nodes))]) * np.array(weights or np.ones(len(nodes)))[:, None]
    while len(row) > 1:
        row = (1 - t) * row[:-1] + t * row[1:]
    return np.array([row[0, 0], 0, row[0, 1]]) / row[0, 2]


def closed_spline():
    """Two parabolic arcs over t from 0 to 2 that meet at both ends, over the seam; weights differ there."""
    nodes, weights = np.array([[20.0, 0], [26, 4], [20, 8], [14, 4], [20, 0]]), [1.0, 1.0, 2.0, 3.0, 3.0]

    def at(t):
        k = int(t % 2 // 1)
        return casteljau(nodes[2 * k : 2 * k + 3], weights[2 * k : 2 * k + 3], t % 1)

    knots = (3, 2, 3), (0.0, 1.0, 2.0)
    return Profile(lambda lines, shift: lines.spline(2, nodes, shift, knots, weights), at, (1.5, 2.5), None)


def bezier(nodes, weights=None):
    nodes = np.array(nodes, dtype=float)
    degree = len(nodes) - 1

    def write(lines, shift):
        return lines.spline(degree, nodes, shift, ((degree + 1, degree + 1), (0.0, 1.0)), weights)

    def at(t):  # by De Casteljau
        row = (
            np.column_stack([nodes, np.ones(len(nodes))]) * np.array(weights or np.ones(len(nodes)))[:, None]
        )
        while len(row) > 1:
            row = (1 - t) * row[:-1] + t * row[1:]
        return np.array([row[0, 0], 0, row[0, 1]]) / row[0, 2]

    cubic = np.polynomial.Polynomial([12.0, 12.0, -33.0, 22.0])

    def circle(x, z):
        return np.hypot(x - 12, z) - 8

    return Profile(
        write,
        lambda t: casteljau(nodes, weights, t),
        (0.0, 1.0),
        circle if weights else lambda x, z: x - cubic(z / 30),
    )


def trimmed(whole, told, sense):
    """A part of a curve by its values in the file."""
    return Profile(
        lambda lines, shift: lines.add(
            f"TRIMMED_CURVE('',{whole.write(lines, shift)},(PARAMETER_VALUE({told[0]!r})),(PARAMETER_VALUE({told[1]!r})),{sense},.PARAMETER.)"
        ),
        whole.at,
        whole.ends,
        whole.off,
    )


ELLIPSE = arc("ELLIPSE", 6.0, 3.0, (0.3, 2.5))
PROFILES = {
    "line": straight((3, 0, 4)),
    "falling line": straight((1, 0, -2)),
    "circle": arc("CIRCLE", 6.0, 6.0, (0.3, 2.5)),
    "over the seam": arc("CIRCLE", 6.0, 6.0, (5.5, 7.5)),
    "ellipse": ELLIPSE,
    "bezier": bezier([[12, 0], [16, 10], [9, 20], [13, 30]]),
    "rational": bezier([[20, 0], [20, 8], [12, 8]], [2.0, 2 * ROOT, 2.0]),
    "trimmed": trimmed(ELLIPSE, tuple(np.rad2deg((0.3, 2.5)).tolist()), ".T."),
    "trimmed line": trimmed(straight((3, 0, 4)), (0.0, 5.0), ".T."),
}


def face(lines, surface, edges, unit=None):
    """Text of a face #10 on a surface with a loop of (edge, sense)."""
    loop = ",".join(lines.add(f"ORIENTED_EDGE('',*,*,{edge},{sense})") for edge, sense in edges)
    bound = lines.add(f"EDGE_LOOP('',({loop}))")
    bound = lines.add(f"FACE_OUTER_BOUND('',{bound},.T.)")
    return text([*lines, f"#10 = ADVANCED_FACE('swept',({bound}),{surface},.T.);"], unit)


def text(entities, unit=None):
    """Text with degrees as the unit of angles."""
    told = step_text([*entities, f"#5 = {DEGREES};"], **({} if unit is None else {"unit": unit}))
    return told.replace("((#3))", "((#3,#5))")


def extruded(profile, way=(1.0, 5.0, 2.0), basis=None):
    """Text of a face between a profile and the same one moved by `way`; `basis` is swept in its stead."""
    lines, way = Lines(), np.array(way)
    first, last = (profile.at(t) for t in profile.ends)
    a, b, c, d = (lines.vertex(each) for each in (first, last, last + way, first + way))
    foot, top = profile.write(lines, np.zeros(3)), profile.write(lines, way)
    sides = [lines.edge(p, q, lines.line(at, way)) for p, q, at in ((b, c, last), (a, d, first))]
    swept = foot if basis is None else basis.write(lines, np.zeros(3))
    surface = lines.add(f"SURFACE_OF_LINEAR_EXTRUSION('',{swept},{lines.vector(way, 3.0)})")
    edges = [
        (lines.edge(a, b, foot), ".T."),
        (sides[0], ".T."),
        (lines.edge(d, c, top), ".F."),
        (sides[1], ".F."),
    ]
    return face(lines, surface, edges)


def axis(lines):
    place = f"{lines.point((0, 0, 7))},{lines.direction((0, 0, 1))}"
    return lines.add(f"AXIS1_PLACEMENT('',{place})")


def revolved(profile):
    """Text of a face all around the z axis, whose seam is the profile."""
    lines = Lines()
    first, last = (profile.at(t) for t in profile.ends)
    a, b = lines.vertex(first), lines.vertex(last)
    curve = profile.write(lines, np.zeros(3))
    seam = lines.edge(a, b, curve)
    low, high = (
        lines.edge(v, v, lines.conic("CIRCLE", (0, 0, at[2]), (0, 0, 1), float(np.hypot(at[0], at[1]))))
        for v, at in ((a, first), (b, last))
    )
    surface = lines.add(f"SURFACE_OF_REVOLUTION('',{curve},{axis(lines)})")
    return face(lines, surface, [(low, ".T."), (seam, ".T."), (high, ".F."), (seam, ".F.")])


def revolved_whole(profile):
    """Text of a surface of revolution without loops."""
    lines = Lines()
    curve = profile.write(lines, np.zeros(3))
    return text(
        [
            *lines,
            f"#10 = SURFACE_OF_REVOLUTION('',{curve},{axis(more := Lines(lines))});",
            *more[len(lines) :],
        ]
    )


def by_pcurves(surface, corners, at, curve=None):
    """Text in inches and degrees of a face whose edges are PCURVEs between corners (u, v) of the file.

    `at` gives the places of the corners, inches; `curve` stands for all edges, else they are lines.
    """
    lines = Lines()
    sheet = surface(lines)
    nodes = [lines.vertex(at(*corner)) for corner in corners]
    edges = []
    for k, (u, v) in enumerate(corners):
        after = (k + 1) % len(corners)
        way = np.subtract(corners[after], (u, v))
        flat = lines.line((u, v), way) if curve is None else curve(lines)
        inner = lines.add(f"DEFINITIONAL_REPRESENTATION('',({flat}),$)")
        edges.append((lines.edge(nodes[k], nodes[after], lines.add(f"PCURVE('',{sheet},{inner})")), ".T."))
    return face(lines, sheet, edges, unit=INCH)
