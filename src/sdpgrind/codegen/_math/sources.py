"""What an export takes from a folder with C sources of a libm: files that are reached, and the licence."""

import posixpath
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath

from sdpgrind.base import checks
from sdpgrind.codegen._math.c_file import CFile
from sdpgrind.codegen._names import HEADERS
from sdpgrind.codegen._translate.calls import EXACT, LIBM

_MORE = "erf erfc lgamma tgamma exp10 pow10 sincos"
_OWN_BITS = frozenset(f"{LIBM} {_MORE}".split()) - {"fmod"}
"""Functions that C libraries compute with last bits of their own."""
_LICENCE = re.compile(r"(licen[cs]e|copying|copyright)", re.IGNORECASE)
_ASSEMBLY = (".s", ".S", ".asm")  # chosen: endings of what no C compiler translates for every target
_GENERIC = "generic"  # source: musl and glibc: the folder of what no processor has of its own

_MARKS = ("hidden",)  # source: musl, include/features.h of its build: not seen by other libraries


@dataclass(frozen=True)
class MathSources:
    """Files beside an export, by their path in its folder ``math``.

    Attributes
    ----------
    files : dict of str to bytes
        All files as they are in the user's folder.
    compiled : tuple of str
        Those that are compiled by themselves.
    names : tuple of str
        What they define for one another, or declare under a name of the C library's kind, and is renamed.
    functions : dict of str to str
        Where each function that the export calls is defined.
    licences : tuple of str
        Files of the licence.
    undefined : tuple of str
        Marks that a header outside the folder would define as nothing.
    """

    files: dict[str, bytes]
    compiled: tuple[str, ...]
    names: tuple[str, ...]
    functions: dict[str, str]
    licences: tuple[str, ...]
    undefined: tuple[str, ...] = ()


def math_folder(path: Path) -> Path:
    """Return the folder, which must be one."""
    if not path.is_dir():
        raise checks.refuse("math", "'libm', or a folder with the C sources of a libm", str(path))
    return path


def math_sources(path: Path, functions: Sequence[str]) -> MathSources:
    """Return what the functions reach in a folder."""
    search = _MathSearch(path)
    for name in functions:
        search.require(name, f"math must be a folder that defines {name}, which this export calls")
    return search.result(functions)


