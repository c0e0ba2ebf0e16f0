"""Compiled recursion: each kernel against dense linear algebra, and what many rows of poor excitation do to
both forms.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from sdpgrind.identify import kernels

FORGETTING = 0.98
ROWS = 1_000_000


def drawn(seed, size, rhs=1, count=12):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, size)), rng.normal(size=(count, rhs))


def rotated(rows, targets):
    array, left = np.zeros((rows.shape[1], rows.shape[1] + targets.shape[1])), np.zeros(targets.shape[1])
    for row in np.hstack([rows, targets]):
        kernels.rotate(array, row)
        left += row[rows.shape[1] :] ** 2
    return array, left


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.integers(1, 5), rhs=st.integers(1, 4))
def test_triangle_is_that_of_all_rows(seed, size, rhs):
    rows, targets = drawn(seed, size, rhs)
    array, left = rotated(rows, targets)
    value, square, *_ = np.linalg.lstsq(rows, targets)
    information = rows.T @ rows
    triangle = np.triu(array[:, :size])
    np.testing.assert_allclose(triangle, array[:, :size])
    np.testing.assert_allclose(triangle.T @ triangle, information, atol=1e-12)
    np.testing.assert_allclose(left, square, rtol=1e-10)

    out, inverse, work = np.empty(size), np.empty((size, size)), np.empty(size)
    kernels.solve(array, out)
    kernels.inverse(array, inverse)
    scale = np.linalg.cond(information) * 1e-13
    np.testing.assert_allclose(out, value[:, 0], rtol=0, atol=scale * max(1, np.abs(value).max()))
    np.testing.assert_allclose(
        inverse, np.linalg.inv(information), rtol=0, atol=scale * np.abs(inverse).max()
    )
    again = np.append(targets[0], rows[0])[-size:]
    assert kernels.spread(array, again, work) == pytest.approx(again @ inverse @ again, rel=1e-8)


def test_too_few_rows_are_said_to_be():
    array, _ = rotated(*drawn(0, 3, count=2))
    out, work = np.empty((3, 3)), np.empty(3)
    assert kernels.spread(array, np.array([0.3, 0.2, 1.0]), work) == np.inf
    kernels.inverse(array, out)
    np.testing.assert_array_equal(out, np.diag(np.full(3, np.inf)))
    value = np.empty(3)
    kernels.solve(array, value)
    assert value[2] == 0
    assert np.all(np.isfinite(value))


def test_rows_of_nothing_leave_the_triangle():
    array, _ = rotated(*drawn(0, 3))
    kept = array.copy()
    kernels.rotate(array, np.array([0.0, 0.0, 0.0, 2.0]))
    np.testing.assert_array_equal(array, kept)
    kernels.rotate(np.zeros((2, 3)), np.full(3, 1e-200))  # its square is 0: neither NaN nor an error


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.integers(1, 5), forgetting=st.floats(0.5, 1.0))
def test_covariance_step_is_the_formula(seed, size, forgetting):
    rows, targets = drawn(seed, size)
    value, inv_info, gain = np.ones(size), 4.0 * np.eye(size), np.empty(size)
    b, p = value.copy(), inv_info.copy()
    for row, (target,) in zip(rows, targets, strict=True):
        kernels.covariance_step(value, inv_info, row, target, forgetting, gain)
        g = p @ row
        a = forgetting + row @ g
        b, p = b + g * (target - row @ b) / a, (p - np.outer(g, g) / a) / forgetting
        np.testing.assert_allclose(gain, g / a, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(value, b, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(inv_info, p, rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(inv_info, inv_info.T)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.integers(1, 5), noise=st.floats(0.01, 10.0))
def test_measure_conditions_a_normal_law(seed, size, noise):
    rng = np.random.default_rng(seed)
    root, row = rng.normal(size=(size, size)), rng.normal(size=size)
    covariance, value = root @ root.T + 0.1 * np.eye(size), rng.normal(size=size)
    information = np.linalg.inv(covariance) + np.outer(row, row) / noise
    wanted = np.linalg.solve(information, np.linalg.solve(covariance, value) + row * 1.5 / noise)
    kernels.measure(value, covariance, row, 1.5, noise, np.empty(size))
    np.testing.assert_allclose(value, wanted, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(covariance, np.linalg.inv(information), rtol=1e-6, atol=1e-9)


@njit
def _many_triangles(array, rows, count, root):
    work = np.empty(array.shape[1])
    for k in range(count):
        array *= root
        work[:] = rows[k % rows.shape[0]]
        kernels.rotate(array, work)


@njit
def _many_covariances(value, inv_info, rows, count, forgetting):
    gain = np.empty(value.size)
    for k in range(count):
        row = rows[k % rows.shape[0]]
        kernels.covariance_step(value, inv_info, row[: value.size], row[value.size], forgetting, gain)


def barely_moving(size=997, tremor=1e-5):
    """Rows [1, cos, sin] and readings of a spindle that all but stands."""
    rng = np.random.default_rng(1)
    angle = 0.7 + tremor * rng.standard_normal(size)
    rows = np.column_stack([np.ones(size), np.cos(angle), np.sin(angle)])
    return np.column_stack([rows, rows @ [61.94, 0.5, -0.2] + 1e-5 * rng.standard_normal(size)])


def test_triangle_stays_definite_where_the_covariance_does_not():
    rows = barely_moving()
    array, value, inv_info, out = np.zeros((3, 4)), np.zeros(3), 1e3 * np.eye(3), np.empty((3, 3))
    _many_triangles(array, rows, ROWS, FORGETTING**0.5)
    kernels.inverse(array, out)
    assert np.all(np.isfinite(out))
    sd = np.sqrt(np.diag(out))
    assert np.linalg.eigvalsh(out / np.outer(sd, sd)).min() > -1e-15
    assert np.all(np.abs(np.diag(array)) > 0)  # R'R is definite whatever its rounding
    kernels.solve(array, value)
    assert rows[0, :3] @ value == pytest.approx(rows[0, 3], abs=1e-4)

    _many_covariances(value, inv_info, rows, ROWS, FORGETTING)
    assert not (np.all(np.isfinite(inv_info)) and np.linalg.eigvalsh(inv_info).min() > 0)


@pytest.mark.parametrize(("count", "trace"), [(100, 1.5e4), (500, 5.0e7), (1000, 1.2e12)])
def test_covariance_winds_up_at_rest(count, trace):
    at_rest = np.array([[1.0, np.cos(0.7), np.sin(0.7), 0.0]])
    inv_info = 1e3 * np.eye(3)
    _many_covariances(np.zeros(3), inv_info, at_rest, count, FORGETTING)
    assert np.trace(inv_info) == pytest.approx(trace, rel=0.03)
    # Two directions that nobody looks at grow by 1/forgetting a row.
    assert np.trace(inv_info) == pytest.approx(2e3 * FORGETTING**-count, rel=1e-3)


def test_without_forgetting_at_rest_nothing_grows():
    at_rest = np.array([[1.0, np.cos(0.7), np.sin(0.7), 0.0]])
    array, out = np.hstack([np.eye(3) * 1e3**-0.5, np.zeros((3, 1))]), np.empty((3, 3))
    _many_triangles(array, at_rest, ROWS, 1.0)
    kernels.inverse(array, out)
    assert np.trace(out) == pytest.approx(2e3, rel=1e-3)
