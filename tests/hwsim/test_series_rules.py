"""A run against the clock from its checks to its error, on a live machine of the test; nothing waits."""

import gc
import signal
import threading
from typing import ClassVar

import numpy as np
import pytest

import hwsim
from hwsim._live import series
from hwsim._live.forwarding import Trip
from hwsim._live.machine import TrippedError
from hwsim._loop.check import checked_clock

SAFE = {"stop": 1.0}
SIMULATED = "on a simulated Bench"


class Bench:
    """A simulated plant; `Yard` is a real one."""

    measures: ClassVar = {"place": "mm"}
    accepts: ClassVar = {"velocity": "mm/s", "stop": ""}
    outcomes: ClassVar = {"place": "mm"}
    ranges: ClassVar = {"stop": (0.0, 1.0)}
    safe: ClassVar = {"stop": 1.0}
    tick = 0.01

    def __init__(self, **changes):
        vars(self).update(changes)
        self.machines = []

    def start(self, rng):
        self.machines.append(Sledge(self))
        return self.machines[-1]


class Sledge:
    """A part of three periods; it keeps its calls, those of its copies too."""

    def __init__(self, plant, refuses=False):
        self.time, self.done, self.event, self.calls = 0, False, False, Shared()
        self.released = self.sampled = 0
        self.taken, self.trip, self.reasons, self.closed = True, None, [], 0
        self.plant, self.refuses = plant, refuses

    def step(self, command, ticks):
        if self.refuses and command == SAFE:
            raise ValueError("not now")
        self.calls.append((self.time, dict(command), ticks))
        self.time += ticks
        self.done = self.time >= 6 or bool(command.get("stop"))
        return {"place": float(self.time)}

    def outcome(self):
        return {"place": float(self.time)}

    def make_safe(self, reason):
        self.reasons.append(reason)
        self.trip = self.trip or Trip(reason, "runner", 0.25)

    def close(self):
        self.closed += 1


class Shared(list):
    def __deepcopy__(self, kept):
        return self


class Yard(Bench):
    """A real machine: what its part does is given."""

    def __init__(self, machine=Sledge, **changes):
        super().__init__(**changes)
        self.kind, self.asked = machine, []

    def start_live(self, rng, live, period):
        self.asked.append((live, period))
        self.machines.append(self.kind(self))
        return self.machines[-1]


class Push:
    """Commands 1 mm/s each 20 ms; `odd`: what it does in its second step."""

    reads: ClassVar = {"place": "mm"}
    commands: ClassVar = {"velocity": "mm/s"}
    period = 0.02

    def __init__(self, odd=None):
        self.odd, self.resets = odd, 0

    def reset(self):
        self.resets += 1
        self.steps = 0

    def step(self, *, place, **others):
        self.steps += 1
        if self.odd is not None and self.steps == 2:
            self.odd()
        return {"velocity": float(self.steps)}


def live(**options):
    return hwsim.Live(**{"safe": SAFE, **options})


def ran(plant, controller=None, control=None):
    controller, control = controller or Push(), control or live()
    plant, clock = checked_clock(plant, controller)
    return series.run_live(plant, controller, clock, np.random.default_rng(0), control)


def aborted(plant, controller=None, control=None):
    with pytest.raises(hwsim.Aborted) as error:
        ran(plant, controller, control)
    return error.value


def raising(error):
    def odd():
        raise error

    return odd


def test_a_part_that_ends_has_its_figures():
    plant, controller, control = Yard(), Push(), live()
    control.tripped = True  # of a part before
    part = ran(plant, controller, control)
    (machine,) = plant.machines
    assert (controller.resets, machine.closed >= 1, machine.reasons) == (1, True, [])
    assert control.tripped is False and plant.asked == [(control, 2)]
    assert part.outcome["place"] == 6.0 and part.outcome["aborted"] == 0.0
    assert part.outcome["abort_reason"] == "" and np.isnan(part.outcome["safe_delay"])
    assert str(part.outcome["begun"])[:2] == "20" and str(part.outcome["begun"]).endswith("+00:00")
    assert part.tables["controller"]["velocity_command"].tolist()[:3] == [1.0, 2.0, 3.0]


