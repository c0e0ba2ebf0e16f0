"""C with elementary functions of its own: on this computer it answers what a target must answer."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sdpgrind.codegen._files.folder import lay_out
from sdpgrind.codegen._files.vectors import ROWS, STEPS, LibrarySteps, Varied, blocks_of, rows_of
from sdpgrind.codegen._proof import compilers
from sdpgrind.codegen._proof.library import Library, sizes_of
from sdpgrind.codegen._recipe import Recipe

COMPILERS = ("gcc", "clang", "cc")  # chosen: any compiler of this computer gives these bits
_STEPS = 20_000  # chosen: of the distance from the library; a quarter of a second


@contextmanager
def built_here(recipe: Recipe, name: str, files: Mapping[str, bytes]) -> Iterator[Callable[[], Library]]:
    """Give what builds the files of an export anew, each time with the state after a reset."""
    there = compilers.found(COMPILERS)[0]
    if not there:
        raise ValueError(
            "math must be 'libm' where no C compiler is found: the answers of the self-test come from the C"
            f" that is built here with the functions of the folder; looked for {', '.join(COMPILERS)}"
        )
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        lay_out(folder, files)
        library = library_of(recipe, folder, folder, name, there[0])

        def begin() -> Library:
            library.state[:] = library.fresh
            return library

        yield begin


def library_of(recipe: Recipe, source: Path, place: Path, name: str, compiler: str) -> Library:
    """Return the export in a folder as a library, built in `place`; a function must have been declared."""
    flags = ("-O0", "-Werror=implicit-function-declaration")
    rule = "math must be a folder whose sources compile with the headers of C and their own alone"
    try:
        return Library(source, place, name, sizes_of(recipe), compiler, *flags)
    except RuntimeError as error:  # the compiler names the file
        raise RuntimeError(f"{rule}; {error}") from None
    except OSError as error:
        raise RuntimeError(f"{rule}; {compiler} lacks something that the export needs: {error}") from None


def distance(recipe: Recipe, begin: Callable[[], Library]) -> dict[str, Any]:
    """Return how far the C is from the library along the inputs of the self-test, in their units.

    Each goes on from its own state, so that differences of last digits may grow, and decisions fall apart.
    """
    rows, resets = rows_of(recipe, np.random.default_rng(0), ROWS)
    steps = min(_STEPS, STEPS * blocks_of(recipe))
    given = Varied(recipe, rows, resets).take(steps)
    found, wanted = begin().take(*given), LibrarySteps(recipe).take(*given)
    answered = (found.codes >= 0) & (wanted.codes >= 0)
    pairs = zip(recipe.outputs, found.outputs[answered].T, wanted.outputs[answered].T, strict=True)
    return {
        "steps": steps,
        "status_differs": int((np.maximum(found.codes, -1) != np.maximum(wanted.codes, -1)).sum()),
        "largest": {name: _largest(*pair) for name, *pair in pairs},
    }


def _largest(found: Sequence[float], wanted: Sequence[float]) -> float:
    """Return the largest difference of numbers that both are finite."""
    one, other = np.asarray(found), np.asarray(wanted)
    both = np.isfinite(one) & np.isfinite(other)
    return float(np.abs(one[both] - other[both]).max(initial=0.0))
