"""Origin of a page: fields of a problem, versions, machine."""

import dataclasses
import json
import platform
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from sdpgrind.base.brief import SHORT
from sdpgrind.base.quantities import Described
from sdpgrind.base.sheets.amounts import Amounts, cell
from sdpgrind.base.sheets.blocks import AmountTable, Block, Embedded, Heading, Sentences
from sdpgrind.base.stored import encode

_PACKAGES = ("numpy", "scipy", "numba", "casadi")
_DEEP = 4  # levels of objects in objects that are listed; chosen: more are parts of parts of laws


def versions() -> dict[str, str]:
    """Return versions of library, Python and packages, and the machine that compiled code depends on."""
    from sdpgrind import __version__

    found = {"library": __version__, "python": platform.python_version()}
    found |= {name: _installed(name) for name in _PACKAGES}
    return found | {"system": f"{platform.system()} {platform.machine()}", "processor": _processor()}


@cache  # each look reads files; a page takes two
def _installed(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


def _processor() -> str:
    """Name of the processor as the compiler knows it."""
    from llvmlite import binding

    return str(binding.get_host_cpu_name())


def versions_table() -> AmountTable:
    """Return the table of `versions`."""
    rows = [Amounts.of(name, [value]) for name, value in versions().items()]
    return AmountTable("Versions and machine", rows, ("what", "is"))


def problem_blocks(problem: Any, plain: str | None = None) -> Iterator[Block]:
    """Yield heading, table of all fields, and data of a problem; `plain`: its JSON if it is known."""
    yield Heading("Problem and model")
    fields = list(_fields(problem, ""))
    if fields:
        yield AmountTable(type(problem).__name__, fields, ("field", "value"))
    else:
        yield Sentences([repr(problem)])
    data = plain_of(problem) if plain is None else json.loads(plain)
    if data is None:
        yield Sentences(["It holds functions of its own, so the page cannot hold it as data."])
    else:
        yield Embedded("problem", data)


def plain_of(thing: Any) -> Any:
    """Return the plain values of a stored dataclass or a mapping; None: it holds functions, or is none."""
    try:
        return json.loads(encode(thing))
    except TypeError:
        return None


def _fields(thing: Any, path: str) -> Iterator[Amounts]:
    """Yield a row for each field of a dataclass and of those in it, with its unit."""
    known = thing._field_units() if isinstance(thing, Described) else {}
    for field in dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ():
        value, name = getattr(thing, field.name), f"{path}{field.name}"
        if not field.repr or field.name.startswith("_"):
            continue
        if dataclasses.is_dataclass(value) and name.count(".") < _DEEP:
            yield from _fields(value, f"{name}.")
        else:
            yield Amounts(name, (_value(value),), known.get(field.name, ""), name)


def _value(value: Any) -> Any:
    """A number as it is, anything else as a short text."""
    if value is None:
        return "none"
    if isinstance(value, bool | int | float | str | np.generic):
        return cell(value)
    if isinstance(value, Mapping | tuple | list) and not value:
        return "none"
    if isinstance(value, Mapping):
        return ", ".join(f"{name}: {_value(each)}" for name, each in value.items())
    if isinstance(value, tuple | list) and any(isinstance(each, np.ndarray) for each in value):
        return f"{sum(map(np.size, value))} values in {len(value)} arrays"
    if isinstance(value, tuple | list | np.ndarray) and np.size(value) <= SHORT:
        return ", ".join(f"{each:.6g}" if isinstance(each, float) else str(each) for each in value)
    if isinstance(value, tuple | list | range | np.ndarray):
        return f"{np.size(value)} values"
    return _named(value)


def _named(value: Any) -> str:
    return str(getattr(value, "__name__", None) or type(value).__name__)