def test_the_fastest_period_is_told_in_ticks_and_none_for_events():
    class Event(Push):
        period = None

    class Tiers(Push):
        def __init__(self):
            super().__init__()
            self.tiers = {"slow": Wishing(), "fast": Following()}

        def reset(self):
            for each in self.tiers.values():
                each.reset()

    class Wishing(Push):
        period = 0.06
        commands: ClassVar = {"wish": "mm"}

        def step(self, *, place, **others):
            return {"wish": 1.0}

    class Following(Push):
        def step(self, *, place, wish):
            return super().step(place=place)

    plant = Yard()
    for machine, controller in ((Moving, Event()), (Sledge, Tiers())):
        plant.kind = machine
        ran(plant, controller)
    assert [period for _, period in plant.asked] == [None, 2]


class Moving(Sledge):
    """Ends with its first step."""

    def step(self, command, ticks):
        return super().step(command, min(ticks, 6) if command else 0)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (KeyError("sensor"), "KeyError: 'sensor'"),
        (ValueError("odd"), "ValueError: odd"),
        (KeyboardInterrupt(), "KeyboardInterrupt"),
        (SystemExit(3), "SystemExit: 3"),
        (MemoryError(), "MemoryError"),
    ],
)
def test_whatever_is_raised_the_machine_is_made_safe_and_the_rows_are_kept(error, reason):
    plant, control = Yard(), live()
    control.part = 4
    told = aborted(plant, Push(raising(error)), control)
    (machine,) = plant.machines
    assert machine.reasons == [reason] and machine.closed == 1
    assert str(told) == f"part 4 was aborted and the machine made safe: {reason}"
    assert told.__cause__ is error
    assert told.part.outcome["aborted"] == 1.0 and told.part.outcome["abort_reason"] == reason
    assert told.part.outcome["safe_delay"] == 0.25 and told.part.outcome["safe_by"] == "runner"
    assert told.part.tables["controller"]["velocity_command"].tolist()[:-1] == [1.0]


class Tripping(Sledge):
    """Is made safe in its second step, by whom the plant says."""

    def step(self, command, ticks):
        if self.time:
            self.trip = Trip("late", self.plant.by, 0.1)
            self.taken = self.plant.took
            raise TrippedError
        return super().step(command, ticks)


@pytest.mark.parametrize(("took", "rows"), [(True, [1.0, 2.0]), (False, [1.0, None])])
def test_rows_whose_commands_were_taken_are_kept(took, rows):
    told = aborted(Yard(Tripping, by="link", took=took))
    kept = told.part.tables["controller"]["velocity_command"]  # with a row of the last measurement
    assert told.__cause__ is None and np.array_equal(kept, np.array(rows, float), equal_nan=True)
    assert str(told) == "part 0 was aborted and the machine made safe: late"


@pytest.mark.parametrize(
    ("by", "limit", "shadow", "said"),
    [
        ("link", 0.0, False, "part 0 was aborted and the machine made safe: late"),
        ("machine", 0.5, False, "part 0 was aborted: late"),
        (
            "",
            0.5,
            False,
            "part 0 was aborted, and it is not known whether the machine is safe: late; "
            "its own watchdog must make it safe within 0.5 s",
        ),
        (
            "",
            0.0,
            False,
            "part 0 was aborted, and it is not known whether the machine is safe: late; "
            "its own watchdog must make it safe, within its own time limit",
        ),
        ("", 0.5, True, "part 0 was not listened to until its end: late"),
    ],
)
def test_what_is_said_of_the_machine(by, limit, shadow, said):
    class Watched(Tripping):
        watchdog = limit

    control = hwsim.Live(shadow=True) if shadow else live()
    assert str(aborted(Yard(Watched, by=by, took=True), control=control)) == said


def test_a_verdict_is_that_of_a_finished_part():
    class Judging(Push):
        def verdict(self):
            return {"good": 1.0}

    plant = Yard(outcomes={"place": "mm", "good": ""})
    assert ran(plant, Judging()).outcome["good"] == 1.0
    assert "good" not in aborted(plant, Judging(raising(KeyError("sensor")))).part.outcome


