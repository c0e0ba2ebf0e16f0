"""A pass as a quadratic program: the cut nearest to the target under limited removal rate and slope of depth.

It leaves out the dynamics of the disc: a bound and a start in a millisecond, for many depths and feeds.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.passes._contour import Contour
from sdpgrind.weldbead.passes._problem import PassProblem

if TYPE_CHECKING:
    import cvxpy

SPACING = 0.5  # chosen: mm; distance of the nodes
_SETTINGS = {"verbose": False, "eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 20_000, "polishing": True}


@dataclass(frozen=True, eq=False)
class RelaxedPass:
    """Cut nearest to the target of a pass.

    Attributes
    ----------
    problem : PassProblem
        Problem with its mean cut (mm) and feed (mm/s).
    x, cut_depth : array
        Nodes along the bead and the depth there, mm.
    depth_max : float
        Greatest depth within the limits on force and power, Q_max/(w V), mm.
    shortfall : float
        Volume that the limits leave, mm^3.
    deviation : float
        Distance of the remaining contour from the target, mm rms.
    iterations : int
        Iterations of the solver, a whole number.
    """

    problem: PassProblem
    x: Floats
    cut_depth: Floats
    depth_max: float
    shortfall: float
    deviation: float
    iterations: int

    @property
    def contour(self) -> Contour:
        """Contour after the cut, mm."""
        return Contour(self.x, self.problem.bead.at(self.x) - self.cut_depth)

    @property
    def limited(self) -> float:
        """Share of the bead with the greatest depth, unit 1."""
        return float(np.mean(self.cut_depth > self.depth_max * (1 - 1e-6)))

    def plot(self) -> Any:
        """Draw bead, target and remaining contour (mm) over the depth; return the figure."""
        return pictures.drawn("sdpgrind.weldbead.passes._picture:plot_relaxed", self)


def relax(
    problem: PassProblem,
    *,
    slope_max: float | None = None,
    candidates: Iterable[tuple[float, float]] | None = None,
) -> list[RelaxedPass]:
    """Return the cuts nearest to the targets of a pass, for pairs of mean cut and feed.

    Each minimises the integral of (Z_i - d - Z_f)^2 over depths d(x) with 0 <= d <= Q_max/(w V), abs(d') <=
    slope_max and mean d = mean_cut, or the greatest mean within the limits.

    Parameters
    ----------
    problem : PassProblem
        Disc, bead and limits.
    slope_max : float, optional
        Greatest slope of the depth along the bead, mm/mm. Default: the slope of the relaxed disc,
        tan(theta0).
    candidates : iterable of (float, float), optional
        Mean cuts (mm) and feeds (mm/s). Default: those of the problem.

    Returns
    -------
    list of RelaxedPass
        One per candidate.

    Raises
    ------
    ValueError
        When a value is out of range, or the program is not solved.

    Examples
    --------
    >>> from sdpgrind import units, weldbead
    >>> from sdpgrind.weldbead import passes
    >>> process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> bead = passes.Contour([0, 75, 150], [1.0, 1.3, 1.0])
    >>> problem = passes.PassProblem(disc, bead, mean_cut=0.2, feed_rate=20.0)
    >>> slow, fast = passes.relax(problem, candidates=[(0.2, 10.0), (0.2, 40.0)])
    >>> slow.shortfall, round(fast.depth_max, 4), fast.shortfall > 0
    (0.0, 0.1855, True)
    """
    slope = (
        float(np.tan(problem.disc.relaxed_angle))
        if slope_max is None
        else checks.positive("slope_max", slope_max, "mm/mm")
    )
    pairs = [(problem.mean_cut, problem.feed_rate)] if candidates is None else list(candidates)
    program = _Program(problem, slope)
    return [program.solve(problem.replace(mean_cut=cut, feed_rate=feed)) for cut, feed in pairs]


def statement(problem: PassProblem, slope_max: float) -> tuple["cvxpy.Problem", "cvxpy.Variable"]:
    """Return the same program in cvxpy, and its variable: the depth at the nodes, mm."""
    import cvxpy

    cp: Any = cvxpy  # its functions have no types

    x, weight = _nodes(problem)
    most, mean = _limits(problem)
    depth = cp.Variable(x.size)
    wanted = problem.bead.at(x) - problem.target.at(x)
    constraints = [
        depth >= 0,
        depth <= most,
        cp.abs(cp.diff(depth)) <= slope_max * np.diff(x),
        weight @ depth == mean,
    ]
    return cp.Problem(cp.Minimize(weight @ cp.square(wanted - depth)), constraints), depth


def _nodes(problem: PassProblem) -> tuple[Floats, Floats]:
    """Return nodes along the bead, mm, and the weights of a mean by trapezoids."""
    x = np.linspace(problem.bead.x[0], problem.bead.x[-1], max(10, round(problem.bead.length / SPACING)) + 1)
    weight = np.full(x.size, 1.0 / (x.size - 1))
    weight[[0, -1]] /= 2
    return x, weight


def _limits(problem: PassProblem) -> tuple[float, float]:
    """Return the greatest depth at this feed and the attainable mean depth, mm."""
    most = float(problem.disc.model.mean_cut(problem.force_limit, problem.feed_rate))
    return most, min(problem.mean_cut, most)


class _Program:
    """OSQP set up once; candidates differ in target, greatest depth and mean."""

    def __init__(self, problem: PassProblem, slope: float) -> None:
        self.x, self.weight = _nodes(problem)
        n = self.x.size
        self.change = slope * np.diff(self.x)
        steps = scipy.sparse.diags_array([-np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1], shape=(n - 1, n))
        rows = [scipy.sparse.eye_array(n), steps, scipy.sparse.csr_array(self.weight[None] * n)]
        self.rows = scipy.sparse.csc_matrix(scipy.sparse.vstack(rows))
        self.hessian = scipy.sparse.csc_matrix(scipy.sparse.diags_array(self.weight * n))
        self.solver: Any = None

    def solve(self, problem: PassProblem) -> RelaxedPass:
        """Solve one candidate."""
        most, mean = _limits(problem)
        wanted = problem.bead.at(self.x) - problem.target.at(self.x)
        everywhere = np.full(self.x.size, most), 0  # there is nothing to choose
        depth, iterations = self._solved(wanted, most, mean) if mean < most else everywhere
        shortfall = (problem.mean_cut - mean) * problem.disc.model.bead_width * problem.bead.length
        deviation = float(np.sqrt(self.weight @ (wanted - depth) ** 2))
        return RelaxedPass(problem, self.x, depth, most, shortfall, deviation, iterations)

    def _solved(self, wanted: Floats, most: float, mean: float) -> tuple[Floats, int]:
        n = self.x.size
        bounds = {
            "q": -self.weight * n * wanted,
            "l": np.concatenate([np.zeros(n), -self.change, [mean * n]]),
            "u": np.concatenate([np.full(n, most), self.change, [mean * n]]),
        }
        if self.solver is None:
            import osqp

            self.solver = osqp.OSQP()
            self.solver.setup(P=self.hessian, A=self.rows, **bounds, **_SETTINGS)
        else:
            self.solver.update(**bounds)
        result = self.solver.solve(raise_error=False)
        if result.info.status_val != 1:
            raise ValueError(f"the program of a pass of {mean:g} mm was not solved: {result.info.status}")
        return np.clip(result.x, 0.0, most), int(result.info.iter)
