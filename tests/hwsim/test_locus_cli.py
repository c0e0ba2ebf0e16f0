"""``hwsim locus``: jobs as TOML, what it prints and keeps, what it refuses, kill -9 in the middle of a run."""

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cli_fakes import only_news, pictures_of_page, without_news
from hwsim_forked import Command

import hwsim
import sdpgrind
from hwsim._log.log import same
from hwsim.cli import main
from hwsim.command._locus.toml import DESIGNED, PRINTED, read
from hwsim.devices import Gauge
from sdpgrind import locus, physics

pytestmark = pytest.mark.usefixtures("sketched")
EXAMPLE = Path(__file__).parents[2] / "examples" / "locus.toml"
PROBLEM = locus.preset("grinding")
JOB = ["--preset", "grinding", "--printed", "--parts", "5", "--rng", "2"]
KEPT = ["curve.nc", "curve.png", "run.db", "run.nc", "run.png"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("runs") / "deep" / "run"
    assert main(["locus", *JOB, "--out", str(folder)]) == 0
    return folder


def said(capsys, *arguments):
    assert main(["locus", *map(str, arguments)]) == 0
    out, error = capsys.readouterr()
    assert only_news(error)
    return out


def refused(capsys, *arguments):
    """Exit status 2, one line on standard error, nothing on standard output; give the line."""
    assert main(["locus", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1 and error.startswith("hwsim: ")
    return error.removeprefix("hwsim: ").strip()


def table(out):
    return {line[:24].strip(): line[24:].split() for line in out.splitlines()}


def in_python(settings, **options):
    controller = locus.LocusController(locus.plan(PROBLEM), along="infeed_rate", **settings)
    return hwsim.run(hwsim.AdaptiveGrinder(PROBLEM), controller, parts=5, rng=2, **options)


def test_keeps_curve_log_journal_and_pictures(finished):
    assert sorted(file.name for file in finished.iterdir()) == sorted([*KEPT, "report.html"])
    log = sdpgrind.load(finished / "run.nc")
    assert same(log, in_python(PRINTED, adapt=locus.LearnedStart()))
    with sdpgrind.load(finished / "run.db") as journal:
        assert same(journal.log(), log)
    curve = sdpgrind.load(finished / "curve.nc")
    assert curve.problem == PROBLEM and curve.at(wear_flat_area=0.006) == locus.plan(PROBLEM).at(
        wear_flat_area=0.006
    )


def test_every_picture_of_its_page_is_drawn(finished, drawn):
    """Worst parts, all parts, plan."""
    assert pictures_of_page(finished, "curve.nc") == 3


def test_koren_s_cycles_from_the_command_line(finished):
    np.testing.assert_array_equal(
        sdpgrind.load(finished / "run.nc").outcome.convergence_time, [27.5, 4.0, 3.5, 3.5, 3.5]
    )


def test_prints_the_best_beside_what_came_of_it(finished, capsys):
    out = said(capsys, *JOB, "--no-pictures", "--out", finished)
    outcome = sdpgrind.load(finished / "run.nc").outcome
    lines = out.splitlines()
    assert lines[0] == "grinding: 0.3 mm of stock, infeed up to 50 µm/s, work 0.4 to 63 rad/s"
    assert lines[1].startswith("curve: ") and lines[1].endswith("; best at 0.006: 15.104 µm/s, 10.453 rad/s")
    assert lines[2].startswith("controller: begins at 1.000 µm/s, ") and lines[2].endswith(
        " rad/s; margin 0 W"
    )
    heads = [
        "part",
        "time",
        "s",
        "converged",
        "s",
        "slack",
        "W",
        "burned",
        "removal",
        "mm^3/s",
        "wear",
        "flats",
    ]
    assert lines[4].split() == heads
    for k in range(5):
        first = [
            f"{outcome.time.values[k]:.2f}",
            f"{outcome.convergence_time.values[k]:.1f}",
            f"{outcome.slack.values[k]:.2f}",
        ]
        last = [f"{outcome.removal_rate.values[k]:.2f}", f"{outcome.true_wear_flat_area.values[k]:.5f}"]
        assert lines[5 + k].split() == [str(k), *first, f"{outcome.burned.values[k]:.0f}", *last]
    rows = table(out)
    # nothing is faster than the best point
    assert float(rows["time (s)"][0]) < outcome.time.values.min() + 0.2
    assert rows["removal rate (mm^3/s)"][1] == f"{outcome.removal_rate.values.mean():.3f}"
    assert rows["burned (%)"][:2] == ["0.0", "80.0"]


def test_the_best_that_is_printed_is_that_of_the_page(finished, capsys):
    """The best point of each part's true wheel in the middle of its course: wheels wear evenly within it."""
    from hwsim._report.locus import planned

    log, curve = sdpgrind.load(finished / "run.nc"), sdpgrind.load(finished / "curve.nc")
    best = planned(log, curve)
    truly = log.outcome.attrs["stock"] / np.nanmean(log.outcome.best_infeed_rate.values[1:], axis=1)
    np.testing.assert_allclose(best["time"][1:], truly, rtol=5e-3)
    rows = table(said(capsys, *JOB, "--no-pictures", "--out", finished))
    assert rows["time (s)"][0] == f"{best['time'].mean():.3f}"
    assert rows["removal rate (mm^3/s)"][0] == f"{best['removal_rate'].mean():.3f}"


def test_a_designed_gain_burns_nothing(capsys):
    out = said(capsys, "--preset", "grinding", "--parts", 3, "--rng", 2)
    log = in_python(DESIGNED, adapt=locus.LearnedStart())
    assert table(out)["burned (%)"][:2] == ["0.0", "0.0"]
    assert f"{log.outcome.slack.values[1]:.2f}" in out.splitlines()[6].split()


def test_finished_run_is_reported_again_unchanged(finished, capsys):
    before = {name: (finished / name).read_bytes() for name in KEPT}
    outputs = [said(capsys, *JOB, "--no-pictures", "--out", finished) for _ in range(2)]
    assert outputs[0] == outputs[1]
    assert before == {name: (finished / name).read_bytes() for name in KEPT}


def test_a_series_is_made_longer_with_the_dull_wheel(finished, tmp_path, capsys):
    for parts in (2, 5):
        said(capsys, *JOB[:3], "--parts", parts, "--rng", 2, "--no-pictures", "--out", tmp_path / "run")
    assert (tmp_path / "run" / "run.nc").read_bytes() == (finished / "run.nc").read_bytes()


def test_every_part_begins_at_the_same_point(finished, tmp_path, capsys):
    arguments = [
        "--curve",
        finished / "curve.nc",
        "--printed",
        "--parts",
        5,
        "--rng",
        2,
        "--no-adapt",
        "--no-pictures",
    ]
    said(capsys, *arguments, "--out", tmp_path)
    assert same(sdpgrind.load(tmp_path / "run.nc"), in_python(PRINTED))
    assert refused(capsys, *JOB, "--no-adapt", "--out", finished).endswith("was begun with another adapt")


def test_parts_that_are_never_done_are_told(tmp_path, capsys):
    path = tmp_path / "job.toml"
    path.write_text(
        EXAMPLE.read_text().replace("[grinder.power_gauge]", 'max_time = "10 s"\n[grinder.power_gauge]')
    )
    assert main(["locus", str(path), "--parts", "2"]) == 1
    out = capsys.readouterr().out
    rows = table(out)
    assert rows["broken off (%)"][1] == "100.0" and "never converged (%)" in rows
    assert out.splitlines()[-1] == "no part was finished: time was up (2)" and "time (s)" not in rows


def test_other_refusals(finished, tmp_path, capsys):
    assert (
        refused(capsys)
        == "problem.toml, --preset or --curve must be given; try: hwsim locus --preset grinding"
    )
    assert refused(capsys, "--preset", "P1").endswith("got 'P1'")
    assert refused(capsys, "--preset", "turning").endswith(
        "as the preset grinding is: no other machine is here; got Turning"
    )
    log = finished / "run.nc"
    assert (
        refused(capsys, "--curve", log)
        == f"--curve must be a saved curve of an optimal locus; {log} holds a Log"
    )
    line = refused(capsys, EXAMPLE, "--printed")
    assert line == "--printed must be left out where a problem.toml sets the controller; got both"
    other = tmp_path / "job.toml"
    other.write_text(EXAMPLE.read_text().replace('width = "9.3 mm"', 'width = "9 mm"'))
    line = refused(capsys, other, "--out", finished)
    assert line == f"--out {finished} holds a run of another problem (model differs): choose another folder"
    assert refused(capsys, *JOB[:2], "--rng", 2, "--out", finished).endswith(
        "was begun with another controller"
    )
    with pytest.raises(SystemExit):
        main(["locus", "--help"])
    assert "--printed" in capsys.readouterr().out


_SPEC = importlib.util.spec_from_file_location("kill", Path(__file__).parents[2] / "benchmarks" / "kill.py")
kill = importlib.util.module_from_spec(_SPEC)
sys.modules.setdefault("kill", kill)
_SPEC.loader.exec_module(kill)


@pytest.mark.usefixtures("finished")
def test_killed_in_the_middle_and_resumed(tmp_path, capsys):
    """The journal holds whole parts; the same command gives the log of an uninterrupted run."""
    arguments = [str(EXAMPLE), "--parts", "100", "--rng", "3", "--no-pictures", "--out"]
    out = tmp_path / "killed"
    with Command("locus", *arguments, out) as run:
        while run.poll() is None and kill.parts_in(out) < 3:
            time.sleep(0.02)
        run.kill()
    assert 3 <= kill.parts_in(out) < 100
    for folder, parts in ((out, 10), (tmp_path / "whole", max(10, kill.parts_in(out)))):
        said(capsys, arguments[0], "--parts", parts, *arguments[3:], folder)
    assert (out / "run.nc").read_bytes() == (tmp_path / "whole" / "run.nc").read_bytes()


def test_the_example_is_the_preset_on_another_machine():
    job = read(EXAMPLE)
    assert job.problem.model == PROBLEM.model
    for ours, its in ((job.problem.controls, PROBLEM.controls), (job.problem.hidden, PROBLEM.hidden)):
        assert list(ours) == list(its)
        np.testing.assert_allclose(list(ours.values()), list(its.values()), rtol=1e-14)
    assert dict(job.settings) == {"margin": 6.0}
    truth = PROBLEM.model.replace(burning=physics.BurningLimit(u0=6.2, B=7.17))
    wheel = {"dulling": 3.3333e-4, "dress_at": 0.0075, "dressed_area": 0.006}
    assert job.stand == hwsim.AdaptiveGrinder(
        job.problem, truth=truth, power_gauge=Gauge(noise_sd=1.0), **wheel
    )


def test_koren_s_own_settings_stand_in_the_example(tmp_path):
    path = tmp_path / "job.toml"
    text = EXAMPLE.read_text()
    for key in ("gain", "kp", "hold", "at", "start", "floor"):
        assert f"# {key} = " in text
        text = text.replace(f"# {key} = ", f"{key} = ")
    path.write_text(text.replace("margin = ", "# margin = "))
    settings = read(path).settings
    assert settings.keys() == PRINTED.keys() and settings["at"] == "command"
    for name, value in PRINTED.items():
        assert settings[name] == (value if name == "at" else pytest.approx(value, rel=1e-14))


BORE = """
[process]
wheel_diameter = 50
work_diameter = "70 mm"
width = 9
wheel_speed = "37 m/s"
internal = true
[process.power]
sliding = "dong"
[controls]
infeed_rate = ["0.5 um/s", "3 mm/min"]
work_rotation = ["10 rpm", "600 rpm"]
[hidden]
wear_flat_area = [0.01, 0.03]
[controller]
along = "wear_flat_area"
wear_flat_area = [0.012, 0.028]
gain = "schedule"
start = "feasible"
hold = "none"
method = "inversion"
filter = "50 %"
lag = 1.0
period = "250 ms"
[grinder]
wear_flat_area = 0.02
dulling = 0
power_lag = 0
idle_error = "10 W"
touch_in = "2 s"
max_time = "1 min"
[grinder.power_gauge]
relative_sd = "1 %"
quantum = 5
[grinder.truth]
width = "9.1 mm"
"""


@pytest.fixture
def job(tmp_path):
    """Write a changed bore and give its path."""

    def write(old="", new=""):
        assert old in BORE
        path = tmp_path / "job.toml"
        path.write_text(BORE.replace(old, new, 1))
        return path

    return write


def test_every_table(job):
    got = read(job())
    process = locus.processes.Grinding(
        wheel_diameter=50.0, work_diameter=70.0, width=9.0, wheel_speed=37e3, internal=True,
        power=physics.GrindingPower(sliding=physics.DongSliding()),
    )  # fmt: skip
    assert got.problem.model == process
    assert got.problem.controls["infeed_rate"] == pytest.approx((5e-4, 0.05), rel=1e-14)
    assert got.problem.controls["work_rotation"] == pytest.approx((np.pi / 3, 20 * np.pi), rel=1e-14)
    settings = {
        "along": "wear_flat_area",
        "x": (0.012, 0.028),
        "gain": "schedule",
        "start": "feasible",
        "hold": "none",
    }
    assert dict(got.settings) == settings | {"method": "inversion", "filter": 0.5, "lag": 1.0, "period": 0.25}
    assert got.stand == hwsim.AdaptiveGrinder(
        got.problem, truth=process.replace(width=9.1), wear_flat_area=0.02, dulling=0.0, power_lag=0.0, idle_error=10.0,
        touch_in=2.0, max_time=60.0, power_gauge=Gauge(relative_sd=0.01, quantum=5.0),
    )  # fmt: skip


FAULTS = [
    ("width = 9", "widht = 9", "process.width is missing; is it meant by process.widht?"),
    ("width = 9", "width = '9 s'", "process.width must have a unit like mm; got '9 s'"),
    ("wheel_diameter = 50", "wheel_diameter = 90", "[process] wheel_diameter must be < work_diameter = 70 in a bore (mm)"),
    ('"37 m/s"', "37", "[process] wheel_speed must be in mm/s, some 30000; \"... m/s\" for m/s; got 37.0"),
    ("internal = true", "internal = 1", "process.internal must be true or false; got 1"),
    ('"dong"', '"coulomb"', "process.power.sliding must be one of dong, malkin; got 'coulomb'"),
    ('["0.5 um/s", "3 mm/min"]', "0.05", "controls.infeed_rate must be a list of numbers (mm/s); got 0.05"),
    ('["0.5 um/s", "3 mm/min"]', "[0.05]", "controls.infeed_rate must be a least and a greatest value (mm/s); got [0.05]"),
    ('"3 mm/min"', '"3 rad/s"', "controls.infeed_rate[1] must have a unit like mm/s; got '3 rad/s'"),
    ("[0.01, 0.03]", "[0.03, 0.01]", "hidden['wear_flat_area'] must be (least, greatest) with least < greatest"),
    ("[0.01, 0.03]", "[1, 3]", "wear_flat_area must be a part of 1, in [0, 1]: divide by 100 for percent; got 3.0"),
    ('"600 rpm"', "6000", "work_rotation must be in rad/s, up to 211.4, with the work's surface below 7400 mm/s; \"... rpm\" for rev/min; got 6000.0"),
    ('"600 rpm"', '"600 rad/s"', "work_rotation must be up to 211.4 rad/s, with the work's surface below 7400 mm/s; got '600 rad/s'"),
    ("[hidden]\n", "[hidden]\ncolour = 3\n", "hidden.colour is not a key; keys here are wear_flat_area"),
    ("lag = 1.0", "lagg = 1.0", "controller.lagg is not a key; is controller.lag meant?"),
    ("gain = \"schedule\"", "gain = '3 W'", "controller.gain must have a unit like mm/(s W); got '3 W'"),
    ("wear_flat_area = 0.02", "wear_flat_area = 2", "[grinder] wear_flat_area must be in (0, 1]; got 2.0"),
    ("power_lag = 0", "power_lag = -1", "[grinder] power_lag must be >= 0 (s); got -1.0"),
    ("relative_sd", "relative", "grinder.power_gauge.relative is not a key; is grinder.power_gauge.relative_sd meant?"),
    ('"9.1 mm"', "0", "[grinder.truth] width must be > 0 (mm); got 0.0"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line"), FAULTS)
def test_one_clear_line_and_nothing_written(job, tmp_path, capsys, old, new, line):
    path = job(old, new)
    assert refused(capsys, path, "--out", tmp_path / "out").startswith(f"{path}: {line}")
    assert [file.name for file in tmp_path.iterdir()] == ["job.toml"]


def test_a_controller_that_cannot_be_is_refused_before_anything_is_written(tmp_path, capsys):
    path = tmp_path / "job.toml"
    path.write_text(EXAMPLE.read_text().replace("margin =", 'gain = "1 mm/(s W)"\nmargin ='))
    assert refused(capsys, path, "--out", tmp_path / "out").startswith("gain must be < ")
    assert [file.name for file in tmp_path.iterdir()] == ["job.toml"]
