"""Bounding of constraints: the theory of (9), the model's optimum by three methods, whole series."""

import functools
import math
import types
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plunge_inside import CONSTRAINTS, SETTINGS, SOLVED, StageTask, moved, optimum, program, readings
from scipy.optimize import brentq

import hwsim
from sdpgrind import plunge

COARSE = plunge.preset("simulation")
FINE = COARSE.replace(sample_time=0.02)
SHARP, DULL = (
    FINE.replace(wear_flat_area=0.0234),
    FINE.replace(wear_flat_area=0.034),
)  # what a controller may believe; true is 0.026
BUFFER = {"burned_layer": 0.003, "roundness": 5e-5}  # mm
SAFE = {"stage_remaining": 0.12, "stage_rate": 0.005}  # mm, mm/s


def ground(plant, controller):
    """Time to the instant of size (s), slack and out-of-roundness (mm) of a part without noise."""
    outcome = hwsim.run(hwsim.PlungeGrinder(plant, noise=None), controller).outcome
    left, slack, roundness = (float(outcome[name][0]) for name in ("remaining", "part_slack", "roundness"))
    rate = (roundness - plant.model.roundness_base) * plant.model.turns / plant.model.roundness_gain
    return float(outcome.time[0]) + left / rate, slack, roundness


def settings_of(controller):
    return {name: getattr(controller, name) for name in SETTINGS}


def believed(model, **chosen):
    return plunge.StagedController(model, **{**SAFE, **chosen})


# ---- theory of (9): the margin is b below the limit, slack d = margin - shortfall, so that d+ = d - (b+ - b)


def slacks(first, step, buffer, rule, parts=200):
    """Slack after each part, for a slack that follows the bound one to one."""
    found, bound = [first], 0.0
    for _ in range(parts):
        bound = moved(bound, first - bound, step=step, buffer=buffer, rule=rule)
        found.append(first - bound)
    return np.array(found)


steps = st.floats(0.01, 1.0)
buffers = st.floats(1e-4, 1e-2)
lead = st.floats(1.001, 40.0)  # first slack over the buffer


@given(steps, buffers, lead)
def test_as_printed_the_slack_follows_its_line_until_it_stops(step, buffer, ahead):
    found = slacks(ahead * buffer, step, buffer, "printed", 30)
    for before, after in pairwise(found):
        line = (1 - step) * before - step * buffer if before > buffer else before
        assert after == pytest.approx(line, abs=1e-12)


@given(st.floats(0.01, 0.5), buffers, lead)
def test_as_printed_no_part_burns_up_to_half(step, buffer, ahead):
    assert slacks(ahead * buffer, step, buffer, "printed").min() >= (1 - 2 * step) * buffer - 1e-12


@given(st.floats(0.51, 0.99), buffers)
def test_as_printed_a_part_can_burn_above_half(step, buffer):
    """Just above the buffer the next slack is near (1 - 2c) n."""
    assert slacks(1.0001 * buffer, step, buffer, "printed", 2).min() < 0.5 * (1 - 2 * step) * buffer < 0


@given(st.floats(0.05, 0.5), buffers, st.floats(1.5, 40.0))
def test_as_printed_the_number_of_cycles(step, buffer, ahead):
    first = ahead * buffer
    exact = math.log((first + buffer) / (2 * buffer)) / -math.log(1 - step)
    stops = np.argmax(np.diff(slacks(first, step, buffer, "printed", 500)) == 0)
    if abs(exact - round(exact)) > 1e-6:  # a cycle more or less by rounding
        assert stops + 1 == 1 + math.ceil(exact)


@given(steps, buffers, lead)
def test_contracting_never_burns_and_shrinks_to_the_buffer(step, buffer, ahead):
    found = slacks(ahead * buffer, step, buffer, "contracting", 20)
    assert found.min() >= buffer - 1e-12
    shrinks = (ahead - 1) * buffer * (1 - step) ** np.arange(21)
    np.testing.assert_allclose(found - buffer, shrinks, atol=1e-12)


