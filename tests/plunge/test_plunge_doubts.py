"""Doubts about plunge cycles: alignment, intervals, sentences, stakes."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from cycle_readings import EXPERIMENT, NOMINAL
from plunge_inside import contact, cycles, of_cycles, residuals

import hwsim
from sdpgrind import identify, plunge

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
STEP, ROWS = 0.05, 220
TIME = STEP * np.arange(ROWS)
RATE = np.select([TIME < 4.2 - 1e-9, TIME < 5.7 - 1e-9], [0.04, 0.01], 0.0)
WAYS = ("begin", "centre", "end")


def size_of(tau, rate=RATE):
    pole, lag = np.exp(-STEP / tau), np.zeros(rate.size)
    for k in range(rate.size - 1):
        lag[k + 1] = pole * lag[k] + rate[k] * tau * (1 - pole)
    return np.concatenate([[0.0], np.cumsum(rate[:-1] * STEP)]) - lag


def recorded(way, rate=RATE):
    before = np.concatenate([rate[:1], rate[:-1]])
    return {"begin": rate, "centre": 0.5 * (rate + before), "end": before}[way]


def file(tau, way, sd=0.0, correlation=0.0, rng=None):
    noise = np.zeros(ROWS) if rng is None else rng.normal(size=ROWS)
    for k in range(1, ROWS):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    return {"time": TIME, "size": size_of(tau) + sd * noise, "command_rate": recorded(way)}


def aligned(data, commands_at="begin"):
    return of_cycles(cycles.cycles(data), commands_at)


@pytest.mark.parametrize(("way", "biased"), [("begin", 1.7), ("centre", 1.6685), ("end", 1.6374)])
def test_a_wrong_alignment_is_told_and_put_right(way, biased):
    """The biases of the specification, without noise, of commands read as at the beginning."""
    found = aligned(file(1.7, way))
    assert found.time_constants["begin"] == pytest.approx(biased, abs=5e-4)
    assert found.time_constants[way] == pytest.approx(1.7, abs=5e-4) and found.alignment.preferred == way


def test_alignments_of_drawn_files():
    """12 files with noise of 0.3 um: all right; of correlation 0.8 six at least, and none wrong."""
    for correlation, right, wrong in ((0.0, 12, 0), (0.8, 6, 0)):
        rng = np.random.default_rng(1)
        said = []
        for k in range(12):
            data = file(rng.uniform(0.8, 3.0), WAYS[k % 3], 3e-4, correlation, rng)
            said.append((WAYS[k % 3], aligned(data).alignment.preferred))
        assert sum(truth == word for truth, word in said) >= right
        assert sum(word not in (truth, "not sure") for truth, word in said) <= wrong


def test_an_alignment_that_was_declared_is_undone_first():
    rng = np.random.default_rng(2)
    data = file(1.7, "begin", 3e-4, 0.0, rng)
    after = np.append(RATE[1:], RATE[-1])
    for commands_at, given in (("end", after), ("centre", 0.5 * (RATE + after))):  # as the reader holds them
        found = aligned(data | {"command_rate": given}, commands_at)
        assert found.alignment.preferred == "begin"
        assert found.time_constants["begin"] == pytest.approx(1.7, abs=0.01)


def test_an_approach_in_air_misleads_no_alignment():
    rng = np.random.default_rng(3)
    air = np.full(40, 0.04)
    time = STEP * np.arange(40 + ROWS)
    size = np.concatenate([np.zeros(40), size_of(1.7)]) + rng.normal(0.0, 3e-4, 40 + ROWS)
    for way in WAYS:
        data = {"time": time, "size": size, "command_rate": recorded(way, np.concatenate([air, RATE]))}
        assert aligned(data).alignment.preferred == way


def test_noise_that_feigns_a_touch_in_the_air_bends_no_lag():
    """6 files with 2.5 s of air, correlation 0.9: the lag from the first size that seems to move is off by 0.1 to 0.8 s in 5."""
    rate = np.concatenate([np.full(50, 0.04), RATE])
    clean = np.concatenate([np.zeros(50), size_of(1.7)])
    for seed in range(6):
        noise = np.random.default_rng(seed).normal(0.0, 5e-4 * np.sqrt(1 - 0.9**2), clean.size + 100)
        for k in range(1, noise.size):
            noise[k] += 0.9 * noise[k - 1]
        data = {"time": STEP * np.arange(rate.size), "command_rate": rate, "size": clean + noise[100:]}
        each = cycles.cycles(data)
        found = of_cycles(each)
        assert found.time_constants["begin"] == pytest.approx(1.7, abs=0.1)
        assert found.alignment.preferred in ("begin", "not sure")
        assert not residuals.of_models(each, found.fit, None)


def test_a_constant_command_tells_no_alignment():
    rate = np.full(ROWS, 0.04)
    size = size_of(1.7, rate) + np.random.default_rng(4).normal(0.0, 3e-4, ROWS)
    assert not aligned({"time": TIME, "size": size, "command_rate": rate}).alignment.sure


def test_the_sample_file():
    """tau 1.4 s, noise 0.3 um, steps of 0.1 um, as tests/data/samples tells; the interval of the estimator."""
    read = {"time": "t", "size": "X", "command_rate": "v", "grinding_power": "P"}
    log = hwsim.Log.read(SAMPLES / "plunge_brackets.csv", **read)
    doubts = NOMINAL.doubts(log)
    row, own = doubts["time_constant"], plunge.identify(log, "time_constant")
    assert row.told == pytest.approx(1.4021, abs=1.5e-3) and row.low < 1.4 < row.high
    assert (row.low, row.high) == pytest.approx(tuple(own.interval()[0])) and row.verdict == "differs"
    assert doubts.alignment == "begin" and doubts["commands_at"].verdict == "assumed"
    page = str(doubts)
    assert "sd 0.28 µm" in page and "steps of 0.10 µm" in page and "64 % of the stock" in page
    assert "A linear lag fits the sizes better" in page and max(map(len, page.splitlines())) <= 112
    table = NOMINAL.doubts(log["data"])
    assert str(table) == page


def test_stakes_are_plans_solved_again():
    doubts = EXPERIMENT.doubts(file(1.7, "begin", 3e-4, 0.0, np.random.default_rng(5)))
    (stake,) = doubts.stakes
    for end, time in ((stake.low, stake.at_low), (stake.high, stake.at_high)):
        again = plunge.plan(EXPERIMENT.replace(linear_time_constant=end)).time
        assert time == pytest.approx(again, rel=1e-9)
    assert doubts.figure.value == pytest.approx(plunge.plan(EXPERIMENT).time)


def of_the_model(problem, sd, seed):
    """Sizes of a machine that is as believed."""
    data = file(1.7, "begin")
    (cycle,) = cycles.cycles(data)
    size = contact.course(cycle, problem.model).size
    return data | {"size": size + np.random.default_rng(seed).normal(0.0, sd, ROWS)}


def test_all_values_together_are_what_the_calls_plan():
    """Area and force ratio of a machine that has others: the ratio alone takes the area's part of the lag."""
    true = NOMINAL.replace(wear_flat_area=0.035, normal_force_ratio=7.0)
    data = of_the_model(true, 3e-4, 3)
    (cycle,) = cycles.cycles(data)
    rate = contact.course(cycle, true.model).infeed_rate
    data["grinding_power"] = np.where(rate > 0, true.model.grinding_power(np.maximum(rate, 1e-9)), 0.0)
    doubts = NOMINAL.doubts(data)
    sharp = NOMINAL.updated(plunge.identify(data, "wear_flat_area", problem=NOMINAL))
    again = sharp.updated(plunge.identify(data, "normal_force_ratio", problem=sharp))
    *_, alone, together = doubts.stakes
    assert together.name == "all of them" and together.at_low == pytest.approx(plunge.plan(again).time)
    assert together.at_low == pytest.approx(plunge.plan(true).time, rel=2e-3)
    assert alone.name == "normal_force_ratio" and alone.at_high < 0.95 * together.at_low
    (said,) = [each for each in doubts.sentences if "as sharp; then" in each]
    assert float(re.search(r"the ratio is ([\d.]+)\.", said)[1]) == pytest.approx(7.0, rel=2e-3)


