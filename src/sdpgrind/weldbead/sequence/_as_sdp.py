"""A weld-bead problem as a problem of the solver `sdp`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.weldbead.sequence._coefficient_scatter import COEFFICIENTS
from sdpgrind.weldbead.sequence._problem import SequenceProblem

METHODS = ("cautious", "certain")
LEVELS = 401  # chosen: levels of the normal force, between which is searched


def sdp_problem(
    problem: SequenceProblem, nodes: int = 401, *, levels: int = LEVELS, search: bool = True
) -> sdp.Problem:
    """Return a weld-bead problem as a problem of `sdp`.

    Parameters
    ----------
    problem : SequenceProblem
        Problem to translate.
    nodes : int
        Nodes of the height axis, 0 to `height_max` mm.
    levels : int
        Levels of the normal force, N.
    search : bool
        Whether the force may lie between levels.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> [move.name for move in weldbead.sequence.sdp_problem(weldbead.preset("P1")).moves][:2]
    ['6 s', '8 s']
    """
    finish = problem.finish_charge
    moves = [
        _move(problem, k, levels, search)
        for k in range(len(problem.durations))
        if np.less(*problem.force_interval(problem.durations[k]))
    ]
    modes = ("",) if finish is None else ("no pass", *(move.name for move in moves))
    return sdp.Problem(
        axes=[sdp.Axis("height", 0.0, problem.height_max, nodes, "mm", below="stop")],
        moves=moves,
        stops=[sdp.Stop("stop", problem.height_charge, extra=_finish(problem, moves))],
        stages=_stages(problem),
        modes=modes,
    )


def as_planned(problem: SequenceProblem, method: str) -> SequenceProblem:
    """Return the problem that the solver plans: "cautious", the bead's scatter counts as one of passes.

    "certain": the believed logarithms are taken as true, K1, K2 and mu at the exponentials of their means.
    """
    beads = problem.bead_scatter
    if method == "cautious" or beads is None:
        return problem
    factors = np.exp(-0.5 * np.diag(beads.log_covariance)).tolist()
    model = {name: f * getattr(problem.model, name) for name, f in zip(COEFFICIENTS, factors, strict=True)}
    scatter = problem.scatter.replace(mean="coefficient")
    return problem.replace(model=problem.model.replace(**model), scatter=scatter, bead_scatter=None)


def true_problem(planned: SequenceProblem, truth: SequenceProblem, nodes: int) -> sdp.Problem:
    """Return the planned moves as the truth answers them; none is left out that the truth would refuse."""
    for name in ("bead_length", "reset_time", "durations", "stage"):
        if getattr(truth, name) != getattr(planned, name):
            raise checks.refuse(
                f"model.{name}", f"that of the plan, {getattr(planned, name)!r}", getattr(truth, name)
            )
    for name in ("finish_charge", "lateness_charge"):
        if (getattr(truth, name) is None) != (getattr(planned, name) is None):
            raise checks.refuse(
                f"model.{name}",
                f"None or not as in the plan, {getattr(planned, name)!r}",
                getattr(truth, name),
            )
    problem = sdp_problem(planned, nodes)
    moves = [
        replace(move, to=_shift(truth, _seconds(move, truth)), charge=truth.pass_charge)
        for move in problem.moves
    ]
    stop = sdp.Stop("stop", truth.height_charge, extra=_finish(truth, problem.moves))
    stages = replace(_stages(planned), late=truth.lateness_charge)
    return replace(problem, moves=moves, stops=[stop], stages=stages)


def _stages(problem: SequenceProblem) -> sdp.Stages:
    count = round(problem.horizon / problem.stage)
    return sdp.Stages(count, problem.stage, late=problem.lateness_charge, late_window=problem.late_window)


def _seconds(move: sdp.Move, problem: SequenceProblem) -> float:
    return move.duration * problem.stage


def _move(problem: SequenceProblem, k: int, levels: int, search: bool) -> sdp.Move:
    duration = problem.durations[k]
    low, high = problem.force_interval(duration)
    name = f"{duration:g} s"
    return sdp.Move(
        name,
        {"normal_force": sdp.Levels(low, high, levels, problem.force_breaks(duration), search)},
        _shift(problem, duration),
        duration=round(duration / problem.stage),
        charge=problem.pass_charge,
        into=None if problem.finish_charge is None else name,
    )


def _shift(problem: SequenceProblem, duration: float) -> sdp.Shift:
    return sdp.Shift("height", partial(_cut, problem, duration))


def _finish(problem: SequenceProblem, moves: Sequence[sdp.Move]) -> "Finish | None":
    finish = problem.finish_charge
    if finish is None:
        return None
    return Finish((0.0, *(float(finish(problem.feed_rate(_seconds(move, problem)))) for move in moves)))


def _cut(problem: SequenceProblem, duration: float, s: Any, c: Any) -> sdp.Law:
    return problem.cut(duration, c.normal_force)


@dataclass(frozen=True)
class Finish:
    """Finish charge, $, by mode; the mode is the last pass."""

    charges: tuple[float, ...]

    def __call__(self, s: Any) -> Any:
        """Return the charge, $, of the modes of the states `s`."""
        return np.asarray(self.charges)[np.asarray(s.mode, dtype=np.int64)]
