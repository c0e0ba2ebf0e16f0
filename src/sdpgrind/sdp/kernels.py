"""Compiled look-up of one state, for exports of the areas."""

from sdpgrind.sdp._policy.single_kernels import FOUND as FOUND
from sdpgrind.sdp._policy.single_kernels import OUTSIDE as OUTSIDE
from sdpgrind.sdp._policy.single_kernels import act_linear_at as act_linear_at
