"""Fingerprints of objects: equal for equal plants and controllers in any process."""

import dataclasses
import functools
import hashlib
import types
from collections.abc import Mapping
from typing import Any

import numpy as np

_PLAIN = (type(None), bool, int, str, bytes, complex)


def fingerprint(thing: Any) -> str:
    """Return a SHA-256 digest of the content of `thing`, 64 hexadecimal digits."""
    digest = hashlib.sha256()
    _feed(digest.update, thing, ())
    return digest.hexdigest()


def _feed(take: Any, thing: Any, above: tuple[int, ...]) -> None:
    if id(thing) in above:
        take(f"<{above.index(id(thing))}>".encode())
        return
    if isinstance(thing, _PLAIN):
        take(f"{type(thing).__name__}:{thing!r};".encode())
    elif isinstance(thing, float):
        take(f"float:{float(thing).hex()};".encode())
    elif isinstance(thing, np.ndarray) and thing.dtype != object:
        take(f"array:{thing.dtype.str}{thing.shape};".encode())
        take(np.ascontiguousarray(thing).tobytes())
    else:
        take(f"{type(thing).__module__}.{type(thing).__qualname__}(".encode())
        for piece in _pieces(thing):
            _feed(take, piece, (*above, id(thing)))
        take(b")")


def _pieces(thing: Any) -> list[Any]:
    """Pieces of an object."""
    # before Mapping: a labelled table is one
    if hasattr(thing, "data_vars") and not isinstance(thing, type):
        named = sorted((str(name), variable) for name, variable in thing.variables.items())
        return [(name, variable.dims, _values(variable)) for name, variable in named]
    if isinstance(thing, Mapping):
        return [piece for item in thing.items() for piece in item]
    if isinstance(thing, list | tuple | range):
        return list(thing)
    if isinstance(thing, set | frozenset):
        return sorted(map(fingerprint, thing))
    if isinstance(thing, np.ndarray | np.generic):
        return [thing.dtype.str, thing.tolist()]
    if isinstance(thing, functools.partial):
        return [thing.func, thing.args, thing.keywords]
    return _code(thing) if callable(thing) and hasattr(thing, "__qualname__") else _object(thing)


def _values(variable: Any) -> Any:
    """Values of a labelled array; texts (objects in some files, arrays in others) as a list."""
    values = np.asarray(variable.values)
    return values.tolist() if values.dtype.kind in "OU" else values


def _code(thing: Any) -> list[Any]:
    """Pieces of a function: its code and constants, not its address."""
    if isinstance(thing, types.MethodType):
        return [thing.__self__, thing.__func__]
    named = [getattr(thing, "__module__", ""), thing.__qualname__]
    if not isinstance(thing, types.FunctionType):
        return named
    closure = [cell.cell_contents for cell in thing.__closure__ or ()]
    return [*named, *_constants(thing.__code__), thing.__defaults__, thing.__kwdefaults__, closure]


def _constants(code: types.CodeType) -> list[Any]:
    inner = [_constants(c) if isinstance(c, types.CodeType) else c for c in code.co_consts]
    return [code.co_code, code.co_names, inner]


def _object(thing: Any) -> list[Any]:
    """Pieces of any other object: its ``identity``, else its fields, else what pickle would store."""
    if hasattr(thing, "identity"):
        return [thing.identity]
    if isinstance(thing, np.random.Generator):
        return [thing.bit_generator.seed_seq]
    if isinstance(thing, np.random.SeedSequence):
        return [thing.entropy, thing.spawn_key, thing.n_children_spawned]
    if dataclasses.is_dataclass(thing):
        return [(f.name, getattr(thing, f.name)) for f in dataclasses.fields(thing) if f.init]
    if hasattr(thing, "dataset"):  # a plan
        return [getattr(thing, "problem", None), thing.dataset]
    return [piece for piece in thing.__reduce_ex__(4)[:3] if piece is not None]
