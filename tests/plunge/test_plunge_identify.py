"""Identification of the model from readings: numbers two ways, bounds, invariance, refusals."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from cycle_readings import EXPERIMENT, LONG, NOMINAL, RATE, SIZE, STEP, TIME, cramer_rao, cycle, found, noisy
from hypothesis import given, settings
from hypothesis import strategies as st
from plunge_inside import contact as _contact
from plunge_inside import cycles as _records
from scipy import integrate, optimize, signal

import hwsim
from sdpgrind import identify, plunge, units


def log(parts, faulty=()):
    """Tables as of `hwsim`: the last row of a part has no command."""
    columns = {"part": [], "time": [], "size": [], "command_rate_command": [], "grinding_power": []}
    for part in parts:
        data = noisy(5e-4, part, 0.002 * part)
        if part in faulty:
            data["size"][60:] = data["size"][60]
        u = data["command_rate"].copy()
        u[-1] = np.nan
        rows = np.full(TIME.size, part), TIME, data["size"], u, np.full(TIME.size, np.nan)
        for column, values in zip(columns.values(), rows, strict=True):
            column.append(values)
    table = {name: ("row", np.concatenate(values)) for name, values in columns.items()}
    coords = {name: table.pop(name) for name in ("part", "time")}
    return {"controller": xr.Dataset(table, coords)}


def test_all_parts_of_a_log():
    each = [found(log([part])) for part in range(4)]
    both = found(log(range(4)))
    values = np.array([one["time_constant"] for one in each])
    weights = np.array([1 / one.covariance[0, 0] for one in each])
    assert both["time_constant"] == pytest.approx(values @ weights / weights.sum(), rel=1e-9)
    assert both.sd[0] == pytest.approx(cramer_rao(5e-4, LONG, touched=True) / 2, rel=0.6)
    assert both.message == "from 4 parts"
    assert found(log(range(4)), part=2)["time_constant"] == pytest.approx(values[2], rel=1e-12)
    assert found(log(range(4)), part=[0, 3]).message == "from 2 parts"
    assert abs(found(log(range(4)), method="recursive")["time_constant"] - both["time_constant"]) < both.sd[0]


def test_a_part_that_fails_is_left_out_and_named():
    fit = found(log(range(3), faulty=[1]))
    assert fit.ok and fit.message.startswith(
        "from 2 parts; 1 left out, part 1: not identified: the gauge stands still at "
    )
    assert fit["time_constant"] == pytest.approx(found(log([0, 2]))["time_constant"], rel=1e-12)


def test_parts_that_differ_are_no_surer_than_their_scatter():
    shown = [
        identify.Estimate(("time_constant",), [value], [[1e-6]], units=("s",)) for value in (1.8, 1.9, 2.0)
    ]
    fit = _records.pooled(shown)
    assert fit["time_constant"] == pytest.approx(1.9)
    assert fit.sd[0] == pytest.approx(0.1 / np.sqrt(3))


def policy():
    """Commands of a cycle: full rate, falling rate, spark-out; 13 s."""
    time = np.arange(0, 13.0, STEP)
    return time, np.select([time < 6.4, time < 9.0], [RATE, 0.02 * np.exp(-(time - 6.4) / 3.0)], 0.0)


def ground(problem, contact_zero=0.0, scale=1.0, sd=0.0, power_sd=0.0, seed=0, area=None):
    """Readings of a cycle of a model."""
    model = problem.model if area is None else problem.model.replace(wear_flat_area=area)
    time, u = policy()
    blank = np.full(time.size, np.nan)
    course = _contact.course(_records.Cycle("", time, u, blank, blank, blank), model, contact_zero, scale)
    rng = np.random.default_rng(seed)
    power = np.where(course.infeed_rate > 0, model.grinding_power(course.infeed_rate), 0.0)
    size = course.size + rng.normal(0, sd, time.size) if sd else course.size
    return cycle(size, time, u, power * (1 + power_sd * rng.standard_normal(time.size)))


@pytest.mark.parametrize("scale", [1.0, 1.1])
@pytest.mark.parametrize("contact_zero", [-0.012, 0.0, 0.005])
def test_the_course_against_an_integrator(contact_zero, scale):
    """dq/dt = v(x), x = p + contact zero - q, with the model's own inversion of x(v)."""
    data, model = ground(NOMINAL, contact_zero, scale), NOMINAL.model
    p = np.r_[0.0, np.cumsum(data["command_rate"][:-1]) * STEP]

    def rate(t, q):
        return [float(model.infeed_rate((np.interp(t, data["time"], p) + contact_zero - q[0]) / scale))]

    one = integrate.solve_ivp(
        rate, (0, 3.0), [0.0], max_step=0.02, rtol=1e-9, atol=1e-12, t_eval=[1.0, 2.0, 3.0]
    )
    np.testing.assert_allclose(data["size"][[25, 50, 75]], one.y[0], atol=2e-7)


