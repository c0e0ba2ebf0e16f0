"""The journal: readable at every moment, resumes with the same results, refuses what it was not begun for."""

import sqlite3
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hwsim_fakes import Drain, Faster, Tank, noisy_tank
from hwsim_inside import fingerprint, former, same

import centering
import hwsim
import sdpgrind
from sdpgrind import finishing, locus, plunge, weldbead


class PowerCut(Exception):
    pass


def cut_after(parts):
    """Progress that stops the run when so many parts are finished."""

    def progress(share, text):
        if text.startswith(f"part {parts} "):
            raise PowerCut

    return progress


@pytest.mark.parametrize("adapt", [None, Faster()], ids=["no adaptation", "adaptation"])
@pytest.mark.parametrize("finished", [1, 3, 5])
def test_resumed_run_equals_the_uninterrupted_one(tmp_path, adapt, finished):
    whole = hwsim.run(noisy_tank(), Drain(), parts=6, rng=3, adapt=adapt)
    arguments = {"parts": 6, "rng": 3, "adapt": adapt, "journal": tmp_path / "run.db"}
    with pytest.raises(PowerCut):
        hwsim.run(noisy_tank(), Drain(), **arguments, progress=cut_after(finished))
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert journal.parts == finished
    assert same(hwsim.run(noisy_tank(), Drain(), **arguments), whole)


def test_series_can_be_made_longer_and_read_back_in_part(tmp_path):
    path = tmp_path / "run.db"
    short = hwsim.run(noisy_tank(), Drain(), parts=2, rng=1, journal=path)
    long = hwsim.run(noisy_tank(), Drain(), parts=5, rng=1, journal=path)
    assert same(long, hwsim.run(noisy_tank(), Drain(), parts=5, rng=1))
    assert same(short, hwsim.run(noisy_tank(), Drain(), parts=2, rng=1, journal=path))


def test_finished_run_is_not_run_again(tmp_path):
    class Once(Tank):
        def start(self, rng):
            assert not (tmp_path / "done").exists()
            return super().start(rng)

    arguments = {"parts": 2, "journal": tmp_path / "run.db"}
    first = hwsim.run(Once(), Drain(), **arguments)
    (tmp_path / "done").touch()
    assert same(hwsim.run(Once(), Drain(), **arguments), first)


def test_executor_writes_the_same_journal(tmp_path):
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(2) as executor:
        hwsim.run(noisy_tank(), Drain(), parts=9, journal=tmp_path / "run.db", executor=executor)
    assert same(hwsim.Journal(tmp_path / "run.db").log(), hwsim.run(noisy_tank(), Drain(), parts=9))


def test_journal_opens_through_load_and_holds_the_log(tmp_path):
    log = hwsim.run(noisy_tank(), Drain(), parts=3, journal=tmp_path / "run.db")
    with sdpgrind.load(tmp_path / "run.db") as journal:
        assert isinstance(journal, hwsim.Journal)
        assert repr(journal).startswith("<hwsim.Journal: 3 parts in ")
        assert same(journal.log(), log)


def test_outcomes_can_be_read_with_sqlite_alone(tmp_path):
    log = hwsim.run(noisy_tank(), Drain(), parts=3, journal=tmp_path / "run.db")
    with sqlite3.connect(tmp_path / "run.db") as database:
        levels = database.execute(
            "SELECT json_extract(outcome, '$.level') FROM part ORDER BY number"
        ).fetchall()
    database.close()
    assert [level for (level,) in levels] == log.outcome.level.values.tolist()


def test_a_figure_that_is_no_number_is_null_for_sqlite(tmp_path):
    class Unsure(Drain):
        def report(self):
            return {"end": float("nan")}

    hwsim.run(noisy_tank(), Unsure(), journal=tmp_path / "run.db")
    with sqlite3.connect(tmp_path / "run.db") as database:
        found = database.execute("SELECT json_type(outcome, '$.end_planned') FROM part").fetchone()
    database.close()
    assert found == ("null",)


