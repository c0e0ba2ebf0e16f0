"""What the tests of the solver reach inside the area."""

from sdpgrind.sdp._policy.value_lost import value_lost
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.point_backup import PointBundle
from sdpgrind.sdp._transitions.menu import Menu

__all__ = ["Bundles", "Grid", "Menu", "PointBundle", "value_lost"]
