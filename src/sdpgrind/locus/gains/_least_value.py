"""Minimum of a smooth function in a box, by successively finer lattices."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Floats

FINE = 17  # chosen: places per side of the refining lattices; fewer may lose the minimum


def least(
    function: Callable[..., Floats], *sides: tuple[float, float], places: int = 257, rounds: int = 9
) -> tuple[float, tuple[float, ...]]:
    """Return the least value and its place; `function` takes one array per side of the box."""
    box, count = [*sides], places
    value, where = np.inf, tuple(low for low, _ in sides)
    for _ in range(rounds):
        lattice = np.meshgrid(*(np.linspace(low, high, count) for low, high in box), indexing="ij")
        found = function(*(axis.ravel() for axis in lattice))
        k = int(np.argmin(found))
        if found[k] < value:
            value, where = float(found[k]), tuple(float(axis.ravel()[k]) for axis in lattice)
        steps = [(high - low) / (count - 1) for low, high in box]
        box = [
            (max(a, w - 1.5 * h), min(b, w + 1.5 * h))
            for (a, b), w, h in zip(sides, where, steps, strict=True)
        ]
        count = FINE
    return value, where
