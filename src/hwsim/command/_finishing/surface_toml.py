"""Surface and path of a finishing job: a preset, control points or a face of a file, and lines over it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hwsim.command._toml import Table
from sdpgrind import finishing
from sdpgrind.base.quantities import units_of
from sdpgrind.finishing.path import LiftedPath
from sdpgrind.finishing.surface import Patch


def surface_of(table: Table, folder: Path) -> finishing.Surface | Patch:
    """Return the surface of a table; `folder` is that of the job, from which the path of a file counts."""
    if table.has("file"):
        surface: finishing.Surface | Patch = _of_file(table, folder)
    elif table.has("control_points"):
        surface = _of_points(table)
    elif table.text("shape", ("flat", *(info.name for info in finishing.presets()))) == "flat":
        surface = table.made(finishing.surface.flat_surface, table.number("side", "mm"))
    else:
        surface = finishing.preset(table.take("shape")).surface
    table.done()
    return surface


def _of_points(table: Table) -> finishing.Surface:
    """B-spline of given control points."""
    points, options = table.take("control_points"), {}
    if table.has("degree"):
        options["degree"] = _degrees(table.path("degree"), table.take("degree"))
    return table.made(finishing.Surface.bspline, points, **options)


def _degrees(name: str, given: Any) -> tuple[int, ...]:
    """Degrees along u and v; the surface looks at their values."""
    if not isinstance(given, list) or not all(type(each) is int for each in given):
        raise ValueError(f"{name} must be two whole numbers, as [3, 3]; got {given!r}")
    return tuple(given)


def _of_file(table: Table, folder: Path) -> Patch:
    """One face of a STEP file, or a region of a scan."""
    options: dict[str, Any] = {"region": _region(table.table("region"))} if table.has("region") else {}
    if table.has("unit"):
        options["unit"] = table.take("unit")
    index = table.take("face") if table.has("face") else None
    found = _read(table, table.file("file", folder), options)
    index = 0 if index is None and len(found) == 1 else index
    if isinstance(index, int) and not isinstance(index, bool) and 0 <= index < len(found):
        return found[index]
    faces = "; ".join(f"{k}: {each.name or 'face'}, {each.area:.5g} mm^2" for k, each in enumerate(found))
    raise ValueError(f"{table.path('face')} must be the number of one of the faces ({faces}); got {index!r}")


def _read(table: Table, file: Path, options: Mapping[str, Any]) -> finishing.surface.Patches:
    """Read a file; advice on a region is given in words of the job."""
    try:
        return table.made(finishing.read_surfaces, file, **options)
    except ValueError as error:
        words = str(error)
        if not any(name in words for name in ("Region(", "empty_max", "region", "unit=")):
            raise
        asked = f"[{table.path('region')}] box, seed, crease, empty_max; {table.path('unit')}"
        raise ValueError(f"{words} (keys of this file: {asked})") from error


def _region(table: Table) -> finishing.Region:
    """Region of a scan."""
    units = units_of(finishing.Region)
    options: dict[str, Any] = {**table.given({name: units[name] for name in ("crease", "empty_max")})}
    if table.has("seed"):
        options["seed"] = table.list_of("seed", units["seed"])
    if table.has("box"):
        options["box"] = table.take("box")
    table.done()
    return table.made(finishing.Region, **options)


def path_of(surface: finishing.Surface | Patch, table: Table) -> finishing.Path | LiftedPath:
    """Return a Hilbert curve of an order or a zigzag of a pitch; rounded where a deviation is given."""
    pattern = table.text("pattern", ("hilbert", "zigzag"))
    options = {key: table.take(key) for key in ("mapping", "along") if table.has(key)}
    if table.has("lift"):
        options["lift"] = table.table("lift").one(finishing.Lift)
    options |= table.given({"margin": "mm"})
    if pattern == "hilbert":
        path = table.made(finishing.hilbert, surface, table.take("order"), **options)
    else:
        options |= table.given({"radius": "mm"})
        path = table.made(finishing.zigzag, surface, table.number("pitch", "mm"), **options)
    if table.has("deviation"):
        path = table.made(path.blended, table.number("deviation", units_of(finishing.Path)["deviation"]))
    table.done()
    return path
