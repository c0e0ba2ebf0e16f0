"""A damaged journal: the chain of its parts, what is told of each damage, what can be salvaged, versions."""

import contextlib
import json
import shutil
import sqlite3

import numpy as np
import pytest
from hwsim_fakes import Drain, noisy_tank
from hwsim_inside import chain, salvage, same
from test_journal import OLD
from test_kept_motions import TALL, TWICE, WIDE, Played, Stand, Strict

import hwsim
import sdpgrind
from hwsim.cli import main

RUN = {"version": "2", "labels": "{}"}
BEGUN = "6f9ebde10704872fac6278ed066ad103d3d40d69f71cb7ed0e6b9c6f2b2ddb9d"
DIGESTS = [
    "fddd159f497d4ed0c8d913b40f0048f4323682247860793e823c74fddffa8b95",
    "58516a6cf6abafbfb24ba46af7e30efac31d87909dd8c97d9b9b2d1bcaa72c5b",
]


def change(path, *statements):
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        for statement in statements:
            database.execute(*((statement,) if isinstance(statement, str) else statement))


def rows(path, query):
    with contextlib.closing(sqlite3.connect(path)) as database:
        return database.execute(query).fetchall()


@pytest.fixture
def path(tmp_path):
    """A journal of five parts."""
    hwsim.run(noisy_tank(), Drain(), parts=5, rng=3, journal=tmp_path / "run.db")
    return tmp_path / "run.db"


def test_the_chain_is_that_of_the_specification():
    assert chain.begun(RUN) == BEGUN
    assert chain.begun({**RUN, "begun": "x", "head": "y"}) == BEGUN
    first = chain.following(BEGUN, 0, "{}", "[]", b"")
    second = chain.following(first, 1, '{"time": 1.5}', "[]", b"\0\1")
    assert [first, second] == DIGESTS
    assert chain.head(2, second) == f"2:{DIGESTS[1]}"


def test_a_piece_cannot_be_moved_into_the_next_one():
    """Lengths stand before the pieces: "a", "bc" is not "ab", "c"."""
    assert chain.following(BEGUN, 0, "a", "bc", b"") != chain.following(BEGUN, 0, "ab", "c", b"")
    assert chain.following(BEGUN, 1, "1", "", b"") != chain.following(BEGUN, 11, "", "", b"")


def test_a_written_journal_has_the_chain(path):
    run = dict(rows(path, "SELECT key, value FROM run"))
    assert run["version"] == "2" and run["begun"] == chain.begun(run)
    last = run["begun"]
    for number, outcome, names, arrays, digest in rows(path, "SELECT * FROM part ORDER BY number"):
        last = chain.following(last, number, outcome, names, arrays)
        assert digest == last
    assert run["head"] == chain.head(5, last)


def test_an_empty_journal_has_a_head(tmp_path):
    class Broken(Drain):
        def step(self, **measured):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        hwsim.run(noisy_tank(), Broken(), journal=tmp_path / "run.db")
    run = dict(rows(tmp_path / "run.db", "SELECT key, value FROM run"))
    assert run["head"] == f"0:{run['begun']}"
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert journal.parts == 0


def test_the_head_is_written_with_its_part(path):
    """A part without its head, or a head without its part, is never on the disk."""
    with pytest.raises(sqlite3.IntegrityError):
        change(path, "INSERT INTO part SELECT * FROM part WHERE number = 4")
    change(path, "CREATE TRIGGER no BEFORE UPDATE ON run BEGIN SELECT RAISE(ABORT, 'no'); END")
    with pytest.raises(sqlite3.IntegrityError, match="no"):
        hwsim.run(noisy_tank(), Drain(), parts=6, rng=3, journal=path)
    with hwsim.Journal(path) as journal:
        assert journal.parts == 5 and len(journal.log()) == 5