@pytest.mark.parametrize("contact_zero", [-0.012, 0.03])
def test_slopes_of_the_course_are_those_of_differences(contact_zero):
    """Rounding of a size over the difference of 1e-6 is 1e-10; its truncation, at the contact, 1e-9."""
    part = _records.cycles(ground(NOMINAL))[0]

    def at(zero, scale):
        return _contact.course(part, NOMINAL.model, contact_zero + zero * 1e-6, 1.1 + scale * 1e-6)

    there = at(0, 0)
    for slope, low, high in (
        (there.by_contact, at(-1, 0), at(1, 0)),
        (there.by_scale, at(0, -1), at(0, 1)),
    ):
        np.testing.assert_allclose(slope, (high.size - low.size) / 2e-6, rtol=0, atol=5e-9)


@pytest.mark.parametrize("problem", [NOMINAL, EXPERIMENT], ids=["force", "linear"])
def test_contact_and_scale_are_found(problem):
    exact = ground(problem, 0.008, 1.08)
    options = {"problem": problem}
    assert plunge.identify(exact, "contact_zero", **options)["contact_zero"] == pytest.approx(0.008, abs=1e-7)
    ratio = plunge.identify(exact, "normal_force_ratio", **options)
    assert ratio["normal_force_ratio"] == pytest.approx(1.08 * problem.model.normal_force_ratio, rel=1e-6)
    assert found(exact, **options)["time_constant"] == pytest.approx(1.08 * problem.time_constant, rel=1e-6)
    late = plunge.identify(ground(problem, -0.006, 1.08), "contact_zero", **options)
    assert late["contact_zero"] == pytest.approx(-0.006, abs=1e-7)
    truth, pulls = {"contact_zero": 0.008, "normal_force_ratio": 1.08 * problem.model.normal_force_ratio}, []
    for seed in range(16):
        data = ground(problem, 0.008, 1.08, sd=5e-4, seed=seed)
        fits = {what: plunge.identify(data, what, **options) for what in truth}
        pulls.append([(fits[what][what] - true) / fits[what].sd[0] for what, true in truth.items()])
    assert np.std(pulls, axis=0) == pytest.approx(1.0, abs=0.4) and np.all(
        abs(np.mean(pulls, axis=0)) < 4 / np.sqrt(16)
    )


@pytest.mark.parametrize("what", ["contact_zero", "normal_force_ratio", "wear_flat_area"])
def test_it_does_not_matter_where_the_gauge_begins(what):
    """The same value and interval, also where it begins below 0 or farther off than the part is fed."""
    data = ground(NOMINAL, 0.008, 1.08, sd=5e-4, power_sd=0.01)
    plain = plunge.identify(data, what, problem=NOMINAL)
    for begins in (-0.147, 0.02, 0.05, 3.0):
        fit = plunge.identify(data | {"size": data["size"] + begins}, what, problem=NOMINAL)
        assert fit[what] == pytest.approx(plain[what], rel=1e-5)
        assert fit.sd == pytest.approx(plain.sd, rel=1e-3)


def test_the_samples_of_one_machine_tell_the_same_contact():
    """The gauge of the second file falls from 0.5 mm of the diameter."""
    samples = Path(__file__).parents[1] / "data" / "samples"
    brackets = hwsim.Log.read(samples / "plunge_brackets.csv", time="t", size="X", command_rate="v")
    size = ("Aufmaß Durchmesser", "um", -0.5)
    deutsch = hwsim.Log.read(
        samples / "plunge_deutsch.csv", time="Zeit", size=size, command_rate="Zustellung"
    )
    for what in ("contact_zero", "normal_force_ratio"):
        one, other = (plunge.identify(log, what, problem=NOMINAL) for log in (brackets, deutsch))
        assert other[what] == pytest.approx(one[what], abs=0.1 * one.sd[0])


