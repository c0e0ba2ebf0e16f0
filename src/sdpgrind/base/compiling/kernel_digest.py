"""Digest of a kernel: of its bytecode, all callees and all constants that it names, in any module.

Equal machine code has an equal digest in any process: comments, docstrings, line numbers and addresses do not
count. A digest is taken at the first use of a kernel, since globals may be set after its definition.
"""

import builtins
import dis
import enum
import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numba.core import types

# packages whose objects count by name; `_VERSIONS` has their versions
_OUTSIDE = {"numba", "numpy", "builtins", "math", "cmath", "operator"}
_PASSES = "references borrowed"  # what `kernel_references` does to code; another text where it does more
_VERSIONS = f"{_PASSES}, numba {version('numba')}, numpy {version('numpy')}, python {sys.version_info[:2]}"
_PLAIN = (type(None), type(...), bool, int, float, complex, str, bytes, range)

_LOAD_GLOBAL = dis.opmap["LOAD_GLOBAL"]
_ABSENT = object()

_pieces: WeakKeyDictionary[Any, tuple[bytes, tuple[Any, ...]]] = WeakKeyDictionary()


def digest(kernel: Any) -> str:
    """Return the digest (SHA-256) of a kernel, its globals and all else that its machine code depends on."""
    total = hashlib.sha256(_VERSIONS.encode())
    order = {function: k for k, function in enumerate(reached(kernel))}
    for function in order:
        text, called = _piece(function)
        total.update(repr((text, [order[one] for one in called])).encode())
    return total.hexdigest()


def reached(kernel: Any) -> list[Any]:
    """Return the kernel, its globals set, and all its direct and indirect callees, each once."""
    found = {kernel: None}
    queue = [kernel]
    for function in queue:
        new = [one for one in dict.fromkeys(_piece(function)[1]) if one not in found]
        found.update(dict.fromkeys(new))
        queue += new
    return queue


def digest_of_type(kind: Any) -> str:
    """Return what the text of an argument's type lacks: digests of kernels, names of fields; else ""."""
    if isinstance(kind, types.Dispatcher):
        return digest(kind.dispatcher)
    made_by = getattr(kind, "instance_class", None)  # of a named tuple
    parts = [repr(getattr(made_by, "_fields", ""))] if made_by is not None else []
    return " ".join(parts + [digest_of_type(one) for one in getattr(kind, "types", ())])


def _piece(function: Any) -> tuple[bytes, tuple[Any, ...]]:
    """Return digest and callees of one function; cached once all its names are defined."""
    if function in _pieces:
        return _pieces[function]
    plain = getattr(function, "py_func", function)
    called: list[Any] = []
    named = list(_named(plain))
    where = plain.__globals__.get("__file__", "")
    options = sorted(getattr(function, "targetoptions", {}).items())
    rest = options, plain.__defaults__, plain.__kwdefaults__
    values = [*((name, _text(value, called, where)) for name, value in named), _text(rest, called, where)]
    text = repr((_code(plain.__code__, plain.__doc__), values)).encode()
    piece = hashlib.sha256(text).digest(), tuple(called)
    if all(value is not _ABSENT for _, value in named):
        _pieces[function] = piece
    return piece


def _code(code: CodeType, doc: str | None = None) -> Any:
    """Return bytecode and constants without docstring, line numbers and file name."""
    constants = [
        _code(one) if isinstance(one, CodeType) else f"{type(one).__name__} {one!r}"
        for one in _constants(code)
    ]
    if doc is not None and isinstance(code.co_consts[0], str):
        constants[0] = ""
    flags = code.co_flags, code.co_argcount, code.co_kwonlyargcount, code.co_exceptiontable
    return code.co_code, constants, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, flags


def _constants(code: CodeType) -> Iterator[Any]:
    """Give constants in the same order in every process."""
    for one in code.co_consts:
        yield sorted(one, key=repr) if isinstance(one, frozenset) else one


