"""Check of an export: compiled by each compiler at each level, against the library, on many steps."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.rng import Seed
from sdpgrind.codegen._files import vector_kernels
from sdpgrind.codegen._files.vectors import ROWS, Answers, LibrarySteps, Varied, rows_of
from sdpgrind.codegen._proof import compilers
from sdpgrind.codegen._proof.library import Library
from sdpgrind.codegen._recipe import Recipe

LEVELS = ("-O0", "-O1", "-O2", "-O3")
_CHUNK = 20_000  # chosen: steps at once: 25 MB of states of a controller of plunge


@dataclass(frozen=True)
class Difference:
    """First step that differs: inputs, outputs and state, in the units of the export (mm, s, N ...).

    Attributes
    ----------
    build : str
        Compiler and level.
    step : int
        Number of the step.
    inputs, outputs, state : tuple of float
        Of the C.
    wanted, wanted_state : tuple of float
        Outputs and state of the library.
    """

    build: str
    step: int
    inputs: tuple[float, ...]
    outputs: tuple[float, ...]
    wanted: tuple[float, ...]
    state: tuple[float, ...]
    wanted_state: tuple[float, ...]


@dataclass(frozen=True)
class ExportCheck:
    """What a check has found; numbers of steps, unit 1.

    Attributes
    ----------
    status : str
        "equal", "differs", or "not run" where no compiler was found.
    states : int
        Steps of each build.
    builds : dict of str to int
        Compiler and level to the number of steps that differ.
    missing : tuple of str
        Compilers that were not found.
    first : Difference or None
        First step that differs.
    """

    status: str
    states: int
    builds: dict[str, int] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    first: Difference | None = None

    @property
    def differing(self) -> int:
        """Number of steps (unit 1) that differ, of all builds; raises where nothing was run."""
        if not self.builds:
            raise RuntimeError(
                f"nothing was run: none of {', '.join(self.missing)} was found on this computer"
            )
        return sum(self.builds.values())


def checked(
    recipe: Recipe,
    folder: Path,
    name: str,
    states: int,
    names: Sequence[str],
    levels: Sequence[str],
    rng: Seed,
) -> ExportCheck:
    """Compare all builds with the library on varied inputs of the recipe."""
    there, missing = compilers.found(names)
    sizes = (len(recipe.inputs), len(recipe.outputs), recipe.state.size)
    counts: dict[str, int] = {}
    first: Difference | None = None
    with tempfile.TemporaryDirectory() as kept:
        builds = {}
        for compiler in there:
            for level in levels:
                build = f"{compiler} {level}"
                place = Path(kept) / build.replace(" ", "").replace("/", "_")
                place.mkdir()
                builds[build] = Library(folder, place, name, sizes, compiler, *level.split())
                counts[build] = 0
        for begin, rows, wanted in _expected(recipe, states if builds else 0, rng):
            for build, library in builds.items():
                found = library.take(*rows)
                wrong = _wrong(found, wanted)
                counts[build] += int(wrong.sum())
                if first is None and wrong.any():
                    first = _difference(build, begin, int(np.argmax(wrong)), rows[0], found, wanted)
    status = "not run" if not counts else "differs" if sum(counts.values()) else "equal"
    return ExportCheck(status, states if counts else 0, counts, tuple(missing), first)


def _expected(recipe: Recipe, states: int, rng: Seed) -> Iterator[tuple[int, tuple[Floats, Bools], Answers]]:
    """Give inputs in pieces with the library's answers."""
    if not states:
        return
    rows, resets = rows_of(recipe, np.random.default_rng(rng), 4 * ROWS)
    varied, reference = Varied(recipe, rows, resets), LibrarySteps(recipe)
    for begin in range(0, states, _CHUNK):
        given = varied.take(min(_CHUNK, states - begin))
        yield begin, given, reference.take(*given)


def _wrong(found: Answers, wanted: Answers) -> Any:
    pairs = ((found.states, wanted.states), (found.outputs, wanted.outputs))
    wrong = [vector_kernels.differing(*(one.view(np.uint64) for one in pair)) for pair in pairs]
    return wrong[0] | wrong[1] | (found.codes != wanted.codes)


def _difference(build: str, begin: int, k: int, rows: Floats, found: Answers, wanted: Answers) -> Difference:
    places = (rows, found.outputs, wanted.outputs, found.states, wanted.states)
    told = [tuple(map(float, one[k])) for one in places]
    return Difference(build, begin + k, told[0], told[1], told[2], told[3], told[4])
