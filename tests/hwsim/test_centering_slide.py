"""The centering machine's slide and spindle, how late it follows under load, its gauges."""

from math import isnan, pi, sqrt

import numpy as np
import pytest
from centering_fakes import RADIUS, STILL, at, constant, exact, move, running, started
from centering_machine_inside import FOLLOWING, MASSES, lag_time, lag_times, slots
from scipy.integrate import solve_ivp

from centering.circle import circle_reading
from hwsim import ProbeErrors

LOOP = 2 * pi * 825.0


def far(**changes):
    """A part whose ring is out of the way of the slide."""
    return started(exact(ring=at(1.0), start_gap=20.0, **changes))


def slide_of(part):
    return float(part._state[slots.REFERENCE] + part._state[slots.LAG])


def test_the_velocity_loop_has_lost_3_db_at_825_hz():
    """Its own step response, transformed: H(iw) = 1 + iw * integral of (h - 1) e^{-iwt}; closed form
    1/sqrt(2) at f_n.
    """
    cell = np.zeros(slots.SETTINGS)
    cell[slots.LOOP], cell[slots.DAMPING] = LOOP, sqrt(0.5)
    time = np.linspace(0.0, 8e-3, 16_001)
    step = np.array([slots.loop_at(cell, 0.0, 0.0, 1.0, each)[1] for each in time])
    gain = 1 + 1j * LOOP * np.trapezoid((step - 1) * np.exp(-1j * LOOP * time), time)
    assert abs(gain) == pytest.approx(sqrt(0.5), rel=1e-4)


@pytest.mark.parametrize("target", [0.5, 60.0, -120.0])
def test_the_slide_is_that_of_an_integrator_of_its_equations(target):
    """a' = w^2 (v_set - v) - 2 z w a, the acceleration held at its greatest while that points further out."""
    part = far()
    begun = slide_of(part)
    part.step({"velocity": target}, 0)

    def twin(_, s):
        jerk = LOOP**2 * (target - s[1]) - 2 * sqrt(0.5) * LOOP * s[2]
        stuck = abs(s[2]) >= 2560.0 and jerk * s[2] > 0
        return [s[1], s[2], 0.0 if stuck else jerk]

    def full(_, s):
        return abs(s[2]) - 2560.0

    def back(_, s):
        return LOOP * (target - s[1]) - 2 * sqrt(0.5) * s[2]

    full.terminal = back.terminal = True
    now, state, end = 0.0, np.array([0.0, 0.0, 0.0]), 0.06
    for event in (full, back, None):
        done = solve_ivp(twin, (now, end), state, events=event, rtol=1e-10, atol=1e-10, max_step=1e-4)
        now, state = float(done.t[-1]), done.y[:, -1]
        if now >= end:
            break
    part.move_to(end)
    assert begun - slide_of(part) == pytest.approx(state[0], abs=1e-6)
    assert part._state[slots.VELOCITY] == pytest.approx(target, abs=1e-6)


def test_the_slide_keeps_to_its_limits_however_it_is_commanded():
    part, rng = far(), np.random.default_rng(3)
    speeds, rates, places = [], [], []
    for k in range(300):
        part.step({"velocity": float(rng.choice([-500.0, -3.0, 0.0, 40.0, 500.0]))}, 0)
        if slide_of(part) < RADIUS + 12:
            part.step({"velocity": -500.0}, 0)
        part.move_to((k + 1) * 3e-3)
        speeds.append(part._state[slots.VELOCITY])
        rates.append(part._state[slots.ACCELERATION])
        places.append(slide_of(part))
    assert np.abs(speeds).max() <= 120.0 * (1 + 1e-3) and np.abs(rates).max() <= 2560.0 * (1 + 1e-8)
    assert np.abs(np.diff(speeds)).max() <= 2560.0 * 3e-3 * (1 + 1e-9)
    travelled = -np.diff(places)
    assert np.all(
        np.abs(travelled) <= np.maximum(np.abs(speeds[:-1]), np.abs(speeds[1:])) * 3e-3 + 2560.0 * 3e-3**2
    )


def test_a_profile_is_followed_to_its_end_and_begins_at_its_angle_inside_a_tick():
    part = started(exact(ring=at(1.0), start_gap=20.0), 2.0)
    rows, begun = move(7.5, 250.0 / 3.0), slide_of(part)
    part.step({"profile": rows, "profile_angle": 0.1001}, 50)  # 0.05005 s
    assert slide_of(part) == begun and part.step({}, 0)["pushing"] == 0.0
    part.step({}, 1)
    assert begun - slide_of(part) == pytest.approx(0.5 * 2560 * (0.051 - 0.05005) ** 2, abs=1e-12)
    assert part.step({}, 0)["pushing"] == 1.0
    part.step({}, 122)
    assert part.step({}, 0)["pushing"] == 0.0  # 0.122552 s
    assert begun - slide_of(part) == pytest.approx(7.5, abs=1e-9)
    part.step({}, 100)
    assert begun - slide_of(part) == pytest.approx(7.5, abs=1e-9)


