"""The pushed ring of the centering machine: against the event-exact model, against two-dimensional dynamics, energy, slipping.

Signs, seen from above at the spindle angle 0; the table turns clockwise, so that the point of the ring that comes to the probe
line has a polar angle that grows with the spindle's::

                 y of the table
                 |   ___
                 | /     \\       probe tip
                 ||   c   | <---o====[ slide ]     slide, probe: positive away from the axis ->
       axis  ----+-\\-----/----------------------- x: probe line
                              <- velocity, profile: positive toward the axis
"""

from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from centering_fakes import RADIUS, at, center, constant, exact, move, problem, started
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from centering._push import direction_kernels as plane
from centering._push.profile import TipProfile
from centering._push.reaction import simulate_pushes
from hwsim.plants import _centering_slide_kernels as slots

TOUCHING = 1e-9  # mm


def pushed(of, rows, *, ring=None, speed=0.0, gap=TOUCHING, wait=0.2, **changes):
    """A part after a profile, and the time that follows."""
    machine = exact(of, ring=ring or at(5.0, radius=of.model.part.radius), start_gap=gap, **changes)
    part = started(machine, speed)
    part.step({"profile": rows}, 0)
    part.move_to(rows[:, 0].sum() + wait)
    return part


@pytest.mark.parametrize(
    ("name", "mm_per_min", "peak"),
    [
        ("printed", 600, 69.602),
        ("printed", 1000, 96.640),
        ("printed", 2000, 164.783),
        ("identified", 600, 59.791),
        ("identified", 1000, 79.660),
        ("identified", 2000, 134.079),
    ],
)
def test_peak_forces_of_the_source_are_those_of_the_converged_model(name, mm_per_min, peak):
    part = pushed(problem(name), constant(mm_per_min / 60.0, 0.4))
    assert part.outcome()["peak_force"] == pytest.approx(peak, rel=1e-3)  # steps of 0.08 of the contact's own time


@pytest.mark.parametrize("name", ["printed", "identified"])
@pytest.mark.parametrize("mass", [0.8, 5.0, 18.9])
@pytest.mark.parametrize("speed", [1.0, 10.0, 40.0])
def test_on_a_table_at_rest_a_push_is_that_of_the_event_exact_model(name, mass, speed):
    """Two ways: fourth-order steps with events within them, and closed forms from event to event."""
    of = problem(name, mass=mass)
    rows = np.array([[0.1, speed, 0.0], [speed / 2560, speed, -2560.0]])
    whole = TipProfile(np.append(rows[:, 0], 0.2), np.append(rows[:, 1], 0.0), np.append(rows[:, 2], 0.0))
    other = simulate_pushes(of.model, whole)[0]
    part = pushed(of, rows)
    assert 5.0 - center(part)[0] == pytest.approx(other[0], abs=2e-6)  # mm
    assert center(part)[1] == pytest.approx(0.0, abs=1e-12)
    assert part.outcome()["peak_force"] == pytest.approx(other[2], rel=2e-3)


@pytest.mark.parametrize("mass", [0.8, 18.9])
@pytest.mark.parametrize(("spin", "speed"), [(2.0944, 40.0), (10.47, 10.0), (10.47, 80.0)])
def test_on_a_turning_table_a_push_is_that_of_the_planner(mass, spin, speed):
    """Two ways: here a frame that turns with the table, there that of the ground and small steps; the sense is mirrored."""
    of = problem(mass=mass)
    ramp = speed / 2500
    rows = np.array([[1.0 / speed, speed, 0.0], [ramp, speed, -2500.0], [0.1, 0.0, 0.0]])
    part = pushed(of, rows, ring=at(3.0, 1.0), speed=spin, gap=0.05, wait=0.0)
    state = np.zeros(plane.STATES)
    state[plane.X], state[plane.Y], state[plane.V_X], state[plane.V_Y] = 3.0, -1.0, spin, 3.0 * spin
    state[plane.RESTS], state[plane.TOUCH], state[plane.TIP] = 1.0, -1.0, 3.0 + sqrt(RADIUS**2 - 1.0) + 0.05
    plane.push_on_table(of.model.parameters, RADIUS, spin, rows, 2e-6, state)
    assert center(part) == pytest.approx((state[plane.X], -state[plane.Y]), abs=1e-4)  # mm; the other way errs by its steps


