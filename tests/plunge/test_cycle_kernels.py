"""Compiled loops of plunge cycles against slow twins: Brent's roots, an integrator, matrices."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from plunge_inside import kernels as _kernels
from plunge_twins import Printed, Wheel, ground
from scipy.signal import lsim

import hwsim
from sdpgrind import physics, plunge
from sdpgrind.base.compiling.compiled import opened
from sdpgrind.plunge import kernels

PROBLEM = plunge.preset("simulation")
MODEL = PROBLEM.model
wheels = st.builds(
    lambda area, stiffness, B, rotation: MODEL.replace(
        wear_flat_area=area,
        stiffness=stiffness,
        burning=physics.BurningLimit(6.205, B),
        work_rotation=rotation,
    ),
    area=st.floats(0.004, 0.06),
    stiffness=st.floats(2e3, 4e4),
    B=st.floats(1.5, 8.0),
    rotation=st.floats(18.0, 38.0),
)


@settings(max_examples=60, deadline=None)
@given(model=wheels, y=st.floats(1e-9, 0.5), near=st.floats(1e-7, 1.0))
def test_rate_of_a_deflection(model, y, near):
    expected = Wheel(model).rate(y)
    assert _kernels.rate(y, model.core) == pytest.approx(expected, rel=1e-12)
    assert opened(_kernels._rate_near)(y, near, model.core) == pytest.approx(expected, rel=1e-10)


def test_no_rate_where_the_wheel_only_ploughs():
    for y in (0.0, -1e-3):
        assert _kernels.rate(y, MODEL.core) == opened(_kernels._rate_near)(y, 0.01, MODEL.core) == 0.0


def test_rates_of_a_linear_machine():
    core = MODEL.replace(linear_time_constant=1.9).core
    assert _kernels.rate(0.019, core) == pytest.approx(0.01, rel=1e-13)
    assert opened(_kernels._rate_near)(0.019, 0.02, core) == pytest.approx(0.01, rel=1e-13)


@settings(max_examples=60, deadline=None)
@given(model=wheels, v=st.floats(1e-5, 0.1))
def test_depth_of_damage(model, v):
    depth = Wheel(model).burn_depth(v)
    assert _kernels.burn_depth(v, model.core) == pytest.approx(depth, rel=1e-9, abs=1e-12)
    assert opened(_kernels._damage)(v, model.core) in (0.0, pytest.approx(depth, rel=1e-9, abs=1e-12))


def test_ploughing_alone_is_no_damage():
    low, high = MODEL.burn_onset
    assert _kernels.burn_depth(low / 2, MODEL.core) > 0 == opened(_kernels._damage)(low / 2, MODEL.core)
    assert (
        opened(_kernels._damage)(1.01 * high, MODEL.core)
        > 0
        == opened(_kernels._damage)(0.99 * high, MODEL.core)
    )
    assert opened(_kernels._damage)(0.0, MODEL.core) == 0.0


@settings(max_examples=60, deadline=None)
@given(model=wheels, depth=st.floats(1e-5, 0.2), high=st.floats(0.01, 0.09))
def test_rate_of_a_depth_of_damage(model, depth, high):
    wheel = Wheel(model)
    low = wheel.burn_rate(high)
    assume(low is not None and low < high)
    found = _kernels.rate_of_burn(depth, low, high, model.core)
    if wheel.burn_depth(high) <= depth:
        assert found == high
    else:
        assert wheel.burn_depth(found) == pytest.approx(depth, abs=1e-12) and low <= found <= high


def test_wear_multiplies_sliding_alone():
    worn, fresh = (
        opened(_kernels._worn)(MODEL.core, 1.3),
        MODEL.replace(wear_flat_area=1.3 * MODEL.wear_flat_area).core,
    )
    np.testing.assert_allclose(worn, fresh, rtol=1e-13)


def commands(rng, samples=120):
    """Full rate, random rates, 0."""
    wander = np.clip(0.02 + 0.01 * np.cumsum(rng.normal(0, 0.3, samples)), 0, 0.0448)
    wander[: samples // 3], wander[-samples // 4 :] = 0.0448, 0.0
    return wander


@pytest.mark.parametrize(
    "wear",
    [None, plunge.Wear(0.02), plunge.Wear(0.03, exponent=0.7, reference_rate=0.02)],
    ids=["sharp", "dulls", "by rate"],
)
def test_the_part_moves_as_an_integrator_has_it(wear):
    model = MODEL.replace(wear=wear)
    rig = kernels.rig(model, PROBLEM.stock, 0.04)._replace(contact_zero=0.002)
    state = np.zeros(kernels.STATES)
    kernels.start_part(state, rig)
    start, got = float(state[kernels.Y]), []
    fed = commands(np.random.default_rng(1))
    for command in fed:
        kernels.advance(state, rig, command)
        got.append((state[kernels.Y], PROBLEM.stock - state[kernels.REMAINING], state[kernels.WORN]))
    assert start == pytest.approx(-Wheel(model).K0 - 0.002, rel=1e-12)
    expected = ground(model, fed, 0.04, start)
    np.testing.assert_allclose(np.array(got)[:, :2], expected[:, :2], rtol=0, atol=5e-8)  # made at contact
    np.testing.assert_allclose(np.array(got)[:, 2], expected[:, 2], rtol=0, atol=3e-6)


def test_what_is_fed_is_ground_off_or_deflection():
    rig = kernels.rig(MODEL, PROBLEM.stock, 0.04)._replace(command_quantum=1e-4)
    state, fed = np.zeros(kernels.STATES), 0.0
    kernels.start_part(state, rig)
    for command in commands(np.random.default_rng(2)):
        kernels.advance(state, rig, command)
        fed += command * 0.04
        gone = PROBLEM.stock - state[kernels.REMAINING]
        assert gone + state[kernels.Y] + MODEL.core.K0 == pytest.approx(1e-4 * round(fed / 1e-4), abs=1e-13)


def test_power_of_the_plant_is_that_of_the_model():
    rig, state = kernels.rig(MODEL, PROBLEM.stock, 0.04), np.zeros(kernels.STATES)
    wheel = Wheel(MODEL)
    for y, power in (
        (wheel.beyond(0.02), wheel.power(0.02)),
        (-0.5 * wheel.K0, 0.5 * wheel.power(0.0)),
        (-2 * wheel.K0, 0.0),
    ):
        kernels.start_part(state, rig)
        state[kernels.Y], state[kernels.RATE] = y, wheel.rate(y)
        assert kernels.true_power(state, rig) == pytest.approx(power, rel=1e-12)


def test_readings():
    rig = kernels.rig(MODEL, PROBLEM.stock, 0.04)._replace(
        size_sd=1e-3, size_offset=0.01, power_sd=0.02, power_gain=1.1, power_max=2000.0
    )
    state = np.zeros(kernels.STATES)
    kernels.start_part(state, rig)
    state[kernels.REMAINING], v = 0.2, 0.02
    state[kernels.Y], state[kernels.RATE] = Wheel(MODEL).beyond(v), v
    power = Wheel(MODEL).power(v)
    size, shown, clipped = kernels.read(state, rig, 2.0, 3.0)
    assert (size, shown, clipped) == (pytest.approx(0.082 + 0.01 + 0.002), pytest.approx(power * 1.16), False)
    for limit, expected in ((power * 1.16 / 0.989, False), (power * 1.16 / 0.991, True)):
        assert kernels.read(state, rig._replace(power_max=limit), 0.0, 3.0)[2] is expected
    assert kernels.read(state, rig._replace(power_max=1000.0), 0.0, 3.0)[1] == 1000.0


def test_late_and_slow_gauges():
    pole = math.exp(-0.04 / 0.1)
    rig = kernels.rig(MODEL, PROBLEM.stock, 0.04)._replace(size_delay=True, power_pole=pole)
    state, truth, shown = np.zeros(kernels.STATES), [], []
    kernels.start_part(state, rig)
    for _ in range(40):
        truth.append((PROBLEM.stock - state[kernels.REMAINING], kernels.true_power(state, rig)))
        shown.append(kernels.read(state, rig, 0.0, 0.0)[:2])
        kernels.advance(state, rig, 0.0448)
    size, power = np.array(truth).T
    late, slow = np.array(shown).T
    np.testing.assert_array_equal(late[1:], size[:-1])
    # the monitor's own equation, P' = (true - P)/lag, solved exactly where the power is linear in a sample
    expected = lsim(([1.0], [0.1, 1.0]), power, 0.04 * np.arange(40))[1]
    np.testing.assert_allclose(slow, expected, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    "options",
    [{}, {"safety_margin": 0.02, "observer_gain": 0.3}, {"no_burn": True, "observer_gain": 0.1}],
    ids=["no margin", "margin", "no burn"],
)
def test_printed_cycle_against_its_sections(options):
    controller = plunge.CycleController(PROBLEM, sparkout="printed", **{"observer_gain": 1.0} | options)
    log = hwsim.run(hwsim.PlungeGrinder(PROBLEM), controller, rng=4)
    table, twin = log["controller"], Printed(controller)
    commanded = [twin.step(size) for size in table["size"].values]
    assert commanded[-1] is None and np.isnan(table.command_rate_command.values[-1])
    np.testing.assert_allclose(table.command_rate_command.values[:-1], commanded[:-1], rtol=0, atol=1e-9)
    assert set(table.section_planned.values) >= {1, 3, 4}
