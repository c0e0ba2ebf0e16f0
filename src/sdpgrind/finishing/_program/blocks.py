"""Blocks of a program: the fewest points whose chords keep half of the deviation, and blends for the rest."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.chord_kernels import chord_fits
from sdpgrind.finishing._program.course import Run
from sdpgrind.finishing._program.turns import ALIKE

# mm, derived: numbers of 0.0001 mm and 1e-7 rad, kept in single precision, move a point by less
ROUNDED = 3e-4
_SHARE = 0.45  # source: two blends on one block leave a tenth of it straight
_SHORTEST = 0.01  # mm, chosen: a shorter blend is an exact stop, which no controller confuses with it
_STRAIGHT = 1e-9  # rad, chosen: blocks in line


class Blocks(NamedTuple):
    """Moves in straight lines: contact (k, 3) in the work, mm, quaternions (k, 4), feed, blend, joints.

    `feeds` (k,), mm/s, are of the block that ends there, `radii` (k,), mm, of the blend there; 0: exact. The
    last of the joints (k, n) are axes that carry the work, where there are any.
    """

    points: Floats
    turns: Floats
    feeds: Floats
    radii: Floats
    joints: Floats


def blocks_of(run: Run, deviation: float, lever: float) -> Blocks:
    """Return the blocks of a run after its first sample."""
    half = 0.5 * deviation
    picks = _pruned(run, _greedy(run, half - ROUNDED, lever), half - ROUNDED, lever)
    points = run.points[picks]
    feeds = np.diff(run.length[picks]) / np.diff(run.time[picks])
    ends = picks[1:]
    return Blocks(
        points[1:],
        run.turns[ends],
        feeds,
        _blends(points, run.turns[picks], run.carried[picks], half - ROUNDED, lever),
        run.joints[ends],
    )


def _greedy(run: Run, tolerance: float, lever: float) -> list[int]:
    """Samples, each as far from the one before as its chord allows."""
    picks, reach = [0], 1
    while picks[-1] < len(run.points) - 1:
        reach = _farthest(run, picks[-1], reach, tolerance, lever)
        picks.append(picks[-1] + reach)
    return picks


def _farthest(run: Run, begin: int, guess: int, tolerance: float, lever: float) -> int:
    """Samples that one chord from `begin` may span; doubling from a guess, then halving."""
    most = len(run.points) - 1 - begin
    good, bad, step = 1, most + 1, min(max(guess, 2), most)
    while good < step < bad:
        if fits(run, begin, begin + step, tolerance, lever):
            good, step = step, min(2 * step, most)
        else:
            bad = step
    while bad - good > 1:
        middle = (good + bad) // 2
        if fits(run, begin, begin + middle, tolerance, lever):
            good = middle
        else:
            bad = middle
    return good


def _pruned(run: Run, picks: list[int], tolerance: float, lever: float) -> list[int]:
    """Samples without those that can be left out: where the error of a chord fell while it grew."""
    kept = picks[:1]
    for k in range(1, len(picks) - 1):
        if not fits(run, kept[-1], picks[k + 1], tolerance, lever):
            kept.append(picks[k])
    return [*kept, picks[-1]]


def fits(run: Run, begin: int, end: int, tolerance: float, lever: float) -> bool:
    """Return whether the chord between two samples keeps contact, and turns times levers, within mm."""
    return bool(chord_fits(run.points, run.turns, run.carried, begin, end, tolerance, lever, ALIKE))


def _blends(points: Floats, turns: Floats, carried: Floats, most: float, lever: float) -> Floats:
    """Lengths before points 1 to the last at which a blend begins, mm; it leaves the corner by <= `most`.

    So does the tool, times the lever: evenly turned from r before to r behind a corner, at which its rate (a
    mm) changes by w, it is r w / 2 away from the turn at the corner. So do axes that carry the work.
    """
    chords = np.diff(points, axis=0)
    size = np.linalg.norm(chords, axis=1)
    along = chords / size[:, None]
    gap = np.linalg.norm(along[1:] - along[:-1], axis=1)
    turn = 2.0 * np.arcsin(np.minimum(0.5 * gap, 1.0))
    shorter = _SHARE * np.minimum(size[1:], size[:-1])
    frames = Rotation.from_quat(turns)
    rates = (frames[:-1].inv() * frames[1:]).as_rotvec() / size[:, None]
    kink = np.linalg.norm(np.diff(rates, axis=0), axis=1)
    radii = np.minimum(shorter, most / np.tan(np.maximum(turn, _STRAIGHT) / 4.0))
    radii = np.minimum(radii, 2.0 * most / (lever * np.maximum(kink, _STRAIGHT)))
    bend = np.abs(np.diff(np.diff(carried, axis=0) / size[:, None], axis=0)).sum(axis=1)
    radii = np.minimum(radii, 2.0 * most / np.maximum(bend, _STRAIGHT))
    return np.append(np.where(radii < _SHORTEST, 0.0, radii), 0.0)


def joined(parts: list[Blocks]) -> Blocks:
    """Return the blocks of all parts in sequence."""
    return Blocks(*(np.concatenate(column) for column in zip(*parts, strict=True)))
