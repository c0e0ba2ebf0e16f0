"""Builds of an export that a check compares: libraries, programs under sanitizers and under emulators."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.codegen._files.vectors import Answers
from sdpgrind.codegen._proof import compilers
from sdpgrind.codegen._proof.foreign import other_functions
from sdpgrind.codegen._proof.library import Library, sizes_of
from sdpgrind.codegen._proof.program import ProgramRun
from sdpgrind.codegen._proof.reference import COMPILERS
from sdpgrind.codegen._proof.stack import TELLING, stack_of, stack_told
from sdpgrind.codegen._recipe import Recipe

TARGETS = ("sanitizers", "aarch64", "armhf")
SLOW = 100_000  # chosen: steps under sanitizers and emulators, some ten times as slow
_SANITIZED = ("-O1", "-DSG_CHECK", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
_ABROAD = {
    "aarch64": ("aarch64-linux-gnu-gcc", "qemu-aarch64"),
    "armhf": ("arm-linux-gnueabihf-gcc", "qemu-arm"),
}


class Runner(Protocol):
    """Build of an export."""

    def take(self, rows: Floats, resets: Bools) -> Answers:
        """Return what follows on rows, the state going on from the rows before."""


class Builds:
    """Builds by their names, each with the most steps that it takes.

    Parameters
    ----------
    source : Path
        Folder of the export.
    folder : Path
        Where they are built.
    libm : sequence of str
        Functions of the C library that are used.
    fresh : array
        State after a reset.
    """

    def __init__(
        self, recipe: Recipe, source: Path, folder: Path, name: str, libm: Sequence[str], fresh: Floats
    ) -> None:
        self.libm, self._fresh = libm, fresh
        self._recipe, self._source, self._folder, self._name = recipe, source, folder, name
        self._sizes = sizes_of(recipe)
        self.builds: dict[str, Runner] = {}
        self.most: dict[str, float] = {}
        self._stacks: dict[str, int | None] = {}

    def add_library(self, compiler: str, level: str) -> None:
        """Add a shared library of a compiler at a level."""
        library = self._gcc(level) if compiler == "gcc" else self._library(self._place(), compiler, level)
        self._add(f"{compiler} {level}", library, np.inf)

    def add_targets(self, there: Sequence[str], targets: Sequence[str]) -> list[str]:
        """Add what is to be built beside libraries; return what is not found, or not possible."""
        missing = []
        for target in targets:
            if target == "sanitizers" and not there:
                missing.append("sanitizers: no compiler here")
            elif target == "sanitizers":
                missing += [f"sanitizers of {one}" for one in there if not self._sanitized(one)]
            else:
                missing += self._abroad(target, there)
        return missing

    def stack(self, levels: Sequence[str]) -> dict[str, int]:
        """Return the bytes of stack of a step by gcc, by level."""
        found = {level: self._stacks.get(level) or self._stack_of(level) for level in levels}
        return {level: size for level, size in found.items() if size is not None}

    def _gcc(self, level: str) -> Library:
        """Return the library of gcc, which tells the stack where it knows the flags."""
        place = self._place()
        try:
            library = self._library(place, "gcc", level, *TELLING)
        except RuntimeError:
            return self._library(place, "gcc", level)
        self._stacks[level] = stack_told(place, self._name)
        return library

    def _library(self, place: Path, compiler: str, level: str, *flags: str) -> Library:
        return Library(self._source, place, self._name, self._sizes, compiler, *level.split(), *flags)

    def _stack_of(self, level: str) -> int | None:
        return stack_of("gcc", self._source, self._place(), self._name, level)

    def _place(self) -> Path:
        return Path(tempfile.mkdtemp(dir=self._folder))

    def _add(self, build: str, runner: Runner, most: float) -> None:
        self.builds[build], self.most[build] = runner, most

    def _program(self, build: str, emulator: str, compiler: str, *flags: str) -> None:
        place = (self._source, self._place(), self._name, self._sizes)
        self._add(build, ProgramRun(*place, self._fresh, emulator, compiler, flags), SLOW)

    def _sanitized(self, compiler: str) -> bool:
        if not compilers.links(compiler, *_SANITIZED):
            return False
        self._program(f"{compiler} sanitizers", "", compiler, *_SANITIZED)
        return True

    def _abroad(self, target: str, there: Sequence[str]) -> list[str]:
        """Add a build for another processor, unless its C library has bits of its own."""
        compiler, emulator = _ABROAD[target]
        if missing := compilers.found((compiler, emulator))[1]:
            return missing
        here = there or compilers.found(COMPILERS)[0]  # not compared itself, where it was not asked for
        if self.libm and not here:
            return [f"{target}: no compiler here to compare its C library with"]
        place = self._place()
        others = other_functions(self.libm, place, here[0], compiler, emulator) if self.libm else []
        if others:
            return [f"{target}: its C library computes {', '.join(others)} with other bits"]
        self._program(target, emulator, compiler, "-O2", "-static")
        return []
