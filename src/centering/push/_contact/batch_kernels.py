"""Many pushes, one after the other."""

import numpy as np

from centering.push._contact.reaction_kernels import LOG_COLUMNS, push
from sdpgrind.base.compiled import compiled


@compiled
def push_many(parameters, segments, ends, starts, out, status):
    """Simulate pushes: row i of `parameters` (or the only one) with the segments before ``ends[i]`` (or the only profile)."""
    log = np.empty((0, LOG_COLUMNS))
    for i in range(out.shape[0]):
        profile = i if ends.size > 1 else 0
        begin = ends[profile - 1] if profile > 0 else 0
        law = parameters[i if parameters.shape[0] > 1 else 0]
        status[i] = push(law, segments[begin : ends[profile]], starts[profile], out[i], log)