def _named(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Give names and values that a function looks up: globals, attributes of modules, closure variables."""
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    found: list[tuple[str, Any]] = [(name, _content(cell)) for name, cell in cells]
    outer = function.__globals__
    names = sorted(set(_globals(function.__code__)))
    found += [
        (name, outer.get(name, _ABSENT)) for name in names if name in outer or not hasattr(builtins, name)
    ]
    attributes = sorted(set(_attributes(function.__code__)))
    seen = set()
    for name, value in found:  # grows: modules hold modules
        yield name, value
        if isinstance(value, ModuleType) and not _outside(value.__name__) and value not in seen:
            seen.add(value)
            there = set(dir(value))
            found += [(f"{name}.{inner}", getattr(value, inner)) for inner in attributes if inner in there]


def _content(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # a recursive function is not defined yet
        return _ABSENT


def _attributes(code: CodeType) -> Iterator[str]:
    """Give names of attributes and globals, those of inner functions included."""
    for one in _codes(code):
        yield from one.co_names


def _globals(code: CodeType) -> Iterator[str]:
    """Give names of globals, with those of inner functions; from the bytes: `dis` takes 20 times as long."""
    for one in _codes(code):
        argument = 0
        for operation, byte in zip(one.co_code[::2], one.co_code[1::2], strict=True):
            argument = argument << 8 | byte
            if operation == _LOAD_GLOBAL:
                yield one.co_names[argument >> 1]  # the last bit: whether it is called
            if operation != dis.EXTENDED_ARG:
                argument = 0


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _codes(one)


def _text(value: Any, called: list[Any], where: str) -> Any:
    """Return a value as text; functions are appended to `called`, since they may call each other."""
    if isinstance(value, _PLAIN) and not isinstance(value, enum.Enum):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, FunctionType) or isinstance(getattr(value, "py_func", None), FunctionType):
        return _callee(value, called)
    if isinstance(value, tuple | list):
        return _class(type(value)), [_text(one, called, where) for one in value]
    if isinstance(value, set | frozenset):
        return type(value).__name__, sorted(repr(_text(one, called, where)) for one in value)
    if isinstance(value, dict):
        return "dict", [(_text(key, called, where), _text(one, called, where)) for key, one in value.items()]
    if isinstance(value, np.ndarray | np.generic):
        return _numbers(np.asarray(value), called, where)
    return _other(value, called, where)


def _callee(value: Any, called: list[Any]) -> str:
    if _outside(value.__module__):
        return f"{value.__module__}.{value.__qualname__}"
    called.append(value)
    return "called"


def _numbers(value: Any, called: list[Any], where: str) -> Any:
    body = [_text(one, called, where) for one in value.ravel()] if value.dtype.hasobject else value.tobytes()
    return repr(value.dtype), value.shape, value.flags.c_contiguous, value.flags.f_contiguous, body


def _other(value: Any, called: list[Any], where: str) -> Any:
    if value is _ABSENT:
        return "absent"
    if isinstance(value, ModuleType):
        return f"module {value.__name__}"
    if isinstance(value, np.dtype | types.Type):
        return repr(value)
    if isinstance(value, enum.Enum):
        return _class(type(value)), value.name
    if isinstance(value, type):
        return _class(value)
    if isinstance(value, np.ufunc) or _outside(getattr(value, "__module__", None)):
        return f"{type(value).__name__} {getattr(value, '__qualname__', getattr(value, '__name__', ''))}"
    inner = getattr(value, "_defn", None)  # of an intrinsic of numba
    return _callee(inner, called) if isinstance(inner, FunctionType) else ("in", *_sources(value, where))


def _class(value: type) -> Any:
    name = f"{value.__module__}.{value.__qualname__}"
    members = [(key, repr(one.value)) for key, one in getattr(value, "__members__", {}).items()]
    if members or hasattr(value, "_fields") or _outside(value.__module__):
        return name, getattr(value, "_fields", ()), members
    return name, _file(getattr(sys.modules.get(value.__module__), "__file__", None) or "")


def _sources(value: Any, where: str) -> Any:
    """Return digests of the files of the module that names a value and of its class."""
    return _class(type(value)), _file(where)


@cache
def _file(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest() if Path(path).is_file() else ""


def _outside(name: str | None) -> bool:
    return name is not None and name.partition(".")[0] in _OUTSIDE
