"""Machine code of kernels on disk: numba's cache with a stamp of all callees and constants.

numba's own stamp is that of the kernel's file and misses edits in other modules.
"""

import pickle
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import sigutils, types
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache, _Cache

from sdpgrind.base.compiling.compile_line import listen
from sdpgrind.base.compiling.kernel_digest import digest, digest_of_type
from sdpgrind.base.compiling.kernel_library import LinkedTarget
from sdpgrind.base.warned import warn

_SIGNATURE = 3  # source: numba 0.6x, CompileResult._reduce
_lines: dict[tuple[str, str], list[int]] = {}
"""(file, name) -> first lines of the functions of that name, in the order of definition."""


class KernelCache(_Cache):
    """Cache of one kernel; it reads globals and disk at the first call of the kernel."""

    def __init__(self, kernel: Any) -> None:
        self._kernel = kernel
        self._number = _number(kernel.py_func)
        self._opened: Any = None

    @property
    def cache_path(self) -> str | None:
        """Folder of the files; None: no folder can be written."""
        path: str | None = self._files().cache_path
        return path

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None: there is none, or it is out of date."""
        found = None
        try:
            found = self._files().load_overload(sig, target_context)
        except (EOFError, pickle.UnpicklingError, ImportError, AttributeError):  # torn, or a name is gone
            with suppress(OSError):
                self.flush()
        except OSError:
            pass
        if found is None:
            listen()
        return found

    def result_type(self, sig: Any, target_context: Any) -> Any:
        """Return numba's type of the result for types that are `alike`, without code; None: not on disk."""
        files = self._files()
        with suppress(EOFError, pickle.UnpicklingError, ImportError, AttributeError, OSError):
            return files.result_type(sig, target_context) if isinstance(files, _Files) else None
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the machine code for a signature."""
        try:
            self._files().save_overload(sig, data)
        except OSError as error:
            self._opened = NullCache()
            _warn_once(error.strerror or str(error))

    def enable(self) -> None:
        """Use the files."""
        self._files().enable()

    def disable(self) -> None:
        """Do not use the files."""
        self._files().disable()

    def flush(self) -> None:
        """Remove the code on disk."""
        self._files().flush()

    def _files(self) -> Any:
        if self._opened is None:
            try:
                self._opened = _Files(self._kernel, self._number)
            except RuntimeError:  # numba found no folder, or the kernel was typed at a prompt
                self._opened = NullCache()
                if Path(self._kernel.py_func.__code__.co_filename).is_file():
                    _warn_once("no folder can be written")
        return self._opened


class _Files(FunctionCache):
    """Index and data of one kernel. Both hold the digest: a process that ends between writing the two leaves
    an index entry whose data are missing or old.
    """

    def __init__(self, kernel: Any, number: int) -> None:
        FunctionCache.__init__(self, kernel.py_func)
        self._closed = kernel.targetoptions["no_cpython_wrapper"]
        self._digest = digest(kernel)
        self._cache_file = IndexDataCacheFile(
            self._cache_path, _file_name(kernel, number, self._digest), self._digest
        )

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        args, _ = sigutils.normalize_signature(sig)
        return sig, codegen.magic_tuple(), self._digest, tuple(digest_of_type(kind) for kind in args)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        found = self._kept(sig, target_context)
        if found is None:
            return None
        target = LinkedTarget(target_context) if self._closed else target_context
        return self._impl.rebuild(target, found)._replace(target_context=target_context)

    def result_type(self, sig: Any, target_context: Any) -> Any:
        """Return the type of the result for types that are `alike`; None: it is not on disk."""
        same = [key[0] for key in self._cache_file._load_index() if alike(key[0]) == alike(sig)]
        kept = (self._kept(one, target_context) for one in same)
        return next((found[_SIGNATURE].return_type for found in kept if found is not None), None)

    def _kept(self, sig: Any, target_context: Any) -> Any:
        key = self._index_key(sig, target_context.codegen())
        found = self._cache_file.load(key) if self._enabled else None
        return found[1] if found is not None and found[0] == key else None

    def _save_overload(self, sig: Any, data: Any) -> None:
        if self._enabled and self._impl.check_cachable(data):
            self._impl.locator.ensure_cache_path()
            key = self._index_key(sig, data.codegen)
            code = self._impl.reduce(data._replace(type_annotation=""))  # a text, a third of all on disk
            self._cache_file.save(key, (key, code))


def alike(sig: Iterable[Any]) -> tuple[Any, ...]:
    """Return what of the types of arguments decides on that of a result, but for the width of whole numbers.

    A literal, the width of a number with a sign, and the layout of an array do not.
    """
    return tuple(map(_plain, sig))


def _plain(kind: Any) -> Any:
    kind = types.unliteral(kind)
    if isinstance(kind, types.BaseTuple):
        return getattr(kind, "instance_class", tuple), alike(getattr(kind, "types", ()))
    if isinstance(kind, types.Array):
        return types.Array, _plain(kind.dtype), kind.ndim
    return types.int64 if getattr(kind, "signed", False) else kind


def _file_name(kernel: Any, number: int, stamp: str) -> str:
    """Return a name without a line number; functions made by a function share it and need their digest."""
    function = kernel.py_func
    place = Path(function.__code__.co_filename).stem
    name = function.__qualname__.replace("<", "").replace(">", "")
    closed = kernel.targetoptions["no_cpython_wrapper"]
    twin = "-opened" if function.__name__.startswith("_") and not closed else ""
    which = stamp[:12] if "<locals>" in function.__qualname__ else str(number)
    return f"{place}.{name}-{which}{twin}.py{sys.version_info[0]}{sys.version_info[1]}"


def _number(function: Any) -> int:
    """Return the number of a function among those of equal name in a file."""
    code = function.__code__
    lines = _lines.setdefault((code.co_filename, function.__qualname__), [])
    if code.co_firstlineno not in lines:
        lines.append(code.co_firstlineno)
    return lines.index(code.co_firstlineno)


@cache
def _warn_once(reason: str) -> None:
    warn(
        f"compiled kernels cannot be kept on disk ({reason}), so every process compiles them again; "
        "set NUMBA_CACHE_DIR to a folder that can be written"
    )
