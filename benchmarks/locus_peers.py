"""Solvers that find the best point for one hidden state after the other, each warm from the point before."""

import contextlib
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import casadi as ca
import cvxpy as cp
import numpy as np
from scipy import optimize

from sdpgrind import locus
from sdpgrind.base.compiling.compiled import opened
from sdpgrind.locus._problem.tape_kernels import work_size
from sdpgrind.locus._trace.kkt_kernels import _evaluate, _sizes

evaluate = opened(_evaluate)
sizes = opened(_sizes)

TIGHT, SETTLED = 1e-6, 1e-10  # of the scaled problem: a limit that is tight, conditions that hold
MOST_STEPS, MOST_ROUNDS = 10, 50  # of a batched Newton's method


class Scaled:
    """A problem with one hidden state in the scaled form that our tracer uses: peers have the same scales and
    exact slopes.
    """

    def __init__(self, problem: locus.Problem, curve: locus.Locus) -> None:
        self.system = problem.system
        points = np.concatenate([piece.table.points for piece in curve.best])
        self.wanted, self.places = points[:, : self.system.n], points[:, -1]

    def error(self, found: np.ndarray) -> float:
        """Largest distance from our points, as part of a control's range."""
        return float(np.max(np.abs(found - self.wanted)))


def slsqp(scaled: Scaled) -> Callable[[], np.ndarray]:
    """SLSQP of scipy: values and exact gradients from one compiled call."""
    system, kkt = scaled.system, scaled.system.kkt_tape
    n, m = system.n, system.m
    f, point = 1 + m, np.zeros(n + m + 2)
    d, work, hidden = np.empty(sizes(n, m, 1)), np.empty(work_size(kkt)), np.zeros(1)

    def at(q: np.ndarray) -> np.ndarray:
        if not np.array_equal(point[:n], q):
            point[:n] = q
            evaluate(kkt, n, 1, point, hidden, 0, work, d)
        return d

    def cost(q: np.ndarray) -> tuple[float, np.ndarray]:
        found = at(q)
        return found[0], found[f : f + n].copy()

    slack = {
        "type": "ineq",
        "fun": lambda q: -at(q)[1:f],
        "jac": lambda q: -at(q)[f + n : f + n * f].reshape(m, n),
    }

    def sweep() -> np.ndarray:
        found, q = np.empty_like(scaled.wanted), scaled.wanted[0].copy()
        for k, place in enumerate(scaled.places):
            point[:], point[-1] = np.nan, place
            q = optimize.minimize(
                cost,
                q,
                jac=True,
                bounds=[(0.0, 1.0)] * n,
                constraints=slack,
                method="SLSQP",
                options={"ftol": 1e-12},
            ).x
            found[k] = q
        return found

    return sweep


def _expressions(scaled: Scaled) -> dict:
    system = scaled.system
    q, p = ca.SX.sym("q", system.n), ca.SX.sym("p")
    y = ca.vertcat(q, p)
    values = [
        low * ca.exp(y[k] * np.log(high / low)) if log else low + y[k] * (high - low)
        for k, (low, high, log) in enumerate(zip(system.low, system.high, system.logarithmic, strict=True))
    ]
    found = system.function(ca.vertcat(*values[: system.n]), values[-1])
    m = system.m
    slack = (found[1 : 1 + m] - found[1 + m :]) / ca.DM(system.scales)
    return {"x": q, "p": p, "f": found[0] / system.cost_scale, "g": slack}


def ipopt(scaled: Scaled) -> Callable[[], np.ndarray]:
    """IPOPT through casadi.nlpsol, started at the last point with its multipliers."""
    options = {
        "print_time": False,
        "ipopt": {
            "print_level": 0, "sb": "yes", "tol": 1e-9, "warm_start_init_point": "yes", "mu_init": 1e-6,
            "warm_start_bound_push": 1e-9, "warm_start_mult_bound_push": 1e-9, "warm_start_slack_bound_push": 1e-9,
            "warm_start_bound_frac": 1e-9, "warm_start_slack_bound_frac": 1e-9, "bound_relax_factor": 0.0,
        },
    }  # fmt: skip
    return _sweep(scaled, ca.nlpsol("solver", "ipopt", _expressions(scaled), options))


def sqpmethod(scaled: Scaled) -> Callable[[], np.ndarray]:
    """SQP method of CasADi with qrqp, started at the last point with its multipliers."""
    options = {
        "print_time": False, "print_header": False, "print_iteration": False, "print_status": False, "qpsol": "qrqp",
        "tol_du": 1e-9, "tol_pr": 1e-9, "qpsol_options": {"print_iter": False, "print_header": False, "print_info": False},
    }  # fmt: skip
    return _sweep(scaled, ca.nlpsol("solver", "sqpmethod", _expressions(scaled), options))


def _sweep(scaled: Scaled, solver: ca.Function) -> Callable[[], np.ndarray]:
    n, m = scaled.system.n, scaled.system.m

    def sweep() -> np.ndarray:
        found, q, by_bound, by_limit = (
            np.empty_like(scaled.wanted),
            scaled.wanted[0],
            np.zeros(n),
            np.zeros(m),
        )
        for k, place in enumerate(scaled.places):
            best = solver(
                x0=q, p=place, lbx=0.0, ubx=1.0, lbg=-np.inf, ubg=0.0, lam_x0=by_bound, lam_g0=by_limit
            )
            q, by_bound, by_limit = best["x"], best["lam_x"], best["lam_g"]
            found[k] = np.asarray(q).ravel()
        return found

    return sweep


