"""The stretch of a locus for a controller."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.protocol import Curve
from sdpgrind.locus._path.stretch import Stretch
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._trace.pieces import Piece


def stretch(curve: Curve, along: str, x: tuple[float, float] | None) -> Stretch:
    """Return the part of a locus with one active measured constraint, without fold or jump."""
    checks.one_of("along", along, (*curve.names, curve.hidden_name))
    low, high = _declared(curve, x)
    if curve.system.limit_varies:
        raise ValueError(
            "limit must not depend on a hidden state where a controller is to compute it; it does"
        )
    chosen = [
        piece for piece in curve.best if piece.active and piece.range[1] > low and piece.range[0] < high
    ]
    if not chosen:
        raise ValueError(
            f"x must hold states at which a measured constraint is active: from {low:g} to {high:g} none is,"
            " and nothing measured can lead to the best point"
        )
    _check_continuous(curve, chosen, low, high)
    j = _measured(curve, chosen)
    tables = [_rows(curve, piece, low, high, j) for piece in chosen]
    columns = [np.concatenate(parts) for parts in zip(*tables, strict=True)]
    return Stretch.of_curve(
        along,
        names=curve.names,
        hidden_name=curve.hidden_name,
        hidden=columns[0],
        controls=columns[1],
        limit=columns[2],
        tangents=(columns[4], columns[3], columns[5], columns[6]),
        ends=_ends(chosen, low, high),
        values=_Model(curve.problem, j),
        response=curve.responses[j],
        units={
            name: curve.problem.unit(name) for name in (*curve.names, curve.hidden_name, curve.responses[j])
        },
    )


def _declared(curve: Curve, x: tuple[float, float] | None) -> tuple[float, float]:
    if x is None:
        return curve.problem.hidden[curve.hidden_name]
    unit = curve.problem.unit(curve.hidden_name)
    if np.shape(x) != (2,):
        raise ValueError(
            f"x must be the least and the greatest {curve.hidden_name} that may come; got {checks.shown(x)}"
        )
    low, high = (checks.number(f"x[{k}]", value, unit) for k, value in enumerate(x))
    first, last = curve.problem.hidden[curve.hidden_name]
    if not first <= low < high <= last:
        raise checks.refuse("x", f"(least, greatest) within [{first:g}, {last:g}]", (low, high), unit)
    return low, high


def _check_continuous(curve: Curve, chosen: list[Piece], low: float, high: float) -> None:
    """Refuse jumps, folds and parts without a feasible point."""
    inside = [event for event in curve.jumps if low < event.hidden < high]
    if inside:
        raise ValueError(
            f"x must not span a jump: at {curve.hidden_name} = {inside[0].hidden:.6g} another branch is"
            f" cheaper, and no controller walks there; got {low:g} to {high:g}"
        )
    for before, after in pairwise(chosen):
        if abs(after.range[0] - before.range[1]) > 1e-9 * (1 + abs(before.range[1])):
            raise ValueError(
                f"x must not span a part where no measured constraint is active; {curve.hidden_name} from"
                f" {before.range[1]:.6g} to {after.range[0]:.6g} has none"
            )
    for end, bad in ((chosen[0].range[0], low), (chosen[-1].range[1], high)):
        piece = chosen[0] if bad == low else chosen[-1]
        what = piece.start if bad == low else piece.end
        beyond = end > low if bad == low else end < high
        if beyond and what in ("fold", "infeasible", "branch point", "lost"):
            where = f"it ends ({what}) at {curve.hidden_name} = {end:.6g}"
            raise ValueError(f"x must stay where the locus goes on: {where}; got {low:g} to {high:g}")


def _measured(curve: Curve, chosen: list[Piece]) -> int:
    """Index of the constraint that is active on every piece."""
    common = set.intersection(*(set(piece.active) for piece in chosen))
    if not common:
        told = "; ".join(f"{', '.join(piece.active)} up to {piece.range[1]:.6g}" for piece in chosen)
        raise ValueError(
            f"x must be a range on which one constraint is active all along, to be measured; got {told}"
        )
    return next(j for j, name in enumerate(curve.responses) if name in common)


def _rows(curve: Curve, piece: Piece, low: float, high: float, j: int) -> tuple[Floats, ...]:
    """Return hidden states, controls and limit of a piece within a range, and their slopes by arclength."""
    system, table = curve.system, piece.table
    first, last = max(low, piece.range[0]), min(high, piece.range[1])
    inside = (table.hidden > first) & (table.hidden < last)
    ends = [curve.point_at(piece, value) for value in (first, last)]
    points = np.concatenate([ends[0].points, table.points[inside], ends[1].points])
    along = np.concatenate([ends[0].along, table.along[inside], ends[1].along])
    n = system.n
    controls, hidden = system.unscaled(points[:, :n]), system.unscaled(points[:, -1:], n)
    by_length = (
        along[:, :n] * system.unscaled_slope(points[:, :n]),
        along[:, -1] * system.unscaled_slope(points[:, -1:], n)[:, 0],
    )
    response, limit = system.slopes(controls, hidden, by_length[0])
    total = limit[:, j]
    return (
        hidden[:, 0],
        controls,
        system.values(controls, hidden)[2][:, j],
        by_length[1],
        by_length[0],
        total,
        response[:, j],
    )


def _ends(chosen: list[Piece], low: float, high: float) -> tuple[str, str]:
    first = "range" if chosen[0].range[0] <= low else _why(chosen[0].start)
    last = "range" if chosen[-1].range[1] >= high else _why(chosen[-1].end)
    return first, last


def _why(event: str) -> str:
    if event.endswith(("active", "inactive")):
        return "interior"
    return {"fold": "fold", "jump": "jump", "range": "range"}.get(event, "bound")


@dataclass(frozen=True)
class _Model:
    """Response and limit of the j-th constraint."""

    problem: Problem
    j: int

    def __call__(self, controls: Floats, hidden: Floats) -> tuple[Floats, Floats]:
        _, response, limit = self.problem.system.values(controls, np.asarray(hidden)[..., None])
        return response[..., self.j], limit[..., self.j]

    @property
    def limit_tape(self) -> tuple[Floats, int]:
        """Tape by controls and hidden state, and the place of the limit among its outputs, for kernels."""
        system = self.problem.system
        return system.value_tape, 1 + system.m + self.j
