"""Constant powers of one base, by one power and products where exponents differ by integers."""

from math import floor
from typing import TypeAlias

from sdpgrind.locus._problem.tape_kernels import Op

Operation: TypeAlias = tuple[int, int, int]
FURTHEST = 4  # chosen: largest difference of exponents bridged by products; beyond, a power is cheaper


def cheaper_powers(
    code: list[Operation], results: list[int], first: int, constants: dict[int, float]
) -> tuple[list[Operation], list[int]]:
    """Return operations (kind, two places) with cheaper constant powers, and places of results.

    The last bits may change. Exponents keep their sign, so that powers of 0 stay 0 or infinite.
    """
    writer = _Writer(first, _nearest_to_zero(code, constants))
    places: dict[int, int] = {}
    for k, (op, x, y) in enumerate(code):
        x, y = places.get(x, x), places.get(y, y)
        if op == Op.CONSTPOW and abs(constants[y]) < 1e6:
            places[first + k] = writer.power(code[k][1], x, y, constants)
        else:
            places[first + k] = writer.do(op, x, y)
    return list(writer.code), [places.get(n, n) for n in results]


def _family(x: int, exponent: float) -> tuple[int, bool, float]:
    """Key of powers that products connect: base, sign, fraction of the exponent."""
    size = abs(exponent)
    return x, exponent > 0, round(size - floor(size), 12)


def _nearest_to_zero(
    code: list[Operation], constants: dict[int, float]
) -> dict[tuple[int, bool, float], int]:
    """Return the place of the exponent nearest to 0 of each family."""
    found: dict[tuple[int, bool, float], int] = {}
    for op, x, y in code:
        if op == Op.CONSTPOW and abs(constants[y]) < 1e6:
            family = _family(x, constants[y])
            if family not in found or abs(constants[y]) < abs(constants[found[family]]):
                found[family] = y
    return found


class _Writer:
    """Growing list of distinct operations."""

    def __init__(self, first: int, anchors: dict[tuple[int, bool, float], int]) -> None:
        self.first, self.anchors, self.code = first, anchors, dict[Operation, int]()

    def do(self, op: int, x: int, y: int) -> int:
        """Return the place of a result."""
        return self.first + self.code.setdefault((int(op), x, y), len(self.code))

    def power(self, base: int, x: int, y: int, constants: dict[int, float]) -> int:
        """Return the place of x to the constant y; `base` is the former place of x."""
        exponent = constants[y]
        anchor = self.anchors[_family(base, exponent)]
        steps = round(abs(exponent) - abs(constants[anchor]))
        whole = floor(abs(exponent))
        quarters = 4 * (abs(exponent) - whole)
        if quarters in (1.0, 2.0, 3.0) and whole <= FURTHEST:
            place, steps = self._root(x, int(quarters)), whole
            if exponent < 0:
                place = self.do(Op.INV, place, place)
        elif steps <= FURTHEST:
            place = self.do(Op.CONSTPOW, x, anchor)
        else:
            place, steps = self.do(Op.CONSTPOW, x, y), 0
        for _ in range(steps):
            place = self.do(Op.MUL, *sorted((place, x))) if exponent > 0 else self.do(Op.DIV, place, x)
        return place

    def _root(self, x: int, quarters: int) -> int:
        """Return the place of x to the power 1/4, 2/4 or 3/4."""
        root = self.do(Op.SQRT, x, x)
        if quarters == 2:
            return root
        fourth = self.do(Op.SQRT, root, root)
        return fourth if quarters == 1 else self.do(Op.MUL, *sorted((root, fourth)))
