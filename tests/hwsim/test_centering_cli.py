"""``hwsim centering``: jobs as TOML, what it prints and keeps, what it refuses, the source's controller
beside ours.
"""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from centering_machine_inside import Size, prepared, read, reasons, same, solved
from cli_fakes import only_news, pictures_of_page, without_news

import centering
import hwsim
import sdpgrind
from centering.cycle import PushKind
from centering.cycle._strategy import risk as risks
from hwsim.cli import main
from sdpgrind import units
from sdpgrind.base.progress import silent

pytestmark = pytest.mark.usefixtures("sketched")
EXAMPLE = Path(__file__).parents[2] / "examples" / "centering.toml"
KEPT = ["film.png", "run.db", "run.nc", "run.png", "strategy.nc", "strategy.png"]
KINDS = tuple(PushKind("trapezoid", speed, True) for speed in (5.0, 20.0, 80.0))
SMALL = """
offset_max = "6 mm"
[part]
mass = "800 g"
radius = 61.95
[machine]
start_offset = ["1 mm", "5 mm"]
"""


def quick(problem, *, size=(48, 5), **options):
    """A coarse strategy in the place of a fine one."""
    speed = options.get("spindle_speed", "scheduled")
    return solved(prepared(problem, speed, KINDS, Size(*size), None, silent), None, silent)


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    path = tmp_path_factory.mktemp("job") / "job.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def strategy(job):
    made = quick(read(job).problem)
    made.save(job.parent / "quick.nc")
    return made


@pytest.fixture(scope="module", autouse=True)
def robust():
    """The function that finds a risk, which tests find once for equal strategies and options."""
    found = []

    def known(*asked):
        if asked not in (each for each, _ in found):
            found.append((asked, whole(*asked)))
        return next(risk for each, risk in found if each == asked)

    whole = risks.robust
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(risks, "robust", known)
        yield whole


@pytest.fixture
def given(job, strategy):
    """The options of a run with the quick strategy."""
    return job, "--strategy", job.parent / "quick.nc"


def said(capsys, *arguments):
    assert main(["centering", *map(str, arguments)]) == 0
    out, error = capsys.readouterr()
    assert only_news(error)
    return out


