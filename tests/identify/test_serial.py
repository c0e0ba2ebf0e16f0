"""Order of residuals: Durbin and Watson's test against simulation; statistic by its formula; correlations."""

import numpy as np
import pytest
from scipy import signal

from sdpgrind.base import serial


@pytest.mark.parametrize("count", [8, 30])
def test_probability_of_durbin_and_watson(count):
    """5 % and 1 % of independent files lie below their limits; 4000 files."""
    rng = np.random.default_rng(count)
    matrix = np.column_stack([np.ones(count), rng.uniform(1, 2, count)])
    noise = rng.standard_normal((4000, count))
    left = noise - noise @ np.linalg.pinv(matrix).T @ matrix.T
    share = np.array([serial.durbin_watson(row, matrix)[1] for row in left])
    for level in (0.01, 0.05, 0.5, 0.95):
        tolerance = 3.5 * np.sqrt(level * (1 - level) / 4000) + 0.002  # of 4000 files; of the beta law
        assert np.mean(share < level) == pytest.approx(level, abs=tolerance)


def test_statistic_of_durbin_and_watson():
    left = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    assert serial.durbin_watson(left, np.ones((6, 1)))[0] == pytest.approx(20 / 6)
    assert serial.durbin_watson(left, np.ones((6, 1)))[1] > 0.95
    assert serial.durbin_watson(np.repeat([1.0, -1.0], 10), np.ones((20, 1)))[1] < 1e-4
    assert serial.durbin_watson(np.zeros(6), np.ones((6, 1))) == (2.0, 0.5)


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_slow_misfit_raises_no_local_correlation(correlation):
    """Mean of 40 files of 480 readings about a wave of 3 sd; one file has a standard error of 0.05."""
    rng = np.random.default_rng(2)
    wave = 3.0 * np.sin(np.arange(480) / 60.0)
    found = []
    for _ in range(40):
        white = rng.normal(0.0, np.sqrt(1 - correlation**2), 580)
        left = wave + signal.lfilter([1.0], [1.0, -correlation], white)[100:]
        found.append(serial.local_correlation(left, 48))
        assert serial.correlation(left, 3, serial.gaps(None, 480)) > 0.7
    # below 0 there is none: of white noise half of the files say 0, the others 0.04 in the mean
    assert np.mean(found) == pytest.approx(correlation, abs=0.03)
    assert np.std(found) < 0.07
