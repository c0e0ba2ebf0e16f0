"""The tracer against brute force and against conditions of a best point, on problems of every kind of
trouble.
"""

import functools
import warnings
from itertools import combinations

import casadi as ca
import numpy as np
import pytest
from brute_force import evaluated, least, named
from hard_problems import EXAMPLE, PROBLEMS, one, problem
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import locus

TICKS = {3: 17, 4: 9}
"""Of the grid of brute force, where it has many controls."""


@functools.cache
def traced(name):
    return locus.plan(PROBLEMS[name])


def state_range(curve):
    return curve.problem.hidden[curve.hidden_name]


def kinds(curve):
    return [event.kind for event in curve.events]


def event(curve, kind):
    return next(found for found in curve.events if found.kind == kind)


def cost_at(curve, x):
    """Least cost, infinite where none is known."""
    try:
        point = curve.at(**{curve.hidden_name: x})
    except ValueError:
        return np.inf, None
    return (np.inf, None) if point.clamped else (point.cost, np.array(list(point.controls.values())))


# Brute force


@pytest.mark.parametrize("name", PROBLEMS)
def test_least_cost_is_that_of_brute_force(name):
    """To the accuracy of SLSQP, at nine hidden states that are no nodes."""
    curve = traced(name)
    low, high = state_range(curve)
    for x in low + (high - low) * (np.arange(9) + 0.37) / 9:
        known, where = cost_at(curve, x)
        best, there = least(curve.problem, x, ticks=TICKS.get(len(curve.names)), starts=4)
        if there is None:
            assert where is None, f"{curve.hidden_name} = {x}"
            continue
        size = max(abs(best), curve.system.cost_scale)
        assert known == pytest.approx(best, abs=2e-7 * size), f"{curve.hidden_name} = {x}: {where}, {there}"


# Conditions of a best point, by expressions of their own


def expressions(problem):
    """Cost and excesses with their derivatives, in the user's units."""
    z, x = ca.SX.sym("z", len(problem.names)), ca.SX.sym("x")
    s, c = named(problem.hidden_names, [x]), named(problem.names, ca.vertsplit(z))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # of numpy's functions on symbols
        cost, excess = (
            problem.objective(s, c),
            [one.response(s, c) - one.limit(s, c) for one in problem.varying],
        )
    multipliers = ca.SX.sym("l", len(excess))
    lagrangian = cost + ca.dot(multipliers, ca.vertcat(*excess))
    parts = [
        ca.gradient(cost, z),
        ca.jacobian(ca.vertcat(*excess), z),
        ca.vertcat(*excess),
        ca.hessian(lagrangian, z)[0],
    ]
    return ca.Function("f", [z, x, multipliers], [ca.densify(ca.SX(part)) for part in parts])


def reduced_curvature(hessian, rows):
    """Least eigenvalue on the null space of rows (numpy's SVD); inf where it is empty."""
    if len(rows) == 0:
        return np.linalg.eigvalsh(hessian)[0]
    _, sizes, right = np.linalg.svd(rows)
    basis = right[np.sum(sizes > 1e-9 * sizes[0]) :]
    return np.linalg.eigvalsh(basis @ hessian @ basis.T)[0] if len(basis) else np.inf