def refused(capsys, *arguments):
    """Exit status 2, one line on standard error, nothing on standard output; give the line."""
    assert main(["centering", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1 and error.startswith("hwsim: ")
    return error.removeprefix("hwsim: ").strip()


@pytest.fixture(scope="module")
def finished(job, strategy):
    pytest.importorskip("matplotlib")
    folder = job.parent / "deep" / "run"
    options = ["--strategy", str(job.parent / "quick.nc"), "--parts", "3", "--rng", "2", "--out", str(folder)]
    assert main(["centering", str(job), *options]) == 0
    return folder


def in_python(job, strategy, parts=3):
    made = read(job)
    return hwsim.run(made.stand, made.controller(strategy), parts=parts, rng=2)


def test_keeps_strategy_log_journal_and_pictures(job, strategy, finished):
    assert sorted(file.name for file in finished.iterdir()) == sorted([*KEPT, "report.html"])
    log = sdpgrind.load(finished / "run.nc")
    assert same(log, in_python(job, strategy))
    with sdpgrind.load(finished / "run.db") as journal:
        assert same(journal.log(), log)
    assert sdpgrind.load(finished / "strategy.nc") == strategy


@pytest.mark.usefixtures("drawn")
def test_every_picture_of_its_page_is_drawn(finished):
    """All parts, plan."""
    assert pictures_of_page(finished, "strategy.nc") == 2


def test_prints_the_strategy_beside_what_came_of_it(job, strategy, finished, capsys):
    out = said(capsys, job, "--parts", 3, "--rng", 2, "--no-pictures", "--out", finished)
    lines, outcome = out.splitlines(), sdpgrind.load(finished / "run.nc").outcome
    assert lines[0] == f"{job}: a ring of 0.8 kg, radius 61.95 mm, from up to 6 mm to 2.5 µm"
    assert f"{strategy.cycle_time(6.0):.2f} s from 6 mm" in lines[1]
    start = np.hypot(outcome.center_x[:, 0], outcome.center_y[:, 0]).values
    row = next(line for line in lines if line.startswith("time (s)")).split()
    assert float(row[2]) == pytest.approx(np.mean([strategy.cycle_time(x) for x in start]), abs=6e-4)
    assert float(row[3]) == pytest.approx(float(outcome.time.mean()), abs=6e-4)
    row = next(line for line in lines if line.startswith("pushes")).split()
    assert float(row[2]) == pytest.approx(float(outcome.pushes.mean()), abs=6e-4)
    heads, first = lines[4], lines[5].split()
    assert "offset µm" in heads and float(first[3]) == pytest.approx(
        1000 * float(outcome.offset[0]), abs=6e-3
    )
    row = next(line for line in lines if line.startswith("offset at the end (µm)")).split()
    assert float(row[-2]) == pytest.approx(1000 * float(outcome.offset.mean()), abs=6e-4)
    assert out.endswith(f"kept in {finished}: strategy.nc, run.nc, run.db, report.html\n")


def test_a_page_tells_where_the_time_differs_from_the_plan(job, strategy):
    """Three legs of the cycle, planned and realised: each sums to its whole, and none is called exact."""
    log = in_python(job, strategy, parts=6)
    text = " ".join(log.report(plan=strategy).split())
    start = np.hypot(log.outcome.center_x[:, 0], log.outcome.center_y[:, 0]).values
    planned, real = np.mean([strategy.cycle_time(x) for x in start]), float(log.outcome.time.mean())
    assert f"planned {planned:.6g} s expected" in text and f"{planned:.6g} s exact" not in text
    legs = reasons(log, strategy)["time"]
    shown = [float(each) for each in re.findall(r"\d\.\d{3}", legs)]
    assert sum(shown[::2]) == pytest.approx(real, abs=2e-3) and sum(shown[1::2]) == pytest.approx(
        planned, abs=2e-3
    )
    table, begin = log["control"].to_dataframe().query("part == 2"), log.outcome.time.values[2]
    rising = table.time[(table.pushing > 0) & ~(table.pushing.shift() > 0)]
    assert len(rising) == log.outcome.pushes[2] and 0 < begin - rising.iloc[-1] < begin
    model = strategy.simulate(runs=400, rng=0, start=np.resize(start, 400))
    assert shown[5] == pytest.approx(np.mean(model.last), abs=1e-3)
    times = strategy.timing
    most = np.max(strategy.outcomes.contact_time) + times.after[:, 1:3].max()
    most += times.final_arc.max() / times.before.min()
    assert np.all(model.last <= most) and np.all(model.last < model.time)


def test_a_page_tells_which_parts_end_above_what_the_plan_pushes_again(job, strategy):
    log = in_python(job, strategy, parts=6)
    told, finish = reasons(log, strategy)["offset"], 1000 * strategy.finish
    above = log.outcome.offset.values > strategy.finish
    assert f"{100 * above.mean():.1f} % of the parts ended above {finish:.3g} µm" in told
    assert f"ended at {1000 * log.outcome.offset.values[~above].mean():.3f} µm" in told
    log.outcome["true_mu_kinetic"][:] = 0.15001  # as planned, in all digits that are told
    assert "friction" in told and "friction" not in reasons(log, strategy)["offset"]


def test_a_kept_run_goes_on(job, strategy, given, tmp_path, capsys):
    for parts in (1, 3):
        out = said(capsys, *given, "--parts", parts, "--rng", 2, "--no-pictures", "--out", tmp_path)
        assert f"mean of {parts} part" in out
    assert same(sdpgrind.load(tmp_path / "run.nc"), in_python(job, strategy))


def test_plans_anew_where_no_strategy_is_given(job, strategy, monkeypatch, capsys):
    asked = {}

    def plan(problem, **options):
        asked.update(options, problem=problem)
        return strategy

    monkeypatch.setattr(centering, "plan", plan)
    said(capsys, job, "--parts", 1)
    assert asked["spindle_speed"] == "scheduled" and asked["problem"] == strategy.problem


def test_a_preset_says_that_slow_pushes_are_too_coarse_for_it(monkeypatch, capsys):
    monkeypatch.setattr(centering, "plan", partial(quick, size=(16, 3)))
    lines = said(capsys, "--preset", "printed", "--parts", 1).splitlines()
    assert lines[0] == "printed: a ring of 18.9 kg, radius 89.5 mm, from up to 10 mm to 2.5 µm"
    assert lines[3] == f"note: {centering.preset('printed').quantum_note}"


def test_the_sources_controller_on_the_same_parts(job, strategy, given, tmp_path, capsys):
    out = said(
        capsys, *given, "--source", "--parts", 2, "--rng", 1, "--no-pictures", "--out", tmp_path / "both"
    )
    kept = sdpgrind.load(tmp_path / "both" / "compare.nc").outcome
    made = read(job)
    both = {"source": made.source(strategy), "ours": made.controller(strategy)}
    fresh = hwsim.compare(made.stand, both, parts=2, rng=1).outcome
    np.testing.assert_array_equal(kept.time, fresh.time)
    row = next(line for line in out.splitlines() if line.startswith("time (s), mean")).split()
    np.testing.assert_allclose([float(x) for x in row[-2:]], fresh.time.mean("part"), atol=6e-3)
    assert sdpgrind.load(tmp_path / "both" / "strategy.nc") == strategy


def test_the_example_is_read():
    made = read(EXAMPLE)
    assert made.problem.model.part == centering.push.Part(5.0, 85.0)
    assert made.problem.tolerance == pytest.approx(0.0025)
    assert made.problem.limits.spindle_speed_max == pytest.approx(units.rpm(100))
    assert made.stand.truth == made.problem.model.replace(mu_kinetic=0.16) and made.stand.start_offset == (
        1.0,
        10.0,
    )
    assert made.spindle_speed == "scheduled" and made.settings.timeout == 60.0


def test_all_that_a_file_may_say(tmp_path):
    path = tmp_path / "job.toml"
    path.write_text(
        'preset = "identified"\nspindle_speed = "30 rpm"\npushes_max = 9\nfriction_range = [0.7, 1.2]\n[limits]\nsafety = "0.3 mm"\n[scatter]\nstop_sd = 0\n'
        '[controller]\nmargin = "0.4 mm"\n[machine]\nstart_offset = 2\ntip_radius = 5\nscheduler = false\n'
        "gain_scheduling = false\n"
        '[machine.scatter]\nmeasuring_sd = "1 um"\n[machine.errors]\nrunout = "1 um"\n'
    )
    made = read(path)
    known = centering.preset("identified")
    assert made.problem == known.replace(
        pushes_max=9,
        limits=known.limits.replace(safety=0.3),
        scatter=known.scatter.replace(stop_sd=0.0),
        friction_range=(0.7, 1.2),
    )
    assert (
        made.spindle_speed == pytest.approx(units.rpm(30))
        and made.settings.margin == 0.4
        and made.settings.tip_radius == 5.0
    )
    machine = made.stand
    assert machine.start_offset == 2.0 and machine.scheduler is None and not machine.gain_scheduling
    assert machine.scatter.measuring_sd == pytest.approx(1e-3) and machine.errors.runout == pytest.approx(
        1e-3
    )


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('preset = "best"', "preset must be one of printed, identified; got 'best'"),
        (
            'spindle_speed = "3000 rpm"',
            "spindle_speed must be <= spindle_speed_max = 10.472 (rad/s); got 314.159",
        ),
        ('spindle_speed = "3000 rpm"', ", from '3000 rpm'"),
        ("tolerence = 1", "tolerence is not a key; is tolerance meant?"),
        ('tolerance = "2 kg"', "tolerance"),
        ("friction_range = [1.1, 1.2]", "friction_range[0] must be in (0, 1]"),
        ("friction_range = 0.8", "friction_range must be a list of numbers"),
        ("[part]\nmass = -1", "[part] mass must be > 0 (kg); got -1"),
        ("[model]\nmu_static = 0.1", "[model] mu_static must be >= mu_kinetic = 0.15; got 0.1"),
        (
            '[limits]\nspindle_speed_max = "80 Hz"',
            "[limits] spindle_speed_max must be < 30 (rad/s); got '80 Hz'",
        ),
        (
            "[limits]\nspindle_speed_max = 80",
            '[limits] spindle_speed_max must be < 30; "... rpm" for rev/min (rad/s); got 80.0',
        ),
        ("[limits]\nspindle_speed_max = 0", "[limits] spindle_speed_max must be > 0 (rad/s); got 0"),
        ("[machine]\nstart_offset = [5, 1]", "[machine] start_offset must be of a least and a greatest"),
        (
            "[machine]\nstart_offset = [1, 15]",
            "[machine] start_offset must be <= offset_max = 10 (mm); got (1.0, 15.0)",
        ),
        ("[machine]\nscheduler = 1", "machine.scheduler must be true or false; got 1"),
        ("[machine.truth]\nmu = 1", "machine.truth.mu is not a key"),
    ],
)
def test_faults_of_a_file_are_one_line(tmp_path, capsys, line, message):
    path = tmp_path / "job.toml"
    path.write_text(f"{line}\n")
    told = refused(capsys, path)
    assert told.startswith(f"{path}: ") and message in told


