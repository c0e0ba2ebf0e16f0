"""Monte-Carlo of a policy on the model, in blocks that do not depend on the executor."""

import pickle
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from sdpgrind.base import checks, pictures
from sdpgrind.base import rng as random
from sdpgrind.base.budget import afford
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import execute
from sdpgrind.sdp._policy.locate import Place
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.countdown import Countdown
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._problem.stops import charge_of, stop_state
from sdpgrind.sdp._transitions.edges import passed
from sdpgrind.sdp._transitions.menu import Menu

BLOCK = 32_768  # chosen: runs in a block; smaller ones cost overhead, larger ones memory
LONGEST = 100_000  # chosen: moves of a run taken for endless; fewer would refuse long processes


@dataclass(frozen=True)
class Runs:
    """Outcome of simulated runs of a policy.

    Attributes
    ----------
    penalty : array (runs,)
        Total charge of a run, $.
    moves : int array (runs,)
        Number of moves.
    final : dict of array (runs,)
        Final coordinates, in the axes' units, and the stage coordinate at the end.
    units : dict
        Unit of each entry of `final`.
    """

    penalty: Floats
    moves: Ints
    final: dict[str, Floats]
    units: dict[str, str]

    @property
    def mean(self) -> float:
        """Mean penalty, $."""
        return float(np.mean(self.penalty))

    @property
    def standard_error(self) -> float:
        """Standard error of the mean penalty, $; infinite for a single run."""
        if self.penalty.size < 2:
            return float("inf")
        return float(np.std(self.penalty, ddof=1) / np.sqrt(self.penalty.size))

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Labelled data (dimension: run)."""
        final = {
            f"final_{name}": ("run", x, {"units": self.units.get(name, "")}) for name, x in self.final.items()
        }
        return xr.Dataset(
            {"penalty": ("run", self.penalty, {"units": "$"}), "moves": ("run", self.moves), **final}
        )

    def plot(self) -> Any:
        """Return a figure of the distributions of penalty and number of moves."""
        figure, (left, right) = pictures.subplots(1, 2, (9, 3.4))
        left.hist(self.penalty, bins=80, color=pictures.ACTUAL)
        left.axvline(self.mean, color="k", lw=1, label=f"mean {self.mean:.4g} $")
        left.set(xlabel="penalty [$]", ylabel="runs", yscale="log")
        left.legend(frameon=False)
        right.hist(self.moves, bins=np.arange(self.moves.max() + 2) - 0.5, color=pictures.ACTUAL, rwidth=0.9)
        right.set(xlabel="moves", ylabel="runs")
        return figure

    def __repr__(self) -> str:
        mean = f"{self.mean:.6g} +- {self.standard_error:.2g} $"
        return f"Runs({self.penalty.size} runs, mean penalty {mean}, {np.mean(self.moves):.3g} moves)"


def simulate(
    policy: Solution,
    runs: int,
    rng: random.Seed,
    problem: Problem | None,
    snap: bool,
    executor: Executor | None,
    start: dict[str, Any],
    noise: Mapping[str, float] = MappingProxyType({}),
) -> Runs:
    """Run `policy` from one state; see `Policy.simulate`."""
    truth = problem if problem is not None else policy.need_problem("simulate")
    place = policy.locate(start)
    if place.row.size != 1:
        raise ValueError(f"simulate must start from one state; got {place.row.size}")
    size = 2 * 8.0 * (3 + len(policy.layout.axes)) * checks.count("runs", runs)  # penalty, moves, stage, axes
    afford(f"runs = {runs}", size, "several simulations of fewer runs need less")
    sizes = [min(BLOCK, runs - k) for k in range(0, runs, BLOCK)]
    seeds = random.children(rng, len(sizes))
    if executor is None:
        blocks = [
            _Block(policy, truth, snap, noise, size, seed).run(place)
            for size, seed in zip(sizes, seeds, strict=True)
        ]
    else:
        recipe = pickle.dumps((policy, truth, snap, dict(noise), place))
        work = partial(_work, recipe)
        blocks = execute(work, list(zip(sizes, seeds, strict=True)), executor)
    penalty, moves, *final = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    names = [axis.name for axis in policy.layout.axes] + (
        [policy.layout.stage_name] if not policy.layout.endless else []
    )
    units = {axis.name: axis.unit for axis in policy.layout.axes} | {
        policy.layout.stage_name: policy.layout.stage_unit
    }
    return Runs(penalty, moves, dict(zip(names, final, strict=False)), units)


@lru_cache(maxsize=4)
def _unpacked(recipe: bytes) -> Any:
    return pickle.loads(recipe)


def _work(recipe: bytes, job: tuple[int, np.random.Generator]) -> tuple[Any, ...]:
    policy, truth, snap, noise, place = _unpacked(recipe)
    return _Block(policy, truth, snap, noise, *job).run(place)


class _Block:
    """Runs advanced together, move by move."""

    def __init__(
        self,
        policy: Solution,
        truth: Problem,
        snap: bool,
        noise: Mapping[str, float],
        size: int,
        rng: np.random.Generator,
    ) -> None:
        self.policy, self.truth, self.snap, self.rng, self.size = policy, truth, snap, rng, size
        self.noise = [noise.get(axis.name, 0.0) for axis in policy.layout.axes]
        self.menus = [Menu(truth, policy.grid, k) for k in range(len(truth.moves))]
        self.layout, self.countdown = policy.layout, Countdown.of(truth.stages)

    def run(self, place: Place) -> tuple[Any, ...]:
        """Run to the end; return penalty, moves, final coordinates, final stage coordinate."""
        n = self.size
        self.points = [np.full(n, float(p[0])) for p in place.points]
        begin, self.offset = self.policy.begin(place)
        self.stage = np.full(n, begin)
        self.mode = np.full(n, int(place.mode[0]))
        self.penalty, self.moves = np.zeros(n), np.zeros(n, dtype=np.int64)
        alive = np.arange(n)
        for _ in range(LONGEST):
            alive = self._advance(alive)
            if not alive.size:
                time = [self.stage * self.layout.step + self.offset] if not self.layout.endless else []
                return (self.penalty, self.moves, *self.points, *time)
        raise ValueError(f"a run did not end within {LONGEST} moves")

    def _place(self, alive: Ints) -> Place:
        read = tuple(self._read(axis, p[alive]) for axis, p in enumerate(self.points))
        return self.policy.placed(self.stage[alive], self.mode[alive], read)

    def _read(self, axis: int, true: Floats) -> Floats:
        """Measured coordinates, clamped at the high end."""
        if not self.noise[axis]:
            return true
        high = self.layout.axes[axis].high
        return np.minimum(
            true + self.noise[axis] * self.rng.standard_normal(true.size), np.maximum(true, high)
        )

    def _advance(self, alive: Ints) -> Ints:
        best, entry, control, _ = self.policy.act(self._place(alive))
        going = np.ones(alive.size, dtype=bool)
        for k in np.unique(best):
            here = best == k
            if k < 0:
                self._stop(alive[here], -1 - int(k))
                going[here] = False
            else:
                going[here] = self._move(
                    alive[here], self.menus[k], entry[here].astype(np.int64), control[here]
                )
        return alive[going]

    def _stop(self, who: Ints, stop: int) -> None:
        s = stop_state(self.truth, [p[who] for p in self.points], self.mode[who], self.stage[who])
        self.penalty[who] += charge_of(self.truth, self.truth.stops[stop], s) + self._late(who)

    def _late(self, who: Ints) -> Any:
        return self.countdown.late(self.stage[who] * self.countdown.step + self.offset)

    def _move(self, who: Ints, menu: Menu, entry: Ints, control: Floats) -> Any:
        """Make one move; return the mask of runs that go on."""
        points = tuple(p[who] for p in self.points)
        mode = self.mode[who] if len(self.truth.modes) > 1 else None
        stage = self.stage[who] * self.truth.step
        after, extra = menu.move.to.sample(menu, points, mode, stage, entry, control, self.rng)
        self.penalty[who] += (
            menu.penalty(menu.state(points, mode, stage), menu.controls(entry, control)) + extra
        )
        self.moves[who] += 1
        self.stage[who] -= menu.move.duration
        if menu.into is not None:
            self.mode[who] = menu.into[entry]
        for k, x in enumerate(after):
            self.points[k][who] = x
        if self.snap:
            self._snap(who)
        return self._leave(who)

    def _leave(self, who: Ints) -> Any:
        """Charge and end runs beyond an edge; clamp those at a holding edge."""
        going = np.ones(who.size, dtype=bool)
        for k, axis in enumerate(self.layout.axes):
            for gone, edge, end in passed(axis, self.points[k][who]):
                beyond = gone & going
                if edge == "hold":
                    self.points[k][who[beyond]] = end
                elif edge == "stop":
                    self._stop(who[beyond], 0)
                    going[beyond] = False
                elif edge != "refuse":
                    self.penalty[who[beyond]] += edge
                    going[beyond] = False
        return going

    def _snap(self, who: Ints) -> None:
        """Put coordinates on a neighbour node at random, with the weights of linear interpolation."""
        for k, axis in enumerate(self.layout.axes):
            x = self.points[k][who]
            inside = (x > axis.low) & (x < axis.high)
            index = self.policy.grid.index(k, x[inside])
            up = self.rng.random(index.size) < index - np.floor(index)
            node = np.floor(index).astype(np.int64) + up
            self.points[k][who[inside]] = self.policy.grid.coordinates[k][np.clip(node, 0, axis.nodes - 1)]
