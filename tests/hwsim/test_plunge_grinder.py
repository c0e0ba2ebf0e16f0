"""The plunge grinder: whole parts to the bits of the loop, durable and parallel runs, hidden truth, gauges,
refusals.
"""

import copy
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import hwsim
from hwsim._log.log import same
from hwsim.plants._plunge.machine import PlungePart
from hwsim.protocols import FOREVER
from sdpgrind import plunge

PROBLEM = plunge.preset("simulation")
MODEL = PROBLEM.model
CONTROLLER = plunge.CycleController(PROBLEM.replace(wear_flat_area=0.0234), safety_margin=0.02)
STAGES = plunge.StagedController(PROBLEM, 0.1, 0.0075)
PRINTED = plunge.CycleController(PROBLEM, sparkout="printed", safety_margin=0.02)
SAFE = plunge.CycleController(PROBLEM, safety_margin=0.005)


KINDS = {
    "plain": {},
    "no noise": {"noise": None},
    "clipped": {"power_max": 2300.0},
    "delays": {"size_delay": True, "power_lag": 0.1},
    "steps": {"command_quantum": 2e-4},
    "contact": {"contact_zero_sd": 0.02, "size_offset": 0.003, "power_gain": 1.03},
    "linear": {"dynamics": "first_order"},
    "dulls": {"truth": MODEL.replace(wear=plunge.Wear(0.02, exponent=0.5))},
    "broken off": {"max_time": 3.0},
    "one sample": {"max_time": 0.01},
    # more than one block of random numbers
    "never there": {"truth": MODEL.replace(stiffness=800.0), "max_time": 30.0},
}


@pytest.mark.parametrize("controller", [CONTROLLER, STAGES, PRINTED], ids=["online", "stages", "printed"])
@pytest.mark.parametrize("options", KINDS.values(), ids=KINDS)
def test_a_whole_part_is_the_loop_bit_for_bit(monkeypatch, controller, options):
    grinder = hwsim.PlungeGrinder(PROBLEM, **options)
    at_once = hwsim.run(grinder, controller, parts=3, rng=6)
    monkeypatch.setattr(PlungePart, "whole", lambda machine, controller: None)
    assert same(hwsim.run(grinder, controller, parts=3, rng=6), at_once)


def test_a_whole_part_of_a_gauge_that_is_at_the_end(monkeypatch):
    grinder = hwsim.PlungeGrinder(PROBLEM, size_offset=0.3)
    with pytest.raises(ValueError, match="size must be < stock") as at_once:
        hwsim.run(grinder, CONTROLLER)
    monkeypatch.setattr(PlungePart, "whole", lambda machine, controller: None)
    with pytest.raises(ValueError, match="size must be < stock") as in_the_loop:
        hwsim.run(grinder, CONTROLLER)
    assert str(at_once.value) == str(in_the_loop.value)


def test_a_controller_of_ones_own_goes_through_the_loop():
    class Mine(plunge.CycleController):
        def step(self, **measured):
            return {"retract": 1.0}

    assert hwsim.run(hwsim.PlungeGrinder(PROBLEM), Mine(PROBLEM)).outcome.time.values == [0.0]


def test_samples_are_exact_multiples(grinder):
    table = hwsim.run(grinder, CONTROLLER)["controller"]
    np.testing.assert_array_equal(table.time.values, np.arange(table.sizes["row"]) * 4 / 100)


@pytest.fixture
def grinder():
    return hwsim.PlungeGrinder(PROBLEM, contact_zero_sd=0.005, truth=drawn)


def drawn(rng):
    """A wheel of its own for each part."""
    return MODEL.replace(wear_flat_area=0.026 * (1 + 0.01 * rng.standard_normal()))


class PowerCut(Exception):
    pass


def cut_after(parts):
    def progress(share, text):
        if text.startswith(f"part {parts} "):
            raise PowerCut

    return progress


@pytest.mark.parametrize("finished", [1, 4])
@pytest.mark.parametrize(
    "adapt", [None, plunge.learning.MarginBounding(step=0.25)], ids=["alone", "adapting"]
)
def test_a_cut_series_is_resumed(tmp_path, grinder, finished, adapt):
    arguments = {"parts": 6, "rng": 3, "adapt": adapt}
    whole = hwsim.run(grinder, CONTROLLER, **arguments)
    with pytest.raises(PowerCut):
        hwsim.run(grinder, CONTROLLER, **arguments, journal=tmp_path / "run.db", progress=cut_after(finished))
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert journal.parts == finished
    assert same(hwsim.run(grinder, CONTROLLER, **arguments, journal=tmp_path / "run.db"), whole)


