"""Monte Carlo of a budget (GUM, Supplement 1): draws of noise about the form, and of all other errors."""

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from centering.roundness._budget_rows import AT_BOTH_ENDS, NORMAL, RECTANGULAR, UPWARD, BudgetRow
from centering.roundness._circle_noise import even_noise, is_even_noise, point_noise, waves_of
from centering.roundness._circle_protocol import Circle
from centering.roundness._interval import lifts, seen, widths_at
from centering.roundness._sensitivity import SEED
from sdpgrind.base.checks import Floats

_PAIRS = 1000  # chosen: draws of noise with their negatives; the sd of RONt is known to 2 %
_POINT_PAIRS = 250  # chosen: the same for noise that is not even, where each draw takes an exchange
_EACH = 10  # chosen: draws of the other errors for each of noise

_LAWS: Mapping[str, Callable[[np.random.Generator, int], Floats]] = {
    NORMAL: lambda rng, size: rng.standard_normal(size),
    RECTANGULAR: lambda rng, size: np.sqrt(3) * rng.uniform(-1, 1, size),
    AT_BOTH_ENDS: lambda rng, size: np.sqrt(1.5) * rng.uniform(-1, 1, (2, size)).sum(axis=0),
    UPWARD: lambda rng, size: np.sqrt(12) * rng.uniform(0, 1, size),
}
"""Draws of unit standard deviation by law; those of noise go through the form."""


def lift_of(circle: Circle) -> Floats:
    """Increase of RONt by each draw of noise, mm: step 2 of the calibrated interval with more draws."""
    if not np.any(circle.noise_sd):
        return np.zeros(1)
    if is_even_noise(circle):
        noise = even_noise(circle, _PAIRS)
        form = seen(waves_of(circle), noise)
        return np.asarray(lifts(circle.kind, form[np.newaxis], noise, circle.radius)[0])
    distance = np.hypot(*(circle.points - circle.center).T)
    noise_at = point_noise(circle, _POINT_PAIRS)
    return widths_at(circle.kind, circle.angle, distance, noise_at) - circle.ron_t


def totals(drawn: Floats, rows: Iterable[BudgetRow]) -> Floats:
    """Draws of RONt, mm, from those that hold the noise alone."""
    rng = np.random.default_rng(SEED)
    size = _EACH * drawn.size
    others = [row.contribution * _LAWS[row.law](rng, size) for row in rows if row.law in _LAWS]
    return np.asarray(np.tile(drawn, _EACH) + np.sum(others, axis=0))
