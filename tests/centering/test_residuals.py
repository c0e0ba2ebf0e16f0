"""Checks of what a fit leaves, against statsmodels, and the source's normality argument, which validates
nothing.
"""

import numpy as np
import pytest
from statsmodels.stats.diagnostic import acorr_ljungbox, normal_ad
from statsmodels.tsa.stattools import acf

from centering.circle import residual_checks
from sdpgrind.base import stored

LINES = {
    43: 0.235,
    3: 0.206,
    2: 0.155,
    6: 0.048,
    44: 0.040,
    21: 0.038,
    22: 0.036,
    42: 0.029,
    4: 0.018,
    18: 0.018,
}
"""Table 6.5: undulations per revolution -> amplitude, um."""


def samples(kind, count=360, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(5.0, 0.01, count) if kind == "normal" else np.cumsum(rng.uniform(-1, 1, count))


def form(rng):
    """A turn of the part of Table 6.5 with random phases, mm."""
    angle = np.arange(360) * np.pi / 180
    return 1e-3 * sum(a * np.cos(n * angle - rng.uniform(0, 2 * np.pi)) for n, a in LINES.items())


@pytest.mark.parametrize("kind", ["normal", "walk"])
@pytest.mark.parametrize("count", [8, 60, 360])
def test_against_statsmodels(kind, count):
    left = samples(kind, count)
    found, lags = residual_checks(left), min(10, count // 5)
    square, _ = normal_ad(left)
    assert found.anderson_darling == pytest.approx(square * (1 + 0.75 / count + 2.25 / count**2), rel=1e-9)
    box = acorr_ljungbox(left, [lags])
    assert found.lags == lags and found.samples == count
    assert found.ljung_box == pytest.approx(box.lb_stat.iloc[0], rel=1e-9)
    assert found.probability == pytest.approx(box.lb_pvalue.iloc[0], rel=1e-9, abs=1e-300)
    assert found.lag_1 == pytest.approx(acf(left, nlags=1, fft=False)[1], abs=1e-12)


def test_more_lags():
    left = samples("normal")
    assert residual_checks(left, lags=40).ljung_box == pytest.approx(
        acorr_ljungbox(left, [40]).lb_stat.iloc[0], rel=1e-9
    )


def test_unit_and_mean_do_not_matter():
    left = samples("normal")
    one, other = residual_checks(left), residual_checks(1e3 * left - 7)
    assert other.anderson_darling == pytest.approx(one.anderson_darling, rel=1e-9)
    assert other.ljung_box == pytest.approx(one.ljung_box, rel=1e-9)


def test_levels_are_true():
    """One normal sample of twenty is refused by each check."""
    rng = np.random.default_rng(1)
    found = [residual_checks(rng.normal(size=100)) for _ in range(2000)]
    scatter = np.sqrt(0.05 * 0.95 / 2000)
    assert np.mean([not one.normal for one in found]) == pytest.approx(0.05, abs=4 * scatter)
    assert np.mean([not one.independent for one in found]) == pytest.approx(0.05, abs=4 * scatter)


def test_normal_and_uniform_are_told_apart():
    """n = 360: normal median 0.34 (5-95 %: 0.17-0.77), uniform 4.0 (3.0-5.7)."""
    rng = np.random.default_rng(2)
    normal = [residual_checks(rng.normal(size=360)).anderson_darling for _ in range(1000)]
    uniform = [residual_checks(rng.uniform(size=360)).anderson_darling for _ in range(1000)]
    assert np.quantile(normal, [0.05, 0.5, 0.95]) == pytest.approx([0.17, 0.34, 0.77], abs=0.05)
    assert np.quantile(uniform, [0.05, 0.5, 0.95]) == pytest.approx([3.0, 4.15, 5.7], abs=0.25)


def test_pure_form_passes_for_normal_noise():
    """79 % of parts of Table 6.5 with random phases are "normal"; their residuals have nothing independent
    about them.
    """
    rng = np.random.default_rng(3)
    found = [residual_checks(form(rng)) for _ in range(1000)]
    assert np.mean([one.normal for one in found]) == pytest.approx(0.79, abs=4 * np.sqrt(0.79 * 0.21 / 1000))
    assert not any(one.independent for one in found)
    lags, squares = np.array([one.lag_1 for one in found]), {n: a * a for n, a in LINES.items()}
    power = sum(squares.values())
    # of a turn that closes, of any phases
    lag = sum(square * np.cos(np.radians(n)) for n, square in squares.items()) / power
    # at most, of the one product that an open turn lacks
    closing = sum(LINES.values()) ** 2 / (360 * power / 2)
    assert np.abs(lags - lag).max() <= closing < 0.03
    assert lags.mean() == pytest.approx(lag * (1 - 1 / 360), abs=4 * lags.std() / np.sqrt(1000))
    assert found[0].inflation == pytest.approx(np.sqrt((1 + lags[0]) / (1 - lags[0])), rel=1e-12)


def test_inflation():
    """sqrt((1 + lag)/(1 - lag)): the sd of a mean of AR(1) noise over that of independent noise."""
    rng, held = np.random.default_rng(4), 0.6
    noise = np.zeros((2000, 400))
    for k in range(1, 400):
        noise[:, k] = held * noise[:, k - 1] + rng.normal(size=2000)
    means = noise[:, 100:].mean(axis=1).std() / (noise[:, 100:].std() / np.sqrt(300))
    found = np.mean([residual_checks(row[100:]).inflation for row in noise[:300]])
    assert found == pytest.approx(means, rel=0.05)
    assert residual_checks(samples("normal")).inflation < 1.2
    assert residual_checks(np.tile([1.0, -1.0], 20)).inflation == 1.0


def test_saved_and_loaded():
    found = residual_checks(samples("normal"))
    assert stored.decode(stored.encode(found)) == found


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: residual_checks(np.arange(7.0)), r"residual must be at least 8 residuals; got 7"),
        (lambda: residual_checks(np.full(20, 3.0)), r"residual must be not all the same \(mm\); got 3\.0"),
        (lambda: residual_checks([*range(9), np.nan]), r"residual\[9\] must be finite \(mm\); got nan"),
        (
            lambda: residual_checks(np.arange(9.0), lags=9),
            r"lags must be < the number of residuals, 9; got 9",
        ),
        (lambda: residual_checks(np.arange(9.0), lags=0), r"lags must be >= 1; got 0"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()
