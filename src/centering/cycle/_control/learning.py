"""Learning from pushes: travel of the part along and across the push."""

from dataclasses import dataclass
from math import cos, hypot, inf, pi, sin

import numpy as np

from centering.cycle._control.launch import Approach, SentPush
from centering.cycle._control.next_push import ChosenPush, PushStrategy
from centering.cycle._control.part_view import PartView
from centering.cycle._control.push_evidence import FeltPush
from centering.cycle._strategy.belief import Belief
from centering.cycle._strategy.density import lower_end, prior, widened
from centering.cycle._strategy.outcomes import FRICTION_SCALES
from centering.cycle._strategy.table_limit import least_friction
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

# chosen: excess travel from turning, relative and in mm, above which a push is no evidence of friction
_TOLD, _HIDDEN = 0.05, 2e-3
_LONG = 1.0  # mm, chosen: the error of a longer push is mainly its direction; short pushes show it better
_MEMORY = 4.0  # chosen: greatest evidence, in pushes; friction may change, and models err
_TELLING = 0.02  # mm, chosen: shorter travels are no evidence of the direction
_STRANGE = 5.0  # chosen: standard deviations from part to part; exceeded by one part of a million
_IDLE = 12  # chosen: such pushes without halving the offset; at even odds one part of 4000
_DIRECTION_BIAS = 0.0035  # rad, chosen: prior sd of a constant error of direction


@dataclass(frozen=True)
class RingTravel(Frozen):
    """Travel of a part, from the centres before and after a push.

    Parameters
    ----------
    along, across : float
        Travel along the direction of the push on the table, and to its left, mm.

    Examples
    --------
    >>> from math import pi
    >>> travel = RingTravel.between((3.0, 4.0), (0.0, 0.0), towards=0.0)
    >>> travel.along, travel.across, travel.distance  # mm
    (-3.0, -4.0, 5.0)
    """

    along: float
    across: float

    @classmethod
    def between(
        cls, before: tuple[float, float], after: tuple[float, float], *, towards: float
    ) -> "RingTravel":
        """Return the travel between centres (mm) in a push directed on the table at `towards` (rad)."""
        x, y = after[0] - before[0], after[1] - before[1]
        return cls(x * cos(towards) + y * sin(towards), y * cos(towards) - x * sin(towards))

    @property
    def distance(self) -> float:
        """Length of the travel, mm."""
        return hypot(self.along, self.across)


class LearnedBias:
    """Constant observed in noise: mean and variance, updated by each observation (scalar Kalman filter).

    Parameters
    ----------
    sd : float
        Prior standard deviation, > 0.

    Examples
    --------
    >>> bias = LearnedBias(0.01)
    >>> bias.see(0.02, 0.01)
    >>> bias.value, round(bias.sd, 6)
    (0.01, 0.007071)
    """

    def __init__(self, sd: float) -> None:
        self._start = sd
        self.reset()

    def reset(self) -> None:
        """Return to the prior."""
        self.value, self._variance = 0.0, self._start**2

    @property
    def sd(self) -> float:
        """Standard deviation of the constant."""
        return float(self._variance**0.5)

    def see(self, value: float, sd: float) -> None:
        """Add an observation.

        Parameters
        ----------
        value, sd : float
            Observed value and standard deviation of its noise.
        """
        gain = self._variance / (self._variance + sd * sd)
        self.value += gain * (value - self.value)
        self._variance *= 1.0 - gain


@dataclass(frozen=True)
class _Pushed(Frozen):
    """Executed push: centre and sd before (mm), direction on the table (rad), its command and start."""

    x: float
    y: float
    sd: float
    choice: ChosenPush
    towards: float
    push: SentPush
    start: Approach

    @property
    def turned(self) -> bool:
        """Whether turning changed the travel so much that it is not that on a table at rest."""
        beyond = abs(self.push.beyond)
        return self.choice.aim > _LONG or beyond > max(_TOLD * self.choice.aim, _HIDDEN)


