"""The one-draw stand: physics of a pass, hidden truth, sensors, outcome, refusals."""

import copy
from math import isnan, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hwsim
from hwsim.protocols import FOREVER
from sdpgrind import sdp, weldbead
from sdpgrind.weldbead.kernels import blamed

P1 = weldbead.preset("P1")
DROOP = P1.replace(free_speed=560.0, speed_droop=0.1)
QUIET = {"height_noise": 0.0, "power_noise": 0.0, "force_noise": 0.0}
PASS = {"duration": 8.0, "normal_force": 30.0}
NAMES = ("C1", "K1", "K2", "mu")


class Passes:
    """Does the given passes, then stops."""

    period = None

    def __init__(self, *passes):
        self.passes = passes

    def reset(self):
        self.next = iter([*self.passes, {"stop": 1.0}])

    def step(self, **measured):
        return next(self.next)


def bead(problem=P1, seed=0, **options):
    return hwsim.WeldBeadStand(problem, **options).start(np.random.default_rng(seed))


def mean_cut(process, coefficients, force, feed):
    """Brown (4.5) with (4.8), written out."""
    energy, idle, friction = coefficients
    torque = friction * process.disk_radius * force
    power = 1e-3 * torque * (process.free_speed - process.speed_droop * torque)
    return (power - idle) / (energy * process.bead_width * feed)


@given(
    attribution=st.lists(st.sampled_from(NAMES), min_size=1, max_size=4, unique=True),
    force=st.floats(20.0, 50.0),
    duration=st.sampled_from(P1.durations),
    relative=st.floats(0.3, 2.0),
    problem=st.sampled_from([P1, DROOP]),
)
def test_blamed_coefficients_give_exactly_the_cut(attribution, force, duration, relative, problem):
    scatter = weldbead.Scatter(tuple(attribution), tuple(0.1 + 0.02 * k for k in range(len(attribution))))
    feed = problem.feed_rate(duration)
    cut = relative * float(problem.model.mean_cut(force, feed))
    truth = blamed(scatter, problem.model, force, feed, cut)
    assert mean_cut(problem.model, truth, force, feed) == pytest.approx(cut, rel=1e-9)


@pytest.mark.parametrize(("name", "moved"), [("C1", {0, 1}), ("K1", {0}), ("K2", {1}), ("mu", {2})])
def test_only_what_scatters_is_blamed(name, moved):
    process = P1.model
    nominal = (process.specific_energy, process.idle_power, process.friction_ratio)
    truth = blamed(weldbead.Scatter(name, 0.15), process, 30.0, 10.0, 0.25)
    assert {k for k in range(3) if truth[k] != nominal[k]} == moved


def test_c1_keeps_the_idle_volume():
    truth = blamed(weldbead.Scatter("C1", 0.15), P1.model, 30.0, 10.0, 0.25)
    assert truth.idle_power / truth.specific_energy == pytest.approx(10.0, rel=1e-12)


def test_blame_is_shared_by_variance():
    scatter, process = weldbead.Scatter(("K2", "K1"), (0.3, 0.1)), P1.model
    mean, _ = scatter.moments(process, 30.0, 10.0)
    cut = float(mean) + 0.05
    truth = blamed(scatter, process, 30.0, 10.0, cut)
    swept = process.specific_energy * process.bead_width * 10.0
    of_idle, of_energy = (0.3 * process.idle_power / swept) ** 2, (0.1 * float(mean)) ** 2
    by_idle = (process.idle_power - truth.idle_power) / swept
    assert by_idle == pytest.approx(0.05 * of_idle / (of_idle + of_energy), rel=1e-9)


def test_no_cut_means_that_all_power_was_idle():
    truth = blamed(weldbead.Scatter("C1", 0.15), P1.model, 30.0, 10.0, 0.0)
    power = float(P1.model.grinding_power(30.0))
    assert truth.idle_power == pytest.approx(power)
    assert blamed(weldbead.Scatter("C1", 0.15), P1.model, 5.0, 10.0, 0.0).idle_power == 100.0


