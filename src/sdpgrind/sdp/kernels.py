"""Look-up of one state, compiled, small tables for it, and laws for whole tables: for the areas."""

from sdpgrind.sdp._distributions.quick import quick as quick
from sdpgrind.sdp._policy.single_kernels import FOUND as FOUND
from sdpgrind.sdp._policy.single_kernels import OUTSIDE as OUTSIDE
from sdpgrind.sdp._policy.single_kernels import act_linear_at as act_linear_at
from sdpgrind.sdp._policy.small_choice import small_tables as small_tables
from sdpgrind.sdp._policy.small_kernels import act_small_at as act_small_at
from sdpgrind.sdp._policy.small_kernels import tell_small_at as tell_small_at
from sdpgrind.sdp._policy.stage_told import stage_told as stage_told
