"""Result of a search for a placement."""

from dataclasses import dataclass
from typing import Any

from sdpgrind.base import pictures
from sdpgrind.finishing.placement._proof import Proof

LIMITS_ONLY = "collisions are not looked at"


@dataclass(frozen=True)
class Placement:
    """Placement of the work in the base of a robot, a proof that there is none, or the best try.

    The search looks at limits and singular poses of the joints. Collisions are not looked at: of tool, robot,
    table or work with one another.

    Attributes
    ----------
    found : bool
        Whether the robot takes the whole path within its limits.
    problem : FinishingProblem or None
        The problem with its placement (mm, rad) and azimuth (rad), ready to plan; None where none was found.
    proof : Proof or None
        Why no placement exists, in numbers; None where one was found, or it is not known whether one exists.
    best : FinishingProblem or None
        The best try where nothing was found; else as `problem`.
    worth : float
        Least margin at 30 poses of the path, unit 1: distance of the joints from their limits over their
        range, and distance from singular poses. -1 and less: poses are out of reach. NaN with a proof.
    why : str
        What stops the best try; empty where a placement was found.
    """

    found: bool
    problem: Any
    proof: Proof | None
    best: Any
    worth: float
    why: str = ""

    def __repr__(self) -> str:
        if self.proof is not None:
            return f"Placement(there is none: {self.proof})"
        told = placed_at(self.best)
        if self.found:
            return f"Placement({told}, worth {self.worth:.3g}; {LIMITS_ONLY})"
        return f"Placement(not found; best try: {told}, worth {self.worth:.3g}, {self.why}; {LIMITS_ONLY})"

    def plot(self) -> Any:
        """Draw robot and path in the base, mm, from above and from the side, and the ranges of the joints.

        With a proof: what is needed and what is available.
        """
        return pictures.drawn("sdpgrind.finishing.placement._picture:plot", self)


def placed_at(problem: Any) -> str:
    """Return placement and azimuth of a problem in words (mm, rad)."""
    x, y, z, *turn = problem.placement
    turned = f" turned by {turn[0]:.3g} rad" if turn and turn[0] else ""
    tool = f", azimuth {problem.azimuth:.3g} rad" if problem.heading == "fixed" else ""
    return f"origin at ({x:.5g}, {y:.5g}, {z:.5g}) mm{turned}{tool}"