def test_any_number_of_workers(grinder, processes):
    alone = hwsim.run(grinder, CONTROLLER, parts=20, rng=8)
    with ThreadPoolExecutor(2) as threads:
        assert same(hwsim.run(grinder, CONTROLLER, parts=20, rng=8, executor=threads), alone)
    plain = hwsim.PlungeGrinder(PROBLEM)
    both = [hwsim.run(plain, CONTROLLER, parts=9, rng=8, executor=each) for each in (processes, None)]
    assert same(*both)


def test_parts_do_not_depend_on_their_number(grinder):
    few, many = (hwsim.run(grinder, CONTROLLER, parts=parts, rng=8) for parts in (3, 9))
    np.testing.assert_array_equal(few.outcome.time, many.outcome.time[:3])
    np.testing.assert_array_equal(
        few["controller"]["size"], many["controller"]["size"][: few["controller"].sizes["row"]]
    )


def test_a_copy_in_the_middle_goes_its_own_way():
    machine = hwsim.PlungeGrinder(PROBLEM).start(np.random.default_rng(1))
    controller = copy.deepcopy(CONTROLLER)
    reading = machine.step({}, 0)
    for _ in range(100):
        reading = machine.step(controller.step(**reading), 1)
    ends = []
    for _ in range(2):
        other, mind, seen = copy.deepcopy(machine), copy.deepcopy(controller), dict(reading)
        while not other.done:
            seen = other.step(mind.step(**seen), 1)
        ends.append((other.outcome(), seen))
    assert ends[0] == ends[1] and machine.time == 100 and not machine.done
    stopped = copy.deepcopy(machine)
    stopped.step({"retract": 1.0}, 1)
    assert stopped.done and not machine.done


def test_a_log_is_saved_and_read_back(tmp_path, grinder):
    import sdpgrind

    log = hwsim.run(grinder, CONTROLLER, parts=2)
    log.save(tmp_path / "run.nc")
    assert same(sdpgrind.load(tmp_path / "run.nc"), log)


def test_controllers_are_compared_on_the_same_parts(grinder):
    log = hwsim.compare(grinder, {"learns": CONTROLLER, "stages": STAGES}, parts=4, rng=2)
    true = log.outcome.true_wear_flat_area
    np.testing.assert_array_equal(true.sel(controller="learns"), true.sel(controller="stages"))
    assert np.unique(true).size == 4


def test_plant_and_controllers_fit():
    for controller in (CONTROLLER, STAGES, PRINTED):
        assert hwsim.check(hwsim.PlungeGrinder(PROBLEM), controller).faults == ()


def fed(commands, **options):
    """Readings of a quiet machine before and after each command."""
    machine = hwsim.PlungeGrinder(PROBLEM, noise=None, **options).start(np.random.default_rng(0))
    rows = [machine.step({}, 0), *(machine.step({"command_rate": command}, 1) for command in commands)]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, machine


def test_nothing_happens_without_time():
    machine = hwsim.PlungeGrinder(PROBLEM).start(np.random.default_rng(0))
    assert (
        machine.step({}, 0) == machine.step({"command_rate": 0.04}, 0) == machine.step({}, 0)
        and machine.time == 0
    )


def test_a_command_holds():
    once, _ = fed([0.03] * 40)
    machine = hwsim.PlungeGrinder(PROBLEM, noise=None).start(np.random.default_rng(0))
    assert machine.step({"command_rate": 0.03}, 40)["size"] == once["size"][-1]
    assert machine.step({}, 5)["size"] > once["size"][-1] and machine.time == 45


def test_steady_state():
    """The rate comes to the command, the power to that of the model, the deflection to what the command is
    ahead.
    """
    seen, machine = fed([0.005] * 700)
    assert (seen["size"][-1] - seen["size"][-2]) / 0.04 == pytest.approx(0.005, rel=1e-5)
    assert seen["grinding_power"][-1] == pytest.approx(float(MODEL.grinding_power(0.005)), rel=1e-5)
    assert 700 * 0.04 * 0.005 - seen["size"][-1] == pytest.approx(float(MODEL.deflection(0.005)), rel=1e-5)
    assert machine.outcome()["roundness"] == pytest.approx(float(MODEL.roundness(0.005)), rel=1e-5)


