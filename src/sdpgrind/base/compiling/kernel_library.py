"""Code of closed kernels: bitcode that callers link in, without machine code of its own."""

from typing import Any

from llvmlite.binding import parse_assembly, parse_bitcode
from numba.core.codegen import JITCodeLibrary

from sdpgrind.base.compiling.kernel_references import KernelCompiler

_ENVIRONMENT = "_ZN08NumbaEnv"  # source: numba, `CompileResult._find_referenced_environments`


class LinkedLibrary(JITCodeLibrary):
    """Library of a kernel that only kernels call: each caller links a copy of its code."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: no machine code."""
        library: Any = self
        library._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return name, kind and bitcode for the disk."""
        library: Any = self
        return library.serialize_using_bitcode()

    @classmethod
    def restored(cls, codegen: Any, kept: tuple[str, str, bytes]) -> Any:
        """Return the library of what `serialize_using_object_code` gave."""
        make: Any = cls
        name, _, bitcode = kept
        library = make(codegen, name)
        library._final_module = parse_bitcode(bitcode)
        library._finalize_final_module()
        return library

    def _optimize_functions(self, ll_module: Any) -> None:
        """Optimise the functions of a module, by passes that are made once, not for each name in it."""
        codegen: Any = self._codegen
        ll_module.data_layout = codegen._data_layout
        passes, builder = codegen._function_pass_manager()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Prepare the module for callers: their passes optimise the copies, once for all levels of calls.

        With all passes here, too, first use of centering compiles in 34 instead of 29 s (measured).
        """
        codegen: Any = self._codegen
        cheap = {"loop_vectorize": codegen._loopvect, "slp_vectorize": False, "opt": codegen._opt_level}
        passes, builder = codegen._module_pass_manager(**cheap, cost="cheap")
        library: Any = self
        passes.run(library._final_module, builder)

    def _finalize_final_module(self) -> None:
        """Define the environments, which all copies of the code share, and nothing else."""
        library: Any = self
        library._finalize_dynamic_globals()
        library._verify_declare_only_symbols()
        variables = library._final_module.global_variables
        shared = "\n".join(str(one) for one in variables if one.name.startswith(_ENVIRONMENT))
        library._environments = parse_assembly(shared)
        library._codegen._add_module(library._environments)
        library._codegen._engine.finalize_object()
        library._finalized = True


class LinkedCompiler(KernelCompiler):
    """Compiler of closed kernels."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function into a `LinkedLibrary`."""
        library: Any = LinkedLibrary
        compiler: Any = super()
        self.state.library = library(self.state.targetctx.codegen(), func.__qualname__)
        return compiler.compile_extra(func)


class LinkedTarget:
    """numba's target, by which a closed kernel from the disk gets no machine code either."""

    def __init__(self, target: Any) -> None:
        self._target = target

    def __getattr__(self, name: str) -> Any:
        return getattr(self._target, name)

    def codegen(self) -> Any:
        """Return what numba asks for the library."""
        return self

    def unserialize_library(self, kept: Any) -> Any:
        """Return the library of a kernel."""
        return LinkedLibrary.restored(self._target.codegen(), kept)
