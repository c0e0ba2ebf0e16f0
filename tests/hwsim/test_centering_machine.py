"""The centering machine: tasks, outcomes, copies, runs, refusals."""

import copy
from math import nan
from typing import ClassVar

import numpy as np
import pytest
from centering_fakes import RADIUS, Follower, at, center, constant, exact, move, problem, started
from centering_machine_inside import kernels, lag_time, same, slots, source_tasks

import hwsim
from centering import PrintedController, TipProfile
from centering.circle import plot_centers
from hwsim import CenteringMachine, Recording, Scheduler, Task


def slow(execution, jitter=0.0, **more):
    """One task that takes its time."""
    return Scheduler([Task("control", 0.01, execution_time=execution, jitter=jitter), *more.values()])


def test_the_sample_is_taken_at_the_start_and_the_command_takes_effect_at_the_end():
    part = exact(ring=at(1.0), start_gap=20.0, scheduler=slow(0.004)).start(np.random.default_rng(0))
    first = part.step({"profile": constant(10.0, 1.0)}, 10)
    assert first["time"] == 0.01
    gone = 10.0 * 0.006 - 10.0**2 / (2 * 2560.0)  # it has to gather speed
    assert first["slide"] == pytest.approx(RADIUS + 21.0 - gone, abs=1e-9)


def test_a_late_start_is_told_by_the_time_of_the_sample():
    part = exact(ring=at(1.0), start_gap=20.0, scheduler=slow(0.001, jitter=0.005)).start(
        np.random.default_rng(0)
    )
    part.step({"profile": constant(10.0, 5.0)}, 10)
    begun = None
    for k in range(2, 30):
        seen = part.step({}, 10)
        assert k * 0.01 <= seen["time"] < k * 0.01 + 0.005
        begun = begun or seen["slide"] + 10.0 * seen["time"]
        assert seen["slide"] + 10.0 * seen["time"] == pytest.approx(begun, abs=1e-9)


def test_a_missed_release_is_a_step_that_is_not_made():
    part = exact(ring=at(1.0), start_gap=20.0, scheduler=slow((0.006, 0.005))).start(np.random.default_rng(1))
    times = [part.step({}, 10)["time"] for _ in range(200)]
    assert part.time > 2000 and max(np.diff(times)) >= 0.0199 and part.outcome()["overruns"] > 0
    assert part.outcome()["worst_response"] > 0.01
    assert part.time == 10 * (200 + part.outcome()["overruns"])


def test_the_model_is_refreshed_when_its_task_was_complete():
    model = Task("model", 0.03, priority=2, execution_time=0.001)
    part = exact(ring=at(1.0), scheduler=slow(0.001, model=model)).start(np.random.default_rng(0))
    assert [part.step({}, 10)["refreshed"] for _ in range(7)] == [1, 0, 0, 1, 0, 0, 1]
    alone = exact(ring=at(1.0), scheduler=slow(0.001)).start(np.random.default_rng(0))
    assert alone.step({}, 10)["refreshed"] == 1.0 == started(exact()).step({}, 10)["refreshed"]


def test_tasks_of_the_angle_are_released_by_the_spindle():
    plant = exact(ring=at(1.0), scheduler=source_tasks())
    part = plant.start(np.random.default_rng(0))
    part.step({"spindle_speed": 4.0}, 10)
    while part.time < 2000:
        part.step({}, 10)
    # the ramp lasts 0.4 s, and the command takes about half a millisecond
    turned = 4.0 * (2.0 - 0.2) - 4.0 * 0.0005
    released = part._tasks._core.schedule.report["model"].releases
    assert released == pytest.approx(turned / np.radians(5.0), abs=2)
    assert part.spindle()[0] == pytest.approx(turned, abs=0.01)


def test_a_controller_must_step_with_the_task():
    class Fast(Follower):
        period = 0.005

    with pytest.raises(
        ValueError,
        match=r"period of the controller must be a whole number of those of the task control, 0\.01",
    ):
        hwsim.run(CenteringMachine(problem()), Fast())


@pytest.fixture(scope="module")
def log():
    return hwsim.run(CenteringMachine(problem(mass=0.8)), Follower(), parts=3, rng=7)


def test_a_cycle_is_closed(log):
    out = log.outcome
    assert out.pushes.values.tolist() == [2.0] * 3 and out.said_finished.values.tolist() == [1.0] * 3
    first = np.hypot(out.center_x, out.center_y).values
    assert np.all((first[:, 0] >= 1.0) & (first[:, 0] <= 10.0))
    assert np.all(first[:, 1] < first[:, 0]) and out.offset.values == pytest.approx(first[:, 2], rel=1e-12)
    assert np.all(out.finished.values == (out.offset.values <= 0.0025)) and not out.timed_out.any()
    assert (
        np.all(out.true_mu_static / out.true_mu_kinetic == pytest.approx(4 / 3))
        and out.true_mu_static.values.std() > 0
    )
    assert out.offset.units == "mm" and out.worst_response.units == "s"


