"""Tables of constants: their text in C, and their numbers as words of 64 bits."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.codegen._translate.types import BOOL, ELEMENTS, FLOAT32, ROUNDED, Scalar
from sdpgrind.codegen._translate.values import comment, literal

_COLUMNS = 8  # chosen: numbers in a line
_WHOLE = 1e15  # chosen: whole numbers below it are written as such; all of them have less than 53 bits


@dataclass(frozen=True, eq=False)
class ConstantTable:
    """An array of constants and its name in C; `about`: what it is; `rounded`: the library has doubles."""

    name: str
    array: Any
    about: str
    rounded: bool = False

    @property
    def element(self) -> Scalar:
        """Type of the numbers."""
        return (ROUNDED if self.rounded else ELEMENTS)[self.array.dtype]

    @property
    def numbers(self) -> list[Any]:
        """The numbers in the order of C."""
        return list(self.array.ravel().tolist())

    @property
    def known(self) -> bool:
        """Whether its numbers may be written where they are read."""
        return self.element not in (BOOL, FLOAT32)

    @property
    def text(self) -> str:
        """Definition in C, with a comment that tells the shape."""
        cells = self._cells() or ["0"]
        rows = [", ".join(cells[k : k + _COLUMNS]) for k in range(0, len(cells), _COLUMNS)]
        body = ",\n    ".join(rows)
        about = comment(f"{self.about} ({' x '.join(map(str, self.array.shape))})")
        return f"{about}\nstatic const {self.element.c} {self.name}[{len(cells)}] = {{\n    {body}\n}};"

    def _cells(self) -> list[str]:
        """Return the entries; of short whole numbers, and floats of four bytes, with less to ask."""
        if self.array.dtype in (np.int8, np.int16):
            return [str(one) for one in self.numbers]
        write = _single if self.element == FLOAT32 else _cell
        return [write(one) for one in self.numbers]

    @property
    def words(self) -> Any:
        """Numbers as uint64: bits of a double, those of one NaN for all; whole ones as int64."""
        if self.array.dtype.kind != "f":
            return self.array.ravel().astype(np.int64).view(np.uint64)
        numbers = self.array.ravel().astype(np.float64)
        numbers[np.isnan(numbers)] = np.nan
        return numbers.view(np.uint64)


def _cell(number: Any) -> str:
    """Return an entry of a table: what is no whole number in hexadecimal."""
    if isinstance(number, bool | int) or not math.isfinite(number):
        return literal(number).code
    return repr(number) if number.is_integer() and abs(number) < _WHOLE else str(number.hex())


def _single(number: float) -> str:
    """Return an entry of a table of floats of four bytes."""
    if math.isfinite(number):
        return _cell(number)
    return "NAN" if number != number else "INFINITY" if number > 0.0 else "-INFINITY"