def test_a_model_that_is_true_agrees_although_its_lag_is_not_linear():
    doubts = NOMINAL.doubts(of_the_model(NOMINAL, 5e-5, 0))
    for name in ("time_constant", "contact_zero", "normal_force_ratio"):
        assert doubts[name].verdict == "agrees", name
    assert any("A linear lag does not fit all rates" in sentence for sentence in doubts.sentences)


def test_columns_that_are_both_in_inches_show_against_the_problem():
    problem = EXPERIMENT.replace(stock=0.183, command_rate_max=0.04)
    data = file(1.7, "begin", 3e-4, 0.0, np.random.default_rng(6))
    small = data | {name: data[name] / 25.4 for name in ("size", "command_rate")}
    assert any("both columns in inches" in sentence for sentence in problem.doubts(small).sentences)
    assert not any("inches" in sentence for sentence in problem.doubts(data).sentences)


def test_a_spark_out_narrows_as_much_as_is_said():
    """The predicted interval against that of a file with the spark-out."""
    short = {
        name: values[:90] for name, values in file(1.7, "begin", 3e-4, 0.0, np.random.default_rng(7)).items()
    }
    (words,) = [sentence for sentence in EXPERIMENT.doubts(short).sentences if "spark-out of" in sentence]
    assert words.startswith("A spark-out of 6 s")
    predicted = float(words.partition(" to ±")[2].split()[0])
    rate = np.concatenate([RATE[:89], np.zeros(121)])
    size = size_of(1.7, rate) + np.random.default_rng(8).normal(0.0, 3e-4, 210)
    fit = aligned({"time": TIME[:210], "size": size, "command_rate": rate}).fit
    longer = plunge.identify({"time": TIME[:210], "size": size, "command_rate": rate}, "time_constant")
    assert fit.time_constant == pytest.approx(1.7, abs=0.01)
    assert 2 * longer.sd[0] == pytest.approx(
        predicted, rel=0.35
    )  # one draw of the noise; touch-in or first rate


