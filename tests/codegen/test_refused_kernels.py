"""What is outside the subset is refused, with file, line, construct and remedy, and nothing is written."""

import re

import numpy as np
import pytest

import sdpgrind
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, RefusedKernelError


@compiled
def divides(state, x, out):
    out[0] = 1.0 / x
    return 0


@compiled(error_model="numpy")
def raises(state, x, out):
    if x > 1.0:
        raise ValueError
    return 0


@compiled(error_model="numpy")
def unbounded(state, x, out):
    while x > 1.0:
        x *= 0.5
    out[0] = x
    return 0


@compiled(error_model="numpy")
def sized(state, x, out):
    work = np.empty(int(x))
    out[0] = work.size
    return 0


@compiled(error_model="numpy")
def listed(state, x, out):
    out[0] = [x, 1.0][0]
    return 0


@compiled(error_model="numpy")
def whole_array(state, x, out):
    out[0] = (state * x)[0]
    return 0


@compiled(error_model="numpy")
def rooted(state, x, out):
    out[0] = x**0.5
    return 0


@compiled(error_model="numpy")
def inverse(state, x, out):
    out[0] = x**-2
    return 0


@compiled(error_model="numpy")
def computed_power(state, x, out):
    out[0] = x ** int(state[0])
    return 0


@compiled(error_model="numpy", fastmath=True)
def fast(state, x, out):
    out[0] = x
    return 0


@compiled(error_model="numpy")
def summed(state, x, out):
    out[0] = np.sum(state)
    return 0


@compiled(error_model="numpy")
def member(state, x, out):
    out[0] = 1.0 if 2 in (1, 2) else 0.0
    return 0


@compiled(error_model="numpy")
def behind(state, x, out):
    out[0] = state[3]
    return 0


@compiled(error_model="numpy")
def before(state, x, out):
    state[-4] = x
    return 0


HALVES = np.array([0.5, 0.25], dtype=np.float32)


@compiled(error_model="numpy")
def four_bytes(state, x, out):
    out[0] = x + HALVES[0] * HALVES[1]
    return 0


CASES = {
    divides: "a division under the default error model is not translated; decorate divides with error_model='numpy'",
    raises: "raise is not translated; return a status",
    unbounded: "while without a bound is not translated; add a comment behind it: # at most <expression>",
    sized: "an array of a size that is no constant is not translated; state it as a constant",
    listed: "a list is not translated; use np.empty with a constant size, or a tuple",
    whole_array: "arithmetic of whole arrays or tuples is not translated; write the loop",
    rooted: "**0.5 is not translated; write x*x, 1/x, np.sqrt(x): pow has other bits",
    inverse: "a whole power that is computed, or negative, is not translated; divide by the power",
    computed_power: "a whole power that is computed, or negative, is not translated; divide by the power",
    fast: "fastmath is not translated; leave it out",
    summed: "the function sum is not translated; use one of: sqrt",
    four_bytes: "arithmetic of four-byte floats is not translated; write np.float64(...)",
    behind: "the index 3 of 3 elements is not translated; stay within them",
    before: "the index -4 of 3 elements is not translated; stay within them",
    member: "in is not translated; use comparisons",
}


def recipe(kernel, **more):
    return Recipe("thing", kernel, {"x": "mm"}, {"y": "mm"}, state=np.zeros(3), **more)


@pytest.mark.parametrize("kernel", CASES, ids=lambda one: one.py_func.__name__)
def test_refused(tmp_path, kernel):
    with pytest.raises((RefusedKernelError, ValueError), match=re.escape(CASES[kernel])) as told:
        sdpgrind.export(recipe(kernel), tmp_path / "thing")
    assert re.match(r"test_refused_kernels\.py, line \d+: ", str(told.value))
    assert not (tmp_path / "thing").exists() and not list(tmp_path.iterdir())