def test_more_power_than_the_drive_has_is_blamed_on_the_energy():
    scatter, process = weldbead.Scatter("mu", 0.15), DROOP.model
    cut = 1.5 * float(process.mean_cut(process.peak_force, 10.0))
    truth = blamed(scatter, process, 50.0, 10.0, cut)
    assert truth.specific_energy < process.specific_energy
    assert mean_cut(process, truth, 50.0, 10.0) == pytest.approx(cut, rel=1e-9)


@pytest.mark.parametrize("attribution", NAMES)
def test_cuts_have_the_mean_and_sd_of_the_scatter(attribution):
    problem = DROOP.replace(scatter=weldbead.Scatter(attribution, 0.15))
    log = hwsim.run(hwsim.WeldBeadStand(problem, **QUIET), Passes(PASS), parts=600, rng=2)
    cuts = log.outcome.true_cut_depth.values[:, 0]
    law = problem.cut(8.0, 30.0)
    mean, sd = float(law.mean), float(law.sd)
    assert abs(cuts.mean() - mean) < 4 * sd / sqrt(600)
    assert abs(cuts.std() - sd) < 4 * sd * sqrt(1 / 600)  # kurtosis of these laws is below 5


def test_sensors_agree_with_truth_and_energy_balance():
    log = hwsim.run(hwsim.WeldBeadStand(P1, **QUIET), Passes(PASS, PASS), parts=5)
    rows = log["controller"].dropna("row", subset=["grinding_power"])
    truth = {name: log.outcome[f"true_{name}"].values.ravel() for name in ("specific_energy", "idle_power")}
    balance = truth["specific_energy"] * rows.removal_rate.values + truth["idle_power"]
    np.testing.assert_allclose(rows.grinding_power, balance, rtol=1e-9)
    friction = log.outcome.true_friction_ratio.values.ravel()
    np.testing.assert_allclose(rows.tangential_force, friction * rows.normal_force, rtol=1e-12)
    np.testing.assert_array_equal(rows.normal_force, 30.0)
    np.testing.assert_allclose(rows.cut_depth, log.outcome.true_cut_depth.values.ravel(), rtol=1e-9)


def test_sensor_noise_has_the_stated_sd():
    stand = hwsim.WeldBeadStand(P1, height_noise=0.02, power_noise=7.0, force_noise=1.5)
    log = hwsim.run(stand, Passes(PASS), parts=800, rng=1)
    last = log["controller"].isel(row=slice(1, None, 2))
    true_power = P1.model.grinding_power(30.0)
    for noise, sd in [
        (last.height.values - log.outcome.height.values, 0.02),
        (last.grinding_power.values - true_power, 7.0),
        (last.normal_force.values - 30.0, 1.5),
        (last.tangential_force.values - 9.0, 1.5),
    ]:
        assert abs(noise.mean()) < 4 * sd / sqrt(800)
        assert noise.std() == pytest.approx(sd, rel=4 / sqrt(1600))


def test_time_runs_with_passes_and_reset_only():
    machine = bead(time=30.0)
    assert machine.step({}, 0)["time_left"] == 30.0
    assert machine.step(PASS, FOREVER)["time_left"] == 22.0
    # 50/12.5 + 2
    assert machine.step({"feed_rate": 12.5, "normal_force": 20.0}, FOREVER)["time_left"] == 16.0
    assert machine.event and machine.time == 14_000


def test_lattice_of_an_odd_stage_is_met_exactly():
    problem = P1.replace(stage=0.7, durations=[4.2, 4.9], horizon=21.0)
    machine = bead(problem, time=21.0)
    times = [machine.step({"duration": 4.2, "normal_force": 30.0}, FOREVER)["time_left"] for _ in range(5)]
    assert times == [16.8, 12.6, 8.4, 4.2, 0.0]


def test_a_pass_can_be_watched_and_waited_for():
    machine = bead()
    assert isnan(machine.step(PASS, 3000)["grinding_power"]) and not machine.event
    twin = copy.deepcopy(machine)
    machine.step({}, 5000)
    assert machine.event and machine.time == 8000
    assert twin.step({}, FOREVER) == machine.step({}, 0)
    machine.step({}, 1000)
    assert machine.time == 9000 and not machine.event  # idle


