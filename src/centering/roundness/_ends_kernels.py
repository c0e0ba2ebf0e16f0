"""Minimum zones of many forms on an even turn."""

import numpy as np

from centering.roundness._distance_kernels import extremes
from centering.roundness._mzc_kernels import zone
from sdpgrind.base.compiling.compiled import compiled

_ROUNDING = 1e-15  # derived: of the radius; some units of the distance


@compiled
def zone_widths(forms, radius):
    """Widths of the minimum zones, (b,), mm, of forms (b, n) about a circle, mm."""
    count, size = forms.shape
    found, basis = np.empty(count), np.zeros(4, np.int64)
    cosine, sine = np.empty(size), np.empty(size)
    for k in range(size):
        cosine[k], sine[k] = np.cos(2 * np.pi * k / size), np.sin(2 * np.pi * k / size)
    x, y = np.empty(size), np.empty(size)
    for b in range(count):
        for k in range(size):
            x[k], y[k] = (radius + forms[b, k]) * cosine[k], (radius + forms[b, k]) * sine[k]
        cx, cy, _, _ = zone(x, y, 0.0, 0.0, 16 * _ROUNDING * radius, basis)
        _, most, _, least = extremes(x, y, cx, cy)
        found[b] = most - least
    return found
