"""Source of an export: guards against compilers that change bits, functions, `reset` and `step`."""

import inspect
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.codegen._files.digest import digest_of, digest_text
from sdpgrind.codegen._recipe import Recipe
from sdpgrind.codegen._translate.body import text_of
from sdpgrind.codegen._translate.calls import LIBM
from sdpgrind.codegen._translate.program import CProgram, Function
from sdpgrind.codegen._translate.runtime import FLAGS, GUARDS
from sdpgrind.codegen._translate.types import FLOAT64, Array, Scalar
from sdpgrind.codegen._translate.values import GUARD, Value, double

_TOP = """\
/*
 * {name}.c: {kind}, exported by sdpgrind {version}; fingerprint {fingerprint}.
 * Translated from the kernels that the library runs; see manifest.json. Do not edit.
 * Compile with {flags}.
 */
#include "{name}.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

{guards}

{definitions}
{solver}
/* Public functions; see {name}.h. */

void {name}_reset({name}_state *state)
{{
{reset}
}}

int32_t {name}_step({name}_state *state, const {name}_input *in, {name}_output *out)
{{
{step}
}}

{digest}
"""


_SOLVER = """
/* Solves the quadratic program of a step; see {name}_program.c. */
void {name}_solve(double *room);
"""
_COPIED = """\
    /* volatile: gcc 12 with AVX-512 writes a constant copy of {{NaN, NaN, 0, 0}} as four NaN */
    const volatile double *fresh = {cells};
    for (int64_t k = 0; k < {size}; k++) {{
        state->s[k] = fresh[k];
    }}"""
_DOUBLE = 8  # derived: bytes of a double


@dataclass(frozen=True)
class CSource:
    """Text of the source file, and the program behind it."""

    text: str
    program: CProgram
    step: Function
    digest: int
    """Of the numbers of its tables."""

    @property
    def libm(self) -> tuple[str, ...]:
        """Functions of the C library whose last bits are its own."""
        return tuple(name for name in LIBM.split() if name in self.program.helpers | self._within)

    @property
    def _within(self) -> set[str]:
        return {"fmod"} if "mod" in self.program.helpers else set()


def source_of(recipe: Recipe, name: str, version: str, outside: str = "") -> CSource:
    """Translate a recipe under a name; `outside`: prefix of elementary functions that are not math.h's."""
    program = CProgram(name, outside=outside, written_out=recipe.written_out)
    constants = constants_of(recipe, program)
    step, lines = _step(recipe, name, program, constants)
    reset = _reset(recipe, name, program, constants)
    program.drop_unreached(lines + reset)
    tables = program.read(lines + reset)
    digest = digest_text(name, tables)
    text = _TOP.format(
        name=name, kind=recipe.kind, version=version, fingerprint=recipe.fingerprint, guards=GUARDS,
        flags=" ".join(FLAGS),
        definitions=program.definitions(), reset=reset, step=lines, digest=digest,
        solver="" if recipe.program is None else _SOLVER.format(name=name),
    )  # fmt: skip
    return CSource(text, program, step, digest_of(tables))


def constants_of(recipe: Recipe, program: CProgram) -> list[Value]:
    """Return the constants of a recipe before the inputs, under the names of the parameters of its step."""
    names = list(inspect.signature(recipe.step.py_func).parameters)
    wanted = 2 + len(recipe.law) + len(recipe.inputs) + len(recipe.after)
    if len(names) != wanted:
        told = "step(state, *law, *inputs, *after, out)"
        raise checks.refuse("step", f"{told}, of {wanted} parameters", names)
    program.comments = dict(recipe.tables)
    return list(map(program.constant, recipe.law, names[1:], recipe.taken))


def _row(code: str, size: int) -> Value:
    return Value(code, Array(FLOAT64, (size,), (1,)), root=code)


def _call(program: CProgram, kernel: Any, values: list[Value]) -> tuple[Function, str]:
    function = program.function(kernel, values, None)
    for value, parameter in zip(values, function.parameters, strict=True):
        if parameter in function.written and not value.root:
            raise ValueError(f"{function.name} must not write to the constant {parameter}")
    texts = [text_of(program, one) for one in values] + (["&fault"] if function.faults else [])
    return function, f"{function.name}({', '.join(texts)})"


