"""Tables of a TOML file, read key by key; every fault, also an unknown key, is a line that names the key.

Keys are names of the Python interface; numbers are in the library's units or texts with a unit.
"""

import difflib
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from hwsim.command._in_words import as_given, as_text, names_another
from hwsim.command._toml_bounds import refuse_many, text_of
from sdpgrind.base.quantities import Spec, specs
from sdpgrind.base.unit_text import bare, quantity

Made = TypeVar("Made")
_SHOWN = 80  # characters of a line in a message; chosen: the message fits a line or two


@dataclass
class Table:
    """A table of the file that notes which keys were read."""

    name: str  # "" for the file itself
    entries: dict[str, Any]
    known: set[str] = field(default_factory=set)
    above: "Table | None" = None  # the table that this one is in

    def path(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def has(self, key: str) -> bool:
        self.known.add(key)
        return key in self.entries

    def take(self, key: str) -> Any:
        if not self.has(key):
            self._refuse_misnamed({key})
            close = difflib.get_close_matches(key, self.unread())
            meant = f"; is it meant by {self.path(close[0])}?" if close else self._elsewhere(key)
            raise ValueError(f"{self.path(key)} is missing{meant}")
        return self.entries[key]

    def unread(self) -> set[str]:
        """Keys that no reader asked for so far."""
        return self.entries.keys() - self.known

    def _refuse_misnamed(self, missing: set[str]) -> None:
        """Refuse a table beside this one with a name close to its own, where that holds what is missing."""
        if self.above is None:
            return
        own = self.name.rpartition(".")[2]
        for other in difflib.get_close_matches(own, self.above.unread()):
            held = self.above.entries[other]
            if isinstance(held, dict) and not missing.isdisjoint(held):
                raise ValueError(f"[{self.above.path(other)}] is no table here; is [{self.name}] meant?")

    def _elsewhere(self, key: str) -> str:
        """What to add where a table of a missing key's name lies further up."""
        above = self.above
        while above is not None:
            if key in above.unread() and isinstance(above.entries[key], dict):
                return f"; is [{above.path(key)}] to be [{self.path(key)}]?"
            above = above.above
        return ""

    def need(self, *keys: str, of: type | None = None, skip: Iterable[str] = ()) -> None:
        """Refuse, at once, all of the keys that are missing; `of`: with the required fields of a class."""
        wanted = dict.fromkeys(keys) | dict.fromkeys(() if of is None else _required(of, skip))
        missing = [key for key in wanted if not self.has(key)]
        if len(missing) < 2:  # one alone: told where it is read
            return
        self._refuse_misnamed(set(missing))
        told = f"{', '.join(map(self.path, missing[:-1]))} and {self.path(missing[-1])} are missing"
        close = {key: difflib.get_close_matches(key, self.unread(), 1) for key in missing}
        meant = [f"{self.path(key)} meant by {self.path(near[0])}" for key, near in close.items() if near]
        raise ValueError(told + (f"; is {', '.join(meant)}?" if meant else ""))

    def file(self, key: str, folder: Path) -> Path:
        """Path of an existing file, which counts from `folder`."""
        name = self.take(key)
        path = folder / name if isinstance(name, str) else None
        if path is None or not path.is_file():
            raise ValueError(f"{self.path(key)} must be a file, as seen from {folder}; got {name!r}")
        return path

    def number(self, key: str, unit: str) -> float:
        return quantity(self.path(key), self.take(key), unit)

    def numbers(self, units: Mapping[str, str]) -> dict[str, float]:
        return {key: self.number(key, unit) for key, unit in units.items()}

    def list_of(self, key: str, unit: str) -> list[float]:
        values = self.take(key)
        if not isinstance(values, list):
            told = f" ({unit})" if unit else ""
            raise ValueError(f"{self.path(key)} must be a list of numbers{told}; got {values!r}")
        return [quantity(f"{self.path(key)}[{k}]", value, unit) for k, value in enumerate(values)]

    def given(self, units: Mapping[str, str]) -> dict[str, float]:
        return {key: self.number(key, unit) for key, unit in units.items() if self.has(key)}

    def text(self, key: str, choices: Mapping[str, Any] | tuple[str, ...]) -> str:
        value = self.take(key)
        if not isinstance(value, str) or value not in choices:
            raise ValueError(f"{self.path(key)} must be one of {', '.join(choices)}; got {value!r}")
        return str(value)

    def maybe(self, key: str) -> "Table":
        """A table, empty where it is missing."""
        return self.table(key) if self.has(key) else Table(self.path(key), {})

    def table(self, key: str, holds: str | type = "") -> "Table":
        """A table; `holds`: what it must hold, or the class whose required fields it must have."""
        value = self.take(key)
        if not isinstance(value, dict):
            words = holds if isinstance(holds, str) else ", ".join(_required(holds) or specs(holds))
            told = f" of {words}" if words else ""
            raise ValueError(f"{self.path(key)} must be a table{told}; got {value!r}")
        return Table(self.path(key), value, above=self)

    def made(self, make: Callable[..., Made], *values: Any, **options: Any) -> Made:
        """Call `make`; add the table's name to its refusal."""
        try:
            return make(*values, **options)
        except (ValueError, TypeError) as error:
            where = f"[{self.name}] " if self.name else ""
            raise ValueError(f"{where}{self._as_written(str(error))}") from None

    def _as_written(self, message: str) -> str:
        """Message with a conversion that a file can hold; with none where the file itself gives the unit."""
        return _in_words(message, _entry(self.entries, message.partition(" ")[0]))

    def one(self, cls: type[Made], *given: Any) -> Made:
        """Object of a described class from this table, after the arguments `given`."""
        values = self.values(cls, skip=tuple(specs(cls))[: len(given)])
        self.done()
        return self.made(cls, *given, **values)

    def values(self, cls: type, *, every: bool = True, skip: Iterable[str] = ()) -> dict[str, Any]:
        """Values of the fields of a described class, except `skip`; not `every`: only those in the table.

        Arrays and ``custom`` fields are left to the caller.
        """
        skipped = tuple(skip)
        readable = {
            name: spec for name, spec in specs(cls).items() if name not in skipped and spec.kind in _READ
        }
        if every:
            self.need(of=cls, skip=skipped)
        return {
            name: _READ[spec.kind](self, name, spec)
            for name, spec in readable.items()
            if self.has(name) or (every and (spec.required or spec.kind == "law"))
        }

    def options(self, cls: type, skip: Iterable[str] = ()) -> dict[str, Any]:
        """Values in the table for a described class; its defaults hold for the rest."""
        values = self.values(cls, every=False, skip=skip)
        self.done()
        return values

    def changed(self, known: Made, skip: Iterable[str] = ()) -> Made:
        """A described object with the values of this table in place of its own."""
        thing: Any = known  # a type variable cannot declare ``replace``
        changed: Made = self.made(thing.replace, **self.options(type(known), skip))
        return changed

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self.take(key)
        if not isinstance(value, bool):
            raise ValueError(f"{self.path(key)} must be true or false; got {value!r}")
        return value

    def law(self, key: str, classes: Mapping[str, type]) -> Any:
        """Object of the class that `key` names, with values from this table."""
        cls = classes[self.text(key, classes)]
        return self.made(cls, **self.values(cls))

    def done(self) -> None:
        """Refuse the first unread key."""
        for key in self.entries:
            if key not in self.known:
                close = difflib.get_close_matches(key, self.known, 1)
                meant = (
                    f"is {self.path(close[0])} meant?"
                    if close
                    else f"keys here are {', '.join(sorted(self.known))}"
                )
                raise ValueError(f"{self.path(key)} is not a key; {meant}")


def _required(cls: type, skip: Iterable[str] = ()) -> tuple[str, ...]:
    """Keys that a table of a described class must have, except `skip`."""
    skipped = tuple(skip)
    return tuple(
        name
        for name, spec in specs(cls).items()
        if spec.required and spec.kind in _READ and spec.kind != "law" and name not in skipped
    )


def _number(table: Table, key: str, spec: Spec) -> float:
    """A number; infinity alone where that is the default, as of what has no limit."""
    if table.take(key) == spec.default == math.inf:
        return math.inf
    return table.number(key, "" if spec.unit in ("1", "relative") else spec.unit)


# Reader of a field by the kind of its declaration. A pure number may be in percent, in no other unit.
_READ: Mapping[str, Callable[[Table, str, Spec], Any]] = {
    "number": _number,
    "count": lambda table, key, spec: table.take(key),
    "text": lambda table, key, spec: table.take(key),
    "choice": lambda table, key, spec: table.take(key),
    "flag": lambda table, key, spec: table.flag(key),
    "part": lambda table, key, spec: table.table(key, spec.made_of).one(spec.made_of),
    "law": lambda table, key, spec: table.law(key, spec.made_of),
}


def read(path: Path, make: Callable[[Table], Made]) -> Made:
    """Make an object from the file at `path`; ValueError names the file and the key."""
    entries = _entries(path)
    table = Table("", entries)
    try:
        made = make(table)
        table.done()
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {_with_text(str(error), entries)}") from None
    return made


def _entries(path: Path) -> dict[str, Any]:
    try:
        text = text_of(path)
        entries = _parsed(text)
        refuse_many(entries)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return entries


def _parsed(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(_misread(str(error), text)) from None
    except RecursionError:
        raise ValueError("brackets must be nested at most 32 deep") from None


_NO_TOML = {
    "Cannot overwrite a value": "the key is there twice",
    "Cannot declare": "the table is there twice",
    "Invalid value": "no number, no true or false, and no text in quotes",
}


def _misread(told: str, text: str) -> str:
    """Fault of an invalid file, with its line; tomllib names no key."""
    place = re.search(r"(.*) \(at line (\d+), column \d+\)", told)
    if place is None:
        return told
    what = next((meaning for start, meaning in _NO_TOML.items() if told.startswith(start)), place[1])
    written = text.split("\n")[int(place[2]) - 1].strip()  # as tomllib counts lines
    shown = written if len(written) <= _SHOWN else f"{written[:_SHOWN]}..."
    return f"line {place[2]}, {shown!r}: {what}"


def _entry(entries: Mapping[str, Any], name: str) -> Any:
    """Entry of that name, or of the only table with it; of a range its greatest, which is what is refused."""
    within = [table[name] for table in entries.values() if isinstance(table, dict) and name in table]
    given = entries.get(name, within[0] if len(within) == 1 else None)
    return given[-1] if isinstance(given, list) and given else given


def _in_words(message: str, given: Any) -> str:
    """Message in the words of a file: with the text that was given, or with a unit in place of a call."""
    if isinstance(given, str) and not bare(given) and names_another(message):
        return as_given(message, given)
    return as_text(message)


def _with_text(told: str, entries: Any) -> str:
    """Add the text in the file to the refusal of a number made from it, in the words of a file."""
    named = re.match(r"(?:\[([\w.]+)\] )?([\w.]+) must be ", told)
    if named is None:
        return as_text(told)
    for key in ".".join(filter(None, named.groups())).split("."):
        entries = entries.get(key) if isinstance(entries, dict) else None
    told = _in_words(told, entries)
    return f"{told}, from {entries!r}" if isinstance(entries, str) and repr(entries) not in told else told