CHANGES = {
    "an outcome": ("UPDATE part SET outcome = outcome || ' ' WHERE number = 3", "part 3 is not as it was", 3),
    "an index": ("UPDATE part SET names = names || ' ' WHERE number = 3", "part 3 is not as it was", 3),
    "arrays": (
        "UPDATE part SET arrays = zeroblob(length(arrays)) WHERE number = 3",
        "part 3 is not as it was",
        3,
    ),
    "a digest": (f"UPDATE part SET digest = '{BEGUN}' WHERE number = 3", "part 3 is not as it was", 3),
    "another type": ("UPDATE part SET arrays = 'x' WHERE number = 3", "part 3 is not as it was", 3),
    "a part in between": ("DELETE FROM part WHERE number = 2", "part 2 is missing", 2),
    "the last part": ("DELETE FROM part WHERE number = 4", "it had 5 parts, 4 are left", 4),
    "the first part": ("DELETE FROM part WHERE number = 0", "part 0 is missing", 0),
    "all parts": ("DELETE FROM part", "it had 5 parts, 0 are left", 0),
    "the head": ("DELETE FROM run WHERE key = 'head'", "its head is not that of its 5 parts", 5),
    "the head's count": (
        "UPDATE run SET value = '4' || substr(value, 2) WHERE key = 'head'",
        "its head is not that of its 5 parts",
        5,
    ),
    "the head's digest": (
        f"UPDATE run SET value = '5:{BEGUN}' WHERE key = 'head'",
        "its head is not that of its 5 parts",
        5,
    ),
    "begun": (
        f"UPDATE run SET value = '{BEGUN}' WHERE key = 'begun'",
        "its table of the run is not as it was written",
        5,
    ),
    "no begun": ("DELETE FROM run WHERE key = 'begun'", "its table of the run is not as it was written", 5),
    "the version": (
        "UPDATE run SET value = '3' WHERE key = 'version'",
        "its table of the run is not as it was written",
        5,
    ),
    "an old version": (
        "UPDATE run SET value = '1' WHERE key = 'version'",
        "its table of the run is not as it was written",
        5,
    ),
    "labels": (
        "UPDATE run SET value = value || ' ' WHERE key = 'labels'",
        "its table of the run is not as it was written",
        0,
    ),
    "a row more": (
        "INSERT INTO run VALUES ('more', 'x')",
        "its table of the run is not as it was written",
        0,
    ),
    "no text": (
        "UPDATE run SET value = x'00' WHERE key = 'labels'",
        "its table of the run holds what is no text",
        0,
    ),
    "the table": ("DROP TABLE run", "its table of the run cannot be read (no such table: run)", 0),
    "the table of parts": ("DROP TABLE part", "part 0 cannot be read (no such table: part)", 0),
}


@pytest.mark.parametrize("what", CHANGES)
def test_each_damage_is_told_with_the_last_good_part_and_salvaged_up_to_it(path, what, capsys):
    whole = hwsim.run(noisy_tank(), Drain(), parts=5, rng=3)
    statement, wrong, good = CHANGES[what]
    change(path, statement)
    before, target = path.read_bytes(), path.with_name("good.db")
    with pytest.raises(sdpgrind.DamagedFileError) as told, sdpgrind.load(path) as journal:
        journal.log()
    assert told.value.wrong.startswith(wrong) and told.value.path == str(path)
    named = f"part {good - 1} is the last good one; hwsim verify {path} --salvage good.db writes the parts up to it"
    assert told.value.salvage == (named if good else "no part of it can be salvaged")
    with pytest.raises(sdpgrind.DamagedFileError):
        hwsim.run(noisy_tank(), Drain(), parts=6, rng=3, journal=path)
    assert main(["verify", str(path), "--salvage", str(target)]) == 3
    assert path.read_bytes() == before
    assert f"{path}: damaged, {wrong}" in capsys.readouterr().out
    assert target.exists() == (good > 0)
    if good:
        assert main(["verify", str(target)]) == 0
        with hwsim.Journal(target) as journal:
            assert journal.parts == good
        assert same(hwsim.run(noisy_tank(), Drain(), parts=5, rng=3, journal=target), whole)


def test_two_exchanged_parts_are_damage(path):
    change(
        path,
        "UPDATE part SET number = 9 WHERE number = 1",
        "UPDATE part SET number = 1 WHERE number = 2",
        "UPDATE part SET number = 2 WHERE number = 9",
    )
    with (
        hwsim.Journal(path) as journal,
        pytest.raises(sdpgrind.DamagedFileError, match="part 1 is not as it was"),
    ):
        journal.log()


@pytest.mark.parametrize("lost", [0, 4])
def test_the_number_of_parts_does_not_lie(path, lost):
    change(path, f"DELETE FROM part WHERE number = {lost}")
    with hwsim.Journal(path) as journal, pytest.raises(sdpgrind.DamagedFileError):
        _ = journal.parts


def test_the_number_of_parts_is_refused_where_it_cannot_be_read(path):
    change(path, "DROP TABLE part")
    with hwsim.Journal(path) as journal, pytest.raises(sdpgrind.DamagedFileError):
        _ = journal.parts


@pytest.mark.parametrize("parts", [2, 5])
def test_damage_behind_the_wanted_parts_is_told_too(path, parts):
    change(path, "DELETE FROM part WHERE number = 4")
    with pytest.raises(sdpgrind.DamagedFileError, match="it had 5 parts, 4 are left"):
        hwsim.run(noisy_tank(), Drain(), parts=parts, rng=3, journal=path)


