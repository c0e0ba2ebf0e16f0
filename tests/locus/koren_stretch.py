"""Koren's example in closed form: the stretch of its locus by v, and its response."""

import numpy as np

from sdpgrind.locus import Stretch

START = 44 / 401  # derived: v at x = 20


def v_of(x):
    return (4 + 2 * x) / (1 + x**2)


def u_of(x):
    return (x**2 + 4 * x - 1) / (1 + x**2)


def loop_slope_of(x):
    """e_v: (2 - v)/u - x."""
    return -(x**2 + 1) * (x + 2) / (x**2 + 4 * x - 1)


def values(controls, x):
    """Koren (26), (25)."""
    u, v = controls[..., 0], controls[..., 1]
    return x * v + 16 - 4 * v, 17 + u - 4 * v


def koren(along="v", low=0.5, high=20.0, points=401, **options):
    """Points are dense where the locus bends."""
    angle = np.linspace(*np.arctan2(v_of(np.array([low, high])) - 2, u_of(np.array([low, high]))), points)
    u, v = np.sqrt(5) * np.cos(angle), 2 + np.sqrt(5) * np.sin(angle)
    x = (u + 1) / v
    du, dv = 2 - v, u  # by the angle, of the circle (18): u' = -(v - 2), v' = u
    dx = (du * v - (u + 1) * dv) / v**2
    tangents = np.column_stack([du, dv]), dx, du - 4 * dv, (x - 4) * dv
    given = {"ends": ("interior", "range"), "values": values, **options}
    controls, limit = np.column_stack([u, v]), 17 + u - 4 * v
    return Stretch.of_curve(
        along,
        names=("u", "v"),
        hidden_name="x",
        controls=controls,
        hidden=x,
        limit=limit,
        tangents=tangents,
        **given,
    )
