"""Runs of a simulated plant against the clock: equal numbers, and the safe command whatever goes wrong."""

import contextlib
import signal
import sqlite3
import threading
import time
from functools import partialmethod
from typing import ClassVar

import numpy as np
import pytest
from hwsim_fakes import Drain, Faster, Tank, Water, noisy_tank
from live_fakes import (
    INTERRUPT,
    PERIOD,
    TERMINATE,
    Failing,
    asleep,
    broken,
    leaving,
    looping,
    not_a_number,
    unknown,
)

import hwsim
from hwsim._log.labels import Labels
from hwsim._loop.loop import RunSeries, run
from hwsim._part.kept_motions import KeptMotions
from hwsim._part.part import LivePart
from hwsim._report.releases import missed_releases
from sdpgrind import DamagedFileError, plunge, weldbead

pytestmark = pytest.mark.usefixtures("nothing_collected")
SAFE = {"close": 1.0}
TANK = Tank(level=2.0, tick=PERIOD / 2)
LONG = 1.0  # deadline where nothing is to be late, s; above what a busy machine makes a thread wait


def live(**options):
    return hwsim.Live(**{"safe": SAFE, "deadline": LONG, **options})


class Calls(list):
    """Calls of a machine and its copies."""

    def __deepcopy__(self, memo):
        return self


class Watched(Tank):
    """A tank whose machines can be looked at afterwards."""

    machines: ClassVar = []

    def start(self, rng):
        machine = super().start(rng)
        machine.calls = Calls()
        self.machines.append(machine)
        return machine

    def with_tick(self, tick):
        return Watched(self.level, tick, self.alarm, self.leak)


def aborted(wrong, **options):
    """Log of a run that is broken off, and its error."""
    with pytest.raises(hwsim.Aborted) as caught:
        hwsim.run(Watched(level=4.0, tick=PERIOD / 2), Failing(wrong), live=live(**options))
    return caught.value.log, caught.value


def same_numbers(one, other):
    for name in one.outcome:
        np.testing.assert_array_equal(one.outcome[name].values, other.outcome[name].values, str(name))
    for tier in one.tiers:
        for name in one[tier].variables:
            np.testing.assert_array_equal(one[tier][name].values, other[tier][name].values, f"{tier} {name}")


@pytest.mark.parametrize("period", [PERIOD, None])
def test_where_nothing_is_late_the_numbers_are_those_of_a_simulation(period):
    plant = Tank(level=1.0, tick=PERIOD / 2, alarm=0.5, leak=0.5)
    begun = time.monotonic()
    against_clock = hwsim.run(plant, Drain(10.0, period), parts=2, rng=1, live=live())
    lasted = time.monotonic() - begun
    simulated = hwsim.run(plant, Drain(10.0, period), parts=2, rng=1)
    if not against_clock.outcome.overruns.any():  # a busy machine may be late
        same_numbers(simulated, against_clock)
    assert lasted >= simulated.outcome.time.sum()
    assert not against_clock.outcome.aborted.any()
    assert against_clock.outcome.overruns.units == "1"
    assert against_clock["tap"].step_time.units == "s"


@pytest.fixture(scope="module")
def ground():
    """Log of a part that was ground live, in 0.7 s, and the period of its controller."""
    problem = plunge.preset("simulation").replace(stock=0.001)
    grinder, controller = hwsim.PlungeGrinder(problem), plunge.CycleController(problem)
    safe = hwsim.Live(safe={"retract": 1.0}, deadline=1.0)
    return hwsim.run(grinder, controller, live=safe), controller.period


def test_tiers_keep_their_own_grids_in_a_live_hierarchy(ground):
    log, period = ground
    table = log[log.tiers[0]]
    due = np.round(table.time.values / period)
    np.testing.assert_allclose(table.time.values[:-1], due[:-1] * period, rtol=0, atol=1e-12)
    missed = np.diff(due[:-1]) - 1
    np.testing.assert_array_equal(table.overrun.values[1:-1], missed)
    assert float(log.outcome.overruns[0]) == missed.sum()