@pytest.mark.parametrize("rule", ["printed", "contracting"])
def test_a_margin_moves_as_a_bound_does(rule):
    """The margin of `MarginBounding` equals the excess of `ConstraintBounding`."""
    shortfall, buffer = 0.011, 0.005
    bounding = plunge.learning.MarginBounding(0.25, buffer, rule=rule, slack="true")
    controller, found = plunge.CycleController(COARSE, safety_margin=0.05), [0.05 - shortfall]
    for _ in range(12):
        slack = controller.safety_margin - shortfall
        controller = bounding.next(
            controller, types.SimpleNamespace(figure=lambda name, slack=slack: np.array([slack]))
        )
        found.append(controller.safety_margin - shortfall)
    np.testing.assert_allclose(found, slacks(found[0], 0.25, buffer, rule, 12), atol=1e-12)


# ---- three stages


def test_stages_change_where_the_stock_is():
    """Between samples: time and slack are continuous in the switching stock."""
    remaining = np.linspace(0.087, 0.089, 9)
    times, left, _ = np.array(
        [ground(COARSE, believed(COARSE, stage_remaining=r, stage_rate=0.007)) for r in remaining]
    ).T
    assert np.all(np.diff(times) > 0) and np.all(np.diff(left) > 0)
    np.testing.assert_allclose(np.diff(left), np.diff(remaining), rtol=0.4)


def test_rough_and_final_rate_of_a_controller():
    slow = believed(COARSE, rough_rate=0.03, final_rate=0.002)
    log = hwsim.run(hwsim.PlungeGrinder(COARSE, noise=None), slow)
    assert np.nanmax(log["controller"].command_rate_command) == 0.03
    assert float(log.outcome.roundness[0]) == pytest.approx(float(COARSE.model.roundness(0.002)), abs=3e-5)
    plain = believed(COARSE)
    assert (plain.rough_rate, plain.final_rate) == (COARSE.command_rate_max, COARSE.final_rate)


@pytest.mark.parametrize("ratio", [math.inf, 20.0, 6.0])
@pytest.mark.parametrize(
    "chosen",
    [
        {"stage_remaining": 0.0857, "stage_rate": 0.0079},
        {"stage_remaining": 0.1, "stage_rate": 0.006},
        {"stage_remaining": 0.12, "stage_rate": 0.005, "final_rate": 0.0018},
        {"stage_remaining": 0.06, "stage_rate": 0.006, "rough_rate": 0.03},
        {"stage_remaining": 0.09, "stage_rate": 0.0082},
    ],
)
def test_the_closed_form_against_the_simulated_part(chosen, ratio):
    problem = COARSE.replace(sample_time=0.005, grinding_ratio=ratio)
    controller = believed(problem, **chosen)
    time, slack, roundness = ground(problem, controller)
    own = program(problem)
    found, reached = own.reached(own.at(settings_of(controller)))
    assert found == pytest.approx(time, abs=1e-3)
    assert reached["burned_layer"] == pytest.approx(-slack, abs=1e-4)
    assert reached["roundness"] == pytest.approx(roundness, abs=1e-5)
    power = (
        hwsim.run(hwsim.PlungeGrinder(problem, noise=None), controller)
        .column("controller", "grinding_power")
        .max()
    )
    assert reached["grinding_power"] == pytest.approx(power, rel=1e-4)


# ---- the model's optimum


def best(margin, power=np.inf, method="qp", moving=SETTINGS, problem=COARSE):
    bounds = {"burned_layer": -margin, "roundness": problem.roundness_max - 2e-5, "grinding_power": power}
    return optimum(
        problem,
        settings_of(believed(problem, stage_remaining=0.1)),
        bounds=bounds,
        moving=moving,
        method=method,
    )


