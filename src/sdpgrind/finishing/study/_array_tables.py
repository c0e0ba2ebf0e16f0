"""Columns of the orthogonal arrays by construction; runs and columns in Taguchi's order."""

from collections.abc import Callable
from itertools import product

import numpy as np
import numpy.typing as npt

Table = npt.NDArray[np.int64]

# Hadamard matrix of order 12 without its column of ones; 0 for 1 and 1 for -1
_HADAMARD_12 = (
    "00000000000 00000111111 00111000111 01011011001 01101101010 01110110100"
    " 10110011010 10101110001 10011101100 11100001101 11010100011 11001010110"
)
# difference matrices modulo 3: any two columns have each difference equally often
_DIFFERENCES_6 = "000000 001122 010212 022110 012021 021201"
_DIFFERENCES_12 = (
    "000000000000 000011112222 001201220112 002102121021 012021022101 012100212210"
    " 010222011012 011220100221 021012202011 021110021202 022212110100 020121201120"
)
# products in the field of four elements, whose sum is the exclusive or
_MULTIPLES_OF_4 = np.array([[0, 0, 0, 0], [0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2]])
# coefficients of the three base-3 digits of the run, for each column
_LINEAR_27 = "100 010 110 210 001 101 201 011 111 211 021 121 221"


def _digits(rows: str) -> Table:
    return np.array([[int(digit) for digit in row] for row in rows.split()])


def _two_level(factors: int) -> Table:
    """All exclusive ors of the run's binary digits; bit i of the column's number selects digit i."""
    digits = np.array(list(product((0, 1), repeat=factors)))
    masks = [[k >> bit & 1 for bit in range(factors)] for k in range(1, 2**factors)]
    return np.asarray(digits @ np.array(masks).T % 2)


def _three_level(coefficients: Table) -> Table:
    digits = np.array(list(product((0, 1, 2), repeat=coefficients.shape[1])))
    return np.asarray(digits @ coefficients.T % 3)


def _four_level() -> Table:
    x, y = np.array(list(product(range(4), repeat=2))).T
    return np.column_stack([x, y, *(_MULTIPLES_OF_4[k, x] ^ y for k in (1, 2, 3))])


def _developed(blocks: Table, differences: Table) -> Table:
    """Rows of a difference matrix three times, with 0, 1 and 2 added modulo 3, after repeated `blocks`."""
    added = (differences[:, None, :] + np.arange(3)[None, :, None]) % 3
    return np.column_stack([np.repeat(blocks, 3, axis=0), added.reshape(-1, differences.shape[1])])


def _l18() -> Table:
    return _developed(np.array(list(product((0, 1), (0, 1, 2)))), _digits(_DIFFERENCES_6))


def _l36_of_three_levels() -> Table:
    pairs = np.array(list(product((0, 1), (0, 1), (0, 1, 2))))
    blocks = np.column_stack([pairs[:, 0], pairs[:, 1], pairs[:, 0] ^ pairs[:, 1], pairs[:, 2]])
    return _developed(blocks, _digits(_DIFFERENCES_12))


# by full name; a short name is that of the first of its size
TABLES: dict[str, Callable[[], Table]] = {
    "L4(2^3)": lambda: _two_level(2),
    "L8(2^7)": lambda: _two_level(3),
    "L9(3^4)": lambda: _three_level(np.array([[1, 0], [0, 1], [1, 1], [2, 1]])),
    "L12(2^11)": lambda: _digits(_HADAMARD_12),
    "L16(2^15)": lambda: _two_level(4),
    "L16(4^5)": _four_level,
    "L18(2^1 3^7)": _l18,
    "L27(3^13)": lambda: _three_level(_digits(_LINEAR_27)),
    "L36(2^11 3^12)": lambda: _developed(_digits(_HADAMARD_12), _digits(_DIFFERENCES_12)),
    "L36(2^3 3^13)": _l36_of_three_levels,
}