@pytest.mark.parametrize(
    ("wrong", "by", "said"),
    [
        (broken, "runner", "KeyError: 'sensor'"),
        (leaving, "runner", "SystemExit: 3"),
        (not_a_number, "runner", "flow commanded by tap must be a number"),
        (unknown, "runner", "a command of tap must be one of"),
        (asleep(0.2), "link", "no sign of the controller for more than 100 ms"),
        (looping, "link", "no sign of the controller for more than 100 ms"),
        (INTERRUPT, "link", "SIGINT"),
        (TERMINATE, "link", "SIGTERM"),
    ],
)
def test_whatever_goes_wrong_the_machine_is_made_safe_first(wrong, by, said):
    log, error = aborted(wrong, deadline=0.1)
    calls = Watched.machines[-1].calls
    assert calls[-1] == (SAFE, 0)
    assert float(log.outcome.longest_step[-1]) >= (0.2 if "no sign" in said else 0.0)
    outcome = log.outcome.isel(part=-1)
    assert said in str(error)
    assert said in str(outcome.abort_reason.values)
    assert float(outcome.aborted) == 1.0
    assert str(outcome.safe_by.values) == by
    assert 0.0 <= float(outcome.safe_delay) < 0.3
    assert log["tap"].time.size >= 4  # the rows up to then are kept
    assert hwsim.run(hwsim.Recording(log), Drain(10.0, PERIOD)).outcome.same.all()


def test_signal_handlers_are_put_back():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    aborted(INTERRUPT)
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_missed_releases_are_counted_and_their_log_replays():
    log = hwsim.run(TANK, Failing(asleep(2.4 * PERIOD)), live=live())
    table = log["tap"]
    assert float(table.overrun.max()) >= 2
    assert float(log.outcome.overruns[0]) == table.overrun.sum()
    assert float(log.outcome.longest_step[0]) >= 2.4 * PERIOD
    assert hwsim.run(hwsim.Recording(log), Drain(10.0, PERIOD)).outcome.same.all()
    steps = np.isfinite(table.overrun.values)
    told = (
        f"{table.overrun.values[steps].sum():.0f} of {(table.overrun.values + 1.0)[steps].sum():.0f} releases"
    )
    assert missed_releases(log) == (
        f"{told} missed; the latest step began {1e3 * np.nanmax(table.release_delay):.0f} ms after its release"
    )
    assert missed_releases(hwsim.run(TANK, Drain(10.0, PERIOD))) == ""


def test_a_late_command_takes_effect_when_it_came():
    def opened():
        time.sleep(1.5 * PERIOD)
        return {"flow": 20.0}

    log = hwsim.run(Tank(level=2.5, tick=PERIOD / 2, alarm=-1.0), Failing(opened), live=live())
    level, at = log["tap"].level.values, log["tap"].time.values
    late = int(np.flatnonzero(log["tap"].overrun.values)[0])
    held = (at[late] - at[late - 1]) - (level[late - 1] - level[late]) / 20.0  # flow was 10 for twice as long
    assert held >= 1.5 * PERIOD / 2 - 1e-9


def late():
    time.sleep(3.4 * PERIOD)


def test_a_part_that_ends_within_a_late_step():
    log = hwsim.run(Tank(level=1.3, tick=PERIOD / 2, alarm=-1.0), Failing(late, at=4), live=live())
    on_time = not log["tap"].overrun.values[:4].any()  # a busy machine may delay the first steps
    assert float(log.outcome.time[0]) == pytest.approx(0.13) if on_time else log.outcome.time[0] > 0.13
    assert hwsim.run(hwsim.Recording(log), Drain(10.0, PERIOD)).outcome.same.all()


def test_an_event_within_a_late_step_is_told_when_it_was():
    class Watching(Drain):
        tier, commands = "alarm", {}

        def step(self, **read):
            return {}

    class Alarm(Both):
        def __init__(self, tap):
            self.tiers = {"alarm": Watching(), "tap": tap}

    plant = Tank(level=1.6, tick=PERIOD / 2, alarm=0.75)
    log = hwsim.run(plant, Alarm(Failing(late, at=4)), live=live())
    at = log["alarm"].isel(row=1)
    on_time = not log["tap"].overrun.values[:4].any()
    assert float(at.time) == pytest.approx(0.09) if on_time else at.time > 0.09  # between two releases
    assert float(at.level) == pytest.approx(0.7)
    due = log["tap"].time.values[:-1] / PERIOD
    np.testing.assert_allclose(due, np.round(due), rtol=0, atol=1e-9)
    assert hwsim.run(hwsim.Recording(log), Alarm(Drain(10.0, PERIOD))).outcome.same.all()


