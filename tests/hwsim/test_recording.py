"""Recordings: every kind of machine replayed to the same commands, and the first command that differs."""

import copy
import json
import pickle
import sqlite3
from contextlib import closing
from math import isnan, nan
from typing import ClassVar

import finishing_fakes
import numpy as np
import pytest
from hwsim_fakes import Drain, Tank
from hwsim_inside import Frames, digest
from hwsim_inside import same as log_same
from test_loop import Two

import centering
import hwsim
import sdpgrind
from hwsim import Recording
from sdpgrind import plunge, units, weldbead
from sdpgrind.weldbead import force, passes

PROBLEM = plunge.preset("simulation")


def replayed(log, controller, **options):
    return hwsim.run(Recording(log, **options), controller)


def same(log, controller, **options):
    replay = replayed(log, controller, **options)
    assert replay.outcome.same.values.tolist() == [1.0], replay.outcome
    return replay


def columns_of(log, tier, part=0):
    table = log[tier]
    return table.isel(row=np.flatnonzero(table.part.values == part))


@pytest.mark.parametrize(
    "controller", [plunge.CycleController(PROBLEM), plunge.StagedController(PROBLEM, 0.1, 0.0075)]
)
def test_a_plunge_cycle_is_replayed_row_by_row(controller):
    log = hwsim.run(hwsim.PlungeGrinder(PROBLEM), controller, parts=2, rng=4)
    for part in range(2):
        replay = same(log, controller, part=part)
        was, is_now = columns_of(log, "controller", part), columns_of(replay, "controller")
        np.testing.assert_array_equal(was.command_rate_command, is_now.command_rate_command)
        np.testing.assert_array_equal(was.size, is_now.size)
        np.testing.assert_array_equal(was.time, is_now.time)
        # the last one retracts
        assert replay.outcome.steps[0] == np.isfinite(was.command_rate_command).sum() + 1


@pytest.mark.parametrize("samples_per_turn", [None, 100])
def test_a_probe_is_replayed_by_the_clock_and_by_the_angle(samples_per_turn):
    estimator = centering.GeometryEstimator(noise_sd=0.0012, tip_radius=3.75, confidence=0.999, rel_tol=0.03)
    controller = centering.MeasuringController(estimator)
    log = hwsim.run(hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5), samples_per_turn=samples_per_turn), controller)
    replay = same(log, controller)
    np.testing.assert_array_equal(log["probe"].band_planned, replay["probe"].band_planned)
    np.testing.assert_array_equal(log["probe"].time, replay["probe"].time)


def test_a_finishing_cell_that_ran_whole_is_replayed_in_the_loop():
    of = finishing_fakes.problem()
    controller = finishing_fakes.controller(of)
    log = hwsim.run(finishing_fakes.cell(of), controller)
    replay = same(log, controller)
    np.testing.assert_array_equal(log["controller"].current_command, replay["controller"].current_command)


def test_three_tiers_with_set_points_between_them_are_replayed():
    process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    sequence = weldbead.preset("P4").replace(
        model=process, bead_length=40.0, durations=range(6, 17, 2), stage=2.0, horizon=24.0, force_max=50.0
    )
    x = np.linspace(0, 40, 81)
    bead = passes.Contour(x, 0.4 + 0.05 * np.sin(2 * np.pi * x / 20))
    stand = hwsim.ForceTableStand(passes.PassProblem(disc, bead, mean_cut=0.2, feed_rate=10.0), time=20.0)
    policy = weldbead.plan(sequence, tolerance=None, nodes=51)
    controller = weldbead.Hierarchy(policy, disc, force.PI.design(crossover=units.hz(3.0)))
    log = hwsim.run(stand, controller, rng=1)
    replay = same(log, controller)
    assert replay.tiers == log.tiers
    for tier in log.tiers:
        assert log[tier].sizes == replay[tier].sizes
        for name in log[tier].data_vars:
            np.testing.assert_array_equal(log[tier][name], replay[tier][name])


class Alarmed(Drain):
    """Opens further at the start and at each alarm."""

    commands: ClassVar = {"close": ""}
    reports: ClassVar = {}
    report = None

    def step(self, *, level, **others):
        return {"close": 1.0} if level < 0.5 else {}


