"""The source's strategy as a controller."""

import numpy as np
import pytest
from cycle_twins import PlainStrategy
from push_inside import PrintedPlanner

import hwsim
from centering import PrintedController, plan_push, preset
from centering.push import energy_balance_speed, free_slide_table
from hwsim import CenteringMachine
from sdpgrind import units

PROBLEM = preset("printed").replace(mass=0.8, radius=44.45)
MACHINE = CenteringMachine(PROBLEM, start_offset=(1.0, 4.0), scheduler=None)


@pytest.fixture(scope="module")
def log():
    return hwsim.run(MACHINE, PrintedController(PROBLEM), parts=3, rng=0)


def test_light_parts_are_centred_in_about_the_published_pushes(log):
    """8.9 to 10.8 pushes on the real machine, of parts whose mass is not told."""
    assert np.all(log.outcome.said_finished == 1)
    assert 2 <= log.outcome.pushes.mean() <= 25


def test_a_push_takes_about_a_turn(log):
    """0.7 to 1.1 turns at 30 rpm, and with each late trigger one more; the last turn only measures."""
    turns = (log.outcome.time - 2.0) / 2.0 / log.outcome.pushes
    assert 0.5 < float(turns.mean()) < 2.0


def test_the_gap_is_kept_while_following(log):
    table = log["control"]
    following = (table.state_planned == 1) & (table.pushes_planned == 0) & (table.time > 0.5)
    assert float(np.abs(table.probe.values[following.values] + 7.928).mean()) < 1.5


def test_the_first_push_is_that_of_the_formulas(log):
    """Energy balance, free sliding taken off, lead of (5.17): planned again from what was reported."""
    table = log["control"]
    row = np.flatnonzero((table.part.values == 0) & np.isfinite(table.profile_angle_command.values))[0]
    offset = float(table.offset_planned[row])
    slides = free_slide_table(PROBLEM.model)
    speed = slides.augmented_speed(offset, energy_balance_speed(PROBLEM, offset))
    gap = float(table.profile_angle_command[row] - table.offset_angle_planned[row])
    loose = PROBLEM.replace(limits=PROBLEM.limits.replace(stroke_offset_max=20.0))
    lead = float(table.lead_angle_planned[row])
    # of the rim now; the gap at the trigger follows from the fit's
    radius = float(table.slide[row] + table.probe[row])
    assert np.cos(gap + lead) == pytest.approx(1.0, abs=1e-12) and radius > 40.0
    planned = [
        plan_push(loose, offset=offset, follow_gap=at, spindle_speed=units.rpm(30), push_speed=speed, direction="end",
                  timing="printed", stroke_offset=-float(slides.distance_at(speed))).lead_angle
        for at in (6.0, 10.0)
    ]  # fmt: skip
    assert planned[0] < lead < planned[1]


def test_the_correction_is_within_its_limit(log):
    assert np.nanmax(np.abs(log["control"].stroke_offset_planned)) <= PROBLEM.limits.stroke_offset_max


def test_table_speeds_of_another_strategy():
    controller = PrintedController(PROBLEM, scheduled=PlainStrategy(PROBLEM))
    log = hwsim.run(MACHINE.replace(start_offset=3.0), controller, rng=0)
    commanded = log["control"].spindle_speed_command.values
    assert np.nanmax(commanded) > units.rpm(60)
    assert log.outcome.pushes[0] >= 1


def test_constant_push_speed_and_reset():
    controller = PrintedController(PROBLEM, push_speed=units.mm_per_min(500))
    machine = MACHINE.replace(time_max=12.0)
    first = hwsim.run(machine, controller, rng=5).outcome
    assert first.pushes[0] >= 3 and first.identical(hwsim.run(machine, controller, rng=5).outcome)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"spindle_speed": 0.0}, "spindle_speed must be > 0 .rad/s."),
        ({"push_speed": -1.0}, "push_speed must be > 0 .mm/s."),
        ({"push_speed": 600.0}, r"push_speed must be <= push_speed_max = 83.3333 \(mm/s\); got 600"),
        (
            {"spindle_speed": 1000.0},
            r"spindle_speed must be <= spindle_speed_max = 10.472 \(rad/s\); got 1000",
        ),
        ({"timing": "mine"}, "timing must be one of printed, exact"),
    ],
)
def test_bad_input(arguments, message):
    with pytest.raises(ValueError, match=message):
        PrintedController(PROBLEM, **arguments)


def test_what_has_no_speeds():
    with pytest.raises(TypeError, match="scheduled must be a strategy"):
        PrintedController(PROBLEM, scheduled=3.0)


@pytest.mark.parametrize("offset", [7.0, 9.0, 10.0])
def test_a_slide_that_lags_behind_the_rim_still_gets_its_push_away(offset):
    """The rim comes at the greatest scheduled speed: gap and trigger are not those of a slide that keeps up."""
    problem = PROBLEM.replace(radius=61.95)
    controller = PrintedController(problem, scheduled=PlainStrategy(problem), timing="exact")
    log = hwsim.run(CenteringMachine(problem, start_offset=offset, time_max=4.0), controller, parts=3, rng=1)
    assert log.outcome.pushes.values.min() >= 1


def test_a_push_from_a_slide_that_stands_begins_where_it_stands():
    """Two ways: the gap at the trigger follows from the lead here, the approach from the room there."""
    planner = PrintedPlanner(PROBLEM, None, "printed")
    for offset, room in ((6.0, 4.0), (2.0, 0.6), (0.01, 7.0)):
        planner.plan_from(offset, room, 4.0)
        assert planner.push.rough == pytest.approx(room - PROBLEM.limits.safety, abs=1e-9)


def test_a_table_that_was_slowed_for_one_push_is_fast_again_after_it():
    planner = PrintedPlanner(PROBLEM, None, "printed")
    planner.plan(10.0, 1.0, 9.0)
    assert planner.push is None and planner.slower < 1.0
    controller = PrintedController(PROBLEM)
    machine = MACHINE.replace(start_offset=3.0).start(np.random.default_rng(1))
    reading, seen = machine.step({}, 0), []
    controller._planner.slower = 0.5
    while not machine.done and controller.report()["pushes"] < 1:
        command = controller.step(**reading)
        seen.append(command.get("spindle_speed"))
        reading = machine.step(command, 10)
    assert seen[0] == pytest.approx(0.5 * units.rpm(30)) and controller._planner.slower == 1.0


def test_only_what_a_slower_table_cures_is_taken_for_that():
    planner = PrintedPlanner(PROBLEM, 100.0, "printed")
    with pytest.raises(ValueError, match="push_speed must be <= push_speed_max"):
        planner.plan(3.0, 8.0, 3.0)
    assert planner.slower == 1.0
