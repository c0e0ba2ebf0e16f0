"""``hwsim finishing``: jobs as TOML, what it prints and keeps, what it refuses, and experiments with --study."""

from pathlib import Path

import numpy as np
import pytest
from cli_fakes import only_news, pictures_of_page, without_news
from finishing_fakes import AXIS

import hwsim
import sdpgrind
from hwsim._log.log import same
from hwsim.cli import main
from hwsim.command._finishing.report import beyond_line, report
from hwsim.command._finishing.toml import read
from sdpgrind import finishing

pytestmark = pytest.mark.usefixtures("sketched")
EXAMPLE = Path(__file__).parents[2] / "examples" / "finishing.toml"
SMALL = """
[surface]
shape = "flat"
side = 6.4
[path]
pattern = "hilbert"
order = 2
mapping = "parametric"
[tool]
feed_rate = "10 mm/s"
[controller]
kind = "pidff"
normal_force = 0.8
[cell.scatter]
height_sd = "5 um"
"""
KEPT = ["motion.nc", "motion.png", "run.db", "run.nc", "run.png"]


def said(capsys, *arguments):
    assert main(["finishing", *map(str, arguments)]) == 0
    out, error = capsys.readouterr()
    assert only_news(error)
    return out


def refused(capsys, *arguments):
    """Exit status 2, one line on standard error, nothing on standard output; give the line."""
    assert main(["finishing", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1 and error.startswith("hwsim: ")
    return error.removeprefix("hwsim: ").strip()


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    path = tmp_path_factory.mktemp("job") / "job.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def finished(job):
    pytest.importorskip("matplotlib")
    folder = job.parent / "deep" / "run"
    assert main(["finishing", str(job), "--parts", "3", "--rng", "2", "--out", str(folder)]) == 0
    return folder


def in_python(job, parts=3):
    made = read(job)
    return hwsim.run(made.stand, made.controller(finishing.plan(made.problem)), parts=parts, rng=2)


def test_keeps_motion_log_journal_and_pictures(job, finished):
    assert sorted(file.name for file in finished.iterdir()) == sorted([*KEPT, "report.html"])
    log = sdpgrind.load(finished / "run.nc")
    assert same(log, in_python(job))
    with sdpgrind.load(finished / "run.db") as journal:
        assert same(journal.log(), log)
    motion = sdpgrind.load(finished / "motion.nc")
    assert motion.problem == read(job).problem
    np.testing.assert_array_equal(motion.profile, finishing.plan(motion.problem).profile)


def test_every_picture_of_its_page_is_drawn(finished, drawn):
    """All parts, plan."""
    assert pictures_of_page(finished, "motion.nc") == 2


def test_prints_the_plan_beside_what_came_of_it(job, finished, capsys):
    out = said(capsys, job, "--parts", 3, "--rng", 2, "--no-pictures", "--out", finished)
    log, motion = sdpgrind.load(finished / "run.nc"), sdpgrind.load(finished / "motion.nc")
    lines, outcome = out.splitlines(), log.outcome
    assert lines[0] == f"{job}: hilbert2, 24 mm of path, pitch 1.71 mm, tool 4 mm"
    assert (
        lines[1].startswith(f"motion: {motion.duration:.2f} s, ")
        and "% of the 10 mm/s commanded; all limits are held" in lines[1]
    )
    slowest = finishing.TorqueController(AXIS, motion, normal_force=0.8).poles.slowest
    assert lines[2] == f"controller: pidff, 0.8 N; its slowest pole decays with {slowest:.1f} 1/s"
    for k in range(3):
        cells = lines[5 + k].split()
        assert cells[:3] == [str(k), f"{outcome.time.values[k]:.2f}", f"{outcome.normal_force.values[k]:.4f}"]
    rows = {line[:24].strip(): line[24:].split() for line in lines}
    force = outcome.normal_force.values
    assert rows["force (N)"] == ["0.8000", f"{force.mean():.4f}", f"{force.std(ddof=1) / np.sqrt(3):.4f}"]
    assert rows["rms off the force (N)"][1] == f"{outcome.force_error.values.mean():.4f}"
    assert rows["time (s)"][0] == f"{motion.duration:.3f}" and rows["beyond the model (%)"] == [
        "100.0",
        "100.0",
        "0.0",
    ]
    assert "roughness Ra (µm)" not in rows  # the model knows no such path
    assert lines[-1] == f"kept in {finished}: motion.nc, run.nc, run.db, report.html"


def test_what_the_model_does_not_know_is_said_before_the_run(job, finished, tmp_path, capsys):
    def told(text):
        (tmp_path / "job.toml").write_text(text)
        found = read(tmp_path / "job.toml")
        return beyond_line(found.problem, found.stand.target_force)

    said(capsys, job, "--parts", 3, "--rng", 2, "--no-pictures", "--out", finished)
    assert main(["finishing", str(job), "--parts", "1", "--no-pictures"]) == 0
    line, begins = "hwsim: no roughness is told: its model does not know pattern hilbert2\n", "hwsim: running"
    error = capsys.readouterr().err
    assert error.count(line) == 1 and error.index(line) < error.index(begins)
    known = SMALL.replace("order = 2", "order = 4")
    assert told(known) == ""
    small = known.replace("0.8", "0.2").replace("[tool]", "[tool]\ntool_diameter = 1.0")
    assert told(small) == (
        "no roughness is told: its model does not know a tool of 1 mm (3 to 4 mm) or a force of 0.2 N (0.556"
        " to 1.667 N)"
    )


def test_roughness_beyond_its_model_has_no_digits(job, finished, tmp_path):
    log, motion = sdpgrind.load(finished / "run.nc"), sdpgrind.load(finished / "motion.nc")
    log.outcome["roughness_ra"][:], log.outcome["extrapolated"][:] = [0.005, 0.1528, 0.004], [0.0, 1.0, 0.0]
    text = report("a job", log, motion, read(job))
    cells = [line.split()[-1] for line in text.splitlines()[4:10]]
    assert cells == ["mm", "0.00500", "-", "0.00400", "0.00500", "0"]
    assert f"{'Ra of 2 parts (µm)':<24}{'':>12}{'4.500':>12}{'0.500':>12}" in text and "52." not in text
    page = log.report(tmp_path / "page.html", plan=motion)
    assert "0.1528" not in Path(page).read_text("utf-8") and "152.8" not in Path(page).read_text("utf-8")
    log.outcome["extrapolated"][:] = 1.0
    text = report("a job", log, motion, read(job))
    assert [line.split()[-1] for line in text.splitlines()[5:10]] == ["-"] * 5 and "nan" not in text
    assert "Ra of" not in text and "roughness Ra" not in text


def test_a_finished_run_is_reported_again_and_made_longer(job, finished, tmp_path, capsys):
    before = {name: (finished / name).read_bytes() for name in KEPT}
    arguments = job, "--rng", 2, "--no-pictures", "--out"
    assert said(capsys, *arguments, finished, "--parts", 3) == said(
        capsys, *arguments, finished, "--parts", 3
    )
    assert before == {name: (finished / name).read_bytes() for name in KEPT}
    for parts in (1, 3):
        said(capsys, *arguments, tmp_path, "--parts", parts)
    assert (tmp_path / "run.nc").read_bytes() == before["run.nc"]


def test_a_kept_motion_is_played_again(job, finished, capsys):
    plain = said(capsys, job, "--parts", 2, "--motion", finished / "motion.nc")
    assert plain.splitlines()[5:] == said(capsys, job, "--parts", 2).splitlines()[5:]
    nominal = said(capsys, "--motion", finished / "motion.nc", "--nominal", "--parts", 2)
    rows = [line.split() for line in nominal.splitlines()[5:7]]
    # but for the encoder's phase
    assert rows[0][1] == rows[1][1] and abs(float(rows[0][2]) - float(rows[1][2])) < 0.01


def test_refusals(job, finished, tmp_path, capsys):
    line = refused(capsys)
    assert line == "problem.toml, --preset or --motion must be given; try: hwsim finishing --preset nominal"
    assert refused(capsys, "--preset", "die").endswith("got 'die'")
    line = refused(capsys, job, "--nominal")
    assert line == "--nominal must be left out where a problem.toml describes the cell; got both"
    log = finished / "run.nc"
    assert (
        refused(capsys, "--motion", log)
        == f"--motion must be a saved motion of a finishing job; {log} holds a Log"
    )
    other = tmp_path / "job.toml"
    other.write_text(SMALL.replace('feed_rate = "10 mm/s"', "feed_rate = 12"))
    line = refused(capsys, other, "--out", finished)
    assert (
        line == f"--out {finished} holds a run of another problem (feed_rate differs): choose another folder"
    )
    other.write_text(SMALL.replace("normal_force = 0.8", "normal_force = 0.9"))
    assert refused(capsys, other, "--rng", 2, "--out", finished).endswith("was begun with another plant")
    line = refused(capsys, job, "--study", "--motion", finished / "motion.nc")
    assert line == "--motion must be left out with --study, which plans motions of its own"
    assert refused(capsys, job, "--study", "--out", job) == f"--out must be a folder; {job} is a file"
    line = refused(capsys, job, "--study", "--parts", 3)
    assert line == "--parts must be left out with --study (--confirm is of the runs that confirm); got 3"
    assert refused(capsys, job, "--confirm", 3) == "--confirm must be left out without --study; got 3"
    assert refused(capsys, job, "--study", "--confirm", 0) == "--confirm must be >= 1; got 0"
    with pytest.raises(SystemExit):
        main(["finishing", "--help"])
    told = capsys.readouterr().out
    assert "--study" in told and "--confirm N" in told


def test_the_example_is_the_preset_in_a_cell_that_scatters():
    made = read(EXAMPLE)
    assert made.problem == finishing.preset("specimen") and made.method == "trapezoid"
    scatter = hwsim.CellScatter(inertia=0.05, tool_mass=0.005)
    assert made.stand == hwsim.FinishingCell(made.problem, scatter=scatter, axis=AXIS, target_force=1.111)
    assert made.controller(None).kind == "lqg" and made.controller(None).normal_force == 1.111
    published = finishing.Study.published("wang-2001")
    levels = {name: tuple(published.factors[name]) for name in published.factors}
    assert {name: tuple(made.study[name]) for name in levels} == levels and made.study[
        "pitch"
    ] == pytest.approx(0.2)


LONG = """
method = "toppra"
[surface]
control_points = [[[0, 0, 0], [0, 30, 1]], [[30, 0, 0], [30, 30, 0]]]
degree = [1, 1]
[path]
pattern = "zigzag"
pitch = "5 mm"
mapping = "equal_spacing"
deviation = "50 um"
[tool]
contact_angle = "20 deg"
heading = "fixed"
pushed = false
placement = [400, 10, "10 cm"]
wrist_radius = 340
[axis]
inertia = "0.0012 kg m^2"
current_limit = "900 mA"
bits = 14
[controller]
kind = "pidff"
observer = "state"
prefilter = true
settle_time = "0.5 s"
[cell]
max_time = "1 min"
[cell.truth]
load_torque = 0.01
tool_mass = "20 g"
table = false
[cell.truth.axis]
torque_constant = "0.2 N m/A"
[cell.truth.wave]
amplitude = "20 um"
wavelength = "8 mm"
direction = [0, 1, 0]
"""


def long(tmp_path, text=LONG):
    path = tmp_path / "job.toml"
    path.write_text(text)
    return path


def test_everything_that_can_be_said(tmp_path):
    made = read(long(tmp_path))
    problem, stand, truth = made.problem, made.stand, made.stand.truth
    surface = finishing.Surface.bspline([[[0, 0, 0], [0, 30, 1]], [[30, 0, 0], [30, 30, 0]]], degree=(1, 1))
    assert problem.path == finishing.zigzag(surface, 5.0).blended(0.05) and made.method == "toppra"
    assert problem.placement == (400.0, 10.0, 100.0) and problem.contact_angle == pytest.approx(np.pi / 9)
    assert (
        stand.axis == finishing.TorqueAxis(inertia=0.0012, current_limit=0.9, bits=14)
        and stand.max_time == 60.0
    )
    assert (
        truth.axis == stand.axis.replace(torque_constant=0.2)
        and truth.table is None
        and truth.tool_mass == 0.02
    )
    assert truth.height == hwsim.HeightField.wave(0.02, 8.0, (0, 1, 0)) and stand.target_force == 1.111
    assert made.settings == {"kind": "pidff", "observer": "state", "prefilter": True, "settle_time": 0.5}


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("[surface]", "[surfaec]", "surface is missing; is it meant by surfaec?"),
        (
            'pattern = "zigzag"',
            'pattern = "spiral"',
            "path.pattern must be one of hilbert, zigzag; got 'spiral'",
        ),
        ('pitch = "5 mm"', 'pitch = "5 s"', "path.pitch must have a unit like mm; got '5 s'"),
        ('pitch = "5 mm"', "pitch = 50", "[path] pitch must be < "),
        ("bits = 14", "bits = 14.5", "[axis] bits must be a whole number; got 14.5"),
        ('"900 mA"', '"9 A"', "[axis] current_limit must be <= current_range = 5 (A); got 9.0"),
        ("pushed = false", "pushed = 0", "tool.pushed must be true or false; got 0"),
        (
            'contact_angle = "20 deg"',
            'contact_angle = "95 deg"',
            "[tool] contact_angle must be in [0, pi/2] (rad); got '95 deg'",
        ),
        (
            'contact_angle = "20 deg"',
            "contact_angle = 20",
            '[tool] contact_angle must be in [0, pi/2]; "30 deg" for degrees (rad); got 20.0',
        ),
        (
            'method = "toppra"',
            'method = "fast"',
            "method must be one of trapezoid, toppra, min_time; got 'fast'",
        ),
        ("table = false", "tables = false", "cell.truth.tables is not a key; is cell.truth.table meant?"),
        (
            '"0.2 N m/A"',
            '"0.2 N m"',
            "cell.truth.axis.torque_constant must have a unit like N m/A; got '0.2 N m'",
        ),
        (
            "[controller]\n",
            "[controller]\nnormal_force = 0\n",
            "[controller] normal_force must be > 0 (N); got 0.0",
        ),
        (
            "[controller]\n",
            "[controller]\nnormal_force = '9 N'\n",
            "[controller] normal_force must be <= 1.682, what current_limit = 0.9 A presses (N); got 9.0, from '9 N'",
        ),
        ("table = false", "table = {kd = -1}", "[cell.truth.table] kd must be >= 0"),
        (
            'kind = "pidff"',
            'kind = "pidf"',
            "[controller] kind must be one of constant, pidff, damped, lqg; got 'pidf'",
        ),
        (
            'observer = "state"',
            'observer = "ideal"',
            "[controller] observer must be 'pid' or 'state': no sensor of a cell has the true contact torque",
        ),
        (
            'amplitude = "20 um"\nwavelength = "8 mm"\n',
            "",
            "cell.truth.wave.amplitude and cell.truth.wave.wavelength are missing",
        ),
        (
            'contact_angle = "20 deg"',
            'contact_angle = "90 deg"',
            "axis must be left out: no torque of the axis presses a tool that is face-on",
        ),
        ("degree = [1, 1]", "degree = 1", "surface.degree must be two whole numbers, as [3, 3]; got 1"),
    ],
)
def test_faults_name_the_key(tmp_path, capsys, old, new, fault):
    assert LONG.count(old) == 1
    path = long(tmp_path, LONG.replace(old, new))
    assert refused(capsys, path).startswith(f"{path}: {fault}")


