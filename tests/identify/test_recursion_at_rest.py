"""Recursive least squares where nothing new is seen and the old is forgotten: right to the digits, or said to
be lost.
"""

import numpy as np
import pytest

from sdpgrind import identify
from sdpgrind.weldbead import PowerEstimator

SIGMA = 0.01
VARIED = 50
LEFT = 1e-6  # of a row's information: the prior of the covariance form


def rows_of(size, still):
    """Rows [1, x] or [1, cos, sin] that vary, then the last of them again and again."""
    x = np.linspace(0.0, 1.0, VARIED)
    varied = np.column_stack(
        [np.ones(VARIED), x] if size == 2 else [np.ones(VARIED), np.cos(5 * x), np.sin(5 * x)]
    )
    rows = np.vstack([varied, np.repeat(varied[-1:], still, axis=0)])
    return rows, rows @ np.arange(1.0, size + 1) + SIGMA * np.random.default_rng(0).standard_normal(len(rows))


def exact(rows, targets, forgetting, prior=0.0):
    """Value, covariance for noise of variance 1, and variance of the noise found, without a loss of digits.

    In turned axes the still rows are (length, 0, ...) exactly, and what fades is scaled by how much it has:
    the scaled problem is well conditioned however long the rest."""
    count, size = rows.shape
    still = count - VARIED
    turn = np.linalg.qr(np.column_stack([rows[-1], np.eye(size)[:, : size - 1]]))[0]
    inside = np.vstack([rows, np.sqrt(prior) * np.eye(size)]) @ turn
    inside[VARIED - 1 : count, 1:] = 0.0
    weights = np.append(forgetting ** np.arange(count - 1.0, -1.0, -1.0), np.full(size, forgetting**count))
    faded = np.append(1.0, np.full(size - 1, forgetting ** (-0.5 * still)))
    weighted, goal = (
        inside * np.sqrt(weights)[:, None] * faded,
        np.append(targets, np.zeros(size)) * np.sqrt(weights),
    )
    value = np.linalg.lstsq(weighted, goal)[0]
    inverse = np.linalg.inv(weighted.T @ weighted)
    sandwich = inverse @ ((weighted * weights[:, None]).T @ weighted) @ inverse
    freedom = weights[:count].sum() - np.trace(inverse @ (weighted * weights[:, None]).T @ weighted)
    back = turn * faded
    return back @ value, back @ sandwich @ back.T, np.sum((goal - weighted @ value) ** 2) / freedom


def courses(size, forgetting, still, known, method="square_root"):
    """Estimates after each still row, and how they compare: largest errors of standard deviations and values,
    in these; of a long rest, in which errors grow by a tenth in five rows, after each fifth row.
    """
    every = 5 if still >= 2000 else 1
    rows, targets = rows_of(size, still)
    names, prior = ("radius", "center_x", "center_y")[:size], None
    if method == "covariance":
        prior = identify.Estimate(names, np.zeros(size), SIGMA**2 / LEFT * np.eye(size))
    rls = identify.RecursiveLeastSquares(
        names, forgetting=forgetting, prior=prior, noise_sd=SIGMA if known else None, method=method
    )
    for k, (row, target) in enumerate(zip(rows, targets, strict=True)):
        rls.update(row, target)
        if k >= VARIED:
            estimate = rls.estimate
            if not estimate.ok or k % every:  # it says so: nothing to compare
                yield estimate, 0.0, 0.0
                continue
            value, unit, variance = exact(rows[: k + 1], targets[: k + 1], forgetting, LEFT if prior else 0.0)
            sd = np.sqrt(np.diag(unit) * (SIGMA**2 if known else variance))
            wide, off = estimate.sd / sd - 1, (estimate.value - value) / sd
            yield estimate, np.abs(wide).max(), np.abs(off).max()