def test_dead_time_of_touching():
    """Nothing comes off until the deflection is that of the ploughing force: 0.236 s."""
    seen, _ = fed([0.0448] * 8)
    assert np.all(seen["size"][:6] == 0) and seen["size"][6] > 0
    assert seen["grinding_power"][3] == pytest.approx(
        3 * 0.04 * 0.0448 / MODEL.core.K0 * float(MODEL.grinding_power(0.0))
    )


def test_a_linear_machine():
    """v' = (u - v)/tau from the first sample: (1) and (5)."""
    seen, _ = fed([0.04] * 50, dynamics="first_order")
    t, tau = 0.04 * np.arange(51), PROBLEM.time_constant
    np.testing.assert_allclose(seen["size"], 0.04 * (t - tau * (1 - np.exp(-t / tau))), atol=1e-9)


def test_a_stepper_goes_whole_steps_and_owes_the_rest():
    """0.0208 mm/s are 0.832 steps in a sample: 1, 1 (1.664), 0 (2.496), 1 (3.328), ..."""
    coarse, _ = fed([0.0208] * 60, command_quantum=1e-3)
    steps = np.diff(np.round(0.0208 * 0.04 * np.arange(61) / 1e-3)) * 1e-3
    fine, _ = fed(list(steps / 0.04), command_quantum=0.0)
    np.testing.assert_allclose(coarse["size"], fine["size"], atol=1e-15)
    assert set(np.round(steps * 1e3)) == {0.0, 1.0}


@pytest.mark.parametrize("quantum", [1e-4, 1e-3])
def test_steps_do_not_spoil_a_part(quantum):
    outcome = hwsim.run(hwsim.PlungeGrinder(PROBLEM, command_quantum=quantum), SAFE, parts=20, rng=2).outcome
    assert outcome.burned.values.sum() == 0
    # never less than the margin, and 3.7 standard deviations of the filter's size, 0.14 um, more
    assert 0.005 - quantum < outcome.part_slack.values.mean() < 0.005 + 3.72 * 1.4e-4 + quantum
    assert outcome.roundness.values.mean() == pytest.approx(2.96e-3, abs=5e-5)


def test_slack_is_the_least_while_balancing():
    machine = hwsim.PlungeGrinder(PROBLEM, noise=None).start(np.random.default_rng(0))
    machine.step({"command_rate": 0.0448}, 60)
    left = [
        PROBLEM.stock - machine.step({"command_rate": 0.0448, "balancing": float(k == 1)}, 1)["size"]
        for k in range(3)
    ]
    rate = machine.outcome()["roundness"] - MODEL.roundness_base
    assert np.isfinite(machine.outcome()["slack"])
    assert machine.outcome()["part_slack"] < machine.outcome()["slack"] < left[0]
    assert rate > 0
    machine.step({"retract": 1.0}, 1)
    rate *= MODEL.turns / MODEL.roundness_gain
    assert machine.outcome()["part_slack"] == pytest.approx(
        left[-1] - float(MODEL.burn_depth(rate)), abs=1e-9
    )


def test_a_part_that_is_left_alone_ends():
    machine = hwsim.PlungeGrinder(PROBLEM, max_time=2.0).start(np.random.default_rng(0))
    machine.step({}, FOREVER)
    assert machine.done and (machine.time, machine.outcome()["timed_out"], machine.outcome()["time"]) == (
        50,
        1.0,
        2.0,
    )
    assert math.isnan(machine.outcome()["part_slack"]) and machine.outcome()["burned"] == 0


def test_the_longest_time_is_ten_times_the_slowest_cycle():
    machine = hwsim.PlungeGrinder(PROBLEM).start(np.random.default_rng(0))
    machine.step({}, FOREVER)
    assert machine.outcome()["time"] == pytest.approx(10 * PROBLEM.stock / PROBLEM.final_rate, abs=0.04)


