import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from push_inside import (
    _push_on_table,
    after,
    at,
    back,
    forward,
    landing,
    profile_of,
    remaining,
    ring_state,
    slide,
    touch_back,
)
from scipy.integrate import solve_ivp

from centering import TipProfile, preset, simulate_push
from centering.push import plan_touch
from sdpgrind import units
from sdpgrind.base.compiling.compiled import opened

push_on_table = opened(_push_on_table)

PRINTED = preset("printed")
SPEED = units.rpm(20.0)


def _back(radius, w, rows, offset):
    out = np.zeros(back.TOUCHES)
    touch_back(radius, w, np.asarray(rows, dtype=float), offset, out)
    assert out[back.FOUND] == 1.0
    return out


def _path(w, rows, start, reverse):
    """The quasi-static push in the plane, c' = w J c + s n with s = -(n . w J c) - v n_x, from a place of (c,
    p).
    """
    state = np.array(start, dtype=float)
    for duration, velocity, acceleration in rows[::-1] if reverse else rows:
        span = (duration, 0.0) if reverse else (0.0, duration)

        def slope(t, y, velocity=velocity, acceleration=acceleration):
            v = velocity + acceleration * t
            c = y[:2]
            n = (c - [y[2], 0.0]) / np.linalg.norm(c - [y[2], 0.0])
            turned = w * np.array([-c[1], c[0]])
            return np.append(turned + (-(n @ turned) - v * n[0]) * n, -v)

        state = solve_ivp(slope, span, state, rtol=1e-12, atol=1e-13).y[:, -1]
    return state


def test_start_of_the_specification():
    """R 61.94 mm, 20 rpm, 83.333 mm/s over 0.12 s: (10.01141, -1.19093), 6.784 deg."""
    start = _path(SPEED, [(0.12, 83.333, 0.0)], [0.0, 0.0, 61.94], True)
    np.testing.assert_allclose(start[:2], [10.01141, -1.19093], atol=5e-6)
    out = _back(61.94, SPEED, [(0.13, 83.333, 0.0)], math.hypot(*start[:2]))
    d = math.hypot(*start[:2])
    np.testing.assert_allclose(
        (d * math.cos(out[back.ANGLE]), d * math.sin(out[back.ANGLE])), start[:2], atol=1e-8
    )
    assert math.isclose(out[back.ANGLE], -units.deg(6.784), abs_tol=units.deg(5e-4))
    assert math.isclose(0.13 - out[back.TIME], 0.12, abs_tol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.05, 10.0), st.floats(1.0, 80.0), st.floats(5.0, 80.0), st.floats(40.0, 100.0))
def test_quasi_static_push_ends_on_the_axis_with_the_planned_profile(offset, rpm, speed, radius):
    rows = TipProfile.move(offset + 0.5, speed, 2560.0).segments
    w = units.rpm(rpm)
    out = _back(radius, w, rows, offset)
    x, y = offset * math.cos(out[back.ANGLE]), offset * math.sin(out[back.ANGLE])
    push = after(rows, out[back.TRAVEL])
    tip = x + math.sqrt(radius**2 - y * y)
    end = _path(w, push, [x, y, tip], False)
    np.testing.assert_allclose(end, [0.0, 0.0, radius], atol=2e-8)


@pytest.mark.parametrize(("offset", "speed"), [(1.0, 10.0), (10.0, 83.333), (0.01, 5.0)])
def test_slow_tables_lead_by_half_the_push(offset, speed):
    """For small w T the centre of the push is led: the angle is w times the mean of the time left, weighted
    by the way.
    """
    w = 1e-3
    rows = TipProfile.move(offset + 0.5, speed, 2560.0).segments
    out = _back(89.5, w, rows, offset)
    time = np.linspace(out[back.TIME], rows[:, 0].sum(), 20001)
    left = np.array([remaining(rows, t) for t in time[::200]])
    mean = np.trapezoid(np.interp(time, time[::200], left), time) / offset
    assert math.isclose(-out[back.ANGLE], w * mean, rel_tol=0.1)


