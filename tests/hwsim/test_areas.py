"""What every command ``hwsim <area>`` does alike, tried on a toy: a new area gives words and a few functions."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import pytest
import toy_area
import xarray as xr
from cli_fakes import only_news, without_news
from hwsim_fakes import Drain, Tank
from hwsim_inside import CommandReport, Table, broken_off, read, same, summary_line, with_kept

import hwsim
import sdpgrind
from hwsim import cli
from hwsim.command.base import AreaCommand, StandJob
from sdpgrind import plunge
from sdpgrind.base import records
from sdpgrind.base.quantities import Described, described, law, quantity

pytestmark = pytest.mark.usefixtures("sketch")


@pytest.fixture(autouse=True)
def toy(monkeypatch):
    """One line in the table of areas, one in the table of records."""
    entry, known = EntryPoint("toy.flow", "toy_area:Flow", "sdpgrind.records"), records.entry_points
    monkeypatch.setattr(cli, "_AREAS", (*cli._AREAS, "toy_area"))
    monkeypatch.setattr(
        records,
        "entry_points",
        lambda group, name: [entry] if name == "toy.flow" else known(group=group, name=name),
    )


def said(capsys, *arguments):
    """What a command prints."""
    assert cli.main(["toy", *map(str, arguments)]) == 0
    out, error = capsys.readouterr()
    assert only_news(error)
    return out


def refused(capsys, *arguments):
    assert cli.main(["toy", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1
    return error.removeprefix("hwsim: ").strip()


def test_an_area_is_a_small_module():
    assert len(Path(toy_area.__file__).read_text().splitlines()) < 120


def test_help_of_all_areas_and_of_one(capsys):
    for arguments, words in (
        (["--help"], ("weldbead", "toy", "drain a tank")),
        (["toy", "--help"], ("full, half", "--no-leak", "--plan")),
    ):
        with pytest.raises(SystemExit) as ended:
            cli.main(arguments)
        out = capsys.readouterr().out
        assert ended.value.code == 0 and all(word in out for word in words)


def test_runs_reports_and_keeps(tmp_path, capsys):
    out = tmp_path / "deep" / "run"
    lines = said(capsys, "--preset", "full", "--parts", 12, "--rng", 3, "--out", out).splitlines()
    log = hwsim.run(Tank(leak=0.5), Drain(2.0), parts=12, rng=3)
    assert same(sdpgrind.load(out / "run.nc"), log) and sdpgrind.load(out / "plan.nc") == toy_area.Flow(
        toy_area.Draining()
    )
    assert lines[0] == "full: 2 mm/s" and lines[1].split() == ["drain", "time", "s", "lost", "mm/s"]
    assert lines[2].split() == ["0", f"{log.outcome.time.values[0]:.2f}", f"{log.outcome.leak.values[0]:.3f}"]
    assert lines[12] == " ...  (2 more)" and lines[15].startswith("mean of 12 drains ")
    time = log.outcome.time.values
    assert lines[16].split() == [
        "time",
        "(s)",
        "5.00",
        f"{time.mean():.2f}",
        f"{time.std(ddof=1) / 12**0.5:.2f}",
    ]
    assert lines[-1] == f"kept in {out}: plan.nc, run.nc, run.db, plan.png, run.png, report.html"
    assert sorted(file.name for file in out.iterdir()) == [
        "plan.nc",
        "plan.png",
        "report.html",
        "run.db",
        "run.nc",
        "run.png",
    ]
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in out.glob("*.png"))
    again = said(capsys, "--preset", "full", "--parts", 12, "--rng", 3, "--out", out, "--no-pictures")
    assert again.splitlines()[:-1] == lines[:-1]
    fewer = said(capsys, "--preset", "full", "--parts", 2, "--rng", 3, "--out", out, "--no-pictures")
    assert f"{out} held 12 finished drains already: all of them are reported, not 2" in fewer


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_is_gone_hears_no_complaint(unbuffered):
    line = [
        sys.executable,
        "-c",
        "import time; time.sleep(0.2); from hwsim.cli import main; main()",
        "--help",
    ]
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    process = subprocess.Popen(
        line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    process.stdout.close()
    assert process.stderr.read() == "" and process.wait() == 0
    process.stderr.close()


def test_switches_are_the_areas_own(capsys):
    tight = said(capsys, "--preset", "half", "--no-leak", "--parts", 2)
    assert [line.split()[1:] for line in tight.splitlines()[2:4]] == [["5.00", "0.000"]] * 2


def test_refusals_name_the_areas_words(tmp_path, capsys):
    plan, other = tmp_path / "full.nc", tmp_path / "half.nc"
    toy_area.Flow(toy_area.Draining()).save(plan)
    toy_area.Flow(toy_area.Draining(5.0), error=None).save(other)
    assert refused(capsys) == "problem.toml, --preset or --plan must be given; try: hwsim toy --preset full"
    assert refused(capsys, "--preset", "full", "--tolerance", 0) == "--tolerance must be > 0 (mm/s); got 0.0"
    assert (
        refused(capsys, "--preset", "full", "--plan", other)
        == f"--plan {other} is for another problem: level differs"
    )
    asked = refused(capsys, "--plan", other, "--tolerance", 1)
    assert asked.startswith(
        f"--plan {other} holds a plan of unknown error, --tolerance asks for 1 mm/s: plan anew, without --plan"
    )
    hwsim.run(Tank(), Drain(), parts=1).save(tmp_path / "log.nc")
    wrong = refused(capsys, "--plan", tmp_path / "log.nc")
    assert wrong == f"--plan must be a saved plan of a tank; {tmp_path / 'log.nc'} holds a Log"
    said(capsys, "--plan", plan, "--parts", 1, "--out", tmp_path / "run", "--no-pictures")
    kept = refused(capsys, "--preset", "half", "--out", tmp_path / "run")
    assert (
        kept
        == f"--out {tmp_path / 'run'} holds a run of another problem (level differs): choose another folder"
    )
    assert "was begun with another plant" in refused(
        capsys, "--plan", plan, "--no-leak", "--out", tmp_path / "run"
    )


def test_an_area_without_tolerance_has_no_such_option(monkeypatch, capsys):
    monkeypatch.setattr(toy_area.Toy, "tolerance", "")
    monkeypatch.setattr(cli, "_parser_of", cli._parser_of.__wrapped__)
    with pytest.raises(SystemExit):
        cli.main(["toy", "--preset", "full", "--tolerance=1"])
    assert "unrecognized arguments: --tolerance=1" in capsys.readouterr().err
    assert said(capsys, "--preset", "full", "--parts", 1)


class Words(AreaCommand):
    """An area of words alone: it reads, plans and names what its library has."""

    name, about, made_for, presets = "words", "nothing new", "a plunge cycle", "simulation"
    library, plans = "sdpgrind.plunge", "CyclePlan"

    def job_of(self, problem, arguments):
        return StandJob(hwsim.PlungeGrinder(problem))


def test_an_area_is_mostly_words(monkeypatch):
    beside = {"toml": SimpleNamespace(read=str), "report": SimpleNamespace(report=lambda *told: repr(told))}
    for name, module in beside.items():
        monkeypatch.setitem(sys.modules, f"{Words.__module__}.{name}", module)
    monkeypatch.setattr(Words, "__module__", f"{Words.__module__}.command")
    area = Words()
    assert area.preset("simulation") == plunge.preset("simulation") and area.plan_class() is plunge.CyclePlan
    job = area.job_of(area.preset("simulation"), None)
    assert job.problem == plunge.preset("simulation") and job == StandJob(job.stand, {})
    assert area.plan(job, None, None).problem == job.problem
    assert area.read(Path("a.toml"), None) == "a.toml" and area.report("a", 1, 2, 3) == "('a', 1, 2, 3)"


class Broken:
    """Three parts of which one was thrown by the table and one given up."""

    def __init__(self):
        flags = {"unfinished": [0.0, 1.0, 1.0], "slipped": [0.0, 1.0, 0.0]}
        columns = {name: ("part", values, {"units": ""}) for name, values in flags.items()}
        self.outcome = xr.Dataset(columns | {"time": ("part", [4.0, 1.0, 2.0], {"units": "s"})})

    def __len__(self):
        return 3


def test_a_report_says_which_parts_were_broken_off():
    def summary(log, plan, job, finished):
        yield summary_line("time (s)", log.outcome.time.values[finished], ".1f", plan)

    report = CommandReport(
        [("time", ".1f")], {}, lambda *told: iter([f"{told}"]), summary, "ring", "it was tired"
    )
    assert report("a", Broken(), 3.0).splitlines() == [
        "('a', 3.0, None)",
        "",
        "ring        time s",
        "   0           4.0",
        "   1           1.0  broken off: the table threw the part",
        "   2           2.0  broken off: it was tired",
        "worst          4.0",
        "in ring          0",
        "",
        "mean of 1 of 3 rings         planned    realised  std. error",
        "time (s)                         3.0         4.0           -",
        "broken off (%)                   0.0        66.7        33.3",
        "2 of 3 rings were broken off, and are in no mean of times and sizes: the table threw the part (1), it was tired (1)",
    ]
    assert broken_off(Broken().outcome)[2] == "the controller gave up"


def test_what_is_kept_is_said_below():
    assert with_kept("text", Path("runs"), ["a.nc", "a.png"]) == "text\n\nkept in runs: a.nc, a.png"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("level = ", "Invalid value (at end of document)"),
        ("levle = 3", "levle is not a key; is level meant?"),
        ("duration = '3 mm'", "duration must have a unit like s; got '3 mm'"),
        ("duration = 0", "duration must be > 0 (s); got 0.0"),
    ],
)
def test_faults_name_the_file(tmp_path, capsys, text, fault):
    path = tmp_path / "job.toml"
    path.write_text(text)
    assert refused(capsys, path) == f"{path}: {fault}"


def test_a_file_is_read(tmp_path, capsys):
    path = tmp_path / "job.toml"
    path.write_text("level = '1 cm'\nduration = 4")
    assert said(capsys, path, "--parts", 1).startswith(f"{path}: 2.5 mm/s\n")


def test_lists_and_tables_that_may_be_missing(tmp_path):
    table = Table("stand", {"sizes": ["1 cm", 2], "inner": {"a": 1}, "one": 3})
    assert table.list_of("sizes", "mm") == [10.0, 2.0]
    assert table.maybe("inner").number("a", "") == 1.0 and table.maybe("none").entries == {}
    with pytest.raises(ValueError, match=r"stand\.one must be a list of numbers \(mm\); got 3"):
        table.list_of("one", "mm")
    with pytest.raises(ValueError, match=r"stand\.sizes\[0\] must have a unit like s; got '1 cm'"):
        table.list_of("sizes", "s")
    path = tmp_path / "file.toml"
    path.write_text("[x]\ny = 1")
    assert read(path, lambda file: file.table("x").number("y", "")) == 1.0


class Weight:
    def force(self):
        return 9.81


@described()
class Press(Described):
    force_max: float = quantity("N", above=0)
    gap: float = quantity("mm", above=0, default=0.1)
    load: object = law({"weight": Weight}, "a load", "force", default_factory=Weight)


def test_options_are_what_is_given_and_something_known_is_changed():
    assert Table("press", {"gap": "20 um"}).options(Press) == {"gap": 0.02}
    assert Table("press", {"gap": "20 um"}).options(Press, skip=("force_max",)) == {"gap": 0.02}
    changed = Table("press", {"force_max": "1 kN"}).changed(Press(5.0, gap=0.2))
    assert (changed.force_max, changed.gap) == (1000.0, 0.2)
    with pytest.raises(ValueError, match=r"press\.gpa is not a key; is press\.gap meant\?"):
        Table("press", {"gpa": 0.1}).options(Press)
    with pytest.raises(ValueError, match=r"press\.gap is not a key"):
        Table("press", {"gap": 0.1}).options(Press, skip=("gap",))
    with pytest.raises(ValueError, match=r"\[press\] force_max must be > 0 \(N\); got -1.0"):
        Table("press", {"force_max": -1}).changed(Press(5.0))
