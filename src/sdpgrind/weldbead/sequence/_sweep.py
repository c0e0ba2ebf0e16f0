"""Many problems planned in parallel, and sensitivities of the expected penalty."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats, one_of, positive, refuse
from sdpgrind.base.parallel import execute
from sdpgrind.base.progress import silent
from sdpgrind.weldbead.sequence._plan import plan
from sdpgrind.weldbead.sequence._problem import SequenceProblem

MODEL = ("specific_energy", "idle_power", "friction_ratio", "disk_radius", "free_speed")
FACTORS = (*MODEL, "force_max", "relative_sd", "under", "over")


def sweep(
    problems: Mapping[str, SequenceProblem],
    *,
    height: Any,
    time_left: Any,
    tolerance: float = 1e-4,
    executor: Executor | None = None,
) -> dict[str, Any]:
    """Plan several problems and return the expected penalty of each at the same states.

    Parameters
    ----------
    problems : mapping of str to SequenceProblem
        Problems to plan, by name.
    height, time_left : float or array
        States, mm and s.
    tolerance : float
        Tolerance of each plan, $.
    executor : concurrent.futures.Executor, optional
        Plans one problem per task; results do not depend on it.

    Returns
    -------
    dict
        Expected penalty ($) by name.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> short = {"durations": (6, 12), "height_max": 1.0, "horizon": 24.0}  # s, mm, s
    >>> problem, laws = weldbead.preset("P1").replace(**short), ("rayleigh", "lognormal")
    >>> cases = {law: problem.replace(scatter=weldbead.Scatter("C1", 0.15, law=law)) for law in laws}
    >>> found = weldbead.sequence.sweep(cases, height=1.0, time_left=24.0, tolerance=1e-2)
    >>> {law: round(penalty, 3) for law, penalty in found.items()}
    {'rayleigh': 0.071, 'lognormal': 0.074}
    """
    work = partial(_value, height, time_left, tolerance)
    return dict(zip(problems, execute(work, list(problems.values()), executor), strict=True))


def _value(height: Any, time_left: Any, tolerance: float, problem: SequenceProblem) -> Any:
    return plan(problem, tolerance=tolerance, progress=silent).value(height, time_left)


@dataclass(frozen=True)
class Sensitivity:
    """Answer of the expected penalty to relative changes.

    Attributes
    ----------
    names : tuple of str
        Factors that were changed.
    elasticity : array
        Change of the expected penalty per 100 % of each factor, by central differences, $.
    value : float
        Expected penalty, $.
    """

    names: tuple[str, ...]
    elasticity: Floats
    value: float

    def __getitem__(self, name: str) -> float:
        return float(self.elasticity[self.names.index(name)])

    def plot(self) -> Any:
        """Draw the sensitivities as bars; return the figure."""
        figure, ax = pictures.subplots(1, 1, (6, 0.35 * len(self.names) + 1))
        order = np.argsort(np.abs(self.elasticity))
        ax.barh([self.names[k] for k in order], 0.01 * self.elasticity[order], color=pictures.ACTUAL)
        ax.axvline(0, color="k", lw=0.8)
        ax.set_xlabel("change of the expected penalty for + 1 % [$]")
        return figure


def sensitivity(
    problem: SequenceProblem,
    *,
    height: float,
    time_left: float,
    names: Sequence[str] = FACTORS,
    step: float = 0.02,
    tolerance: float = 1e-5,
    executor: Executor | None = None,
) -> Sensitivity:
    """Return the sensitivity of the expected penalty at a state to several factors.

    Parameters
    ----------
    problem : SequenceProblem
        Problem to plan.
    height, time_left : float
        State, mm and s.
    names : sequence of str
        Any of: specific_energy, idle_power, friction_ratio, disk_radius, free_speed, force_max, relative_sd
        (the scatter), under, over (the sides of the height charge).
    step : float
        Relative change to either side, unit 1.
    tolerance : float
        Tolerance of each plan, $.
    executor : concurrent.futures.Executor, optional
        Plans one case per task; results do not depend on it.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> exact = weldbead.preset("P1").replace(scatter=weldbead.Scatter("C1", 0.0))
    >>> found = weldbead.sequence.sensitivity(exact, height=1.0, time_left=6.0, names=["friction_ratio"])
    >>> round(found["friction_ratio"], 3)  # $
    -0.816
    """
    positive("step", step, "1")
    if isinstance(names, str) or not len(names):
        raise refuse("names", f"a sequence of one or more of {', '.join(FACTORS)}", names)
    for name in names:
        one_of("names", name, FACTORS)
    cases = {f"{name} {sign}": _changed(problem, name, 1 + sign * step) for name in names for sign in (-1, 1)}
    found = sweep(
        {"": problem} | cases, height=height, time_left=time_left, tolerance=tolerance, executor=executor
    )
    slope = [(found[f"{name} 1"] - found[f"{name} -1"]) / (2 * step) for name in names]
    return Sensitivity(tuple(names), np.array(slope), float(found[""]))


def _changed(problem: SequenceProblem, name: str, factor: float) -> SequenceProblem:
    if name in MODEL:
        return problem.replace(**{name: factor * getattr(problem.model, name)})
    if name == "force_max":
        return problem.replace(force_max=factor * problem.force_max)
    if name == "relative_sd":
        sd = problem.scatter.relative_sd
        return problem.replace(
            scatter=replace(
                problem.scatter,
                relative_sd=tuple(factor * r for r in sd) if isinstance(sd, tuple) else factor * sd,
            )
        )
    side = getattr(problem.height_charge, name)
    amount = {sdp.Constant: "amount", sdp.Linear: "rate", sdp.Quadratic: "factor"}.get(type(side))
    if amount is None:
        raise ValueError(f"names must not hold {name!r} where that side is a function; got {side!r}")
    scaled = replace(side, **{amount: factor * getattr(side, amount)})
    return problem.replace(height_charge=replace(problem.height_charge, **{name: scaled}))
