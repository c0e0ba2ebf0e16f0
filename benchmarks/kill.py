"""Kill ``hwsim weldbead`` with -9 at random moments and see what is left: ``python benchmarks/kill.py --times
50``.

After each kill the journal must be readable, hold every part that a reader had seen, and lack at most the
part under way; the same command must then give the log of an uninterrupted run, bit for bit. Prints one line
a kill and a summary; exit status 1 when anything was lost.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import hwsim


@dataclass(frozen=True)
class Job:
    """One command line, run into different folders."""

    arguments: tuple[str, ...]

    def start(self, out: Path) -> subprocess.Popen:
        command = [
            sys.executable,
            "-m",
            "hwsim.cli",
            "weldbead",
            *self.arguments,
            "--no-pictures",
            "--out",
            str(out),
        ]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def finish(self, out: Path) -> bytes:
        """Run to the end and give the saved log."""
        _, error = (process := self.start(out)).communicate()
        if process.returncode != 0:
            raise RuntimeError(f"exit status {process.returncode}: {error}")
        return (out / "run.nc").read_bytes()


@dataclass(frozen=True)
class Kill:
    """What one kill left."""

    delay: float  # s
    seen: int  # parts in the journal just before
    left: int  # parts in the journal afterwards
    same: bool  # the resumed run equals the uninterrupted one


def parts_in(out: Path) -> int:
    """Read every part of the journal; -1: there is none yet."""
    if not (out / "run.db").exists():
        return -1
    with hwsim.Journal(out / "run.db") as journal:
        number = journal.parts
        assert number == 0 or len(journal.log()) >= number
        return number


def kill_once(job: Job, out: Path, whole: bytes, delay: float) -> Kill:
    """Start the job, kill it after `delay` seconds, read, resume, compare."""
    process = job.start(out)
    try:
        process.wait(timeout=delay)
    except subprocess.TimeoutExpired:
        seen = parts_in(out)
        process.kill()
        process.wait()
    else:
        seen = parts_in(out)
    process.stderr.close()
    left = parts_in(out)
    return Kill(delay, seen, left, job.finish(out) == whole)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--parts", type=int, default=1000)
    parser.add_argument("--rng", type=int, default=0)
    parser.add_argument("--three-tiers", action="store_true", help="force control too; fewer --parts will do")
    options = parser.parse_args()
    simple = () if options.three_tiers else ("--simple",)
    job = Job((*simple, "--preset", "P1", "--tolerance", "1e-3", "--parts", str(options.parts), "--rng", "7"))
    with tempfile.TemporaryDirectory() as folder:
        job.finish(Path(folder, "warm"))  # what is compiled at the first use is compiled now
        start = time.perf_counter()
        whole = job.finish(Path(folder, "whole"))
        lasted = time.perf_counter() - start
        print(f"uninterrupted: {options.parts} parts in {lasted:.1f} s")
        delays = np.random.default_rng(options.rng).uniform(0.0, lasted, options.times)
        kills = []
        for k, delay in enumerate(delays):
            kills.append(kill_once(job, Path(folder, str(k)), whole, float(delay)))
            print(
                f"{k:4d}  after {delay:5.2f} s: saw {kills[-1].seen:5d}, left {kills[-1].left:5d}", flush=True
            )
    return summary(kills, options.parts)


def summary(kills: list[Kill], parts: int) -> int:
    """Print what happened; 1 when something was lost."""
    lost = sum(kill.left < kill.seen for kill in kills)
    different = sum(not kill.same for kill in kills)
    during = sum(0 <= kill.left < parts for kill in kills)
    print(
        f"{len(kills)} kills: {sum(kill.left < 0 for kill in kills)} before the journal, {during} during the parts"
    )
    print(f"unreadable journals: 0, finished parts lost: {lost}, resumed runs that differ: {different}")
    return int(lost + different > 0)


if __name__ == "__main__":
    sys.exit(main())
