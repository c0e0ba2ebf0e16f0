"""Edges of a face as chains in the parameters of its surface.

The 3-D edge between its vertices is projected onto the surface, in closed form or by foot points. PCURVEs of
the file, copies of the same edge in the parameters, may lack ends, run another way or use other units of
angle, the edge does not: they stand in only where the file has no 3-D curve, or one of a kind not read.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.curves import StepCurve, curve, is_known
from sdpgrind.finishing.surface._step.elementary import Pole
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.pcurves import Carrier, FaceSurface, on_sheet, pcurve_on
from sdpgrind.finishing.surface._step.placements import point

CHORD = 0.0005  # mm, chosen: a tenth of what a polygon may have, so that areas hold 1e-4 with holes of 1 mm
ROUNDS = 12  # chosen: halvings of an interval between places
FIRST = 3  # chosen: places between two breaks of a curve, to begin with
AWAY = 0.05  # mm, chosen: an edge that is farther from its surface is of another one
SAME = 1e-9  # of a period or a curve's length, chosen: rounding
POLE = 1e-7  # of the chain's extent and 1, chosen: a place at a pole


class EdgeChain(NamedTuple):
    """An edge of a loop: its number, and parameters (n, 2) along it in the direction of the loop."""

    edge: int
    uv: Floats

    def reversed(self) -> "EdgeChain":
        """Return the chain the other way."""
        return self._replace(uv=self.uv[::-1])


def edge_chain(file: StepFile, oriented: int, sheet: FaceSurface) -> EdgeChain | None:
    """Return the chain of an ORIENTED_EDGE, None of one that is a place."""
    use = file.row(oriented, "ORIENTED_EDGE")
    edge = file.row(use.reference(3), "EDGE_CURVE")
    carrier = sheet.carrier
    start, end = (_vertex(file, edge.reference(place), sheet.units.length) for place in (1, 2))
    along = _along(file, edge.reference(3), sheet, (start, end))
    t = _interval(edge, along, start, end)
    if t[0] == t[1]:
        return None
    uv = _sampled(edge, along, carrier, *t)
    found = EdgeChain(edge.number, _from_poles(uv, carrier.poles))
    if not len(found.uv):
        return None
    return found if edge.flag(4) == use.flag(4) else found.reversed()


def _along(file: StepFile, number: int, sheet: FaceSurface, ends: tuple[Floats, Floats]) -> StepCurve:
    """Curve of an edge: the one in space, or that on its surface where there is no other that is read."""
    flat = None if is_known(file, number) else pcurve_on(file, number, sheet.number)
    return curve(file, number, sheet.units.length) if flat is None else on_sheet(file, flat, sheet, ends)


def _vertex(file: StepFile, number: int, scale: float) -> Floats:
    return point(file, file.row(number, "VERTEX_POINT").reference(1), scale)


def _interval(edge: StepRow, along: StepCurve, start: Floats, end: Floats) -> tuple[float, float]:
    """Parameters between the vertices, rising; from the end to the start where the senses differ."""
    if edge.reference(1) == edge.reference(2) and along.period is None:
        low, high = float(along.breaks[0]), float(along.breaks[-1])
        return (low, high) if np.isfinite(high - low) else (0.0, 0.0)
    first, last = (start, end) if edge.flag(4) else (end, start)
    low, high = along.parameter(first), along.parameter(last)
    if along.period is not None and (edge.reference(1) == edge.reference(2)):
        return low, low + along.period
    if along.period is not None and high <= low + SAME * along.period:
        high += along.period
    if high < low:
        raise edge.refused("must run along its curve from its first vertex to its second")
    return low, high


def _sampled(edge: StepRow, along: StepCurve, carrier: Carrier, low: float, high: float) -> Floats:
    """Parameters (n, 2) at places of the edge whose chords are within `CHORD` of it."""
    period = along.period or 0.0
    inner = np.concatenate([along.breaks + k * period for k in range(2 if period else 1)])
    ends = np.concatenate([[low], inner[(inner > low) & (inner < high)], [high]])
    t = np.unique(np.linspace(ends[:-1], ends[1:], FIRST))
    for _ in range(ROUNDS):
        both = np.empty(2 * t.size - 1)
        both[::2], both[1::2] = t, (t[1:] + t[:-1]) / 2
        points = along.points(both)
        uv = unwrapped(_from_poles(carrier.uv(points), carrier.poles, keep=True), carrier.periods)
        _refuse_away(edge, carrier.points(uv), points)
        straight = (uv[2::2] + uv[:-2:2]) / 2
        off = np.linalg.norm(carrier.points(straight) - carrier.points(uv[1::2]), axis=1)
        step = np.abs(uv[2::2] - uv[:-2:2])
        far = (off > CHORD) | ((step[:, 0] > carrier.longest_step) & (step[:, 1] > SAME))
        if not far.any():
            break
        t = np.sort(np.concatenate([t, both[1::2][far]]))
    return np.asarray(uv[::2] if not far.any() else uv)


def _refuse_away(edge: StepRow, feet: Floats, points: Floats) -> None:
    away = float(np.linalg.norm(feet - points, axis=1).max())
    if not away <= AWAY:
        raise edge.refused(f"must lie on the surface of its face; it is {away:.3g} mm away")


def unwrapped(uv: Floats, periods: tuple[float | None, float | None]) -> Floats:
    """Return a chain without jumps over a seam."""
    out = uv.copy()
    for axis, period in enumerate(periods):
        if period is not None:
            jumps = np.round(np.diff(out[:, axis]) / period)
            out[1:, axis] -= period * np.cumsum(jumps)
    return out


def _from_poles(uv: Floats, poles: tuple[Pole, ...], keep: bool = False) -> Floats:
    """Chain whose places at a pole have the free parameter of their neighbour; empty if all are there."""
    out = uv.copy()
    for axis, place in poles:
        there = at_pole(uv, Pole(axis, place))
        if there.all():
            return out if keep else out[:0]
        if there.any():
            away = np.flatnonzero(~there)
            nearest = away[np.abs(np.arange(len(uv))[:, None] - away).argmin(axis=1)]
            out[there, 1 - axis] = uv[nearest[there], 1 - axis]
    return out


def at_pole(uv: Floats, pole: Pole) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return which places (n,) are at a pole."""
    size = max(1.0, float(np.abs(uv[:, pole.axis]).max()))
    return np.asarray(np.abs(uv[:, pole.axis] - pole.place) <= POLE * size)
