"""Expressions: names, operators, comparisons, conditions."""

import ast
import builtins
import math
import operator
from collections.abc import Callable
from typing import Any

from sdpgrind.codegen._translate.calls import Calls
from sdpgrind.codegen._translate.refusals import check_division
from sdpgrind.codegen._translate.types import BOOL, FLOAT64, INT64, Scalar, Tuple, unified
from sdpgrind.codegen._translate.values import (
    LOWEST,
    PRIMARY,
    PRODUCT,
    SUM,
    Value,
    gathered,
    literal,
    widened,
    within,
)

_SIGNS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.LShift: "<<", ast.RShift: ">>",
    ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
    ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
_FOLDED: dict[type, Callable[[float, float], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.LShift: operator.lshift,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip
_BY_NODE = {
    ast.Name: "variable", ast.Constant: "constant", ast.Attribute: "attribute", ast.Subscript: "subscript",
    ast.Tuple: "several", ast.UnaryOp: "unary", ast.BinOp: "binary", ast.Compare: "compare",
    ast.BoolOp: "connected", ast.IfExp: "conditional", ast.Call: "call",
}  # fmt: skip
"""Node -> method that translates it."""
_EVALUATED_OTHERWISE = (2.0, -1.0, 0.5)  # source: LLVM turns pow with these exponents into products and roots


class Expressions(Calls):
    """Translation of expressions."""

    def expression(self, node: ast.expr) -> Value:
        """Return the value of an expression; emit what must be done before it."""
        name = _BY_NODE.get(type(node))
        if name is None:
            raise self.source.unknown(node)
        found: Value = getattr(self, name)(node)
        return found

    def constant(self, node: ast.Constant) -> Value:
        """Return a literal."""
        if isinstance(node.value, bool | int | float):
            return literal(node.value)
        raise self.refused(node, f"the literal {node.value!r}", "use numbers")

    def variable(self, node: ast.Name) -> Value:
        """Return a variable, or what the name means outside."""
        if node.id in self.variables:
            return self.read(node, node.id)
        function = self.kernel.py_func
        if node.id in function.__code__.co_varnames:
            raise self.refused(node, f"{node.id}, which may not be set yet,", "set it before")
        cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
        outer = function.__globals__.get(node.id, getattr(builtins, node.id, None))
        thing = cells[node.id].cell_contents if node.id in cells else outer
        return self.program.constant(thing, node.id)

    def several(self, node: ast.Tuple) -> Value:
        """Return a tuple."""
        return gathered(tuple, tuple(self.operands(node.elts)))

    def unary(self, node: ast.UnaryOp) -> Value:
        """Return the opposite."""
        if isinstance(node.op, ast.Not):
            found = self.truth(node.operand)
            if isinstance(found.number, bool):
                return literal(not found.number)
            return Value(f"!{within(found, PRIMARY)}", BOOL, PRODUCT)
        value = self.expression(node.operand)
        if isinstance(node.op, ast.UAdd):
            return value
        if not isinstance(node.op, ast.USub):
            raise self.refused(node, "~", "use comparisons")
        if value.number is not None:
            return literal(-value.number)
        value = self.converted(node, value, INT64 if value.type != FLOAT64 else FLOAT64)
        return Value(f"-{within(value, PRIMARY)}", value.type, PRODUCT)

    def binary(self, node: ast.BinOp) -> Value:
        """Return the value of an operator."""
        left, right = self.operands([node.left, node.right])
        return self.combined(node, node.op, left, right)

    def combined(self, node: ast.AST, sign: ast.operator, left: Value, right: Value) -> Value:
        """Return the value of an operator on two values."""
        if not (isinstance(left.type, Scalar) and isinstance(right.type, Scalar)):
            raise self.refused(node, "arithmetic of whole arrays or tuples", "write the loop")
        if isinstance(sign, ast.Pow):
            return self._power(node, left, right)
        if left.count is not None and right.count is not None and type(sign) in _FOLDED:
            return literal(_FOLDED[type(sign)](left.count, right.count))
        if isinstance(sign, ast.FloorDiv | ast.Mod):
            return self._divided(node, sign, left, right)
        if type(sign) not in _SIGNS:
            raise self.source.unknown(sign)
        if FLOAT64 in (left.type, right.type):
            left, right = widened(left), widened(right)
        kind = FLOAT64 if FLOAT64 in (left.type, right.type) or isinstance(sign, ast.Div) else INT64
        if isinstance(sign, ast.Div):
            check_division(self.source, self.kernel, node)
        return self._operated(node, _SIGNS[type(sign)], left, right, kind)

    def _operated(self, node: ast.AST, sign: str, left: Value, right: Value, kind: Scalar) -> Value:
        a, b = self.converted(node, left, kind), self.converted(node, right, kind)
        if sign == "<<" and a.count is not None:
            a = Value(f"(int64_t){a.code}", INT64, PRODUCT)
        level = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT}.get(sign, LOWEST)
        tight = level + 1 if level else PRIMARY
        number = _folded(sign, a.number, b.number) if kind == FLOAT64 else None
        return Value(f"{within(a, level or PRIMARY)} {sign} {within(b, tight)}", kind, level, number)

    def _divided(self, node: ast.AST, sign: ast.operator, left: Value, right: Value) -> Value:
        check_division(self.source, self.kernel, node)
        whole = FLOAT64 not in (left.type, right.type)
        if not whole and isinstance(sign, ast.FloorDiv):
            raise self.refused(node, "// of floats", "write np.floor(a / b)")
        if left.count is not None and right.count:
            return literal(
                left.count // right.count if isinstance(sign, ast.FloorDiv) else left.count % right.count
            )
        kind = INT64 if whole else FLOAT64
        name = "quotient" if isinstance(sign, ast.FloorDiv) else "remainder" if whole else "mod"
        if whole and (right.count or 0) > 0:
            name += "_by"
        a, b = self.converted(node, left, kind), self.converted(node, right, kind)
        return Value(f"{self.program.helper(name)}({a.code}, {b.code})", kind)

    def _is_written(self, node: ast.AST) -> bool:
        """Whether the exponent stands in the kernel: numba knows such a one, and not those of a law."""
        if not isinstance(node, ast.BinOp):
            return True
        return all(one.id not in self.variables for one in ast.walk(node.right) if isinstance(one, ast.Name))

    def _power(self, node: ast.AST, base: Value, exponent: Value) -> Value:
        """Repeated squaring for whole exponents, in the order of numba; pow for others."""
        if (
            self._is_written(node)
            and exponent.number in _EVALUATED_OTHERWISE
            and isinstance(exponent.number, float)
        ):
            raise self.refused(node, f"**{exponent.number}", "write x*x, 1/x, np.sqrt(x): pow has other bits")
        if base.count is not None and exponent.count is not None and exponent.count >= 0:
            return literal(base.count**exponent.count)
        if exponent.type == FLOAT64 or base.type != FLOAT64:
            if exponent.type != FLOAT64:
                raise self.refused(node, "a power of a whole number", "write float(...), or the product")
            a, b = self.converted(node, base, FLOAT64), exponent
            return Value(f"{self.program.helper('pow')}({a.code}, {b.code})", FLOAT64)
        if exponent.count is None or exponent.count < 0:
            raise self.refused(
                node,
                "a whole power that is computed, or negative,",
                "divide by the power, or write float(...): Python raises at 0",
            )
        if exponent.count == 2:
            if base.level == PRIMARY and "(" not in base.code:
                return Value(f"{base.code} * {base.code}", FLOAT64, PRODUCT)
            return Value(f"{self.program.helper('square')}({base.code})", FLOAT64)
        whole = self.converted(node, exponent, INT64)
        return Value(f"{self.program.helper('power')}({base.code}, {whole.code})", FLOAT64)

    # -- truth -----------------------------------------------------------------------------------------

    def compare(self, node: ast.Compare) -> Value:
        """Return a chain of comparisons; what stands in the middle is evaluated once."""
        values = self.operands([node.left, *node.comparators])
        for k in range(1, len(values) - 1):
            if values[k].level < PRIMARY or "(" in values[k].code:
                values[k] = self.temporary(values[k])
        if _empty(node.ops, values[0].number, values[-1].number) and "(" not in values[1].code:
            return literal(False)
        found = [self._compared(node, sign, values[k], values[k + 1]) for k, sign in enumerate(node.ops)]
        if len(found) == 1:
            return found[0]
        return Value(" && ".join(within(one, PRIMARY) for one in found), BOOL, LOWEST)

    def _compared(self, node: ast.AST, sign: ast.cmpop, left: Value, right: Value) -> Value:
        if type(sign) not in _SIGNS:
            raise self.source.unknown(sign)
        if left.number is not None and right.number is not None:
            return literal(bool(_FOLDED[type(sign)](left.number, right.number)))
        kind = unified(left.type, right.type)
        if not isinstance(kind, Scalar):
            raise self.refused(node, "a comparison of what are no numbers", "compare numbers")
        wide = FLOAT64 if kind == FLOAT64 else INT64
        found = self._operated(node, _SIGNS[type(sign)], left, right, wide)
        return Value(found.code, BOOL, LOWEST)

    def truth(self, node: ast.expr) -> Value:
        """Return whether an expression is true."""
        if isinstance(node, ast.BoolOp):
            return self._connected(node, self.truth)
        return self.as_truth(node, self.expression(node))

    def connected(self, node: ast.BoolOp) -> Value:
        """Return the value of `and` or `or`."""
        return self._connected(node, self.expression)

    def _connected(self, node: ast.BoolOp, operand: Callable[[ast.expr], Value]) -> Value:
        """Connect operands from the left: what follows is evaluated only where it counts."""
        both, found = isinstance(node.op, ast.And), operand(node.values[0])
        for one in node.values[1:]:
            with self.apart() as lines:
                value = operand(one)
            test = self.as_truth(node, found)
            if isinstance(test.number, bool):
                self.lines += lines if test.number is both else []
                found = value if test.number is both else found
            else:
                found = self._pair(node, both, test, found, (lines, value))
        return found

    def _pair(self, node: ast.AST, both: bool, test: Value, first: Value, second: tuple[Any, Value]) -> Value:
        lines, value = second
        kind = unified(first.type, value.type)
        if not isinstance(kind, Scalar):
            raise self.refused(node, "and, or of what are no numbers", "compare them")
        if kind == BOOL and value.number is both and not lines:
            return first
        if kind == BOOL and not lines:
            sign = "&&" if both else "||"
            return Value(f"{within(first, PRIMARY)} {sign} {within(value, PRIMARY)}", BOOL, LOWEST)
        ends: list[tuple[list[Any], Value]] = [(lines, value), ([], first)]
        return self.chosen(test, kind, ends if both else ends[::-1], node)

    def conditional(self, node: ast.IfExp) -> Value:
        """Return one of two values."""
        test = self.truth(node.test)
        if isinstance(test.number, bool):
            return self.expression(node.body if test.number else node.orelse)
        with self.apart() as lines:
            yes = self.expression(node.body)
        with self.apart() as others:
            no = self.expression(node.orelse)
        kind = unified(yes.type, no.type)
        if not isinstance(kind, Scalar | Tuple):
            raise self.refused(
                node, "a choice between arrays, or between two types", "write the two branches"
            )
        if lines or others or isinstance(kind, Tuple):
            return self.chosen(test, kind, [(lines, yes), (others, no)], node)
        a, b = self.converted(node, yes, kind), self.converted(node, no, kind)
        return Value(f"{within(test, PRIMARY)} ? {within(a, PRIMARY)} : {within(b, PRIMARY)}", kind, LOWEST)


def _folded(sign: str, left: float | None, right: float | None) -> float | None:
    """Return a sum, difference or product of known doubles, rounded as in C; None: not known or finite."""
    if left is None or right is None or sign not in ("+", "-", "*"):
        return None
    found = left + right if sign == "+" else left - right if sign == "-" else left * right
    return found if math.isfinite(found) else None


def _empty(signs: list[ast.cmpop], low: float | None, high: float | None) -> bool:
    """Whether nothing lies between two known numbers, as in `low <= x < high`."""
    if (
        low is None
        or high is None
        or len(signs) != 2
        or not all(isinstance(one, ast.Lt | ast.LtE) for one in signs)
    ):
        return False
    return low > high or (low == high and any(isinstance(one, ast.Lt) for one in signs))
