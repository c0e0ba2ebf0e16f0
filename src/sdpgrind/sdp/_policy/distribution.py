"""Exact distribution of a policy's final penalty, by the forward recursion adjoint to the backward one."""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.grid import Graded, Grid, Ints
from sdpgrind.sdp._problem.stops import charge_of, stop_state
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Tail

NEGLIGIBLE = 1e-15  # chosen: probability that is dropped; a smaller one is rounding


@dataclass(frozen=True)
class Left:
    """Mass that left the grid into a stop: origin, probabilities, and further charge."""

    tail: Tail
    probability: Floats
    extra: float


@dataclass(frozen=True)
class Distribution:
    """Distribution of the final penalty: atoms at nodes of stopping, and exact tails beyond stopping edges.

    In-path charges are not part of it, nor is what left by an edge with a value-to-go of its own; their
    expectation is `on_the_way`. Exact for the process that the
    table solves, with outcomes put on neighbour nodes at random.

    Attributes
    ----------
    charge, probability : array
        Penalties ($) and probabilities of the atoms.
    final : array (axes, atoms)
        Final coordinates of the atoms.
    on_the_way : float
        Expected in-path charge, $.
    moves : float
        Expected number of moves.
    outside : tuple of float
        Probability of the atoms beyond the low and the high end of an axis.
    """

    charge: Floats
    probability: Floats
    final: Floats
    tails: tuple[Left, ...]
    on_the_way: float
    moves: float
    outside: tuple[float, float] = (0.0, 0.0)

    @property
    def total(self) -> float:
        """Total probability: 1, up to rounding, less what left by an edge that is a number of $."""
        return float(self.probability.sum() + self._gone(1) + self._gone(-1))

    @property
    def _least(self) -> float:
        """Lower bound of the penalty, $: 0, unless a stop charge is negative."""
        extra = (left.extra for left in self.tails)
        return min(0.0, float(self.charge.min(initial=0.0)), *extra)

    @property
    def mean(self) -> float:
        """Expected penalty, in-path charges included, $."""
        return self._least + self.excess(self._least) + self.on_the_way

    @property
    def probability_below(self) -> float:
        """Probability of ending beyond the low end of an axis (a weld bead: of overgrinding)."""
        return self._gone(1) + self.outside[0]

    @property
    def probability_above(self) -> float:
        """Probability of ending beyond the high end of an axis."""
        return self._gone(-1) + self.outside[1]

    def excess(self, level: float) -> float:
        """Return E (penalty - level)+, $, for a level in $."""
        total = float(self.probability @ np.maximum(self.charge - level, 0.0))
        return total + sum(
            float(left.probability @ left.tail.excess(level - left.extra)) for left in self.tails
        )

    def exceeds(self, level: float) -> float:
        """Return P(penalty > level), for a level in $; an atom within rounding of the level may count."""
        total = float(self.probability @ (self.charge > level))
        return total + sum(
            float(left.probability @ left.tail.exceeds(level - left.extra)) for left in self.tails
        )

    def cvar(self, confidence: float) -> float:
        """Return the conditional value at risk: mean penalty ($) of the worst ``1 - confidence`` of cases.

        Rockafellar and Uryasev: the least of ``c + E (penalty - c)+ / (1 - confidence)`` over c.
        """
        checks.within("confidence", confidence, 0.0, 1.0 - 1e-9)
        if confidence == 0:
            return self._least + self.excess(self._least)
        level = self._quantile(confidence)  # where that is least
        return level + self.excess(level) / (1 - confidence)

    def _quantile(self, confidence: float) -> float:
        """Penalty that is exceeded with a probability of ``1 - confidence``, $."""

        def surplus(level: float) -> float:
            return self.exceeds(level) - (1 - confidence)

        low, high = self._least, max(1e-12, float(self.charge.max(initial=0.0)))
        while surplus(high) > 0:
            high *= 2
        if surplus(low) <= 0:
            return low
        return float(brentq(surplus, low, high, xtol=1e-15 * (high - low)))  # at an atom the slope is steep

    def _gone(self, sign: int) -> float:
        return sum(
            float(left.probability @ left.tail.end.probability(left.tail.law, left.tail.x))
            for left in self.tails
            if left.tail.end.sign == sign
        )


def distribution(policy: Solution, state: dict[str, Any], nodes: npt.ArrayLike | None = None) -> Distribution:
    """Spread probability forward from one state; see `Policy.distribution`."""
    problem = policy.need_problem("distribution")
    place = policy.locate(state)
    if place.row.size != 1:
        raise ValueError(f"distribution must start from one state; got {place.row.size}")
    if policy.layout.endless:
        raise ValueError("distribution needs stages: a process without end has no finite forward recursion")
    if policy.locator.outside(place)[0]:
        return _ended(policy, place, float(policy.value_at(place)[0]))
    return _Spread(
        policy, problem, policy.grid if nodes is None else Graded.on(policy.layout.axes, nodes)
    ).run(place)