def test_between_events_the_ring_obeys_its_equations():
    """A twin in the frame of the ground, with the spindle speeding up: a ring that is thrown by a hard push and slides freely."""
    of = problem(mass=5.0)
    machine = exact(of, ring=at(5.0), start_gap=TOUCHING)
    part = started(machine, 3.0)
    part.step({"profile": move(0.8, 60.0), "spindle_speed": 9.0}, 0)
    part.move_to(0.030)
    state = part._state
    rate = 10.0

    def seen(now):
        angle = 3.0 * now + 0.5 * rate * now**2
        spin = 3.0 + rate * now
        turn = np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
        place = turn @ state[[slots.X, slots.Y]]
        return place, turn @ state[[slots.SPEED_X, slots.SPEED_Y]] + spin * np.array([place[1], -place[0]])

    def ground(now, s):
        over = s[2:] - (3.0 + rate * now) * np.array([s[1], -s[0]])  # over the table
        friction = 0.15 * 9807.0 * over / hypot(*over) + 0.1 / 0.005 * over
        return np.concatenate([s[2:], -friction])

    assert state[slots.FORCE] == 0.0 and state[slots.MOVING] == 1.0
    place, velocity = seen(0.030)
    twin = solve_ivp(ground, (0.030, 0.036), [*place, *velocity], rtol=1e-11, atol=1e-12).y[:, -1]
    part.move_to(0.036)
    assert state[slots.FORCE] == 0.0 and state[slots.MOVING] == 1.0
    place, velocity = seen(0.036)
    np.testing.assert_allclose(place, twin[:2], atol=1e-8)
    np.testing.assert_allclose(velocity, twin[2:], atol=1e-6)


@settings(max_examples=25, deadline=None)
@given(
    mass=st.floats(0.5, 70.0),
    stiffness=st.floats(50.0, 5000.0),
    damping=st.floats(0.0, 3.0),
    mu=st.floats(0.05, 0.6),
    ratio=st.floats(1.001, 2.0),
    speed=st.floats(1.0, 83.0),
)
def test_any_push_ends_and_moves_no_further_than_the_impact_could(mass, stiffness, damping, mu, ratio, speed):
    of = problem(mass=mass, contact_stiffness=stiffness, contact_damping=damping, mu_kinetic=mu, mu_static=mu * ratio)
    rows = move(1.0, speed)
    part = pushed(of, rows, wait=3.0)  # a heavily damped tip lets a ring creep on for long
    gone = 5.0 - center(part)[0]
    stroke = float((rows[:, 1] * rows[:, 0] + 0.5 * rows[:, 2] * rows[:, 0] ** 2).sum())
    thrown = (2.0 * 83.0) ** 2 / (2.0 * mu * 9807.0)  # as if it left at twice the tip's speed
    assert part._state[slots.MOVING] == 0.0
    assert 0.0 <= gone <= stroke + thrown
    assert gone >= stroke - part._cell[slots.BREAKAWAY] / stiffness - 1e-9  # the spring holds no more than breaks away


def test_a_stiff_tip_without_slip_brings_the_ring_of_the_quasi_static_anchor_to_the_axis():
    """Spec 3.5: R 61.94 mm, 20 rpm, 83.333 mm/s for 0.12 s brings (10.01141, -1.19093) to the axis; mirrored here."""
    of = problem(mass=0.5, radius=61.94, contact_stiffness=5e4, contact_damping=10.0, mu_kinetic=20.0, mu_static=20.0001)
    part = pushed(of, constant(250.0 / 3.0, 0.12), ring=at(10.01141, 1.19093, 61.94), speed=pi * 20 / 30, wait=0.0)
    assert hypot(*center(part)) < 0.02  # the spring gives by about F_s/k = 2e-3 mm, the tip touches a little late


