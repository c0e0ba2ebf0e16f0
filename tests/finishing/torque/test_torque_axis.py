"""The torque axis: digital limits, exact motion through touches and lifts, energy."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from torque_twins import axis_twin

from sdpgrind.base import stored
from sdpgrind.finishing import TorqueAxis, kernels

AXIS = TorqueAxis()


def ticks(start, drives, surface, axis, load=0.0):
    state, rows = np.array([*start, 0.0]), []
    for k, drive in enumerate(drives):
        torque = kernels.axis_tick(state, drive / axis[2], load, surface[k], surface[k + 1], axis)
        rows.append([*state, torque])
    return np.array(rows)


def test_digital_limits_of_the_source():
    """In its units: mA, mN m, kgf mm and gf, with 9.81 m/s^2."""
    gf, kgf_mm = 9.81e-3, 9.81e-3  # N; N m
    assert 1e3 * AXIS.current_step == pytest.approx(2.4414, rel=1e-4)
    assert 1e3 * AXIS.torque_step == pytest.approx(0.45166, rel=1e-4)
    assert AXIS.torque_step / kgf_mm == pytest.approx(0.046041, rel=1e-4)
    assert AXIS.force_step / gf == pytest.approx(0.48464, rel=1e-4)
    assert AXIS.torque_max / kgf_mm == pytest.approx(18.858, rel=1e-4)
    assert AXIS.force_max / gf == pytest.approx(198.51, rel=1e-4)


def test_command_and_observation_are_limited_by_different_steps():
    assert AXIS.force_step == pytest.approx(0.0048, abs=5e-5)
    assert AXIS.force_resolution == pytest.approx(0.040, abs=5e-4)
    assert AXIS.replace(encoder_counts=4000).force_resolution == pytest.approx(0.198, abs=5e-4)
    assert AXIS.replace(current_limit=1.2).force_max == pytest.approx(2.337, abs=5e-4)
    assert AXIS.force_max == pytest.approx(1.947, abs=5e-4)
    assert AXIS.contact_stiffness == pytest.approx(1.324, abs=5e-4)
    assert AXIS.natural_frequency / (2 * pi) == pytest.approx(16.6, abs=0.05)


def test_an_axis_is_stored_and_replaced():
    other = AXIS.replace(encoder_counts=4000, inertia=0.002)
    assert stored.decode(stored.encode(other)) == other != AXIS


def test_moves_as_integrated_through_touches_and_lifts():
    rng = np.random.default_rng(1)
    drives = rng.uniform(0.0, 0.1, 120)
    surface = 1e-3 * rng.normal(size=121)
    found = ticks((2e-3, -0.5), drives, surface, AXIS.parameters)
    twin = axis_twin((2e-3, -0.5), drives, surface, AXIS.parameters)
    gap = found[:, 0] - surface[1:]
    assert np.sum(np.diff(np.sign(gap)) != 0) >= 4  # it does touch and lift
    np.testing.assert_allclose(found[:, 0], twin[:, 0], atol=1e-10)
    np.testing.assert_allclose(found[:, 1], twin[:, 1], atol=1e-8)
    np.testing.assert_allclose(found[:, 3], AXIS.contact_angular_stiffness * np.maximum(gap, 0), atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(
    gap=st.floats(-2e-2, 2e-2),
    speed=st.floats(-3, 3),
    drive=st.floats(-0.15, 0.25),
    scale=st.floats(0.1, 10),
    tick=st.floats(1e-5, 0.02),
)
def test_energy_is_kept_on_a_surface_that_stands_still(gap, speed, drive, scale, tick):
    stiffness = scale * AXIS.contact_angular_stiffness
    axis = np.array([AXIS.inertia, stiffness, AXIS.torque_constant, tick])
    rows = ticks((gap, speed), np.full(60, drive), np.zeros(61), axis)
    angle, omega = np.append(gap, rows[:, 0]), np.append(speed, rows[:, 1])
    parts = [0.5 * AXIS.inertia * omega**2, 0.5 * stiffness * np.maximum(angle, 0) ** 2, -drive * angle]
    size = max(np.abs(part).max() for part in parts)
    assert np.ptp(np.sum(parts, axis=0)) <= 2e-12 * size + 1e-25


@settings(max_examples=60, deadline=None)
@given(
    gap=st.floats(-1e-2, 1e-2), speed=st.floats(-2, 2), drive=st.floats(-0.1, 0.2), tick=st.floats(1e-4, 5e-3)
)
def test_played_backwards_it_comes_back(gap, speed, drive, tick):
    axis = np.array([AXIS.inertia, AXIS.contact_angular_stiffness, AXIS.torque_constant, tick])
    there = ticks((gap, speed), np.full(30, drive), np.zeros(31), axis)[-1]
    back = ticks((there[0], -there[1]), np.full(30, drive), np.zeros(31), axis)[-1]
    size = abs(gap) + (abs(speed) + 30 * tick * 300) * 30 * tick
    assert back[0] == pytest.approx(gap, abs=1e-9 * size)
    assert -back[1] == pytest.approx(speed, abs=1e-7 * (abs(speed) + 1))


@settings(max_examples=60, deadline=None)
@given(
    gap=st.floats(-2e-3, 5e-3, allow_subnormal=False),  # the time of a touch has their products, which are 0
    speed=st.floats(-1, 1),
    drive=st.floats(-0.1, 0.2),
    move=st.floats(-1e-3, 1e-3, allow_subnormal=False),
)
def test_a_tick_is_the_sum_of_its_parts(gap, speed, drive, move):
    """Touches and lifts are found wherever the ticks end; the mean torque is that of the parts."""
    whole = np.array([AXIS.inertia, AXIS.contact_angular_stiffness, AXIS.torque_constant, 4e-3])
    quarter = np.array([*whole[:3], 1e-3])
    one = ticks((gap, speed), [drive], [0.0, move], whole)[-1]
    four = ticks((gap, speed), np.full(4, drive), np.linspace(0, move, 5), quarter)
    np.testing.assert_allclose(one[:2], four[-1, :2], rtol=1e-9, atol=1e-11)
    assert one[2] == pytest.approx(four[:, 2].mean(), abs=1e-9)


def test_rest_is_rest_and_load_torque_pulls_against_the_motor():
    depth = 0.1 / AXIS.contact_angular_stiffness
    rows = ticks((depth, 0.0), np.full(100, 0.13), np.zeros(101), AXIS.parameters, load=0.03)
    np.testing.assert_allclose(rows[:, 0], depth, rtol=1e-12)
    np.testing.assert_allclose(rows[:, 2:], 0.1, rtol=1e-11)


def test_just_touching_without_force_stays_and_is_pushed_either_way():
    for drive, sign in ((0.0, 0), (1e-3, 1), (-1e-3, -1)):
        rows = ticks((0.0, 0.0), [drive], np.zeros(2), AXIS.parameters)
        assert np.sign(rows[0, 0]) == sign


def test_the_encoder_shows_the_nearest_count():
    step = AXIS.angle_step
    assert kernels.encoder_reading(2.4 * step, step) == pytest.approx(2 * step)
    assert kernels.encoder_reading(-2.6 * step, step) == pytest.approx(-3 * step)
    assert kernels.encoder_reading(0.1234, 0.0) == 0.1234
