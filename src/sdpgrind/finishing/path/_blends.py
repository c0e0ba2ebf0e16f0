"""Blends: sharp corners rounded by curves of continuous curvature within a deviation from the sharp path.

In the unit square a blend is the quintic with place, velocity and acceleration of both legs at its ends, the
ends of two arms of the same length l on the surface. At its ends it is as fast as two arms over its duration.
Between straight legs with unit tangents s and t that is the quartic with its control points at the ends, in
the middle of the arms and on the corner; its middle is 3/16 l ``|t - s|`` away from the corner, the greatest
distance of both paths.
"""

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path import _contact as contact
from sdpgrind.finishing.path import _departure as departure
from sdpgrind.finishing.path._legs import Legs, part
from sdpgrind.finishing.path._mappings import Mapping
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.surface._surface import Surface

DEGREE = 5  # derived: place, velocity and acceleration at both ends
# chosen: speed at the ends of a blend, arms over its duration; 2: control points in the middle of the arms
PACE = 2.0
# derived: distance of a blend's middle from the corner, arms by the change of the unit tangent: 3/16
MIDDLE = 0.1875
# chosen: greatest share of a leg for an arm, with and without a blend at the leg's other end
HALF, WHOLE = 0.49, 0.98
BACK = 1e-3  # chosen: sum of the unit tangents of a corner that turns back on itself
STRAIGHT = 1e-9  # chosen: change of the unit tangent at no corner
LOOKS = np.linspace(0.3, 0.7, 9)  # places on a blend for its distance from the corner, chosen
# chosen: rounds that fit the arms to the deviation, and limit of rounds that only shorten them
ROUNDS, SHRINKS = 4, 60
HELD = 1e-3  # relative excess of the deviation; chosen: without it the rounds only approach the deviation
LEAST, MOST = 0.2, 0.999  # chosen: bounds of the factor by which a round shortens an arm


def rounded(surface: Surface, mapping: Mapping, sharp: Legs, corners: Bools, deviation: float) -> Legs:
    """Return the pieces of a path with all corners rounded, as one run."""
    at = np.flatnonzero(corners)
    arms = _arms(surface, mapping, sharp, at, deviation)
    count = len(corners) - 1
    begin, end = np.zeros(count), np.ones(count)
    begin[at], end[at - 1] = arms[1], 1.0 - arms[0]
    straight = part(_raised(sharp.coefficients), begin, end)
    place = np.arange(count) + np.cumsum(corners[:-1])
    pieces = np.empty((count + len(at), DEGREE + 1, 2))
    pieces[place], pieces[place[at] - 1] = straight, _blends(sharp.coefficients, at, arms)
    node_piece, node_t = np.append(place, count + len(at) - 1), np.zeros(count + 1)
    node_piece[at], node_t[at], node_t[-1] = place[at] - 1, 0.5, 1.0
    return Legs(pieces, np.zeros(len(pieces), np.intp), np.arange(count + 1), node_piece, node_t)


def _arms(surface: Surface, mapping: Mapping, sharp: Legs, at: Ints, deviation: float) -> Floats:
    """Shares (2, c) of the legs before and after each corner for its blend."""
    pace, turn = _turns(surface, mapping, sharp, at)
    busy = np.isin(np.stack([at - 1, at + 1]), at)
    room = (np.where(busy, HALF, WHOLE) * pace).min(axis=0)
    arm = np.minimum(deviation / (MIDDLE * np.maximum(turn, STRAIGHT)), room)
    corner = contact.points(surface, mapping, sharp.coefficients, at, np.zeros((len(at), 1)))
    for _ in range(ROUNDS):
        blends = _blends(sharp.coefficients, at, arm / pace)
        looks = np.tile(LOOKS, (len(at), 1))
        points = contact.points(surface, mapping, blends, np.arange(len(at)), looks)
        squares = ((points - corner) ** 2).sum(axis=-1)
        arm = np.minimum(
            arm * deviation / np.maximum(np.sqrt(departure.least(squares)), STRAIGHT * deviation), room
        )
    return _shortened(surface, mapping, sharp.coefficients, at, arm / pace, deviation)


def _shortened(
    surface: Surface, mapping: Mapping, legs: Floats, at: Ints, arms: Floats, deviation: float
) -> Floats:
    """Arms (2, c) shortened until their blends keep the deviation everywhere."""
    todo = np.arange(len(at))
    for _ in range(SHRINKS):
        blends = _blends(legs, at[todo], arms[:, todo])
        off = departure.departures(surface, mapping, legs, at[todo], arms[:, todo], blends)
        over = off > deviation * (1 + HELD)
        todo = todo[over]
        if not len(todo):
            return arms
        arms[:, todo] *= np.clip(deviation / off[over], LEAST, MOST)
    raise ValueError(
        "deviation must be larger:"
        f" the corner at nodes[{at[todo[0]]}] cannot be rounded within {deviation:g} mm"
    )


def _turns(surface: Surface, mapping: Mapping, sharp: Legs, at: Ints) -> tuple[Floats, Floats]:
    """Speeds (2, c) before and after each corner, mm, and change of the unit tangent."""
    piece, t = np.concatenate([at - 1, at]), np.repeat([1.0, 0.0], len(at))
    moved, there = contact.met(surface, mapping, sharp.coefficients, piece, t)
    found = contact.contact(surface, moved, there, np.arange(len(t)))
    before, after = found.tangent[: len(at)], found.tangent[len(at) :]
    back = at[np.linalg.norm(before + after, axis=1) < BACK]
    if len(back):
        raise ValueError(
            f"a corner that turns back on itself cannot be rounded; the path does at nodes[{back[0]}]"
        )
    return found.speed.reshape(2, -1), np.linalg.norm(after - before, axis=1)


def _blends(coefficients: Floats, at: Ints, arms: Floats) -> Floats:
    """Quintics (c, 6, 2) around the corners `at`."""
    before = contact.jets(coefficients, at - 1, 1.0 - arms[0])
    after = contact.jets(coefficients, at, arms[1])
    scale = (PACE * arms[..., None]) ** np.arange(3)  # (2, c, 3)
    p, v, a = np.moveaxis(before * scale[0, ..., None], 1, 0)
    q, w, b = np.moveaxis(after * scale[1, ..., None], 1, 0)
    d, e, f = q - p - v - 0.5 * a, w - v - a, b - a
    found = [p, v, 0.5 * a, 10 * d - 4 * e + 0.5 * f, -15 * d + 7 * e - f, 6 * d - 3 * e + 0.5 * f]
    return np.stack(found, axis=1)


def _raised(coefficients: Floats) -> Floats:
    found = np.zeros((len(coefficients), DEGREE + 1, 2))
    found[:, : coefficients.shape[1]] = coefficients
    return found
