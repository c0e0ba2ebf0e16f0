"""How time and memory are measured."""

import time
import tracemalloc
from collections.abc import Callable

import numpy as np


def median(run: Callable[[], object], times: int) -> float:
    """Median wall time of `run`, s, after one warm-up."""
    run()
    found = []
    for _ in range(times):
        begin = time.perf_counter()
        run()
        found.append(time.perf_counter() - begin)
    return float(np.median(found))


def peak_memory(run: Callable[[], object]) -> float:
    """Peak of the memory (MB) that a second call of `run` allocates."""
    run()
    tracemalloc.start()
    run()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 2**20
