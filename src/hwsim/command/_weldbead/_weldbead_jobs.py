"""What ``hwsim weldbead`` runs: all three tiers on the force table, or the sequence alone on the stand of one draw a pass."""

import math
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np

from hwsim.plants._force_table.plant import ForceTableStand
from hwsim.plants._weldbead.plant import WeldBeadStand
from sdpgrind import units, weldbead
from sdpgrind.base import checks
from sdpgrind.weldbead import force, passes

Problem: TypeAlias = weldbead.SequenceProblem
Policy: TypeAlias = weldbead.SequencePolicy
ANGLE, STIFFNESS, CROSSOVER = units.deg(20.0), 6e5, units.hz(3.0)  # of Brown's disc, N mm/rad, and of his force loop
WAVE, WAVE_LENGTH = 0.1, 40.0  # mm; a bead is not level
_NODE = 0.1  # distance of the nodes of a bead, mm


class Job(Protocol):
    """A stand, and the controller that it takes."""

    @property
    def stand(self) -> Any:
        """The plant."""

    @property
    def problem(self) -> Problem:
        """What the sequence is planned for."""

    @property
    def start(self) -> tuple[float, float]:
        """Mean height (mm) and time to the deadline (s) at the start."""

    def controller(self, policy: Policy) -> Any:
        """The controller that follows a policy."""


@dataclass(frozen=True)
class OneDraw:
    """The sequence alone: a pass takes off what is drawn for it."""

    stand: WeldBeadStand

    @property
    def problem(self) -> Problem:
        """What the sequence is planned for."""
        return self.stand.problem

    @property
    def start(self) -> tuple[float, float]:
        """Mean height (mm) and time to the deadline (s) at the start."""
        return self.stand.start_height, self.stand.start_time

    def controller(self, policy: Policy) -> weldbead.SequenceController:
        """The controller that follows a policy."""
        return weldbead.SequenceController(policy)


@dataclass(frozen=True)
class ThreeTiers:
    """Sequence, passes and force loop."""

    stand: ForceTableStand
    problem: Problem
    crossover: float = CROSSOVER

    @property
    def start(self) -> tuple[float, float]:
        """Mean height (mm) and time to the deadline (s) at the start."""
        return self.stand.problem.bead.mean, self.stand.start_time

    def controller(self, policy: Policy) -> weldbead.Hierarchy:
        """The controller that follows a policy."""
        loop = force.PI.design(crossover=self.crossover, drive=force.table_drive())
        return weldbead.Hierarchy(policy, self.stand.problem.disc, loop, lead_out=self.stand.lead_out)


def bead(problem: Problem, height: float, wave: float | None = None, wave_length: float = WAVE_LENGTH) -> passes.Contour:
    """A wavy bead of a mean height (mm), with metal everywhere."""
    wave = checks.nonnegative("wave", min(WAVE, height / 2) if wave is None else wave, "mm")
    if wave_length < 10 * _NODE:
        raise checks.refuse("wave_length", f">= {10 * _NODE:g}", wave_length, "mm")
    x = np.linspace(0.0, problem.bead_length, math.ceil(problem.bead_length / _NODE) + 1)
    shape = np.sin(2 * np.pi * x / wave_length)
    z = height + wave * (shape - np.trapezoid(shape, x) / problem.bead_length)
    if z.min() <= 0:
        raise checks.refuse("wave", f"small enough to leave metal everywhere on a bead of {height:g} mm", wave, "mm")
    return passes.Contour(x, z)


def one_pass(problem: Problem, disc: passes.TiltedDisc, contour: passes.Contour) -> passes.PassProblem:
    """Disc and bead of a stand; what its first pass is asked for is the sequence's affair."""
    feed = problem.feed_rate(problem.durations[-1])
    return passes.PassProblem(disc, contour, mean_cut=0.0, feed_rate=feed, normal_force_max=problem.force_max)


def job_of(problem: Problem, *, simple: bool) -> Job:
    """A problem on a stand of which nothing is said."""
    plain = WeldBeadStand(problem)
    if simple:
        return OneDraw(plain)
    disc = passes.TiltedDisc(problem.model, relaxed_angle=ANGLE, rotational_stiffness=STIFFNESS)
    on_table = one_pass(problem, disc, bead(problem, plain.start_height))
    return ThreeTiers(ForceTableStand(on_table, sequence=problem, time=plain.start_time), problem)
