"""Laws of physics: against energy balance, a root finder and the inch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import constants
from scipy.optimize import brentq, minimize_scalar

from sdpgrind import physics


def test_power_of_a_droopy_disc():
    torque = physics.disk_torque(50.0, 0.3, 85.0)
    assert torque == pytest.approx(1275.0)
    assert physics.disk_speed(torque, 560.0, 0.1) == pytest.approx(432.5)
    assert physics.disk_power(torque, 560.0, 0.1) == pytest.approx(1.275 * 432.5)  # N m * rad/s
    assert physics.removal_rate(537.5 + 100, 10.0, 100.0) == pytest.approx(53.75)


def test_peak_torque_is_the_maximum():
    found = minimize_scalar(
        lambda t: -physics.disk_power(t, 560.0, 0.1),
        bounds=(0, 5600),
        method="bounded",
        options={"xatol": 1e-8},
    )
    assert physics.peak_torque(560.0, 0.1) == pytest.approx(found.x, rel=1e-6)


@given(share=st.floats(0.0, 1.0), droop=st.floats(1e-12, 1.0))
def test_torque_of_power_is_the_smaller_root(share, droop):
    peak = physics.peak_torque(500.0, droop)
    torque = share * peak
    power = physics.disk_power(torque, 500.0, droop)
    # Near the peak the power is flat: an error e of it moves the root by sqrt(e).
    power = min(power, physics.disk_power(peak, 500.0, droop) * (1 - 1e-15))
    found = physics.torque_of_power(power, 500.0, droop)
    assert found <= peak * (1 + 1e-12)
    assert physics.disk_power(found, 500.0, droop) == pytest.approx(power, rel=1e-12, abs=1e-12)
    if share < 0.9:
        assert found == pytest.approx(torque, rel=1e-12, abs=1e-300)


def test_malkin_in_inches_and_in_millimetres():
    # The law in its own units: inch, pound, second.
    depth, diameter, feed = 0.02, 7.0, 0.4
    energy = 9.0e5 * depth + 4.1e4 * (diameter * depth) ** 0.25 / feed**0.5  # in lb / in^2
    metric = energy * constants.inch * constants.lbf / (constants.inch * 1e3) ** 2
    u0, B = physics.malkin_burn_coefficients()
    got = physics.malkin_burn_energy(depth * 25.4, feed * 25.4, diameter * 25.4, u0, B)
    assert got == pytest.approx(metric, rel=1e-12)
    assert (u0, B) == (pytest.approx(6.2053, rel=1e-5), pytest.approx(7.1802, rel=1e-5))
    assert u0 == pytest.approx(0.45 * 13.8, rel=1e-3)  # the 45 % that leave with the chips


def test_arrays_broadcast():
    power = physics.disk_power(np.array([[0.0], [1000.0]]), np.array([400.0, 500.0]), 0.0)
    np.testing.assert_allclose(power, [[0.0, 0.0], [400.0, 500.0]])


def test_root_without_cancellation():
    torque = 1e-7
    power = physics.disk_power(torque, 500.0, 0.1)
    expected = brentq(
        lambda t: physics.disk_power(t, 500.0, 0.1) / power - 1, 0, 1e-6, xtol=1e-22, rtol=1e-15
    )
    assert physics.torque_of_power(power, 500.0, 0.1) == pytest.approx(expected, rel=1e-12)
