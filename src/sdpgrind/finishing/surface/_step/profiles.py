"""Profiles of swept surfaces of a STEP file: lines, circles, ellipses and B-splines, trimmed or whole."""

import numpy as np

from sdpgrind.finishing.surface._step.curves import DEEPEST, SPLINES, told_spline
from sdpgrind.finishing.surface._step.elementary import Meaning
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.measures import StepUnits
from sdpgrind.finishing.surface._step.placements import direction, placement, point
from sdpgrind.finishing.surface._step.rational import CLOSE, RationalCurve, closed_or_open, nearest, ring
from sdpgrind.finishing.surface._step.text import StepRecord


def profile(file: StepFile, number: int, units: StepUnits, depth: int = 0) -> RationalCurve:
    """Return a curve that is swept, mm."""
    if depth > DEEPEST:
        raise ValueError(f"{file.name(number)} must not stand on itself")
    row = file.find(number, "LINE", "CIRCLE", "ELLIPSE", "TRIMMED_CURVE", *SPLINES)
    if row is None:
        raise ValueError(f"{file.name(number)} is not read as a profile; export the face as B-spline")
    if row.type == "TRIMMED_CURVE":
        return _trimmed(file, row, profile(file, row.reference(1), units, depth + 1), units)
    if row.type == "LINE":
        return _line(file, row, units.length)
    if row.type in SPLINES:
        degree, nodes, weights, knots = told_spline(file, row, units.length)
        return closed_or_open(
            RationalCurve(degree, np.column_stack([nodes, np.ones(len(nodes))]) * weights[:, None], knots)
        )
    return _conic(file, row, units)


def _line(file: StepFile, row: StepRow, scale: float) -> RationalCurve:
    start, way = point(file, row.reference(1), scale), file.row(row.reference(2), "VECTOR")
    nodes = np.column_stack([[start, start + direction(file, way.reference(1))], np.ones(2)])
    length = way.number_at(2) * scale
    return RationalCurve(1, nodes, np.array([0.0, 0.0, 1.0, 1.0]), endless=True, meaning=Meaning(length))


def _conic(file: StepFile, row: StepRow, units: StepUnits) -> RationalCurve:
    frame = placement(file, row.reference(1), units.length)
    a = row.number_at(2) * units.length
    b = a if row.type == "CIRCLE" else row.number_at(3) * units.length
    if not (a > 0 and b > 0):
        raise row.refused(f"must have radii > 0; got {a:g} and {b:g} mm")
    return ring(frame[:3, 3], a * frame[:3, 0], b * frame[:3, 1], units.angle)


def _trimmed(file: StepFile, row: StepRow, whole: RationalCurve, units: StepUnits) -> RationalCurve:
    """Part of a curve, from its first end to its second: against the curve where the senses differ."""
    agree = row.flag(4)
    first, last = (_end(file, row, place, whole, units) for place in (2, 3))
    low, high = (first, last) if agree else (last, first)
    if whole.period is not None and high <= low + CLOSE * whole.period:
        high += whole.period
    if not high > low:
        raise row.refused("must run along its curve from its first end to its second")
    all_of_it = whole.period is not None and high - low >= (1 - CLOSE) * whole.period
    found = whole if all_of_it else whole.piece(low, high)
    return found if agree else found.reversed()


def _end(file: StepFile, row: StepRow, place: int, whole: RationalCurve, units: StepUnits) -> float:
    """Parameter of an end: of its point, else of the parameter that is told."""
    told = row.value(place)
    members = told if isinstance(told, tuple) else ()
    for each in members:
        if isinstance(each, int):
            return float(nearest(whole, point(file, int(each), units.length)[None], lambda p, d: (p, d))[0])
    numbers = [each.values[0] for each in members if isinstance(each, StepRecord) and len(each.values) == 1]
    if not numbers or not isinstance(numbers[0], float):
        raise row.refused(f"must have a point or a parameter as value {place + 1}")
    found = float(whole.meaning.from_file(np.array(numbers[0])))
    if np.isnan(found):
        raise row.refused("has an angle, and the file names no unit of angles; a unit is never guessed")
    return float(np.clip(found, *whole.ends)) if whole.period is None else found
