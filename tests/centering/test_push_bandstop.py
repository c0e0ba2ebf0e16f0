import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from centering import TipProfile, preset, simulate_push
from centering.push import Part, band_stop_lag, band_stop_profile

PRINTED, IDENTIFIED = preset("printed").model, preset("identified").model
LIGHT = PRINTED.replace(part=Part(0.8, 30.0))
TEN = 10.0  # mm/s: 600 mm/min
SETTLED = np.linspace(0.05, 0.4, 7001)


def _filtered(model, band, **further):
    return simulate_push(model, band_stop_profile(TEN, 0.4, band=band, **further))


@pytest.mark.parametrize(("low", "lag"), [(25.0, 47.746), (20.0, 79.577), (5.0, 557.04)])
def test_lags_of_the_specification(low, lag):
    assert abs(1e3 * band_stop_lag(TEN, band=(low, 40.0)) - lag) < 0.006


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_lag_is_the_slope_of_the_phase_at_zero(order):
    """The analog filter's own transfer function, evaluated next to frequency 0."""
    band = (25.0, 40.0)
    b, a = signal.butter(order, 2 * math.pi * np.array(band), btype="bandstop", analog=True)
    _, answer = signal.freqs(b, a, worN=[1e-3])
    assert math.isclose(band_stop_lag(1.0, band=band, order=order), -np.angle(answer[0]) / 1e-3, rel_tol=1e-6)


@pytest.mark.parametrize("band", [(25.0, 40.0), (20.0, 40.0), (5.0, 40.0)])
def test_tip_settles_behind_the_unfiltered_one_by_the_lag(band):
    """At 8 kHz the bilinear filter has the analog lag to (pi f/f_s)^2: the printed 1 kHz one is 0.3 % longer."""
    profile = band_stop_profile(TEN, 2.0, band=band, sample_rate=8000.0, allow_reverse=True)
    assert abs(1e3 * (TEN * 2.0 - profile.stroke) - 1e3 * band_stop_lag(TEN, band=band)) < 0.1
    assert math.isclose(profile.final_velocity, TEN, rel_tol=1e-6)


def test_lag_of_the_digital_filter():
    """47.90 um with held samples; straight lines come half a sample of the first gap nearer."""
    profile = band_stop_profile(TEN, 1.0)
    held = float(np.sum(TEN - profile.velocity)) / 1000.0
    assert abs(1e3 * held - 47.90) < 0.01
    assert math.isclose(TEN - profile.stroke, held - (TEN - profile.velocity[0]) / 2000.0, rel_tol=1e-9)


def test_speeds_are_the_filter_s_own_recursion():
    """Direct form by hand, joined by straight lines."""
    profile = band_stop_profile(TEN, 0.06)
    b, a = signal.butter(3, (25.0, 40.0), btype="bandstop", fs=1000.0)
    out = np.zeros(61)
    for n in range(61):
        out[n] = sum(b[j] * TEN for j in range(min(n, 6) + 1)) - sum(
            a[j] * out[n - j] for j in range(1, min(n, 6) + 1)
        )
    assert np.allclose(profile.velocity, out[:-1], atol=1e-9)
    assert np.allclose(
        profile.velocity_at(np.arange(60) / 1000.0 + 5e-4), (out[1:] + out[:-1]) / 2, atol=1e-9
    )


@pytest.mark.parametrize(
    ("model", "low", "reach"),
    [(PRINTED, 25.0, 27.0), (PRINTED, 20.0, 37.0), (IDENTIFIED, 25.0, 33.0), (IDENTIFIED, 20.0, 30.0)],
)
def test_part_keeps_to_its_line(model, low, reach):
    """x - v t after 0.05 s: the source has less than 40 um."""
    ahead = _filtered(model, (low, 40.0)).at(SETTLED).part_position.values - TEN * SETTLED
    assert abs(1e3 * np.ptp(ahead) - reach) < 1.0


@pytest.mark.parametrize(("model", "reach"), [(PRINTED, 57.0), (IDENTIFIED, 91.0)])
def test_fluctuation_at_constant_speed(model, reach):
    data = simulate_push(model, TipProfile.constant_speed(TEN, 0.4)).at(np.linspace(0.0, 0.4, 40001))
    assert abs(1e3 * np.ptp((data.part_position - data.tip_position).values) - reach) < 1.0


