"""Commissioning: values and intervals, what is not told, goodness of the fit, the way into the problem."""

import re
from pathlib import Path

import numpy as np
import pytest
from machine_readings import (
    MODEL,
    MOST,
    PROBLEM,
    RATES,
    STEP,
    TRUTH,
    commands,
    commissioned,
    ground,
    recorded,
)
from plunge_inside import cycles, machine_model, rounding
from scipy import stats

import hwsim
from sdpgrind import identify, plunge
from sdpgrind.base import stored

NAMES = list(TRUTH)
ONE_RATE = ((1.0, 9.0),)


def found(data, problem=PROBLEM, **options):
    return plunge.identify(data, "machine", problem=problem, **options)


def distance(fit):
    """Square of the distance from the truth in the metric of the covariance: chi-square of nine values."""
    off = fit.value - np.array([TRUTH[name] for name in fit.names])
    return float(off @ np.linalg.solve(fit.covariance, off))


def test_the_values_and_their_covariance():
    """Chi-square of 4 x 9 values within 1 in 10 000 of either side; the units and names as documented."""
    each = [commissioned(seed) for seed in range(4)]
    assert all(fit.ok and list(fit.names) == NAMES for fit in each)
    total = sum(map(distance, each))
    assert stats.chi2.ppf(1e-4, 36) < total < stats.chi2.isf(1e-4, 36)
    fit = each[0]
    assert fit["normal_force_ratio"] == pytest.approx(11.5, rel=0.005)
    assert fit["idle_power"] == pytest.approx(220.0, rel=0.01)
    assert fit["specific_energy"] == pytest.approx(11.0, abs=4 * fit.sd[2])
    assert fit.units == ("1", "1", "J/mm^3", "N/mm", "W", "1", "s", "s", "mm")


def test_the_goodness_of_a_good_fit():
    """Squares of some 700 readings scatter by 5 %, their autocorrelation by 0.038."""
    for seed in range(3):
        fit = commissioned(seed).fit
        for name in ("size", "power"):
            assert fit[f"{name}_chi_square"] == pytest.approx(1.0, abs=0.2)
            assert abs(fit[f"{name}_autocorrelation"]) < 0.15
            assert 1e-3 < fit[f"{name}_autocorrelation_p"] <= 1.0
        assert fit["size_sd"] == pytest.approx(5e-4, rel=0.1)
        assert fit["power_sd"] == pytest.approx(0.01, rel=0.1)


def test_noise_that_resembles_its_neighbours():
    """Taken as white, chi-square of the values would be 5.7 times as great: (1 + 0.7)/(1 - 0.7)."""
    each = [commissioned(seed, rho=0.7) for seed in range(4)]
    total = sum(map(distance, each))
    assert stats.chi2.ppf(1e-4, 36) < total < 1.5 * stats.chi2.isf(1e-4, 36)
    assert each[0].fit["size_autocorrelation"] == pytest.approx(0.7, abs=0.1)
    assert each[0].fit["size_autocorrelation_p"] < 1e-9
    white = commissioned(0)
    assert np.mean(each[0].sd / white.sd) == pytest.approx(5.7**0.5, rel=0.4)


def test_the_rounding_of_a_gauge_at_rest():
    """Steps of 1 um, and 20 s of spark-out at one reading: chi-square of 4 x 9 values was 130 as if white."""
    rates, step, total = (*RATES[:3], (0.0, 20.0)), 1e-3, 0.0
    problem = PROBLEM.replace(uncertainty=PROBLEM.uncertainty.replace(size_sd=3e-4))
    for seed in range(4):
        data = recorded(seed, rates, size_sd=1e-4)
        begins = np.random.default_rng(seed).uniform(0, step)  # the gauge anywhere between two of them
        data["size"] = np.round((data["size"] + begins) / step) * step
        fit = found(data, problem)
        assert fit.ok
        total += distance(fit)
    assert total < stats.chi2.isf(1e-4, 36)


