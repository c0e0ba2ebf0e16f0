"""Distribution of the depth of a pass from the mean and variance of the power that removes."""

from abc import ABC, abstractmethod
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._process import GrindingProcess


class Depths(ABC):
    """Random depth of a pass of a process; its law is `law`, of the parameters that `_law` adds."""

    law: str

    @abstractmethod
    def expected(self, process: GrindingProcess) -> GrindingProcess:
        """Return the process of the mean cut: J/mm^3, W, N, mm/s."""

    @abstractmethod
    def power_moments(self, process: GrindingProcess, normal_force: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return mean and sd, W, of the power that removes, K1 w V depth, of a process at a force, N."""

    def moments(
        self, process: GrindingProcess, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike
    ) -> tuple[Floats, Floats]:
        """Return mean and sd, mm, of the depth of a process at a force, N, and a feed, mm/s; Brown (4.9)."""
        mean, sd = self.power_moments(process, normal_force)
        whole = process.specific_energy * process.bead_width * np.asarray(feed_rate, dtype=float)
        return mean / whole, sd / whole

    def cut(self, process: GrindingProcess, normal_force: npt.ArrayLike, feed_rate: npt.ArrayLike) -> sdp.Law:
        """Return the distribution of the depth, mm, of a process at forces, N, and feeds, mm/s."""
        return self._law(*self.moments(process, normal_force, feed_rate))

    def _law(self, mean: Floats, sd: Floats) -> sdp.Law:
        if self.law == "rayleigh":
            return sdp.Rayleigh(mean, sd)
        return sdp.LogNormal(mean, sd) if self.law == "lognormal" else sdp.RectifiedNormal(mean, sd)

    def peak_force(self, process: GrindingProcess) -> float:
        """Return the normal force of greatest mean cut, N; with random mu, less than the process's own."""
        return self.expected(process).peak_force

    def switch_force(self, process: GrindingProcess, feed_rate: npt.ArrayLike) -> Floats:
        """Return the normal force, N, of a process where the Rayleigh law turns from scaled to translated.

        It is the same at every feed, mm/s; NaN: another law, or no such force.
        """
        return np.full(np.shape(feed_rate), _switch(self, process) if self.law == "rayleigh" else np.nan)


@lru_cache(maxsize=64)
def _switch(scatter: Depths, process: GrindingProcess) -> float:
    """Return the force, N, at which the mean is `sdp.Rayleigh.SWITCH` standard deviations."""

    def surplus(force: float) -> float:
        mean, sd = scatter.power_moments(process, force)
        return float(mean - sdp.Rayleigh.SWITCH * sd)

    expected = scatter.expected(process)
    low = expected.threshold_force * (1 + 1e-9) or 1e-9 * expected.peak_force
    if not low < expected.peak_force or surplus(low) >= 0:
        return np.nan
    # Far above the threshold the ratio of mean and sd is at its limit: no switch there means none at all.
    high = min(expected.peak_force, 1e6 * low)
    if surplus(high) <= 0:
        return np.nan
    return float(brentq(surplus, low, high, xtol=1e-14 * low, rtol=4 * np.finfo(float).eps))
