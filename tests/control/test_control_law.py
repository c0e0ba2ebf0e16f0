"""Laws that know what became of their command."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.control import Law, Sampled, sampled
from sdpgrind.control.kernels import quantised

errors = st.lists(st.floats(-50, 50), min_size=1, max_size=40).map(np.array)


def pi(kp, step):
    """Sum of errors times step, half of the last one, and kp of it."""
    one = np.ones(1)
    return Law(Sampled(np.ones((1, 1)), one, step * one, kp + step / 2, 1.0), one / step)


@settings(deadline=None, max_examples=40)
@given(errors, st.floats(0.1, 2.0), st.floats(0.05, 1.0))
def test_without_limits_it_is_the_linear_law(e, kp, step):
    law = pi(kp, step)
    assert law.simulate(e) == pytest.approx(law.system.run(e), abs=1e-9)
    assert law.simulate(e) == pytest.approx(step * (np.cumsum(e) - e / 2) + kp * e, abs=1e-9)


@settings(deadline=None, max_examples=40)
@given(errors, st.floats(0.1, 2.0), st.floats(0.05, 1.0))
def test_limited_law_is_the_incremental_form(e, kp, step):
    """u = clip(u_last + kp (e - e_last) + step (e + e_last)/2): written without any state of the law."""
    expected, u = [], 0.0
    for k, value in enumerate(e):
        last = e[k - 1] if k else 0.0
        grown = kp * (value - last) + step * ((value + last) / 2 if k else value / 2)
        u = float(np.clip(u + grown, -1.0, 1.0))
        expected.append(u)
    assert pi(kp, step).simulate(e, low=-1.0, high=1.0) == pytest.approx(np.array(expected), abs=1e-8)


def test_nothing_winds_up():
    e = np.concatenate([np.full(200, 5.0), np.full(3, -5.0)])
    limited = pi(0.5, 0.2).simulate(e, high=1.0)
    assert limited[199] == 1.0
    assert limited[200] < 0  # 5 -> -5 through the proportional part at once
    wound = np.minimum(pi(0.5, 0.2).system.run(e), 1.0)
    assert np.all(wound[200:] == 1.0)


def internal(model_pole=0.6, filter_gain=0.4):
    model = Sampled([[model_pole]], [1 - model_pole], [1.0], 0.0, 1.0).delayed(1)
    filter = Sampled([[0.3]], [1.0], [filter_gain], 0.2, 1.0)
    return model, filter, Law.internal_model(model, filter)


def test_internal_model_is_q_over_one_less_pq():
    model, filter, law = internal()
    w = np.linspace(0.05, 3.0, 9)
    P, Q = model.response(w), filter.response(w)
    assert law.system.response(w) == pytest.approx(Q / (1 - P * Q), rel=1e-10)
    closed = law.system.then(model).closed().response(w)
    assert closed == pytest.approx(P * Q, abs=1e-10)


def test_internal_model_knows_the_limited_command():
    """With limits the law is: filter of (error + what the model says for the command that was applied)."""
    model, filter, law = internal()
    rng = np.random.default_rng(0)
    e = rng.normal(0, 3, 60)
    x, q, expected = np.zeros(model.order), np.zeros(1), []
    for value in e:
        seen = value + model.C @ x
        u = float(np.clip(filter.C @ q + filter.D * seen, -0.5, 0.5))
        q, x = filter.A @ q + filter.B * seen, model.A @ x + model.B * u
        expected.append(u)
    assert law.simulate(e, -0.5, 0.5) == pytest.approx(np.array(expected), abs=1e-12)


@settings(deadline=None, max_examples=40)
@given(st.floats(-1e3, 1e3), st.floats(1e-3, 10.0))
def test_quantised_is_nearest(value, quantum):
    q = quantised(value, quantum)
    assert abs(q - value) <= quantum / 2 * (1 + 1e-9)
    assert q / quantum == pytest.approx(round(q / quantum), abs=1e-6)
    assert quantised(value, 0.0) == value


def test_messages():
    model, filter, _ = internal()
    with pytest.raises(ValueError, match=r"L must be of shape \(1,\); got \(2,\)"):
        Law(Sampled([[1.0]], [1.0], [1.0], 0.0, 1.0), [1.0, 2.0])
    with pytest.raises(
        ValueError, match=r"model.D must be 0 \(a plant that answers after its command\); got 0.2"
    ):
        Law.internal_model(filter, filter)
    with pytest.raises(ValueError, match="sample_time must be the same in both"):
        Law.internal_model(model, sampled([1.0], [1.0, 1.0], 0.5))
