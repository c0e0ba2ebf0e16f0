import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from centering import preset
from centering.push import (
    contact_stiffness,
    energy_balance_speed,
    free_slide,
    mass_ratio,
    restitution,
    sliding_speed,
)
from sdpgrind import units

PROBLEM = preset("printed")
MODEL = PROBLEM.model
# Table 3.1
DISTANCE, FORCE = [0.010, 0.015, 0.020, 0.025, 0.030, 0.035], [10.7, 16.0, 22.4, 31.0, 37.4, 40.6]
HIT = {"slide_before": 139.0, "slide_after": 104.0, "part_after": 222.0}  # (3.13)


def test_stiffness_of_table_3_1():
    assert math.isclose(contact_stiffness(DISTANCE, FORCE) / 1000, 1.15056, abs_tol=1e-4)
    assert math.isclose(
        contact_stiffness(DISTANCE, FORCE, method="least_squares") / 1000, 1.1836, abs_tol=1e-4
    )


def test_restitution_and_masses_of_3_13():
    assert math.isclose(restitution(**HIT), 0.84892, abs_tol=1e-4)
    assert math.isclose(mass_ratio(**HIT), 0.158, abs_tol=5e-4)
    m = mass_ratio(**HIT)
    assert math.isclose(139.0, 104.0 + m * 222.0, rel_tol=1e-14)


def test_speed_for_100_um_is_not_the_printed_one():
    assert math.isclose(energy_balance_speed(PROBLEM, 0.1), units.mm_per_min(556), rel_tol=1e-3)
    far = (units.mm_per_min(3700) * 1.85) ** 2 / (2 * 0.15 * 9807)
    assert math.isclose(far, 4.4, rel_tol=0.01)


@pytest.mark.parametrize(("speed", "um"), [(500, 81), (1000, 323), (2000, 1293)])
def test_inverse_energy_balance_of_the_limit_cycles(speed, um):
    d = units.um(float(um))
    assert math.isclose(energy_balance_speed(PROBLEM, d), units.mm_per_min(float(speed)), rel_tol=5e-3)


def test_speed_is_clipped_and_a_free_slide_must_be_faster():
    assert energy_balance_speed(PROBLEM, 100.0) == PROBLEM.limits.push_speed_max
    driven, free = energy_balance_speed(PROBLEM, 0.1), energy_balance_speed(PROBLEM, 0.1, slide_mass=2 * 18.9)
    assert math.isclose(free, 1.5 * driven, rel_tol=1e-14)


@pytest.mark.parametrize("viscous", [0.0, 1e-9, 0.1, 2.0])
@pytest.mark.parametrize("speed", [0.5, 40.0, 300.0])
def test_free_slide_is_that_of_the_equation_of_motion(viscous, speed):
    model = MODEL.replace(viscous_coefficient=viscous)

    def motion(_, y):
        return [y[1], -(model.coulomb_force + viscous * y[1]) / model.inertia]

    def rests(_, y):
        return y[1]

    rests.terminal = True
    run = solve_ivp(motion, (0.0, 10.0), [0.0, speed], events=rests, rtol=1e-11, atol=1e-13)
    slide = free_slide(model, speed)
    assert math.isclose(slide.distance, run.y_events[0][0][0], rel_tol=1e-8)
    assert math.isclose(slide.time, run.t_events[0][0], rel_tol=1e-8)


def test_series_and_closed_form_meet():
    edge = 0.1 * MODEL.coulomb_force / MODEL.viscous_coefficient
    v = edge * (1 + np.array([-1e-9, 1e-9]))
    d = [free_slide(MODEL, float(u)).distance for u in v]
    assert math.isclose(d[1] / d[0], (v[1] / v[0]) ** 2, rel_tol=1e-9)


@given(st.floats(0.0, 1e-3), st.floats(1e-3, 200.0))
def test_small_viscous_friction_is_a_small_change(viscous, speed):
    slide = free_slide(MODEL.replace(viscous_coefficient=viscous), speed).distance
    plain = speed**2 / (2 * 0.15 * 9807)
    u = viscous * speed / MODEL.coulomb_force
    assert plain * (1 - 2 / 3 * u) * (1 - 1e-12) <= slide <= plain * (1 + 1e-12)


@given(st.floats(0.0, 5.0), st.floats(1e-6, 20.0))
def test_speed_and_slide_are_inverse(viscous, distance):
    model = MODEL.replace(viscous_coefficient=viscous)
    assert math.isclose(free_slide(model, sliding_speed(model, distance)).distance, distance, rel_tol=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: restitution(slide_before=100.0, slide_after=0.0, part_after=120.0),
            r"restitution must be in \[0, 1\] \(1\); got 1.2",
        ),
        (lambda: energy_balance_speed(PROBLEM, -1.0), r"distance must be >= 0 \(mm\); got -1.0"),
        (
            lambda: energy_balance_speed(PROBLEM, 1.0, slide_mass=0.0),
            r"slide_mass must be > 0 \(kg\); got 0.0",
        ),
        (lambda: free_slide(MODEL, -1.0), r"speed must be >= 0 \(mm/s\); got -1.0"),
        (lambda: contact_stiffness([1.0], [1.0, 2.0]), "distance and force must be of one length >= 1"),
        (lambda: contact_stiffness([0.0], [1.0]), r"distance must be > 0 \(mm\); got 0.0"),
    ],
)
def test_bad_values_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
