import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from push_inside import GRAVITY, STARTS, PushProgram, PushTask, Swing, TipState, optimal
from scipy.integrate import solve_ivp

import sdpgrind
from centering import TipProfile, preset, simulate_push
from centering.push import OptimalPush, Part, PushStatus, gentle_profile, minimum_time_push

HEAVY = preset("printed").replace(limits=preset("printed").limits.replace(push_speed_max=40.0))
LIGHT = HEAVY.replace(part=Part(0.8, 30.0))
FITTED = preset("identified").replace(limits=HEAVY.limits)
# mm: difference of the closings at frictions of 0.9 and 1.1
FLOOR = 0.2 * HEAVY.model.coulomb_force / HEAVY.model.contact_stiffness


PROBLEMS = {"heavy": HEAVY, "light": LIGHT, "fitted": FITTED}
COARSE = 0.6  # fineness; the longer segments cost 0.3 % of the time
FINENESS = {"heavy": 1.0, "light": COARSE, "fitted": COARSE}


@cache
def _solved(name, distance, further):
    return minimum_time_push(PROBLEMS[name], distance, **dict(further))


def _push(name="heavy", distance=5.0, **further):
    """Each is solved once."""
    return _solved(name, distance, tuple(sorted(({"fineness": FINENESS[name]} | further).items())))


def _gentle(problem, distance, friction):
    """Time until rest, and stop errors, of the gentle push."""
    profile = gentle_profile(problem.model, distance, problem.limits.push_speed_max)
    traces = [simulate_push(_scaled(problem.model, r), profile) for r in friction]
    rests = [
        max(t for t, mode in zip(e.phases[1:, 0], e.event_mode, strict=True) if mode in ("slip", "free"))
        for e in traces
    ]
    return max(rests), np.array([trace.final_position for trace in traces]) - distance


def _scaled(model, ratio):
    return model.replace(mu_static=ratio * model.mu_static, mu_kinetic=ratio * model.mu_kinetic)


@pytest.mark.parametrize(
    ("name", "distance", "problem", "saved"),
    [("heavy", 5.0, HEAVY, 0.29), ("heavy", 1.0, HEAVY, 0.5), ("light", 1.0, LIGHT, 0.45),
     ("fitted", 5.0, FITTED, 0.35)],
)  # fmt: skip
def test_faster_than_the_gentle_rule_and_nearer(name, distance, problem, saved):
    push = _push(name, distance)
    time, errors = _gentle(problem, distance, push.friction)
    assert push.ok and push.time < (1.0 - saved) * time
    assert np.abs(push.stop_error).max() < 2.52e-3
    if name != "light":  # whose gentle stops are within 0.5 um
        assert np.abs(push.stop_error).max() < np.abs(errors).max()
    assert push.spread < max(
        np.ptp(errors), 1.01 * 0.2 * problem.model.coulomb_force / problem.model.contact_stiffness
    )


def test_no_friction_between_leaves_the_bounds():
    push = _push()
    for ratio in np.linspace(0.9, 1.1, 21):
        trace = simulate_push(_scaled(HEAVY.model, ratio), push.profile)
        assert "free" not in trace.event_mode
        assert abs(trace.final_position - 5.0) < 2.52e-3
        assert trace.final_velocity == 0.0


def test_part_moves_as_an_integrator_says():
    """Neither program nor event simulator: Runge-Kutta over the profile at the greatest friction."""
    push, model = _push(distance=1.0), _scaled(HEAVY.model, 1.1)
    m, k, b, static, kinetic, viscous = model.parameters

    def slope(t, state):
        y, v = float(push.profile.position(t)), float(push.profile.velocity_at(t))
        force = max(k * (y - state[0]) + b * (v - state[1]), 0.0)
        if state[1] <= 0.0 and force <= static:
            return [0.0, 0.0]
        return [state[1], (force - kinetic - viscous * state[1]) / m]

    found = solve_ivp(slope, (0.0, push.rest_time[-1]), [0.0, 0.0], max_step=1e-4, rtol=1e-8, atol=1e-10)
    assert abs(found.y[0, -1] - 1.0 - push.stop_error[-1]) < 2e-5
    assert abs(found.y[1, -1]) < 0.1


@pytest.mark.parametrize(("name", "distance"), [("heavy", 5.0), ("light", 1.0)])
def test_limits_are_kept_and_are_what_holds_the_push_back(name, distance):
    push, limits = _push(name, distance), HEAVY.limits
    speeds = np.concatenate(
        (push.profile.velocity, push.profile.velocity + push.profile.acceleration * push.profile.duration)
    )
    moving = push.profile.duration[:-2].sum()
    assert speeds.max() < limits.push_speed_max * (1 + 1e-6)
    assert np.abs(push.profile.acceleration).max() < limits.acceleration_max * (1 + 1e-6)
    # no jump: 0.1 µm/s
    assert np.abs(push.profile.velocity[1:] - speeds[push.profile.duration.size :][:-1]).max() < 1e-4
    inside = np.linspace(0.0, moving, 20001)
    speed = push.profile.velocity_at(inside)
    acceleration = np.gradient(speed, inside)
    force = push.traces[0].at(np.clip(inside, 0.0, push.rest_time[0])).contact_force.values
    at_limit = (speed > 0.99 * limits.push_speed_max) | (
        np.abs(acceleration) > 0.98 * limits.acceleration_max
    )
    at_margin = force < 0.15 * HEAVY.model.coulomb_force * (1.0 if name == "heavy" else 0.8 / 18.9)
    assert np.mean(at_limit | at_margin) > 0.97


