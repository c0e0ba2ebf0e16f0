"""Pushes against the numbers that they must give: the source's cases, closed forms, the source's tables."""

from math import atan2, hypot, pi, sqrt

import numpy as np
import pytest

from centering import TipProfile, preset, simulate_push
from centering.push import simulate_pushes
from sdpgrind import units

TABLE = {  # mm/min: peak N and slide µm as modelled by the source, Tables 6.1 and 5.1
    100: (39.81, 0), 200: (41.83, 0), 300: (46.25, 13), 400: (51.00, 36), 500: (56.19, 65), 600: (61.39, 109), 700: (66.65, 140),
    800: (71.87, 184), 900: (76.16, 229), 1000: (79.76, 272), 1200: (86.95, 366), 1500: (118.48, 494), 2000: (123.14, 948),
}  # fmt: skip


def push_at(name, speeds):
    profiles = [TipProfile.constant_speed(units.mm_per_min(v), 0.4) for v in speeds]
    return simulate_pushes(preset(name).model, profiles)


@pytest.mark.parametrize(
    ("name", "peaks", "slides"),
    [
        ("printed", (69.602, 96.640, 164.783), (0.0, 193.83, 859.87)),
        ("identified", (59.791, 79.660, 134.079), (95.24, 267.81, 921.05)),
    ],
)
def test_converged_peaks_and_slides(name, peaks, slides):
    out = push_at(name, (600, 1000, 2000))
    np.testing.assert_allclose(out[:, 2], peaks, atol=6e-4)  # given to three places
    np.testing.assert_allclose(1e3 * out[:, 1], slides, atol=0.006)


@pytest.mark.parametrize(
    ("name", "slide_rms", "peak_rms"), [("identified", 21.5, 5.0), ("printed", 65.0, 15.9)]
)
def test_distance_to_the_tables_of_the_source(name, slide_rms, peak_rms):
    out = push_at(name, TABLE)
    wanted = np.array(list(TABLE.values()))
    assert np.sqrt(np.mean((out[:, 2] - wanted[:, 0]) ** 2)) == pytest.approx(peak_rms, abs=0.05)
    assert np.sqrt(np.mean((1e3 * out[:, 1] - wanted[:, 1]) ** 2)) == pytest.approx(slide_rms, abs=0.5)


def test_worst_distance_to_the_tables_of_the_source():
    out, wanted = push_at("identified", TABLE), np.array(list(TABLE.values()))
    assert np.abs(out[:, 2] - wanted[:, 0]).max() == pytest.approx(12.0, abs=0.5)
    assert np.abs(1e3 * out[:, 1] - wanted[:, 1]).max() == pytest.approx(68.0, abs=0.5)


@pytest.mark.parametrize("mass", [0.5, 0.8, 5.0, 18.9, 70.0])
@pytest.mark.parametrize("speed", [0.5, 5.0, 30.0])
def test_breaks_away_when_the_contact_has_closed(mass, speed):
    model = preset("printed").model.replace(mass=mass)
    trace = simulate_push(model, TipProfile.constant_speed(speed, 0.3))
    k, b = model.contact_stiffness, model.contact_damping
    closed = max(model.breakaway_force / (k * speed) - b / k, 0.0)
    assert trace.breakaway_time == pytest.approx(closed, abs=1e-12)


@pytest.mark.parametrize("mass", [0.8, 18.9, 70.0])
@pytest.mark.parametrize("speed", [1.0, 10.0, 80.0])
def test_peak_without_damping(mass, speed):
    model = preset("printed").model.replace(mass=mass, contact_damping=0.0, viscous_coefficient=0.0)
    peak = simulate_push(model, TipProfile.constant_speed(speed, 0.2)).peak_force
    swing = speed * sqrt(model.contact_stiffness * model.inertia)
    closed = model.coulomb_force + hypot(model.breakaway_force - model.coulomb_force, swing)
    assert peak == pytest.approx(closed, rel=1e-12)


@pytest.mark.parametrize("mass", [0.8, 18.9])
def test_slow_jumps_are_the_quantum_and_what_the_tip_moves_meanwhile(mass):
    model = preset("printed").model.replace(mass=mass, contact_damping=0.0, viscous_coefficient=0.0)
    quantum, slow = model.stick_slip_quantum, 1e-3
    trace = simulate_push(model, TipProfile.constant_speed(slow, 4.5 * quantum / slow + 31.0))
    at_rest = [
        x
        for x, mode in zip(trace.phases[:, 2] - trace.phases[:, 5], trace.event_mode, strict=False)
        if mode == "stick"
    ]
    rate = sqrt(model.contact_stiffness / model.inertia)
    jump = quantum + slow * (pi + 2 * atan2(2 * slow / rate, quantum)) / rate
    assert np.diff(at_rest) == pytest.approx(jump, rel=1e-9)
    assert jump == pytest.approx(quantum, rel=4e-3)


def test_thrown_off_it_slides_by_its_kinetic_energy():
    model = preset("printed").model.replace(viscous_coefficient=0.0)
    trace = simulate_push(model, TipProfile.constant_speed(50.0, 0.4))
    first = next(i for i, mode in enumerate(trace.event_mode) if mode == "free")
    speed = trace.phases[first, 6]
    clear = simulate_push(
        model, TipProfile.constant_speed(50.0, trace.event_time[first]).then(TipProfile.move(-5.0, 1e4, 1e6))
    )
    assert clear.free_slide == pytest.approx(speed**2 / (2 * model.coulomb_force / model.inertia), rel=1e-12)


def test_work_is_that_of_friction_and_motion():
    """The balance by another quadrature than that of the library, of its samples."""
    model = preset("printed").model
    trace = simulate_push(model, TipProfile.move(5.0, 40.0, 2560.0))
    time = np.unique(np.concatenate((np.linspace(0, trace.duration, 200_001), trace.event_time[1:])))
    data = trace.at(time)
    work = np.trapezoid(data.contact_force * data.part_velocity, time)
    lost = model.coulomb_force * trace.final_position
    lost += model.viscous_coefficient * np.trapezoid(data.part_velocity**2, time)
    assert work == pytest.approx(lost, rel=2e-5)  # the force jumps at a few of the samples
    assert trace.energy_balance < 1e-12
