"""Loops of a face as polygons in the parameters of its surface: seams, poles, loops around a surface."""

from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.edges import EdgeChain, at_pole, edge_chain
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.pcurves import Carrier, FaceSurface

OPEN = 1e-3  # of the polygons' extent; source: specification, a gap that is none
HALF = 0.5  # chosen: share of a period that a loop around the surface is off


class Chains(NamedTuple):
    """A loop: its chain (n, 2), closed (last place the first) but for whole turns (2,) of the periods."""

    uv: Floats
    turns: tuple[int, int]


def polygons(file: StepFile, face: StepRow, sheet: FaceSurface) -> list[Floats]:
    """Return the closed polygons (n, 2) of a face in the parameters of its surface; none: all of it."""
    sense = 1 if face.flag(3) else -1
    carrier = sheet.carrier
    loops = [_loop(file, bound, sheet, sense) for bound in face.references(1)]
    chains = [loop for loop in loops if loop is not None]
    around = [loop for loop in chains if any(loop.turns)]
    plain = [loop.uv for loop in chains if not any(loop.turns)]
    if around:
        plain.insert(0, _joined(face, around, carrier, sense))
    return _gathered(plain, carrier)


def _loop(file: StepFile, number: int, sheet: FaceSurface, sense: int) -> Chains | None:
    """Return the chain of a bound; None of a loop that is a vertex, at a pole."""
    bound = file.row(number, "FACE_OUTER_BOUND", "FACE_BOUND")
    if file.find(bound.reference(1), "VERTEX_LOOP"):
        return None
    loop = file.row(bound.reference(1), "EDGE_LOOP")
    edges = [edge_chain(file, each, sheet) for each in loop.references(1)]
    chains = [each for each in edges if each is not None]
    if not chains:
        return None
    if not bound.flag(2):
        chains = [each.reversed() for each in reversed(chains)]
    return _chained(loop, _begun(chains), sheet.carrier, sense)


def _begun(chains: list[EdgeChain]) -> list[EdgeChain]:
    """Chains from one on that is no seam, if there is one: a seam takes its side from its neighbour."""
    times = Counter(each.edge for each in chains)
    first = next((k for k, each in enumerate(chains) if times[each.edge] == 1), 0)
    return chains[first:] + chains[:first]


def _chained(loop: StepRow, chains: list[EdgeChain], carrier: Carrier, sense: int) -> Chains:
    """Join chains end to start, over seams and at poles."""
    out = [chains[0].uv]
    gaps = []
    for before, here in pairwise(chains):
        end = out[-1][-1]
        uv = here.uv + _shift(end, here.uv[0], carrier)
        if before.edge == here.edge:
            uv = uv + _fold(out[-1], carrier, sense)
        gaps.append(_gap(end, uv[0], carrier))
        out.append(uv)
    chain = np.concatenate(out)
    turns = _turns(chain[-1] - chain[0], carrier)
    if _pole_between(chain[-1], chain[0], carrier):
        turns = (0, 0)
    offset = np.array([n * (p or 0.0) for n, p in zip(turns, carrier.periods, strict=True)])
    gaps.append(_gap(chain[-1], chain[0] + offset, carrier))
    extent = np.ptp(chain, axis=0).max()
    if max(gaps) > OPEN * extent:
        raise loop.refused(f"must be closed; there is a gap of {max(gaps) / extent:.3g} of its extent")
    return Chains(np.vstack([chain, chain[:1] + offset]), turns)


def _shift(end: Floats, start: Floats, carrier: Carrier) -> Floats:
    """Whole periods that bring a start to an end."""
    return np.array([
        0.0 if period is None else period * np.round(apart / period)
        for apart, period in zip(end - start, carrier.periods, strict=True)
    ])  # fmt: skip


def _fold(before: Floats, carrier: Carrier, sense: int) -> Floats:
    """Whole period between a seam and itself, way back behind a pole; the face is on the left, or right."""
    out = np.zeros(2)
    for pole in carrier.poles:
        period = carrier.periods[1 - pole.axis]
        if period is not None and at_pole(before[-1:], pole)[0]:
            way = np.sign(before[-1, pole.axis] - before[0, pole.axis])
            out[1 - pole.axis] = (way if pole.axis == 0 else -way) * sense * period
    return out


def _pole_between(one: Floats, other: Floats, carrier: Carrier) -> bool:
    pair = np.stack([one, other])
    return any(bool(at_pole(pair, pole).all()) for pole in carrier.poles)


def _gap(end: Floats, start: Floats, carrier: Carrier) -> float:
    """Distance of an end from the next start; none at a pole, where they are one place."""
    return 0.0 if _pole_between(end, start, carrier) else float(np.abs(end - start).max())


def _turns(way: Floats, carrier: Carrier) -> tuple[int, int]:
    """Whole turns around the surface."""
    u, v = (0 if p is None else round(w / p) for w, p in zip(way, carrier.periods, strict=True))
    return u, v


def _joined(face: StepRow, around: list[Chains], carrier: Carrier, sense: int) -> Floats:
    """One polygon of loops that go around the surface: of two opposite ones, or of one up to a pole."""
    axis = 0 if around[0].turns[0] else 1
    first = around[0].uv
    if len(around) == 2 and around[1].turns[axis] == -around[0].turns[axis]:
        second = around[1].uv + _shift(first[-1], around[1].uv[0], carrier)
        return np.vstack([first, second, first[:1]])
    left = around[0].turns[axis] * sense * (1 if axis == 0 else -1)
    sides = [pole.place for pole in carrier.poles if pole.axis == 1 - axis]
    ahead = [place for place in sides if left * (place - first[0, 1 - axis]) > 0]
    if len(around) > 1 or not ahead:
        raise face.refused("must have loops that bound a part of its surface")
    ends = first[[-1, 0]].copy()
    ends[:, 1 - axis] = min(ahead, key=lambda place: abs(place - first[0, 1 - axis]))
    return np.vstack([first, ends, first[:1]])


def _gathered(plain: list[Floats], carrier: Carrier) -> list[Floats]:
    """Polygons in one sheet: all near the largest."""
    if not plain:
        return []
    middle = max(plain, key=lambda each: float(np.ptp(each, axis=0).prod()))
    centre = (middle.max(axis=0) + middle.min(axis=0)) / 2
    return [each + _shift(centre, (each.max(axis=0) + each.min(axis=0)) / 2, carrier) for each in plain]
