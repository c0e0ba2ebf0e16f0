"""Planned cycle: course over time, error, method."""

import dataclasses
from collections.abc import Callable, Mapping
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
from sdpgrind.plunge._plan.control_table import ControlStages, faster_told, stage_table, stages_of
from sdpgrind.plunge._plan.doubted import Safety, limits_of, price_of, price_told
from sdpgrind.plunge._plan.exact import fastest
from sdpgrind.plunge._plan.program import CycleProgram, program_of
from sdpgrind.plunge._plan.trajectory import of_exact

if TYPE_CHECKING:
    import xarray as xr

SOLVED = "solved"
_WIDENED = 5  # chosen: margins tried until constant rates keep the limits
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


def _rounder(problem: CycleProblem, less: float) -> CycleProblem:
    """Problem with a limit of out-of-roundness smaller by `less`, mm."""
    return problem.replace(roundness_max=problem.roundness_max - less) if less > 0.0 else problem


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
    confidence : float or None
        Chance that no finished surface is burned; None: all values are taken as exact.
    gauge : bool
        Whether the size is measured.
    price : mapping
        Time that each doubt costs, by name, s; with "all".
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
        *,
        confidence: float | None = None,
        gauge: bool = True,
    ):
        self.problem, self.error, self.switches = problem, error, switches
        self.safety_margin, self.confidence, self.gauge = safety_margin, confidence, gauge
        self._safety = Safety(safety_margin, confidence, gauge)
        self._course, self.method, self.solution = course, method, solution

    @cached_property
    def trajectory(self) -> "xr.Dataset":
        """Course over time (s, mm, mm/s, W, rad/s)."""
        return self._course() if callable(self._course) else self._course

    @cached_property
    def time(self) -> float:
        """Time of the cycle, s."""
        return float(self.trajectory.time[-1])

    @cached_property
    def price(self) -> Mapping[str, float]:
        """Time (s) by which the cycle is shorter without each doubt alone; "all": without any."""
        return price_of(self.problem, self._safety, self.time)

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

    def program(
        self,
        target: str = "ngc",
        *,
        deviation: float,
        axis: str = "X",
        diameter: bool = False,
        certain: bool = False,
    ) -> CycleProgram:
        """Return the cycle as a program of the feed axis for a control without a gauge.

        ``"ngc"``: RS274NGC, as LinuxCNC reads it: few blocks G1 with a feed in mm/min, and G4 where the axis
        rests. ``"csv"``: positions at the sample time.

        The axis feeds the metal to be removed, the deflection, and the radius that the wheel loses, within
        `command_rate_max`. Lag and dead time of the drive are not made up for.

        Parameters
        ----------
        target : {"ngc", "csv"}
            Form of the program.
        deviation : float
            Greatest distance of the axis from the plan at all times, rounding included, mm of radius; some
            1e-4. A table keeps it at its rows.
        axis : str
            Letter of the axis, one of XYZUVW; its 0 is the first contact.
        diameter : bool
            Whether positions and feeds are of the diameter, twice those of the radius.
        certain : bool
            Whether a plan without a confidence may become a program: all its values must be exact.

        Returns
        -------
        CycleProgram
            Program with `text`, `check()` and `save(path)`.

        Raises
        ------
        ValueError
            If the deviation (mm) is out of range or the plan has a gauge, no confidence, no solution or
            several rotations of the work.

        Examples
        --------
        >>> from sdpgrind import plunge, units
        >>> problem = plunge.preset("simulation").replace(burning_sd=0.03)
        >>> blind = plunge.plan(problem, confidence=0.999, gauge=False)
        >>> program = blind.program("ngc", deviation=units.um(1))
        >>> program.text.splitlines()[-4:]
        ['G1 X0.2729 F0.1277', 'G1 X0.2993 F0.2315', 'G4 P0.3183', 'M2']
        >>> found = program.check()
        >>> found.deviation <= 1e-3, abs(found.time - blind.time) < 0.01
        (True, True)
        """
        return program_of(self, target, deviation, axis, diameter, certain)

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
        """Constant rates that keep the limits: of an exact plan, one with a wider margin where needed."""
        deeper = max(DEEPER, 0.0 if self.solution is None else self.solution.excess)
        stages = stages_of(self.problem, self.trajectory, self.switches, self._safety, deeper)
        margin, problem = self._safety.margin, self.problem
        for _ in range(_WIDENED if self.solution is None else 0):
            rough = stages.roundness - self.problem.roundness_max
            if stages.excess <= ROUNDING and rough <= ROUNDING:
                break
            margin, problem = margin + 2.0 * stages.excess, _rounder(problem, 2.0 * max(rough, 0.0))
            _, ends, course = fastest(limits_of(problem, self._safety._replace(margin=margin)))
            stages = stages_of(self.problem, of_exact(self.problem, course), ends, self._safety, deeper)
        return stages

    def _control_table(self) -> tuple[AmountTable, Sentences]:
        """Table that an operator keys in, and what the model makes of it."""
        stages = self._stages
        takes = f"the part of the model takes {stages.time:.2f} s (the plan {self.time:.2f} s)"
        table = stage_table(stages.each, self.problem.model.work_rotation)
        keyed = f"Keyed in like this and switched by the stock, {takes}; {self._kept(stages)}."
        told = [*self._promised(), *price_told(self.price, self.time), *faster_told(stages.each), keyed]
        return table, Sentences(told)

    def _promised(self) -> list[str]:
        """Sentence on the confidence, where there is one."""
        if self.confidence is None:
            return []
        known = f"burn threshold {self.problem.uncertainty.burn_threshold}"
        how = "" if self.gauge else "; without a gauge it leaves as a program: the stock below is the model's"
        return [f"No finished surface is burned with a confidence of {self.confidence:.10g}; {known}{how}."]

    def _kept(self, stages: ControlStages) -> str:
        """Words on the limits that the stages keep, or do not."""
        faults = [] if stages.done else ["it does not reach size"]
        if stages.excess > ROUNDING:
            faults.append(f"damage goes {UM * stages.excess:.2g} µm deeper than the limit")
        if stages.roundness > self.problem.roundness_max + ROUNDING:
            faults.append(f"it is {UM * stages.roundness:.3f} µm out of round")
        return " and ".join(faults) or "all limits are kept"

    def _doubted(self) -> list[tuple[str, object, str]]:
        """Rows of the report: confidence, and what each doubt costs."""
        if self.confidence is None:
            return [("confidence", "none: all values are taken as exact", "")]
        costs = [(f"price of {name}", seconds, "s") for name, seconds in self.price.items()]
        return [
            ("confidence", self.confidence, "1"),
            ("burn threshold", self.problem.uncertainty.burn_threshold, ""),
            *costs,
        ]

    def _figures(self) -> "tuple[Block, ...]":
        rows = (
            ("time", Interval(self.time, self.error), "s"),
            ("roundness", self.roundness, "mm"),
            ("safety_margin", self.safety_margin, "mm"),
            *self._doubted(),
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
        if self.confidence is not None:
            attrs |= {"confidence": self.confidence, "gauge": int(self.gauge)}
        if self.solution is not None:
            attrs["solution"] = stored.encode(self.solution)
        return self.trajectory.assign_attrs(attrs | {"switches": list(self.switches), "method": self.method})

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        attrs = dataset.attrs
        problem, ends = stored.decode(attrs["problem"]), tuple(np.atleast_1d(attrs["switches"]).tolist())
        solution = stored.decode(attrs["solution"]) if "solution" in attrs else None
        confidence = float(attrs["confidence"]) if "confidence" in attrs else None
        known = float(attrs["safety_margin"]), float(attrs["error"]), ends, dataset.drop_attrs(deep=False)
        gauge = bool(attrs.get("gauge", 1))
        method = attrs.get("method", "exact")
        return cls(problem, *known, method, solution, confidence=confidence, gauge=gauge)

    def __str__(self) -> str:
        from sdpgrind.base.sheets import page

        return page.body([Sentences([repr(self)]), *self._control_table()])

    def _told(self) -> str:
        pieces = f"{len(self.switches)} pieces, {self.binding} at the end"
        return f"{self.time:.4f} s, error {self.error:.1g} s, {self.method}, {pieces}"