def test_a_tier_without_period_is_stepped_at_its_events_again():
    tiers = Two(alarm=Alarmed(), tap=Drain(1.5, period=0.3))
    log = hwsim.run(Tank(leak=0.3), tiers, rng=5)
    assert log["alarm"].sizes["row"] == 3 and log["tap"].sizes["row"] > 20
    replay = same(log, tiers)
    for tier in log.tiers:
        np.testing.assert_array_equal(log[tier].time, replay[tier].time)


def test_a_log_from_a_file_is_replayed(tmp_path):
    log = hwsim.run(hwsim.PlungeGrinder(PROBLEM), plunge.CycleController(PROBLEM))
    log.save(tmp_path / "log.nc")
    same(hwsim.Log.from_file(tmp_path / "log.nc"), plunge.CycleController(PROBLEM))


class Late(Drain):
    """Opens the tap a little further from its third step on."""

    def step(self, **measured):
        return {"flow": super().step(**measured)["flow"] + 0.25 * (self.steps > 2)}


def drained():
    return hwsim.run(Tank(alarm=-1.0), Drain(period=0.5))


def test_the_first_command_that_differs_is_told():
    outcome = replayed(drained(), Late(period=0.5)).outcome.isel(part=0)
    told = [float(outcome[name]) for name in ("same", "steps", "difference_time", "recorded", "commanded")]
    assert told == [0.0, 3.0, 1.0, 2.0, 2.25] and str(outcome.difference_name.values) == "flow"


def test_a_controller_that_steps_too_rarely_differs_where_it_was_silent():
    outcome = replayed(drained(), Drain(period=1.0)).outcome.isel(part=0)
    assert (
        float(outcome.difference_time) == 0.5 and float(outcome.recorded) == 2.0 and isnan(outcome.commanded)
    )


def test_a_controller_that_steps_too_often_differs_where_none_was_recorded():
    outcome = replayed(drained(), Drain(period=0.25)).outcome.isel(part=0)
    assert (
        float(outcome.difference_time) == 0.25 and isnan(outcome.recorded) and float(outcome.commanded) == 2.0
    )


class Told:
    """Commands what it is given, step by step."""

    period = 0.5

    def __init__(self, *commands):
        self.commands_to_come = list(commands)

    def reset(self):
        pass

    def step(self, **measured):
        return self.commands_to_come.pop(0)


@pytest.mark.parametrize(
    ("first", "second", "name", "recorded", "commanded"),
    [
        (np.array([1.0, 2.0]), np.array([1.0, 3.0]), "flow[1]", 2.0, 3.0),
        (np.array([1.0, 2.0]), np.array([1.0]), "flow.size", 2.0, 1.0),
        (np.zeros((3, 2)), np.zeros((4, 2)), "flow", 3.0, 4.0),
        (np.zeros((3, 2)), np.array([[0, 0], [0, 1e-300], [0, 0]]), "flow[1, 1]", 0.0, 1e-300),
        (np.zeros((3, 2)), np.zeros((3, 3)), "flow[0, 2]", nan, 0.0),
        (np.zeros((3, 2)), np.zeros((3, 1)), "flow[0, 1]", 0.0, nan),
        (np.zeros((64, 2)), np.eye(64, 2, -62), "flow[62, 0]", 0.0, 1.0),
        (
            np.zeros((200, 2)),
            np.eye(200, 2, -62),
            "flow_digest",
            digest(np.zeros((200, 2))),
            digest(np.eye(200, 2, -62)),
        ),
    ],
)
def test_arrays_are_compared_entry_by_entry_and_motions_row_by_row_or_by_digests(
    first, second, name, recorded, commanded, monkeypatch
):
    monkeypatch.setattr("hwsim._part.kept_motions.ROWS_MAX", 100)

    class Open(Tank):
        def start(self, rng):
            return Still()

    class Still:
        time, done, event = 0, False, False

        def step(self, command, ticks):
            self.time += ticks
            self.done = self.time >= 10
            return {"level": 1.0}

        def outcome(self):
            return {}

    log = hwsim.run(Open(), Told({"flow": first}, {}))
    assert replayed(log, Told({"flow": first.copy()}, {})).outcome.same[0] == 1
    outcome = replayed(log, Told({"flow": second}, {})).outcome.isel(part=0)
    assert str(outcome.difference_name.values) == name
    np.testing.assert_array_equal((float(outcome.recorded), float(outcome.commanded)), (recorded, commanded))


