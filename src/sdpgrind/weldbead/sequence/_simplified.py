"""A plan of few bands that an operator follows: one duration and one force for a range of heights.

From the lowest time left up, each stage is covered by the fewest ranges of height whose duration loses little
and each range by the fewest bands of one force. Costs are those of the bands chosen for less time left: the
values are those of following the bands, and the loss is exact.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from math import nan
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress
from sdpgrind.weldbead.sequence._band_sheet import Band, at_height
from sdpgrind.weldbead.sequence._pass_rows import PassRows
from sdpgrind.weldbead.sequence._problem import SequenceProblem

Ints: TypeAlias = npt.NDArray[np.int64]
STOP = -1  # derived: numbers of rows begin at 0
HEIGHTS = 101  # chosen: heights where bands may end; a gauge is read to 1 % of the greatest
FORCE_SHARE = 0.3  # chosen: share of the loss of a decision that its force may take; more saves no bands
_STEPS = (
    10.0,
    5.0,
    2.0,
    1.0,
    0.5,
    0.2,
    0.1,
    0.05,
)  # N; chosen: steps that are offered in place of one too coarse
_READ = 0.01  # N; chosen: a force is set and printed to that


@dataclass(frozen=True)
class Covered:
    """Bands of a problem on the nodes of a plan: chosen rows, and what following them costs.

    Attributes
    ----------
    rows : PassRows
        Passes by duration (s) and force (N).
    choice : array (stages, nodes)
        Row at each node, or `STOP`.
    value : array (stages, nodes)
        Expected penalty of following the bands, $.
    """

    rows: PassRows
    choice: Ints
    value: Floats


def covered(
    problem: SequenceProblem, plan: Floats, loss: float, step: float, count: int | None, progress: Progress
) -> Covered:
    """Return the bands of a problem for a plan's values, $, [stage, node]; force `step`, N.

    A decision may lose `loss`, $, and all of them together as much, where the cheapest one leaves that. At
    most `count` durations; None: as many as there are.
    """
    _refuse_modes(problem)
    rows = _grid(problem, step, plan.shape[1])
    stop = np.asarray(problem.height_charge(np.linspace(0.0, problem.height_max, plan.shape[1])), dtype=float)
    if count is not None:
        rows = _fewest(rows, stop, len(plan), count, progress)
    _refuse_coarse(problem, rows, stop, plan, loss, step, count)
    return _followed(
        rows, stop, len(plan), lambda cost, below, stage: _bands(rows, cost, below, plan[stage] + loss, loss)
    )


def followed(problem: SequenceProblem, lines: list[list[tuple[float, float, float]]], nodes: int) -> Covered:
    """Return what bands cost: for each stage (up to, mm; duration, s; force, N) from the target up."""
    _refuse_modes(problem)
    heights = np.linspace(0.0, problem.height_max, nodes)
    passes = sorted({(duration, force) for line in lines for _, duration, force in line if duration > 0})
    duration, force = np.array(passes).reshape(-1, 2).T
    rows = PassRows.of(problem, duration, force, nodes)
    number = {each: k for k, each in enumerate(passes)}
    choice = np.array([[number.get(at_height(line, x), STOP) for x in heights.tolist()] for line in lines])
    stop = np.asarray(problem.height_charge(heights), dtype=float)
    return _followed(rows, stop, len(lines), lambda cost, below, stage: choice[stage].copy())


def bands_of(problem: SequenceProblem, found: Covered) -> tuple[tuple[Band, ...], ...]:
    """Return the bands for each stage, from the target up."""
    heights = np.linspace(0.0, problem.height_max, found.choice.shape[1])
    return tuple(
        tuple(_of_stage(stage * problem.stage, heights, choice, found.rows))
        for stage, choice in enumerate(found.choice)
    )


def _of_stage(time_left: float, heights: Floats, choice: Ints, rows: PassRows) -> Iterator[Band]:
    """Bands of one stage. A height between nodes is ground as the nearer one; node 0, the target, stops."""
    ends = np.append(np.flatnonzero(np.diff(choice)), choice.size - 1)
    edges = np.concatenate([[0.0], (heights[ends[:-1]] + heights[ends[:-1] + 1]) / 2, heights[-1:]])
    edges = np.round(edges, 9).tolist()
    for k, row in enumerate(choice[ends].tolist()):
        duration, force = (0.0, nan) if row == STOP else (float(rows.duration[row]), float(rows.force[row]))
        yield Band(time_left, edges[k], edges[k + 1], duration, force)


def intervals_of(rows: PassRows, choice: Ints) -> int:
    """Return the number of ranges of one duration, or of stopping, over all stages."""
    duration = np.where(choice == STOP, 0.0, rows.duration[choice])[:, 1:]
    return int(np.count_nonzero(np.diff(duration, axis=1)) + len(choice))


def _refuse_modes(problem: SequenceProblem) -> None:
    for name in ("finish_charge", "lateness_charge"):
        if getattr(problem, name) is not None:
            raise checks.refuse(f"problem.{name}", "None for a simplified policy", getattr(problem, name))


def _grid(problem: SequenceProblem, step: float, nodes: int) -> PassRows:
    """Rows of all durations, at multiples of a step (N) and at the limit of each."""
    durations, forces = [], []
    for duration in problem.durations:
        low, high = problem.force_interval(duration)
        if low < high:
            inside = step * np.arange(np.floor(low / step) + 1, np.ceil(high / step))
            limit = np.floor(high / _READ + 1e-9) * _READ
            force = np.unique(np.append(inside[(inside > low) & (inside < limit)], limit))
            forces.append(np.round(force, 6))
            durations.append(np.full(force.size, duration))
    return PassRows.of(problem, np.concatenate(durations), np.concatenate(forces), nodes)


Choose: TypeAlias = Callable[[Floats, Ints, int], Ints]


def _followed(rows: PassRows, stop: Floats, stages: int, choose: Choose) -> Covered:
    """Follow a choice of rows from the lowest stage up; a row that no time is left for costs infinitely."""
    value, choice = np.empty((stages, stop.size)), np.full((stages, stop.size), STOP)
    nodes = np.arange(stop.size)
    blocks = [(int(s), np.flatnonzero(rows.steps == s)) for s in np.unique(rows.steps)]
    for stage in range(stages):
        cost = np.full((len(rows.force) + 1, stop.size), np.inf)  # the last row: stop
        cost[STOP] = stop
        for steps, which in blocks:
            if steps <= stage:
                cost[which] = rows.some(which).expected(value[stage - steps])
        chosen = choose(cost, choice[max(stage - 1, 0)], stage)
        chosen[0] = STOP
        choice[stage], value[stage] = chosen, cost[chosen, nodes]
    return Covered(rows, choice, value)


def _best(cost: Floats, below: Ints, stage: int) -> Ints:
    """Cheapest row of each node."""
    best = np.argmin(cost, axis=0)
    return np.where(best == len(cost) - 1, STOP, best)


def _bands(rows: PassRows, cost: Floats, below: Ints, most: Floats, loss: float) -> Ints:
    """Fewest ranges of one duration, and in each the fewest bands of one force, within `most`, $, by node."""
    duration = np.append(rows.duration, 0.0)  # the last: stop
    menu = np.unique(duration)
    least = np.array([cost[duration == t].min(axis=0) for t in menu])
    ranges = _cover(_good(least, loss, most), np.searchsorted(menu, duration[below]))
    chosen = np.full(cost.shape[1], STOP)
    for k, begin, end in _runs(ranges):
        which = np.flatnonzero(duration == menu[k])
        here = cost[which, begin:end]
        good = _good(here, FORCE_SHARE * loss, most[begin:end])
        row = which[_cover(good, np.searchsorted(which, below[begin:end] % len(duration)))]
        chosen[begin:end] = np.where(row == len(duration) - 1, STOP, row)
    return chosen


def _good(cost: Floats, loss: float, most: Floats) -> npt.NDArray[np.bool_]:
    """Mask of rows that lose little, $, against the cheapest one and in all; it is among them."""
    best = cost.min(axis=0)
    good: npt.NDArray[np.bool_] = cost <= np.maximum(best, np.minimum(best + loss, most))
    return good


def _cover(good: npt.NDArray[np.bool_], preferred: Ints) -> Ints:
    """Fewest runs of one row where all are good, by the longest reach; ties as `preferred`, [row, node]."""
    rows, nodes = good.shape
    found, node = np.empty(nodes, dtype=np.int64), 0
    while node < nodes:
        bad = ~good[:, node:]
        reach = np.where(bad.any(axis=1), np.argmax(bad, axis=1), nodes - node)
        row, before = int(np.argmax(reach)), int(preferred[node])
        if before < rows and reach[before] == reach[row]:
            row = before
        found[node : node + reach[row]] = row
        node += int(reach[row])
    return found


def _runs(of: Ints) -> Iterator[tuple[int, int, int]]:
    """Runs of equal numbers: the number, begin and end."""
    ends = np.append(np.flatnonzero(np.diff(of)) + 1, of.size)
    for begin, end in zip(np.append(0, ends[:-1]).tolist(), ends.tolist(), strict=True):
        yield int(of[begin]), begin, end


def _refuse_coarse(
    problem: SequenceProblem,
    rows: PassRows,
    stop: Floats,
    plan: Floats,
    loss: float,
    step: float,
    count: int | None,
) -> None:
    """Refuse a force step (N) by which rounding alone loses more than allowed; say which one does not."""
    if count is not None:
        return
    lost = float(np.max(_followed(rows, stop, len(plan), _best).value - plan))
    if lost <= loss:
        return
    for finer in (each for each in _STEPS if each < step):
        found = _followed(_grid(problem, finer, plan.shape[1]), stop, len(plan), _best)
        if np.max(found.value - plan) <= loss:
            rule = f"<= {finer:g} for a loss of {loss:g} $: rounding to {step:g} N loses {lost:.2g} $"
            raise checks.refuse("force_step", rule, step, "N")
    raise checks.refuse("loss", f"> {lost:.2g}, which forces in steps of {step:g} N lose", loss, "$")


def _fewest(rows: PassRows, stop: Floats, stages: int, count: int, progress: Progress) -> PassRows:
    """Rows of the `count` durations with the least mean value; each choice of them is solved."""
    menu = np.unique(rows.duration)
    if count >= menu.size:
        return rows
    tried = list(combinations(menu, count))
    means = []
    for k, durations in enumerate(tried):
        progress(k / len(tried), "durations")
        some = rows.some(np.isin(rows.duration, durations))
        means.append(_followed(some, stop, stages, _best).value.mean())
    return rows.some(np.isin(rows.duration, tried[int(np.argmin(means))]))
