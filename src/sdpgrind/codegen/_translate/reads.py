"""Which tables of a program are read: others are handed on from function to function, and left alone."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

Span: TypeAlias = tuple[int, int]
"""Begin and end of a part of a text."""
Fields: TypeAlias = tuple[tuple[str, str], ...]
"""Names of the fields of a structure, each with the structure that it is, or ""."""
_CHAIN = re.compile(r"(\w*)((?:\.[A-Za-z_]\w*)+)")


@dataclass
class Reads:
    """Names that C functions use, but for arguments that a function ignores and fields that none takes.

    What is not understood counts as used.

    Attributes
    ----------
    functions : mapping of str to (str, str)
        Name to the head, and the text behind it.
    structures : mapping of str to Fields
        Name to fields.
    """

    functions: Mapping[str, tuple[str, str]]
    structures: Mapping[str, Fields]
    _ignored: set[tuple[str, str]] = field(default_factory=set)

    def names(self, text: str) -> set[str]:
        """Return the names that are used in the functions, and in the text that calls them."""
        while True:
            texts = {name: self._blank(_told(body)) for name, (_, body) in self.functions.items()}
            texts[""] = self._blank(text)
            found = {name: set(re.findall(r"\w+", one)) for name, one in texts.items()}
            ignored = {
                (name, one) for name, (head, _) in self.functions.items() for one in _parameters(head)
                if one not in found[name]
            }  # fmt: skip
            taken = {one for name, told in texts.items() for one in self._taken(name, told)}
            ignored |= self._fields() - taken
            if ignored == self._ignored:
                return set().union(*found.values())
            self._ignored = ignored

    def _fields(self) -> set[tuple[str, str]]:
        return {(kind, one) for kind, fields in self.structures.items() for one, _ in fields}

    def _taken(self, name: str, text: str) -> Iterator[tuple[str, str]]:
        """Give the fields that a function takes out of structures."""
        head = self.functions[name][0] if name else ""
        declared = re.findall(r"\b(\w+) (?=(\w+))", f"{head} {text}")
        for base, chain in _CHAIN.findall(text):
            kinds = {kind for kind, one in declared if one == base and kind in self.structures}
            for one in chain[1:].split("."):
                kinds = kinds or {kind for kind, fields in self.structures.items() if one in dict(fields)}
                yield from ((kind, one) for kind in kinds)
                kinds = {dict(self.structures[kind]).get(one, "") for kind in kinds} - {""}

    def _blank(self, text: str) -> str:
        """Return a text without the arguments and fields that are ignored."""
        calls = ((m, self.functions.get(m[1])) for m in re.finditer(r"(\w+)\(", text))
        spans = [
            one for m, f in calls if f for one in self._ignored_of(text, m[1], m.end(), _parameters(f[0]))
        ]
        made = (m for m in re.finditer(r"\((\w+)\)\{", text) if m[1] in self.structures)
        spans += [one for m in made for one in self._items(text, m[1], m.end())]
        letters = list(text)
        for begin, end in spans:
            letters[begin:end] = " " * (end - begin)
        return "".join(letters)

    def _ignored_of(self, text: str, name: str, begin: int, names: tuple[str, ...]) -> Iterator[Span]:
        """Give the parts from `begin` on that stand for what is ignored."""
        parts = zip(_parts(text, begin), names, strict=True)
        return (part for part, one in parts if (name, one) in self._ignored)

    def _items(self, text: str, kind: str, begin: int) -> Iterator[Span]:
        """Give the fields of a structure, written from `begin` on, that are ignored."""
        fields = self.structures[kind]
        yield from self._ignored_of(text, kind, begin, tuple(one for one, _ in fields))
        for (start, end), (_, inner) in zip(_parts(text, begin), fields, strict=True):
            if inner and text[start:end].lstrip().startswith("{"):
                yield from self._items(text, inner, text.index("{", start) + 1)


def _parameters(head: str) -> tuple[str, ...]:
    """Return names of the parameters of a function."""
    return tuple(re.findall(r"(\w+)(?=[,)])", head))


def _parts(text: str, begin: int) -> list[Span]:
    """Return the parts between commas up to the bracket that ends them."""
    depth, start, parts = 0, begin, []
    for k in range(begin, len(text)):
        depth += (text[k] in "([{") - (text[k] in ")]}")
        if depth < 0 or (depth == 0 and text[k] == ","):
            parts.append((start, k))
            start = k + 1
        if depth < 0:
            break
    return parts


def _told(text: str) -> str:
    """Return a text without comments and without the lines that name what is not used."""
    return re.sub(r"/\*.*?\*/|\(void\)\w+;", "", text, flags=re.S)