def check_conditions(curve, piece):
    """At every point of a piece: in controls as shares of their ranges, cost and excess as shares of how they
    spread.
    """
    problem, table, system = curve.problem, piece.table, curve.system
    f, (low, high) = expressions(problem), np.array(list(problem.controls.values())).T
    for z, x, multipliers in zip(table.controls, table.hidden, table.multipliers, strict=True):
        if np.any(multipliers > 1e7 * system.cost_scale / system.scales):
            continue  # where feasibility ends they have no limit
        by_cost, by_limit, excess, hessian = (np.asarray(part) for part in f(z, x, multipliers))
        stretch = np.where(low > 0, z * np.log(high / np.where(low > 0, low, 1.0)), high - low)
        pull = (by_cost[:, 0] + multipliers @ by_limit) * stretch / system.cost_scale
        size = 1 + np.max(np.abs(multipliers * system.scales / system.cost_scale), initial=0.0)
        free = np.array([control not in piece.bounds for control in problem.names])
        assert np.all(np.abs(pull[free]) <= 1e-10 * size)
        for k, control in enumerate(problem.names):
            if control in piece.bounds:
                end, sign = {"least": (low[k], 1), "greatest": (high[k], -1)}[piece.bounds[control]]
                assert z[k] == pytest.approx(end, rel=1e-12, abs=1e-12)
                assert sign * pull[k] >= -1e-9 * size
            else:
                assert low[k] - 1e-9 * (high[k] - low[k]) <= z[k] <= high[k] + 1e-9 * (high[k] - low[k])
        for j, varying in enumerate(problem.varying):
            share = excess[j, 0] / system.scales[j]
            if varying.name in piece.active:
                assert abs(share) <= 1e-10
                assert multipliers[j] >= -1e-9 * size
            else:
                assert share <= 1e-9
                assert abs(multipliers[j]) <= 1e-12 * size
        rows = by_limit[[varying.name in piece.active for varying in problem.varying]][:, free]
        assert (
            reduced_curvature(hessian[np.ix_(free, free)], rows * 1.0) >= -1e-8 * np.abs(hessian).max()
            if any(free)
            else True
        )


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_point_satisfies_the_conditions(name):
    curve = traced(name)
    assert curve.error <= 1e-10
    for piece in curve.pieces:
        check_conditions(curve, piece)


@pytest.mark.parametrize("name", PROBLEMS)
def test_pieces_meet_and_rise(name):
    """The hidden state rises in every table; neighbours meet, but where feasibility has a gap."""
    curve = traced(name)
    low, high = state_range(curve)
    for piece in curve.pieces:
        assert np.all(np.diff(piece.table.hidden) > 0)
    for before, after in zip(curve.best[:-1], curve.best[1:], strict=True):
        assert after.range[0] == pytest.approx(before.range[1], abs=1e-7 * (high - low))
    for piece, after in zip(curve.best[:-1], curve.best[1:], strict=True):
        assert piece.end not in ("", "lost", "range")
        if piece.end == "infeasible":  # there, but elsewhere it goes on
            assert np.abs(after.table.controls[0] - piece.table.controls[-1]).max() > 0.1


@pytest.mark.parametrize("name", PROBLEMS)
def test_slopes_are_differences_of_solved_points(name):
    curve = traced(name)
    low, high = state_range(curve)
    for piece in curve.best:
        first, last = piece.range
        x, step = first + 0.4 * (last - first), 1e-5 * min(high - low, last - first)
        before, at, after = (curve.at(**{curve.hidden_name: value}) for value in (x - step, x, x + step))
        for control, (least_, greatest) in curve.problem.controls.items():
            difference = (after.controls[control] - before.controls[control]) / (2 * step)
            rounding = 1e-10 * (greatest - least_) / step
            assert at.slope[control] == pytest.approx(difference, rel=1e-5, abs=rounding)


# What must happen where


def test_jump_is_where_both_valleys_cost_the_same():
    curve = traced("jump")
    (jump,) = curve.jumps
    costs = [cost_at(curve, jump.hidden + side)[0] for side in (-1e-9, 1e-9)]
    assert costs[0] == pytest.approx(costs[1], abs=1e-8)
    places = [cost_at(curve, jump.hidden + side)[1] for side in (-1e-9, 1e-9)]
    assert abs(places[0][0] - places[1][0]) > 1
    with pytest.raises(ValueError, match="x must not span a jump"):
        curve.stretch("u", x=(-0.9, 0.9999))


def test_fold_is_where_the_curvature_is_none():
    """u^3 - u + x = 0 turns at x = 2/(3 sqrt 3)."""
    curve = traced("fold")
    np.testing.assert_allclose([fold.hidden for fold in curve.folds], [-2 / 27**0.5, 2 / 27**0.5], atol=1e-9)
    np.testing.assert_allclose(
        [fold.controls["u"] for fold in curve.folds], [-1 / 3**0.5, 1 / 3**0.5], atol=1e-4
    )
    assert [jump.hidden for jump in curve.jumps] == [pytest.approx(0.0, abs=1e-9)]


def test_fold_is_approached_exactly():
    """The branch that is only the best nearby can be followed to within 1e-9 of its end."""
    curve = traced("fold")
    for piece in curve.pieces:
        for x in (piece.range[0] + 1e-9, piece.range[1] - 1e-9):
            u, v = curve.point_at(piece, x).controls[0]
            assert u**3 - u + x == pytest.approx(0.0, abs=1e-9)
            assert v == pytest.approx(u, abs=1e-9)


