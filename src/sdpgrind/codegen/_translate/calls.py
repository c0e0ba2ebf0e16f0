"""Calls: of kernels, of functions of math and numpy, of casts, of what makes arrays and tuples."""

import ast
import inspect
import math
from dataclasses import replace
from typing import Any

import numpy as np

from sdpgrind.base.compiling.compiled import Kernel
from sdpgrind.base.compiling.uncounted import uncounted
from sdpgrind.codegen._translate.body import moved
from sdpgrind.codegen._translate.types import (
    BOOL,
    ELEMENTS,
    FLOAT64,
    INT64,
    Array,
    Known,
    Nothing,
    RowType,
    Scalar,
    Tuple,
    Type,
    dense,
    unified,
)
from sdpgrind.codegen._translate.values import LOWEST, Value, gathered, literal, widened
from sdpgrind.codegen._translate.views import Views

EXACT = "sqrt floor ceil fabs trunc copysign rint"
"""Functions of C that IEEE 754 defines to the last bit."""
LIBM = (
    "exp log pow sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh expm1 log1p hypot exp2"
    " log2 log10 cbrt fmod"
)
"""Functions whose last bits are those of the C library."""
_CALLED = {"abs": "fabs", "absolute": "fabs", "arcsin": "asin", "arccos": "acos", "arctan": "atan"}
_CALLED |= {"arctan2": "atan2", "arcsinh": "asinh", "arccosh": "acosh", "arctanh": "atanh", "power": "pow"}
_TESTS = {"isnan", "isinf", "isfinite"}
_KNOWN = {"min", "max", "len", *EXACT.split(), *LIBM.split(), *_CALLED, *_TESTS}
_ROUNDED = (math.floor, math.ceil, math.trunc)
"""Those of math give whole numbers, as in Python; those of numpy doubles."""
_INTEGERS = (int, np.int64, np.intp)


