"""Compiled loops of plunge cycles against slow twins: Brent's roots, an integrator, matrices."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from plunge_inside import kernels as _kernels
from plunge_inside import state as places
from plunge_twins import Filter, Printed, Wheel, ground
from scipy.optimize import brentq
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
@given(model=wheels, near=st.floats(1e-6, 0.2), rate_max=st.floats(0.01, 0.09))
def test_rate_at_which_burning_begins(model, near, rate_max):
    expected = Wheel(model).burn_rate(rate_max)
    found = opened(_kernels._burning_begins)(model.core, near, rate_max)
    if expected is not None:
        assert found == pytest.approx(expected, rel=1e-8)
    else:  # at every rate: the one at which heat exceeds least what is stood
        rates = np.geomspace(1e-6, rate_max, 2000)
        over = [math.exp(depth_over_reach(model, v)) * v**0.25 - v**0.25 for v in rates]
        assert found == pytest.approx(rates[int(np.argmin(over))], rel=0.01)


def depth_over_reach(model, v):
    """Logarithm of heat over the heat of burning."""
    return _kernels.burn_depth(v, model.core) / (model.core.reach * v**0.25)


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


@settings(max_examples=40, deadline=None)
@given(model=wheels, scale=st.floats(0.5, 1.5), rate_max=st.floats(0.03, 0.2), share=st.floats(0.01, 1.0))
def test_least_of_deflection_less_damage(model, scale, rate_max, share):
    """Against a dense grid, whose minimum errs by at most an eighth of its second difference."""
    wheel = Wheel(model)
    low = wheel.burn_rate(rate_max)
    assume(low is not None and low < 0.999 * rate_max)
    high = low * (rate_max / low) ** share
    over = np.array([scale * wheel.beyond(v) - wheel.burn_depth(v) for v in np.geomspace(low, high, 2001)])
    between = float(np.abs(np.diff(over, 2)).max()) / 8
    found = opened(_kernels._least_over_burn)(scale, low, high, model.core)
    # damage of both to 1e-9 of itself
    assert min(found, over[-1]) == pytest.approx(over.min(), abs=between + 1e-11)
    assert found == math.inf or found in (
        pytest.approx(over[0], abs=1e-11),
        pytest.approx(turned(over), abs=between + 1e-11),
    )
    if np.diff(over).max() < 0:
        assert found == math.inf


def turned(over):
    """Least inner local minimum; infinite: none."""
    inner = over[1:-1]
    return float(np.min(inner[(inner <= over[:-2]) & (inner <= over[2:])], initial=np.inf))


def test_a_turn_is_found_wherever_it_lies():
    """In the first cell, in the last one, just before the end; never at the end itself."""
    model = MODEL.replace(
        wear_flat_area=0.015625,
        stiffness=4041.0,
        burning=physics.BurningLimit(6.205, 3.0),
        work_rotation=22.0,
    )
    turn = brentq(lambda v: opened(_kernels._over_burn)(v, 1.0, model.core)[1], 0.01, 0.06, xtol=1e-15)
    least = Wheel(model).beyond(turn) - Wheel(model).burn_depth(turn)
    for below, above in itertools.product((0.5, 1e-2, 1e-5), (1e-6, 1e-3, 0.05, 1.0)):
        found = opened(_kernels._least_over_burn)(1.0, turn * (1 - below), turn * (1 + above), model.core)
        assert found == pytest.approx(least, abs=1e-11)
    for low, high in ((0.5, 1 - 1e-6), (1.0, 1.0)):
        assert (
            opened(_kernels._least_over_burn)(
                1.0, low * turn * (1 - 1e-6), high * turn * (1 - 1e-6), model.core
            )
            == math.inf
        )
    rising = opened(_kernels._least_over_burn)(1.0, 1.01 * turn, 2 * turn, model.core)
    assert rising == pytest.approx(
        Wheel(model).beyond(1.01 * turn) - Wheel(model).burn_depth(1.01 * turn), abs=1e-11
    )


@settings(max_examples=40, deadline=None)
@given(model=wheels, scale=st.floats(0.5, 1.5), v=st.floats(1e-3, 0.1))
def test_slope_of_deflection_less_damage(model, scale, v):
    """By fourth-order differences over a step h of the logarithm."""
    wheel, h = Wheel(model), 1e-3
    over = [
        scale * wheel.beyond(v * math.exp(k * h)) - wheel.burn_depth(v * math.exp(k * h))
        for k in (-2, -1, 0, 1, 2)
    ]
    value, slope = opened(_kernels._over_burn)(v, scale, model.core)
    assert value == pytest.approx(over[2], abs=1e-11)
    assert slope == pytest.approx(
        (over[0] - 8 * over[1] + 8 * over[3] - over[4]) / (12 * h), abs=1e-10, rel=1e-9
    )


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
    rig = kernels.rig(MODEL, PROBLEM.stock, 0.04)._replace(size_delay=True, power_lag=pole)
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


@pytest.mark.parametrize("seed", range(3))
def test_filter_against_matrices(seed):
    """A noisy part with a wheel unlike the controller's and missing readings."""
    controller = plunge.CycleController(PROBLEM.replace(wear_flat_area=0.0234), safety_margin=0.01)
    machine = hwsim.PlungeGrinder(PROBLEM, contact_zero_sd=0.01, power_max=2600.0).start(
        np.random.default_rng(seed)
    )
    rng, twin, state, reading = (
        np.random.default_rng(seed),
        Filter(controller),
        controller.state,
        machine.step({}, 0),
    )
    command = {}
    while not machine.done:
        twin.predict(command.get("command_rate", 0.0))
        missing = rng.uniform(size=2) < 0.05 if machine.time > 20 else (False, False)
        size, power = (
            math.nan if gone else reading[name]
            for gone, name in zip(missing, ("size", "grinding_power"), strict=True)
        )
        command = controller.step(size=size, grinding_power=power, power_saturated=reading["power_saturated"])
        twin.read(
            size if state[places.MISSED] == 0 else math.nan, math.nan if reading["power_saturated"] else power
        )
        if twin.touched:
            got = state[[places.Y, places.ZERO, places.SCALE, places.SHARPNESS]] + [twin.base.K0, 0, 0, 0]
            np.testing.assert_allclose(got, twin.mean, rtol=1e-7, atol=1e-10)
            np.testing.assert_allclose(
                state[places.COVARIANCE : places.FILTERED].reshape(4, 4),
                twin.covariance,
                rtol=1e-5,
                atol=1e-12 * twin.covariance.max(),
            )
        reading = machine.step(command, 1)
    assert twin.touched and machine.time > 250


