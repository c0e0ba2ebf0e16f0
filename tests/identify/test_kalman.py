"""Random walks against the joint normal law of all that happened, and the steady state against its own
iteration.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import identify


def posterior(prior_mean, prior_cov, walk, readings, rows, noise):
    """Last state given all readings: the joint normal law of the states at all times, conditioned once. Slow
    and obvious.
    """
    size, times = prior_mean.size, len(readings)
    mean = np.tile(prior_mean, times)
    covariance = np.zeros((size * times, size * times))
    for i in range(times):
        for j in range(times):
            covariance[i * size : (i + 1) * size, j * size : (j + 1) * size] = prior_cov + (
                min(i, j) + 1
            ) * np.diag(walk)
    looks, seen, noises = [], [], []
    for t, (reading, row) in enumerate(zip(readings, rows, strict=True)):
        for entry, line, variance in zip(reading, row, noise, strict=False):
            if not np.isnan(entry):
                look = np.zeros(size * times)
                look[t * size : (t + 1) * size] = line
                looks.append(look)
                seen.append(entry)
                noises.append(variance)
    look = np.array(looks).reshape(-1, size * times)
    inside = look @ covariance @ look.T + np.diag(noises)
    gain = covariance @ look.T @ np.linalg.inv(inside)
    mean, covariance = mean + gain @ (seen - look @ mean), covariance - gain @ look @ covariance
    return mean[-size:], covariance[-size:, -size:]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), missing=st.floats(0, 0.6))
def test_several_walks_with_gaps(seed, missing):
    rng = np.random.default_rng(seed)
    walk, noise = rng.uniform(0, 1, 2), rng.uniform(0.1, 1, 2)
    root = rng.normal(size=(2, 2))
    prior = identify.Estimate(("gap", "friction"), rng.normal(size=2), root @ root.T)
    readings = np.where(rng.uniform(size=(8, 2)) < missing, np.nan, rng.normal(size=(8, 2)))
    filtered = identify.RandomWalk(prior.names, walk_variance=walk, noise_variance=noise, prior=prior)
    for k, reading in enumerate(readings):
        filtered.update(reading)
        rows = [np.eye(2)] * (k + 1)
        mean, covariance = posterior(prior.value, prior.covariance, walk, readings[: k + 1], rows, noise)
        np.testing.assert_allclose(filtered.estimate.value, mean, atol=1e-9)
        np.testing.assert_allclose(filtered.estimate.covariance, covariance, atol=1e-9)
        assert np.array_equal(np.isnan(filtered.innovation), np.isnan(reading))
    assert filtered.count == 8


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_rows_of_a_moving_part(seed):
    rng = np.random.default_rng(seed)
    names, walk = ("radius", "center_x", "center_y"), np.array([0.0, 0.3, 0.2])
    prior = identify.Estimate(names, [61.9, 0.0, 0.0], np.diag([0.5, 1.0, 2.0]))
    angle = rng.uniform(0, 6, 10)
    rows = np.column_stack([np.ones(10), np.cos(angle), np.sin(angle)])
    readings = rng.normal(62, 1, 10)
    filtered = identify.RandomWalk(names, walk_variance=walk, noise_variance=0.3, prior=prior)
    for k in range(10):
        before = filtered.estimate
        expected = before.covariance + np.diag(walk)
        filtered.update(readings[k], rows[k])
        assert filtered.innovation == pytest.approx([readings[k] - rows[k] @ before.value])
        assert filtered.innovation_sd == pytest.approx([np.sqrt(rows[k] @ expected @ rows[k] + 0.3)])
    mean, covariance = posterior(prior.value, prior.covariance, walk, readings[:, None], rows[:, None], [0.3])
    np.testing.assert_allclose(filtered.estimate.value, mean, atol=1e-8)
    np.testing.assert_allclose(filtered.estimate.covariance, covariance, atol=1e-8)


def test_without_a_walk_it_is_least_squares():
    rng = np.random.default_rng(0)
    names = ("a", "b")
    prior = identify.Estimate(names, [0.0, 0.0], np.eye(2))
    walk = identify.RandomWalk(names, walk_variance=0.0, noise_variance=0.25, prior=prior)
    rls = identify.RecursiveLeastSquares(names, prior=prior, noise_sd=0.5)
    for row, reading in zip(rng.normal(size=(9, 2)), rng.normal(size=9), strict=True):
        walk.update(float(reading), row)
        rls.update(row, float(reading))
    np.testing.assert_allclose(walk.estimate.value, rls.estimate.value, rtol=1e-9)
    np.testing.assert_allclose(walk.estimate.covariance, rls.estimate.covariance, rtol=1e-9)


def test_innovations_are_white_and_as_wide_as_said():
    rng = np.random.default_rng(1)
    true = np.cumsum(0.3 * rng.standard_normal((4000, 2)), axis=0)
    readings = true + [0.5, 1.0] * rng.standard_normal((4000, 2))
    walk = identify.RandomWalk(("a", "b"), walk_variance=0.09, noise_variance=[0.25, 1.0])
    scaled = []
    for reading in readings:
        walk.update(reading)
        scaled.append(walk.innovation / walk.innovation_sd)
    scaled = np.array(scaled[1:])
    lagged = np.mean(scaled[1:] * scaled[:-1], axis=0)
    np.testing.assert_allclose(np.mean(scaled**2, axis=0), 1.0, atol=4 * np.sqrt(2 / 4000))
    np.testing.assert_allclose(lagged, 0.0, atol=4 / np.sqrt(4000))


def test_the_first_reading_starts_a_walk():
    walk = identify.RandomWalk(("a", "b"), walk_variance=0.1, noise_variance=[0.2, 0.3], units=("mm", "1"))
    assert not walk.estimate.ok
    walk.update([np.nan, 2.0])
    assert walk.estimate.status is identify.Status.UNDETERMINED
    assert np.all(np.isnan(walk.innovation))
    np.testing.assert_array_equal(walk.innovation_sd, [np.inf, np.inf])
    walk.update([5.0, np.nan])
    assert walk.estimate.ok
    np.testing.assert_allclose(walk.estimate.value, [5.0, 2.0])
    np.testing.assert_allclose(np.diag(walk.estimate.covariance), [0.2, 0.4])
    assert walk.innovation_sd[1] == pytest.approx(np.sqrt(0.4 + 0.3))  # told even where nothing was read
    walk.update([6.0, np.nan])
    np.testing.assert_allclose(np.diag(walk.estimate.covariance), [0.3 * 0.2 / 0.5, 0.5])
    walk.reset()
    assert (walk.count, walk.estimate.ok) == (0, False)
    walk.update([1.0, 1.0])
    np.testing.assert_allclose(walk.estimate.value, 1.0)


@pytest.mark.parametrize("nothing", [np.nan, np.float32("nan"), np.array(np.nan, dtype=np.float32)])
def test_no_reading_whatever_kind_of_nan_says_so(nothing):
    walk = identify.RandomWalk(("a",), walk_variance=0.1, noise_variance=0.2)
    walk.update(np.float32(2.0))
    walk.update(nothing)
    assert walk.estimate["a"] == 2.0 and np.isnan(walk.innovation[0])
    np.testing.assert_allclose(walk.estimate.covariance, 0.3)


def test_what_is_not_known_yet_does_not_disturb_what_is():
    half = identify.Estimate(("a", "b"), [1.0, 7.0], np.diag([0.5, np.inf]))
    both = identify.RandomWalk(half.names, walk_variance=0.1, noise_variance=0.2, prior=half)
    alone = identify.RandomWalk(
        ("a",), walk_variance=0.1, noise_variance=0.2, prior=identify.Estimate(("a",), [1.0], [[0.5]])
    )
    for reading in (1.5, 0.3, np.nan, 2.0):
        both.update([reading, np.nan])
        alone.update(reading)
        assert both.estimate["a"] == alone.estimate["a"]
        assert both.innovation_sd.tolist() == [alone.innovation_sd[0], np.inf]
    assert both.estimate.status is identify.Status.UNDETERMINED
    with pytest.raises(ValueError, match="prior must be given, with finite variances, where rows are read"):
        both.update(1.0, [1.0, 1.0])


@pytest.mark.parametrize(
    ("walk", "noise", "gain"),
    [(0.0005, 0.03, 0.121035), (0.005**2, 0.03**2, 0.153355), (0.0, 1.0, 0.0), (1.0, 0.0, 1.0)],
)
def test_gain_settles(walk, noise, gain):
    assert identify.random_walk_gain(walk, noise) == pytest.approx(gain, abs=1e-6)
    variance = 1.0
    for _ in range(20_000):  # without a walk the gain falls as 1/k only
        before = variance + walk
        variance = before * noise / (before + noise)
    assert before / (before + noise) == pytest.approx(identify.random_walk_gain(walk, noise), abs=1e-4)


@pytest.mark.parametrize("upr", [1, 3, 43])
def test_response_is_what_comes_out(upr):
    gain = identify.random_walk_gain(0.0005, 0.03)
    step = upr * np.deg2rad(1.0)
    phase = step * np.arange(720)
    track = identify.RandomWalk(("reading",), walk_variance=0.0005, noise_variance=0.03)
    out = []
    for reading in np.cos(phase):
        track.update(reading)
        out.append(track.estimate.value[0])
    last = np.array(out[360:])
    seen = 2 * np.mean(last * np.exp(-1j * phase[360:]))  # a whole turn: no leakage
    np.testing.assert_allclose(seen, identify.random_walk_response(gain, step), atol=1e-9)


def test_response_of_the_source():
    step = np.deg2rad(1.0)
    simulated = identify.random_walk_response(identify.random_walk_gain(0.0005, 0.03), step)
    assert 100 * (abs(simulated) - 1) == pytest.approx(-0.9015, abs=1e-3)
    assert np.rad2deg(np.angle(simulated)) == pytest.approx(-7.215, abs=1e-3)
    assert abs(simulated - 1) == pytest.approx(0.126, abs=5e-4)
    prototype = identify.random_walk_response(
        identify.random_walk_gain(0.005**2, 0.03**2), step * np.array([1, 3, 43])
    )
    np.testing.assert_allclose(abs(prototype[0]), 0.9946, atol=5e-5)
    np.testing.assert_allclose(np.rad2deg(-np.angle(prototype[:2])), [5.5, 16], atol=0.3)
    assert 0.19 < abs(prototype[2]) < 0.225


MESSAGES = [
    (
        lambda: identify.random_walk_gain(0.0, 0.0),
        "walk_variance and noise_variance must not both be 0; got 0 and 0",
    ),
    (lambda: identify.random_walk_gain(-1.0, 1.0), "walk_variance must be >= 0; got -1.0"),
    (lambda: identify.random_walk_gain(1.0, -1.0), "noise_variance must be >= 0; got -1.0"),
    (lambda: identify.random_walk_response(0.0, 1.0), r"gain must be in \(0, 1\] \(1\); got 0.0"),
    (lambda: identify.random_walk_response(0.5, np.nan), r"step\[0\] must be finite \(rad\); got nan"),
    (lambda: walker(walk_variance=-1.0), "walk_variance must be >= 0; got -1.0"),
    (lambda: walker(walk_variance=[0.0, 1.0], noise_variance=0.0), "must not both be 0"),
    (
        lambda: walker(noise_variance=[1.0, 2.0, 3.0]),
        r"noise_variance must be a number or of shape \(2,\); got shape \(3,\)",
    ),
    (
        lambda: walker(prior=identify.Estimate(("x",), [0.0], [[1.0]])),
        "prior must be an estimate of a, b; got 'x'",
    ),
    (
        lambda: walker(prior=identify.Estimate(("a", "b"), [0.0, 0.0], -np.eye(2))),
        "variances of the prior must be >= 0",
    ),
    (lambda: walker().update(1.0), r"reading must be finite or NaN, of shape \(2,\); got \[1.0\]"),
    (
        lambda: walker().update([1.0, np.inf]),
        r"reading must be finite or NaN, of shape \(2,\); got \[1.0, inf\]",
    ),
    (
        lambda: walker(prior=KNOWN).update([1.0, 2.0], [1.0, 0.0]),
        r"reading must be finite or NaN, of shape \(1,\)",
    ),
    (lambda: walker(prior=KNOWN).update(1.0, [1.0]), r"row must be of shape \(2,\); got \(1,\)"),
    (
        lambda: walker().update(1.0, [1.0, 0.0]),
        "prior must be given, with finite variances, where rows are read; got None",
    ),
    (
        lambda: walker(prior=KNOWN, noise_variance=[1.0, 2.0]).update(1.0, [1.0, 0.0]),
        r"noise_variance must be one number > 0 where rows are read; got \[1.0, 2.0\]",
    ),
]
KNOWN = identify.Estimate(("a", "b"), [0.0, 0.0], np.eye(2))


def walker(**changes):
    return identify.RandomWalk(("a", "b"), **{"walk_variance": 1.0, "noise_variance": 1.0} | changes)


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
