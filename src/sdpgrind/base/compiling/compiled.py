"""`compiled`: decorator of all kernels, with machine code on disk.

A kernel is compiled at its first call and kept on disk until it, a callee or a constant that it names changes
(`kernel_cache`). No kernel can be a C callback, and one whose name begins with ``_`` can be called from
kernels only: these entry points would take a third of the compile time.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any, NoReturn, overload

from numba.core import config
from numba.core.registry import CPUDispatcher

from sdpgrind.base.compiling.kernel_cache import KernelCache, alike
from sdpgrind.base.compiling.kernel_library import LinkedCompiler
from sdpgrind.base.compiling.kernel_references import KernelCompiler

# chosen: option `fastmath` for fast sums, reordered and fused; NaN and infinity stay
REORDER = {"contract", "nsz", "reassoc"}


class Kernel(CPUDispatcher):
    """A compiled function, made by `compiled`."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None, **more: Any) -> None:
        super().__init__(py_func, locals, targetoptions, **({"pipeline_class": KernelCompiler} | more))
        self._cache = KernelCache(self)
        self._result_types: dict[Any, Any] = {}

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load the code from the disk."""
        with _uncollected():
            return super().compile(sig)

    def result_type(self, sig: Any) -> Any:
        """Return numba's type of the result for types of arguments, of whatever width its whole numbers are.

        Code is compiled only where there is none for arguments that are alike, and loaded only where it must.
        """
        kinds = alike(sig)
        if kinds not in self._result_types:  # exports ask for the same ones again
            self._result_types[kinds] = self._result_type(sig, kinds)
        return self._result_types[kinds]

    def _result_type(self, sig: Any, kinds: Any) -> Any:
        made: Any = {alike(one): found for one, found in self.overloads.items()}.get(kinds)
        found = None if made else self._cache.result_type(sig, self.targetctx)
        if found is None:
            if made is None:
                self.compile(sig)
                made = self.overloads[sig]
            found = made.signature.return_type
        return found

    def entry(self, *args: Any) -> Callable[..., Any]:
        """Return what runs the kernel for arguments of the types of these, and does not look at types again.

        Of a call with tables in tuples, that look is half the time (measured). Nothing guards other types.
        """
        sig = tuple(self.typeof_pyval(one) for one in args)
        if sig not in self.overloads:
            self.compile(sig)
        found: Callable[..., Any] = self.get_overload(sig)
        return found

    def __reduce__(self) -> Any:
        """Pickle by module and name, so that another process uses its own kernel and the code on disk."""
        where, name = self.py_func.__module__, self.py_func.__qualname__
        if _of_module(where, name) is self:
            return _of_module, (where, name)
        return super().__reduce__()


class ClosedKernel(Kernel):
    """A kernel that Python cannot call: numba would follow a null pointer."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None, **more: Any) -> None:
        super().__init__(py_func, locals, targetoptions, **more, pipeline_class=LinkedCompiler)

    def __call__(self, *args: Any, **kwargs: Any) -> NoReturn:
        """Raise TypeError."""
        name = self.py_func.__name__
        raise TypeError(
            f"{name} is a kernel that only kernels can call, as its name begins with '_'; "
            f"call it from a kernel, or call sdpgrind.base.compiling.compiled.opened({name})"
        )


@overload
def compiled(function: Callable[..., Any], /) -> Kernel: ...
@overload
def compiled(**options: Any) -> Callable[[Callable[..., Any]], Kernel]: ...
def compiled(function: Callable[..., Any] | None = None, /, **options: Any) -> Any:
    """Compile a function at its first call, without the interpreter's lock, and keep the code on disk.

    Parameters
    ----------
    function : callable
        Function that numba can compile. With a name that begins with ``_`` only kernels can call it.
    **options
        Options of numba's ``njit``: ``error_model``, ``fastmath``, ``inline``, ``forceinline``,
        ``boundscheck``.

    Returns
    -------
    Kernel
        The kernel; a decorator where only options are given.

    Examples
    --------
    >>> from sdpgrind.base.compiling.compiled import compiled
    >>> @compiled(error_model="numpy")
    ... def ratio(a, b):
    ...     return a / b
    >>> ratio(1.0, 4.0)
    0.25
    """
    if function is None:
        return lambda kernel: compiled_with(kernel, options)
    return compiled_with(function, options)


def compiled_with(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Return the kernel of a function; closed if its name begins with ``_``."""
    return _made(function, options, closed=function.__name__.startswith("_"))


@cache
def opened(kernel: Kernel) -> Any:
    """Return a twin of a closed kernel that Python can call, for tests; an open one is returned itself."""
    if not isinstance(kernel, ClosedKernel):
        return kernel
    options = {key: value for key, value in kernel.targetoptions.items() if key not in _FIXED}
    return _made(kernel.py_func, options, closed=False)


_FIXED = ("nopython", "nogil", "no_cfunc_wrapper", "no_cpython_wrapper")


def _made(function: Callable[..., Any], options: dict[str, Any], closed: bool) -> Any:
    if vars(config)["DISABLE_JIT"]:
        return function
    kind = ClosedKernel if closed else Kernel
    fixed = dict(zip(_FIXED, (True, True, True, closed), strict=True))
    return kind(function, targetoptions={"boundscheck": None, **options, **fixed})


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without collections of garbage: numba's many objects make them take a tenth of compiling (measured).

    What is new then counts as old, else all of it is walked through at once: 1.5 of 35 s of centering.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            if not gc.get_freeze_count():  # else they are the user's, who wants them to stay frozen
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def _of_module(where: str, name: str) -> Any:
    """Return the attribute of a module by its qualified name, or None."""
    found: Any = import_module(where)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found
