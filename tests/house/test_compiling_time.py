"""What keeps compiling short: what numba prepares, types and walks through once."""

import gc

from numba import types
from numba.core.caching import NullCache
from numba.core.cpu import CPUContext
from numba.core.typing.context import Context
from numba.extending import overload

from sdpgrind.base.compiling.compiled import compiled


def test_functions_of_numba_are_prepared_once_for_kernels_of_any_door():
    """Whatever the name of a kernel and its inlining are; another error model has code of its own."""
    asked = []

    def helped(x):
        return x / 2.0

    @overload(helped)
    def _(x):
        asked.append(x)
        return lambda x: x / 2.0

    @compiled
    def _closed(x):
        return helped(x)

    @compiled(inline="always")
    def opened(x):
        return helped(x) + 1.0

    @compiled(error_model="numpy")
    def divided(x):
        return helped(x) + 2.0

    for kernel, count in ((_closed, 1), (opened, 1), (divided, 2)):
        kernel._cache.flush()  # what an earlier run left on disk
        kernel.compile((types.float64,))
        assert len(asked) == count
    assert opened(3.0) == 2.5


def test_a_kernel_types_each_operation_on_numbers_and_asks_for_each_size_once(monkeypatch):
    typed, sized = [], []

    def resolved(context, function, args, named, known=Context.resolve_function_type):
        if len(args) == 2 and all(isinstance(one, types.Number) for one in args):
            typed.append((str(function), args))
        return known(context, function, args, named)

    def size(target, kind, known=CPUContext.get_abi_sizeof):
        sized.append(kind)
        return known(target, kind)

    def sums(x, y):
        a = x + y
        b = a * y
        for _ in range(3):
            c = (a + b) * y + b
            a = b + c
        return a

    monkeypatch.setattr(Context, "resolve_function_type", resolved)
    monkeypatch.setattr(CPUContext, "get_abi_sizeof", size)
    kernel = compiled(sums)
    kernel._cache = NullCache()
    assert kernel(1.0, 2.0) == sums(1.0, 2.0)
    assert len(typed) == len(set(typed)) == 2  # a sum and a product
    assert len(sized) == len(set(sized)) > 0


def test_no_walk_begins_at_what_compiling_made():
    """This kernel makes 1700 objects, others 50 times as many."""
    kernel, walks, before = compiled(lambda x: x + 1), [], gc.get_threshold()
    kernel._cache = NullCache()
    gc.callbacks.append(lambda phase, told: walks.append(told["generation"]))
    try:
        gc.set_threshold(1000)
        gc.collect(0)  # counted anew; of all generations it takes seconds among the objects of all tests
        walks.clear()
        kernel.compile((types.int64,))
        assert walks == [] and gc.get_count()[0] < 1000
    finally:
        gc.set_threshold(*before)
        gc.callbacks.pop()


def test_what_a_user_froze_stays_frozen():
    kernel = compiled(lambda x: x - 1)
    kernel._cache = NullCache()
    gc.freeze()
    try:
        kernel.compile((types.float64,))
        assert gc.get_freeze_count() > 50_000
    finally:
        gc.unfreeze()
