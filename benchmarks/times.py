"""Times that the first line of every command foretells, measured: CPU seconds of processes of one thread.

``python benchmarks/times.py [COMMAND]``: each command of the table, or one, on its example file: from an empty
cache, warm, with more parts, and once more on a finished folder; and the number of kernels that `warm` compiles.
Ends with 1 where one is off by a factor 2.
"""

import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from hwsim.command import _warm
from hwsim.command._times import TIMES, Times
from sdpgrind.base.compiling import warm

FACTOR, SMALL = 2.0, 2.0  # a time (s) may be off by the factor or by so many seconds
RING = "tests/data/samples/ring_degrees.csv --angle angle --deviation deviation --radius 40"
JOBS = {"demo": [], "roundness": RING.split()}  # else an example file
WHOLE = {  # no parts: all in one
    "demo": "rest", "roundness": "rest", "export": "rest", "export --lost-max": "rest", "finishing --study": "plan", "centering --source": "plan",
}  # fmt: skip
PARTS = {"weldbead": 4, "finishing": 3}  # parts of the longer run, else 10
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "MPLBACKEND": "Agg",
}


LOST = "1e-3"  # $, chosen: int16 loses less


def exported(command: str, folder: Path, cache: str) -> tuple[float, float]:
    """CPU times of an export of the policy of the example, cold and later, s."""
    plan = folder / "plan"
    said(
        cache,
        "-m",
        "hwsim",
        "weldbead",
        "examples/weldbead.toml",
        "--parts",
        1,
        "--no-pictures",
        "--out",
        plan,
    )
    more = ["--lost-max", LOST] if "--lost-max" in command else []
    with tempfile.TemporaryDirectory() as empty:
        line = ["export", plan / "policy.nc"]
        cold, later = (spent(empty, *line, folder / name, *more) for name in ("cold", "later"))
    return cold, later


def cpu(command: str, cache: str, *options: object) -> float:
    """CPU time of one command, s."""
    name, *switches = command.split()
    job = JOBS.get(name, [f"examples/{name}.toml"])
    return spent(cache, name, *job, *switches, *options)


def spent(cache: str, *options: object) -> float:
    """CPU time of a command line, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    said(cache, "-m", "hwsim", *options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def said(cache: str, *options: object) -> str:
    """Run Python with a cache of kernels, and return its standard output."""
    env = os.environ | ONE_THREAD | {"NUMBA_CACHE_DIR": cache}
    line = [sys.executable, *map(str, options)]
    return subprocess.run(line, env=env, check=True, capture_output=True, text=True).stdout


def measured(command: str) -> Times:
    """Times of one command."""
    parts = PARTS.get(command, 10)
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        if command in WHOLE:
            kept = "--report" if command == "roundness" else "--out"
            if command.startswith("export"):
                cold, later = exported(command, out, cache)
            else:
                cold, later = (cpu(command, cache, kept, out / name) for name in ("cold", "later"))
            none = TIMES[command]._replace(plan=0.0, part=0.0, rest=0.0, compiling=cold - later)
            return none._replace(**{WHOLE[command]: later})
        cold = cpu(command, cache, "--parts", 1, "--out", out / "cold")
        one = cpu(command, cache, "--parts", 1, "--out", out / "one")
        again = cpu(command, cache, "--parts", 1, "--out", out / "one")
        more = cpu(command, cache, "--parts", parts, "--out", out / "more")
    part = max(0.0, (more - one) / (parts - 1))
    return TIMES[command]._replace(
        plan=max(0.0, one - again - part), part=part, rest=again, compiling=cold - one
    )


def kernels(area: str) -> tuple[int, int]:
    """Return the number of kernels of the first use of an area, and of one simulated part after it."""
    with tempfile.TemporaryDirectory() as cache:
        first = said(cache, "-c", f"import sdpgrind; print(sdpgrind.warm({area!r})[{area!r}])")
        part = re.search(r"compiled (\d+) kernels", said(cache, "-m", "hwsim", "warm", area))
    return int(first), int(part[1]) if part else 0


def main(commands: list[str]) -> int:
    """Print measured and foretold times and numbers."""
    wrong = 0
    for area in warm.HOMES.keys() & commands:
        for own, foretold in zip(kernels(area), (warm.KERNELS[area], _warm.KERNELS[area]), strict=True):
            near = abs(own - foretold) <= SMALL or 1 / FACTOR <= own / foretold <= FACTOR
            wrong += not near
            print(f"{area:20s} kernels    {own:8d}  , foretold {foretold:8d}  {'' if near else '  OFF'}")
    for command in commands:
        found, told = measured(command), TIMES[command]
        for name in ("plan", "part", "rest", "compiling"):
            own, foretold = getattr(found, name), getattr(told, name)
            several = 20 if name == "part" else 1
            near = abs(own - foretold) * several <= SMALL or 1 / FACTOR <= own / max(foretold, 1e-9) <= FACTOR
            wrong += not near
            print(
                f"{command:20s} {name:10s} {own:8.2f} s, foretold {foretold:8.2f} s{'' if near else '  OFF'}",
                flush=True,
            )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or list(TIMES)))
