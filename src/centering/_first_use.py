"""A first program with a ring, which `sdpgrind.warm` compiles."""

import numpy as np

import centering


def first_use() -> None:
    """Find a circle, reading by reading and at once, the roundness of the ring, and push it."""
    angle = np.radians(np.arange(120.0))
    reading = 3.0 * np.cos(angle) + np.sqrt(60.0**2 - 9.0 * np.sin(angle) ** 2)  # mm
    estimator = centering.GeometryEstimator(noise_sd=0.002)
    for a, r in zip(angle, reading, strict=True):
        estimator.update(angle=float(a), reading=float(r))
    estimator.reset()
    estimator.first_valid(angle, reading)
    centering.identify((angle, reading), "circle")
    _roundness()
    problem = centering.preset("printed").replace(mass=0.8)
    centering.plan_push(problem, offset=2.0, spindle_speed=2.0, push_speed=20.0).simulate()


def _roundness() -> None:
    """Find all reference circles of an oval turn."""
    angle = np.radians(np.arange(0.0, 360.0, 4.0))
    radius = 60.0 + 0.01 * np.cos(2.0 * angle)  # mm
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    for kind in ("LSC", "MCC", "MIC", "MZC"):
        centering.roundness.reference_circle(points, kind)
