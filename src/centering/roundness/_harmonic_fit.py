"""Harmonics of values at any angles by least squares: Toeplitz normal equations, conjugate gradients.

With the basis exp(i k angle), k = -n..n, the normal matrix T[j, k] = sum exp(i (k - j) angle) depends on k -
j alone: a product with it is a product of two functions of the angle, by two real FFTs. On an even grid T is
a multiple of the identity and a single step is exact.
"""

import dataclasses
from collections.abc import Iterator
from functools import cached_property
from math import inf, isqrt, sqrt

import numpy as np
from scipy.fft import next_fast_len
from scipy.linalg.lapack import dsterf

from sdpgrind.base.checks import Complex, Floats

_STEPS = 2000  # chosen: conjugate-gradient steps, many more than any accepted condition needs
_RESIDUAL = 1e-14  # chosen: relative residual that ends them, above rounding
_PIECE = 512  # chosen: samples of a piece that fits the cache
_FLAT = 1e-11  # chosen: eigenvalue of T over the number of samples that is rounding


def sums(angle: Floats, values: Floats, degree: int) -> tuple[Complex, Complex]:
    """Sums of exp(-i k angle) for k = 0..2 degree, and of values times that for k = 0..degree."""
    fine = isqrt(2 * degree) + 1
    density = np.zeros((2 * degree // fine + 1, fine), dtype=complex)
    target = np.zeros((degree // fine + 1, fine), dtype=complex)
    for piece, low, high in _pieces(angle, fine, len(density)):
        density += high @ low.T
        target += (high[: len(target)] * values[piece]) @ low.T
    return density.ravel()[: 2 * degree + 1], target.ravel()[: degree + 1]


def values_at(coef: Complex, angle: Floats) -> Floats:
    """Real values of sum coef[k] exp(i k angle) over k = -n..n, given for k >= 0."""
    fine = isqrt(coef.size) + 1
    padded = np.zeros(((coef.size - 1) // fine + 1, fine), dtype=complex)
    padded.flat[: coef.size] = np.concatenate([coef[:1], 2 * coef[1:]]).conj()
    values = np.empty(angle.size)
    for piece, low, high in _pieces(angle, fine, len(padded)):
        values[piece] = np.sum(high * (padded @ low), axis=0).real
    return values


def _pieces(angle: Floats, fine: int, coarse: int) -> Iterator[tuple[slice, Complex, Complex]]:
    """Fine powers 0..fine-1 and coarse powers of exp(-i k angle), in pieces that fit the cache."""
    for first in range(0, angle.size, _PIECE):
        piece = slice(first, first + _PIECE)
        turned = angle[piece]
        yield piece, powers(np.exp(-1j * turned), fine), powers(np.exp(-1j * fine * turned), coarse)


def powers(base: Complex, count: int) -> Complex:
    """Powers 0..count-1 of numbers on the unit circle, (count, n), by repeated products."""
    powers = np.empty((count, base.size), dtype=complex)
    powers[0] = 1.0
    for k in range(1, count):
        np.multiply(powers[k - 1], base, out=powers[k])
    return powers


@dataclasses.dataclass(frozen=True, eq=False)
class HarmonicFit:
    """Coefficients 0..n of exp(i k angle), condition, residuals, the sums that make T, T^-1 on cos n."""

    coef: Complex
    condition: float
    residual: Floats
    density: Complex
    cosine: Complex

    @property
    def freedom(self) -> int:
        """Number of values minus coefficients."""
        return int(self.residual.size - 2 * self.coef.size + 1)

    @property
    def noise_sd(self) -> float:
        """Standard deviation of one value, from the residuals; infinite without degrees of freedom."""
        return float(np.linalg.norm(self.residual) / sqrt(self.freedom)) if self.freedom > 0 else inf

    @cached_property
    def amplitude_spread(self) -> Floats:
        """Standard deviation of the mean (k = 0) and of amplitude k along its phase, for unit noise."""
        variance, pseudo = _inverse(self.density, self.cosine)
        towards = np.exp(-2j * np.angle(self.coef))
        spread = 2 * (variance + (pseudo * towards).real)
        spread[0] = variance[0]
        return np.asarray(np.sqrt(np.maximum(spread, 0.0)))


def fit_harmonics(angle: Floats, values: Floats, degree: int) -> HarmonicFit:
    """Least squares of harmonics 0..degree; infinite condition where the angles do not separate them."""
    density, target = sums(angle, values, degree)
    coef, steps = _solved(density, target)
    cosine, edged = _solved(density, _edge(degree))  # the highest harmonic has the worst condition
    condition = max(_condition(steps), _condition(edged))
    return HarmonicFit(coef, condition, values - values_at(coef, angle), density, cosine)


def fitted_again(fit: HarmonicFit, angle: Floats, values: Floats) -> Complex:
    """Coefficients of other values at the angles of a fit."""
    return _solved(fit.density, sums(angle, values, fit.coef.size - 1)[1])[0]


def _edge(degree: int) -> Complex:
    """Highest harmonic alone, a cosine; times i, a sine."""
    edge = np.zeros(degree + 1, dtype=complex)
    edge[-1] = 1.0
    return edge


def even_harmonics(values: Floats) -> Complex:
    """Coefficients 0..n/2 of exp(i k angle) on an even grid that starts at 0."""
    return np.asarray(np.fft.rfft(values) / values.size)


def even_values(coef: Complex, size: int) -> Floats:
    """Values on an even grid of `size` points: `values_at` by FFT; needs size > 2 (coef.size - 1)."""
    return np.asarray(np.fft.irfft(coef * size, size))


def _solved(density: Complex, target: Complex) -> tuple[Complex, list[tuple[float, float]] | None]:
    """Solve T c = target by conjugate gradients; return c and the steps; None where they do not end."""
    field = _field(density)
    coef, left = np.zeros_like(target), target.copy()
    towards, square = left, _inner(left, left)
    goal = _RESIDUAL**2 * square
    steps: list[tuple[float, float]] = []
    while square > goal and len(steps) < _STEPS:
        pushed = _product(field, towards)
        curvature = _inner(towards, pushed)
        if curvature <= _FLAT * density[0].real * _inner(towards, towards):
            return coef, None
        length = square / curvature
        coef, left = coef + length * towards, left - length * pushed
        before, square = square, _inner(left, left)
        steps.append((length, square / before))
        towards = left + (square / before) * towards
    return coef, steps if square <= goal else None


def _field(density: Complex) -> Floats:
    """The sums as a function of the angle, on a grid fine enough for products with harmonics of the fit."""
    size = next_fast_len(2 * density.size, real=True)
    return even_values(density, size)


def _product(field: Floats, coef: Complex) -> Complex:
    """T times coefficients, as a product of two functions of the angle."""
    return np.asarray(even_harmonics(field * even_values(coef, field.size))[: coef.size])


def _inner(one: Complex, other: Complex) -> float:
    """Inner product over k = -n..n, given for k >= 0."""
    return float(2 * np.vdot(one, other).real - (one[0].conjugate() * other[0]).real)


def _condition(steps: list[tuple[float, float]] | None) -> float:
    """Root of T's condition from the steps, by the outer eigenvalues of their Lanczos matrix."""
    if steps is None:
        return inf
    if len(steps) < 2:
        return 1.0
    length, ratio = np.array(steps).T
    main = 1 / length
    main[1:] += ratio[:-1] / length[:-1]
    eigenvalues = dsterf(main, np.sqrt(ratio[:-1]) / length[:-1])[0]
    return sqrt(eigenvalues[-1] / eigenvalues[0]) if eigenvalues[0] > 0 else inf


def _inverse(density: Complex, cosine: Complex) -> tuple[Floats, Complex]:
    """Elements (k, k) and (k, -k) of T^-1, k = 0..n."""
    n = density.size // 2
    first, mirrored = _generators(density, cosine)
    diagonal = np.cumsum(np.abs(first) ** 2 - np.abs(mirrored) ** 2)[n:]
    crossed = [_lagged(first, n, k) - _lagged(mirrored, n, k) for k in range(n + 1)]
    return np.asarray(diagonal), np.array(crossed)


def _generators(density: Complex, cosine: Complex) -> tuple[Complex, Complex]:
    """First columns of triangular Toeplitz matrices L and M with T^-1 = L L' - M M' (Gohberg and Semencul).

    They are the first column of T^-1 (k = -n..n, from T^-1 on a cosine, given, and on a sine) over the root
    of its first element, and that column reversed.
    """
    n = density.size // 2
    sine = 1j * _solved(density, 1j * _edge(n))[0]
    first = np.asarray(np.concatenate([(cosine - sine).conj()[:0:-1], cosine + sine]) / 2, dtype=complex)
    mirrored = np.zeros_like(first)
    mirrored[1:] = first[:0:-1].conj()
    size = sqrt(first[0].real)
    return np.asarray(first / size), np.asarray(mirrored / size)


def value_spread(fit: HarmonicFit, passed: Floats, angle: Floats) -> Floats:
    """Standard deviation of the transmitted sum of the fit's harmonics at any angles, for unit noise.

    Its square has harmonics up to 2 n: sums of T^-1 with the transmissions along each diagonal.
    """
    first, mirrored = _generators(fit.density, fit.cosine)
    share, behind = np.concatenate([passed[:0:-1], passed]), (first.conj(), mirrored.conj())
    coef = np.empty(first.size, dtype=complex)
    for k in range(first.size):
        steps = first[k:] * behind[0][: first.size - k] - mirrored[k:] * behind[1][: first.size - k]
        coef[k] = np.dot(np.cumsum(steps), share[k:] * share[: first.size - k])
    return np.asarray(np.sqrt(np.maximum(values_at(coef, angle), 0.0)))


def _lagged(column: Complex, n: int, k: int) -> complex:
    """Product of a column with itself, shifted by 2 k."""
    return complex(np.vdot(column[: n - k + 1], column[2 * k : n + k + 1]))