def test_measuring_twice_gives_the_same_reading():
    machine = bead()
    machine.step(PASS, FOREVER)
    assert machine.step({}, 0) == machine.step({}, 0)


def test_truth_as_process_problem_and_function():
    other = P1.model.replace(specific_energy=14.0)
    no_scatter = weldbead.Scatter("C1", 0.0)
    problem = P1.replace(model=other, scatter=no_scatter)
    expected = float(other.mean_cut(30.0, P1.feed_rate(8.0)))
    exact = P1.replace(scatter=no_scatter)
    for stand in (
        hwsim.WeldBeadStand(exact, truth=other),
        hwsim.WeldBeadStand(P1, truth=problem),
        hwsim.WeldBeadStand(P1, truth=lambda rng: problem),
        hwsim.WeldBeadStand(exact, truth=lambda rng: other),
    ):
        machine = stand.start(np.random.default_rng(0))
        machine.step(PASS, FOREVER)
        assert machine.outcome()["true_cut_depth"] == pytest.approx([expected], rel=1e-12)


def test_function_draws_a_truth_for_each_bead():
    def drawn(rng):
        return P1.model.replace(specific_energy=rng.uniform(8.0, 12.0))

    stand = hwsim.WeldBeadStand(P1.replace(scatter=weldbead.Scatter("C1", 0.0)), truth=drawn)
    energies = hwsim.run(stand, Passes(PASS), parts=50).outcome.true_specific_energy.values
    assert energies.min() < 8.7 and energies.max() > 11.3 and np.unique(energies).size == 50


def test_truth_does_not_move_the_other_draws():
    """Controllers and truths are compared on equal quantiles."""
    cuts = []
    for energy in (10.0, 20.0):
        stand = hwsim.WeldBeadStand(P1, truth=P1.model.replace(specific_energy=energy), **QUIET)
        outcome = hwsim.run(stand, Passes(PASS), parts=10).outcome
        cuts.append(outcome.true_cut_depth.values)
    np.testing.assert_allclose(cuts[0], 2 * cuts[1], rtol=1e-12)


CHARGED = P1.replace(
    lateness_charge=sdp.Quadratic(0.01),
    finish_charge=weldbead.FinishCharge(0.4, reference_rate=12.5),
    pass_charge=0.03,
)


def test_penalty_by_hand():
    fast = {"duration": 6.0, "normal_force": 40.0}
    machine = bead(CHARGED, height=1.0, time=10.0)
    machine.step(PASS, FOREVER)
    machine.step(fast, FOREVER)
    machine.step({"stop": 1.0}, FOREVER)
    outcome = machine.outcome()
    height = 1.0 - sum(outcome["true_cut_depth"])
    assert machine.done and outcome["passes"] == 2 and outcome["time"] == 14.0 and outcome["lateness"] == 4.0
    assert outcome["height"] == pytest.approx(height) and outcome["overground"] == max(
        0.0, -outcome["height"]
    )
    side = 2.0 * height if height > 0 else -10.0 * height
    assert outcome["penalty"] == pytest.approx(side + 0.01 * 4.0**2 + 0.4 * 12.5 / 12.5 + 2 * 0.03)


def test_light_pass_does_not_refinish():
    problem = CHARGED.replace(min_cut=0.05)
    light = {"duration": 20.0, "normal_force": float(P1.model.normal_force(0.04, P1.feed_rate(20.0)))}
    at_least = {"duration": 20.0, "normal_force": float(P1.model.normal_force(0.05, P1.feed_rate(20.0)))}
    finishes = []
    for last in (light, at_least):
        machine = bead(problem, height=1.0, time=60.0, seed=3)
        for command in (PASS, last):
            machine.step(command, FOREVER)
        outcome = machine.outcome()
        finishes.append(outcome["penalty"] - float(problem.height_charge(outcome["height"])) - 0.06)
    feeds = (problem.feed_rate(8.0), problem.feed_rate(20.0))
    assert finishes == pytest.approx([0.4 * feed / 12.5 for feed in feeds])


def test_bead_without_a_pass():
    machine = bead(CHARGED, height=0.3)
    machine.step({"stop": 1.0}, FOREVER)
    outcome = machine.outcome()
    assert outcome["penalty"] == pytest.approx(0.6) and outcome["true_cut_depth"] == []