COURSES = {  # size, forgetting, rows at rest, after how many of them four digits are still right
    "line": (2, 0.98, 2000, 1200),
    "ring": (3, 0.98, 2000, 1200),
    "ring, soon forgotten": (3, 0.8, 200, 105),
    "ring, forgotten at once": (3, 0.5, 90, 30),
}


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize(("size", "forgetting", "still", "right"), COURSES.values(), ids=COURSES)
def test_the_triangle_is_right_or_says_so(size, forgetting, still, right, known):
    found = list(courses(size, forgetting, still, known))
    good = np.array([estimate.ok for estimate, *_ in found])
    assert np.all(good[:right])
    assert np.all(np.diff(good.astype(int)) <= 0)  # once lost, lost while the rest lasts
    assert not good[-1] and "not determined" in found[-1][0].message
    assert max(wide for _, wide, _ in found[:right]) < 1e-4
    assert max(wide for _, wide, _ in found) < 0.01
    assert max(off for *_, off in found) < 0.01


@pytest.mark.parametrize(("size", "forgetting", "still", "right"), COURSES.values(), ids=COURSES)
def test_the_covariance_form_is_right_or_says_so_for_good(size, forgetting, still, right):
    found = list(courses(size, forgetting, still, True, "covariance"))
    good = np.array([estimate.ok for estimate, *_ in found])
    assert np.all(good[:right])
    assert np.all(np.diff(good.astype(int)) <= 0) and not good[-1]
    assert max(wide for _, wide, _ in found) < 0.01
    assert max(off for *_, off in found) < 0.01


def test_lost_is_lost_whether_or_not_anybody_looked():
    rows, targets = rows_of(3, 2000)
    prior = identify.Estimate(("a", "b", "c"), np.zeros(3), np.eye(3))
    made = {"forgetting": 0.98, "prior": prior, "noise_sd": SIGMA}
    rls = identify.RecursiveLeastSquares(prior.names, **made, method="covariance")
    again = identify.RecursiveLeastSquares(prior.names, **made)
    turning = rows_of(3, 0)
    for row, target in zip(np.vstack([rows, turning[0]]), np.append(targets, turning[1]), strict=True):
        rls.update(row, target)
        again.update(row, target)
    assert rls.estimate.status is identify.Status.UNDETERMINED and "wound up" in rls.estimate.message
    rls.reset()
    assert rls.estimate.ok
    assert again.estimate.ok  # the triangle has forgotten its rounding with the rest


def test_the_triangle_finds_back():
    rows, targets = rows_of(2, 3000)
    varied, read = rows_of(2, 0)
    rls = identify.RecursiveLeastSquares(("start", "slope"), forgetting=0.98, noise_sd=SIGMA)
    for row, target in zip(np.vstack([rows, varied]), np.append(targets, read), strict=True):
        rls.update(row, target)
    weights = 0.98 ** np.arange(299.0, -1.0, -1.0)
    late, goal = np.vstack([rows[-250:], varied]), np.append(targets[-250:], read)
    inverse = np.linalg.inv((late * weights[:, None]).T @ late)
    np.testing.assert_allclose(
        rls.estimate.value, inverse @ (late * weights[:, None]).T @ goal, atol=0.1 * SIGMA
    )
    sandwich = inverse @ ((late * weights[:, None] ** 2).T @ late) @ inverse
    np.testing.assert_allclose(rls.estimate.sd, SIGMA * np.sqrt(np.diag(sandwich)), rtol=0.01)


def test_a_weld_at_constant_power():
    rng = np.random.default_rng(0)
    estimator = PowerEstimator(forgetting=0.95)
    powers = np.append(rng.uniform(200.0, 400.0, 40), np.full(1500, 300.0))
    for k, power in enumerate(powers):
        estimator.update(
            grinding_power=power, removal_rate=(power - 100.0) / 10.0 + 0.1 * rng.standard_normal()
        )
        if k >= 3:
            estimate = estimator.estimate
            assert np.all(np.diag(estimate.covariance) >= 0)
            assert not estimate.ok or np.all(np.diag(estimate.covariance) > 0)
    assert not estimate.ok