def test_a_profile_that_waits_is_replaced_or_taken_back_and_one_that_runs_is_not():
    part = started(exact(ring=at(1.0), start_gap=20.0), 2.0)
    part.step({"profile": move(1.0, 50.0), "profile_angle": 0.2}, 10)
    part.step({"profile": move(2.0, 50.0), "profile_angle": 0.1}, 10)
    begun = slide_of(part)
    part.step({}, 40)
    part.step({"profile": move(9.0, 50.0), "profile_angle": 0.0}, 200)  # comes while the other runs
    assert begun - slide_of(part) == pytest.approx(2.0, abs=1e-9) and part.outcome()["pushes"] == 1.0
    part.step({"profile": move(1.0, 50.0), "profile_angle": 1.0}, 10)
    part.step({"profile": np.zeros((0, 3))}, 500)
    assert part.outcome()["pushes"] == 1.0
    part.step({"profile": move(1.0, 50.0), "profile_angle": 0.3}, 100)  # passed: begins at once
    assert part.outcome()["pushes"] == 2.0


@pytest.mark.parametrize("speed", [0.0, 30.0, -30.0])
def test_the_speed_that_a_slide_has_is_not_dropped_when_a_profile_begins_or_jumps(speed):
    """It joins the profile at 2560 mm/s^2: a twin in steps of 5 us, and the way that it gains or loses in
    closed form.
    """
    part = running(far(), speed)
    # a jump of 40 mm/s after the first
    rows = np.array([[0.02, 0.0, 1000.0], [0.05, 60.0, 0.0], [0.05, 60.0, -800.0]])
    begun, step = slide_of(part), 5e-6
    part.step({"profile": rows}, 0)
    velocity, place, twin, seen, speeds = speed, begun, [], [], []
    for k in range(24_000):
        row = int(np.searchsorted(np.cumsum(rows[:, 0]), (k + 0.5) * step))
        wanted = rows[row, 1] + rows[row, 2] * ((k + 1) * step - rows[:row, 0].sum())
        after = velocity + np.clip(wanted - velocity, -2560.0 * step, 2560.0 * step)
        place, velocity = place - 0.5 * (velocity + after) * step, after
        if (k + 1) % 200 == 0:
            part.move_to((k + 1) * step)
            twin.append(place)
            seen.append(slide_of(part))
            speeds.append(part._state[slots.VELOCITY])
    np.testing.assert_allclose(seen, twin, rtol=0, atol=5e-6)
    assert np.abs(np.diff([speed, *speeds])).max() <= 2560.0 * 1e-3 * (1 + 1e-9)
    off = speed**2 / (2 * (2560.0 + np.sign(speed) * 1000.0)) * np.sign(speed) - 40.0**2 / (2 * 2560.0)
    assert begun - slide_of(part) == pytest.approx(0.2 + 3.0 + 2.0 + off, abs=1e-9)


def test_the_spindle_ramps_at_its_acceleration():
    part = far()
    part.step({"spindle_speed": 5.0}, 200)
    assert (part._state[slots.SPEED], part._state[slots.ANGLE]) == pytest.approx((2.0, 0.2), rel=1e-12)
    part.step({}, 800)
    assert part._state[slots.SPEED] == 5.0
    assert part._state[slots.ANGLE] == pytest.approx(1.25 + 2.5, rel=1e-12)
    part.step({"spindle_speed": 0.0}, 2000)
    assert part._state[slots.SPEED] == 0.0 and part._state[slots.ANGLE] == pytest.approx(5.0, rel=1e-12)


def test_the_lag_is_the_least_squares_of_the_source_s_table():
    table = np.array(FOLLOWING)
    slopes = [np.linalg.lstsq(table[:, :1] / 60, table[:, k] / 1000, rcond=None)[0][0] for k in (1, 2)]
    np.testing.assert_allclose(lag_times(), slopes, rtol=1e-12)
    error = np.outer(table[:, 0] / 60, lag_times()) * 1000 - table[:, 1:]
    assert np.sqrt((error**2).mean(axis=0)) == pytest.approx([3.45, 13.31], abs=0.01)  # um
    assert [lag_time(mass) for mass in MASSES] == pytest.approx(lag_times(), rel=1e-12)
    assert lag_time(0.01) > 0.0


