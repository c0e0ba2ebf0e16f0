"""How noise of the readings moves a roundness: it is a linear function of few of them."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats


def value_spread(kind: str, points: Floats, center: Floats, contacts: Any, outer: Any) -> float:
    """Standard deviation of RONt over that of one reading, to first order, for the contacts as they are.

    A change e of the readings moves a circle so that u.dc + dR = e at each of its contacts (in the mean of all points for LSC).
    """
    away = points - center
    distance = np.sqrt(np.sum(away**2, axis=1))
    peak, valley = int(np.argmax(distance)), int(np.argmin(distance))
    row = np.column_stack([away / distance[:, np.newaxis], np.ones(len(points))])
    if kind == "LSC":
        across = row[peak] - row[valley]
        return float(np.sqrt(max(2.0 - across @ np.linalg.solve(row.T @ row, across), 0.0)))
    if kind == "MZC":
        return float(np.linalg.norm(_zone_weights(row[contacts, :2], np.asarray(outer))))
    other = valley if kind == "MCC" else peak
    if other in contacts:
        return 0.0
    return float(np.hypot(1.0, np.linalg.norm(row[other] @ np.linalg.pinv(row[contacts]))))


def _zone_weights(direction: Floats, outer: Any) -> Floats:
    """What a change of the reading at each contact adds to the width of the zone."""
    equations = np.column_stack([direction, outer, ~outer]).astype(float)  # dc, change of the outer and of the inner radius
    inverse = np.linalg.pinv(equations)
    return np.asarray(inverse[2] - inverse[3])
