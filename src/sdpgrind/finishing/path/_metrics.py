"""Evenness of a path over its surface: length, steps, cells, coverage, gaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.finishing.path._cells import CellRoute, cell_areas
from sdpgrind.finishing.path._coverage import Coverage, CoveredArea, edges_of, first_step, sample_count
from sdpgrind.finishing.path._nearest import Nearest
from sdpgrind.finishing.surface._patch import Patch

# chosen: smallest cells on the surface for each radius of the footprint, and for each pitch
SURFACE_SHARE, SURFACE_PITCH = 40, 4
BORDER = 3  # chosen: halvings of the smallest cells where a trimming crosses them
# chosen: distance of chords from the path, and steps that suffice, of the lesser of radius and pitch
CHORD, FINE = 1e-3, 0.05
SAMPLES_MAX = 30_000_000  # cells or chords, chosen: a minute or two
ALONG = 8  # chosen: smallest cells along both edges of the footprint


@dataclass(frozen=True, kw_only=True)
class PathMetrics(Frozen):
    """Quality of a path over a surface, with its sampling.

    Parameters
    ----------
    length : float
        Length on the surface, mm.
    step_min, step_mean, step_max : float
        Straight distances of consecutive nodes, mm.
    step_cv : float
        Coefficient of variation of the steps, unit 1.
    cell_area_cv : float or None
        Coefficient of variation of the areas of cells, unit 1. Nodes on a lattice of the unit square
        (Hilbert): the part of the square nearest to a node, as it lies on the surface. Zigzag: the strip of
        each pass, half way to its neighbours in the square; pieces shorter than half of the longest, and
        moves to passes along shocks, are no passes. None: other paths, passes or shocks too slanted for
        strips, and fewer than two passes along one side.
    coverage : float
        Share of the surface's area within the footprint's radius of the path (straight distance), unit 1.
    largest_gap : float
        Twice the greatest straight distance of a place on the surface from the path, mm: the diameter of the
        largest ball around such a place without any part of the path in it. The pitch for straight passes on
        a flat, up to sqrt(2) pitch at the corners of the surface and of a Hilbert curve.
    footprint_radius : float
        Radius of the footprint, mm, not of the tool; see `ball_footprint`.
    surface_step, path_step : float
        Width of the smallest cells of the surface, which lie where the footprint ends and where the gap is
        largest, mm, at most 1/4 of the pitch (an eighth of it along a trimming); longest chord of the path,
        mm.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> path = fin.hilbert(fin.surface.flat_surface(8.0), order=3, mapping="parametric")
    >>> path.metrics(footprint_radius=0.5)
    PathMetrics(
        length         63 mm
        node steps     1 mm (1 to 1 mm, CV 0)
        cell areas     CV 0
        coverage       95.5 % within 0.5 mm of the path
        largest gap    1.41 mm
        sampled by     0.0125 mm on the surface, 0.25 mm on the path)
    """

    length: float
    step_min: float
    step_mean: float
    step_max: float
    step_cv: float
    cell_area_cv: float | None
    coverage: float
    largest_gap: float
    footprint_radius: float
    surface_step: float
    path_step: float

    def __repr__(self) -> str:
        cells = (
            "not defined for this pattern" if self.cell_area_cv is None else f"CV {_small(self.cell_area_cv)}"
        )
        spread = f"{self.step_min:.4g} to {self.step_max:.4g} mm, CV {_small(self.step_cv)}"
        rows = {
            "length": f"{self.length:.6g} mm",
            "node steps": f"{self.step_mean:.4g} mm ({spread})",
            "cell areas": cells,
            "coverage": f"{100 * self.coverage:.3g} % within {self.footprint_radius:.4g} mm of the path",
            "largest gap": f"{self.largest_gap:.3g} mm",
            "sampled by": f"{self.surface_step:.4g} mm on the surface, {self.path_step:.4g} mm on the path",
        }
        return "PathMetrics(\n" + "\n".join(f"    {name:<15}{text}" for name, text in rows.items()) + ")"


def metrics(
    path: CellRoute,
    footprint_radius: float,
    surface_step: float | None = None,
    path_step: float | None = None,
    *,
    pieces: Sequence[CellRoute] = (),
    patch: Patch | None = None,
) -> PathMetrics:
    """Measure a path, of several `pieces` on a patch, too; see `Path.metrics`."""
    own = pieces or (path,)
    radius = checks.positive("footprint_radius", footprint_radius, "mm")
    pitch, length = path.pitch, float(sum(each.length for each in own))
    on_surface = _least(radius / SURFACE_SHARE, pitch / SURFACE_PITCH, "surface_step", surface_step)
    first = first_step(path.surface, radius, pitch, on_surface)
    cells = sample_count(path.surface, first) + ALONG * length / on_surface
    _refuse_work("surface_step", on_surface, cells)
    lines, on_path = _lines(own, min(radius, pitch), path_step)
    steps = np.concatenate([np.linalg.norm(np.diff(each.points, axis=0), axis=1) for each in own])
    areas = None if len(own) > 1 or (patch is not None and patch.trim) else cell_areas(own[0])
    covered = CoveredArea(path.surface, patch)
    edges = edges_of(path.surface, first, on_surface, BORDER if covered.trimmed else 0)
    coverage, farthest = Coverage(covered, Nearest(lines), radius, edges).measured()
    return PathMetrics(
        length=length,
        step_min=float(steps.min()),
        step_mean=float(steps.mean()),
        step_max=float(steps.max()),
        step_cv=_cv(steps),
        cell_area_cv=None if areas is None else _cv(areas),
        coverage=coverage,
        largest_gap=2 * farthest,
        footprint_radius=radius,
        surface_step=on_surface,
        path_step=on_path,
    )


def _least(usual: float, most: float, name: str, given: float | None) -> float:
    """The step of the caller, mm, or the usual one; `most` at most."""
    return min(most, usual if given is None else checks.positive(name, given, "mm"))


def _lines(pieces: Sequence[CellRoute], usual: float, given: float | None) -> tuple[list[Floats], float]:
    """Places along pieces, and their greatest step, mm: chords leave the path by at most `CHORD` of `usual`.

    Where it bends so much that they would be shorter, steps of `FINE` of `usual` suffice.
    """
    first = 0.5 * usual
    samples = [each.sample(first) for each in pieces]
    bend = max(float(np.linalg.norm(each.curvature_vector, axis=1).max()) for each in samples)
    chord = np.sqrt(8 * CHORD * usual / max(bend, 1e-300))
    step = _least(max(FINE * usual, min(chord, first)), first, "path_step", given)
    _refuse_work("path_step", step, sum(each.length for each in pieces) / step)
    if step < first:
        samples = [each.sample(step) for each in pieces]
    return [each.point for each in samples], step


def _refuse_work(name: str, step: float, count: float) -> None:
    if count > SAMPLES_MAX:
        raise ValueError(
            f"{name} must be larger: {step:.4g} mm asks for {count:.3g} samples, more than {SAMPLES_MAX:.3g};"
            f" give {name}=... (mm)"
        )


def _small(cv: float) -> str:
    """Text of a coefficient of variation; 0 for rounding."""
    return f"{cv:.2g}" if cv > 1e-9 else "0"


def _cv(values: Floats) -> float:
    return float(values.std() / values.mean())
