"""Appendix B: every number of the table drive, in the units of the source, from its printed data."""

import numpy as np
import pytest
from weldbead_inside import CONTACT_STIFFNESS

from sdpgrind import units
from sdpgrind.weldbead import force

KRPM = 1000 * 2 * np.pi / 60  # rad/s
IN_LB = 4.4482216152605 * 25.4  # N mm
SERVO = force.ServoTable()


def test_inertia_as_printed():
    assert 4.06e-5 * 1000 * 2 * np.pi / 60 == pytest.approx(4.2516e-3, rel=1e-4)
    assert SERVO.motor_inertia * KRPM / IN_LB == pytest.approx(4.25e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("got", "expected"),
    [
        (SERVO.motor_numerator / KRPM, 9.4902e5),
        (SERVO.motor_denominator[1], 7792.6),
        (SERVO.motor_denominator[2], 4.1961e6),
        (SERVO.motor_poles[0], -581.9),
        (SERVO.motor_poles[1], -7210.7),
        (SERVO.motor_gain / KRPM, 0.22617),
        (SERVO.motor_time_constant, 1.9060e-3),
        (1 / SERVO.emf_constant / KRPM, 0.23256),
        (SERVO.speed_feedback * KRPM / IN_LB, 33.179),
        (SERVO.speed_gain / KRPM, 0.40076),
        (SERVO.amplifier_of(units.hz(510.0), 0.5)[0], 1312.8),
        (SERVO.amplifier_of(units.hz(510.0), 0.5)[1], 5460.8),
        (SERVO.dc_gain, 0.60652),
        (6e5 / 85**2, 83.04),
        (CONTACT_STIFFNESS, 75.92),
    ],
)
def test_numbers(got, expected):
    assert got == pytest.approx(expected, rel=1e-4)


def test_torque_and_emf_constants_are_one_in_si():
    torque, emf = SERVO.torque_constant / 1000, SERVO.emf_constant  # N m/A, V s/rad
    assert torque == pytest.approx(0.04101, rel=2e-4)
    assert emf == pytest.approx(0.04106, rel=2e-4)
    assert torque == pytest.approx(emf, rel=2e-3)


def test_poles_of_the_table():
    poles = force.table_drive("appendix-b").poles / (2 * np.pi)
    assert poles[0] == pytest.approx(-9.042, rel=1e-3)
    assert abs(poles[1]) == pytest.approx(312.9, rel=1e-3)
    assert -poles[1].real / abs(poles[1]) == pytest.approx(0.4663, rel=1e-3)


def test_transfer_function_as_block_diagram_algebra_in_inches_and_krpm():
    """A second way: the closed form of the source with its own units, coefficients corrected."""
    J2, B2, KT, K3, DT, R53, DL, p = 9.313e-3, 0.063, 0.363, 36.7, 3.09, 0.806, 41.878, 5.0
    pa, za, c = 1100.0, 5000.0, 1000 / (60 * 5.0)
    a, b = DT * R53 * K3 * KT, c * KT * K3 * pa / J2
    low = [1.0, pa + B2 / J2 + a * pa / (J2 * za), pa * (B2 + a) / J2 + DL * b / za, DL * b]
    top = [b / za, b]
    ours = force.table_drive("appendix-b").transfer
    assert p == 5.0
    assert ours.den == pytest.approx(np.array(low), rel=1e-10)
    assert ours.num == pytest.approx(DL * np.array(top), rel=1e-10)  # mm/mm instead of in/V
    assert top[1] / low[3] == pytest.approx(0.023879, rel=1e-4)


def test_two_poles_that_stand_for_the_drive():
    b1, b2 = force.table_drive("appendix-b").reduced
    assert b1 / (2 * np.pi) == pytest.approx(9.1, rel=5e-3)
    assert b2 / (2 * np.pi) == pytest.approx(549, rel=5e-3)
    assert np.array(force.table_drive().reduced) / (2 * np.pi) == pytest.approx([9.0, 40.0])
    third, design = force.table_drive("appendix-b"), force.table_drive()
    at = np.array([units.hz(30.0)])
    lag = np.degrees(np.angle(third.response(at)) - np.angle(design.response(at)))
    assert lag == pytest.approx(34, abs=1)


def test_friction_as_force_error():
    drive = force.table_drive("appendix-b")
    assert drive.stuck_band == pytest.approx(7.65e-3, rel=1e-3)  # mm
    assert drive.stuck_band * 83.04 == pytest.approx(0.64, abs=0.01)  # N
    # N at the screw
    assert SERVO.friction_torque / IN_LB * 2 * np.pi * 5 * 4.4482 == pytest.approx(23.5, abs=0.05)


def test_lag_of_a_slow_command():
    for name in ("design", "appendix-b"):
        drive, w = force.table_drive(name), np.array([1e-3])
        assert drive.lag_time == pytest.approx(float(-np.angle(drive.response(w)[0]) / w[0]), rel=1e-5)
    plant = force.ForcePlant()
    assert plant.lag == pytest.approx(1 / units.hz(9.0) + 1 / units.hz(40.0) + 1.5 / 60, rel=1e-9)
    assert plant.lag == pytest.approx(0.047, abs=5e-4)


@pytest.mark.parametrize("name", ["design", "appendix-b"])
def test_matrices_are_the_transfer_function(name):
    drive = force.table_drive(name)
    A, command, _ = drive.matrices()
    for w in units.hz(np.array([0.1, 9.0, 60.0, 300.0])):
        got = np.linalg.solve(1j * w * np.eye(3) - A, command)[0]
        assert got == pytest.approx(drive.response(np.array([w]))[0], rel=1e-9)


def test_kept_in_files():
    from sdpgrind.base.stored import decode, encode

    for thing in (
        SERVO,
        force.table_drive("appendix-b"),
        force.SensorChain(),
        force.ForcePlant(),
        force.DesignLimits(),
    ):
        assert decode(encode(thing)) == thing
