"""Plans of beads whose coefficients are known, with the weights of such beads."""

from functools import cache, partial
from itertools import product

import numpy as np

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._as_sdp import sdp_problem
from sdpgrind.weldbead.sequence._coefficient_scatter import COEFFICIENTS
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem

POINTS = 3  # chosen: points for each coefficient; five change the figures of the 15 % job by 0.3 % or less
# chosen: nodes and levels of each plan; the mean of the 27 errs by less than 1e-4 $
NODES, LEVELS = 201, 101


def known_beads(policy: SequencePolicy) -> list[tuple[float, SequencePolicy | None]]:
    """Return weights, and plans of beads at the points of Gauss's rule for the problem's `bead_scatter`.

    None: no admissible force removes such a bead.
    """
    planned = cache(partial(_planned, policy.problem))  # beads are equal where a coefficient has no scatter
    return [(weight, planned(*told)) for weight, told in _beads(policy.problem)]


def _planned(problem: SequenceProblem, *coefficients: float) -> SequencePolicy | None:
    """Plan of a bead with known coefficients (J/mm^3, W, 1) and the scatter of passes."""
    told = dict(zip(COEFFICIENTS, coefficients, strict=True))
    passes = problem.scatter.replace(mean="coefficient")
    try:
        bead = problem.replace(scatter=passes, bead_scatter=None, **told)
    except ValueError:
        return None
    return SequencePolicy(bead, sdp.plan(sdp_problem(bead, NODES, levels=LEVELS)))


def _beads(problem: SequenceProblem) -> list[tuple[float, list[float]]]:
    """Weights, and coefficients of one bead (J/mm^3, W, 1)."""
    assert problem.bead_scatter is not None
    covariance = problem.bead_scatter.log_covariance
    value, vector = np.linalg.eigh(covariance)
    root = vector * np.sqrt(np.maximum(value, 0.0))
    found = []
    for weight, normal in _points():
        factors = np.exp(root @ normal - 0.5 * np.diag(covariance)).tolist()
        told = [f * getattr(problem.model, n) for n, f in zip(COEFFICIENTS, factors, strict=True)]
        found.append((weight, told))
    return found


def _points() -> list[tuple[float, Floats]]:
    """Gauss's rule of three independent normal variables: weights and points."""
    points, weights = np.polynomial.hermite_e.hermegauss(POINTS)
    weights = weights / weights.sum()
    each = range(POINTS)
    return [(float(np.prod(weights[list(k)])), points[list(k)]) for k in product(each, each, each)]
