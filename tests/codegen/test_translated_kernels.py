"""Every construct of the subset: C against numba, in bits."""

import shutil

import codegen_kernels as kernels
import numpy as np
import pytest

import sdpgrind
from sdpgrind.codegen import Recipe

gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
INPUTS, OUTPUTS = {"x": "", "y": ""}, {f"out{k}": "" for k in range(7)}
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, 2.0, -3.5, 7.0, -7.0, np.nan, np.inf, -np.inf, 1e-310)


def numbers(rng, count):
    """Special numbers among all others."""
    rows = rng.standard_normal((count, 2)) * rng.choice([0.3, 3.0, 30.0], (count, 1))
    special = np.array([(a, b) for a in SPECIAL for b in SPECIAL])
    return [np.concatenate([special, rows])]


def finite(rng, count):
    return [rows[np.isfinite(rows).all(axis=1)] for rows in numbers(rng, count)]


def recipe(kernel, **more):
    whole = kernel in (kernels.whole_numbers, kernels.calls, kernels.views, kernels.loops, kernels.constants)
    return Recipe(
        kernel.py_func.__name__, kernel, INPUTS, OUTPUTS, state=np.zeros(7), missing=() if whole else ("x", "y"),
        ranges={} if whole else dict.fromkeys(INPUTS, (-np.inf, np.inf)), vectors=finite if whole else numbers, spread=(1.0, 1.0), **more,
    )  # fmt: skip


@gcc
@pytest.mark.parametrize("kernel", kernels.ALL, ids=lambda one: one.py_func.__name__)
def test_a_construct(tmp_path, kernel):
    found = sdpgrind.export(recipe(kernel), tmp_path / "thing").check(
        3000, ["gcc"], levels=["-O0", "-O2"], targets=()
    )
    assert found.status == "equal" and found.differing == 0, found.first


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