def test_the_linear_model_holds_about_one_rate():
    """With deflection by force the linear lag of roughing is shorter than that of spark-out."""
    model = NOMINAL.model
    blank = np.full(TIME.size, np.nan)
    roughing = cycle(
        _contact.course(_records.Cycle("", TIME, np.full(TIME.size, RATE), blank, blank, blank), model).size
    )
    linear, secant = found(roughing), found(roughing, problem=NOMINAL)
    assert linear.message.endswith("at other rates the lag is another; in spark-out with `problem`")
    said = [
        found(ground(problem, sd=5e-4, seed=k)).message
        for problem in (NOMINAL, EXPERIMENT)
        for k in range(10)
    ]
    assert sum("leaves more than noise" in words for words in said[:10]) >= 7
    assert sum("leaves more than noise" in words for words in said[10:]) <= 1
    assert linear["time_constant"] < 1.85 < secant["time_constant"]
    assert secant["time_constant"] == pytest.approx(NOMINAL.time_constant, rel=1e-5)


def test_linear_and_secant_agree_on_a_linear_machine():
    data = ground(EXPERIMENT, sd=5e-4)
    assert found(data)["time_constant"] == pytest.approx(1.9347, abs=0.01)
    assert found(data, problem=EXPERIMENT)["time_constant"] == pytest.approx(1.9347, abs=0.01)


def test_a_wheel_that_is_loaded_from_the_start():
    """Contact before the command is 0."""
    model = EXPERIMENT.model
    blank = np.full(TIME.size, np.nan)
    for zero in (-0.01, 0.004):
        exact = _contact.course(
            _records.Cycle("", TIME, np.full(TIME.size, RATE), blank, blank, blank), model, zero
        ).size
        for method in ("output_error", "recursive"):
            assert found(cycle(exact), method=method)["time_constant"] == pytest.approx(1.9347, rel=1e-5)


def test_the_area_from_the_power():
    duller = 1.1 * NOMINAL.model.wear_flat_area
    exact = plunge.identify(ground(NOMINAL, area=duller), "wear_flat_area", problem=NOMINAL)
    assert exact["wear_flat_area"] == pytest.approx(duller, rel=1e-5)
    pulls = []
    for seed in range(12):
        data = ground(NOMINAL, 0.005, 1.05, sd=5e-4, power_sd=0.01, seed=seed, area=duller)
        fit = plunge.identify(data, "wear_flat_area", problem=NOMINAL)
        assert 1.0 < fit.sd[0] / (duller * 0.0255 / np.sqrt(300)) < 2.0  # the rates are estimates too
        pulls.append((fit["wear_flat_area"] - duller) / fit.sd[0])
    assert np.std(pulls) == pytest.approx(1.0, abs=0.45) and abs(np.mean(pulls)) < 4 / np.sqrt(12)
    # Without a size the commanded infeed is believed.
    blind = {name: values for name, values in ground(NOMINAL, area=duller).items() if name != "size"}
    assert plunge.identify(blind, "wear_flat_area", problem=NOMINAL)["wear_flat_area"] == pytest.approx(
        duller, rel=1e-5
    )


def test_power_that_resembles_its_neighbours_says_less():
    """A drift of 1 %, autocorrelation 0.8: three times the standard deviation of the mean."""
    exact, alike, pulls = ground(NOMINAL), 0.8, []
    drifts = np.random.default_rng(0).standard_normal((64, exact["time"].size))
    for drift in drifts:
        drift[1:] *= np.sqrt(1 - alike**2)
        drift[:] = signal.lfilter([1.0], [1.0, -alike], drift)
        data = exact | {"grinding_power": exact["grinding_power"] * (1 + 0.01 * drift)}
        fit = plunge.identify(data, "wear_flat_area", problem=NOMINAL)
        pulls.append((fit["wear_flat_area"] - NOMINAL.model.wear_flat_area) / fit.sd[0])
    assert np.std(pulls) == pytest.approx(1.1, abs=0.4) and abs(np.mean(pulls)) < 4 / np.sqrt(64)