def test_units_and_names_come_out_of_the_log():
    recording = Recording(drained())
    assert recording.measures == {"time": "s", "level": "mm", "temperature": "K"}
    assert dict(recording.accepts) == {"flow": "mm/s", "flow_command": "mm/s"}
    assert recording.description == {"recorded_plant": "Tank"} and recording.tick == 0.5


def test_it_fits_is_copied_and_pickled():
    recording = Recording(drained())
    assert hwsim.check(recording, Drain(period=0.5))
    for other in (copy.deepcopy(recording), pickle.loads(pickle.dumps(recording))):
        assert hwsim.run(other, Drain(period=0.5)).outcome.same[0] == 1
    # a command that is declared but was never given
    assert "close" in pickle.loads(pickle.dumps(recording.accepts))


def test_a_command_that_was_never_recorded_is_a_difference():
    replay = replayed(drained(), Told({"close": 1.0, "flow": 2.0}))
    outcome = replay.outcome.isel(part=0)
    assert (str(outcome.difference_name.values), float(outcome.commanded)) == ("close", 1.0) and isnan(
        outcome.recorded
    )
    assert replay[replay.tiers[0]].close_command.values[0] == 1.0
    # by a machine it is refused, as before
    with pytest.raises(ValueError, match=r"must be one of flow.*got 'shut'"):
        hwsim.run(Tank(), Told({"shut": 1.0}))


class Pusher:
    """Pushes with a table, once."""

    period = 0.01

    def __init__(self, rows):
        self.rows = np.array(rows)

    def reset(self):
        self.steps = 0

    def step(self, **measured):
        self.steps += 1
        return {2: {"profile": self.rows.copy()}, 30: {"retract": 1.0}}.get(self.steps, {"velocity": 0.0})


ROWS = [[0.02, 0.0, 500.0], [0.1, 10.0, 0.0], [0.02, 10.0, -500.0]]


@pytest.mark.parametrize(("row", "column"), [(0, 0), (1, 1), (2, 2)])
def test_one_number_of_a_profile_is_a_difference(row, column, tmp_path):
    log = hwsim.run(hwsim.CenteringMachine(centering.preset("printed")), Pusher(ROWS), rng=1)
    log.save(tmp_path / "log.nc")
    changed = np.array(ROWS)
    changed[row, column] = np.nextafter(changed[row, column], 1.0)
    for each in (log, hwsim.Log.from_file(tmp_path / "log.nc")):
        same(each, Pusher(ROWS))
        outcome = replayed(each, Pusher(changed)).outcome.isel(part=0)
        assert str(outcome.difference_name.values) == f"profile[{row}, {column}]"
        assert (float(outcome.recorded), float(outcome.commanded)) == (
            ROWS[row][column],
            changed[row, column],
        )
        assert float(outcome.difference_time) == pytest.approx(0.01, abs=1e-4)  # when it was sampled


def without(log, *names):
    """A log as it was written before it held these."""
    tables = {tier: log[tier].drop_vars([name for name in names if name in log[tier]]) for tier in log.tiers}
    return hwsim.Log(lambda: Frames(tables, log.outcome))


def test_a_log_from_before_it_held_rows_is_replayed_by_digests_and_by_numbers_of_rows():
    log = hwsim.run(hwsim.CenteringMachine(centering.preset("printed")), Pusher(ROWS), rng=1)
    for old, tells in (without(log), "profile_digest"), (without(log, "profile_digest_command"), ""):
        same(old, Pusher(ROWS))
        other = replayed(old, Pusher(np.array(ROWS) * 0.9)).outcome
        assert other.difference_name.values.tolist() == [tells] and other.same[0] == (tells == "")
        assert replayed(old, Pusher(ROWS[:2])).outcome.difference_name.values.tolist() == ["profile"]


class Twice(Pusher):
    """Pushes at two of its steps, the second time with fewer rows; takes one back in between, and leaves its
    parts different.
    """

    parts = 0

    def reset(self):
        super().reset()
        Twice.parts += 1

    def step(self, **measured):
        command = super().step(**measured)
        late = {"profile": self.rows[: Twice.parts]} if self.steps == 25 else {}
        return command | late | ({"profile": self.rows[:0]} if self.steps == 20 else {})


