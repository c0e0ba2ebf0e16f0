"""Kernels that only borrow arrays have no counts of references; others keep them, and none loses or leaks one."""

import sys
from typing import NamedTuple

import numpy as np
import pytest

from sdpgrind.base.compiling.compiled import compiled

TABLE = np.array([1.0, 10.0])


class Pair(NamedTuple):
    """Two arrays and a number."""

    first: np.ndarray
    second: np.ndarray
    factor: float


@compiled
def entry(array, k):
    """Take only arrays and give a number."""
    return array[k]


@compiled
def view(array):
    """Give a view."""
    return array[1:]


def by_slices(a, b, out):
    for k in range(len(out)):
        out[k] = entry(a[k:], 0) + entry(b[:, k], 1)
    return out[0]


def by_tuples(a, b, out):
    pair = Pair(a, out, 2.0)
    first, second, factor = pair
    for k in range(pair.first.size):
        second[k] = factor * entry(first, k) + TABLE[k % 2] + b[0, k]
    return out[1]


def by_choice(a, b, out):
    chosen = a if a[0] > 0.0 else b[0]
    out[:] = 3.0
    out[1] = max(chosen[1], min(a[0], a[1]))
    return np.sqrt(chosen[2])


def refused(a, b, out):
    if a[0] < -1e9:
        raise ValueError("a is too small")
    return a.size + b.shape[1]


def makes(a, b, out):
    room = np.empty(a.size)
    for k in range(a.size):
        room[k] = entry(a, k)
    return room[2]


def copies(a, b, out):
    return a.copy()[1] + b.T[0, 0]


def adds(a, b, out):
    return (a + b[0])[1]


def selects(a, b, out):
    return a[a > 1.5][0] + b[:, np.array([0, 2])][1, 1]


def sums(a, b, out):
    return a.sum() + np.dot(a, b[1])


def assigns(a, b, out):
    out[1:] = out[:-1]
    out[0] = a[0]
    return out[2]


def iterates(a, b, out):
    total = 0.0
    for value in a:
        total += value
    for row in b:
        total += row[0]
    return total


def calls_view(a, b, out):
    return view(view(a))[0]


def gives(a, b, out):
    return b[1]


def given_tuple(a, b, out):
    return a[1:], a[0]


BORROWS = (by_slices, by_tuples, by_choice, refused)
COUNTS = (makes, copies, adds, selects, sums, assigns, iterates, calls_view, gives, given_tuple)


def arrays():
    """Arguments of the functions."""
    return np.array([1.0, 2.0, 4.0]), np.arange(6.0).reshape(2, 3), np.array([7.0, 8.0, 9.0])


def flat(*values):
    """All numbers in results and arrays."""
    return np.concatenate([np.ravel(np.hstack(v) if isinstance(v, tuple) else v) for v in values])


@pytest.mark.parametrize("function", [*BORROWS, *COUNTS])
def test_kernel_does_what_python_does_and_keeps_the_references(function):
    kernel, given, expected = compiled(function), arrays(), arrays()
    kernel._cache.disable()  # code from the disk has no text
    assert flat(kernel(*given), *given).tolist() == flat(function(*expected), *expected).tolist()
    before = [sys.getrefcount(array) for array in given]
    for _ in range(100):
        kernel(*given)
    assert [sys.getrefcount(array) for array in given] == before
    (code,) = kernel.inspect_llvm().values()
    assert ("NRT_" in code) == (function in COUNTS)  # all of numba's counts and room


def test_results_outlive_their_arguments():
    kernel = compiled(gives)
    rows = [kernel(*arrays()) for _ in range(1000)]
    assert all(row.tolist() == [3.0, 4.0, 5.0] for row in rows)


@compiled
def each(array):
    """Give the numbers of an array one by one, after the call has returned."""
    for k in range(array.size):
        yield array[k]


def test_a_generator_keeps_its_array():
    found = [each(np.full(1000, float(k))) for k in range(20)]
    others = [np.full(1000, -7.0) for _ in range(20)]  # where freed arrays would have been
    assert [sum(values) for values in found] == [1000.0 * k for k in range(20)] and len(others) == 20
