"""Sums over lags by Fourier transforms, against the sum itself."""

import numpy as np
import pytest
from sdp_inside import Convolution, Product


def drawn(nodes, first_lag):
    """Weights of 40 rows, each on a window of lags of its own, and a value that is 0 at node 0."""
    rng = np.random.default_rng(nodes)
    lags = nodes - first_lag
    weight = rng.uniform(size=(40, lags))
    ends = np.sort(rng.integers(0, lags, (40, 2)), axis=0)  # neighbours are alike, the first ones only rise
    weight[(np.arange(lags) < ends[:, :1]) | (np.arange(lags) > ends[:, :1] + ends[::-1, 1:] // 4)] = 0.0
    weight[-1] = 0.0
    return weight, np.append(0.0, rng.uniform(size=nodes - 1))


@pytest.mark.parametrize("falling", [True, False])
@pytest.mark.parametrize("rows", [slice(0, 40), slice(5, 33)])
def test_transforms_give_the_sums(falling, rows):
    nodes = 61
    first_lag = 0 if falling else 1 - nodes
    weight, value = drawn(nodes, first_lag)
    node, lag = np.arange(nodes)[:, None], first_lag + np.arange(weight.shape[1])
    inside = (node - lag >= 1) & (node - lag < nodes)
    twin = weight[rows] @ np.where(inside, value[np.where(inside, node - lag, 0)], 0.0).T
    every = np.arange(len(weight))
    for sums in (
        Convolution(weight, every, nodes, first_lag),
        Product(weight, nodes, weight.shape[1], first_lag),
    ):
        found = np.full(twin.shape, np.nan)
        sums(rows, value[::-1].copy(), found)
        np.testing.assert_allclose(found, twin, rtol=0, atol=2e-14)  # roundings of sums up to 30
