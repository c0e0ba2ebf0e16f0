"""Tapes equal CasADi: every operation, whole expressions, derivatives, patterns with holes."""

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from locus_inside import Op, run, run_many, tape, work_size

AWKWARD = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.5,
    -2.5,
    3.0,
    -7.0,
    1e-310,
    1e-9,
    -1e-9,
    1e9,
    -1e300,
    1e300,
    np.inf,
    -np.inf,
    np.nan,
]
ONE = {
    **{
        name: getattr(casadi, name)
        for name in ("sqrt", "exp", "log", "fabs", "sin", "cos", "tan", "asin", "acos", "atan")
    },
    **{
        name: getattr(casadi, name)
        for name in ("sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "erf", "log1p", "expm1")
    },
    **{name: getattr(casadi, name) for name in ("sign", "floor", "ceil")},
    "neg": lambda x: -x,
    "sq": lambda x: x**2,
    "twice": lambda x: 2 * x,
    "inv": lambda x: 1 / x,
    "not": casadi.logic_not,
}
TWO = {
    **{
        name: getattr(casadi, name)
        for name in ("atan2", "fmin", "fmax", "fmod", "remainder", "copysign", "hypot")
    },
    "if_else_zero": lambda x, y: casadi.if_else(x, y, 0),
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
    "pow": lambda x, y: x**y,
    "lt": lambda x, y: x < y,
    "le": lambda x, y: x <= y,
    "eq": lambda x, y: x == y,
    "ne": lambda x, y: x != y,
    "and": casadi.logic_and,
    "or": casadi.logic_or,
}


def evaluated(function, *inputs):
    """What the tape of a function makes of dense inputs, flat."""
    packed = tape(function)
    out = np.full(sum(function.numel_out(k) for k in range(function.n_out())), 7.0)
    flat = np.concatenate([np.ravel(one, order="F") for one in inputs]).astype(float)
    run(packed, flat, np.full(work_size(packed), np.nan), out)
    return out


def expected(function, *inputs):
    """The same by CasADi."""
    return np.concatenate([np.asarray(one).ravel(order="F") for one in function.call(list(inputs))])


def operations(function):
    return int(tape(function)[:4].view(np.int64)[3])


def test_every_operation_has_a_test():
    assert {op.name.lower() for op in Op} == {*ONE, *TWO, "constpow"}


@pytest.mark.parametrize("name", ONE)
def test_operations_of_one_number(name):
    x = casadi.SX.sym("x")
    function = casadi.Function("f", [x], [ONE[name](x)])
    assert any(function.instruction_id(k) == getattr(casadi, f"OP_{name.upper()}") for k in range(3))
    points = [*AWKWARD, *np.random.default_rng(1).normal(0, 2, 50)]
    _same(name, [(evaluated(function, [p]), expected(function, p), p) for p in points])


@pytest.mark.parametrize("name", TWO)
def test_operations_of_two_numbers(name):
    x, y = casadi.SX.sym("x"), casadi.SX.sym("y")
    function = casadi.Function("f", [x, y], [TWO[name](x, y)])
    assert any(function.instruction_id(k) == getattr(casadi, f"OP_{name.upper()}") for k in range(4))
    rng = np.random.default_rng(2)
    points = [(a, b) for a in AWKWARD for b in AWKWARD] + [tuple(rng.normal(0, 3, 2)) for _ in range(50)]
    packed = tape(function)
    got = np.empty((len(points), 1))
    run_many(packed, np.array(points), got)
    _same(name, [(got[k], expected(function, *p), p) for k, p in enumerate(points)])


@pytest.mark.parametrize("exponent", [0.25, -0.5, 1.5, -1 / 3, 170.3, np.inf])
def test_powers_that_are_constant(exponent):
    x = casadi.SX.sym("x")
    function = casadi.Function("f", [x], [x**exponent])
    assert any(function.instruction_id(k) == casadi.OP_CONSTPOW for k in range(4))
    # quarters are roots, which take the sign of -0.0 and have no value below it
    points = [p for p in AWKWARD if exponent % 0.25 or not (p == -np.inf or (p == 0 and np.signbit(p)))]
    _same("constpow", [(evaluated(function, [p]), expected(function, p), p) for p in points])


@pytest.mark.parametrize("exponent", [0.25, 0.5, 0.75, 1.6, 2.6, -0.4, -1.75, 7.3])
def test_powers_of_one_number_share_what_is_dear(exponent):
    x = X[0]
    powers = [x ** (exponent + k) for k in (-2, -1, 0, 1, 2)]
    function = casadi.Function("f", [X], [casadi.vertcat(*powers)])
    code = tape(function)
    assert _operation_counts(code).get(Op.CONSTPOW, 0) <= (0 if exponent % 0.25 == 0 else 2)
    for point in (0.0, 1e-300, 1e-9, 0.3, 1.0, 7.7, 1e9, np.inf):
        # a product or a quotient for each whole number between exponents, and 2.6 - 1 is not 1.6 to the last
        # bit: times log(x)
        got, wanted = evaluated(function, [point, 0, 0]), expected(function, [point, 0, 0])
        np.testing.assert_allclose(
            got, wanted, rtol=1e-15 * (4 + 20 * (abs(np.log(point)) if 0 < point < np.inf else 0)), atol=0
        )


def _operation_counts(code):
    """How many of each operation a tape has."""
    whole, found = code.view(np.int64), {}
    at = 5 + whole[2]
    for _ in range(whole[4]):
        found[Op(whole[at])] = found.get(Op(whole[at]), 0) + int(whole[at + 1])
        at += 2 + 2 * whole[at + 1]
    return found


def _same(name, found):
    for got, wanted, point in found:
        np.testing.assert_allclose(got, wanted, rtol=1e-15 * 4, atol=0, err_msg=f"{name} at {point}")


X = casadi.SX.sym("x", 3)


def _joined(depth):
    leaves = st.one_of(st.integers(0, 2).map(lambda k: X[k]), st.floats(-3, 3).map(casadi.SX))
    safe = [name for name in ONE if name not in ("not", "sign", "floor", "ceil")]
    smooth = ["add", "sub", "mul", "div", "pow", "atan2", "hypot", "fmin", "fmax"]
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.builds(lambda name, a: ONE[name](a), st.sampled_from(safe), inner),
            st.builds(lambda name, a, b: TWO[name](a, b), st.sampled_from(smooth), inner, inner),
        ),
        max_leaves=depth,
    )


