"""Scatter of three coefficients: draws, correlation, what is refused."""

import re

import numpy as np
import pytest
from stand_job import PROCESS

from sdpgrind.weldbead import CoefficientScatter

RHO = ((1.0, -0.5, 0.2), (-0.5, 1.0, 0.0), (0.2, 0.0, 1.0))


def logs(scatter, count=20_000):
    rng = np.random.default_rng(5)
    drawn = [scatter.drawn(PROCESS, rng) for _ in range(count)]
    return np.log([(d.specific_energy, d.idle_power, d.friction_ratio) for d in drawn])


def test_drawn_logs_have_the_covariance_and_the_coefficients_their_means():
    scatter = CoefficientScatter(0.15, 0.2, 0.1, correlation=RHO)
    found, told = logs(scatter), scatter.log_covariance
    sd = np.sqrt(np.diag(told))
    assert np.allclose(sd**2, np.log1p(np.array([0.15, 0.2, 0.1]) ** 2), rtol=1e-14)
    # 4 standard errors: of a correlation 1/sqrt(n), of a mean r/sqrt(n)
    assert np.allclose(np.corrcoef(found.T), RHO, atol=4 / np.sqrt(len(found)))
    means = np.exp(found).mean(axis=0) / (12.8, 114.0, 0.33)
    assert np.all(np.abs(means - 1) < 4 * np.array([0.15, 0.2, 0.1]) / np.sqrt(len(found)))


def test_without_a_correlation_draws_are_those_of_three_normals():
    z = np.random.default_rng(3).standard_normal(3)
    s = np.sqrt(np.log1p(0.0225))
    drawn = CoefficientScatter(0.15, 0.15, 0.15).drawn(PROCESS, np.random.default_rng(3))
    assert drawn.specific_energy == pytest.approx(12.8 * np.exp(s * z[0] - s**2 / 2), rel=1e-14)
    assert drawn.friction_ratio == pytest.approx(0.33 * np.exp(s * z[2] - s**2 / 2), rel=1e-14)


def test_fully_correlated_coefficients_move_together():
    ones = np.ones((3, 3))
    found = logs(CoefficientScatter(0.1, 0.1, 0.1, correlation=ones), count=50)
    assert (
        np.ptp(found - found.mean(axis=0), axis=1).max() < 1e-8
    )  # 0.1 times roots of eigenvalues that are 0 to rounding


@pytest.mark.parametrize("rho", [None, RHO])
def test_covariance_of_logs_and_back(rho):
    scatter = CoefficientScatter(0.15, 0.2, 0.1, correlation=rho)
    again = CoefficientScatter.of_logs(scatter.log_covariance)
    assert np.allclose(again.log_covariance, scatter.log_covariance, rtol=1e-13, atol=1e-17)
    assert (again.correlation is None) == (rho is None)


def test_a_coefficient_that_is_known_has_no_correlation():
    covariance = np.diag([0.02, 0.0, 0.01])
    covariance[0, 2] = covariance[2, 0] = 0.005
    again = CoefficientScatter.of_logs(covariance)
    assert again.idle_power == 0
    assert np.allclose(again.log_covariance, covariance, rtol=1e-13)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"specific_energy": -0.1}, "specific_energy must be >= 0"),
        ({"idle_power": float("nan")}, "idle_power must be"),
        (
            {"friction_ratio": 15.0},
            "friction_ratio must be <= 1: divide by 100 where percent is meant; got 15",
        ),
        ({"correlation": [[1, 0], [0, 1]]}, "correlation must be three rows of three numbers"),
        ({"correlation": [[1, 0.5, 0], [0.4, 1, 0], [0, 0, 1]]}, "correlation must be symmetric"),
        ({"correlation": [[0.9, 0, 0], [0, 1, 0], [0, 0, 1]]}, "correlation must be symmetric with ones"),
        (
            {"correlation": [[1, 1.2, 0], [1.2, 1, 0], [0, 0, 1]]},
            "correlation must be positive semi-definite",
        ),
        (
            {"correlation": [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]},
            "correlation must be positive semi-definite",
        ),
    ],
)
def test_refused(given, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        CoefficientScatter(**given)
