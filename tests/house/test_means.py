"""Means: Student's interval, and pooling of estimates that scatter by more than they say."""

import numpy as np
import pytest

from sdpgrind.base.means import half_interval, pooled, standard_error


def test_interval_of_a_mean():
    """By hand: 1, 2, 3, 6 have standard deviation (14/3)^(1/2); Student's 97.5 % quantile at 3 is 3.182446."""
    values = np.array([1.0, 2.0, 3.0, 6.0])
    assert standard_error(values) == pytest.approx((14 / 3) ** 0.5 / 2, rel=1e-15)
    assert half_interval(values) == pytest.approx(3.182446 * (14 / 3) ** 0.5 / 2, rel=1e-6)
    assert np.isnan(half_interval(values[:1])) and np.isnan(standard_error(values[:0]))


def test_estimates_within_their_variances_keep_them():
    mean, variance, freedom = pooled(np.array([1.0, 2.0]), np.array([1.0, 3.0]), 40.0)
    assert mean == pytest.approx(1.25) and variance == pytest.approx(0.75) and freedom == 40.0


def test_scatter_beyond_the_variances_counts():
    """By hand: weights 1 and 1, squares 50 + 50 over 1 degree of freedom are 100 times the variance 0.5."""
    mean, variance, freedom = pooled(np.array([0.0, 20.0]) / 2**0.5, np.ones(2), 40.0)
    assert mean == pytest.approx(10 / 2**0.5) and variance == pytest.approx(50.0) and freedom == 1.0


@pytest.mark.parametrize("value", [0.0, 3.0])
def test_exact_estimates_have_a_finite_weight(value):
    mean, variance, freedom = pooled(np.full(2, value), np.zeros(2), 9.0)
    assert mean == value and 0 < variance < 1e-20 and freedom == 9.0
    assert pooled(np.array([value]), np.array([2.0]), 9.0) == (value, 2.0, 9.0)