def cvxpy(scaled: Scaled, solver: str) -> Callable[[], np.ndarray]:
    """Koren's example, which is convex, with the hidden state as a parameter: compiled once (DPP)."""
    system = scaled.system
    u, v, x = cp.Variable(), cp.Variable(), cp.Parameter(nonneg=True)
    problem = cp.Problem(
        cp.Minimize(cp.square(u - 1) + cp.square(v - 4)),
        [x * v - u - 1 <= 0, u >= 0, u <= 5, v >= 0, v <= 10],
    )
    tight = {"eps_abs": 1e-8, "eps_rel": 1e-8} if solver == "OSQP" else {}

    def sweep() -> np.ndarray:
        found = np.empty_like(scaled.wanted)
        for k, value in enumerate(system.unscaled(scaled.places[:, None], system.n)[:, 0]):
            x.value = value
            problem.solve(solver=solver, warm_start=True, **tight)
            found[k] = u.value, v.value
        return system.scaled(found)

    return sweep


def batched_newton(scaled: Scaled) -> Callable[[], np.ndarray]:
    """Newton's method for all hidden states at once, by `casadi.Function.map`: the strongest simple rival.

    The conditions of the best point are equations once min(multiplier, slack) = 0 stands for each limit and a
    projection for the bounds. All begin at our first point; those that do not settle, again at the nearest
    that did.
    """
    n, count = scaled.system.n, scaled.places.size
    step, first, places = _newton_step(scaled).map(count), scaled.wanted[0], scaled.places[None]
    begin = np.concatenate([first, _multipliers(scaled, first)])[:, None]

    def sweep() -> np.ndarray:
        z = np.repeat(begin, count, axis=1)
        for _ in range(MOST_ROUNDS):
            z, settled = _settled(step, z, places)
            good = np.flatnonzero(settled)
            if good.size in (0, count):
                break
            z = z[:, good[np.abs(good[:, None] - np.arange(count)).argmin(axis=0)]]
        return z[:n].T

    return sweep


def _newton_step(scaled: Scaled) -> ca.Function:
    """One step from (controls, multipliers) at a hidden state, and how far off the conditions were."""
    said, n = _expressions(scaled), scaled.system.n
    q, p, f, g = said["x"], said["p"], said["f"], said["g"]
    multiplier = ca.SX.sym("multiplier", scaled.system.m)
    z = ca.vertcat(q, multiplier)
    downhill = q - ca.gradient(f + ca.dot(multiplier, g), q)
    off = ca.vertcat(q - ca.fmin(ca.fmax(downhill, 0.0), 1.0), ca.fmin(multiplier, -g))
    new = z - ca.solve(ca.jacobian(off, z), off)
    inside = ca.vertcat(ca.fmin(ca.fmax(new[:n], 0.0), 1.0), new[n:])
    return ca.Function("step", [z, p], [inside, ca.norm_inf(off)], {"cse": True})


def _multipliers(scaled: Scaled, q: np.ndarray) -> np.ndarray:
    """Of the limits at our first point, by least squares over the controls that are not at a bound."""
    said, out = _expressions(scaled), np.zeros(scaled.system.m)
    about = [ca.gradient(said["f"], said["x"]), ca.jacobian(said["g"], said["x"]), said["g"]]
    function = ca.Function("about", [said["x"], said["p"]], about)
    slope, slopes, slack = (np.asarray(v) for v in function(q, scaled.places[0]))
    tight, free = slack[:, 0] > -TIGHT, (q > TIGHT) & (q < 1 - TIGHT)
    out[tight] = np.linalg.lstsq(slopes[np.ix_(tight, free)].T, -slope[free, 0], rcond=None)[0]
    return out


def _settled(step: ca.Function, z: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All after at most so many steps, and which of them have settled."""
    for _ in range(MOST_STEPS):
        z, off = (np.asarray(v) for v in step(z, places))
        settled = np.isfinite(z).all(axis=0) & (off[0] < SETTLED)
        if settled.all():
            break
    return z, settled


def peers(scaled: Scaled, convex: bool) -> Iterator[tuple[str, Callable[[], np.ndarray]]]:
    """Name and sweep of each that can solve the problem."""
    yield "scipy SLSQP, warm", slsqp(scaled)
    yield "IPOPT (casadi), warm", ipopt(scaled)
    yield "sqpmethod (casadi), warm", sqpmethod(scaled)
    if convex:
        for solver in ("OSQP", "CLARABEL"):
            yield f"cvxpy, {solver}", cvxpy(scaled, solver)


@contextlib.contextmanager
def silence() -> Iterator[None]:
    """Keep what solvers print, from Python or not, off the table."""
    kept = os.dup(1)
    with Path(os.devnull).open("w") as nothing, contextlib.redirect_stdout(io.StringIO()):
        os.dup2(nothing.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)
