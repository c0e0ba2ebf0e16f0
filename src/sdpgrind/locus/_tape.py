"""A function of CasADi as a tape: one flat array of numbers that a compiled loop runs, without CasADi and without Python."""

from collections.abc import Callable, Sequence

import casadi
import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._tape_kernels import Op

_OPS: dict[int, int] = {getattr(casadi, f"OP_{op.name}"): int(op) for op in Op}
_EITHER_WAY = {Op.ADD, Op.MUL, Op.EQ, Op.NE, Op.AND, Op.OR}
_MADE_OF = "expressions: operators, ** and functions of numpy or CasADi that take symbols"


def tape(function: casadi.Function) -> Floats:
    """Return the tape of a function: head, constants, three numbers an operation (what, of which two places), places of outputs.

    All inputs make one flat vector, and so do all outputs, dense and by columns. What is computed twice is computed once. Whole
    numbers stand in the array by their bits, so that the loop that reads them need not convert.
    """
    return _Packing(_expanded(function)).packed()


def _expanded(function: casadi.Function) -> casadi.Function:
    """A function of matrices as one of numbers."""
    if function.is_a("SXFunction"):
        return function
    try:
        return function.expand()
    except RuntimeError:
        raise _refused(function, casadi.OP_CALL) from None


def _refused(function: casadi.Function, what: int) -> ValueError:
    found = "a call of something that has none" if what == casadi.OP_CALL else f"the operation {_name(what)}"
    return ValueError(f"{function.name()} must be made of {_MADE_OF}; got {found}")


class _Packing:
    """A function while its operations are numbered: inputs, constants and each result have a place of their own."""

    def __init__(self, function: casadi.Function) -> None:
        self.function = function
        self.inputs, self.n_in = _positions(function.n_in(), function.sparsity_in)
        self.outputs, self.n_out = _positions(function.n_out(), function.sparsity_out)
        self.constants: dict[bytes, int] = {}
        self.operations: dict[tuple[int, int, int], int] = {}
        self.held: dict[int, int] = {}  # CasADi's places, which it uses again and again, to ours

    def packed(self) -> Floats:
        """Number everything, and put it in one array."""
        steps = range(self.function.n_instructions())
        for k in steps:  # constants first: results stand behind them
            if self.function.instruction_id(k) == casadi.OP_CONST:
                self.constant(self.function.instruction_constant(k))
        results = [self.constant(0.0)] * self.n_out  # where the pattern of an output has nothing
        for k in steps:
            self.take(k, results)
        head = [self.n_in, self.n_out, len(self.constants), len(self.operations)]
        constants = np.frombuffer(b"".join(self.constants))
        return np.concatenate([_bits(head), constants, _bits([n for one in self.operations for n in one]), _bits(results)])

    def take(self, k: int, results: list[int]) -> None:
        """Follow one of CasADi's instructions."""
        what, of, to = self.function.instruction_id(k), self.function.instruction_input(k), self.function.instruction_output(k)
        if what == casadi.OP_OUTPUT:
            results[self.outputs[to[0]][to[1]]] = self.held[of[0]]
        elif what == casadi.OP_INPUT:
            self.held[to[0]] = self.inputs[of[0]][of[1]]
        elif what == casadi.OP_CONST:
            self.held[to[0]] = self.constant(self.function.instruction_constant(k))
        elif what in (casadi.OP_ASSIGN, casadi.OP_LIFT):
            self.held[to[0]] = self.held[of[0]]
        else:
            self.held[to[0]] = self.operation(what, self.held[of[0]], self.held[of[-1]])

    def constant(self, value: float) -> int:
        """Place of a constant; those that are equal to the last bit share one."""
        return self.n_in + self.constants.setdefault(np.float64(value).tobytes(), len(self.constants))

    def operation(self, what: int, first: int, second: int) -> int:
        """Place of a result; the same operation on the same places is done once."""
        if what not in _OPS:
            raise _refused(self.function, what)
        op = _OPS[what]
        if op in _EITHER_WAY and first > second:
            first, second = second, first
        before = self.n_in + len(self.constants)
        return before + self.operations.setdefault((op, first, second), len(self.operations))


def _positions(count: int, sparsity: Callable[[int], casadi.Sparsity]) -> tuple[list[list[int]], int]:
    """Where each entry that is not structurally zero stands in the flat vector, matrix by matrix; and how long that is."""
    found, start = [], 0
    for k in range(count):
        pattern = sparsity(k)
        found.append([start + place for place in pattern.find()])
        start += pattern.numel()
    return found, start


def _bits(numbers: Sequence[int]) -> Floats:
    """Whole numbers as floats of the same bits."""
    return np.array(numbers, np.int64).view(np.float64)


def _name(what: int) -> str:
    """CasADi's name of an operation."""
    return next((name[3:].lower() for name in dir(casadi) if name.startswith("OP_") and getattr(casadi, name) == what), str(what))
