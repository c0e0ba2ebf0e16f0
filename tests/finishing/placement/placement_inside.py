"""What the tests of placements reach inside the area."""

from sdpgrind.finishing._problem.place import placing_task
from sdpgrind.finishing.placement._azimuths import AzimuthRange, ranges, swept, turned_back
from sdpgrind.finishing.placement._enclosing_ball import enclosing_ball
from sdpgrind.finishing.placement._grid import in_base, on_work
from sdpgrind.finishing.placement._proofs import proof_of
from sdpgrind.finishing.placement._reach import reach_of
from sdpgrind.finishing.placement._table import wrist_travels
from sdpgrind.finishing.placement._task import ToolHold, spread, task_of
from sdpgrind.finishing.placement._widths import least_room, widths
from sdpgrind.finishing.placement._worth import PlacementRows, rated

__all__ = [
    "AzimuthRange",
    "PlacementRows",
    "ToolHold",
    "enclosing_ball",
    "in_base",
    "least_room",
    "on_work",
    "placing_task",
    "proof_of",
    "ranges",
    "rated",
    "reach_of",
    "spread",
    "swept",
    "task_of",
    "turned_back",
    "widths",
    "wrist_travels",
]
