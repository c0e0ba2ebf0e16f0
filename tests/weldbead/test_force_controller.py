"""Following a plan: the same bits in step and batch, limits, loss of contact, blends, set-points."""

import copy
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import units
from sdpgrind.weldbead import force

LOOP = force.PI.design(crossover=units.hz(3.0))
K = LOOP.plant.contact_stiffness
QUIET = LOOP.plant.replace(sensor=force.SensorChain(noise_sd=0.0, quantum=0.0))


def plan_of(hertz=0.5, mean=45.0, size=15.0, duration=13.0, stiffness=K):
    t = np.arange(0, duration, 0.004)
    wanted = mean + size * np.sin(units.hz(hertz) * t)
    return SimpleNamespace(
        time=t, normal_force=wanted, fly_height=5.0 - wanted / stiffness, center_x=20.0 * t - 30
    )


PLAN = plan_of()


def by_steps(controller, **options):
    """The same simulation with the public `step`."""
    return force.simulate_loop(_Stepwise(controller), **options)


class _Stepwise(force.ForceController):
    """Not the class itself, so that the simulation calls `step`."""

    def __init__(self, other):
        self.__dict__.update(copy.deepcopy(other).__dict__)


@pytest.mark.parametrize(
    "options", [{}, {"feedforward": False}, {"blend": 0.4}, {"limits": force.Limits(command_rate_max=1.5)}]
)
def test_step_and_batch_give_the_same_bits(options):
    controller = force.ForceController(PLAN, LOOP, **options)
    plant = LOOP.plant.replace(drive=force.table_drive("appendix-b"))
    batch = force.simulate_loop(controller, duration=3.0, plant=plant, runs=2, rng=5)
    steps = by_steps(controller, duration=3.0, plant=plant, runs=2, rng=5)
    assert np.array_equal(batch.command, steps.command)
    assert np.array_equal(batch.force, steps.force)
    assert np.array_equal(batch.reading, steps.reading)
    assert not np.array_equal(batch.reading[0], batch.reading[1])


def test_perfect_model_needs_no_correction():
    """With a true model the reading is the one foreseen: no correction, and force = plan but for the lag's
    curvature.
    """
    controller = force.ForceController(PLAN, LOOP.replace(plant=QUIET))
    record = force.simulate_loop(controller, duration=6.0, plant=QUIET)
    position = controller.trajectory(len(record.command[0]))[1]
    assert np.abs(record.command[0] - position)[90:].max() < 2e-3
    assert record.error_rms(after=1.5)[0] < 0.06
    alone = force.simulate_loop(
        force.ForceController(PLAN, LOOP, feedforward=False), duration=6.0, plant=QUIET
    )
    assert alone.error_rms(after=1.5)[0] > 1.0


def test_feedback_removes_what_the_plan_does_not_know():
    """A surface 0.1 mm higher than planned: 7.6 N at first, nothing after a second, and the correction says
    -0.1 mm.
    """
    controller = force.ForceController(plan_of(size=0.0), LOOP.replace(plant=QUIET))
    record = force.simulate_loop(
        controller, duration=4.0, plant=QUIET, surface=lambda t: np.where(t > 1.0, 0.1, 0.0)
    )
    jump = record.force[0, np.searchsorted(record.time, 1.01)] - 45.0
    assert jump == pytest.approx(0.1 * K, rel=0.02)
    assert record.force[0, -1] == pytest.approx(45.0, abs=0.01)
    assert record.command[0, -1] + 5.0 - 45.0 / K == pytest.approx(-0.1, abs=1e-3)


@pytest.mark.parametrize("stiffness_error", [0.85, 1.15])
def test_blend_between_force_and_height(stiffness_error):
    """Blend 0 ends at the planned force, 1 at the planned height, in between in between."""
    plant = QUIET.replace(contact_stiffness=stiffness_error * K)
    ends = []
    for blend in (0.0, 0.3, 0.7, 1.0):
        controller = force.ForceController(plan_of(size=0.0), LOOP.replace(plant=QUIET), blend=blend)
        ends.append(float(force.simulate_loop(controller, duration=6.0, plant=plant).force[0, -1]))
    assert ends[0] == pytest.approx(45.0, abs=0.01)
    assert ends[3] == pytest.approx(45.0 * stiffness_error, rel=1e-6)
    assert np.all(np.diff(ends) * np.sign(stiffness_error - 1) > 0)


