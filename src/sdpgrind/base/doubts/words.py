"""Numbers in words: as many digits as their uncertainty carries, small ones in a thousandth of their unit."""

from collections.abc import Sequence
from math import isfinite

from sdpgrind.base.sheets.amounts import fixed, places_of, scale_of, written

_TIMES = 2.0  # chosen: excess from which on a multiple is clearer than a share in percent
_ENDLESS = 1e5  # chosen: excess beyond which its digits say nothing
_FEW = 1e-4  # chosen: probabilities below are written by their power of ten


def amount(value: float, unit: str, digits: int = 2) -> str:
    """Return a value with its unit, to some significant digits; small ones as a page shows them, as µm."""
    factor, unit = scale_of(unit, abs(value))
    return f"{significant(factor * value, digits)} {'' if unit == '1' else unit}".rstrip()


def in_one_unit(values: Sequence[float], unit: str, digits: int = 2) -> list[str]:
    """Return values with the unit of the least of them, as they are compared; see `amount`."""
    factor, unit = scale_of(unit, min(map(abs, values)))
    shown = "" if unit == "1" else unit
    return [f"{significant(factor * value, digits)} {shown}".rstrip() for value in values]


def share(excess: float) -> str:
    """Return words for how much larger a quantity is, before the word "larger"."""
    if excess >= _ENDLESS:
        return f"over {_ENDLESS:g} times"
    return f"{significant(excess)} times" if excess >= _TIMES else f"{significant(100 * excess)} %"


def significant(value: float, digits: int = 2) -> str:
    """Return a value to some significant digits, without exponent between 1e-4 and 1e6."""
    return written(value, value, digits)


def to_spread(value: float, spread: float) -> str:
    """Return a value with the decimals that two digits of its spread carry."""
    if not isfinite(value):
        return f"{value:g}"
    if not isfinite(spread) or spread <= 0 or not 1e-6 <= abs(value or spread) < 1e6:
        return f"{value:.4g}"
    return fixed(value, places_of(spread))


def probability(chance: float) -> str:
    """Return a probability in words of a sentence."""
    if chance >= _FEW:
        return f"by chance {significant(100 * chance, 2)} %"
    return "by chance < 0.01 %"