def test_a_wait_longer_than_the_deadline_is_no_hang():
    log = hwsim.run(Tank(level=0.4, tick=0.01, alarm=-1.0), Drain(1.0), live=live(deadline=0.3))
    assert not log.outcome.aborted.any()


def test_a_missed_release_can_abort():
    _, error = aborted(asleep(2.4 * PERIOD), overruns="abort")
    assert "a release was missed" in str(error)


def test_an_abort_from_another_thread_during_a_long_wait():
    operator = live()

    class Once(Drain):
        def step(self, **read):
            if operator.state == "running":
                threading.Timer(0.2, lambda: operator.abort("door open")).start()
            return super().step(**read)

        def __deepcopy__(self, memo):
            return self  # and with it the operator

    with pytest.raises(hwsim.Aborted, match="door open") as caught:
        hwsim.run(Tank(level=60.0, tick=0.01, alarm=5.0), Once(1.0), live=operator)
    outcome = caught.value.log.outcome.isel(part=0)
    assert operator.state == "aborted"
    table = caught.value.log["tap"]
    np.testing.assert_array_equal(table.flow_command, [1.0])  # the command that was under way
    assert 0.0 < float(outcome.time) < 10.0  # and not at the event, 55 s later
    assert float(outcome.level) == pytest.approx(60.0 - float(outcome.time), abs=0.01)


def test_an_aborted_live_is_not_used_again():
    operator = live()
    operator.abort("door open")
    with pytest.raises(ValueError, match=r"live must be a new Live: this one was aborted \(door open\)"):
        hwsim.run(TANK, Drain(10.0, PERIOD), live=operator)


def test_paused_between_parts():
    operator, begun = live(), []

    class Seen(Drain):
        def reset(self):
            super().reset()
            begun.append(operator.state)

        def __deepcopy__(self, memo):
            return self

    operator.pause()
    threading.Timer(0.15, operator.resume).start()
    log = hwsim.run(Tank(level=0.5, tick=0.01), Seen(10.0), parts=2, live=operator)
    assert len(log) == 2
    assert "running" in begun[1:]  # the first is the rehearsal
    assert operator.state == "idle"


def test_an_abort_during_a_pause_begins_no_part():
    operator = live()
    operator.pause()
    threading.Timer(0.1, lambda: operator.abort("lunch")).start()
    with pytest.raises(hwsim.Aborted, match="no part was begun: lunch"):
        hwsim.run(TANK, Drain(10.0, PERIOD), live=operator)


def test_an_aborted_part_is_in_the_journal_and_is_run_again_on_a_simulated_plant(tmp_path):
    path = tmp_path / "run.db"
    plant = Tank(level=0.5, tick=PERIOD / 2, leak=0.5)
    broken_off = {"left": 3}

    class Third(Failing):
        def reset(self):
            super().reset()
            broken_off["left"] -= 1

        @property
        def wrong(self):
            return broken if broken_off["left"] == 0 else lambda: None

        @wrong.setter
        def wrong(self, value): ...

        identity = "third"

    with pytest.raises(hwsim.Aborted):
        hwsim.run(plant, Third(None, at=1), parts=3, rng=3, live=live(), journal=path, adapt=None)
    with hwsim.Journal(path) as journal:
        np.testing.assert_array_equal(journal.log().outcome.aborted, [0.0, 1.0])
    whole = hwsim.run(plant, Third(None, at=1), parts=3, rng=3, live=live(), journal=path)
    plain = hwsim.run(plant, Third(None, at=1), parts=3, rng=3)
    np.testing.assert_array_equal(whole.outcome.leak, plain.outcome.leak)
    assert not whole.outcome.aborted.any()


class Stuck(Water):
    """Water that can be closed up to a tick."""

    def step(self, command, ticks):
        if "close" in command and self.time > self.tank.free_until:
            raise ValueError("the valve is stuck")
        return super().step(command, ticks)


class Refusing(Tank):
    """A tank that cannot be closed for long."""

    free_until = 4  # ticks

    def start(self, rng):
        return Stuck(self, 0.0)

    def with_tick(self, tick):
        return Refusing(self.level, tick, self.alarm, self.leak)


def test_a_safe_command_that_the_machine_refuses_is_told():
    with pytest.raises(hwsim.Aborted, match="the safe command was refused: the valve is stuck") as caught:
        hwsim.run(Refusing(level=4.0, tick=PERIOD / 2), Failing(broken), live=live())
    assert str(caught.value.log.outcome.safe_by[0].values) == ""


