"""The loop: order of one tick, who is stepped when, what is logged."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, field
from math import isnan
from typing import ClassVar

import numpy as np
import pytest
from hwsim_fakes import Drain, Faster, FixedTank, Tank, noisy_tank
from hwsim_forked import forked
from hwsim_inside import same

import hwsim
from hwsim.protocols import FOREVER


@dataclass(frozen=True)
class Diary(Tank):
    """A tank that writes down what happens."""

    book: list = field(default_factory=list)

    def start(self, rng):
        machine = super().start(rng)
        step, book = machine.step, self.book

        def written(command, ticks):
            book.append(("plant", dict(command), ticks))
            return step(command, ticks)

        machine.step = written
        return machine


class Writing(Drain):
    def __init__(self, name, book, flow=2.0, period=None):
        super().__init__(flow, period)
        self.name, self.book = name, book

    def __deepcopy__(self, memo):
        return self

    def step(self, **measured):
        self.book.append((self.name, measured["level"]))
        return super().step(**measured)


class Two:
    """Two controllers of one part."""

    period = None

    def __init__(self, **tiers):
        self.tiers = tiers

    def reset(self):
        for tier in self.tiers.values():
            tier.reset()

    def step(self, **measured):
        return {}


def test_order_of_one_tick():
    tank = Diary()
    hwsim.run(tank, Writing("tap", tank.book))
    assert tank.book == [
        ("plant", {}, 0),  # measure
        ("tap", 10.0),  # controllers that are due
        ("plant", {"flow": 2.0}, FOREVER),  # commands take effect, the plant advances to its event
        ("tap", pytest.approx(4.8)),
        ("plant", {"flow": 2.0}, FOREVER),
    ]


def test_controllers_are_stepped_by_priority_each_at_its_own_rate():
    tank = Diary(level=1.0, alarm=-1.0)
    fast, slow = Writing("fast", tank.book, 1.0, 0.2), Writing("slow", tank.book, 5.0, 0.5)
    log = hwsim.run(tank, Two(slow=slow, fast=fast))
    assert [entry[0] for entry in tank.book] == ["plant", "slow", "fast", "plant"]
    assert tank.book[3] == ("plant", {"flow": 5.0}, 2)  # the first that commands a name has it
    assert log.tiers == ("slow", "fast")


def test_periodic_controllers_are_due_at_whole_periods():
    log = hwsim.run(Tank(alarm=-1.0), Two(slow=Drain(2.0, 0.5), fast=Drain(2.0, 0.2)))
    np.testing.assert_array_equal(log["slow"].time, np.arange(11) / 2)
    np.testing.assert_array_equal(log["fast"].time, np.arange(26) / 5)


def test_a_controller_without_period_is_stepped_at_events_only():
    log = hwsim.run(Tank(), Two(tap=Drain(), watch=Drain(2.0, 0.5)))
    np.testing.assert_array_equal(log["tap"].time, [0.0, 2.6, 5.0])  # start, alarm at 5 mm, end


def test_an_event_on_the_tick_of_a_periodic_controller_is_seen():
    log = hwsim.run(Tank(alarm=5.0, tick=0.5), Two(tap=Drain(), watch=Drain(2.0, 0.5)))
    assert 2.5 in log["tap"].time.values


def test_last_row_holds_the_last_measurement_without_command():
    table = hwsim.run(Tank(), Drain())["tap"]
    assert table.level.values[-1] == pytest.approx(0.0, abs=1e-9)
    assert isnan(table.flow_command[-1]) and isnan(table.end_planned[-1])


def test_no_last_row_where_the_controller_ended_the_part():
    class Closing(Drain):
        def step(self, **measured):
            return {"close": 1.0} if measured["level"] < 5 else {"flow": 2.0}

    table = hwsim.run(Tank(), Closing())["tap"]
    np.testing.assert_array_equal(table.close_command, [np.nan, 1.0])


def test_missing_reading_is_nan_for_controller_and_log():
    class Looking(Drain):
        def step(self, **measured):
            assert isnan(measured["temperature"])
            return {"flow": 2.0}

    assert np.isnan(hwsim.run(Tank(), Looking())["tap"].temperature).all()


def test_plant_with_another_tick_is_retimed_so_that_the_period_is_exact():
    log = hwsim.run(Tank(tick=0.25, alarm=-1.0), Drain(period=1 / 60))
    np.testing.assert_array_equal(log["tap"].time[:-1], np.arange(300) / 60)
    assert log.outcome.sizes["tick"] == 300


def test_first_report_of_a_part_stands_in_the_outcome():
    log = hwsim.run(Tank(), Drain(4.0))
    assert log.outcome.end_planned.values == [2.5]
    assert log.outcome.end_planned.attrs == {"units": "s", "long_name": "end planned"}


def test_units_and_names_of_everything():
    log = hwsim.run(Tank(), Drain())
    table = log["tap"]
    assert {name: table[name].units for name in table.variables if name != "part"} == {
        "level": "mm",
        "temperature": "K",
        "flow_command": "mm/s",
        "end_planned": "s",
        "time": "s",
    }
    assert table.flow_command.long_name == "flow commanded"
    assert log.outcome.attrs == {"plant": "Tank", "controller": "Drain", "colour": "red"}
    assert log.outcome.levels.dims == ("part", "tick") and log.outcome.levels.units == "mm"


def test_arrays_of_unequal_length_are_padded():
    log = hwsim.run(noisy_tank(), Drain(), parts=3, rng=4)
    lengths = [int(np.isfinite(row).sum()) for row in log.outcome.levels.values]
    assert len(set(lengths)) > 1 and max(lengths) == log.outcome.sizes["tick"]


def test_text_and_scans_in_commands_and_measurements():
    from hwsim_inside import column

    assert column([1.0, np.arange(2.0)]).tolist()[1] == [0.0, 1.0]
    assert np.isnan(column([1.0, np.arange(2.0)])[0, 1])
    assert column(["a", 2]).tolist() == ["a", "2"]
    assert column([np.ones((2, 3))] * 4).shape == (4, 6)


def test_part_k_is_the_same_whatever_the_number_of_parts():
    few, many = (hwsim.run(noisy_tank(), Drain(), parts=n, rng=7) for n in (2, 5))
    np.testing.assert_array_equal(few.outcome.leak, many.outcome.leak[:2])
    assert len(np.unique(many.outcome.leak)) == 5


def test_rng_as_int_seed_and_generator():
    logs = [hwsim.run(noisy_tank(), Drain(), parts=3, rng=rng) for rng in (5, np.random.SeedSequence(5))]
    assert same(logs[0], logs[1])
    assert same(logs[0], hwsim.run(noisy_tank(), Drain(), parts=3, rng=np.random.default_rng(5)))


def test_the_controller_given_is_left_alone_and_nothing_leaks_between_parts():
    class Ageing(Drain):
        def step(self, **measured):
            self.flow += 0.5  # not undone by reset
            return super().step(**measured)

    controller = Ageing()
    log = hwsim.run(Tank(), controller, parts=3)
    assert controller.flow == 2.0 and controller.seen == []
    assert len(np.unique(log["tap"].flow_command[log["tap"].time == 0])) == 1


@pytest.mark.parametrize("parts", [1, 7, 70])
def test_threads_give_the_same_parts(parts):
    serial = hwsim.run(noisy_tank(), Drain(), parts=parts, rng=3)
    with ThreadPoolExecutor(3) as executor:
        assert same(serial, hwsim.run(noisy_tank(), Drain(), parts=parts, rng=3, executor=executor))


def test_processes_give_the_same_parts():
    serial = hwsim.run(noisy_tank(), Drain(), parts=11, rng=3)
    with ProcessPoolExecutor(2, mp_context=forked()) as executor:
        assert same(serial, hwsim.run(noisy_tank(), Drain(), parts=11, rng=3, executor=executor))
        both = {"a": Drain(), "b": Drain(3.0)}
        compared = hwsim.compare(noisy_tank(), both, parts=3, executor=executor)
        assert same(compared, hwsim.compare(noisy_tank(), both, parts=3))


@pytest.fixture(scope="module")
def dask():
    """An executor with a worker process of two threads."""
    distributed = pytest.importorskip("distributed")
    # without an address the scheduler listens on 8787, and warns where that is taken
    free_port = "127.0.0.1:0"
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=free_port) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()


def test_dask_gives_the_same_parts(dask):
    serial = hwsim.run(noisy_tank(), Drain(), parts=20, rng=3)
    assert same(serial, hwsim.run(noisy_tank(), Drain(), parts=20, rng=3, executor=dask))


def test_compare_gives_each_controller_the_same_parts():
    log = hwsim.compare(noisy_tank(), {"slow": Drain(1.0), "fast": Drain(3.0)}, parts=4, rng=2)
    np.testing.assert_array_equal(
        log.outcome.leak.sel(controller="slow"), log.outcome.leak.sel(controller="fast")
    )
    assert set(log["tap"].controller.values) == {"slow", "fast"}
    for name, flow in (("slow", 1.0), ("fast", 3.0)):
        alone = hwsim.run(noisy_tank(), Drain(flow), parts=4, rng=2)
        rows = log["tap"].isel(row=log["tap"].controller == name)
        np.testing.assert_array_equal(rows.level, alone["tap"].level)


def test_compare_does_not_spend_a_generator_twice():
    log = hwsim.compare(noisy_tank(), {"a": Drain(), "b": Drain()}, parts=3, rng=np.random.default_rng(1))
    np.testing.assert_array_equal(log.outcome.level[0], log.outcome.level[1])


def test_adaptation_gives_the_controller_of_the_next_part():
    log = hwsim.run(noisy_tank(), Drain(), parts=4, adapt=Faster())
    flows = log["tap"].flow_command[log["tap"].time == 0].values
    sums = np.cumsum(log.outcome.leak.values)
    np.testing.assert_allclose(np.diff(flows), 0.1 + 0.01 * sums[:-1], rtol=1e-12)


def test_adaptation_given_is_left_alone():
    adapt = Faster()
    hwsim.run(noisy_tank(), Drain(), parts=2, adapt=adapt)
    assert adapt.total == 0.0


def test_progress_is_told():
    told = []
    hwsim.run(Tank(), Drain(), parts=4, progress=lambda share, text: told.append((share, text)))
    assert told[-1] == (1.0, "part 4 of 4") and [share for share, _ in told] == [0.25, 0.5, 0.75, 1.0]


def test_a_machine_can_be_copied_at_any_tick():
    import copy

    machine = noisy_tank().start(np.random.default_rng(0))
    machine.step({"flow": 1.0}, 7)
    twin = copy.deepcopy(machine)
    assert machine.step({}, 9) == twin.step({}, 9)


class Says(Drain):
    """Commands what it is told to."""

    def __init__(self, command):
        super().__init__()
        self.command = command

    def step(self, **measured):
        return self.command


@pytest.mark.parametrize(
    ("command", "error", "message"),
    [
        ({"tap": 1.0}, ValueError, "a command of tap must be one of flow, close; got 'tap'"),
        ({"flow": float("nan")}, ValueError, r"flow commanded by tap must be a number \(mm/s\); got nan"),
        (None, TypeError, "step of tap must return a mapping of commands; got None"),
        ({}, RuntimeError, "nothing is under way and nothing was commanded: the part would never end"),
    ],
)
def test_bad_commands(command, error, message):
    with pytest.raises(error, match=message) as caught:
        hwsim.run(Tank(), Says(command), parts=2)
    assert caught.value.__notes__[-1] == "in part 0"


def test_misfits_are_refused_before_the_first_tick():
    class Wrong(Drain):
        reads: ClassVar = {"level": "um", "pressure": "bar"}
        commands: ClassVar = {"flow": "l/min", "pump": "W"}

    tank = Diary()
    with pytest.raises(ValueError) as caught:
        hwsim.run(tank, Wrong())
    assert str(caught.value).splitlines() == [
        "Wrong and Diary do not fit:",
        "- controller reads level in um, the plant measures it in mm",
        "- controller's step needs pressure, which the plant does not measure",
        "- controller commands flow in l/min, the plant accepts it in mm/s",
        "- controller commands pump, which the plant does not accept; it accepts flow, close",
    ]
    assert tank.book == []


def test_period_that_the_plant_cannot_keep():
    with pytest.raises(
        ValueError, match=r"no whole number of the plant's ticks of 0.1 s; a tick of 1/60 s would fit"
    ):
        hwsim.run(FixedTank(), Drain(period=1 / 60))


def test_other_refusals():
    with pytest.raises(ValueError, match="parts must be >= 1; got 0"):
        hwsim.run(Tank(), Drain(), parts=0)
    with pytest.raises(ValueError, match=r"controllers must be a mapping .* got none"):
        hwsim.compare(Tank(), {})
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(ValueError, match="executor must be None where adapt is given"),
    ):
        hwsim.run(Tank(), Drain(), adapt=Faster(), executor=executor)
    with pytest.raises(KeyError, match="tier must be one of tap; got 'force'"):
        hwsim.run(Tank(), Drain())["force"]


def test_adaptation_that_returns_nothing():
    class Nothing:
        def next(self, controller, part_log):
            pass

    with pytest.raises(TypeError, match="next of the adaptation must return a controller; got None"):
        hwsim.run(Tank(), Drain(), parts=2, adapt=Nothing())
