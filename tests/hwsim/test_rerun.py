"""Pages run again: equal to the bit, other versions told first, differences counted, the rest refused."""

import json
import re
from pathlib import Path

import pytest

import hwsim
from hwsim._report import job
from hwsim._report.again import differences
from hwsim.cli import main
from sdpgrind import finishing, load, locus, plunge, weldbead

pytestmark = pytest.mark.usefixtures("sketched")  # but for those that compare pages with all they show
EXAMPLES = Path(__file__).parents[2] / "examples"
COMMANDS = {
    "plunge": ["--preset=simulation"],
    "locus": ["--preset=grinding", "--no-adapt"],
    "weldbead": ["--preset=P1", "--simple", "--tolerance=0.1"],
    "finishing": ["--preset=specimen", "--nominal"],
}
"""Centering is planned and run again with both controllers, below."""


class OnePass:
    """One pass, then stop."""

    period = None

    def reset(self):
        self.begun = False

    def step(self, **measured):
        begun, self.begun = self.begun, True
        return {"stop": 1.0} if begun else {"duration": 20.0, "normal_force": 40.0}


@pytest.fixture(scope="module")
def cycle():
    return plunge.plan(plunge.preset("simulation"))


@pytest.fixture(scope="module")
def bead():
    """Not with the options that a plan has by default."""
    return weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=51)


@pytest.fixture
def ground(cycle):
    controller = plunge.CycleController(cycle.problem)
    return hwsim.run(hwsim.PlungeGrinder(cycle.problem), controller, parts=2, rng=7)


def rerun(page, folder, capsys):
    """Exit status and lines of the command, but for those of a first use and of what takes long."""
    status = main(["verify", str(page), "--rerun", str(folder)])
    told = capsys.readouterr()
    lines = told.out.splitlines() + told.err.splitlines()
    return status, [line for line in lines if not re.match(r"sdpgrind: compiling| *\d+ % ", line)]


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize("area", ["plunge", "locus", "weldbead", "finishing"])
def test_the_page_of_a_command_is_made_again_to_the_bit(area, tmp_path, capsys, monkeypatch):
    """The operator's sheet of a bead as well."""

    def write(policy, path):  # in less time than the table itself
        path.write_bytes(policy.table.table.control.tobytes())

    monkeypatch.setattr(weldbead.SequencePolicy, "operator_table", write)
    first, again, sheet = tmp_path / "first", tmp_path / "again", tmp_path / "report.html"
    more = [f"--operator-table={sheet}"] if area == "weldbead" else []
    line = [area, *COMMANDS[area], *more, "--parts=2", "--rng=3", "--no-pictures", f"--out={first}"]
    assert main(line) == 0
    assert str(tmp_path) not in (first / "report.html").read_text(encoding="utf-8")
    capsys.readouterr()
    status, lines = rerun(first / "report.html", again, capsys)
    assert status == 0 and any("equal to the bit (plan; log, " in line for line in lines)
    assert not any("before it starts" in line for line in lines)
    assert (again / "run.nc").read_bytes() == (first / "run.nc").read_bytes()
    assert not list(again.glob("*.png"))  # the first had none
    if more:
        assert (again / "operator-table.html").read_bytes() == sheet.read_bytes()


@pytest.mark.usefixtures("drawn")
def test_the_page_of_a_program_is_made_again_to_the_bit(ground, cycle, tmp_path, capsys):
    page = tmp_path / "job.html"
    ground.report(page, plan=cycle)
    assert rerun(page, tmp_path / "again", capsys) == (
        0,
        [
            f"{page}: as it was written, every number and picture",
            f"{tmp_path / 'again'}: equal to the bit (plan; log, controller; log, outcome)",
        ],
    )


def test_a_controller_that_holds_its_plan_is_made_again(tmp_path, capsys):
    curve = locus.plan(locus.preset("grinding"))
    follower = locus.LocusController(curve, along="wear_flat_area")
    stand = hwsim.AdaptiveGrinder(curve.problem)
    hwsim.run(stand, follower, adapt=locus.LearnedStart()).report(tmp_path / "job.html", plan=curve)
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 0 and lines[-1].endswith("equal to the bit (plan; log, controller; log, outcome)")


