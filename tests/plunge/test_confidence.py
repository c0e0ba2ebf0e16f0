"""Plans that keep a confidence: chances, safe rates, prices; three methods and brute force."""

from math import inf

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from plunge_inside import BurnChance

import sdpgrind
from sdpgrind import plunge

KNOWN = plunge.preset("simulation").replace(sharpness_sd=0.0)
CORE, MOST = KNOWN.model.core, KNOWN.command_rate_max
# of the project's derivation: sd of ln B, safe rates (mm/s) at 0, 0.02 and 0.06 mm, time and price (s)
ROWS = [
    (0.0, (0.008257, 0.015628, 0.031630), 12.0195, 0.0),
    (0.01, (0.007250, 0.014509, 0.030050), 12.1286, 0.109),
    (0.02, (0.006257, 0.013439, 0.028537), 12.2740, 0.254),
    (0.03, (0.005256, 0.012415, 0.027087), 12.4643, 0.445),
    (0.045, (0.003597, 0.010961, 0.025025), 12.8701, 0.851),
]


@pytest.mark.parametrize(("sd", "rates", "time", "price"), ROWS)
def test_safe_rates_and_times(sd, rates, time, price):
    problem = KNOWN.replace(burning_sd=sd)
    found = [problem.safe_rate(r, 0.999) for r in (0.0, 0.02, 0.06)]
    np.testing.assert_allclose(found, rates, rtol=1e-4)
    best = plunge.plan(problem, confidence=0.999)
    assert best.time == pytest.approx(time, abs=2e-4) and best.error < 1e-9
    assert best.price["all"] == pytest.approx(price, abs=6e-4)


def test_three_doubts_by_quadrature():
    problem = KNOWN.replace(burning_sd=0.02, diffusivity_sd=0.05, sharpness_sd=0.02)
    found = [problem.safe_rate(r, 0.999) for r in (0.0, 0.02, 0.06)]
    np.testing.assert_allclose(found, (0.006138, 0.013176, 0.027679), rtol=1e-4)


@pytest.mark.parametrize(
    "sds", [(0.02, 0.05, 0.02), (0.001, 0.05, 0.02), (0.0, 0.2, 0.02), (0.0, 0.05, 0.1), (0.02, 0.0, 0.0)]
)
def test_chance_against_draws(sds):
    """Whichever doubt is integrated exactly; 4e6 draws know a chance of 1e-3 to 1.6 percent."""
    chance, (of_b, of_alpha, of_area) = BurnChance(CORE, *sds), sds
    rate, rng, hits = chance.safe_rate(0.02, 0.999, MOST), np.random.default_rng(5), 0
    for _ in range(8):
        eta, alpha, area = rng.standard_normal((3, 500_000))
        heat = CORE.heat0 + CORE.heat1 * rate + CORE.heat2 * np.exp(of_area * area) * rate**CORE.p
        depth = CORE.reach * rate**0.25 * np.exp(0.5 * of_alpha * alpha)
        hits += np.count_nonzero(depth * (np.log(heat / rate**0.25) + of_b * eta) > 0.02)
    assert hits / 4e6 == pytest.approx(1e-3, rel=5 * 0.016)


@settings(max_examples=40)
@given(
    sds=st.tuples(*[st.floats(0.0, 0.1)] * 3),
    rate=st.floats(0.004, MOST),
    confidence=st.floats(0.9, 0.9999),
)
@example(sds=(2.2e-311, 0.0, 0.0), rate=0.03125, confidence=0.9375)
@example(sds=(0.0, 0.0, 2.2e-311), rate=0.03125, confidence=0.9375)
def test_the_quantile_is_where_the_chance_is(sds, rate, confidence):
    chance = BurnChance(CORE, *sds)
    depth = float(chance.quantile(np.array([rate]), confidence)[0])
    if depth > 1e-9:
        assert float(chance(rate, depth * (1 - 1e-6))) >= (1 - confidence) * (1 - 1e-6)
        assert float(chance(rate, depth * (1 + 1e-6))) <= (1 - confidence) * (1 + 1e-6)
    else:
        assert float(chance(rate, 1e-9)) <= 1 - confidence


@pytest.mark.parametrize("gauge", [True, False])
def test_dynamic_programming_finds_the_same(gauge):
    problem = KNOWN.replace(burning_sd=0.03, diffusivity_sd=0.05, sharpness_sd=0.05)
    best = plunge.plan(problem, confidence=0.999, gauge=gauge)
    stages = plunge.plan(problem, confidence=0.999, gauge=gauge, method="dp", steps=120)
    assert abs(stages.time - best.time) < 2 * stages.error < 0.02


