"""Coefficients and scatter from passes: known biases, honest covariances, the loop back to the problem."""

import numpy as np
import pytest

from sdpgrind import identify, sdp, weldbead

P1 = weldbead.preset("P1")
BASE = P1.model
DROOPY = BASE.replace(free_speed=560.0, speed_droop=0.1)
FORCES, FEEDS = np.tile([12.0, 20.0, 35.0, 50.0], 60), np.repeat([3.0, 6.0, 12.5], 80)


def power_data(noise, n=2000, seed=0):
    """Readings of K1 = 10, K2 = 100 at 5..40 mm^3/s, relative noise on the removal rate."""
    true = np.linspace(5, 40, n)
    rate = true * (1 + noise * np.random.default_rng(seed).standard_normal(n))
    return {"grinding_power": 10 * true + 100, "removal_rate": rate}


def pass_data(attribution, relative_sd, process=BASE, law="rayleigh", seed=0):
    scatter = weldbead.Scatter(attribution, relative_sd, law=law)
    depth = scatter.cut(process, FORCES, FEEDS).sample(seed)
    return {"normal_force": FORCES, "feed_rate": FEEDS, "cut_depth": depth}


@pytest.mark.parametrize(("noise", "k1", "k2"), [(0.1, 9.44, 112), (0.2, 8.11, 142)])
def test_the_printed_direction_is_biased(noise, k1, k2):
    fits = [
        weldbead.identify(power_data(noise, seed=seed), "power", method="printed").value for seed in range(20)
    ]
    assert np.mean(fits, axis=0)[0] == pytest.approx(k1, abs=0.05)
    assert np.mean(fits, axis=0)[1] == pytest.approx(k2, abs=2.0)


def test_the_default_direction_is_not():
    fits = [weldbead.identify(power_data(0.1, n=200, seed=seed), "power") for seed in range(200)]
    values = np.array([fit.value for fit in fits])
    spread = values.std(axis=0, ddof=1)
    np.testing.assert_allclose(values.mean(axis=0), [10.0, 100.0], atol=4 * spread.max() / np.sqrt(200))
    # Noise in proportion to the rate, so the covariance (of constant noise) is right to some ten percent
    # only.
    np.testing.assert_allclose(np.mean([fit.sd for fit in fits], axis=0), spread, rtol=0.35)


def test_covariance_with_constant_noise():
    rng, power = np.random.default_rng(3), np.linspace(150, 600, 40)
    fits = [
        weldbead.identify(
            {"grinding_power": power, "removal_rate": (power - 100) / 10 + rng.normal(0, 1, 40)}, "power"
        )
        for _ in range(400)
    ]
    values = np.array([fit.value for fit in fits])
    np.testing.assert_allclose(
        np.mean([fit.sd for fit in fits], axis=0), values.std(axis=0, ddof=1), rtol=0.12
    )
    assert np.mean([fit.correlation[0, 1] for fit in fits]) == pytest.approx(
        np.corrcoef(values.T)[0, 1], abs=0.03
    )


def test_both_readings_noisy():
    rng, rate = np.random.default_rng(3), np.linspace(5, 40, 4000)
    data = {
        "grinding_power": 10 * rate + 100 + rng.normal(0, 30, rate.size),
        "removal_rate": rate + rng.normal(0, 2, rate.size),
    }
    total = weldbead.identify(data, "power", method="total", noise_ratio=15.0)
    assert np.all(np.abs(total.value - [10.0, 100.0]) < 4 * total.sd)
    for method in ("regression", "printed"):
        biased = weldbead.identify(data, "power", method=method)
        assert abs(biased["specific_energy"] - 10.0) > 4 * biased.sd[0]


def test_recursive_is_regression_and_forgets():
    data = power_data(0.1, n=200)
    batch, recursive = (weldbead.identify(data, "power", method=m) for m in ("regression", "recursive"))
    np.testing.assert_allclose(recursive.value, batch.value, rtol=1e-9)
    np.testing.assert_allclose(recursive.covariance, batch.covariance, rtol=1e-7)
    later = {"grinding_power": data["grinding_power"], "removal_rate": (data["grinding_power"] - 150) / 12}
    both = {name: np.r_[data[name], later[name]] for name in data}
    fresh = weldbead.identify(both, "power", method="recursive", forgetting=0.9)
    np.testing.assert_allclose(fresh.value, [12.0, 150.0], rtol=1e-6)


