"""Problems without scatter: the expected penalty in closed form.

Without scatter any depth up to D_k(t) can be ground away in k passes within the time t, and nothing is ground
below the target. With the charge C of the height x, p of a pass and f of the feed of the last pass::

    J(x, t) = min over k and last passes of  C(max(0, x - D_k(t))) + k p + f
    D_k(t) = max over durations T of  c(T) + D_{k-1}(t - T)

c(T) is the mean cut at the greatest force. The cuts of the chosen passes share the height in proportion.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._problem import SequenceProblem

Ints = npt.NDArray[np.int64]
TIE = 1e-9  # $; chosen: a smaller gain is rounding and earns no further pass
HAIR = 1e-12  # chosen: share of the height that the last pass leaves; rounding must not overgrind
NOTHING = 1e-12  # mm; chosen: least mean cut that counts as none
TOGETHER = 2048  # chosen: states evaluated together; more cost memory


class Choice(NamedTuple):
    """First passes of states: -1 or number of the move, its mean cut (mm), and the cost of each, $.

    `costs` has one column for stopping, then one a move.
    """

    move: Ints
    cut: Floats
    costs: Floats


@dataclass(frozen=True)
class Knapsack:
    """Greatest depths of k passes with a last one, [stage, option], mm, and what they cost; see the module.

    Attributes
    ----------
    problem : SequenceProblem
        Problem without scatter.
    cut, duration : array (moves,)
        Greatest mean cut, mm, and duration, stages.
    feed_rate, force : array (moves,), (2, moves)
        Feed, mm/s; least and greatest force, N.
    finish : array (modes,)
        Finish charge of the last pass, $; first mode: no pass.
    depth, price : array
        Greatest depth [stage, option], mm, -inf: not in time; charge of the passes, $ [option].
    """

    problem: SequenceProblem
    cut: Floats
    duration: Ints
    feed_rate: Floats
    force: Floats
    finish: Floats
    depth: Floats
    price: Floats

    @classmethod
    def of(cls, problem: SequenceProblem, seconds: list[float], count: int) -> "Knapsack":
        """Fill the table for moves of some durations, s, and `count` stages."""
        feed = np.array([problem.feed_rate(each) for each in seconds])
        force = np.array([problem.force_interval(each) for each in seconds]).T
        cut = np.array(problem.depths.moments(problem.model, force[1], feed)[0])
        duration = np.array([round(each / problem.stage) for each in seconds])
        charge = problem.finish_charge
        last = np.zeros(1) if charge is None else np.asarray(charge(feed))
        depth = _depths(cut, duration, count, charge is not None)
        price = problem.pass_charge * np.arange(1, depth.shape[1] + 1)[:, None] + last
        finish = np.zeros(1 if charge is None else 1 + cut.size)
        finish[1:] = last if charge is not None else 0.0
        return cls(problem, cut, duration, feed, force, finish, depth.reshape(count + 1, -1), price.ravel())

    def value(self, height: Floats, stage: Ints, mode: Ints) -> Floats:
        """Return the expected penalty, $, of heights, mm, with stages left, in modes."""
        stop = self._charge(height) + self.finish[mode]
        left = height[:, None] - self.depth[stage]
        cost = self._charge(left) + self.price
        return np.asarray(np.minimum(stop, cost.min(axis=1, initial=np.inf)))

    def slope(self, height: Floats, stage: Ints, mode: Ints) -> Floats:
        """Return the derivative of the expected penalty by height, $/mm."""
        left = np.column_stack([height, height[:, None] - self.depth[stage]])
        cost = self._charge(left) + np.column_stack([self.finish[mode], np.tile(self.price, (mode.size, 1))])
        best = left[np.arange(mode.size), np.argmin(cost, axis=1)]
        return np.where(best > 0, self.problem.height_charge.slope(np.maximum(best, 0.0)), 0.0)

    def choose(self, height: Floats, stage: Ints, mode: Ints) -> Choice:
        """Return the first pass of heights, mm, with stages left, in modes: fewest passes of least cost."""
        costs = np.full((height.size, 1 + self.cut.size), np.inf)
        costs[:, 0] = self._charge(height) + self.finish[mode]
        options = []
        for k in range(self.cut.size):
            depth, price = self._first(k, stage)
            each = self._charge(height - depth) + price
            costs[:, 1 + k] = each.min(axis=0)
            options.append((depth, each))
        least = costs.min(axis=1)
        move, share = self._fewest(height, least, options)
        move = np.where(costs[:, 0] <= least + TIE, -1, move)
        return Choice(move, np.where(move < 0, 0.0, share * self.cut[np.maximum(move, 0)]), costs)

    def _first(self, k: int, stage: Ints) -> tuple[Floats, Floats]:
        """Depths [option, state] and charges of all that may begin with `k`: it alone, then with each option.

        States go last: their rows are long, those of options are short.
        """
        left = stage - self.duration[k]
        after = np.take(self.depth.T, np.maximum(left, 0), axis=1)
        depth = np.concatenate([np.zeros((1, left.size)), after])
        depth[:, left < 0] = -np.inf
        finish = self.finish[1 + k] if self.finish.size > 1 else 0.0
        price = self.problem.pass_charge + np.append(finish, self.price)
        return self.cut[k] + depth, price[:, None]

    def _fewest(
        self, height: Floats, least: Floats, options: list[tuple[Floats, Floats]]
    ) -> tuple[Ints, Floats]:
        """Move and share of its cut: the fewest passes at the least cost, of these the deepest."""
        lasts = max(1, self.finish.size - 1)
        passes = np.append(1, 2 + np.arange(self.price.size) // lasts)[:, None]
        move, best = np.full(height.size, -1), np.full((2, height.size), np.inf)  # passes, and depth below 0
        for k, (depth, cost) in enumerate(options):
            number = np.where(cost <= least + TIE, passes, np.inf)
            fewest = number.min(axis=0)
            deepest = -np.where(number == fewest, depth, -np.inf).max(axis=0)
            better = (fewest < best[0]) | ((fewest == best[0]) & (deepest < best[1]))
            move[better], best[:, better] = k, np.stack([fewest, deepest])[:, better]
        with np.errstate(divide="ignore", invalid="ignore"):
            return move, np.minimum(1.0, height * (1 - HAIR) / -best[1])

    def _charge(self, height: Floats) -> Floats:
        """Charge of heights that are left, $; below 0: none; inf: infinite."""
        under = self.problem.height_charge.under
        assert isinstance(under, sdp.Linear | sdp.Quadratic)  # has_closed_form
        with np.errstate(invalid="ignore"):  # infinite heights that nothing is charged for
            return np.where(height == np.inf, np.inf, under(height))


def has_closed_form(problem: SequenceProblem) -> bool:
    """Whether the formula of this module holds: no scatter, no lateness, any small cut, a convex charge."""
    under, beads = problem.height_charge.under, problem.bead_scatter
    certain = problem.scatter.total == 0 and (beads is None or not np.any(beads.log_covariance))
    plain = problem.lateness_charge is None and isinstance(under, sdp.Linear | sdp.Quadratic)
    return certain and plain and all(_any_cut(problem, each) for each in problem.durations)


def _any_cut(problem: SequenceProblem, duration: float) -> bool:
    """Whether a pass may remove next to nothing; also one that is not admissible."""
    low, high = problem.force_interval(duration)
    least = problem.depths.moments(problem.model, low, problem.feed_rate(duration))[0]
    return low >= high or float(least) <= NOTHING


def _depths(cut: Floats, duration: Ints, count: int, lasts: bool) -> Floats:
    """Greatest depths [stage, passes - 1, last pass], mm; one column where the last pass does not matter."""
    most = max(1, count // int(duration.min()))
    depth = np.full((count + 1, most, cut.size if lasts else 1), -np.inf)
    for stage in range(count + 1):
        for k in np.flatnonzero(duration <= stage):
            here, last = depth[stage], k if lasts else 0
            here[0, last] = max(here[0, last], cut[k])
            here[1:] = np.maximum(here[1:], cut[k] + depth[stage - duration[k], :-1])
    return depth
