"""Plan a plunge cycle: the infeed of least time."""

import os
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from sdpgrind.base import checks, records, stored
from sdpgrind.base.extras import need
from sdpgrind.plunge._envelope import Limits
from sdpgrind.plunge._exact import HOLD, LINE, START, TRACK, WAIT, Course, fastest
from sdpgrind.plunge._problem import CycleProblem

PIECES = {WAIT: "touch-in", START: "full rate", TRACK: "on the limit of burning", HOLD: "constant rate", LINE: "spark-out"}
ROUNDING = 1e-12
"""Of closed forms and of roots, relative to the time."""
_COLUMNS = {
    "remaining": ("mm", "remaining stock"),
    "infeed_rate": ("mm/s", "actual infeed rate"),
    "command_rate": ("mm/s", "commanded infeed rate"),
    "deflection": ("mm", "deflection of the machine"),
    "burn_depth": ("mm", "depth of damage (negative: what is left to it)"),
    "grinding_power": ("W", "power at the contact"),
}


class CyclePlan:
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
        Estimated error of that time, s.
    switches : tuple of float
        Times at which its pieces end, s.
    trajectory : xarray.Dataset
        The course over time: remaining stock, rates, deflection, depth of damage, power, with units.
    """

    def __init__(
        self, problem: CycleProblem, safety_margin: float, error: float, switches: tuple[float, ...], course: xr.Dataset
    ):
        self.problem, self.safety_margin, self.error, self.switches = problem, safety_margin, error, switches
        self.trajectory = course

    @cached_property
    def time(self) -> float:
        """Time of the cycle, s."""
        return float(self.trajectory.time[-1])

    @property
    def roundness(self) -> float:
        """Out-of-roundness that is left, mm."""
        return float(self.problem.model.roundness(self.trajectory.infeed_rate[-1]))

    @property
    def binding(self) -> str:
        """What limits the rate at the end (mm/s): "roundness" or "burning"."""
        return "roundness" if self.problem.final_rate < self.problem.model.burn_rate else "burning"

    def plot(self) -> Any:
        """Draw rates, and depth of damage under the remaining stock (mm), over time (s); return the figure."""
        plt = need("matplotlib.pyplot", "plot")
        t = self.trajectory
        figure, (top, low) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
        top.step(t.time, 1e3 * t.command_rate, where="post", color="0.6", lw=1, label="command")
        top.plot(t.time, 1e3 * t.infeed_rate, color="#4878a8", label="actual")
        top.set(ylabel="infeed rate [um/s]")
        low.plot(t.time, t.remaining, color="0.35", label="remaining stock")
        low.plot(t.time, np.maximum(t.burn_depth, 0.0), color="#b04a3a", label="depth of damage")
        low.set(ylabel="[mm]", xlabel="time [s]")
        for axis in (top, low):
            axis.legend(frameon=False, fontsize=8)
            for switch in self.switches[:-1]:
                axis.axvline(switch, color="0.8", lw=0.8, zorder=0)
        figure.suptitle(f"{self.time:.2f} s, {1e3 * self.roundness:.2f} um out of round", fontsize=10)
        return figure

    @cached_property
    def dataset(self) -> xr.Dataset:
        """All of it as labelled arrays."""
        attrs = {"problem": stored.encode(self.problem), "safety_margin": self.safety_margin, "error": self.error}
        return self.trajectory.assign_attrs(attrs | {"switches": list(self.switches)})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the plan to a NetCDF file at `path`."""
        records.write(self.dataset, path, "plunge.cycle")

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> "CyclePlan":
        """Read the plan that `save` wrote to `path`."""
        data = records.read(path)
        problem, switches = stored.decode(data.attrs["problem"]), tuple(np.atleast_1d(data.attrs["switches"]).tolist())
        course = data.drop_attrs(deep=False)
        return cls(problem, float(data.attrs["safety_margin"]), float(data.attrs["error"]), switches, course)

    def __repr__(self) -> str:
        return f"CyclePlan({self.time:.4f} s, error {self.error:.1g} s, {len(self.switches)} pieces, {self.binding} at the end)"


def plan(problem: CycleProblem, *, safety_margin: float = 0.0) -> CyclePlan:
    """Plan the fastest cycle, exactly: least bound of all limits from which the rest can be ground.

    Parameters
    ----------
    problem : CycleProblem
        What to grind, within which limits.
    safety_margin : float
        By how much less than the remaining stock the damage may go down, mm: (7).

    Returns
    -------
    CyclePlan
        Time in s, with its error; no other way within the limits is faster.

    Raises
    ------
    ValueError
        When the margin is negative, or no less than the stock (mm).

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> best = plunge.plan(plunge.preset("simulation"))
    >>> round(best.time, 4), best.error < 1e-9
    (12.0195, True)
    """
    checks.kind("problem", problem, CycleProblem, " (see plunge.preset)")
    if checks.nonnegative("safety_margin", safety_margin, "mm") >= problem.stock:
        raise checks.refuse("safety_margin", f"< stock = {problem.stock:g}", safety_margin, "mm")
    model = problem.model
    if model.wear is not None:
        raise ValueError("method must be 'dp' or 'collocation' where the model has wear; got 'exact'")
    limits = Limits(model.core, problem.command_rate_max, model.burn_rate, problem.final_rate, safety_margin, problem.stock)
    time, switches, course = fastest(limits)
    return CyclePlan(
        problem, safety_margin, abs(time - fastest(limits, points=20)[0]) + ROUNDING * time, switches, _labelled(problem, course)
    )


def _labelled(problem: CycleProblem, course: Course) -> xr.Dataset:
    model, rate = problem.model, course.rate
    touching = rate > 0
    burn = np.full(rate.size, np.nan)
    burn[touching] = model.burn_depth(rate[touching])
    columns = {
        "remaining": course.remaining,
        "infeed_rate": rate,
        "command_rate": course.command,
        "deflection": np.where(course.kind == WAIT, 0.0, course.y + model.core.K0),
        "burn_depth": burn,
        "grinding_power": np.where(touching, model.grinding_power(rate), 0.0),
    }
    data: dict[str, Any] = {
        name: ("time", column, dict(zip(("units", "long_name"), _COLUMNS[name], strict=True))) for name, column in columns.items()
    }
    meanings = ", ".join(f"{k}: {words}" for k, words in PIECES.items())
    data["piece"] = ("time", course.kind.astype(np.int16), {"long_name": meanings})
    return xr.Dataset(data, {"time": ("time", course.time, {"units": "s"})})
