"""kill -9 at random moments: the journal is readable, lacks at most the part under way, and the run resumes
equal.
"""

import importlib.util
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hwsim_fakes import Drain, noisy_tank
from hwsim_forked import Command
from hwsim_inside import same

import hwsim
from hwsim.cli import main
from sdpgrind import weldbead

_SPEC = importlib.util.spec_from_file_location("kill", Path(__file__).parents[2] / "benchmarks" / "kill.py")
kill = importlib.util.module_from_spec(_SPEC)
sys.modules["kill"] = kill
_SPEC.loader.exec_module(kill)

# Announces each part after it was written, as a terminal would see it.
ANNOUNCED = """
import sys, hwsim
sys.path.insert(0, sys.argv[1])
from hwsim_fakes import Drain, noisy_tank
hwsim.run(noisy_tank(), Drain(), parts=2000, rng=5, journal=sys.argv[2],
          progress=lambda share, text: print(text, flush=True))
"""


@pytest.mark.parametrize("announced", [1, 20])
def test_every_announced_part_is_there_and_at_most_one_more(tmp_path, announced):
    path = tmp_path / "run.db"
    command = [sys.executable, "-c", ANNOUNCED, Path(__file__).parent, path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        for _ in range(announced):
            process.stdout.readline()
        process.send_signal(signal.SIGKILL)
        heard = announced + len([line for line in process.stdout if line.endswith("\n")])
    with hwsim.Journal(path) as journal:
        assert heard <= journal.parts <= heard + 1

        assert same(journal.log(), hwsim.run(noisy_tank(), Drain(), parts=journal.parts, rng=5))


class Here(kill.Job):
    """Is killed in a process, and resumes in this one, that have imported everything already."""

    def start(self, out):
        process = Command("weldbead", *self.arguments, "--no-pictures", "--out", out)
        process.stdout.close()
        return process

    def finish(self, out):
        assert main(["weldbead", *self.arguments, "--no-pictures", "--out", str(out)]) == 0
        return (out / "run.nc").read_bytes()


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    """File of a policy for both jobs."""
    path = tmp_path_factory.mktemp("policy") / "p1.nc"
    weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=101).save(path)
    return path


JOBS = {"one draw": "--parts 50 --simple", "three tiers": "--parts 2"}


def job_of(name, policy):
    return Here(("--policy", str(policy), *JOBS[name].split(), "--rng", "3"))


@pytest.fixture(scope="module")
def uninterrupted(policy, tmp_path_factory):
    """Log of beads of one draw in a process that nobody kills, and how long that lasts: as long as three tiers."""
    Command("--version").communicate()  # the process to fork from has imported everything
    start = time.perf_counter()
    whole = kill.Job.finish(job_of("one draw", policy), tmp_path_factory.mktemp("kill") / "whole")
    return whole, time.perf_counter() - start


@pytest.fixture(scope="module", params=JOBS)
def job(request, policy, uninterrupted, tmp_path_factory):
    """A job whose policy is planned already, its uninterrupted log, and how long it lasts."""
    job, (whole, lasts) = job_of(request.param, policy), uninterrupted
    if request.param != "one draw":
        whole = job.finish(tmp_path_factory.mktemp("kill") / "whole")
    return job, whole, lasts


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_command_line_killed_at_a_random_moment(tmp_path, job, seed):
    line, whole, lasts = job
    delay = float(np.random.default_rng(seed).uniform(0.0, lasts))
    left = kill.kill_once(line, tmp_path / "out", whole, delay)
    assert left.same and left.left >= left.seen
