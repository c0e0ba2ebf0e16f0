"""``hwsim plunge``: jobs as TOML, what it prints and keeps, what it refuses; the picture of a run."""

import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cli_fakes import OutcomeAlone, only_news, pictures_of_page, without_news, without_shares

import hwsim
import sdpgrind
from hwsim._log.log import same
from hwsim.cli import main
from hwsim.command._plunge.report import report
from hwsim.command._plunge.toml import read
from sdpgrind import physics, plunge

pytestmark = pytest.mark.usefixtures("sketched")
EXAMPLE = Path(__file__).parents[2] / "examples" / "plunge.toml"
PROBLEM = plunge.preset("simulation")
JOB = ["plunge", "--preset", "simulation", "--parts", "4", "--rng", "4"]
KEPT = ["plan.nc", "plan.png", "run.db", "run.nc", "run.png"]


@pytest.fixture
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "deep" / "run"
    assert main([*JOB, "--out", str(folder)]) == 0
    return folder


def said(capsys, *arguments):
    assert main(["plunge", *map(str, arguments)]) == 0
    out, error = capsys.readouterr()
    assert only_news(error)
    return out


def refused(capsys, *arguments):
    """Exit status 2, one line on standard error, nothing on standard output; give the line."""
    assert main(["plunge", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1 and error.startswith("hwsim: ")
    return error.removeprefix("hwsim: ").strip()


def in_python(**options):
    controller = plunge.CycleController(PROBLEM)
    return hwsim.run(hwsim.PlungeGrinder(PROBLEM), controller, parts=4, rng=4, **options)


def test_keeps_plan_log_journal_and_pictures(finished):
    assert sorted(file.name for file in finished.iterdir()) == sorted([*KEPT, "report.html"])
    log = sdpgrind.load(finished / "run.nc")
    assert same(log, in_python(adapt=plunge.adaptation(PROBLEM)))
    with sdpgrind.load(finished / "run.db") as journal:
        assert same(journal.log(), log)
    plan = sdpgrind.load(finished / "plan.nc")
    assert plan.problem == PROBLEM and plan.time == plunge.plan(PROBLEM).time


def test_every_picture_of_its_page_is_drawn(finished, drawn):
    """Worst parts, all parts, plan."""
    assert pictures_of_page(finished, "plan.nc") == 3


def test_prints_the_bound_beside_what_came_of_it(finished, capsys):
    out = said(capsys, *JOB[1:], "--no-pictures", "--out", finished)
    outcome = sdpgrind.load(finished / "run.nc").outcome
    lines = out.splitlines()
    assert lines[0] == "simulation: 0.282 mm of stock, up to 0.0448 mm/s, 3 µm round"
    assert lines[1].startswith("plan: the fastest cycle takes 12.0195 s (known to ") and lines[1].endswith(
        "roundness binds at the end"
    )
    assert lines[2] == (
        "controller: none burned with a confidence of 0.999; burn threshold taken as exactly known"
    )
    assert lines[4].split() == [
        "part",
        "time",
        "s",
        "slack",
        "mm",
        "burned",
        "roundness",
        "mm",
        "out",
        "of",
        "round",
    ]
    for k in range(4):
        first = [
            f"{outcome.time.values[k]:.2f}",
            f"{outcome.part_slack.values[k]:.4f}",
            f"{outcome.burned.values[k]:.0f}",
        ]
        assert lines[5 + k].split() == [str(k), *first, f"{outcome.roundness.values[k]:.5f}", "0"]
    by_name = {line[:24].strip(): line[24:].split() for line in lines}
    assert by_name["time (s)"][:2] == ["12.020", f"{outcome.time.values.mean():.3f}"]
    assert by_name["time from part 1 on (s)"][1] == f"{outcome.time.values[1:].mean():.3f}"
    assert by_name["roundness (µm)"][:2] == ["3.000", f"{1e3 * outcome.roundness.values.mean():.3f}"]
    assert by_name["burned (%)"][:2] == ["0.0", "0.0"]


def test_a_limit_of_burning_that_nothing_comes_near_is_told():
    """A limit or an energy in another unit made "none burned" true, and nothing else was seen of it."""
    burning = PROBLEM.model.burning
    cold = PROBLEM.replace(burning=burning.replace(B=100 * burning.B))
    job = SimpleNamespace(controller=lambda plan: plunge.CycleController(plan.problem))
    lines = list(report.head("a.toml", plunge.plan(cold), job))
    assert (
        lines[2] == "burning: none up to the greatest rate, where the power is 2.5 % of its limit"
    )  # W: 2731/111423


def test_finished_run_is_reported_again_unchanged(finished, capsys):
    before = {name: (finished / name).read_bytes() for name in KEPT}
    outputs = [said(capsys, *JOB[1:], "--no-pictures", "--out", finished) for _ in range(2)]
    assert outputs[0] == outputs[1]
    assert before == {name: (finished / name).read_bytes() for name in KEPT}


def test_a_series_is_made_longer_and_margins_go_on(finished, tmp_path, capsys):
    for parts in (2, 4):
        said(capsys, *JOB[1:3], "--parts", parts, "--rng", 4, "--no-pictures", "--out", tmp_path / "run")
    assert (tmp_path / "run" / "run.nc").read_bytes() == (finished / "run.nc").read_bytes()


def test_the_same_margins_for_every_part(finished, tmp_path, capsys):
    said(
        capsys,
        "--plan",
        finished / "plan.nc",
        "--parts",
        4,
        "--rng",
        4,
        "--no-adapt",
        "--no-pictures",
        "--out",
        tmp_path,
    )
    assert same(sdpgrind.load(tmp_path / "run.nc"), in_python())
    line = refused(capsys, *JOB[1:], "--no-adapt", "--out", finished)
    assert line.endswith("was begun with another adapt")


def test_a_cycle_without_damage_and_one_part(capsys):
    out = said(capsys, "--preset", "experiment", "--parts", 1, "--no-adapt")
    assert "slack of damage" not in out and "part 1 on" not in out
    assert "mean of 1 part " in out


def noisy(tmp_path, size_sd):
    """The example with another noise of its size gauge; its controller believes in 0.5 µm."""
    path = tmp_path / f"{size_sd}.toml"
    path.write_text(EXAMPLE.read_text().replace('size_sd = "0.5 um"', f'size_sd = "{size_sd} um"'))
    return path


def test_parts_that_are_broken_off_are_no_success(tmp_path, capsys):
    """Noise of 50 µm looks like jumps of the gauge: no part is ground, none is in a mean, the last line and
    the status say so.
    """
    assert main(["plunge", str(noisy(tmp_path, 50)), "--parts", "2", "--no-pictures"]) == 1
    lines = capsys.readouterr().out.splitlines()
    why = "readings of size were missing, frozen or jumped"
    assert [line.endswith(f"  broken off: {why}") for line in lines[5:7]] == [True, True]
    assert lines[-1] == f"no part was finished: {why} (2)"
    assert not any(line.startswith(("time", "roundness", "out of round")) for line in lines)


def test_means_are_of_the_parts_that_were_finished():
    job = read(EXAMPLE)
    whole = hwsim.run(job.stand, plunge.CycleController(job.problem), parts=4, rng=1)
    outcome = whole.outcome.copy(deep=True)
    outcome.part_slack.values[1] = 5.0
    outcome.time.values[1], outcome.unfinished.values[1], outcome.timed_out.values[1] = 1e6, 1.0, 1.0
    lines = report("job", OutcomeAlone(outcome), plunge.plan(job.problem), job).splitlines()
    by_name = {line[:24].strip(): line[24:].split() for line in lines}
    kept = outcome.time.values[[0, 2, 3]]
    kept_slack = 1000.0 * outcome.part_slack.values[[0, 2, 3]]
    assert by_name["slack of damage (µm)"][1] == f"{kept_slack.mean():.2f}"
    assert "burned, of all (%)" in by_name and "burned (%)" not in by_name
    assert "mean of 3 of 4 parts" in by_name and by_name["time (s)"][1] == f"{kept.mean():.3f}"
    assert by_name["time from part 1 on (s)"][1] == f"{kept[1:].mean():.3f}"
    assert lines[6].endswith("broken off: time was up") and "broken" not in lines[5]
    assert lines[-1] == "1 of 4 parts were broken off, and are in no mean of times and sizes: time was up (1)"


def test_what_begins_is_said_and_so_is_a_warning_in_one_line(tmp_path, capsys):
    slow = tmp_path / "slow.toml"
    slow.write_text(EXAMPLE.read_text().replace('"0.0448 mm/s"', '"0.0448 mm/min"'))
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        assert main(["plunge", str(slow), "--parts", "1", "--no-pictures"]) == 0
    first, warning, *news = without_shares(capsys.readouterr().err)
    assert first.startswith("hwsim: planning takes less than 1 s, 1 part less than 1 s, the rest about 5 s")
    assert first.endswith(" (on an idle core, measured on the example)")
    assert warning.startswith("hwsim: warning: no spark-out is needed: ")
    assert news == ["hwsim: planning ...", "hwsim: running 1 part ..."]


def test_a_wrong_line_is_answered_by_one(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main(["plunge", "--parts", "x"])
    assert left.value.code == 2
    assert (
        capsys.readouterr().err
        == "hwsim plunge: argument --parts: invalid int value: 'x'; hwsim plunge --help says more\n"
    )
    missing = tmp_path / "none.toml"
    assert refused(capsys, missing) == f"{missing}: No such file or directory"


def test_wear_is_planned_by_stages(tmp_path, capsys):
    path = tmp_path / "job.toml"
    path.write_text(
        EXAMPLE.read_text().replace("# [model.wear]", "[model.wear]").replace("# growth =", "growth =")
    )
    out = said(capsys, path, "--parts", 2)
    assert "s, dp)" in out.splitlines()[1]
    assert read(path).problem.model.wear == plunge.Wear(0.02)


def test_other_refusals(finished, capsys):
    assert (
        refused(capsys)
        == "problem.toml, --preset or --plan must be given; try: hwsim plunge --preset simulation"
    )
    assert refused(capsys, "--preset", "P1").endswith("got 'P1'")
    log = finished / "run.nc"
    assert (
        refused(capsys, "--plan", log) == f"--plan must be a saved plan of a plunge cycle; {log} holds a Log"
    )
    line = refused(capsys, "--preset", "experiment", "--out", finished)
    assert line.startswith(f"--out {finished} holds a run of another problem (model, stock, ")
    with pytest.raises(SystemExit):
        main(["plunge", "--help"])
    assert "--no-adapt" in capsys.readouterr().out


def test_the_example_is_the_preset_on_another_machine():
    job = read(EXAMPLE)
    assert job.problem.model.replace(wheel_speed=1.0e4, work_rotation=20.0) == PROBLEM.model.replace(
        wheel_speed=1.0e4, work_rotation=20.0
    )
    assert (job.problem.model.wheel_speed, job.problem.model.work_rotation) == pytest.approx(
        (37e3, 10 * np.pi), rel=1e-14
    )
    assert (job.problem.stock, job.problem.command_rate_max, job.problem.roundness_max) == (
        0.282,
        0.0448,
        0.003,
    )
    assert dict(job.settings) == {"confidence": 0.999}
    assert job.problem.uncertainty == plunge.Uncertainty(burning_sd=0.02)
    assert job.problem.drive == plunge.Drive(feed_delay=0.04, feed_lag=0.02)
    assert job.stand.inspection == hwsim.Inspection(severity_sd=0.03)
    assert job.stand.truth == job.problem.model.replace(wear_flat_area=0.0286)
    assert (job.stand.noise, job.stand.power_max) == (hwsim.GrinderNoise(), 3000.0)


SHAFT = """
stock = 0.2
command_rate_max = "2 mm/min"
roundness_max = "4 um"
time_constant = "90.85 ms"
sample_time = "20 ms"
[model]
wheel_diameter = "40 cm"
work_diameter = 50
width = 20
internal = false
wheel_speed = "45 m/s"
work_rotation = "240 rpm"
wear_flat_area = "0.3 %"
stiffness = "40 kN/mm"
normal_force_ratio = 2.5
diffusivity = 12.5
roundness_base = 0.001
roundness_gain = 1.5
[model.power]
sliding = "malkin"
pressure = 7.0
[model.burning]
u0 = 6.2
B = 12.0
[controller]
safety_margin = 0.01
sparkout = "p_end"
online = false
no_burn = true
observer_gain = 0.2
[grinder]
dynamics = "nonlinear"
size_delay = true
command_quantum = "0.1 um"
max_time = "2 min"
[grinder.noise]
size_sd = 0
[grinder.truth]
stiffness = 35e3
[grinder.truth.wear]
growth = 1e-3
exponent = 0.5
"""


@pytest.fixture
def job(tmp_path):
    """Write a changed shaft and give its path."""

    def write(old="", new=""):
        assert old in SHAFT
        path = tmp_path / "job.toml"
        path.write_text(SHAFT.replace(old, new, 1))
        return path

    return write


def test_a_time_constant_of_the_printed_cycle_alone(tmp_path):
    """It is no machine's: the example with another warns, unless its controller takes it."""
    example = EXAMPLE.read_text().replace('sample_time = "0.04 s"', 'time_constant = "1.25 s"')
    path = tmp_path / "job.toml"
    path.write_text(example)
    with pytest.warns(UserWarning, match=r"a time_constant of 1\.25 s changes no plan: .* of 1\.933 s"):
        read(path)
    path.write_text(example.replace("[controller]", '[controller]\nsparkout = "printed"'))
    assert read(path).problem.time_constant == 1.25


def test_every_table(job):
    got = read(job())
    model = plunge.PlungeModel(
        wheel_diameter=400.0, work_diameter=50.0, width=20.0, internal=False, wheel_speed=45e3,
        work_rotation=got.problem.model.work_rotation, wear_flat_area=0.003, stiffness=4e4, normal_force_ratio=2.5,
        diffusivity=12.5, roundness_base=0.001, roundness_gain=1.5, burning=physics.BurningLimit(6.2, 12.0),
        power=physics.GrindingPower(sliding=physics.MalkinSliding(pressure=7.0)),
    )  # fmt: skip
    assert got.problem.model == model and model.work_rotation == pytest.approx(8 * np.pi, rel=1e-14)
    assert (got.problem.command_rate_max, got.problem.sample_time, got.problem.time_constant) == (
        pytest.approx(1 / 30),
        0.02,
        0.09085,
    )
    stand = hwsim.PlungeGrinder(
        got.problem, noise=hwsim.GrinderNoise(size_sd=0.0), size_delay=True, command_quantum=1e-4, max_time=120.0,
        truth=model.replace(stiffness=35e3, wear=plunge.Wear(1e-3, 0.5)),
    )  # fmt: skip
    assert got.stand == stand
    plan = plunge.plan(got.problem)
    controller = plunge.CycleController(
        got.problem, safety_margin=0.01, online=False, no_burn=True, observer_gain=0.2
    )
    assert got.controller(plan) == controller


FAULTS = [
    ("stock = 0.2", "stok = 0.2", "stock is missing; is it meant by stok?"),
    ("stock = 0.2", "stock = '0.2 s'", "stock must have a unit like mm; got '0.2 s'"),
    ("stock = 0.2", "stock = 0", "stock must be > 0 (mm); got 0.0"),
    (
        '"4 um"',
        '"0.5 um"',
        "roundness_max must be > roundness_base = 0.001: no rate is round enough (mm); got 0.0005",
    ),
    ('"20 ms"', '"1 s"', "sample_time must be <= time_constant/4 = 0.02271 (s); got 1.0"),
    ("internal = false", "internal = 1", "model.internal must be true or false; got 1"),
    (
        "internal = false",
        "internal = true",
        "[model] wheel_diameter must be < work_diameter = 50 in a bore (mm); got 400.0",
    ),
    (
        '"45 m/s"',
        "45",
        '[model] wheel_speed must be in mm/s, some 30000; "... m/s" for m/s; got 45.0',
    ),
    ("width = 20", "width = 20\ncolour = 3", "model.colour is not a key; keys here are"),
    ("stiffness", "stifness", "model.stiffness is missing; is it meant by model.stifness?"),
    ("[model]\n", "[modell]\n", "[modell] is no table here; is [model] meant?"),
    ("[model.power]", "[power]", "model.power is missing; is [power] to be [model.power]?"),
    ('"malkin"', '"coulomb"', "model.power.sliding must be one of dong, malkin; got 'coulomb'"),
    ('"malkin"', '["malkin"]', "model.power.sliding must be one of dong, malkin; got ['malkin']"),
    ("pressure = 7.0", "coefficient = 7.0", "model.power.coefficient is not a key; keys here are"),
    ("B = 12.0", "B = -7.2", "[model.burning] B must be > 0 (J/(mm^2 s^(1/2))); got -7.2"),
    (
        'sparkout = "p_end"',
        'sparkout = "q_k"',
        "[controller] sparkout must be one of p_end, gauge, printed; got 'q_k'",
    ),
    ("observer_gain = 0.2", "observer_gain = 2", "[controller] observer_gain must be in (0, 1]; got 2.0"),
    (
        "safety_margin = 0.01",
        "safety_margin = 0.3",
        "[controller] safety_margin must be < stock = 0.2 (mm); got 0.3",
    ),
    ("no_burn = true", "no_burn = 'yes'", "controller.no_burn must be true or false; got 'yes'"),
    (
        '"nonlinear"',
        '"second_order"',
        "[grinder] dynamics must be one of nonlinear, first_order; got 'second_order'",
    ),
    (
        "u0 = 6.2",
        "u0 = 6205",
        "[model.burning] u0 must be in J/mm^3, some 6; multiply by 0.001 for J/cm^3; got 6205.0",
    ),
    (
        "max_time",
        "contact_zero_sd = 5\nmax_time",
        '[grinder] contact_zero_sd must be in mm, some 0.01; "... um" for micrometres; got 5.0',
    ),
    (
        "size_sd = 0",
        "size_sd = 0.5",
        '[grinder.noise] size_sd must be in mm, some 0.0005; "... um" for micrometres; got 0.5',
    ),
    ("size_sd = 0", "size_sd = -1", "[grinder.noise] size_sd must be >= 0 (mm); got -1.0"),
    ("stiffness = 35e3", "wear_flat_area = 2", "[grinder.truth] wear_flat_area must be in (0, 1]; got 2.0"),
    ("stiffness = 35e3", "stock = 0.3", "grinder.truth.stock is not a key; keys here are"),
    ("growth = 1e-3", "rate = 1e-3", "grinder.truth.wear.growth is missing"),
]


@pytest.mark.parametrize(("old", "new", "line"), FAULTS)
def test_one_clear_line_and_nothing_written(job, tmp_path, capsys, old, new, line):
    path = job(old, new)
    assert refused(capsys, path, "--out", tmp_path / "out").startswith(f"{path}: {line}")
    assert [file.name for file in tmp_path.iterdir()] == ["job.toml"]


def test_the_picture_shows_what_the_log_holds(finished, pyplot):
    log = sdpgrind.load(finished / "run.nc")
    figure = log.plot()
    rates, stock, time, slack, roundness = figure.axes
    table = log["controller"]
    last = table.isel(row=np.flatnonzero(table.part.values == 3))
    lines = {line.get_label(): line for line in (*rates.lines, *stock.lines)}
    np.testing.assert_array_equal(
        lines["remaining stock, by the gauge"].get_ydata(), PROBLEM.stock - last["size"].values
    )
    np.testing.assert_array_equal(lines["command"].get_ydata(), 1e3 * last.command_rate_command.values)
    damage = lines["depth of damage, by power"]
    assert damage.get_ydata().max() == pytest.approx(float(PROBLEM.model.burn_depth(0.0435)), abs=6e-3)
    np.testing.assert_allclose(time.lines[0].get_ydata(), log.outcome.time)
    np.testing.assert_allclose(slack.lines[0].get_ydata(), 1e3 * log.outcome.part_slack)
    np.testing.assert_allclose(roundness.lines[0].get_ydata(), 1e3 * log.outcome.roundness)
    assert [axis.get_ylabel() for axis in figure.axes] == [
        "rate [µm/s]", "depth from the size [mm]", "time [s]", "part slack [µm]", "out-of-round [µm]",
    ]  # fmt: skip
    assert (
        figure.get_suptitle()
        == f"4 parts: {log.outcome.time.values.mean():.2f} s each, 0 burned, 0 out of round"
    )
    verticals = [line for line in rates.lines if np.ptp(line.get_xdata()) == 0]
    assert len(verticals) == 2  # where balance and spark-out begin


def test_a_burned_part_is_red(pyplot):
    log = hwsim.run(
        hwsim.PlungeGrinder(PROBLEM),
        plunge.CycleController(
            PROBLEM.replace(wear_flat_area=0.02, sharpness_sd=0.0, deflection_sd=0.0), online=False
        ),
    )
    figure = log.plot()
    assert log.outcome.burned.values == [1.0] and "s each, 1 burned, " in figure.get_suptitle()
    (dot,) = (
        line for line in figure.axes[3].lines if line.get_color() == "tab:red" and len(line.get_xdata())
    )
    assert dot.get_ydata()[0] < 0


class Plain:
    """A controller of one's own that reports nothing."""

    period = PROBLEM.sample_time

    def reset(self):
        pass

    def step(self, *, size, **measured):
        return {"retract": 1.0} if size > 0.01 else {"command_rate": 0.02}


def test_a_controller_that_reports_nothing_is_drawn_too(pyplot):
    rates, stock, *_ = hwsim.run(hwsim.PlungeGrinder(PROBLEM), Plain(), parts=2).plot().axes
    assert len(rates.lines) == 1 and len(stock.lines[0].get_xdata()) > 10


def test_a_sliding_law_of_ones_own_is_run_and_drawn_without_damage(pyplot):
    class Mine(physics.DongSliding):
        pass

    problem = PROBLEM.replace(power=PROBLEM.model.power.replace(sliding=Mine()))
    grinder = hwsim.PlungeGrinder(problem)
    assert "problem" not in grinder.description
    figure = hwsim.run(grinder, plunge.CycleController(problem, safety_margin=0.01)).plot()
    assert all(line.get_label() != "depth of damage, by power" for line in figure.axes[1].lines)


def test_controllers_are_compared_in_a_picture(pyplot):
    both = {
        "ours": plunge.CycleController(PROBLEM, safety_margin=0.005),
        "stages": plunge.StagedController(PROBLEM, 0.09, 0.0079),
    }
    figure = hwsim.compare(hwsim.PlungeGrinder(PROBLEM), both, parts=3).plot()
    assert any("time" in axis.get_title() for axis in figure.axes)
