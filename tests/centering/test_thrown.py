"""A ring that the table throws: seen by the probe, the table stops, the cycle begins again once."""

from math import nan

import numpy as np
import pytest
from cycle_twins import PlainStrategy
from push_inside import PartView, cycle_controller, felt_model

from centering import CenteringController, CycleSettings, preset
from centering.cycle import CycleState
from centering.cycle._control.slip_watch import SlipWatch
from hwsim import CenteringMachine, Ring

PROBLEM = preset("printed").replace(mass=0.8, radius=44.45)
STILL = PROBLEM.scatter.replace(friction_part_sd=0.0, friction_push_sd=0.0)

SEEN = [(0.27, 5), (0.22, 5)]  # factor of friction, thrown parts seen


def followed(friction, offset=8.0, seed=2, every=0, time_max=8.0):
    """States of a cycle, its last command, and the outcome of the part; the probe drops each `every`th reading."""
    machine = CenteringMachine(
        PROBLEM,
        truth=felt_model(PROBLEM.model, friction),
        scatter=STILL,
        start_offset=offset,
        time_max=time_max,
    )
    part, controller = machine.start(np.random.default_rng(seed)), CenteringController(PlainStrategy(PROBLEM))
    reading, states, command = part.step({}, 0), [], {}
    while not part.done:
        dropped = every and len(states) % every == 0
        command = controller.step(**reading | ({"probe": nan} if dropped else {}))
        states.append(int(controller.report()["state"]))
        reading = part.step(command, 10)
    return states, command, part.outcome()


def test_a_thrown_part_begins_again_on_a_slower_table():
    """At 0.27 of the friction told 530 mm/s^2 are held; the run-up alone asks for 445 at the rim."""
    states, _, outcome = followed(0.27)
    assert outcome["slipped"] == 1.0
    assert CycleState.REFOLLOW in states and states[-1] == CycleState.CENTERED
    assert outcome["finished"] == 1.0 and outcome["collisions"] == 0.0


@pytest.mark.parametrize(("friction", "least"), SEEN)
def test_the_share_of_thrown_parts_that_is_seen(friction, least):
    """Of the parts 2 to 8; a slip that a push follows at once is not seen; the tip hits none."""
    runs = [followed(friction, seed=seed, time_max=2.0) for seed in range(2, 9)]
    slipped = [states for states, _, outcome in runs if outcome["slipped"]]
    assert sum(CycleState.REFOLLOW in states for states in slipped) >= least
    assert len(slipped) >= 6 and sum(outcome["collisions"] for *_, outcome in runs) == 0.0


def test_a_slip_that_is_not_seen_is_mended_by_the_pushes():
    """With each third reading lost pushes come before two readings tell of a slip: 4 of 7 parts finished."""
    outcomes = [followed(0.27, seed=seed, every=3)[2] for seed in range(2, 9)]
    assert sum(outcome["slipped"] for outcome in outcomes) >= 5
    assert all(outcome["finished"] and not outcome["collisions"] for outcome in outcomes)


def test_lobes_of_a_ring_at_rest_are_no_throw():
    for seed in range(6):
        rng = np.random.default_rng(seed)
        lobes = {upr: (0.002, rng.uniform(0.0, 6.0)) for upr in (2, 3, 5)}
        ring = Ring(44.45, rng.uniform(0.1, 10.0), lobes=lobes)
        part = CenteringMachine(PROBLEM, ring=ring, time_max=2.0).start(rng)
        controller, reading = CenteringController(PlainStrategy(PROBLEM)), part.step({}, 0)
        while not part.done:
            reading = part.step(controller.step(**reading), 10)
            assert controller.report()["state"] not in (CycleState.REFOLLOW, CycleState.THROWN)


def test_after_a_collision_the_table_stops():
    controller = CenteringController(PlainStrategy(PROBLEM))
    part = CenteringMachine(PROBLEM, start_offset=6.0, scatter=STILL).start(np.random.default_rng(2))
    reading = part.step({}, 0)
    while reading["spindle_speed"] < 2.0:
        reading = part.step(controller.step(**reading), 10)
    command = controller.step(**reading | {"force": 100.0})
    assert controller.report()["state"] == CycleState.COLLISION
    most = PROBLEM.limits.spindle_acceleration_max
    assert command["spindle_speed"] == 0.0 and command["spindle_acceleration"] == most
    assert command["retract"] == 1.0 and command["velocity"] == 0.0


def test_a_part_that_is_thrown_too_often_is_given_up_with_the_table_stopped(monkeypatch):
    monkeypatch.setattr(cycle_controller, "_THROWS", 0)
    states, command, outcome = followed(0.27)
    assert states[-1] == CycleState.THROWN == 13 and CycleState.THROWN.failed
    assert command["spindle_speed"] == 0.0 and command["retract"] == 1.0
    assert outcome["said_finished"] == 0.0 and outcome["slipped"] == 1.0


@pytest.mark.parametrize("every", (0, 3))
def test_a_part_that_stays_is_not_thrown(every):
    """At 60 samples a turn each third one is always at the same angles: a push may be due at one of these."""
    states, _, outcome = followed(1.0, seed=4, every=every)
    assert CycleState.REFOLLOW not in states and outcome["finished"] == 1.0


def test_without_a_reading_the_table_gains_no_speed_and_stops_in_the_end():
    controller = CenteringController(PlainStrategy(PROBLEM))
    part = CenteringMachine(PROBLEM, start_offset=6.0, scatter=STILL).start(np.random.default_rng(2))
    reading = part.step({}, 0)
    while reading["spindle_speed"] < 2.0:
        reading = part.step(controller.step(**reading), 10)
    blind = reading | {"probe": nan}
    command = controller.step(**blind | {"time": reading["time"] + 0.01})
    assert command["spindle_speed"] == pytest.approx(reading["spindle_speed"])
    command = controller.step(**blind | {"time": reading["time"] + CycleSettings().lost_after + 0.02})
    assert command["spindle_speed"] == 0.0 and command["retract"] == 1.0
    assert controller.report()["state"] == CycleState.LOST


def test_the_expected_reading_is_that_of_the_ring():
    view, rng = PartView(60.0, CycleSettings(tip_radius=3.0), 1e-4), np.random.default_rng(0)

    def reading(angle):
        across = 2.0 * np.sin(0.7 - angle)
        return 2.0 * np.cos(0.7 - angle) + np.sqrt(63.0**2 - across**2) - 3.0

    for k in range(80):
        view.take(0.05 * k, reading(0.05 * k) + 1e-4 * rng.standard_normal())
    off, sd = view.missed(4.1, reading(4.1))
    assert abs(off) < 3e-4  # a noise of 0.1 um, and some 0.1 um of the fit
    assert sd == pytest.approx(np.hypot(0.02, 2e-3 * 2.0), rel=0.1)  # form and angle
    assert view.missed(4.1, reading(4.1) + 0.1)[0] == pytest.approx(0.1, abs=3e-4)


def test_noise_and_dust_are_no_throw():
    rng, watch = np.random.default_rng(1), SlipWatch()
    off = 0.002 * rng.standard_normal(20_000)
    off[::10] += 0.05  # dust under every tenth sample
    assert not any(watch.leaves(float(one), 0.002) for one in off)