def test_another_version_is_refused_by_its_number(path):
    run = dict(rows(path, "SELECT key, value FROM run")) | {"version": "3"}
    change(
        path,
        "UPDATE run SET value = '3' WHERE key = 'version'",
        f"UPDATE run SET value = '{chain.begun(run)}' WHERE key = 'begun'",
    )
    with pytest.raises(ValueError, match=r"of version 1 or 2; .*run\.db' is of version 3$") as told:
        sdpgrind.load(path)
    assert not isinstance(told.value, sdpgrind.DamagedFileError)
    assert main(["verify", str(path), str(path)]) == 2


def test_a_locked_journal_is_not_called_damaged(path, monkeypatch):
    monkeypatch.setattr("hwsim._log.journal_file.PATIENCE", 0.01)
    with contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(sqlite3.OperationalError, match="locked"):
            sdpgrind.load(path)
    with hwsim.Journal(path) as journal, contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        for read in (journal.log, lambda: journal.parts):
            with pytest.raises(sqlite3.OperationalError, match="locked"):
                read()


def test_a_lost_head_of_the_file_is_damage(path):
    """Neither SQLite nor the library know the file any more, but for its tables."""
    raw = path.read_bytes()
    for changed in (b"sqlite" + raw[6:], raw[:100], raw[:4095], bytes(100) + raw[100:]):
        path.write_bytes(changed)
        for read in (sdpgrind.load, hwsim.Journal):
            with pytest.raises(sdpgrind.DamagedFileError, match=r"run\.db' is damaged"):
                read(path)


@pytest.mark.parametrize("name", [b"partpart", b"runrun"])
def test_a_fault_that_sqlite_tells_with_damaged_letters_is_damage(path, name):
    """Its message is no UTF-8 then, and no error of SQLite comes."""
    path.write_bytes(path.read_bytes().replace(name, name[:1] + b"\xcb" + name[2:], 1))
    with pytest.raises(UnicodeDecodeError):
        rows(path, "SELECT * FROM run")
    with pytest.raises(
        sdpgrind.DamagedFileError, match=r"run\.db' is damaged: its table of the run cannot be read"
    ):
        sdpgrind.load(path)


def test_a_broken_transaction_is_undone_in_a_copy(path):
    """SQLite undoes it in the file that it opens: the damaged file stays as it is."""
    change(path, "DELETE FROM part WHERE number = 4")
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("PRAGMA cache_spill = 1").close()
        database.execute("PRAGMA cache_size = 1")
        database.execute("BEGIN IMMEDIATE")
        database.execute("UPDATE part SET arrays = zeroblob(50000)")
        folder = path.with_name("killed")
        folder.mkdir()
        for file in (path, path.with_name("run.db-journal")):
            shutil.copyfile(file, folder / file.name)
        database.execute("ROLLBACK")
    killed = folder / "run.db"
    before = killed.read_bytes()
    assert before != path.read_bytes()
    assert salvage(killed, folder / "good.db") == 4
    assert killed.read_bytes() == before


@pytest.mark.parametrize("lost", [100, 4096, 8192])
def test_the_parts_before_a_lost_end_are_salvaged(tmp_path, lost, capsys):
    path, good = tmp_path / "run.db", tmp_path / "good.db"
    whole = hwsim.run(noisy_tank(), Drain(), parts=30, rng=3, journal=path)
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - lost)
    assert main(["verify", str(path), "--salvage", str(good)]) == 3
    assert "no part of it" not in capsys.readouterr().out
    with hwsim.Journal(good) as journal:
        log = journal.log()
    assert 0 < len(log) <= 30 and np.array_equal(log.outcome.time, whole.outcome.time[: len(log)])


def test_salvage_refuses_what_it_cannot_do(path, capsys):
    target = path.with_name("good.db")
    assert main(["verify", str(path), "--salvage", str(target)]) == 0
    out = capsys.readouterr().out
    assert not target.exists() and "journal of 5 parts, as it was written" in out
    assert out.endswith(f"{target}: not written, since no damage of {path} is known\n")
    change(path, "DELETE FROM part WHERE number = 4")
    target.write_text("mine")
    assert main(["verify", str(path), "--salvage", str(target)]) == 2
    assert target.read_text() == "mine" and "--salvage must be a new file" in capsys.readouterr().err
    for files in ([path, path], [target]):
        assert main(["verify", *map(str, files), "--salvage", str(path.with_name("new.db"))]) == 2
        assert "--salvage needs the journal of a run" in capsys.readouterr().err


