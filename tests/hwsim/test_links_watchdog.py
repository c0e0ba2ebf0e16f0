"""A host that falls silent: the machine is made safe in time, and no record of it is lost."""

import json
from dataclasses import dataclass
from math import nan
from threading import Event, Thread
from time import monotonic
from typing import Any, ClassVar

import numpy as np
import pytest
from hwsim_inside import TcpLink, TcpListener

import hwsim
from hwsim import Courier, QueueLink, Watchdog

SAFE = {"velocity": 0.0, "retract": 1.0}
PATIENCE = 20.0  # s


@dataclass(frozen=True)
class World:
    """A slide that is driven towards a part 100 mm away; the host on the other end of the wire lives in the
    same world.
    """

    host: Courier | None = None
    link: Any = None
    cut: int = 10**9  # tick at which the link breaks
    tick: float = 0.01
    event_each: int = 0
    measures: ClassVar = {"slide": "mm", "time": "s"}
    accepts: ClassVar = {"velocity": "mm/s", "retract": "", "light": ""}
    outcomes: ClassVar = {"deepest": "mm", "slide": "mm"}

    def start(self, rng):
        return Slide(self)


class Slide:
    def __init__(self, world):
        self.world, self.time, self.done, self.event = world, 0, False, True
        self.slide = self.deepest = self.velocity = 0.0
        self.retracts = False

    def step(self, command, ticks):
        self.velocity = command.get("velocity", self.velocity)
        self.retracts = self.retracts or bool(command.get("retract"))
        for k in range(min(ticks, 10**6)):
            self._tick()
            self.event = bool(self.world.event_each) and self.time % self.world.event_each == 0
            if self.done or self.event or k == 10**5:
                break
        return {"slide": self.slide, "time": self.time * self.world.tick}

    def _tick(self):
        self.time += 1
        self.slide += (-500.0 if self.retracts else self.velocity) * self.world.tick
        self.deepest = max(self.deepest, self.slide)
        self.done = self.slide <= -50.0 or self.time >= 300
        if self.world.host is not None:
            if self.time == self.world.cut:
                self.world.link.close()
            self.world.host.advance(self.time * self.world.tick)

    def outcome(self):
        return {"deepest": self.deepest, "slide": self.slide}


class Drive:
    """Drives the slide on without looking."""

    commands: ClassVar = {"velocity": "mm/s", "retract": "", "light": ""}
    reports: ClassVar = {"wish": "mm"}

    def __init__(self, period=0.01, command=None):
        self.period, self.command, self.steps = period, command or {"velocity": 30.0}, 0

    def reset(self):
        self.steps = 0

    def step(self, *, slide, **measured):
        self.steps += 1
        return self.command

    def report(self):
        return {"wish": 100.0 - self.steps}


class Two:
    """Two loops, the slow one first."""

    def __init__(self):
        self.tiers = {"lamp": Drive(0.05, {"light": 1.0}), "drive": Drive(0.01)}
        self.period = 0.05

    def reset(self):
        for tier in self.tiers.values():
            tier.reset()

    def step(self, **measured):
        return {**self.tiers["lamp"].step(**measured), **self.tiers["drive"].step(**measured)}


def connected(latency=0.02, loss=0.0, **world):
    near, far = QueueLink(latency, loss=loss).start(3)
    machine, host = Courier(near), Courier(far)
    return machine, host, World(host, near, **world)


def after(machine, host, begin=10.0):
    """Records that the host has once the link is mended."""
    near, far = QueueLink(0.02).start()
    machine.attach(near)
    host.attach(far)
    for k in range(200):
        machine.advance(begin + 0.05 * k)
        host.advance(begin + 0.05 * k)
    assert machine.waiting == 0
    return [json.loads(record) for record in host.receive()]


@pytest.mark.parametrize("cut", [37, 100])
def test_a_dropped_link_stops_the_slide_and_loses_no_record(cut):
    machine, host, world = connected(cut=cut, loss=0.1)
    log = hwsim.run(world, Watchdog(Drive(), machine, timeout=0.2, safe_command=SAFE))
    table = log["controller"]
    lost = table["link_lost_planned"].values
    steps = int(np.isfinite(lost).sum())
    first = int(np.argmax(lost == 1.0))
    # the last sign of life was heard before the cut at most a latency, a few lost messages and a step before
    # it
    assert cut * 0.01 - 0.1 + 0.2 <= table.time.values[first] <= cut * 0.01 + 0.2 + 0.021
    assert np.all(table.velocity_command.values[:first] == 30.0) and np.all(
        table.velocity_command.values[first:steps] == 0.0
    )
    assert np.all(table.retract_command.values[first:steps] == 1.0)
    assert (
        log.outcome.deepest.item() <= 30.0 * (cut * 0.01 + 0.2 + 0.021) and log.outcome.slide.item() <= -50.0
    )
    records = after(machine, host)
    assert len(records) == steps
    np.testing.assert_allclose([each["time"] for each in records], np.arange(steps) * 0.01, atol=1e-12)
    np.testing.assert_array_equal([each["read"]["slide"] for each in records], table.slide.values[:steps])
    np.testing.assert_array_equal(
        [each["command"]["velocity"] for each in records], table.velocity_command.values[:steps]
    )
    assert {each["tier"] for each in records} == {"controller"}


