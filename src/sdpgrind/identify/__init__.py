"""Estimation from data."""

from sdpgrind.identify._density import KernelDensity, QuantileDensity, kernel_density, quantile_density
from sdpgrind.identify._estimate import Estimate, Status
from sdpgrind.identify._kalman import RandomWalk, random_walk_gain, random_walk_response
from sdpgrind.identify._moments import (
    Moments,
    delta_method,
    difference_moments,
    product_moments,
    ratio_moments,
    sample_moments,
    sum_moments,
)
from sdpgrind.identify._output_error import output_error
from sdpgrind.identify._readings import Readings, readings
from sdpgrind.identify._recursive import RecursiveLeastSquares
from sdpgrind.identify._regression import least_squares, total_least_squares
from sdpgrind.identify._series import Series, series

__all__ = [
    "Estimate",
    "KernelDensity",
    "Moments",
    "QuantileDensity",
    "RandomWalk",
    "Readings",
    "RecursiveLeastSquares",
    "Series",
    "Status",
    "delta_method",
    "difference_moments",
    "kernel_density",
    "least_squares",
    "output_error",
    "product_moments",
    "quantile_density",
    "random_walk_gain",
    "random_walk_response",
    "ratio_moments",
    "readings",
    "sample_moments",
    "series",
    "sum_moments",
    "total_least_squares",
]