def test_another_process_reads_while_the_run_goes_on(tmp_path):
    path = tmp_path / "run.db"
    script = "import sys, hwsim; print(hwsim.Journal(sys.argv[1]).parts)"
    seen = []

    def read(share, text):
        if text.startswith("part 2 "):
            seen.append(
                subprocess.run(
                    [sys.executable, "-c", script, path], capture_output=True, text=True, check=True
                )
            )

    hwsim.run(noisy_tank(), Drain(), parts=4, journal=path, progress=read)
    assert seen[0].stdout == "2\n"


def test_everything_stands_in_one_file(tmp_path):
    hwsim.run(noisy_tank(), Drain(), parts=2, journal=tmp_path / "run.db")
    assert [file.name for file in tmp_path.iterdir()] == ["run.db"]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"plant": Tank(level=9.0, leak=0.5)}, "plant"),
        ({"controller": Drain(2.5)}, "controller"),
        ({"rng": 4}, "rng"),
        ({"adapt": Faster()}, "adapt"),
        ({"plant": Tank(), "controller": Drain(3.0)}, "plant and controller"),
    ],
)
def test_journal_of_another_run_is_refused(tmp_path, change, named):
    begun = {"plant": noisy_tank(), "controller": Drain(), "rng": 3, "adapt": None}
    path = tmp_path / "run.db"
    for arguments in (begun, begun | change):
        run = partial(
            hwsim.run, arguments["plant"], arguments["controller"], rng=arguments["rng"], journal=path
        )
        if arguments is begun:
            run()
            continue
        with pytest.raises(
            ValueError, match=f"journal must be of this run; .*run.db' was begun with another {named}$"
        ):
            run(adapt=arguments["adapt"])
    with hwsim.Journal(path) as journal:
        assert journal.parts == 1