def test_a_controller_that_is_heard_is_left_alone():
    machine, host, world = connected()
    guarded = hwsim.run(world, Watchdog(Drive(), machine, timeout=0.1, safe_command=SAFE))["controller"]
    alone = hwsim.run(World(), Drive())["controller"]
    assert np.all(guarded.link_lost_planned.values[:-1] == 0.0)
    assert guarded.drop_vars("link_lost_planned").identical(alone)
    assert len(after(machine, host)) == 300


def test_who_is_never_heard_is_silent_from_the_beginning():
    log = hwsim.run(World(), Watchdog(Drive(), Courier(), timeout=0.2, safe_command=SAFE))
    lost = log["controller"].link_lost_planned.values
    assert np.argmax(lost == 1.0) == 21  # the first step after more than 0.2 s
    assert (
        np.isnan(log["controller"].wish_planned.values[21])
        and log["controller"].wish_planned.values[20] == 79.0
    )


def test_each_tier_is_guarded():
    machine, host, world = connected(cut=103)
    guarded = Watchdog(Two(), machine, timeout=0.2, safe_command=SAFE)
    assert list(guarded.tiers) == ["lamp", "drive"] and guarded.tiers["drive"].period == 0.01
    log = hwsim.run(world, guarded)
    for name in ("lamp", "drive"):
        table = log[name]
        rows = np.isfinite(table.link_lost_planned.values)
        assert np.array_equal(table.time.values[rows] >= 1.225, table.link_lost_planned.values[rows] == 1.0)
        late = table.isel(row=rows & (table.time.values > 1.225))
        assert late.row.size and np.all(late.velocity_command == 0.0) and np.all(late.retract_command == 1.0)
    assert np.nanmax(log["lamp"].light_command.values[log["lamp"].time.values > 1.225], initial=0.0) == 0.0
    records = after(machine, host)
    assert (
        sum(each["tier"] == "lamp" for each in records)
        == np.isfinite(log["lamp"].link_lost_planned.values).sum()
    )
    assert (
        sum(each["tier"] == "drive" for each in records)
        == np.isfinite(log["drive"].link_lost_planned.values).sum()
    )


def test_a_controller_of_events_is_guarded_by_the_time_it_measures():
    machine, _, world = connected(cut=100, event_each=7)
    log = hwsim.run(world, Watchdog(Drive(None), machine, timeout=0.2, safe_command=SAFE))
    table = log["controller"]
    stepped = np.isfinite(table.link_lost_planned.values)
    np.testing.assert_allclose(table.time.values[stepped], 0.07 * np.arange(stepped.sum()), atol=1e-12)
    late = table.time.values[stepped] > 1.18  # heard last at 0.98 s
    assert late.any() and np.array_equal(table.velocity_command.values[stepped], np.where(late, 0.0, 30.0))
    guarded = Watchdog(Drive(None), Courier(), timeout=0.2, safe_command=SAFE)
    guarded.reset()
    with pytest.raises(
        ValueError, match=r"time \(s\) must be measured where a guarded controller has no period"
    ):
        guarded.step(slide=0.0)


def test_it_stays_safe_until_the_next_part():
    near, far = QueueLink().start()
    machine, host = Courier(near), Courier(far)
    guarded = Watchdog(Drive(), machine, timeout=0.05, safe_command=SAFE)
    guarded.reset()
    commands = [guarded.step(slide=0.0) for _ in range(8)]
    assert commands[5] == {"velocity": 30.0} and commands[6] == SAFE and guarded.tripped  # 0.06 s
    host.advance(0.08)
    assert guarded.step(slide=0.0) == SAFE and machine.silence == 0.0
    guarded.reset()
    assert not guarded.tripped and guarded.step(slide=0.0) == {"velocity": 30.0}
    for _ in range(7):
        guarded.step(slide=0.0)
    guarded.reset()
    assert guarded.step(slide=0.0) == SAFE  # a new part does not bring the host back