@dataclass
class _MathSearch:
    """Files of a folder that are reached; paths are relative to it."""

    path: Path
    units: dict[str, CFile] = field(default_factory=dict)
    placed: dict[str, str] = field(default_factory=dict)
    """Where a file lies beside the export, and which it is."""
    where: dict[str, str] = field(default_factory=dict)

    @cached_property
    def _all(self) -> tuple[str, ...]:
        files = (one for one in self.path.rglob("*") if one.is_file())
        return tuple(sorted(one.relative_to(self.path).as_posix() for one in files))

    @cached_property
    def _sources(self) -> dict[str, CFile]:
        return {one: self._read(one) for one in self._all if one.endswith(".c")}

    def _read(self, name: str) -> CFile:
        return CFile((self.path / name).read_bytes())

    def require(self, name: str, otherwise: str) -> None:
        """Take the file that defines a function, which must be there."""
        if not self.take(name):
            raise ValueError(f"{otherwise}; {self._not_found(name)}")

    def _not_found(self, name: str) -> str:
        """Say where a function was looked for, where its name stands, and what would do."""
        told = f"looked for {name}(...) {{ in the {len(self._sources)} .c files of {str(self.path)!r}"
        whole = re.compile(rf"\b{name}\b".encode())
        beside = [k for k, one in self._sources.items() if whole.search(one.content)]
        other = [
            k for k in self._all if PurePosixPath(k).suffix in _ASSEMBLY and PurePosixPath(k).stem == name
        ]
        if other:
            told += f"; {other[0]} is assembly"
        elif beside:
            more = f" and {len(beside) - 1} more" if len(beside) > 1 else ""
            told += f"; its name stands in {beside[0]}{more} without a body, as where a macro defines it"
        return f"{told}: a folder with a C function of this name and its body would do"

    def take(self, name: str) -> bool:
        """Take the file that defines a name, and all that it reaches; whether there is one."""
        if name in self.where:
            return True
        word = name.encode()
        found = [k for k, one in self._sources.items() if word in one.content and name in one.defined]
        if not found:
            return False
        unit = self._chosen(found, f"{name} is defined")
        self.where[name] = unit
        if unit not in self.units:
            self.units[unit] = self._sources[unit]
            self._follow(unit)
        return True

    def _chosen(self, found: list[str], what: str) -> str:
        """Return the file that counts: that of every processor, then the one nearest to the folder."""
        every = [one for one in found if _GENERIC in PurePosixPath(one).parts] or found
        least = min(len(PurePosixPath(one).parts) for one in every)
        nearest = [one for one in every if len(PurePosixPath(one).parts) == least]
        if len(nearest) > 1:
            got = f"got it in {' and '.join(nearest)}: name a folder that holds one of them"
            raise ValueError(f"math must be a folder in which {what} once; {got}")
        return nearest[0]

    def _follow(self, unit: str) -> None:
        """Take what a source includes, calls, and reads of the data of others."""
        text = self.units[unit]
        texts = [text, *self._included(unit, unit)]
        for name in sorted((_union(texts, "foreign") | _OWN_BITS) & text.words):
            self.take(name)
        here = text.defined | _union(texts, "own") | _union(texts, "macros") | frozenset(EXACT.split())
        for name in sorted(_union(texts, "called") - here):
            if not self.take(name) and _has_own_bits(name):
                self.require(name, f"math must be a folder that defines {name}, which its {unit} calls")

    def _included(self, place: str, name: str, seen: frozenset[str] = frozenset()) -> list[CFile]:
        """Place a file, and all that it includes, where its includes look for them; return these."""
        if self.placed.setdefault(place, name) != name:
            told = f"{place} would be both {self.placed[place]} and {name}"
            raise ValueError(f"math must be a folder whose headers differ in name; {told}")
        found, seen = [], seen | {place}
        for wanted in self._read(name).includes:
            there = posixpath.normpath(posixpath.join(posixpath.dirname(place), wanted))
            if there not in seen and (other := self._resolved(name, wanted)) is not None:
                if there.startswith("../"):
                    told = f"{wanted} of its {name} would stand outside the export"
                    raise ValueError(f"math must be a folder whose includes stay in it; {told}")
                found += [self._read(other), *self._included(there, other, seen)]
        return found

    def _resolved(self, name: str, wanted: str) -> str | None:
        """Return the file of an include; None for a header of the C library."""
        beside = posixpath.normpath(posixpath.join(posixpath.dirname(name), wanted))
        if beside in self._all:
            return beside
        found = [one for one in self._all if f"/{one}".endswith(f"/{wanted}")]
        if found:
            return self._chosen(found, f"{wanted} stands")
        if wanted.removesuffix(".h") in HEADERS:
            return None
        looked = f"looked for it beside that file and anywhere in {str(self.path)!r}"
        raise ValueError(
            f"math must be a folder that has {wanted}, which its {name} includes; {looked}: name the folder"
            " above it in which both lie"
        )

    # -- result ----------------------------------------------------------------------------------------

    def result(self, functions: Sequence[str]) -> MathSources:
        """Return the files, under the shortest paths that keep them apart."""
        licences = self._licences()
        common = posixpath.commonpath([posixpath.dirname(one) for one in self.placed])
        short = {one: posixpath.relpath(one, common or ".") for one in self.placed}
        files = {short[place]: self._read(name).content for place, name in self.placed.items()}
        files |= {one.replace("/", "_"): self._read(one).content for one in licences}
        texts = [CFile(one) for one in files.values()]
        own = [CFile(self._read(name).content) for name in self.placed.values()]
        names = _union(own, "defined") | _union(texts, "reserved") | _with_own_bits(own)
        return MathSources(
            files=dict(sorted(files.items())),
            compiled=tuple(sorted(short[one] for one in self.units)),
            names=tuple(sorted(names)),
            functions={one: short[self.where[one]] for one in functions},
            licences=tuple(one.replace("/", "_") for one in licences),
            undefined=_undefined(texts),
        )

    def _licences(self) -> list[str]:
        """Return the files of the licence: in the folder, or on the way to what is reached."""
        ways = {posixpath.dirname(one) for one in self.placed.values()}
        homes = {"", *ways, *(str(up) for way in ways for up in PurePosixPath(way).parents)} - {"."}
        found = [
            one
            for one in self._all
            if posixpath.dirname(one) in homes and _LICENCE.match(posixpath.basename(one))
        ]
        if not found:
            rule = "a folder with the licence of its sources, in a file LICENSE, COPYING or COPYRIGHT"
            raise checks.refuse("math", rule, str(self.path))
        return found


def _undefined(texts: Sequence[CFile]) -> tuple[str, ...]:
    """Return the marks that no header among the files defines."""
    return tuple(one for one in _MARKS if one in _union(texts, "words") - _union(texts, "macros"))


def _with_own_bits(texts: Sequence[CFile]) -> frozenset[str]:
    """Return the functions that no source may take from the C library, however it calls them.

    By a pointer, in parentheses, joined in a macro: under a name of the export the linker does not find them.
    """
    told = (one for one in _union(texts, "words") if _has_own_bits(one.removeprefix("__builtin_")))
    return (_OWN_BITS | frozenset(told)) - _union(texts, "macros")


def _union(texts: Sequence[CFile], what: str) -> frozenset[str]:
    return frozenset[str]().union(*(getattr(one, what) for one in texts))


def _has_own_bits(name: str) -> bool:
    """Whether a function of C, for any kind of numbers, has last bits of its library's."""
    return name in _OWN_BITS or (name[-1] in "fl" and name[:-1] in _OWN_BITS)