def test_what_cannot_be_asked_for(given, tmp_path, capsys):
    assert refused(capsys).startswith(
        "problem.toml, --preset or --strategy must be given; try: hwsim centering --preset printed"
    )
    assert "--live must be left out with --source" in refused(capsys, *given, "--source", "--live")
    (tmp_path / "old.txt").write_text("")
    told = refused(capsys, *given, "--source", "--out", tmp_path)
    assert told == f"--out must be a new or empty folder with --source; {tmp_path} holds something"
    other = tmp_path / "other.toml"
    other.write_text(SMALL + "scheduler = false\n[limits]\nsafety = 0.4\n")
    assert "is for another problem: limits differs" in refused(capsys, other, *given[1:])


def test_the_risk_of_the_range_is_told(given, strategy, robust, capsys):
    risk = robust(strategy, strategy.problem.friction_range, 200, 0)
    assert f"\nrisk: {risk.told}\n" in said(capsys, *given, "--parts", "1", "--no-pictures")
    assert (
        risk.told.startswith("friction x 0.8 to 1.25; slowest on average at x ")
        and "none of 200 thrown (1.8 % at most" in risk.told
    )
    assert f"Risk by the true friction over that told: {strategy._risk.told}" in strategy.report()
    assert read(EXAMPLE).problem.friction_range == (0.8, 1.25)