def test_valleys_that_part_are_no_jump():
    """v = +-sqrt(x/2) from x = 0 on: both are as good, one is kept."""
    curve = traced("pitchfork")
    assert not curve.jumps
    assert not curve.degenerate
    assert event(curve, "branch point").hidden == pytest.approx(0.0, abs=1e-8)
    for x in (1e-6, 0.01, 0.5, 1.0):
        assert cost_at(curve, x)[1][1] ** 2 == pytest.approx(x / 2, rel=1e-8)
    for x in (-1.0, -1e-6, 0.0, 1e-9):
        assert cost_at(curve, x)[1][1] == pytest.approx(0.0, abs=1e-3)


def test_constraint_for_a_while():
    """3 (x - 1/2)^2 is under x/2 between the roots of 3 x^2 - 3.5 x + 0.75."""
    curve = traced("for-a-while")
    roots = (3.5 + np.array([-1, 1]) * np.sqrt(3.5**2 - 9)) / 6
    found = [event(curve, kind).hidden for kind in ("response active", "response inactive")]
    np.testing.assert_allclose(found, roots, atol=1e-10)


def test_corners_by_hand():
    """u stays at 1 until v is at 2, then v stays there: u = (2.5 - v)/(1 + x)."""
    curve = traced("corners")
    for x in (0.0, 0.2, 0.42, 0.43, 1.0, 3.0, 4.0):
        u, v = (1.0, 1.5 - x) if x < 0 else (min(1.0, 0.5 / (1 + x)), 2.0)
        if 2.5 - (1 + x) <= 2 and 1 - 0.7 * (1 + x) > 0:  # u gains more than it takes from v
            u, v = 1.0, 1.5 - x
        assert cost_at(curve, x)[1] == pytest.approx([u, v], rel=1e-9)


def test_one_bound_gives_way_where_a_limit_reaches_a_corner():
    """From the corner (1, 1) the dearer control stays held and the other is released; this is no fold."""
    curve = locus.plan(
        problem(
            lambda s, c: -2 * c.u - c.v,
            one(lambda s, c: s.x + c.u + c.v, lambda s, c: 2.5),
            u=(-1.0, 1.0),
            v=(-1.0, 1.0),
        )
    )
    assert kinds(curve) == ["response active"]
    assert event(curve, "response active").hidden == pytest.approx(0.5, abs=1e-12)
    assert [piece.bounds for piece in curve.best] == [{"u": "greatest", "v": "greatest"}, {"u": "greatest"}]
    assert curve.at(x=0.9).controls == pytest.approx({"u": 1.0, "v": 0.6}, abs=1e-12)
    assert curve.at(x=0.9).multipliers["response"] == pytest.approx(1.0, abs=1e-9)


def test_both_controls_may_meet_their_bounds_at_once():
    curve = locus.plan(
        problem(
            lambda s, c: (c.u - s.x) ** 2 + (c.v - s.x) ** 2,
            one(lambda s, c: s.x + c.u, lambda s, c: 9.0),
            x=(0.0, 2.0),
            u=(-1.0, 1.0),
            v=(-1.0, 1.0),
        )
    )
    for x in (0.3, 0.999999, 1.0, 1.000001, 1.7):
        assert cost_at(curve, x)[1] == pytest.approx([min(x, 1.0)] * 2, abs=1e-9)


def test_feasibility_ends_where_the_disc_is_a_point():
    curve = traced("end")
    end = event(curve, "infeasible")
    assert end.hidden == pytest.approx(1.0, abs=1e-9)
    assert curve.range == (-2.0, pytest.approx(1.0, abs=1e-9))
    assert "no best point was found elsewhere" in curve.status
    for x in (0.9, 1 - 1e-6):
        u, v = cost_at(curve, x)[1]
        assert (u - 1) ** 2 + (v - 0.5) ** 2 == pytest.approx(1 - x, rel=1e-6)
    assert curve.at(x=1.5, throw=False).clamped
    with pytest.raises(ValueError, match=r"x must be in \[-2, 1\], where best points are known; got 1.5"):
        curve.at(x=1.5)


