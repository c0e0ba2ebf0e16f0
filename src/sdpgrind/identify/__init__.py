"""Estimation from data."""

from sdpgrind.identify._density import KernelDensity, QuantileDensity, kernel_density, quantile_density
from sdpgrind.identify._estimate import Estimate, Status
from sdpgrind.identify._moments import (
    Moments,
    delta_method,
    difference_moments,
    product_moments,
    ratio_moments,
    sample_moments,
    sum_moments,
)
from sdpgrind.identify._readings import Readings, readings
from sdpgrind.identify._regression import RecursiveLeastSquares, least_squares, total_least_squares

__all__ = [
    "Estimate",
    "KernelDensity",
    "Moments",
    "QuantileDensity",
    "Readings",
    "RecursiveLeastSquares",
    "Status",
    "delta_method",
    "difference_moments",
    "kernel_density",
    "least_squares",
    "product_moments",
    "quantile_density",
    "ratio_moments",
    "readings",
    "sample_moments",
    "sum_moments",
    "total_least_squares",
]
