"""What a push would have shown with other frictions: simulated on a few, laid over many, with how rough that is."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Floats

_ROUGH = 0.5
"""Standard deviation of what lies between nodes, over their second difference: that of noise, and more than that of a jump."""


def laid_over(found: Floats, nodes: tuple[Floats, Floats], grid: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Values (n, m, q) at nodes, and their doubt, linear in between and held beyond, at (p, r, q) places of the grid."""
    along, across = (_shares(axis, places) for axis, places in zip(nodes, grid, strict=True))
    doubt = np.maximum(_rough(found, 0), _rough(found, 1))
    return _laid(along, found, across), _laid(along, doubt, across)


def _laid(along: Floats, found: Floats, across: Floats) -> Floats:
    """One weighted mean along each axis."""
    return np.asarray(np.einsum("pn,nmq,rm->prq", along, found, across, optimize=True))


def _shares(axis: Floats, places: Floats) -> Floats:
    """Weights (places, nodes) of linear interpolation, held at the ends."""
    if axis.size == 1 or axis[0] == axis[-1]:
        return np.eye(axis.size)[np.zeros(places.size, dtype=int)]
    at = np.clip((places - axis[0]) / (axis[1] - axis[0]), 0.0, axis.size - 1.0)
    left = np.minimum(at.astype(int), axis.size - 2)
    shares = np.zeros((places.size, axis.size))
    rows = np.arange(places.size)
    shares[rows, left], shares[rows, left + 1] = left + 1 - at, at - left
    return shares


def _rough(found: Floats, axis: int) -> Floats:
    """Doubt of each node from the second differences about it."""
    if found.shape[axis] < 3:
        return np.zeros_like(found)
    values = np.moveaxis(found, axis, 0)
    second = np.abs(values[:-2] - 2.0 * values[1:-1] + values[2:])
    padded = np.concatenate([second[:1], second, second[-1:]])
    return np.moveaxis(_ROUGH * padded, 0, axis)


def likelihood(values: Floats, doubt: Floats, read: Floats, noise: Callable[[Floats], Floats]) -> tuple[Floats, float]:
    """Likelihood (p, r), greatest 1, of readings (q,), NaN for none; and how far the nearest place is off, squared sds."""
    seen = np.isfinite(read)
    variance = noise(values)[..., seen] + doubt[..., seen] ** 2 + _coarse(values[..., seen])
    miss = np.sum((values[..., seen] - read[seen]) ** 2 / variance, axis=-1)
    log_likelihood = -0.5 * (miss + np.sum(np.log(variance), axis=-1))
    return np.exp(log_likelihood - log_likelihood.max()), float(miss.min())


def _coarse(values: Floats) -> Floats:
    """Variance of what changes within a cell of the grid."""
    steps = [np.gradient(values, axis=k) ** 2 / 12.0 for k in (0, 1) if values.shape[k] > 1]
    return np.asarray(sum(steps, np.zeros_like(values)))
