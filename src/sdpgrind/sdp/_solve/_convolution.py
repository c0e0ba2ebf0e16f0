"""Sums of all rows over all lags: a matrix product with the Toeplitz matrix of the values, or a Fourier transform."""

import itertools

import numpy as np
from scipy import fft

from sdpgrind.base.checks import Floats

CHUNK = 32
"""Rows that are transformed back together."""
BLOCKS = 4
"""Column blocks of the matrix product: the lower triangle is not multiplied. Fixed, so that results never depend on it."""


class Product:
    """out[row, node] = sum of weight[row, lag] * value[node - lag] over the targets 1..n-1, by blocks of nodes."""

    def __init__(self, weight: Floats, nodes: int, lags: int, first_lag: int) -> None:
        self._weight = weight
        self._padded = np.zeros(nodes + 2 * lags)
        self._inside = self._padded[lags : lags + nodes - 1]  # node 0 is the origin of the values: its weight does not matter
        # Entry (lag, node) of the Toeplitz matrix is the value of node - lag = flipped[nodes - 1 - node + lag].
        start, item = lags + nodes - 1 + first_lag, self._padded.itemsize
        view = np.lib.stride_tricks.as_strided(self._padded[start:], (lags, nodes), (item, -item))
        edges = np.linspace(0, nodes, (BLOCKS if nodes >= 64 else 1) + 1).astype(int)
        self._blocks = []
        for begin, end in itertools.pairwise(edges):
            depth = min(lags, int(end) - first_lag)
            self._blocks.append((slice(int(begin), int(end)), depth, view[:depth, begin:end], np.empty((depth, end - begin))))

    def __call__(self, rows: slice, flipped: Floats, out: Floats) -> None:
        """Multiply; `flipped` is the value from the top node down."""
        self._inside[:] = flipped[:-1]
        for columns, depth, view, matrix in self._blocks:
            matrix[:] = view
            np.matmul(self._weight[rows, :depth], matrix, out=out[:, columns])


class Convolution:
    """The same for many nodes: the transform of each row is kept, that of the value is taken once a call."""

    def __init__(self, weight: Floats, nodes: int, lags: int, first_lag: int) -> None:
        self._first, self._nodes = -first_lag, nodes
        self._size = fft.next_fast_len(nodes + lags - 1, real=True)
        self._spectrum = fft.rfft(weight, self._size, axis=1)

    def __call__(self, rows: slice, flipped: Floats, out: Floats) -> None:
        """Convolve; `flipped` is the value from the top node down, that of node 0 being 0."""
        value = fft.rfft(flipped[::-1], self._size)
        for k in range(rows.start, rows.stop, CHUNK):
            some = slice(k, min(k + CHUNK, rows.stop))
            found = fft.irfft(self._spectrum[some] * value, self._size, axis=1, overwrite_x=True)
            out[some.start - rows.start : some.stop - rows.start] = found[:, self._first : self._first + self._nodes]