def test_limits_hold_and_nothing_winds_up():
    limits = force.Limits(command_min=-4.6, command_max=-4.1, command_rate_max=2.0)
    controller = force.ForceController(PLAN, LOOP, limits=limits)
    plant = QUIET.replace(contact_stiffness=0.5 * K)  # the highest command makes 34.2 N
    record = force.simulate_loop(controller, duration=8.0, plant=plant)
    assert record.command.max() == -4.1
    assert record.command.min() >= -4.6
    assert np.abs(np.diff(record.command[0])).max() <= 2.0 / 60 + 1e-12
    wanted, held = controller.trajectory(480)[0], record.command[0] == -4.1
    reach = 0.5 * K * 0.9
    falls = np.flatnonzero((wanted[1:] < reach) & (wanted[:-1] >= reach)) + 1
    assert len(falls) >= 3
    for k in falls:  # it leaves its limit when less is wanted than the limit gives
        assert held[k - 20]
        assert not held[k + 8]


def test_without_contact_it_creeps_up_and_lands_softly():
    """The surface falls 2 mm away: frozen law, limited approach, and no thrust when the contact is back."""
    limits = force.Limits(approach_rate_max=1.5, patience=4)
    controller = force.ForceController(plan_of(size=0.0), LOOP.replace(plant=QUIET), limits=limits)
    record = force.simulate_loop(
        controller, duration=8.0, plant=QUIET, surface=lambda t: np.where(t > 1.0, -2.0, 0.0)
    )
    loose = np.flatnonzero(record.force[0] == 0.0)
    loose = loose[record.time[loose] > 1.0]
    first, last = record.time[loose[0]], record.time[loose[-1]]
    # the law itself closes most of the gap until it knows that the contact is lost
    assert 0.3 < last - first < 1.0
    speed = np.diff(record.command[0]) * 60
    air = slice(int((first + 0.15) * 60), int(last * 60) - 1)
    assert speed[air] == pytest.approx(1.5, abs=1e-9)
    assert record.force[0][record.time > last].max() < 45 * 1.25
    assert record.force[0, -1] == pytest.approx(45.0, abs=0.5)
    hasty = force.ForceController(
        plan_of(size=0.0), LOOP.replace(plant=QUIET), limits=limits.replace(patience=100_000)
    )
    bang = force.simulate_loop(
        hasty, duration=8.0, plant=QUIET, surface=lambda t: np.where(t > 1.0, -2.0, 0.0)
    )
    assert bang.force[0][bang.time > 1.1].max() > record.force[0][record.time > last].max() + 2


def test_runout_with_loss_of_contact_keeps_the_mean_force():
    """0.4 mm of runout at 42 Hz, play 4.8 N, contact lost a third of the time: stable, mean force right."""
    plan = plan_of(mean=15.0, size=0.0)
    plant = QUIET.replace(drive=QUIET.drive.replace(play=4.8 / K))
    controller = force.ForceController(plan, LOOP.replace(plant=QUIET))
    record = force.simulate_loop(
        controller, duration=12.0, plant=plant, surface=lambda t: 0.4 * np.sin(units.hz(42.0) * t)
    )
    kept = record.force[0][record.time > 4.0]
    assert 0.25 < np.mean(kept == 0.0) < 0.5
    assert kept.mean() == pytest.approx(15.0, abs=0.3)


def test_missing_reading_holds_the_correction():
    controller = force.ForceController(plan_of(size=0.0), LOOP)
    for _ in range(20):
        last = controller.step(force=40.0)["platform_command"]
    held = [controller.step(force=np.nan)["platform_command"] for _ in range(5)]
    assert held == pytest.approx([last] * 5, abs=1e-12)
    after = controller.step(force=40.0)["platform_command"]  # and goes on as if nothing had been
    assert after - last == pytest.approx(LOOP.law.core.C[0] * 5.0, rel=1e-9)


