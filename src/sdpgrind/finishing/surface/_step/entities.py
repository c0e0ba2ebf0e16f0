"""Entities of a STEP file with checked access to their values."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.text import Entity, Enumeration, Reference, StepRecord, StepText

Item = TypeVar("Item")
LARGEST = 1e30  # chosen: beyond all lengths, and its eighth power is a float


class StepRow:
    """A record of an entity; each access names entity and type in its error."""

    def __init__(self, entity: Entity, record: StepRecord) -> None:
        self.number, self.line = entity.number, entity.line
        self.type, self.values = record

    def __str__(self) -> str:
        return f"#{self.number} {self.type}"

    def refused(self, sentence: str) -> ValueError:
        """Return the error of this entity."""
        return ValueError(f"line {self.line}: {self} {sentence}")

    def value(self, place: int) -> Any:
        """Return the value at a place, whatever it is."""
        if not -len(self.values) <= place < len(self.values):
            raise self.refused(f"must have more than {len(self.values)} values")
        return self.values[place]

    def _of_kind(self, place: int, value: Any, kind: type[Item], what: str) -> Item:
        if not isinstance(value, kind):
            raise self.refused(f"must have {what} as value {place + 1}; got {str(value)[:40]!r}")
        return value

    def text(self, place: int) -> str:
        """Return a string, "" where there is none."""
        value = self.value(place)
        return value if isinstance(value, str) and not isinstance(value, Enumeration) else ""

    def number_at(self, place: int) -> float:
        """Return a finite number, typed or not."""
        return self._number(place, self.value(place))

    def _number(self, place: int, value: Any) -> float:
        if isinstance(value, StepRecord) and len(value.values) == 1:
            value = value.values[0]
        number = self._of_kind(place, value, float, "a number")
        if not abs(number) < LARGEST:
            raise self.refused(f"must have numbers below {LARGEST:g}; got {number:g}")
        return number

    def count(self, place: int) -> int:
        """Return a whole number >= 0 below a million."""
        number = self.number_at(place)
        if not (number.is_integer() and 0 <= number < 1e6):
            raise self.refused(f"must have a count as value {place + 1}; got {number:g}")
        return int(number)

    def flag(self, place: int, default: bool | None = None) -> bool:
        """Return .T. or .F.; a `default` stands for an unknown one."""
        value = self.value(place)
        if value in ("T", "F") and isinstance(value, Enumeration):
            return bool(value == "T")
        if default is None:
            raise self.refused(f"must have .T. or .F. as value {place + 1}; got {str(value)[:40]!r}")
        return default

    def word(self, place: int) -> str:
        """Return an enumeration's word, "" for $."""
        value = self.value(place)
        return "" if value is None else str(self._of_kind(place, value, Enumeration, "a word between dots"))

    def reference(self, place: int) -> int:
        """Return the number of another entity."""
        return self._of_kind(place, self.value(place), Reference, "a reference (#number)")

    def optional_reference(self, place: int) -> int | None:
        """Return the number of another entity, or None for $ and *."""
        value = self.value(place)
        return None if value is None or value == "*" else self.reference(place)

    def references(self, place: int) -> list[int]:
        """Return the numbers of a list."""
        return self._list(place, self.value(place), Reference, "references (#number)")

    def numbers(self, place: int) -> Floats:
        """Return a list of finite numbers."""
        value = self._of_kind(place, self.value(place), tuple, "a list")
        return np.array([self._number(place, each) for each in value], dtype=float)

    def counts(self, place: int) -> list[int]:
        """Return a list of whole numbers >= 0."""
        found = self.numbers(place)
        if np.any((found != np.round(found)) | (found < 0) | (found > 1e6)):
            raise self.refused(f"must have counts as value {place + 1}")
        return [int(each) for each in found]

    def net(self, place: int, read: Callable[[int, Any], Any]) -> list[list[Any]]:
        """Return a list of equally long lists, each entry by `read`(place, entry)."""
        rows = self._list(place, self.value(place), tuple, "lists")
        if not rows or any(len(row) != len(rows[0]) or not row for row in rows):
            raise self.refused(f"must have equally long lists as value {place + 1}")
        return [[read(place, each) for each in row] for row in rows]

    def reference_net(self, place: int) -> list[list[int]]:
        """Return lists of references."""
        return self.net(place, lambda at, each: self._of_kind(at, each, Reference, "references"))

    def number_net(self, place: int) -> list[list[float]]:
        """Return lists of finite numbers."""
        return self.net(place, self._number)

    def _list(self, place: int, value: Any, kind: type[Item], what: str) -> list[Item]:
        values = self._of_kind(place, value, tuple, f"a list of {what}")
        return [self._of_kind(place, each, kind, f"a list of {what}") for each in values]


class StepFile:
    """Entities of a STEP file."""

    def __init__(self, text: str) -> None:
        self.entities: Mapping[int, Entity] = StepText(text).entities()

    def rows(self, *types: str) -> Iterator[StepRow]:
        """Yield the records of the types, in the order of the file."""
        for entity in self.entities.values():
            for record in entity.records:
                if record.type in types:
                    yield StepRow(entity, record)

    def entity(self, number: int) -> Entity:
        """Return an entity that another one refers to."""
        if number not in self.entities:
            raise ValueError(f"#{number} is not in the file, but other entities refer to it")
        return self.entities[number]

    def find(self, number: int, *types: str) -> StepRow | None:
        """Return the record of one of the types, in their order, or None."""
        entity = self.entity(number)
        by_type = {record.type: record for record in entity.records}
        name = next((each for each in types if each in by_type), None)
        return None if name is None else StepRow(entity, by_type[name])

    def row(self, number: int, *types: str) -> StepRow:
        """Return the record of one of the types, in their order."""
        found = self.find(number, *types)
        if found is None:
            entity = self.entity(number)
            raise StepRow(entity, entity.records[0] if entity.records else StepRecord("", ())).refused(
                f"must be a {' or '.join(types)}"
            )
        return found

    def name(self, number: int) -> str:
        """Return number and types of an entity for a message."""
        entity = self.entity(number)
        return f"#{number} {' '.join(record.type for record in entity.records)}"
