"""Cycle of three stages as a small nonlinear program in CasADi.

At a command u = (1 + gamma) w, gamma the wheel's wear per stock, the rate is v = w + (v0 - w) e^-s, and
(1 + gamma) dt = tau(v) ds with the local time constant tau: times and infeeds are sums over s. Unknowns: the
settings (rough rate u1, stage rate u2, switching stock r1, final rate v_f) and the lengths s1, s2 of both
stages, which r1 and the start of spark-out determine. Damage is compared with the stock at levels of the rate
from the burn rate to the greatest.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq

from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss
from sdpgrind.plunge._model.dynamics import burn_depth
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem

SETTINGS = ("rough_rate", "stage_rate", "stage_remaining", "final_rate")
# fields of `StagedController`, mm/s and mm
CONSTRAINTS: Mapping[str, str] = {"burned_layer": "mm", "roundness": "mm", "grinding_power": "W"}
# bounded: excess of damage over the stock, out-of-roundness, greatest power
FREE = len(SETTINGS)
LEVELS = 24  # chosen: levels of the rate at which damage and stock are compared
_UNKNOWNS = FREE + 2
_SPANS = (0.7, 14.0), (0.0, 14.0)  # chosen: ranges of s1 and s2; s1 = 0.7 reaches half of the rough rate
_FINE, _COARSE = 12, 3  # chosen: Gauss nodes over a whole stage, and between levels


@lru_cache(maxsize=16)
def program(problem: CycleProblem) -> "StageProgram":
    """Program of a problem, cached."""
    return StageProgram(problem)


@dataclass(frozen=True, eq=False)
class StageProgram:
    """Time and conditions of a cycle, scaled to order 1."""

    problem: CycleProblem

    @cached_property
    def stage_rate_max(self) -> float:
        """Greatest stage rate (mm/s), without burning."""
        return float(min(self.lost * self.problem.model.burn_rate, 0.5 * self.problem.command_rate_max))

    @property
    def lost(self) -> float:
        """Way of the axis per stock, 1 + gamma: of work and wheel, unit 1."""
        return 1.0 + self.problem.model.wheel_wear

    @cached_property
    def burns(self) -> bool:
        """Whether the greatest rate burns."""
        return self.problem.model.burn_rate < self.problem.command_rate_max

    @cached_property
    def scale(self) -> Floats:
        """Scale of the unknowns."""
        p = self.problem
        return np.array([p.command_rate_max, self.stage_rate_max, 0.25 * p.stock, p.final_rate, 1.0, 1.0])

    @cached_property
    def box(self) -> tuple[Floats, Floats]:
        """Least and greatest scaled unknowns."""
        p = self.problem
        fast, slow, final = p.command_rate_max, self.stage_rate_max, min(p.final_rate, self.stage_rate_max)
        low = [min(2.1 * slow, 0.9 * fast), 0.1 * final, 0.0, 0.25 * final, *(low for low, _ in _SPANS)]
        high = [fast, slow, p.stock, min(2.0 * final, slow), *(high for _, high in _SPANS)]
        return np.array(low) / self.scale, np.array(high) / self.scale

    @cached_property
    def rows(self) -> dict[str, slice]:
        """Rows of the conditions: the first two are 0, the others at most a bound."""
        counts = {
            "fixed": 2,
            "burned_layer": LEVELS + 1 if self.burns else 0,
            "roundness": 1,
            "grinding_power": 1,
            "spark_out": 1,
        }
        ends = np.cumsum(list(counts.values())).tolist()
        return {
            name: slice(end - count, end) for (name, count), end in zip(counts.items(), ends, strict=True)
        }

    @cached_property
    def condition_scale(self) -> Floats:
        """Scale of the conditions."""
        p, rows = self.problem, self.rows
        scale = np.full(rows["spark_out"].stop, 0.25 * p.stock)
        scale[rows["roundness"]], scale[rows["spark_out"]] = p.roundness_max, p.final_rate
        scale[rows["grinding_power"]] = float(p.model.grinding_power(p.command_rate_max))
        return scale

    def ceilings(self, bounds: Mapping[str, float]) -> Floats:
        """Upper bounds of the scaled conditions, from bounds by name in mm and W."""
        high = np.zeros(self.condition_scale.size)
        for name in CONSTRAINTS:
            high[self.rows[name]] = bounds.get(name, np.inf)
        return high / self.condition_scale

    @cached_property
    def symbols(self) -> tuple[Any, Any, Any]:
        """Scaled unknowns, time (s) and scaled conditions in CasADi."""
        import casadi

        x = casadi.SX.sym("x", _UNKNOWNS)
        time, conditions = self._cycle(x * self.scale)
        return x, time, casadi.vertcat(*conditions) / self.condition_scale

    def _cycle(self, x: Any) -> tuple[Any, list[Any]]:
        """Time, and conditions in the order of `rows`."""
        import casadi

        core, model, stock = self.problem.model.core, self.problem.model, self.problem.stock
        u1, u2, r1, final, s1, s2 = (x[k] for k in range(_UNKNOWNS))
        w1, w2 = u1 / self.lost, u2 / self.lost
        v1 = w1 * (1 - casadi.exp(-s1))
        v2 = w2 + (v1 - w2) * casadi.exp(-s2)
        first, second = _duration(w1, 0.0, s1, core), _duration(w2, v1, s2, core)
        last = _duration(0.0, v2, casadi.log(v2 / final), core)
        switch = stock - (w1 * first - _beyond(v1, core)) / self.lost
        fed = w1 * first + w2 * second
        conditions = [r1 - switch, fed - self.lost * stock - _beyond(final, core)]
        conditions += self._layers(w1 * first, w2, v1, v2) if self.burns else []
        conditions += [model.roundness_base + model.roundness_gain * final / model.turns]
        conditions += [core.power0 + core.power1 * v1 + core.power2 * v1**core.p, final - v2]
        return core.K0 / u1 + (first + second + last) / self.lost, conditions

    def _layers(self, commanded: Any, w2: Any, v1: Any, v2: Any) -> list[Any]:
        """Damage less stock (mm) while the rate falls from v1 to the burn rate."""
        import casadi

        core, model, layers, above = self.problem.model.core, self.problem.model, [], v1
        shares = np.linspace(1.0, 0.0, LEVELS)
        levels = [model.burn_rate + share * (v1 - model.burn_rate) for share in shares]
        corner = casadi.fmax(v2, model.burn_rate)  # rate at spark-out, if it burns
        for v in [*levels, corner]:
            fed = casadi.fmax(v, v2)  # no feed below v2
            if v is not corner:
                commanded += w2 * _duration(w2, above, casadi.log((above - w2) / (fed - w2)), core, _COARSE)
            removed = (commanded - _beyond(v, core)) / self.lost
            layers.append(burn_depth(v, core, casadi.log) - (self.problem.stock - removed))
            above = fed
        return layers

    @cached_property
    def values(self) -> Any:
        """Function of the unknowns: time and conditions."""
        import casadi

        x, time, conditions = self.symbols
        return casadi.Function("values", [x], [time, conditions])

    @cached_property
    def _fixed(self) -> Any:
        import casadi

        x, _, conditions = self.symbols
        return casadi.Function("fixed", [x], [conditions[:2]])

    @cached_property
    def derivatives(self) -> Any:
        """Function: gradient of time, conditions, Jacobian, Hessian of time plus priced conditions."""
        import casadi

        x, time, conditions = self.symbols
        prices = casadi.SX.sym("prices", conditions.numel())
        curvature = casadi.hessian(time + casadi.dot(prices, conditions), x)[0]
        terms = [casadi.gradient(time, x), conditions, casadi.jacobian(conditions, x), curvature]
        return casadi.Function("derivatives", [x, prices], [casadi.densify(term) for term in terms])

    def at(self, settings: Mapping[str, float]) -> Floats:
        """Scaled unknowns of settings, inside the box."""
        low, high = self.box
        x = np.array([*(settings[name] for name in SETTINGS), 1.0, 1.0]) / self.scale
        x[:FREE] = np.clip(x[:FREE], low[:FREE], high[:FREE])
        for k, (least, most) in enumerate(_SPANS):  # the first condition fixes s1, then the second s2
            x[FREE + k] = self._root(x, k, least, most)
        return x

    def _root(self, x: Floats, k: int, least: float, most: float) -> float:
        def off(span: float) -> float:
            x[FREE + k] = span
            return float(self._fixed(x)[k])

        if off(least) >= 0:
            return least
        return most if off(most) <= 0 else float(brentq(off, least, most, xtol=1e-12))

    def settings(self, x: Floats) -> dict[str, float]:
        """Settings of scaled unknowns, mm/s and mm."""
        return dict(zip(SETTINGS, (x * self.scale)[:FREE].tolist(), strict=True))

    def reached(self, x: Floats) -> tuple[float, dict[str, float]]:
        """Time (s), and the greatest value of each bounded quantity (mm, W), at scaled unknowns."""
        time, conditions = (np.asarray(each).ravel() for each in self.values(x))
        found = {name: (conditions * self.condition_scale)[self.rows[name]] for name in CONSTRAINTS}
        return float(time[0]), {name: float(np.max(value)) for name, value in found.items() if value.size}


def _duration(u: Any, start: Any, span: Any, core: PlungeCore, nodes: int = _FINE) -> Any:
    """Time (s) at a command u from a rate `start` until v = u + (start - u) e^-span, without wheel wear."""
    import casadi

    total: Any = 0.0
    power = 2.0 / core.p if isinstance(start, float) else 1.0  # from rest the time constant has a weak pole
    for node, weight in zip(*leggauss(nodes), strict=True):
        share = 0.5 * (1 + node)
        v = u + (start - u) * casadi.exp(-span * share**power)
        total += (
            0.5 * weight * power * share ** (power - 1) * (core.K1 + core.p * core.K2 * v ** (core.p - 1))
        )
    return span * total


def _beyond(v: Any, core: PlungeCore) -> Any:
    return core.K1 * v + core.K2 * v**core.p
