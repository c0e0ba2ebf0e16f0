"""Chance that damage reaches below the finished surface, and the depth exceeded with a given chance.

At a rate v, damage is deeper than a remaining stock r where eta + G(v, A) > r/reach(v), with G the logarithm
of the surface temperature over that of damage and eta = -d ln B. ln B, ln alpha and ln A are normal and
independent. One of them is integrated exactly: that which moves the sum most, so that the integrand over the
others, by Gauss and Hermite, is smooth.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ndtr

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model.dynamics import allowed_rate, coolest_rate
from sdpgrind.plunge._model.kernels import PlungeCore

NODES = 21  # chosen: nodes of each quadrature; 31 change no digit of a rate
HALVINGS = 60  # derived: a bracket shrinks below the rounding of a double
_FAR = 8.0  # derived: standard deviations; a normal exceeds them with a chance of 6e-16
_SLOWEST, _FASTEST = 0.1, 10.0  # chosen: rates of the search over the coolest without doubts
_EXACT = 1e-12  # derived: doubt (ln) that moves no digit of a depth; thresholds over less than it overflow
_NEVER = 1e-300  # derived: keeps a logarithm finite
_LEAST_SHARE = 1e-9  # chosen: least rate of the search over the greatest, where no rate is the coolest


@dataclass(frozen=True)
class BurnChance:
    """Chance of damage below the finished surface with doubts of B, diffusivity and wear flat area (ln)."""

    core: PlungeCore
    burning_sd: float = 0.0
    diffusivity_sd: float = 0.0
    sharpness_sd: float = 0.0

    def __post_init__(self) -> None:
        for name in ("burning_sd", "diffusivity_sd", "sharpness_sd"):
            if getattr(self, name) < _EXACT:
                object.__setattr__(self, name, 0.0)

    def __call__(self, rate: Any, remaining: Any) -> Floats:
        """Chance at rates (mm/s) and remaining stocks (mm, >= 0), shape of both broadcast."""
        v, r = np.broadcast_arrays(np.asarray(rate, dtype=float), np.asarray(remaining, dtype=float))
        out = np.empty(v.shape)
        inner = self._widest(v, r)
        for k, threshold in enumerate((self._of_burning, self._of_diffusivity, self._of_sharpness)):
            at = inner == k
            if np.any(at):
                out[at] = self._mean(threshold, k, v[at], r[at])
        return out

    def _sds(self) -> tuple[float, float, float]:
        return self.burning_sd, self.diffusivity_sd, self.sharpness_sd

    def _widest(self, v: Floats, r: Floats) -> Floats:
        """Number of the doubt that moves eta + G - r/reach most."""
        c = self.core
        heat = c.heat0 + c.heat1 * v + c.heat2 * v**c.p
        by_depth = 0.5 * self.diffusivity_sd * r / (c.reach * v**0.25)
        by_area = self.sharpness_sd * c.heat2 * v**c.p / heat
        moved = np.stack([np.full(v.shape, self.burning_sd), by_depth, by_area])
        return np.asarray(np.argmax(moved, axis=0))

    def _mean(self, threshold: Callable[..., Floats], inner: int, v: Floats, r: Floats) -> Floats:
        """Mean of the chance that the inner normal exceeds its threshold, over the two others."""
        moves, weights = _grid(self._sds(), inner)
        return np.asarray(weights @ ndtr(-threshold(v.ravel(), r.ravel(), *moves)))

    def _excess(self, v: Floats, area: Floats) -> Floats:
        """Logarithm G of surface temperature over that of damage, with the area moved by `area` (ln)."""
        c = self.core
        return np.asarray(np.log((c.heat0 + c.heat1 * v + c.heat2 * np.exp(area) * v**c.p) / v**0.25))

    def _depth(self, v: Floats, r: Floats, diffusivity: Floats) -> Floats:
        """Remaining stock over reach, with the diffusivity moved by `diffusivity` (ln)."""
        return np.asarray(r * np.exp(-0.5 * diffusivity) / (self.core.reach * v**0.25))

    def _of_burning(self, v: Floats, r: Floats, eta: Floats, diffusivity: Floats, area: Floats) -> Floats:
        off = self._depth(v, r, diffusivity) - self._excess(v, area)
        sure = np.where(off < 0.0, -np.inf, np.inf)
        return np.asarray(off / self.burning_sd) if self.burning_sd > 0.0 else np.asarray(sure)

    def _of_diffusivity(self, v: Floats, r: Floats, eta: Floats, diffusivity: Floats, area: Floats) -> Floats:
        hot = np.maximum(self._excess(v, area) + eta, 0.0)
        with np.errstate(divide="ignore"):
            return np.asarray(2.0 / self.diffusivity_sd * np.log(self._depth(v, r, 0.0 * eta) / hot))

    def _of_sharpness(self, v: Floats, r: Floats, eta: Floats, diffusivity: Floats, area: Floats) -> Floats:
        c = self.core
        sliding = v**0.25 * np.exp(self._depth(v, r, diffusivity) - eta) - c.heat0 - c.heat1 * v
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(np.maximum(sliding, 0.0) / (c.heat2 * v**c.p)) / self.sharpness_sd)

    def quantile(self, rate: Floats, confidence: float) -> Floats:
        """Depths (mm, >= 0) that damage exceeds with a chance of 1 - confidence, at rates (mm/s)."""
        hot = self._excess(rate, np.full(rate.shape, _FAR * self.sharpness_sd)) + _FAR * self.burning_sd
        reach = self.core.reach * rate**0.25 * np.exp(0.5 * _FAR * self.diffusivity_sd)
        low, high = np.zeros(rate.shape), np.maximum(hot, 0.0) * reach
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            deeper = self(rate, middle) > 1.0 - confidence
            low, high = np.where(deeper, middle, low), np.where(deeper, high, middle)
        return np.asarray(high)

    def safe_rate(self, remaining: float, confidence: float, rate_max: float) -> float:
        """Greatest rate up to `rate_max` (mm/s) that is safe above `remaining` (mm); 0: none is."""
        allowed = 1.0 - confidence
        if self._at(rate_max, remaining) <= allowed:
            return rate_max
        if self.burning_sd == self.diffusivity_sd == self.sharpness_sd == 0.0:
            return float(allowed_rate(self.core, np.array([remaining]), rate_max)[0])
        low = max(min(float(coolest_rate(self.core)), rate_max), _LEAST_SHARE * rate_max)
        if self._at(low, remaining) > allowed:
            low = self.coolest(low, remaining)
            if self._at(low, remaining) > allowed:
                return 0.0
        return float(
            brentq(lambda v: self._at(v, remaining) - allowed, low, rate_max, xtol=1e-15, rtol=1e-13)
        )

    def coolest(self, near: float, remaining: float = 0.0) -> float:
        """Rate (mm/s) of the least chance above `remaining` (mm), of those near one."""
        low, high = np.log(_SLOWEST * near), np.log(_FASTEST * near)
        found = minimize_scalar(
            lambda x: np.log(self._at(np.exp(x), remaining) + _NEVER), bounds=(low, high), method="bounded"
        )
        return float(np.exp(found.x))

    def _at(self, rate: float, remaining: float) -> float:
        return float(self(rate, remaining))


@lru_cache
def _grid(sds: tuple[float, float, float], inner: int) -> tuple[tuple[Floats, ...], Floats]:
    """Moves of the three doubts (ln), each (q, 1), the inner one at its mean; weights, (q,)."""
    rules = [_rule(sd > 0.0 and k != inner) for k, sd in enumerate(sds)]
    moves = np.meshgrid(*(sd * x for sd, (x, _) in zip(sds, rules, strict=True)), indexing="ij")
    weights = np.prod(np.meshgrid(*(w for _, w in rules), indexing="ij"), axis=0)
    return tuple(move.ravel()[:, None] for move in moves), weights.ravel()


@lru_cache
def _rule(doubted: bool) -> tuple[Floats, Floats]:
    """Nodes and weights of a standard normal, or the mean alone."""
    if not doubted:
        return np.zeros(1), np.ones(1)
    nodes, weights = hermegauss(NODES)
    return nodes, weights / weights.sum()
