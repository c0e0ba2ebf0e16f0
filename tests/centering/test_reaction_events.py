"""Pushes of any part by any tip: they end, they keep the energy, and small steps come nearer and nearer to
them.
"""

from math import exp, log

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reaction_twins import stepped_push, tip_at
from scipy.integrate import solve_ivp

from centering import TipProfile, preset, simulate_push
from centering.push import simulate_pushes


def span(low, high):
    return st.floats(log(low), log(high)).map(exp)


@st.composite
def pushes(draw):
    mass, k = draw(span(0.5, 70.0)) / 1e3, draw(span(50.0, 5000.0))
    weight = mass * 9807.0
    viscous = draw(st.one_of(st.just(0.0), st.floats(0.0, 1.0)))
    # the last: critical
    damping = draw(st.one_of(st.just(0.0), st.floats(0.0, 3.0), st.just(2.0 * np.sqrt(mass * k))))
    kinetic = draw(st.floats(0.03, 0.5))
    static = kinetic * draw(st.one_of(st.just(1.0), st.floats(1.0, 2.5)))
    parameters = np.array([mass, k, damping, static * weight, kinetic * weight, viscous])
    n = draw(st.integers(1, 5))
    numbers = st.lists(st.floats(-1.0, 1.0), min_size=n, max_size=n)
    duration = [0.041 + 0.039 * x for x in draw(numbers)]
    speed = [25.0 + 65.0 * x for x in draw(numbers)]
    acceleration = [2560.0 * x for x in draw(numbers)]
    start = draw(st.sampled_from([0.0, -0.2]))
    return parameters, TipProfile(np.array(duration), np.array(speed), np.array(acceleration), start)


@settings(max_examples=150, deadline=None)
@given(pushes())
def test_any_push_ends_and_keeps_its_energy(push):
    parameters, profile = push
    trace = simulate_push(parameters, profile)
    assert trace.energy_balance <= 1e-9
    assert trace.contact_force.min() >= 0.0
    assert np.all(np.diff(trace.part_position) >= -1e-12)
    assert trace.peak_force >= trace.contact_force.max() * (1 - 1e-12)
    assert 0.0 <= trace.free_slide <= trace.final_position + 1e-12
    assert np.all(np.diff(trace.phases[:, 0]) >= 0.0)


@settings(max_examples=40, deadline=None)
@given(pushes())
def test_small_steps_come_to_the_same_place(push):
    parameters, profile = push
    trace = simulate_push(parameters, profile)
    rest = max(trace.duration - profile.total_time, 0.0) + 0.005 if profile.final_velocity <= 0.0 else 0.0
    errors = []
    for step in (8e-6, 1e-6):
        stepped = stepped_push(parameters, profile.segments, profile.start, step, int(rest / step))
        errors.append(abs(stepped[0] - trace.final_position))
    assert errors[1] < max(0.4 * errors[0], 3e-4 * abs(trace.final_position), 2e-4)


@pytest.mark.parametrize("name", ["printed", "identified"])
def test_small_steps_converge_at_first_order(name):
    """The typical error of a dozen pushes: that of one depends on where an event lies between two steps."""
    parameters = preset(name).model.parameters
    profiles = [
        TipProfile.move(2.0, v, 2560.0).then(TipProfile.move(-0.5, v, 2560.0))
        for v in np.linspace(12.0, 60.0, 12)
    ]
    exact = simulate_pushes(parameters, profiles)
    steps = 1.6e-5 / 4.0 ** np.arange(5)
    errors = np.empty((steps.size, len(profiles), 3))
    for i, step in enumerate(steps):
        for j, profile in enumerate(profiles):
            stepped = stepped_push(parameters, profile.segments, 0.0, step, int(0.05 / step))
            errors[i, j] = np.abs(stepped[[0, 1, 2]] - exact[j, :3])
    typical = np.median(errors, axis=1)
    for column, least in enumerate((0.85, 0.85, 0.8)):  # final position, slide, peak force
        assert np.polyfit(np.log(steps), np.log(typical[:, column]), 1)[0] > least, typical
    assert np.all(typical[-1] < (2e-6, 1e-5, 1e-4)), typical[-1]


def terminal(function, direction):
    """An event that ends an integration."""

    def event(t, s):
        return function(t, s)

    event.terminal, event.direction = True, direction
    return event