def test_a_gauge_that_filters_and_rounds(monkeypatch):
    """Noise of half a step, correlation 0.8: of 120 intervals each, 94 to 98 % hold the nine values.

    The sd of contact is 1.3 times that by the correlation of what was rounded.
    """
    read = recorded(4, rho=0.8)
    read["size"] = np.round(read["size"], 3)
    undone = found(read).sd[-1]
    monkeypatch.setattr(rounding, "unrounded", lambda correlation, *_: correlation)
    assert undone > 1.25 * found(read).sd[-1]


def test_a_gauge_that_filters_is_no_noise_of_the_power():
    """The air tells the idle power, whatever the size; by the mean of both squares its sd was 0.83 times as great."""
    read = recorded(4, rho=0.8) | {"grinding_power": recorded(4)["grinding_power"]}
    assert found(read).sd[4] == pytest.approx(commissioned(4).sd[4], rel=0.02)


def test_what_the_offset_of_the_gauge_changes():
    data = recorded()
    fit = found(data | {"size": data["size"] + 0.37})
    np.testing.assert_allclose(fit.value, commissioned().value, rtol=2e-4)
    np.testing.assert_allclose(fit.sd, commissioned().sd, rtol=2e-3)


def test_the_idle_power_from_air_alone():
    """Without an air cut neither part of the power at contact is told, nor changed, whatever is believed of it."""
    data = recorded(contact_zero=0.0)
    for idle in (0.0, 220.0, 300.0):
        problem = PROBLEM.replace(idle_power=idle)
        fit = found(data, problem)
        assert fit.ok and np.all(np.isinf(fit.sd[[3, 4]])) and np.all(np.isfinite(np.delete(fit.sd, [3, 4])))
        updated = problem.updated(fit)
        assert updated.drive.idle_power == idle
        assert updated.model.power.ploughing_force == PROBLEM.model.power.ploughing_force
        truth = np.array(list((TRUTH | {"contact_zero": 0.0}).values()))
        assert np.all(np.abs(fit.value - truth) < 4 * fit.sd)
        assert "not told, and left as believed: ploughing_force, idle_power; an air cut of 20" in fit.message
        both = 220.0 + 0.9 * 37.0 * 9.0
        shown, believed = map(int, re.search(r"take (\d+) W together, (\d+) W as", fit.message).groups())
        assert shown == pytest.approx(both, abs=3) and believed == round(idle + 0.962 * 37.0 * 9.0)


def test_what_is_told_without_air():
    """Of a loaded wheel that ploughs more, idles as much less and begins deeper, all readings are the same."""
    known = PROBLEM.replace(drive=plunge.Drive())
    model = machine_model.MachineModel(known)
    rate = commands()
    time = STEP * np.arange(rate.size)
    nothing = np.full(rate.size, np.nan)
    cycle = cycles.Cycle("", time, rate, nothing, nothing, nothing)
    line = machine_model.timeline(cycle, known.drive, STEP)
    values = model.believed(known.drive)
    values[machine_model.IDLE], values[machine_model.CONTACT] = 300.0, 0.002
    other, more = values.copy(), 0.5
    watts = more * 37.0 * MODEL.width
    other[machine_model.PLOUGHING] += more
    other[machine_model.IDLE] -= watts
    other[machine_model.CONTACT] += MODEL.normal_force_ratio * more * MODEL.width / MODEL.stiffness
    np.testing.assert_allclose(
        model.response(line, other), model.response(line, values), rtol=1e-9, atol=1e-12
    )
    assert model.at_contact(other) == pytest.approx(model.at_contact(values), rel=1e-12)


@pytest.mark.parametrize("idle", [0.0, 220.0, 330.0])
def test_a_wheel_that_waits_is_in_the_air(idle):
    """A second at command 0, unloaded, tells the idle power as an air cut does, though it touches at once."""
    data = recorded(rates=((0.0, 1.0), *RATES), contact_zero=0.0)
    fit = found(data, PROBLEM.replace(idle_power=idle))
    assert fit.ok and "idle_power" not in fit.message
    assert fit["idle_power"] == pytest.approx(220.0, abs=4 * fit.sd[4]) and fit.sd[4] < 1.0
    assert fit["ploughing_force"] == pytest.approx(0.9, abs=4 * fit.sd[3]) and fit.sd[3] < 0.02


