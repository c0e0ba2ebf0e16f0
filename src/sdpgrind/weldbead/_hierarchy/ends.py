"""Ends of a bead: where the contact of the disc's face is short, the path of the tip is raised.

A pass at its limit of force runs above its path; where the contact is short the same force would reach the
path, and dig. Softer metal than believed is dug out there, too.
"""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.passes import Contour, PassProblem

REACH = 4.0  # chosen: length of an end, mm; the face is on 1.6 mm of a cut of 0.6 mm
STEP = 0.25  # chosen: distance of the nodes of a raised end, mm; that of the stand's scanner
# chosen: standard deviations of the depth by which an end is higher; without them softer metal is dug out,
# with one of them 0.1 mm stays on the last millimetre
DOUBT = 0.5


def ends_raised(problem: PassProblem, cut_sd: float) -> PassProblem:
    """Return the pass with its path raised at both ends; `cut_sd` is what is not known of the depth, mm."""
    bead, shape = problem.bead, problem.shape
    x = _nodes(bead, shape)
    inside = np.minimum(x - bead.x[0], bead.x[-1] - x)
    reached = bead.at(x) - float(problem.disc.model.mean_cut(problem.force_limit, problem.feed_rate))
    raised = np.where(inside < REACH, np.maximum(reached - problem.tip_path.at(x), 0.0), 0.0)
    raised += DOUBT * cut_sd * np.maximum(1.0 - inside / REACH, 0.0)
    return problem.replace(target_shape=Contour(x, shape.at(x) + raised))


def _nodes(bead: Contour, shape: Contour) -> Floats:
    """Places where the raised shape has nodes, mm."""
    low, high = bead.x[0], bead.x[-1]
    ends = np.concatenate([np.arange(low, low + REACH, STEP), np.arange(high, high - REACH, -STEP)])
    inside = [each for each in shape.x if low <= each <= high]
    return np.unique(np.concatenate([ends, inside, [low + REACH, high - REACH, low, high]]))
