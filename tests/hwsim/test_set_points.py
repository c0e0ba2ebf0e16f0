"""Set-points: what an upper tier commands, the plant does not know, and a lower tier reads."""

from math import isnan, nan
from typing import ClassVar

import numpy as np
import pytest
from hwsim_fakes import Tank
from test_loop import Two

import hwsim
from sdpgrind import units
from sdpgrind.weldbead import force


class Boss:
    """Wants a flow, and draws a curve, at the start and at each event."""

    period = None
    reads: ClassVar = {"level": "mm"}
    commands: ClassVar = {"wanted": "mm/s", "curve": "mm"}

    def __init__(self, book=None):
        self.book, self.steps = [] if book is None else book, 0

    def __deepcopy__(self, memo):
        return self

    def reset(self):
        self.steps = 0

    def step(self, **measured):
        self.steps += 1
        self.book.append(("boss", measured))
        return {"wanted": float(self.steps), "curve": np.arange(self.steps + 1.0)}


class Hand:
    """Opens the tap as it was told to."""

    period = 0.5
    reads: ClassVar = {"wanted": "mm/s", "curve": "mm", "temperature": "K"}
    commands: ClassVar = {"flow": "mm/s"}

    def __init__(self, book):
        self.book = book

    def __deepcopy__(self, memo):
        return self

    def reset(self):
        pass

    def step(self, *, wanted, curve, **others):
        self.book.append(("hand", wanted, curve, others))
        return {"flow": 2.0} if isnan(wanted) else {"flow": wanted}


def run_both():
    book = []
    return hwsim.run(Tank(), Two(boss=Boss(book), hand=Hand(book))), book


def test_set_points_act_in_the_same_tick_and_are_held():
    log, book = run_both()
    assert [entry[0] for entry in book[:3]] == ["boss", "hand", "hand"]
    assert book[1][1] == book[2][1] == 1.0
    wanted = log["hand"].wanted.values
    # the alarm at 5 mm is reached after 5 s
    np.testing.assert_array_equal(wanted[log["hand"].time.values < 5.0], 1.0)
    assert wanted[-2] == 2.0
    np.testing.assert_array_equal(log["hand"].flow_command.values[:-1], wanted[:-1])


def test_arrays_pass_untouched():
    _, book = run_both()
    assert book[1][2] is book[2][2] and list(book[1][2]) == [0.0, 1.0]
    assert list(book[-1][2]) == [0.0, 1.0, 2.0]


def test_tables_hold_what_tiers_read_and_command():
    log, book = run_both()
    assert set(log["boss"].data_vars) == {"level", "wanted_command", "curve_command"}
    # the curve stands once, with the boss
    assert set(log["hand"].data_vars) == {"temperature", "wanted", "flow_command"}
    assert log["boss"].wanted_command.units == log["hand"].wanted.units == "mm/s"
    assert log["boss"].curve_command.dims == ("row", "curve_command_index")
    assert "wanted" not in book[0][1]  # the upper tier does not see them


def test_set_points_never_reach_the_plant():
    class Strict(Tank):
        def start(self, rng):
            machine = super().start(rng)
            step = machine.step

            def strict(command, ticks):
                assert set(command) <= {"flow", "close"}
                return step(command, ticks)

            machine.step = strict
            return machine

    hwsim.run(Strict(), Two(boss=Boss(), hand=Hand([])))


def test_before_the_first_set_point_there_is_no_reading():
    class Late(Boss):
        def step(self, **measured):
            self.steps += 1
            return {"wanted": 1.0} if self.steps > 1 else {}

    book = []
    hwsim.run(Tank(), Two(boss=Late(), hand=Hand(book)))
    assert isnan(book[0][1]) and isnan(book[0][2]) and book[-1][1] == 1.0


def test_logs_and_journals_keep_them(tmp_path):
    import sdpgrind

    log, _ = run_both()
    log.save(tmp_path / "run.nc")
    assert sdpgrind.load(tmp_path / "run.nc")["boss"].curve_command.identical(log["boss"].curve_command)
    hwsim.run(Tank(), Two(boss=Boss(), hand=Hand([])), journal=tmp_path / "run.db")
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert journal.log()["hand"].wanted.units == "mm/s"


def faults(**tiers):
    return hwsim.check(Tank(), Two(**tiers)).faults


