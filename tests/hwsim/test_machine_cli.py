"""``hwsim AREA --serve URL`` and ``--machine URL``: served jobs, runs on them, what is refused."""

import os
import re
import signal
import threading
import time

import numpy as np
import pytest
from cli_fakes import without_news
from hwsim_forked import Command

import hwsim
import sdpgrind
from hwsim._loop import loop
from hwsim.cli import main
from hwsim.command._run_folder import RunFolder
from sdpgrind import plunge

pytestmark = pytest.mark.usefixtures("sketched", "nothing_collected")
PROBLEM = plunge.preset("simulation").replace(stock=0.001)  # mm; a part of 0.7 s
ANY = "opc.tcp://127.0.0.1:0"
OPEN = ["--security", "none"]


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "plan.nc"
    plunge.plan(PROBLEM).save(path)
    return path


@pytest.fixture(scope="module")
def machine():
    with hwsim.serve(hwsim.PlungeGrinder(PROBLEM), ANY, security="none", timeout=5.0) as server:
        yield server


def refused(capsys, *arguments):
    assert main(["plunge", "--preset", "simulation", *map(str, arguments)]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1
    return error.removeprefix("hwsim: ").strip()


def said(capsys, status, *arguments):
    assert main(["plunge", *map(str, arguments)]) == status
    return capsys.readouterr()


def terminated_in_the_next_part(machine):
    """Send SIGTERM to this process once the machine makes another part, however long that takes."""
    before = machine.state["part"]
    until = time.monotonic() + 120.0
    while machine.state["part"] == before and time.monotonic() < until:
        time.sleep(0.01)
    os.kill(os.getpid(), signal.SIGTERM)


def test_in_lockstep_the_report_is_that_of_a_simulation(plan, capsys):
    simulated = said(capsys, 0, "--plan", plan, "--parts", 2, "--rng", 3).out
    with hwsim.serve(hwsim.PlungeGrinder(PROBLEM), ANY, speed=None, security="none") as server:
        there = said(capsys, 0, "--plan", plan, "--parts", 2, "--rng", 3, "--machine", server.url, *OPEN).out
    assert there == simulated


def test_a_part_on_a_machine_is_kept_and_reported(plan, machine, tmp_path, capsys):
    folder = tmp_path / "run"
    options = ["--plan", plan, "--machine", machine.url, *OPEN, "--safe", "retract=1", "--deadline", "2 s"]
    out = said(capsys, 0, *options, "--out", folder, "--no-pictures").out
    assert "mean of 1 part" in out and "report.html" in out
    log = sdpgrind.load(folder / "run.nc")
    assert log.outcome.aborted.values.tolist() == [0.0] and log.outcome.attrs["plant"] == "OpcuaPlant"
    assert main(["verify", str(folder / "run.db"), str(folder / "report.html")]) == 0


def test_a_signal_makes_safe_says_so_before_pictures_and_is_the_status(
    plan, machine, tmp_path, capsys, monkeypatch
):
    folder = tmp_path / "run"
    options = ["--plan", plan, "--machine", machine.url, *OPEN, "--safe", "retract=1", "--deadline", "2 s"]
    terminator = threading.Thread(target=terminated_in_the_next_part, args=(machine,))
    terminator.start()
    told, keep = [], RunFolder.keep
    monkeypatch.setattr(RunFolder, "keep", lambda *a: told.append(capsys.readouterr().err) or keep(*a))
    out, error = said(capsys, 143, *options, "--parts", 100, "--out", folder, "--no-pictures")
    terminator.join()
    assert "SIGTERM" in out and error == ""
    assert "hwsim: part 0 was aborted and the machine made safe: SIGTERM" in told[0]
    with hwsim.Journal(folder / "run.db") as journal:
        log = journal.log()
    np.testing.assert_array_equal(log.outcome.aborted.values[-1:], [1.0])
    assert len(log) == len(sdpgrind.load(folder / "run.nc"))


def test_shadow_reports_what_the_own_control_made(plan, capsys):
    stand, control = hwsim.PlungeGrinder(PROBLEM), plunge.CycleController(PROBLEM)
    with hwsim.serve(stand, ANY, security="none", controller=control) as server:
        out = said(capsys, 0, "--plan", plan, "--machine", server.url, *OPEN, "--shadow").out
        assert server.state["writes"] == 0
    assert "mean of 1 part" in out


def test_a_served_job_ends_with_a_signal():
    process = Command("plunge", "--preset", "simulation", "--serve", ANY, *OPEN)
    line = process.stderr.readline()
    url = re.search(r"PlungeGrinder at (\S+), keeping wall time", line)[1]
    plant = hwsim.OpcuaPlant(url, security="none")
    assert plant.accepts["retract"] == "" and not plant.lockstep
    plant.close()
    process.send_signal(signal.SIGINT)
    out, error = process.communicate()
    assert (process.returncode, out, error) == (0, "0 parts finished, 0 aborted\n", "")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--serve", ANY, "--machine", ANY], "either --serve or --machine must be given, not both"),
        (["--safe", "retract=1"], "--safe needs --machine"),
        (["--speed", "2", "--machine", ANY], "--speed needs --serve"),
        (["--own-control"], "--own-control needs --serve"),
        (["--security", "none"], "--security needs --serve or --machine"),
        (["--serve", ANY, "--parts", "3"], "--serve runs nothing: --parts and --out must not be given"),
        (["--serve", ANY, *OPEN, "--speed", "fast"], "--speed must be a number or lockstep; got 'fast'"),
        (["--serve", ANY, *OPEN, "--speed", "-1"], "speed must be > 0; got -1.0"),
        (["--serve", "http://x", *OPEN], "url must be such as opc.tcp://127.0.0.1:4840; got 'http://x'"),
        (["--serve", ANY], "the password of operator must be in the environment variable HWSIM_PASSWORD_OPERATOR"),
        (["--machine", ANY, "--safe", "retract=1"],
         "the password of operator must be in the environment variable HWSIM_PASSWORD_OPERATOR"),
    ],
)  # fmt: skip
def test_what_does_not_go_together(options, line, capsys):
    assert refused(capsys, *options) == line


