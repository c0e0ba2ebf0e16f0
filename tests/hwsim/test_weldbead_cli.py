"""``hwsim weldbead``: what it prints, what it keeps, what it refuses."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from cli_fakes import OutcomeAlone, only_news, pictures_of_page, without_news, without_shares

import hwsim
import sdpgrind
from hwsim._log.log import same
from hwsim.cli import main
from hwsim.command import _work
from hwsim.command._weldbead.report import report
from hwsim.command._weldbead.toml import job_of
from sdpgrind import sdp, weldbead

pytestmark = pytest.mark.usefixtures("sketched")
JOB = ["weldbead", "--simple", "--preset", "P1", "--tolerance", "1e-2", "--parts", "6", "--rng", "4"]
KEPT = ["policy.nc", "policy.png", "run.db", "run.nc", "run.png"]


@pytest.fixture(scope="module")
def policy():
    return weldbead.plan(weldbead.preset("P1"), tolerance=1e-2)


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """File of a policy of one grid: its error is not known."""
    path = tmp_path_factory.mktemp("coarse") / "policy.nc"
    problem = weldbead.preset("P1")
    table = sdp.plan(weldbead.sequence.sdp_problem(problem, 51))
    weldbead.SequencePolicy(problem, table).save(path)
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "deep" / "p1"
    assert main([*JOB, "--out", str(folder)]) == 0
    return folder


def refused(capsys, *arguments):
    """Exit status 2, one line on standard error, nothing on standard output; give the line."""
    assert main(["weldbead", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1 and error.startswith("hwsim: ")
    return error.removeprefix("hwsim: ").strip()


def test_keeps_policy_log_journal_and_pictures(finished, policy):
    assert sorted(file.name for file in finished.iterdir()) == sorted([*KEPT, "report.html"])
    log = sdpgrind.load(finished / "run.nc")
    stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
    assert same(log, hwsim.run(stand, weldbead.SequenceController(policy), parts=6, rng=4))
    with sdpgrind.load(finished / "run.db") as journal:
        assert same(journal.log(), log)
    assert sdpgrind.load(finished / "policy.nc").problem == weldbead.preset("P1")


def test_every_picture_of_its_page_is_drawn(finished, drawn):
    """Worst parts, all parts, plan."""
    assert pictures_of_page(finished, "policy.nc") == 3


def test_what_nobody_told_of_the_bead_is_marked(finished, policy):
    outcome = OutcomeAlone(sdpgrind.load(finished / "run.nc").outcome)
    told = "job: beads of 1.5 mm, 30 s to the deadline"
    for assumed, mark in (((), ""), (("time",), " (time assumed, as no [stand] tells)")):
        assert report("job", outcome, policy, (1.5, 30.0), assumed).splitlines()[0] == told + mark
    assert job_of(policy.problem, simple=True).assumed == job_of(policy.problem, simple=False).assumed != ()


def test_an_aborted_bead_is_in_no_mean(finished, policy):
    outcome = sdpgrind.load(finished / "run.nc").outcome.copy(deep=True)
    outcome["aborted"] = "part", np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    outcome["abort_reason"] = "part", np.array(["", "door open", "", "", "", ""])
    outcome.penalty.values[1] = 1e6
    lines = report("job", OutcomeAlone(outcome), policy, (1.5, 30.0)).splitlines()
    named = {line[:24].strip(): line[24:].split() for line in lines}
    kept = np.delete(outcome.penalty.values, 1)
    assert "mean of 5 of 6 beads" in named and named["penalty ($)"][1] == f"{kept.mean():.4f}"
    assert lines[-1].endswith("and are in no mean of times and sizes: door open (1)")


def test_prints_planned_beside_realised(finished, policy, capsys):
    assert main([*JOB, "--no-pictures", "--out", str(finished)]) == 0
    out, error = capsys.readouterr()
    lines = {line[:24].strip(): line[24:].split() for line in out.splitlines()}
    outcome = sdpgrind.load(finished / "run.nc").outcome
    penalty = outcome.penalty.values
    planned = f"{outcome.penalty_planned.values.mean():.4f}"
    # by a noisy scan
    assert float(planned) == pytest.approx(policy.value(height=1.5, time_left=30.0), abs=1e-3)
    standard_error = f"{np.std(penalty, ddof=1) / np.sqrt(6):.4f}"
    assert lines["mean of 6 beads"] == ["planned", "realised", "std.", "error"]
    assert lines["penalty ($)"] == [planned, f"{penalty.mean():.4f}", standard_error]
    assert float(lines["passes"][1]) == pytest.approx(outcome.passes.values.mean(), abs=0.006)
    assert float(lines["late (%)"][0]) == 0.0
    assert sum(line.startswith("   ") for line in out.splitlines()) == 6
    assert only_news(error)


def test_finished_run_is_reported_again_unchanged(finished, capsys):
    before = {name: (finished / name).read_bytes() for name in ("run.nc", "policy.nc", "run.db")}
    outputs = []
    for _ in range(2):
        assert main([*JOB, "--no-pictures", "--out", str(finished)]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]
    assert before == {name: (finished / name).read_bytes() for name in before}


def test_policy_from_a_file_gives_the_same_run(finished, tmp_path, capsys):
    arguments = [
        "weldbead",
        "--simple",
        "--policy",
        str(finished / "policy.nc"),
        "--parts",
        "6",
        "--rng",
        "4",
        "--no-pictures",
    ]
    assert main([*arguments, "--out", str(tmp_path)]) == 0
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "policy.nc",
        "report.html",
        "run.db",
        "run.nc",
    ]
    assert (tmp_path / "run.nc").read_bytes() == (finished / "run.nc").read_bytes()


def test_without_out_nothing_is_written(finished, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["weldbead", "--simple", "--policy", str(finished / "policy.nc"), "--parts", "2"]) == 0
    assert "kept" not in capsys.readouterr().out and list(tmp_path.iterdir()) == []


def test_one_bead_has_no_standard_error(finished, capsys):
    assert main(["weldbead", "--simple", "--policy", str(finished / "policy.nc"), "--parts", "1"]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("penalty"))
    assert line.split()[-1] == "-"


def test_a_run_can_be_made_longer(finished, tmp_path, capsys):
    job = [
        "weldbead",
        "--simple",
        "--policy",
        str(finished / "policy.nc"),
        "--rng",
        "4",
        "--no-pictures",
        "--out",
        str(tmp_path / "run"),
    ]
    assert main([*job, "--parts", "2"]) == main([*job, "--parts", "6"]) == 0
    assert (tmp_path / "run" / "run.nc").read_bytes() == (finished / "run.nc").read_bytes()


def test_interrupted(finished, monkeypatch, capsys, tmp_path):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(_work, "_run", interrupt)
    job = ["weldbead", "--simple", "--policy", str(finished / "policy.nc")]
    kept = "the same command with the same --out goes on from here"
    lost = "nothing is kept: with --out DIR the same command goes on from there"
    for out, stays in ([], lost), (["--out", str(tmp_path / "run")], kept):
        assert main([*job, *out]) == 130
        assert without_news(capsys.readouterr().err) == f"hwsim: interrupted; {stays}\n"


def test_journal_of_another_seed(finished, capsys):
    before = (finished / "run.nc").read_bytes()
    line = refused(capsys, *JOB[1:-1], "5", "--out", finished)
    assert line.startswith("journal must be of this run;") and line.endswith("was begun with another rng")
    assert (finished / "run.nc").read_bytes() == before


def test_folder_of_another_problem_or_policy(finished, coarse, capsys):
    line = refused(capsys, "--preset", "P4", "--out", finished)
    assert (
        line == f"--out {finished} holds a run of another problem (burn_limit differs): choose another folder"
    )
    line = refused(capsys, "--policy", coarse, "--out", finished)
    assert line == f"--out {finished} holds a run of another policy: choose another folder"


def test_other_refusals(finished, tmp_path, capsys):
    policy, log = finished / "policy.nc", finished / "run.nc"
    assert (
        refused(capsys) == "problem.toml, --preset or --policy must be given; try: hwsim weldbead --preset P1"
    )
    assert (
        refused(capsys, "a.toml", "--preset", "P1")
        == "either problem.toml or --preset must be given, not both"
    )
    assert "No such file" in refused(capsys, tmp_path / "no.toml")
    assert refused(capsys, "--preset", "P9").endswith("got 'P9'")
    assert refused(capsys, "--preset", "P1", "--parts", 0) == "--parts must be >= 1; got 0"
    assert refused(capsys, "--preset", "P1", "--rng", -1) == "--rng must be >= 0; got -1"
    assert refused(capsys, "--preset", "P1", "--tolerance", 0) == "--tolerance must be > 0 ($); got 0.0"
    assert (
        refused(capsys, "--policy", log)
        == f"--policy must be a saved policy of a weld bead; {log} holds a Log"
    )
    differs = refused(capsys, "--preset", "P4", "--policy", policy)
    assert differs == f"--policy {policy} is for another problem: burn_limit differs"
    for out in (log, log / "beads"):  # the second was known once the plan was there
        assert refused(capsys, "--preset", "P1", "--out", out) == f"--out must be a folder; {log} is a file"


def test_error_on_the_machine_names_part_and_time(finished, tmp_path, capsys):
    tall = tmp_path / "job.toml"
    from test_weldbead_toml import P1

    tall.write_text(P1 + "[stand]\nheight = 2.0\n[stand.simple]\nheight_noise = '0.5 mm'\n")
    line = refused(capsys, tall, "--simple", "--policy", finished / "policy.nc")
    assert line.startswith("height must be <= height_max = 2 of the policy (mm); got ")
    assert line.endswith("(at 0 s of the part, in part 1)")  # the first scan of bead 0 is below the parent


@pytest.fixture(scope="module")
def three_tiers(finished, tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiers")
    assert (
        main(
            [
                "weldbead",
                "--policy",
                str(finished / "policy.nc"),
                "--parts",
                "2",
                "--rng",
                "4",
                "--out",
                str(folder),
            ]
        )
        == 0
    )
    return folder


def test_three_tiers_are_what_runs_unless_it_is_simple(three_tiers, policy):
    """The same as in Python, with what the command line fills in."""
    assert sorted(file.name for file in three_tiers.iterdir()) == sorted([*KEPT, "report.html"])
    log = sdpgrind.load(three_tiers / "run.nc")
    job = job_of(weldbead.preset("P1"), simple=False)
    assert same(log, hwsim.run(job.stand, job.controller(policy), parts=2, rng=4))
    assert {"sequence", "pass", "force"} <= set(log.tiers)
    assert job.start == (pytest.approx(1.5, abs=1e-12), 30.0)
    assert np.all(log.outcome.time.values <= 30.0)  # no stage is lost to leads


def test_three_tiers_are_reported_with_their_deepest_place(three_tiers, capsys):
    again = [
        "weldbead",
        "--policy",
        str(three_tiers / "policy.nc"),
        "--parts",
        "2",
        "--rng",
        "4",
        "--out",
        str(three_tiers),
    ]
    assert main([*again, "--no-pictures"]) == 0
    lines = capsys.readouterr().out.splitlines()
    outcome = sdpgrind.load(three_tiers / "run.nc").outcome
    assert (
        lines[3].split()[-2:] == ["realised", "$"] and "mean over mm" in lines[3] and "deepest mm" in lines[3]
    )
    assert float(lines[4].split()[4]) == pytest.approx(outcome.overground.values[0], abs=6e-5)
    assert float(lines[4].split()[5]) == pytest.approx(outcome.overground_worst.values[0], abs=6e-4)
    assert any(line.startswith("deepest place (mm)") for line in lines)


def test_folder_of_the_other_stand(finished, three_tiers, capsys):
    line = refused(capsys, "--policy", finished / "policy.nc", "--parts", 6, "--rng", 4, "--out", finished)
    assert line.endswith("was begun with another plant")
    line = refused(capsys, "--simple", "--policy", finished / "policy.nc", "--rng", 4, "--out", three_tiers)
    assert line.endswith("was begun with another plant")


def test_version(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0 and capsys.readouterr().out == f"hwsim {sdpgrind.__version__}\n"


def test_a_reader_that_has_had_enough(finished, tmp_path, monkeypatch, capsys):
    """As in ``hwsim weldbead ... | head``: no fault is told, and all is kept.

    In this process; what the interpreter says at its end is seen in `test_areas`.
    """
    out, (read, write) = tmp_path / "kept", os.pipe()
    os.close(read)
    line = [
        "weldbead",
        "--simple",
        "--policy",
        finished / "policy.nc",
        "--parts",
        "3",
        "--no-pictures",
        "--out",
        out,
    ]
    with os.fdopen(write, "w") as output, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", output)
        assert main(list(map(str, line))) == 0
    first, *news = without_shares(capsys.readouterr().err)
    assert first.startswith("hwsim: 3 beads take ") and news == ["hwsim: running 3 beads ..."]
    assert len(sdpgrind.load(out / "run.nc")) == 3


def test_fewer_parts_than_are_kept_throw_nothing_away(finished, tmp_path, capsys):
    out = tmp_path / "kept"
    job = [
        "weldbead",
        "--simple",
        "--policy",
        str(finished / "policy.nc"),
        "--no-pictures",
        "--out",
        str(out),
        "--parts",
    ]
    assert main([*job, "3"]) == 0
    before = (out / "run.nc").read_bytes()
    capsys.readouterr()
    assert main([*job, "2"]) == 0
    assert f"{out} held 3 finished beads already: all of them are reported, not 2" in capsys.readouterr().out
    assert (out / "run.nc").read_bytes() == before


def test_as_a_program():
    done = subprocess.run(
        [sys.executable, "-m", "hwsim.cli", "weldbead"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and done.stderr.startswith(
        "hwsim: problem.toml, --preset or --policy must be given"
    )


def content(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir()}


@pytest.fixture
def left(finished, tmp_path):
    """A folder in which only the journal is left of a run."""
    folder = tmp_path / "left"
    folder.mkdir()
    shutil.copy(finished / "run.db", folder / "run.db")
    return folder


@pytest.mark.parametrize(("changed", "said"), [(["--rng", "5"], "rng"), (["--preset", "P4"], "plant")])
def test_journal_of_another_run_is_refused_without_planning(left, monkeypatch, capsys, changed, said):
    monkeypatch.setattr(weldbead, "plan", None)
    before = content(left)
    line = refused(capsys, *JOB[1:], *changed, "--out", left)
    assert line == f"journal must be of this run; {str(left / 'run.db')!r} was begun with another {said}"
    assert content(left) == before


def test_journal_of_another_policy_is_refused_before_anything_is_written(left, coarse, capsys):
    before = content(left)
    line = refused(capsys, "--simple", "--policy", coarse, "--parts", 6, "--rng", 4, "--out", left)
    assert line.endswith("was begun with another controller")
    assert content(left) == before


def test_file_that_is_no_journal_is_refused_before_anything_is_written(tmp_path, capsys):
    (tmp_path / "run.db").write_text("notes of mine\n" * 100)
    assert refused(capsys, *JOB[1:], "--out", tmp_path).startswith("path must be the journal of a run;")
    assert list(content(tmp_path)) == ["run.db"]


def test_kept_policy_must_be_as_exact_as_is_asked_for(finished, capsys):
    before = content(finished)
    known = sdpgrind.load(finished / "policy.nc").error
    assert known < 1e-2
    line = refused(
        capsys, "--simple", "--preset", "P1", "--rng", 4, "--tolerance", known / 2, "--out", finished
    )
    said = f"holds a policy known to {known:.2g} $, --tolerance asks for {known / 2:g} $"
    assert line == f"--out {finished} {said}: choose another folder or tolerance"
    assert content(finished) == before
    # Where nothing is asked, what is kept will do: a run that was killed goes on.
    assert (
        main(
            [
                "weldbead",
                "--simple",
                "--preset",
                "P1",
                "--rng",
                "4",
                "--parts",
                "6",
                "--no-pictures",
                "--out",
                str(finished),
            ]
        )
        == 0
    )


def test_policy_of_unknown_error_does_for_no_tolerance(coarse, tmp_path, capsys):
    line = refused(capsys, *JOB[1:], "--out", coarse.parent)
    assert line.startswith(
        f"--out {coarse.parent} holds a policy of unknown error, --tolerance asks for 0.01 $: "
    )
    line = refused(capsys, "--policy", coarse, "--tolerance", 1.0, "--out", tmp_path / "new")
    assert line.endswith("of unknown error, --tolerance asks for 1 $: plan anew, without --policy")
    assert list(content(coarse.parent)) == ["policy.nc"] and not (tmp_path / "new").exists()


def test_writes_the_operator_table(tmp_path):
    problem = weldbead.preset("P1").replace(durations=(6, 12, 18), stage=6.0, horizon=30.0)
    short = weldbead.SequencePolicy(problem, sdp.plan(weldbead.sequence.sdp_problem(problem, 51)))
    short.save(tmp_path / "short.nc")
    arguments = ["weldbead", "--simple", "--policy", str(tmp_path / "short.nc"), "--parts", "1"]
    assert main([*arguments, "--operator-table", str(tmp_path / "bead.html")]) == 0
    page = (tmp_path / "bead.html").read_text()
    assert (
        "Next pass: duration s / normal force N" in page
        and "between two rows take that of the greater height" in page
    )


def test_refuses_another_ending_of_the_operator_table(capsys, coarse, tmp_path):
    told = refused(capsys, "--policy", coarse, "--parts", "1", "--operator-table", tmp_path / "bead.pdf")
    assert told == "ending of --operator-table must be one of .html, .txt, .csv; got '.pdf'"
