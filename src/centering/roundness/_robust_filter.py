"""Robust Gaussian regression of degree 2 on an even turn (ISO 16610-31): outliers lose their weight."""

import warnings

import numpy as np
from scipy.fft import irfft, rfft

from centering.roundness._robust_kernels import heights
from sdpgrind.base.checks import Complex, Floats

LEAST = 64  # chosen: points; fewer leave no residuals to judge outliers by
WIDTH = 0.7309134280731705
"""Derived: root of exp(-pi g^2) (1 + pi g^2) = 1/2, for which degree 2 passes one half at the cut-off."""
_BOUND = 4.4478  # source: ISO 16610-31; Tukey's bound over the median of the absolute residuals
_STILL = 1e-9  # chosen: move over the range that ends the sweeps
_MOST = 1000  # chosen: sweeps; 9 to 130 were needed


def robust_gaussian(values: Floats, cut_off: float, sweeps: int | None = None) -> Floats:
    """Low-pass values on an even turn; the cut-off in upr.

    At each point a parabola is fitted to its surroundings, each reading weighted by the Gaussian of its
    distance and by Tukey's weight of its residual, which follows from the parabolas before. Where all near
    it lost their weight a point keeps its value. After so many `sweeps` it ends as it is; None: until it is
    still.
    """
    window = _window(values.size, cut_off)
    scale = float(np.ptp(values))
    now = _fitted(values, np.ones_like(values), window, values.copy())  # writable, as those that follow
    for _ in range(_MOST if sweeps is None else sweeps):
        residual = values - now
        bound = _BOUND * _median(np.abs(residual))
        if bound < _STILL * scale:
            return now
        before, now = now, _fitted(values, _weights(residual, bound), window, now)
        if np.max(np.abs(now - before)) < _STILL * np.ptp(now):
            return now
    if sweeps is not None:
        return now
    warnings.warn(
        f"the robust filter still moves by {1e3 * np.max(np.abs(now - before)):.2g} µm after {_MOST} sweeps",
        stacklevel=5,
    )
    return now


def _window(size: int, cut_off: float) -> Complex:
    """Spectra of the Gaussian times powers 0..4 of the distance, for correlations, (5, n/2 + 1)."""
    place = (np.arange(size) + size // 2) % size - size // 2
    distance = place * cut_off / (WIDTH * size)
    weight = np.exp(-np.pi * distance**2)
    return np.conj(np.fft.rfft(weight * distance ** np.arange(5)[:, None]))


def _median(sizes: Floats) -> float:
    """`numpy.median` of finite values to the bit, in a fifth of its time for 360; they are put in order."""
    high = sizes.size // 2
    low = high - 1 + sizes.size % 2
    sizes.partition((low, high))
    return 0.5 * float(sizes[low] + sizes[high])


def _fitted(values: Floats, weight: Floats, window: Complex, before: Floats) -> Floats:
    """Parabolas about each point: their values there."""
    weights, weighted = rfft(np.stack((weight, weight * values)))
    both = irfft(np.concatenate((weights * window, weighted * window[:3])), values.size, overwrite_x=True)
    return np.asarray(heights(both[:5], both[5:], float(window[0].real[0]), before))


def _weights(residual: Floats, bound: float) -> Floats:
    """Tukey's weights of residuals, 0 from the bound on."""
    return np.asarray(np.maximum(1 - (residual / bound) ** 2, 0.0) ** 2)
