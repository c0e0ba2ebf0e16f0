"""Damage still ahead of a part: on soft machines it may fall more slowly than the deflection."""

import math

import numpy as np
import pytest
from cycle_parts import DRIFT, EXACT, KNOWN, PROBLEM, run
from plunge_twins import Wheel

import hwsim
from sdpgrind import physics, plunge
from sdpgrind.plunge import kernels

NAMES = (
    "command_rate_max",
    "B",
    "stock",
    "stiffness",
    "wear_flat_area",
    "roundness_max",
    "work_rotation",
    "sample_time",
)
TURNS = (0.0625, 3.0, 0.25, 4041.0, 0.015625, 0.00390625, 22.0, 0.02)
"""Burned by 15 nm in spark-out, where the turn lies in the last cell that is searched for it."""
SOFT = [
    TURNS,
    # without a look ahead: by 5.5 µm, 1.2 % below the bound
    (0.08236, 3.114, 0.3333, 6420.0, 0.0281, 0.0059, 31.8, 0.04),
    (0.07126, 3.126, 0.3551, 5299.0, 0.02512, 0.005309, 28.68, 0.02),  # by 5.5 um
    (0.08515, 4.217, 0.3536, 6332.0, 0.0299, 0.005099, 22.54, 0.02),  # by 1.8 um
    (0.06248, 3.473, 0.2517, 4008.0, 0.02587, 0.005408, 21.5, 0.02),  # by 0.9 um
    (0.06426, 3.262, 0.2896, 4478.0, 0.01828, 0.003661, 20.54, 0.04),  # by 0.5 um
]
STIFF = [
    # by halves of both rates: 3.7 nm too deep
    (0.08288, 5.145, 0.2361, 29870.0, 0.01558, 0.002731, 34.84, 0.04),
    (0.08105, 4.807, 0.2351, 27290.0, 0.01006, 0.005876, 22.21, 0.04),  # 2.8 nm
]


def problem_of(values):
    known = dict(zip(NAMES, values, strict=True))
    walk = 0.0013 * (known["stock"] / KNOWN.stock) ** 0.5  # as much in a millimetre
    burning = physics.BurningLimit(6.205, known.pop("B"))
    return KNOWN.replace(burning=burning, time_constant=None, sharpness_change_sd=walk, **known)


def over_damage(problem):
    """Rates from the burn rate, and deflection less depth of damage (mm) at each."""
    wheel = Wheel(problem.model)
    rates = np.geomspace(wheel.burn_rate(problem.command_rate_max), problem.command_rate_max, 2001)
    return rates, np.array([wheel.beyond(v) - wheel.burn_depth(v) for v in rates])


def least_between(problem, commands, parts=16):
    """Least slack (mm) of a part sampled `parts` times as often."""
    rig = kernels.rig(problem.model, problem.stock, problem.sample_time / parts)
    state = np.zeros(kernels.STATES)
    kernels.start_part(state, rig)
    for command in np.repeat(commands, parts):
        kernels.advance(state, rig, command)
        if state[kernels.REMAINING] > 0:
            kernels.update_slacks(state, rig, False)
    return float(state[kernels.PART_SLACK])


@pytest.mark.parametrize("online", [True, False])
@pytest.mark.parametrize("values", SOFT + STIFF)
def test_no_part_burns_without_a_margin(values, online):
    """At and between samples; two samples more than the bound, of which the end of the last is one."""
    problem = problem_of(values)
    log = run(plunge.CycleController(problem, online=online, **EXACT), problem=problem)
    out, bound = (
        {name: float(value[0]) for name, value in log.outcome.data_vars.items()},
        plunge.plan(problem).time,
    )
    assert 0.0 < out["part_slack"] < 6e-4 and (out["burned"], out["out_of_round"]) == (0, 0)
    assert least_between(problem, log["controller"].command_rate_command.values[:-1]) > 0.0
    assert bound <= out["time"] <= bound + 2.01 * problem.sample_time


@pytest.mark.parametrize("values", SOFT)
def test_these_machines_have_something_ahead(values):
    """Deflection less damage has an inner minimum, or one at the burn rate."""
    rates, over = over_damage(problem_of(values))
    assert over[-1] > over.min() + 1e-4
    inside = 0 < int(np.argmin(over)) < rates.size - 1
    assert inside or over[1] > over[0]


def test_nothing_is_commanded_until_the_turn_is_passed():
    """Deflection less stock stays at the minimum until the limit turns, and rises with it."""
    problem = problem_of(TURNS)
    rates, over = over_damage(problem)
    least, turn = over.min(), rates[int(np.argmin(over))]
    table = run(plunge.CycleController(problem, **EXACT), problem=problem)["controller"]
    rate, left = table.infeed_rate_planned.values[:-1], problem.stock - table["size"].values[:-1]
    command, wheel = table.command_rate_command.values[:-1], Wheel(problem.model)
    ahead = np.array([wheel.beyond(v) for v in rate]) - left
    lies = np.flatnonzero((ahead > least - DRIFT) & (rate > turn * 1.01))
    assert lies.size > 40 and np.all(np.diff(lies) == 1)
    assert np.all(ahead[lies] < least) and np.all(command[lies] * problem.sample_time < 0.01 * DRIFT)
    after = int(np.flatnonzero(ahead > least + 1e-6)[0])
    assert rate[after] < turn
    depth = np.array([wheel.burn_depth(v) for v in rate[after : after + 4]])
    assert np.all(
        (left[after : after + 4] - depth > 0.0) & (left[after : after + 4] - depth < DRIFT)
    )  # again


def test_a_margin_is_kept_on_the_way():
    problem, margin = problem_of(SOFT[2]), 0.004
    log = run(plunge.CycleController(problem, margin, **EXACT), problem=problem)
    assert margin < float(log.outcome.part_slack[0]) < margin + DRIFT
    bound = plunge.plan(problem, safety_margin=margin).time
    assert bound <= float(log.outcome.time[0]) <= bound + 2.01 * problem.sample_time


@pytest.mark.parametrize(
    ("area", "stiffness", "margin"), [(0.06, 3e4, 0.05), (0.06, 1e4, 0.0), (0.1, 8e3, 0.01)]
)
def test_a_wheel_that_turns_out_to_burn_at_every_rate_is_not_waited_for(area, stiffness, margin):
    """Its least damage is never removed before; the rest of the stock goes at that rate."""
    stiff = PROBLEM.replace(stiffness=stiffness)
    log = run(
        plunge.CycleController(stiff, margin), problem=stiff, truth=stiff.model.replace(wear_flat_area=area)
    )
    assert float(log.outcome.timed_out[0]) == 0 and abs(float(log.outcome.remaining[0])) < 1e-3


def test_noise_does_not_keep_a_part_from_its_end():
    """The look-ahead uses estimates, which move: no infinite wait."""
    problem = problem_of(SOFT[3]).replace(uncertainty=PROBLEM.uncertainty)
    log = run(plunge.CycleController(problem, 0.02), problem=problem, noise=hwsim.GrinderNoise(), rng=4)
    assert (
        float(log.outcome.timed_out[0])
        == float(log.outcome.unfinished[0])
        == float(log.outcome.burned[0])
        == 0
    )
    assert math.isclose(
        float(log.outcome.time[0]), plunge.plan(problem, safety_margin=0.02).time, rel_tol=0.02
    )
