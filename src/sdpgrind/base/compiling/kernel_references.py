"""Kernels without counts of references: they borrow their arrays from the caller.

numba counts the references to an array at each assignment and each call, by atomic additions that it cannot
remove from loops: a third of the time of kernels that call others (measured), and of their machine code. A
kernel that makes no array and returns none needs no counts: its caller holds what it gave until it returns.
"""

from collections.abc import Iterable
from typing import Any

from numba.core import ir, types
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.typed_passes import IRLegalization

from sdpgrind.base.compiling.kernel_contexts import KnownTypes, know_sizes
from sdpgrind.base.compiling.kernel_flags import KernelFlags

_VIEWS = ("getitem", "static_getitem")
_FIELDS = ("getattr", "exhaust_iter", *_VIEWS)
_NAMED = ir.Arg | ir.Var | ir.Const | ir.Global | ir.FreeVar
_HARMLESS = ir.Del | ir.Jump | ir.Branch | ir.Return | ir.Raise | ir.StaticRaise


class KernelCompiler(Compiler):
    """Compiler of kernels: numba's, under `KernelFlags`, and `BorrowedReferences` before the code."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function; numba copies the flags once before it asks for the passes."""
        flags: Any = KernelFlags
        compiler: Any = super()
        self.state.flags = flags(self.state.flags)
        self.state.typingctx = KnownTypes(self.state.typingctx)
        know_sizes(self.state.targetctx)
        return compiler.compile_extra(func)

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        flags: Any = Flags
        self.state.flags = flags(self.state.flags)
        compiler: Any = super()
        (passes,) = compiler.define_pipelines()
        passes.add_pass_after(BorrowedReferences, IRLegalization)
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=False, analysis_only=True)
class BorrowedReferences(AnalysisPass):
    """Turn the counts off where a kernel only borrows arrays."""

    _name = "sdpgrind_borrowed_references"

    def __init__(self) -> None:
        begin: Any = super().__init__  # numba's is abstract
        begin()

    def run_pass(self, state: Any) -> bool:
        """Choose the target of the code that follows."""
        if KernelTypes(state).borrowed:
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
            vars(state.targetctx).pop("nrt", None)  # what makes arrays, of the target with counts
        return False


class KernelTypes:
    """Types of a kernel's variables, and what its statements do with those that hold arrays."""

    def __init__(self, state: Any) -> None:
        self._types, self._returned = state.typemap, state.return_type
        self._blocks, self._models = state.func_ir.blocks.values(), state.targetctx.data_model_manager

    @property
    def borrowed(self) -> bool:
        """Whether no statement makes an array, nor may make one inside a function of numba."""
        statements = (statement for block in self._blocks for statement in block.body)
        return not self._holds(self._returned) and all(map(self._borrows, statements))

    def _holds(self, kind: Any) -> bool:
        return bool(self._models[kind].contains_nrt_meminfo())

    def _hold(self, variables: Iterable[Any]) -> bool:
        """Whether any of some variables holds an array."""
        return any(self._holds(self._types[one.name]) for one in variables)

    def _borrows(self, statement: Any) -> bool:
        if isinstance(statement, ir.Assign):
            made = self._hold([statement.target])
            if isinstance(statement.value, ir.Expr):
                return self._finds(statement.value, made)
            return isinstance(statement.value, _NAMED)  # a generator's yield outlives the call
        if isinstance(statement, ir.SetItem | ir.StaticSetItem):
            return not self._hold([statement.value])  # an array may overlap, and is copied then
        return isinstance(statement, _HARMLESS)

    def _finds(self, expression: Any, made: bool) -> bool:
        """Whether an expression only finds a number, or what holds an array (`made`) in its operands."""
        if expression.op == "call":
            return self._calls(expression, made)
        if expression.op in _FIELDS:
            return not made or self._is_part(expression)
        return expression.op == "build_tuple" or not (made or self._hold(expression.list_vars()))

    def _is_part(self, expression: Any) -> bool:
        """Whether an expression is an entry of a tuple, or a view of an array."""
        whole = self._types[expression.value.name]
        if isinstance(whole, types.Array):
            return expression.op in _VIEWS and not self._hold(expression.list_vars()[1:])
        return isinstance(whole, types.BaseTuple)

    def _calls(self, call: Any, made: bool) -> bool:
        """Whether a call makes a named tuple, or a number: a kernel from arrays, others from numbers."""
        function = self._types[call.func.name]
        if made or isinstance(function, types.NamedTupleClass):
            return isinstance(function, types.NamedTupleClass)
        kernel = isinstance(function, types.Dispatcher) or getattr(function, "typing_key", None) is len
        return kernel or not self._hold(call.list_vars())
