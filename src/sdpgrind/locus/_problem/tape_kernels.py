"""Run a tape: elementary operations packed in one flat array; see `tape`."""

import math
from enum import IntEnum

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

COUNTS = 5  # derived: head of a tape: numbers of inputs, outputs, constants, results, runs
BLOCK = 32  # chosen: points run at once; more leaves the first-level cache
_ONE, _TWO = np.uint64(1), np.uint64(2)  # unsigned: no test for negative indices
Op = IntEnum(
    "Op",
    "ADD SUB MUL DIV NEG SQ TWICE INV SQRT CONSTPOW POW EXP LOG FABS "
    "SIN COS TAN ASIN ACOS ATAN ATAN2 SINH COSH TANH ASINH ACOSH ATANH ERF LOG1P EXPM1 HYPOT "
    "LT LE EQ NE NOT AND OR IF_ELSE_ZERO FMIN FMAX SIGN COPYSIGN FLOOR CEIL FMOD REMAINDER",
    start=0,
)
"""Operations of a tape, named as CasADi's without ``OP_``."""


@compiled(error_model="numpy")
def work_size(tape):
    """Return the size of the work array of `run`."""
    counts = tape[:COUNTS].view(np.int64)
    return counts[0] + counts[2] + counts[3]


@compiled(error_model="numpy")
def output_size(tape):
    """Return the number of outputs of `run`."""
    return tape[:COUNTS].view(np.int64)[1]


@compiled(error_model="numpy")
def run(tape, inputs, work, out):
    """Evaluate a tape at flat `inputs` into flat `out`, by columns; `work` has at least `work_size` numbers.

    `work` holds inputs, constants, then the result of each operation; nothing is overwritten. The loops stand
    here because a call with array slices costs as much as a run.
    """
    code = tape.view(np.uint64)
    n_in, n_out, n_const, n_run = code[0], code[1], code[2], code[4]
    for k in range(n_in):
        work[k] = inputs[k]
    for k in range(n_const):
        work[n_in + k] = tape[COUNTS + k]
    at, to = np.uint64(COUNTS) + n_const, n_in + n_const
    for _ in range(n_run):
        op, end = np.int64(code[at]), to + code[at + _ONE]
        at += _TWO
        if op == Op.MUL:
            while to < end:
                work[to] = work[code[at]] * work[code[at + _ONE]]
                at, to = at + _TWO, to + _ONE
        elif op == Op.ADD:
            while to < end:
                work[to] = work[code[at]] + work[code[at + _ONE]]
                at, to = at + _TWO, to + _ONE
        elif op == Op.SUB:
            while to < end:
                work[to] = work[code[at]] - work[code[at + _ONE]]
                at, to = at + _TWO, to + _ONE
        elif op == Op.DIV:
            while to < end:
                work[to] = work[code[at]] / work[code[at + _ONE]]
                at, to = at + _TWO, to + _ONE
        else:
            while to < end:
                work[to] = _apply(op, work[code[at]], work[code[at + _ONE]])
                at, to = at + _TWO, to + _ONE
    for k in range(n_out):
        out[k] = work[code[at + k]]


@compiled(error_model="numpy")
def _room(tape, count):
    """Return the work array of `_run_block` for `count` points, a row per place, with constants."""
    counts = tape[:COUNTS].view(np.int64)
    work = np.empty(work_size(tape) * count)
    for k in range(counts[2]):
        first = (counts[0] + k) * count
        work[first : first + count] = tape[COUNTS + k]
    return work


@compiled(error_model="numpy")
def _run_block(tape, work, out):
    """Evaluate a tape at all rows of `out` (points, outputs); the first rows of `work` are inputs.

    Operation by operation over all points: one branch per operation, vectorised arithmetic.
    """
    code, size = tape.view(np.uint64), np.uint64(out.shape[0])
    n_out, n_const = code[1], code[2]
    at, to = np.uint64(COUNTS) + n_const, (code[0] + n_const) * size
    for _ in range(code[4]):
        op, count = np.int64(code[at]), code[at + _ONE]
        at += _TWO
        for _ in range(count):
            _row(op, work, code[at] * size, code[at + _ONE] * size, to, size)
            at, to = at + _TWO, to + size
    for k in range(n_out):
        first = code[at + k] * size
        for i in range(size):
            out[i, k] = work[first + i]


