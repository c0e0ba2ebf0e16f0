"""Modifier adaptation: correct a wrong model until its optimum is that of the plant.

In iteration k a bias and gradient modifiers correct the problem (Marchetti, Chachuat and Bonvin 2009):

    minimise phi(z) + q . z   subject to   P(z) + b + p . (z - z_k) <= 0,

with b, p, q such that P and the gradients of P and phi equal those of the plant at z_k. At a fixed point the
optimality conditions hold for the plant: P = 0 and grad phi + mu grad P = 0 are the same equations for both.

Slopes of the plant along its limit are enough: dP = 0 fixes the direction of the limit, and dphi = 0 the
rest, whatever the multiplier. A dither costs to second order along the limit, to first order across it. The
controls move along the corrected limit in a pattern of signs; a linear fit with a trend gives the slopes.
"""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import KW_ONLY
from functools import cached_property
from math import isnan, nan
from typing import Self

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, choice, custom, described, part, quantity, text
from sdpgrind.locus._adaptation.modified import Modified
from sdpgrind.locus._problem.problem import Problem

FEEDBACK = ("state", "bias")
STILL = 0.5  # chosen: share of the dither; a direction in which the point moves less gives no reliable slope


def pattern(n: int) -> Floats:
    """Signs (2^(n+1), n) for n directions, orthogonal to each other, their products and a trend.

    Column i is the product of the signs of binary digits i to n + 1 of the row; the first is Thue-Morse.
    """
    rows = np.arange(2 ** (n + 1))
    digits = np.array([1.0 - 2.0 * (rows >> (n - j) & 1) for j in range(n + 1)])
    return np.array([np.prod(digits[i:], axis=0) for i in range(n)]).T


class ModifierAdaptation:
    """State of modifier adaptation; controls are scaled."""

    def __init__(self, n: int, hidden: float, center: Floats):
        self.hidden, self.bias, self.center = hidden, 0.0, center
        self.constraint, self.cost, self.reference = np.zeros(n), np.zeros(n), np.zeros(n)
        self.units, self.directions, self.signs, self.row = np.eye(n), np.empty((n, 0)), np.empty((0, 0)), 0
        self.rows: list[tuple[float, ...]] = []
        self.slack, self.failures, self.command, self.believed = nan, 0, center, hidden

    def modifiers(self) -> Floats:
        """Return the hidden states (2 + 2n,) of `Modified`."""
        return np.concatenate(
            [[self.hidden, self.bias - self.constraint @ self.reference], self.constraint, self.cost]
        )


