"""Write the STEP files beside this script with the Open CASCADE kernel of gmsh 4.15 (``pip install gmsh``).

Tests read the files and never run this. Names of authors and times are taken out. Inch, metre, placements of
the assembly and the file without PCURVEs are changes of the text: gmsh writes neither.
"""

import re
from pathlib import Path

import gmsh
import numpy as np

HERE = Path(__file__).parent


def clamped(count, degree):
    inner = np.linspace(0.0, 1.0, count - degree + 1)
    return np.concatenate([np.zeros(degree), inner, np.ones(degree)])


def nominal_net():
    """Control points of ``nominal_surface`` by the formula of its docstring."""
    knots = clamped(6, 3)
    g = np.array([knots[k + 1 : k + 4].mean() for k in range(6)])
    z = 10.0 * np.outer(np.sin(np.pi * g), np.cos(1.5 * g))
    return np.stack([*np.meshgrid(50.0 * g, 50.0 * g, indexing="ij"), z], axis=-1)


def wavy_net():
    """7 by 5 control points of a wavy surface over 60 mm by 40 mm."""
    i, j = np.meshgrid(np.arange(7.0), np.arange(5.0), indexing="ij")
    return np.stack([10.0 * i, 10.0 * j, 3.0 * np.sin(i) * np.cos(0.8 * j)], axis=-1)


def barrel_net():
    """A quarter of a barrel around the z axis: rational along u, round; (net, weights)."""
    arc, height = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([0.0, 10.0, 20.0, 30.0])
    radius = np.array([12.0, 16.0, 16.0, 12.0])
    net = np.stack([np.append(radius[k] * xy, height[k]) for xy in arc for k in range(4)]).reshape(3, 4, 3)
    return net, np.repeat([[1.0], [0.5**0.5], [1.0]], 4, axis=1)


def spline(net, degree, weights=None):
    """Add a B-spline surface and return its tag."""
    occ, (nu, nv) = gmsh.model.occ, net.shape[:2]
    tags = [occ.addPoint(*net[i, j]) for j in range(nv) for i in range(nu)]
    told = [] if weights is None else [weights[i, j] for j in range(nv) for i in range(nu)]
    ends = [np.unique(clamped(n, p), return_counts=True) for n, p in zip((nu, nv), degree, strict=True)]
    knots = {"knotsU": ends[0][0], "multiplicitiesU": ends[0][1]}
    knots |= {"knotsV": ends[1][0], "multiplicitiesV": ends[1][1]}
    return occ.addBSplineSurface(tags, nu, degreeU=degree[0], degreeV=degree[1], weights=told, **knots)


def write(name, *, change=None):
    """Write the model, its text without author and time, and begin a new one."""
    gmsh.model.occ.synchronize()
    gmsh.model.occ.remove(gmsh.model.occ.getEntities(0))
    gmsh.model.occ.synchronize()
    file = HERE / f"{name}.step"
    gmsh.write(str(file))
    text = re.sub(
        r"FILE_NAME\(.*?\);", f"FILE_NAME('{name}','',(''),(''),'','','');", file.read_text(), flags=re.S
    )
    file.write_text(text if change is None else change(text))
    gmsh.clear()


def cut(surface, *tools):
    gmsh.model.occ.cut([(2, surface)], [(3, tool) for tool in tools])


def nominal(name, *, change=None):
    write_tools = gmsh.model.occ
    surface = spline(nominal_net(), (3, 3))
    cut(surface, write_tools.addCylinder(25, 25, -20, 0, 0, 60, 8))
    write(name, change=change)


def in_unit(length, scale, unit):
    """Change of a text: another unit of length, and points, radii by `scale`."""

    def change(text):
        lines = re.sub(
            r"\(\s*LENGTH_UNIT\(\) NAMED_UNIT\(\*\) SI_UNIT\(\.MILLI\.,\.METRE\.\)\s*\)", unit, text
        )
        lines = re.sub(
            r"(CARTESIAN_POINT\(\s*'',\s*\(\s*)(-?[\d.E+-]+,\s*-?[\d.E+-]+,\s*-?[\d.E+-]+)\s*\)",
            scaled(scale),
            lines,
        )
        return re.sub(
            r"((?:CIRCLE|CYLINDRICAL_SURFACE|SPHERICAL_SURFACE)\('',#\d+,)([\d.E+-]+)", one(scale), lines
        )

    return change


def scaled(scale):
    return lambda found: found[1] + ",".join(f"{float(x) * scale!r}" for x in found[2].split(",")) + ")"


def one(scale):
    return lambda found: found[1] + f"{float(found[2]) * scale!r}"


def without_pcurves(text):
    """Edges by their 3-D curves alone."""
    text = re.sub(r"#\d+ = (PCURVE|DEFINITIONAL_REPRESENTATION)\(.*?\);\n", "", text, flags=re.S)
    for number, curve in re.findall(r"#(\d+) = (?:SURFACE|SEAM)_CURVE\('',#(\d+),.*?\);\n", text, flags=re.S):
        text = re.sub(rf"#{number} = (?:SURFACE|SEAM)_CURVE\(.*?\);\n", "", text, flags=re.S)
        text = re.sub(rf"(EDGE_CURVE\('',#\d+,#\d+,)#{number},", rf"\g<1>#{curve},", text)
    return text


