"""Blocks of a page: heading, sentences, listing, table, picture, data, blanks for a signature.

A block has a plain form for JSON, from which the same texts are made again: `shown` is all that a reader
sees, so a changed number is found.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sdpgrind.base.sheets.amounts import Amounts, Interval, scale_of

Scales = Mapping[tuple[str, str], tuple[float, str]]
"""Factor and unit shown, by name and unit of a quantity."""
Shown = tuple[str, str]
"""A place in a page and the text there."""


@dataclass(frozen=True)
class Heading:
    """Heading of a section."""

    text: str

    def shown(self, scales: Scales) -> Iterator[Shown]:
        """Yield the text with its place."""
        yield "heading", self.text

    def plain(self) -> dict[str, Any]:
        """Return the block for JSON."""
        return {"heading": self.text}


@dataclass(frozen=True)
class Sentences:
    """Sentences, each on a line of its own; `strong`: the verdict."""

    lines: Sequence[str]
    strong: bool = False

    def shown(self, scales: Scales) -> Iterator[Shown]:
        """Yield each line with its place."""
        for line in self.lines:
            yield "text", line

    def plain(self) -> dict[str, Any]:
        """Return the block for JSON."""
        return {"lines": list(self.lines), "strong": self.strong}


@dataclass(frozen=True)
class Listing:
    """Text with its own line ends and columns."""

    text: str

    def shown(self, scales: Scales) -> Iterator[Shown]:
        """Yield the text with its place."""
        yield "listing", self.text

    def plain(self) -> dict[str, Any]:
        """Return the block for JSON."""
        return {"listing": self.text}


@dataclass(frozen=True)
class AmountTable:
    """Amounts side by side (`heads` empty: columns), or as rows below `heads`, whose first is of names.

    Attributes
    ----------
    caption : str
        Words above the table.
    amounts : sequence of Amounts
        Columns, or rows.
    heads : sequence of str
        Heads of columns of rows: of the names, and of each value.
    """

    caption: str
    amounts: Sequence[Amounts]
    heads: Sequence[str] = ()

    def head(self, scales: Scales) -> list[str]:
        """Return the heads of all columns."""
        return list(self.heads) or [each.head(_scale(each, scales)) for each in self.amounts]

    def rows(self, scales: Scales) -> list[list[str]]:
        """Return the cells of all rows."""
        columns = [each.cells(_scale(each, scales)) for each in self.amounts]
        if not self.heads:
            return [list(row) for row in zip(*columns, strict=True)]
        names = [each.head(_scale(each, scales)) for each in self.amounts]
        return [[name, *cells] for name, cells in zip(names, columns, strict=True)]

    def shown(self, scales: Scales) -> Iterator[Shown]:
        """Yield caption, heads and cells with their places."""
        where, heads = f"table {self.caption!r}", self.head(scales)
        yield where, self.caption
        yield from ((f"{where}, head", head) for head in heads)
        for number, row in enumerate(self.rows(scales), 1):
            for head, cell in zip(heads, row, strict=True):
                yield f"{where}, row {number}, {head}", cell

    def plain(self) -> dict[str, Any]:
        """Return the block for JSON."""
        amounts = [each.plain() for each in self.amounts]
        return {"table": self.caption, "heads": list(self.heads), "amounts": amounts}


@dataclass(frozen=True)
class Picture:
    """A matplotlib figure, made when the page is; `missing`: why there is none."""

    caption: str
    draw: Callable[[], Any] | None = field(default=None, compare=False)
    missing: str = ""

    def shown(self, scales: Scales) -> Iterator[Shown]:
        """Yield caption, or the reason, with its place."""
        yield "picture", f"{self.caption}: left out, {self.missing}" if self.missing else self.caption

    def plain(self) -> dict[str, Any]:
        """Return the block for JSON, without the drawing."""
        return {"picture": self.caption, "missing": self.missing}


@dataclass(frozen=True)
class Blanks:
    """Names before empty lines, to be filled in by hand."""

    names: Sequence[str]

    def shown(self, scales: Scales) -> Iterator[Shown]:
        """Yield each name with its place."""
        for name in self.names:
            yield "blank", name

    def plain(self) -> dict[str, Any]:
        """Return the block for JSON."""
        return {"blanks": list(self.names)}


@dataclass(frozen=True)
class Embedded:
    """What a program reads, not shown: a plain value (numbers, texts, lists, mappings) under a name."""

    name: str
    value: Any


Visible = Heading | Sentences | Listing | AmountTable | Picture | Blanks
Block = Visible | Embedded


def figures(caption: str, *rows: tuple[str, Any, str]) -> AmountTable:
    """Return a table of figures: name, value (a float is exact; or any other cell) and unit."""
    amounts = [Amounts.of(name, [Interval(x, 0.0) if isinstance(x, float) else x], u) for name, x, u in rows]
    return AmountTable(caption, amounts, ("figure", "value"))


def scales_of(blocks: Iterable[Block]) -> Scales:
    """Return one unit for each quantity, chosen by its greatest value in all tables."""
    greatest: dict[tuple[str, str], float] = {}
    for block in blocks:
        for each in block.amounts if isinstance(block, AmountTable) else ():
            key = each.name, each.unit
            greatest[key] = max(greatest.get(key, 0.0), each.greatest)
    return {key: scale_of(key[1], most) for key, most in greatest.items()}


def _scale(each: Amounts, scales: Scales) -> tuple[float, str]:
    return scales.get((each.name, each.unit), (1.0, each.unit))


_FORMS: dict[str, Callable[[dict[str, Any]], Visible]] = {
    "heading": lambda plain: Heading(plain["heading"]),
    "lines": lambda plain: Sentences(plain["lines"], plain["strong"]),
    "listing": lambda plain: Listing(plain["listing"]),
    "table": lambda plain: AmountTable(
        plain["table"], [Amounts.from_plain(each) for each in plain["amounts"]], plain["heads"]
    ),
    "picture": lambda plain: Picture(plain["picture"], missing=plain["missing"]),
    "blanks": lambda plain: Blanks(plain["blanks"]),
}


def from_plain(plain: dict[str, Any]) -> Visible:
    """Return the block of a plain form."""
    return next(make(plain) for name, make in _FORMS.items() if name in plain)
