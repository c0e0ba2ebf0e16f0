"""Alignment of commands where the lag is no linear one: told by the law that fits, or not at all."""

import numpy as np
import pytest
from cycle_readings import EXPERIMENT, NOMINAL
from scipy.integrate import solve_ivp

from sdpgrind import plunge

STEP = 0.05
TIME = STEP * np.arange(349)
RATE = np.select([TIME < 6.4 - 1e-9, TIME < 9.4 - 1e-9], [0.0448, 0.01], 0.0)


@pytest.fixture(scope="module")
def clean():
    """Sizes (mm) of the grinder of the preset, which deflects by the power of its rate, by an integrator."""
    model, sizes = NOMINAL.model, [0.0]
    infeed = np.append(0.0, np.cumsum(RATE[:-1])) * STEP
    for k in range(TIME.size - 1):
        start, held = infeed[k], RATE[k]
        end = solve_ivp(
            lambda t, s, start=start, held=held: [model.infeed_rate(max(start + held * t - s[0], 0.0))],
            (0.0, STEP),
            sizes[-1:],
            rtol=1e-6,
            atol=1e-9,
        )
        sizes.append(float(end.y[0, -1]))
    return np.array(sizes)


def recorded(clean, way, seed):
    before = np.append(RATE[:1], RATE[:-1])
    rate = {"begin": RATE, "centre": (RATE + before) / 2, "end": before}[way]
    size = clean + np.random.default_rng(seed).normal(0.0, 5e-4, clean.size)
    return {"time": TIME, "command_rate": rate, "size": size}


@pytest.mark.parametrize("way", ["begin", "centre", "end"])
def test_the_deflection_of_the_model_tells_the_alignment(clean, way):
    """A linear lag fitted to these sizes told 25 of 40 files "centre" where they were recorded at the beginning.

    Of a log that is to be read again, no lag, no bend and no plan is told: a linear one of 1.7 s "bent" in 44 of 60.
    """
    for seed in range(3):
        found = NOMINAL.doubts(recorded(clean, way, seed))
        assert found.alignment == way
        for words in ("To plan with", "A linear lag does not fit all rates"):
            assert any(words in sentence for sentence in found.sentences) == (way == "begin")


def test_a_linear_lag_that_does_not_fit_tells_no_alignment(clean):
    """Also where the sums of squares differ enough."""
    said = [EXPERIMENT.doubts(recorded(clean, "begin", seed)) for seed in range(4)]
    assert {doubts.alignment for doubts in said} == {"not sure"}
    words = "neither confirm nor reject: the law of the model fits them with no alignment"
    assert any(words in doubts.sentences[0] for doubts in said)


@pytest.mark.parametrize("what", ["contact_zero", "normal_force_ratio", "time_constant"])
def test_a_value_that_rests_on_a_deflection_that_does_not_fit_says_so(clean, what):
    """As `doubts` does: noise of 0.5 um, a linear lag of 1.9 s; of 60 files each all, and none of the model's own."""
    words = "a linear lag fits the sizes better than the deflection of the model"
    infeed, pole, lag = np.append(0.0, np.cumsum(RATE[:-1])) * STEP, np.exp(-STEP / 1.9), [0.0]
    for rate in RATE[:-1]:
        lag.append(pole * lag[-1] + rate * 1.9 * (1 - pole))
    for sizes, said in ((clean, False), (infeed - np.array(lag), True)):
        fit = plunge.identify(recorded(sizes, "begin", 0), what, problem=NOMINAL)
        assert fit.ok and (words in fit.message) == said
