"""Every construct of the subset: C against numba, in bits."""

import shutil
import subprocess

import codegen_kernels as kernels
import numpy as np
import pytest
from codegen_inside import compilers, identical

import sdpgrind
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal

pytestmark = pytest.mark.usefixtures("few_blocks")
gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
OUTPUTS = {f"out{k}": "" for k in range(7)}
WHOLE = (
    kernels.whole_numbers, kernels.calls, kernels.views, kernels.seldom, kernels.loops, kernels.constants,
)  # fmt: skip
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, 2.0, -3.5, 7.0, -7.0, np.nan, np.inf, -np.inf, 1e-310)


def numbers(rng, count):
    """Special numbers among all others."""
    rows = rng.standard_normal((count, 2)) * rng.choice([0.3, 3.0, 30.0], (count, 1))
    special = np.array([(a, b) for a in SPECIAL for b in SPECIAL])
    return [np.concatenate([special, rows])]


def finite(rng, count):
    return [rows[np.isfinite(rows).all(axis=1)] for rows in numbers(rng, count)]


def recipe(kernel, **more):
    whole = kernel in WHOLE
    inputs = dict.fromkeys("xy", Signal() if whole else Signal(low=-np.inf, high=np.inf, missing=True))
    vectors = finite if whole else numbers
    return Recipe(
        kernel.py_func.__name__, kernel, inputs, OUTPUTS, state=np.zeros(7), vectors=vectors, **more
    )


@gcc
@pytest.mark.parametrize("kernel", kernels.ALL, ids=lambda one: one.py_func.__name__)
def test_a_construct(tmp_path, kernel):
    found = sdpgrind.export(recipe(kernel), tmp_path / "thing").check(
        3000, ["gcc"], levels=["-O0", "-O2"], targets=()
    )
    assert found.status == "equal" and found.differing == 0, found.first


@compiled
def _nth(x, k):
    return x[k]


@compiled
def narrow(state, which, x, out):
    out[0] = _nth(state, 1) + _nth(state, which[0])
    return 0


def test_no_kernel_is_compiled_for_its_translation(tmp_path):
    """In C whole numbers are wider than the literal and the number of 8 bits that the library hands over."""
    for one in (_nth, narrow):
        one._cache.disable()
    thing = Recipe("c", narrow, {"x": ""}, {"y": ""}, law=(np.array([2], np.int8),), state=np.zeros(3))
    sdpgrind.export(thing, tmp_path / "thing")
    assert len(_nth.overloads) == 2


@gcc
@pytest.mark.parametrize("level", ["-O1 -march=native -std=gnu99", "-O2"])
def test_a_reset_state_that_begins_by_two_nan(tmp_path, level):
    """By 32 bytes of a constant: gcc 12 with AVX-512 makes four NaN of it."""
    state = np.array([np.nan, np.nan, 0.0, 0.0] * 3)
    thing = Recipe("c", kernels.counted_on, {"x": ""}, {"open": "", "sum": ""}, state=state)
    made = sdpgrind.export(thing, tmp_path / "thing")
    found = made.check(300, ["gcc"], levels=[level], targets=())
    assert found.differing == 0, found.first


@gcc
def test_constants_of_a_law(tmp_path):
    law = (
        kernels.Table(np.array([0.5, np.nan, -2.25]), 1.5),
        kernels.Pair(3.0, 0.125),
        np.array([1, -7, 30000], dtype=np.int16),
        np.array([0.1, np.nan, -np.inf], dtype=np.float32),
    )
    made = sdpgrind.export(recipe(kernels.constants, law=law), tmp_path / "thing")
    found = made.check(3000, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first


@gcc
@pytest.mark.parametrize("on", [True, False])
@pytest.mark.parametrize("lag", [0.0, 0.25])
def test_branches_that_a_law_decides(tmp_path, on, lag):
    """They are left out, with the bits of the library; what is in the C no more, its helpers neither."""
    law = (kernels.Rule(1.5, 0.3, on), lag, np.full(3, -7, dtype=np.int16))
    made = sdpgrind.export(recipe(kernels.known, law=law), tmp_path / "thing")
    found = made.check(3000, ["gcc"], levels=["-O0", "-O2"], targets=())
    assert found.differing == 0, found.first
    for compiler in compilers.found(("gcc", "clang"))[0]:
        command = [
            compiler,
            "-std=c99",
            "-O2",
            *compilers.STRICT,
            "-c",
            "thing.c",
            "-o",
            tmp_path / "thing.o",
        ]
        subprocess.run(command, cwd=made.path, check=True)
    text = (made.path / "thing.c").read_text()
    assert ("exp(" in text) == (on and lag > 0.0) == bool(made.manifest["libm"])
    translated = text.partition("/* Public functions")[0]  # a reset copies by a loop
    assert "thing_allowed" not in text and "1.5 /* limit */ >" not in text and "for (" not in translated
    assert ("if (x > 1e+300) { /* guard */" in text) == on


def test_what_differs_in_a_sign_is_no_constant():
    """0.0 and -0.0, 1 and 1.0 and True are not the same number."""
    pairs = [(0.0, -0.0), (1, 1.0), (1, True), (np.nan, np.nan), (None, 0)]
    assert not any(identical(one, other) for one, other in pairs)
    assert identical(-0.0, -0.0) and identical(None, None) and identical(2, 2)