@pytest.mark.parametrize(("y", "command"), [(0.03, 0.0448), (0.05, 0.01), (0.02, 0.0), (-0.005, 0.0448)])
def test_jacobian_against_differences(y, command):
    """Of the step itself, to the order of the sample time over the time constant."""
    twin = Filter(plunge.CycleController(PROBLEM))

    def after(y, scale, area):
        return Wheel(MODEL, MODEL.wear_flat_area * area).step(y, command, 0.04 / scale)

    end = after(y, 1.1, 0.95)
    rate = command - 1.1 * (end - y) / 0.04
    got = twin.jacobian(end, rate, command, 1.1, 0.95)[0]
    h = 1e-6
    by_y = (after(y + h, 1.1, 0.95) - after(y - h, 1.1, 0.95)) / (2 * h)
    by_scale = (after(y, 1.1 + h, 0.95) - after(y, 1.1 - h, 0.95)) / (2 * h)
    by_area = (after(y, 1.1, 0.95 + h) - after(y, 1.1, 0.95 - h)) / (2 * h)
    assert got[0] == pytest.approx(by_y, rel=2e-3)
    assert got[2] == pytest.approx(by_scale, rel=0.03, abs=1e-9)
    assert got[3] == pytest.approx(by_area, rel=0.03, abs=1e-9)


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
