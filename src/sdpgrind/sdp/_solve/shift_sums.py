"""Sums of weights times values over all lags, for many rows at every node: as matrices, or by transforms."""

import itertools
from bisect import bisect_left
from typing import Any

import numpy as np
from scipy import fft

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.grid import Ints

BLOCKS = 4  # chosen: column blocks of the matrix product without its lower triangle; fixed for equal bits
# chosen: rows whose transforms have one length, a third of a scan of 51 levels: a block that holds the end of
# one and the beginning of the next is as long as both. More share fewer lags, fewer cost overhead
BLOCK = 17
TOGETHER = 2**16  # chosen: entries transformed back together; fewer cost overhead, more leave the cache
SIZES = 8  # chosen: lengths of transforms for each number of nodes; fewer are too long, more seldom shared

_Block = tuple[slice, int, int, Any]  # rows, first and last lag, their transforms


class Product:
    """out[row, node] = sum of weight[row, lag] * value[node - lag] over targets 1..n-1, by node blocks."""

    def __init__(self, weight: Floats, nodes: int, lags: int, first_lag: int) -> None:
        self._weight = weight
        self._padded = np.zeros(nodes + 2 * lags)
        # Node 0 is the origin of the values: its weight is irrelevant.
        self._inside = self._padded[lags : lags + nodes - 1]
        # Entry (lag, node) of the Toeplitz matrix: value[node - lag] = flipped[nodes - 1 - node + lag].
        start, item = lags + nodes - 1 + first_lag, self._padded.itemsize
        view = np.lib.stride_tricks.as_strided(self._padded[start:], (lags, nodes), (item, -item))
        edges = np.linspace(0, nodes, (BLOCKS if nodes >= 64 else 1) + 1).astype(int)
        self._blocks = []
        for begin, end in itertools.pairwise(edges):
            depth = min(lags, int(end) - first_lag)
            self._blocks.append(
                (slice(int(begin), int(end)), depth, view[:depth, begin:end], np.empty((depth, end - begin)))
            )

    def __call__(self, rows: slice, flipped: Floats, out: Floats) -> None:
        """Multiply; `flipped` is the value from the top node down."""
        self._inside[:] = flipped[:-1]
        for columns, depth, view, matrix in self._blocks:
            matrix[:] = view
            np.matmul(self._weight[rows, :depth], matrix, out=out[:, columns])


class Convolution:
    """`Product` for many nodes, by Fourier transforms: of blocks of rows, kept, and of the value once a call.

    A transform is as long as the nodes and the lags of its block; blocks with equal lengths are transformed
    back together.
    """

    def __init__(self, weight: Floats, rows: Ints, nodes: int, first_lag: int) -> None:
        self._nodes = nodes
        by_size: dict[int, list[_Block]] = {}
        for k in range(0, len(rows), BLOCK):
            part = weight[rows[k : k + BLOCK]]
            low, high = _columns_used(part)
            size = self._size(high - low + 1)
            lines = slice(k, k + len(part)), low + first_lag, high + first_lag
            block = *lines, fft.rfft(part[:, low : high + 1], size, axis=1)
            by_size.setdefault(size, []).append(block)
        self._groups = [
            (size, *_together(blocks[k : k + count]))
            for size, blocks in by_size.items()
            for count in [max(1, TOGETHER // (size * BLOCK))]
            for k in range(0, len(blocks), count)
        ]

    def _size(self, lags: int) -> int:
        """Length of the transforms for a number of lags."""
        step = max(1, self._nodes // SIZES)
        return int(fft.next_fast_len(-(-(self._nodes + lags) // step) * step, real=True))

    def __call__(self, rows: slice, flipped: Floats, out: Floats) -> None:
        """Convolve; `flipped` is the value from the top node down, 0 at node 0."""
        values: dict[int, Any] = {}
        for size, numbers, spectrum, blocks in self._groups:
            first, last = (bisect_left(numbers, row) for row in (rows.start, rows.stop))
            if first >= last:
                continue
            if size not in values:
                values[size] = fft.rfft(flipped[::-1], size)
            found = fft.irfft(spectrum[first:last] * values[size], size, axis=1, overwrite_x=True)
            at = 0
            for block, low, high in blocks:
                some = slice(max(rows.start, block.start), min(rows.stop, block.stop))
                if some.start < some.stop:
                    line = out[some.start - rows.start : some.stop - rows.start]
                    self._put(found[at : at + len(line)], low, high, line)
                    at += len(line)

    def _put(self, found: Floats, low: int, high: int, out: Floats) -> None:
        """Copy the sums at the nodes that end on another one; zeros elsewhere."""
        begin, end = max(low + 1, 0), min(self._nodes + high, self._nodes)
        out[:, begin:end] = found[:, begin - low : end - low]
        out[:, :begin] = out[:, end:] = 0.0


def _together(blocks: list[_Block]) -> tuple[list[int], Any, list[tuple[slice, int, int]]]:
    """Numbers of all rows, their transforms, and (rows, first lag, last lag) of each block."""
    numbers = [row for block in blocks for row in range(block[0].start, block[0].stop)]
    return numbers, np.concatenate([block[3] for block in blocks]), [block[:3] for block in blocks]


def _columns_used(weight: Floats) -> tuple[int, int]:
    """First and last column with a weight that is not 0; 0, 0 without."""
    used = np.flatnonzero(np.any(weight != 0, axis=0))
    return (int(used[0]), int(used[-1])) if used.size else (0, 0)
