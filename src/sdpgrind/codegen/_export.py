"""`export`: C99 of a plan, a controller or a user's own kernel, with the library's bits."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sdpgrind import __version__
from sdpgrind.base import checks
from sdpgrind.base.progress import Progress, ProgressOption, portion, reporting, silent
from sdpgrind.codegen._exported import Exported
from sdpgrind.codegen._files.folder import check_free, put_back, write_folder
from sdpgrind.codegen._files.header import header
from sdpgrind.codegen._files.manifest import manifest, promise, text_of
from sdpgrind.codegen._files.program import program_files
from sdpgrind.codegen._files.selftest import selftest
from sdpgrind.codegen._files.shell import source_of
from sdpgrind.codegen._files.vectors import vectors_of
from sdpgrind.codegen._fmi import archive
from sdpgrind.codegen._fmi.unit import unit_files
from sdpgrind.codegen._math.sources import math_folder, math_sources
from sdpgrind.codegen._math.wrapped import math_files, math_notes, outside
from sdpgrind.codegen._names import c_name
from sdpgrind.codegen._proof.reference import built_here, distance
from sdpgrind.codegen._recipe import Recipe
from sdpgrind.codegen._tables import TablesAsked

TARGETS = ("c99", "fmi2")
EXPORTED = (
    "weldbead.SequencePolicy", "sdp.Policy", "locus.Locus", "locus.LocusController",
    "plunge.CycleController", "plunge.StagedController", "finishing.TorqueController",
    "weldbead.force.ForceController", "weldbead.force.PredictiveController", "centering.GeometryEstimator",
    "centering.Strategy", "identify.RecursiveLeastSquares", "identify.RandomWalk",
)  # fmt: skip
"""Classes with ``__export__``, by where they stand for a user; the docs say more of each."""
# measured on a policy of 1601 heights with `lost_max`, shares of the CPU time of the whole
_OF_TABLES, _OF_FILES = (0.1, 0.7), 0.95
_TRANSLATED = 0.6  # measured: of the files; from there on vectors
_INSTEAD = {
    "CyclePlan": "plunge.CycleController(plan.problem)",
    "CycleProblem": "plunge.CycleController(problem)",
    "Motion": "finishing.TorqueController(axis, motion)",
}
"""Classes without it -> the controller that is exported in their place."""


@reporting
def export(
    thing: Any,
    path: str | os.PathLike[str],
    target: str = "c99",
    *,
    precision: str = "double",
    math: str | os.PathLike[str] = "libm",
    lost_max: float | None = None,
    outputs: Sequence[str] | None = None,
    name: str | None = None,
    overwrite: bool = False,
    progress: ProgressOption = None,
) -> Exported:
    """Write a plan or a controller as C99 that gives the same bits as the library.

    Inputs and outputs are in the units of the thing (mm, s, N, W), named in the header. The C is translated
    from the kernels that the library runs. It allocates nothing, keeps nothing static,
    and needs math.h alone. With it come a self-test with vectors and a manifest: see
    :doc:`/on_your_controller`.

    Parameters
    ----------
    thing : plan, controller or Recipe
        What has ``__export__``: :doc:`/exported_things` lists plans, controllers, estimators and tables; or a
        `Recipe` of a kernel of one's own.
    path : path
        Folder that is written: ``NAME.h``, ``NAME.c``, ``NAME_selftest.c``, ``vectors.bin``,
        ``manifest.json``; with a quadratic program ``NAME_program.c`` and its licence. Folders in which it
        lies are made.
    target : {"c99", "fmi2"}
        C99 in a folder, or an FMU of FMI 2.0 for co-simulation around it: `path` is then a file that ends in
        ``.fmu``.
    precision : {"double", "float32", "int16"}
        How the tables of a policy are kept: as they are, or rounded, with cells in which the action changes
        as sorted lists. What that loses is computed, from the plan's own problem, and stands in the manifest
        ("lost": see :doc:`/exported_things`).
    math : "libm" or path
        Elementary functions (exp, log, pow ...): those of the C library, or a folder with the C sources of a
        libm and their licence, from which what is reached goes into ``math`` beside the export: the bits are
        then the same on every target, and those of the library only nearly (see :doc:`/exported_bits`). A C
        compiler must be there. Nothing is taken where no such function is called.
    lost_max : float, optional
        Largest value lost at any node of any stage, $ or what the plan charges in. The smallest form that
        keeps it is written; with a `precision` other than "double" that one, if it keeps it.
    outputs : sequence of str, optional
        Outputs of a policy: "gap" ($), a table of its own, may be left out, "value" ($) be added.
    name : str, optional
        Prefix of files, types and functions. Default: the name of the folder, or of the FMU.
    overwrite : bool
        Whether another export there is replaced. It stays until the new one is complete; what a killed
        process had moved aside, the next export puts back.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    Exported
        Promise, manifest, check against the library, and the C as a controller.

    Raises
    ------
    TypeError
        When the thing cannot be exported.
    ValueError
        When a kernel is outside the subset that is translated (file, line, construct and what to write
        instead), a name is no identifier of C or is taken by its headers, or the folder or FMU was not
        exported, or holds something else; when the value lost ($) is above `lost_max` in every form, or
        cannot be computed, as the plan was loaded without its problem; when the thing has no tables that can
        be rounded; when the folder `math` is none, has no licence, lacks a function, or defines one twice, or
        no compiler is there for it.
    RuntimeError
        When a compiler refuses the sources in `math`.
    NotADirectoryError
        When a file stands where a folder of `path` must be.
    FileExistsError
        When `path` holds another export and `overwrite` is False.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> import sdpgrind
    >>> from sdpgrind import plunge
    >>> controller = plunge.StagedController(plunge.preset("simulation"))
    >>> folder = pathlib.Path(tempfile.mkdtemp()) / "stages"
    >>> stages = sdpgrind.export(controller, folder)
    >>> sorted(path.name for path in folder.iterdir())
    ['manifest.json', 'stages.c', 'stages.h', 'stages_selftest.c', 'vectors.bin']
    >>> print(stages.promise)
    same bits where the C library computes pow as that of this computer; the self-test tells
    """
    assert callable(progress)  # made by the decorator
    checks.one_of("target", target, TARGETS)
    asked = replace(TablesAsked.of(precision, lost_max, outputs), tell=portion(progress, *_OF_TABLES))
    folder = None if math == "libm" else math_folder(checks.path("math", math))
    recipe, place = recipe_of(thing, asked), checks.path("path", path)
    unit = target == "fmi2"
    if unit and recipe.program is not None:
        raise checks.refuse("target", f"'c99' for a {recipe.kind}, which has a program of its own", target)
    put_back(place)
    (archive.check_free if unit else check_free)(place, overwrite)
    prefix = c_name("name", name if name is not None else place.stem if unit else place.name)
    files = files_of(recipe, prefix, folder, portion(progress, _OF_TABLES[1], _OF_FILES))
    progress(_OF_FILES, "files")
    if unit:
        archive.write_archive(place, unit_files(recipe, prefix, __version__, files), overwrite)
    else:
        write_folder(place, files, overwrite)
    return Exported.of(place, recipe)


def recipe_of(thing: Any, asked: TablesAsked) -> Recipe:
    """Return the recipe of a thing, with its tables as asked; refuse what has none."""
    if asked.given and not hasattr(type(thing), "__export_tables__"):
        name, value = next(iter(asked.given.items()))
        usual = "'double'" if name == "precision" else "None"
        rule = f"{usual} for a {type(thing).__name__}: only the tables of a policy are rounded"
        raise checks.refuse(name, rule, value)
    if isinstance(thing, Recipe):
        return thing
    told = getattr(type(thing), "__export__", None)
    if told is None:
        rule = f"one of {', '.join(EXPORTED)}, table() or inversion() of a locus, or a codegen.Recipe"
        name = type(thing).__name__
        instead = f", whose {_INSTEAD[name]} is one" if name in _INSTEAD else ""
        raise TypeError(f"thing must be {rule}; got {name}{instead}")
    recipe: Recipe = thing.__export_tables__(asked) if asked.given else told(thing)
    return recipe


def files_of(recipe: Recipe, name: str, folder: Path | None, tell: Progress = silent) -> dict[str, bytes]:
    """Return name and content of all files; `folder`: that of elementary functions, None: the C library's."""
    tell(0.0, "kernels as C")
    source = source_of(recipe, name, __version__, outside(name) if folder else "")
    files = {
        f"{name}.h": header(recipe, name, __version__, promise(recipe, source), source.digest).encode(),
        f"{name}.c": source.text.encode(),
        **({} if recipe.program is None else program_files(recipe.program, name)),
    }
    notes: dict[str, Any] = {}
    tell(_TRANSLATED, "vectors of the self-test")
    if folder and source.libm:
        sources = math_sources(folder, source.libm)
        files |= math_files(sources, name)
        with built_here(recipe, name, files) as begin:
            vectors = vectors_of(recipe, begin)
            notes = {**math_notes(sources), "from_library": distance(recipe, begin)}
    else:
        vectors = vectors_of(recipe)
    told = manifest(recipe, name, __version__, source, vectors, notes)
    test = {
        f"{name}_selftest.c": selftest(recipe, name, vectors, bool(notes)).encode(),
        "vectors.bin": vectors.table().astype("<f8").tobytes(),
    }
    files |= test
    return {**files, "manifest.json": text_of(told, files).encode()}