@pytest.mark.parametrize("name", [":memory:", "b" * 240])
def test_any_name_of_a_file_is_one(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    log = hwsim.run(noisy_tank(), Drain(), rng=3, journal=name)
    with hwsim.Journal(name) as journal:
        assert journal.parts == len(log) == 1
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_two_runs_on_one_journal(tmp_path):
    path = tmp_path / "run.db"

    def second(share, text):
        if text == "part 1 of 3":
            hwsim.run(noisy_tank(), Drain(), parts=3, journal=path)

    with pytest.raises(RuntimeError, match=r"part 1 is in .*run.db' already: another run is writing there"):
        hwsim.run(noisy_tank(), Drain(), parts=3, journal=path, progress=second)


@pytest.mark.parametrize("lost", [0, 1])
def test_a_gap_is_told_and_not_read_over(tmp_path, lost):
    """Read over it, the parts behind would move up: a run would go on with the wrong numbers."""
    path = tmp_path / "run.db"
    hwsim.run(noisy_tank(), Drain(), parts=3, rng=3, journal=path)
    with sqlite3.connect(path) as database:
        database.execute("DELETE FROM part WHERE number = ?", (lost,))
    database.close()
    told = rf"run.db' is damaged: part {lost} is missing; "
    with hwsim.Journal(path) as journal, pytest.raises(sdpgrind.DamagedFileError, match=told):
        journal.log()
    for parts in (3, 5):
        with pytest.raises(sdpgrind.DamagedFileError, match=told):
            hwsim.run(noisy_tank(), Drain(), parts=parts, rng=3, journal=path)


def test_files_that_are_no_journals(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"path must be an existing journal; got .*no.db"):
        hwsim.Journal(tmp_path / "no.db")
    (tmp_path / "text.db").write_text("not a database, but long enough to be taken for one by mistake" * 20)
    with pytest.raises(
        ValueError, match=r"path must be the journal of a run; .*text.db' is not \(file is not a database"
    ):
        hwsim.Journal(tmp_path / "text.db")
    sqlite3.connect(tmp_path / "other.db").execute("CREATE TABLE t (x)").connection.close()
    with pytest.raises(ValueError, match=r"other.db' is not \(no such table: run\)"):
        hwsim.Journal(tmp_path / "other.db")
    with pytest.raises(FileNotFoundError, match="path must lie in an existing folder"):
        hwsim.run(Tank(), Drain(), journal=tmp_path / "no folder" / "run.db")


def test_empty_journal_has_no_log(tmp_path):
    class Broken(Drain):
        def step(self, **measured):
            raise PowerCut

    with pytest.raises(PowerCut):
        hwsim.run(Tank(), Broken(), journal=tmp_path / "run.db")
    with (
        hwsim.Journal(tmp_path / "run.db") as journal,
        pytest.raises(ValueError, match="holds no finished part yet"),
    ):
        journal.log()


def twice(x, factor=2):
    return factor * x


def thrice(x, factor=3):
    return factor * x


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 2),
        (1, 1.0),
        (1.0, np.nextafter(1.0, 2.0)),
        (0, False),
        ("1", 1),
        ((1, 2), (12,)),
        ((1, (2,)), (1, 2)),
        ({"a": 1}, {"a": 2}),
        (np.zeros(3), np.zeros((3, 1))),
        (np.zeros(2, np.float32), np.zeros(1, np.float64)),
        (twice, thrice),
        (lambda rng: rng.random(), lambda rng: 2 * rng.random()),
        (partial(twice, factor=4), partial(twice, factor=5)),
        (Tank(), Tank(level=9.0)),
        (Drain(), Drain(2.5)),
        (np.random.default_rng(1), np.random.default_rng(2)),
        (np.random.SeedSequence(1), np.random.SeedSequence(1, spawn_key=(0,))),
        (Tank, Drain),
        ({1, 2}, {1, 3}),
    ],
)
def test_different_things_have_different_fingerprints(one, other):
    assert fingerprint(one) != fingerprint(other)
    assert fingerprint(one) == fingerprint(one)


def test_a_closure_is_told_by_what_it_holds():
    def made(scale):
        return lambda rng: scale * rng.random()

    assert fingerprint(made(1.0)) == fingerprint(made(1.0)) != fingerprint(made(2.0))


def test_labelled_tables_are_told_by_what_they_hold():
    """Not by the order of their columns, nor by how a file kept their names."""
    import xarray as xr

    def table(names=("q1", "q2"), last=2.0, **first):
        return xr.Dataset(
            {**first, "y": ("joint", [1.0, last]), "x": ("row", [3.0])},
            {"joint": np.array(names, dtype=object)},
        )

    same = table(x=("row", [3.0]))
    same = same.assign_coords(joint=np.array(["q1", "q2"]))
    assert list(same.data_vars) != list(table().data_vars) and same.joint.dtype != table().joint.dtype
    assert fingerprint(same) == fingerprint(table())
    assert (
        len(
            {
                fingerprint(each)
                for each in (table(), table(last=2.5), table(("q1", "q3")), table(z=("row", [3.0])))
            }
        )
        == 4
    )


def test_a_ring_of_references_ends():
    ring = Drain()
    ring.myself = ring
    assert fingerprint(ring) != fingerprint(Drain())


def test_equal_in_another_process():
    script = (
        "import sys; sys.path.insert(0, sys.argv[1]); from hwsim_fakes import *; "
        "from hwsim._log.fingerprint import fingerprint; "
        "print(fingerprint((Drain(), noisy_tank(), Faster(), {'b', 'a', 'c'}, rng_of, np.arange(3))))"
    )
    from pathlib import Path

    from hwsim_fakes import rng_of

    done = subprocess.run(
        [sys.executable, "-c", script, Path(__file__).parent], capture_output=True, text=True, check=True
    )
    here = fingerprint((Drain(), noisy_tank(), Faster(), {"c", "a", "b"}, rng_of, np.arange(3)))
    assert done.stdout.strip() == here


