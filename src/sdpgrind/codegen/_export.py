"""`export`: C99 of a plan, a controller or a user's own kernel, with the library's bits."""

import os
from typing import Any

from sdpgrind import __version__
from sdpgrind.base import checks
from sdpgrind.codegen._exported import Exported
from sdpgrind.codegen._files.folder import check_free, write_folder
from sdpgrind.codegen._files.header import header
from sdpgrind.codegen._files.manifest import manifest, promise, text_of
from sdpgrind.codegen._files.selftest import selftest
from sdpgrind.codegen._files.shell import CSource, source_of
from sdpgrind.codegen._files.vectors import Vectors, vectors_of
from sdpgrind.codegen._fmi import archive
from sdpgrind.codegen._fmi.unit import unit_files
from sdpgrind.codegen._recipe import Recipe, c_name

TARGETS = ("c99", "fmi2")


def export(
    thing: Any,
    path: str | os.PathLike[str],
    target: str = "c99",
    *,
    name: str | None = None,
    overwrite: bool = False,
) -> Exported:
    """Write a plan or a controller as C99 that gives the same bits as the library.

    Inputs and outputs are in the units of the thing (mm, s, N, W), named in the header. The C is translated
    from the kernels that the library runs. It allocates nothing, keeps nothing static,
    and needs math.h alone. With it come a self-test with vectors and a manifest: see
    :doc:`/on_your_controller`.

    Parameters
    ----------
    thing : plan, controller or Recipe
        What has ``__export__``: `weldbead.SequencePolicy`, `locus.Locus` (its table by the hidden state) and
        ``locus.table()``, `plunge.CycleController`, `plunge.StagedController`, `finishing.TorqueController`,
        `weldbead.force.ForceController` (along its plan; without one its law, to which force and position of
        the plan are handed over), `centering.GeometryEstimator`; or a `Recipe` of a kernel of one's own.
    path : path
        Folder that is written: ``NAME.h``, ``NAME.c``, ``NAME_selftest.c``, ``vectors.bin``,
        ``manifest.json``. Its parent must exist.
    target : {"c99", "fmi2"}
        C99 in a folder, or an FMU of FMI 2.0 for co-simulation around it: `path` is then a file that ends in
        ``.fmu``.
    name : str, optional
        Prefix of files, types and functions. Default: the name of the folder, or of the FMU.
    overwrite : bool
        Whether another export there is replaced. It stays until the new one is complete.

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
        instead), a name is no identifier of C, or the folder holds something else.
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
    same bits where the C library computes log, pow and expm1 as that of this computer; the self-test tells
    """
    checks.one_of("target", target, TARGETS)
    recipe, place = recipe_of(thing), checks.path("path", path)
    unit = target == "fmi2"
    (archive.check_free if unit else check_free)(place, overwrite)
    prefix = c_name("name", name if name is not None else place.stem if unit else place.name)
    source, vectors = source_of(recipe, prefix, __version__), vectors_of(recipe)
    files = files_of(recipe, prefix, source, vectors)
    if unit:
        archive.write_archive(place, unit_files(recipe, prefix, __version__, files), overwrite)
    else:
        write_folder(place, files, overwrite)
    return Exported.of(place, recipe)


def recipe_of(thing: Any) -> Recipe:
    """Return the recipe of a thing; refuse what has none."""
    if isinstance(thing, Recipe):
        return thing
    told = getattr(type(thing), "__export__", None)
    if told is None:
        raise TypeError(
            "thing must be a SequencePolicy, a LocusTable, a Locus, a CycleController, a StagedController, a"
            " TorqueController, a ForceController, a GeometryEstimator or a Recipe;"
            f" got {type(thing).__name__}"
        )
    recipe: Recipe = told(thing)
    return recipe


def files_of(recipe: Recipe, name: str, source: CSource, vectors: Vectors) -> dict[str, bytes]:
    """Return name and content of all files."""
    told = manifest(recipe, name, __version__, source, vectors)
    files = {
        f"{name}.h": header(recipe, name, __version__, promise(source)).encode(),
        f"{name}.c": source.text.encode(),
        f"{name}_selftest.c": selftest(recipe, name, vectors).encode(),
        "vectors.bin": vectors.table().astype("<f8").tobytes(),
    }
    return {**files, "manifest.json": text_of(told, files).encode()}