def placed(text):
    """The second part moved by (40, 0, 5) and turned by 90 degrees about z, the third moved by (0, 50, 0)."""
    first = re.search(r"#10 = SHAPE_REPRESENTATION\('',\(([^)]*)\)", text)[1].replace("\n", "").split(",")
    for item, point, x in ((first[2], "(40.,0.,5.)", "(0.,1.,0.)"), (first[3], "(0.,50.,0.)", "(1.,0.,0.)")):
        parts = re.search(rf"{item} = AXIS2_PLACEMENT_3D\('',(#\d+),(#\d+),(#\d+)\)", text.replace("\n", ""))
        text = re.sub(
            rf"{parts[1]} = CARTESIAN_POINT\('',.*?\);", f"{parts[1]} = CARTESIAN_POINT('',{point});", text
        )
        text = re.sub(rf"{parts[3]} = DIRECTION\('',.*?\);", f"{parts[3]} = DIRECTION('',{x});", text)
    return text


def swept():
    """Sheets and a solid whose faces are profiles moved along a line or turned around an axis."""
    occ = gmsh.model.occ
    wave = points((0, 0, 0), (10, 0, 6), (20, 0, -3), (30, 0, 4), (40, 0, 0))
    cut(sheet(occ.extrude([(1, occ.addBSpline(wave))], 3, 30, 0)), occ.addCylinder(20, 15, -20, 0, 0, 40, 5))
    write("extruded_hole")
    foot = occ.addPlaneSurface([occ.addWire([occ.addEllipse(0, 0, 0, 12, 7)])])
    block = next(tag for kind, tag in occ.extrude([(2, foot)], 0, 0, 20) if kind == 3)
    occ.cut([(3, block)], [(3, occ.addBox(5, -3, 5, 20, 6, 8))])
    write("ellipse_notch")
    vase = occ.addBSpline(points((12, 0, 0), (16, 0, 10), (9, 0, 20), (13, 0, 30)))
    cut(sheet(turned(vase, 2 * np.pi)), occ.addCylinder(0, 0, 15, 20, 20, 0, 4))
    write("revolved_hole")
    turned(occ.addBSpline(points((0, 0, 0), (8, 0, 0.5), (14, 0, 6), (15, 0, 15))), 2 * np.pi)
    write("bowl")
    turned(occ.addEllipse(20, 0, 0, 6, 3, angle1=0.3, angle2=2.5, zAxis=[0, 1, 0], xAxis=[1, 0, 0]), 2.0)
    write("ellipse_ring")


def points(*places):
    return [gmsh.model.occ.addPoint(*place) for place in places]


def sheet(found):
    return next(tag for kind, tag in found if kind == 2)


def turned(curve, angle):
    """Turn a curve around the z axis."""
    return gmsh.model.occ.revolve([(1, curve)], 0, 0, 0, 0, 0, 1, angle)


def main():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ

    spline(nominal_net(), (3, 3))
    write("nominal")
    nominal("nominal_hole")
    nominal("nominal_hole_no_pcurves", change=without_pcurves)
    nominal(
        "nominal_hole_inch",
        change=in_unit(
            "inch",
            1 / 25.4,
            "( CONVERSION_BASED_UNIT('INCH',#9001) LENGTH_UNIT() NAMED_UNIT(#9002) );\n"
            "#9001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9003);\n#9002 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
            "#9003 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )",
        ),
    )
    cut(spline(nominal_net(), (3, 3)), occ.addBox(-5, 20, -20, 20, 12, 60))
    write("notch")
    cut(
        spline(wavy_net(), (3, 2)),
        occ.addCylinder(20, 20, -20, 0, 0, 40, 6),
        occ.addCylinder(42, 18, -20, 0, 0, 40, 4),
    )
    write("two_holes")
    net, weights = barrel_net()
    cut(spline(net, (2, 3), weights), occ.addCylinder(0, 0, 15, 20, 20, 0, 5))
    write("rational")
    rings = [occ.addWire([occ.addCircle(0, 0, z, r)]) for z, r in ((0, 10), (15, 14), (30, 9))]
    occ.addThruSections(rings, makeSolid=False)
    write("seam")
    tools = [occ.addBox(0, 0, 0, 30, 20, 10), occ.addCylinder(15, 10, -1, 0, 0, 12, 4)]
    occ.cut([(3, tools[0])], [(3, tools[1])])
    write("plate_metre", change=in_unit("metre", 1e-3, "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )"))
    occ.addSphere(0, 0, 0, 10), occ.addCone(40, 0, 0, 0, 0, 10, 8, 0), occ.addTorus(80, 0, 0, 10, 3)
    write("round")
    ball, box = occ.addSphere(0, 0, 0, 10), occ.addBox(2, -20, -20, 40, 40, 25)
    occ.cut([(3, ball)], [(3, box)])
    write("cut_ball")
    plate = occ.addBox(0, 0, 0, 30, 20, 10)
    occ.synchronize()
    touching = gmsh.model.getAdjacencies(0, 1)[0]
    occ.fillet([plate], touching, [2.0])
    write("fillets")
    (
        occ.addBox(0, 0, 0, 10, 20, 5),
        occ.addCylinder(0, 0, 0, 0, 0, 12, 5),
        occ.addCone(0, 0, 0, 0, 0, 10, 8, 3),
    )
    write("assembly", change=placed)
    swept()
    gmsh.finalize()


if __name__ == "__main__":
    main()
