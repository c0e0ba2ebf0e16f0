"""Progress: shares never fall, a pipe hears of long steps, compiling speaks, stages are logged."""

import argparse
import io
import itertools
import logging
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hwsim
import sdpgrind
from hwsim.cli import _parser
from hwsim.command import _times as times
from sdpgrind import finishing, locus, plunge, sdp, weldbead
from sdpgrind.base import progress
from sdpgrind.base.compiling import compile_line
from sdpgrind.base.progress import Portions, Speaker, Told, current, portion, reported

BEND = sdp.Problem(
    [sdp.Axis("error", -3, 3, 31, "mm", below="stop", above="stop")],
    [
        sdp.Move(
            "bend",
            {"by": sdp.Levels(0, 5, 21)},
            sdp.Shift("error", lambda s, c: sdp.Normal(c.by, 0.1 * c.by)),
        )
    ],
    [sdp.Stop("done", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(4.0)))],
    sdp.Stages(2, 1.0, "hits_left", ""),
)
BEAD = weldbead.preset("P1")
CYCLE = plunge.preset("simulation")
GRINDER, FOLLOW = hwsim.PlungeGrinder(CYCLE), plunge.CycleController(CYCLE, safety_margin=0.002)
PATH = finishing.hilbert(finishing.preset("nominal").surface, 2)
VERBS = {
    "one grid": lambda tell: sdp.plan(BEND, progress=tell),
    "refined": lambda tell: sdp.plan(BEND, tolerance=1e-2, progress=tell),
    "out of reach": lambda tell: sdp.plan(BEND, tolerance=1e-7, throw=False, progress=tell),
    "sequence": lambda tell: weldbead.plan(BEAD, tolerance=1e-2, progress=tell),
    "exact": lambda tell: plunge.plan(CYCLE, progress=tell),
    "stages": lambda tell: plunge.plan(CYCLE, method="dp", steps=40, progress=tell),
    "locus": lambda tell: locus.plan(locus.preset("koren-example"), progress=tell),
    "motion": lambda tell: finishing.plan(finishing.FinishingProblem(PATH), progress=tell),
    "run": lambda tell: hwsim.run(GRINDER, FOLLOW, parts=3, progress=tell),
    "compare": lambda tell: hwsim.compare(GRINDER, {"a": FOLLOW, "b": FOLLOW}, parts=2, progress=tell),
    "repeat": lambda tell: hwsim.repeat(GRINDER, FOLLOW, series=2, progress=tell),
}


@pytest.mark.parametrize("verb", VERBS)
def test_shares_never_fall_and_end_at_one(verb, monkeypatch):
    monkeypatch.setattr("sdpgrind.sdp._plan.plan.REFINEMENTS", 6)  # the last of ten takes seconds
    told = []
    VERBS[verb](lambda share, text: told.append(share))
    assert told == sorted(told) and told[0] >= 0 and told[-1] == pytest.approx(1.0)
    assert current() is None


@given(st.lists(st.tuples(st.floats(0.01, 1e3), st.floats(0, 1e3)), min_size=1, max_size=8))
def test_portions_are_what_is_left(stages):
    told, at = [], 0.0
    portions = Portions(lambda share, text: told.append(share))
    for weight, later in stages:
        stage = portions.next(weight, later)
        stage(0.0, "")
        stage(1.0, "")
        assert told[-2] == pytest.approx(at)
        at += (1 - at) * weight / (weight + later)
        assert told[-1] == pytest.approx(at)
    assert all(a <= b + 1e-12 for a, b in itertools.pairwise(told)) and at <= 1 + 1e-12


def test_known_stages_have_their_share_of_the_work():
    ends = []
    portions = Portions(lambda share, text: ends.append(share))
    for later in ((4.0 + 16.0), 4.0, 0.0):  # 1 : 4 : 16
        portions.next(1.0, later)(1.0, "")
    assert ends == pytest.approx([1 / 21, 5 / 21, 1.0])


