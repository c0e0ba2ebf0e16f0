"""Rows of motions: kept once in a log, seen by the adaptation after every part, also in a resumed run."""

import numpy as np
import pytest
from hwsim_fakes import Tank
from hwsim_inside import digest, same

import hwsim

WIDE = np.arange(1.0, 7.0).reshape(2, 3)
TALL = WIDE.reshape(3, 2)  # the same numbers in the same order


class Still:
    """A machine on which nothing happens, for three steps after the start."""

    time, done, event = 0, False, True

    def step(self, command, ticks):
        self.time += 1
        self.done = self.time > 3
        return {"level": 1.0}

    def outcome(self):
        return {}


class Stand(Tank):
    def start(self, rng):
        return Still()


class Played:
    """Commands motions one after the other."""

    period = None

    def __init__(self, *motions):
        self.motions = motions

    def reset(self):
        self.steps = 0

    def step(self, **measured):
        self.steps += 1
        return {"flow": self.motions[(self.steps - 1) % len(self.motions)]}


class Doubles:
    """Doubles the first motion of the last part, from the rows in its log, up to 20 mm/s."""

    def next(self, controller, part_log):
        rows = part_log["controller:flow"].flow_command.values[:2]
        return Played(np.where(rows < 20.0, 2.0 * rows, rows), TALL)


class Counts:
    """Notes the rows that it sees."""

    seen = ()

    def next(self, controller, part_log):
        rows = part_log["controller:flow"]
        Counts.seen += ((rows.sizes["row"], *np.unique(rows.time.values).tolist()),)
        return controller


@pytest.mark.parametrize("finished", [1, 7, 8])
def test_a_resumed_adaptation_sees_the_rows_of_motions_of_earlier_parts(tmp_path, finished):
    whole = hwsim.run(Stand(), Played(WIDE, TALL), parts=9, adapt=Doubles())
    assert whole["controller:flow"].part.values.max() < 6  # the last parts repeat motions alone
    arguments = {"adapt": Doubles(), "journal": tmp_path / "run.db"}
    hwsim.run(Stand(), Played(WIDE, TALL), parts=finished, **arguments)
    assert same(hwsim.run(Stand(), Played(WIDE, TALL), parts=9, **arguments), whole)


def test_every_part_shows_all_its_rows_to_the_adaptation(tmp_path, monkeypatch):
    monkeypatch.setattr(Counts, "seen", ())
    for parts in (2, 4):
        hwsim.run(Stand(), Played(WIDE), parts=parts, adapt=Counts(), journal=tmp_path / "run.db")
    assert Counts.seen == ((6, 0.1, 0.2, 0.3),) * 6


def test_beyond_the_limit_a_resumed_run_is_equal_too(tmp_path, monkeypatch):
    monkeypatch.setattr("hwsim._part.kept_motions.ROWS_MAX", 6)
    whole = hwsim.run(Stand(), Played(WIDE, TALL), parts=5, adapt=Doubles())
    assert whole["controller:flow"].sizes["row"] <= 6
    for parts in (2, 5):
        again = hwsim.run(
            Stand(), Played(WIDE, TALL), parts=parts, adapt=Doubles(), journal=tmp_path / "run.db"
        )
    assert same(again, whole)


def test_a_comparison_keeps_each_motion_once_and_to_the_limit(monkeypatch):
    several = {"one": Played(WIDE), "other": Played(WIDE, 2.0 * WIDE)}
    rows = hwsim.compare(Stand(), several, parts=5)["controller:flow"]
    assert rows.controller.values.tolist() == ["one"] * 2 + ["other"] * 2
    np.testing.assert_array_equal(rows.flow_command, np.vstack([WIDE, 2.0 * WIDE]))
    monkeypatch.setattr("hwsim._part.kept_motions.ROWS_MAX", 3)
    assert hwsim.compare(Stand(), several, parts=5)["controller:flow"].sizes["row"] == 2


def test_the_same_numbers_in_another_shape_are_another_motion():
    assert digest(WIDE) == digest(TALL)  # the number of rows stands beside it
    log = hwsim.run(Stand(), Played(WIDE, TALL), parts=2)
    assert log["controller:flow"].sizes["row"] == 5
    for part in range(2):
        for motions, equal in (((WIDE, TALL), 1), ((WIDE, WIDE), 0), ((TALL, TALL), 0)):
            assert hwsim.run(hwsim.Recording(log, part=part), Played(*motions)).outcome.same[0] == equal