@pytest.mark.usefixtures("drawn")
def test_the_page_of_a_comparison_is_made_again(cycle, tmp_path, capsys):
    both = {
        "cautious": plunge.CycleController(cycle.problem, 0.05),
        "bold": plunge.CycleController(cycle.problem, 0.01),
    }
    log = hwsim.compare(hwsim.PlungeGrinder(cycle.problem), both, parts=2, rng=7)
    log.report(tmp_path / "job.html", plan=cycle)
    text = log.report(plan=cycle)
    assert re.search(r"seed +7\n", text) and "controller 'bold', CycleController" in text
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 0 and lines[-1].endswith("equal to the bit (plan; log, controller; log, outcome)")


def test_a_page_without_run_or_plan_says_so(tmp_path, capsys):
    finishing.Study.published("wang-2001").report(tmp_path / "study.html")
    status, lines = rerun(tmp_path / "study.html", tmp_path / "again", capsys)
    assert status == 2 and lines[-1].endswith("this one holds neither a run nor a plan")


def test_a_log_from_a_file_is_not_made_again(ground, tmp_path, capsys):
    ground.save(tmp_path / "run.nc")
    load(tmp_path / "run.nc").report(tmp_path / "job.html")
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 2 and lines[-1].endswith("the log of this one was read from a file")


@pytest.mark.usefixtures("drawn")
def test_the_page_of_both_controllers_is_made_again(tmp_path, capsys, few_pushes):
    """From the file in the page, which is written into the folder before the run: the user's is gone.

    One part: that several are made again is seen above and below.
    """
    first, again, file = tmp_path / "first", tmp_path / "again", tmp_path / "job.toml"
    file.write_text((EXAMPLES / "centering.toml").read_text())
    assert (
        main(["centering", str(file), "--source", "--parts=1", "--rng=3", "--no-pictures", f"--out={first}"])
        == 0
    )
    file.unlink()
    capsys.readouterr()
    status, lines = rerun(first / "report.html", again, capsys)
    assert status == 0 and any("equal to the bit (plan; log, " in line for line in lines)
    assert not any("before it starts" in line for line in lines)
    logs = sorted(path.name for path in first.glob("*.nc"))
    assert logs and all((again / each).read_bytes() == (first / each).read_bytes() for each in logs)


@pytest.mark.usefixtures("drawn")
def test_the_page_of_a_plan_is_made_again(cycle, tmp_path, capsys):
    cycle.report(tmp_path / "plan.html")
    status, lines = rerun(tmp_path / "plan.html", tmp_path / "again", capsys)
    assert status == 0 and lines[-1].endswith("equal to the bit (plan)")


def test_another_version_is_told_first_and_differences_are_counted(
    ground, cycle, tmp_path, capsys, monkeypatch
):
    known = job.versions()
    monkeypatch.setattr(job, "versions", lambda: known | {"numpy": "1.99.0"})
    ground.made_of = ground.made_of | {"rng": 8}
    ground.report(tmp_path / "job.html", plan=cycle)
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 1
    assert lines[1] == f"before it starts: numpy 1.99.0 made the page, {known['numpy']} is here"
    assert lines[2:4] == [f"{tmp_path / 'again'}: log, {name}: differs" for name in ("controller", "outcome")]
    assert re.search(r": \d+ of \d+ numbers in tables differ; the first is \w+", lines[4])


def test_one_number_that_differs_is_counted(ground, cycle, tmp_path):
    ground.report(tmp_path / "job.html", plan=cycle)
    before = {
        name: json.loads(re.search(rf'id="{name}">(.*?)</script>', (tmp_path / "job.html").read_text())[1])
        for name in ("page", "job")
    }
    after = json.loads(json.dumps(before))
    table = next(block for block in after["page"]["blocks"] if "table" in block)
    table["amounts"][0]["values"][0] += 1e-12
    assert differences(before, before) == []
    (told,) = differences(before, after)
    assert told.startswith("1 of ") and f"{table['table']!r}, value 1" in told


