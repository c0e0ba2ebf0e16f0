"""Modes of files that appear at once, their temporary files, and what a killed process leaves."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from sdpgrind.base import whole_files
from sdpgrind.base.whole_files import durable, remove_leftovers, whole_file


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture(params=[0o022, 0o077, 0o000])
def mask(request):
    before = os.umask(request.param)
    yield request.param
    os.umask(before)


def test_a_new_file_has_the_mode_that_open_gives(tmp_path, mask):
    (tmp_path / "plain").write_text("x")
    with whole_file(tmp_path / "whole") as temporary:
        temporary.write_text("x")
        assert mode(temporary) == mode(tmp_path / "plain")
    assert mode(tmp_path / "whole") == mode(tmp_path / "plain") == 0o666 & ~mask


@pytest.mark.parametrize("given", [0o600, 0o640, 0o444, 0o666])
def test_a_file_that_is_replaced_keeps_its_mode(tmp_path, mask, given):
    path = tmp_path / "kept"
    path.write_text("before")
    path.chmod(given)
    with whole_file(path) as temporary:
        assert mode(temporary) == 0o600 & ~mask  # nobody else reads what will be private
        temporary.write_text("after")
    assert (mode(path), path.read_text()) == (given, "after")


def test_the_umask_of_the_process_is_never_changed(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "umask", None)
    with whole_file(tmp_path / "whole") as temporary:
        temporary.write_text("x")


def test_a_long_name_and_several_at_once(tmp_path):
    target = tmp_path / ("n" * 250)
    with whole_file(target) as one, whole_file(target) as two:
        one.write_text("one")
        two.write_text("two")
        assert one != two and one.parent == two.parent == tmp_path
        assert one.name.startswith("." + "n" * 100 + f".{os.getpid()}@")
    assert target.read_text() == "one"  # the last to end
    assert [each.name for each in tmp_path.iterdir()] == [target.name]


def test_a_folder_that_is_not_there(tmp_path):
    said = r"path must lie in an existing folder; got "
    with pytest.raises(FileNotFoundError, match=said), whole_file(tmp_path / "no" / "file"):
        pass


def test_both_the_file_and_its_folder_are_written_to_the_disk(tmp_path, monkeypatch):
    synced = []

    def noted(handle):
        synced.append(os.fstat(handle).st_ino)

    monkeypatch.setattr(os, "fsync", noted)
    with whole_file(tmp_path / "file") as temporary:
        temporary.write_text("x")
        own = temporary.stat().st_ino
    assert synced == [own, tmp_path.stat().st_ino]


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="the system does not list open files")
def test_a_folder_that_was_written_is_closed(tmp_path):
    before = len(list(Path("/proc/self/fd").iterdir()))
    durable(tmp_path)
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_windows_opens_no_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(whole_files.os, "fsync", lambda handle: pytest.fail("a folder was opened"))
    monkeypatch.setattr(whole_files.os, "name", "nt")
    durable(tmp_path)


def part(number, computer=None):
    return f".run.nc.{number}@{computer or whole_files._computer()}.a1b2.part"


def test_only_what_dead_processes_of_this_computer_left_is_removed(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    names = {
        part(dead.pid): False,
        part(os.getpid()): True,
        part(1): True,  # of another user, or root's own
        part(dead.pid, "elsewhere"): True,
        ".run.nc.part": True,
        "run.nc": True,
    }
    for name in names:
        (tmp_path / name).write_text("x")
    remove_leftovers(tmp_path)
    assert {name: (tmp_path / name).exists() for name in names} == names


def test_a_process_of_another_user_lives_and_windows_asks_none(tmp_path, monkeypatch):
    def refused(process, signal):
        assert signal == 0
        raise PermissionError

    monkeypatch.setattr(os, "kill", refused)
    assert whole_files._lives(7)
    monkeypatch.setattr(os, "kill", lambda *given: pytest.fail("a signal of 0 would end it"))
    monkeypatch.setattr(whole_files.os, "name", "nt")
    assert whole_files._lives(7)