def test_wrong_options_of_a_machine(machine, capsys):
    at = ["--machine", machine.url, *OPEN]
    assert "--safe NAME=VALUE or --shadow must be given" in refused(capsys, *at)
    assert refused(capsys, *at, "--safe", "retract") == (
        "--safe must be NAME=VALUE, such as retract=1; got 'retract'"
    )
    assert refused(capsys, *at, "--safe", "stop=1") == (
        "--safe must name commands of the machine: command_rate, balancing, retract; got 'stop'"
    )
    assert "--safe command_rate must have a unit like mm/s" in refused(
        capsys, *at, "--safe", "command_rate=1 N"
    )
    assert "--deadline must have a unit like s" in refused(
        capsys, *at, "--safe", "retract=1", "--deadline", "5 mm"
    )


def test_the_clock_of_a_run_is_chosen_on_the_command_line(plan, machine, capsys, monkeypatch):
    seen = []
    run = loop.run
    monkeypatch.setattr(loop, "run", lambda *a, live, **k: seen.append(live) or run(*a, live=live, **k))
    options = ["--machine", machine.url, *OPEN, "--safe", "retract=1", "--deadline", "2 s"]
    said(capsys, 0, "--plan", plan, *options, "--stale", "3000 ms", "--overruns", "count")
    assert (seen[0].stale, seen[0].overruns) == (3.0, "count")
    assert refused(capsys, "--stale", "1 s") == "--stale needs --machine"


def test_without_a_server_the_status_is_that_of_the_environment(capsys):
    options = ["--machine", "opc.tcp://127.0.0.1:1", *OPEN, "--safe", "retract=1"]
    assert main(["plunge", "--preset", "simulation", *options]) == 3
    assert without_news(capsys.readouterr().err).startswith("hwsim: no session at opc.tcp://127.0.0.1:1: ")


def test_with_keys_and_passwords(plan, tmp_path, monkeypatch, capsys):
    keys = tmp_path / "keys"
    hwsim.opcua.make_keys(keys)
    monkeypatch.setenv("HWSIM_PASSWORD_OPERATOR", "lapping")
    stand = hwsim.PlungeGrinder(PROBLEM)
    with hwsim.serve(stand, ANY, speed=None, security=keys, users={"operator": "lapping"}) as server:
        out = said(capsys, 0, "--plan", plan, "--machine", server.url, "--security", keys).out
        assert "mean of 1 part" in out
        monkeypatch.setenv("HWSIM_PASSWORD_OPERATOR", "lapping compound")
        status = main(["plunge", "--plan", str(plan), "--machine", server.url, "--security", str(keys)])
        assert status == 3 and "with its password" in capsys.readouterr().err