def test_parts_begin_within_the_greatest_offset_of_the_problem():
    machine = CenteringMachine(problem(offset_max=0.5))
    first = [
        abs(complex(*machine.start(np.random.default_rng(k))._state[[slots.X, slots.Y]])) for k in range(50)
    ]
    assert 0.05 <= min(first) < 0.1 and 0.45 < max(first) <= 0.5
    assert CenteringMachine(problem(), start_offset=10.0)._offsets == (10.0, 10.0)


def test_numbers_of_many_pushes_do_not_pile_up():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    centers = np.vstack([[8.0, 0.0], [0.0, 3.0], np.full((18, 2), 0.4) + 1e-3 * np.arange(18)[:, None]])
    figure = plot_centers(centers, 0.0025)
    assert sorted(int(text.get_text()) for text in figure.axes[0].texts) == [0, 1, 19]
    pyplot.close(figure)


class Otherwise(Follower):
    """Sends its profile as something else than an array."""

    def __init__(self, made):
        super().__init__()
        self.of = made

    def step(self, **read):
        command = super().step(**read)
        return command | {"profile": self.of(command["profile"])} if "profile" in command else command


@pytest.mark.parametrize(
    "made", [np.ndarray.tolist, lambda rows: TipProfile(*rows.T)], ids=["list", "TipProfile"]
)
def test_a_profile_may_be_a_list_or_a_tip_profile_and_is_logged_like_an_array(log, made):
    other = hwsim.run(CenteringMachine(problem(mass=0.8)), Otherwise(made), parts=3, rng=7)
    np.testing.assert_array_equal(other["push"].profile_command, log["push"].profile_command)
    np.testing.assert_array_equal(other["push"].profile_digest_command, log["push"].profile_digest_command)
    np.testing.assert_array_equal(other.outcome.center_x, log.outcome.center_x)
    assert hwsim.run(Recording(log), Otherwise(made)).outcome.same.item() == 1.0


def test_what_a_controller_needs_to_know_of_a_late_slide():
    assert CenteringMachine(problem()).following_lag == 0.0
    late = CenteringMachine(problem(), gain_scheduling=False)
    assert late.following_lag == lag_time(18.9) and late.replace(mass=0.8).following_lag == lag_time(0.8)


def test_it_fits_and_is_drawn(log):
    assert hwsim.check(CenteringMachine(problem()), Follower())
    pyplot = pytest.importorskip("matplotlib.pyplot")
    figure = log.plot()
    assert "0.8 kg" in figure.get_suptitle() and len(figure.axes) == 4
    paths = [
        line.get_ydata()
        for line in figure.axes[2].lines
        if len(line.get_xdata()) == log.outcome.center_x.shape[1]
    ]
    wanted = 1000 * np.hypot(log.outcome.center_x, log.outcome.center_y).values
    assert {tuple(each) for each in wanted} <= {tuple(each) for each in paths}  # every part, push by push
    pyplot.close(figure)


def test_same_seed_same_log_on_any_number_of_workers(log, processes):
    plant = CenteringMachine(problem(mass=0.8))
    assert same(log, hwsim.run(plant, Follower(), parts=3, rng=7))
    assert same(log, hwsim.run(plant, Follower(), parts=3, rng=7, executor=processes))


def test_it_is_replayed_from_its_recording(log):
    for part in range(3):
        assert hwsim.run(Recording(log, part=part), Follower()).outcome.same.values.tolist() == [1.0]
    other = hwsim.run(Recording(log), Follower(speed=2.5)).outcome.isel(part=0)
    assert str(other.difference_name.values) == "spindle_speed" and float(other.commanded) == 2.5


def test_controllers_get_the_same_parts():
    plant = CenteringMachine(problem(mass=0.8))
    both = hwsim.compare(plant, {"one": Follower(1), "two": Follower(2)}, parts=2, rng=3).outcome
    for name in ("true_mu_static", "center_x", "center_y"):
        values = both[name].values if both[name].ndim == 2 else both[name].values[..., 0]
        np.testing.assert_array_equal(values[0], values[1])


def test_a_copy_goes_on_by_itself():
    part = CenteringMachine(problem(mass=0.8), start_gap=0.5).start(np.random.default_rng(2))
    part.step({"profile": move(3.0, 40.0), "spindle_speed": 3.0}, 30)
    other = copy.deepcopy(part)
    rows = [[each.step({}, 10) for _ in range(20)] for each in (part, other)]
    assert rows[0] == rows[1] and part.outcome()["offset"] == other.outcome()["offset"]


