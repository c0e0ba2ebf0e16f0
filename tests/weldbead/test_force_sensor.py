"""The sensor: frequency response, honest aliasing, quantum, and the compiled chain against both."""

import numpy as np
import pytest
import scipy.signal

from sdpgrind import units
from sdpgrind.weldbead import force
from sdpgrind.weldbead.force.kernels import sensor_read, sensor_step

QUIET = force.SensorChain(noise_sd=0.0, quantum=0.0)
SUB = 48


def readings(chain, signal, samples):
    """What the chain shows at each sample of 60 Hz for a force as a function of time."""
    step = chain.sample_time / SUB
    core, state, out = chain.core(step), chain.start(), []
    for k in range(samples * SUB):
        sensor_step(state, signal((k + 1) * step), core)
        if (k + 1) % SUB == 0:
            out.append(sensor_read(state, core, 0.0))
    return np.array(out)


def db(chain, hertz):
    return 20 * np.log10(abs(complex(chain.response(units.hz(hertz)))))


def test_thirty_hertz_is_no_anti_alias_filter():
    analogue = force.SensorChain(analogue_cutoff=None, inner_rate=None)
    digital = force.SensorChain(analogue_cutoff=None)
    assert [db(analogue, f) for f in (50.0, 58.0)] == pytest.approx([-9.4, -11.8], abs=0.05)
    assert [db(digital, f) for f in (50.0, 58.0)] == pytest.approx([-9.8, -12.4], abs=0.05)
    assert db(QUIET, 0.0) == pytest.approx(0.0, abs=1e-9)


def test_where_the_spin_appears():
    for hertz, seen in ((50, 10), (58, 2), (60, 0), (30, 30), (20, 20), (70, 10), (110, 10)):
        assert float(QUIET.alias(units.hz(float(hertz)))) == pytest.approx(units.hz(float(seen)), abs=1e-9)


@pytest.mark.parametrize(
    "chain", [QUIET, QUIET.replace(analogue_cutoff=None), QUIET.replace(inner_rate=None)]
)
@pytest.mark.parametrize("hertz", [3.0, 22.0, 50.0, 58.0])
def test_compiled_chain_has_the_exact_response_at_the_alias(chain, hertz):
    samples = 240
    got = readings(chain, lambda t: np.sin(units.hz(hertz) * t), samples)[60:]
    t = (1 + np.arange(samples))[60:] / 60
    basis = np.column_stack([np.sin(units.hz(hertz) * t), np.cos(units.hz(hertz) * t)])
    a, b = np.linalg.lstsq(basis, got, rcond=None)[0]
    assert got == pytest.approx(basis @ [a, b], abs=1e-6)  # nothing else is in it
    seen = abs(((hertz + 30) % 60) - 30)
    slow = np.column_stack([np.sin(units.hz(seen) * t), np.cos(units.hz(seen) * t)])
    assert got == pytest.approx(slow @ np.linalg.lstsq(slow, got, rcond=None)[0], abs=1e-6)
    exact = complex(chain.response(units.hz(hertz)))
    assert a + 1j * b == pytest.approx(exact, abs=4e-3)  # the force is a straight line in each sub-step
    assert abs(exact) > 0.1


def test_digital_filter_is_scipys():
    chain = QUIET.replace(analogue_cutoff=None)
    rng = np.random.default_rng(1)
    force_in = rng.normal(size=8 * 30)
    b, a = scipy.signal.butter(2, 30.0, fs=480.0)
    expected = scipy.signal.lfilter(b, a, force_in)[7::8]
    got = readings(chain, lambda t: force_in[min(int(t * 480 - 1e-6), len(force_in) - 1)], 30)
    assert got == pytest.approx(expected, abs=1e-12)


def test_quantum_and_noise():
    chain = force.SensorChain(noise_sd=0.0, quantum=0.1)
    got = readings(chain, lambda t: 12.345, 60)
    assert got[-1] == pytest.approx(12.3, abs=1e-9)
    core, state = QUIET.core(1 / 2880), QUIET.start()
    assert sensor_read(state, core, 0.37) == 0.37


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: force.SensorChain(cutoff=-1.0), r"cutoff must be > 0 \(rad/s\); got -1\.0"),
        (lambda: force.SensorChain(noise_sd=-0.1), r"noise_sd must be >= 0 \(N\); got -0\.1"),
        (
            lambda: force.SensorChain(inner_rate=1),
            r"cutoff must be < 188\.496, half the rate inside the sensor \(rad/s\)",
        ),
        (lambda: QUIET.core(1 / 2900), r"step must be a whole part of 0\.00208333 \(s\)"),
    ],
)
def test_messages(call, message):
    with pytest.raises(ValueError, match=message):
        call()