def test_one_rate_does_not_tell_chips_from_sliding():
    fit = found(recorded(rates=ONE_RATE))
    assert fit.ok and "a hold at a second rate tells chips from sliding" in fit.message
    untold = [name for name, sd in zip(fit.names, fit.sd, strict=True) if np.isinf(sd)]
    believed = {"ploughing_force": 0.962, "specific_energy": 13.8, "wheel_wear": MODEL.wheel_wear}
    for name in untold:
        assert fit[name] == pytest.approx(believed.get(name, fit[name]), rel=1e-12)
    poor = "specific_energy" in untold or fit.sd[2] > 0.03 * fit["specific_energy"]
    assert poor and fit.sd[0] < 0.05 * fit["normal_force_ratio"]


def test_three_rates_ask_for_longer_holds():
    assert "tell more" in commissioned().message and "second rate" not in commissioned().message


def test_a_linear_time_constant_does_not_fit():
    linear = PROBLEM.replace(linear_time_constant=PROBLEM.time_constant)
    fit = found(recorded(), linear)
    assert fit.status is identify.Status.MISFIT and not fit.ok
    assert fit.message.startswith("does not fit: chi^2/dof of size must be 0.8 ... 1.25; got ")
    assert "linear_time_constant" in fit.names and "normal_force_ratio" not in fit.names
    with pytest.raises(ValueError, match="estimate must have succeeded; got 'does not fit"):
        PROBLEM.updated(fit)
    with pytest.raises(ValueError, match="does not fit"):
        found(recorded(), linear, throw=True)


@pytest.mark.parametrize(
    ("declared", "told"),
    [
        ({"size_sd": 3e-4}, r"chi\^2/dof of size must be 0.8 ... 1.25; got 2.\d+: its noise is 0.0005\d* mm"),
        ({"size_sd": 1e-3}, r"chi\^2/dof of size must be 0.8 ... 1.25; got 0.2\d+: its noise is 0.000[45]\d* mm"),
        ({"power_sd": 0.02}, r"chi\^2/dof of power .* got 0.2\d+: its noise is .* declared are 0.02 \(power_sd\)"),
    ],
)  # fmt: skip
def test_noise_that_was_declared_wrongly(declared, told):
    fit = found(recorded(), PROBLEM.replace(**declared))
    assert fit.status is identify.Status.MISFIT
    assert re.search(told, fit.message)
    np.testing.assert_allclose(fit.value, commissioned().value, atol=0.3 * commissioned().sd.max(), rtol=0.02)


def test_noise_that_was_not_declared():
    fit = found(recorded(), PROBLEM.replace(size_sd=0.0, power_sd=0.0))
    assert fit.ok and fit.fit["size_chi_square"] == pytest.approx(1.0, abs=0.25)
    np.testing.assert_allclose(fit.value, commissioned().value, rtol=0.02)


def test_clipped_power_is_never_used():
    """The monitor ends at 90 % of the greatest power: a plateau, that no value follows."""
    data = recorded()
    most = 0.9 * data["grinding_power"].max()
    fit = found(data | {"grinding_power": np.minimum(data["grinding_power"], most)}, power_max=float(most))
    assert fit.ok and distance(fit) < stats.chi2.isf(1e-4, 9)


def test_missing_readings():
    data = recorded()
    rng = np.random.default_rng(3)
    for name in ("size", "grinding_power"):
        data[name] = np.where(rng.uniform(size=data[name].size) < 0.2, np.nan, data[name])
    fit = found(data)
    assert fit.ok and distance(fit) < stats.chi2.isf(1e-4, 9)


def series():
    """A log of three parts with other contacts on a known machine with all effects."""
    problem = PROBLEM.replace(feed_delay=0.04, idle_power=0.0)
    plant = hwsim.PlungeGrinder(problem, contact_zero_sd=0.01)
    return problem, hwsim.run(plant, plunge.CycleController(problem), parts=3, rng=4)


