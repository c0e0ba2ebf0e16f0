"""Which of several laws or alignments the sizes prefer, where a gauge filters its noise and rounds it.

Sums of squares of residuals are compared after a first-order filter, the same for all. What it leaves alike
of noise that was rounded makes their difference scatter by more than that of independent readings.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.alignment import Alignment, preferred
from sdpgrind.plunge._identify import rounding


def preferred_law(
    left: Mapping[str, Sequence[Floats]],
    sizes: Sequence[Floats],
    times: Sequence[Floats],
    rho: float,
    fitted: int,
) -> Alignment:
    """Law of least squares, by its residuals (mm) in each part of sizes (mm) read at times (s).

    `rho`: correlation of the residuals of the best; `fitted`: values fitted in a part.
    """
    apart = [serial.gaps(time, time.size) for time in times]
    squares = {
        law: float(sum(np.sum(serial.filtered(e, rho, a) ** 2) for e, a in zip(each, apart, strict=True)))
        for law, each in left.items()
    }
    readings = sum(size.size for size in sizes)
    found = preferred(squares, readings)
    pairs = zip(sizes, apart, left[found.best], left[found.second], strict=True)
    scatter = np.sum([_scatter(*each, rho, fitted) for each in pairs], axis=0)
    return preferred(squares, readings, max(scatter[0] / scatter[1], 1.0) if scatter[1] > 0 else 1.0)


def _scatter(
    size: Floats, apart: Floats, best: Floats, second: Floats, rho: float, fitted: int
) -> tuple[float, float]:
    """Variance (mm^4) of half the difference of two sums of squares, and that by independent noise."""
    noise_sd = float(np.sqrt(np.mean(best**2)))
    off = serial.filtered(second - best, rho, apart)
    weights = serial.filtered_back(off, rho, apart)[None]
    own = rounding.unrounded(rho, size, noise_sd, fitted)
    moved = rounding.covariance(size, weights, apart, own, rho, noise_sd)
    return float(moved[0, 0]), float(off @ off) * (1 - rho**2) * noise_sd**2