def test_experiments_start_from_the_interval_of_the_table():
    """Of the two parts of the sample file, which differ by more than noise, and of one of them."""
    log = hwsim.Log.read(SAMPLES / "plunge_parts.tdms", size="size", command_rate="rate")
    table = log["data"]
    for data, words in ((log, "3 more parts"), (table.isel(row=np.arange(120)), "spark-out of")):
        doubts = EXPERIMENT.doubts(data)
        row = doubts["time_constant"]
        (said,) = [sentence for sentence in doubts.sentences if words in sentence]
        assert f"from ±{(row.high - row.low) / 2:.2g} s to ±" in said


@pytest.mark.parametrize("begins", [0.0, 3.0])
def test_what_rests_on_a_deflection_that_does_not_fit_is_not_told(begins):
    """Neither an interval nor a stake of it, in one unit, wherever the gauge begins."""
    data = file(1.4, "begin", 3e-4, 0.0, np.random.default_rng(11))
    data["size"] = data["size"] + begins
    told = plunge.identify(data, "normal_force_ratio", problem=NOMINAL)
    doubts = NOMINAL.doubts(data)
    assert told.ok and {stake.name for stake in doubts.stakes} == {"time_constant"}
    for name in ("contact_zero", "normal_force_ratio"):
        assert doubts[name].verdict == "not told" and np.isnan(doubts[name].low), name
        assert "a linear lag fits these better" in doubts[name].note
    (said,) = [sentence for sentence in doubts.sentences if sentence.startswith("A linear lag fits")]
    assert re.search(r"[\d.]+ µm against [\d.]+ µm", said)


def parts_of(size, sd, correlation, seed, count=4):
    """Parts of one machine, with noise of their own."""
    rng = np.random.default_rng(seed)
    each = [file(1.25, "begin", sd, correlation, rng)["size"] - size_of(1.25) + size for _ in range(count)]
    return {
        "time": np.tile(TIME, count), "command_rate": np.tile(RATE, count),
        "size": np.concatenate(each), "part": np.repeat(np.arange(count), ROWS),
    }  # fmt: skip


