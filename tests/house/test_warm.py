"""Compiling tells how far it is, before a first use (`sdpgrind.warm`, ``hwsim warm``) or within it; then it
is silent.
"""

import io
import logging
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from multiprocessing import active_children, get_context
from pathlib import Path
from types import SimpleNamespace

import pytest

import sdpgrind
from hwsim import cli
from hwsim.command import _warm
from hwsim.command._side_by_side import SideBySide
from sdpgrind.base import progress
from sdpgrind.base.compiling import compile_line, warm
from sdpgrind.base.progress import Speaker

SOURCE = Path(sdpgrind.__file__).parents[1]
TOY = """
import time
from hwsim import cli
from hwsim.command import _warm
from sdpgrind.base.compiling import warm
warm.HOMES["weldbead"] = "toy"
_warm._one_part = lambda area, arguments_of: None
_warm._EVERY /= 20.0
raise SystemExit(cli.main(["warm", "weldbead"]))
"""
FIRST_USE = """
import os, signal, time
from sdpgrind.base.compiling.compiled import compiled

@compiled
def _inner(x):
    return x + 1.0

@compiled
def outer(x):
    return _inner(x)

def first_use():
    outer(1.0)
    if os.path.exists("interrupted"):
        signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in the background
        os.kill(os.getpid(), signal.SIGINT)
    if os.path.exists("slow"):
        time.sleep(0.15)
"""


@pytest.fixture
def toy(tmp_path):
    """An area in a folder, with a cache of its own."""
    (tmp_path / "toy").mkdir()
    (tmp_path / "toy" / "__init__.py").write_text("")
    (tmp_path / "toy" / "_first_use.py").write_text(FIRST_USE)
    return tmp_path


def command(folder):
    """What `hwsim warm` of the toy says in a pipe: status, standard output, standard error."""
    known = {"PYTHONPATH": f"{SOURCE}{os.pathsep}{folder}", "NUMBA_CACHE_DIR": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", TOY],
        capture_output=True,
        text=True,
        cwd=folder,
        env=os.environ | known,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def test_the_command_says_what_was_compiled_and_in_a_pipe_every_two_seconds_what_is_done(toy):
    """In a twentieth of its time."""
    assert _warm._EVERY == 2.0
    (toy / "slow").write_text("")
    status, out, error = command(toy)
    assert status == 0
    assert out.startswith("weldbead: compiled 2 kernels in ") and out.count("\n") == 1
    assert "weldbead: first use\n" in error and "\r" not in error


def test_broken_off_what_is_compiled_stays(toy):
    (toy / "interrupted").write_text("")
    status, out, error = command(toy)
    assert (status, out) == (130, "")
    assert (
        error.splitlines()[-1]
        == "hwsim: interrupted; what is compiled stays, and the same command goes on from here"
    )
    (toy / "interrupted").unlink()
    assert command(toy)[:2] == (0, "weldbead: compiled already\n")


def test_the_function_tells_an_area_that_there_is_none():
    with pytest.raises(ValueError, match=r"area must be one of .*locus.*; got 'milling'"):
        sdpgrind.warm("milling")


def test_the_command_tells_an_area_that_there_is_none(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["warm", "milling"])
    assert ended.value.code == 2
    assert "milling" in capsys.readouterr().err


def test_every_area_has_a_first_use():
    areas = [module.split(".")[2].removeprefix("_") for module in cli._AREAS]
    assert sorted(areas) == sorted(warm.HOMES) == sorted(warm.KERNELS) == sorted(_warm.KERNELS)
    for home in warm.HOMES.values():
        assert SOURCE.joinpath(*home.split("."), "_first_use.py").is_file()


def kernel(module):
    return SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=SimpleNamespace(__module__=module))})


OUTER, INNER = kernel("sdpgrind.locus._trace"), kernel("numba.np")


class Terminal(io.StringIO):
    """Says that it is a terminal."""

    def isatty(self):
        return True


def standard_error(monkeypatch, stream):
    """Put a stream in the place of standard error; a fixture comes before pytest's own."""
    monkeypatch.setattr(sys, "stderr", stream)
    return stream


def compile_two(listener, stream=None):
    """Compile a kernel within one; with a stream: take as long as it needs to be told."""
    listener.on_start(OUTER)
    listener.on_start(INNER)
    listener.on_end(INNER)
    while stream is not None and "once on this machine" not in stream.getvalue():
        time.sleep(0.001)
    listener.on_end(OUTER)


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(compile_line, "_PATIENCE", 0.0)


def test_a_long_first_call_is_told_on_a_terminal_and_wiped_away(monkeypatch, impatient):
    stream, listener = standard_error(monkeypatch, Terminal()), compile_line.Compiling()
    compile_two(listener, stream)
    lines = stream.getvalue().split("\r\x1b[K")
    assert lines[1].startswith("sdpgrind: compiling locus, once on this machine: 0 kernels so far")
    assert lines[-1] == "" and "\n" not in stream.getvalue() and listener.count == 2


def test_a_long_first_call_is_told_in_a_pipe(monkeypatch, impatient):
    stream, listener = standard_error(monkeypatch, io.StringIO()), compile_line.Compiling()
    compile_two(listener, stream)
    compile_two(listener)  # within the seconds between two lines
    assert re.fullmatch(
        r"sdpgrind: compiling locus, once on this machine: [01] kernels? so far\n", stream.getvalue()
    )


