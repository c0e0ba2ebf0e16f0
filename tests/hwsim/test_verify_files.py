"""``hwsim verify`` of plans, logs and journals: a line for each file, and the exit status."""

import shutil

import pytest
from hwsim_fakes import Drain, noisy_tank
from test_journal import OLD

import hwsim
from hwsim.cli import main
from sdpgrind import plunge


@pytest.fixture
def files(tmp_path):
    """A plan, a log and a journal."""
    plunge.plan(plunge.preset("simulation")).save(tmp_path / "plan.nc")
    hwsim.run(noisy_tank(), Drain(), parts=3, journal=tmp_path / "run.db").save(tmp_path / "run.nc")
    return [tmp_path / name for name in ("plan.nc", "run.nc", "run.db")]


def verify(capsys, *files):
    status = main(["verify", *map(str, files)])
    return status, capsys.readouterr().out.splitlines()


def test_whole_files_have_a_line_each(files, capsys):
    kinds = ("plunge.cycle", "hwsim.log", "journal of 3 parts")
    told = [f"{path}: {kind}, as it was written" for path, kind in zip(files, kinds, strict=True)]
    assert verify(capsys, *files) == (0, told)
    for path, line in zip(files, told, strict=True):
        assert verify(capsys, path) == (0, [line])


@pytest.mark.parametrize("k", range(3))
def test_a_damaged_file_gives_status_3_and_does_not_keep_the_others_from_it(files, capsys, k):
    raw = bytearray(files[k].read_bytes())
    raw[-5] ^= 1  # in a journal: of the last part's arrays
    files[k].write_bytes(raw)
    status, told = verify(capsys, *files)
    assert status == 3 and [": damaged, " in line for line in told] == [j == k for j in range(3)]
    assert verify(capsys, files[k]) == (3, [told[k]])


def test_files_of_before_are_not_checked_but_read(tmp_path, capsys):
    chart = OLD.with_name("centering.chart.nc")
    status, told = verify(capsys, shutil.copy(OLD, tmp_path / "run.db"), chart)
    assert status == 2
    end = "not checked: version 0.1.0 wrote no digest; it can be read"
    assert told == [f"{tmp_path / 'run.db'}: journal of 2 parts, {end}", f"{chart}: centering.chart, {end}"]
    (tmp_path / "chart.nc").write_bytes(chart.read_bytes().replace(b"sigmas", b"sigmaz"))
    assert verify(capsys, tmp_path / "chart.nc")[0] == 3


def test_a_command_with_a_damaged_plan_has_the_same_status(files, capsys):
    files[0].write_bytes(files[0].read_bytes()[:-1])
    assert main(["plunge", "--plan", str(files[0])]) == 3
    told = capsys.readouterr().err.splitlines()
    assert told[-1].startswith(f"hwsim: '{files[0]}' is damaged: ") and "Traceback" not in "".join(told)