def test_noise_hides_no_law_of_the_lag():
    """0.5 um, which is more than the laws differ: of four parts, the law that is not theirs is refused."""
    linear = NOMINAL.doubts(parts_of(size_of(1.25), 5e-4, 0.6, 0))
    assert {row.name for row in linear.rows if row.measured} == {"time_constant"}
    assert linear["time_constant"].low < 1.25 < linear["time_constant"].high
    assert any("would decide), on which contact_zero" in sentence for sentence in linear.sentences)
    stiff = NOMINAL.replace(stiffness=12e3)
    bent = contact.course(cycles.cycles(file(1.25, "begin"))[0], stiff.model).size
    doubts = NOMINAL.doubts(parts_of(bent, 5e-4, 0.6, 0))
    truth = {"contact_zero": 0.0, "normal_force_ratio": NOMINAL.model.normal_force_ratio * 8 / 12}
    for name, value in (truth | {"time_constant": stiff.time_constant}).items():
        assert doubts[name].low < value < doubts[name].high, name


def test_a_law_that_is_not_told_is_said():
    """Under noise of 20 um both fit: what rests on the deflection says so."""
    doubts = NOMINAL.doubts(parts_of(size_of(1.25), 0.02, 0.0, 0, count=1))
    (said,) = [sentence for sentence in doubts.sentences if "do not tell the deflection" in sentence]
    assert "contact_zero, normal_force_ratio and wear_flat_area hold with the deflection" in said


def test_where_a_linear_lag_fits_the_advice_plans_no_part_by_the_deflection():
    """Scaled to such lags it planned parts 4.1 to 4.7 um out of round where 3 are allowed, some burnt 7 um deep."""
    true = NOMINAL.replace(linear_time_constant=1.4, wear_flat_area=0.03)
    data = file(1.4, "begin", 3e-4, 0.0, np.random.default_rng(11))
    (cycle,) = cycles.cycles(data)
    rate = contact.course(cycle, true.model).infeed_rate
    data["grinding_power"] = np.where(rate > 0, true.model.grinding_power(np.maximum(rate, 1e-9)), 0.0)
    (said,) = [s for s in NOMINAL.doubts(data).sentences if s.startswith("To plan with")]
    called = {"problem": NOMINAL, "plunge": plunge, "log": data}
    exec(said[said.index("problem = ") : said.index(";")], called)
    linear = called["problem"]
    (said,) = [s for s in linear.doubts(data).sentences if s.startswith("To plan with")]
    advised = eval(said[said.index("problem.updated") : -1], called)
    assert advised.time_constant == advised.model.linear_time_constant == pytest.approx(1.4, rel=3e-3)
    assert advised.model.wear_flat_area == pytest.approx(0.03, rel=3e-3)
    assert plunge.plan(advised).time == pytest.approx(plunge.plan(true).time, rel=2e-3)


def test_an_interval_ends_at_zero_and_has_no_plan_there():
    """Two parts that differ much: Student's interval of one degree of freedom reaches below 0."""
    apart = [of_the_model(NOMINAL.replace(stiffness=stiffness), 5e-5, 0) for stiffness in (7000.0, 9500.0)]
    both = {name: np.concatenate([part[name] for part in apart]) for name in apart[0]}
    both["part"] = np.repeat([0, 1], ROWS)
    told = plunge.identify(both, "normal_force_ratio", problem=NOMINAL)
    doubts = NOMINAL.doubts(both)
    row = doubts["normal_force_ratio"]
    assert told.interval()[0, 0] < 0 == row.low < row.told and row.high == told.interval()[0, 1]
    (stake,) = [stake for stake in doubts.stakes if stake.name == row.name]
    assert np.isnan(stake.at_low) and stake.reason == "normal_force_ratio must be > 0; got 0.0"
    assert "(0 to " in doubts.report()


