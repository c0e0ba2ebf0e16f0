"""Expected penalty of the whole bead, planned again at both ends of each interval."""

import warnings
from collections.abc import Sequence
from functools import reduce
from typing import Any

from sdpgrind import sdp
from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes, together
from sdpgrind.base.progress import silent
from sdpgrind.weldbead.sequence._as_sdp import sdp_problem
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem

# measured: 0.2 s of CPU a plan; on P1 with a scatter of 0.023 to 0.15 within 9e-5 $ of the default tolerance,
# where 101 nodes are 1.6e-3 $ off, most of the penalty of a small scatter
_NODES = 401
_OF_THE_PLAN = ("specific_energy", "idle_power", "friction_ratio")


def of_plan(
    problem: SequenceProblem, rows: Sequence[Doubt], taken: Sequence[Any]
) -> tuple[Figure, tuple[Stake, ...]]:
    """Return the expected penalty as believed, $, at the ends of each interval, and with all estimates."""
    changes: list[float] = []
    name = f"expected penalty of a bead of {problem.height_max:g} mm in {problem.horizon:g} s"
    figure = Figure(name, "$", _penalty(problem, changes))
    found = stakes(rows, figure, lambda name, value: _with(problem, name, value, changes))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = together(
            found, lambda: _penalty(_updated(problem, taken), changes), _attributed(problem, taken)
        )
    solved = f"{_NODES} nodes; from half of them the plans below change by at most {max(changes):.1g} $"
    return figure._replace(solved=solved), found


def _updated(problem: SequenceProblem, taken: Sequence[Any]) -> SequenceProblem:
    """Problem with all estimates taken over."""
    return reduce(SequenceProblem.updated, taken, problem)


def _attributed(problem: SequenceProblem, taken: Sequence[Any]) -> str:
    """Words on the coefficient that scatters where it is another than believed."""
    told = [each.favoured for each in taken if hasattr(each, "favoured")]
    return "".join(f"where {each} scatters" for each in told if each != problem.scatter.attribution)


def _with(problem: SequenceProblem, name: str, value: float, changes: list[float]) -> float | None:
    """Penalty with another value, $; None: it does not depend on it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if name == "relative_sd":
            scatter = problem.scatter.replace(relative_sd=max(value, 0.0))
            return _penalty(problem.replace(scatter=scatter), changes)
        return _penalty(problem.replace(**{name: value}), changes) if name in _OF_THE_PLAN else None


def _penalty(problem: SequenceProblem, changes: list[float]) -> float:
    """Penalty of the bead, $; its change from half the nodes, an estimate of its error, joins `changes`."""
    tables = (sdp.plan(sdp_problem(problem, nodes), progress=silent) for nodes in (_NODES // 2 + 1, _NODES))
    coarse, fine = (
        float(SequencePolicy(problem, table).value(height=problem.height_max, time_left=problem.horizon))
        for table in tables
    )
    changes.append(abs(fine - coarse))
    return fine