def test_collocation_finds_the_same():
    problem = KNOWN.replace(burning_sd=0.03)
    best = plunge.plan(problem, confidence=0.999)
    other = plunge.plan(problem, confidence=0.999, method="collocation", steps=60)
    assert abs(other.time - best.time) < 2 * other.error < 0.02


def test_every_rate_of_a_plan_is_safe():
    problem = KNOWN.replace(burning_sd=0.03, diffusivity_sd=0.05, sharpness_sd=0.1)
    course = plunge.plan(problem, confidence=0.999).trajectory
    fed = course.isel(time=course.infeed_rate.values > 0.0)
    chance = problem.burn_chance(fed.infeed_rate.values, fed.remaining.values)
    assert 0.99e-3 < chance.max() <= 1.0001e-3


def test_prices_by_name():
    problem = plunge.preset("simulation").replace(burning_sd=0.03, diffusivity_sd=0.05)
    best, blind = (plunge.plan(problem, confidence=0.999, gauge=gauge) for gauge in (True, False))
    assert list(best.price) == ["burning_sd", "diffusivity_sd", "sharpness_sd", "all"]
    assert list(blind.price)[3:] == ["contact_zero_sd", "deflection_sd", "all"]
    assert best.price["all"] == pytest.approx(best.time - 12.0195, abs=2e-4)
    assert blind.time > best.time and all(seconds > 0.0 for seconds in blind.price.values())


def test_the_page_tells_the_price():
    """0.851 s of 12.0195; a series grinds no faster than that before it is inspected."""
    page = str(plunge.plan(KNOWN.replace(burning_sd=0.045), confidence=0.999))
    told = "The doubts cost 0.851 s, 7.1 % of the cycle without them; most of it burning_sd, 0.851 s alone"
    assert f"{told}: inspecting parts for burn narrows it." in page
    mixed = KNOWN.replace(burning_sd=0.01, diffusivity_sd=0.05, sharpness_sd=0.1)
    assert "most of it sharpness_sd, " in str(plunge.plan(mixed, confidence=0.999))
    for certain in (plunge.plan(KNOWN), plunge.plan(KNOWN, confidence=0.999)):
        assert "The doubts cost" not in str(certain)


def test_a_confident_plan_is_saved(tmp_path):
    best = plunge.plan(KNOWN.replace(burning_sd=0.02), confidence=0.99)
    best.save(tmp_path / "plan.nc")
    again = sdpgrind.load(tmp_path / "plan.nc")
    assert (again.confidence, again.gauge, again.problem) == (0.99, True, best.problem)
    assert again.time == best.time and again.price == best.price


def test_refusals():
    with pytest.raises(
        ValueError, match=r"burning_sd must be at most 0.0515 for a confidence of 0.999 .*got 0.06"
    ):
        plunge.plan(KNOWN.replace(burning_sd=0.06), confidence=0.999)
    with pytest.raises(ValueError, match=r"confidence must be in \[0.5, 1\), such as 0.999; got 99"):
        KNOWN.safe_rate(0.0, 99)
    with pytest.raises(ValueError, match="confidence must be given where gauge=False"):
        plunge.plan(KNOWN, gauge=False)
    with pytest.raises(
        ValueError, match="confidence must be None where the rotation is free or the model has wear"
    ):
        plunge.plan(KNOWN.replace(wear=plunge.Wear(0.02)), confidence=0.999, method="dp")
    with pytest.raises(ValueError, match=r"burning_sd must be <= 0.5 \(0.03 for 3 %\)"):
        plunge.Uncertainty(burning_sd=3.0)


def test_drawn_models_scatter_as_declared():
    problem = KNOWN.replace(
        burning_sd=0.03, diffusivity_sd=0.05, sharpness_sd=0.1, deflection_sd=0.08, wheel_wear_sd=0.02,
        grinding_ratio=20.0,
    )  # fmt: skip
    rng, model = np.random.default_rng(2), problem.model
    drawn = [problem.draw(rng) for _ in range(2000)]

    def spread(of):
        return np.std([np.log(of(each) / of(model)) for each in drawn])

    assert spread(lambda m: m.burning.B) == pytest.approx(0.03, rel=0.08)  # 5 sd of the sd of 2000
    assert spread(lambda m: m.diffusivity) == pytest.approx(0.05, rel=0.08)
    assert spread(lambda m: m.wear_flat_area) == pytest.approx(0.1, rel=0.08)
    assert spread(lambda m: m.normal_force_ratio) == pytest.approx(0.08, rel=0.08)
    assert np.std([m.wheel_wear for m in drawn]) == pytest.approx(0.02, rel=0.08)
    assert KNOWN.draw(1).replace(normal_force_ratio=KNOWN.model.normal_force_ratio).grinding_ratio == inf
