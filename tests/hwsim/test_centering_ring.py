"""The pushed ring of the centering machine: against the event-exact model, against two-dimensional dynamics,
energy, slipping.

Signs, seen from above at the spindle angle 0; the table turns clockwise, so that the point of the ring that
comes to the probe line has a polar angle that grows with the spindle's::

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
from centering_fakes import RADIUS, at, center, constant, exact, move, problem, running, started
from centering_machine_inside import friction, plane, slots
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from centering import TipProfile
from centering.push import simulate_pushes
from centering.push.turning import ring_friction, slide_to_rest
from hwsim import Ring
from sdpgrind.base.compiling.compiled import opened

TOUCHING = 1e-9  # mm
AROUND = (np.arange(4000) + 0.5) * (2 * pi / 4000)


def shares_of(v, s):
    """Force and moment of a ring that slides and spins, point by point around it."""
    along, across = v - s * np.sin(AROUND), s * np.cos(AROUND)
    size = np.hypot(along, across)
    return (along / size).mean(), ((across * np.cos(AROUND) - along * np.sin(AROUND)) / size).mean()


def pushed(of, rows, *, ring=None, speed=0.0, gap=TOUCHING, wait=0.2, **changes):
    """A part after a profile, and the time that follows."""
    machine = exact(of, ring=ring or at(5.0, radius=of.model.part.radius), start_gap=gap, **changes)
    part = running(started(machine, speed), rows[0, 1])
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
    assert part.outcome()["peak_force"] == pytest.approx(peak, rel=1e-5)  # five digits are printed


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
    assert part.outcome()["peak_force"] == pytest.approx(other[2], rel=1e-4)


@pytest.mark.parametrize("mass", [0.8, 18.9])
@pytest.mark.parametrize(("spin", "speed"), [(2.0944, 40.0), (10.47, 10.0), (10.47, 80.0)])
def test_on_a_turning_table_a_push_is_that_of_the_planner(mass, spin, speed):
    """Two ways: here a frame that turns with the table, there that of the ground and small steps; the sense
    is mirrored.
    """
    of = problem(mass=mass)
    ramp = speed / 2500
    rows = np.array([[1.0 / speed, speed, 0.0], [ramp, speed, -2500.0], [0.1, 0.0, 0.0]])
    part = pushed(of, rows, ring=at(3.0, 1.0), speed=spin, gap=0.05, wait=0.0)
    state = np.zeros(plane.STATES)
    state[plane.X], state[plane.Y], state[plane.V_X], state[plane.V_Y] = 3.0, -1.0, spin, 3.0 * spin
    state[plane.RESTS], state[plane.TOUCH], state[plane.TIP] = 1.0, -1.0, 3.0 + sqrt(RADIUS**2 - 1.0) + 0.05
    opened(plane._push_on_table)(of.model.parameters, RADIUS, spin, rows, 2e-6, state)
    # mm; the other way errs by its steps
    assert center(part) == pytest.approx((state[plane.X], -state[plane.Y]), abs=1e-4)


def test_between_events_the_ring_obeys_its_equations():
    """A twin in the frame of the ground, with the spindle speeding up: a ring that is thrown by a hard push
    and slides freely.
    """
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
        over = s[2:4] - (3.0 + rate * now) * np.array([s[1], -s[0]])  # over the table
        force, moment = shares_of(hypot(*over), s[4])
        friction = 0.15 * 9807.0 * force * over / hypot(*over) + 0.1 / 0.005 * over
        return [*s[2:4], *-friction, -rate * RADIUS - 0.15 * 9807.0 * moment - 0.1 / 0.005 * s[4]]

    assert state[slots.FORCE] == 0.0 and state[slots.MOVING] == 1.0
    place, velocity = seen(0.030)
    twin = solve_ivp(
        ground, (0.030, 0.036), [*place, *velocity, state[slots.SPIN]], rtol=1e-10, atol=1e-11
    ).y[:, -1]
    part.move_to(0.036)
    assert state[slots.FORCE] == 0.0 and state[slots.MOVING] == 1.0
    place, velocity = seen(0.036)
    np.testing.assert_allclose(place, twin[:2], atol=1e-7)
    np.testing.assert_allclose(velocity, twin[2:4], atol=1e-5)
    # mm/s: the table turns under it
    assert state[slots.SPIN] == pytest.approx(twin[4], abs=1e-5) and abs(twin[4]) > 5.0


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
    of = problem(
        mass=mass, contact_stiffness=stiffness, contact_damping=damping, mu_kinetic=mu, mu_static=mu * ratio
    )
    rows = move(1.0, speed)
    part = pushed(of, rows, wait=3.0)  # a heavily damped tip lets a ring creep on for long
    gone = 5.0 - center(part)[0]
    stroke = float((rows[:, 1] * rows[:, 0] + 0.5 * rows[:, 2] * rows[:, 0] ** 2).sum())
    thrown = (2.0 * 83.0) ** 2 / (2.0 * mu * 9807.0)  # as if it left at twice the tip's speed
    assert part._state[slots.MOVING] == 0.0
    assert 0.0 <= gone <= stroke + thrown
    # the spring holds no more than breaks away
    assert gone >= stroke - part._cell[slots.BREAKAWAY] / stiffness - 1e-9


def test_a_stiff_tip_without_slip_brings_the_ring_of_the_quasi_static_anchor_to_the_axis():
    """R 61.94 mm, 20 rpm, 83.333 mm/s for 0.12 s brings (10.01141, -1.19093) to the axis; here mirrored, all
    ten times slower.
    """
    contact = {"contact_stiffness": 5e4, "contact_damping": 10.0, "mu_kinetic": 1.9, "mu_static": 1.9001}
    of = problem(mass=0.5, radius=61.94, offset_max=11.0, **contact)
    part = pushed(
        of, constant(25.0 / 3.0, 1.2), ring=at(10.01141, 1.19093, 61.94), speed=pi * 2 / 30, wait=0.0
    )
    # the spring gives by about F_s/k = 2e-3 mm, the tip touches a little late
    assert hypot(*center(part)) < 0.02


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
            assert along == pytest.approx(center(plain)[0] - 0.05, abs=2e-3) and across == pytest.approx(
                0.0, abs=1e-12
            )


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


@pytest.mark.parametrize(("share", "slips"), [(0.995, 0.0), (1.005, 1.0)])
def test_a_table_that_speeds_up_holds_the_spin_of_the_ring_with_the_friction_that_holds_its_place(
    share, slips
):
    """M d |w^2, alpha| and M alpha R at d = 10 mm, w = 6.6 rad/s on the limit of even pressure: of a common
    slide and spin.
    """
    of, static = problem(), 0.2 * 9807.0

    def rate_at(e):
        return shares_of(e, 1.0)[1] * static / RADIUS

    ratio = brentq(lambda e: shares_of(e, 1.0)[0] - 10.0 * hypot(6.6**2, rate_at(e)) / static, 0.01, 0.9)
    rate = share * rate_at(ratio)  # 20.5 rad/s^2
    limits = of.limits.replace(spindle_acceleration_max=rate, spindle_speed_max=20.0)
    part = started(exact(of.replace(limits=limits), ring=at(10.0), start_gap=12.0), 6.59)
    part.step({"spindle_speed": 6.61}, 100)
    assert part.outcome()["slipped"] == slips


@pytest.mark.parametrize("ratio", [1e-6, 0.019, 0.021, 0.4, 0.999, 1.0, 1.3, 60.0])
def test_friction_of_a_ring_is_the_sum_around_it(ratio):
    force, moment = opened(friction._shares)(ratio, 1.0)
    assert (force, moment) == pytest.approx(ring_friction(ratio, 1.0), abs=1e-12)
    if abs(ratio - 1.0) > 0.01:  # at equal speeds one point stands still
        assert (force, moment) == pytest.approx(shares_of(ratio, 1.0), abs=1e-9)
    assert opened(friction._shares)(1.0, ratio)[::-1] == pytest.approx((force, moment), abs=1e-12)


def test_what_is_left_for_the_place_is_on_the_limit():
    for moment in (0.01, 0.3, 0.63662, 0.9, 0.999):
        force = opened(friction._held)(moment)
        ratio = brentq(lambda e, moment=moment: shares_of(e, 1.0)[1] - moment, 1e-4, 200.0)
        assert force == pytest.approx(shares_of(ratio, 1.0)[0], abs=1e-5)
    assert (opened(friction._held)(0.0), opened(friction._held)(1.0), opened(friction._held)(2.0)) == (
        1.0,
        0.0,
        0.0,
    )


@given(st.floats(0.02, 1.5), st.floats(0.02, 1.5))
def test_a_ring_begins_to_move_the_way_in_which_it_is_set_in_motion(pull, turn):
    """Else friction, taken against another way, would stop it where it begins, again and again."""
    onward, around = opened(friction._begins)(pull, turn, 1.0)
    force, moment = opened(friction._shares)(onward, around)
    assert (pull - force) * around == pytest.approx(
        (turn - moment) * onward, abs=1e-10
    )  # shares are one value within 1e-12 of equal
    if pull > 1.01 * opened(friction._held)(turn):  # beyond what friction can hold
        assert pull > force and turn > moment


def test_a_table_that_speeds_up_throws_a_heavy_ring_on_little_friction_and_does_not_hang():
    """At half the friction a table at 10 rad/s^2 leaves a third of it for the place: w^2 d of 4.95 mm is
    beyond at 8.4 rad/s.
    """
    of = problem(mass=18.9, radius=89.5, mu_static=0.1, mu_kinetic=0.075)
    part = started(exact(of, ring=at(4.95, radius=89.5), start_gap=20.0), 0.0)
    part.step({"spindle_speed": 10.4}, 0)
    left = opened(friction._held)(10.0 * 89.5 / (0.1 * 9807.0)) * 0.1 * 9807.0 / 4.95
    slips = (left**2 - 10.0**2) ** 0.25 / 10.0  # s: w^4 + alpha^2 on the limit
    part.move_to(0.98 * slips)
    assert part.outcome()["slipped"] == 0.0
    part.move_to(1.02 * slips)
    assert part.outcome()["slipped"] == 1.0 and hypot(*center(part)) > 4.95


@pytest.mark.parametrize(
    ("speed", "spin"), [(100.0, 0.0), (100.0, 0.1), (100.0, 0.9), (100.0, -2.0), (20.0, 1.0), (5.0, 1.0)]
)
def test_a_ring_that_slides_and_spins_comes_to_rest_where_the_closed_slide_ends(speed, spin):
    """Two ways: steps in time here, along the ratio of the speeds there; from mm/s and rad/s."""
    of = problem(viscous_coefficient=0.0)
    part = started(exact(of, ring=at(5.0), start_gap=30.0))
    state = part._state
    state[slots.SPEED_Y], state[slots.SPIN], state[slots.MOVING] = speed, spin * RADIUS, 1.0
    part.move_to(1.0)
    assert state[slots.MOVING] == 0.0 and state[slots.SPIN] == 0.0
    slid = slide_to_rest(of.model, speed=speed, spin=spin)
    # the last steps before it stands are coarse
    assert state[slots.Y] == pytest.approx(slid.distance, abs=1e-3)


@pytest.mark.parametrize("mass", [0.8, 18.9])
def test_a_push_while_the_table_changes_its_speed_does_not_hang_on_the_step(mass):
    """Steps of an eighth; and the spin takes friction from the place, so that it is not that of a steady
    table.
    """
    of, ends = problem(mass=mass), []
    for finer, speed in ((1.0, 8.0), (0.125, 8.0), (1.0, 2.5)):
        part = started(exact(of, ring=at(5.0), start_gap=0.05), 2.0)
        part._cell[slots.STEP] *= finer
        part.step({"profile": move(1.05, 20.0), "spindle_speed": speed}, 0)
        part.move_to(1.0)
        ends.append(hypot(*center(part)))
    assert ends[0] == pytest.approx(ends[1], abs=2e-4)
    assert abs(ends[0] - ends[2]) > 1e-3


def test_a_lost_ring_ends_the_part():
    part = started(exact(problem(offset_max=40.0), ring=at(40.0), start_gap=60.0), 20.0)
    while not part.done:
        part.step({}, 10)
    outcome = part.outcome()
    assert outcome["lost"] == 1.0 and outcome["finished"] == 0.0 and outcome["offset"] >= RADIUS
    assert np.isnan(part.step({}, 0)["probe"])


def test_a_pusher_that_stands_in_the_way_of_the_rim_trims_the_ring():
    """Parked at R + 2 mm under a ring 5 mm off: within turns no point of the rim stands out by more than 2
    mm.
    """
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


@pytest.mark.parametrize("speed", [0.0, 3.0])
@pytest.mark.parametrize("lobes", [{}, {3: (0.02, 0.4)}, {5: (0.02, 0.4), 11: (0.005, 1.0)}])
def test_the_tip_touches_the_rim_where_the_probe_says_that_it_is(lobes, speed):
    """However far the table has turned since the profile began: here 6 rad, or not at all."""
    ring = Ring(RADIUS, 1.0, 0.0, lobes=lobes)
    part = started(exact(ring=ring, start_gap=2.0), speed)
    part.step({"profile": constant(1.0, 4.0)}, 0)
    before = after = part.step({}, 0)
    while part._state[slots.TOUCHES] == 0.0:
        before, after = after, part.step({}, 1)
    gaps = [each["slide"] - float(ring.reading([each["angle"]])[0]) for each in (before, after)]
    # the tip is there within the tick; outside of a step of 0.5 ms the rim is 3 * 3 * 0.02 mm/s * 0.5 ms =
    # 0.1 µm off
    assert gaps[0] >= -1e-4 and gaps[1] <= 1e-4 and gaps[0] - gaps[1] < 1e-3 * (1.0 + 4.0 * speed) + 1e-9


def test_a_tip_that_stands_still_trims_a_lobed_ring_as_the_lobes_come_round():
    """A tip stands in the valley of a ring at the axis. Turned by 90 degrees, h = 0.2 (1 - cos 2t) mm of rim
    came against it.

    The ring gives way by h along the line of the tip, and what it gave way before turns aside: c' = h, to 0.1
    pi."""
    of = problem(mass=0.8)
    ring = Ring(RADIUS, 0.0, 0.0, lobes={2: (0.2, pi)})
    part = started(exact(of, ring=ring, start_gap=1.0))
    part.step({"profile": move(1.0, 10.0)}, 300)
    assert part.outcome()["offset"] == 0.0
    part._state[slots.VELOCITY_SET], part._state[slots.SPEED_SET] = 0.0, 0.5
    part.step({}, round(1000 * pi + 25))  # 25 ms: half of the ramp
    squeezed = of.model.breakaway_force / of.model.contact_stiffness
    normal = 0.1 * pi / RADIUS * 0.4  # the normal of the contact is so far off the line, at most
    assert part.outcome()["offset"] == pytest.approx(hypot(0.4, 0.1 * pi), abs=2 * squeezed + normal)
