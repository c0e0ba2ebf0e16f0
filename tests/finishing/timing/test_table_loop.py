"""The table's loop: transfer function, stability, errors left, exact samples."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.base import stored
from sdpgrind.finishing.timing import TableLoop

LOOP = TableLoop()
gains = st.floats(1e-2, 1e2)


def test_denominator_and_numerator_as_printed():
    assert LOOP.denominator.tolist() == pytest.approx([0.002, 0.01 + 0.5 * 0.4, 10.0, 50.0])
    assert LOOP.numerator.tolist() == pytest.approx([0.2, 10.0, 50.0])


def test_loop_is_closed_from_its_blocks():
    """PID law times 1/(J s^2 + B s), under unit feedback."""
    frequency = np.geomspace(0.1, 1e3, 50)
    s = 1j * frequency
    open_loop = 0.5 * (20.0 + 100.0 / s + 0.4 * s) / (0.002 * s**2 + 0.01 * s)
    assert np.allclose(LOOP.response(frequency), open_loop / (1 + open_loop), rtol=1e-12)


@settings(deadline=None)
@given(gains, gains, gains, gains, gains, gains)
def test_refused_where_a_pole_is_not_on_the_left(inertia, damping, constant, kp, ki, kd):
    margin = (damping + constant * kd) * kp / (inertia * ki)
    poles = np.roots([inertia, damping + constant * kd, constant * kp, constant * ki])
    if margin > 1 + 1e-6:
        assert np.max(poles.real) < 0
        assert TableLoop(inertia, damping, constant, kp, ki, kd).poles == pytest.approx(poles)
    elif margin < 1 - 1e-6:
        assert np.max(poles.real) > 0
        with pytest.raises(ValueError, match="unstable; its poles are"):
            TableLoop(inertia, damping, constant, kp, ki, kd)


def test_ramp_leaves_no_error():
    time = np.arange(6001) * 1e-3
    assert LOOP.follow(25.0 * time, 1e-3)[-1] == pytest.approx(25.0 * time[-1], abs=1e-9)


@pytest.mark.parametrize("loop", [LOOP, LOOP.replace(damping=0.05, ki=200.0)])
def test_parabola_leaves_what_the_formula_says(loop):
    time = np.arange(8001) * 1e-3
    command = 500.0 * time**2
    left = command[-1] - loop.follow(command, 1e-3)[-1]
    # straight lines between samples stand above the parabola by a h^2/12 in the mean
    assert left == pytest.approx(loop.parabola_error(1000.0), abs=1000.0 * 1e-6 / 4)
    assert loop.parabola_error(1000.0) == pytest.approx(loop.damping * 1000.0 / (0.5 * loop.ki))


def test_samples_are_exact_for_straight_lines():
    rng = np.random.default_rng(0)
    command = np.cumsum(rng.normal(size=400))
    time = 2e-3 * np.arange(400)
    _, exact, _ = scipy.signal.lsim((LOOP.numerator, LOOP.denominator), command - command[0], time)
    assert np.allclose(LOOP.follow(command, 2e-3), exact + command[0], atol=1e-9)


def test_samples_do_not_depend_on_their_step():
    corners = np.array([0.0, 0.1, 0.25, 0.4]), np.array([0.0, 3.0, 3.0, -1.0])
    fine, coarse = (
        LOOP.follow(np.interp(np.arange(count + 1) * 0.4 / count, *corners), 0.4 / count)
        for count in (400, 80)
    )
    assert np.allclose(fine[::5], coarse, atol=1e-11)


def test_compiled_loop_is_the_obvious_one():
    step, rng = LOOP.sampled(1e-3), np.random.default_rng(1)
    command, state, obvious = rng.normal(size=50), np.zeros(3), [0.0]
    for before, after in zip(command[:-1] - command[0], command[1:] - command[0], strict=True):
        state = step.transition @ state + step.old * before + step.new * after
        obvious.append(step.output @ state)
    assert np.allclose(LOOP.follow(command, 1e-3), np.array(obvious) + command[0], atol=1e-13)


def test_standing_still_stays():
    assert LOOP.follow(np.full(100, 37.0), 1e-3) == pytest.approx(np.full(100, 37.0), abs=1e-12)


def test_sine_is_followed_as_the_response_says():
    frequency, time = 20.0, np.arange(40001) * 1e-4
    position = LOOP.follow(np.sin(frequency * time), 1e-4)
    gain = LOOP.response(frequency)
    assert np.allclose(position[-5000:], np.imag(gain * np.exp(1j * frequency * time[-5000:])), atol=1e-5)


def test_comes_back_from_its_text():
    assert stored.decode(stored.encode(LOOP)) == LOOP
