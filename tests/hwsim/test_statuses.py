"""Exit statuses of commands, their one line of text, and the lock of a folder."""

import atexit
import ctypes
import errno
import gc
import io
import os
import re
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from hwsim_forked import Command

import hwsim
from hwsim._log.journal import SecondWriterError
from hwsim.cli import main
from hwsim.command import _lock
from hwsim.command._lock import LockedError, locked
from hwsim.command._statuses import Terminated, catch_signals, ended
from sdpgrind import weldbead
from sdpgrind.base.whole_files import remove_leftovers, whole_file

COMMAND = [sys.executable, "-c", "import sys; from _hwsim import main; sys.exit(main())"]  # as the script
BEADS = ["weldbead", "--preset", "P1", "--no-pictures", "--tolerance", "0.05"]


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    """File of a policy that is exact enough for the beads."""
    path = tmp_path_factory.mktemp("policy") / "p1.nc"
    weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=51).save(path)
    return str(path)


def test_a_line_for_a_full_disk_ends_no_work(monkeypatch):
    """As of ``2> kept.txt``: a fault then had the status 1 of a part that was broken off, and a traceback."""
    with Path("/dev/full").open("w") as full:
        monkeypatch.setattr(sys, "stderr", full)
        assert ended(ValueError("height must be > 0 (mm); got -1.0")) == 2


def test_a_folder_that_may_not_be_written_is_told_before_anything_is_planned(tmp_path, monkeypatch, capsys):
    """It was known after the plan, of minutes in centering; as root everything may be written."""
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path)
    assert main([*BEADS, "--out", str(tmp_path / "new" / "beads")]) == 3
    *_, line = capsys.readouterr().err.splitlines()
    assert line == f"hwsim: {tmp_path}: Permission denied"
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_with_the_file(tmp_path):
    with (
        pytest.raises(OSError, match=r"No space left on device: .*policy\.nc"),
        whole_file(tmp_path / "policy.nc"),
    ):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("buffering", [-1, 0])
def test_help_that_cannot_be_written_is_no_success(monkeypatch, capsys, buffering):
    """`--help > /dev/full` ended with a traceback; in a stream without a buffer, which argparse wrote to, with 0."""
    with Path("/dev/full").open("wb", buffering=buffering) as raw:
        full = io.TextIOWrapper(raw, write_through=not buffering)
        monkeypatch.setattr(sys, "stdout", full)
        assert main(["--help"]) == 3
        full.flush()  # as the interpreter does at its end: nothing is left to be said
    assert capsys.readouterr().err == "hwsim: standard output: No space left on device\n"


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (ValueError("height must be > 0 (mm); got -1.0"), 2, "height must be > 0 (mm); got -1.0"),
        (
            FileNotFoundError(2, "No such file or directory", "job.toml"),
            2,
            "job.toml: No such file or directory",
        ),
        (IsADirectoryError(21, "Is a directory", "jobs"), 2, "jobs: Is a directory"),
        (PermissionError(13, "Permission denied", "runs"), 3, "runs: Permission denied"),
        (OSError(28, "No space left on device", "run.nc"), 3, "run.nc: No space left on device"),
        (OSError(98, "Address already in use"), 3, "[Errno 98] Address already in use"),
        (
            LockedError("runs is being written by process 1 on a"),
            3,
            "runs is being written by process 1 on a",
        ),
        (SecondWriterError("part 3 is there"), 3, "part 3 is there"),
        (sqlite3.OperationalError("database or disk is full"), 3, "database or disk is full"),
        (MemoryError(), 3, "out of memory: fewer parts or a coarser grid need less"),
        (ImportError("jinja2 is needed"), 3, "jinja2 is needed"),
        (ValueError("nodes:\n- one is\n  missing\n- two"), 2, "nodes:\n- one is missing\n- two"),
        (hwsim.Aborted("door open"), 1, "door open"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (Terminated(), 143, "terminated"),
    ],
)
def test_each_exception_has_a_status_and_one_line(error, status, said, capsys):
    assert ended(error) == status
    assert capsys.readouterr().err == f"hwsim: {said}\n"


def test_a_fault_of_ours_is_one_line_and_a_file(capsys):
    try:
        raise ZeroDivisionError("division by zero")
    except ZeroDivisionError as error:
        assert ended(error) == 70
    line = capsys.readouterr().err
    assert line.startswith("hwsim: a fault of this program, ZeroDivisionError: division by zero; ")
    assert line.count("\n") == 1
    kept = Path(line.split()[-1])
    assert "test_statuses.py" in kept.read_text(encoding="utf-8")
    kept.unlink()


RING = ["roundness", "tests/data/samples/ring.x3p", "--radius", "40"]


def test_garbage_is_not_searched_for_where_a_command_ends(monkeypatch, capsys):
    """Half a second of three, of a plunge job with its page."""
    at_end = []
    monkeypatch.setattr(atexit, "register", at_end.append)
    monkeypatch.setattr(sys, "argv", ["hwsim", "--version"])
    monkeypatch.setattr("hwsim.cli.catch_signals", lambda: None)
    with pytest.raises(SystemExit):
        main()
    try:
        for call in at_end:
            call()
        assert gc.get_freeze_count() > 1000
    finally:
        gc.unfreeze()


