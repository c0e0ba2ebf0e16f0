"""Lack of fit: an F test of text books where the noise is white, and rounding."""

import numpy as np
import pytest
from scipy.stats import f as fisher

from sdpgrind.base import serial
from sdpgrind.base.lack_of_fit import rest


def coloured(white, correlation=0.8):
    """Noise of first order of one series, by its recursion."""
    found = white * (1 - correlation**2) ** 0.5
    for k in range(1, white.size):
        found[k] += correlation * found[k - 1]
    return found


def test_white_noise_is_the_test_of_text_books():
    """A line through 40 readings, against the parabola: Fisher's F of 1 and 37."""
    rng, x = np.random.default_rng(4), np.linspace(0.0, 1.0, 40)
    read = 1.0 + 2.0 * x + 0.6 * x**2 + 0.1 * rng.standard_normal(40)
    line, curve = np.stack([np.ones(40), x], axis=1), np.stack([np.ones(40), x, x**2], axis=1)
    squares = []
    for rows in (line, curve):
        left = read - rows @ np.linalg.lstsq(rows, read)[0]
        squares.append(left @ left)
    off = read - line @ np.linalg.lstsq(line, read)[0]
    found = rest(off, line, x[None], np.full(40, np.inf), 0.0)  # no reading resembles the one before
    assert found.chance == pytest.approx(
        fisher.sf((squares[0] - squares[1]) / (squares[1] / 37), 1, 37), rel=1e-6
    )
    assert found.noise_sd == pytest.approx((squares[1] / 37) ** 0.5, rel=1e-9)
    assert found.sd == pytest.approx((squares[0] / 38) ** 0.5, rel=1e-9)


def test_noise_of_a_filter_is_no_misfit():
    """Correlation 0.9 over a slow change: none of 60, where a test for white noise alarms in a third."""
    x, alarms, white = np.linspace(0.0, 1.0, 100), 0, 0
    one, apart = np.ones((100, 1)), serial.gaps(None, 100)
    for rng in np.random.default_rng(5).spawn(60):
        noise = rng.standard_normal(100)
        for k in range(1, 100):
            noise[k] = 0.9 * noise[k - 1] + 0.19**0.5 * noise[k]
        off = noise - noise.mean()
        alarms += not rest(off, one, x[None], apart, 0.0).fits
        white += not rest(off, one, x[None], np.full(100, np.inf), 0.0).fits
    assert alarms <= 2 and white > 10


def test_a_gauge_that_lags_is_no_noise():
    """Levels read through a filter: the surface takes it for noise, which resembles as a lag does."""
    level, rng, apart = (
        np.repeat([3.0, 1.0, 4.0, 2.0, 5.0], 40),
        np.random.default_rng(6),
        serial.gaps(None, 200),
    )
    lagging = level - coloured(np.diff(level, prepend=3.0)) / 0.6
    np.testing.assert_allclose(lagging[41:43], [1.0 + 2.0 * 0.8, 1.0 + 2.0 * 0.64])
    for read, late in ((lagging, True), (level, False)):
        off = read - level + 0.1 * coloured(rng.standard_normal(200))
        slopes, inputs = level[:, None], level[None]
        assert rest(off, slopes, inputs, apart, 0.0).fits
        found = rest(off, slopes, inputs, apart, 0.0, level)
        assert found.late is late and found.fits is not late


def test_too_few_readings_and_what_rounding_leaves():
    assert rest(np.zeros(4), np.ones((4, 1)), np.arange(4.0)[None], serial.gaps(None, 4), 0.0) is None
    off = np.tile([1e-12, -1e-12, 3e-12], 10)
    assert rest(off, np.ones((30, 1)), np.arange(30.0)[None], serial.gaps(None, 30), 1e-9).fits
