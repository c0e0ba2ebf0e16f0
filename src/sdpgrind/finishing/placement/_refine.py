"""Refinement of a placement by Nelder and Mead."""

import math

import numpy as np
from scipy.optimize import minimize

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.placement._grid import STEP, TURNS
from sdpgrind.finishing.placement._task import PlacingTask
from sdpgrind.finishing.placement._worth import PlacementRows, Rating, Sides, rated

EVALUATIONS = 150  # chosen: after them the worth of a placement grows by some 0.01 at most
MOVE = np.array([STEP / 2] * 3 + [math.pi / TURNS / 2] * 2)  # mm, rad: a quarter of the grid's step of turns


def refined(task: PlacingTask, row: PlacementRows, sides: Sides) -> tuple[PlacementRows, float]:
    """Return the placement (one row) of greatest worth near a given one, and its worth."""
    free = [k for k in range(5) if not (k < 2 and isinstance(task.robot, Arm))]
    if not task.turns_freely:
        free.remove(4)
    start = np.concatenate([row.origin[0], row.turn, row.azimuth])
    low, high = np.array([*sides, (-math.inf, math.inf), (-math.inf, math.inf)]).T

    def made(moved: Floats) -> PlacementRows:
        place = start.copy()
        place[free] += moved * MOVE[free]
        place = np.clip(place, low, high)
        return PlacementRows(place[None, :3], place[3:4], place[4:5])

    def rate(moved: Floats) -> Rating:
        return rated(task, made(moved), sides)

    simplex = np.vstack([np.zeros(len(free)), np.eye(len(free))])
    options = {"initial_simplex": simplex, "maxfev": EVALUATIONS, "xatol": 1e-2, "fatol": 1e-4}
    found = minimize(lambda moved: -rate(moved).worth[0], simplex[0], method="Nelder-Mead", options=options)
    best = rate(found.x)
    return made(found.x)._replace(origin=best.origin), float(best.worth[0])
