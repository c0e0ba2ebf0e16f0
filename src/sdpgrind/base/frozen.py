"""Frozen dataclasses with `replace`, which also reaches fields of inner objects."""

import dataclasses
import difflib
from functools import cache
from typing import Any, ClassVar, Self


class Frozen:
    """Base of frozen dataclasses with ``replace``."""

    _inside: ClassVar[str | tuple[str, ...]] = "model"
    """Field or fields whose own fields `replace` accepts, too."""

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes
            Fields of this object, in their own units; also fields of its ``model`` (or ``disc``, ``limits``).

        Raises
        ------
        ValueError
            When a name is a field of none, or of several inner objects.
        """
        own = _fields(self)
        further = {name: changes.pop(name) for name in list(changes) if name not in own}
        if further:
            inner: dict[str, Any] = {
                name: changes.get(name, getattr(self, name, None)) for name in inside(self)
            }
            _refuse_unknown(self, further, own.union(*map(_all_fields, inner.values())))
            for home, named in _by_home(type(self).__name__, further, inner).items():
                changes[home] = inner[home].replace(**named)
        thing: Any = self  # a base class cannot declare itself a dataclass
        changed: Self = dataclasses.replace(thing, **changes)
        return changed


def _fields(thing: Any) -> frozenset[str]:
    kind: Any = type(thing)  # mypy takes type[Any] for unhashable
    return _fields_of(kind)


@cache
def _fields_of(cls: Any) -> frozenset[str]:
    known = dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ()
    return frozenset(field.name for field in known)


def inside(thing: Any) -> tuple[str, ...]:
    """Return the names of the fields whose own fields `replace` of an object accepts, too."""
    names: str | tuple[str, ...] = getattr(thing, "_inside", ())
    return (names,) if isinstance(names, str) else names


def _all_fields(thing: Any) -> frozenset[str]:
    """Names that `replace` of an object accepts."""
    return _fields(thing).union(*(_all_fields(getattr(thing, name, None)) for name in inside(thing)))


def _by_home(owner: str, names: dict[str, Any], inner: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Changes by the inner object to which they belong."""
    found: dict[str, dict[str, Any]] = {}
    for name, value in names.items():
        homes = [home for home, thing in inner.items() if name in _all_fields(thing)]
        if len(homes) > 1:
            raise ValueError(
                f"{owner} has {name!r} in {' and in '.join(homes)}; replace the one that is meant"
            )
        found.setdefault(homes[0], {})[name] = value
    return found


def _refuse_unknown(owner: Any, names: dict[str, Any], known: frozenset[str]) -> None:
    for name in names:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            meant = f"is {close[0]} meant?" if close else f"its fields are {', '.join(sorted(known))}"
            if way := _deeper(owner, name):
                meant = f"take replace({way[-1]}=x.{'.'.join(way)}.replace({name}=...)) of it, x"
            raise ValueError(f"{type(owner).__name__} has no field {name!r}; {meant}")


def _deeper(thing: Any, name: str) -> tuple[str, ...]:
    """Names of fields that lead to an inner object with a field `name`; empty: there is none."""
    for field in sorted(_fields(thing)):
        inner = getattr(thing, field)
        if field in inside(thing):
            if way := _deeper(inner, name):
                return field, *way
        elif name in _fields(inner) and hasattr(inner, "replace"):
            return (field,)
    return ()
