"""A tape as straight lines of Python, one an operation: no interpreter, no loop, no room."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.tape_kernels import COUNTS, Op

_LINES = {
    Op.ADD: "{0} + {1}", Op.SUB: "{0} - {1}", Op.MUL: "{0} * {1}", Op.DIV: "{0} / {1}", Op.NEG: "-{0}",
    Op.SQ: "{0} * {0}", Op.TWICE: "{0} + {0}", Op.INV: "1.0 / {0}", Op.SQRT: "np.sqrt({0})",
    Op.CONSTPOW: "np.power({0}, {1})", Op.POW: "np.power({0}, {1})", Op.FABS: "abs({0})",
    Op.EXP: "np.exp({0})", Op.LOG: "np.log({0})", Op.LOG1P: "np.log1p({0})", Op.EXPM1: "np.expm1({0})",
    Op.SIN: "np.sin({0})", Op.COS: "np.cos({0})", Op.TAN: "np.tan({0})", Op.ASIN: "np.arcsin({0})",
    Op.ACOS: "np.arccos({0})", Op.ATAN: "np.arctan({0})", Op.ATAN2: "np.arctan2({0}, {1})",
    Op.SINH: "np.sinh({0})", Op.COSH: "np.cosh({0})", Op.TANH: "np.tanh({0})", Op.HYPOT: "np.hypot({0}, {1})",
    Op.LT: "1.0 if {0} < {1} else 0.0", Op.LE: "1.0 if {0} <= {1} else 0.0",
    Op.EQ: "1.0 if {0} == {1} else 0.0", Op.NE: "1.0 if {0} != {1} else 0.0",
    Op.NOT: "1.0 if {0} == 0.0 else 0.0", Op.AND: "1.0 if {0} != 0.0 and {1} != 0.0 else 0.0",
    Op.OR: "1.0 if {0} != 0.0 or {1} != 0.0 else 0.0", Op.IF_ELSE_ZERO: "{1} if {0} != 0.0 else 0.0",
    Op.COPYSIGN: "np.copysign({0}, {1})", Op.FLOOR: "np.floor({0})", Op.CEIL: "np.ceil({0})",
    Op.FMOD: "np.fmod({0}, {1})",
}  # fmt: skip
"""Operation -> its line in the subset that is translated to C; others have none of their bits there."""


def straight_lines(tape: Floats, inputs: list[str], outputs: Sequence[int]) -> tuple[list[str], list[str]]:
    """Return lines that some outputs of a tape need, of inputs by names, and the names of these outputs.

    Raises ValueError for an operation that is not translated.
    """
    whole = tape[:COUNTS].view(np.int64)
    constants = [_number(one) for one in tape[COUNTS : COUNTS + whole[2]].tolist()]
    operations, results = _operations(tape)
    names = [*inputs, *constants, *(f"r{k}" for k in range(len(operations)))]
    first, wanted = len(inputs) + len(constants), {results[k] for k in outputs}
    lines: list[str] = []
    for k, (op, *places) in reversed(list(enumerate(operations))):
        if first + k in wanted:
            wanted |= set(places)
            lines.append(f"r{k} = {_line(op, [names[one] for one in places])}")
    return lines[::-1], [names[results[k]] for k in outputs]


def _operations(tape: Floats) -> tuple[list[tuple[int, int, int]], list[int]]:
    """Return the operations of a tape, kind and two places, and the places of its outputs."""
    whole = tape.view(np.int64).tolist()
    _, n_out, n_const, _, n_run = whole[:COUNTS]
    at, found = COUNTS + n_const, []
    for _ in range(n_run):
        op, count = whole[at : at + 2]
        at += 2
        found += [(op, whole[at + 2 * k], whole[at + 2 * k + 1]) for k in range(count)]
        at += 2 * count
    return found, whole[at : at + n_out]


def _line(op: int, names: list[str]) -> str:
    if op not in _LINES:
        told = f"without the operation {Op(op).name.lower()}, for which C has no function of the same bits"
        raise ValueError(f"expressions of the process must be {told}")
    return _LINES[Op(op)].format(*names)


def _number(value: float) -> str:
    """Return a constant that reads back as the same."""
    if value != value or value in (np.inf, -np.inf):
        return "np.nan" if value != value else f"({'-' * (value < 0)}np.inf)"
    return repr(value) if np.copysign(1.0, value) > 0.0 else f"({value!r})"