def _stepped(model, radius, w, rows, offset, angle, step):
    """The twin of `push_on_table`, in the frame of the table (complex numbers): there a resting ring rests,
    and Coriolis acts.
    """
    m, k, b, f_s, f_k, k_v = model.parameters
    q, u, time, rests, peak = offset * np.exp(1j * angle), 0.0, 0.0, True, 0.0
    tip = q.real + math.sqrt(radius**2 - q.imag**2)
    for duration, velocity, acceleration in rows:
        steps = max(round(duration / step), 1)
        h = duration / steps
        for n in range(steps):
            speed = velocity + acceleration * (n + 0.5) * h
            tip, time = tip - speed * h, time + h
            turned = complex(math.cos(w * time), -math.sin(w * time))  # the push line, from the table
            apart = q - tip * turned
            away = abs(apart)
            normal = apart / away
            closing = -((u + speed * turned + 1j * w * tip * turned) * normal.conjugate()).real
            force = max(0.0, k * (radius - away) + b * closing) if away < radius else 0.0
            peak = max(peak, force)
            load = force * normal / m + w * w * q - 2j * w * u
            if rests and abs(load) * m <= f_s:
                continue
            u += h * load
            lost = h * (f_k + k_v * abs(u)) / m
            rests = abs(u) <= lost
            u = 0.0 if rests else u * (1.0 - lost / abs(u))
            q += h * u
    return q, peak


def _pushed(model, radius, w, rows, offset, angle, error=1e-10):
    """The same by the kernel: where the ring ends, in the frame of the table at first touch, and the state."""
    state = ring_state(offset, angle, radius, w)
    push_on_table(model.parameters, radius, w, np.asarray(rows, dtype=float), error, state)
    return complex(state[at.X], state[at.Y]) * np.exp(-1j * w * state[at.CLOCK]), state


def _withdrawn(rows):
    return np.vstack((forward(rows), [[0.02, 0.0, -2560.0], [0.05, -51.2, 0.0]]))


CASES = [
    (18.9, 20.0, 1.0, 40.0),
    (18.9, 100.0, 0.1, 10.0),
    (0.8, 100.0, 1.0, 40.0),
    (0.8, 60.0, 0.1, 10.0),
    (5.0, 60.0, 3.0, 80.0),
]


@pytest.mark.parametrize(("mass", "rpm", "offset", "speed"), CASES)
def test_push_on_a_table_is_that_of_the_table_s_frame(mass, rpm, offset, speed):
    problem, w = PRINTED.replace(mass=mass), units.rpm(rpm)
    touch = plan_touch(problem, offset=offset, spindle_speed=w, push_speed=speed, direction="quasi-static")
    rows = _withdrawn(touch.push_profile.segments)
    q, peak = _stepped(problem.model, 89.5, w, rows, offset, -touch.angle, 2e-5)
    half, _ = _stepped(problem.model, 89.5, w, rows, offset, -touch.angle, 4e-5)
    end, state = _pushed(problem.model, 89.5, w, rows, offset, -touch.angle)
    assert abs(end - q) < 2.5 * abs(q - half)  # the twin is of first order: its error is what halving changes
    assert math.isclose(state[at.PEAK_FORCE], peak, rel_tol=0.05)
    assert state[at.RESTS] == 1.0


@pytest.mark.parametrize(("mass", "speed"), [(18.9, 10.0), (18.9, 40.0), (0.8, 10.0), (0.8, 83.0)])
def test_push_on_a_resting_table_is_the_reaction_model(mass, speed):
    model = PRINTED.replace(mass=mass).model
    profile = TipProfile.constant_speed(speed, 0.1).then(TipProfile.constant_speed(1e-6, 0.08))
    trace = simulate_push(model, profile)
    state = ring_state(20.0, 0.0, 89.5, 0.0)
    push_on_table(model.parameters, 89.5, 0.0, profile.segments, 1e-10, state)
    assert state[at.Y] == 0.0
    # a slide begins by a step of 2 us
    assert math.isclose(20.0 - state[at.X], trace.final_position, abs_tol=1e-7)
    assert math.isclose(state[at.PEAK_FORCE], trace.peak_force, rel_tol=5e-5)  # between steps by a parabola
    assert math.isclose(state[at.FREE_MAX], trace.free_slide, abs_tol=1e-7)


