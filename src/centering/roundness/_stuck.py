"""Whether a probe stood still: many equal readings in a row, beside others that are not equal."""

import numpy as np

from sdpgrind.base.checks import Bools, Floats

_LEAST = 8  # chosen: equal readings in a row
_BESIDE = 20  # chosen: pairs of readings on either side that tell how seldom two are equal
_CHANCE = 1e-6  # chosen: that so many are equal anywhere; of a gauge with few digits on a wave some 1e-2
_DIGITS = 1.5  # chosen: a wave leaves its top by one digit, a probe that comes free by more
_SAME = 1e-10  # mm; chosen: a tenth of the last digit of any tester


def stuck(angle: Floats, reading: Floats) -> str:
    """Sentence on the longest run of equal readings (mm) by angle (rad), where chance does not make it; "".

    On either side the digits are those of the same place of the form: at the top of a wave a gauge with few
    of them repeats a reading there, too.
    """
    moved = np.abs(np.diff(reading))
    equal = moved <= _SAME
    first, after = _longest(equal)
    count = after - first  # pairs
    reach = max(count, _BESIDE)
    beside = np.concatenate([equal[max(first - reach, 0) : first], equal[after : after + reach]])
    if count + 1 < _LEAST or beside.size < _BESIDE:  # or a whole turn of them, which has no roundness
        return ""
    share = (np.sum(beside) + 1) / (beside.size + 2)  # Laplace's rule
    ends = moved[max(first - 1, 0) : after + 1]  # with the pairs that lead into the run and out of it
    if equal.size * share**count > _CHANCE or ends.max() < _DIGITS * moved[~equal].min():
        return ""
    begin, end = (np.degrees(angle[k]) % 360 for k in (first, after))
    return (
        f"{count + 1} readings in a row are equal, from {begin:.4g} to {end:.4g} degrees: the probe stuck, or"
        " was beyond its range?"
    )


def _longest(equal: Bools) -> tuple[int, int]:
    """First pair and the one after the last of the longest run of equal pairs."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(np.int8), [0]])))
    if not edges.size:
        return 0, 0
    k = 2 * int(np.argmax(edges[1::2] - edges[::2]))
    return int(edges[k]), int(edges[k + 1])
