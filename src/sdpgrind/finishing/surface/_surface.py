"""A die surface: B-spline or rational B-spline patch."""

import os
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import lasting
from sdpgrind.base.by_name import called
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described
from sdpgrind.finishing.surface import _area as area
from sdpgrind.finishing.surface import _control_net as control_net
from sdpgrind.finishing.surface import _degenerate as degenerate
from sdpgrind.finishing.surface import _evaluation as evaluation
from sdpgrind.finishing.surface import _fitting as fitting
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._class_verb import ClassVerb, leave
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives
from sdpgrind.finishing.surface._fit_quality import FitQuality

Pair = tuple[int, int]
SLACK = 1e-12  # of the domain, chosen: rounding of a parameter beyond its ends
NOT_GIVEN: Any = ()
KnotPair = tuple[npt.ArrayLike, npt.ArrayLike]


def _fit(
    cls: type["Surface"],
    points: npt.ArrayLike,
    net: Pair | None = None,
    degree: Pair = (3, 3),
    tolerance: float = 0.01,
    side: npt.ArrayLike | None = None,
    *,
    empty_max: float = fitting.EMPTY,
) -> "Surface":
    """Return a B-spline surface through scattered points; of the surface, ``fit`` is its `FitQuality`.

    The surface is a sheet over the plane of the points: over the least rectangle there that holds them. The
    net is that of least squares, with the feet of the points sought anew after each solution; a bending term
    of 1e-6 decides where no points lie. Surfaces made from it by `replace` or `moved` have no ``fit``.

    Outliers, as reflections in a scan are, do not take part: points that are farther off than `tolerance`,
    farther than any of so many points with Gaussian noise of the same median, and alone: where three of the
    12 points around are off likewise, it is form; so it is where more than 2 % of all points are outliers.
    ``fit.outliers`` counts those left out.

    Parameters
    ----------
    points : array (m, 3)
        On the surface, mm, in any order.
    net : (int, int), optional
        Control points along the longer side of the rectangle (u) and across (v), whole numbers. Default: as
        few as `tolerance` needs, but no more than help: where a net half as large again brings the points
        less than 10 % nearer, what is left is noise.
    degree : (int, int)
        Degrees along u and v, whole numbers >= 1.
    tolerance : float
        Distance that 99 % of the points are to keep, mm.
    side : array (3,), optional
        Direction towards the tool (dimensionless). Default: upwards, along z.
    empty_max : float
        Greatest share of the rectangle (dimensionless) that may be empty: farther than two knot spans from
        any point, or in a disc without points that is twelve times as wide as is usual between them.

    Raises
    ------
    ValueError
        When points are NaN, fewer than control points, on a line, or not a sheet: a wall of more than 80 deg;
        or when too much of the rectangle is empty.

    Examples
    --------
    >>> at = np.linspace(-20.0, 20.0, 41)  # mm
    >>> x, y = np.meshgrid(at, at)
    >>> scan = np.stack([x, y, 0.01 * x * y + np.cos(x / 10.0)], axis=-1).reshape(-1, 3)
    >>> surface = Surface.fit(scan, tolerance=0.001)
    >>> surface
    Surface(B-spline, 9 x 9 control points over 40 x 40 x 8 mm, degree (3, 3))
    >>> surface.fit.most < 0.001 and surface.fit.rms < 0.0005  # mm
    True
    """
    return fitted_surface(cls, points, net, degree, tolerance, side, empty_max)


def fitted_surface(
    cls: type["Surface"],
    points: npt.ArrayLike,
    net: Pair | None,
    degree: Pair,
    tolerance: float,
    side: npt.ArrayLike | None,
    empty_max: float,
    scattered: bool = True,
) -> "Surface":
    """Fit as `Surface.fit` does; corners of triangles, which may be wide, are not `scattered`."""
    found = fitting.fitted(points, net, degree, tolerance, side, empty_max, scattered)
    made = cls(found.control_points, control_net.degree_pair(degree), found.knots)
    return leave(made, "fit", found.quality)