def test_margin_costs_time_and_is_kept():
    """The force between the places where it is watched may be a little less."""
    wide, narrow = _push(), _push(contact_margin=8.0, fineness=COARSE)
    assert narrow.ok and narrow.time > wide.time
    assert narrow.least_force.min() > 7.0 and wide.least_force.min() > 0.7
    # where the force at the least friction is the margin, and tip and part are of one speed
    end = narrow.profile.segments[-5:-2]
    middle = end[:, 1] + 0.5 * end[:, 2] * end[:, 0]
    slowing = 0.9 * HEAVY.model.coulomb_force - 8.0 + HEAVY.model.viscous_coefficient * middle
    assert np.allclose(end[:, 2], -slowing / HEAVY.model.inertia, rtol=0.03)


def test_force_bound_costs_time_and_is_kept():
    hard, soft = _push(), _push(force_max=49.0, fineness=COARSE)
    assert soft.ok and hard.time < soft.time < _gentle(HEAVY, 5.0, (0.9, 1.0, 1.1))[0] * 0.82
    assert soft.peak_force < 49.3 < hard.peak_force


def test_finer_steps_agree():
    """Twice as many segments gain less than the coarser ones promise: 0.2 % of the time."""
    coarse, fine = _push(distance=1.0), _push(distance=1.0, fineness=2.0)
    assert fine.ok and abs(fine.time - coarse.time) < 2e-3 * coarse.time
    assert fine.profile.duration.size > 1.5 * coarse.profile.duration.size


def test_first_guesses_lead_to_one_time(monkeypatch):
    times = []
    for start in STARTS:
        monkeypatch.setattr(optimal, "STARTS", (start,))
        times.append(minimum_time_push(HEAVY, 1.0).time)
    assert abs(times[1] - times[0]) < 3e-3 * times[0]


@pytest.mark.parametrize(("name", "distance"), [("heavy", 5.0), ("heavy", 1.0), ("light", 1.0)])
def test_time_is_between_bounds(name, distance):
    """No faster than a part that has its greatest speed at once and is braked by friction alone; little
    slower.
    """
    push = _push(name, distance)
    problem = PROBLEMS[name]
    for trace, ratio in zip(push.traces, push.friction, strict=True):
        most = trace.part_velocity.max()
        slowing = (
            ratio * problem.model.mu_kinetic * GRAVITY
            + problem.model.viscous_coefficient * most / problem.model.inertia
        )
        assert push.time > (distance - 2.5e-3) / most + 0.5 * most / slowing
    # at rest at both ends, no part
    tip = TipProfile.move(distance, 40.0, problem.limits.acceleration_max).total_time
    assert 0.75 * tip < push.time < 1.1 * tip


def test_parts_in_contact_spread_by_their_contacts():
    """Their difference is a free swing about (F_k,max - F_k,min)/k, and that has died after 5 mm."""
    assert math.isclose(_push().spread, FLOOR, rel_tol=0.01)


def test_creeping_on_beats_the_gentle_rule_at_less_spread():
    """What contact alone does not give: each part sticks and jumps once more, and ends (2 F_k - F_s)/k behind
    the tip.
    """
    push = _push(stop_error_max=1.95e-3)
    time, errors = _gentle(HEAVY, 5.0, push.friction)
    assert push.ok and push.time < 0.88 * time and push.spread < np.ptp(errors) < FLOOR
    for trace in push.traces:
        assert "free" not in trace.event_mode
        last = [k for k, mode in enumerate(trace.event_mode) if mode == "slip"][-1]
        assert "stick" in trace.event_mode[2:last]


def test_bounds_that_nothing_keeps():
    """20 um are less than the contact closes by until the part breaks away and jumps."""
    push = _push(distance=0.02, stop_error_max=5e-4)
    assert push.status is PushStatus.NOT_FOUND and not push.ok
    assert push.profile == gentle_profile(HEAVY.model, 0.02, 40.0)
    assert "NOT_FOUND" in repr(push) and "allow a larger stop error" in push.status


def test_one_friction_stops_where_it_should():
    push = _push(distance=2.0, friction=(1.0,), stop_error_max=1e-4, fineness=COARSE)
    assert push.ok and push.friction.tolist() == [1.0] and push.spread == 0.0
    assert abs(push.stop_error[0]) < 1.2e-4


