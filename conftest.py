"""For every test: one thread of linear algebra, as in the library's own work, since two wait for each other.

A run of the whole suite compiles the areas' kernels before workers start, since two workers at work in one
area would compile the same. Bytecode is kept even where PYTHONDONTWRITEBYTECODE is set, as kernels are: each
worker and each program that a test starts would compile all modules anew (measured: 15 s a worker). No
example of a property has a deadline: the first one may compile.

Garbage is collected more seldom than by default: collectors walk through all that was imported (measured: 3.7
of 62 s of CPU time over reports, dynamic programs and pages, 1.2 s now).

Memory that is freed stays with the process: the system gives it back page by page, at some 6 us each
(measured: 5.4 of 155 s of CPU time over dynamic programs, weld beads and reports, 3.7 s now).

Workers tell less: nobody reads their own terminal, and of a set-up or a teardown that passed the run needs no
report (measured: 7 of 26 s of CPU time with 15 000 empty tests).
"""

import gc
import os
import subprocess
import sys

import pytest
from _pytest.runner import runtestprotocol
from hypothesis import settings
from hypothesis.internal import entropy

settings.register_profile("sdpgrind", deadline=None)
settings.load_profile("sdpgrind")
# Nothing draws from numpy's global state; putting it back takes 0.1 ms of CPU at each example (measured).
entropy.NP_RANDOM = object()

gc.set_threshold(50_000, 20, 50)  # chosen: figures that are closed do not pile up
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before numpy is loaded; programs that tests start inherit it
# bytes; read by glibc where a process starts, so by workers and programs. Chosen: more than tests take
for name, size in (("TRIM_THRESHOLD", 2**32), ("MMAP_THRESHOLD", 2**25), ("TOP_PAD", 2**26)):
    os.environ.setdefault(f"MALLOC_{name}_", str(size))


class Brief:
    """Part of a worker: its tests' calls are reported, and of all else what did not pass."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        """Run a test as pytest does, with fewer reports."""
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in runtestprotocol(item, log=False, nextitem=nextitem):
            if report.when == "call" or not report.passed:
                item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    """Compile where workers are about to start on the whole suite; let workers be brief."""
    if hasattr(config, "workerinput"):
        config.pluginmanager.unregister(name="terminalreporter")
        config.pluginmanager.register(Brief())
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    starting = not config.option.collectonly and getattr(config.option, "numprocesses", None)
    if whole and starting and subprocess.run([sys.executable, "-m", "hwsim", "warm"], check=False).returncode:
        raise pytest.UsageError("the kernels of an area cannot be compiled")


def pytest_sessionfinish():
    """Collect garbage once: pytest does so ten times then, each through all that was imported (0.4 s)."""
    gc.collect()
    gc.freeze()