@pytest.mark.parametrize("power", [1e4, 2500.0, 2000.0])
@pytest.mark.parametrize("margin", [0.0, 0.003, 0.008])
def test_quadratic_programs_and_ipopt_agree(margin, power):
    ours, theirs = best(margin, power), best(margin, power, "nlp")
    assert ours.message == theirs.message == SOLVED
    assert ours.time == pytest.approx(theirs.time, abs=1e-6)
    for name in SETTINGS:
        assert ours.settings[name] == pytest.approx(theirs.settings[name], rel=1e-4)
    assert ours.reached["burned_layer"] == pytest.approx(-margin, abs=1e-7)
    assert ours.reached["grinding_power"] <= power * (1 + 1e-7)


def test_quadratic_programs_that_do_not_settle_leave_the_rest_to_ipopt(monkeypatch):
    """A step before the last the conditions hold already, and the unknowns still move."""
    task = StageTask(
        program(COARSE),
        settings_of(believed(COARSE, stage_remaining=0.1)),
        {"burned_layer": 0.0, "roundness": COARSE.roundness_max - 2e-5, "grinding_power": 2500.0},
        SETTINGS,
    )
    steps = task.by_quadratic_programs()[2]
    monkeypatch.setattr("sdpgrind.plunge._stages.solvers._STEPS", steps - 1)
    assert task.by_quadratic_programs()[1] == f"{steps - 1} steps were not enough"
    assert best(0.0, 2500.0).time == best(0.0, 2500.0, "nlp").time


def test_the_optimum_against_brute_force():
    """No other stage rate, with its least stock for the margin, is faster in the simulated part."""
    problem, margin = COARSE.replace(sample_time=0.01), 0.003
    found = best(margin, problem=problem)
    final = found.settings["final_rate"]
    times = []
    for rate in np.linspace(0.006, 0.0082, 12):
        part = functools.partial(believed, problem, stage_rate=rate, final_rate=final)
        remaining = brentq(
            lambda r, part=part: ground(problem, part(stage_remaining=r))[1] - margin, 0.05, 0.2, xtol=1e-6
        )
        times.append(ground(problem, part(stage_remaining=remaining))[0])
    assert min(times) - 0.01 < found.time < min(times) + 1e-3
    time, slack, _ = ground(problem, plunge.StagedController(problem, **found.settings))
    assert slack == pytest.approx(margin, abs=1e-4) and time == pytest.approx(found.time, abs=2e-3)


@given(st.floats(0.0, 0.008), st.floats(1900.0, 2800.0))
@settings(max_examples=15, deadline=None)
def test_a_tighter_bound_never_makes_the_model_faster(margin, power):
    time = best(margin, power).time
    assert time <= best(margin + 0.001, power).time + 1e-6
    assert time <= best(margin, power - 50.0).time + 1e-6


def test_settings_that_do_not_move_stay():
    found = best(0.003, moving=("stage_remaining", "final_rate"))
    start = settings_of(believed(COARSE, stage_remaining=0.1))
    assert found.message == SOLVED and found.settings["stage_remaining"] < 0.09
    for name in ("rough_rate", "stage_rate"):
        assert found.settings[name] == start[name]


def test_the_statement_in_cvxpy_has_the_solution_of_osqp():
    cvxpy = pytest.importorskip("cvxpy")
    stated = best(0.003).first.statement()
    assert stated.is_dcp(dpp=True)
    stated.solve(solver=cvxpy.CLARABEL)
    np.testing.assert_allclose(stated.var_dict["step"].value, best(0.003).first.solved()[0], atol=1e-5)
    assert best(0.004).first.statement() is stated  # stated once, with other values


def test_slopes_against_differences():
    task = StageTask(
        program(COARSE), settings_of(believed(COARSE, stage_remaining=0.1)), {"roundness": 0.003}, SETTINGS
    )
    x, prices = task.start, np.linspace(0, 1, task.ceilings.size)
    slope, _, slopes, curvature = (np.asarray(each) for each in task.program.derivatives(x, prices))

    def of(x):
        time, conditions = (np.asarray(each).ravel() for each in task.program.values(x))
        return np.append(time, conditions)

    def pull(x):
        gradient, _, jacobian, _ = (np.asarray(each) for each in task.program.derivatives(x, prices))
        return gradient.ravel() + jacobian.T @ prices

    for k, step in enumerate(1e-6 * np.eye(x.size)):
        np.testing.assert_allclose(
            (of(x + step) - of(x - step)) / 2e-6, np.append(slope[k], slopes[:, k]), atol=1e-6
        )
        np.testing.assert_allclose((pull(x + step) - pull(x - step)) / 2e-6, curvature[:, k], atol=1e-5)


