"""Linear feedback of the largest bandwidth: convex design over the stabilising laws of a stable plant."""

import importlib
import warnings
from math import pi
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.control._margins import HALF_POWER
from sdpgrind.control._sampled import Sampled

_GRID = 220  # chosen: fewer frequencies violate the limits between them, more cost solver time
_SLACK = 5e-4  # chosen: relative tightening of the limits on the grid, so that they hold between its points


@described()
class QLimits(Described):
    """Constraints of a feedback design.

    Parameters
    ----------
    sensitivity_max : float
        Ms, largest abs(S), unit 1; 2 implies a gain margin of 6 dB and a phase margin of 29 degrees.
    complementary_max : float
        Mt, largest abs(T), unit 1.
    frequency : array
        Angular frequencies at which abs(C S) is limited, rad/s.
    weight : array
        Weights on abs(C S) there, in units of output over command.
    weighted_max : float
        Limit of the weighted abs(C S), unit 1.

    Examples
    --------
    >>> QLimits(sensitivity_max=1.8).complementary_max
    1.5
    """

    sensitivity_max: float = quantity("1", above=1, default=2.0)
    complementary_max: float = quantity("1", above=1, default=1.5)
    frequency: tuple[float, ...] = custom(unit="rad/s", default=())
    weight: tuple[float, ...] = custom(default=())
    weighted_max: float = quantity("1", above=0, default=np.inf)

    def _check(self) -> None:
        if len(self.frequency) != len(self.weight):
            raise checks.refuse("weight", f"as long as frequency ({len(self.frequency)})", len(self.weight))


def q_design(
    plant: Sampled, limits: QLimits | None = None, *, taps: int = 40, tolerance: float = 2e-3
) -> tuple[Sampled, float]:
    """Return the filter Q of the largest bandwidth, and that bandwidth, by a search over convex problems.

    T = P Q, S = 1 - P Q, C = Q/(1 - P Q); Q has `taps` coefficients whose sum is 1/P(1). The bandwidth is the
    largest f with abs(S(v)) <= 0.7071 v/f for all v <= f. cvxpy states the problems, Clarabel solves them.

    Parameters
    ----------
    plant : Sampled
        Stable plant with all delays.
    limits : QLimits, optional
        Constraints. Default: ``QLimits()``.
    taps : int
        Number of coefficients, a whole number; the bandwidth grows with it to a limit.
    tolerance : float
        Relative width of the bandwidth at which the search stops, dimensionless.

    Returns
    -------
    filter : Sampled
        Q, in units of command over output.
    bandwidth : float
        rad/s, on the grid of the design; judge the result with `loop_margins`.

    Raises
    ------
    ValueError
        When the plant is not stable, or no bandwidth is feasible.

    Examples
    --------
    >>> delay = Sampled([[0.0]], [1.0], [1.0], 0.0, 1.0)  # P = 1/z
    >>> filter, bandwidth = q_design(delay, taps=10)
    >>> bool(0.3 < bandwidth < 1.0)
    True
    """
    if not plant.stable:
        raise checks.refuse(
            "plant", "stable (poles inside the unit circle)", float(np.max(np.abs(plant.poles)))
        )
    limits = QLimits() if limits is None else limits
    gain = plant.dc_gain
    problem = _Problem(plant.scaled(1 / gain), limits, gain, checks.count("taps", taps, at_least=2))
    with one_blas_thread():
        low = _largest(problem, 0.04 * pi / plant.sample_time, tolerance)
    return _finite(problem.coefficients / gain, plant.sample_time), low


