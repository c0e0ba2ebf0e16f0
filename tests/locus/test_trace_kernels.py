"""Parts of the tracer by themselves: linear equations, the null space, corners, cubics, against numpy."""

import numpy as np
import pytest
from hard_problems import PROBLEMS, one, problem
from locus_inside import _exchange, work_size
from locus_inside import kkt_kernels as kkt
from locus_inside import trace_kernels as kernels

from sdpgrind.base.compiling.compiled import opened

exchange = opened(_exchange)


def given(system, point, hidden):
    """What the tape gives at a point."""
    d = np.empty(opened(kkt._sizes)(system.n, system.m, system.h))
    opened(kkt._evaluate)(
        system.kkt_tape, system.n, system.h, point, hidden, 0, np.empty(work_size(system.kkt_tape)), d
    )
    return d


@pytest.mark.parametrize("size", [1, 2, 5, 8])
def test_elimination(size):
    rng = np.random.default_rng(size)
    a, b = rng.normal(size=(size, size)), rng.normal(size=size)
    x = b.copy()
    determinant = opened(kkt._solve)(a.copy(), x)
    np.testing.assert_allclose(x, np.linalg.solve(a, b), rtol=1e-9)
    assert determinant == pytest.approx(np.linalg.det(a), rel=1e-9)


def test_no_solution_is_told():
    assert opened(kkt._solve)(np.zeros((2, 2)), np.ones(2)) == 0.0
    assert opened(kkt._solve)(np.array([[1.0, 2.0], [2.0, 4.0]]), np.ones(2)) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("name", ["three-controls", "four-controls", "koren"])
def test_jacobian_of_the_conditions_is_that_of_differences(name):
    system, rng = PROBLEMS[name].system, np.random.default_rng(4)
    n, m = system.n, system.m
    size = n + m + 2
    point, held = rng.uniform(0.2, 0.8, size), np.zeros(n + m, dtype=np.int64)
    held[n:] = 1
    held[0] = -1

    def f(at):
        residual, jacobian = np.empty(size), np.empty((size, size))
        opened(kkt._conditions)(given(system, at, np.zeros(1)), at, held, n, m, 1, 0, residual, jacobian)
        return residual[:-1].copy(), jacobian[:-1].copy()

    _, jacobian = f(point)
    for k in range(size):
        step = np.eye(size)[k] * 1e-6
        difference = (f(point + step)[0] - f(point - step)[0]) / 2e-6
        np.testing.assert_allclose(jacobian[:, k], difference, atol=1e-7 * (1 + np.abs(jacobian).max()))


@pytest.mark.parametrize("name", ["three-controls", "four-controls"])
def test_reduced_curvature_by_singular_values(name):
    system, rng = PROBLEMS[name].system, np.random.default_rng(5)
    n, m = system.n, system.m
    point, held = rng.uniform(0.2, 0.8, n + m + 2), np.zeros(n + m, dtype=np.int64)
    held[n] = 1
    d = given(system, point, np.zeros(1))
    gradient, hessians = (
        d[1 + m + n : 1 + m + 2 * n],
        d[(1 + m) * (1 + n) :][: (1 + m) * n * n].reshape(1 + m, n, n),
    )
    basis = np.linalg.svd(gradient[None])[2][1:]
    hessian = np.tensordot(point[n : n + 1 + m], hessians, 1) / point[n]
    assert opened(kkt._curvature)(d, point, held, n, m) == pytest.approx(
        np.linalg.eigvalsh(basis @ hessian @ basis.T)[0], rel=1e-9
    )


def corner():
    """At the corner (1, 1) with cost -2u - v, where u + v <= 2 (scaled alike) has just become active."""
    made = problem(
        lambda s, c: -2 * c.u - c.v,
        one(lambda s, c: s.x + c.u + c.v, lambda s, c: 2.0),
        x=(-1.0, 1.0),
        u=(-1.0, 1.0),
        v=(-1.0, 1.0),
    )
    return made.system, np.array([1.0, 1.0, 1.0, 0.0, 0.5])


def test_the_member_whose_multiplier_vanishes_first_gives_way():
    system, point = corner()
    held = np.array([1, 1, 1])
    gone = exchange(given(system, point, np.zeros(1)), point, held, 2, 2, 1, 1, 0)
    assert gone == 1  # v: it gains less by its bound
    np.testing.assert_array_equal(held, [1, 0, 1])
    assert np.sum(point[2:4] ** 2) == pytest.approx(1.0)
    d = given(system, point, np.zeros(1))
    assert opened(kkt._gradient_row)(d, point, 1, 2, 1, 1, 0, np.empty(5)) == pytest.approx(0.0, abs=1e-12)
    assert opened(kkt._gradient_row)(d, point, 0, 2, 1, 1, 0, np.empty(5)) < 0


def test_where_none_gives_way_feasibility_ends():
    """At the corner (0, 0) the limit u + v <= .. leaves nothing: bounds push the other way."""
    system, point = corner()
    point[:2] = 0.0
    assert exchange(given(system, point, np.zeros(1)), point, np.array([-1, -1, 1]), 2, 2, 1, 1, 0) == -1


def test_a_cubic_between_nodes_is_met_at_a_place():
    """On a circle, a quarter of a radian: to the fourth order of the distance."""
    angles, errors = np.array([0.3, 0.55]), []
    for share in (1.0, 0.5):
        a, b = angles[0], angles[0] + share * (angles[1] - angles[0])
        nodes = [np.array([np.cos(angle), np.sin(angle)]) for angle in (a, b)]
        along = [np.array([-np.sin(angle), np.cos(angle)]) for angle in (a, b)]
        point, place = np.empty(2), np.sin(a + 0.4 * (b - a))
        length = kernels.between(*nodes, *along, place, point)
        assert length == pytest.approx(np.linalg.norm(nodes[1] - nodes[0]))
        assert point[1] == place
        errors.append(abs(point[0] - np.sqrt(1 - place**2)))
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 7
