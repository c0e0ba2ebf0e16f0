"""kill -9 at random moments: the journal is readable, lacks at most the part under way, and the run resumes equal."""

import importlib.util
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import hwsim

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


@pytest.mark.parametrize("announced", [1, 17, 60])
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
        from hwsim_fakes import Drain, noisy_tank

        from hwsim._log import same

        assert same(journal.log(), hwsim.run(noisy_tank(), Drain(), parts=journal.parts, rng=5))