def test_noise_has_the_stated_sd():
    grinder = hwsim.PlungeGrinder(
        PROBLEM, noise=hwsim.GrinderNoise(size_sd=0.001, power_sd=0.02), power_gain=1.05
    )
    quiet = hwsim.run(grinder.replace(noise=None), STAGES)["controller"]
    machine, reading = grinder.start(np.random.default_rng(4)), None
    rows = []
    for command in quiet.command_rate_command.values[:-1]:
        reading = machine.step({"command_rate": float(command)}, 1)
        rows.append((reading["size"], reading["grinding_power"]))
    size, power = np.array(rows).T
    off = size - quiet["size"].values[1:]
    relative = (power / quiet.grinding_power.values[1:])[10:]
    for noise, sd in ((off, 0.001), (relative * 1.05 - 1.05, 0.02)):
        assert abs(noise.mean()) < 4 * sd / math.sqrt(noise.size)
        assert noise.std() == pytest.approx(sd, rel=4 / math.sqrt(2 * noise.size))


def test_hidden_truth(grinder):
    outcome = hwsim.run(grinder, CONTROLLER, parts=200, rng=5).outcome
    area, zero = outcome.true_wear_flat_area.values, outcome.true_contact_zero.values
    assert area.std() == pytest.approx(2.6e-4, rel=0.2) and area.mean() == pytest.approx(0.026, abs=8e-5)
    assert zero.std() == pytest.approx(0.005, rel=0.2) and abs(zero.mean()) < 4 * 0.005 / math.sqrt(200)
    assert abs(np.corrcoef(area, zero)[0, 1]) < 0.3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dynamics": "second_order"}, "dynamics must be one of nonlinear, first_order; got 'second_order'"),
        ({"contact_zero_sd": -0.01}, r"contact_zero_sd must be >= 0 \(mm\); got -0.01"),
        ({"power_lag": -1.0}, r"power_lag must be >= 0 \(s\); got -1.0"),
        ({"command_quantum": math.nan}, r"command_quantum must be finite \(mm\); got nan"),
        ({"power_gain": 0.0}, "power_gain must be > 0"),
        ({"power_max": -5.0}, r"power_max must be > 0 \(W\); got -5.0"),
        ({"size_offset": math.inf}, r"size_offset must be finite \(mm\); got inf"),
        ({"max_time": 0.0}, r"max_time must be > 0 \(s\); got 0.0"),
    ],
)
def test_grinders_that_are_none(options, message):
    with pytest.raises(ValueError, match=message):
        hwsim.PlungeGrinder(PROBLEM, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": 0.01}, "noise must be a GrinderNoise; got 0.01"),
        ({"truth": PROBLEM}, "truth must be a PlungeModel, a function of rng, or None"),
    ],
)
def test_things_of_another_kind(options, message):
    with pytest.raises(TypeError, match=message):
        hwsim.PlungeGrinder(PROBLEM, **options)
    with pytest.raises(TypeError, match="problem must be a CycleProblem"):
        hwsim.PlungeGrinder(MODEL)


def test_a_truth_that_draws_nonsense():
    with pytest.raises(TypeError, match=r"truth\(rng\) must be a PlungeModel"):
        hwsim.run(hwsim.PlungeGrinder(PROBLEM, truth=lambda rng: 3.0), CONTROLLER)


@pytest.mark.parametrize("noise", [{"size_sd": -1e-3}, {"power_sd": -0.1}, {"power_sd": 1.0}])
def test_noise_that_is_none(noise):
    with pytest.raises(ValueError, match=r"sd must be (>= 0|in)"):
        hwsim.GrinderNoise(**noise)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"command_rate": 0.05}, r"command_rate must be <= command_rate_max = 0.0448 \(mm/s\); got 0.05"),
        ({"command_rate": -0.01}, r"command_rate must be >= 0 \(mm/s\); got -0.01"),
    ],
)
def test_commands_that_cannot_be_done(command, message):
    machine = hwsim.PlungeGrinder(PROBLEM).start(np.random.default_rng(0))
    with pytest.raises(ValueError, match=message):
        machine.step(command, 1)


def test_a_controller_for_another_part():
    for changed in ({"stock": 0.3}, {"work_diameter": 75.0}, {"command_rate_max": 0.04}):
        (name,) = changed
        with pytest.raises(ValueError, match=name):
            hwsim.run(hwsim.PlungeGrinder(PROBLEM), plunge.CycleController(PROBLEM.replace(**changed)))
