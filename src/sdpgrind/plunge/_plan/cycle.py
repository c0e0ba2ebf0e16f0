"""Planned cycle: course over time, error, method."""

import dataclasses
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sdpgrind.base import pictures, stored
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.plans import Plan
from sdpgrind.base.sheets.amounts import Interval
from sdpgrind.base.sheets.blocks import AmountTable, Block, Sentences, figures
from sdpgrind.base.units import UM
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.control_table import ControlStages, stage_table, stages_of

if TYPE_CHECKING:
    import xarray as xr

SOLVED = "solved"
ROUNDING = 1e-9  # chosen: excess of the depth of damage that is rounding, mm; derived: 1e-8 of a stock
DEEPER = 5e-4  # chosen: tolerance of the depth of damage between nodes, mm; below the noise of a gauge


@stored.stored("plunge.solution")
@dataclasses.dataclass(frozen=True)
class CycleSolution(Frozen):
    """Solution of "dp" or "collocation", and the result of replaying its commands.

    Attributes
    ----------
    steps : int
        ControlStages of remaining stock, or intervals of collocation.
    iterations : int
        Iterations of the interior-point method; 0 without.
    residual : float
        Greatest scaled violation of the optimality conditions, unit 1; 0 without a program.
    excess : float
        Greatest excess of the depth of damage over its limit, mm.
    left : float
        Remaining stock, mm.
    message : str
        Message of the solver.
    """

    steps: int
    iterations: int
    residual: float
    excess: float
    left: float
    message: str

    @property
    def ok(self) -> bool:
        """Whether the solver succeeded and the replayed commands keep the limits."""
        return self.message == SOLVED and self.excess <= DEEPER and self.left == 0.0


class CycleError(ValueError):
    """Failure to find a cycle.

    Attributes
    ----------
    message : str
        Reason.
    plan : CyclePlan
        Last plan reached, with an unreliable time (s).
    """

    def __init__(self, message: str, plan: "CyclePlan") -> None:
        super().__init__(message)
        self.message, self.plan = message, plan