def test_place_or_clock_or_count_tell_the_time():
    told = (
        {"pass_time": 2.0},
        {"center_x": 20.0 * 2.0 - 30},
        {"pass_time": 7.0, "center_x": 20.0 * 2.0 - 30},
    )
    commands = [
        force.ForceController(PLAN, LOOP).step(force=np.nan, **say)["platform_command"] for say in told
    ]
    assert commands == pytest.approx([commands[0]] * 3, abs=1e-12)
    counted = force.ForceController(PLAN, LOOP)
    for _ in range(121):
        command = counted.step(force=np.nan)["platform_command"]
    assert command == pytest.approx(commands[0], abs=1e-12)
    lag = LOOP.plant.lag
    assert commands[0] == pytest.approx(-float(np.interp(2.0 + lag, PLAN.time, PLAN.fly_height)), abs=1e-12)


def test_lead_in_before_the_plan():
    """The disc comes from before the plan's start: no demand, no creeping, then the plan at its place."""
    plan = plan_of(size=0.0)
    controller, free = force.ForceController(plan, LOOP), -plan.fly_height[0]
    for k in range(60):  # one second of air, 20 mm before the plan's first place
        command = controller.step(force=0.0, pass_time=k / 60, center_x=-50.0 + k / 3)["platform_command"]
        assert command == pytest.approx(free, abs=2e-2 if k > 56 else 1e-12)
        assert controller.report()["force_reference"] == pytest.approx(0.0, abs=20.0 if k > 56 else 1e-9)


def test_noise_of_the_gauge_is_no_noise_of_the_plan():
    """0.01 mm of noise at 20 mm/s is 0.5 ms; the clock of the samples takes two thirds of it away."""
    rng, controller, times = np.random.default_rng(0), force.ForceController(PLAN, LOOP), []
    for k in range(300):
        controller.step(force=np.nan, center_x=20.0 * k / 60 - 30 + 0.01 * rng.normal())
        times.append(controller._time - k / 60)
    assert np.std(times[50:]) < 0.5e-3 * 0.4
    slow = force.ForceController(PLAN, LOOP)
    for k in range(300):  # a feed 10 % slower than planned: the place counts
        slow.step(force=np.nan, center_x=18.0 * k / 60 - 30)
    assert slow._time == pytest.approx(0.9 * 299 / 60, abs=0.01)


def test_set_points_are_a_plan():
    given_one, told = force.ForceController(PLAN, LOOP), force.ForceController(None, LOOP)
    assert set(told.reads) - set(given_one.reads) == {
        "plan_time",
        "normal_force_plan",
        "fly_height_plan",
        "center_x_plan",
        "face_leaves_plan",
    }
    points = {
        "plan_time": PLAN.time,
        "normal_force_plan": PLAN.normal_force,
        "fly_height_plan": PLAN.fly_height,
        "center_x_plan": PLAN.center_x,
    }
    for k in range(10):
        one = given_one.step(force=40.0 + k, pass_time=k / 60)
        copied = {name: value.copy() for name, value in points.items()}
        assert told.step(force=40.0 + k, pass_time=k / 60, **copied) == one
    higher = points | {"fly_height_plan": PLAN.fly_height + 1.0}
    fresh = force.ForceController(SimpleNamespace(**vars(PLAN) | {"fly_height": PLAN.fly_height + 1.0}), LOOP)
    assert told.step(force=40.0, pass_time=0.0, **higher) == fresh.step(force=40.0, pass_time=0.0)


def test_new_pass_forgets_the_last():
    controller = force.ForceController(PLAN, LOOP)
    first = [controller.step(force=30.0, pass_time=k / 60) for k in range(10)]
    assert [controller.step(force=30.0, pass_time=k / 60) for k in range(10)] == first  # the clock went back
    controller.reset()
    assert [controller.step(force=30.0, pass_time=k / 60) for k in range(10)] == first
    controller.follow(PLAN)
    assert controller.step(force=30.0, pass_time=0.0) == first[0]


def test_copies_and_pickles_go_their_own_way():
    controller = force.ForceController(PLAN, LOOP)
    controller.step(force=30.0)
    twin, sent = copy.deepcopy(controller), pickle.loads(pickle.dumps(controller))
    ahead = [controller.step(force=20.0) for _ in range(5)]
    assert [twin.step(force=20.0) for _ in range(5)] == ahead
    assert [sent.step(force=20.0) for _ in range(5)] == ahead