def test_overground():
    machine = bead(height=0.1)
    machine.step({"duration": 20.0, "normal_force": 50.0}, FOREVER)
    outcome = machine.outcome()
    assert outcome["overground"] > 1.0 and outcome["penalty"] == pytest.approx(10.0 * outcome["overground"])


def test_burned_passes_are_counted():
    limited = P1.replace(burn_limit=weldbead.ForceBurnLimit(10.0))
    machine = bead(limited)
    limit = 10.0 * sqrt(limited.feed_rate(8.0))
    for force in (limit, limit + 0.01, limit - 1.0):
        machine.step({"duration": 8.0, "normal_force": force}, FOREVER)
    assert machine.outcome()["burned"] == 1


def test_defaults_and_description():
    stand = hwsim.WeldBeadStand(P1)
    assert (stand.start_height, stand.start_time, stand.tick) == (1.5, 30.0, 0.001)
    assert stand.replace(problem=P1.replace(height_max=4.0)).start_height == 3.0
    assert stand.description["start_height"] == 1.5
    log = hwsim.run(stand, Passes(PASS), parts=2)
    assert log.outcome.attrs["start_time"] == 30.0
    assert log.outcome.true_specific_energy.attrs["units"] == "J/mm^3"
    assert log.outcome.true_specific_energy.dims == ("part", "pass")


def test_check_finds_nothing_to_say():
    assert str(hwsim.check(hwsim.WeldBeadStand(P1), Passes())) == "Passes and WeldBeadStand fit"


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"duration": 8.0, "normal_force": 51.0}, r"normal_force must be <= force_max = 50 \(N\); got 51.0"),
        ({"duration": 8.0, "normal_force": 0.0}, r"normal_force must be > 0 \(N\); got 0.0"),
        ({"feed_rate": -3.0, "normal_force": 30.0}, r"feed_rate must be > 0 \(mm/s\); got -3.0"),
        ({"duration": 2.0, "normal_force": 30.0}, r"duration must be > reset_time = 2 \(s\); got 2.0"),
        (
            {"duration": 31.0, "normal_force": 30.0},
            r"duration must be <= the 30 left before the fixed deadline \(s\)",
        ),
        (
            {"duration": 8.0},
            r"a pass needs normal_force \(N\) and duration \(s\) or .* got {'duration': 8.0}",
        ),
        ({"normal_force": 8.0}, r"a pass needs duration \(s\) or feed_rate \(mm/s\); got"),
        (
            {"duration": 8.0, "feed_rate": 10.0, "normal_force": 30.0},
            r"feed_rate must be 8.33333 to do this bead of 50 mm in 8 s, reset 2 s \(mm/s\); got 10.0",
        ),
    ],
)
def test_passes_that_cannot_be_done(command, message):
    with pytest.raises(ValueError, match=message):
        bead().step(command, FOREVER)


def test_a_command_during_a_pass():
    machine = bead()
    machine.step(PASS, 100)
    with pytest.raises(ValueError, match="a command must wait for the end of the pass; got"):
        machine.step(PASS, 100)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        (
            {"truth": 3},
            TypeError,
            "truth must be None, a GrindingProcess, a SequenceProblem or a function of rng; got 3",
        ),
        ({"height": float("inf")}, ValueError, r"height must be finite \(mm\); got inf"),
        ({"time": -1.0}, ValueError, r"time must be >= 0 \(s\); got -1.0"),
        ({"power_noise": -1.0}, ValueError, r"power_noise must be >= 0 \(W\); got -1.0"),
    ],
)
def test_stands_that_make_no_sense(options, error, message):
    with pytest.raises(error, match=message):
        hwsim.WeldBeadStand(P1, **options)


def test_other_refusals():
    with pytest.raises(TypeError, match="problem must be a SequenceProblem; got"):
        hwsim.WeldBeadStand(P1.model)
    with pytest.raises(
        TypeError, match=r"truth\(rng\) must give a GrindingProcess or a SequenceProblem; got 1.0"
    ):
        bead(truth=lambda rng: 1.0)
    assert bead(CHARGED, time=-3.0).step({}, 0)["time_left"] == -3.0
