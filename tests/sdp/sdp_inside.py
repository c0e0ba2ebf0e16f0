"""What the tests of the solver reach inside the area."""

from sdpgrind.sdp._distributions.quick import hats, quick
from sdpgrind.sdp._policy import small_kernels
from sdpgrind.sdp._policy import small_tables as small_tables_module
from sdpgrind.sdp._policy.small_choice import small_tables
from sdpgrind.sdp._policy.small_tables import PRECISIONS, Rounding, narrowed, small_of
from sdpgrind.sdp._policy.value_lost import value_lost, value_lost_within
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._solve import forever
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.point_backup import PointBundle
from sdpgrind.sdp._solve.shift_sums import Convolution, Product
from sdpgrind.sdp._transitions.menu import Menu

__all__ = [
    "PRECISIONS",
    "Bundles",
    "Convolution",
    "Grid",
    "Menu",
    "PointBundle",
    "Product",
    "Rounding",
    "forever",
    "hats",
    "narrowed",
    "quick",
    "small_kernels",
    "small_of",
    "small_tables",
    "small_tables_module",
    "value_lost",
    "value_lost_within",
]
