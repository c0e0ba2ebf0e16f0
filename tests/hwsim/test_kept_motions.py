"""Rows of motions: kept once in a log, seen by the adaptation after every part, also in a resumed run."""

import warnings

import numpy as np
import pytest
from hwsim_fakes import Tank
from hwsim_inside import Frames, digest, same

import hwsim
import sdpgrind

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


class Refusing:
    """Refuses each motion but the last of two at once: an event at the time of its command."""

    time, done, event, steps = 0, False, True, 0

    def step(self, command, ticks):
        if ticks:
            self.steps += 1
            self.time += self.steps % 2 == 0
            self.done = self.steps == 6
        return {"level": 0.1 * self.steps}

    def outcome(self):
        return {}


class Strict(Tank):
    def start(self, rng):
        return Refusing()


class Shut:
    """A tier with a period."""

    period = 0.1

    def reset(self):
        pass

    def step(self, **measured):
        return {"close": 0.0}


class Both:
    """A tier stepped at events, and one with a period beside it."""

    period = None

    def __init__(self, *flows):
        self.tiers = {"events": Played(*flows), "clock": Shut()}

    def reset(self):
        for tier in self.tiers.values():
            tier.reset()

    def step(self, **measured):
        return {}  # never called: the loop steps the tiers


LOW = WIDE + 7.0
TWICE = (WIDE, TALL, WIDE, LOW, TALL, TALL)  # two at each of three times, of unequal and of equal sizes


def replayed(log, *motions, part=0):
    return hwsim.run(hwsim.Recording(log, part=part), Played(*motions)).outcome.isel(part=0)


def without_digests(log):
    """A log as it was before digests stood in it."""
    steps = log["controller"].drop_vars("flow_digest_command")
    tables = {"controller": steps, "controller:flow": log["controller:flow"]}
    return hwsim.Log(lambda: Frames(tables, log.outcome))


def test_motions_at_one_time_are_replayed_one_after_the_other(tmp_path):
    log = hwsim.run(Strict(), Played(*TWICE), parts=3)
    assert log["controller"].time.values[:7].tolist() == [0.0, 0.0, 0.1, 0.1, 0.2, 0.2, 0.3]
    assert log["controller:flow"].part.values.max() == 0  # later parts repeat the motions of the first
    log.save(tmp_path / "log.nc")
    loaded = sdpgrind.load(tmp_path / "log.nc")
    assert same(loaded, log)
    for each in (log, loaded):
        for part in range(3):
            outcome = replayed(each, *TWICE, part=part)
            assert (float(outcome.same), float(outcome.steps)) == (1.0, 6.0)
    assert replayed(without_digests(log), *TWICE).same == 1.0


@pytest.mark.parametrize(
    ("step", "motion", "name", "time"),
    [
        (0, TALL, "flow", 0.0),  # the first of two, of another size
        (1, WIDE, "flow", 0.0),  # and the second
        (2, LOW, "flow[0, 0]", 0.1),  # exchanged, of the same size
        (3, WIDE, "flow[0, 0]", 0.1),
        (3, LOW + np.eye(2, 3, 1) * 1e-12, "flow[0, 1]", 0.1),
        (5, TALL + np.eye(3, 2, -2), "flow[2, 0]", 0.2),  # the second of two equal ones
    ],
)
def test_each_of_two_motions_at_one_time_is_compared(step, motion, name, time):
    log = hwsim.run(Strict(), Played(*TWICE), parts=2)
    other = [*TWICE[:step], motion, *TWICE[step + 1 :]]
    for part in range(2):
        outcome = replayed(log, *other, part=part)
        assert (float(outcome.same), float(outcome.steps)) == (0.0, step + 1.0)
        assert str(outcome.difference_name.values) == name
        assert float(outcome.difference_time) == pytest.approx(time)


def test_motions_at_one_time_beyond_the_limit_are_compared_by_digests(monkeypatch):
    monkeypatch.setattr("hwsim._part.kept_motions.ROWS_MAX", 5)
    log = hwsim.run(Strict(), Played(*TWICE))
    assert log["controller:flow"].time.values.tolist() == [0.0] * 5
    assert replayed(log, *TWICE).same == 1.0
    outcome = replayed(log, *TWICE[:3], WIDE, *TWICE[4:])
    assert str(outcome.difference_name.values) == "flow_digest" and outcome.steps == 4.0


def test_numbers_at_one_time_and_a_tier_beside_are_replayed_one_after_the_other():
    log = hwsim.run(Strict(), Both(1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert [log[tier].sizes["row"] for tier in log.tiers] == [7, 4]
    recording = hwsim.Recording(log)
    assert hwsim.run(recording, Both(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)).outcome.same[0] == 1.0
    outcome = hwsim.run(recording, Both(1.0, 2.0, 3.0, 4.5, 5.0, 6.0)).outcome.isel(part=0)
    assert (float(outcome.recorded), float(outcome.commanded), float(outcome.steps)) == (4.0, 4.5, 4.0)
    assert float(outcome.difference_time) == pytest.approx(0.1)


def test_rows_at_one_time_are_written_and_read_to_the_bit_and_never_as_one(tmp_path):
    log = hwsim.run(Strict(), Played(*TWICE))
    columns = {"size": "level"}, {"infeed_rate_command": "flow_command.0"}
    for table, first, named in zip(("controller", "controller:flow"), (4, 2), columns, strict=True):
        path = tmp_path / "log.csv"
        log.to_csv(path, table)
        lines = [line.split(",") for line in path.read_text().splitlines()[1:]]
        written = np.array([[float(cell or "nan") for cell in line] for line in lines])
        flow = log[table].flow_command.values
        wide = flow.reshape(len(flow), -1)
        np.testing.assert_array_equal(written[:, first : first + wide.shape[1]], wide)
        np.testing.assert_array_equal(written[:, 1], log[table].time)
        with pytest.raises(
            ValueError,
            match=r'0\.0 stands in line 2 .* in line 3: .* or (?:duplicates=)?"keep" for the rows of',
        ):
            hwsim.Log.read(path, time="time", part="part", **named)
        for k in range(wide.shape[1]):
            entry = {"infeed_rate_command": f"flow_command.{k}" if wide.shape[1] > 1 else "flow_command"}
            with warnings.catch_warnings(action="ignore"):  # entries that narrow motions do not have
                back = hwsim.Log.read(path, time="time", part="part", duplicates="keep", **named | entry)
            assert (back.source.rows_read, back.source.rows_left_out, back.source.gaps) == (len(wide), 0, ())
            read = back["data"]
            for values, origin in ((read.time, log[table].time), (read.part, log[table].part)):
                np.testing.assert_array_equal(values, origin)
            assert read["infeed_rate_command"].values.tobytes() == wide[:, k].tobytes()


def test_what_is_kept_as_it_stands_is_neither_resampled_nor_aligned():
    table = {"t [s]": [0.0, 0.0, 1.0], "v [mm/s]": [1.0, 1.0, 2.0]}
    for option in ({"resample": 0.5}, {"commands_at": "end"}):
        with pytest.raises(
            ValueError, match=r'duplicates="keep" .*: commands_at must be "begin" and resample'
        ):
            hwsim.Log.read(table, time="t", infeed_rate="v", duplicates="keep", **option)