def test_retract_gives_up_and_finished_says_so_and_the_time_runs_out():
    for command, said in (
        ({"retract": 1.0}, 0.0),
        ({"retract": 1.0, "finished": 1.0}, 1.0),
        ({"finished": 1.0}, 1.0),
    ):
        part = started(exact(ring=at(0.002)))
        part.step({}, 25)
        part.step(command, 10)
        outcome = part.outcome()
        assert (
            part.done
            and (outcome["said_finished"], outcome["finished"]) == (said, said)
            and outcome["time"] == 0.025
        )
    part = started(exact(time_max=0.05))
    part.step({}, 2**62)
    assert part.done and part.outcome()["timed_out"] == 1.0 and part.time == 50


def test_the_offset_is_told_once_the_ring_lies_still():
    part = started(exact(ring=at(5.0), start_gap=1e-9))
    part.step({"profile": constant(80.0, 0.2)}, 10)
    assert part._state[slots.MOVING] == 1.0
    moving = center(part)[0]
    part.step({"retract": 1.0}, 10)
    assert kernels.settled(part._state) and center(part)[0] < moving - 0.1
    assert part.outcome()["time"] == 0.01


def test_the_truth_is_the_model_or_drawn():
    of = problem()
    other = of.model.replace(mu_kinetic=0.1)
    assert started(exact(of, truth=other)).outcome()["true_mu_kinetic"] == 0.1
    drawn = exact(of, truth=lambda rng: of.model.replace(mu_kinetic=float(rng.uniform(0.05, 0.15))))
    assert len({started(drawn, seed=k).outcome()["true_mu_kinetic"] for k in range(3)}) == 3
    with pytest.raises(TypeError, match=r"truth\(rng\) must be a PushModel; got 3"):
        started(exact(of, truth=lambda rng: 3))


def test_a_controller_for_another_part_is_refused():
    class Other(Follower):
        job: ClassVar = {"mass": (5.0, "kg")}

    with pytest.raises(ValueError, match=r"its mass is 5\.0 kg, that of the plant 18\.9 kg"):
        hwsim.run(CenteringMachine(problem()), Other())


@pytest.mark.parametrize(
    "changed", ["acceleration_max", "spindle_acceleration_max", "slide_speed_max", "follow_gap"]
)
def test_a_controller_for_another_machine_is_refused(changed):
    of = problem()
    other = of.replace(limits=of.limits.replace(**{changed: 1.5 * getattr(of.limits, changed)}))
    with pytest.raises(ValueError, match=f"its {changed} is "):
        hwsim.run(CenteringMachine(other), PrintedController(of))


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"problem": 3}, TypeError, r"problem must be a CenteringProblem \(see centering\.preset\); got 3"),
        ({"start_offset": 90.0}, ValueError, r"start_offset must be <= offset_max = 10 \(mm\); got 90\.0"),
        (
            {"start_offset": (1.0, 15.0)},
            ValueError,
            r"start_offset must be <= offset_max = 10 \(mm\); got \(1\.0, 15\.0\)",
        ),
        (
            {"start_offset": (3.0, 2.0)},
            ValueError,
            r"start_offset must be of a least and a greatest \(mm\); got \(3\.0, 2\.0\)",
        ),
        ({"start_offset": (3.0, nan)}, ValueError, r"start_offset\[1\] must be finite \(mm\); got nan"),
        ({"start_offset": (3.0,)}, ValueError, r"start_offset must be a number or a pair of them \(mm\)"),
        (
            {"ring": at(1.0, radius=60.0)},
            ValueError,
            r"radius of ring must be that of the part, 89\.5 \(mm\); got 60\.0",
        ),
        ({"ring": 1}, TypeError, r"ring must be a Ring or None; got 1"),
        (
            {"ring": at(1.0), "start_offset": 2.0},
            ValueError,
            "start_offset must be left out with a ring, which says where it lies",
        ),
        (
            {"ring": at(10.5)},
            ValueError,
            r"offset and amplitudes of lobes of ring must be <= offset_max = 10 together \(mm\); got 10\.5",
        ),
        (
            {"ring": at(8.0).replace(lobes={2: (1.5, 0.0), 3: (1.0, 0.0)})},
            ValueError,
            r"offset and amplitudes of lobes of ring must be <= offset_max = 10 together \(mm\); got 10\.5",
        ),
        ({"scatter": 1}, TypeError, r"scatter must be a PushScatter or None; got 1"),
        ({"errors": 1}, TypeError, r"errors must be a ProbeErrors or None; got 1"),
        ({"scheduler": 1}, TypeError, r"scheduler must be a Scheduler or None; got 1"),
        (
            {"scheduler": Scheduler([Task("data", 0.01)])},
            ValueError,
            r"scheduler must be with a task named control",
        ),
        (
            {"tick": 0.003},
            ValueError,
            r"period of the task control must be a whole number of ticks of 3/1000 s \(s\); got 0\.01",
        ),
        ({"tip_radius": -1.0}, ValueError, r"tip_radius must be >= 0 \(mm\); got -1\.0"),
        ({"start_gap": 0.0}, ValueError, r"start_gap must be > 0 \(mm\); got 0\.0"),
        ({"gain_scheduling": 1}, TypeError, r"gain_scheduling must be a bool; got 1"),
        ({"time_max": 0.0}, ValueError, r"time_max must be > 0 \(s\); got 0\.0"),
        ({"truth": 1}, TypeError, r"truth must be a PushModel, a function of rng, or None; got 1"),
    ],
)
def test_bad_machines_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        CenteringMachine(**{"problem": problem(), **options})


