"""Parts centred in simulation: times, pushes, final offsets."""

import dataclasses
from typing import Any

import numpy as np
import xarray as xr

from centering._problem.problem import CenteringProblem
from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CenteringRuns:
    """Parts centred in simulation, from `Strategy.simulate`.

    Attributes
    ----------
    start : array, (parts,)
        Initial offset, mm.
    time : array, (parts,)
        Time from the table at rest to the last measurement, s.
    pushes : array of int, (parts,)
        Number of pushes.
    offset : array, (parts,)
        True final offset, mm.
    finished : array of bool, (parts,)
        Whether the part was judged centred and is.
    problem : CenteringProblem
        Simulated problem.
    last : array, (parts,)
        Time from the last touch to the end of the last measurement, s; NaN: never pushed.
    """

    start: Floats
    time: Floats
    pushes: Any
    offset: Floats
    finished: Any
    problem: CenteringProblem
    last: Floats

    @property
    def mean(self) -> float:
        """Mean time of a part, s."""
        return float(np.mean(self.time))

    @property
    def standard_error(self) -> float:
        """Standard error of the mean time, s."""
        return float(np.std(self.time, ddof=1) / np.sqrt(self.time.size)) if self.time.size > 1 else 0.0

    @property
    def dataset(self) -> xr.Dataset:
        """Parts with labels and units."""
        return xr.Dataset(
            {
                "start": ("part", self.start, {"units": "mm", "long_name": "offset at the start"}),
                "time": ("part", self.time, {"units": "s", "long_name": "time of the cycle"}),
                "pushes": ("part", self.pushes, {"long_name": "pushes"}),
                "offset": ("part", self.offset, {"units": "mm", "long_name": "true offset at the end"}),
                "finished": ("part", self.finished, {"long_name": "taken for centred, and centred"}),
            }
        )

    def plot(self) -> Any:
        """Draw the times, the pushes and the final offsets; return the figure."""
        figure, (left, middle, right) = pictures.subplots(1, 3, (11, 3.2))
        left.hist(self.time, bins=30, color=pictures.ACTUAL)
        left.axvline(self.mean, color="k", lw=1, label=f"mean {self.mean:.2f} s")
        left.set(xlabel="time of a part [s]", ylabel="parts")
        left.legend(frameon=False)
        middle.hist(
            self.pushes, bins=np.arange(self.pushes.max() + 2) - 0.5, color=pictures.ACTUAL, rwidth=0.9
        )
        middle.set(xlabel="pushes", ylabel="parts")
        right.hist(1e3 * self.offset, bins=30, color=pictures.ACTUAL)
        right.axvline(1e3 * self.problem.tolerance, color="k", lw=1, ls="--", label="tolerance")
        right.set(xlabel="offset at the end [µm]", ylabel="parts")
        right.legend(frameon=False, loc="upper left")
        return figure

    def __repr__(self) -> str:
        share = 100.0 * float(np.mean(self.finished))
        return (
            f"CenteringRuns({self.time.size} parts, {share:.4g} % centred in {self.mean:.2f} s and"
            f" {float(np.mean(self.pushes)):.2f} pushes on average)"
        )
