"""Expected penalty of the whole bead, planned again at both ends of each interval."""

import warnings
from collections.abc import Sequence

from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes
from sdpgrind.base.progress import silent
from sdpgrind.weldbead.sequence._plan import plan
from sdpgrind.weldbead.sequence._problem import SequenceProblem

_NODES = 101  # measured: 0.4 s a plan; the penalty is known to some 1 %, its changes better
_OF_THE_PLAN = ("specific_energy", "idle_power", "friction_ratio")


def of_plan(problem: SequenceProblem, rows: Sequence[Doubt]) -> tuple[Figure, tuple[Stake, ...]]:
    """Return the expected penalty as believed, $, and at the ends of each interval."""
    bead = f"a bead of {problem.height_max:g} mm in {problem.horizon:g} s"
    figure = Figure(
        f"expected penalty of {bead}", "$", _penalty(problem), f"{_NODES} nodes, known to some 1 %"
    )
    return figure, stakes(rows, figure, lambda name, value: _with(problem, name, value))


def _with(problem: SequenceProblem, name: str, value: float) -> float | None:
    """Penalty with another value, $; None: it does not depend on it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if name == "relative_sd":
            return _penalty(problem.replace(scatter=problem.scatter.replace(relative_sd=max(value, 0.0))))
        return _penalty(problem.replace(**{name: value})) if name in _OF_THE_PLAN else None


def _penalty(problem: SequenceProblem) -> float:
    policy = plan(problem, tolerance=None, nodes=_NODES, progress=silent)
    return float(policy.value(height=problem.height_max, time_left=problem.horizon))