def test_a_direction_error_turns_the_way_and_a_stop_error_shortens_it():
    of = problem(mass=0.8)
    for name, value in {"AIM": 0.02, "STOP": -0.05}.items():
        part = started(exact(of, ring=at(5.0), start_gap=0.1))
        part.step({"profile": move(1.1, 10.0)}, 0)
        part._cell[getattr(slots, name)] = value
        part.move_to(1.0)
        plain = pushed(of, move(1.1, 10.0), gap=0.1, wait=1.0)
        along, across = center(part)
        if name == "AIM":
            assert across / (along - 5.0) == pytest.approx(0.02, rel=0.02)
        else:
            assert along == pytest.approx(center(plain)[0] - 0.05, abs=2e-3) and across == pytest.approx(0.0, abs=1e-12)


# Without a push -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("speed", "slips"), [(13.9, 0.0), (14.1, 1.0)])
def test_a_ring_is_thrown_where_the_table_is_too_fast(speed, slips):
    """w^2 d = mu_s g at w = 14.005 rad/s, d = 10 mm; it then moves outward."""
    of = problem()
    part = started(exact(of, ring=at(10.0), start_gap=12.0), speed)
    part.step({}, 100)
    outcome = part.outcome()
    assert outcome["slipped"] == slips and (outcome["offset"] > 10.001) == bool(slips)
    if not slips:
        assert outcome["offset"] == pytest.approx(10.0, abs=1e-12)


@pytest.mark.parametrize(("rate", "slips"), [(21.1, 0.0), (21.4, 1.0)])
def test_a_table_that_speeds_up_holds_the_spin_of_the_ring_with_the_friction_that_holds_its_place(rate, slips):
    """(M w^2 d)^2 + (M alpha R)^2 = (mu_s M g)^2 at d = 10 mm, w = 6.6 rad/s: alpha = 21.235 rad/s^2."""
    of = problem()
    limits = of.limits.replace(spindle_acceleration_max=rate, spindle_speed_max=20.0)
    part = started(exact(of.replace(limits=limits), ring=at(10.0), start_gap=12.0), 6.59)
    part.step({"spindle_speed": 6.61}, 100)
    assert part.outcome()["slipped"] == slips


def test_a_lost_ring_ends_the_part():
    part = started(exact(ring=at(40.0), start_gap=60.0), 20.0)
    while not part.done:
        part.step({}, 10)
    outcome = part.outcome()
    assert outcome["lost"] == 1.0 and outcome["finished"] == 0.0 and outcome["offset"] >= RADIUS
    assert np.isnan(part.step({}, 0)["probe"])


def test_a_pusher_that_stands_in_the_way_of_the_rim_trims_the_ring():
    """Parked at R + 2 mm under a ring 5 mm off: within turns no point of the rim stands out by more than 2 mm."""
    of = problem(mass=0.8)
    part = started(exact(of, ring=at(5.0, 3.0), start_gap=1.0), 2.0)
    part._state[slots.REFERENCE] = RADIUS + 6.5
    part._state[slots.VELOCITY_SET] = 0.0
    part.step({}, 1)
    part.step({"profile": move(4.5, 40.0)}, 12_000)
    outcome = part.outcome()
    assert outcome["collisions"] >= 1.0 and outcome["pushes"] == 1.0
    squeezed = of.model.breakaway_force / of.model.contact_stiffness
    assert 2.0 <= outcome["offset"] <= 2.0 + 2 * squeezed + 2e-3


@pytest.mark.parametrize("lobes", [{}, {3: (0.02, 0.4)}])
def test_the_tip_touches_the_rim_where_the_probe_says_that_it_is(lobes):
    from hwsim.plants._probe_ring import Ring

    ring = Ring(RADIUS, 3.0, 0.0, lobes=lobes)
    part = started(exact(ring=ring, start_gap=2.0))
    rim = float(ring.reading([0.0])[0])
    part.step({"profile": constant(1.0, 3.0)}, 0)
    while part._state[slots.FORCE] == 0.0:
        part.step({}, 1)
    assert part.step({}, 0)["slide"] == pytest.approx(rim, abs=2e-3)  # a tick of 1 ms at 1 mm/s
