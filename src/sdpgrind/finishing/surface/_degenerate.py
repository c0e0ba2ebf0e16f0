"""Normals and curvatures where Qu x Qv vanishes (pole of a sphere): limit from the interior, or an error."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._derivatives import Differentiable, SurfaceDerivatives

# chosen: least ``|Qu x Qv|``, of size^2 over the domain's widths; least speed ``|dQ|``, of size over them
THIN = 1e-9
ROUGH = 1e-4  # chosen: the same for curvatures, whose rounding errors grow with its inverse square
NEAR = 1e-3  # of the domain, chosen: a nearer knot bounds no ray for the limit of a curvature
# chosen: Chebyshev points on a ray for the extrapolation of a limit, which do not amplify rounding
NODES = 12
REACH = 0.25  # knot spans, chosen: length of a ray
# chosen: spread of the limits along different rays, relative to the greatest or to a usual one
AGREE = 1e-6
SLOPES = ((1.0, 1.0), (1.0, 0.5), (0.5, 1.0))  # chosen: rays of each quadrant, spans


class Quantity(NamedTuple):
    """A function of the derivatives, 1/mm to a `power`; a limit where ``|Qu x Qv|`` is `thin`, see `THIN`."""

    function: Callable[[SurfaceDerivatives], Floats]
    name: str
    power: int
    thin: float


NORMAL = Quantity(forms.unit_cross, "normal", 0, THIN)
GAUSSIAN = Quantity(forms.gaussian, "Gaussian curvature", 2, ROUGH)
MEAN = Quantity(forms.mean, "mean curvature", 1, ROUGH)
PRINCIPAL = Quantity(forms.principal, "principal curvatures", 1, ROUGH)


def regular(
    surface: Differentiable, quantity: Quantity, d: SurfaceDerivatives, u: npt.ArrayLike, v: npt.ArrayLike
) -> Floats:
    """A quantity of the derivatives, with its limit wherever the surface is degenerate."""
    bad = _thin(surface, d, quantity.thin)
    if not bad.any():
        return quantity.function(d)
    lost = _thin(surface, d, THIN)
    places = np.stack([np.broadcast_to(x, bad.shape)[bad] for x in (u, v)], axis=-1)
    known = quantity.function(SurfaceDerivatives(*(x[~lost] for x in d)))
    out = np.full(bad.shape + known.shape[1:], np.nan)
    out[~lost] = known
    limits = [_limit(surface, quantity, *place) for place in places]
    out[bad] = [own if limit is None else limit for limit, own in zip(limits, out[bad], strict=True)]
    for limit, gone, (at_u, at_v) in zip(limits, lost[bad], places, strict=True):
        if limit is None and gone:
            raise ValueError(
                f"the surface has no {quantity.name} at (u, v) = ({at_u:g}, {at_v:g}): |Qu x Qv| vanishes"
                " there, and the interior gives no limit"
            )
    return out


def squared_length(
    surface: Differentiable, d: SurfaceDerivatives, du: Floats, dv: Floats, u: npt.ArrayLike, v: npt.ArrayLike
) -> Floats:
    """First form of a direction, which must have a length on the surface."""
    (u0, u1), (v0, v1) = surface.domain
    length = forms.along(forms.first_form(d), du, dv)
    least = THIN * surface.size * (np.abs(du) / (u1 - u0) + np.abs(dv) / (v1 - v0))
    bad = np.broadcast_to(length <= least**2, length.shape)
    if bad.any():
        at_u, at_v, step_u, step_v = (np.broadcast_to(x, bad.shape)[bad][0] for x in (u, v, du, dv))
        raise ValueError(
            f"(du, dv) must have a length on the surface; got ({step_u:g}, {step_v:g})"
            f" at (u, v) = ({at_u:g}, {at_v:g})"
        )
    return length


def _thin(surface: Differentiable, d: SurfaceDerivatives, thin: float) -> Bools:
    """Where ``|Qu x Qv|`` is less than a share of that of a surface of this size."""
    (u0, u1), (v0, v1) = surface.domain
    return np.asarray(forms.area_density(d) < thin * surface.size**2 / ((u1 - u0) * (v1 - v0)))


def _limit(surface: Differentiable, quantity: Quantity, u: float, v: float) -> Floats | None:
    """Limit at (u, v) from the interior of the domain, if all rays agree, or None."""
    rays = _rays(surface, u, v, max(THIN, NEAR * (quantity.thin > THIN)))
    nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    near = surface.derivatives(u + nodes * rays[:, :1], v + nodes * rays[:, 1:])
    if forms.area_density(near).all() and not _folded(near):
        limits = np.einsum("k,rk...->r...", _to_the_end(nodes), quantity.function(near))
        usual = max(float(np.abs(limits).max()), surface.size**-quantity.power)
        if np.ptp(limits, axis=0).max() <= AGREE * usual:
            return np.asarray(limits.mean(axis=0))
    return None


def _folded(near: SurfaceDerivatives) -> bool:
    """Whether the normal reverses on a ray (r, k), across which nothing can be extrapolated."""
    normal = forms.unit_cross(near)
    return bool((forms.dot(normal[:, 1:], normal[:, :-1]) <= 0).any())


def _to_the_end(nodes: Floats) -> Floats:
    """Weights of values at `nodes` for the value at 0 of their interpolating polynomial."""
    own = np.eye(len(nodes))
    return np.asarray(((nodes - own * nodes + own) / (nodes - nodes[:, None] + own)).prod(axis=1))


def _rays(surface: Differentiable, u: float, v: float, near: float) -> Floats:
    """Steps (r, 2) from (u, v) into the interior, none across a knot."""
    sides = [_sides(breaks, x, near) for breaks, x in zip(surface.breaks, (u, v), strict=True)]
    return np.array([(p * du, q * dv) for du in sides[0] for dv in sides[1] for p, q in SLOPES])


def _sides(places: Floats, x: float, near: float) -> list[float]:
    """Steps along one parameter within the spans on both sides of x that end further away than `near`."""
    margin = near * (places[-1] - places[0])
    behind, before = places[places > x + margin], places[places < x - margin]
    return [REACH * (place - x) for place in (*behind[:1], *before[-1:])]