@compiled(inline="always")
def _row(op, work, x, y, to, size):
    """Apply one operation to numbers from `x` and `y` on."""
    if op == Op.MUL:
        for k in range(size):
            work[to + k] = work[x + k] * work[y + k]
    elif op == Op.ADD:
        for k in range(size):
            work[to + k] = work[x + k] + work[y + k]
    elif op == Op.SUB:
        for k in range(size):
            work[to + k] = work[x + k] - work[y + k]
    elif op == Op.DIV:
        for k in range(size):
            work[to + k] = work[x + k] / work[y + k]
    elif op == Op.SQRT:
        for k in range(size):
            work[to + k] = np.sqrt(work[x + k])
    else:
        for k in range(size):
            work[to + k] = _apply(op, work[x + k], work[y + k])


@compiled(error_model="numpy")
def run_many(tape, inputs, out):
    """Evaluate a tape at each row of `inputs` (k, n_in) into the rows of `out` (k, n_out)."""
    whole = len(inputs) // BLOCK * BLOCK
    if whole:
        work = _room(tape, BLOCK)
        for since in range(0, whole, BLOCK):
            for i in range(inputs.shape[1]):
                for k in range(BLOCK):
                    work[i * BLOCK + k] = inputs[since + k, i]
            _run_block(tape, work, out[since : since + BLOCK])
    single = np.empty(work_size(tape))
    for k in range(whole, len(inputs)):
        run(tape, inputs[k], single, out[k])


@compiled(error_model="numpy")
def _apply(op, x, y):
    """Return the result of an operation without a loop of its own."""
    if op == Op.NEG:
        return -x
    if op == Op.SQ:
        return x * x
    if op == Op.TWICE:
        return x + x
    if op == Op.INV:
        return 1.0 / x
    if op == Op.SQRT:
        return np.sqrt(x)
    if op == Op.CONSTPOW or op == Op.POW:
        return x**y
    if op == Op.EXP:
        return math.exp(x)
    if op == Op.LOG:
        return np.log(x)
    if op == Op.FABS:
        return abs(x)
    return _smooth(op, x, y) if op < Op.LT else _choice(op, x, y)


@compiled(error_model="numpy")
def _smooth(op, x, y):
    """Return the result of a transcendental function."""
    if op == Op.SIN:
        return math.sin(x)
    if op == Op.COS:
        return math.cos(x)
    if op == Op.TAN:
        return math.tan(x)
    if op == Op.ASIN:
        return np.arcsin(x)
    if op == Op.ACOS:
        return np.arccos(x)
    if op == Op.ATAN:
        return math.atan(x)
    if op == Op.ATAN2:
        return math.atan2(x, y)
    if op == Op.SINH:
        return np.sinh(x)
    if op == Op.COSH:
        return np.cosh(x)
    if op == Op.TANH:
        return math.tanh(x)
    if op == Op.ASINH:
        return np.arcsinh(x)
    if op == Op.ACOSH:
        return np.arccosh(x)
    if op == Op.ATANH:
        return np.arctanh(x)
    if op == Op.ERF:
        return math.erf(x)
    if op == Op.LOG1P:
        return np.log1p(x)
    return np.expm1(x) if op == Op.EXPM1 else np.hypot(x, y)


@compiled(error_model="numpy")
def _choice(op, x, y):
    """Return the result of a comparison, logic (nonzero, NaN: true), or function with kinks."""
    if op == Op.LT:
        return 1.0 if x < y else 0.0
    if op == Op.LE:
        return 1.0 if x <= y else 0.0
    if op == Op.EQ:
        return 1.0 if x == y else 0.0
    if op == Op.NE:
        return 1.0 if x != y else 0.0
    if op == Op.NOT:
        return 1.0 if x == 0.0 else 0.0
    if op == Op.AND:
        return 1.0 if x != 0.0 and y != 0.0 else 0.0
    if op == Op.OR:
        return 1.0 if x != 0.0 or y != 0.0 else 0.0
    if op == Op.IF_ELSE_ZERO:
        return y if x != 0.0 else 0.0
    if op == Op.FMIN:
        return np.fmin(x, y)
    if op == Op.FMAX:
        return np.fmax(x, y)
    if op == Op.SIGN:
        return np.sign(x)
    if op == Op.COPYSIGN:
        return math.copysign(x, y)
    if op == Op.FLOOR:
        return np.floor(x)
    if op == Op.CEIL:
        return np.ceil(x)
    return np.fmod(x, y) if op == Op.FMOD else _remainder(x, y)


@compiled(error_model="numpy")
def _remainder(x, y):
    """Return the IEEE 754 remainder: x minus the nearest multiple of y, the even one of two."""
    if np.isinf(y):
        return x if np.isfinite(x) else np.nan
    size = abs(y)
    left = np.fmod(abs(x), 2.0 * size) if 2.0 * size != np.inf else abs(x)
    if left - size > -left:
        left -= size
        if left - size >= -left:
            left -= size
    return left if x >= 0.0 else -left