def test_the_plan_follows_what_doubts_say_of_the_lag():
    """By `updated`; and as the linear lag that the sentence puts into a model whose deflection does not fit."""
    data = file(1.4, "begin", 3e-4, 0.0, np.random.default_rng(11))
    tau = plunge.identify(data, "time_constant")
    doubts = NOMINAL.doubts(data)
    assert any(f"problem.replace(linear_time_constant={tau.value[0]:.4g})" in s for s in doubts.sentences)
    (stake,) = [stake for stake in doubts.stakes if stake.name == "time_constant"]
    low = NOMINAL.replace(linear_time_constant=stake.low)
    assert stake.at_low == pytest.approx(plunge.plan(low).time)
    assert plunge.plan(NOMINAL.updated(tau)).time < 0.97 * plunge.plan(NOMINAL).time
    assert EXPERIMENT.updated(tau).model.linear_time_constant == tau["time_constant"]
    assert plunge.plan(EXPERIMENT.updated(tau)).time < 0.97 * plunge.plan(EXPERIMENT).time


@pytest.mark.parametrize("lag", [0.5, 1.25, 10.0])
def test_a_time_constant_that_would_change_no_plan_warns(lag):
    """`replace` names the stiffness, whose plan is that of `updated`."""
    with pytest.warns(UserWarning, match=r"changes no plan: plans rest on .* of 1\.933 s") as told:
        assert NOMINAL.replace(time_constant=lag).time_constant == lag
    stiffness = float(re.search(r"stiffness = ([\d.e+]+) \(N/mm\)", str(told[0].message))[1])
    stiff = NOMINAL.replace(stiffness=stiffness)
    assert stiff.time_constant == pytest.approx(lag, rel=1e-3)
    found = identify.Estimate(("time_constant",), [lag], [[1e-4]], units=("s",))
    assert plunge.plan(stiff).time == pytest.approx(plunge.plan(NOMINAL.updated(found)).time, rel=1e-3)
    with pytest.warns(UserWarning, match=f"linear_time_constant = {lag:g} gives the deflection another"):
        EXPERIMENT.replace(time_constant=lag)


def test_a_time_constant_of_the_deflection_is_taken():
    own = NOMINAL.time_constant
    assert NOMINAL.replace(time_constant=own) == NOMINAL == NOMINAL.replace(time_constant=None)
    assert NOMINAL.replace(time_constant=round(own, 4)).time_constant == round(own, 4)
    for changes in ({"normal_force_ratio": 2 * NOMINAL.model.normal_force_ratio}, {"stiffness": 4000.0}):
        assert NOMINAL.replace(**changes).time_constant == pytest.approx(2 * own)


def test_doubts_believe_the_lag_that_the_plan_has():
    """Believed and told, and the plans of both, are of one quantity, whatever the printed cycle assumes."""
    assumed = dataclasses.replace(NOMINAL, time_constant=1.0)
    data = file(1.4, "begin", 3e-4, 0.0, np.random.default_rng(11))
    doubts, own = assumed.doubts(data), NOMINAL.doubts(data)
    assert doubts["time_constant"].believed == NOMINAL.time_constant and doubts.stakes == own.stakes
    (stake,) = doubts.stakes  # a shorter lag, a shorter plan
    assert stake.high < doubts["time_constant"].believed and stake.at_high < doubts.figure.value


def test_a_frozen_gauge_is_said():
    data = file(1.7, "begin", 3e-4, 0.0, np.random.default_rng(9))
    data["size"][40:] = data["size"][40]
    doubts = EXPERIMENT.doubts(data)
    assert doubts.alignment == "" and doubts["time_constant"].verdict == "not told"
    assert "stands still" in doubts.sentences[0]


def test_the_problem_is_not_changed():
    before = dataclasses.replace(EXPERIMENT)
    EXPERIMENT.doubts(file(1.7, "begin", 3e-4, 0.0, np.random.default_rng(10)))
    assert before == EXPERIMENT


def test_missing_columns_are_named():
    with pytest.raises(ValueError, match="data must hold size"):
        NOMINAL.doubts({"time": TIME, "command_rate": RATE})
