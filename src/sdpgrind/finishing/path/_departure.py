"""Distance between blends and the corners that they round."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._contact import points
from sdpgrind.finishing.path._departure_kernels import furthest
from sdpgrind.finishing.path._mappings import Mapping
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.surface._surface import Surface

NEAR = np.linspace(0.1, 0.9, 41)  # places on a blend for its distance from the corner, chosen
# places on blend and arm, chosen: straight lines between them are close enough
ON_BLEND, ON_ARM = np.linspace(0.0, 1.0, 21), np.linspace(0.0, 1.0, 17)
BLOCK = 512  # corners measured at once, chosen for memory


def departures(
    surface: Surface, mapping: Mapping, legs: Floats, at: Ints, arms: Floats, blends: Floats
) -> Floats:
    """Greatest distances (c,), mm, of blends (c, 6, 2) from arms (2, c), shares of legs at corners `at`."""
    out = np.empty(len(at))
    for first in range(0, len(at), BLOCK):
        here = slice(first, first + BLOCK)
        out[here] = _block(surface, mapping, legs, at[here], arms[:, here], blends[here])
    return out


def _block(
    surface: Surface, mapping: Mapping, legs: Floats, at: Ints, arms: Floats, blends: Floats
) -> Floats:
    every = np.arange(len(at))
    before = points(surface, mapping, legs, at - 1, 1.0 - arms[0][:, None] * ON_ARM[::-1])
    after = points(surface, mapping, legs, at, arms[1][:, None] * ON_ARM)
    blend = points(surface, mapping, blends, every, np.tile(ON_BLEND, (len(at), 1)))
    near = points(surface, mapping, blends, every, np.tile(NEAR, (len(at), 1)))
    corner = np.sqrt(least(((near - after[:, :1]) ** 2).sum(axis=-1)))
    sharp = np.concatenate([before, after[:, 1:]], axis=1)
    beside = np.delete(sharp, len(ON_ARM) - 1, axis=1)  # the corner is measured more finely
    return np.asarray(np.maximum(corner, np.maximum(_furthest(blend, sharp), _furthest(beside, blend))))


def _furthest(point: Floats, line: Floats) -> Floats:
    """Greatest distance (c,) of points (c, m, 3) from polylines (c, k, 3)."""
    out = np.empty(len(point))
    furthest(point, line, out)
    return out


def least(squares: Floats) -> Floats:
    """Minimum of each row (c, m), by the parabola through it and its neighbours."""
    row, at = np.arange(len(squares)), np.clip(squares.argmin(axis=1), 1, squares.shape[1] - 2)
    low, middle, high = (squares[row, at + k] for k in (-1, 0, 1))
    bend = np.maximum(low - 2 * middle + high, np.finfo(float).tiny)
    least = np.minimum(squares.min(axis=1), middle - (high - low) ** 2 / (8 * bend))
    return np.asarray(np.maximum(least, 0.0))
