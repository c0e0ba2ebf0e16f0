"""Friction belief about a part from its pushes: mean and standard deviation of the friction scale."""

from math import sqrt
from typing import NamedTuple

from centering._problem.problem import PushScatter
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity


class Belief(NamedTuple):
    """Belief about the friction of a part.

    Attributes
    ----------
    friction : float
        Mean of the friction scale, unit 1.
    evidence : float
        Equivalent number of fully informative pushes, which determines the standard deviation; 0 where it is
        wider than the scatter from part to part.
    weights : array, (R,), optional
        Weights of the friction scales of the tables, unit 1: the belief with its whole form.
    """

    friction: float
    evidence: float
    weights: Floats | None = None


class PushEvidence(NamedTuple):
    """What a push shows of friction.

    Attributes
    ----------
    expected : array, (K, R)
        Values expected at the friction scales of the tables: travel, mm; sum of forces, N.
    noise, seen : array, (K,)
        Standard deviations of the observed values, and these.
    """

    expected: Floats
    noise: Floats
    seen: Floats


@described("centering.belief")
class FrictionScaleBelief(Described):
    """Belief about the friction scale of a part: its friction over that of the model, for both coefficients.

    From part to part the scale has mean 1 and standard deviation `part_sd`; each push scatters about it by
    `push_sd`. After n informative pushes the variance is ``1/(1/part_sd^2 + n/push_sd^2)``: the mean and n
    are the whole state.

    Parameters
    ----------
    part_sd, push_sd : float
        Standard deviations from part to part and from push to push, relative.

    Raises
    ------
    ValueError
        One is negative.

    Examples
    --------
    >>> belief = FrictionScaleBelief(part_sd=0.08, push_sd=0.04)
    >>> [round(belief.sd(pushes), 4) for pushes in (0, 1, 3)]
    [0.08, 0.0358, 0.0222]
    >>> round(belief.next_sd(0), 4), round(belief.evidence(belief.sd(3)), 6)
    (0.0894, 3.0)
    """

    part_sd: float = quantity("relative", at_least=0)
    push_sd: float = quantity("relative", at_least=0)

    @classmethod
    def of(cls, scatter: PushScatter) -> "FrictionScaleBelief":
        """Return the belief before the first push under the `scatter` of a problem (relative sd)."""
        return cls(scatter.friction_part_sd, scatter.friction_push_sd)

    def sd(self, pushes: float) -> float:
        """Return the relative standard deviation of the part's scale after `pushes` informative pushes."""
        prior, noise = self.part_sd**2, self.push_sd**2
        return sqrt(prior * noise / (noise + pushes * prior)) if noise + pushes * prior > 0 else 0.0

    def next_sd(self, pushes: float) -> float:
        """Return the relative standard deviation of the scale at the next push."""
        return sqrt(self.sd(pushes) ** 2 + self.push_sd**2)

    def evidence(self, sd: float) -> float:
        """Return the number of informative pushes that leaves a relative standard deviation of `sd`."""
        if self.part_sd == 0.0 or self.push_sd == 0.0 or sd <= 0.0:
            return 0.0
        return max(0.0, self.push_sd**2 * (1.0 / sd**2 - 1.0 / self.part_sd**2))
