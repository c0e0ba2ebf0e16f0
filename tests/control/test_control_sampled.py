"""Exact sampling, series, delay, feedback: against scipy and closed forms."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.control import Sampled, continuous, ramped, sampled

poles = st.lists(st.floats(0.2, 200.0), min_size=1, max_size=4)
times = st.sampled_from([1 / 480, 1 / 60, 0.1])


def transfer(rates):
    """Product of rate/(s + rate)."""
    low = np.poly(-np.array(rates))
    return [np.prod(rates)], low


@settings(deadline=None, max_examples=40)
@given(poles, times)
def test_hold_is_scipys(rates, step):
    top, low = transfer(rates)
    ours = sampled(top, low, step)
    A, B, C, D = scipy.signal.tf2ss(top, low)
    theirs = scipy.signal.cont2discrete((A, B, C, D), step)
    theirs = Sampled(theirs[0], theirs[1][:, 0], theirs[2][0], theirs[3][0, 0], step)
    w = np.linspace(0.01, 3.1, 7) / step
    assert ours.response(w) == pytest.approx(theirs.response(w), abs=1e-9)
    assert ours.dc_gain == pytest.approx(1.0, abs=1e-9)
    assert ours.stable


@settings(deadline=None, max_examples=40)
@given(poles)
def test_state_space_of_a_transfer_function(rates):
    top, low = transfer(rates)
    A, B, C, D = continuous(top, low)
    for w in (0.1, 3.0, 100.0):
        ours = C @ np.linalg.solve(1j * w * np.eye(len(B)) - A, B) + D
        assert ours == pytest.approx(np.polyval(top, 1j * w) / np.polyval(low, 1j * w), rel=1e-8, abs=1e-12)


def test_direct_gain_of_a_lead():
    A, B, C, D = continuous([2.0, 3.0], [1.0, 5.0])
    assert D == 2.0
    assert D - C @ np.linalg.solve(A, B) == pytest.approx(0.6)


@settings(deadline=None, max_examples=40)
@given(poles, poles, times)
def test_series_delay_and_feedback_by_frequency(first, second, step):
    a, b = sampled(*transfer(first), step), sampled(*transfer(second), step)
    w = np.linspace(0.01, 3.0, 5) / step
    P, Q = a.response(w), b.response(w)
    assert a.then(b).response(w) == pytest.approx(P * Q, abs=1e-9)
    assert a.delayed(3).response(w) == pytest.approx(P * np.exp(-3j * w * step), abs=1e-9)
    assert a.scaled(0.5).closed().response(w) == pytest.approx(0.5 * P / (1 + 0.5 * P), abs=1e-8)


def test_feedback_with_direct_gain():
    lead = Sampled([[0.5]], [1.0], [0.3], 0.8, 0.1)
    w = np.array([0.2, 5.0, 30.0])
    assert lead.closed().response(w) == pytest.approx(lead.response(w) / (1 + lead.response(w)), rel=1e-12)


@settings(deadline=None, max_examples=40)
@given(poles, st.integers(1, 9))
def test_every_nth_sample_is_sampling_slower(rates, number):
    fast = sampled(*transfer(rates), 0.01).every(number)
    slow = sampled(*transfer(rates), 0.01 * number)
    w = np.linspace(0.1, 3.0, 5) / slow.sample_time
    assert fast.response(w) == pytest.approx(slow.response(w), abs=1e-8)


def test_run_is_a_recursive_filter():
    rng = np.random.default_rng(3)
    u = rng.standard_normal(50)
    b, a = scipy.signal.butter(2, 0.3)
    system = Sampled(
        *(scipy.signal.tf2ss(b, a)[0],),
        scipy.signal.tf2ss(b, a)[1][:, 0],
        scipy.signal.tf2ss(b, a)[2][0],
        b[0],
        1.0,
    )
    assert system.run(u) == pytest.approx(scipy.signal.lfilter(b, a, u), abs=1e-12)


def test_ramp_is_exact_for_straight_lines():
    rate, step = 3.0, 0.2
    A, old, new = ramped(np.array([[-rate]]), np.array([rate]), step)
    x = 0.0
    for k in range(5):  # input t, answer t - 1/rate + exp(-rate t)/rate
        x = A[0, 0] * x + old[0] * k * step + new[0] * (k + 1) * step
    t = 5 * step
    assert x == pytest.approx(t - 1 / rate + np.exp(-rate * t) / rate, abs=1e-13)


def test_integrators_have_no_dc_gain():
    assert Sampled([[1.0]], [1.0], [1.0], 0.0, 1.0).dc_gain == np.inf
    assert not Sampled([[1.0]], [1.0], [1.0], 0.0, 1.0).stable


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Sampled([[1.0]], [1.0, 2.0], [1.0], 0.0, 1.0), r"A must be of shape \(2, 2\)"),
        (lambda: Sampled([[np.nan]], [1.0], [1.0], 0.0, 1.0), r"A\[0\] must be finite"),
        (lambda: Sampled([[1.0]], [1.0], [1.0], 0.0, 0.0), r"sample_time must be > 0 \(s\); got 0.0"),
        (lambda: Sampled([[0.5]], [1.0], [1.0], 0.0, 1.0).delayed(-1), "delay_samples must be >= 0; got -1"),
        (
            lambda: Sampled([[0.5]], [1.0], [1.0], 0.0, 1.0).then(Sampled([[0.5]], [1.0], [1.0], 0.0, 2.0)),
            r"sample_time must be the same in both: 1 \(s\); got 2.0",
        ),
    ],
)
def test_messages(call, message):
    with pytest.raises(ValueError, match=message):
        call()
