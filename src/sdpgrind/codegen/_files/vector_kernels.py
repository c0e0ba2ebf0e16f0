"""Inputs and digests of the self-test, and comparison of bits."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# source: Marsaglia (2003), Xorshift RNGs, 64 bits; FNV-1a, 64 bits
_LEFT, _RIGHT, _LAST = np.uint64(13), np.uint64(7), np.uint64(17)
BASIS = 14695981039346656037  # source: FNV-1a, 64 bits
_BASIS, _PRIME, _HALF = np.uint64(BASIS), np.uint64(1099511628211), np.uint64(32)
_NAN = np.uint64(0x7FF8000000000000)  # derived: the bits of every NaN
_INFINITY, _UNSIGNED = np.uint64(0x7FF0000000000000), np.uint64(0x7FFFFFFFFFFFFFFF)
_UNIT = 2.0**-53  # derived: step of the 53 bits of a share
_FAR = 50.0  # chosen: spreads by which an input is far off
_RESET, _SKIP, _HOLD, _JUMP = range(4)  # of 256 numbers, what happens to the next row
_MISSED, _FAR_OFF, _EXACT = range(3)  # of 64 numbers, what happens to an input


@compiled
def _next(seed):
    """Advance the random number in place and return it."""
    x = seed[0]
    x ^= x << _LEFT
    x ^= x >> _RIGHT
    x ^= x << _LAST
    seed[0] = x
    return x


@compiled
def varied(seed, place, rows, resets, missing, spread, out, out_resets):
    """Fill `out` with varied rows and `out_resets` with where the state is reset.

    `seed`: the random number (uint64, 1); `place`: row, scale and wildness of the chain, kept between calls.
    Every operation is exact or rounded once, so that C has the same inputs.
    """
    for k in range(out.shape[0]):
        word = _next(seed)
        what = np.int64(word & np.uint64(255)) if place[2] > 0.0 else 255
        row, count = np.int64(place[0]), rows.shape[0]
        if what == _SKIP:
            row += np.int64((word >> np.uint64(8)) & np.uint64(15))
        elif what in (_JUMP, _RESET):
            row = np.int64((word >> np.uint64(8)) % np.uint64(count))
        elif what != _HOLD:
            row += 1
        row %= count
        out_resets[k] = resets[row] or what == _RESET
        if out_resets[k]:
            place[1] = np.float64((word >> np.uint64(40)) & np.uint64(3)) * 0.5
            place[2] = np.float64((word >> np.uint64(44)) & np.uint64(1))
        place[0] = np.float64(row)
        for j in range(rows.shape[1]):
            out[k, j] = _input(_next(seed), rows[row, j], place[1] * spread[j], missing[j])


@compiled
def _input(word, value, half, missing):
    """Return an input: missing, far off, exact, or within its spread."""
    what = np.int64(word & np.uint64(63))
    if what == _MISSED and missing:
        return np.nan
    if what == _EXACT:
        return value
    share = np.float64(word >> np.uint64(11)) * _UNIT - 0.5
    if what == _FAR_OFF:
        half *= _FAR
    return value + 2.0 * half * share


@compiled
def digest(states, outs, codes):
    """Digest of all states, outputs (as uint64) and statuses; every NaN is the same."""
    total = _BASIS
    for k in range(codes.size):
        total = _hashed(total, np.uint64(codes[k] + 4))
        for j in range(outs.shape[1]):
            total = _hashed(total, _same_nan(outs[k, j]))
        for j in range(states.shape[1]):
            total = _hashed(total, _same_nan(states[k, j]))
    return total


@compiled
def hashed_words(total, words):
    """Digest of `words` (uint64) behind others whose digest is `total`."""
    for k in range(words.size):
        total = _hashed(total, words[k])
    return total


@compiled
def _hashed(total, word):
    """Digest of one word more.

    Both steps can be undone: a product with an odd number, and the upper half onto the lower one. So two
    totals stay two whatever follows, and no change of a single word is lost. Without the shift an upper bit
    stays in its place, and signs that change in two words would cancel.
    """
    total = (total ^ word) * _PRIME
    return total ^ (total >> _HALF)


@compiled
def _same_nan(bits):
    """Return the bits of a double, those of one NaN for all of them."""
    return _NAN if (bits & _UNSIGNED) > _INFINITY else bits


@compiled
def differing(first, second):
    """Whether two arrays (m, n) of bits (uint64) differ in each row; a NaN equals any other."""
    found = np.zeros(first.shape[0], dtype=np.bool_)
    for k in range(first.shape[0]):
        for j in range(first.shape[1]):
            if _same_nan(first[k, j]) != _same_nan(second[k, j]):
                found[k] = True
    return found
