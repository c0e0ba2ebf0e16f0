"""The load torque: by weight, and from free motion before touch-down."""

from math import pi

import numpy as np
import pytest
from finishing_inside import identify_load_torque
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import stats

from sdpgrind.finishing import TorqueAxis, TorqueController, kernels
from sdpgrind.finishing.torque import gravity_torque, simulate_axis

AXIS = TorqueAxis()


def free_motion(load, samples=150, offset=0.0, speed=0.0, surface=1e3, seed=0, swing=0.05):
    """Readings of an axis that flies under a current of some variety; the surface is far."""
    return flown(load, samples, offset, speed, surface, seed, swing)[0]


def flown(load, samples=150, offset=0.0, speed=0.0, surface=1e3, seed=0, swing=0.05):
    """Readings as of `free_motion`, and the angles (rad) that they were rounded from."""
    rng = np.random.default_rng(seed)
    state, time, angle, current = np.array([offset, speed, 0.0]), [], [], []
    for k in range(samples):
        time.append(k * 1e-3)
        angle.append(state[0])
        current.append(swing * rng.normal())
        kernels.axis_tick(state, current[-1], load, surface, surface, AXIS.parameters)
    shown = [kernels.encoder_reading(one, AXIS.angle_step) for one in angle]
    data = {"time": np.array(time), "motor_angle": np.array(shown), "current": np.array(current)}
    return data, np.array(angle)


@settings(max_examples=30, deadline=None)
@given(load=st.floats(-0.1, 0.1), offset=st.floats(-1, 1), speed=st.floats(-1, 1), seed=st.integers(0, 99))
@example(load=-0.024435439102107798, offset=0.0, speed=0.0, seed=0)  # 7.2 standard deviations
def test_free_motion_tells_the_load(load, offset, speed, seed):
    """All of its error is the rounding of the readings, each by up to half a count, in the parabola.

    No number of standard deviations bounds it: they are estimated with four degrees of freedom, and 2 of
    1000 motions are farther off than 7.
    """
    data, angle = flown(load, offset=offset, speed=speed, seed=seed)
    found = identify_load_torque(data, AXIS)
    assert found.ok and found.names == ("load_torque",) and found.units == ("N m",)
    powers = np.stack([np.ones_like(angle), data["time"], data["time"] ** 2], axis=1)
    weights = -2 * AXIS.inertia * np.linalg.pinv(powers)[2]
    error = float(weights @ (data["motor_angle"] - angle))
    # each tick rounds the gap to the surface, 1e3 rad off; sums of sums over n readings n^2 times the angle
    lost = np.finfo(float).eps * angle.size * (1e3 + angle.size * np.abs(angle).max()) * np.abs(weights).sum()
    assert found["load_torque"] - load == pytest.approx(error, rel=0, abs=lost)
    assert abs(error) <= 0.5 * AXIS.angle_step * np.abs(weights).sum() * (1 + 1e-9)
    assert 6 * found.sd[0] < 1e-3


@pytest.mark.parametrize(("load", "swing"), [(0.02, 0.05), (1e-4, 1e-3), (0.0, 0.0)])
def test_standard_deviations_are_those_of_the_errors(load, swing):
    """Over the phases of the encoder; where it hardly moves, rounding is one error for many readings."""
    rng = np.random.default_rng(5)
    errors, inside = [], []
    for seed in range(120):
        found = identify_load_torque(
            free_motion(load, offset=rng.uniform(0, 1), seed=seed, swing=swing), AXIS
        )
        errors.append((found["load_torque"] - load) / found.sd[0])
        inside.append(abs(errors[-1]) < stats.t.ppf(0.975, found.freedom))
    assert np.sqrt(np.mean(np.square(errors))) < 1.3
    assert sum(inside) >= stats.binom.ppf(1e-4, 120, 0.95)  # Student's 95 %; measured: 97.2 % of 3000 motions
    if swing == 0.05:
        assert np.sqrt(np.mean(np.square(errors))) > 0.5  # that of the worst course nearby, so not as small


