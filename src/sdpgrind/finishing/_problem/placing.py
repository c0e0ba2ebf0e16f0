"""Placements in `plan`: a search where a robot needs one, and a hint at what a search would do."""

from sdpgrind.base.progress import Progress, portion
from sdpgrind.base.warned import warn
from sdpgrind.finishing._problem.place import place, quick_proof
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.placement._placement import LIMITS_ONLY, Placement, placed_at

PLACE_SHARE = 0.6  # chosen: portion of progress for a placement; a search takes longer than most plans


def placed_for(problem: FinishingProblem, progress: Progress) -> tuple[FinishingProblem, float]:
    """Return the problem with a placement where its robot needs one, and the share of progress behind.

    ValueError where none was found.
    """
    if problem.placement is not None or isinstance(problem.robot, Arm):
        return problem, 0.0
    if isinstance(problem.robot, MountedRobot):
        raise ValueError(
            "placement must be given where axes carry the work: x, y, z (mm) with the axes at zero, and a"
            " turn about z (rad); finishing.place searches one in a box; got None"
        )
    found = place(problem, progress=portion(progress, 0.0, PLACE_SHARE))
    if not found.found:
        raise ValueError(_refusal(found))
    warn(f"placement was None: finishing.place took {placed_at(found.problem)}; {LIMITS_ONLY}")
    return found.problem, PLACE_SHARE


def _refusal(found: Placement) -> str:
    if found.proof is not None:
        return f"placement cannot be found, as there is none: {found.proof}"
    return (
        "placement must be given for this robot, as finishing.place found none; its best try:"
        f" {placed_at(found.best)}, where {found.why}"
    )


def what_place_would(problem: FinishingProblem) -> str:
    """Return in words what `place` would do about a placement that fails."""
    if isinstance(problem.robot, MountedRobot):
        return "more candidates of the axes, or other limits, may do; finishing.place searches in a box"
    proof = quick_proof(problem)
    if proof is not None:
        return f"no placement would do: {proof}"
    others = "origin, turn and azimuth" if problem.heading == "fixed" else "origin and turn"
    return f"finishing.place would search another {others} of the work"
