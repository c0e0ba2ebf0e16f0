"""Form and noise told apart by whole turns: lobes do no harm to what is sure, correlated noise is not taken
for form.
"""

import numpy as np
import pytest
from circle_inside import slots as at
from measured_rings import LOBES, RADIUS
from numpy.testing import assert_allclose
from scipy.signal import lfilter
from scipy.stats import binom

from centering.circle import GeometryEstimator, circle_reading
from sdpgrind import units

PHI = 0.7


def turned(readings, turns, start=0.0):
    return start + np.arange(round(readings * turns) + 1) * 2 * np.pi / readings


def lobed(angle, offset, lobes, noise=3e-5, seed=0):
    """Readings of a ring with lobes, near enough for small offsets."""
    rng = np.random.default_rng(seed)
    form = sum(a * np.cos(n * angle - rng.uniform(0, 7)) for n, a in lobes.items())
    return circle_reading(angle, RADIUS, offset, PHI) + form + rng.normal(0.0, noise, angle.size)


def error(estimator, offset):
    circle = estimator.estimate
    return np.hypot(circle.center_x - offset * np.cos(PHI), circle.center_y - offset * np.sin(PHI))


def fitted(angle, reading, **settings):
    estimator = GeometryEstimator(**{"joint": True} | settings)
    estimator.extend(angle, reading)
    return estimator


@pytest.mark.parametrize("readings", [60, 300, 720])
@pytest.mark.parametrize("form", [None, {2: 0.01, 3: 0.002}])
def test_a_lobed_ring_is_sure_after_a_turn(readings, form):
    angle, offset = turned(readings, 1.5), 0.05
    reading = lobed(angle, offset, {2: 0.01, 3: 0.002})
    estimator = fitted(angle[: readings // 2], reading[: readings // 2], form=form)
    step = estimator.first_valid(angle[readings // 2 :], reading[readings // 2 :])
    # without a bound lobes may at first be taken for a part that has moved
    latest = 1 if form else 0.45 * readings
    assert -1 <= step + readings // 2 - readings <= latest
    assert error(estimator, offset) <= estimator.band <= 0.002


@pytest.mark.parametrize("turns", [1.2, 1.37, 1.5, 1.8])
def test_what_form_does_in_a_broken_turn_is_in_the_band(turns):
    offset = 0.05
    for seed in range(20):
        angle = turned(300, turns)
        estimator = fitted(angle, lobed(angle, offset, {2: 0.01}, seed=seed), abs_tol=1e-4)
        assert error(estimator, offset) <= estimator.band
        assert estimator.estimate.form_bound > 0.5 * error(estimator, offset)
        assert estimator.estimate.limited_by in ("", "form")


def test_squares_of_waves_above_form_are_those_of_the_readings():
    """By numpy, from the readings of the turn themselves."""
    angle = turned(360, 1)
    reading = lobed(angle, 1.0, {3: 0.005, 6: 0.003, 8: 0.002}, 0.0)
    state = fitted(angle, reading + 50.0 - circle_reading(angle, RADIUS, 1.0, PHI), model="limacon")._state
    waves = [wave(n * angle[:360]) for n in range(1, 10) for wave in (np.cos, np.sin)]
    q, _ = np.linalg.qr(np.column_stack([np.ones(360), *waves]))
    told = q.T @ (reading - circle_reading(angle, RADIUS, 1.0, PHI))[:360]
    assert state[at.TURNS] == 1
    assert_allclose(np.sum(told[11:] ** 2), 180 * (0.003**2 + 0.002**2), rtol=1e-9)
    # waves are taken at the middle of 6 readings, whose mean is less by the ratio of sines; to the square of
    # what is missing
    six, eight = ((np.sin(np.radians(3 * n)) / (6 * np.sin(np.radians(0.5 * n)))) ** 2 for n in (6, 8))
    assert_allclose(state[at.LOW_SQUARES], 180 * (six * 0.003**2 + eight * 0.002**2), rtol=0.01)


def test_table_6_5_does_not_keep_an_estimate_from_being_sure():
    angle = turned(360, 1.1)
    for seed in range(20):
        for form in ({43: LOBES[43]}, LOBES):
            estimator = GeometryEstimator(joint=True)
            reading = lobed(angle, 0.05, form, seed=seed)
            assert estimator.first_valid(angle, reading) <= 361
            estimator = fitted(angle, reading)
            assert estimator.valid and error(estimator, 0.05) < estimator.band < 0.001


@pytest.mark.parametrize("form", [None, {2: 0.01, 3: 0.01}])
@pytest.mark.parametrize("rho", [0.9, 0.97])
def test_correlated_noise_is_not_taken_for_form(rho, form):
    """At 99 % of 300; what misses chance allows once in 10000 tests."""
    ends, miss = [180, 361, 450, 725], np.zeros(4)
    angle = units.deg(np.arange(726.0))
    clean = circle_reading(angle, RADIUS, 1.0, PHI)
    estimator = GeometryEstimator(joint=True, confidence=0.99, form=form)
    for seed in range(300):
        white = np.random.default_rng(seed).normal(0.0, 0.01, angle.size)
        white[1:] *= np.sqrt(1 - rho**2)
        reading = clean + lfilter([1.0], [1.0, -rho], white)
        estimator.reset()
        for k, (begin, end) in enumerate(zip([0, *ends], ends, strict=False)):
            estimator.extend(angle[begin:end], reading[begin:end])
            band = estimator.band
            miss[k] += np.isfinite(band) and error(estimator, 1.0) > band
    assert np.all(miss <= binom.ppf(0.9999, 300, 0.01))


def test_a_turn_with_a_gap_tells_nothing():
    """Over the gap of a third of a turn lobes cannot be told from an offset."""
    angle = turned(300, 1.2)
    kept = (angle < 1.0) | (angle > 1.0 + 2 * np.pi / 3)
    estimator = fitted(angle[kept], lobed(angle, 0.05, {2: 0.01})[kept])
    assert not estimator.valid
    assert estimator.estimate.limited_by == "correlation"


def test_says_that_a_turn_will_tell():
    angle = turned(300, 0.5)
    circle = fitted(angle, lobed(angle, 0.05, {3: 0.002})).estimate
    assert circle.limited_by == "correlation"
    assert_allclose(circle.arc_needed, np.pi, atol=0.03)
    assert "a whole turn tells form from noise, after 180 deg more" in circle.message


@pytest.mark.parametrize("forgetting", [1.0, 0.5])
def test_noise_is_never_less_than_what_is_given(forgetting):
    angle = turned(300, 2.2)
    reading = lobed(angle, 0.05, {2: 0.01})
    known = fitted(angle, reading, noise_sd=0.002, forgetting=forgetting).estimate
    free = fitted(angle, reading, forgetting=forgetting).estimate
    assert known.inflation == 1.0 and free.inflation < 0.1
    assert known.uncertainty(0.999, joint=True) > 3.7 * 0.002 * np.sqrt(2 / 661)
    assert known.center_sd > free.center_sd * free.inflation