@pytest.mark.parametrize(
    ("rate", "published"), [(0.0448, 2.3), (None, 2.9)], ids=["at the greatest rate", "where burning begins"]
)
def test_one_per_cent_of_power(rate, published):
    """dA/A = (P/P_sl) dP/P; and by two readings of it."""
    model = NOMINAL.model
    v = np.full(12, model.burn_rate if rate is None else rate)
    part = _records.Cycle("", np.arange(12.0), v, v, 1.01 * model.grinding_power(v), np.zeros(12))
    from plunge_inside import samples

    each, _ = samples(part, model, v, np.ones(12, dtype=bool), np.inf)
    percent = 100 * (each[0] / model.wear_flat_area - 1)
    assert percent == pytest.approx(published, abs=0.05)
    bare = model.grinding_power(v) - model.replace(wear_flat_area=1e-9).grinding_power(v)
    assert percent == pytest.approx(float(model.grinding_power(v)[0] / bare[0]), rel=1e-6)


@pytest.mark.parametrize("told", ["by its limit", "by a flag", "by nothing"])
def test_clipped_power_is_never_used(told):
    """A monitor clipped at 1800 W: the same area; with clipped readings 12 % less."""
    data = ground(NOMINAL, sd=5e-4, power_sd=0.01)
    clipped = data | {"grinding_power": np.minimum(data["grinding_power"], 1800.0)}
    flags = {"power_saturated": (clipped["grinding_power"] >= 0.99 * 1800.0) * 1.0}
    known = {"by its limit": {"power_max": 1800.0}}.get(told, {})
    fit = plunge.identify(
        clipped | (flags if told == "by a flag" else {}), "wear_flat_area", problem=NOMINAL, **known
    )
    assert abs(fit["wear_flat_area"] - 0.026) < 4 * fit.sd[0] < 0.02 * 0.026
    believed = plunge.identify(clipped, "wear_flat_area", problem=NOMINAL, power_max=1e5)
    assert believed["wear_flat_area"] < 0.95 * 0.026


def test_only_clipped_power():
    data = ground(NOMINAL)
    low = data | {"grinding_power": np.where(data["grinding_power"] > 0, 300.0, np.nan)}
    fit = plunge.identify(low, "wear_flat_area", problem=NOMINAL)
    assert fit.status is identify.Status.NOT_IDENTIFIED
    assert "readings of the power are clipped" in fit.message


def test_missing_power_is_skipped():
    data = ground(NOMINAL, sd=5e-4, power_sd=0.01)
    holes = data["grinding_power"].copy()
    holes[::3] = np.nan
    fit = plunge.identify(data | {"grinding_power": holes}, "wear_flat_area", problem=NOMINAL)
    assert abs(fit["wear_flat_area"] - 0.026) < 4 * fit.sd[0]


def test_wear_is_taken_off():
    """The area grows from 0.026 by 0.006: the estimate is that at the start."""
    wear = plunge.Wear(growth=0.006 / 0.282)
    data, model = ground(NOMINAL), NOMINAL.model
    rate = model.infeed_rate(
        np.maximum(np.r_[0.0, np.cumsum(data["command_rate"][:-1]) * STEP] - data["size"], 0.0)
    )
    area = 0.026 + wear.growth * data["size"]
    rest, one = (
        np.array([float(model.replace(wear_flat_area=a).grinding_power(v)) for v in rate])
        for a in (1e-12, 0.01)
    )
    data["grinding_power"] = np.where(rate > 0, rest + (one - rest) / 0.01 * area, 0.0)
    plain = plunge.identify(data, "wear_flat_area", problem=NOMINAL)
    known = plunge.identify(data, "wear_flat_area", problem=NOMINAL.replace(wear=wear))
    assert plain["wear_flat_area"] > 0.0275
    assert known["wear_flat_area"] == pytest.approx(0.026, rel=5e-3)


def test_what_was_measured_updates_the_problem():
    fit = found(noisy(5e-4, 0))
    updated = NOMINAL.updated(fit)
    assert updated.time_constant == fit["time_constant"] and (
        plunge.plan(updated).time > plunge.plan(NOMINAL).time
    ) == (fit["time_constant"] > NOMINAL.time_constant)
    # The deflection has this time constant, and nothing else of the model is changed.
    assert updated.replace(time_constant=None).time_constant == pytest.approx(fit["time_constant"], rel=1e-9)
    assert updated.replace(stiffness=NOMINAL.model.stiffness).model == NOMINAL.model
    area = plunge.identify(ground(NOMINAL, area=0.03), "wear_flat_area", problem=NOMINAL)
    assert NOMINAL.updated(area).model == NOMINAL.model.replace(wear_flat_area=area["wear_flat_area"])
    assert NOMINAL.updated(area).time_constant == NOMINAL.time_constant
    ratio = plunge.identify(ground(NOMINAL, scale=0.9), "normal_force_ratio", problem=NOMINAL)
    again = NOMINAL.updated(ratio)
    assert again.model.deflection(0.02) == pytest.approx(0.9 * NOMINAL.model.deflection(0.02), rel=1e-6)
    assert again.replace(time_constant=None).time_constant == pytest.approx(
        0.9 * NOMINAL.time_constant, rel=1e-6
    )


