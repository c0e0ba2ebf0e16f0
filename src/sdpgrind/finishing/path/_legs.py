"""Curves through the nodes of a path in the unit square: straight legs, or cubic splines between corners."""

from itertools import pairwise
from math import comb
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._samples import Ints

TURN = 1e-9  # sine of an angle that is no turn; chosen: above rounding, below any corner


class Legs(NamedTuple):
    """Pieces of a path, each a polynomial in t from 0 to 1.

    `coefficients` (k, degree + 1, 2) by rising powers; `run` (k,) of each piece. `at_node`, `at_piece`,
    `at_t`: each node's place on the path, two for a node with two directions.
    """

    coefficients: Floats
    run: Ints
    at_node: Ints
    at_piece: Ints
    at_t: Floats


def turning(nodes: Floats) -> Bools:
    """Where a straight polyline turns, without its ends."""
    step = np.diff(nodes, axis=0)
    step /= np.hypot(step[:, 0], step[:, 1])[:, None]
    before, after = step[:-1], step[1:]
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    cosine = before[:, 0] * after[:, 0] + before[:, 1] * after[:, 1]
    return np.concatenate([[False], (np.abs(sine) > TURN) | (cosine < 0), [False]])


def legs(nodes: Floats, corners: Bools, smooth: bool) -> Legs:
    """Return one piece for each pair of neighbouring nodes."""
    coefficients = (
        _splines(nodes, corners) if smooth else np.stack([nodes[:-1], np.diff(nodes, axis=0)], axis=1)
    )
    run = np.cumsum(corners[:-1], dtype=np.intp)
    node = np.repeat(np.arange(len(nodes)), 1 + corners)
    ends = np.concatenate([corners[node[:-1]] & (np.diff(node) == 0), [True]])
    return Legs(coefficients, run, node, node - ends.astype(np.intp), ends.astype(float))


def by_legs(run: Ints, per_leg: int) -> tuple[Ints, Floats]:
    """Piece and t of `per_leg` parts of each piece; the end of a piece is the start of the next one."""
    count = per_leg + np.append(np.diff(run) > 0, True)
    piece = np.repeat(np.arange(len(run)), count)
    return piece, np.asarray((np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)) / per_leg)


def part(coefficients: Floats, begin: Floats, end: Floats) -> Floats:
    """Polynomials restricted to `begin` to `end`, as polynomials from 0 to 1."""
    found = np.zeros_like(coefficients)
    for power in range(coefficients.shape[1]):
        for k in range(power + 1):
            factor = comb(power, k) * begin ** (power - k) * (end - begin) ** k
            found[:, k] += factor[:, None] * coefficients[:, power]
    return found


def _splines(nodes: Floats, corners: Bools) -> Floats:
    """C2 cubic splines from corner to corner, over the chords in the square."""
    ends = np.concatenate([[0], np.flatnonzero(corners), [len(nodes) - 1]])
    return np.concatenate([_spline(nodes[a : b + 1]) for a, b in pairwise(ends)])


def _spline(nodes: Floats) -> Floats:
    chord = np.hypot(*np.diff(nodes, axis=0).T)
    places = np.concatenate([[0.0], np.cumsum(chord)])
    powers = CubicSpline(places, nodes).c[::-1].transpose(1, 0, 2)
    found = np.zeros((len(chord), 4, 2))
    found[:, : powers.shape[1]] = powers
    return np.asarray(found * (chord[:, None] ** np.arange(4))[..., None])