@pytest.mark.parametrize("steep", [4e4, 4e6])
def test_a_sliver_between_all_points_of_the_lattice(steep):
    """Least squares lead into it."""
    narrow = problem(
        lambda s, c: (c.u - 0.7) ** 2 + (c.v - 0.1) ** 2,
        one(lambda s, c: s.x + steep * (c.u - 0.37 * c.v - 0.123) ** 2 + c.u, lambda s, c: 1.4),
        x=(0.8, 1.2), u=(0.0, 1.0), v=(0.0, 1.0),
    )  # fmt: skip
    curve = locus.plan(narrow)
    for x in (0.83, 1.1):
        u, v = cost_at(curve, x)[1]
        assert abs(u - 0.37 * v - 0.123) <= np.sqrt((1.4 - x) / steep)
        best = min((0.123 + 0.37 * w - 0.7) ** 2 + (w - 0.1) ** 2 for w in np.linspace(0, 1, 10001))
        assert curve.at(x=x).cost == pytest.approx(best, abs=2 / np.sqrt(steep))


def test_ends_of_the_range_are_within():
    """Whatever rounding does to them."""
    for ends in ((0.1, 0.7), (1 / 3, 2 / 3), (1e-3, 0.3), (-0.3, 0.1), (0.2, 20.0), (1e-9, 1e9)):
        x = {"x": ends}
        curve = locus.plan(
            problem(
                lambda s, c: (c.u - 2) ** 2,
                one(lambda s, c: s.x + c.u, lambda s, c: 3.0 + 1e9),
                u=(0.0, 1.0),
                **x,
            )
        )
        for end in ends:
            assert not curve.at(x=end).clamped


@pytest.mark.parametrize("slope", [0.0, -1e-56, 1e-17])
def test_what_rounding_leaves_of_a_slope_is_none(slope):
    """At u = 1 the limit depends on v no more: there feasibility ends, and nothing folds."""
    curve = locus.plan(
        problem(
            lambda s, z: z.u**2 + z.v**2 + 0.5 * z.u * z.v + 0.5 * z.v,
            one(lambda s, z: s.x, lambda s, z: 0.3 + z.u + slope * z.v),
            x=(-1.0, 2.0), u=(-1.0, 1.0), v=(-1.0, 1.0),
        )
    )  # fmt: skip
    assert not curve.folds
    assert curve.best[-1].table.hidden.max() == pytest.approx(1.3, abs=1e-9)


# Properties


def least_of_quadratic(hessian, slope, rows, limits):
    """Least z.H.z/2 + slope.z over two numbers z with rows.z <= limits, of all points where the cost is level on
    the border of none, one or two of the limits; inf: nothing is feasible.
    """
    found = [np.inf]
    for count in range(3):
        for held in combinations(range(len(rows)), count):
            own = rows[list(held)]
            matrix = np.block([[hessian, own.T], [own, np.zeros((count, count))]])
            if abs(np.linalg.det(matrix)) > 1e-12:
                z = np.linalg.solve(matrix, np.concatenate([-slope, limits[list(held)]]))[:2]
                if np.all(rows @ z <= limits + 1e-12):
                    found.append(0.5 * z @ hessian @ z + slope @ z)
    return min(found)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12))
def test_random_convex_problems(numbers):
    """Quadratic cost, linear constraint that tightens: the best of all sets of limits agrees, and the least cost
    never falls (nested sets).
    """
    a, b, c, d, e, f, g, h, p, q, r, w = numbers
    convex = problem(
        lambda s, z: (1 + a * a) * z.u**2 + (1 + b * b) * z.v**2 + c * z.u * z.v + d * z.u + e * z.v,
        one(lambda s, z: (1 + w * w) * s.x + f * z.u + g * z.v, lambda s, z: 0.3 + h * h + p * z.u + q * z.v + r * r),
        x=(-1.0, 2.0), u=(-1.0, 1.0), v=(-1.0, 1.0),
    )  # fmt: skip
    try:
        curve = locus.plan(convex)
    except ValueError as error:
        assert "constraints must leave a feasible point" in str(error)
        return
    cost = np.concatenate([piece.table.cost for piece in curve.best])
    assert np.all(np.diff(cost) >= -1e-10)
    assert not curve.jumps
    assert not curve.folds
    hessian = np.array([[2 * (1 + a * a), c], [c, 2 * (1 + b * b)]])
    steep = np.hypot(f - p, g - q) or 1.0
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [(f - p) / steep, (g - q) / steep]])
    for x in (-0.91, 0.13, 0.77, 1.63):
        limits = np.append(np.ones(4), (0.3 + h * h + r * r - (1 + w * w) * x) / steep)
        best = least_of_quadratic(hessian, np.array([d, e]), rows, limits)
        assert cost_at(curve, x)[0] == pytest.approx(best, abs=1e-9)


