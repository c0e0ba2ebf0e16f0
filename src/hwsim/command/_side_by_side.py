"""Works of several stages side by side: a process that is idle takes the next stage of the longest work left.

Processes are new ones, since none may be forked where threads run. Signals end the parent, which ends them.
"""

import atexit
import gc
import os
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from typing import Any, ClassVar

from sdpgrind.base.progress import Progress

_LOOK = 0.2  # s between two looks at what processes tell; chosen: a line is redrawn each second

Stage = Callable[[str, int, Progress], int]
"""Carries out a stage of a work by name and number, with its progress; returns a count."""


class SideBySide:
    """Works by name, each with the weights of its stages; `stage` must be picklable."""

    def __init__(self, stage: Stage, works: Mapping[str, Sequence[float]], tell: Progress) -> None:
        self._stage, self._works, self._tell = stage, works, tell
        self._told = get_context("spawn").SimpleQueue()
        self._ready = dict.fromkeys(works, 0)  # name -> number of the next stage
        self._under_way: dict[Future[int], tuple[str, int]] = {}
        self._shares: dict[tuple[str, int], float] = {}
        self._counts: Counter[str] = Counter()

    def carried_out(self, processes: int) -> Counter[str]:
        """Carry out all works and return the sum of the counts of each."""
        with _workers(processes, self._told) as pool:
            while self._ready or self._under_way:
                while self._ready and len(self._under_way) < processes:
                    self._begin(pool)
                finished, _ = wait(self._under_way, _LOOK, FIRST_COMPLETED)
                self._hear()
                for future in finished:
                    self._end(future)
        return self._counts

    def _begin(self, pool: ProcessPoolExecutor) -> None:
        name = max(self._ready, key=lambda name: sum(self._works[name][self._ready[name] :]))
        number = self._ready.pop(name)
        self._under_way[pool.submit(_carry_out, self._stage, name, number)] = name, number

    def _hear(self) -> None:
        while not self._told.empty():
            name, number, share, text = self._told.get()
            self._shares[name, number] = share
            self._tell(self._share(), text)

    def _end(self, future: Future[int]) -> None:
        name, number = self._under_way.pop(future)
        self._counts[name] += future.result()
        self._shares[name, number] = 1.0
        if number + 1 < len(self._works[name]):
            self._ready[name] = number + 1

    def _share(self) -> float:
        """Return the share of all works that is done."""
        done = sum(self._works[name][number] * share for (name, number), share in self._shares.items())
        return done / sum(map(sum, self._works.values()))


@contextmanager
def _workers(processes: int, told: Any) -> Iterator[ProcessPoolExecutor]:
    """Return processes that end with the block, at once if it is interrupted."""
    known, others = (told, gc.get_threshold()), set(active_children())
    with ProcessPoolExecutor(processes, get_context("spawn"), _start, known) as pool:
        try:
            yield pool
        except BaseException:
            for process in set(active_children()) - others:
                process.terminate()
            raise


class _Teller:
    """What a process tells its parent through."""

    queue: ClassVar[Any]


def _start(told: Any, seldom: tuple[int, int, int]) -> None:
    """Make a process one that the parent ends, also by its own end, and that collects garbage as it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    gc.set_threshold(*seldom)
    atexit.register(gc.freeze)  # else collectors walk through all that was compiled: 1.2 of 20 s (measured)
    _Teller.queue = told


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _carry_out(stage: Stage, name: str, number: int) -> int:
    return stage(name, number, lambda share, text: _Teller.queue.put((name, number, share, text)))
