"""Frozen dataclasses as JSON in files, each class under a name that no move changes."""

import dataclasses
import json
from collections.abc import Callable
from importlib import import_module
from pkgutil import walk_packages
from typing import Any, TypeVar

import numpy as np

Stored = TypeVar("Stored")

_classes: dict[str, type] = {}
_names: dict[type, str] = {}
# areas whose stored names do not begin with the name of a package of sdpgrind
_HOMES = {"centering": "centering", "force": "sdpgrind.weldbead.force", "hwsim": "hwsim"}


def stored(name: str) -> Callable[[type[Stored]], type[Stored]]:
    """Register a frozen dataclass for `encode` under `name`."""

    def register(cls: type[Stored]) -> type[Stored]:
        known = _classes.setdefault(name, cls)
        if (known.__module__, known.__qualname__) != (cls.__module__, cls.__qualname__):
            raise ValueError(f"name must be of one class; {name!r} is that of {known.__qualname__} already")
        _classes[name], _names[cls] = cls, name
        return cls

    return register


def name_of(cls: type) -> str:
    """Return the name under which a class is registered."""
    return _names[cls]


def encode(value: Any) -> str:
    """Return JSON of registered dataclasses of numbers, strings, None, arrays and tuples."""
    return json.dumps(value, default=_as_json)


def decode(text: str) -> Any:
    """Return the object of `encode`; sequences become tuples."""
    return _tuples(json.loads(text, object_hook=_from_json))


def _as_json(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and type(value) in _names:
        return {"stored": _names[type(value)], **_fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, range):
        return list(value)
    raise TypeError(f"{value!r} cannot be saved: {type(value).__name__} is not a plain value")


def _fields(value: Any) -> dict[str, Any]:
    """Fields of a registered object; a younger one (`_younger`) only where it is not at its default."""
    younger = getattr(value, "_younger", ())
    given = [field for field in dataclasses.fields(value) if field.init]
    kept = [each for each in given if each.name not in younger or getattr(value, each.name) != each.default]
    return {each.name: getattr(value, each.name) for each in kept}


def _from_json(fields: dict[str, Any]) -> Any:
    name = fields.pop("stored", None)
    given = {key: _tuples(value) for key, value in fields.items()}
    if name is None:
        return given
    made = class_of(name)
    return getattr(made, "_from_file", made)(**given)  # a class whose fields have changed since 0.1.0


def class_of(name: str) -> Any:
    """Return the class of a stored name; the modules of its area are imported until one registers it."""
    area = name.partition(".")[0]
    for module in () if name in _classes else _modules(_HOMES.get(area, f"sdpgrind.{area}")):
        import_module(module)
        if name in _classes:
            break
    if name not in _classes:
        raise ValueError(f"the file holds a {name!r}, which this version does not know")
    return _classes[name]


def _modules(package: str) -> list[str]:
    try:
        found = import_module(package)
    except ModuleNotFoundError:  # no such area
        return []
    each = walk_packages(found.__path__, f"{package}.")
    return [module.name for module in each if not module.name.endswith("__main__")]


def _tuples(value: Any) -> Any:
    return tuple(_tuples(entry) for entry in value) if isinstance(value, list) else value