def random_problem(seed):
    """Cubic and wavy cost, curved and wavy constraint, over two controls."""
    rng = np.random.default_rng(seed)
    root, linear, cubic, centre = (
        rng.normal(size=(2, 2)),
        rng.normal(size=2),
        0.5 * rng.normal(size=2),
        rng.uniform(-0.7, 0.7, 2),
    )
    waves, phases, heights = rng.uniform(1, 5, (2, 2)), rng.uniform(0, 6.3, 2), rng.uniform(0, 0.8, 2)
    slope, bend, rate = rng.normal(size=2), 0.5 * rng.normal(size=(2, 2)), rng.uniform(0.5, 2)
    room, ripple, depth = rng.uniform(0.2, 1.5), rng.uniform(1, 4, 2), rng.uniform(0, 0.6)
    square = 0.3 * root.T @ root

    def cost(s, c):
        z = (c.u, c.v)
        total = sum(cubic[i] * z[i] ** 3 + linear[i] * z[i] for i in range(2))
        total += sum(
            square[i, j] * (z[i] - centre[i]) * (z[j] - centre[j]) for i in range(2) for j in range(2)
        )
        return total + sum(
            heights[k] * np.sin(waves[k, 0] * z[0] + waves[k, 1] * z[1] + phases[k]) for k in range(2)
        )

    def response(s, c):
        z = (c.u, c.v)
        total = (
            rate * s.x
            + depth * np.sin(ripple[0] * z[0] + ripple[1] * z[1])
            + slope[0] * z[0]
            + slope[1] * z[1]
        )
        return total + sum(bend[i, j] * z[i] * z[j] for i in range(2) for j in range(2))

    return problem(
        cost, one(response, lambda s, c: room + 0 * c.u), x=(-1.0, 1.0), u=(-1.0, 1.0), v=(-1.0, 1.0)
    )


@pytest.mark.parametrize("seed", [3, 4, 9, 30, 37, 38, 41, 146, 198])
def test_random_problems_that_were_missed_once(seed):
    """Corners, searches that left their valley, branches between the places where searches begin, jumps near
    an end.
    """
    curve = locus.plan(random_problem(seed))
    assert curve.error <= 1e-10
    for x in np.linspace(-1, 1, 11):
        best, there = least(curve.problem, x, ticks=41, starts=4)
        known = cost_at(curve, x)[0]
        assert known <= best + 1e-7 if there is not None else True
        cost, excess = (
            evaluated(curve.problem, cost_at(curve, x)[1], [x])
            if np.isfinite(known)
            else (np.inf, np.zeros(1))
        )
        assert np.isinf(known) or (excess[0] <= 1e-9 and cost == pytest.approx(known, rel=1e-9, abs=1e-9))


def test_example_against_a_convex_solver():
    """Koren's example is a convex problem with x as a parameter: cvxpy with Clarabel."""
    cvxpy = pytest.importorskip("cvxpy")
    x, z = cvxpy.Parameter(nonneg=True), cvxpy.Variable(2)
    within = [x * z[1] - z[0] - 1 <= 0, z >= 0, z[0] <= 5, z[1] <= 10]
    convex = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(z - np.array([1.0, 4.0]))), within)
    assert convex.is_dcp(dpp=True)
    curve = locus.plan(locus.Problem(hidden={"x": (0.2, 20.0)}, **EXAMPLE))
    for value in (0.3, 0.5, 0.7, 1.0, 3.3, 11.0, 20.0):
        x.value = value
        convex.solve(solver="CLARABEL", tol_gap_abs=1e-12, tol_gap_rel=1e-12, tol_feas=1e-12)
        assert cost_at(curve, value)[1] == pytest.approx(z.value, abs=1e-6)
        assert curve.at(x=value).multipliers["response"] == pytest.approx(within[0].dual_value, abs=1e-5)