def test_error_is_what_is_asked():
    """Across events; the error of a few dozen steps is at most a few dozen times that of one."""
    rows = _withdrawn(TipProfile.move(1.0, 40.0, 2560.0).segments)
    exact, _ = _pushed(PRINTED.model, 89.5, 8.0, rows, 1.0, -0.3, 1e-13)
    for error in (1e-5, 1e-7, 1e-9):
        assert abs(_pushed(PRINTED.model, 89.5, 8.0, rows, 1.0, -0.3, error)[0] - exact) < 30.0 * error


def _stepped_slide(law, w, tip, touching, start, time, steps):
    """End of a smooth slide after a number of equal steps."""
    ring, y, end, k = (
        (law, 89.5, w),
        np.array(start),
        np.empty(slide.MOTION),
        np.empty((slide.STAGES, slide.MOTION)),
    )
    for _ in range(steps):
        opened(slide._slope)(ring, tip, touching, y, k[0])
        opened(slide._stride)(ring, tip, touching, time / steps, y, k, end)
        tip, y = opened(slide._tip_after)(tip, time / steps), end.copy()
    return y


def test_steps_are_of_fifth_order():
    """Twice as many err by 32 times less: a ring that slides on the tip, over a table that turns."""
    start, tip = [1.0, 0.2, -20.0, 5.0, 0.0], (90.48, 30.0, -500.0)
    ends = [
        _stepped_slide(PRINTED.model.parameters, 8.0, tip, True, start, 0.01, steps)[:2]
        for steps in (5, 10, 20, 640)
    ]
    errors = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
    assert errors[0] > 25.0 * errors[1] > 25.0**2 * errors[2] > 0.0


def test_a_free_slide_keeps_its_line():
    """Without friction nothing acts: a straight line at one speed, its angular momentum that of the start."""
    law = PRINTED.model.parameters
    law[4:] = 0.0
    end = _stepped_slide(law, 10.0, (200.0, 0.0, 0.0), False, [5.0, 0.0, 3.0, 50.0, 0.0], 0.2, 50)
    np.testing.assert_allclose(end[:4], [5.6, 10.0, 3.0, 50.0], rtol=1e-13)
    assert math.isclose(end[0] * end[3] - end[1] * end[2], 250.0, rel_tol=1e-13)


