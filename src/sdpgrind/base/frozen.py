"""Models and problems are frozen dataclasses; `replace` makes a changed copy and knows the fields of the model inside."""

import dataclasses
import difflib
from typing import Any, ClassVar, Self


class Frozen:
    """Base of frozen dataclasses with ``replace``."""

    _inside: ClassVar[str] = "model"
    """The field whose own fields `replace` takes too."""

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes
            Fields of this object, in their own units; where it has a ``model`` (or a ``disc``), the fields in it too.

        Raises
        ------
        ValueError
            When a name is a field of neither.
        """
        own = _fields(self)
        further = {name: changes.pop(name) for name in list(changes) if name not in own}
        if further:
            inside: Any = changes.get(self._inside, getattr(self, self._inside, None))
            _refuse_unknown(type(self).__name__, further, own | _all_fields(inside))
            changes[self._inside] = inside.replace(**further)
        thing: Any = self  # a dataclass, which this base cannot promise
        changed: Self = dataclasses.replace(thing, **changes)
        return changed


def _fields(thing: Any) -> set[str]:
    return {field.name for field in dataclasses.fields(thing)} if dataclasses.is_dataclass(thing) else set()


def _all_fields(thing: Any) -> set[str]:
    """Names that `replace` of an object takes."""
    further = getattr(thing, getattr(thing, "_inside", ""), None)
    return _fields(thing) | (_all_fields(further) if further is not None else set())


def _refuse_unknown(owner: str, names: dict[str, Any], known: set[str]) -> None:
    for name in names:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            meant = f"is {close[0]} meant?" if close else f"its fields are {', '.join(sorted(known))}"
            raise ValueError(f"{owner} has no field {name!r}; {meant}")
