"""Random generators from a seed, and independent children; no global state."""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

Seed: TypeAlias = int | np.random.SeedSequence | np.random.Generator


def generator(rng: Seed) -> np.random.Generator:
    """Return a Generator from an int, a SeedSequence or a Generator (itself)."""
    if isinstance(rng, np.random.Generator):
        return rng
    if isinstance(rng, np.random.SeedSequence):
        return np.random.default_rng(rng)
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer) or rng < 0:
        raise TypeError(f"rng must be an int >= 0, a SeedSequence or a Generator; got {rng!r}")
    return np.random.default_rng(int(rng))


def one_by_one(rng: Seed) -> Iterator[np.random.Generator]:
    """Give the children of `children`, without end, each when it is asked for."""
    parent = generator(rng)
    while True:
        yield parent.spawn(1)[0]


def children(rng: Seed, number: int) -> list[np.random.Generator]:
    """Return `number` independent generators; the k-th does not depend on `number`."""
    return list(generator(rng).spawn(number))
