"""How time and memory are measured, and told beside a bar.

Wall time; with ``BENCH_CLOCK=cpu`` CPU time of the process, whose ratios hold still on a shared
machine.
"""

import os
import time
import tracemalloc
from collections.abc import Callable

import numpy as np

clock = time.process_time if os.environ.get("BENCH_CLOCK") == "cpu" else time.perf_counter
"""What is read before and after a run, s."""


def median(run: Callable[[], object], times: int) -> float:
    """Median time of `run`, s, after one warm-up."""
    run()
    found = []
    for _ in range(times):
        begin = clock()
        run()
        found.append(clock() - begin)
    return float(np.median(found))


def peak_memory(run: Callable[[], object]) -> float:
    """Peak of the memory (MB) that a second call of `run` allocates."""
    run()
    tracemalloc.start()
    run()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 2**20


def in_turn(runs: dict[str, Callable[[], object]], times: int) -> dict[str, float]:
    """Median of each, s, taken in turns after one warm-up."""
    for run in runs.values():
        run()
    found: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(times):
        for name, run in runs.items():
            begin = clock()
            run()
            found[name].append(clock() - begin)
    return {name: float(np.median(each)) for name, each in found.items()}