# ---- what is measured


def test_what_is_measured_without_noise_is_what_is():
    """Also with a wrong wheel in the controller."""
    for model in (FINE, SHARP, DULL):
        controller = believed(model, stage_remaining=0.09, stage_rate=0.007)
        log = hwsim.run(hwsim.PlungeGrinder(FINE, noise=None), controller)
        found = readings.measured(log, controller)
        assert found["burned_layer"] == pytest.approx(-float(log.outcome.part_slack[0]), abs=4e-4)
        assert found["roundness"] == float(log.outcome.roundness[0])


def test_noise_does_not_bias_what_is_measured():
    """Uncorrected, the maximum of noisy readings has three times the remaining bias."""
    controller, cleared, raw = believed(COARSE, stage_remaining=0.09, stage_rate=0.007), [], []
    for seed in range(40):
        log = hwsim.run(hwsim.PlungeGrinder(COARSE), controller, rng=seed)
        found = readings.measured(log, controller)
        cleared.append([found["burned_layer"] + float(log.outcome.part_slack[0]), found["grinding_power"]])
        raw.append(np.max(log.column("controller", "grinding_power")))
    layer, power = np.mean(cleared, axis=0)
    true = (
        hwsim.run(hwsim.PlungeGrinder(COARSE, noise=None), controller)
        .column("controller", "grinding_power")
        .max()
    )
    assert abs(layer) < 6e-4  # of a scatter of 0.9e-3 in each part
    assert power == pytest.approx(true, rel=0.003) and np.mean(raw) > 1.01 * true


def test_readings_that_are_missing_or_clipped():
    controller = believed(FINE, stage_remaining=0.09, stage_rate=0.007)
    plain = hwsim.run(hwsim.PlungeGrinder(FINE, noise=None), controller)
    true = -float(plain.outcome.part_slack[0])
    clipped = hwsim.run(hwsim.PlungeGrinder(FINE, noise=None, power_max=2000.0), controller)
    # of the model where clipped
    assert readings.measured(clipped, controller)["burned_layer"] == pytest.approx(true, abs=4e-4)
    columns = {name: plain.column("controller", name).copy() for name in readings._READ}
    columns["size"][::7] = columns["grinding_power"][::5] = np.nan
    log = types.SimpleNamespace(
        column=lambda tier, name: columns[name], figure=lambda name: np.array([0.003])
    )
    assert readings.measured(log, controller)["burned_layer"] == pytest.approx(true, abs=6e-4)
    columns["size"][:] = np.nan
    assert math.isnan(readings.measured(log, controller)["burned_layer"])


@given(
    st.lists(
        st.tuples(st.floats(0.001, 0.1), st.floats(0.0, 0.1), st.floats(1e-4, 2e-3)), min_size=1, max_size=12
    )
)
@settings(max_examples=30, deadline=None)
def test_the_mean_of_a_greatest_noisy_value(rows):
    """Against random numbers: noise counts where the value stays above 0."""
    value, less, sd = np.array(rows).T
    drawn = value + sd * np.random.default_rng(0).standard_normal((20_000, value.size))
    if (drawn > 0).all():
        greatest = np.max(drawn - less, axis=1)
        exact = readings._expected_maximum(value, less, sd)
        assert exact == pytest.approx(greatest.mean(), abs=5 * greatest.std() / 20_000**0.5 + 1e-6)


# ---- series


def series(plant, controller, bounding, parts):
    """Last controller, and the outcomes."""
    outcomes = []
    for _ in range(parts):
        used, log = controller, hwsim.run(plant, controller)
        outcomes.append(log.outcome)
        controller = bounding.next(controller, log)
    return used, outcomes


def bounding(**options):
    return plunge.learning.ConstraintBounding(**{"step": 0.5, "noise_buffer": BUFFER, **options})