def test_what_a_problem_does_not_take():
    failed = found(cycle(SIZE[:5], TIME[:5]))
    with pytest.raises(
        ValueError, match="estimate must have succeeded; got 'not identified: 2 readings of a moving size"
    ):
        NOMINAL.updated(failed)
    contact = plunge.identify(ground(NOMINAL), "contact_zero", problem=NOMINAL)
    with pytest.raises(
        ValueError,
        match=r"estimate.names must be one of time_constant, B, burning_sd, wheel_diameter.*; got 'contact_zero'",
    ):
        NOMINAL.updated(contact)
    with pytest.raises(TypeError, match=r"estimate must be what plunge.identify gives; got 1.9"):
        NOMINAL.updated(1.9)


def test_the_two_experiments():
    """Roundness of 3.9 and 2.9 um with 1.8 and 1.95 s gives the lag; then v_f, k_r and the stock."""
    runs = ((0.026, 1.8, 3.9), (0.0255, 1.95, 2.9))

    def off(values):
        gain, rate = values  # µm of roundness for each mm/s, 1/s
        return [gain * (u - assumed * rate * (u - 3.0 / gain)) - left for u, assumed, left in runs]

    gain, rate = optimize.fsolve(off, [600.0, 0.5], xtol=1e-12)
    assert 1 / rate == pytest.approx(1.9347, abs=1e-3) and 3.0 / gain == pytest.approx(0.00490, abs=1e-5)
    assert EXPERIMENT.model.linear_time_constant == pytest.approx(1 / rate, abs=1e-4)
    assert EXPERIMENT.final_rate == pytest.approx(3.0 / gain, rel=1e-4)
    assert (
        EXPERIMENT.model.roundness_gain
        == pytest.approx(5.0 * gain / 1000, rel=1e-4)
        == pytest.approx(3.063, abs=1e-3)
    )
    # Spark-out from the steady rate with the assumed time constant leaves the published roundness.
    for u, assumed, left in runs:
        end = u - assumed * rate * (u - EXPERIMENT.final_rate)
        assert EXPERIMENT.model.roundness(end) == pytest.approx(units.um(left), rel=1e-3)


def test_the_stock_of_the_experiment():
    """Full rate, then spark-out begun with 1.95 s: 17.87 s, the published 24.66 s less 38 %."""
    tau, final, u = EXPERIMENT.model.linear_time_constant, EXPERIMENT.final_rate, EXPERIMENT.command_rate_max

    def off(start):
        v = u * (1 - np.exp(-start / tau))
        given = u * start - tau * v
        left = EXPERIMENT.stock - given
        return left - 1.95 * (v - final)

    start = optimize.brentq(off, 5.0, 17.0)
    v = u * (1 - np.exp(-start / tau))
    end = v - (1.95 / tau) * (v - final)
    assert start + tau * np.log(v / end) == pytest.approx(24.66 / 1.38, abs=0.01)
    assert EXPERIMENT.command_rate_max < EXPERIMENT.model.burn_rate  # two segments


def test_the_lag_of_the_linear_machine():
    model = EXPERIMENT.model
    assert model.deflection(0.02) == pytest.approx(0.02 * 1.9347, rel=1e-12)
    assert model.infeed_rate(0.02 * 1.9347) == pytest.approx(0.02, rel=1e-12)
    assert model.local_time_constant(0.01) == pytest.approx(1.9347) == EXPERIMENT.time_constant
    np.testing.assert_array_equal(model.local_time_constant([0.0, 0.02]), 1.9347)
    assert model.grinding_power(0.026) == pytest.approx(1778.0, abs=2.0)  # power is still that of the force
    with pytest.raises(ValueError, match=r"linear_time_constant must be > 0 \(s\); got 0.0"):
        model.replace(linear_time_constant=0.0)


