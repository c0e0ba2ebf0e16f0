"""Passes over the unit square, c as a function of s, joined by connectors with sharp corners or arcs."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
from scipy.interpolate import PPoly

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._square import Square

# rad, chosen: turn between nodes of an arc; less for an ellipse in the square, whose tips are sharper
ARC = np.pi / 16
LONGEST = 16.0  # chosen: greatest ratio of the ellipse's axes that shortens the turn
NEAR = 0.2  # steps of an arc, chosen: with less between them, two arcs make one


@dataclass(frozen=True)
class PathPass:
    """A pass through nodes (s, c) with rising s; straight where `curve` is None."""

    s: Floats
    c: Floats
    curve: PPoly | None = None

    @classmethod
    def straight(cls, s: Floats, c: float) -> Self:
        """Return a pass at a constant c."""
        return cls(s, np.full(s.size, c))

    @classmethod
    def curved(cls, s: Floats, curve: PPoly) -> Self:
        """Return a pass on a curve."""
        return cls(s, np.asarray(curve(s)), curve)

    def at(self, s: Floats) -> Floats:
        """Return the place across."""
        return np.full(np.shape(s), self.c[0]) if self.curve is None else np.asarray(self.curve(s))

    def slope(self, s: float) -> float:
        """Return the derivative dc/ds."""
        return 0.0 if self.curve is None else float(self.curve(s, 1))


class Arc(NamedTuple):
    """An arc at a corner: nodes (k, 2) of (s, c) from pass to connector; its reach and step on both."""

    nodes: Floats
    reach: tuple[float, float]
    step: tuple[float, float]


def joined(square: Square, passes: Sequence[PathPass], radius: float) -> tuple[Floats, Bools]:
    """Return places (n, 2) of (s, c) along passes there and back, and the sharp corners."""
    if radius:
        return _rounded(square, passes, radius)
    places = [np.stack([each.s, each.c], axis=1)[:: 1 - 2 * (k % 2)] for k, each in enumerate(passes)]
    corners = [ends_of(each.s.size) for each in passes]
    return np.concatenate(places), np.concatenate(corners)


def ends_of(count: int) -> Bools:
    """Mask of both ends of a pass."""
    out = np.zeros(count, bool)
    out[[0, -1]] = True
    return out


def _rounded(square: Square, passes: Sequence[PathPass], radius: float) -> tuple[Floats, Bools]:
    """Join pass, arc, connector, arc and so on, without sharp corners."""
    pairs = list(pairwise(passes))
    up = [_arc(square, one, k % 2 == 0, 1.0, radius) for k, (one, _) in enumerate(pairs)]
    down = [_arc(square, other, k % 2 == 0, -1.0, radius) for k, (_, other) in enumerate(pairs)]
    _refuse_radius(passes, up, down, radius)
    pieces: list[Floats] = []
    for k, each in enumerate(passes):
        pieces.append(_along(each, k % 2 == 0, down[k - 1] if k else None, up[k] if k < len(up) else None))
        if k < len(up):
            pieces.append(_turn(up[k], down[k]))
    places = np.concatenate(pieces)
    return places, np.zeros(len(places), bool)


def _arc(square: Square, each: PathPass, forward: bool, turn: float, radius: float) -> Arc:
    """Arc from the end of a pass into its connector, towards larger c (`turn` 1) or smaller (-1).

    It is round in the tangent plane at the corner; along a curved pass it bends with it.
    """
    way, side = (1.0, each.s[-1]) if forward else (-1.0, each.s[0])
    by_s, by_c = square.tangents(side, each.at(side))
    x, y = way * (by_s + each.slope(side) * by_c), turn * by_c
    along, across = float(np.linalg.norm(x)), float(np.linalg.norm(y))
    angle = float(np.arccos(x @ y / (along * across)))
    reach = radius * np.tan(angle / 2)
    longer = min(max(along / across, across / along), LONGEST)
    count = max(4, int(np.ceil(angle / ARC * longer)))
    psi = np.linspace(0.0, angle, count + 1)
    inward = radius * (1 - np.cos(psi)) / np.sin(angle)
    s = side + way / along * (radius * np.sin(psi) - reach - inward * np.cos(angle))
    step = radius * angle / count
    return Arc(
        np.stack([s, each.at(s) + turn / across * inward], axis=1),
        (reach / along, reach / across),
        (step / along, step / across),
    )


def _refuse_radius(passes: Sequence[PathPass], up: Sequence[Arc], down: Sequence[Arc], radius: float) -> None:
    """Raise where two arcs are longer than their connector, or one than half a pass."""
    room = np.inf
    for k, (first, second) in enumerate(zip(up, down, strict=True)):
        one, other = passes[k], passes[k + 1]
        end = -1 if k % 2 == 0 else 0
        half = (one.s[-1] - one.s[0]) / 2
        connector = (other.c[end] - one.c[end]) / (first.reach[1] + second.reach[1])
        room = min(room, connector, half / first.reach[0], half / second.reach[0])
    if room < 1 - 1e-9:
        raise checks.refuse(
            "radius", f"<= {room * radius:.4g}, what fits between the passes at their ends", radius, "mm"
        )


def _along(each: PathPass, forward: bool, before: Arc | None, after: Arc | None) -> Floats:
    """Nodes of a pass between its arcs, closer together near them."""
    first, last = (before, after) if forward else (after, before)
    low = each.s[0] if first is None else each.s[0] + first.reach[0]
    high = each.s[-1] if last is None else each.s[-1] - last.reach[0]
    left, right = (0.0 if arc is None else arc.step[0] for arc in (first, last))
    s = _graded(low, high, each.s, left, right)
    return np.stack([s, each.at(s)], axis=1)[:: 1 if forward else -1]


def _turn(up: Arc, down: Arc) -> Floats:
    """Nodes from one pass to the next: arc, connector, arc."""
    side, low, high = up.nodes[-1, 0], up.nodes[-1, 1], down.nodes[-1, 1]
    back = down.nodes[::-1]
    if high - low < NEAR * up.step[1]:
        return np.concatenate([up.nodes, back[1:]])
    c = _graded(low, high, np.array([(low + high) / 2]), up.step[1], down.step[1])
    return np.concatenate([up.nodes, np.stack([np.full(c.size, side), c], axis=1), back])


def _graded(low: float, high: float, places: Floats, left: float, right: float) -> Floats:
    """Places between two ends, with more at 1, 3, 7, ... steps from an end that has a step."""
    middle = (low + high) / 2
    spacing = np.diff(places) if places.size > 1 else np.array([high - low])
    near = [
        low + _steps(left, min(spacing[0], middle - low)),
        high - _steps(right, min(spacing[-1], high - middle))[::-1],
    ]
    first, last = (
        (near[0][-1] if near[0].size else low) + left,
        (near[1][0] if near[1].size else high) - right,
    )
    return np.concatenate([near[0], places[(places >= first) & (places <= last)], near[1]])


def _steps(step: float, longest: float) -> Floats:
    """Step times 1, 3, 7, ... up to `longest`."""
    if not step:
        return np.empty(0)
    out = step * (2.0 ** np.arange(1, 40) - 1)
    return np.asarray(out[out < longest])