def old(tmp_path):
    path = tmp_path / "old.db"
    shutil.copyfile(OLD, path)
    return path


def test_a_journal_of_the_first_version_warns_once(tmp_path):
    with (
        pytest.warns(sdpgrind.OldFileWarning, match=r"old\.db' is of version 0\.1\.0") as told,
        sdpgrind.load(old(tmp_path)) as journal,
    ):
        journal.log()
    assert len(told) == 1 and told[0].filename == __file__


OLD_CHANGES = {
    "a gap": ("DELETE FROM part WHERE number = 0", "part 0 is missing"),
    "an index": ("UPDATE part SET names = '[' WHERE number = 1", "part 1 cannot be read ("),
    "arrays": ("UPDATE part SET arrays = x'00' WHERE number = 1", "part 1 cannot be read ("),
    "labels": ("UPDATE run SET value = '{' WHERE key = 'labels'", "its table of the run cannot be read ("),
    "no labels": ("DELETE FROM run WHERE key = 'labels'", "its table of the run cannot be read ("),
    "prints": (
        "UPDATE run SET value = '{' WHERE key = 'fingerprints'",
        "its table of the run cannot be read (",
    ),
}


@pytest.mark.filterwarnings("ignore::sdpgrind.OldFileWarning")
@pytest.mark.parametrize("what", OLD_CHANGES)
def test_what_cannot_be_read_of_the_first_version_is_damage(tmp_path, what):
    path, (statement, wrong) = old(tmp_path), OLD_CHANGES[what]
    change(path, statement)
    with pytest.raises(sdpgrind.DamagedFileError) as told, sdpgrind.load(path) as journal:
        journal.log()
    assert told.value.wrong.startswith(wrong)
    good = 1 if wrong.startswith("part 1") else 0
    assert main(["verify", str(path), "--salvage", str(tmp_path / "good.db")]) == 3
    assert (tmp_path / "good.db").exists() == (good > 0)
    if good:
        with hwsim.Journal(tmp_path / "good.db") as journal:
            assert journal.parts == 1 and journal.has_digests


def test_a_journal_that_lost_the_digests_of_its_run_is_not_taken_for_an_old_one(path, capsys):
    change(
        path,
        "DELETE FROM run WHERE key IN ('begun', 'head', 'acts')",
        "UPDATE run SET value = '1' WHERE key = 'version'",
    )
    with pytest.raises(sdpgrind.DamagedFileError, match="part 4 is the last good one"):
        hwsim.Journal(path)
    change(path, "UPDATE part SET outcome = '{}' WHERE number = 3")
    target = path.with_name("good.db")
    assert main(["verify", str(path), "--salvage", str(target)]) == 3
    with hwsim.Journal(target) as journal:
        assert journal.parts == 3


def test_an_unknown_version_without_digests_is_refused_by_its_number(tmp_path):
    path = old(tmp_path)
    change(path, "UPDATE run SET value = '0' WHERE key = 'version'")
    with pytest.raises(ValueError, match=r"of version 1 or 2; .*old\.db' is of version 0$"):
        sdpgrind.load(path)


def test_a_long_motion_stands_once_and_deflated(tmp_path):
    """100 parts of one path of 2000 rows: the rows of one part, smaller than they are."""
    path = np.add.outer(np.arange(2000.0), [0.0, 1.0, 2.0])
    hwsim.run(Stand(), Played(path), parts=100, journal=tmp_path / "run.db")
    found = rows(tmp_path / "run.db", "SELECT names, length(arrays) FROM part ORDER BY number")
    motions = [[entry for entry in json.loads(names) if ":" in entry[0]] for names, _ in found]
    assert len(motions[0]) == 2 and not any(motions[1:])
    assert [len(entry) for entry in motions[0]] == [4, 4]
    assert sum(size for _, size in found) < path.nbytes / 2


@pytest.mark.parametrize(("plant", "motions"), [(Stand, (WIDE, TALL)), (Strict, TWICE)])
def test_a_log_from_a_journal_is_replayed_to_the_bit(tmp_path, plant, motions):
    log = hwsim.run(plant(), Played(*motions), parts=3, journal=tmp_path / "run.db")
    with hwsim.Journal(tmp_path / "run.db") as journal:
        read = journal.log()
    assert same(read, log)
    for part in range(3):
        assert hwsim.run(hwsim.Recording(read, part=part), Played(*motions)).outcome.same[0] == 1.0
    other = (*motions[:-1], motions[-1] + 1e-12)
    assert hwsim.run(hwsim.Recording(read), Played(*other)).outcome.same[0] == 0.0
