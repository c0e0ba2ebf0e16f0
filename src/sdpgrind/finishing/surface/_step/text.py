"""Text of a STEP file: tokens, and the entities of its data sections by number."""

import re
from bisect import bisect_right
from collections.abc import Iterator
from typing import Any, NamedTuple

DEEPEST = 60  # chosen: lists within lists; nets of control points need two
_FIRST = "ISO-10303-21"
_TOKEN = re.compile(
    r"""(?P<blank>\s+|/\*.*?\*/)
    |(?P<string>'(?:[^']|'')*')
    |(?P<number>[+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)
    |(?P<reference>\#\d+)
    |(?P<enumeration>\.\w+\.)
    |(?P<word>!?[A-Za-z_][\w-]*)
    |(?P<binary>"[0-9A-Fa-f]*")
    |(?P<mark>[()=,;$*])""",
    re.DOTALL | re.VERBOSE | re.ASCII,
)


class Reference(int):
    """Number of another entity."""


class Enumeration(str):
    """Word between dots, such as T of ``.T.``; "*" of a derived value."""

    __slots__ = ()


class StepRecord(NamedTuple):
    """A type with its values: an entity, a part of a complex one, or a typed value."""

    type: str
    values: tuple[Any, ...]


class Entity(NamedTuple):
    """An entity: number, line in the file, and its records, several of a complex one."""

    number: int
    line: int
    records: tuple[StepRecord, ...]


class Token(NamedTuple):
    """A token: its kind, its text and its place in the whole text."""

    kind: str
    text: str
    at: int


class StepText:
    """Entities of a text; errors name the line."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._ends = [found.start() for found in re.finditer("\n", text)]
        self._tokens = self._read()

    def entities(self) -> dict[int, Entity]:
        """Return the entities of all data sections by number."""
        self._begin()
        found: dict[int, Entity] = {}
        while (section := self._next()).text != f"END-{_FIRST}":
            self._pass_to(";") if section.text == "DATA" else self._pass_to("ENDSEC")
            if section.text == "DATA":
                self._section(found)
            self._want(";")
        return found

    def _begin(self) -> None:
        first = self._next()
        if first.text != _FIRST:
            raise ValueError(f"line 1: a STEP file begins with {_FIRST}; got {first.text[:40]!r}")
        self._want(";")

    def _section(self, found: dict[int, Entity]) -> None:
        """Read the entities of a data section up to its end."""
        while (token := self._next()).text != "ENDSEC":
            if token.kind != "reference":
                raise self._refused(token, "an entity (#number) or ENDSEC")
            entity = self._entity(token)
            if entity.number in found:
                raise ValueError(
                    f"line {entity.line}: #{entity.number} is there twice; the first one is in line"
                    f" {found[entity.number].line}"
                )
            found[entity.number] = entity

    def _entity(self, token: Token) -> Entity:
        self._want("=")
        first = self._next()
        records = tuple(self._complex()) if first.text == "(" else (self._record(first),)
        self._want(";")
        return Entity(int(token.text[1:]), self._line(token.at), records)

    def _complex(self) -> Iterator[StepRecord]:
        while (token := self._next()).text != ")":
            yield self._record(token)

    def _record(self, token: Token) -> StepRecord:
        if token.kind != "word":
            raise self._refused(token, "the type of an entity")
        self._want("(")
        return StepRecord(token.text.upper(), self._values())

    def _values(self) -> tuple[Any, ...]:
        """Values up to the bracket that closes them, with lists and typed values inside."""
        stack: list[tuple[str, list[Any]]] = [("", [])]
        fresh = True  # whether a value may follow
        while True:
            token = self._next()
            if token.text == ")" and token.kind == "mark" and (not fresh or not stack[-1][1]):
                name, values = stack.pop()
                if not stack:
                    return tuple(values)
                stack[-1][1].append(StepRecord(name, tuple(values)) if name else tuple(values))
                fresh = False
            elif token.text == "," and token.kind == "mark" and not fresh:
                fresh = True
            elif fresh and (token.kind == "word" or token.text == "("):
                stack.append((token.text.upper() if token.kind == "word" else "", []))
                if token.kind == "word":
                    self._want("(")
                if len(stack) > DEEPEST:
                    raise self._refused(token, f"lists at most {DEEPEST} deep")
            elif fresh:
                stack[-1][1].append(self._value(token))
                fresh = False
            else:
                raise self._refused(token, "a comma or a closing bracket")

    def _value(self, token: Token) -> Any:
        if token.kind == "string":
            return token.text[1:-1].replace("''", "'")
        if token.kind == "number":
            return self._number(token)
        if token.kind == "reference":
            return Reference(token.text[1:])
        if token.kind == "enumeration":
            return Enumeration(token.text[1:-1].upper())
        if token.text in "$*":
            return None if token.text == "$" else Enumeration("*")
        if token.kind == "binary":
            return token.text
        raise self._refused(token, "a value")

    def _number(self, token: Token) -> float:
        if len(token.text) > 400:  # chosen: Python refuses to read whole numbers of more digits
            raise self._refused(token, "a number of at most 400 characters")
        return float(token.text)

    def _read(self) -> Iterator[Token]:
        at, size = 0, len(self._text)
        while at < size:
            match = _TOKEN.match(self._text, at)
            if match is None:
                raise ValueError(f"line {self._line(at)}: {self._unreadable(at)}")
            if match.lastgroup != "blank":
                yield Token(str(match.lastgroup), match.group(), at)
            at = match.end()

    def _unreadable(self, at: int) -> str:
        if self._text[at] in "'\"":
            return "a string is not closed"
        if self._text.startswith("/*", at):
            return "a comment is not closed"
        return f"{self._text[at : at + 20]!r} is no token of ISO 10303-21"

    def _next(self) -> Token:
        token = next(self._tokens, None)
        if token is None:
            raise ValueError(
                f"line {len(self._ends) + 1}: the file ends before END-{_FIRST}: it is truncated"
            )
        return token

    def _want(self, mark: str) -> None:
        token = self._next()
        if token.text != mark:
            raise self._refused(token, repr(mark))

    def _pass_to(self, text: str) -> None:
        while self._next().text != text:
            pass

    def _line(self, at: int) -> int:
        return bisect_right(self._ends, at - 1) + 1

    def _refused(self, token: Token, wanted: str) -> ValueError:
        return ValueError(f"line {self._line(token.at)}: {wanted} must stand there; got {token.text[:40]!r}")
