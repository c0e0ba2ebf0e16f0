"""Check of an export: compiled by each compiler at each level, against its reference, on many steps."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.progress import Progress, portion
from sdpgrind.base.rng import Seed
from sdpgrind.codegen._files import vector_kernels
from sdpgrind.codegen._files.vectors import ROWS, Answers, LibrarySteps, ReferenceSteps, Varied, rows_of
from sdpgrind.codegen._proof import compilers
from sdpgrind.codegen._proof.builds import Builds
from sdpgrind.codegen._proof.reference import COMPILERS, library_of
from sdpgrind.codegen._recipe import Recipe

LEVELS = ("-O0", "-O1", "-O2", "-O3")
_BUILDING = 0.3  # chosen: share of progress for compilers, and again for sanitizers and emulators
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
        Outputs and state of the reference.
    status, wanted_status : int
        Of the C and of the reference, as the header lists them.
    """

    build: str
    step: int
    inputs: tuple[float, ...]
    outputs: tuple[float, ...]
    wanted: tuple[float, ...]
    state: tuple[float, ...]
    wanted_state: tuple[float, ...]
    status: int
    wanted_status: int

    def __str__(self) -> str:
        """First number that differs: the status, one of the outputs, or one of the state."""
        told = f"first step {self.step} by {self.build}"
        if self.status != self.wanted_status:
            return f"{told}: status {self.status}, expected {self.wanted_status}"
        pairs = (("out", self.outputs, self.wanted), ("state", self.state, self.wanted_state))
        for name, found, wanted in pairs:
            wrong = vector_kernels.differing(*(np.array([one]).T.view(np.uint64) for one in (found, wanted)))
            if wrong.any():
                k = int(np.argmax(wrong))
                return f"{told}: {name}[{k}] = {found[k]!r}, expected {wanted[k]!r}"
        return told


@dataclass(frozen=True)
class ExportCheck:
    """What a check has found; numbers of steps, unit 1.

    Attributes
    ----------
    status : str
        "equal", "differs", or "not run" where no compiler was found.
    states : int
        Steps of each build but those that `steps` names with fewer.
    builds : dict of str to int
        Compiler and level to the number of steps that differ.
    missing : tuple of str
        Compilers, sanitizers and emulators that were not found, and processors that were left out as their C
        library has bits of its own.
    first : Difference or None
        First step that differs.
    steps : dict of str to int
        Steps of each build; fewer under sanitizers and emulators, which are slow.
    stack : dict of str to int
        Bytes of stack of a step by gcc's own count, by level; the manifest's estimate is to be above.
    reference : str
        What builds are compared with: "library", or the compiler and level of the C itself where it has
        elementary functions of its own, which the library has not.
    """

    status: str
    states: int
    builds: dict[str, int] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    first: Difference | None = None
    steps: dict[str, int] = field(default_factory=dict)
    stack: dict[str, int] = field(default_factory=dict)
    reference: str = "library"

    def __str__(self) -> str:
        differ = [f"{count} differ by {build}" for build, count in self.builds.items() if count]
        first = [] if self.first is None else [str(self.first)]
        steps = [f"{self.states} steps of {', '.join(self.builds) or 'no build'}"]
        absent = [f"left out: {', '.join(self.missing)}"] if self.missing else []
        return f"{self.status}: {'; '.join([*steps, *differ, *first, *absent])}"

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
    manifest: Mapping[str, Any],
    states: int,
    names: Sequence[str],
    levels: Sequence[str],
    targets: Sequence[str],
    rng: Seed,
    progress: Progress,
) -> ExportCheck:
    """Compare all builds with the reference on varied inputs of the recipe."""
    with tempfile.TemporaryDirectory() as kept:
        there, missing = compilers.found(names)
        name, given = _reference(recipe, folder, Path(kept), manifest, there)
        if given is None:
            return ExportCheck("not run", 0, missing=tuple(missing), reference=name)
        own = manifest["math"] == "folder"
        made = Builds(
            recipe, folder, Path(kept), str(manifest["name"]), () if own else manifest["libm"], given.fresh
        )
        wanted = [pair for pair in product(there, levels) if " ".join(pair) != name]
        for k, (compiler, level) in enumerate(wanted):
            progress(_BUILDING * k / len(wanted), f"{compiler} {level}")
            made.add_library(compiler, level)
        progress(_BUILDING, ", ".join(targets) or "comparing")
        missing += made.add_targets(there, targets)
        counts, first = _compared(recipe, made, given, states, rng, portion(progress, 2 * _BUILDING, 1.0))
        stack = made.stack(levels) if "gcc" in there else {}
    status = "not run" if not counts else "differs" if sum(counts.values()) else "equal"
    steps = {build: int(min(states, most)) for build, most in made.most.items()}
    return ExportCheck(
        status, states if counts else 0, counts, tuple(missing), first, steps, stack, reference=name
    )


def _reference(
    recipe: Recipe, folder: Path, place: Path, manifest: Mapping[str, Any], there: Sequence[str]
) -> tuple[str, ReferenceSteps | None]:
    """Return what builds are compared with; None: there is no compiler for it."""
    if manifest["math"] != "folder":
        return "library", LibrarySteps(recipe)
    here = there or compilers.found(COMPILERS)[0]
    if not here:
        return "C built here", None
    return f"{here[0]} -O0", library_of(recipe, folder, place, str(manifest["name"]), here[0])


def _compared(
    recipe: Recipe, made: Builds, reference: ReferenceSteps, states: int, rng: Seed, progress: Progress
) -> tuple[dict[str, int], Difference | None]:
    """Return the number of steps that differ, by build, and the first of them."""
    counts, first = dict.fromkeys(made.builds, 0), None
    for begin, rows, wanted in _expected(recipe, reference, states if made.builds else 0, rng):
        for build, runner in made.builds.items():
            if begin >= made.most[build]:
                continue
            progress(begin / states, f"{states} steps of each build: {build} from step {begin} on")
            found = runner.take(*rows)
            wrong = _wrong(found, wanted)
            counts[build] += int(wrong.sum())
            if first is None and wrong.any():
                first = _difference(build, begin, int(np.argmax(wrong)), rows[0], found, wanted)
    return counts, first


def _expected(
    recipe: Recipe, reference: ReferenceSteps, states: int, rng: Seed
) -> Iterator[tuple[int, tuple[Floats, Bools], Answers]]:
    """Give inputs in pieces with the answers of the reference."""
    if not states:
        return
    rows, resets = rows_of(recipe, np.random.default_rng(rng), 4 * ROWS)
    varied = Varied(recipe, rows, resets)
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
    codes = int(found.codes[k]), int(wanted.codes[k])
    return Difference(build, begin + k, told[0], told[1], told[2], told[3], told[4], *codes)