@pytest.mark.parametrize("stream", [Terminal, io.StringIO])
def test_a_short_first_call_is_silent(monkeypatch, stream):
    stream = standard_error(monkeypatch, stream())
    compile_two(compile_line.Compiling())
    assert stream.getvalue() == ""


def test_short_compilations_add_up(monkeypatch):
    stream, listener = standard_error(monkeypatch, io.StringIO()), compile_line.Compiling()
    monkeypatch.setattr(compile_line, "_PATIENCE", 0.05)
    while not stream.getvalue():  # each lasts much less
        compile_two(listener)


@pytest.mark.parametrize("silenced", ["logger", "no standard error", "not ours", "progress"])
def test_no_line_where_nobody_looks(monkeypatch, impatient, silenced):
    stream = standard_error(monkeypatch, None if silenced == "no standard error" else io.StringIO())
    if silenced == "logger":
        monkeypatch.setattr(progress.logger, "level", logging.WARNING)
    started, asked = INNER if silenced == "not ours" else OUTER, nullcontext()
    if silenced == "progress":
        asked = progress.reported(lambda share, text: None)
    with asked:
        listener = compile_line.Compiling()
        listener.on_start(started)
        assert listener._line is None
        listener.on_end(started)
    assert stream is None or stream.getvalue() == ""


def test_progress_is_told_from_the_first_kernel_on_and_never_falls(monkeypatch, impatient):
    stream, listener, told = standard_error(monkeypatch, Terminal()), compile_line.Compiling(), []
    compile_two(listener, stream)
    said = stream.getvalue()
    with listener.of("weldbead", lambda share, text: told.append((share, text)), kernels=5):
        for _ in range(3):
            compile_two(listener)
    assert told[0] == (0.0, "compiling weldbead, once on this machine: 2 kernels so far")
    assert told[2] == (0.4, "weldbead: first use") and told[-1][0] == 1.0
    assert told == sorted(told, key=lambda line: line[0]) and stream.getvalue() == said


def test_what_is_planned_meanwhile_has_no_line_of_its_own(monkeypatch):
    stream = standard_error(monkeypatch, io.StringIO())
    monkeypatch.setattr(progress, "_FIRST", 0.0)
    plan = progress.reporting(lambda *, progress=None: progress(0.5, "planning"))
    with compile_line.Compiling().of("locus", lambda share, text: None, kernels=5):
        plan()
    assert stream.getvalue() == ""
    plan()
    assert stream.getvalue() == " 50 % planning\n"


def test_shares_of_all_areas_never_fall(monkeypatch):
    monkeypatch.setattr(
        warm, "first_use", lambda area, progress: [progress(share, area) for share in (0.5, 1)]
    )
    told = []
    sdpgrind.warm(progress=lambda share, text: told.append(share))
    assert told == sorted(told) and len(set(told)) > len(warm.HOMES) and told[-1] == pytest.approx(1.0)


def long_work(name, number, tell):
    """A stage of a work that processes carry out; its count says which one it is."""
    tell(0.5, f"{name} {number}")
    return 10**number


def test_processes_take_the_longest_work_left_and_shares_never_fall():
    told = []
    works = {"short": (1.0,), "long": (4.0, 3.0), "middle": (1.5, 1.0)}
    done = SideBySide(long_work, works, lambda share, text: told.append((share, text))).carried_out(1)
    assert done == {"short": 1, "long": 11, "middle": 11}
    assert [text for _, text in told] == ["long 0", "long 1", "middle 0", "short 0", "middle 1"]
    assert [10.5 * share for share, _ in told] == pytest.approx([2.0, 5.5, 7.75, 9.0, 10.0])


def failing_work(name, number, tell):
    raise ValueError(name)


def test_a_work_that_fails_ends_its_processes_and_no_other():
    other = get_context("spawn").Process(target=time.sleep, args=(60.0,), daemon=True)
    other.start()
    others = set(active_children())
    with pytest.raises(ValueError, match="one"):
        SideBySide(failing_work, {"one": (1.0,)}, lambda share, text: None).carried_out(1)
    other.join(0.2)  # time to end, if it was told to
    assert set(active_children()) == others and other.is_alive()
    other.kill()
    other.join()


def test_kernels_are_of_an_area():
    place = {"sdpgrind.locus._trace.trace": "locus", "centering.push.batch": "centering"}
    place |= {"hwsim.plants._x": "hwsim", "mine": "mine"}
    for module, area in place.items():
        kernel = SimpleNamespace(py_func=SimpleNamespace(__module__=module))
        assert compile_line._area(kernel) == area


def test_a_terminal_has_one_line(monkeypatch):
    stream = standard_error(monkeypatch, Terminal())
    with Speaker(every=0.001) as line:
        line(0.5, "halfway")
        while "halfway" not in stream.getvalue():
            time.sleep(0.001)
    lines = stream.getvalue().split("\r\x1b[K")
    assert " 50 % halfway" in lines and lines[-1] == "" and "\n" not in stream.getvalue()


def test_interrupts_are_those_of_the_shell():
    assert _warm.INTERRUPTED == 128 + signal.SIGINT