@pytest.mark.parametrize("share", [1.02, 1.4])
def test_a_ring_that_the_table_throws_off_slides_as_its_equation_says(share):
    """Between F_k and twice that the table throws it outward; a ring that slips goes on, and no step adds to it."""
    model = PRINTED.model
    w = math.sqrt(share * model.mu_static * 9807.0 / 5.0)
    state = ring_state(5.0, 0.0, 89.5, w)
    state[at.TIP] = 300.0
    push_on_table(model.parameters, 89.5, w, np.array([[0.02, 0.0, 0.0]]), 1e-11, state)
    assert state[at.RESTS] == 0.0
    begin = state.copy()
    push_on_table(model.parameters, 89.5, w, np.array([[0.1, 0.0, 0.0]]), 1e-11, state)

    def slope(_, y):
        slip = np.array([y[2] + w * y[1], y[3] - w * y[0]])
        drag = 0.15 * 9807.0 / np.linalg.norm(slip) + model.viscous_coefficient / model.inertia
        return [y[2], y[3], *-drag * slip]

    twin = solve_ivp(slope, (0.0, 0.1), begin[:4], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(state[:4], twin, rtol=1e-8)
    assert math.hypot(*state[:2]) > 5.0 and state[at.RESTS] == 0.0


def test_push_goes_on_from_where_it_was():
    """Tick by tick: the same motion cut into pieces."""
    rows = _withdrawn(TipProfile.move(1.0, 40.0, 2560.0).segments)
    whole, _ = _pushed(PRINTED.model, 89.5, 5.0, rows, 1.0, -0.2)
    state = ring_state(1.0, -0.2, 89.5, 5.0)
    for duration, velocity, acceleration in rows:
        for n in range(4):
            piece = np.array([[duration / 4, velocity + acceleration * duration / 4 * n, acceleration]])
            push_on_table(PRINTED.model.parameters, 89.5, 5.0, piece, 1e-10, state)
    end = complex(state[at.X], state[at.Y]) * np.exp(-1j * 5.0 * state[at.CLOCK])
    assert math.isclose(state[at.CLOCK], rows[:, 0].sum()) and abs(end - whole) < 1e-7


def test_a_slow_push_is_followed_until_the_ring_rests():
    """At 1 mm/s friction would stop a free ring in 3 ms; pressed by the tip it swings, for some 12 ms in a
    half.
    """
    touch = plan_touch(PRINTED, offset=0.1, spindle_speed=1.0, push_speed=1.0)
    state = ring_state(0.1, -touch.angle, 89.5, 1.0)
    where = landing(PRINTED.model, 1.0, touch.push_profile.segments, state, 1e-10)
    later = state.copy()
    push_on_table(PRINTED.model.parameters, 89.5, 1.0, np.array([[0.05, 0.0, 0.0]]), 1e-10, later)
    there = complex(later[at.X], later[at.Y]) * np.exp(-1j * later[at.CLOCK])
    assert state[at.RESTS] == 1.0 and abs(there - where) < 1e-12


def _let_go(share, outward):
    """Where a 0.8 kg ring 8 mm off the axis ends that has left a tip of 5 mm/s outward over the table."""
    model = PRINTED.replace(mass=0.8).model
    w = math.sqrt(share * model.mu_kinetic * 9807.0 / 8.0)
    state = ring_state(8.0, 0.0, 89.5, w)
    state[at.TIP], state[at.RESTS] = 300.0, 0.0
    state[at.V_X] += outward
    landing(model, w, np.array([[1e-3, 5.0, 0.0]]), state, 1e-10)
    return state, w


def test_a_ring_that_the_table_hardly_lets_slow_is_followed_until_it_rests():
    """A tenth of mu_k g is left: a slide from 10 mm/s takes six times as long as on a table at rest."""
    state, w = _let_go(0.9, 10.0)
    assert state[at.RESTS] == 1.0 and state[at.CLOCK] > 5.0 * 10.0 / (0.15 * 9807.0)
    assert w * w * math.hypot(state[at.X], state[at.Y]) < 0.15 * 9807.0  # else it would not have stopped


def test_a_ring_that_is_thrown_off_is_not_said_to_rest():
    """Friction would hold it at rest; once it slides it goes on, and it is not followed for ever."""
    state, w = _let_go(1.1, 10.0)
    usual = 2.0 * 6.0 / (0.15 * 9807.0) + 2.0 * math.pi * math.sqrt(0.8e-3 / 1200.0)
    # twice, where 1/16 of mu_k g is left
    assert state[at.RESTS] == 0.0 and state[at.CLOCK] < 1e-3 + 32.0 * usual + 1e-9
    assert w * w * math.hypot(state[at.X], state[at.Y]) > 1.1 * 0.15 * 9807.0


def test_a_ring_out_of_reach_is_carried_round():
    state = ring_state(3.0, 0.4, 89.5, 6.0)
    state[at.TIP] = 110.0
    push_on_table(PRINTED.model.parameters, 89.5, 6.0, np.array([[0.7, 0.0, 0.0]]), 1e-10, state)
    np.testing.assert_allclose(
        state[[at.X, at.Y]], 3.0 * np.array([math.cos(4.6), math.sin(4.6)]), atol=1e-12
    )
    assert state[at.PEAK_FORCE] == 0.0 and state[at.TOUCH] < 0.0 and state[at.RESTS] == 1.0


def test_a_ring_slides_off_where_the_table_is_too_fast():
    model = PRINTED.model
    for share, rests in ((0.99, 1.0), (1.01, 0.0)):
        w = share * math.sqrt(model.mu_static * 9807.0 / 5.0)
        state = ring_state(5.0, 0.0, 89.5, w)
        state[at.TIP] = 120.0
        push_on_table(model.parameters, 89.5, w, np.array([[0.05, 0.0, 0.0]]), 1e-10, state)
        assert state[at.RESTS] == rests


def test_a_gap_is_met_at_its_time():
    state = ring_state(2.0, 0.0, 89.5, 0.0)
    state[at.TIP] += 1.0
    push_on_table(PRINTED.model.parameters, 89.5, 0.0, np.array([[0.2, 10.0, 0.0]]), 1e-10, state)
    assert math.isclose(state[at.TOUCH], 0.1, abs_tol=1e-10)


def _sideways(problem, offset, w, speed, direction, shape="trapezoid"):
    """Distance from the axis at which the push leads past it, mm."""
    touch = plan_touch(
        problem, offset=offset, spindle_speed=w, push_speed=speed, direction=direction, shape=shape
    )
    start = offset * np.exp(-1j * touch.angle)
    rows = _withdrawn(touch.push_profile.segments) if shape == "trapezoid" else touch.push_profile.segments
    rest = np.vstack((rows, [[0.1, -1.0, 0.0]]))
    end, _ = _pushed(problem.model, 89.5, w, rest, offset, -touch.angle)
    return abs(((end - start) * start.conjugate()).imag) / abs(end - start)


@pytest.mark.parametrize("shape", ["trapezoid", "gentle"])
@pytest.mark.parametrize(("mass", "rpm", "offset", "speed"), CASES)
def test_exact_direction_goes_through_the_axis(mass, rpm, offset, speed, shape):
    """Within 0.3 deg of it; a direction without inertia misses by degrees, about w v/(mu_k g) where the ring
    does not stick.
    """
    problem, w = PRINTED.replace(mass=mass), units.rpm(rpm)
    exact, quasi = (_sideways(problem, offset, w, speed, kind, shape) for kind in ("exact", "quasi-static"))
    assert exact < 0.005 * offset
    assert exact < quasi < 3.0 * w * speed / (0.15 * 9807.0) * offset


def test_drift_is_less_for_more_friction():
    misses = []
    for mu in (0.1, 0.2, 0.4):
        problem = PRINTED.replace(mass=0.8, mu_static=1.3 * mu, mu_kinetic=mu)
        misses.append(_sideways(problem, 1.0, 6.0, 40.0, "quasi-static"))
    assert misses[0] > misses[1] > misses[2]


def test_rows_from_a_travel_on():
    profile = TipProfile.move(2.0, 30.0, 2560.0)
    for travel in (1e-6, 0.05, 1.0, 1.9, 2.0):
        rows = after(profile.segments, travel)
        assert math.isclose(profile_of(rows, 0.0).stroke, travel, rel_tol=1e-7)
        assert math.isclose(
            profile.total_time - rows[:, 0].sum(), profile.total_time - profile_of(rows, 0.0).total_time
        )
        assert math.isclose(
            remaining(profile.segments, profile.total_time - rows[:, 0].sum()), travel, rel_tol=1e-7
        )
    back = np.vstack((profile.segments, [[0.01, 0.0, -100.0], [0.01, -1.0, 0.0]]))
    assert len(forward(back)) == len(profile.segments) and len(after(back, 1.0)) == 4


@settings(max_examples=40, deadline=None)
@example(1.0, 0.021484375, 1.0, 6.0, 6.0, 3.0, 0.5)
@given(
    st.floats(0.5, 70.0),
    st.floats(0.02, 0.4),
    st.floats(1.0, 1.6),
    st.floats(0.0, 10.0),
    st.floats(0.01, 10.0),
    st.floats(1.0, 83.0),
    st.floats(-0.8, 0.8),
)
def test_any_push_keeps_its_invariants(mass, mu, ratio, w, offset, speed, angle):
    """The contact never pulls, no way is shorter than a line, and a ring beyond the friction limit does not rest."""
    model = PRINTED.model.replace(mass=mass, mu_kinetic=mu, mu_static=mu * ratio * (1 + 1e-9))
    rows = _withdrawn(TipProfile.move(min(offset, 2.0), speed, 2560.0).segments)
    state = ring_state(offset, angle, 89.5, w)
    tip = state[at.TIP]
    for row in rows:
        push_on_table(model.parameters, 89.5, w, row[None], 1e-8, state)
        assert state[at.FORCE] >= 0.0 and state[at.WAY] > state[at.FREE_MAX] - 1e-12 >= -1e-12
    assert math.isclose(tip - state[at.TIP], profile_of(rows, 0.0).stroke, abs_tol=1e-9)
    end = complex(state[at.X], state[at.Y]) * np.exp(-1j * w * rows[:, 0].sum())
    assert state[at.WAY] >= abs(end - offset * np.exp(1j * angle)) - 1e-5  # a thousand steps
    if w * w * math.hypot(state[at.X], state[at.Y]) > model.mu_static * 9807.0:
        assert state[at.RESTS] == 0.0
