"""A strategy without planning, for controllers under test."""

from typing import NamedTuple

from centering import CenteringProblem


class Plain(NamedTuple):
    """A gentle push over the whole offset."""

    aim: float
    stroke: float
    push_speed: float
    shape: str
    retract: bool
    spindle_speed: float


class PlainStrategy:
    """Gentle pushes over the whole offset, the table at a speed that the tip can outrun; nothing is learned."""

    def __init__(self, problem: CenteringProblem) -> None:
        self.problem = problem
        self.finish = 0.8 * problem.tolerance
        self.offset_max = 1.5 * problem.offset_max
        self.told: list[tuple[float, float]] = []
        self.shown: list[object] = []

    def spindle_speed(self, offset: float) -> float:
        return min(self.problem.limits.spindle_speed_max, 60.0 / offset)

    def push(self, *, offset: float, friction: float, evidence: float) -> Plain:
        speed = 40.0 if offset > 0.3 else 10.0
        return Plain(offset, offset, speed, "gentle", True, self.spindle_speed(offset))

    def update_belief(
        self, friction: float, evidence: float, commanded: Plain, travelled: float, **known: object
    ) -> tuple[float, float]:
        self.shown.append(known["shown"])
        self.told.append((commanded.aim, travelled))
        return friction, evidence + 1.0
