"""Reader of tables of joints over time."""

import re

import numpy as np

from sdpgrind.base.checks import shown
from sdpgrind.finishing._program.program_path import ProgramPath

_COLUMN = re.compile(r"\w+_(?:rad|mm)")


def read_table(text: str) -> ProgramPath:
    """Return the rows of a table: time_s, then joints named with _rad or _mm.

    Raises
    ------
    ValueError
        When a name has no unit, a row other columns, or times do not rise; with the line.
    """
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line and not line.startswith("#")]
    names = lines[0][1].split(",")
    if names[0] != "time_s" or not all(_COLUMN.fullmatch(name) for name in names[1:]) or len(names) < 2:
        raise ValueError(
            f"text must be a table of time_s and joints in _rad or _mm; got {shown(lines[0][1])}"
        )
    rows = np.empty((len(lines) - 1, len(names)))
    for row, (number, line) in zip(rows, lines[1:], strict=True):
        words = line.split(",")
        try:
            row[:] = [float(word) for word in words]
        except ValueError:
            raise ValueError(
                f"text must be a table of {len(names)} numbers a row; line {number} is {shown(line)}"
            ) from None
    if len(rows) < 2 or not np.isfinite(rows).all() or np.any(np.diff(rows[:, 0]) <= 0):
        raise ValueError("text must be a table of at least two rows of finite numbers, whose times rise (s)")
    joints = tuple(name.rpartition("_")[0] for name in names[1:])
    return ProgramPath("csv", time=rows[:, 0], joints=rows[:, 1:], names=joints)