def test_streaming():
    data = power_data(0.1, n=50)
    estimator = weldbead.PowerEstimator()
    assert not estimator.estimate.ok
    for power, rate in zip(data["grinding_power"], data["removal_rate"], strict=True):
        estimator.update(grinding_power=power, removal_rate=rate)
    np.testing.assert_allclose(estimator.estimate.value, weldbead.identify(data, "power").value, rtol=1e-9)
    assert estimator.estimate.units == ("J/mm^3", "W")
    estimator.reset()
    assert not estimator.estimate.ok
    estimator.update(grinding_power=100.0, removal_rate=20.0)
    estimator.update(grinding_power=200.0, removal_rate=10.0)
    estimator.update(grinding_power=300.0, removal_rate=1.0)
    assert estimator.estimate.status is identify.Status.IMPOSSIBLE


def test_friction():
    rng, normal = np.random.default_rng(0), np.linspace(10, 50, 40)
    tangential = 0.3 * normal + rng.normal(0, 1, 40)
    fit = weldbead.identify({"normal_force": normal, "tangential_force": tangential}, "friction")
    assert fit["friction_ratio"] == pytest.approx(tangential @ normal / (normal @ normal), rel=1e-12)
    assert abs(fit["friction_ratio"] - 0.3) < 4 * fit.sd[0]
    assert fit.sd[0] == pytest.approx(1 / np.sqrt(normal @ normal), rel=0.3)
    estimator = weldbead.FrictionEstimator()
    for pair in zip(normal, tangential, strict=True):
        estimator.update(normal_force=pair[0], tangential_force=pair[1])
    np.testing.assert_allclose(estimator.estimate.value, fit.value, rtol=1e-12)


class FakeLog:
    """A log has tables by tier; a row without a reading is NaN."""

    def __init__(self, **columns):
        self._tables = {"sequence": columns}

    def __getitem__(self, tier):
        return self._tables[tier]


def test_rows_without_a_reading_are_dropped_and_counted():
    data = power_data(0.1, n=30)
    holed = {name: np.r_[np.nan, values, 1.0] for name, values in data.items()}
    holed["removal_rate"][-1] = np.nan
    fit = weldbead.identify(FakeLog(part=np.zeros(32), **holed), "power")
    np.testing.assert_allclose(fit.value, weldbead.identify(data, "power").value)
    assert fit.message == "from 30 passes, 2 more were of no use"


@pytest.mark.parametrize("name", ["C1", "K1", "K2", "mu"])
@pytest.mark.parametrize("process", [BASE, DROOPY], ids=["stiff", "droopy"])
@pytest.mark.parametrize("law", ["rayleigh", "lognormal"])
def test_the_right_coefficient_is_found(name, process, law):
    true = 0.3 if name == "K2" else 0.15
    wins = 0
    for seed in range(5):
        found = weldbead.identify(
            pass_data(name, true, process, law, seed), "scatter", model=process, law=law
        )
        assert abs(found[name] - true) < 4.5 * found.standard_error[found.names.index(name)]
        wins += name in found.plausible
    assert wins >= 4


def test_relative_sd_has_an_honest_error():
    found = [
        weldbead.identify(
            pass_data("C1", 0.15, law="lognormal", seed=s), "scatter", model=BASE, law="lognormal"
        )
        for s in range(30)
    ]
    values = np.array([f["C1"] for f in found])
    assert values.mean() == pytest.approx(0.15, abs=4 * values.std() / np.sqrt(30))
    assert np.mean([f.standard_error[0] for f in found]) == pytest.approx(values.std(ddof=1), rel=0.35)


def test_what_cannot_be_told_apart():
    # One force and one feed at the model's word: every attribution predicts one and the same scatter.
    one = {name: values[FORCES == 50.0][:20] for name, values in pass_data("C1", 0.15).items()}
    found = weldbead.identify(one, "scatter", method="model", model=BASE)
    assert set(found.plausible) == set(found.names)
    np.testing.assert_allclose(found.log_likelihood, found.log_likelihood[0], atol=1e-4)
    # C1 and mu are the same without droop: not told apart, and no matter.
    found = weldbead.identify(pass_data("C1", 0.15), "scatter", model=BASE)
    assert found["mu"] == pytest.approx(found["C1"], rel=1e-4)
    assert set(found.plausible) == {"C1", "mu"}
    assert found.distinguishable


def test_the_mean_is_fitted_or_believed():
    data = pass_data("K1", 0.15)
    wrong = BASE.replace(specific_energy=14.0)
    fitted = weldbead.identify(data, "scatter", model=wrong)
    assert fitted["K1"] == pytest.approx(0.15, abs=0.03)
    assert fitted.process.specific_energy == pytest.approx(10.0, rel=0.05)
    believed = weldbead.identify(data, "scatter", method="model", model=wrong)
    assert believed["K1"] > 0.3
    assert believed.process == wrong