def test_fitting_tiers_have_no_faults():
    assert faults(boss=Boss(), hand=Hand([])) == ()


def test_a_tier_above_does_not_get_set_points_of_one_below():
    assert faults(hand=Hand([]), boss=Boss()) == (
        "controller hand's step needs wanted, which the plant does not measure",
        "controller hand's step needs curve, which the plant does not measure",
        "controller boss commands wanted, which the plant does not accept; it accepts flow, close",
        "controller boss commands curve, which the plant does not accept; it accepts flow, close",
    )


def test_units_of_set_points():
    hand = Hand([])
    hand.reads = {**Hand.reads, "wanted": "l/min"}
    assert faults(boss=Boss(), hand=hand) == (
        "controller hand reads wanted in l/min, the tier above commands it in mm/s",
    )
    with pytest.raises(ValueError, match="reads wanted in l/min, the tier above commands it in mm/s"):
        hwsim.run(Tank(), Two(boss=Boss(), hand=hand))


def test_ambiguous_set_points():
    assert faults(boss=Boss(), other=Boss(), hand=Hand([])) == (
        "set-point wanted is commanded by boss and by other; one tier must",
        "set-point curve is commanded by boss and by other; one tier must",
    )
    boss, hand = Boss(), Hand([])
    boss.commands = {**Boss.commands, "level": "mm"}
    hand.reads = {**Hand.reads, "level": "mm"}
    assert faults(boss=boss, hand=hand) == (
        "set-point level commanded by boss is also measured by the plant; it needs a name of its own",
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"wish": 1.0}, "a command of boss must be one of flow, close, wanted, curve; got 'wish'"),
        ({"wanted": nan}, r"wanted commanded by boss must be a number \(mm/s\); got nan"),
    ],
)
def test_bad_set_points_at_run_time(given, message):
    class Wishing(Boss):
        def step(self, **measured):
            return given

    with pytest.raises(ValueError, match=message):
        hwsim.run(Tank(), Two(boss=Wishing(), hand=Hand([])))


def test_a_command_that_is_called_command_keeps_its_name():
    from hwsim_inside import Labels, command_column

    assert (command_column("flow"), command_column("platform_command")) == (
        "flow_command",
        "platform_command",
    )
    labels = Labels("", "", {}, {"platform_command": "mm", "flow": "mm/s"}, {}, {}, {})
    assert labels.column("platform_command") == {"units": "mm", "long_name": "platform commanded"}
    assert labels.column("flow_command") == {"units": "mm/s", "long_name": "flow commanded"}


def test_a_pass_begins_after_its_set_points_came():
    """The disc is still where the last pass left it: nothing is demanded before it comes to the plan, and
    nothing winds up.
    """
    time = np.arange(0.0, 2.0, 0.004)
    points = {
        "plan_time": time,
        "normal_force_plan": np.where(time > 0, 40.0, 0.0),
        "fly_height_plan": np.full(time.size, 10.0),
    }
    controller = force.ForceController(None, force.PI.design(crossover=units.hz(3.0)))
    command = controller.step(force=nan, **points, center_x_plan=20.0 * time)
    assert controller.report() == {"force_demand": 0.0, "force_reference": 0.0, "correction": 0.0}
    for k in range(15):  # from 10 mm before
        place = -10.0 + 20.0 * k / 60
        assert controller.step(force=0.0, center_x=place, **points, center_x_plan=20.0 * time) == command
        assert controller.report()["force_demand"] == 0.0
    for k in range(15, 40):
        controller.step(force=0.0, center_x=-10.0 + 20.0 * k / 60, **points, center_x_plan=20.0 * time)
    assert controller.report()["force_demand"] == 40.0


def test_without_place_and_clock_samples_are_counted():
    time = np.arange(0.0, 2.0, 0.004)
    points = {
        "plan_time": time,
        "normal_force_plan": 10.0 + 20.0 * time,
        "fly_height_plan": np.full(time.size, 10.0),
    }
    controller = force.ForceController(None, force.PI.design(crossover=units.hz(3.0)))
    demands = []
    for _ in range(30):
        controller.step(force=nan, **points)
        demands.append(controller.report()["force_demand"])
    assert demands[0] == 10.0 and np.allclose(np.diff(demands[1:]), 20.0 / 60)