@settings(max_examples=100, deadline=None)
@given(_joined(25), st.lists(st.floats(-4, 4), min_size=3, max_size=3))
def test_composed_expressions_and_their_gradients(expression, point):
    function = casadi.Function("f", [X], [casadi.SX(expression), casadi.gradient(expression, X)])
    # same operations in the same order, but for the last bits of sinh and its like, and their consequences
    got, wanted = evaluated(function, point), expected(function, point)
    np.testing.assert_array_equal(np.isnan(got), np.isnan(wanted))
    usual = np.isfinite(wanted) & (np.abs(wanted) < 1e6)
    np.testing.assert_allclose(got[usual], wanted[usual], rtol=1e-7, atol=1e-9)


def test_powers_of_grinding_with_gradient_and_hessian():
    infeed, speed, flat = X[0], X[1], X[2]
    burning = 6.2 * infeed + 7.2 * (50 * infeed * speed) ** 0.25
    power = (
        13.8 * infeed + 28.86 + (7.55 + 2.1e6 * speed / (3e4 * 50)) * (50 * infeed / speed) ** 0.5 * flat * 30
    )
    lagrangian = -infeed + 1.3 * (power - burning)
    function = casadi.Function("L", [X], [lagrangian, *casadi.hessian(lagrangian, X)])
    for point in ([4.21736, 430.734, 0.005], [0.218862, 514.491, 0.01], [1e-8, 200.0, 0.0]):
        # roots for powers of a quarter, and products of them: the last bits may differ
        np.testing.assert_allclose(evaluated(function, point), expected(function, point), rtol=4e-15)
    # a second way to a column of the Hessian: the slope of the gradient
    step, point = 1e-4, np.array([4.21736, 430.734, 0.005])
    sides = [evaluated(function, point + side * np.array([step, 0, 0]))[10:] for side in (1, -1)]
    np.testing.assert_allclose(evaluated(function, point)[1:4], (sides[0] - sides[1]) / (2 * step), rtol=1e-6)


def test_powers_of_what_is_not_positive_are_those_of_c():
    x, p = casadi.SX.sym("x"), casadi.SX.sym("p")
    function = casadi.Function("f", [x, p], [x**p])
    assert evaluated(function, [-8.0], [3.0]) == -512.0
    assert np.isnan(evaluated(function, [-8.0], [1 / 3]))
    assert evaluated(function, [0.0], [-0.5]) == np.inf
    assert evaluated(function, [-0.0], [-3.0]) == -np.inf
    assert evaluated(function, [0.0], [0.0]) == 1.0