class Calls(Views):
    """Translation of calls."""

    hint: str = ""
    """Name for the array that the next call makes."""

    def call(self, node: ast.Call) -> Value:
        """Return the value of a call."""
        if isinstance(node.func, ast.Attribute):
            base = self.expression(node.func.value)
            if isinstance(base.type, Array):
                return self._method(node, base, base.type, node.func.attr)
        function = self.expression(node.func)
        if not isinstance(function.type, Known):
            raise self.refused(node, "a call of what is no function", "call kernels by their names")
        thing = function.type.thing
        if isinstance(thing, Kernel):
            return self.called(node, thing, self._bound(node, thing.py_func))
        if isinstance(thing, type) and issubclass(thing, tuple) and hasattr(thing, "_fields"):
            return gathered(thing, tuple(self._bound(node, thing.__new__, skip=1)))
        if node.keywords and thing not in (np.empty, np.zeros, np.ones):
            raise self.refused(
                node, "an argument by its name, of a function of numpy", "hand it over by place"
            )
        return self._of_library(node, thing)

    # -- kernels ---------------------------------------------------------------------------------------

    def _bound(self, node: ast.Call, function: Any, skip: int = 0) -> list[Value]:
        """Return the values of all parameters, in their order."""
        named = {one.arg: one.value for one in node.keywords if one.arg is not None}
        values = self.operands([*node.args, *named.values()])
        for one in [*node.args, *node.keywords]:
            if isinstance(one, ast.Starred) or (isinstance(one, ast.keyword) and one.arg is None):
                raise self.refused(node, "a starred argument", "name the arguments")
        signature = inspect.signature(function)
        count = len(node.args)
        given = signature.bind(
            *[None] * skip, *values[:count], **dict(zip(named, values[count:], strict=True))
        )
        given.apply_defaults()
        found = list(given.arguments.values())[skip:]
        return [one if isinstance(one, Value) else self.program.constant(one, "") for one in found]

    def called(self, node: ast.AST, kernel: Kernel, values: list[Value]) -> Value:
        """Call a kernel; its result is a temporary."""
        function = self.program.function(kernel, values, (self.source, node))
        if function.view is not None:
            place, at = function.view
            return replace(moved(values[place], at), type=function.result)
        if function.number is not None:
            return literal(function.number)
        for value, name in zip(values, function.parameters, strict=True):
            if name in function.written:
                self.write(node, value)
        texts = [
            self.text(self.converted(node, value, kind))
            for value, kind in zip(values, function.types, strict=True)
            if not isinstance(kind, Known)
        ]
        call = f"{function.name}({', '.join([*texts, 'fault'] if function.faults else texts)})"
        if isinstance(function.result, Nothing):
            self.emit(f"{call};")
            return Value("", Nothing())
        return self.temporary(Value(call, function.result), call=f"(void){call};")

    # -- numbers ---------------------------------------------------------------------------------------

    def _of_library(self, node: ast.Call, thing: Any) -> Value:
        name = getattr(thing, "__name__", "")
        if thing is uncounted:
            return self.expression(node.args[0])
        if thing in (np.empty, np.zeros, np.ones):
            return self._made(node, thing)
        if not isinstance(thing, type) and name not in _KNOWN:
            raise self.refused(node, f"the function {name or thing}", f"use one of: {EXACT} {LIBM}")
        values = self.operands(list(node.args))
        if thing in (min, max):
            return self._extreme(node, name, values)
        if thing is len and isinstance(values[0].type, Array | Tuple):
            kind = values[0].type
            return literal(self.known(node, kind.shape[0]) if isinstance(kind, Array) else len(kind.types))
        if thing in _INTEGERS:
            return self._integer(node, values[0])
        if thing in (float, np.float64):
            wide = widened(values[0]) if thing is np.float64 else values[0]
            return self.converted(node, wide, FLOAT64)
        if thing in (bool, np.bool_):
            return self.as_truth(node, values[0])
        if not any(thing is getattr(home, name, None) for home in (math, np)) and thing is not abs:
            raise self.refused(node, f"the function {name}", "use functions of math and numpy, or a kernel")
        found = self._of_math(node, _CALLED.get(name, name), values)
        return self._integer(node, found) if thing in _ROUNDED else found

    def _of_math(self, node: ast.Call, name: str, values: list[Value]) -> Value:
        if name == "fabs" and values[0].type != FLOAT64:
            whole = self.converted(node, values[0], INT64)
            return Value(f"{self.program.helper('abs')}({whole.code})", INT64)
        numbers = [self.converted(node, one, FLOAT64).code for one in values]
        if name in _TESTS:
            return Value(f"{name}({', '.join(numbers)}) != 0", BOOL, LOWEST)
        if name in EXACT.split():
            return Value(f"{name}({', '.join(numbers)})", FLOAT64)
        return Value(f"{self.program.helper(name)}({', '.join(numbers)})", FLOAT64)

    def _extreme(self, node: ast.Call, name: str, values: list[Value]) -> Value:
        """Fold from the left, as numba does with NaN."""
        kinds = [one.type for one in values if isinstance(one.type, Scalar)]
        if len(kinds) < max(2, len(values)):
            raise self.refused(node, f"{name} of one thing, or of no numbers", "write the loop")
        counts = [one.count for one in values]
        known = [one for one in counts if one is not None]
        if len(known) == len(counts):
            return literal(min(known) if name == "min" else max(known))
        kind: Type | None = kinds[0]
        for one in kinds[1:]:
            kind = None if kind is None else unified(kind, one)
        wide = FLOAT64 if kind == FLOAT64 else INT64
        helper = name if wide == FLOAT64 else f"{name}_int"
        found = self.converted(node, values[0], wide)
        beyond = math.inf if name == "min" else -math.inf
        for value in values[1:]:
            if value.number != beyond:  # no number is beyond it, and a NaN on the left stays
                found = self._pair_of(helper, found, self.converted(node, value, wide))
        return found

    def _pair_of(self, helper: str, left: Value, right: Value) -> Value:
        return Value(f"{self.program.helper(helper)}({left.code}, {right.code})", left.type)

    def _integer(self, node: ast.Call, value: Value) -> Value:
        if value.type != FLOAT64:
            return self.converted(node, value, INT64)
        if value.number is not None and math.isfinite(value.number):
            return literal(int(value.number))
        return Value(f"{self.program.helper('int')}({value.code}, fault)", INT64)

    # -- arrays ----------------------------------------------------------------------------------------

    def _made(self, node: ast.Call, thing: Any) -> Value:
        """Declare a local array."""
        hint, self.hint = self.hint, ""
        asked = self.expression(node.args[0])
        kinds = [one.value for one in node.keywords if one.arg == "dtype"] + node.args[1:2]
        element = FLOAT64
        if kinds:
            told = self.expression(kinds[0]).type
            element = ELEMENTS[np.dtype(told.thing)] if isinstance(told, Known) else FLOAT64
        extents = self._counts([asked])
        if None in extents:
            raise self.unsized(node, "an array of a size")
        shape = tuple(one or 0 for one in extents)
        kind = Array(element, shape, dense(shape))
        name = self.name(hint) if hint else self.fresh()
        total = max(self.size(node, kind), 1)
        self.bytes += total * element.size
        self.emit(f"{element.c} {name}[{total}];", name)
        made = Value(name, kind, root=name)
        self.written.add(name)
        if thing is not np.empty:
            cell = literal(thing is np.ones)
            self.filled(node, made, cell if element == BOOL else literal(int(thing is np.ones)))
        return made

    def _method(self, node: ast.Call, base: Value, kind: Array, name: str) -> Value:
        if name == "view":
            return self._viewed(node, base, kind)
        if name in ("reshape", "ravel") and kind.dense:
            counts = self._counts(self.operands(list(node.args))) if name == "reshape" else [-1]
            if None in counts:
                raise self.unsized(node, "a shape")
            return replace(base, type=self._reshaped(node, kind, [one for one in counts if one is not None]))
        raise self.refused(node, f"the method {name} of an array", "write the loop")

    def _counts(self, asked: list[Value]) -> list[int | None]:
        """Return the extents of a shape, told as one tuple or by itself."""
        shape = asked[0] if asked else None
        if shape is not None and isinstance(shape.type, Tuple):
            asked = [self.item(shape, k) for k in range(len(shape.type.types))]
        return [one.count for one in asked]

    def _reshaped(self, node: ast.AST, kind: Array, counts: list[int]) -> Array:
        total, rest = self.size(node, kind), math.prod(one for one in counts if one >= 0)
        shape = tuple(total // max(rest, 1) if one < 0 else one for one in counts)
        if math.prod(shape) != total:
            raise self.refused(node, f"a shape {shape} of {total} elements", "use one that fits")
        return replace(kind, shape=shape, strides=dense(shape))

    def _viewed(self, node: ast.Call, base: Value, kind: Array) -> Value:
        told = self.expression(node.args[0]).type
        thing = told.thing if isinstance(told, Known) else None
        if isinstance(thing, np.dtype) and thing.names and kind.element == FLOAT64 and kind.dense:
            return replace(base, type=RowType(thing, kind.fixed))
        if thing is np.int64 and kind.element == FLOAT64:
            return replace(base, type=replace(kind, bits=True, fixed=(), every=""))
        raise self.refused(node, "this view of an array", "view doubles as a record, or as np.int64")