def test_the_fixed_point_is_the_true_optimum_where_as_much_is_active_as_is_free():
    """Two limits, two settings: no other pair is faster on the real machine, with a model wrong by 30 %."""
    learner = bounding(settings=("stage_remaining", "final_rate"))
    controller, outcomes = series(hwsim.PlungeGrinder(FINE, noise=None), believed(DULL), learner, 16)
    assert learner.status == "solved" and not any(outcome.burned[0] for outcome in outcomes)
    assert learner.left["burned_layer"] == pytest.approx(0.003, abs=1e-4)
    assert learner.left["roundness"] == pytest.approx(5e-5, abs=2e-5)
    time, slack, roundness = ground(FINE, controller)
    for factor in (0.97, 0.99, 1.01, 1.03):
        for other in (0.97, 0.99, 1.0, 1.01, 1.03):
            remaining, final = factor * controller.stage_remaining, other * controller.final_rate
            there = ground(FINE, controller.replace(stage_remaining=remaining, final_rate=final))
            inside = there[1] >= slack - 2e-4 and there[2] <= roundness + 1e-5
            assert not inside or there[0] >= time - 0.03


def test_the_fixed_point_is_not_the_true_optimum_where_a_setting_is_left_over():
    """The same limits are met; the stage rate follows the wrong model."""
    learner = bounding()
    controller, outcomes = series(hwsim.PlungeGrinder(FINE, noise=None), believed(DULL), learner, 16)
    assert learner.left["burned_layer"] == pytest.approx(0.003, abs=1e-4)
    assert learner.left["roundness"] == pytest.approx(5e-5, abs=2e-5)
    time, slack, _ = ground(FINE, controller)
    other = controller.replace(stage_rate=0.0075)
    remaining = brentq(
        lambda r: ground(FINE, other.replace(stage_remaining=r))[1] - slack, 0.05, 0.2, xtol=1e-6
    )
    faster = ground(FINE, other.replace(stage_remaining=remaining))
    assert faster[1] >= slack - 1e-5 and faster[2] <= FINE.roundness_max
    assert faster[0] < 0.99 * time  # 12.24 of 12.46 s: what modifier adaptation would gain
    assert time < 0.8 * float(outcomes[0].time[0])  # of 17 s: what constraint adaptation does gain


def test_three_limits_three_settings():
    learner = bounding(power_max=2300.0, settings=("rough_rate", "stage_remaining", "final_rate"))
    controller, _ = series(hwsim.PlungeGrinder(FINE, noise=None), believed(SHARP), learner, 16)
    assert learner.left["grinding_power"] == pytest.approx(0.0, abs=2.0)
    assert learner.left["burned_layer"] == pytest.approx(0.003, abs=1e-4)
    assert learner.left["roundness"] == pytest.approx(5e-5, abs=2e-5)
    peak = (
        hwsim.run(hwsim.PlungeGrinder(FINE, noise=None), controller)
        .column("controller", "grinding_power")
        .max()
    )
    assert peak == pytest.approx(2300.0, abs=2.0) and controller.rough_rate < FINE.command_rate_max
    assert set(learner.bounds) == set(CONSTRAINTS)


@pytest.mark.parametrize("noise", [None, hwsim.GrinderNoise()])
def test_twenty_five_parts(noise):
    start = believed(COARSE.replace(wear_flat_area=0.0234))
    log = hwsim.run(
        hwsim.PlungeGrinder(COARSE, noise=noise),
        start,
        parts=25,
        rng=3,
        adapt=plunge.learning.ConstraintBounding(),
    )
    outcome = log.outcome
    assert not outcome.burned.any() and not outcome.timed_out.any()
    assert not outcome.out_of_round[10:].any()
    assert outcome.time[-1] < 0.78 * outcome.time[0]
    assert 0.001 < outcome.part_slack[-8:].mean() < 0.005