def _largest(problem: "_Problem", start: float, tolerance: float) -> float:
    """Largest feasible bandwidth, rad/s; `problem` keeps its coefficients.

    The more points of the grid are held below the slope, the less bandwidth is left by them. Hence what `k`
    points leave is feasible where it reaches past the point before them, and a limit for more points; where
    it does not, fewer points reach as far at least.
    """
    grid = np.append(0.0, problem.frequency)  # of k points the last one, from 1 on
    least, most, known, low = 0, grid.size, 1, 0.0  # points: feasible, infeasible, feasible but not solved
    k = int(np.searchsorted(grid[:-1], start))
    while k < most and grid[most - 1] > (1 + tolerance) * low:
        left = problem.bandwidth_left(k)
        reached = int(np.searchsorted(grid, left))
        if left > grid[k - 1]:
            least, most, low = k, min(most, reached + 1), min(left, float(grid[k]))
            problem.keep()
        else:
            most, known = k, max(known, reached)
        k = (max(known, least + 1) + most) // 2
    if low == 0.0:
        raise ValueError(f"limits leave no filter at all: bandwidth {grid[1]:.3g} rad/s cannot be reached")
    return low


class _Problem:
    """Convex problem with the points held below the slope as parameter: least factor on it."""

    def __init__(self, plant: Sampled, limits: QLimits, gain: float, taps: int) -> None:
        cp: Any = importlib.import_module("cvxpy")  # 1 s to import, needed nowhere else
        self.frequency = _frequencies(plant.sample_time)
        self._q, self._factor = cp.Variable(taps), cp.Variable()
        self._slope = cp.Parameter(len(self.frequency), nonneg=True)
        tracking = _rows(self.frequency, plant.sample_time, taps) * plant.response(self.frequency)[:, None]
        # T as variables: dense rows in Q once, not for each limit; the solver takes half the time (measured)
        t = cp.Variable((2, len(tracking)))
        sensitivity = cp.norm(np.array([[1.0], [0.0]]) - t, axis=0)
        keep = [
            cp.sum(self._q) == 1,
            t == cp.vstack([tracking.real @ self._q, tracking.imag @ self._q]),
            sensitivity <= limits.sensitivity_max * (1 - _SLACK),
            cp.norm(t, axis=0) <= limits.complementary_max * (1 - _SLACK),
            sensitivity <= self._slope * self._factor,
        ]
        if limits.frequency and np.isfinite(limits.weighted_max):
            w = np.asarray(limits.frequency)
            rows = _rows(w, plant.sample_time, taps) * (np.asarray(limits.weight) / abs(gain))[:, None]
            size = cp.norm(cp.vstack([rows.real @ self._q, rows.imag @ self._q]), axis=0)
            keep.append(size <= limits.weighted_max * (1 - _SLACK))
        self._problem = cp.Problem(cp.Minimize(self._factor), keep)

    def bandwidth_left(self, points: int) -> float:
        """Bandwidth (rad/s) that is left where abs(S) is below the slope at the first points; 0: none."""
        last = self.frequency[points - 1]
        slope = HALF_POWER * self.frequency / last
        self._slope.value = np.where(self.frequency <= last, slope, 1e2)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # near the edge of what is feasible; the factor below decides
            self._problem.solve(solver="CLARABEL")
        if self._problem.status not in ("optimal", "optimal_inaccurate"):
            return 0.0
        return float(last * (1 - _SLACK / 2) / self._factor.value)

    def keep(self) -> None:
        """Keep the coefficients found last."""
        self.coefficients: Floats = np.array(self._q.value)


def _frequencies(sample_time: float) -> Floats:
    top = pi / sample_time
    return np.concatenate(
        [np.geomspace(1e-4 * top, 0.03 * top, 25, endpoint=False), np.linspace(0.03 * top, top, _GRID - 25)]
    )


def _rows(frequency: Floats, sample_time: float, taps: int) -> npt.NDArray[np.complex128]:
    return np.asarray(np.exp(-1j * np.outer(frequency * sample_time, np.arange(taps))))


def _finite(coefficients: Floats, sample_time: float) -> Sampled:
    """Filter with a finite impulse response."""
    order = len(coefficients) - 1
    return Sampled(
        np.eye(order, k=-1), np.eye(order)[0], coefficients[1:], float(coefficients[0]), sample_time
    )
