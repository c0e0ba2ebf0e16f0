"""Public names of packages, declared in ``__init__.pyi`` and imported at their first use."""

import os
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from types import MappingProxyType
from typing import Any

import lazy_loader

from sdpgrind.base.warned import warn


def attach(
    package: str,
    file: str | os.PathLike[str],
    former: Sequence[str] = (),
    renamed: Mapping[str, str] = MappingProxyType({}),
    retired: Mapping[str, tuple[str, str]] = MappingProxyType({}),
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__``, ``__all__`` of a package from the ``__init__.pyi`` by its `file`.

    `former`: sub-packages whose names were in the package in version 0.1; `renamed`: new names of old ones;
    `retired`: names that the next version lacks, with their module and what takes their place. All still work
    there, with a warning.
    """
    imported, names, every = lazy_loader.attach_stub(package, os.fspath(file))

    def attribute(name: str) -> Any:
        if name in every:
            return imported(name)
        if name in renamed:
            warn(f"{package}.{name} is now {package}.{renamed[name]}", DeprecationWarning)
            return imported(renamed[name])
        if name in retired:
            home, instead = retired[name]
            warn(f"{package}.{name} is retired: {instead}", DeprecationWarning)
            return getattr(import_module(f"{package}.{home}"), name)
        for home in () if name.startswith("_") else former:
            if name in (found := import_module(f"{package}.{home}")).__all__:
                warn(f"{package}.{name} is now {package}.{home}.{name}", DeprecationWarning)
                return getattr(found, name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return attribute, names, every
