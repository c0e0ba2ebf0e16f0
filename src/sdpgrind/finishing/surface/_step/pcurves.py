"""Edges of a STEP file by their curves in the parameters of a surface, where no curve in space is read."""

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.curves import ON_ANOTHER, StepCurve, curve
from sdpgrind.finishing.surface._step.elementary import Meaning, Pole
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.measures import StepUnits
from sdpgrind.finishing.surface._step.splines import SplineNet

PARTS = 8  # chosen: of a span of the curve, so that no span of the surface hides between places
LEVEL = 1e-9  # of a line's direction, chosen: it does not run along the other parameter
TURNS = np.arange(-2.0, 3.0)  # chosen: a file's parameters may be so many periods beside those found here


class Carrier(Protocol):
    """A surface whose places have parameters."""

    @property
    def periods(self) -> tuple[float | None, float | None]: ...
    @property
    def poles(self) -> tuple[Pole, ...]: ...
    @property
    def longest_step(self) -> float: ...
    def uv(self, points: Floats) -> Floats: ...
    def points(self, uv: Floats) -> Floats: ...
    def net(self, box: Floats) -> SplineNet: ...
    def parameters(self, uv: Floats, box: Floats) -> Floats: ...
    def meanings(self, units: StepUnits) -> tuple[Meaning, Meaning]: ...


class FaceSurface(NamedTuple):
    """The surface of a face, its number, and the file's units."""

    carrier: Carrier
    number: int
    units: StepUnits

    def points(self, told: Floats) -> Floats:
        """Return the points (n, 3), mm, at parameters (n, 2) of the file."""
        pairs = zip(self.carrier.meanings(self.units), told.T, strict=True)
        return self.carrier.points(np.stack([each.from_file(x) for each, x in pairs], axis=-1))

    def told(self, place: Floats) -> Floats:
        """Return the parameters (n, 2) of the file at which a place (3,) may be, over whole periods."""
        uv = self.carrier.uv(place[None])[0]
        axes = [
            each.to_file(np.array([x]) if period is None else x + period * TURNS)
            for x, period, each in zip(
                uv, self.carrier.periods, self.carrier.meanings(self.units), strict=True
            )
        ]
        return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)


def pcurve_on(file: StepFile, number: int, surface: int) -> StepRow | None:
    """Return the first PCURVE of a curve on a surface, or None."""
    row = file.find(number, "PCURVE", *ON_ANOTHER[:3])
    if row is None:
        return None
    each = [number] if row.type == "PCURVE" else row.references(2)
    rows = (file.find(one, "PCURVE") for one in each)
    return next((one for one in rows if one is not None and one.reference(1) == surface), None)


def on_sheet(file: StepFile, row: StepRow, sheet: FaceSurface, ends: tuple[Floats, Floats]) -> StepCurve:
    """Return a PCURVE as a curve in space, mm, that runs between two vertices."""
    if any(np.isnan(each.unit) for each in sheet.carrier.meanings(sheet.units)):
        raise row.refused("has an angle, and the file names no unit of angles; a unit is never guessed")
    inner = file.row(row.reference(2), "DEFINITIONAL_REPRESENTATION").references(1)
    if not inner:
        raise row.refused("must have a curve in the parameters of its surface")
    flat = curve(file, inner[0], 1.0, size=2)

    def points(t: Floats) -> Floats:
        return sheet.points(flat.points(np.atleast_1d(t))[:, :2])

    if np.all(np.isfinite(flat.breaks)):
        breaks = np.unique(np.linspace(flat.breaks[:-1], flat.breaks[1:], PARTS + 1))
        return StepCurve(points, breaks, flat.period)
    return _on_line(sheet, flat, replace(flat, points=points), ends)


def _on_line(sheet: FaceSurface, flat: StepCurve, along: StepCurve, ends: tuple[Floats, Floats]) -> StepCurve:
    """Curve over a line of the parameters; it is closed where the line is along a closed one."""
    start, after = flat.points(np.array([0.0, 1.0]))[:, :2]
    way = after - start
    periods = [
        period / abs(each.unit * step)
        for period, each, step, other in zip(
            sheet.carrier.periods, sheet.carrier.meanings(sheet.units), way, way[::-1], strict=True
        )
        if period is not None and abs(other) < LEVEL
    ]
    period = periods[0] if periods else None

    def locate(place: Floats) -> float:
        t = (sheet.told(place) - start) @ way
        best = float(t[np.argmin(np.linalg.norm(along.points(t) - place, axis=1))])
        return best if period is None else best % period

    low, high = sorted(locate(place) for place in ends)
    inner = np.linspace(low, max(high, low + (period or 0.0)), 4 * PARTS + 1)
    return replace(along, breaks=np.concatenate([[-np.inf], inner, [np.inf]]), period=period, locate=locate)