def test_holes_of_outputs_are_zero_and_columns_come_first():
    entries = casadi.SX(3, 2)
    entries[2, 0], entries[0, 1] = X[0], X[1] * X[2]
    function = casadi.Function("f", [X], [entries, casadi.SX(2, 1), X[2]])
    np.testing.assert_array_equal(evaluated(function, [2.0, 3.0, 5.0]), [0, 0, 2, 15, 0, 0, 0, 0, 5])


def test_holes_of_inputs_are_skipped():
    held = casadi.SX.sym("d", casadi.Sparsity.diag(2))
    function = casadi.Function("f", [X, held], [held[0, 0] - 2 * held[1, 1]])
    assert evaluated(function, [9.0, 9.0, 9.0], [[3.0, 9.0], [9.0, 5.0]]) == -7.0


def test_outputs_may_be_inputs_or_constants_or_the_same_twice():
    product = X[0] * X[1]
    function = casadi.Function("f", [X], [X[2], 4.5, product, product])
    np.testing.assert_array_equal(evaluated(function, [2.0, 3.0, 5.0]), [5, 4.5, 6, 6])


def test_the_same_is_computed_once():
    x, y = X[0], X[1]
    once = casadi.Function("f", [X], [casadi.exp(x * y)])
    twice = casadi.Function("f", [X], [casadi.exp(x * y) + casadi.exp(y * x)])
    assert operations(twice) == operations(once) + 1
    assert operations(casadi.Function("f", [X], [(x - y) * (y - x)])) == 3  # not the same
    point = [0.3, 0.7, 0.0]
    np.testing.assert_array_equal(evaluated(twice, point), expected(twice, point))


def test_equal_operations_stand_together():
    powers = sum((X[k % 3] * 1.5 + 0.1 * k) ** (0.3 + 0.1 * k) for k in range(12))
    function = casadi.Function("f", [X], [powers, casadi.gradient(powers, X)])
    packed = tape(function)
    n_op, n_run = packed[3:5].view(np.int64)
    assert n_op > 60
    assert n_run < n_op / 2
    np.testing.assert_array_equal(evaluated(function, [0.2, 0.3, 0.5]), expected(function, [0.2, 0.3, 0.5]))


def test_functions_of_matrices_are_expanded():
    x = casadi.MX.sym("x", 2)
    function = casadi.Function("f", [x], [casadi.mtimes(x, x.T), casadi.sumsqr(x)])
    np.testing.assert_array_equal(evaluated(function, [2.0, 3.0]), [4, 6, 6, 9, 13])


def test_many_rows_are_as_many_runs():
    function = casadi.Function("f", [X], [X[0] ** X[1], casadi.if_else(X[2] > 0, X[0], X[1])])
    for count in (20, 32, 75):  # less than a block, one, and two with some left
        rows, out = np.random.default_rng(3).normal(1, 1, (count, 3)), np.empty((count, 2))
        run_many(tape(function), rows, out)
        np.testing.assert_array_equal(out, [evaluated(function, row) for row in rows])


def test_a_tape_is_a_plain_array(tmp_path):
    function = casadi.Function(
        "f", [X], [casadi.exp(X[0]) - 1e-300, casadi.hessian(X[0] ** 1.5 * X[1], X)[0]]
    )
    packed = tape(function)
    assert packed.dtype == np.float64
    assert packed.ndim == 1
    assert packed.flags.c_contiguous
    np.save(tmp_path / "tape.npy", packed)
    again = np.load(tmp_path / "tape.npy")
    assert again.tobytes() == packed.tobytes()
    assert tape(function).tobytes() == packed.tobytes()


class Counter(casadi.Callback):
    """A function of the user's that is no expression."""

    def __init__(self):
        casadi.Callback.__init__(self)
        self.construct("counter", {})

    def eval(self, given):
        return [given[0]]


@pytest.mark.parametrize(
    "make", [lambda: casadi.interpolant("t", "linear", [[0.0, 1.0, 2.0]], [0.0, 1.0, 4.0]), Counter]
)
def test_what_has_no_expression_is_refused(make):
    x = casadi.MX.sym("x")
    called = make()
    wanted = (
        r"^cost must be made of expressions: operators, \*\* and .*; got a call of something that has none$"
    )
    with pytest.raises(ValueError, match=wanted):
        tape(casadi.Function("cost", [x], [called(x)]))


def test_an_operation_that_no_tape_has_is_named():
    x = casadi.SX.sym("x")
    with pytest.raises(ValueError, match=r"^response must be made of expressions.*got the operation erfinv"):
        tape(casadi.Function("response", [x], [casadi.erfinv(x)]))
