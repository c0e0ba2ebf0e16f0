"""Push sequence as a problem of `sdpgrind.sdp`: offset and friction belief move on the same draw."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.special import ndtri

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.belief import FrictionScaleBelief
from centering.cycle._strategy.cycle_times import evidence_after
from centering.cycle._strategy.draw_kernels import all_draws
from centering.cycle._strategy.outcomes import OutcomeTable
from centering.cycle._strategy.timing import CycleTiming
from sdpgrind import sdp
from sdpgrind.base.checks import Floats

# chosen: dense about the offset, sparse beyond it, as the best travel is most often near the offset
_NEAR = 0.5, 0.7, 0.8, 0.86, 0.9, 0.94, 0.97, 0.985, 1.0, 1.015, 1.03, 1.06, 1.1, 1.15, 1.25, 1.4
_OVER = 1.7, 2.2, 3.0, 5.0, 8.0, 13.0, 22.0, 36.0  # chosen: the same, over the axis
FRACTIONS = np.array([*_NEAR, *_OVER])
"""Chosen: candidate mean travels over the offset; the large ones push over the axis and back.

The largest move a nearly centred part by about a stick-slip jump: a shorter push most likely sticks, and so
does the next.
"""
DRAWS = 101  # chosen: draws of friction, direction and place of a push
_LATTICE = (1, 26, 40)  # chosen: steps of a lattice of DRAWS points; small ones leave gaps between planes
_SIGMAS = 3.0  # chosen: half width of the friction axis, in standard deviations from part to part
_BEYOND = 1.5  # chosen: greatest offset of the table over that of the problem
_SURE = 1.5  # chosen: margin to the tolerance, in standard deviations of a measured offset
_MIDDLE = 0.5  # chosen: least share of the tolerance at which a part counts as centred


class Size(NamedTuple):
    """Resolution of a strategy: nodes of the offset and of the believed friction scale."""

    offsets: int = 128
    frictions: int = 7


@dataclasses.dataclass(frozen=True)
class StrategyGround:
    """Common data of all pushes of one problem; picklable."""

    problem: CenteringProblem
    outcomes: OutcomeTable
    timing: CycleTiming
    speeds: Floats
    finish: float
    size: Size

    @property
    def belief(self) -> FrictionScaleBelief:
        """Belief before the first push."""
        return FrictionScaleBelief.of(self.problem.scatter)

    @property
    def axes(self) -> tuple[sdp.Axis, sdp.Axis]:
        """Offset and friction scale."""
        return offset_axis(self.problem, self.size.offsets), friction_axis(self.problem, self.size.frictions)


def finish_offset(problem: CenteringProblem) -> float:
    """Measured offset at which a part counts as centred, mm: tolerance less the error of the measurement."""
    return problem.tolerance - min(_SURE * problem.scatter.measuring_sd, _MIDDLE * problem.tolerance)


def offset_axis(problem: CenteringProblem, nodes: int) -> sdp.Axis:
    """Axis of the offset; its low end is the goal."""
    high = _BEYOND * problem.offset_max
    return sdp.Axis("offset", finish_offset(problem), high, nodes, "mm", scale="log", below=0.0, above="hold")


def friction_axis(problem: CenteringProblem, nodes: int) -> sdp.Axis:
    """Axis of the believed friction scale; its ends serve beyond it."""
    low, high = _ends(problem)
    return sdp.Axis("friction", low, high, nodes, "", below="hold", above="hold")


def _ends(problem: CenteringProblem) -> tuple[float, float]:
    """Ends of the friction axis: of the scatter from part to part, or a deviation within the range."""
    low, high, reach = *problem.friction_range, _reach(problem)
    own = problem.scatter.friction_part_sd
    return min(max(0.6, 1 - reach), low + own), max(min(1.4, 1 + reach), high - own)


def _reach(problem: CenteringProblem) -> float:
    return max(_SIGMAS * problem.scatter.friction_part_sd, 0.01)


def resolved(problem: CenteringProblem, size: Size) -> Size:
    """Return a size with as many more nodes of friction as the range is wider than the scatter."""
    low, high = _ends(problem)
    wider = (high - low) / (2.0 * _reach(problem))
    return size._replace(frictions=max(size.frictions, round((size.frictions - 1) * wider) + 1))


def packed_axes(offset: sdp.Axis, friction: sdp.Axis) -> tuple[float, float, int, float, float, int]:
    """Axes for kernels: log of low end, log step, nodes of the offset; low end, step, nodes of friction."""
    log_step = float(np.log(offset.high / offset.low)) / (offset.nodes - 1)
    step = (friction.high - friction.low) / (friction.nodes - 1)
    return float(np.log(offset.low)), log_step, offset.nodes, friction.low, step, friction.nodes


def draws(problem: CenteringProblem) -> tuple[Floats, ...]:
    """Draws of a push: friction (1), direction (rad), place (mm), unmeasured share (mm), weight; each (Q,).

    A rank-1 lattice: no two draws share a friction, so no push profits from a few favourable frictions.
    """
    scatter = problem.scatter
    place = np.hypot(scatter.stop_sd, scatter.measuring_sd)
    hidden = scatter.measuring_sd**2 / place if place > 0 else 0.0
    unit = (np.arange(DRAWS)[:, None] * np.array(_LATTICE) / DRAWS + 0.5 / DRAWS) % 1.0
    friction, direction, where = ndtri(unit).T
    return (
        friction,
        scatter.direction_sd * direction,
        place * where,
        hidden * where,
        np.full(DRAWS, 1.0 / DRAWS),
    )


def _compiled(friction: Floats, direction: Floats, *others: Floats) -> tuple[Floats, ...]:
    """Draws for the kernel, with cosine and sine of the direction."""
    return friction, np.cos(direction), np.sin(direction), *others


@dataclasses.dataclass(frozen=True)
class KindOfPush:
    """One kind of push as a transition after `pushes` informative pushes; None: counted by the stage."""

    ground: StrategyGround
    kind: int
    settled: int

    def rows(
        self, menu: Any, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Any, level: Floats
    ) -> sdp.Rows:
        """Return the one-step distribution and the expected time, s; infinite if no stroke is long enough."""
        share = menu.controls(choice, level).share
        time, (starts, columns, weights) = self._follow(points[0], points[1], share, self._seen(stage))
        matrix = sparse.csr_array((weights, columns, starts), shape=(time.size, menu.grid.size))
        return sdp.Rows(matrix, np.zeros(time.size, dtype=np.int64), time, np.zeros(time.size))

    def sample(
        self,
        menu: Any,
        points: tuple[Floats, ...],
        mode: Any,
        stage: Any,
        choice: Any,
        level: Floats,
        rng: np.random.Generator,
    ) -> tuple[tuple[Floats, ...], Any]:
        """Draw next coordinates: nodes of the grid, by the weights of `rows`."""
        rows = self.rows(menu, points, mode, stage, choice, level)
        draw = rng.random(points[0].size)
        after = [np.array(p, dtype=float) for p in points]
        low = menu.grid.axes[0].low
        for k in range(draw.size):
            row = rows.matrix[[k]]
            total = np.cumsum(row.data)
            at = int(np.searchsorted(total, draw[k]))
            inside = at < total.size
            after[0][k] = menu.grid.points[0][row.indices[at]] if inside else low
            after[1][k] = menu.grid.points[1][row.indices[at]] if inside else after[1][k]
        return tuple(after), rows.charge

    def _seen(self, unseen: Any) -> int:
        """Pushes seen: `settled` less the remaining stages."""
        return self.settled if unseen is None else self.settled - int(np.round(np.ravel(unseen)[0]))

    def _follow(self, offset: Any, friction: Any, share: Any, seen: int) -> tuple[Floats, Any]:
        ground, out = self.ground, np.empty(np.size(offset))
        table, scatter, belief = ground.outcomes, ground.problem.scatter, ground.belief
        where, friction_scale = ground.axes
        k = self.kind
        found = all_draws(
            *(np.ascontiguousarray(np.ravel(x), dtype=float) for x in (offset, friction, share)),
            (table.travel[k], table.mean_travel[k], table.contact_time[k], table.grid, int(table.last[k])),
            (ground.speeds, ground.finish),
            (
                belief.sd(evidence_after(seen, belief.push_sd)),
                belief.push_sd,
                float(np.hypot(scatter.stop_sd, np.sqrt(2.0) * scatter.measuring_sd)),
            ),
            ground.timing.of_kind(k, seen),
            packed_axes(where, friction_scale),
            _compiled(*draws(ground.problem)),
            out,
        )
        return out, found


def moves(ground: StrategyGround, settled: int, timed: bool) -> list[sdp.Move]:
    """One move for each kind of push; `timed`: the stage coordinate counts the pushes still to come."""
    return [
        sdp.Move(kind.name, {"share": FRACTIONS}, KindOfPush(ground, k, settled), timed=timed)
        for k, kind in enumerate(ground.outcomes.kinds)
    ]