def test_the_presets_are_told():
    assert [info.name for info in plunge.presets()] == ["simulation", "experiment"]
    assert all(len(info) == 4 and all(info) for info in plunge.presets())
    with pytest.raises(ValueError, match="name must be one of simulation, experiment; got 'nominal'"):
        plunge.preset("nominal")


def frozen():
    data = noisy(5e-4, 0)
    data["size"][80:] = data["size"][80]
    return data


def backwards():
    data = noisy(5e-4, 0)
    data["size"][80:] -= 0.02
    return data


def two_parts():
    data = noisy(5e-4, 0)
    data["size"][80:] = data["size"][:81]
    return data


def still():
    return cycle(np.random.default_rng(0).normal(0, 5e-4, TIME.size))


FAULTY = [
    (frozen, r"the gauge stands still at 0\.07\d\d mm from 3\.20 to 6\.40 s while the work is ground"),
    (
        backwards,
        r"the size jumps back by 0\.01\d+ mm at 3\.20 s, more than 5 standard deviations of its noise",
    ),
    (
        two_parts,
        r'the size jumps back by 0\.0\d+ mm .* noise; of another part\? Log\.read takes its column, part="header"',
    ),
    (still, r"0 readings of a moving size are too few: at least 10 are needed \(0 are missing\)"),
    (lambda: cycle(np.full(TIME.size, 0.1)), "0 readings of a moving size are too few"),
    (
        lambda: cycle(np.full(TIME.size, np.nan)),
        r"0 readings of a moving size are too few: .* \(161 are missing\)",
    ),
    (lambda: cycle(RATE * TIME), "command and size say too little of it"),
]


@pytest.mark.parametrize(("data", "reason"), FAULTY)
@pytest.mark.parametrize("method", ["output_error", "recursive"])
def test_faulty_readings(data, reason, method):
    fit = found(data(), method=method)
    assert fit.status == "not identified" and not fit.ok
    assert np.all(np.isfinite(fit.value)) and np.all(np.isinf(fit.sd))
    with pytest.raises(ValueError, match=f"^not identified: {reason}"):
        found(data(), method=method, throw=True)


def test_a_value_below_its_standard_deviation_is_told_in_full():
    """Of a pure number no unit is told; a last digit 1 of the standard deviation is."""
    vague = identify.Estimate(("wear_flat_area",), [0.05], [[0.11**2]], units=("1",))
    assert _records.concluded(vague, "too little").message == "not identified: too little (0.05 ± 0.11)"
    in_s = identify.Estimate(("time_constant",), [0.05], [[0.11**2]], units=("s",))
    assert _records.concluded(in_s, "too little").message == "not identified: too little (0.05 ± 0.11 s)"


@pytest.mark.parametrize("what", ["contact_zero", "normal_force_ratio"])
def test_faulty_readings_of_the_contact(what):
    for data, reason in ((frozen(), "stands still"), (backwards(), "jumps back")):
        fit = plunge.identify(data, what, problem=NOMINAL)
        assert not fit.ok and reason in fit.message


@pytest.mark.parametrize("what", ["time_constant", "contact_zero", "wear_flat_area"])
def test_two_parts_in_one_series_are_told_and_a_gauge_that_retreats_is_none(what):
    """Taken as one part, the power of both gives a wear flat area, and a wrong one."""
    data = ground(NOMINAL, sd=5e-4)
    both = {name: np.concatenate([values, values]) for name, values in data.items()}
    both["time"] = np.concatenate([data["time"], data["time"] + data["time"][-1] + 0.5])
    told = plunge.identify(both, what, problem=NOMINAL, throw=False)
    assert not told.ok and told.message.endswith('of another part? Log.read takes its column, part="header"')
    data["size"][-3:] = 0.0
    told = plunge.identify(data, what, problem=NOMINAL, throw=False)
    assert told.ok == (what == "wear_flat_area") and "another part" not in told.message


@pytest.mark.parametrize("at, readings, size", [(60, 1, -1.0), (200, 20, 0.0), (200, 20, -1.0), (15, 1, 0.5)])
def test_a_spike_or_a_gauge_that_is_withdrawn_for_a_while_is_no_other_part(at, readings, size):
    data = ground(NOMINAL, sd=5e-4)
    data["size"][at : at + readings] = size
    assert plunge.identify(data, "wear_flat_area", problem=NOMINAL).value == pytest.approx([0.026])
    told = plunge.identify(data, "time_constant", problem=NOMINAL, throw=False)
    assert "the size jumps back by" in told.message and "another part" not in told.message