def test_noise_of_the_depth_is_no_scatter():
    data = pass_data("K1", 0.15)
    noise = 0.04
    noisy = data | {"cut_depth": data["cut_depth"] + np.random.default_rng(9).normal(0, noise, FORCES.size)}
    corrected = weldbead.identify(noisy, "scatter", model=BASE, depth_noise=noise)
    assert corrected["K1"] == pytest.approx(0.15, abs=0.03)
    assert weldbead.identify(noisy, "scatter", model=BASE)["K1"] > corrected["K1"] * 1.1


@pytest.mark.parametrize(("wrong", "more"), [([-0.02], ""), ([-0.02, -0.015], ", and 1 more like it")])
def test_a_depth_below_zero_far_outside_the_scatter_is_refused_with_its_pass(wrong, more):
    """One of 240 made the scatter of C1 1.5 times as great, without a word."""
    data = pass_data("C1", 0.06)
    depth = data["cut_depth"].copy()
    depth[[3, 7][: len(wrong)]] = wrong  # of 50 N at 3 mm/s
    told = rf"got -0\.02 in the pass of normal_force 50 N and feed_rate 3 mm/s{more}: a wrong reading\?"
    with pytest.raises(ValueError, match=told):
        weldbead.identify(data | {"cut_depth": depth}, "scatter", model=BASE)


def test_a_depth_below_zero_that_is_alone_at_its_force_is_refused():
    """Without it all passes are of one force, and no line can be fitted."""
    force, feed = np.append(np.full(19, 30.0), 45.0), np.full(20, 10.0)
    depth = 0.1 * np.exp(0.1 * np.random.default_rng(0).standard_normal(20))
    alone = {"normal_force": force, "feed_rate": feed, "cut_depth": np.append(depth[:-1], -0.02)}
    with pytest.raises(ValueError, match=r"got -0\.02 in the pass of normal_force 45 N"):
        weldbead.identify(alone, "scatter", model=BASE)


def test_depths_below_zero_of_a_noisy_gauge_are_taken():
    """Light passes of like depth scatter as much, as the gauge does."""
    data = pass_data("C1", 0.06)
    noisy = data["cut_depth"] + np.random.default_rng(3).normal(0, 0.016, FORCES.size)
    assert np.sum(noisy < 0) == 1
    for known in (0.0, 0.016):
        weldbead.identify(data | {"cut_depth": noisy}, "scatter", model=BASE, depth_noise=known)


def test_forces_below_the_threshold_say_nothing():
    data = pass_data("K1", 0.15)
    more = {
        "normal_force": np.r_[data["normal_force"], 5.0, 7.0],
        "feed_rate": np.r_[data["feed_rate"], 6.0, 6.0],
        "cut_depth": np.r_[data["cut_depth"], 0.0, 0.0],
    }
    found = weldbead.identify(more, "scatter", model=BASE)
    assert found.message == "from 240 passes, 2 more were of no use"
    assert found.relative_sd == weldbead.identify(data, "scatter", model=BASE).relative_sd


def test_law_of_the_depths():
    data = pass_data("C1", 0.15, seed=4)
    smooth = weldbead.identify(data, "law", model=BASE, attribution="C1")
    assert (smooth.law, smooth.attribution) == ("empirical", "C1")
    assert smooth.relative_sd == pytest.approx(0.15, abs=0.02)
    rough = weldbead.identify(data, "law", model=BASE, method="sample", attribution="C1")
    assert rough.bandwidth == 0.0
    # Away from the threshold the depths follow a translated Rayleigh law: so does the empirical one.
    true = weldbead.Scatter("C1", 0.15).cut(BASE, 50.0, 6.0)
    y = true.mean + true.sd * np.linspace(-2, 3, 21)
    for scatter in (smooth, rough):
        np.testing.assert_allclose(scatter.cut(BASE, 50.0, 6.0).under(y, 0), true.under(y, 0), atol=0.08)
    noisy = data | {"cut_depth": data["cut_depth"] - data["cut_depth"].min() - 0.01}
    assert len(weldbead.identify(noisy, "law", model=BASE, depth_noise=0.005).sample) == 240
    favoured = weldbead.identify(data, "law", model=BASE)
    assert favoured.attribution in ("C1", "mu")