OLD = Path(__file__).parents[1] / "data/saved-0.1.0/hwsim.journal.db"


def leave(module="__main__"):
    """The user's controller in the saved journal: one pass, then the bead is left."""

    def step(self, **measured):
        begun = measured["time_left"] < 30.0
        return {"stop": 1.0} if begun else {"duration": 20.0, "normal_force": 40.0}

    own = {"period": None, "tier": "sequence", "reset": lambda self: None, "step": step}
    return type("Leave", (), {**own, "__module__": module, "__qualname__": "Leave"})()


def test_a_journal_of_the_first_version_is_carried_on(tmp_path):
    path = tmp_path / "run.db"
    path.write_bytes(OLD.read_bytes())
    stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
    with pytest.warns(sdpgrind.OldFileWarning) as told:
        log = hwsim.run(stand, leave(), parts=3, journal=path)
    assert len(told) == 1
    assert same(log, hwsim.run(stand, leave(), parts=3))
    with pytest.warns(sdpgrind.OldFileWarning), hwsim.Journal(path) as journal:
        assert journal.parts == 3
    for plant, controller, rng in (
        (hwsim.WeldBeadStand(weldbead.preset("P2")), leave(), 0),
        (stand, leave("another"), 0),
        (stand, leave(), 1),
    ):
        with (
            pytest.warns(sdpgrind.OldFileWarning),
            pytest.raises(ValueError, match="journal must be of this run"),
        ):
            hwsim.run(plant, controller, parts=3, rng=rng, journal=path)


def test_a_part_is_written_once_into_a_journal_of_the_first_version(tmp_path):
    path = tmp_path / "run.db"
    path.write_bytes(OLD.read_bytes())
    with pytest.warns(sdpgrind.OldFileWarning), hwsim.Journal(path) as journal:
        parts = journal.parts
        (part, *_) = journal.read()
        with pytest.raises(RuntimeError, match=r"part 0 is in .*run\.db. already: another run is writing"):
            journal.add(0, part)
        assert journal.parts == parts


def of_exact_numbers():
    """A problem without a number from LAPACK, whose last bits differ between processors."""
    problem = finishing.preset("specimen")
    rounded = tuple(round(8 * c) / 8 for c in problem.model.coefficients)
    covariance = tuple(map(tuple, 0.001 * np.eye(len(rounded))))
    model = problem.model.replace(coefficients=rounded, covariance=covariance, residual_sd=0.0625)
    return problem.replace(model=model)


@pytest.mark.parametrize(
    ("make", "printed"),
    [
        (lambda: hwsim.WeldBeadStand(weldbead.preset("P4"), height=1.0), "00fce6563068"),
        (lambda: hwsim.PlungeGrinder(plunge.preset("simulation")), "909a65dd29b0"),
        (lambda: hwsim.AdaptiveGrinder(locus.preset("grinding")), "3e2821c3c780"),
        (lambda: hwsim.CenteringMachine(centering.preset("printed")), "0b5d6cb8e121"),
        (lambda: hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5)), "55d8aea8ffee"),
        (lambda: hwsim.FinishingCell(of_exact_numbers()), "0db730b0bc3b"),
    ],
)
def test_fingerprints_of_the_first_version_are_known(make, printed):
    """What 0.1.0 wrote for the same object."""
    assert former(make()).startswith(printed) and not fingerprint(make()).startswith(printed)


def test_a_class_of_ours_may_be_moved(monkeypatch):
    before = fingerprint(hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5)))
    monkeypatch.setattr(hwsim.Ring, "__module__", "centering.elsewhere")
    assert fingerprint(hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5))) == before
    monkeypatch.setattr(hwsim.Ring, "__module__", "users.own")
    assert fingerprint(hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5))) != before
