"""C source of somebody else, read as text: what it includes, defines for others, and calls."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|/\*.*?\*/|//[^\n]*', re.DOTALL)
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"\n]+)"', re.MULTILINE)
_DIRECTIVE = re.compile(r"^[ \t]*#[^\n]*", re.MULTILINE)
_MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)", re.MULTILINE)
_OF_CXX = re.compile(
    r"^[ \t]*#[ \t]*if(?:def[ \t]+__cplusplus|[ \t]+defined[ \t]*\(?[ \t]*__cplusplus[ \t]*\)?)[ \t]*\n"
    r"(?:(?![ \t]*#)[^\n]*\n)*[ \t]*#[ \t]*endif",
    re.MULTILINE,
)
_ATTRIBUTE = re.compile(r"\b__attribute__\s*\(\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)\)")
_TOKEN = re.compile(r"[A-Za-z_]\w*|[^\s\w]")
_CALL = re.compile(r"\b([A-Za-z_]\w*)\s*\(")
_WORD = re.compile(r"[A-Za-z_]\w*")
_STATEMENTS = frozenset(["if", "while", "for", "switch", "return", "sizeof", "do", "else", "case", "defined"])


def _bare(text: str) -> str:
    """Return a text without comments, on whole lines; literals stay."""
    joined = text.replace("\\\r\n", " ").replace("\\\n", " ")
    return _COMMENT.sub(lambda found: " " if found[0].startswith("/") else found[0], joined)


@dataclass(frozen=True)
class CFile:
    """Source or header as text.

    Names stand in it under conditions of the preprocessor, too: what is found is never less than what one
    compiler sees.
    """

    content: bytes

    @cached_property
    def _text(self) -> str:
        # a brace of extern "C" would hide all within it
        return _OF_CXX.sub("", _bare(self.content.decode("latin-1")))

    @cached_property
    def _code(self) -> str:
        """Text without directives, attributes and literals."""
        plain = _COMMENT.sub(lambda found: '""', _DIRECTIVE.sub("", self._text))
        return _ATTRIBUTE.sub("", plain)

    @cached_property
    def includes(self) -> tuple[str, ...]:
        """Files that it includes by name."""
        return tuple(_INCLUDE.findall(self._text))

    @cached_property
    def macros(self) -> frozenset[str]:
        """Macros that it defines."""
        return frozenset(_MACRO.findall(self._text))

    @cached_property
    def words(self) -> frozenset[str]:
        """All identifiers."""
        return frozenset(_WORD.findall(self._text))

    @cached_property
    def _declarations(self) -> tuple[tuple[list[str], str, str], ...]:
        return tuple(_declarations(self._code))

    @cached_property
    def defined(self) -> frozenset[str]:
        """Functions and data that other files may use."""
        return frozenset(_names(self._declarations, static=False))

    @cached_property
    def own(self) -> frozenset[str]:
        """Functions and data that no other file sees."""
        return frozenset(_names(self._declarations, static=True))

    @cached_property
    def reserved(self) -> frozenset[str]:
        """Names of the C library's kind, with an underscore, that it declares: a library may have others."""
        declared = (_function(head) or _last_word(head) for head, end, _ in self._declarations if end == ";")
        return frozenset(one for one in declared if one.startswith("_"))

    @cached_property
    def called(self) -> frozenset[str]:
        """Functions that are called, in macros as well."""
        macros = [_MACRO.sub("", one, count=1) for one in _DIRECTIVE.findall(self._text) if _MACRO.match(one)]
        bodies = [*macros, *(body for _, _, body in self._declarations)]
        return frozenset(name for body in bodies for name in _CALL.findall(body)) - _STATEMENTS

    @cached_property
    def foreign(self) -> frozenset[str]:
        """Data of other files that it declares."""
        heads = [head for head, end, _ in self._declarations if end == ";" and "extern" in head]
        return frozenset(_last_word(head) for head in heads if not _function(head)) - {""}


def _declarations(code: str) -> Iterator[tuple[list[str], str, str]]:
    """Give declarations of a file: words before body or end, "{" or "=" or ";", and the body's text."""
    head: list[str] = []
    start = depth = 0
    for token in _TOKEN.finditer(code):
        word = token[0]
        if word == "{":
            start, depth = (token.end(), 1) if depth == 0 else (start, depth + 1)
        elif word == "}":
            depth -= 1
            body = code[start : token.start()]
            if depth == 0 and "=" not in head and _function(head):
                yield head, "{", body
                head = []
            elif depth == 0:
                head.append(" ")  # a type or a list of numbers: the declaration goes on
        elif depth == 0 and word == ";":
            yield (head, "=", " ".join(head)) if "=" in head else (head, ";", "")
            head = []
        elif depth == 0:
            head.append(word)


def _function(head: list[str]) -> str:
    """Return the name before the first parenthesis, of a function; "" of anything else."""
    place = head.index("(") if "(" in head else 0
    return head[place - 1] if place and _WORD.fullmatch(head[place - 1]) else ""


def _last_word(head: list[str]) -> str:
    """Return the name that a declaration of data ends with, before "=" and extents."""
    text = " ".join(head[: head.index("=")] if "=" in head else head)
    words = _WORD.findall(re.sub(r"\[[^\]]*\]", "", text))
    return words[-1] if words else ""


def _names(declarations: tuple[tuple[list[str], str, str], ...], static: bool) -> Iterator[str]:
    for head, end, _ in declarations:
        if end == ";" or "typedef" in head or ("static" in head) != static:
            continue
        name = _function(head) if end == "{" else _last_word(head)
        if name:
            yield name
