"""Configuration that moves name: compared with the joints of the motion there."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats

# mm, chosen: places of a check, other than the writer's; a chord of it leaves an arc of 0.3 mm by 0.4 um
STEP = 0.03
_JOINTS = 6  # source: KRL, axes whose signs are told; external ones are not among them
_ROUNDING = 1e-3  # rad, chosen: a joint nearer to a quarter of a turn, or to 0, may count on either side


def check_configuration(path: Any, joints: Floats, block: Any, branch: int) -> None:
    """Refuse a move whose branch, quarters or signs are not those of the motion at its end."""
    if path.configuration.shape[1] == 0:
        return
    least, most = _near_ends(joints, block, path.radii)
    low = _configured(path.target, least - _ROUNDING, branch)
    high = _configured(path.target, most + _ROUNDING, branch)
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


def _near_ends(joints: Floats, block: Any, radii: Floats) -> tuple[Floats, Floats]:
    """Extremes of the joints (moves, n) near the end of each move: between two samples, or in its blend."""
    ends = np.searchsorted(block, np.arange(len(radii)), side="right") - 1
    first = np.maximum(ends - np.ceil(2.0 * radii / STEP).astype(int), 0)
    near = [joints[a : b + 2] for a, b in zip(first, ends, strict=True)]
    return np.array([each.min(axis=0) for each in near]), np.array([each.max(axis=0) for each in near])


def _configured(target: str, joints: Floats, branch: int) -> Floats:
    """Quarters of a turn and number of the branch; or status and turn."""
    shoulder, wrist, elbow = (branch >> 2) & 1, (branch >> 1) & 1, branch & 1
    if target == "rapid":
        number = np.full(len(joints), 4 * shoulder + 2 * elbow + wrist)
        return np.column_stack([joints[:, [0, 3, 5]] // (np.pi / 2), number])
    signs = (joints[:, :_JOINTS] < 0.0) @ (1 << np.arange(_JOINTS))
    return np.column_stack([np.full(len(joints), shoulder | (elbow << 1)), signs])
