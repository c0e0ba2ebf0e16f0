"""Fastest two settings of a cycle of three stages, by simulation of the controller."""

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from sdpgrind.plunge._control.state import staged_law
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plant import part_kernels as kernels
from sdpgrind.plunge._plant.simulation import simulated_part

_GRID = 12  # chosen: rates before the search between the neighbours of the best


def fastest_stages(problem: CycleProblem, margin: float) -> tuple[float, float]:
    """Switching stock (mm) and stage rate (mm/s) of the fastest cycle with a slack of `margin` (mm).

    For each rate the switch is a root of the slack; the rate is then one minimum.
    """
    high = min((1.0 + problem.model.wheel_wear) * problem.model.burn_rate, problem.command_rate_max)
    low = min(1.5 * problem.final_rate, 0.5 * high)
    rates = np.geomspace(low, high, _GRID)
    times = [_time(problem, rate, margin) for rate in rates]
    k = int(np.argmin(times))
    ends = rates[max(k - 1, 0)], rates[min(k + 1, _GRID - 1)]
    best = minimize_scalar(
        lambda rate: _time(problem, rate, margin),
        bounds=ends,
        method="bounded",
        options={"xatol": 1e-4 * high},
    )
    rate = float(best.x) if best.fun <= times[k] else float(rates[k])
    return _begin(problem, rate, margin), rate


def _time(problem: CycleProblem, rate: float, margin: float) -> float:
    return _ground(problem, _begin(problem, rate, margin), rate)[0]


def _begin(problem: CycleProblem, rate: float, margin: float) -> float:
    """Least stock at which the stage rate may begin."""

    def slack(remaining: float) -> float:
        return _ground(problem, remaining, rate)[1] - margin

    if slack(0.0) >= 0:
        return 0.0
    if slack(problem.stock) < 0:
        return problem.stock
    root = float(brentq(slack, 0.0, problem.stock, xtol=1e-6))
    return min(root + 2e-6, problem.stock)


def _ground(problem: CycleProblem, remaining: float, rate: float) -> tuple[float, float]:
    """Time (s) to the instant of size and slack (mm) of a part without noise."""
    state, _ = simulated_part(problem, staged_law(problem, remaining, rate))
    over = -state[kernels.REMAINING] / max(state[kernels.RATE], 1e-9)
    time, slack = state[kernels.SAMPLES] * problem.sample_time - over, state[kernels.PART_SLACK]
    return float(time), float(slack if np.isfinite(slack) else problem.stock)
