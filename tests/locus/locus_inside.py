"""What tests of the locus reach inside the package: twins of kernels, and parts that no user names."""

from sdpgrind.locus._adaptation.modifiers import pattern as pattern
from sdpgrind.locus._curve import inversion_kernels as inversion_kernels
from sdpgrind.locus._curve.inversion import Inversion as Inversion
from sdpgrind.locus._curve.inversion_kernels import find_state as find_state
from sdpgrind.locus._problem.tape import tape as tape
from sdpgrind.locus._problem.tape_kernels import Op as Op
from sdpgrind.locus._problem.tape_kernels import run as run
from sdpgrind.locus._problem.tape_kernels import run_many as run_many
from sdpgrind.locus._problem.tape_kernels import work_size as work_size
from sdpgrind.locus._robust.robust import feedback_points as feedback_points
from sdpgrind.locus._trace import kkt_kernels as kkt_kernels
from sdpgrind.locus._trace import pieces as pieces
from sdpgrind.locus._trace import trace_kernels as trace_kernels
from sdpgrind.locus._trace.exchange_kernels import _exchange as _exchange
from sdpgrind.locus._trace.table import LocusTable as LocusTable
from sdpgrind.locus._trace.table_kernels import ABOVE as ABOVE
from sdpgrind.locus._trace.table_kernels import BELOW as BELOW
from sdpgrind.locus._trace.table_kernels import INSIDE as INSIDE
from sdpgrind.locus._trace.table_kernels import NO_KEY as NO_KEY
from sdpgrind.locus._trace.table_kernels import pack as pack
from sdpgrind.locus.gains._loops import Lag as Lag
from sdpgrind.locus.gains._loops import Pid as Pid
from sdpgrind.locus.gains._loops import lagged_map as lagged_map
from sdpgrind.locus.gains._loops import radius as radius
from sdpgrind.locus.gains._loops import sampled_radius as sampled_radius
from sdpgrind.locus.processes import _presets as _presets
