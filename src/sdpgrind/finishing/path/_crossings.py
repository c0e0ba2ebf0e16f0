"""Crossings of a path with the knots of its surface, at which integration starts anew."""

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.halving import halved
from sdpgrind.finishing.path._contact import jets
from sdpgrind.finishing.path._mappings import Mapping
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.surface._surface import Surface

# places on a piece for its knot spans, chosen: two crossings between are left to finer intervals
PLACES = np.linspace(0.0, 1.0, 5)
HALVINGS = 50  # chosen: to the last digits of t
LEAST = 1e-9  # of a piece, chosen: no shorter interval


def intervals(surface: Surface, mapping: Mapping, coefficients: Floats) -> tuple[Ints, Floats, Floats]:
    """Cut the pieces at knots: number of the piece, first and last t of each interval."""
    count, uv = len(coefficients), _looked_up(mapping, coefficients)
    found = [
        _crossed(mapping, coefficients, uv[..., axis], surface.breaks[axis][1:-1], axis) for axis in (0, 1)
    ]
    every = np.arange(count)
    piece = np.concatenate([every, *(pieces for pieces, _ in found)])
    first = np.concatenate([np.zeros(count), *(places for _, places in found)])
    order = np.lexsort((first, piece))
    piece, first = piece[order], first[order]
    last = np.where(np.append(np.diff(piece) > 0, True), 1.0, np.append(first[1:], 1.0))
    wide = last - first > LEAST
    return piece[wide], first[wide], last[wide]


def crossed(mapping: Mapping, coefficients: Floats, knots: Floats, axis: int) -> tuple[Ints, Floats]:
    """Pieces and t at which a path crosses knots of u (axis 0) or v (1)."""
    return _crossed(mapping, coefficients, _looked_up(mapping, coefficients)[..., axis], knots, axis)


def _looked_up(mapping: Mapping, coefficients: Floats) -> Floats:
    """Parameters (k, 5, 2) at `PLACES` of each piece."""
    count = len(coefficients)
    piece, t = np.repeat(np.arange(count), len(PLACES)), np.tile(PLACES, count)
    return mapping.carried(jets(coefficients, piece, t))[:, 0].reshape(count, len(PLACES), 2)


def _crossed(
    mapping: Mapping, coefficients: Floats, places: Floats, knots: Floats, axis: int
) -> tuple[Ints, Floats]:
    """Pieces and t at which one parameter, (k, 5) at `PLACES`, crosses a knot."""
    span = np.searchsorted(knots, places, side="right")
    crossed = np.abs(np.diff(span, axis=1))
    piece, interval = (np.repeat(index, crossed[crossed > 0]) for index in np.nonzero(crossed))
    which = np.arange(len(piece)) - np.searchsorted(
        piece * len(PLACES) + interval, piece * len(PLACES) + interval
    )
    knot = knots[np.minimum(span[piece, interval], span[piece, interval + 1]) + which]
    return piece, _halved(mapping, coefficients, piece, PLACES[interval], knot, axis)


def _halved(
    mapping: Mapping, coefficients: Floats, piece: Ints, begin: Floats, knot: Floats, axis: int
) -> Floats:
    """The t from `begin` on, within a quarter of a piece, at which a parameter crosses its knot."""

    def below(place: Floats) -> Bools:
        return np.asarray(mapping.carried(jets(coefficients, piece, place))[:, 0, axis] < knot)

    side = below(begin)
    return halved(begin, begin + PLACES[1], lambda place: below(place) == side, HALVINGS if len(piece) else 0)
