"""States located in a policy table."""

from dataclasses import dataclass

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._grid import Ints


@dataclass(frozen=True)
class Place:
    """States located in the table: slice, late charge, mode, position on every axis (cells), coordinates, stage coordinate."""

    row: Ints
    late: Floats
    mode: Ints
    index: Floats
    points: tuple[Floats, ...]
    shape: tuple[int, ...]
    time: Floats