def test_a_machine_that_tells_no_watchdog_has_its_own_time_limit():
    assert str(aborted(Yard(Tripping, by="", took=True))).endswith("make it safe, within its own time limit")


def test_a_trip_of_the_last_moment_aborts_the_part():
    class Late(Sledge):
        def close(self):
            super().close()
            self.trip = self.trip or Trip("late", "link", 0.1)

    told = aborted(Yard(Late))
    assert told.__cause__ is None and told.part.outcome["aborted"] == 1.0


def test_an_outcome_that_cannot_be_told_loses_no_row():
    class Dumb(Sledge):
        def outcome(self):
            raise OSError("gone")

    plant = Yard(Dumb)
    told = aborted(plant, Push(raising(KeyError("sensor"))))
    assert str(told).endswith("made safe: KeyError: 'sensor'; its outcome cannot be told: gone")
    assert told.part.tables["controller"]["velocity_command"].tolist()[:-1] == [1.0]
    assert told.part.outcome["aborted"] == 1.0 and "place" not in told.part.outcome
    assert plant.machines[0].closed == 1


def test_figures_of_the_run_beside_outcomes_of_the_same_name():
    plant = Yard(outcomes={"place": "mm", "aborted": ""})
    part = ran(plant)
    assert "live_aborted" in part.outcome and "aborted" not in part.outcome and "overruns" in part.outcome


@pytest.mark.parametrize(
    ("plant", "options", "said"),
    [
        (Yard(), {"safe": {"halt": 1.0}}, "safe must be of commands that the plant accepts: velocity, stop; got"),
        (Yard(), {"safe": {"stop": 2.0}}, r"safe\['stop'\] must be in \[0, 1\]; got 2"),
        (Yard(), {"stuck": {"size": 3}}, "stuck must be of measurements of the plant: place; got 'size'"),
        (Bench(), {"safe": None, "shadow": True}, f"live must not be in shadow {SIMULATED}: it has no control"),
        (Bench(), {"gate": True}, f"gate must be False {SIMULATED}, which is in this process"),
        (Bench(), {"stale": 1.0}, f"stale must not be given {SIMULATED}: its readings never stand still"),
        (Bench(), {"stuck": {"place": 3}}, f"stuck must not be given {SIMULATED}"),
        (Yard(measures={"step_time": "s"}), {}, "the plant must not measure step_time, which a live run writes"),
    ],
)  # fmt: skip
def test_what_is_refused_before_a_run(plant, options, said):
    with pytest.raises(ValueError, match=said):
        series.check_live(live(**options), plant, Push())


@pytest.mark.parametrize("plant", [Yard(), Bench(ranges={})])
def test_what_fits_is_not_refused(plant):
    series.check_live(live(safe={"stop": 1.0, "velocity": 0.0}), plant, Push())
    if isinstance(plant, Yard):
        series.check_live(live(stale=1.0, stuck={"place": 3}, gate=True), plant, Push())
        series.check_live(hwsim.Live(shadow=True), plant, Push())


def test_a_watchdog_of_simulated_time_is_refused_as_a_tier_too():
    class Dog(Push):
        tripped = False

    class Tiers(Push):
        tiers: ClassVar = {"above": Push(), "below": Dog()}

    for controller in (Dog(), Tiers()):
        with pytest.raises(ValueError, match="controller must not be a Watchdog in a live run"):
            series.check_live(live(), Yard(), controller)


def test_another_safe_command_than_the_machine_s_own_is_told():
    said = r"safe differs from the machine's own safe command, \{'stop': 1.0\}; got \{'velocity': 0.0\}"
    with pytest.warns(UserWarning, match=said) as told:
        series.check_live(live(safe={"velocity": 0.0}), Yard(), Push())
    assert told[0].filename == __file__  # the user's own line
    with pytest.warns(UserWarning, match="safe differs"):
        series.check_live(live(safe={"stop": 0.5}), Yard(), Push())


def handlers():
    return [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]


@pytest.fixture
def hurried(monkeypatch):
    told = []
    monkeypatch.setattr(series, "hurry", lambda: told.append("hurry"))
    monkeypatch.setattr(series, "leave", lambda: told.append("leave"))
    monkeypatch.setattr(series.gc, "collect", lambda: 0)  # a second among all tests; looked at below
    return told