def test_a_ring_as_far_out_as_parts_may_be_is_taken():
    assert CenteringMachine(problem(), ring=at(10.0)).ring == at(10.0)
    assert CenteringMachine(problem(), ring=at(8.0).replace(lobes={2: (2.0, 0.0)})).ring.offset == 8.0


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"velocity": nan}, r"velocity must be finite \(mm/s\); got nan"),
        (
            {"spindle_acceleration": 0.0},
            r"spindle_acceleration must be > 0 \(rad/s\^2\); got 0\.0",
        ),
        (
            {"spindle_acceleration": 11.0},
            r"spindle_acceleration must be <= spindle_acceleration_max = 10 \(rad/s\^2\); got 11\.0",
        ),
        ({"spindle_speed": -1.0}, r"spindle_speed must be >= 0 \(rad/s\); got -1\.0"),
        (
            {"spindle_speed": 20.0},
            r"spindle_speed must be <= spindle_speed_max = 10\.472; units\.rpm\(20\) for rev/min \(rad/s\)",
        ),
        ({"profile": [1.0, 2.0, 3.0]}, r"profile must be of shape \(n, 3\): rows of duration"),
        ({"profile": [[0.0, 1.0, 0.0]]}, r"profile\[:, 0\] must be durations > 0 \(s\); got 0\.0"),
        ({"profile": [[1.0, 1.0, nan]]}, r"profile\[2\] must be finite"),
        (
            {"profile": [[0.1, 130.0, 0.0]]},
            r"profile\[:, 1\] must be speeds <= slide_speed_max = 120 \(mm/s\); got 130\.0",
        ),
        (
            {"profile": [[0.1, 0.0, 1300.0]]},
            r"profile\[:, 1\] must be speeds <= slide_speed_max = 120 \(mm/s\); got 130\.0",
        ),
        (
            {"profile": [[0.01, 0.0, 3e3]]},
            r"profile\[:, 2\] must be accelerations <= acceleration_max = 2560 \(mm/s\^2\)",
        ),
        (
            {"profile": move(1.0, 10.0), "profile_angle": nan},
            r"profile_angle must be finite \(rad\); got nan",
        ),
    ],
)
def test_bad_commands_are_refused(command, message):
    with pytest.raises(ValueError, match=message):
        started(exact()).step(command, 10)


def test_the_table_gains_speed_at_the_commanded_acceleration():
    part = exact(ring=at(1.0)).start(np.random.default_rng(0))
    assert part.step({"spindle_speed": 5.0, "spindle_acceleration": 4.0}, 100)["spindle_speed"] == 0.4
    assert part.step({}, 100)["spindle_speed"] == pytest.approx(0.8, rel=1e-12)
    assert part.step({"spindle_acceleration": 10.0}, 100)["spindle_speed"] == pytest.approx(1.8, rel=1e-12)
    held = part._cell[slots.HELD]
    part.step({"spindle_acceleration": 2.0}, 10)
    assert part._cell[slots.HELD] > held  # less of the friction is needed for the spin


def test_a_scheduled_table_learns_of_another_acceleration():
    part = exact(ring=at(1.0), scheduler=source_tasks()).start(np.random.default_rng(0))
    part.step({"spindle_speed": 4.0, "spindle_acceleration": 2.0}, 1000)
    assert part.spindle()[1] == pytest.approx(2.0, abs=0.01)  # the command takes about half a millisecond
    part.step({"spindle_acceleration": 8.0}, 200)
    assert part.spindle()[1] == pytest.approx(3.6, abs=0.02)
