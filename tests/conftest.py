"""CPU time of every test: at the end of a run those are told that took long.

A busy machine stretches the time on the clock, the CPU time hardly. What a test compiled is not counted
against it: compiled kernels stay on disk. Its fixtures count, and the programs that it starts.

Of two workers that collect, one begins at the last file: they meet in the middle. In the same order both would
rewrite the assertions of every file at the same time (measured: 23 s of CPU time each, on a clean clone).
"""

import gc
import os
import sys
import time
from collections import Counter
from contextlib import contextmanager

import pytest

CPU_LIMIT = 5.0  # s; chosen: some 15 000 tests in twenty minutes on two cores leave few of them more
_begun = pytest.StashKey()


def pytest_addoption(parser):
    told = "fail where a test took more CPU time (s), compiled nothing and is not marked slow"
    parser.addoption("--cpu-limit", type=float, metavar="S", help=told)


class BackwardDir(pytest.Dir):
    """A folder that is collected from its last file to its first."""

    def collect(self):
        return reversed(list(super().collect()))


def pytest_collect_directory(path, parent):
    """Let every other worker begin at the end; its tests are put in the order of all below."""
    worker = getattr(parent.config, "workerinput", {}).get("workerid", "gw0")
    return BackwardDir.from_parent(parent, path=path) if int(worker.removeprefix("gw")) % 2 else None


def pytest_collection_modifyitems(config, items):
    """Give workers files with slow tests first, then those of many: no long one is left to a single worker."""
    if hasattr(config, "workerinput"):
        many = Counter(item.path for item in items)
        slow_ones = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: (item.path not in slow_ones, -many[item.path], str(item.path)))


def _spent():
    """CPU time of this process and of those that it waited for, s; kernels compiled here."""
    compiling = sys.modules.get("sdpgrind.base.compiling.compile_line")
    times = os.times()
    seconds = time.process_time() + times.children_user + times.children_system
    return seconds, compiling.listener.count if compiling else 0


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item):
    item.stash[_begun] = _spent()
    return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_call(item):
    try:
        return (yield)
    finally:
        seconds, compiled = (now - begun for now, begun in zip(_spent(), item.stash[_begun], strict=True))
        if compiled == 0 and not any(map(item.get_closest_marker, ("slow", "gallery"))):
            item.user_properties.append(("cpu", seconds))


def slow(reports, limit):
    """Sentences on the tests above a limit (s), the slowest first; `reports` of their calls."""
    times = [
        (value, report.nodeid)
        for report in reports
        for name, value in getattr(report, "user_properties", ())
        if name == "cpu" and value > limit and report.when == "call"
    ]
    return [f"{seconds:6.1f} s  {test}" for seconds, test in sorted(times, reverse=True)]


def _slow(config, limit):
    terminal = config.pluginmanager.get_plugin("terminalreporter")
    return slow([report for kind in terminal.stats.values() for report in kind], limit) if terminal else []


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session):
    limit = session.config.option.cpu_limit
    if limit is not None and _slow(session.config, limit):
        session.exitstatus = max(session.exitstatus, pytest.ExitCode.TESTS_FAILED)


def pytest_terminal_summary(terminalreporter, config):
    limit = config.option.cpu_limit or CPU_LIMIT
    found = _slow(config, limit)
    if found:
        terminalreporter.section(f"more than {limit:g} s of CPU time, not marked slow")
        terminalreporter.write_line("\n".join(found))


@pytest.fixture
def few_pushes(monkeypatch):
    """Strategies on a coarse grid with every fourth kind of push: for what does not depend on how good they are."""
    from centering.cycle._strategy import plan

    kinds, size = plan.default_kinds, plan.Size
    monkeypatch.setattr(plan, "default_kinds", lambda top_speed: kinds(top_speed)[::4])
    monkeypatch.setattr(plan, "Size", lambda: size(offsets=32, frictions=3))


@contextmanager
def _frames():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sdpgrind.base.sheets.page.svg_of", lambda draw, prefix: f'<svg id="{prefix}"></svg>')
        yield


@pytest.fixture(scope="module")
def sketched():
    """Pictures of pages as empty frames: for files that look at numbers, lines, files and refusals."""
    with _frames():
        yield


@pytest.fixture
def sketch():
    """Pictures of a test's pages as empty frames, in a file that looks at pictures too."""
    with _frames():
        yield


@pytest.fixture
def drawn(sketched, monkeypatch):
    """Pictures of pages as users have them, in a file that is `sketched`."""
    from sdpgrind.base.sheets import svg

    monkeypatch.setattr("sdpgrind.base.sheets.page.svg_of", svg.svg_of)


@contextmanager
def _without_garbage():
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@pytest.fixture(scope="module")
def nothing_collected():
    """Live runs without a collector, instead of a full collection at their beginning.

    Among all tests that takes longer than the run (measured: 0.5 s of 0.7 s); test_series_rules looks at it.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hwsim._live.series._frozen", _without_garbage)
        yield
