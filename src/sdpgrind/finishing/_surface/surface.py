"""A die surface: B-spline or rational B-spline patch."""

import dataclasses
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.finishing._surface import door, evaluation, forms
from sdpgrind.finishing._surface.derivatives import Derivatives


@stored("finishing.surface")
@dataclasses.dataclass(frozen=True, eq=False)
class Surface(Frozen):
    """A B-spline surface, rational where it has weights."""

    control_points: Floats
    degree: tuple[int, int]
    knots: tuple[Floats, Floats]
    weights: Floats | None = None
    outward: int = 1

    def __post_init__(self) -> None:
        net = door.control_net(self.control_points)
        degree = door.degrees(self.degree, net)
        knots = door.knot_vectors(self.knots, degree, net)
        checked = {"control_points": net, "degree": degree, "knots": knots, "weights": door.weight_net(self.weights, net)}
        for name, value in {**checked, "outward": door.side(self.outward)}.items():
            object.__setattr__(self, name, value)

    @classmethod
    def bspline(
        cls,
        control_points: npt.ArrayLike,
        degree: tuple[int, int] = (3, 3),
        knots: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
        outward: int = 1,
    ) -> Self:
        """B-spline."""
        net = door.control_net(control_points)
        pair = door.degrees(degree, net)
        return cls(net, pair, door.knot_vectors(knots, pair, net), None, outward)

    @classmethod
    def nurbs(
        cls,
        control_points: npt.ArrayLike,
        weights: npt.ArrayLike,
        degree: tuple[int, int] = (3, 3),
        knots: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
        outward: int = 1,
    ) -> Self:
        """Rational B-spline."""
        net = door.control_net(control_points)
        pair = door.degrees(degree, net)
        return cls(net, pair, door.knot_vectors(knots, pair, net), door.weight_net(weights, net), outward)

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and greatest u and v."""
        (ku, kv), (p, q) = self.knots, self.degree
        return (float(ku[p]), float(ku[-p - 1])), (float(kv[q]), float(kv[-q - 1]))

    @cached_property
    def _net(self) -> Floats:
        return evaluation.homogeneous(self.control_points, self.weights)

    def derivatives(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Derivatives:
        """Points with derivatives."""
        du, dv = self.domain
        return evaluation.scattered(self._net, self.knots, self.degree, door.parameter("u", u, *du), door.parameter("v", v, *dv))

    def point(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Points."""
        return self.derivatives(u, v).point

    def grid(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Derivatives:
        """Tensor grid."""
        du, dv = self.domain
        return evaluation.on_grid(self._net, self.knots, self.degree, door.parameter("u", u, *du), door.parameter("v", v, *dv))

    def normal(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Unit normals outward."""
        d = self.derivatives(u, v)
        cross = np.cross(d.u, d.v)
        return np.asarray(self.outward * cross / np.sqrt(forms.dot(cross, cross))[..., None])

    def area_density(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """sqrt(EG - F^2)."""
        return forms.area_density(self.derivatives(u, v))
