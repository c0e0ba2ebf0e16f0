"""A planned cycle: its course over time, how good it is, and how it was found."""

import dataclasses
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sdpgrind.base import pictures, stored
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.plans import Plan
from sdpgrind.plunge._model.problem import CycleProblem

if TYPE_CHECKING:
    import xarray as xr

SOLVED = "solved"
DEEPER = 5e-4
"""By how much (mm) the damage may go deeper than allowed between the places at which the limit is kept: what no gauge sees."""


@stored.stored("plunge.solution")
@dataclasses.dataclass(frozen=True)
class CycleSolution(Frozen):
    """How a cycle was found by steps, and what its commands do when they are played through the dynamics.

    Attributes
    ----------
    steps : int
        Stages of remaining stock, or intervals of collocation.
    iterations : int
        Of the interior-point method; 0 without.
    residual : float
        Largest violation of the optimality conditions of the program, unknowns scaled to order 1, unit 1; 0 without a program.
    excess : float
        How much deeper than allowed the damage goes anywhere, mm.
    left : float
        Stock that is left, mm.
    message : str
        What the solver says.
    """

    steps: int
    iterations: int
    residual: float
    excess: float
    left: float
    message: str

    @property
    def ok(self) -> bool:
        """Whether it is solved, and its commands keep the limits."""
        return self.message == SOLVED and self.excess <= DEEPER and self.left == 0.0


class CycleError(ValueError):
    """A cycle that could not be found.

    Attributes
    ----------
    message : str
        Why not.
    plan : CyclePlan
        The best that was reached; its time (s) is none to rely on.
    """

    def __init__(self, message: str, plan: "CyclePlan") -> None:
        super().__init__(message)
        self.message, self.plan = message, plan


class CyclePlan(Plan):
    """The fastest way to grind a part; immutable.

    Attributes
    ----------
    problem : CycleProblem
        What was planned.
    safety_margin : float
        By how much less than the remaining stock the damage may go down, mm.
    time : float
        Time of the cycle, s.
    error : float
        Estimated error of that time, s; infinite where it could not be solved.
    switches : tuple of float
        Times at which its pieces end, s: for "dp" and "collocation" the end of full rate, the beginning of spark-out, the end.
    trajectory : xarray.Dataset
        The course over time: remaining stock, rates, deflection, depth of damage, power, wear flat area, rotation, with units.
        For "dp" and "collocation" it is what the planned commands do in the dynamics of the model.
    method : str
        How it was planned.
    solution : CycleSolution or None
        How "dp" or "collocation" went; None for "exact".
    """

    kind = "plunge.cycle"

    def __init__(
        self,
        problem: CycleProblem,
        safety_margin: float,
        error: float,
        switches: tuple[float, ...],
        course: "xr.Dataset | Callable[[], xr.Dataset]",
        method: str = "exact",
        solution: CycleSolution | None = None,
    ):
        self.problem, self.safety_margin, self.error, self.switches = problem, safety_margin, error, switches
        self._course, self.method, self.solution = course, method, solution

    @cached_property
    def trajectory(self) -> "xr.Dataset":
        """The course over time (s, mm, mm/s, W, rad/s)."""
        return self._course() if callable(self._course) else self._course

    @cached_property
    def time(self) -> float:
        """Time of the cycle, s."""
        return float(self.trajectory.time[-1])

    @property
    def roundness(self) -> float:
        """Out-of-roundness that is left, mm."""
        model, end = self.problem.model, self.trajectory.isel(time=-1)
        depth = float(end.infeed_rate) * 2 * np.pi / float(end.work_rotation)
        return float(model.roundness_base + model.roundness_gain * depth)

    @property
    def binding(self) -> str:
        """What limits the rate at the end (mm/s): "roundness", "burning", or the greatest "command"."""
        base, most = self.problem.model.roundness_base, self.problem.roundness_max
        if self.roundness - base >= (most - base) * (1 - 1e-5):
            return "roundness"
        full = float(self.trajectory.infeed_rate[-1]) >= 0.99 * self.problem.command_rate_max
        return "command" if full else "burning"

    @property
    def status(self) -> str:
        """One sentence: how good it is, and what stands in the way (depths in mm)."""
        if self.solution is None:
            return "exact: nothing within the limits is faster"
        s = self.solution
        if s.message != SOLVED:
            return f"{s.message} after {s.iterations} iterations with {s.steps} steps"
        if s.left > 0:
            return f"{s.message}, but played back, the commands leave {s.left:.3g} mm of stock"
        deeper = (
            f"damage goes {1e3 * s.excess:.1g} µm deeper than allowed"
            if s.excess > 0
            else "all limits are kept"
        )
        return f"{s.message} with {s.steps} steps, time known to {self.error:.1g} s; played back, {deeper}"

    def plot(self) -> Any:
        """Draw rates, and depth of damage under the remaining stock (mm), over time (s); return the figure."""
        t = self.trajectory
        figure, (top, low) = pictures.subplots(2, 1, (8, 5), sharex=True)
        top.step(t.time, 1e3 * t.command_rate, where="post", color="0.6", lw=1, label="command")
        top.plot(t.time, 1e3 * t.infeed_rate, color=pictures.ACTUAL, label="actual")
        top.set(ylabel="infeed rate [µm/s]")
        low.plot(t.time, t.remaining, color="0.35", label="remaining stock")
        burning = (
            t.infeed_rate > self.problem.model.burn_onset[0]
        )  # below it damage is an artefact of ploughing
        low.plot(
            t.time,
            np.maximum(t.burn_depth, 0.0).where(burning, 0.0),
            color=pictures.LIMIT,
            label="depth of damage",
        )
        low.set(ylabel="depth from the size [mm]", xlabel="time [s]")
        for axis in (top, low):
            pictures.legend(axis)
            for switch in self.switches[:-1]:
                axis.axvline(switch, color="0.8", lw=0.8, zorder=0)
        figure.suptitle(f"{self.time:.2f} s, {1e3 * self.roundness:.2f} µm out of round", fontsize=10)
        return figure

    @cached_property
    def dataset(self) -> "xr.Dataset":
        """All of it as labelled arrays."""
        attrs = {
            "problem": stored.encode(self.problem),
            "safety_margin": self.safety_margin,
            "error": self.error,
        }
        if self.solution is not None:
            attrs["solution"] = stored.encode(self.solution)
        return self.trajectory.assign_attrs(attrs | {"switches": list(self.switches), "method": self.method})

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        told = dataset.attrs
        problem, ends = stored.decode(told["problem"]), tuple(np.atleast_1d(told["switches"]).tolist())
        solution = stored.decode(told["solution"]) if "solution" in told else None
        known = float(told["safety_margin"]), float(told["error"]), ends, dataset.drop_attrs(deep=False)
        return cls(problem, *known, told.get("method", "exact"), solution)

    def _told(self) -> str:
        pieces = f"{len(self.switches)} pieces, {self.binding} at the end"
        return f"{self.time:.4f} s, error {self.error:.1g} s, {self.method}, {pieces}"