def test_a_safe_command_that_the_machine_never_takes_is_refused_before_the_first_part():
    class Never(Refusing):
        free_until = -1

        def with_tick(self, tick):
            return Never(self.level, tick, self.alarm, self.leak)

    with pytest.raises(ValueError, match=r"safe must be a command that the machine takes .*valve is stuck"):
        hwsim.run(Never(level=4.0, tick=PERIOD / 2), Drain(10.0, PERIOD), live=live())


def test_a_safe_command_outside_the_range_of_the_plant_is_refused():
    class Ranged(Tank):
        ranges: ClassVar = {"close": (0.0, 0.5)}

        def with_tick(self, tick):
            return Ranged(self.level, tick, self.alarm, self.leak)

    with pytest.raises(ValueError, match=r"safe\['close'\] must be in \[0, 0.5\]; got 1"):
        hwsim.run(Ranged(level=4.0, tick=PERIOD / 2), Drain(10.0, PERIOD), live=live())


def test_a_hang_after_a_long_wait_is_made_safe_where_the_machine_is_by_then():
    plant = Tank(level=2.0, tick=0.01, alarm=1.6)  # an event after 0.4 s
    with pytest.raises(hwsim.Aborted) as caught:
        hwsim.run(plant, Failing(asleep(0.5), at=2, flow=1.0, period=None), live=live(deadline=0.3))
    outcome = caught.value.log.outcome.isel(part=0)
    assert 0.7 <= float(outcome.time) <= 1.1  # 0.4 s of flow, 0.3 s of waiting for the controller
    assert float(outcome.level) == pytest.approx(2.0 - float(outcome.time), abs=0.011)


def test_a_finished_part_is_not_late_however_long_its_outcome_takes():
    class Slow(Tank):
        def start(self, rng):
            machine = super().start(rng)
            found = machine.outcome
            machine.outcome = lambda: time.sleep(0.35) or found()
            return machine

        def with_tick(self, tick):
            return Slow(self.level, tick, self.alarm, self.leak)

    log = hwsim.run(Slow(level=0.5, tick=0.01), Drain(10.0), live=live(deadline=0.3))
    assert float(log.outcome.aborted[0]) == 0.0


def test_a_part_that_was_made_safe_never_counts_as_finished():
    class Heavy(Tank):
        """The safe command ends its part, as that of most machines does."""

        def with_tick(self, tick):
            return Heavy(self.level, tick, self.alarm, self.leak)

    for at in (2, 3):
        with pytest.raises(hwsim.Aborted) as caught:
            hwsim.run(
                Heavy(level=4.0, tick=PERIOD / 2),
                Failing(asleep(0.2), at=at),
                parts=3,
                live=live(deadline=0.1),
            )
        np.testing.assert_array_equal(caught.value.log.outcome.aborted, [1.0])


def test_the_time_of_the_simulated_plant_is_not_the_controllers():
    class Slow(Tank):
        def start(self, rng):
            machine = super().start(rng)
            taken = machine.step

            def step(command, ticks):
                time.sleep(0.15 if machine.time == 4 else 0.0)
                return taken(command, ticks)

            machine.step = step
            return machine

        def with_tick(self, tick):
            return Slow(self.level, tick, self.alarm, self.leak)

    log = hwsim.run(Slow(level=1.0, tick=PERIOD / 2), Drain(10.0, PERIOD), live=live(deadline=0.1))
    assert not log.outcome.aborted.any()


@pytest.mark.parametrize("which", ["verdict", "outcome"])
def test_what_fails_after_the_last_step_keeps_the_rows(which, tmp_path):
    def fail():
        raise KeyError("nothing to say")

    class Broken(Tank):
        def start(self, rng):
            machine = super().start(rng)
            machine.outcome = fail
            return machine

        def with_tick(self, tick):
            return Broken(self.level, tick, self.alarm, self.leak)

    plant, controller = Tank(level=0.5, tick=PERIOD / 2), Drain(10.0, PERIOD)
    if which == "verdict":
        controller.verdict = fail
    else:
        plant = Broken(level=0.5, tick=PERIOD / 2)
    with pytest.raises(hwsim.Aborted, match="nothing to say") as caught:
        hwsim.run(plant, controller, live=live(), journal=tmp_path / "run.db")
    assert caught.value.log["tap"].level.size >= 2
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert journal.parts == 1