def test_what_cannot_be_made_again_is_refused_before_it_starts(tmp_path, capsys):
    problem = weldbead.preset("P1")
    hwsim.run(hwsim.WeldBeadStand(problem), OnePass()).report(tmp_path / "job.html")
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 2 and "the OnePass of this one cannot be told by values" in lines[-1]
    assert not (tmp_path / "again").exists()


def test_a_folder_of_another_run_is_refused(cycle, tmp_path, capsys):
    cycle.report(tmp_path / "plan.html")
    status, lines = rerun(tmp_path / "plan.html", tmp_path, capsys)
    assert status == 2 and "--rerun must be a new or an empty folder" in lines[-1]


def test_a_changed_page_is_not_run_again(cycle, tmp_path, capsys):
    page = tmp_path / "plan.html"
    cycle.report(page)
    page.write_text(page.read_text().replace("12.0", "13.0", 1))
    status, _ = rerun(page, tmp_path / "again", capsys)
    assert status == 1 and not (tmp_path / "again").exists()


def test_a_plan_is_made_again_with_the_options_it_was_solved_with(cycle, bead, tmp_path, capsys):
    best = plunge.plan(cycle.problem, safety_margin=0.005)
    best.report(tmp_path / "plan.html")
    controller = plunge.CycleController(cycle.problem, safety_margin=0.005)
    run = hwsim.run(hwsim.PlungeGrinder(cycle.problem), controller, rng=0)
    run.report(tmp_path / "job.html", plan=best)
    bead.report(tmp_path / "bead.html")
    for name in ("plan", "job", "bead"):
        status, lines = rerun(tmp_path / f"{name}.html", tmp_path / name, capsys)
        assert status == 0 and "equal to the bit (plan" in lines[-1]


def test_a_plan_of_unknown_options_is_never_said_to_differ(cycle, tmp_path, capsys):
    """A plan from a file does not hold them: the defaults count where they make the same plan."""
    for name, margin in (("usual", 0.0), ("cautious", 0.005)):
        plunge.plan(cycle.problem, safety_margin=margin).save(tmp_path / "plan.nc")
        load(tmp_path / "plan.nc").report(tmp_path / f"{name}.html")
    assert rerun(tmp_path / "usual.html", tmp_path / "usual", capsys)[0] == 0
    status, lines = rerun(tmp_path / "cautious.html", tmp_path / "cautious", capsys)
    assert status == 2 and "cannot be made again: it was solved with options" in lines[-1]
    assert not any("differs" in line for line in lines)


def test_a_controller_of_another_plan_is_refused(bead, tmp_path, capsys):
    problem = bead.problem
    wide = problem.replace(scatter=problem.scatter.replace(relative_sd=0.3))
    other = weldbead.plan(wide, tolerance=None, nodes=51)
    both = {"one": weldbead.SequenceController(bead), "other": weldbead.SequenceController(other)}
    hwsim.compare(hwsim.WeldBeadStand(problem), both).report(tmp_path / "job.html", plan=bead)
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 2 and "needs a SequenceController that is made of the plan or the problem" in lines[-1]


def test_a_controller_of_a_plan_that_comes_out_differently_is_refused(bead, tmp_path, capsys, monkeypatch):
    log = hwsim.run(hwsim.WeldBeadStand(bead.problem), weldbead.SequenceController(bead))
    log.report(tmp_path / "job.html", plan=bead)
    other = weldbead.plan(bead.problem, tolerance=None, nodes=41)
    monkeypatch.setattr(weldbead, "plan", lambda problem, **options: other)
    status, lines = rerun(tmp_path / "job.html", tmp_path / "again", capsys)
    assert status == 2 and "SequenceController of this page cannot be made again: the plan" in lines[-1]
