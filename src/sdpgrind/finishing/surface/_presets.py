"""Ready-made surfaces: nominal die, plain shapes in closed form, and some with uneven parameters."""

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import another_unit
from sdpgrind.finishing.surface._control_net import clamped
from sdpgrind.finishing.surface._surface import Surface

# Control points of a quarter of the unit circle as a rational parabola, and their weights.
QUARTER = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
QUARTER_WEIGHTS = np.array([1.0, np.sqrt(0.5), 1.0])

_USUAL, _TYPICAL = (0.5, 2e4), 50.0  # mm, chosen: a smaller or greater work is in metres or micrometres


def _size(name: str, value: float) -> float:
    """Check a size of a work, mm."""
    size = checks.positive(name, value, "mm")
    if not _USUAL[0] <= size <= _USUAL[1]:
        raise ValueError(another_unit(name, value, "mm", _USUAL, _TYPICAL))
    return size


def nominal_surface() -> Surface:
    """Return the nominal die surface: 50 mm by 50 mm, one ridge 10 mm high that falls along v.

    Chosen here, as the source's figures 3 and 4 give no numbers: bicubic, 6 by 6 control points over the
    Greville abscissae g of clamped uniform knots, x = 50 g_i, y = 50 g_j, z = 10 sin(pi g_i) cos(1.5 g_j) mm.

    Examples
    --------
    >>> die = nominal_surface()
    >>> round(die.area, 4), die.point(0.5, 0.5).round(6).tolist()
    (2604.076, [25.0, 25.0, 5.856271])
    """
    g = greville(6, 3)
    return _over(50.0 * g, 50.0 * g, 10.0 * np.outer(np.sin(np.pi * g), np.cos(1.5 * g)))


def flat_surface(side: float = 50.0) -> Surface:
    """Return a flat square in the plane z = 0, with (u, v) in the unit square.

    Parameters
    ----------
    side : float
        Side, mm.

    Raises
    ------
    ValueError
        When the side is not > 0, or beyond all that is finished (0.5 mm to 20 m).

    Examples
    --------
    >>> flat_surface(20.0).area
    400.0
    """
    ends = np.array([0.0, _size("side", side)])
    return _over(ends, ends, np.zeros((2, 2)), degree=(1, 1))


def cylinder_surface(radius: float, length: float, *, inside: bool = False) -> Surface:
    """Return a quarter of a cylinder about the y axis, exactly: u along it, v around it from x to z axis.

    Parameters
    ----------
    radius, length : float
        Radius and length, mm.
    inside : bool
        Whether the tool works on the inside, where the surface curves towards it.

    Raises
    ------
    ValueError
        When one is not > 0, or beyond all that is finished (0.5 mm to 20 m).

    Examples
    --------
    >>> groove = cylinder_surface(20.0, 50.0, inside=True)
    >>> round(float(groove.mean_curvature(0.5, 0.5)), 12)  # 1/mm
    0.025
    """
    radius, length = _size("radius", radius), _size("length", length)
    x, z = radius * QUARTER.T
    net = [np.stack([x, np.full(3, y), z], axis=-1) for y in (0.0, length)]
    return Surface.nurbs(net, [QUARTER_WEIGHTS] * 2, degree=(1, 2), outward=-1 if inside else 1)


def sphere_surface(radius: float, *, inside: bool = False) -> Surface:
    """Return an eighth of a sphere, exactly: u around the z axis, v from the equator to the pole.

    Parameters
    ----------
    radius : float
        Radius, mm.
    inside : bool
        Whether the tool works on the inside, where the surface curves towards it.

    Raises
    ------
    ValueError
        When it is not > 0, or beyond all that is finished (0.5 mm to 20 m).

    Examples
    --------
    >>> ball = sphere_surface(20.0)
    >>> ball.normal(0.3, 1.0).round(12) + 0.0  # at the pole, where an edge is one point
    array([0., 0., 1.])
    """
    radius = _size("radius", radius)
    across, up = QUARTER.T
    net = np.stack([np.outer(x, across) for x in QUARTER.T] + [np.broadcast_to(up, (3, 3))], axis=-1)
    weights = np.outer(QUARTER_WEIGHTS, QUARTER_WEIGHTS)
    return Surface.nurbs(radius * net, weights, degree=(2, 2), outward=-1 if inside else 1)


def uneven_surfaces() -> dict[str, Surface]:
    """Return surfaces of 50 mm by 50 mm whose area density sqrt(EG - F^2) varies strongly, as tests of maps.

    ``"crowded"``: the nominal ridge with its control points drawn together in one corner. ``"steep"``: a wall
    24 mm high across the middle, and uneven knots. ``"weighted"``: the nominal ridge with a weight of 16 on
    the four control points in the middle, which draw the parameters there.

    Examples
    --------
    >>> {name: round(surface.area) for name, surface in uneven_surfaces().items()}  # mm^2
    {'crowded': 2612, 'steep': 3050, 'weighted': 2612}
    >>> at = np.linspace(0.0, 1.0, 101)
    >>> densities = {name: each.area_density(at[:, None], at) for name, each in uneven_surfaces().items()}
    >>> {name: int(each.max() / each.min()) for name, each in densities.items()}
    {'crowded': 230, 'steep': 53, 'weighted': 13}
    """
    return {"crowded": _crowded(), "steep": _steep(), "weighted": _weighted()}


def _crowded() -> Surface:
    g = greville(8, 3)
    near = 0.15 * g + 0.85 * g**3
    return _over(50.0 * near, 50.0 * near, 10.0 * np.outer(np.sin(np.pi * near), np.cos(1.5 * near)))


def _steep() -> Surface:
    inner = np.array([0.1, 0.15, 0.5, 0.8])
    knots = np.concatenate([np.zeros(4), inner, np.ones(4)])
    side = np.linspace(0.0, 50.0, 8)
    return _over(side, side, 12.0 * np.tanh((side[:, None] + 0.5 * side - 37.5) / 6.0), knots=(knots, knots))


def _weighted() -> Surface:
    weights = np.ones((6, 6))
    weights[2:4, 2:4] = 16.0
    return Surface.nurbs(nominal_surface().control_points, weights)


def _over(
    x: Floats,
    y: Floats,
    z: Floats,
    degree: tuple[int, int] = (3, 3),
    knots: tuple[Floats, Floats] | None = None,
) -> Surface:
    """Surface of heights z (nu, nv) over a net of x (nu,) and y (nv,)."""
    x, y = np.meshgrid(x, y, indexing="ij")
    return Surface.bspline(np.stack([x, y, z], axis=-1), degree, knots)


def greville(n: int, degree: int) -> Floats:
    """Greville abscissae, means of `degree` clamped uniform knots; control points there run evenly."""
    knots = clamped(n, degree)
    return np.array([knots[i + 1 : i + degree + 1].mean() for i in range(n)])
