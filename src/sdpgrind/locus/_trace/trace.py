"""All branches of optima over one hidden state, cut where the active set or the cheapest branch changes."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.system import TICKS, System, starts_of
from sdpgrind.locus._trace import trace_kernels as kernels
from sdpgrind.locus._trace.kkt_kernels import GOOD
from sdpgrind.locus._trace.seed_kernels import best_points, lattice_best, lattice_minima, reach

Ints: TypeAlias = npt.NDArray[np.int64]
PLACES = (0.0, 1.0, 0.5, 0.25, 0.75)  # chosen: scaled hidden states of searches; fewer miss branches
BETWEEN = np.setdiff1d(np.arange(1, 16), [4, 8, 12]) / 16.0
"""Places where lattice points are only compared with known branches."""
MOST = 2000  # chosen: nodes of a branch to one side; a longer one is cut as lost
SAME = 1e-6  # chosen: scaled distance of controls that are one point
ROUNDING = 1e-9  # chosen: scaled error of the ends of runs
KINDS = {
    kernels.NONE: "",
    kernels.LOW: "least",
    kernels.HIGH: "greatest",
    kernels.RELEASE: "released",
    kernels.DROP: "inactive",
    kernels.ADD: "active",
    kernels.RANGE: "range",
    kernels.INFEASIBLE: "infeasible",
    kernels.FOLD: "fold",
    kernels.BRANCH: "branch point",
    kernels.LOST: "lost",
    kernels.FULL: "lost",
}
"""Names of events at ends of pieces."""


@dataclass(frozen=True)
class TraceRun:
    """Part of a branch with one set: nodes (k, n + m + 2), unit tangents, by rising place; events at ends."""

    nodes: Floats
    tangents: Floats
    held: Ints
    start: tuple[str, int] = ("", 0)
    end: tuple[str, int] = ("", 0)

    @property
    def low(self) -> float:
        """Least scaled hidden state."""
        return float(self.nodes[0, -1])

    @property
    def high(self) -> float:
        """Greatest scaled hidden state."""
        return float(self.nodes[-1, -1])


Branch: TypeAlias = list[TraceRun]


@dataclass(frozen=True)
class Tracer:
    """Tracer over the t-th hidden state; `hidden` are all scaled hidden states."""

    system: System
    hidden: Floats
    t: int = 0
    flat: list[tuple[float, float]] = field(default_factory=list)
    """Places with several optima, and their cost."""

    @property
    def _sizes(self) -> tuple[int, int, int]:
        return self.system.n, self.system.m, self.system.h

    def seeds(self, place: float, starts: Floats | None = None) -> Iterator[tuple[Floats, Ints]]:
        """Yield optima at one place, from lattice minima or given feasible points (k, n)."""
        n, m, h = self._sizes
        hidden = self._hidden_at(place)
        kkt, first, lattice = self.system.kkt_tape, self.system.first_tape, starts_of(n)
        chosen = (
            lattice[lattice_minima(first, n, m, hidden, lattice, TICKS.get(n, 3))]
            if starts is None
            else starts
        )
        found = best_points(kkt, first, n, m, h, hidden, self.t, chosen)
        for point, held, curvature in zip(*found, strict=True):
            if curvature > 0:
                yield point, held
            elif curvature == 0:
                self.flat.append((place, float(self._costs(point[None])[0])))

    def follow(
        self, point: Floats, held: Ints, rising: float, low: float = 0.0, high: float = 1.0
    ) -> list[TraceRun]:
        """Return the runs to one side of an optimum, in order."""
        n, m, h = self._sizes
        nodes, tangents = np.empty((MOST, n + m + 2)), np.empty((MOST, n + m + 2))
        sets, events = np.empty((MOST, n + m), dtype=np.int64), np.zeros((MOST, 2), dtype=np.int64)
        count = kernels.follow(
            self.system.kkt_tape, n, m, h, self.hidden, self.t, point, held, rising, low, high,
            nodes, tangents, sets, events,
        )  # fmt: skip
        return list(_runs(nodes[:count], tangents[:count], sets[:count], events[:count]))

    def grow(self, point: Floats, held: Ints) -> Branch:
        """Return the whole branch through an optimum."""
        down, up = self.follow(point, held, -1.0), self.follow(point, held, 1.0)
        backward = [_reversed(run) for run in reversed(down)]
        last, first = backward[-1], up[0]
        joined = TraceRun(
            np.concatenate([last.nodes, first.nodes[1:]]),
            np.concatenate([last.tangents, first.tangents[1:]]),
            held,
            last.start,
            first.end,
        )
        return _rising(
            [run for run in [*backward[:-1], joined, *up[1:]] if run.high > run.low + ROUNDING], self.system.n
        )

    def at(self, run: TraceRun, place: float) -> Floats | None:
        """Return the point of a run at a place; None: not found."""
        n, m, h = self._sizes
        point = np.empty(n + m + 2)
        left = kernels.reach(
            self.system.kkt_tape, n, m, h, self.hidden, self.t, run.held, run.nodes, place, point
        )
        return point if left <= GOOD else None

    def cost(self, branch: Branch, place: float) -> float:
        """Return the cost of a branch at a place; inf: none."""
        run = run_at(branch, place)
        point = None if run is None else self.at(run, place)
        return np.inf if point is None else float(self._costs(point[None])[0])

    def _costs(self, points: Floats) -> Floats:
        """Return the cost (k,) of points (k, n + m + 2)."""
        hidden, n = np.repeat(self.hidden[None], len(points), axis=0), self.system.n
        hidden[:, self.t] = points[:, -1]
        values: tuple[Floats, ...] = self.system.values(
            self.system.unscaled(points[:, :n]), self.system.unscaled(hidden, n)
        )
        return values[0]

    def branches(self) -> list[Branch]:
        """Return all branches found from `PLACES` and near the ends of known branches."""
        found: list[Branch] = []
        for place in PLACES:
            self._add(found, place)
        if not found:
            self._reach(found)
        for place in {end for branch in found for end in (branch[0].low, branch[-1].high)}:
            for beside in (place - 0.01, place + 0.01):
                if 0 < place < 1 and 0 < beside < 1:
                    self._add(found, beside)
        self._challenge(found)
        return sorted(found, key=lambda branch: branch[0].low)

    def _reach(self, found: list[Branch]) -> None:
        """Search from feasible points where the limits leave no room for lattice points."""
        n, m, h = self._sizes
        for place in PLACES:
            start = reach(self.system.kkt_tape, n, m, h, self._hidden_at(place), self.t, starts_of(n))
            if np.all(np.isfinite(start)):
                self._add(found, place, start[None])

    def _hidden_at(self, place: float) -> Floats:
        hidden = self.hidden.copy()
        hidden[self.t] = place
        return hidden

    def _challenge(self, found: list[Branch]) -> None:
        """Search at `BETWEEN` where a lattice point is cheaper than every branch."""
        n, m, _ = self._sizes
        best, costs = lattice_best(self.system.first_tape, n, m, self.hidden, self.t, BETWEEN, starts_of(n))
        known = np.min([self._about(branch) for branch in found], axis=0, initial=np.inf)
        for place, start, cheaper in zip(BETWEEN, best, costs < known, strict=True):
            if cheaper:
                self._add(found, float(place), starts_of(n)[start][None])

    def _about(self, branch: Branch) -> Floats:
        """Return the scaled cost of a branch at `BETWEEN`, linear between nodes; inf outside."""
        nodes = np.concatenate([run.nodes for run in branch])
        scaled = self._costs(nodes) / self.system.cost_scale
        about: Floats = np.interp(BETWEEN, nodes[:, -1], scaled, left=np.inf, right=np.inf)
        return about

    def _add(self, found: list[Branch], place: float, starts: Floats | None = None) -> None:
        for point, held in self.seeds(place, starts):
            if not any(self._holds(branch, point) for branch in found) and (grown := self.grow(point, held)):
                found.append(grown)

    def _holds(self, branch: Branch, point: Floats) -> bool:
        run = run_at(branch, float(point[-1]))
        there = None if run is None else self.at(run, float(point[-1]))
        n = self.system.n
        return there is not None and bool(np.max(np.abs(there[:n] - point[:n])) < SAME)

    def cut(self, run: TraceRun, places: list[float]) -> Iterator[TraceRun]:
        """Yield a run in parts, cut at places where another branch becomes cheaper."""
        rest = run
        for place in sorted(places):
            point = self.at(rest, place)
            if point is None or not rest.low < place < rest.high:
                continue
            k = int(np.searchsorted(rest.nodes[:, -1], place))
            tangent = np.empty_like(point)
            self._tangent(point, rest, k, tangent)
            head, tail = rest.nodes[:k], rest.nodes[k:]
            yield replace(
                rest,
                nodes=np.vstack([head, point]),
                tangents=np.vstack([rest.tangents[:k], tangent]),
                end=("jump", 0),
            )
            rest = replace(
                rest,
                nodes=np.vstack([point, tail]),
                tangents=np.vstack([tangent, rest.tangents[k:]]),
                start=("jump", 0),
            )
        yield rest

    def _tangent(self, point: Floats, run: TraceRun, k: int, out: Floats) -> None:
        n, m, h = self._sizes
        kernels.tangent_of(
            self.system.kkt_tape, n, m, h, self.hidden, self.t, run.held, point, run.tangents[k], out
        )


def run_at(branch: Branch, place: float) -> TraceRun | None:
    """Return the run of a branch at a place; None: outside."""
    for run in branch:
        if run.low - ROUNDING <= place <= run.high + ROUNDING:
            return run
    return None


def _runs(nodes: Floats, tangents: Floats, sets: Ints, events: Ints) -> Iterator[TraceRun]:
    """Yield the runs of a followed branch, cut at events."""
    since, start = 0, ("", 0)
    for k in np.flatnonzero(events[:, 0] != kernels.NONE):
        end = (KINDS[int(events[k, 0])], int(events[k, 1]))
        yield TraceRun(nodes[since : k + 1], tangents[since : k + 1], sets[k], start, end)
        since, start = int(k) + 1, end


def _rising(branch: Branch, n: int) -> Branch:
    """Name the events between runs as for a rising hidden state."""
    for k, (before, after) in enumerate(pairwise(branch)):
        event = _change(before.held, after.held, n)
        branch[k], branch[k + 1] = replace(before, end=event), replace(after, start=event)
    return branch


def _change(before: Ints, after: Ints, n: int) -> tuple[str, int]:
    changed = np.flatnonzero(before != after)
    new = changed[after[changed] != 0]  # the new member of an exchange
    i = int([*new, *changed][0])
    if i < n:
        return ("released" if after[i] == 0 else "least" if after[i] < 0 else "greatest"), i
    return ("active" if after[i] else "inactive"), i - n


def _reversed(run: TraceRun) -> TraceRun:
    return TraceRun(run.nodes[::-1].copy(), -run.tangents[::-1], run.held, run.end, run.start)