def test_the_safe_command_is_not_shared():
    safe = dict(SAFE)
    guarded = Watchdog(Drive(), Courier(), timeout=0.02, safe_command=safe)
    guarded.reset()
    safe["velocity"] = 5.0
    for _ in range(4):
        command = guarded.step(slide=0.0)
    command["velocity"] = 7.0
    assert guarded.step(slide=0.0) == SAFE


def test_readings_of_any_kind_are_recorded():
    near, far = QueueLink().start()
    machine, host = Courier(near), Courier(far)
    guarded = Watchdog(Drive(), machine, timeout=0.05, safe_command=SAFE)
    guarded.reset()
    guarded.step(slide=nan, profile=np.arange(6.0).reshape(2, 3), count=np.int64(3))
    guarded.step(slide=1.0)
    host.advance(0.01)
    (record,) = [json.loads(each) for each in host.receive()]
    assert record["read"]["slide"] != record["read"]["slide"]
    assert record["read"]["profile"] == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]] and record["read"]["count"] == 3


def test_it_is_checked_like_what_it_guards():
    guarded = Watchdog(Drive(), Courier(), timeout=0.2, safe_command=SAFE)
    assert hwsim.check(World(), guarded) and hwsim.check(
        World(), Watchdog(Two(), Courier(), timeout=0.2, safe_command=SAFE)
    )

    class Needs(Drive):
        def step(self, *, temperature):
            return {}

    faults = hwsim.check(World(), Watchdog(Needs(), Courier(), timeout=0.2, safe_command=SAFE)).faults
    assert faults == ("controller's step needs temperature, which the plant does not measure",)
    with pytest.raises(AttributeError, match="tier"):
        _ = guarded._tier


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"timeout": 0.01}, ValueError, r"timeout must be > period of the controller, 0.01 \(s\); got 0.01"),
        ({"timeout": -1.0}, ValueError, r"timeout must be > 0 \(s\); got -1.0"),
        ({"safe_command": {}}, TypeError, r"safe_command must be a mapping of commands; got {}"),
        (
            {"safe_command": {"velocity": nan}},
            ValueError,
            r"safe_command\['velocity'\] must be finite; got nan",
        ),
        (
            {"safe_command": {"stop": 1.0}},
            ValueError,
            r"safe_command must be of commands of the controller; got 'stop'",
        ),
        ({"courier": None}, TypeError, r"courier must be a Courier; got None"),
        ({"controller": 5}, TypeError, r"controller must be a controller; got 5"),
    ],
)
def test_bad_input(change, error, message):
    settings = {"controller": Drive(), "courier": Courier(), "timeout": 0.2, "safe_command": SAFE} | change
    with pytest.raises(error, match=message):
        Watchdog(settings.pop("controller"), settings.pop("courier"), **settings)


def answering(listener, got, leave):
    """A host that hears records and answers until it is told to leave, without a word."""
    with listener.accept(PATIENCE) as link:
        courier, begun = Courier(link), monotonic()
        while not leave.is_set() and monotonic() - begun < PATIENCE:
            link.wait(0.02)
            courier.advance(monotonic() - begun)
            got += courier.receive()
    return courier


def test_a_host_that_vanishes_over_tcp():
    got, leave, couriers = [], Event(), []
    with TcpListener() as listener:
        worker = Thread(target=lambda: couriers.append(answering(listener, got, leave)), daemon=True)
        worker.start()
        link = TcpLink.connect(listener.address)
        machine = Courier(link)
        guarded = Watchdog(Drive(), machine, timeout=0.1, safe_command=SAFE)
        guarded.reset()
        for _ in range(100):
            assert guarded.step(slide=0.0) == {"velocity": 30.0}
            assert link.wait(PATIENCE)  # in the real world a period passes here
        leave.set()
        worker.join(PATIENCE)
        commands = [guarded.step(slide=0.0) for _ in range(30)]
        at = commands.index(SAFE)
        assert 9 <= at <= 12 and commands[at:] == [SAFE] * (30 - at)
        assert link.wait(PATIENCE) and link.closed
        with TcpLink.connect(listener.address) as again, listener.accept(PATIENCE) as far:
            (host,) = couriers
            host.attach(far)
            machine.attach(again)
            begun = monotonic()
            while machine.waiting and monotonic() - begun < PATIENCE:
                machine.advance(100.0 + monotonic() - begun)
                far.wait(0.02)
                host.advance(100.0 + monotonic() - begun)
                got += host.receive()
                again.wait(0.02)
    records = [json.loads(each) for each in got]
    assert machine.waiting == 0 and len(records) == 130
    np.testing.assert_allclose([each["time"] for each in records], np.arange(130) * 0.01, atol=1e-12)