def integrated_events(parameters, profile):
    """Times of the modes by scipy: each phase integrated with its events, to 1e-12."""
    mass, k, b, static, coulomb, viscous = parameters

    def force(t, s):
        y, v = tip_at(profile.segments, profile.start, t)
        return k * (y - s[0]) + b * (v - s[1])

    def gap(t, s):
        return tip_at(profile.segments, profile.start, t)[0] - s[0]

    laws = {
        "stick": (
            lambda t, s: (0.0, 0.0),
            [(lambda t, s: force(t, s) - static, 1, "slip"), (force, -1, "rest")],
        ),
        "slip": (
            lambda t, s: (s[1], (force(t, s) - coulomb - viscous * s[1]) / mass),
            [(force, -1, "free"), (lambda t, s: s[1], -1, "stick")],
        ),
        "free": (
            lambda t, s: (s[1], -(coulomb + viscous * s[1]) / mass),
            [(lambda t, s: min(k * gap(t, s), force(t, s)), 1, "slip"), (lambda t, s: s[1], -1, "rest")],
        ),
    }
    t, state, mode, found = 0.0, [0.0, 0.0], "stick", []
    while t < profile.total_time and mode != "rest":
        found.append((t, mode))
        law, events = laws[mode]
        watched = []
        for function, direction, _ in events:
            watched.append(terminal(function, direction))
        run = solve_ivp(
            law,
            (t, profile.total_time),
            state,
            "DOP853",
            events=watched,
            rtol=1e-12,
            atol=1e-13,
            max_step=1e-3,
        )
        t, state = run.t[-1], run.y[:, -1]
        hit = [i for i, times in enumerate(run.t_events) if times.size]
        if not hit:
            break
        mode = events[hit[0]][2]
        if mode in ("stick", "rest"):
            state[1] = 0.0
    return found


@pytest.mark.parametrize(
    ("name", "speed"), [("printed", 100.0 / 3.0), ("identified", 50.0 / 3.0), ("identified", 1.5)]
)
def test_event_times_against_an_integrator(name, speed):
    parameters = preset(name).model.parameters
    profile = TipProfile.constant_speed(speed, 0.2)
    trace = simulate_push(parameters, profile)
    found = integrated_events(parameters, profile)
    assert tuple(mode for _, mode in found) == trace.event_mode
    np.testing.assert_allclose(trace.event_time, [t for t, _ in found], atol=1e-9)
    assert len(found) >= 4


@pytest.mark.parametrize("damping", [0.999999, 1.0, 1.000001])
def test_critical_damping_is_no_seam(damping):
    mass, k = 0.0008, 80.0
    b = 2.0 * damping * np.sqrt(mass * k)
    out = [
        simulate_pushes(np.array([mass, k, c, 1.6, 1.2, 0.0]), TipProfile.move(2.0, 40.0, 2560.0))[0]
        for c in (b, b * (1 + 1e-9))
    ]
    # all but the energy residual
    np.testing.assert_allclose(np.delete(out[0], 5), np.delete(out[1], 5), rtol=1e-6)


def test_a_graze_is_not_missed():
    """The speed of the part touches nothing by a hair: found or not as the closed form says."""
    model = preset("printed").model.replace(contact_damping=0.0, viscous_coefficient=0.0)
    rate = np.sqrt(model.contact_stiffness / model.inertia)
    swing = (model.breakaway_force - model.coulomb_force) / model.contact_stiffness
    lift = model.coulomb_force / model.contact_stiffness  # the force falls to 0 where the swing exceeds this
    just = rate * np.sqrt(lift**2 - swing**2)
    for factor, leaves in ((1 - 1e-9, False), (1 + 1e-9, True)):
        trace = simulate_push(model, TipProfile.constant_speed(float(just * factor), 0.1))
        assert ("free" in trace.event_mode) is leaves


def test_jumps_of_the_tip_speed_decide_the_mode_anew():
    model = preset("printed").model
    there = TipProfile.constant_speed(10.0, 0.002)
    jump = there.then(TipProfile.constant_speed(60.0, 0.01))  # b times the jump is 50 N, above breaking away
    assert simulate_push(model, jump).event_mode[:2] == ("stick", "slip")
    assert simulate_push(model, jump).breakaway_time == 0.002
    # k delta is 24 N, b times the jump 40 N
    back = there.then(TipProfile(np.array([0.01]), np.array([-30.0]), np.zeros(1)))
    trace = simulate_push(model, back)
    assert trace.event_mode == ("stick", "rest", "rest")
    assert trace.final_position == 0.0


def test_a_tip_that_comes_back_before_the_spring_is_clear():
    model = preset("printed").model.replace(contact_damping=5.0)
    away = TipProfile(np.array([0.0015, 0.004]), np.array([5.0, -8.0]), np.array([0.0, 6000.0]))
    trace = simulate_push(model, away)
    again = trace.event_mode.index("rest")
    assert trace.event_mode[again + 1] == "stick"
    assert trace.phases[again + 1, 5] > 0.0  # the gap never opened
    k, b = model.contact_stiffness, 5.0
    assert k * trace.phases[again + 1, 5] + b * trace.phases[again + 1, 3] == pytest.approx(0.0, abs=1e-9)


def test_too_many_phases_are_told():
    model = preset("printed").model.replace(mass=0.05, contact_stiffness=20_000.0, contact_damping=0.0)
    with pytest.raises(
        ValueError,
        match=r"a push must have at most 200000 phases; push 0 has more: make it shorter or faster",
    ):
        simulate_pushes(model, TipProfile.constant_speed(0.01, 1000.0))