def test_early_touch_is_borne():
    """The rim is known to some 0.3 um: a push that begins 1 um too early or late keeps contact and stops at
    its place.
    """
    push = _push()
    for start in (-1e-3, 1e-3):
        moved = TipProfile(push.profile.duration, push.profile.velocity, push.profile.acceleration, start)
        for ratio in (0.9, 1.1):
            trace = simulate_push(_scaled(HEAVY.model, ratio), moved)
            assert "free" not in trace.event_mode
            assert abs(trace.final_position - start - 5.0) < 2.7e-3


@pytest.mark.parametrize("contact", [0.1, 1.2, 2.5])
def test_step_is_the_solution_of_the_equation(contact):
    """Under- and overdamped: d'' + B d' + d = a + r + kappa v against Runge-Kutta."""
    casadi = pytest.importorskip("casadi")
    task = PushTask(contact, 0.05, 1.3, (1.0,), 10.0, 5.0, 2.0, 0.05, 9.0, 0.1, 1.0, False)
    swing, begin, v, a, r, h = Swing(task), (0.7, 1.9), 2.5, -0.8, 0.9, 1.7
    found = swing.step(TipState(*begin), casadi.DM(v), a, casadi.DM(h), r)

    def slope(t, state):
        closing, speed = state
        tip = v + a * t
        return [tip - speed, closing + contact * (tip - speed) - r - 0.05 * speed]

    truth = solve_ivp(slope, (0.0, h), begin, rtol=1e-11, atol=1e-12).y[:, -1]
    assert np.allclose([float(found.closing), float(found.speed)], truth, atol=1e-8)


def test_program_begins_inside_its_bounds():
    task = PushTask(0.21, 0.02, 1.33, (0.9, 1.1), 200.0, 6.9, 1.7, 0.05, math.inf, 0.1, 1.0, False)
    program = PushProgram(task, STARTS[0])
    lower, start, upper = (np.array(each) for each in (program.lower, program.start, program.upper))
    assert np.all(lower <= start) and np.all(start <= upper)
    h, v, a = program.guess
    assert np.allclose(np.diff(v), a * h)
    assert abs(np.sum(0.5 * (v[1:] + v[:-1]) * h) / 200.0 - 1.0) < 0.05


def test_picture():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    figure = _push().plot()
    assert [axis.get_ylabel() for axis in figure.axes][:2] == ["speed [mm/s]", "contact force [N]"]
    assert len(figure.axes[1].lines) == _push().friction.size
    tip = figure.axes[0].lines[1].get_ydata()
    assert abs(tip.max() - 40.0) < 1e-3


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"distance": 0.0}, r"distance must be > 0 \(mm\); got 0.0"),
        ({"friction": ()}, r"friction must be one or more ratios > 0 \(1\); got \(\)"),
        ({"friction": (0.0, 1.0)}, "friction must be one or more ratios > 0"),
        ({"friction": (1.0, math.nan)}, r"friction\[1\] must be finite \(1\); got nan"),
        ({"contact_margin": -1.0}, r"contact_margin must be >= 0 \(N\); got -1.0"),
        (
            {"contact_margin": 26.0},
            "contact_margin must be < 25.02, the least Coulomb force, which has to brake the part",
        ),
        ({"stop_error_max": 0.0}, r"stop_error_max must be > 0 \(mm\); got 0.0"),
        (
            {"force_max": 30.0},
            r"force_max must be > the margin and 40.78, which the part breaks away at \(N\); got 30.0",
        ),
        ({"fineness": 0.0}, r"fineness must be > 0 \(1\); got 0.0"),
    ],
)
def test_bad_input(change, told):
    with pytest.raises(ValueError, match=told):
        minimum_time_push(**({"problem": HEAVY, "distance": 1.0} | change))


def test_only_problems_are_solved():
    with pytest.raises(TypeError, match="problem must be a CenteringProblem; got 3"):
        minimum_time_push(3, 1.0)


@pytest.mark.parametrize("status", PushStatus)
def test_a_fastest_push_is_kept_in_a_file(tmp_path, status):
    """By value and with its traces: nothing is searched or simulated again."""
    push = dataclasses.replace(_push(), status=status)
    push.save(tmp_path / "push.nc")
    again = sdpgrind.load(tmp_path / "push.nc")
    assert type(again) is OptimalPush and again == push and hash(again) == hash(push)
    assert again.status is status and again.traces == push.traces
    assert again != dataclasses.replace(push, steps=push.steps + 1)
    data = push.dataset
    assert np.array_equal(data["friction"], push.friction) and np.array_equal(
        data["stop_error"], push.stop_error
    )
    told = {
        name: data[name].attrs["units"]
        for name in ("stop_error", "rest_time", "least_force", "velocity", "distance")
    }
    assert told == dict(zip(told, ("mm", "s", "N", "mm/s", "mm"), strict=True))
