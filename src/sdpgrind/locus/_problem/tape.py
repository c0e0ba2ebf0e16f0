"""Translate a CasADi function into a tape: one flat array, run by compiled code."""

from collections.abc import Callable, Sequence

import casadi
import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.tape_kernels import Op
from sdpgrind.locus._problem.tape_powers import cheaper_powers

_OPS: dict[int, int] = {getattr(casadi, f"OP_{op.name}"): int(op) for op in Op}
_EITHER_WAY = {Op.ADD, Op.MUL, Op.EQ, Op.NE, Op.AND, Op.OR}
_MADE_OF = "expressions: operators, ** and functions of numpy or CasADi that take symbols"


def tape(function: casadi.Function) -> Floats:
    """Return the tape of a function: head, constants, runs (kind, count, operand pairs), output places.

    Inputs form one flat vector, outputs another, dense and by columns. Equal subexpressions are computed
    once; equal operations are grouped into runs. Integers are stored by their bits.
    """
    listing = _Listing(_expanded(function))
    code, results = cheaper_powers(list(listing.operations), listing.results, listing.first, listing.values)
    runs = _in_runs(code, listing.first)
    order = [k for _, members in runs for k in members]
    places = {listing.first + k: listing.first + now for now, k in enumerate(order)}
    packed: list[int] = []
    for op, members in runs:
        packed += [op, len(members), *(places.get(n, n) for k in members for n in code[k][1:])]
    head = [listing.n_in, listing.n_out, len(listing.constants), len(code), len(runs)]
    results = [places.get(n, n) for n in results]
    return np.concatenate(
        [_bits(head), np.frombuffer(b"".join(listing.constants)), _bits(packed), _bits(results)]
    )


def _expanded(function: casadi.Function) -> casadi.Function:
    """Return a function of matrices as one of scalars."""
    if function.is_a("SXFunction"):
        return function
    try:
        return function.expand()
    except RuntimeError:
        raise _refused(function, casadi.OP_CALL) from None


def _refused(function: casadi.Function, what: int) -> ValueError:
    found = "a call of something that has none" if what == casadi.OP_CALL else f"the operation {_name(what)}"
    return ValueError(f"{function.name()} must be made of {_MADE_OF}; got {found}")


class _Listing:
    """Operations of a function with numbered places for inputs, constants and results."""

    def __init__(self, function: casadi.Function) -> None:
        self.function = function
        self.inputs, self.n_in = _positions(function.n_in(), function.sparsity_in)
        self.outputs, self.n_out = _positions(function.n_out(), function.sparsity_out)
        self.constants: dict[bytes, int] = {}
        self.operations: dict[tuple[int, int, int], int] = {}
        self.held: dict[int, int] = {}  # from CasADi's work places, which it reuses, to ours
        steps = range(function.n_instructions())
        for k in steps:  # constants first: results follow them
            if function.instruction_id(k) == casadi.OP_CONST:
                self.constant(function.instruction_constant(k))
        self.results = [self.constant(0.0)] * self.n_out  # structural zeros of outputs
        self.first = self.n_in + len(self.constants)
        for k in steps:
            self.take(k)

    @property
    def values(self) -> dict[int, float]:
        """Constants by their places."""
        return {self.n_in + k: float(np.frombuffer(one)[0]) for k, one in enumerate(self.constants)}

    def take(self, k: int) -> None:
        """Translate one CasADi instruction."""
        what, of, to = (
            self.function.instruction_id(k),
            self.function.instruction_input(k),
            self.function.instruction_output(k),
        )
        if what == casadi.OP_OUTPUT:
            self.results[self.outputs[to[0]][to[1]]] = self.held[of[0]]
        elif what == casadi.OP_INPUT:
            self.held[to[0]] = self.inputs[of[0]][of[1]]
        elif what == casadi.OP_CONST:
            self.held[to[0]] = self.constant(self.function.instruction_constant(k))
        elif what in (casadi.OP_ASSIGN, casadi.OP_LIFT):
            self.held[to[0]] = self.held[of[0]]
        else:
            self.held[to[0]] = self.operation(what, self.held[of[0]], self.held[of[-1]])

    def constant(self, value: float) -> int:
        """Return the place of a constant; bit-equal ones share it."""
        return self.n_in + self.constants.setdefault(np.float64(value).tobytes(), len(self.constants))

    def operation(self, what: int, first: int, second: int) -> int:
        """Return the place of a result; equal operations share it."""
        if what not in _OPS:
            raise _refused(self.function, what)
        op = _OPS[what]
        if op in _EITHER_WAY and first > second:
            first, second = second, first
        return self.first + self.operations.setdefault((op, first, second), len(self.operations))


def _in_runs(code: list[tuple[int, int, int]], first: int) -> list[tuple[int, list[int]]]:
    """Group operations (kind, operands) into runs of one kind, in order of dependence.

    Each step takes all ready operations of the kind with the longest remaining path.
    """
    users: list[list[int]] = [[] for _ in code]
    lacking = [0] * len(code)
    for k, (_, *places) in enumerate(code):
        for place in {n - first for n in places if n >= first}:
            users[place].append(k)
            lacking[k] += 1
    way = [0] * len(code)
    for k in reversed(range(len(code))):
        way[k] = 1 + max((way[user] for user in users[k]), default=0)
    ready: dict[int, list[int]] = {}
    for k, lacks in enumerate(lacking):
        if not lacks:
            ready.setdefault(code[k][0], []).append(k)
    runs = []
    while ready:
        op = max(ready, key=lambda kind: (max(way[k] for k in ready[kind]), len(ready[kind])))
        runs.append((op, ready.pop(op)))
        for k in runs[-1][1]:
            for user in users[k]:
                lacking[user] -= 1
                if not lacking[user]:
                    ready.setdefault(code[user][0], []).append(user)
    return runs


def _positions(count: int, sparsity: Callable[[int], casadi.Sparsity]) -> tuple[list[list[int]], int]:
    """Return the places of structural nonzeros in the flat vector, matrix by matrix, and its length."""
    found, start = [], 0
    for k in range(count):
        pattern = sparsity(k)
        found.append([start + place for place in pattern.find()])
        start += pattern.numel()
    return found, start


def _bits(numbers: Sequence[int]) -> Floats:
    """Return integers as floats of the same bits."""
    return np.array(numbers, np.int64).view(np.float64)


def _name(what: int) -> str:
    """Return CasADi's name of an operation."""
    return next(
        (
            name[3:].lower()
            for name in dir(casadi)
            if name.startswith("OP_") and getattr(casadi, name) == what
        ),
        str(what),
    )
