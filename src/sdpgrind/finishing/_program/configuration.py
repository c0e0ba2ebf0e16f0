"""Configuration that moves name: compared with the joints of the motion there."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats

_ROUNDING = 1e-3  # rad, chosen: a joint nearer to a quarter of a turn, or to 0, may count on either side


def check_configuration(path: Any, joints: Floats, block: Any, branch: int) -> None:
    """Refuse a move whose branch, quarters or signs are not those of the motion at its end."""
    if path.configuration.shape[1] == 0:
        return
    ends = np.searchsorted(block, np.arange(len(path.feeds)), side="right") - 1
    # The move ends between two samples of the plan.
    before, after = (joints[np.clip(ends + k, 0, len(joints) - 1)] for k in (0, 1))
    low = _configured(path.target, np.minimum(before, after) - _ROUNDING, branch)
    high = _configured(path.target, np.maximum(before, after) + _ROUNDING, branch)
    told = path.configuration
    if path.target == "rapid":
        fits = np.all((told == low) | (told == high), axis=1)
    else:
        same = ~(low[:, 1].astype(int) ^ high[:, 1].astype(int))  # bits of joints that are not near 0
        differs = (told[:, 1].astype(int) ^ low[:, 1].astype(int)) & same
        fits = (told[:, 0] == low[:, 0]) & (differs == 0)
    for k in np.flatnonzero(~fits)[:1]:
        raise ValueError(
            f"text must name the configuration of the motion's joints; move {k + 1} names"
            f" {told[k].astype(int).tolist()}, the joints have {low[k].astype(int).tolist()}"
        )


def _configured(target: str, joints: Floats, branch: int) -> Floats:
    """Quarters of a turn and number of the branch; or status and turn."""
    shoulder, wrist, elbow = (branch >> 2) & 1, (branch >> 1) & 1, branch & 1
    if target == "rapid":
        number = np.full(len(joints), 4 * shoulder + 2 * elbow + wrist)
        return np.column_stack([joints[:, [0, 3, 5]] // (np.pi / 2), number])
    signs = (joints < 0.0) @ (1 << np.arange(6))
    return np.column_stack([np.full(len(joints), shoulder | (elbow << 1)), signs])
