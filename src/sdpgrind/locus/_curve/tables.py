"""A locus as a table by hidden state, control or response; and its inversion."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.inversion import Inversion
from sdpgrind.locus._curve.protocol import Curve
from sdpgrind.locus._trace.pieces import Columns, counts, tabulate
from sdpgrind.locus._trace.table import LocusTable
from sdpgrind.locus._trace.trace import Tracer, TraceRun

FINER = 5  # chosen: traced points per node; fewer leave `LocusTable.thinned` too little choice


def table(curve: Curve, key: str | None, points: int) -> LocusTable:
    """Return controls by the hidden state, a control, or a response that equals its limit."""
    name = curve.hidden_name if key is None else key
    checks.one_of("key", name, (curve.hidden_name, *curve.names, *curve.responses))
    checks.count("points", points, 2 * len(curve.best))
    pieces = zip(curve.best, _fine(curve, points), strict=True)
    parts = [
        _part(rows, *_keyed(curve, rows, name))
        for piece, rows in pieces
        if name == curve.hidden_name or piece.active
    ]
    if not parts:
        raise ValueError(
            f"key must be {curve.hidden_name!r} where no measured constraint is ever active; got {name!r}"
        )
    spans = np.array([np.sum(np.sqrt(np.sum(np.diff(part.columns, axis=0) ** 2, axis=1))) for part in parts])
    shares = points * spans / max(float(np.sum(spans)), 1e-300)
    kept = [part.thinned(max(2, round(share))) for part, share in zip(parts, shares, strict=True)]
    units = {one: curve.problem.unit(one) for one in (name, *curve.names)}
    return replace(_joined(kept, name, curve.hidden_name), units=units)


def inversion(curve: Curve, response: str | None, points: int) -> Inversion:
    """Return the inversion from a response at any controls to hidden state and optimal controls."""
    name = curve.responses[0] if response is None else checks.one_of("response", response, curve.responses)
    j, m = curve.responses.index(name), len(curve.responses)
    slopes = curve.system.response_slopes()[:, j]
    if not (np.all(slopes >= 0) or np.all(slopes <= 0)) or not np.any(slopes):
        raise ValueError(
            f"response must move one way with {curve.hidden_name} all over the ranges; {name} does not"
        )
    low, high = curve.problem.hidden[curve.hidden_name]
    rising = bool(np.any(slopes > 0))
    found, units = table(curve, None, points), {name: curve.problem.unit(name)}
    return Inversion(
        curve.system.response_tape, found, low, high, rising=rising, count=m, index=j, units=units
    )


def _fine(curve: Curve, points: int) -> list[Columns]:
    """Refine the global pieces by Newton's method."""
    tracer = Tracer(curve.system, np.zeros(1))
    runs = [TraceRun(piece.table.points, piece.table.along, piece.held) for piece in curve.best]
    return [
        tabulate(tracer, [run], [size]) for run, size in zip(runs, counts(runs, FINER * points), strict=True)
    ]


def _keyed(curve: Curve, rows: Columns, name: str) -> tuple[Floats, Floats]:
    """Return the key along a piece and its slope by the hidden state."""
    if name == curve.hidden_name:
        return rows.hidden, np.ones_like(rows.hidden)
    if name in curve.names:
        k = curve.names.index(name)
        return rows.controls[:, k], rows.slope[:, k]
    j = curve.responses.index(name)
    limits = curve.system.slopes(rows.controls, rows.hidden[:, None], rows.slope)[1][:, j]
    return rows.limit[:, j], limits


def _part(rows: Columns, key: Floats, slope: Floats) -> LocusTable:
    known = np.isfinite(slope) & np.all(np.isfinite(rows.slope), axis=1)
    if not (np.all(slope[known] > 0) or np.all(slope[known] < 0)):
        raise ValueError(
            "key must change one way along the locus, so that it belongs to one point;"
            " it turns, or stands still"
        )
    return LocusTable(key[known], rows.controls[known], rows.slope[known] / slope[known, None])


def _joined(parts: list[LocusTable], name: str, hidden: str) -> LocusTable:
    """Join tables; two adjacent nodes at each joint carry the slopes of either side."""
    parts = sorted((_rising(part) for part in parts), key=lambda part: part.low)
    keys = [part.key.copy() for part in parts]
    for before, after in pairwise(keys):
        if after[0] < before[-1] - 1e-9 * abs(before[-1]):
            raise ValueError(f"key must belong to one point of the locus; {name} has two at {after[0]:.6g}")
        after[0] = np.nextafter(max(before[-1], after[0]), np.inf)
    if name != hidden:
        _check_joined(parts, name)
    columns, slopes = ([getattr(part, what) for part in parts] for what in ("columns", "slopes"))
    return LocusTable(np.concatenate(keys), np.concatenate(columns), np.concatenate(slopes))


def _check_joined(parts: list[LocusTable], name: str) -> None:
    """Refuse jumps of the columns between parts."""
    for before, after in pairwise(parts):
        if not np.allclose(before.columns[-1], after.columns[0], rtol=1e-6, atol=1e-9):
            raise ValueError(
                "key must lead along the locus without a jump;"
                f" {name} jumps from {before.high:.6g} to {after.low:.6g}"
            )


def _rising(part: LocusTable) -> LocusTable:
    return (
        part
        if part.key[-1] > part.key[0]
        else LocusTable(part.key[::-1], part.columns[::-1], part.slopes[::-1])
    )