def test_printed_part_keeps_contact_with_the_filter():
    for low in (25.0, 20.0):
        trace = _filtered(PRINTED, (low, 40.0))
        assert set(trace.event_mode) == {"stick", "slip"}
        assert trace.at(np.linspace(1e-3, 0.4, 4001)).contact_force.values.min() > 8.0
    assert "free" not in _filtered(PRINTED, (5.0, 40.0), allow_reverse=True).event_mode
    assert "free" in _filtered(IDENTIFIED, (25.0, 40.0)).event_mode  # unlike the source


@pytest.mark.parametrize(("rate", "peak"), [(1000.0, 23.482), (4000.0, 36.169)])
def test_peak_of_a_light_part_is_the_first_sample(rate, peak):
    """2500 mm/min through 10-100 Hz: the peak is the damper's jump, and goes back to b v as the sampling is
    refined.
    """
    profile = band_stop_profile(2500.0 / 60.0, 0.4, band=(10.0, 100.0), sample_rate=rate, allow_reverse=True)
    trace = simulate_push(LIGHT, profile)
    assert abs(trace.peak_force - peak) < 1e-3
    assert math.isclose(trace.peak_force, LIGHT.contact_damping * profile.velocity[0], rel_tol=1e-12)
    assert -0.26 < profile.velocity.min() / (2500.0 / 60.0) < -0.24
    assert math.isclose(
        simulate_push(LIGHT, TipProfile.constant_speed(2500.0 / 60.0, 0.4)).peak_force, 41.667, abs_tol=1e-3
    )


@settings(max_examples=40, deadline=None)
@given(
    st.floats(1.0, 80.0),
    st.floats(0.003, 0.5),
    st.floats(10.0, 60.0),
    st.floats(1.05, 1.6),
    st.integers(1, 4),
)
def test_profiles_scale_with_the_speed_and_last_as_asked(speed, duration, low, ratio, order):
    band = (low, low * ratio)
    profile = band_stop_profile(speed, duration, band=band, order=order, allow_reverse=True)
    assert math.isclose(profile.total_time, duration, rel_tol=1e-9)
    one = band_stop_profile(1.0, duration, band=band, order=order, allow_reverse=True)
    assert np.allclose(profile.segments, one.segments * [1.0, speed, speed], rtol=1e-9, atol=1e-9)
    assert np.allclose(
        profile.velocity[1:], (profile.velocity + profile.acceleration * profile.duration)[:-1], atol=1e-9
    )


@pytest.mark.parametrize("band", [(0.0, 40.0), (40.0, 25.0), (25.0, 25.0), (25.0, 500.0), (-1.0, 40.0)])
def test_bands_that_are_none(band):
    with pytest.raises(
        ValueError, match=r"band must be two frequencies, 0 < f1 < f2 < sample_rate/2 = 500 \(Hz\); got"
    ):
        band_stop_profile(TEN, 0.4, band=band)


@pytest.mark.parametrize("band", [(5.0, 40.0), (10.0, 100.0)])
def test_pusher_does_not_reverse_without_leave(band):
    with pytest.raises(
        ValueError, match=r"band must be such that the filtered speed is never negative.* got \("
    ):
        band_stop_profile(TEN, 0.4, band=band)
    assert band_stop_profile(TEN, 0.4, band=band, allow_reverse=True).velocity.min() < 0.0


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"speed": 0.0}, r"speed must be > 0 \(mm/s\); got 0.0"),
        ({"duration": -1.0}, r"duration must be > 0 \(s\); got -1.0"),
        ({"sample_rate": math.nan}, r"sample_rate must be finite \(1/s\); got nan"),
        ({"order": 0}, "order must be >= 1; got 0"),
        ({"band": (25.0, math.inf)}, r"band\[1\] must be finite \(Hz\); got inf"),
        ({"band": (25.0, 40.0, 50.0)}, "band must be two frequencies"),
    ],
)
def test_bad_input(change, told):
    with pytest.raises(ValueError, match=told):
        band_stop_profile(**({"speed": TEN, "duration": 0.4} | change))


def test_bad_lags():
    with pytest.raises(ValueError, match=r"band must be two frequencies, 0 < f1 < f2 \(Hz\)"):
        band_stop_lag(TEN, band=(40.0, 25.0))
    with pytest.raises(ValueError, match="order must be >= 1"):
        band_stop_lag(TEN, order=0)
