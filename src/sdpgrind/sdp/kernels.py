"""Look-up of one state, compiled, and small tables for it: for exports of the areas."""

from sdpgrind.sdp._policy.single_kernels import FOUND as FOUND
from sdpgrind.sdp._policy.single_kernels import OUTSIDE as OUTSIDE
from sdpgrind.sdp._policy.single_kernels import act_linear_at as act_linear_at
from sdpgrind.sdp._policy.small_choice import small_tables as small_tables
from sdpgrind.sdp._policy.small_kernels import act_small_at as act_small_at
from sdpgrind.sdp._policy.small_kernels import tell_small_at as tell_small_at
from sdpgrind.sdp._policy.stage_told import stage_told as stage_told
