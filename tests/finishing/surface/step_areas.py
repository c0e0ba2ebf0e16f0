"""Areas of the STEP files by quadrature that knows the shapes, not the reader."""

import numpy as np

GAUSS = np.polynomial.legendre.leggauss(60)


def integral(function, low, high):
    """Integral over [low, high] by one Gauss rule."""
    x, weight = GAUSS
    half = 0.5 * (high - low)
    return half * sum(w * function(low + half * (1 + at)) for at, w in zip(x, weight, strict=True))


def over_plan(surface, x, y):
    """Surface over an area of the plan z = 0, at points (n,) whose x is a function of u alone, y of v alone."""
    (u0, u1), (v0, v1) = surface.domain
    u, v = np.linspace(u0, u1, 4001), np.linspace(v0, v1, 4001)
    at_u = np.interp(x, surface.point(u, v0)[:, 0], u)
    at_v = np.interp(y, surface.point(u0, v)[:, 1], v)
    return 1.0 / np.abs(surface.normal(at_u, at_v)[..., 2])


def over_disk(surface, x, y, radius):
    """Area of a surface above a disk of the plan."""
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    r, weight = 0.5 * radius * (1 + GAUSS[0]), 0.5 * radius * GAUSS[1]
    found = over_plan(surface, x + r[:, None] * np.cos(turn), y + r[:, None] * np.sin(turn))
    return float(2 * np.pi * (weight * r) @ found.mean(axis=1))


def over_rectangle(surface, x, y):
    """Area of a surface above a rectangle of the plan, by midpoints."""
    places = [low + (np.arange(300) + 0.5) / 300 * (high - low) for low, high in (x, y)]
    found = over_plan(surface, *np.meshgrid(*places))
    return float(found.mean() * (x[1] - x[0]) * (y[1] - y[0]))


def barrel_with_hole():
    """Quarter of the barrel with a round hole of radius 5 across its wall at z = 15."""
    radius = np.polynomial.Polynomial([12.0, 12.0, -12.0])  # the cubic of 12, 16, 16, 12 over v

    def ring(v):
        return radius(v) * np.hypot(30.0, radius.deriv()(v))

    def hole(angle):  # z = 15 + 5 sin(angle)
        v = 0.5 + 5 * np.sin(angle) / 30
        return 2 * np.arcsin(5 * np.cos(angle) / radius(v)) * ring(v) * 5 * np.cos(angle) / 30

    return 0.5 * np.pi * integral(ring, 0, 1) - integral(hole, -np.pi / 2, np.pi / 2)


def ball_without_corner():
    """Ball of radius 10 with what is beyond x = 2 below z = 5 taken off: its sphere."""

    def taken(angle):  # z from -sqrt(96), where the plane x = 2 leaves the ball, to 5
        z = -np.sqrt(96) + (5 + np.sqrt(96)) * np.sin(angle) ** 2
        rate = (5 + np.sqrt(96)) * 2 * np.sin(angle) * np.cos(angle)
        return 2 * np.arccos(np.minimum(2 / np.sqrt(100 - z**2), 1.0)) * 10 * rate

    return 400 * np.pi - integral(taken, 0, np.pi / 2)


def segment(square, distance):
    """Area of a disk of squared radius `square` beyond a chord."""
    return square * np.arccos(distance / square**0.5) - distance * np.sqrt(square - distance**2)