class CyclePlan(Plan):
    """Fastest cycle of a problem; immutable.

    Attributes
    ----------
    problem : CycleProblem
        Planned problem.
    safety_margin : float
        Minimum distance between burn depth and remaining stock, mm.
    time : float
        Time of the cycle, s.
    error : float
        Estimated error of the time, s; inf: not solved.
    switches : tuple of float
        End times of the pieces, s; for "dp" and "collocation": end of full rate, start of spark-out, end.
    trajectory : xarray.Dataset
        The course over time with units: stock, rates, deflection, depth of damage, power, wear flat area,
        rotation. For "dp" and "collocation": of the commands replayed in the model.
    method : str
        Method of the plan.
    solution : CycleSolution or None
        Solution of "dp" or "collocation"; None: "exact".
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
        """Course over time (s, mm, mm/s, W, rad/s)."""
        return self._course() if callable(self._course) else self._course

    @cached_property
    def time(self) -> float:
        """Time of the cycle, s."""
        return float(self.trajectory.time[-1])

    @property
    def roundness(self) -> float:
        """Out-of-roundness at the end, mm."""
        model, end = self.problem.model, self.trajectory.isel(time=-1)
        depth = float(end.infeed_rate) * 2 * np.pi / float(end.work_rotation)
        return float(model.roundness_base + model.roundness_gain * depth)

    @property
    def binding(self) -> str:
        """Active limit of the rate (mm/s) at the end: "roundness", "burning" or "command"."""
        base, most = self.problem.model.roundness_base, self.problem.roundness_max
        if self.roundness - base >= (most - base) * (1 - 1e-5):
            return "roundness"
        full = float(self.trajectory.infeed_rate[-1]) >= 0.99 * self.problem.command_rate_max
        return "command" if full else "burning"

    @property
    def status(self) -> str:
        """Quality of the plan in one sentence (depths in mm)."""
        if self.solution is None:
            return "exact: nothing within the limits is faster"
        s = self.solution
        if s.message != SOLVED:
            return f"{s.message} after {s.iterations} iterations with {s.steps} steps"
        if s.left > 0:
            return f"{s.message}, but played back, the commands leave {s.left:.3g} mm of stock"
        excess = f"damage goes {1e3 * s.excess:.1g} µm deeper than allowed"
        deeper = excess if s.excess > 0 else "all limits are kept"
        return f"{s.message} with {s.steps} steps, time known to {self.error:.1g} s; played back, {deeper}"

    def plot(self) -> Any:
        """Draw rates, and damage below the remaining stock (mm), over time (s); return the figure."""
        t = self.trajectory
        figure, (top, low) = pictures.subplots(2, 1, (8, 5), sharex=True)
        top.step(t.time, 1e3 * t.command_rate, where="post", color="0.6", lw=1, label="command")
        top.plot(t.time, 1e3 * t.infeed_rate, color=pictures.ACTUAL, label="actual")
        top.set(ylabel="infeed rate [µm/s]")
        low.plot(t.time, t.remaining, color="0.35", label="remaining stock")
        burning = t.infeed_rate > self.problem.model.burn_onset[0]  # below: artefact of ploughing
        damage = np.maximum(t.burn_depth, 0.0).where(burning, 0.0)
        low.plot(t.time, damage, color=pictures.LIMIT, label="depth of damage")
        low.set(ylabel="depth from the size [mm]", xlabel="time [s]")
        for axis in (top, low):
            pictures.legend(axis)
            for switch in self.switches[:-1]:
                axis.axvline(switch, color="0.8", lw=0.8, zorder=0)
        figure.suptitle(f"{self.time:.2f} s, {1e3 * self.roundness:.2f} µm out of round", fontsize=10)
        return figure

    @cached_property
    def _stages(self) -> ControlStages:
        deeper = max(DEEPER, 0.0 if self.solution is None else self.solution.excess)
        return stages_of(self.problem, self.trajectory, self.switches, self.safety_margin, deeper)

    def _control_table(self) -> tuple[AmountTable, Sentences]:
        """Table that an operator keys in, and what the model makes of it."""
        stages = self._stages
        known = f"Keyed in like this, the part of the model takes {stages.time:.2f} s"
        depth = f"damage goes {UM * stages.excess:.2g} µm deeper than allowed"
        kept = depth if stages.excess > ROUNDING else "all limits are kept"
        return stage_table(stages.each), Sentences([f"{known} (the plan {self.time:.2f} s), and {kept}."])

    def _figures(self) -> "tuple[Block, ...]":
        rows = (
            ("time", Interval(self.time, self.error), "s"),
            ("roundness", self.roundness, "mm"),
            ("safety_margin", self.safety_margin, "mm"),
            ("method", self.method, ""),
            ("limit at the end", self.binding, ""),
        )
        return (figures("The cycle", *rows), *self._control_table())

    @cached_property
    def dataset(self) -> "xr.Dataset":
        """Labelled arrays of the plan, with the problem."""
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
        attrs = dataset.attrs
        problem, ends = stored.decode(attrs["problem"]), tuple(np.atleast_1d(attrs["switches"]).tolist())
        solution = stored.decode(attrs["solution"]) if "solution" in attrs else None
        known = float(attrs["safety_margin"]), float(attrs["error"]), ends, dataset.drop_attrs(deep=False)
        return cls(problem, *known, attrs.get("method", "exact"), solution)

    def __str__(self) -> str:
        from sdpgrind.base.sheets import page

        return page.body([Sentences([repr(self)]), *self._control_table()])

    def _told(self) -> str:
        pieces = f"{len(self.switches)} pieces, {self.binding} at the end"
        return f"{self.time:.4f} s, error {self.error:.1g} s, {self.method}, {pieces}"