def test_the_rows_of_each_push_stand_once_below_each_other(tmp_path):
    Twice.parts = 0
    log = hwsim.run(
        hwsim.CenteringMachine(centering.preset("printed"), scheduler=None),
        Twice(ROWS),
        parts=2,
        rng=1,
        journal=tmp_path / "run.db",
    )
    log.save(tmp_path / "log.nc")
    with hwsim.Journal(tmp_path / "run.db") as journal:
        for each in log, hwsim.Log.from_file(tmp_path / "log.nc"), journal.log():
            rows = each["controller:profile"]
            assert (  # the first push of part 1 is that of part 0
                rows.part.values.tolist() == [0] * 4 + [1] * 2
                and rows.profile_command.units == "s, mm/s, mm/s^2"
            )
            np.testing.assert_allclose(rows.time, [0.01] * 3 + [0.24] + [0.24] * 2, rtol=1e-12)
            np.testing.assert_array_equal(rows.profile_command, ROWS + ROWS[:1] + ROWS[:2])
            assert each.tiers == ("controller",) and log_same(each, log)
    for part in range(2):
        Twice.parts = part
        same(log, Twice(ROWS), part=part)
    short = without(log)
    assert not log_same(short, log) and log_same(without(short), short)


def test_a_run_begun_before_it_held_rows_goes_on(tmp_path):
    """In a journal of version 0.1.0."""
    plant = hwsim.CenteringMachine(centering.preset("printed"))
    hwsim.run(plant, Pusher(ROWS), parts=1, rng=1, journal=tmp_path / "run.db")
    with closing(sqlite3.connect(tmp_path / "run.db")) as database, database:  # the rows come last
        ((names, arrays),) = database.execute("SELECT names, arrays FROM part")
        names = json.loads(names)
        assert [name for name, *_ in names[-2:]] == [
            "controller:profile/time",
            "controller:profile/profile_command",
        ]
        deflated = sum(size for *_, size in names[-2:])
        database.execute(
            "UPDATE part SET names = ?, arrays = ?", (json.dumps(names[:-2]), arrays[:-deflated])
        )
        database.execute("ALTER TABLE part DROP COLUMN digest")
        database.execute("DELETE FROM run WHERE key IN ('begun', 'head', 'acts')")
        database.execute("UPDATE run SET value = '1' WHERE key = 'version'")
    with pytest.warns(sdpgrind.OldFileWarning):
        log = hwsim.run(plant, Pusher(ROWS), parts=2, rng=1, journal=tmp_path / "run.db")
    with closing(sqlite3.connect(tmp_path / "run.db")) as database:  # what 0.1.0 reads: nothing is deflated
        ((names,),) = database.execute("SELECT names FROM part WHERE number = 1")
        assert all(len(entry) == 3 for entry in json.loads(names))
    assert log["controller:profile"].part.values.tolist() == [1] * 3
    same(log, Pusher(ROWS), part=0)
    same(log, Pusher(ROWS), part=1)


def test_a_tier_with_a_colon_is_refused():
    class Colon(Drain):
        tier = "tap:left"

    with pytest.raises(ValueError, match="tier 'tap:left' must have a name without a colon"):
        hwsim.run(Tank(), Colon())


def test_a_minus_before_a_zero_is_no_difference():
    assert (
        digest(np.array([[0.0, -1.0]])) == digest(np.array([[-0.0, -1.0]])) != digest(np.array([[0.0, 1.0]]))
    )
    assert digest(np.arange(6.0).reshape(3, 2).T) == digest(np.array([[0.0, 2.0, 4.0], [1.0, 3.0, 5.0]]))


def test_what_is_no_log_of_one_controller_is_refused():
    with pytest.raises(TypeError, match=r"log must be a Log of hwsim\.run; got 3"):
        Recording(3)
    with pytest.raises(ValueError, match="part must be < the number of parts in the log, 1; got 1"):
        Recording(drained(), part=1)
    both = hwsim.compare(
        Tank(alarm=-1.0), {"one": Drain(period=0.5), "other": Drain(3.0, period=0.5)}, parts=1
    )
    with pytest.raises(ValueError, match="log must be of one controller"):
        Recording(both)
    with pytest.raises(ValueError, match="log must be with a table"):
        Recording(hwsim.run(Tank(leak=1.0), Two()))