def test_a_journal_that_cannot_be_written_does_not_hide_the_abort(tmp_path, monkeypatch):
    def full(*anything):
        raise OSError("disk is full")

    monkeypatch.setattr(hwsim.Journal, "add", full)
    with pytest.raises(hwsim.Aborted) as caught:
        hwsim.run(TANK, Failing(broken), live=live(), journal=tmp_path / "run.db")
    assert "and the journal could not be written: disk is full" in caught.value.__notes__
    assert caught.value.log["tap"].level.size >= 4


def test_a_live_log_has_a_page(ground, tmp_path):
    ground[0].report(tmp_path / "live.html")
    assert (tmp_path / "live.html").stat().st_size > 10_000


def test_no_verdict_about_a_part_that_was_broken_off():
    class Judge(Failing):
        def verdict(self):
            raise AssertionError("there is nothing to judge")

    with pytest.raises(hwsim.Aborted):
        hwsim.run(TANK, Judge(broken), live=live())


class Above(Drain):
    """A slow tier that takes its time."""

    tier = "above"
    commands: ClassVar = {"wish": "mm/s"}

    def step(self, **read):
        time.sleep(0.01)
        super().step(**read)
        return {"wish": 10.0}


class Below(Drain):
    reads: ClassVar = {"level": "mm", "wish": "mm/s"}

    def step(self, *, wish, **read):
        super().step(**read)
        return {"flow": wish}


class Both:
    """Two tiers, the upper one at a third of the rate."""

    def __init__(self):
        self.tiers = {"above": Above(10.0, 3 * PERIOD), "tap": Below(10.0, PERIOD)}

    def reset(self):
        for each in self.tiers.values():
            each.reset()

    period = PERIOD

    def step(self, **read): ...


def test_delays_and_ages_of_a_tier_behind_another_and_the_fastest_leads():
    plant = Tank(level=2.0, tick=PERIOD / 2, alarm=-1.0)
    log = hwsim.run(plant, Both(), live=live())
    tap = log["tap"].isel(row=slice(0, 7))
    late = tap.time.values % (3 * PERIOD) < 1e-9  # behind the tier that takes 10 ms
    assert (tap.release_delay.values[late] >= 0.01).all()
    assert (tap.sample_age.values[late] >= 0.01).all()
    assert (tap.release_delay.values >= 0.0).all()
    missed = log["tap"].overrun.sum() + log["above"].overrun.sum()
    if missed == 0:  # a busy machine may miss some
        np.testing.assert_array_equal(
            log["tap"].time.values[:-1], PERIOD * np.arange(len(log["tap"].time) - 1)
        )
        same_numbers(hwsim.run(plant, Both()), log)


def test_adaptations_never_see_an_aborted_part():
    plant, controller, seen = noisy_tank(), Drain(), Faster()
    series = RunSeries(plant, None, controller, seen, Labels.of(plant, controller), KeptMotions())
    series.learn(LivePart({}, {"aborted": np.array(1.0), "leak": np.array(9.0)}))
    assert seen.total == 0.0


def test_what_the_operator_did_is_in_the_journal(tmp_path):
    operator = live()
    operator.pause(who="night shift")
    threading.Timer(0.1, operator.resume).start()
    hwsim.run(Tank(level=0.5, tick=0.01), Drain(10.0), live=operator, journal=tmp_path / "run.db")
    with hwsim.Journal(tmp_path / "run.db") as journal:
        told = [(act.who, act.what) for act in journal.acts]
    assert told == [("night shift", "pause"), ("program", "resume")]


class GivingUp:
    """An adaptation that pauses the run, and raises."""

    def __init__(self, operator):
        self.operator = operator

    def __deepcopy__(self, kept):
        return self

    def next(self, controller, part_log):
        self.operator.pause(who="night shift")
        raise ArithmeticError("no")


def test_an_act_is_not_lost_with_the_run_that_an_error_of_the_caller_ends(tmp_path):
    operator, path = live(), tmp_path / "run.db"
    tank, tap = Tank(level=0.5, tick=0.01), Drain(10.0)
    with pytest.raises(ArithmeticError):
        hwsim.run(tank, tap, parts=2, live=operator, journal=path, adapt=GivingUp(operator))
    with hwsim.Journal(path) as journal:
        assert [(act.who, act.what, act.part) for act in journal.acts] == [("night shift", "pause", 0)]
    assert operator.unwritten_acts() == ()