def test_parts_of_a_log():
    """Contacts within four standard deviations; the same from the table; a part alone."""
    problem, log = series()
    fit = found(log, problem)
    assert fit.ok and fit.message.startswith("from 3 parts; ")
    assert fit.names[-3:] == ("contact_zero_0", "contact_zero_1", "contact_zero_2")
    off = fit.value[-3:] - log.outcome.true_contact_zero.values
    assert np.all(np.abs(off) < 4 * fit.sd[-3:]) and fit.sd[-1] < 1e-3
    np.testing.assert_array_equal(found(log["controller"], problem).value, fit.value)
    alone = found(log, problem, part=1)
    assert alone.names[-1] == "contact_zero" and alone.message.startswith("from 1 part; ")
    assert alone.sd[0] > fit.sd[0]


def test_a_part_that_fails_is_left_out_and_named():
    one, other = recorded(0), recorded(1)
    data = {name: np.concatenate([one[name], other[name]]) for name in one}
    data["part"] = np.repeat([0, 1], one["time"].size)
    data["size"][-250:] = data["size"][-250]
    fit = found(data)
    assert fit.ok and fit.message.startswith("from 1 part; 1 left out, part 1: the gauge stands still at ")
    np.testing.assert_allclose(fit.value, commissioned().value, rtol=1e-9)


def test_the_machine_goes_into_the_problem():
    fit = commissioned()
    problem = PROBLEM.updated(fit)
    model, drive = problem.model, problem.drive
    assert model.normal_force_ratio == fit["normal_force_ratio"]
    assert (model.wear_flat_area, model.power.specific_energy) == (
        fit["wear_flat_area"],
        fit["specific_energy"],
    )
    assert model.power.ploughing_force == fit["ploughing_force"]
    assert model.wheel_wear == pytest.approx(fit["wheel_wear"], rel=1e-12)
    assert (drive.idle_power, drive.feed_lag, drive.power_lag) == tuple(
        fit[name] for name in ("idle_power", "feed_lag", "power_lag")
    )
    assert problem.uncertainty == PROBLEM.uncertainty and drive.feed_delay == PROBLEM.drive.feed_delay
    assert problem.time_constant == pytest.approx(problem.replace(time_constant=None).time_constant)
    assert plunge.plan(problem).time != plunge.plan(PROBLEM).time
    no_wear = fit.replace(value=np.where(np.array(fit.names) == "wheel_wear", -1e-4, fit.value))
    assert np.isinf(PROBLEM.updated(no_wear).model.grinding_ratio)


def test_only_a_contact_zero_is_refused():
    fit = commissioned()
    k = fit.names.index("contact_zero")
    contact = identify.Estimate(("contact_zero",), fit.value[[k]], fit.covariance[[k]][:, [k]], units=("mm",))
    with pytest.raises(ValueError, match=r"estimate.names must be one of .*; got 'contact_zero'"):
        PROBLEM.updated(contact)


@pytest.mark.parametrize("problem", [plunge.preset("simulation"), plunge.preset("experiment")])
@pytest.mark.parametrize("value", [1.5, 2.4])
def test_a_time_constant_changes_the_plan(problem, value):
    """The secant of the deflection equals it, or the linear lag does; never silently nothing."""
    told = identify.Estimate(("time_constant",), [value], [[1e-4]], units=("s",))
    updated = problem.updated(told)
    assert updated.time_constant == value
    if problem.model.linear_time_constant is None:
        assert updated.replace(time_constant=None).time_constant == pytest.approx(value, rel=1e-12)
    else:
        assert updated.model.linear_time_constant == value
    longer = plunge.plan(updated).time > plunge.plan(problem).time
    assert longer == (value > problem.time_constant)


