"""Density of a part's friction scale over the scales of the tables: before a push, moments, lower end."""

from typing import Any

import numpy as np
from scipy.special import ndtr

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.belief import FrictionScaleBelief
from centering.cycle._strategy.outcomes import FRICTION_SCALES
from sdpgrind.base.checks import Floats

_DOUBT = 0.1  # chosen: weight of the whole range of friction before the first push; 1 ignores what is told
_STRANGERS = 1e-3  # chosen: share of parts with any friction, uniform in its logarithm over the table
_FACTORS = 41  # chosen: factors over the range; neighbours are closer than the scatter of parts
_SMALL = 1e-3  # derived: what 99.9 % exceed
_WIDTHS = np.gradient(FRICTION_SCALES)
_EDGES = np.concatenate(([0.0], 0.5 * (FRICTION_SCALES[1:] + FRICTION_SCALES[:-1]), [np.inf]))


def prior(problem: CenteringProblem, friction: float, evidence: float) -> Floats:
    """Return the weights of the scales, (R,), before a push: told scatter, range of friction, any friction.

    The range has a part only without evidence: a push that tells of friction tells of the range, too.
    """
    belief, doubt = FrictionScaleBelief.of(problem.scatter), _DOUBT if evidence == 0.0 else 0.0
    told = _normal(np.array([friction]), np.array([belief.sd(evidence)]))
    factors = friction * np.geomspace(*problem.friction_range, _FACTORS)
    wide = _normal(factors, factors * belief.part_sd)
    strange = np.gradient(np.log(FRICTION_SCALES))
    mixed = (1.0 - doubt) * told + doubt * wide
    return np.asarray((1.0 - _STRANGERS) * mixed + _STRANGERS * strange / strange.sum())


def _normal(mean: Floats, sd: Floats) -> Floats:
    """Mean weights of normal laws; those of sd 0 lie on the nearest scale."""
    with np.errstate(divide="ignore", invalid="ignore"):
        below = np.where(sd > 0.0, ndtr((_EDGES[:, None] - mean) / sd), _EDGES[:, None] > mean)
    return np.asarray(np.diff(below, axis=0).mean(axis=1))


def moments(weights: Floats) -> tuple[float, float]:
    """Return the mean of the scale, and the half width of its middle two thirds: sd of a normal law.

    The few parts of any friction hardly widen it.
    """
    below = np.cumsum(weights)[:-1]
    low, high = np.interp((ndtr(-1.0), ndtr(1.0)), below, _EDGES[1:-1])
    return float(weights @ FRICTION_SCALES), float(0.5 * (high - low))


def widened(weights: Floats, share: float) -> Floats:
    """Return the weights with a `share` of their evidence: a normal law keeps its mean."""
    powers = (weights / _WIDTHS) ** share * _WIDTHS
    return np.asarray(powers / powers.sum())


def lower_end(weights: Floats, push_sd: float) -> float:
    """Return the scale that a push exceeds with 99.9 %; pushes scatter about the part by `push_sd`."""
    at: Any = np.linspace(0.5 * FRICTION_SCALES[0], FRICTION_SCALES[-1], 1000)
    below = ndtr((at[:, None] - FRICTION_SCALES) / (push_sd * FRICTION_SCALES + 1e-9)) @ weights
    return float(np.interp(_SMALL, below, at))