def test_signals_and_the_collector_are_as_before_after_a_run(hurried):
    before, control = handlers(), live()
    assert gc.get_freeze_count() == 0
    with pytest.raises(ZeroDivisionError), series.operated(control):
        assert control.state == "running" and hurried == ["hurry"]
        assert gc.get_freeze_count() > 1000
        assert not set(handlers()) & set(before)
        raise ZeroDivisionError
    assert (handlers(), control.state, hurried) == (before, "idle", ["hurry", "leave"])
    assert gc.get_freeze_count() == 0


def test_what_the_user_froze_stays_frozen(hurried):
    gc.freeze()
    try:
        with series.operated(live()):
            pass
        assert gc.get_freeze_count() > 0
    finally:
        gc.unfreeze()


def test_garbage_is_collected_before_it_is_frozen(hurried, monkeypatch):
    calls = []
    for name in ("collect", "freeze", "unfreeze"):
        monkeypatch.setattr(series.gc, name, lambda name=name: calls.append(name))
    with series.operated(live()):
        assert calls == ["collect", "freeze"]
    assert calls == ["collect", "freeze", "unfreeze"]


def test_a_run_in_another_thread_leaves_signals_alone(hurried):
    before, seen = handlers(), []

    def work():
        with series.operated(live()):
            seen.append(handlers())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before] and hurried == ["hurry", "leave"]


def test_signals_abort_and_only_one_after_the_safe_command_interrupts():
    control = live()
    handle = series._aborting(control)
    handle(signal.SIGTERM, None)
    assert (control.state, control.reason, control.acts[-1].who) == ("aborted", "SIGTERM", "SIGTERM")
    handle(signal.SIGINT, None)  # not safe yet: it is not skipped
    assert (control.reason, len(control.acts)) == ("SIGTERM", 2)
    control.tripped = True
    with pytest.raises(KeyboardInterrupt, match="SIGINT"):
        handle(signal.SIGINT, None)
    tripped = live()
    tripped.tripped = True  # by a late step: it was not asked for yet
    series._aborting(tripped)(signal.SIGINT, None)
    assert tripped.reason == "SIGINT"


def rehearsed(plant, control=None):
    controller = Push()
    plant, clock = checked_clock(plant, controller)
    series.rehearse(plant, controller, clock, control or live())
    return controller


def test_a_simulated_machine_is_stepped_and_made_safe_on_copies():
    plant = Bench()
    assert rehearsed(plant).resets == 0
    (machine,) = plant.machines
    assert machine.calls == [(0, {}, 0), (0, {"velocity": 1.0}, 2), (2, SAFE, 0)]
    assert machine.time == 2 and not machine.done  # the safe command went to a copy


def test_a_safe_command_that_a_simulated_machine_refuses_is_refused_before():
    class Stiff(Bench):
        def start(self, rng):
            return Sledge(self, refuses=True)

    with pytest.raises(
        ValueError, match="safe must be a command that the machine takes at any moment: not now"
    ):
        rehearsed(Stiff())


def test_a_simulated_machine_with_samples_is_tried_with_them():
    plant = Bench(sample_ticks=4)

    class Going(Sledge):
        def step(self, command, ticks):
            read = super().step(command, ticks)
            self.done = False
            return read

    plant.start = lambda rng: plant.machines.append(Going(plant)) or plant.machines[-1]
    rehearsed(plant)
    assert plant.machines[0].calls[2:] == [(2, SAFE, 0), (2, {}, 4)]


def test_a_real_machine_is_only_looked_at():
    looks = []
    plant = Yard(look=lambda: looks.append(1) or {"place": 1.0})
    rehearsed(plant)
    assert looks == [1] and plant.machines == [] and plant.asked == []
    rehearsed(Yard(look=raising(ConnectionError("gone"))))  # which the run itself will tell
    rehearsed(Yard())


def test_what_is_looked_at_is_no_machine_that_moves():
    looked = series._Looked(Yard(look=lambda: {"place": 1.0}))
    assert looked.step({"velocity": 1.0}, 5) == {"place": 1.0} and looked.outcome() == {}
    assert (looked.time, looked.done, looked.event) == (0, False, False)