def test_it_is_stored_and_drawn():
    fit = commissioned()
    again = stored.decode(stored.encode(fit))
    assert again.fit == fit.fit and again.names == fit.names
    np.testing.assert_array_equal(again.size_residual, fit.size_residual)
    assert np.nanstd(fit.size_residual) == pytest.approx(fit.fit["size_sd"], rel=0.02)
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    labels = [axis.get_ylabel() for axis in fit.plot().axes]
    assert labels == ["size, read less model [µm]", "power, read less model [W]"]
    pyplot.close("all")


def rounded(rates, noise=0.0):
    """Parts that end at some rates, each with its roundness in a column."""
    rows, problem = [], plunge.preset("simulation").replace(drive=plunge.Drive())
    for part, last in enumerate(rates):
        rate = np.concatenate([np.full(150, MOST), np.full(150, last)])
        truth = TRUTH | {"feed_lag": 0.0, "wheel_wear": 0.0, "power_lag": 0.0, "contact_zero": 0.0}
        shown = ground(truth, rate, model=problem.model)
        end = (shown[-1, 0] - shown[-2, 0]) / STEP
        read = float(problem.model.roundness(end)) + noise * (-1) ** part
        rows.append((np.full(300, part), STEP * np.arange(300), rate, shown[:, 0], np.full(300, read)))
    names = ("part", "time", "command_rate", "size", "roundness")
    return problem, dict(zip(names, map(np.concatenate, zip(*rows, strict=True)), strict=True))


def test_roundness_from_rates_that_differ():
    """R_0 and k_r as in the model; the rate at the end is that of the last sample to 1e-4 of it."""
    problem, data = rounded([0.002, 0.004, 0.008])
    fit = plunge.identify(data, "roundness", problem=problem)
    assert fit["roundness_base"] == pytest.approx(problem.model.roundness_base, rel=0.01)
    assert fit["roundness_gain"] == pytest.approx(problem.model.roundness_gain, rel=0.01)
    assert problem.updated(fit).model.roundness_gain == fit["roundness_gain"]


@pytest.mark.parametrize(
    ("rates", "told"),
    [
        ([0.004, 0.005, 0.006], "final rates of 0.00.* mm/s are less than a factor 2 apart"),
        ([0.002, 0.008], "2 parts with roundness and size are too few: at least 3 are needed"),
    ],
)
def test_roundness_that_is_not_told(rates, told):
    problem, data = rounded(rates)
    fit = plunge.identify(data, "roundness", problem=problem)
    assert fit.status is identify.Status.NOT_IDENTIFIED
    assert re.search(told, fit.message)


def test_roundness_of_a_log_is_that_of_its_outcome():
    problem, log = series()
    fit = plunge.identify(log, "roundness", problem=problem)
    assert not fit.ok and "less than a factor 2 apart" in fit.message
    with pytest.raises(ValueError, match="data must hold roundness \\(mm\\) of each part"):
        plunge.identify(recorded(), "roundness", problem=PROBLEM)


def test_the_burn_threshold_needs_inspection():
    fit = plunge.identify(recorded(), "B", problem=PROBLEM)
    assert fit.message.startswith("not identified: needs inspection: plunge.BurnThreshold")


def test_messages():
    data = recorded()
    with pytest.raises(ValueError, match="data must hold grinding_power"):
        found({name: values for name, values in data.items() if name != "grinding_power"})
    with pytest.raises(
        TypeError, match="problem must be a CycleProblem, whose model is corrected, for 'machine'"
    ):
        plunge.identify(data, "machine")
    none = found(data | {"grinding_power": np.full(data["time"].size, np.nan)})
    assert none.message == "not identified: there is no power, or all of it is clipped"


def test_a_value_that_runs_to_the_end_of_its_range():
    """A sample of a machine with a linear lag, and a power without sliding."""
    path = Path(__file__).parents[1] / "data" / "samples" / "plunge_brackets.csv"
    log = hwsim.Log.read(path, time="t", size="X", command_rate="v", grinding_power="P")
    fit = found(log, plunge.preset("simulation"))
    assert fit.status is identify.Status.MISFIT and not fit.ok
    assert "wear_flat_area runs to 0.00052, the end of its range" in fit.message