@described("finishing.surface", eq=False)
class Surface(Described):
    """A surface Q(u, v) of control points and basis functions, rational with weights (Wang, section 3).

    The source's sum runs to n + m + 1 in both directions; here each index runs over its own control points,
    and its k and l are orders, degree + 1. The right end of the domain belongs to the last non-empty knot
    span.

    Parameters
    ----------
    control_points : array (nu, nv, 3)
        B_ij, mm.
    degree : (int, int)
        Degrees along u and v, whole numbers >= 1.
    knots : (array, array)
        Along u and v: nu + degree + 1 and nv + degree + 1 numbers that do not decrease, none more than
        degree + 1 times.
    weights : array (nu, nv), optional
        w_ij > 0 (dimensionless). None: not rational.
    outward : {1, -1}
        Side of the tool: 1, that of Qu x Qv; -1, the other.

    Raises
    ------
    ValueError
        When a value is out of range, or shapes do not fit together.

    Examples
    --------
    A saddle, z = 0.008 x y (mm):

    >>> saddle = Surface.bspline([[[0, 0, 0], [0, 50, 0]], [[50, 0, 0], [50, 50, 20]]], degree=(1, 1))
    >>> saddle.point(0.5, 0.5)
    array([25., 25.,  5.])
    >>> round(float(saddle.gaussian_curvature(0.0, 0.0)), 12)
    -6.4e-05
    >>> round(saddle.area, 6)
    2628.747347
    """

    control_points: Floats = custom(unit="mm")
    degree: Pair = custom(default=NOT_GIVEN)
    knots: tuple[Floats, Floats] = custom(default=NOT_GIVEN)
    weights: Floats | None = custom(default=None)
    outward: int = custom(default=1)

    def _check(self) -> None:
        if self.degree is NOT_GIVEN or self.knots is NOT_GIVEN:
            raise TypeError(
                "degree and knots must be given; Surface.bspline(control_points) gives what is usual for both"
            )
        net = control_net.points(self.control_points)
        degree = control_net.degrees(self.degree, net)
        checked = {
            "control_points": net,
            "degree": degree,
            "knots": control_net.knot_vectors(self.knots, degree, net),
            "weights": control_net.weights(self.weights, net),
            "outward": int(checks.one_of("outward", self.outward, (1, -1))),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @classmethod
    def bspline(
        cls,
        control_points: npt.ArrayLike,
        degree: Pair = (3, 3),
        knots: KnotPair | None = None,
        outward: int = 1,
    ) -> Self:
        """Return a B-spline surface.

        Parameters
        ----------
        control_points, degree, knots, outward
            As of `Surface`, control points in mm. Default of knots: clamped and uniform on [0, 1].

        Examples
        --------
        >>> Surface.bspline([[[i, j, i * j] for j in range(4)] for i in range(5)]).knots[0]
        array([0. , 0. , 0. , 0. , 0.5, 1. , 1. , 1. , 1. ])
        """
        return cls._made(control_points, None, degree, knots, outward)

    @classmethod
    def nurbs(
        cls,
        control_points: npt.ArrayLike,
        weights: npt.ArrayLike,
        degree: Pair = (3, 3),
        knots: KnotPair | None = None,
        outward: int = 1,
    ) -> Self:
        """Return a rational B-spline surface.

        Parameters
        ----------
        control_points, weights, degree, knots, outward
            As of `Surface`, control points in mm. Default of knots: clamped and uniform on [0, 1].

        Examples
        --------
        A quarter of a cylinder of radius 20 mm, exactly:

        >>> arc = [[20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]
        >>> net = [[[x, y, z] for z in (0.0, 50.0)] for x, y in arc]
        >>> quarter = Surface.nurbs(net, [[1, 1], [0.5**0.5, 0.5**0.5], [1, 1]], degree=(2, 1))
        >>> round(float(np.hypot(*quarter.point(0.3, 0.7)[:2])), 12)
        20.0
        """
        if weights is None:
            raise checks.refuse("weights", "given; Surface.bspline makes a surface without", None)
        return cls._made(control_points, weights, degree, knots, outward)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> "Surface":
        """Read the surface of a file with one face that is not trimmed, mm; see `read_surfaces`.

        Parameters
        ----------
        path : str or path
            STEP file.

        Raises
        ------
        ValueError
            When the file cannot be read, has several faces, or trims its face.
        """
        part = called("sdpgrind.finishing.surface._read:read_surfaces", path)
        if len(part) > 1 or part[0].trim:
            told = f"{len(part)} faces" if len(part) > 1 else "a trimmed face"
            rule = "a file of one face that is not trimmed; read_surfaces gives patches"
            raise checks.refuse("path", rule, told)
        found: Surface = part[0].surface
        return found

    @classmethod
    def _made(cls, control_points: Any, weights: Any, degree: Pair, knots: Any, outward: int) -> Self:
        """Return the surface of unchecked values."""
        return cls(control_points, degree, knots, weights, outward)

    fit = ClassVerb(_fit, FitQuality, "this surface was not fitted; Surface.fit(points) returns one that is")

    def __eq__(self, other: object) -> bool:
        return self._key == other._key if isinstance(other, Surface) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key)

    def __repr__(self) -> str:
        nu, nv = self.control_points.shape[:2]
        kind = "B-spline" if self.weights is None else "rational"
        size = " x ".join(f"{side:.4g}" for side in np.ptp(self.control_points, axis=(0, 1)))
        return f"Surface({kind}, {nu} x {nv} control points over {size} mm, degree {self.degree})"

    @cached_property
    def _key(self) -> tuple[Any, ...]:
        weights = None if self.weights is None else self.weights.tobytes()
        ends = (self.knots[0].tobytes(), self.knots[1].tobytes(), weights)
        return (self.control_points.shape, self.control_points.tobytes(), self.degree, *ends, self.outward)

    @cached_property
    def _net(self) -> evaluation.Net:
        return evaluation.net_of(self)

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and greatest u, least and greatest v (dimensionless)."""
        (ku, kv), (p, q) = self.knots, self.degree
        return (float(ku[p]), float(ku[-p - 1])), (float(kv[q]), float(kv[-q - 1]))

    @cached_property
    def breaks(self) -> tuple[Floats, Floats]:
        """Distinct knots of the domain along u and v (dimensionless), with its ends."""
        u, v = (
            lasting(np.unique(np.clip(knots, *ends)))
            for knots, ends in zip(self.knots, self.domain, strict=True)
        )
        return u, v

    def derivatives(self, u: npt.ArrayLike, v: npt.ArrayLike) -> SurfaceDerivatives:
        """Return points and derivatives to second order (mm) at each pair of parameters `u` and `v`.

        At a knot where a derivative jumps it is that of the span behind it.

        Raises
        ------
        ValueError
            When a parameter is NaN or outside the domain.

        Examples
        --------
        >>> bilinear = Surface.bspline([[[0, 0, 0], [0, 9, 0]], [[9, 0, 0], [9, 9, 9]]], degree=(1, 1))
        >>> bilinear.derivatives([0.0, 1.0], 1.0).u
        array([[9., 0., 9.],
               [9., 0., 9.]])
        """
        return evaluation.scattered(self._net, *self._pairs(u, v))

    def point(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Return points Q(u, v) (..., 3) in mm at each pair of parameters `u` and `v`."""
        return evaluation.scattered_points(self._net, *self._pairs(u, v))

    def grid(self, u: npt.ArrayLike, v: npt.ArrayLike) -> SurfaceDerivatives:
        """Return points and derivatives (n, m, 3) in mm at each of `u` (n,) with each of `v` (m,)."""
        columns = [checks.finite_array(name, values) for name, values in (("u", u), ("v", v))]
        for name, values in zip("uv", columns, strict=True):
            if values.ndim != 1:
                raise checks.refuse(name, "one-dimensional", values.shape)
        return evaluation.on_grid(self._net, *self._parameters(*columns))

    def _parameters(self, u: npt.ArrayLike, v: npt.ArrayLike) -> tuple[Floats, Floats]:
        return _parameter("u", u, *self.domain[0]), _parameter("v", v, *self.domain[1])

    def _pairs(self, u: npt.ArrayLike, v: npt.ArrayLike) -> tuple[Floats, Floats]:
        at_u, at_v = self._parameters(u, v)
        evaluation.fitting(u=at_u, v=at_v)
        return at_u, at_v

    def normal(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Return outward unit normals (..., 3) (dimensionless) at `u` and `v`.

        Where ``|Qu x Qv|`` vanishes, as at the pole of a sphere patch, the limit from the interior.

        Raises
        ------
        ValueError
            When there is no such limit; the message names the point.
        """
        return self.normal_of(self.derivatives(u, v), u, v)

    def normal_of(self, derivatives: SurfaceDerivatives, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Return unit normals (dimensionless) from the known `derivatives` at `u` and `v`; see `normal`."""
        return self.outward * degenerate.regular(self, degenerate.NORMAL, derivatives, u, v)

    def first_form(self, u: npt.ArrayLike, v: npt.ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return E, F, G of the first fundamental form at `u` and `v`, mm^2."""
        return forms.first_form(self.derivatives(u, v))

    def second_form(self, u: npt.ArrayLike, v: npt.ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return e, f, g of the second fundamental form at `u` and `v`, mm, for the outward normal."""
        d = self.derivatives(u, v)
        return forms.second_form(d, self.normal_of(d, u, v))

    def gaussian_curvature(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Return K at `u` and `v`, 1/mm^2; where ``|Qu x Qv|`` vanishes, a limit, see `normal`."""
        return degenerate.regular(self, degenerate.GAUSSIAN, self.derivatives(u, v), u, v)

    def mean_curvature(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Return H at `u` and `v`, 1/mm, > 0 where the surface curves towards the tool; see `normal`."""
        return self.outward * degenerate.regular(self, degenerate.MEAN, self.derivatives(u, v), u, v)

    def principal_curvatures(self, u: npt.ArrayLike, v: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return k1 >= k2 at `u` and `v`, 1/mm, > 0 where the surface curves towards the tool."""
        both = self.outward * degenerate.regular(self, degenerate.PRINCIPAL, self.derivatives(u, v), u, v)
        return both.max(axis=-1), both.min(axis=-1)

    def normal_curvature(
        self, u: npt.ArrayLike, v: npt.ArrayLike, du: npt.ArrayLike, dv: npt.ArrayLike
    ) -> Floats:
        """Return the normal curvature (1/mm) along a direction, > 0 where it curves towards the tool.

        Parameters
        ----------
        u, v : array-like
            Place (dimensionless).
        du, dv : array-like
            Direction (dimensionless), of any length but zero.

        Raises
        ------
        ValueError
            When a direction has no length on the surface.

        Examples
        --------
        The inside of a cylinder of radius 20 mm, around it:

        >>> arc = [[20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]
        >>> net = [[[x, y, z] for z in (0.0, 50.0)] for x, y in arc]
        >>> inside = Surface.nurbs(net, [[1, 1], [0.5**0.5, 0.5**0.5], [1, 1]], degree=(2, 1), outward=-1)
        >>> round(float(inside.normal_curvature(0.5, 0.5, 1.0, 0.0)), 12)
        0.05
        """
        d = self.derivatives(u, v)
        step = checks.finite_array("du", du), checks.finite_array("dv", dv)
        evaluation.fitting(points=d.point[..., 0], du=step[0], dv=step[1])
        length = degenerate.squared_length(self, d, *step, u, v)
        e, f, g = forms.second_form(d, self.normal_of(d, u, v))
        return np.asarray(forms.along((e, f, g), *step) / length)

    def area_density(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Return sqrt(EG - F^2) at `u` and `v`: mm^2 of surface per unit square of the parameters."""
        return forms.area_density(self.derivatives(u, v))

    @cached_property
    def _area(self) -> area.PatchArea:
        return area.area(self)

    @property
    def size(self) -> float:
        """Diagonal of the box around the control points, mm."""
        return float(np.linalg.norm(np.ptp(self.control_points.reshape(-1, 3), axis=0)))

    @property
    def area(self) -> float:
        """Area, mm^2, by Gauss points in each knot span, doubled until convergence."""
        return self._area.value

    @property
    def area_error(self) -> float:
        """Change of the area by the last doubling of points, mm^2."""
        return self._area.change

    def moved(self, translation: npt.ArrayLike) -> Self:
        """Return the surface moved by `translation` (3,), mm."""
        step = checks.finite_array("translation", translation, "mm")
        if step.shape != (3,):
            raise checks.refuse("translation", "of three numbers (mm)", step.shape)
        return self.replace(control_points=self.control_points + step)

    def plot(self, ax: Any = None) -> Any:
        """Draw the surface with its knot lines, mm, into 3-D axes `ax` or a new figure; return the figure."""
        return pictures.drawn("sdpgrind.finishing.surface._picture:surface", self, ax)


def _parameter(name: str, value: npt.ArrayLike, low: float, high: float) -> Floats:
    """Check parameters and clip them to [low, high]."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and value.size:
        array: Floats = value
        if low <= array.min() and array.max() <= high:  # nearly all of the library's calls; NaN is not
            return array
    slack, rule = SLACK * (high - low), "in the surface's domain"
    return np.clip(checks.inside(name, value, low, high, slack=slack, rule=rule, numbered=True), low, high)
