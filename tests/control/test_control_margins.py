"""Margins against closed forms, poles and a definition applied on a dense grid."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.control import Sampled, loop_margins, sampled, slope_bandwidth


def integrator(gain, step=0.1):
    """L = gain/(z - 1)."""
    return Sampled([[1.0]], [gain], [1.0], 0.0, step)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.05, 1.6))
def test_integrator_in_closed_form(gain):
    m = loop_margins(integrator(gain))
    assert m.gain_margin == pytest.approx(2 / gain, rel=1e-9)
    crossing = 2 * np.arcsin(gain / 2)  # |e^{jx} - 1| = gain
    assert m.phase_margin == pytest.approx(np.pi / 2 - crossing / 2, rel=1e-8)
    assert m.sensitivity_peak == pytest.approx(2 / (2 - gain), rel=1e-9)
    assert m.complementary_peak == pytest.approx(max(1.0, gain / (2 - gain)), rel=1e-6)
    assert m.stable
    assert m.gain_margin_db == pytest.approx(20 * np.log10(2 / gain))


@settings(deadline=None, max_examples=40)
@given(st.floats(2.01, 5.0))
def test_unstable_loops_are_called_so(gain):
    assert not loop_margins(integrator(gain)).stable


def delayed_lag(gain):
    lag = sampled([1.0], [0.2, 1.0], 0.05)
    return integrator(gain, 0.05).then(lag).delayed(2)


@settings(max_examples=5, deadline=None)
@given(st.floats(0.01, 0.08))
def test_gain_margin_by_poles(gain):
    """A second way: the gain at which a pole of the closed loop reaches the unit circle."""
    m = loop_margins(delayed_lag(gain))
    low, high = 1.0, 1e3
    for _ in range(35):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if delayed_lag(gain * middle).closed().stable else (low, middle)
    assert m.gain_margin == pytest.approx(low, rel=1e-6)


def test_bandwidths_by_definition():
    loop = delayed_lag(0.05)
    w = np.linspace(1e-3, np.pi / 0.05, 400_001)
    L = loop.response(w)
    S, T = np.abs(1 / (1 + L)), np.abs(L / (1 + L))
    m = loop_margins(loop)
    assert m.sensitivity_bandwidth == pytest.approx(w[np.argmax(S > 0.5**0.5)], rel=1e-3)
    assert m.tracking_bandwidth == pytest.approx(w[np.argmax(T < 0.5**0.5)], rel=1e-3)
    tried, least = np.linspace(0.1, 3.0, 3000), np.minimum.accumulate(0.5**0.5 * w / S)
    allowed = tried[tried <= least[np.searchsorted(w, tried, "right") - 1]]  # S <= w / (sqrt(2) f) up to f
    assert m.bandwidth == pytest.approx(allowed.max(), rel=2e-3)
    assert m.sensitivity_peak == pytest.approx(S.max(), rel=1e-5)


def test_flat_sensitivity_buys_no_bandwidth():
    """|S| held flat just below 0.7071 raises the plain -3 dB frequency threefold, not the slope-limited one."""
    w = np.linspace(0.001, 10.0, 20_001)
    honest = np.minimum(0.7071067 * w, 1.0)
    flat = np.where(w < 3.0, np.minimum(0.7071067 * w, 0.70), 1.0)
    assert slope_bandwidth(w, honest) == pytest.approx(1.0, rel=1e-3)
    assert w[np.argmax(flat > 0.7072)] == pytest.approx(3.0, rel=1e-3)
    assert slope_bandwidth(w, flat) == pytest.approx(1.0, rel=2e-2)


def test_python_control_agrees():
    pytest.importorskip("control.statesp")  # a folder of tests is named control, too
    control = pytest.importorskip("control")
    loop = delayed_lag(0.05)
    theirs = control.ss(loop.A, loop.B[:, None], loop.C[None, :], loop.D, loop.sample_time)
    gm, pm, *_ = control.margin(theirs)
    m = loop_margins(loop)
    assert m.gain_margin == pytest.approx(gm, rel=1e-3)
    assert np.degrees(m.phase_margin) == pytest.approx(pm, rel=1e-3)


def test_says_what_it_found():
    text = str(loop_margins(integrator(0.5)))
    assert text.startswith("stable: GM 12.04 dB")
    assert str(loop_margins(integrator(2.5))).startswith("UNSTABLE")
