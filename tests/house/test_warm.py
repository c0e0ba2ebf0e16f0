"""Compiling tells how far it is, before a first use (`sdpgrind.warm`, ``hwsim warm``) or within it; then it
is silent.
"""

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import sdpgrind
from hwsim import cli
from hwsim.command import _warm
from sdpgrind.base.compiling import compile_line, warm
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.progress import Speaker

SOURCE = Path(sdpgrind.__file__).parents[1]
TOY = """
import time
from hwsim import cli
from hwsim.command import _warm
from sdpgrind.base.compiling import warm
warm.HOMES["weldbead"] = "toy"
_warm._one_part = lambda area, arguments_of: None
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
        time.sleep(3.0)
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


def test_the_command_says_what_was_compiled_and_that_it_was(toy):
    status, out, _ = command(toy)
    assert status == 0
    assert out.startswith("weldbead: compiled 2 kernels in ") and out.count("\n") == 1
    assert command(toy)[:2] == (0, "weldbead: compiled already\n")


def test_in_a_pipe_a_line_says_every_two_seconds_what_is_done(toy):
    (toy / "slow").write_text("")
    error = command(toy)[2]
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
    assert sorted(areas) == sorted(warm.HOMES)
    for home in warm.HOMES.values():
        assert SOURCE.joinpath(*home.split("."), "_first_use.py").is_file()


@compiled
def inner(x):
    return x + 1.0


@compiled(inline="always")
def written_into(x):
    return inner(x)


@compiled
def outer(x):
    return written_into(x) + inner(x)


class Terminal(io.StringIO):
    """Says that it is a terminal."""

    def isatty(self):
        return True


def terminal(monkeypatch):
    """Put a terminal in the place of standard error; a fixture comes before pytest's own."""
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    return stream


def listening(seconds_each):
    """What listens to a compiler, on a clock that goes on by so much at each look."""
    now = iter(k * seconds_each for k in range(1000))
    return compile_line.Compiling(clock=lambda: next(now))


def event(kernel):
    return SimpleNamespace(data={"dispatcher": kernel})


def compile_two(listener):
    listener.on_start(event(outer))
    listener.on_start(event(inner))
    listener.on_end(event(inner))
    listener.on_end(event(outer))


def test_a_long_first_call_is_told_on_a_terminal_and_wiped_away(monkeypatch):
    stream = terminal(monkeypatch)
    listener = listening(3.0)
    compile_two(listener)
    assert "\r\x1b[Kcompiling house" not in stream.getvalue()
    lines = stream.getvalue().split("\r\x1b[K")
    assert lines[1].startswith("compiling ") and lines[1].endswith(", once on this machine: 0 of 2")
    assert lines[-1] == "" and listener.count == 2


def test_a_short_first_call_is_silent(monkeypatch):
    stream = terminal(monkeypatch)
    compile_two(listening(0.01))
    assert stream.getvalue() == ""


def test_short_compilations_add_up(monkeypatch):
    stream = terminal(monkeypatch)
    listener = listening(0.3)
    compile_two(listener)
    assert stream.getvalue() == ""
    compile_two(listener)
    compile_two(listener)
    assert "once on this machine" in stream.getvalue()


def test_no_line_where_nobody_looks(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    compile_two(listening(3.0))
    assert sys.stderr.getvalue() == ""


def test_progress_is_told_from_the_first_kernel_on(monkeypatch):
    stream = terminal(monkeypatch)
    listener, told = listening(0.01), []
    monkeypatch.setattr(compile_line, "listener", listener)
    with compile_line.told("locus", lambda share, text: told.append((share, text))):
        compile_two(listener)
    assert told[0] == (0.0, "compiling locus, once on this machine: 0 of 2")
    assert told[-1] == (1.0, "locus: first use") and stream.getvalue() == ""


def test_kernels_are_of_an_area():
    place = {"sdpgrind.locus._trace.trace": "locus", "centering.push.batch": "centering"}
    place |= {"hwsim.plants._x": "hwsim", "mine": "mine"}
    for module, area in place.items():
        kernel = SimpleNamespace(py_func=SimpleNamespace(__module__=module))
        assert compile_line._area(kernel) == area


def test_a_terminal_has_one_line(monkeypatch):
    stream = terminal(monkeypatch)
    with Speaker(every=0.001) as line:
        line(0.5, "halfway")
        while "halfway" not in stream.getvalue():
            time.sleep(0.001)
    lines = stream.getvalue().split("\r\x1b[K")
    assert " 50 % halfway; about 0 s to go" in lines and lines[-1] == "" and "\n" not in stream.getvalue()


def test_interrupts_are_those_of_the_shell():
    assert _warm.INTERRUPTED == 128 + signal.SIGINT