def test_a_verb_that_goes_back_is_held():
    told = []
    tell = Told(lambda share, text: told.append((share, text)))
    tell(0.5, "a")
    tell(0.2, "b")
    tell.say("c")
    assert told == [(0.5, "a"), (0.5, "b"), (0.5, "c")]


class Clock:
    """Time that passes where the test says so; `busy`: seconds by the wall in one of CPU time."""

    def __init__(self, monkeypatch, busy):
        self.cpu, self.busy = 0.0, busy
        clocks = SimpleNamespace(process_time=lambda: self.cpu, monotonic=lambda: self.busy * self.cpu)
        monkeypatch.setattr(progress, "time", clocks)  # not that of the test run
        monkeypatch.setattr(progress, "compile_time", progress.CompileTime())


def test_a_long_step_is_repeated_in_a_pipe(monkeypatch):
    stream, clock = io.StringIO(), Clock(monkeypatch, 1.0)
    with Speaker(stream, every=0.001) as line:
        clock.cpu = 2.0
        line(0.25, "solving")
        while stream.getvalue().count("solving") < 3:  # a single long step
            time.sleep(0.001)
    assert stream.getvalue().splitlines()[-1] == " 25 % solving; about 6 s to go"


def shares_and_times_left(clock, line, compiling=9):
    """Lines each second: a third of the work, compiling, the rest of the work; it takes 9 s by itself."""
    told = []
    for second in range(1, 9 + compiling):
        clock.cpu = float(second)
        if second == 3:
            progress.compile_time.begin()
        if second == 3 + compiling:
            progress.compile_time.end()
        line((second if second < 3 else 3 if second < 3 + compiling else second - compiling) / 9, "work")
        share, _, left = line.line().partition(" % work")
        told.append((float(share), float(left.removeprefix("; about ").removesuffix(" s to go") or "nan")))
    return told


@pytest.mark.parametrize("busy", [1.0, 3.0])
def test_known_compiling_has_its_part_of_the_share(monkeypatch, busy):
    clock = Clock(monkeypatch, busy)
    told = shares_and_times_left(clock, Speaker(io.StringIO(), shown=False, known=(9.0, 9.0)))
    for second, (share, left) in enumerate(told, 1):
        assert share == pytest.approx(100 * second / 18, abs=0.5)
        assert left == pytest.approx(busy * (18 - second), abs=0.5)


@pytest.mark.parametrize("foretold", [6.0, 18.0])
def test_shares_never_fall_where_compiling_takes_longer_or_shorter_than_foretold(monkeypatch, foretold):
    clock = Clock(monkeypatch, 1.0)
    told = shares_and_times_left(clock, Speaker(io.StringIO(), shown=False, known=(9.0, foretold)))
    (shares, left) = zip(*told, strict=True)
    assert list(shares) == sorted(shares) and list(left) == sorted(left, reverse=True)


def test_the_time_left_counts_down_in_a_step_without_news_and_is_not_told_once_it_is_over(monkeypatch):
    clock, line = Clock(monkeypatch, 1.0), Speaker(io.StringIO(), shown=False)
    clock.cpu = 2.0
    line(0.4, "work")
    told = []
    for second in (2.0, 3.0, 4.0, 5.0, 9.0):
        clock.cpu = second
        told.append(line.line().removeprefix(" 40 % work"))
    assert told == ["; about 3 s to go", "; about 2 s to go", "; about 1 s to go", "", ""]


def test_unknown_compiling_moves_no_time_left_and_tells_none(monkeypatch):
    clock = Clock(monkeypatch, 1.0)
    told = shares_and_times_left(clock, Speaker(io.StringIO(), shown=False))
    assert [left for _, left in told[:2]] == [8.0, 7.0] and all(left != left for _, left in told[2:11])
    assert [left for _, left in told[11:]] == [6.0, 5.0, 4.0, 3.0, 2.0, 1.0]


@progress.reporting
def halved(*, progress=None):
    progress(0.0, "begun")
    progress(0.5, "halfway")


