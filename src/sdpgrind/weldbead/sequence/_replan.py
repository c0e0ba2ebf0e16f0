"""Plan anew between two passes, for the time and the height that are left."""

from math import ceil, isnan

from sdpgrind import sdp
from sdpgrind.base.progress import ProgressOption
from sdpgrind.weldbead.sequence._as_sdp import as_planned, sdp_problem
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem

# chosen: nodes of the height left and levels of the force, between which the decision is interpolated;
# a test holds the value at the height left, the only one that is looked up, to 2e-4 $ of a fine grid
NODES, LEVELS = 97, 28
LOWEST = 0.01  # chosen: height of the least grid, mm; the last cuts of a bead are larger


def replanned(problem: SequenceProblem, method: str, height: float, time_left: float) -> SequencePolicy:
    """Return the policy of a problem from a height (mm) and a time left (s); more of them changes nothing."""
    rest = ahead(problem, time_left)
    if height < rest.height_max:
        rest = rest.replace(height_max=max(height, LOWEST))
    table = sdp.plan(sdp_problem(as_planned(rest, method), NODES, levels=LEVELS))
    return SequencePolicy(rest, table, method)


def on_nodes(problem: SequenceProblem, nodes: int, progress: ProgressOption = None) -> SequencePolicy:
    """Return the policy of one grid; its error is not estimated, which takes a quarter of the time more."""
    return SequencePolicy(problem, sdp.plan(sdp_problem(problem, nodes), progress=progress))


def ahead(problem: SequenceProblem, time_left: float) -> SequenceProblem:
    """Problem of the time left (s): more time changes nothing in its plan, to the bit."""
    if isnan(time_left):
        return problem
    stages = ceil(max(time_left, 0.0) / problem.stage)
    horizon = min(max(stages * problem.stage, problem.durations[0]), problem.horizon)
    return problem.replace(horizon=horizon)