def _ended(policy: Solution, place: Any, charge: float) -> Distribution:
    """Distribution from a state beyond an edge at which the process ends."""
    final = np.array(place.points).reshape(len(place.points), 1)
    axes = zip(policy.layout.axes, place.points, strict=True)
    below = any(x[0] < axis.low and axis.below not in ("hold", "refuse") for axis, x in axes)
    return Distribution(np.array([charge]), np.ones(1), final, (), 0.0, 0.0, (float(below), float(not below)))


Points: TypeAlias = tuple[Floats, ...]


class _Spread:
    """Probability [mode, node] by stage, and the charges so far."""

    def __init__(self, policy: Solution, problem: Any, grid: Grid) -> None:
        self.policy, self.problem, self.layout, self.grid = policy, problem, policy.layout, grid
        self.menus = [Menu(problem, grid, k) for k in range(len(problem.moves))]
        self.waiting: dict[int, Floats] = defaultdict(lambda: np.zeros((len(problem.modes), grid.size)))
        self.atoms: list[tuple[Floats, Floats, Floats]] = []
        self.tails: list[Left] = []
        self.on_the_way = self.moves = 0.0

    def run(self, place: Any) -> Distribution:
        # The first action is that of the state itself, no mixture of those at the nodes around it.
        stage, self.offset = self.policy.begin(place)
        best, entry, control, _ = self.policy.act(place)
        self._act(stage, int(best[0]), place.points, place.mode, entry, control, np.ones(1))
        while self.waiting:
            stage = max(self.waiting)
            self._spread(stage, self.waiting.pop(stage))
        charge, probability, final = (
            (np.concatenate(x, axis=-1) for x in zip(*self.atoms, strict=True))
            if self.atoms
            else (np.empty(0), np.empty(0), np.empty((len(self.layout.axes), 0)))
        )
        return Distribution(charge, probability, final, tuple(self.tails), self.on_the_way, self.moves)

    def _spread(self, stage: int, mass: Floats) -> None:
        mode, node = np.nonzero(mass > NEGLIGIBLE)
        best, entry, control = self._decided(stage, mode, node)
        for k in np.unique(best):
            here = best == k
            points = tuple(x[node[here]] for x in self.grid.points)
            at = mode[here], entry[here], control[here], mass[mode[here], node[here]]
            self._act(stage, int(k), points, *at)

    def _decided(self, stage: int, mode: Ints, node: Ints) -> tuple[Any, Any, Floats]:
        """Actions at nodes: from the table, or looked up at nodes that the table lacks."""
        t = self.policy.table
        if self.grid is self.policy.grid:
            at = int(self.policy.countdown.row(stage)), mode, node
            return t.best[at], t.entry[at], t.control[at]
        points = tuple(x[node] for x in self.grid.points)
        return self.policy.act(self.policy.placed(np.full(node.size, stage), mode, points))[:3]

    def _act(
        self, stage: int, k: int, points: Points, mode: Any, entry: Any, control: Floats, mass: Floats
    ) -> None:
        if k < 0:
            self._stop(stage, k, points, mode, mass)
        else:
            self._move(stage, k, points, mode, entry.astype(np.int64), control, mass)

    def _late(self, stage: int) -> float:
        return float(self.policy.countdown.late(stage * self.layout.step + self.offset))

    def _stop(self, stage: int, k: int, points: Points, mode: Any, mass: Floats) -> None:
        s = stop_state(self.problem, points, mode, stage)
        charge = np.broadcast_to(
            charge_of(self.problem, self.problem.stops[-1 - k], s), mass.shape
        ) + self._late(stage)
        self.atoms.append((charge, mass, np.array(points).reshape(len(points), mass.size)))

    def _move(
        self, stage: int, k: int, points: Points, mode: Any, entry: Any, control: Floats, mass: Floats
    ) -> None:
        menu = self.menus[k]
        told = mode if len(self.problem.modes) > 1 else None
        time = np.full(mass.size, stage * self.layout.step)
        rows = menu.move.to.rows(menu, points, told, time, entry, control)
        arrival = stage - menu.move.duration
        for end in np.unique(rows.mode):
            here = rows.mode == end
            extra = (self.layout.edge_extra[end] if self.layout.edge_extra else 0.0) + self._late(arrival)
            self.tails += [
                Left(tail, np.where(here, mass, 0.0), extra)
                for tail in rows.tails
                if float(mass[here] @ rows.stopped[here]) > NEGLIGIBLE
            ]
        beyond = sum(
            (
                tail.end.charge(tail.law, tail.x, tail.end.probability(tail.law, tail.x))
                for tail in rows.tails
            ),
            0.0,
        )
        self.on_the_way += float(mass @ (rows.charge - beyond))
        self.moves += float(mass.sum())
        after = rows.spread(mass, len(self.problem.modes))
        if after.max(initial=0.0) > NEGLIGIBLE:
            self.waiting[arrival] += after
