"""Work on an executor, divided by the problem and not by the number of workers: results are bit-equal."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

from sdpgrind.base import checks

Item = TypeVar("Item")
Result = TypeVar("Result")


def execute(
    function: Callable[[Item], Result], items: Iterable[Item], executor: Executor | None = None
) -> list[Result]:
    """Return ``[function(item) for item in items]``, computed on `executor`; None: in this process.

    For executors of processes `function` must be picklable. Any `concurrent.futures.Executor` does: threads,
    processes, ``dask.distributed``'s ``Client.get_executor()``, MPI.
    """
    if executor is None:
        return [function(item) for item in items]
    checks.able("executor", executor, "None or a concurrent.futures.Executor", "submit")
    futures = [executor.submit(function, item) for item in items]
    try:
        return [future.result() for future in futures]
    finally:
        for future in futures:
            future.cancel()


def in_order(
    function: Callable[[Item], Result], items: Iterable[Item], executor: Executor | None, ahead: int
) -> Iterator[Result]:
    """Give ``function(item)`` of each item in order, each as soon as it is known; `ahead` are under way.

    None: in this process.
    """
    if executor is None:
        yield from map(function, items)
        return
    under_way: deque[Future[Result]] = deque()
    try:
        for item in items:
            under_way.append(executor.submit(function, item))
            if len(under_way) == ahead:
                yield under_way.popleft().result()
        while under_way:
            yield under_way.popleft().result()
    finally:
        for future in under_way:
            future.cancel()


@lru_cache(maxsize=1)
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def one_blas_thread() -> AbstractContextManager[Any]:
    """Return a context in which BLAS uses one thread.

    For many small matrix products a second thread gains little on an idle machine, costs tenfold on a busy
    one, and changes the order of sums.
    """
    limit: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return limit
