"""Least time of a cycle of three stages within bounds: sequential quadratic programs, or IPOPT."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.sparse

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._stages.program import FREE, SETTINGS, StageProgram, program

if TYPE_CHECKING:
    import cvxpy

SOLVED = "solved"
# chosen: greatest number of steps, greatest scaled step, step of convergence
_STEPS, _FARTHEST, _SMALL = 30, 0.5, 1e-5
_CONVEX = 0.1  # chosen: least curvature over the greatest, or over 1; less takes long steps on flat time
_OSQP = {
    "verbose": False,
    "eps_abs": 1e-6,
    "eps_rel": 1e-6,
    "max_iter": 10_000,
    "polishing": True,
    "adaptive_rho_interval": 25,
}


class Optimum(NamedTuple):
    """Settings, time (s), bounded quantities, message of the solver, its steps, first program."""

    settings: dict[str, float]
    time: float
    reached: dict[str, float]
    message: str
    steps: int
    first: "QuadraticProgram | None"


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """min slope d + |root d|^2/2 with slopes d <= room, low <= d <= high; d: scaled step of the settings."""

    root: Floats
    slope: Floats
    slopes: Floats
    room: Floats
    low: Floats
    high: Floats

    def solved(self) -> tuple[Floats, Floats, str]:
        """Step, prices and message of OSQP, set up anew: no bit depends on earlier programs."""
        import osqp

        used, count = np.isfinite(self.room), self.slope.size
        solver = osqp.OSQP(algebra="builtin")
        solver.setup(
            P=scipy.sparse.csc_matrix(np.triu(self.root.T @ self.root)), q=self.slope,
            A=scipy.sparse.csc_matrix(np.vstack([self.slopes[used], np.eye(count)])),
            l=np.concatenate([np.full(used.sum(), -np.inf), self.low]),
            u=np.concatenate([self.room[used], self.high]), **_OSQP,
        )  # fmt: skip
        result = solver.solve(raise_error=False)
        prices = np.zeros(used.size)
        if result.info.status_val != 1:
            return np.zeros(count), prices, f"OSQP says {result.info.status}"
        prices[used] = result.y[: used.sum()]
        return np.clip(result.x, self.low, self.high), prices, SOLVED

    def statement(self) -> "cvxpy.Problem":
        """Return the program in cvxpy, with its values as named parameters."""
        used = np.isfinite(self.room)
        stated = stated_in_cvxpy(int(used.sum()))
        named: Any = stated.param_dict
        named["slopes"].value, named["room"].value = self.slopes[used], self.room[used]
        for name in ("root", "slope", "low", "high"):
            named[name].value = getattr(self, name)
        return stated


@lru_cache(maxsize=8)
def stated_in_cvxpy(rows: int) -> "cvxpy.Problem":
    """Program with parameters (disciplined: compiled once for all values)."""
    import cvxpy

    cp: Any = cvxpy  # its functions have no types
    step = cp.Variable(FREE, name="step")
    root, slopes = cp.Parameter((FREE, FREE), name="root"), cp.Parameter((rows, FREE), name="slopes")
    slope, room = cp.Parameter(FREE, name="slope"), cp.Parameter(rows, name="room")
    low, high = cp.Parameter(FREE, name="low"), cp.Parameter(FREE, name="high")
    time = slope @ step + 0.5 * cp.sum_squares(root @ step)
    stated: cvxpy.Problem = cp.Problem(cp.Minimize(time), [slopes @ step <= room, low <= step, step <= high])
    return stated


def optimum(
    problem: CycleProblem,
    settings: Mapping[str, float],
    *,
    bounds: Mapping[str, float],
    moving: Collection[str],
    method: str = "qp",
) -> Optimum:
    """Least time within bounds, starting from settings; those not in `moving` stay.

    IPOPT solves it where the quadratic programs fail; where it fails too, the settings stay.
    """
    task = StageTask(program(problem), settings, bounds, tuple(moving))
    found = task.by_quadratic_programs() if method == "qp" else task.by_ipopt()
    if found[1] != SOLVED and method == "qp":
        found = task.by_ipopt()
    x, message, steps = found
    x = x if message == SOLVED else task.start
    time, reached = task.program.reached(x)
    found_at = task.program.settings(x)
    kept = {name: found_at[name] if name in task.moving else settings[name] for name in SETTINGS}
    return Optimum(kept if message == SOLVED else dict(settings), time, reached, message, steps, task.first)


class StageTask:
    """Program with bounds and initial settings."""

    def __init__(
        self,
        program: StageProgram,
        settings: Mapping[str, float],
        bounds: Mapping[str, float],
        moving: tuple[str, ...],
    ) -> None:
        self.program, self.ceilings = program, program.ceilings(bounds)
        self.start = program.at(settings)
        self.low, self.high = (edge.copy() for edge in program.box)
        self.moving = moving
        still = [k for k, name in enumerate(SETTINGS) if name not in moving]
        self.low[still] = self.high[still] = self.start[still]
        self.first: QuadraticProgram | None = None

    def by_quadratic_programs(self) -> tuple[Floats, str, int]:
        """Unknowns, message and number of steps, until the steps are small."""
        x, prices = self.start, np.zeros(self.ceilings.size)
        for k in range(_STEPS):
            about = ReducedProgram(self, x, prices)
            self.first = self.first or about.program
            step, priced, message = about.program.solved()
            if message != SOLVED:
                return x, message, k + 1
            whole = about.own + about.along @ step
            x, prices = np.clip(x + whole, self.low, self.high), about.prices(priced)
            if np.max(np.abs(whole)) <= _SMALL:
                return x, SOLVED, k + 1
        return x, f"{_STEPS} steps were not enough", _STEPS

    def by_ipopt(self) -> tuple[Floats, str, int]:
        """Unknowns, message and iterations of the nonlinear program."""
        least = np.full(self.ceilings.size, -np.inf)
        least[:2] = 0.0
        solver = _ipopt(self.program)
        start = np.clip(self.start, self.low, self.high)
        found = solver(x0=start, lbx=self.low, ubx=self.high, lbg=least, ubg=self.ceilings)
        stats = solver.stats()
        x = np.clip(np.asarray(found["x"]).ravel(), self.low, self.high)
        return (
            x,
            SOLVED if stats["success"] else f"IPOPT says {stats['return_status']}",
            int(stats["iter_count"]),
        )


class ReducedProgram:
    """Quadratic program of a task about given unknowns; the first two conditions eliminate s1 and s2.

    A step d of the settings is the step own + along d of all unknowns.
    """

    def __init__(self, task: StageTask, x: Floats, prices: Floats) -> None:
        slope, conditions, slopes, curvature = (
            np.asarray(each) for each in task.program.derivatives(x, prices)
        )
        conditions, self._slope, self._slopes = conditions.ravel(), slope.ravel(), slopes
        follow = np.linalg.solve(slopes[:2, FREE:], -np.column_stack([conditions[:2], slopes[:2, :FREE]]))
        self.own = np.concatenate([np.zeros(FREE), follow[:, 0]])
        self.along = np.vstack([np.eye(FREE), follow[:, 1:]])
        spans = (x + self.own)[FREE:]
        rows = np.vstack([slopes[2:] @ self.along, self.along[FREE:], -self.along[FREE:]])
        reached = np.concatenate([conditions[2:] + slopes[2:] @ self.own, spans, -spans])
        most = np.concatenate([task.ceilings[2:], task.high[FREE:], -task.low[FREE:]])
        low, high = (np.clip(edge - x, -_FARTHEST, _FARTHEST)[:FREE] for edge in (task.low, task.high))
        reduced = self.along.T @ (self._slope + curvature @ self.own)
        root = _convex(self.along.T @ curvature @ self.along)
        self.program = QuadraticProgram(root, reduced, rows, most - reached, low, high)

    def prices(self, priced: Floats) -> Floats:
        """Prices of all conditions from those of the program; the first two balance s1 and s2."""
        own, spans = priced[:-4], priced[-4:-2] - priced[-2:]
        rest = self._slope[FREE:] + self._slopes[2:, FREE:].T @ own + spans
        return np.concatenate([np.linalg.solve(self._slopes[:2, FREE:].T, -rest), own])


@lru_cache(maxsize=16)
def _ipopt(program: StageProgram) -> Any:
    import casadi

    x, time, conditions = program.symbols
    ipopt = {"print_level": 0, "sb": "yes", "tol": 1e-9, "max_iter": 200, "bound_relax_factor": 1e-10}
    # no_nlp_grad: how the optimum depends on data is not asked
    options: dict[str, Any] = {"print_time": False, "no_nlp_grad": True, "ipopt": ipopt}
    return casadi.nlpsol("stages", "ipopt", {"x": x, "f": time, "g": conditions}, options)


def _convex(curvature: Floats) -> Floats:
    """Root of the curvature, with eigenvalues raised until it is convex."""
    values, vectors = np.linalg.eigh(curvature)
    least = _CONVEX * max(1.0, float(np.max(np.abs(values))))
    return np.asarray(np.sqrt(np.maximum(values, least))[:, None] * vectors.T)