def test_both_methods_settle_alike():
    ends = []
    for method in ("qp", "nlp"):
        learner = bounding(method=method)
        ends.append(
            settings_of(series(hwsim.PlungeGrinder(COARSE, noise=None), believed(COARSE), learner, 8)[0])
        )
    for name in SETTINGS:
        assert ends[0][name] == pytest.approx(ends[1][name], rel=1e-3)


def test_a_series_that_was_killed_resumes(tmp_path):
    grinder, start = hwsim.PlungeGrinder(COARSE), believed(COARSE.replace(wear_flat_area=0.0234))
    common = {"rng": 5, "adapt": plunge.learning.ConstraintBounding(step=0.4, rule="printed")}
    whole = hwsim.run(grinder, start, parts=7, **common)
    hwsim.run(grinder, start, parts=3, journal=tmp_path / "series.db", **common)
    best(0.002)  # what else was solved meanwhile does not matter
    resumed = hwsim.run(grinder, start, parts=7, journal=tmp_path / "series.db", **common)
    for name in whole.outcome:
        np.testing.assert_array_equal(whole.outcome[name], resumed.outcome[name])
    assert common["adapt"].bounds == {}  # a run learns on a copy


def test_where_nothing_is_within_the_bounds_the_last_setting_stays():
    """The model deflects so much that none of its final rates is round enough on the stiffer machine."""
    learner, start = bounding(), believed(COARSE.replace(model=COARSE.model.replace(stiffness=6400.0)))
    log = hwsim.run(hwsim.PlungeGrinder(COARSE, noise=None), start)
    assert learner.next(start, log) is start
    assert learner.status.startswith("no setting is within the bounds, the last stays: IPOPT says Infeasible")
    assert learner.left["roundness"] < 0


def test_work_that_does_not_burn_has_no_burned_layer():
    problem = plunge.preset("experiment")
    learner = plunge.learning.ConstraintBounding(step=0.5)
    start = plunge.StagedController(problem, stage_remaining=0.05, stage_rate=0.006, final_rate=0.004)
    controller, outcomes = series(hwsim.PlungeGrinder(problem, noise=None), start, learner, 5)
    assert learner.status == "solved" and set(learner.bounds) == {"roundness"}
    assert outcomes[-1].time[0] < outcomes[0].time[0] and controller.final_rate > 0.004


# ---- the rule, on what is shown


def shown(monkeypatch, learner, *parts, start=None):
    """Bounds of the burned layer after parts with given slacks (mm)."""
    controller, bounds = start or believed(COARSE), []
    for left in parts:
        seen = {
            "burned_layer": -left,
            "roundness": COARSE.roundness_max - BUFFER["roundness"],
            "grinding_power": 1000.0,
        }
        monkeypatch.setattr("sdpgrind.plunge.learning._bounding.measured", lambda *_, seen=seen: seen)
        monkeypatch.setattr("sdpgrind.plunge.learning._bounding.at_size", lambda _: True)
        controller = learner.next(controller, None)
        bounds.append(learner.bounds["burned_layer"])
    return bounds


def test_as_printed_a_burned_part_brings_the_last_good_bound_back(monkeypatch):
    learner = bounding(rule="printed", step=0.8)
    first, second, back, again = shown(monkeypatch, learner, 0.02, 0.004, -0.001, 0.004)
    assert second - first == pytest.approx(0.8 * 0.007)
    assert back == pytest.approx(first, abs=1e-9) and again - back == pytest.approx(0.4 * 0.007)


def test_as_printed_what_was_never_good_is_stepped_back_from(monkeypatch):
    first, second, third = shown(monkeypatch, bounding(rule="printed"), -0.002, -0.001, -0.001)
    assert second - first == pytest.approx(-0.004) and third - second == pytest.approx(-0.004)


def test_as_printed_it_stops_at_the_buffer(monkeypatch):
    first, second, third = shown(monkeypatch, bounding(rule="printed"), 0.02, 0.003, 0.002)
    assert second == pytest.approx(first, abs=1e-9) and third == pytest.approx(first, abs=1e-9)


def test_contracting_takes_all_of_a_burned_layer_back(monkeypatch):
    first, second = shown(monkeypatch, bounding(step=0.1), 0.02, -0.001)
    assert second - first == pytest.approx(-0.004)