class PartLearner:
    """Knowledge from the pushes of a part: friction, by the strategy's rule, and a constant direction error.

    Parameters
    ----------
    strategy : Strategy
        Strategy with its problem and rule of belief.
    lag : float
        Delay of the loaded slide, s. With a lag a push that the table changes is no evidence of friction.
    force_max : float
        End of the range of the force sensor, N. Default: infinite.
    """

    def __init__(self, strategy: PushStrategy, lag: float = 0.0, force_max: float = inf) -> None:
        self._strategy, self._direction, self._lag = strategy, LearnedBias(_DIRECTION_BIAS), lag
        self._force_max = force_max
        self._prior = prior(strategy.problem, 1.0, 0.0)
        self.reset()

    def reset(self) -> None:
        """Forget the part."""
        self._direction.reset()
        self._belief = Belief(1.0, 0.0)
        self.least = least_friction(self._strategy.problem)  # factor that the part exceeds with 99.9 %
        self._last: _Pushed | None = None
        self._times: list[float] = []  # of the samples of its forces, from its start, s
        self._forces: list[float] = []  # N
        # Offset (mm) that is to be halved, and pushes since the last that did so.
        self._nearest, self._idle = inf, 0

    @property
    def bias(self) -> float:
        """Mean deviation of pushes to the left of their aim, rad."""
        return self._direction.value

    @property
    def friction(self) -> float:
        """Mean of the believed friction scale."""
        return self._belief.friction

    @property
    def evidence(self) -> float:
        """Evidence of the belief, in pushes."""
        return self._belief.evidence

    @property
    def strange(self) -> bool:
        """Whether friction is outside the range of the strategy."""
        problem = self._strategy.problem
        low, high = problem.friction_range
        beyond = _STRANGE * problem.scatter.friction_part_sd
        return not low * (1.0 - beyond) <= self.friction <= high * (1.0 + beyond)

    @property
    def hopeless(self) -> bool:
        """Whether friction is outside the range and pushes no longer reduce the offset."""
        return self.strange and self._idle >= _IDLE

    def pushed(self, view: PartView, choice: ChosenPush, push: SentPush, start: Approach) -> None:
        """Record the place of a part that is being pushed.

        Parameters
        ----------
        view : PartView
            Current estimate of the part.
        choice : PushChoice
            The push.
        push : SentPush
            Its command.
        start : Approach
            Its start.
        """
        towards = view.offset_angle + pi - self.bias
        self._last = _Pushed(view.x, view.y, view.sd, choice, towards, push, start)
        self._times, self._forces = [], []

    def thrown(self, friction: float) -> None:
        """Believe that the part has at most a factor of friction, which did not hold it on the table."""
        below = np.where(friction >= FRICTION_SCALES, self._prior, 0.0)
        if below.any():
            mean = float(below @ FRICTION_SCALES / below.sum())
            self._belief = Belief(mean, 0.0, below / below.sum())
        self.least = min(self.least, friction)
        self._last = None

    def feel(self, time: float, force: float) -> None:
        """Record a force (N) of the push, at a time (s) from its start."""
        self._times.append(time)
        self._forces.append(force)

    def see(self, view: PartView) -> None:
        """Evaluate the last push, once; `view` knows the new place (mm)."""
        last, self._last = self._last, None
        if last is None:
            return
        travel = RingTravel.between((last.x, last.y), (view.x, view.y), towards=last.towards)
        self._learn(last, travel.distance, hypot(last.sd, view.sd))
        self._count(view.offset)
        if travel.along > _TELLING:
            spread = hypot(
                self._strategy.problem.scatter.direction_sd, hypot(last.sd, view.sd) / travel.along
            )
            self._direction.see(travel.across / travel.along, spread)

    def _learn(self, last: _Pushed, travelled: float, sd: float) -> None:
        """Update the belief by the last push and its travel, with its sd (mm); forget what is old."""
        before = self._prior if self._belief.weights is None else self._belief.weights
        shown = None
        if last.turned or self.evidence == 0.0:
            if self._lag > 0.0:  # the rows make up for a lag that the simulated tip does not have
                return
            shown = self._felt(last).evidence(before, travelled, sd)
        told = max(travelled - last.push.beyond, 0.0)
        friction, evidence, weights = Belief(
            *self._strategy.update_belief(
                self.friction, self.evidence, last.choice, told, weights=before, shown=shown
            )
        )
        if weights is not None:
            self.least = self._least_after(evidence, weights)
            weights = widened(weights, min(1.0, _MEMORY / max(evidence, _MEMORY)))
        self._belief = Belief(friction, min(evidence, _MEMORY), weights)

    def _felt(self, last: _Pushed) -> FeltPush:
        """Return the last push with the forces of its samples."""
        return FeltPush(
            last.push, last.start, self._strategy.problem.model, self._times, self._forces, self._force_max
        )

    def _least_after(self, evidence: float, weights: Floats) -> float:
        """Factor of friction that the part exceeds with 99.9 %: the problem's until a push has told."""
        problem = self._strategy.problem
        if evidence <= 0.0:
            return least_friction(problem)
        return lower_end(weights, problem.scatter.friction_push_sd)

    def _count(self, offset: float) -> None:
        """Count pushes at friction outside the range that did not halve the offset (mm)."""
        nearer = not self.strange or offset <= 0.5 * self._nearest
        self._nearest, self._idle = (offset, 0) if nearer else (self._nearest, self._idle + 1)