@pytest.mark.parametrize("between", [None, -1.0])
def test_a_part_of_less_stock_before_another_is_told(between):
    """Its size jumps back by a third of the range of both; a gauge without work may show anything."""
    data = ground(NOMINAL, sd=5e-4)
    short = {name: values[:100].copy() for name, values in data.items()}
    if between is not None:
        short["size"][-5:] = between
    both = {name: np.concatenate([short[name], values]) for name, values in data.items()}
    both["time"] = np.concatenate([short["time"], data["time"] + short["time"][-1] + 0.5])
    told = plunge.identify(both, "wear_flat_area", problem=NOMINAL, throw=False)
    assert not told.ok and "of another part" in told.message


def test_a_gauge_in_steps_is_not_frozen():
    """1 um steps, in a spark-out in which many readings are equal."""
    data = ground(NOMINAL, sd=5e-4)
    for size in (data["size"], ground(NOMINAL)["size"]):
        stepped = data | {"size": np.round(size, 3)}
        assert found(stepped).ok
        fit = plunge.identify(stepped, "contact_zero", problem=NOMINAL)
        assert fit["contact_zero"] == pytest.approx(0.0, abs=5e-4)


def test_a_pole_of_no_lag():
    """(4) of a size that alternates: a' < 0; never NaN."""
    rng = np.random.default_rng(0)
    data = cycle(0.02 * TIME + 1e-3 * (-1.0) ** np.arange(TIME.size) + rng.normal(0, 1e-5, TIME.size))
    fit = found(data, method="printed")
    assert not fit.ok and np.isfinite(fit["time_constant"])
    assert fit.message.startswith("not identified: (4) gives a' = -") and fit.message.endswith(
        "it must be in (0, 1)"
    )


@given(
    data=st.lists(st.floats(-0.1, 0.5) | st.just(float("nan")), min_size=3, max_size=40),
    seed=st.integers(0, 9),
)
@settings(max_examples=30, deadline=None)
def test_never_nan(data, seed):
    """Any readings: a value with a variance, or a reason."""
    u = np.random.default_rng(seed).uniform(0, 0.05, len(data))
    for method in ("output_error", "recursive", "printed"):
        fit = found(cycle(np.array(data), STEP * np.arange(len(data)), u), method=method)
        assert np.isfinite(fit.value[0]) and not np.isnan(fit.sd[0])
        assert fit.ok or fit.message.startswith("not identified: ")


MESSAGES = [
    (
        lambda: plunge.identify(cycle(), "colour"),
        "what must be one of time_constant, wear_flat_area, contact_zero, normal_force",
    ),
    (
        lambda: found(cycle(), method="kalman"),
        "method must be one of output_error, recursive, printed; got 'kalman'",
    ),
    (lambda: found(cycle(), forgetting=0.0), r"forgetting must be in \(0, 1\] \(1\); got 0.0"),
    (lambda: plunge.TimeConstantEstimator(forgetting=1.5), r"forgetting must be in \(0, 1\] \(1\); got 1.5"),
    (
        lambda: found(cycle(), method="printed", problem=NOMINAL),
        "problem must be left out with method 'printed'",
    ),
    (
        lambda: found({"time": TIME, "size": SIZE}),
        r"data must hold command_rate \(mm/s\); it holds time, size",
    ),
    (lambda: found(cycle() | {"size": SIZE[:7]}), "size must have as many entries as time, 161; got 7"),
    (lambda: found(cycle(SIZE, TIME[::-1])), r"time must be rising \(s\); got 6.4 and then 6.36"),
    (lambda: found(log([0, 1]), part=7), r"part must be one of 0, 1; got 7"),
    (lambda: found(cycle(), part=1), "part must be left out of data without a column part; got 1"),
    (
        lambda: plunge.identify(cycle(), "wear_flat_area", problem=NOMINAL),
        r"data must hold grinding_power \(W\)",
    ),
    (
        lambda: plunge.identify(cycle(), "wear_flat_area", problem=NOMINAL, power_max=0.0),
        r"power_max must be > 0 \(W\)",
    ),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()


def test_kinds():
    with pytest.raises(
        TypeError,
        match="problem must be a CycleProblem, whose model is corrected, for 'contact_zero'; got None",
    ):
        plunge.identify(cycle(), "contact_zero")
    with pytest.raises(TypeError, match="data must be arrays by name, or a log; got float"):
        found(3.0)