def test_what_was_not_measured_moves_nothing(monkeypatch):
    learner = bounding()
    first, second = shown(monkeypatch, learner, 0.02, math.nan)
    assert first == pytest.approx(second, abs=1e-8) and learner.status == "solved"


def test_no_bound_goes_beyond_its_cap(monkeypatch):
    start = believed(COARSE, stage_remaining=0.09)
    bounds = shown(monkeypatch, bounding(cap={"burned_layer": 0.001}), *[0.05] * 4, start=start)
    assert bounds[-1] == 0.001


# ---- bad arguments


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"step": 1.5}, r"step must be in \[0, 1\]; got 1\.5"),
        ({"step": -0.1}, r"step must be in \[0, 1\]; got -0\.1"),
        ({"step": {"burn": 0.5}}, "step must be one of burned_layer, roundness, grinding_power; got 'burn'"),
        (
            {"noise_buffer": {"roundness": -1e-5}},
            r"noise_buffer\['roundness'\] must be >= 0 \(mm\); got -1e-05",
        ),
        (
            {"noise_buffer": {"slack": 0.1}},
            "noise_buffer must be one of burned_layer, roundness, grinding_power; got 'slack'",
        ),
        ({"cap": {"grinding_power": math.inf}}, r"cap\['grinding_power'\] must be finite \(W\); got inf"),
        ({"power_max": 0.0}, r"power_max must be > 0 \(W\); got 0\.0"),
        ({"rule": "newest"}, "rule must be one of contracting, printed; got 'newest'"),
        ({"method": "slsqp"}, "method must be one of qp, nlp; got 'slsqp'"),
        (
            {"settings": ["speed"]},
            "settings must be one of rough_rate, stage_rate, stage_remaining, final_rate; got 'speed'",
        ),
        (
            {"settings": ["stage_rate", "stage_rate"]},
            "settings must be without repeats; got 'stage_rate' twice",
        ),
    ],
)
def test_bad_arguments(options, said):
    with pytest.raises(ValueError, match=said):
        plunge.learning.ConstraintBounding(**options)


def test_of_another_kind():
    with pytest.raises(
        TypeError,
        match=r"noise_buffer must be a mapping of burned_layer, .* to amounts \(mm, W\); got 0\.005",
    ):
        plunge.learning.ConstraintBounding(noise_buffer=0.005)
    with pytest.raises(
        TypeError, match="controller must be a StagedController to be adapted; got a CycleController"
    ):
        plunge.learning.ConstraintBounding().next(plunge.CycleController(COARSE), None)
    with pytest.raises(ValueError, match="statement must be asked for after a part, with method='qp'"):
        _ = plunge.learning.ConstraintBounding().statement


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"rough_rate": 0.05}, r"rough_rate must be in \[0, 0\.0448\] \(mm/s\); got 0\.05"),
        ({"rough_rate": 0.0}, r"rough_rate must be > 0 \(mm/s\); got 0\.0"),
        ({"final_rate": -0.001}, r"final_rate must be > 0 \(mm/s\); got -0\.001"),
        ({"stage_rate": 0.05}, r"stage_rate must be in \[0, 0\.0448\] \(mm/s\); got 0\.05"),
    ],
)
def test_bad_stages(options, said):
    with pytest.raises(ValueError, match=said):
        believed(COARSE, **options)


def test_a_part_that_was_broken_off_teaches_nothing():
    stages = plunge.StagedController(COARSE, 0.12, 0.006)
    adapt = plunge.learning.ConstraintBounding()
    log = hwsim.run(hwsim.PlungeGrinder(COARSE, max_time=3.0), stages)
    assert adapt.next(stages, log) is stages and "broken off" in adapt.status
    after = adapt.next(stages, hwsim.run(hwsim.PlungeGrinder(COARSE), stages))
    fresh = plunge.learning.ConstraintBounding().next(stages, hwsim.run(hwsim.PlungeGrinder(COARSE), stages))
    assert after == fresh
