"""Flags that kernels share, by which numba finds what it prepared before.

numba keeps its own functions (an array's entry, `numpy.empty`), once prepared, by the types of the arguments
and the flags of the kernel that calls them. All its flags have one hash: to find equal ones it compares one
option after another, a tenth of compiling (measured), and more the more kernels a process has compiled.
"""

from typing import Any

from numba.core.compiler import Flags

_OWN = ("inline", "no_cpython_wrapper")  # options of a kernel that no function of numba inherits
_shared: list[tuple[dict[str, Any], Any]] = []
"""Values of options without `_OWN`, and the flags with them."""


class KernelFlags(Flags):
    """Flags of a kernel that numba begins to compile; it looks up its functions with their copy."""

    def copy(self) -> Any:
        """Return the flags shared by all kernels that differ in `_OWN` at most; called under numba's lock."""
        flags: Any = self
        values = {name: value for name, value in flags.values().items() if name not in _OWN}
        for known, shared in _shared:
            if known == values:
                return shared
        made: Any = SharedFlags
        _shared.append((values, made(self)))
        for name in _OWN:
            _shared[-1][1].discard(name)
        return _shared[-1][1]


class SharedFlags(Flags):
    """Flags that are equal only to themselves."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__

    def copy(self) -> Any:
        """Return flags of numba's class with the same options."""
        flags: Any = Flags
        return flags(self)
