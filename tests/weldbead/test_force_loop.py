"""The sampled loop: PI by Tustin, margins of section 7.3, the exact runout response, and the simulated loop
against both.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from weldbead_inside import parametrised, plant_sample

from sdpgrind import units
from sdpgrind.control import Law, Sampled
from sdpgrind.weldbead import force
from sdpgrind.weldbead.force.kernels import sensor_read

PLAIN = force.SensorChain(analogue_cutoff=None, inner_rate=None, noise_sd=0.0, quantum=0.0)
FULL = force.SensorChain(noise_sd=0.0, quantum=0.0)


def loop(hertz, sensor=PLAIN, **options):
    return force.PI.design(crossover=units.hz(hertz), sensor=sensor, **options)


def step_plant(plant, commands, touch):
    """Forces (N) in each sub-step and readings (N) before each sample, for commands (mm) without any
    feedback.
    """
    step = plant.sample_time / touch.shape[1]
    drive_core, sensor_core = plant.drive.core(step), plant.sensor.core(step)
    drive, sensor = plant.drive.start(0.0), plant.sensor.start()
    forces, readings = np.empty_like(touch), np.empty(len(commands))
    for k, command in enumerate(commands):
        readings[k] = sensor_read(sensor, sensor_core, 0.0)
        plant_sample(
            command, drive, sensor, drive_core, sensor_core, touch[k], plant.contact_stiffness, forces[k]
        )
    return forces, readings


def plan_of(forces, stiffness, step=0.002):
    """A plan over a stiff contact at height 0: the platform at F/K_x makes F."""

    class Plan:
        time = step * np.arange(len(forces))
        normal_force = np.asarray(forces, dtype=float)
        fly_height = -normal_force / stiffness

    return Plan()


def test_margins_of_the_source():
    m = force.margins(loop(3.0), delay_samples=1)
    assert m.gain_margin_db == pytest.approx(7.93, abs=0.08)
    assert np.degrees(m.phase_margin) == pytest.approx(51.4, rel=0.01)
    assert m.sensitivity_peak == pytest.approx(1.88, rel=0.01)
    assert m.tracking_bandwidth == pytest.approx(units.hz(6.75), rel=0.01)
    assert m.sensitivity_bandwidth == pytest.approx(units.hz(1.96), rel=0.01)
    slow = force.margins(loop(0.2))
    assert slow.gain_margin_db == pytest.approx(31.4, rel=0.01)
    assert slow.tracking_bandwidth == pytest.approx(units.hz(0.21), rel=0.02)


def test_margins_with_the_analogue_filter():
    m = force.margins(loop(3.0, PLAIN.replace(analogue_cutoff=units.hz(120.0))))
    assert m.gain_margin_db == pytest.approx(7.2, abs=0.05)
    assert np.degrees(m.phase_margin) == pytest.approx(48.5, abs=0.3)


def test_margins_a_second_way():
    """Plant by partial fractions of held poles, law by Tustin in the frequency domain: nothing of the
    library.
    """
    b1, b2, wc, T = 2 * np.pi * 9, 2 * np.pi * 40, 2 * np.pi * 30, 1 / 60
    poles = np.array([-b1, -b2, wc * np.exp(0.75j * np.pi), wc * np.exp(-0.75j * np.pi)])
    top = b1 * b2 * wc**2
    residues = [top / (p * np.prod([p - q for q in poles if q != p])) for p in poles]
    ki = 2 * np.pi * 3.0

    def response(w):
        z = np.exp(1j * w * T)
        held = 1 + sum(r * (z - 1) / (z - np.exp(p * T)) for r, p in zip(residues, poles, strict=True))
        s = 2 / T * (z - 1) / (z + 1)
        return (ki / b1 + ki / s) * held / z

    crossing = brentq(lambda w: response(w).imag, 20.0, 60.0)
    m = force.margins(loop(3.0))
    assert m.gain_margin == pytest.approx(-1 / response(crossing).real, rel=1e-6)
    unit = brentq(lambda w: abs(response(w)) - 1, 5.0, 60.0)
    assert m.phase_margin == pytest.approx(abs(np.angle(-response(unit))), rel=1e-6)
    w = np.linspace(0.1, np.pi / T, 4000)
    assert m.sensitivity_peak == pytest.approx(np.max(np.abs(1 / (1 + response(w)))), rel=1e-4)


@settings(deadline=None, max_examples=15)
@given(st.floats(0.2, 4.0), st.integers(0, 2))
def test_designs_below_six_decibels_are_seen(hertz, delay):
    made = loop(hertz, delay_samples=delay)
    worst = np.max(np.abs(made.open.closed().poles))
    assert force.margins(made).stable
    assert worst < 1


@pytest.mark.parametrize("sensor", [PLAIN, FULL], ids=["plain", "full"])
@pytest.mark.parametrize("name", ["design", "appendix-b-linear"])
def test_sampled_model_is_the_simulated_plant(sensor, name):
    """Readings of the compiled sub-steps for random commands, against the exact sampled model."""
    plant = force.ForcePlant(drive=force.table_drive(name), sensor=sensor, delay_samples=0)
    commands = 1.0 + 0.1 * np.random.default_rng(0).normal(size=60)
    forces, readings = step_plant(plant, commands, np.full((60, 480), 0.0))
    expected = plant.sampled.run(commands)
    assert readings == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    coarse = step_plant(plant, commands, np.full((60, 48), 0.0))[1]
    assert np.abs(readings - expected).max() < np.abs(coarse - expected).max() / 20  # second order
    assert forces.min() >= 0


def test_delay_is_on_the_command():
    fast, slow = force.ForcePlant(delay_samples=0), force.ForcePlant(delay_samples=2)
    u = np.random.default_rng(1).normal(size=30)
    assert slow.sampled.run(u)[2:] == pytest.approx(fast.sampled.run(u)[:-2], abs=1e-10)


def runout_of(made, hertz, size=0.05):
    """Amplitude at the alias of the force that the loop makes, per runout force, from a simulation over 20 s."""
    plan = plan_of(np.full(12_000, 45.0), made.plant.contact_stiffness)
    controller = force.ForceController(plan, made)
    spin = units.hz(hertz)
    record = force.simulate_loop(controller, duration=20.0, surface=lambda t: size * np.sin(spin * t))
    kept = record.time > 10.0
    assert record.force[0].min() > 0
    seen = float(made.plant.sensor.alias(spin))
    t = record.time[kept]
    basis = np.column_stack([np.sin(seen * t), np.cos(seen * t), np.ones_like(t)])
    a, b, _ = np.linalg.lstsq(basis, record.force[0, kept], rcond=None)[0]
    return np.hypot(a, b) / (size * made.plant.contact_stiffness)


def test_runout_at_fifty_hertz_comes_back_at_ten():
    made = loop(3.0)
    assert float(force.runout_response(made, units.hz(50.0))) == pytest.approx(0.111, rel=0.01)
    assert runout_of(made, 50.0) == pytest.approx(0.111, rel=0.02)


@pytest.mark.parametrize("hertz", [42.0, 50.0, 58.0])
def test_runout_response_is_exact(hertz):
    made = loop(3.0, FULL)
    assert runout_of(made, hertz) == pytest.approx(
        float(force.runout_response(made, units.hz(hertz))), rel=0.01
    )


def test_a_filter_ratio_is_not_the_runout_response():
    """|T| at the alias times the ratio of the filters is off by several per cent: not the way to get it."""
    made = loop(3.0)
    spin = units.hz(np.linspace(31.0, 50.0, 20))
    seen = made.plant.sensor.alias(spin)
    L = made.open.response(seen)
    sensor = made.plant.sensor
    cheap = np.abs(L / (1 + L)) * np.abs(sensor.response(spin) / sensor.response(seen))
    off = np.abs(cheap / force.runout_response(made, spin) - 1)
    assert off.max() > 0.1


@settings(deadline=None, max_examples=50)
@given(st.floats(-20, 20), st.integers(1, 30))
def test_law_of_the_source(error, samples):
    """xi' = xi + e, u = K_I T xi + (K_p + K_I T/2) e: a constant error ramps."""
    law = force.PI(kp=0.01, ki=0.3, sample_time=1 / 60).law
    u = law.simulate(np.full(samples, error))
    k = np.arange(samples)
    assert u == pytest.approx(error * (0.3 / 60 * (k + 0.5) + 0.01), abs=1e-9)


