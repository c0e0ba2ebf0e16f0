"""Work on an executor, divided by the problem and not by the number of workers: results are bit-equal."""

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
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
