"""Programs as tables: joints of every row of the motion over time."""

from collections.abc import Sequence

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.form import ANGLE, LENGTH, commented, told

_SECONDS = 7  # derived: decimals; 25 mm/s move 2.5 nm in 1e-7 s


def table(head: list[str], rows: Floats, names: Sequence[str], units: Sequence[str]) -> str:
    """Write rows (m, n + 1) of time and joints, names with units above."""
    decimals = [LENGTH + 2 if unit == "mm" else ANGLE for unit in units]
    columns = ["time_s", *(f"{name}_{unit}" for name, unit in zip(names, units, strict=True))]
    lines = (
        ",".join(told([value], places) for value, places in zip(row, [_SECONDS, *decimals], strict=True))
        for row in rows
    )
    return "\n".join([*commented(head, "#"), ",".join(columns), *lines]) + "\n"