@pytest.mark.parametrize("every, told", [(0.0, "  0 % begun\n 50 % halfway\n"), (9.0, "")])
def test_a_long_verb_is_heard_in_a_pipe_without_being_asked(monkeypatch, every, told):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    monkeypatch.setattr(progress, "EVERY", every)
    monkeypatch.setattr(progress, "_FIRST", every)
    halved()
    assert sys.stderr.getvalue() == told


def test_the_first_line_that_nobody_asked_for_comes_sooner_than_the_next(monkeypatch):
    clock = iter([100.0, 104.9, 105.1, 105.1, 113.9, 114.2, 114.2])  # s
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    line = progress.UnaskedLine()
    for share in (0.1, 0.2, 0.3, 0.4):
        line(share, "solving")
    assert sys.stderr.getvalue() == " 20 % solving\n 40 % solving\n"


def test_a_verb_goes_on_where_nobody_reads(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    monkeypatch.setattr(progress, "_FIRST", 0.0)
    sys.stderr.close()
    halved()
    monkeypatch.setattr(sys, "stderr", None)
    halved()


def test_a_line_that_nobody_reads_ends():
    stream = io.StringIO()
    with Speaker(stream, every=0.0):
        stream.close()


@pytest.mark.parametrize("closed", [True, False])
def test_a_line_that_was_asked_for_needs_no_standard_error(monkeypatch, closed):
    stream = io.StringIO()
    stream.close()
    monkeypatch.setattr(sys, "stderr", stream if closed else None)
    with Speaker(every=0.0) as line:
        line(0.5, "solving")
    assert line.line().startswith(" 50 % solving")


def test_the_logger_silences_what_nobody_asked_for(monkeypatch):
    assert progress.unasked() is sys.stderr
    monkeypatch.setattr(progress.logger, "level", logging.WARNING)
    assert progress.unasked() is None


def test_progress_true_is_heard_in_a_pipe():
    code = """
import time, sdpgrind.base.progress as p
p.EVERY, clock = 0.05, [0.0]
time.process_time = time.monotonic = lambda: clock[0]
@p.quiet
def verb(*, progress=None):
    clock[0] = 2.0
    progress(0.5, "halfway")
    time.sleep(0.3)
verb(progress=True)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "" and " 50 % halfway; about 2 s to go" in done.stderr and "\r" not in done.stderr


@pytest.mark.parametrize("wrong", [3, "yes", False])
def test_other_progress_is_refused(wrong):
    with pytest.raises(TypeError, match="progress must be True, None or a function of the share done"):
        sdp.plan(BEND, progress=wrong)


def test_compiling_speaks_through_the_verb_that_is_under_way(monkeypatch):
    listener, told = compile_line.Compiling(), []
    kernel = SimpleNamespace(py_func=SimpleNamespace(__module__="sdpgrind.locus._trace"))
    with reported(lambda share, text: told.append((share, text))) as tell:
        tell(0.4, "tracing")
        listener.on_start(SimpleNamespace(data={"dispatcher": kernel}))
    assert told[-1] == (0.4, "compiling locus, once on this machine: 0 kernels so far")


@pytest.mark.parametrize("verb", [progress.reporting, progress.quiet])
def test_what_a_verb_hands_on_was_not_asked_for_by_the_user(verb):
    """Compiling in the verb inside has a line of its own then."""

    @progress.reporting
    def inside(*, progress=None):
        return current() is not None

    @verb
    def outside(*, progress=None):
        return inside(progress=portion(progress, 0.0, 0.5))

    assert not outside() and outside(progress=lambda share, text: None)


def kernel_of(module):
    return SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=SimpleNamespace(__module__=module))})


def test_compiling_that_is_interrupted_at_its_begin_is_over(monkeypatch):
    """Else each later kernel would count as called by that one, and the clock of compiling would go on."""
    monkeypatch.setattr(compile_line, "compile_time", progress.CompileTime())
    monkeypatch.setattr(sys, "stderr", None)
    listener, event = compile_line.Compiling(), kernel_of("sdpgrind.locus._trace")
    for place in (listener, compile_line):
        with monkeypatch.context() as patch:
            patch.setattr(place, "_tell" if place is listener else "_area", lambda *given: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                listener.on_start(event)
        listener.on_end(event)  # as numba does
        assert not compile_line.compile_time.under_way
    monkeypatch.undo()
    listener.on_start(kernel_of(None))  # made by exec
    assert listener._area == "numba"
    listener.on_end(kernel_of(None))


def test_stages_are_logged_and_nothing_is_configured(caplog):
    logger = logging.getLogger("sdpgrind")
    assert logger.level == logging.NOTSET and [type(one) for one in logger.handlers] == [logging.NullHandler]
    with caplog.at_level(logging.DEBUG, "sdpgrind"):
        sdp.plan(BEND, tolerance=1e-2)
    by_level = {
        level: [r.getMessage() for r in caplog.records if r.levelname == level] for level in ("INFO", "DEBUG")
    }
    assert by_level["INFO"][:2] == ["sdpgrind.sdp.plan begins", "solving on 31 nodes"]
    assert by_level["INFO"][-1].startswith("sdpgrind.sdp.plan took ")
    assert by_level["DEBUG"][0].startswith("halving 1: largest change ")


def arguments(line):
    return _parser().parse_args(line.split())


def test_the_table_has_every_command_and_kernels_that_are_there():
    areas = [
        arguments(f"{name} --preset x") for name in ("weldbead", "plunge", "locus", "finishing", "centering")
    ]
    others = {"demo": "demo", "roundness": "roundness ring.csv", "export": "export p.nc out"}  # no presets
    others["export --lost-max"] = f"{others['export']} --lost-max 1e-3"
    commands = {name.split()[0] for name in others}
    assert {*commands, *(each.work.args[0].name for each in areas)} == {
        name.split()[0] for name in times.TIMES
    }
    for name, row in times.TIMES.items():
        arguments(others.get(name, f"{name} --preset x"))  # its switch is there
        path, kernel = row.kernel.split(":")
        assert f"def {kernel}(" in (Path(sdpgrind.__file__).parents[1] / path).read_text(), name


def test_the_first_line_says_what_is_done_and_how_long(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    row = times.Times(12.0, 1.2, 3.0, 25.0, times.TIMES["weldbead"].kernel)
    monkeypatch.setattr(times, "TIMES", {"weldbead": row})
    given = arguments("weldbead --preset P1")
    outlook = times.Outlook.of("weldbead", given, 20, "policy.nc")
    assert outlook.line(20, "bead") == (
        "planning takes about 12 s, 20 beads about 24 s, the rest about 3 s; "
        "compiling, once on this machine, about 25 s more"
    )
    planned = times.Outlook.of("weldbead", given, 0, "policy.nc")
    assert planned.line(0, "bead") == "planning takes about 12 s, the rest about 3 s"
    (tmp_path / "_plant_0").mkdir()
    (tmp_path / "_plant_0" / "force_table_kernels.sample-0.py311.nbi").write_text("")
    (tmp_path / "policy.nc").write_text("")
    kept = argparse.Namespace(**{**vars(given), "out": tmp_path})
    followed = times.Outlook.of("weldbead", kept, 20, "policy.nc")
    assert followed == (0.0, 24.0, 3.0, 0.0)
    assert followed.line(20, "bead") == "20 beads take about 24 s, the rest about 3 s"
    monkeypatch.setattr(times, "TIMES", {"weldbead": row._replace(part=0.0, rest=0.0)})
    times.Outlook.of("weldbead", kept, 20, "policy.nc").foretell(20, "bead")
    assert capsys.readouterr() == ("", "")  # a plan that is kept was all that was known
    assert followed.line(1, "bead") == "1 bead takes about 24 s, the rest about 3 s"
    assert times.Outlook.of("milling", given, 20, "policy.nc") is None