def test_a_loaded_slide_lags_by_its_speed_and_arrives_all_the_same():
    ends = {}
    for scheduled in (True, False):
        part = running(started(exact(ring=at(5.0), start_gap=1e-9, gain_scheduling=scheduled)), 20.0)
        begun = slide_of(part)
        part.step({"profile": np.vstack([constant(20.0, 0.1), [[0.01, 20.0, -2000.0]]])}, 99)
        ends[scheduled] = begun - slide_of(part)
        part.step({}, 100)
        assert begun - slide_of(part) == pytest.approx(2.1, abs=1e-9)
    assert ends[True] == pytest.approx(1.98, abs=1e-9)
    assert ends[True] - ends[False] == pytest.approx(20.0 * lag_time(18.9), rel=1e-9)  # forty time constants


def test_a_slide_that_touches_nothing_does_not_lag():
    part = running(far(gain_scheduling=False), 20.0)
    begun = slide_of(part)
    part.step({"profile": constant(20.0, 0.1)}, 50)
    assert begun - slide_of(part) == pytest.approx(1.0, abs=1e-12)


def test_slide_and_probe_together_are_the_reading_while_table_and_slide_move():
    part = started(exact(ring=at(3.0, 2.0), start_gap=9.0, tip_radius=3.75), 1.0)
    part.step({"velocity": 2.0}, 0)
    for _ in range(20):
        seen = part.step({}, 37)
        true = circle_reading(seen["angle"], RADIUS, sqrt(13.0), np.arctan2(2.0, 3.0), 3.75)
        assert seen["slide"] + seen["probe"] == pytest.approx(true, abs=1e-9)
        assert seen["probe"] < 0.0 and seen["time"] == pytest.approx(seen["angle"], rel=1e-12)
    assert seen["slide"] == pytest.approx(slide_of(part), abs=1e-12)


def test_encoders_and_force_sensor_have_steps_and_ends():
    part = running(
        started(exact(ring=at(5.0), start_gap=1e-9, errors=ProbeErrors(noise_sd=0.0, runout=0.0)), 0.7), 110.0
    )
    seen = part.step({"profile": constant(110.0, 0.02)}, 3)
    steps = {
        "angle": 2 * pi / 4000,
        "slide": 2e-5,
        "probe": 5e-5,
        "force": 892 / 4096,
        "peak_force": 892 / 4096,
    }
    for name, step in steps.items():
        assert seen[name] / step == pytest.approx(round(seen[name] / step), abs=1e-6)
    part.step({}, 10)
    assert part.step({}, 10)["peak_force"] <= 446.0 and part.outcome()["peak_force"] > 446.0


def test_the_peak_is_of_the_time_since_the_sample_before():
    part = started(exact(ring=at(5.0), start_gap=1e-9))
    peaks = [
        part.step({"profile": constant(20.0, 0.05)} if not k else {}, 10)["peak_force"] for k in range(12)
    ]
    assert max(peaks) == pytest.approx(part.outcome()["peak_force"]) and peaks[0] > 20.0
    assert peaks[-1] == pytest.approx(part._state[slots.FORCE], abs=1e-9)  # the tip still leans on the ring


def test_noise_is_that_of_the_scatter_and_runout_that_of_the_roller():
    scatter = STILL.__class__(0.0, 0.0, 0.0, 0.0, 3e-4)
    part = started(exact(ring=at(0.0), scatter=scatter, errors=ProbeErrors(noise_sd=4e-4, runout=0.0)))
    read = [sum(part.step({}, 1)[name] for name in ("slide", "probe")) for _ in range(3000)]
    assert np.std(read) == pytest.approx(5e-4, rel=0.04)
    errors = ProbeErrors(noise_sd=0.0, runout=1.5e-3, counts=0, probe_quantum=0.0, slide_quantum=0.0)
    part = started(exact(ring=at(0.0), errors=errors, tip_radius=3.75), 1.0)
    read = [sum(part.step({}, 1)[name] for name in ("slide", "probe")) for _ in range(1000)]
    assert np.ptp(read) == pytest.approx(3e-3, rel=1e-3)


def test_beyond_its_stroke_the_probe_says_nothing():
    part = running(started(exact(ring=at(1.0), start_gap=25.01)), 1.0)
    assert isnan(part.step({}, 0)["probe"])
    assert part.step({"profile": constant(1.0, 0.1)}, 20)["probe"] == pytest.approx(-24.99)
