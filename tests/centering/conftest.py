"""Kernels are compiled before the clock of the first test runs."""

import numpy as np
import pytest

from centering import GeometryEstimator, fit_circle


@pytest.fixture(scope="session", autouse=True)
def compiled():
    angle, reading = np.radians(np.arange(40.0)), np.full(40, 61.94)
    estimator = GeometryEstimator()
    estimator.extend(angle, reading)
    estimator.update(angle=0.7, reading=61.94)
    _ = estimator.valid, estimator.estimate
    estimator.reset(keep_radius=True)
    estimator.first_valid(angle, reading)
    fit_circle(angle, reading + 1e-3 * np.cos(9 * angle), loss="huber", throw=False)