def _step(recipe: Recipe, name: str, program: CProgram, constants: list[Value]) -> tuple[Function, str]:
    inputs = [Value(f"in->{one}", FLOAT64) for one in recipe.inputs]
    fixed = tuple((int(k), float(recipe.state[k])) for k in recipe.settings)
    state = Value("s", Array(FLOAT64, (recipe.state.size,), (1,), fixed=fixed), root="s")
    after = [program.constant(one, "") for one in recipe.after]
    behind = _row("o", len(recipe.outputs))
    room = behind if recipe.program is None else _row("room", recipe.program.width)
    recipe.entry()  # its kernels tell the types of results: for narrow tables none is compiled
    function, call = _call(program, recipe.step, [state, *constants, *inputs, *after, room])
    calls = [f"status = (int32_t){call};"]
    if recipe.program is not None:
        last, finish = _call(program, recipe.program.finish, [state, *constants, room, behind])
        function = _both(function, last, recipe.program.width)
        calls += ["if (status > 0) {", f"    {name}_solve(room);", "}", f"status = (int32_t){finish};"]
    if not isinstance(function.result, Scalar) or function.result.c == "double":
        raise checks.refuse("step", "a kernel that returns a whole number, the status", function.result)
    lines = [*_declared(recipe, name, function), *_refused_inputs(recipe)]
    lines += ["(void)memcpy(s, state->s, sizeof s);", *calls]
    lines += _outside_index(name, function) if program.checked else []
    lines += [*_refused_status(function), *_taken(recipe, function)]
    return function, "\n".join(one if one.startswith("#") else "    " + one for one in lines)


def _declared(recipe: Recipe, name: str, function: Function) -> list[str]:
    """Declarations of `step`."""
    lines = [f"double s[{name.upper()}_STATE_SIZE];", f"double o[{len(recipe.outputs)}] = {{0.0}};"]
    lines += [] if recipe.program is None else [f"double room[{recipe.program.width}] = {{0.0}};"]
    lines += ["int32_t fault = 0;"] if function.faults else []
    return [*lines, "int32_t status;"]


def _refused_inputs(recipe: Recipe) -> list[str]:
    """Return of `step` before anything else, where an input is out of its range."""
    return [line for test in _outside(recipe) for line in (f"if ({test}) {{", "    return -1;", "}")]


def _outside_index(name: str, function: Function) -> list[str]:
    """Fault of `step` on the test bench, where a number was no index."""
    fault, outside = "fault = -3;" if function.faults else "return -3;", f"{name}_outside"
    test = [f"if ({outside} != 0) {{ {GUARD}", f"    {outside} = 0;", f"    {fault}", "}"]
    return ["#ifdef SG_CHECK", *test, "#endif"]


def _refused_status(function: Function) -> list[str]:
    """Return of `step` without a change, where a loop has reached its bound or the kernel refuses."""
    lines = [f"if (fault != 0) {{ {GUARD}", "    return fault;", "}"] if function.faults else []
    if function.least is None or function.least < 0:
        guard = "" if function.refuses else f" {GUARD}"
        lines += [f"if (status < 0) {{{guard}", "    return -1;", "}"]
    return lines


def _taken(recipe: Recipe, function: Function) -> list[str]:
    """End of `step`: the new state, the outputs, the status."""
    changes = function.parameters[0] in function.written
    lines = ["(void)memcpy(state->s, s, sizeof s);"] if changes else []
    return [*lines, *(f"out->{one} = o[{k}];" for k, one in enumerate(recipe.outputs)), "return status;"]


def _both(first: Function, last: Function, width: int) -> Function:
    """Return what counts of the two functions of a step with a program: its end, what either writes."""
    changes = first.parameters[0] in first.written
    written = last.written | ({last.parameters[0]} if changes else frozenset())
    stack = max(first.stack, last.stack) + _DOUBLE * width
    return replace(last, faults=first.faults or last.faults, written=written, stack=stack)


def _outside(recipe: Recipe) -> Iterator[str]:
    """Return the tests of what is out of range; a NaN is neither below nor above."""
    for one, finite, (low, high) in zip(recipe.inputs, recipe.finite, recipe.limits, strict=True):
        tests = [f"isfinite(in->{one}) == 0"] if finite else []
        tests += [f"in->{one} < {double(low)}"] if low > -math.inf else []
        tests += [f"in->{one} > {double(high)}"] if high < math.inf else []
        if tests:
            yield tests[0] if len(tests) == 1 else " || ".join(f"({test})" for test in tests)


def _reset(recipe: Recipe, name: str, program: CProgram, constants: list[Value]) -> str:
    """Lines of `reset`: the kernel that starts, or the state as it is then."""
    if recipe.start is None:
        cells = program.table(recipe.state, "reset_state").code
        return _COPIED.format(cells=cells, size=f"{name.upper()}_STATE_SIZE")
    function, call = _call(program, recipe.start, [_row("state->s", recipe.state.size), *constants])
    fault = "    int32_t fault = 0;\n" if function.faults else ""
    return f"    (void)memset(state->s, 0, sizeof state->s);\n{fault}    {call};"


def reset_state(recipe: Recipe) -> Any:
    """Return the state after a reset, as the library has it."""
    if recipe.start is None:
        return recipe.state.copy()
    state = np.zeros(recipe.state.size)
    recipe.start(state, *recipe.taken)
    return state