def test_acts_are_marked_once_the_journal_has_them():
    class Full:
        full, told = True, ()

        def add(self, number, part, acts):
            if self.full:
                raise OSError("disk full")
            self.told += acts

        note = partialmethod(add, 0, None)

    operator, book = live(), Full()
    series = RunSeries(Tank(), None, Drain(), None, None, KeptMotions(), operator)
    operator.pause()
    for write in (lambda: series._write(book, 0, None), lambda: series._note(book)):
        book.full = True
        with pytest.raises(OSError, match="disk full"):
            write()
        assert len(operator.unwritten_acts()) == 1
        book.full, before = False, len(book.told)
        write()
        assert operator.unwritten_acts() == () and len(book.told) == before + 1
        operator.resume()
    assert [act.what for act in book.told] == ["pause", "resume"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            "UPDATE act SET told = replace(told, 'night', 'early') WHERE number = 0",
            "act 0 of the operator is not as",
        ),
        ("DELETE FROM act WHERE number = 1", "acts of the operator are missing"),
        ("DELETE FROM act WHERE number = 0", "the acts of the operator are not as they were written"),
        ("DELETE FROM run WHERE key = 'acts'", "acts of the operator are missing"),
    ],
)
def test_a_changed_act_is_damage(change, said, tmp_path):
    operator, path = live(), tmp_path / "run.db"
    operator.pause(who="night shift")
    operator.resume()
    hwsim.run(Tank(level=0.5, tick=0.01), Drain(10.0), live=operator, journal=path)
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        database.execute(change)
    with hwsim.Journal(path) as journal, pytest.raises(DamagedFileError, match=said):
        journal.log()
    with hwsim.Journal(path) as journal, pytest.raises(DamagedFileError, match=said):
        _ = journal.acts


def test_a_stop_within_a_pass_lifts_the_wheel():
    stand = hwsim.WeldBeadStand(weldbead.preset("P1"), height=1.0, time=30.0)
    whole, half = (stand.start(np.random.default_rng(1)) for _ in range(2))
    pass_ = {"duration": 8.0, "normal_force": 30.0}
    ticks = round(8.0 / stand.tick)
    whole.step(pass_, ticks)
    half.step(pass_, ticks // 2)
    half.step({"stop": 1.0}, 0)
    ground = [1.0 - each.outcome()["height"] for each in (whole, half)]
    assert half.done
    assert ground[1] == pytest.approx(ground[0] / 2, rel=1e-9)
    assert half.outcome()["passes"] == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"safe": {}},
            r"safe must be the command that makes the machine safe, such as \{'stop': 1.0\}; got \{\}",
        ),
        ({"safe": {"close": float("nan")}}, r"safe\['close'\] must be finite"),
        ({"safe": SAFE, "deadline": 0.0}, r"deadline must be > 0 \(s\)"),
        ({"safe": SAFE, "overruns": "ignore"}, "overruns must be one of"),
        ({"safe": SAFE, "stuck": {"level": 1}}, r"stuck\['level'\] must be"),
        ({"safe": SAFE, "stuck": ["level"]}, r'stuck must be a Mapping, such as {"size": 20}; got .*level'),
        ({"safe": SAFE, "shadow": True}, "safe must not be given in shadow, where nothing is written"),
    ],
)
def test_wrong_options(options, said):
    with pytest.raises((ValueError, TypeError), match=said):
        hwsim.Live(**options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"live": hwsim.Live(safe={"stop": 1.0})},
            "safe must be of commands that the plant accepts: flow, close; got 'stop'",
        ),
        ({"live": True}, r"live must be a Live: hwsim.Live\(safe=...\); got True"),
        ({"live": hwsim.Live(shadow=True)}, "live must not be in shadow on a simulated Tank"),
        ({"live": hwsim.Live(safe=SAFE, stuck={"size": 20})}, "stuck must be of measurements of the plant"),
        ({"live": hwsim.Live(safe=SAFE, stuck={"level": 20})}, "stuck must not be given on a simulated Tank"),
        ({"live": hwsim.Live(safe=SAFE, stale=0.1)}, "stale must not be given on a simulated Tank"),
        ({"live": hwsim.Live(safe=SAFE), "executor": object()}, "executor must be"),
    ],
)
def test_what_cannot_run_live(options, said):
    with pytest.raises((ValueError, TypeError), match=said):
        run(TANK, Drain(10.0, PERIOD), **options)