def test_what_was_measured_updates_the_problem():
    power = weldbead.identify(power_data(0.1), "power")
    assert P1.updated(power).model == BASE.replace(
        specific_energy=power["specific_energy"], idle_power=power["idle_power"]
    )
    friction = identify.Estimate(("friction_ratio",), [0.33], [[1e-4]])
    assert P1.updated(friction).model.friction_ratio == 0.33
    scatter = weldbead.identify(pass_data("K1", 0.2), "scatter", model=BASE)
    assert P1.updated(scatter).scatter == weldbead.Scatter("K1", scatter["K1"])
    law = weldbead.identify(pass_data("K1", 0.2), "law", model=BASE)
    updated = P1.updated(law)
    assert isinstance(updated.cut(6.0, [20.0, 50.0]), sdp.Empirical)


FAILED = identify.Estimate(("idle_power",), [0.0], [[np.inf]], identify.Status.UNDETERMINED)
DATA = pass_data("C1", 0.15)
POWER = power_data(0.1, n=5)
MESSAGES = [
    (lambda: P1.updated(FAILED), "estimate must have succeeded; got 'the data do not determine all values"),
    (
        lambda: P1.updated(identify.Estimate(("stiffness",), [1.0], [[1.0]])),
        "estimate.names must be one of specific_energy, idle_power, friction_ratio, .*; got 'stiffness'",
    ),
    (
        lambda: weldbead.identify(POWER, "colour"),
        "what must be one of power, friction, scatter, law, lead_length; got 'colour'",
    ),
    (
        lambda: weldbead.identify(POWER, "power", method="model"),
        "method must be one of regression, total, recursive, printed; got 'model'",
    ),
    (
        lambda: weldbead.identify({name: values[:2] for name, values in POWER.items()}, "power"),
        r"data must have at least 3 passes; got 2 \(and 0 without a reading\)",
    ),
    (
        lambda: weldbead.identify(POWER | {"grinding_power": np.full(5, 300.0)}, "power"),
        r"grinding_power must have at least two levels \(W\); got 300.0 in all passes",
    ),
    (
        lambda: weldbead.identify(POWER | {"removal_rate": [1, 2, np.nan, 4, 5]}, "power"),
        r"removal_rate\[2\] must be finite \(mm\^3/s\); got nan",
    ),
    (
        lambda: weldbead.identify({"grinding_power": [1.0]}, "power"),
        r"data must hold removal_rate \(mm\^3/s\); it holds grinding_power",
    ),
    (
        lambda: weldbead.identify(POWER | {"removal_rate": [1.0, 2.0]}, "power"),
        "removal_rate must have as many entries as grinding_power, 5; got 2",
    ),
    (
        lambda: weldbead.identify(POWER | {"removal_rate": POWER["removal_rate"][::-1]}, "power"),
        r"the values are physically impossible: look for bad readings or a wrong unit \(from 5 passes\)",
    ),
    (
        lambda: weldbead.identify(POWER, "power", method="total"),
        r"noise_ratio must be given with method 'total': .* \(J/mm\^3\); got None",
    ),
    (
        lambda: weldbead.identify(POWER, "power", method="recursive", forgetting=2.0),
        r"forgetting must be in \(0, 1\]",
    ),
    (
        lambda: weldbead.identify({"normal_force": np.zeros(4), "tangential_force": np.zeros(4)}, "friction"),
        r"the data do not determine all values",
    ),
    (
        lambda: weldbead.identify(DATA | {"normal_force": np.full(240, 30.0)}, "scatter", model=BASE),
        r"normal_force must have at least two levels \(N\); got 30.0 in all passes",
    ),
    (
        lambda: weldbead.identify(DATA | {"feed_rate": np.zeros(240)}, "scatter", model=BASE),
        r"feed_rate must be > 0 \(mm/s\); got 0.0",
    ),
    (
        lambda: weldbead.identify(DATA | {"cut_depth": DATA["cut_depth"] - 0.1}, "law", model=BASE),
        r"cut_depth must be >= 0 up to 5 depth_noise, 0 mm \(mm\); got \d+ of 240 that are not",
    ),
    (
        lambda: weldbead.identify(DATA, "law", model=BASE, attribution="w"),
        "attribution must be one of C1, K1, K2, mu; got 'w'",
    ),
    (
        lambda: weldbead.identify(DATA, "scatter", model=BASE, depth_noise=-1.0),
        r"depth_noise must be >= 0 \(mm\); got -1.0",
    ),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()


def test_kinds():
    with pytest.raises(TypeError, match=r"model must be a GrindingProcess, whose mean cut .*; got None"):
        weldbead.identify(DATA, "scatter")
    with pytest.raises(TypeError, match="data must be arrays by name, or a log; got float"):
        weldbead.identify(3.0, "power")


def test_a_failed_estimate_on_request():
    backwards = POWER | {"removal_rate": POWER["removal_rate"][::-1]}
    for method in ("regression", "recursive", "printed"):
        fit = weldbead.identify(backwards, "power", method=method, throw=False)
        assert fit.status is identify.Status.IMPOSSIBLE
        assert fit.message.startswith("the values are physically impossible")


def test_noise_of_the_force_sensor_is_no_scatter():
    """Of a log the commanded forces count; rows hold what was measured, then what was commanded next."""
    rng = np.random.default_rng(3)
    force, feed = rng.uniform(9.0, 40.0, 600), np.full(600, 12.5)
    depth = weldbead.Scatter("K1", 0.18).cut(BASE, force, feed).sample(rng)
    parts = np.repeat(np.arange(200), 4)

    def column(values, at):
        """Three passes a part: commands in rows 0 to 2, what they led to in rows 1 to 3."""
        rows = np.full((200, 4), np.nan)
        rows[:, at : at + 3] = values.reshape(200, 3)
        return rows.ravel()

    table = {
        "part": parts,
        "normal_force": column(force + rng.normal(0.0, 1.0, 600), 1),
        "normal_force_command": column(force, 0),
        "feed_rate": column(feed, 1),
        "cut_depth": column(depth, 1),
    }
    found = weldbead.identify({"sequence": table}, "scatter", model=BASE)
    clean = weldbead.identify(
        {"normal_force": force, "feed_rate": feed, "cut_depth": depth}, "scatter", model=BASE
    )
    assert found.relative_sd == clean.relative_sd
    del table["normal_force_command"]
    blind = weldbead.identify({"sequence": table}, "scatter", model=BASE)
    assert blind.relative_sd[1] > 1.2 * found.relative_sd[1]


def test_a_forgotten_noise_of_the_scan_is_found_out():
    """2 um of noise in light passes, taken for scatter, would make the scatter ten times too small."""
    rng = np.random.default_rng(5)
    force, feed = rng.uniform(8.2, 40.0, 400), np.full(400, 12.5)
    depth = weldbead.Scatter("C1", 0.2, law="lognormal").cut(BASE, force, feed).sample(rng) + rng.normal(
        0.0, 0.0028, 400
    )
    data = {"normal_force": force, "feed_rate": feed, "cut_depth": depth}
    found = weldbead.identify(data, "scatter", model=BASE, depth_noise=0.0028, method="model")
    assert found.relative_sd[0] == pytest.approx(0.2, abs=0.03)
    light = data | {
        "normal_force": np.r_[force, 8.05],
        "feed_rate": np.r_[feed, 12.5],
        "cut_depth": np.r_[depth, 0.012],
    }
    with pytest.raises(
        ValueError, match=r"depth_noise must cover .* residual of \d+ standard deviations; got 0"
    ):
        weldbead.identify(light, "scatter", model=BASE.replace(idle_power=102.4), method="model")


def test_noise_that_grows_with_the_force():
    """3 % of each force, 600 files of 30 passes: 95 % within three standard deviations; white noise gives 92 %."""
    rng, hit = np.random.default_rng(0), 0
    for _ in range(600):
        normal = rng.uniform(17.0, 50.0, 30)
        tangential = 0.33 * normal * (1 + 0.03 * rng.standard_normal(30))
        data = {"normal_force": normal, "tangential_force": tangential}
        low, high = weldbead.identify(data, "friction").interval()[0]
        hit += low <= 0.33 <= high
    assert hit / 600 == pytest.approx(0.95, abs=0.027)


@pytest.mark.parametrize(("what", "drifts"), [("power", True), ("friction", True), ("power", False)])
def test_an_order_of_the_residuals_is_said(what, drifts):
    rng, drift = np.random.default_rng(2), np.sin(np.arange(30) / 5) if drifts else np.zeros(30)
    force, rate = rng.uniform(20, 50, 30), rng.uniform(10, 40, 30)
    noise = drift + 0.1 * rng.standard_normal(30)
    data = {
        "grinding_power": 114 + 12.8 * rate,
        "removal_rate": rate + noise,
        "normal_force": force,
        "tangential_force": 0.3 * force + noise,
    }
    message = weldbead.identify(data, what).message
    assert ("residuals resemble those of the pass before (Durbin-Watson 0." in message) is drifts
    assert message.startswith("from 30 passes")
