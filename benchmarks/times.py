"""Times that the first line of every command foretells, measured: CPU seconds of processes of one thread.

``python benchmarks/times.py [COMMAND]``: each command of the table, or one, on its example file: from an empty
cache, warm, with more parts, and once more on a finished folder. Ends with 1 where a time is off by a factor 2.
"""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from hwsim.command._times import TIMES, Times

FACTOR, SMALL = 2.0, 2.0  # a time (s) may be off by the factor or by so many seconds
PARTS = {"weldbead": 4, "finishing": 3}  # parts of the longer run, else 10
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "MPLBACKEND": "Agg",
}


def cpu(command: str, cache: str, *options: object) -> float:
    """CPU time of one command, s."""
    name, *switches = command.split()
    line = [sys.executable, "-m", "hwsim", name, f"examples/{name}.toml", *switches, *map(str, options)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    env = os.environ | ONE_THREAD | {"NUMBA_CACHE_DIR": cache}
    subprocess.run(line, env=env, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measured(command: str) -> Times:
    """Times of one command."""
    parts = PARTS.get(command, 10)
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as folder:
        if "--study" in command or "--source" in command:
            cold, warm = (cpu(command, cache) for _ in range(2))
            return TIMES[command]._replace(plan=warm, part=0.0, rest=0.0, compiling=cold - warm)
        out = Path(folder)
        cold = cpu(command, cache, "--parts", 1, "--out", out / "cold")
        one = cpu(command, cache, "--parts", 1, "--out", out / "one")
        again = cpu(command, cache, "--parts", 1, "--out", out / "one")
        more = cpu(command, cache, "--parts", parts, "--out", out / "more")
    part = max(0.0, (more - one) / (parts - 1))
    return TIMES[command]._replace(
        plan=max(0.0, one - again - part), part=part, rest=again, compiling=cold - one
    )


def main(commands: list[str]) -> int:
    """Print measured and foretold times."""
    wrong = 0
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
