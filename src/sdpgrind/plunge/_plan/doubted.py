"""Limits of a cycle that keeps a confidence.

The depth that damage exceeds with a chance of 1 - confidence takes the place of the depth of damage. Without
a gauge, the remaining stock is doubted as well: by the place of contact and by the deflection at the rate.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq
from scipy.special import ndtri

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.envelope import EnvelopeLimits
from sdpgrind.plunge._plan.exact import fastest

_OF_DAMAGE = ("burning_sd", "diffusivity_sd", "sharpness_sd")
_OF_STOCK = ("contact_zero_sd", "deflection_sd")
_NARROWED = {  # what narrows a doubt
    "burning_sd": "inspecting parts for burn narrows it",
    "sharpness_sd": "CycleController learns the wear flat area within the part, from power",
    "contact_zero_sd": "a gauge makes up for it",
    "deflection_sd": "plunge.identify of a cycle, or a gauge, narrows it",
}
DEGREE = 40  # chosen: of the depth over the logarithm of the rate; `error` of a plan tells what it costs


@dataclass(frozen=True)
class DoubtedLimits(EnvelopeLimits):
    """Limits of the rate whose depth of damage, mm, is a polynomial in the logarithm of the rate."""

    depth: Chebyshev

    def of_both(self) -> Self:
        """Limits of the radius that work and wheel lose together, without wear."""
        growth = 1.0 + self.wear
        depth = Chebyshev(np.multiply(growth, self.depth.coef), self.depth.domain + np.log(growth))
        return replace(super().of_both(), depth=depth)

    def z(self, v: float) -> float:
        """Depth of damage, mm, that is exceeded with the chance allowed."""
        return float(self.depth(np.log(v)))

    def slope_of_z(self, v: Floats) -> Floats:
        """dz/dv, s."""
        return np.asarray(self.depth.deriv()(np.log(v)) / v)

    def rate_at(self, r: float) -> float:
        """Greatest rate (mm/s) whose damage is at most the stock `r` less the margin."""
        if not self.burns or self.z(self.rate_max) <= r - self.margin:
            return self.rate_max
        if r - self.margin <= self.z(self.burn_rate):
            return self.burn_rate
        rate = brentq(lambda v: self.z(v) - (r - self.margin), self.burn_rate, self.rate_max, xtol=1e-16)
        return float(rate)


class Safety(NamedTuple):
    """Distance of damage from the remaining stock (mm), confidence or None, whether the size is measured."""

    margin: float = 0.0
    confidence: float | None = None
    gauge: bool = True

    @property
    def doubts(self) -> dict[str, Any]:
        """Confidence and gauge by name."""
        return {"confidence": self.confidence, "gauge": self.gauge}


def limits_of(problem: CycleProblem, safety: Safety, degree: int = DEGREE) -> EnvelopeLimits:
    """Limits of a cycle; with no confidence all values are as believed."""
    margin, confidence, gauge = safety
    model, most = problem.model, problem.command_rate_max
    if confidence is None:
        return EnvelopeLimits(
            model.core,
            most,
            model.burn_rate,
            problem.final_rate,
            margin,
            problem.stock,
            wear=model.wheel_wear,
        )
    chance, slowest = problem.burn_chance, problem.safe_rate(0.0, confidence)
    spread = _StockSpread(problem, float(ndtri(confidence)), gauge)
    shift = margin + float(spread(slowest))
    if slowest >= most:
        return EnvelopeLimits(
            model.core, most, np.inf, problem.final_rate, shift, problem.stock, wear=model.wheel_wear
        )

    def depth(x: Floats) -> Floats:
        v = np.exp(x)
        return np.asarray(chance.quantile(v, confidence) + spread(v) - spread(slowest))

    found = Chebyshev.interpolate(depth, degree, domain=[np.log(slowest), np.log(most)])
    return DoubtedLimits(
        model.core, most, slowest, problem.final_rate, shift, problem.stock, found, wear=model.wheel_wear
    )


@dataclass(frozen=True)
class _StockSpread:
    """What an unmeasured remaining stock may lack at a rate, mm; nothing with a gauge."""

    problem: CycleProblem
    k: float
    gauge: bool

    def __call__(self, rate: Any) -> Any:
        if self.gauge:
            return 0.0 * rate
        doubts, core = self.problem.uncertainty, self.problem.model.core
        deflection = core.K0 + _kernels.beyond.py_func(rate, core)
        return self.k * np.hypot(doubts.contact_zero_sd, doubts.deflection_sd * deflection)


def margin_and_doubts(problem: CycleProblem, safety: Safety) -> tuple[float, DoubtedLimits | None]:
    """Margin (mm) of a replay, and the limits where doubts bind."""
    limits = limits_of(problem, safety)
    return limits.margin, limits if isinstance(limits, DoubtedLimits) else None


def price_of(problem: CycleProblem, safety: Safety, time: float) -> dict[str, float]:
    """Seconds by which a cycle of `time` (s) is shorter without each doubt alone, and without all."""
    if safety.confidence is None:
        return {"all": 0.0}
    doubts = problem.uncertainty
    felt = [
        name for name in (_OF_DAMAGE if safety.gauge else _OF_DAMAGE + _OF_STOCK) if getattr(doubts, name)
    ]

    def without(*names: str) -> float:
        known = problem.replace(uncertainty=doubts.replace(**dict.fromkeys(names, 0.0)))
        return time - fastest(limits_of(known, safety))[0]

    return {name: without(name) for name in felt} | {"all": without(*felt)}


def price_told(price: Mapping[str, float], time: float) -> list[str]:
    """Sentence on what the doubts cost in a cycle of a time (s), the dearest of them, and what narrows it."""
    each = {name: seconds for name, seconds in price.items() if name != "all"}
    if not each:
        return []
    cost, most = price["all"], max(each, key=lambda name: each[name])
    share = f"{100.0 * cost / (time - cost):.1f} % of the cycle without them"
    how = f": {_NARROWED[most]}" if most in _NARROWED else ""
    return [f"The doubts cost {cost:.3g} s, {share}; most of it {most}, {each[most]:.3g} s alone{how}."]
