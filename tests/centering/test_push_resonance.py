import math

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

from centering import TipProfile, preset, simulate_push
from centering.push import Part, implied_stiffness, resonance_over_speed, stiction_resonance

PRINTED, IDENTIFIED = preset("printed").model, preset("identified").model


def _constant(model, per_minute, duration=0.2):
    return simulate_push(model, TipProfile.constant_speed(per_minute / 60.0, duration))


def _recorded(force, step=1e-3):
    time = step * np.arange(np.size(force))
    return xr.Dataset({"contact_force": ("time", force)}, {"time": ("time", time)})


@pytest.mark.parametrize(("model", "line"), [(PRINTED, 39.8), (IDENTIFIED, 30.7)])
def test_resonances_of_the_specification(model, line):
    found = stiction_resonance(_constant(model, 600.0))
    assert abs(found.line - line) < 0.3
    assert abs(found.spacing - line) < 0.3


def test_resonance_is_that_of_part_and_contact_while_they_touch():
    """The damped frequency of the slip phase; the short sticking in each period takes 0.3 Hz."""
    damped = math.sqrt(PRINTED.contact_stiffness / PRINTED.inertia - (1.1 / (2 * PRINTED.inertia)) ** 2) / (
        2 * math.pi
    )
    found = stiction_resonance(_constant(PRINTED, 300.0))
    assert "free" not in _constant(PRINTED, 300.0).event_mode
    assert abs(found.line - damped) < 0.4 and abs(found.spacing - damped) < 0.4


@pytest.mark.parametrize(("model", "ends"), [(PRINTED, (40.0, 29.0)), (IDENTIFIED, (31.0, 24.0))])
def test_resonance_falls_once_the_part_bounces(model, ends):
    found = resonance_over_speed(model, np.array([300.0, 1000.0, 1500.0, 2000.0]) / 60.0)
    spacing = [each.spacing for each in found]
    assert all(np.diff(spacing) < 0.0)
    assert abs(spacing[0] - ends[0]) < 0.5
    # bounces decay: each window has its own mean
    assert ends[1] - 3.0 < min(found[-1].line, spacing[-1]) < ends[1] + 3.0


def test_identified_part_sticks_long_when_pushed_slowly():
    found = stiction_resonance(_constant(IDENTIFIED, 100.0))
    assert abs(found.line - 19.0) < 0.5 and abs(found.spacing - 19.0) < 0.5


def test_peaks_of_the_force_are_the_breakaways():
    """Events of the simulator say when the part breaks away: that is where the force is greatest."""
    trace = _constant(IDENTIFIED, 100.0)
    off = trace.event_time[[mode == "slip" for mode in trace.event_mode]]
    found = stiction_resonance(trace)
    assert found.peaks == off.size
    assert math.isclose(found.spacing, (off.size - 1) / (off[-1] - off[0]), rel_tol=1e-3)


def test_first_flight_lasts_as_long_as_friction_takes():
    """The flight that lengthens a period: about 2 (v_0 - v)/(mu_k g), exactly with the viscous share."""
    trace = _constant(PRINTED, 2000.0)
    k, tip = trace.event_mode.index("free"), 2000.0 / 60.0
    flight, v, gap = trace.phases[k + 1, 0] - trace.phases[k, 0], trace.phases[k, 6], trace.phases[k, 5]
    final, rate = (
        PRINTED.coulomb_force / PRINTED.viscous_coefficient,
        PRINTED.viscous_coefficient / PRINTED.inertia,
    )

    def ahead(t):
        return (v + final) * -math.expm1(-rate * t) / rate - (final + tip) * t - gap

    assert math.isclose(flight, brentq(ahead, 0.01, 0.1, xtol=1e-12), rel_tol=1e-8)
    assert math.isclose(flight, 2.0 * (v - tip) / (PRINTED.coulomb_force / PRINTED.inertia), rel_tol=0.2)


def test_pure_tones_are_found_between_the_raw_lines():
    """A line of 37.3 Hz in a record whose raw lines are 5 Hz apart; neighbours leak by less than 0.2 Hz."""
    time = 1e-4 * np.arange(2000)
    found = stiction_resonance(_recorded(30.0 + 5.0 * np.sin(2 * math.pi * 37.3 * time), 1e-4))
    assert abs(found.line - 37.3) < 0.2
    assert abs(found.spacing - 37.3) < 0.2 and found.peaks == 8


def test_drift_of_the_force_is_no_line():
    """Ten times the tone, at 1.5 Hz: below the search range, it leaks by 10 % of the tone."""
    time = 1e-3 * np.arange(2000)
    force = 30.0 + 50.0 * np.sin(2 * math.pi * 1.5 * time) + 5.0 * np.sin(2 * math.pi * 37.3 * time)
    assert abs(stiction_resonance(_recorded(force)).line - 37.3) < 0.05


def test_datasets_of_a_trace_give_the_same():
    trace = _constant(PRINTED, 600.0)
    sampled = stiction_resonance(trace.at(np.linspace(0.0, 0.2, 1001)))
    whole = stiction_resonance(trace)
    assert abs(sampled.line - whole.line) < 0.02 and abs(sampled.spacing - whole.spacing) < 0.02


def test_stiffness_gives_the_frequency_back():
    light = PRINTED.replace(part=Part(0.8, 30.0))
    damping = light.contact_damping + light.viscous_coefficient
    damped = math.sqrt(light.contact_stiffness / light.inertia - (damping / (2 * light.inertia)) ** 2) / (
        2 * math.pi
    )
    assert abs(damped - 162.0) < 1.0
    assert math.isclose(
        implied_stiffness(damped, mass=0.8, damping=damping), light.contact_stiffness, rel_tol=1e-12
    )
    undamped = math.sqrt(1200.0 / 8e-4) / (2 * math.pi)
    assert abs(undamped - 195.0) < 0.1 and math.isclose(
        implied_stiffness(undamped, mass=0.8), 1200.0, rel_tol=1e-12
    )


def test_force_without_peaks_has_no_spacing():
    found = stiction_resonance(_recorded(np.linspace(0.0, 1.0, 400) ** 2))
    assert math.isnan(found.spacing) and found.peaks == 0


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (_recorded(np.ones(100)), r"contact_force must be changing \(N\); got 1.0"),
        (_recorded(np.arange(8.0)), "time and contact_force must be of one length >= 16"),
        (_recorded(np.array([*np.ones(50), np.nan])), r"contact_force\[50\] must be finite \(N\); got nan"),
        (
            _recorded(np.arange(64.0) ** 2).assign_coords(time=np.arange(64.0) ** 2),
            "time must be evenly spaced and increasing",
        ),
    ],
)
def test_bad_records(data, told):
    with pytest.raises(ValueError, match=told):
        stiction_resonance(data)


def test_bad_arguments():
    with pytest.raises(TypeError, match="trace must be a Dataset or a PushTrace; got 3"):
        stiction_resonance(3)
    with pytest.raises(ValueError, match=r"frequency must be > 0 \(Hz\)"):
        implied_stiffness(0.0, mass=1.0)
    with pytest.raises(ValueError, match=r"mass must be > 0 \(kg\)"):
        implied_stiffness(30.0, mass=-1.0)
    with pytest.raises(ValueError, match=r"damping must be >= 0 \(N s/mm\)"):
        implied_stiffness(30.0, mass=1.0, damping=-0.1)
    with pytest.raises(ValueError, match=r"speed must be > 0 \(mm/s\)"):
        resonance_over_speed(PRINTED, [0.0])
