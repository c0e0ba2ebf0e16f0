"""Columns of angles in a file: by their unit, or by a usual name."""

from typing import Any

from sdpgrind.base.columns.read import opened
from sdpgrind.base.columns.sheet import ColumnHead
from sdpgrind.base.columns.taken import Rules
from sdpgrind.base.unit_text import factor

_NAMES = ("angle", "phi", "theta", "winkel")  # chosen: headers of angles without a unit


def angle_headings(data: Any, rules: Rules) -> list[tuple[str, ColumnHead]]:
    """Return where each column of angles stands, and its heading."""
    return [
        (sheet.where, each) for sheet in opened(data, rules)[1] for each in sheet.headings if _is_angle(each)
    ]


def _is_angle(head: ColumnHead) -> bool:
    """Whether the unit of a column, or its name, is that of an angle."""
    try:
        factor(head.unit or "", "rad")
    except ValueError:
        return head.name.lower() in _NAMES
    return True
