"""Small STEP texts: faces of planes and B-splines in a representation with units."""

MILLIMETRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
NODES = ((0, 0, 0), (40, 0, 0), (40, 30, 0), (0, 30, 0))


def step_text(entities, items="#10", unit=MILLIMETRE):
    """Text of a file whose representation #1 holds `items`; `entities` are more lines."""
    lines = [
        "ISO-10303-21;", "HEADER;", "FILE_DESCRIPTION(('a; ''b'''),'2;1');", "FILE_NAME('n','',(''),(''),'','','');",
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));", "ENDSEC;", "DATA;",
        f"#1 = SHAPE_REPRESENTATION('',({items}),#2);",
        "#2 = ( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#3)) REPRESENTATION_CONTEXT('','') );",
        f"#3 = {unit};",
    ]  # fmt: skip
    return "\n".join([*lines, *entities, "ENDSEC;", "END-ISO-10303-21;", ""])


def plate(nodes=NODES, sense=".T.", surface="PLANE('',#12)", closed=True):
    """Lines of a flat face #10 through nodes."""
    count = len(nodes)
    edges = range(count if closed else count - 1)
    lines = [
        f"#10 = ADVANCED_FACE('plate',(#11),#13,{sense});",
        "#11 = FACE_OUTER_BOUND('',#14,.T.);",
        "#12 = AXIS2_PLACEMENT_3D('',#15,$,$);",
        f"#13 = {surface};",
        f"#14 = EDGE_LOOP('',({','.join(f'#{100 + k}' for k in edges)}));",
        "#15 = CARTESIAN_POINT('',(0.,0.,0.));",
    ]
    for k, node in enumerate(nodes):
        lines += [
            f"#{200 + k} = CARTESIAN_POINT('',({','.join(f'{float(x)!r}' for x in node)}));",
            f"#{300 + k} = VERTEX_POINT('',#{200 + k});",
        ]
    for k in edges:
        after = (k + 1) % count
        way = [float(b - a) for a, b in zip(nodes[k], nodes[after], strict=True)]
        lines += [
            f"#{100 + k} = ORIENTED_EDGE('',*,*,#{400 + k},.T.);",
            f"#{400 + k} = EDGE_CURVE('',#{300 + k},#{300 + after},#{500 + k},.T.);",
            f"#{500 + k} = LINE('',#{200 + k},#{600 + k});",
            f"#{600 + k} = VECTOR('',#{700 + k},1.);",
            f"#{700 + k} = DIRECTION('',({way[0]!r},{way[1]!r},{way[2]!r}));",
        ]
    return lines


def saddle(kind="QUASI_UNIFORM_SURFACE", degree=1):
    """Lines of a surface #10 without loops over 3 by 3 points, z = x y / 10 mm, knots implicit."""
    places = [(i, j) for i in range(3) for j in range(3)]
    points = [
        f"#{20 + 3 * i + j} = CARTESIAN_POINT('',({5.0 * i},{5.0 * j},{2.5 * i * j}));" for i, j in places
    ]
    net = ",".join(f"(#{20 + 3 * i},#{21 + 3 * i},#{22 + 3 * i})" for i in range(3))
    return [f"#10 = {kind}('',{degree},{degree},({net}),.UNSPECIFIED.,.F.,.F.,.F.);", *points]