def test_law_is_tustins():
    law, w = force.PI(kp=0.01, ki=0.3).law.system, np.array([0.3, 10.0, 100.0])
    z = np.exp(1j * w / 60)
    s = 120 * (z - 1) / (z + 1)
    assert law.response(w) == pytest.approx(0.01 + 0.3 / s, rel=1e-10)


def test_parametrised_is_control_times_sensitivity():
    made, w = loop(3.0), np.array([1.0, 20.0, 100.0])
    C, P = made.law.system.response(w), made.plant.sampled.response(w)
    assert parametrised(made).response(w) == pytest.approx(C / (1 + C * P), rel=1e-9)


def test_brown_hardware_advice_is_no_gain_at_sixty_hertz():
    """A two-pole low-pass in the law costs margin: 11.4 to 6.7 dB at 2 Hz with 10 Hz; 4.7 dB with 6 Hz."""
    from scipy.signal import bilinear, butter

    made = loop(2.0)
    assert force.margins(made).gain_margin_db == pytest.approx(11.4, abs=0.1)
    for hertz, gm in ((10.0, 6.7), (6.0, 4.7)):
        (b0, b1, b2), (_, a1, a2) = bilinear(*butter(2, units.hz(hertz), analog=True), fs=60.0)
        low_pass = Sampled([[-a1, 1], [-a2, 0]], [b1 - a1 * b0, b2 - a2 * b0], [1, 0], b0, 1 / 60)
        both = low_pass.then(made.law.system)
        slow = force.ForceLoop(Law(both, np.zeros(3)), made.plant)
        assert force.margins(slow).gain_margin_db == pytest.approx(gm, abs=0.25)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda: loop(12.0),
            ValueError,
            r"crossover must be lower \(75\.4 rad/s\): law must give a stable loop: .* modulus is 1\.",
        ),
        (lambda: loop(3.0, delay_samples=-1), ValueError, "delay_samples must be >= 0; got -1"),
        (lambda: loop(3.0, delay_samples=1.5), TypeError, r"delay_samples must be a whole number; got 1\.5"),
        (
            lambda: force.margins(loop(3.0), delay_samples=-2),
            ValueError,
            "delay_samples must be >= 0; got -2",
        ),
        (
            lambda: force.margins(loop(3.0), delay_samples=9),
            ValueError,
            "stable loop: poles inside the unit circle",
        ),
        (lambda: loop(-1.0), ValueError, r"crossover must be > 0 \(rad/s\); got -6\.28"),
        (
            lambda: force.PI(kp=1e-3, ki=0.1, sample_time=1 / 100).loop(),
            ValueError,
            r"sample_time must be the same in both: 0\.0166667 \(s\); got 0\.01",
        ),
        (lambda: force.margins("loop"), TypeError, "loop must be a ForceLoop, as PI.design gives it"),
        (
            lambda: force.ForcePlant(contact_stiffness=0.0),
            ValueError,
            r"contact_stiffness must be > 0 \(N/mm\); got 0\.0",
        ),
        (lambda: force.ForcePlant(drive="motor"), TypeError, "drive must be a TableDrive"),
        (
            lambda: force.table_drive("x"),
            ValueError,
            "name must be one of design, appendix-b, appendix-b-linear; got 'x'",
        ),
        (lambda: force.PI(kp=-1.0, ki=1.0), ValueError, r"kp must be >= 0 \(mm/N\); got -1\.0"),
    ],
)
def test_messages(call, error, message):
    with pytest.raises(error, match=message):
        call()
