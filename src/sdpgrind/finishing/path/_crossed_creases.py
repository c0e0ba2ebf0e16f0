"""Paths over creases of a surface: a turn at a crease is a sharp corner."""

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path import _contact as contact
from sdpgrind.finishing.path._crossings import crossed
from sdpgrind.finishing.path._legs import Legs, part
from sdpgrind.finishing.path._mappings import Mapping
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.surface._creases import creases
from sdpgrind.finishing.surface._surface import Surface

Place = tuple[Ints, Floats]
NODE = 1e-8  # of a leg, chosen: a nearer crossing is at the node
INSET = 1e-12  # of a leg, chosen: distance of the legs from a crease, so that each is on its own side
TURN = 1e-6  # rad, chosen: angle on the surface that is no corner


def corners(surface: Surface, mapping: Mapping, own: Legs) -> Bools:
    """Which nodes of straight or smooth legs lie on a crease at which the path turns."""
    found = np.zeros(len(own.coefficients) + 1, bool)
    piece, t = crossings(surface, mapping, own)
    found[np.concatenate([piece[t <= NODE], piece[t >= 1 - NODE] + 1])] = True
    at = np.flatnonzero(found[1:-1]) + 1
    near = np.full(len(at), 2 * NODE)
    found[:] = False
    found[at] = _turning(surface, mapping, own, (at - 1, 1 - near), (at, near))
    return found


def crossings(surface: Surface, mapping: Mapping, own: Legs) -> tuple[Ints, Floats]:
    """Pieces and t at which a path crosses or meets creases."""
    found = [(np.zeros(0, np.intp), np.zeros(0))]
    for crease in creases(surface):
        piece, t = crossed(mapping, own.coefficients, np.array([crease.place]), crease.axis)
        if crease.torn and len(piece):
            raise ValueError(
                "the path must keep off where its surface is torn;"
                f" leg {piece[0]} crosses a tear: the {crease}"
            )
        found.append((piece, t))
    piece, t = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.lexsort((t, piece))
    piece, t = piece[order], t[order]
    apart = np.append(True, (np.diff(piece) > 0) | (np.diff(t) > NODE))[: len(piece)]
    return piece[apart], t[apart]


def cut(surface: Surface, mapping: Mapping, own: Legs) -> Legs:
    """Return the pieces of a path, cut at creases where it turns, each on its own side of the crease."""
    piece, t = crossings(surface, mapping, own)
    early, late = t <= NODE, t >= 1 - NODE
    first, last = np.zeros(len(own.run)), np.ones(len(own.run))
    first[piece[early]], last[piece[late]] = t[early] + INSET, t[late] - INSET
    piece, t = piece[~early & ~late], t[~early & ~late]
    sharp = _turning(surface, mapping, own, (piece, t - NODE / 10), (piece, t + NODE / 10))
    return _parted(own, piece[sharp], t[sharp], first, last)


def _parted(own: Legs, piece: Ints, t: Floats, first: Floats, last: Floats) -> Legs:
    """Pieces from `first` to `last`, and cut at t."""
    every = np.arange(len(own.run))
    by_begin = np.lexsort((np.concatenate([first, t]), np.concatenate([every, piece])))
    begin = np.concatenate([first, t + INSET])[by_begin]
    by_end = np.lexsort((np.concatenate([t, last]), np.concatenate([piece, every])))
    end = np.concatenate([t - INSET, last])[by_end]
    of = np.sort(np.concatenate([every, piece]))
    run = np.append(0, np.cumsum((np.diff(own.run[of]) > 0) | (np.diff(of) == 0)))
    which = np.searchsorted(of + begin, own.at_piece + own.at_t, side="right") - 1
    which = np.clip(
        which, np.searchsorted(of, own.at_piece), np.searchsorted(of, own.at_piece, side="right") - 1
    )
    at_t = np.clip((own.at_t - begin[which]) / (end[which] - begin[which]), 0.0, 1.0)
    return Legs(part(own.coefficients[of], begin, end), run, own.at_node, which, at_t)


def _turning(surface: Surface, mapping: Mapping, own: Legs, before: Place, after: Place) -> Bools:
    """Whether the directions on the surface differ between pairs of places on a path."""
    steps = []
    for piece, t in (before, after):
        moved, there = contact.met(surface, mapping, own.coefficients, piece, t)
        step = moved[:, 1, :1] * there.u + moved[:, 1, 1:] * there.v
        steps.append(step / np.linalg.norm(step, axis=1)[:, None])
    return np.asarray(np.linalg.norm(steps[1] - steps[0], axis=1) > TURN)


def refuse_rounding(surface: Surface, mapping: Mapping, own: Legs, deviation: float) -> None:
    """Raise where corners are to be rounded on a path that crosses a crease."""
    piece, _ = crossings(surface, mapping, own)
    if deviation and len(piece):
        raise ValueError(
            "deviation must be 0 on a path that crosses a crease of its surface, which no rounding takes"
            f" away; its leg {piece[0]} does; got {deviation:g} (mm)"
        )