@pytest.mark.parametrize("how", ["closed", "unread"])
def test_a_standard_error_that_takes_nothing_changes_nothing(how):
    """Closed, the first line of a command went to its output; with a reader that had gone nothing was done."""
    quiet = Command(*RING, **{how: True})
    out, _ = quiet.communicate()
    assert quiet.returncode == 0 and out.startswith("file    ring.x3p: 500 points\n")


def test_what_is_told_goes_nowhere_where_standard_error_is_closed_from_the_beginning():
    told = [*COMMAND, "verify", "missing.db"]
    quiet = subprocess.run(told, stdout=subprocess.PIPE, preexec_fn=lambda: os.close(2), text=True)
    assert (quiet.returncode, quiet.stdout) == (2, "")


def test_a_second_writer_is_refused_with_the_first_ones_name(tmp_path, capsys):
    with locked(tmp_path):
        assert main([*BEADS, "--parts", "1", "--out", str(tmp_path)]) == 3
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(f"hwsim: {tmp_path} is being written by process {os.getpid()} on ")


def test_a_disk_that_has_no_locks_is_not_called_locked(tmp_path, monkeypatch):
    def no_locks(handle):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(_lock, "_lock", no_locks)
    with pytest.raises(OSError, match="No locks available"), locked(tmp_path):
        pass


def test_the_lock_is_free_again_after_its_owner_was_killed(tmp_path):
    owner = (
        "import sys, time, pathlib; from hwsim.command._lock import locked\n"
        "with locked(pathlib.Path(sys.argv[1])): print('held', flush=True); time.sleep(60)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", owner, tmp_path], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(LockedError, match=f"written by process {process.pid} on "), locked(tmp_path):
            pass
        process.kill()
        process.wait()
    with locked(tmp_path):
        assert (tmp_path / "run.lock").exists()
    assert not list(tmp_path.iterdir())


def test_of_many_that_come_at_once_one_holds_the_lock(tmp_path):
    inside, most, won = [0], [0], [0]

    def come():
        for _ in range(50):
            try:
                with locked(tmp_path):
                    inside[0] += 1
                    most[0] = max(most[0], inside[0])
                    won[0] += 1
                    time.sleep(0)
                    inside[0] -= 1
            except LockedError:
                time.sleep(0)

    threads = [threading.Thread(target=come) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1]
    assert won[0] >= 50 / 4


def test_a_full_disk_is_one_line_and_nothing_half_written(policy, tmp_path):
    given = ["--policy", policy, "--parts", "2", "--out", tmp_path / "run"]
    done = Command(*BEADS, *given, full_disk=True)
    _, said = done.communicate()
    assert done.returncode == 3, said
    assert "Traceback" not in said
    assert said.splitlines()[-1].startswith("hwsim: ")
    assert not list((tmp_path / "run").glob("*.nc"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_during_the_imports_is_silent(number):
    alone = f"import _hwsim, os; os.kill(os.getpid(), {int(number)}); import hwsim.cli"
    done = subprocess.run(
        [sys.executable, "-c", alone], capture_output=True, text=True, check=False, timeout=100
    )
    assert (done.returncode, done.stderr) == (-number, "")


@pytest.mark.parametrize(
    ("during", "number", "status"),
    [
        ("planning takes ", signal.SIGINT, 130),
        ("planning takes ", signal.SIGTERM, 143),
        ("planning ...", signal.SIGINT, 130),
        ("running 1000 beads ...", signal.SIGTERM, 143),
    ],
)
def test_a_signal_leaves_one_line_and_no_lock(number, status, during, policy, tmp_path):
    given = ["--policy", policy] if during.startswith("running") else []
    process = Command(*BEADS, *given, "--parts", "1000", "--out", tmp_path / "run")
    begun = next(line for line in iter(process.stderr.readline, "") if line.startswith(f"hwsim: {during}"))
    time.sleep(0.1 if during.endswith("...") else 0.0)  # s; a part takes as long
    process.send_signal(number)
    _, said = process.communicate()
    assert process.returncode == status, begun + said
    assert "Traceback" not in said
    assert said.splitlines()[-1].endswith("the same command with the same --out goes on from here")
    assert not (tmp_path / "run" / "run.lock").exists()


@pytest.mark.parametrize(
    ("number", "error"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_a_signal_in_a_callback_is_not_lost(number, error, monkeypatch):
    """As Ctrl-C while kernels are loaded: the command went on, with a traceback."""
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(sys, "unraisablehook", None)
    callback = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(number))
    begun = time.monotonic()
    try:
        catch_signals()
        with pytest.raises(error):
            callback()
            time.sleep(20.0)
        assert time.monotonic() - begun < 20.0  # it ended the wait, and did not come after it
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def test_what_a_killed_process_left_is_removed_at_the_next_start(tmp_path):
    owner = (
        "import os, sys; from sdpgrind.base.whole_files import whole_file\n"
        "with whole_file(sys.argv[1]): os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", owner, str(tmp_path / "run.nc")], check=False, timeout=100)
    (dead,) = tmp_path.iterdir()
    with whole_file(tmp_path / "plan.nc") as mine:
        elsewhere = dead.with_name(re.sub("@.+?\\.", "@elsewhere.", dead.name))
        elsewhere.touch()
        (tmp_path / ".users.part").touch()
        remove_leftovers(tmp_path)
        assert sorted(tmp_path.iterdir()) == sorted([mine, elsewhere, tmp_path / ".users.part"])
