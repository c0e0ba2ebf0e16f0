"""Predicted readings of a push for frictions about the believed ones; likelihood of the actual ones."""

import numpy as np

from centering._problem.model import PushModel
from centering.friction._belief import FrictionBelief, span
from centering.friction._prediction_kernels import log_likelihood
from centering.push._contact.reaction import pushed
from centering.push._contact.reaction_kernels import FORCE
from centering.push._profile.profile import TipProfile
from centering.push.turning._table_profile import TableProfile
from centering.push.turning._table_trace import simulate_table_pushes
from sdpgrind.base.checks import Floats

NODES = (21, 9)
"""Simulated frictions of a push, of scale and ratio; chosen: more cost time, fewer blur the prediction."""
_REACH = 4.0  # chosen: reach of the nodes in standard deviations of the prediction
_ROUGH = 0.5  # chosen: sd between nodes over their second difference; that of noise, more than that of a jump
_FINAL, _SLIDE, _PEAK = range(3)
"""Columns of the result of a push."""


def likelihood(
    belief: FrictionBelief,
    model: PushModel,
    profile: TipProfile,
    read: Floats,
    noise_sd: Floats,
    error: tuple[float, float],
) -> tuple[Floats, float]:
    """Likelihood of the readings over (scale, ratio), greatest 1; the least misfit.

    `error`: relative error of the model, and travel of the tip (mm), within which positions are exact.
    """
    met = belief.expected()
    scales = span(belief.pushed, met.sum(axis=1), _REACH, NODES[0])
    ratios = span(belief.ratio, met.sum(axis=0), _REACH, NODES[1])
    found = predicted(model, profile, scales, ratios)
    doubt = np.maximum(roughness(found, 0), roughness(found, 1))
    nodes, cells = _axes(scales, ratios), _axes(belief.pushed, belief.ratio)
    out = np.empty((belief.pushed.size, belief.ratio.size))
    off = log_likelihood(found, doubt, nodes, cells, read, noise_sd, *error, out)
    return np.exp(out - out.max()), float(off)


def predicted(model: PushModel, profile: TipProfile, scales: Floats, ratios: Floats) -> Floats:
    """Peak force (N), free slide and final position (mm) at each friction, (n, m, 3)."""
    held = model.breakaway_force * np.exp(scales[:, None] + 0.5 * ratios)
    slid = np.minimum(model.coulomb_force * np.exp(scales[:, None] - 0.5 * ratios), held)
    rows = np.tile(model.parameters, (held.size, 1))
    rows[:, 3], rows[:, 4] = held.ravel(), slid.ravel()
    if isinstance(profile, TableProfile):
        shown = simulate_table_pushes(rows, profile)
    else:
        shown = pushed(rows, profile, FORCE)
    return np.ascontiguousarray(shown[:, [_PEAK, _SLIDE, _FINAL]]).reshape(*held.shape, 3)


def roughness(found: Floats, axis: int) -> Floats:
    """Standard deviation at each node from the second differences along an axis."""
    if found.shape[axis] < 3:
        return np.zeros_like(found)
    values = np.moveaxis(found, axis, 0)
    second = np.abs(values[:-2] - 2.0 * values[1:-1] + values[2:])
    padded = np.concatenate([second[:1], second, second[-1:]])
    return np.moveaxis(_ROUGH * padded, 0, axis)


def _axes(*axes: Floats) -> Floats:
    """First place and step of each axis, (2, 2)."""
    return np.array([(axis[0], axis[1] - axis[0] if axis.size > 1 else 0.0) for axis in axes])
