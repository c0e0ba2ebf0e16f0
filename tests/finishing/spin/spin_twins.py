"""Slow, obvious twins of the sweep over turns of a tool: the recursion written out, and all sequences there are."""

import itertools
from dataclasses import dataclass

import numpy as np

TURN = 2 * np.pi
SLACK = 1e-9


@dataclass
class Candidates:
    """Joints (m, g, c, n) of candidates, which may be taken (m, g, c), their turns (c,), and limits (n,)."""

    joints: np.ndarray
    kept: np.ndarray
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    turning: np.ndarray
    speed: np.ndarray
    far: float = 0.35
    around: bool = True
    held: bool = False


def way(of, before, after):
    """Change of the joints from one pose to the next, the shortest one of those that turn."""
    change = after - before
    return np.where(of.turning, change - TURN * np.round(change / TURN), change)


def fits(of, course):
    """Whether each joint of a course (k, n), moved by whole turns, stays within its limits."""
    course = np.asarray(course)
    turns = TURN * np.arange(-4, 5)[:, None] * of.turning
    above = course.min(axis=0) + turns >= of.low - SLACK
    below = course.max(axis=0) + turns <= of.high + SLACK
    return bool(np.all(np.any(above & below, axis=0)))


def time(of, change):
    """Time of the slowest joint, or inf where a joint turns too far."""
    if np.any(np.abs(change[of.turning]) > of.far):
        return np.inf
    return float(np.max(np.abs(change) / of.speed))


def joined(of, a, b):
    return (a == b or not of.held) and (of.around or abs(of.values[a] - of.values[b]) <= np.pi)


def recursion(of):
    """Least cost, group and picks: each candidate remembers its cheapest course."""
    count = of.joints.shape[2]
    best = (np.inf, -1, None)
    for g in range(of.joints.shape[1]):
        ways = {
            c: (0.0, [of.joints[0, g, c]], [c])
            for c in range(count)
            if of.kept[0, g, c] and fits(of, [of.joints[0, g, c]])
        }
        for i in range(1, len(of.joints)):
            ways = {
                c: found
                for c in range(count)
                if of.kept[i, g, c] and (found := cheapest(of, ways, i, g, c)) is not None
            }
        for cost, _, picks in ways.values():
            if cost < best[0]:
                best = (cost, g, picks)
    return best


def cheapest(of, ways, i, g, c):
    """The cheapest course to a candidate that is within limits, its own turn first of equal ones."""
    found = None
    for before in sorted(ways, key=lambda b: (b != c, b)):
        cost, course, picks = ways[before]
        change = way(of, course[-1], of.joints[i, g, c])
        after = cost + time(of, change)
        course = [*course, course[-1] + change]
        if joined(of, before, c) and after < np.inf and (found is None or after < found[0]):
            found = (after, course, [*picks, c]) if fits(of, course) else found
    return found


def all_sequences(of):
    """Least cost of all sequences of candidates in all groups."""
    count, best = of.joints.shape[2], np.inf
    for g in range(of.joints.shape[1]):
        for picks in itertools.product(range(count), repeat=len(of.joints)):
            if all(of.kept[i, g, c] for i, c in enumerate(picks)) and all(
                itertools.starmap(lambda a, b: joined(of, a, b), itertools.pairwise(picks))
            ):
                best = min(best, cost_of(of, g, picks))
    return best


def cost_of(of, group, picks):
    """Time through a sequence, or inf where it is not allowed."""
    course, total = [of.joints[0, group, picks[0]]], 0.0
    for i, c in enumerate(picks[1:], start=1):
        change = way(of, course[-1], of.joints[i, group, c])
        total += time(of, change)
        course.append(course[-1] + change)
    return total if fits(of, course) else np.inf