STUDY = """
[surface]
shape = "flat"
side = 1.6
[path]
pattern = "hilbert"
order = 1
mapping = "parametric"
[controller]
kind = "damped"
[cell.scatter]
[study]
feed_rate = [10, 20, 30]
pitch = 0.1
"""


@pytest.fixture(scope="module")
def remembered():
    """Motions are planned once: they do not depend on what is tried here."""
    plan, known = finishing.plan, {}

    def planned(problem, **options):
        key = problem.path.pattern, problem.path.length, problem.feed_rate
        if key not in known:
            known[key] = plan(problem, **options)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finishing, "plan", planned)
        yield


@pytest.fixture(scope="module")
def study_job(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "study.toml"
    path.write_text(STUDY)
    return path


@pytest.fixture(scope="module")
def studied(study_job, remembered):
    made = read(study_job)
    levels = {"feed_rate": (10.0, 20.0, 30.0), "pitch": 0.1}
    return hwsim.finishing_study(made.stand, confirm=4, rng=3, kind="damped", **levels)


def test_a_study_finds_what_was_put_in(studied):
    truth = finishing.roughness.RoughnessModel.published()
    table = studied.study.anova()
    assert all(table[name].p < 1e-3 for name in ("tool_diameter", "pattern", "normal_force"))
    assert studied.best["tool_diameter"] == 4.0 and studied.best["pattern"] == "hilbert5"
    off = (np.array(studied.model.coefficients) - truth.coefficients) / studied.model.standard_errors
    assert np.abs(off).max() < 3.5 and 0.04 < studied.model.residual_sd < 0.12
    assert repr(studied).startswith(
        "FinishingStudy(tool_diameter 4.0, pattern hilbert5, "
    ) and "in 4 runs" in repr(studied)
    assert studied.held == (abs(studied.confirmed - studied.prediction.mean) <= studied.prediction.ci_confirm)


def test_a_study_s_readings_are_those_of_its_runs(studied):
    settings = studied.study.settings
    np.testing.assert_array_equal(studied.study.readings, studied.outcome["roughness_ra"])
    held = studied.outcome["normal_force"][:, 0]
    np.testing.assert_allclose(held, settings["normal_force"], atol=0.2)
    assert np.all(studied.outcome["feed"][:, 0] <= 1.3 * settings["feed_rate"])
    assert len(studied.confirmation) == 4
    for name in ("tool_diameter", "feed_rate"):
        assert studied.confirmation.outcome.attrs[name] == studied.best[name]


def test_confirmation_is_in_decibels(studied):
    read = studied.confirmation.outcome.roughness_ra.values
    assert studied.confirmed == pytest.approx(np.mean(-20 * np.log10(read / 0.01)), rel=1e-12)


def test_what_is_left_is_handed_to_the_planner(studied):
    policy = studied.refinishing(passes=3)
    tolerance = studied.prediction.response
    places = np.linspace(0.5, 2.0, 301) * tolerance
    limits = [places[policy.action(roughness=places, passes_left=k).stop].max() for k in (2, 1)]
    assert tolerance < limits[0] < limits[1]  # the fewer passes are left, the sooner one delivers
    costs = [float(policy.value(roughness=2 * tolerance, passes_left=k)) for k in (1, 2, 3)]
    assert costs[0] > costs[1] > costs[2] > 0
    law = studied.model.law("hilbert5", 4.0, studied.best["normal_force"])
    time = studied.outcome["time"][studied.study.settings["pattern"] == "hilbert5"].mean()
    # a table of 401 nodes
    assert costs[0] == pytest.approx(1e4 * float(law.over(tolerance)) + time / 60, rel=2e-2)
    dear = studied.refinishing(passes=3, machine_charge=1e3)
    assert bool(dear.action(roughness=1.2 * tolerance, passes_left=2).stop)


def test_replicates_are_counted_as_runs(study_job, remembered):
    made = read(study_job)
    options = {"tool_diameter": (6.0, 4.0), "replicates": 2, "confirm": 2, "rng": 1, **dict(made.study)}
    with pytest.warns(
        UserWarning, match=r"extrapolated: its model does not know a tool of 6 mm \(3 to 4 mm\)"
    ):
        found = hwsim.finishing_study(made.stand, kind="damped", **options)
    assert found.study.name == "roughness R_a, extrapolated in 9 of 18 runs"
    assert found.study.readings.shape == (18, 2) and len(found.confirmation) == 4
    pairs = found.confirmation.outcome.roughness_ra.values.reshape(2, 2)
    assert found.confirmed == pytest.approx(
        np.mean(-10 * np.log10(np.mean((pairs / 0.01) ** 2, axis=1))), rel=1e-12
    )


@pytest.mark.slow
def test_a_study_from_the_command_line(study_job, studied, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    arguments = study_job, "--study", "--confirm", 4, "--rng", 3, "--out", tmp_path
    out = said(capsys, *arguments)
    assert out.startswith(f"{study_job}: What the cell did: 22 specimens")
    assert studied.study.report(rng=3) in out and "Confirmation at tool_diameter 4" in out
    assert ("within the interval" in out) and ("NOT within" in out) != studied.held
    assert out.splitlines()[-1].startswith(f"kept in {tmp_path}: study.txt, ")
    names = {file.name for file in tmp_path.iterdir()}
    assert names == {
        "study.txt",
        "study.png",
        "confirm.png",
        "confirm.nc",
        "confirm.db",
        "report.html",
        *(f"run-{k + 1:02d}.db" for k in range(18)),
    }
    assert (tmp_path / "study.txt").read_text() == out[: out.rindex("\n\nkept in")] + "\n"
    assert same(sdpgrind.load(tmp_path / "confirm.nc"), studied.confirmation)
    (tmp_path / "run-18.db").unlink()  # as after an interruption
    assert said(capsys, *arguments, "--no-pictures") == out.replace(", study.png, confirm.png", "")
    line = refused(capsys, *arguments[:4], "--rng", 4, "--out", tmp_path)
    assert line.endswith("was begun with another rng")


ROBOT = """
method = "trapezoid"
[surface]
shape = "nominal"
[path]
pattern = "hilbert"
order = 1
[robot]
{robot}
tool_length = "150 mm"
[tool]
placement = [650, -25, 100]
[program]
deviation = "50 um"
name = "face1"
"""


@pytest.mark.filterwarnings("ignore:.* is not the language of the")
@pytest.mark.parametrize(
    ("target", "file"), [("urscript", "face1.script"), ("rapid", "face1.mod"), ("krl", "face1.src"), ("csv", "face1.csv")]
)  # fmt: skip
def test_a_job_with_a_robot_becomes_a_program(target, file, capsys, tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(ROBOT.format(robot='preset = "ur10"'))
    folder = tmp_path / "out"
    told = said(capsys, job, "--program", target, "--out", folder)
    motion = sdpgrind.load(folder / "motion.nc")
    found = finishing.read_program(folder / file).check(motion)
    assert f"read back: {found.deviation:.4f} mm" in told and found.deviation <= 0.05
    assert sorted(path.name for path in folder.iterdir()) == sorted([file, "motion.nc"])
    again = said(
        capsys, job, "--program", target, "--motion", folder / "motion.nc", "--out", tmp_path / "again"
    )
    assert (tmp_path / "again" / file).read_bytes() == (folder / file).read_bytes() and file in again


def test_a_job_with_a_urdf_file_beside_it(tmp_path):
    joint = (
        '<joint name="{name}" type="revolute"><parent link="{name}a"/><child link="{child}"/><origin xyz="{xyz}"/>'
        '<axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="3"/></joint>'
    )
    rows = [("0 0 0.5", "0 0 1"), ("0.1 0 0.1", "0 1 0"), ("0 0 0.7", "0 1 0"), ("0.2 0 0.1", "1 0 0"), ("0.5 0 0", "0 1 0"),
            ("0.1 0 0", "1 0 0")]  # fmt: skip
    links = [f"j{k}a" for k in range(6)] + ["tool0"]
    text = "".join(f'<link name="{name}"/>' for name in links)
    for k, (xyz, axis) in enumerate(rows):
        text += joint.format(name=f"j{k}", child=links[k + 1], xyz=xyz, axis=axis)
    (tmp_path / "cell.urdf").write_text(f'<robot name="cell">{text}</robot>')
    job = tmp_path / "job.toml"
    ends = 'urdf = "cell.urdf"\nbase = "j0a"\ntip = "tool0"\nacceleration_max = 10.0\ntool_axis = "x"'
    job.write_text(ROBOT.format(robot=ends))
    made = read(job)
    assert made.problem.robot.acceleration_max == (10.0,) * 6 and made.program["name"] == "face1"
    assert made.problem.robot.forward([0.0] * 6)[:3, 3] == pytest.approx([900.0 + 150.0, 0.0, 1400.0])


@pytest.mark.parametrize(
    ("robot", "told"),
    [
        ('preset = "ur11"', "robot.preset must be one of generic, ur10, irb2400"),
        ('preset = "ur10"\nurdf = "a"', r"\[robot\] must have a preset \(generic, ur10, irb2400\) or a urdf"),
        ('preset = "generic"', "robot.tool_length must be left out for a robot without a flange"),
    ],
)
def test_refused_robots_of_a_job(robot, told, tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(ROBOT.format(robot=robot))
    with pytest.raises(ValueError, match=told):
        read(job)


def test_a_refused_tool_is_called_as_the_key(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(ROBOT.format(robot='preset = "ur10"').replace('"150 mm"', "0.15"))
    with pytest.raises(ValueError, match=r"\[robot\] tool_length must be in mm, some 150; .* got 0.15"):
        read(job)


def test_what_a_program_is_refused_with(capsys, job, tmp_path):
    assert (
        refused(capsys, job, "--program", "csv")
        == "--out must be given with --program, the folder of its files"
    )
    line = refused(capsys, job, "--program", "csv", "--parts", 3, "--out", tmp_path)
    assert line == "--parts must be left out with --program, which finishes none; got 3"
    line = refused(capsys, job, "--program", "csv", "--study", "--out", tmp_path)
    assert line == "--program must be left out with --study; got csv"
    line = refused(capsys, job, "--program", "krl", "--out", tmp_path)
    assert line.startswith("robot must be a SerialRobot") and not list(tmp_path.glob("*.src"))
