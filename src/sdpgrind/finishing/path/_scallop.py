"""Scallops that a ball leaves between passes: height and roughness; radius of the ball's footprint."""

from math import asin, sqrt

import numpy as np

from sdpgrind.base import checks

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # chosen: exact to rounding
_HALF, _SHARE = (_NODES + 1) / 2, _WEIGHTS / 2


def scallop_height(tool_radius: float, pitch: float, normal_curvature: float = 0.0) -> float:
    """Return the height (mm) of the scallops that a ball leaves between passes: R - sqrt(R^2 - pitch^2/4).

    Exact on a flat. On a curved surface 1/R is 1/R_t - k_n, with k_n the normal curvature across the passes;
    for a cylinder, with the pitch along its arc, the relative excess is k_n pitch^2/(16 R_t).

    Parameters
    ----------
    tool_radius : float
        R_t, radius of the ball, mm.
    pitch : float
        Distance of neighbouring passes on the surface, mm.
    normal_curvature : float
        k_n across the passes, 1/mm; positive where the surface curves towards the tool.

    Raises
    ------
    ValueError
        When k_n R_t >= 1 (the ball gouges), passes do not meet, or a value is out of range.

    Examples
    --------
    >>> round(1e3 * scallop_height(2.0, 0.2), 4)  # µm
    2.5016
    >>> round(1e3 * scallop_height(2.0, 0.2, normal_curvature=-0.02), 4)  # a ridge has higher ones, µm
    2.6018
    """
    radius, half = _cusp(tool_radius, pitch, normal_curvature)
    return _sagitta(radius, half)


def cusp_roughness(tool_radius: float, pitch: float, normal_curvature: float = 0.0) -> float:
    """Return the arithmetic mean roughness R_a (mm) of the scallops that a ball leaves.

    Their arcs meet in cusps. For a pitch small next to the radius R_a is 4/(9 sqrt 3) = 0.2566 of their
    height.

    Parameters
    ----------
    tool_radius, pitch, normal_curvature : float
        As of `scallop_height`, mm and 1/mm.

    Raises
    ------
    ValueError
        When k_n R_t >= 1 (the ball gouges), passes do not meet, or a value is out of range.

    Examples
    --------
    >>> round(1e3 * cusp_roughness(2.0, 0.2), 4)  # µm
    0.6418
    >>> round(cusp_roughness(2.0, 0.2) / scallop_height(2.0, 0.2), 4)
    0.2566
    """
    radius, half = _cusp(tool_radius, pitch, normal_curvature)
    mean = _mean_height(radius, half)
    below = sqrt(mean * (2 * radius - mean))  # the profile is below its mean up to here
    return 2 * below / half * (mean - _mean_height(radius, below))


def ball_footprint(tool_radius: float, depth: float) -> float:
    """Return the footprint radius (mm) of a ball pressed into a flat: sqrt(2 R_t d), a paraboloid.

    The circle in which the sphere cuts the flat has the radius sqrt(2 R_t d - d^2), relatively less by d/(4
    R_t).

    Parameters
    ----------
    tool_radius : float
        R_t, radius of the ball, mm.
    depth : float
        d, depth of the ball in the flat, mm; at most its radius.

    Raises
    ------
    ValueError
        When the depth exceeds the radius, or a value is not positive.

    Examples
    --------
    >>> ball_footprint(2.0, 0.01)  # mm
    0.2
    """
    radius, d = checks.positive("tool_radius", tool_radius, "mm"), checks.positive("depth", depth, "mm")
    if d > radius:
        raise checks.refuse("depth", f"<= tool_radius = {radius:g}", d, "mm")
    return sqrt(2 * radius * d)


def _cusp(tool_radius: float, pitch: float, normal_curvature: float) -> tuple[float, float]:
    """Radius of the arcs on the surface unrolled, and half their width, mm."""
    radius = checks.positive("tool_radius", tool_radius, "mm")
    half = checks.positive("pitch", pitch, "mm") / 2
    bend = checks.number("normal_curvature", normal_curvature, "1/mm")
    if bend * radius >= 1:
        raise checks.refuse(
            "normal_curvature", f"< 1/tool_radius = {1 / radius:g}: else the ball gouges", bend, "1/mm"
        )
    apparent = radius / (1 - bend * radius)
    if half > apparent:
        raise checks.refuse(
            "pitch", f"<= {2 * apparent:g}: else passes of the ball do not meet", 2 * half, "mm"
        )
    return apparent, half


def _sagitta(radius: float, half: float) -> float:
    """Height of an arc at `half` from its lowest point, without cancellation."""
    return half**2 / (radius + sqrt(radius**2 - half**2))


def _mean_height(radius: float, half: float) -> float:
    """Mean height of an arc from its lowest point to `half`, by Gauss points over its angle."""
    end = asin(half / radius)
    angle = end * _HALF
    height = 2 * radius * np.sin(angle / 2) ** 2
    return float(np.sum(_SHARE * height * radius * np.cos(angle)) * end / half)