@described(eq=False)
class ModifierController(Described):
    """Modifier adaptation: correct the model by measured values and slopes, and move to its optimum.

    It reaches the optimum of a structurally different plant, which no locus of the model contains, at the
    price of a dither along the limit and of slow convergence. Measured are the response and, where the cost
    model may be wrong, the cost. Each reading must be of a settled plant.

    Parameters
    ----------
    problem : Problem
        The model: one hidden state, one constraint.
    feedback : {"state", "bias"}
        Correction per sample of the constraint. "state": the hidden state that explains the reading; the
        point moves along the corrected locus. "bias": a constraint bias at a fixed hidden state.
    hidden : float, optional
        Initial hidden state, in its unit. Default: middle of its range.
    dither : float
        Amplitude along the limit, share of the (logarithmic, where positive) ranges of the controls. Slopes
        count less when the point itself moves farther.
    across : float
        Amplitude across the limit, unit 1 as above. 0: none, unless no constraint is active (`dither`).
    filter : float
        Weight (0, 1] of new slopes, once per pattern: 2^n samples for n controls, 2^(n+1) with `across`.
    gain : float
        Weight (0, 1] of a new hidden state or bias, per sample.
    trust : float
        Greatest move per sample, share of the ranges.
    margin : float
        Distance kept from the limit, in its unit.
    cost : str, optional
        Name of the measured cost. None: the cost model is exact.
    period : float, optional
        Sampling period, s. None: one sample per event of the plant.

    Raises
    ------
    ValueError
        When the problem has several hidden states or constraints, or a value is out of range.

    Examples
    --------
    A plant with another power of v, which the model cannot represent:

    >>> from sdpgrind import locus
    >>> controller = ModifierController(locus.preset("koren-example"), hidden=1.0, dither=1e-3)
    >>> for _ in range(400):
    ...     u, v = controller.command.values()
    ...     _ = controller.step(response=v**1.2 + 16 - 4 * v, cost=(u - 1) ** 2 + (v - 4) ** 2)
    >>> {name: round(value, 3) for name, value in controller.center.items()}  # the model alone: 2 and 3
    {'u': 2.027, 'v': 2.517}
    """

    problem: Problem = part(Problem, " (see locus.preset)")
    _: KW_ONLY
    feedback: str = choice(*FEEDBACK, default="state")
    hidden: float | None = custom(default=None)
    dither: float = quantity("1", above=0, below=0.25, default=0.01)
    across: float = quantity("1", at_least=0, below=0.25, default=0.0)
    filter: float = quantity("1", above=0, at_most=1, default=0.5)
    gain: float = quantity("1", above=0, at_most=1, default=1.0)
    trust: float = quantity("1", above=0, at_most=1, default=0.1)
    margin: float = custom(checks.number, default=0.0)
    cost: str | None = text(default="cost")
    period: float | None = quantity("s", above=0, default=None)

    def _check(self) -> None:
        if len(self.problem.hidden) != 1 or len(self.problem.varying) != 1:
            told = f"{len(self.problem.hidden)} and {len(self.problem.varying)}"
            raise ValueError(f"problem must have one hidden state and one constraint; got {told}")
        if self.problem.system.limit_varies:
            raise ValueError(
                "limit must not depend on the hidden state, for a controller is to compute it; it does"
            )
        _ = self.start_hidden

    @property
    def start_hidden(self) -> float:
        """Initial hidden state, in its unit."""
        (name,) = self.problem.hidden_names
        low, high = self.problem.hidden[name]
        return (
            0.5 * (low + high)
            if self.hidden is None
            else checks.within(name, self.hidden, low, high, self.problem.unit(name))
        )

    @property
    def response(self) -> str:
        """Name of the measured response; its unit: `Problem.unit`."""
        return self.problem.varying[0].name

    @cached_property
    def _modified(self) -> Modified:
        return Modified(self.problem)

    @cached_property
    def state(self) -> ModifierAdaptation:
        """Learned state (scaled, unit 1)."""
        n = self._modified.n
        modifiers = np.append(self.start_hidden, np.zeros(1 + 2 * n))
        if not self._modified.begin(modifiers):
            raise ValueError(f"hidden must be a state with a feasible point; {self.start_hidden:g} has none")
        state = ModifierAdaptation(n, self.start_hidden, self._modified.point[:n].copy())
        self._begin(state)
        self._move(state)
        return state

    def __deepcopy__(self, memo: object) -> Self:
        """Return a controller in the same state."""
        twin = self.replace()
        for name in ("state", "_modified"):
            if name in self.__dict__:
                twin.__dict__[name] = deepcopy(self.__dict__[name])
        return twin

    @property
    def reads(self) -> Mapping[str, str]:
        """Name of each measurement to its unit."""
        return {name: self.problem.unit(name) for name in (self.response, self.cost) if name is not None}

    @property
    def commands(self) -> Mapping[str, str]:
        """Name of each control to its unit."""
        return {name: self.problem.unit(name) for name in self.problem.names}

    @property
    def reports(self) -> Mapping[str, str]:
        """Name of each reported value to its unit."""
        (name,) = self.problem.hidden_names
        return {
            name: self.problem.unit(name),
            "bias": self.problem.unit(self.response),
            "slack": self.problem.unit(self.response),
        }

    def reset(self) -> None:
        """Return to the initial state."""
        self.__dict__.pop("state", None)

    @property
    def command(self) -> dict[str, float]:
        """Current controls with dither, in the user's units."""
        return dict(zip(self.problem.names, self.state.command.tolist(), strict=True))

    @property
    def center(self) -> dict[str, float]:
        """Current controls without dither, in the user's units."""
        return dict(
            zip(self.problem.names, self._modified.model.unscaled(self.state.center).tolist(), strict=True)
        )

    def step(self, **measurement: float) -> dict[str, float]:
        """Return the controls of the next sample, in the user's units.

        Parameters
        ----------
        **measurement : float
            Response and cost by name, in their units (NaN: no reading). Others are ignored.

        Raises
        ------
        ValueError
            When a measurement is missing.
        """
        for name in self.reads:
            if name not in measurement:
                raise ValueError(f"measurement must have {name!r}; got {', '.join(measurement) or 'nothing'}")
        state, response = self.state, float(measurement[self.response])
        cost = 0.0 if self.cost is None else float(measurement[self.cost])
        if not (isnan(response) or isnan(cost)):
            self._learn(response, cost)
        state.row += 1
        if state.row == len(state.signs):
            self._turn()
            self._begin(state)
        self._improve()
        self._move(state)
        return self.command

    def _learn(self, response: float, cost: float) -> None:
        """Add the reading to the pattern and correct hidden state or bias."""
        state, modified, z = self.state, self._modified, self.state.command
        limit = modified.limit(z)
        P = response - limit + self.margin
        tilt = float(state.constraint @ (z - state.reference))
        known, paid, _ = modified.values(z, state.believed)
        place = state.center + state.directions @ state.signs[state.row]
        state.rows.append((P - tilt - known, cost - paid - float(state.cost @ z), state.row, *place))
        state.slack = self.margin - P
        if self.feedback == "state":
            found = modified.hidden_of(z, P - tilt + limit)
            state.hidden += self.gain * (found - state.hidden)
            state.bias = P - tilt - modified.values(z, found)[0]  # 0, unless the hidden state is clamped
        else:
            state.bias += self.gain * (P - tilt - modified.values(z, state.hidden)[0] - state.bias)

    def _turn(self) -> None:
        """Correct the modifiers by the slopes fitted over the pattern."""
        state, model = self.state, self._modified.model
        rows, state.rows = np.array(state.rows), []
        k = state.directions.shape[1]
        if len(rows) < k + 2:
            return
        slopes = state.units[:, :k] @ self._fitted(rows, k) / model.unscaled_slope(state.center)[:, None]
        here = model.unscaled(state.center)
        state.bias += float(state.constraint @ (here - state.reference))
        state.reference = here
        believed = self.filter * self._stillness(rows)
        state.constraint = state.constraint + believed * slopes[:, 0]
        if self.cost is not None:
            state.cost = state.cost + believed * slopes[:, 1]

    def _stillness(self, rows: Floats) -> float:
        """Return the weight (0, 1] of the slopes: small when the point moved farther than the dither."""
        centers = rows[:, 3:] - (self.state.directions @ self.state.signs[rows[:, 2].astype(int)].T).T
        return float(1 / (1 + np.sum(np.var(centers, axis=0)) / self.dither**2))

    def _fitted(self, rows: Floats, k: int) -> Floats:
        """Return slopes (k, 2) of constraint and cost along the k dithered directions.

        Motion of the point in other directions is fitted too; `STILL` pulls slopes without motion to 0.
        """
        places = (rows[:, 3:] - rows[:, 3:].mean(axis=0)) @ self.state.units / self.dither
        planes = np.column_stack([places, np.ones(len(rows)), rows[:, 2] - rows[:, 2].mean()])
        others = places.shape[1] - k
        still = np.zeros((others, planes.shape[1]))
        still[:, k : k + others] = STILL * np.eye(others)
        given = np.vstack([rows[:, :2], np.zeros((others, 2))])
        return np.asarray(np.linalg.lstsq(np.vstack([planes, still]), given, rcond=None)[0][:k] / self.dither)

    def _begin(self, state: ModifierAdaptation) -> None:
        """Choose the directions of the next pattern: along the corrected limit and across it."""
        model, n = self._modified.model, self._modified.n
        z = model.unscaled(state.center)
        normal = (self._modified.values(z, state.hidden)[2] + state.constraint) * model.unscaled_slope(
            state.center
        )
        basis = np.linalg.svd(normal[None])[2]  # the first row is across, the others along
        sizes = np.full(n, self.dither)
        if self._modified.active:
            sizes[0] = self.across
        order, k = np.argsort(sizes == 0, kind="stable"), int(np.sum(sizes > 0))
        state.units, state.signs = basis[order].T, pattern(k)
        state.directions = state.units[:, :k] * sizes[order[:k]]
        state.row, state.believed = 0, state.hidden

    def _improve(self) -> None:
        """Move to the optimum of the corrected model, at most by `trust`."""
        state = self.state
        best = self._modified.best(state.modifiers())
        if best is None:
            state.failures += 1
        else:
            room, step = max(self.dither, self.across), np.clip(best - state.center, -self.trust, self.trust)
            state.center = np.clip(state.center + step, room, 1 - room)

    def _move(self, state: ModifierAdaptation) -> None:
        state.command = self._modified.model.unscaled(
            state.center + state.directions @ state.signs[state.row]
        )

    def report(self) -> dict[str, float]:
        """Return hidden state, bias and last slack, in the user's units."""
        state = self.state
        return dict(zip(self.reports, (state.hidden, state.bias, state.slack), strict=True))