@settings(deadline=None, max_examples=20)
@given(st.lists(st.floats(-100, 400), min_size=1, max_size=60), st.floats(0.5, 5.0))
def test_no_reading_breaks_the_limits(readings, rate):
    limits = force.Limits(command_min=-5.2, command_max=-4.0, command_rate_max=rate)
    controller = force.ForceController(PLAN, LOOP, limits=limits)
    commands = np.array([controller.step(force=value)["platform_command"] for value in readings])
    assert np.all((commands >= -5.2) & (commands <= -4.0))
    assert np.all(np.abs(np.diff(commands)) <= rate / 60 + 1e-12)


def test_reports_what_it_foresees():
    controller = force.ForceController(plan_of(size=0.0), LOOP)
    controller.step(force=45.0)
    report = controller.report()
    assert report["force_demand"] == 45.0
    assert report["force_reference"] == pytest.approx(45.0, abs=1e-9)
    assert report["correction"] == pytest.approx(0.0, abs=1e-12)
    assert set(report) == set(controller.reports)


def bad(**changes):
    return SimpleNamespace(
        **{"time": [0.0, 1.0], "normal_force": [10.0, 20.0], "fly_height": [1.0, 1.0]} | changes
    )


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda: force.ForceController(bad(normal_force=[10.0, -3.0]), LOOP),
            ValueError,
            r"normal_force\[1\] must be >= 0 \(N\); got -3\.0",
        ),
        (
            lambda: force.ForceController(bad(normal_force=[10.0, 95.0]), LOOP),
            ValueError,
            r"normal_force\[1\] must be <= force_max = 90 \(N\); got 95\.0",
        ),
        (
            lambda: force.ForceController(bad(problem=SimpleNamespace(normal_force_max=15.0)), LOOP),
            ValueError,
            r"normal_force\[1\] must be <= force_max = 15 \(N\); got 20\.0",
        ),
        (
            lambda: force.ForceController(bad(time=[0.0, 0.0]), LOOP),
            ValueError,
            r"time\[1\] must be > time\[0\] = 0 \(s\); got 0\.0",
        ),
        (
            lambda: force.ForceController(bad(fly_height=[1.0]), LOOP),
            ValueError,
            r"fly_height must be as long as time \(2 entries\)",
        ),
        (
            lambda: force.ForceController(bad(fly_height=[1.0, np.nan]), LOOP),
            ValueError,
            r"fly_height\[1\] must be finite \(mm\)",
        ),
        (lambda: force.ForceController(object(), LOOP), TypeError, "plan must have the arrays time"),
        (lambda: force.ForceController(PLAN, "loop"), TypeError, "loop must be a ForceLoop"),
        (
            lambda: force.ForceController(PLAN, LOOP, blend=1.5),
            ValueError,
            r"blend must be in \[0, 1\]; got 1\.5",
        ),
        (
            lambda: force.ForceController(PLAN, LOOP, feedforward=False, blend=0.5),
            ValueError,
            "blend must be 0 without feedforward",
        ),
        (
            lambda: force.ForceController(None, LOOP).step(force=1.0),
            ValueError,
            "plan must be given before the first step",
        ),
        (
            lambda: force.Limits(command_min=1.0, command_max=0.0),
            ValueError,
            r"command_max must be > command_min = 1 \(mm\); got 0\.0",
        ),
        (
            lambda: force.Limits(command_rate_max=0.0),
            ValueError,
            r"command_rate_max must be > 0 \(mm/s\); got 0\.0",
        ),
        (
            lambda: force.simulate_loop(
                force.ForceController(PLAN, LOOP),
                duration=1.0,
                plant=QUIET.replace(sensor=force.SensorChain(sample_time=0.01)),
            ),
            ValueError,
            r"sample_time must be the controller's 0\.0166667 in the plant \(s\); got 0\.01",
        ),
    ],
)
def test_messages(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_an_infinite_reading_is_none():
    """It holds the correction, as a missing one does, and does not poison what follows."""
    commands = []
    for bad in (float("nan"), float("inf"), float("-inf")):
        controller = force.ForceController(PLAN, LOOP)
        commands.append(
            [controller.step(force=value)["platform_command"] for value in (30.0, 28.0, bad, 31.0, 30.0)]
        )
    assert np.all(np.isfinite(commands))
    np.testing.assert_array_equal(commands[1], commands[0])
    np.testing.assert_array_equal(commands[2], commands[0])
