"""`Exported`: what `export` has written, its check, and the C as a controller."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from sdpgrind.base import checks
from sdpgrind.base.progress import ProgressOption, reporting
from sdpgrind.base.rng import Seed
from sdpgrind.codegen._fmi.archive import export_folder
from sdpgrind.codegen._proof.builds import TARGETS
from sdpgrind.codegen._proof.check import LEVELS, ExportCheck, checked
from sdpgrind.codegen._proof.compilers import sources_of
from sdpgrind.codegen._proof.controller import CompiledController
from sdpgrind.codegen._recipe import Recipe


@dataclass(frozen=True, eq=False, repr=False)
class Exported:
    """Written export; its `size` is in bytes of text, unit 1.

    Attributes
    ----------
    path : Path
        Folder, or FMU.
    manifest : mapping
        Content of ``manifest.json``.
    recipe : Recipe
        What was exported.
    """

    path: Path
    manifest: Mapping[str, Any]
    recipe: Recipe

    @classmethod
    def of(cls, path: Path, recipe: Recipe) -> Self:
        """Return the export in a folder or an FMU; units (mm, s, N) are those of the recipe.

        Parameters
        ----------
        path : Path
            Folder, or FMU.
        recipe : Recipe
            What was exported.
        """
        with export_folder(path) as folder:
            return cls(path, json.loads((folder / "manifest.json").read_text(encoding="utf-8")), recipe)

    def __repr__(self) -> str:
        about = (
            f"{self.manifest['kind']}, {self.size / 1000:.0f} kB, {len(self.manifest['functions'])} functions"
        )
        return f"Exported({str(self.manifest['name'])!r} in {str(self.path)!r}: {about}; {self.promise})"

    @property
    def promise(self) -> str:
        """What the bits depend on, in a sentence without units."""
        return str(self.manifest["promise"])

    @property
    def size(self) -> int:
        """Size of header and source as text, bytes; on the target: ``manifest["sizes"]["tables"]``."""
        name = self.manifest["name"]
        with export_folder(self.path) as folder:
            sources = (folder / f"{name}.h", *sources_of(folder, str(name)))
            return sum(one.stat().st_size for one in sources)

    @reporting
    def check(
        self,
        states: int = 100_000,
        compilers: Sequence[str] = ("gcc", "clang"),
        *,
        levels: Sequence[str] = LEVELS,
        targets: Sequence[str] = TARGETS,
        rng: Seed = 0,
        progress: ProgressOption = None,
    ) -> ExportCheck:
        """Compile the C with each compiler at each level and compare it with the library in bits.

        Numbers are compared in the units of the thing (mm, s, N).

        State, outputs and status are compared after every step. Inputs are those of the self-test, varied
        anew: with missing readings, outliers and restarts. An export with elementary functions from a folder
        (``math``) is compared with its own C, built here at -O0, since the library has other last digits.

        Parameters
        ----------
        states : int
            Steps of each build.
        compilers : sequence of str
            Commands of compilers; those that are not found are named in the result.
        levels : sequence of str
            Flags of a build, as one text each.
        targets : sequence of str
            Further builds, of 100 000 steps at most each: "sanitizers" (of addresses and undefined behaviour,
            with indices checked, by each compiler), "aarch64" and "armhf" (by Debian's cross compilers under
            qemu-user, where their C library has the bits of this computer's). What is not run is named.
        rng : int, SeedSequence or Generator
            Source of the inputs.
        progress : callable(share, text), True or None
            True: a line with the time left. Default: a line on standard error when it takes long.

        Returns
        -------
        ExportCheck
            Number of steps that differ, by build; the first of them; compilers, sanitizers and emulators that
            were not found; bytes of stack that gcc counts.

        Raises
        ------
        TypeError
            When compilers, levels or targets are one text.
        RuntimeError
            When a compiler refuses the C, or a sanitizer stops it.
        """
        assert callable(progress)  # made by the decorator
        checks.count("states", states)
        names = _several("compilers", compilers, "('gcc',)"), _several("levels", levels, "('-O2',)")
        wanted = _several("targets", targets, "('sanitizers',)")
        for target in wanted:
            checks.one_of("targets", target, TARGETS)
        with export_folder(self.path) as folder:
            return checked(self.recipe, folder, self.manifest, states, *names, wanted, rng, progress)

    def controller(self, compiler: str = "gcc") -> CompiledController:
        """Return a controller whose `step` runs the C (mm, s, N): the first half of hardware in the loop.

        Parameters
        ----------
        compiler : str
            Command of the C compiler.

        Raises
        ------
        ValueError
            When the compiler is not found.
        """
        with export_folder(self.path) as folder:
            return CompiledController(self.recipe, folder, str(self.manifest["name"]), compiler)


def _several(name: str, given: Sequence[str], example: str) -> tuple[str, ...]:
    """Return texts as a tuple; a text alone would be read by its letters."""
    if isinstance(given, str) or not all(isinstance(one, str) for one in given):
        raise TypeError(f"{name} must be a sequence of texts, as {example}; got {checks.shown(given)}")
    return tuple(given)
