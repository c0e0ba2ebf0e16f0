"""Recursive least squares against the objective that it claims to minimise, at every step and in both forms."""

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import identify

NAMES = ("radius", "center_x", "center_y")
SIGMA = 0.04


def ring(seed, count=30):
    """Rows [1, cos, sin] and readings of a turning ring, mm."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 4, count))
    rows = np.column_stack([np.ones(count), np.cos(angle), np.sin(angle)])
    return rows, rows @ [61.94, 0.5, -0.2] + SIGMA * rng.standard_normal(count)


def drawn_prior(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    return identify.Estimate(NAMES, [62.0, 0.1, 0.1], 0.05 * (root @ root.T) + 0.01 * np.eye(3))


def argmin(rows, targets, weights, prior, left):
    """Value of least cost, as a stacked weighted least-squares problem; `left` is the weight of the prior."""
    root = np.linalg.cholesky(np.linalg.inv(prior.covariance / SIGMA**2)).T * np.sqrt(left)
    stacked = np.vstack([rows * np.sqrt(weights)[:, None], root])
    return np.linalg.lstsq(stacked, np.append(targets * np.sqrt(weights), root @ prior.value))[0]


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    fading=st.lists(st.sampled_from([1.0, 0.98, 0.9, 0.6]), min_size=30, max_size=30),
)
@pytest.mark.parametrize("method", ["square_root", "covariance"])
def test_least_of_its_objective_at_every_step(method, seed, fading):
    rows, targets = ring(seed)
    prior = drawn_prior(seed + 1)
    rls = identify.RecursiveLeastSquares(NAMES, prior=prior, noise_sd=SIGMA, method=method)
    weights, left = np.zeros(0), 1.0
    for k, (row, target, forgetting) in enumerate(zip(rows, targets, fading, strict=True)):
        rls.update(row, target, forgetting)
        weights, left = np.append(weights * forgetting, 1.0), left * forgetting
        wanted = argmin(rows[: k + 1], targets[: k + 1], weights, prior, left)
        np.testing.assert_allclose(rls.estimate.value, wanted, rtol=0, atol=1e-8)


@pytest.mark.parametrize("method", ["square_root", "covariance"])
def test_covariance_counts_weights_as_weights(method):
    # The value is linear in readings and prior mean: its covariance follows from its slopes, which are exact
    # differences.
    rows, targets = ring(3, 12)
    prior = drawn_prior(4)

    def value(targets, mean):
        rls = identify.RecursiveLeastSquares(
            NAMES, prior=prior.replace(value=mean), noise_sd=SIGMA, forgetting=0.8, method=method
        )
        for row, target in zip(rows, targets, strict=True):
            rls.update(row, target)
        return rls.estimate

    found = value(targets, prior.value)
    by_reading = np.array([value(targets + unit, prior.value).value - found.value for unit in np.eye(12)]).T
    by_mean = np.array([value(targets, prior.value + unit).value - found.value for unit in np.eye(3)]).T
    wanted = SIGMA**2 * by_reading @ by_reading.T + by_mean @ prior.covariance @ by_mean.T
    np.testing.assert_allclose(found.covariance, wanted, rtol=1e-7, atol=1e-12)
    assert found.freedom == np.inf


@pytest.mark.parametrize("forgetting", [1.0, 0.9])
def test_same_as_by_orthogonal_triangles_of_numpy(forgetting):
    rows, targets = ring(5, 25)
    rls = identify.RecursiveLeastSquares(NAMES, forgetting=forgetting)
    triangle = np.zeros((4, 4))
    for k, (row, target) in enumerate(zip(rows, targets, strict=True)):
        rls.update(row, target)
        triangle = np.linalg.qr(np.vstack([triangle * np.sqrt(forgetting), np.append(row, target)]), mode="r")
        weights = forgetting ** np.arange(k, -1, -1.0)
        if k < 3:
            assert not rls.estimate.ok
            continue
        value = np.linalg.solve(triangle[:3, :3], triangle[:3, 3])
        np.testing.assert_allclose(rls.estimate.value, value, rtol=1e-9, atol=1e-9)
        inverse = np.linalg.inv(rows[: k + 1].T @ (weights[:, None] * rows[: k + 1]))
        sandwich = inverse @ (rows[: k + 1].T @ (weights[:, None] ** 2 * rows[: k + 1])) @ inverse
        squares = np.sum(weights * (targets[: k + 1] - rows[: k + 1] @ value) ** 2)
        noise = squares / (
            weights.sum() - np.trace(inverse @ (rows[: k + 1].T @ (weights[:, None] ** 2 * rows[: k + 1])))
        )
        np.testing.assert_allclose(rls.estimate.covariance, noise * sandwich, rtol=2e-4)
        assert rls.estimate.freedom == pytest.approx(max(weights.sum() ** 2 / np.sum(weights**2) - 3, 1))


def test_a_prior_that_knows_the_radius_alone():
    rows, targets = ring(6, 10)
    prior = identify.Estimate(NAMES, [61.94, 0.0, 0.0], np.diag([1e-4**2, np.inf, np.inf]))
    rls = identify.RecursiveLeastSquares(NAMES, prior=prior, noise_sd=SIGMA)
    assert not rls.estimate.ok
    for row, target in zip(rows, targets, strict=True):
        rls.update(row, target)
    centre = np.linalg.lstsq(rows[:, 1:], targets - 61.94)[0]
    np.testing.assert_allclose(rls.estimate.value[1:], centre, atol=2e-5)
    assert rls.estimate.sd[0] == pytest.approx(1e-4, rel=1e-3)


def test_known_noise_without_a_prior():
    rows, targets = ring(7)
    rls = identify.RecursiveLeastSquares(NAMES, noise_sd=SIGMA)
    for row, target in zip(rows, targets, strict=True):
        rls.update(row, target)
    batch = identify.least_squares(rows, targets, noise_sd=SIGMA)
    np.testing.assert_allclose(rls.estimate.value, batch.value, rtol=1e-10)
    np.testing.assert_allclose(rls.estimate.covariance, batch.covariance, rtol=1e-8)


@pytest.mark.parametrize("method", ["square_root", "covariance"])
def test_reset_goes_back_to_the_prior_and_copies_are_their_own(method):
    prior = drawn_prior(0)
    rls = identify.RecursiveLeastSquares(NAMES, prior=prior, noise_sd=SIGMA, method=method)
    np.testing.assert_allclose(rls.estimate.value, prior.value, rtol=1e-9)
    np.testing.assert_allclose(rls.estimate.covariance, prior.covariance, rtol=1e-7)
    twin = copy.deepcopy(rls)
    rls.update([1.0, 0.0, 1.0], 60.0)
    np.testing.assert_allclose(twin.estimate.value, prior.value, rtol=1e-9)
    before = rls.estimate
    rls.reset()
    assert rls.count == 0
    np.testing.assert_allclose(rls.estimate.value, prior.value, rtol=1e-9)
    rls.update([1.0, 0.0, 1.0], 60.0)
    np.testing.assert_array_equal(rls.estimate.value, before.value)


def at_rest(method, count, forgetting):
    prior = identify.Estimate(NAMES, np.zeros(3), 1e3 * np.eye(3))
    rls = identify.RecursiveLeastSquares(
        NAMES, prior=prior, noise_sd=1.0, forgetting=forgetting, method=method
    )
    for _ in range(count):
        rls.update([1.0, np.cos(0.7), np.sin(0.7)], 1.0)
    return rls.estimate


def test_what_winds_up_is_said_to_be():
    fading = at_rest("covariance", 2000, 0.5)  # beyond the largest number
    assert fading.status is identify.Status.UNDETERMINED
    assert "wound up" in fading.message
    assert np.all(np.isfinite(fading.value))
    assert np.trace(at_rest("square_root", 3000, 1.0).covariance) == pytest.approx(2e3, rel=1e-3)
    faded = at_rest("square_root", 3000, 0.98)
    assert faded.status is identify.Status.UNDETERMINED  # nothing of the prior is left
    assert np.all(np.isfinite(faded.value))


def test_what_is_not_determined_is_named():
    rows, targets = ring(0)
    rows[:, 2] = 2 * rows[:, 1]
    with pytest.raises(
        ValueError,
        match=r"do not determine all values: take points .* \(not determined: center_x, center_y\)",
    ):
        identify.least_squares(rows, targets, names=NAMES)
    rls = identify.RecursiveLeastSquares(NAMES)
    for row, target in zip(rows, targets, strict=True):
        rls.update(row, target)
    assert rls.estimate.message.endswith("(not determined: center_x, center_y)")


def made(**changes):
    given = {"prior": drawn_prior(0), "noise_sd": SIGMA} | changes
    return identify.RecursiveLeastSquares(NAMES, **given)


FLAT = identify.Estimate(NAMES, np.zeros(3), np.diag([1.0, np.inf, np.inf]))
MESSAGES = [
    ({"forgetting": 0.0}, r"forgetting must be in \(0, 1\] \(1\); got 0.0"),
    ({"forgetting": 1.1}, r"forgetting must be in \(0, 1\] \(1\); got 1.1"),
    ({"noise_sd": 0.0}, "noise_sd must be > 0; got 0.0"),
    ({"noise_sd": None}, "noise_sd must be given with a prior, which is weighed by it; got None"),
    ({"method": "qr"}, "method must be one of square_root, covariance; got 'qr'"),
    (
        {"prior": identify.Estimate(("a",), [0.0], [[1.0]])},
        "prior must be an estimate of radius, center_x, center_y; got 'a'",
    ),
    (
        {"prior": identify.Estimate(NAMES, np.zeros(3), np.diag([1.0, -1.0, 1.0]))},
        r"variance of center_x in the prior must be > 0; got -1.0",
    ),
    (
        {
            "prior": identify.Estimate(
                NAMES, np.zeros(3), np.ones((3, 3)) + np.eye(3) * -1e-3 + 1e-3 * np.ones((3, 3))
            )
        },
        "prior must have a positive definite covariance",
    ),
    (
        {"prior": None, "method": "covariance"},
        "prior must be given, with finite variances, for method covariance; got None",
    ),
    (
        {"prior": FLAT, "method": "covariance"},
        "prior must be given, with finite variances, for method covariance",
    ),
]


@pytest.mark.parametrize(("changes", "message"), MESSAGES)
def test_messages(changes, message):
    with pytest.raises(ValueError, match=message):
        made(**changes)


def test_messages_of_update():
    with pytest.raises(ValueError, match=r"forgetting must be in \(0, 1\] \(1\); got -0.5"):
        made().update([1.0, 0.0, 0.0], 1.0, forgetting=-0.5)
    with pytest.raises(TypeError, match=r"prior must be an Estimate; got 3\.0"):
        made(prior=3.0)