@pytest.mark.parametrize(
    ("counts", "readings"), [(0.99, 100), (0.995, 200), (1.02, 50), (2.01, 100), (0.505, 100)]
)
def test_a_motor_that_turns_by_nearly_whole_counts_is_not_trusted_too_far(counts, readings):
    """Rounding then beats slowly, and looks like acceleration."""
    rng, time, errors = np.random.default_rng(7), np.arange(readings) * AXIS.sample_time, []
    for _ in range(60):
        turned = np.round(rng.uniform() + counts * np.arange(readings)) * AXIS.angle_step
        data = {
            "time": time,
            "motor_angle": turned,
            "current": np.full(readings, 0.02 / AXIS.torque_constant),
        }
        found = identify_load_torque(data, AXIS)
        errors.append((found["load_torque"] - 0.02) / found.sd[0])
    assert np.sqrt(np.mean(np.square(errors))) < 1.2 and np.mean(np.abs(errors) < 2) > 0.9


def test_contact_is_not_taken_for_free_motion():
    record = simulate_axis(TorqueController(AXIS, normal_force=1.111, kind="damped"), start_angles=20)
    for run in range(20):
        shown = np.round(record.angle[run] / AXIS.angle_step) * AXIS.angle_step
        data = {"time": record.time, "motor_angle": shown, "current": record.current[run]}
        assert not identify_load_torque(data, AXIS, until=0.03, throw=False).ok


def test_it_is_least_squares():
    data = free_motion(0.03)
    found = identify_load_torque(data, AXIS)
    time, driven, speed = data["time"], [0.0], 0.0
    for k in range(1, time.size):  # the current alone, step by step
        gain = AXIS.torque_constant / AXIS.inertia * data["current"][k - 1]
        driven.append(driven[-1] + speed * 1e-3 + 0.5 * gain * 1e-6)
        speed += 1e-3 * gain
    curve = np.polyfit(time, data["motor_angle"] - driven, 2)
    assert found["load_torque"] == pytest.approx(-2 * AXIS.inertia * curve[0], rel=1e-9)


def test_readings_that_are_missing_are_left_out():
    data = free_motion(0.03)
    data["motor_angle"][::7] = np.nan
    assert identify_load_torque(data, AXIS)["load_torque"] == pytest.approx(0.03, abs=1e-3)


def test_touch_down_ends_free_motion():
    load, data = 0.01, free_motion(0.01, samples=300, offset=-0.04, speed=1.5, surface=0.0, swing=0.2)
    whole = identify_load_torque(data, AXIS, throw=False)
    assert not whole.ok
    assert (
        "the motion is not free" in whole.message
        and "touch-down, or look at the current and the axis" in whole.message
    )
    with pytest.raises(ValueError, match="not free"):
        identify_load_torque(data, AXIS)
    begun = np.argmax(data["motor_angle"] > -2e-3) * 1e-3
    assert identify_load_torque(data, AXIS, until=begun)["load_torque"] == pytest.approx(load, abs=2e-3)


def test_what_is_found_puts_the_force_right():
    load = 0.015
    found = identify_load_torque(free_motion(load), AXIS)
    errors = {}
    for known in (0.0, found["load_torque"]):
        law = TorqueController(AXIS, normal_force=1.111, kind="lqg", load_torque=known)
        errors[known] = abs(np.mean(simulate_axis(law, load_torque=load).offset))
    assert errors[0.0] == pytest.approx(load / 0.095, rel=0.02)
    assert errors[found["load_torque"]] < 0.01


def test_parts_are_pooled():
    parts = [free_motion(0.03, seed=k, offset=0.1 * k) for k in range(5)]
    data = {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}
    data["part"] = np.repeat(np.arange(5), 150)
    all_of_them, one = identify_load_torque(data, AXIS), identify_load_torque(data, AXIS, part=2)
    assert all_of_them["load_torque"] == pytest.approx(0.03, abs=4 * all_of_them.sd[0])
    assert all_of_them.sd[0] < one.sd[0]
    assert "5 parts" in all_of_them.message
    single = identify_load_torque(parts[2], AXIS)
    assert one["load_torque"] == pytest.approx(single["load_torque"], rel=1e-12)


def test_too_few_readings_tell_nothing():
    data = {name: values[:5] for name, values in free_motion(0.03).items()}
    assert identify_load_torque(data, AXIS, throw=False).message == (
        "not identified: 5 readings of the angle are too few: at least 8 are needed"
    )  # fmt: skip


def test_weight_of_a_tool():
    assert gravity_torque(0.44, 50.0, 0.0) == pytest.approx(0.2158, abs=1e-4)
    assert gravity_torque(0.44, 50.0, 0.0) > AXIS.torque_max
    np.testing.assert_allclose(
        gravity_torque(0.1, 20.0, np.array([0.0, pi / 3, pi / 2])),
        0.1 * 9.81 * 0.02 * np.array([1, 0.5, 0]),
        atol=1e-17,
    )
