"""Demand of a pass plan on the force loop, as arrays over time, checked once."""

import dataclasses
from bisect import bisect_right
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


class Trajectory(Protocol):
    """Plan that can be followed: arrays over time."""

    @property
    def time(self) -> Any:
        """Time since the start of the pass, s."""

    @property
    def normal_force(self) -> Any:
        """Planned normal force, N."""

    @property
    def fly_height(self) -> Any:
        """Planned height of the disc's center, mm."""


@dataclasses.dataclass(frozen=True, eq=False)
class ForceReference:
    """Planned force (N), fly height (mm) and, where known, center of the disc (mm) over time (s).

    From `face_leaves` (s) on the face of the disc leaves the bead.
    """

    time: Floats
    normal_force: Floats
    fly_height: Floats
    center_x: Floats | None = None
    face_leaves: float = np.inf

    @classmethod
    def of(cls, plan: Trajectory, force_max: float) -> "ForceReference":
        """Read a plan and refuse one that no force loop can follow."""
        for name in ("time", "normal_force", "fly_height"):
            if not hasattr(plan, name):
                raise TypeError(
                    "plan must have the arrays time (s), normal_force (N) and fly_height (mm), as"
                    f" passes.plan gives it; {checks.shown(plan)} has no {name}"
                )
        place, leaves = getattr(plan, "center_x", None), float(getattr(plan, "face_leaves", np.inf))
        return cls.arrays(plan.time, plan.normal_force, plan.fly_height, force_max, place, leaves)

    @classmethod
    def arrays(
        cls,
        time: npt.ArrayLike,
        normal_force: npt.ArrayLike,
        fly_height: npt.ArrayLike,
        force_max: float,
        center_x: npt.ArrayLike | None = None,
        face_leaves: float = np.inf,
    ) -> "ForceReference":
        """Check arrays and keep them."""
        t = checks.finite_array("time", time, "s").ravel()
        force = checks.finite_array("normal_force", normal_force, "N").ravel()
        height = checks.finite_array("fly_height", fly_height, "mm").ravel()
        for name, array in (("normal_force", force), ("fly_height", height)):
            if array.shape != t.shape or not t.size:
                raise checks.refuse(name, f"as long as time ({t.size} entries)", array.shape)
        if np.any(np.diff(t) <= 0):
            k = int(np.flatnonzero(np.diff(t) <= 0)[0]) + 1
            raise checks.refuse(f"time[{k}]", f"> time[{k - 1}] = {t[k - 1]:g}", float(t[k]), "s")
        _check_force(force, force_max)
        place = None if center_x is None else _increasing(center_x, t)
        return cls(t, force, height, place, np.inf if np.isnan(face_leaves) else face_leaves)

    def at(self, time: float) -> tuple[float, float]:
        """Planned force (N) and height (mm) at a time (s); outside the plan 0 N, at the height of its end."""
        times, force, height, _ = self._lists
        if times[0] <= time <= times[-1]:
            k = bisect_right(times, time) - 1
            return _between(time, k, times, force), _between(time, k, times, height)
        return 0.0, height[0] if time < times[0] else height[-1]

    def along(self, time: Floats) -> tuple[Floats, Floats]:
        """Planned forces (N) and heights (mm) at many times (s), to the bit those of `at`."""
        force = np.interp(time, self.time, self.normal_force, left=0.0, right=0.0)
        return force, np.interp(time, self.time, self.fly_height)

    def when(self, center_x: float) -> float:
        """Planned time, s, of a disc center at `center_x`, mm; extrapolated at the speeds of the ends."""
        times, _, _, x = self._lists
        if center_x < x[0]:
            return times[0] + (center_x - x[0]) * (times[1] - times[0]) / (x[1] - x[0])
        if center_x > x[-1]:
            return times[-1] + (center_x - x[-1]) * (times[-1] - times[-2]) / (x[-1] - x[-2])
        return _between(center_x, bisect_right(x, center_x) - 1, x, times)

    @cached_property
    def _lists(self) -> tuple[list[float], list[float], list[float], list[float]]:
        """Columns as lists: a look-up in each sample takes a fifth of `numpy.interp`."""
        place = [] if self.center_x is None else self.center_x.tolist()
        return self.time.tolist(), self.normal_force.tolist(), self.fly_height.tolist(), place


def _between(at: float, k: int, x: list[float], y: list[float]) -> float:
    """Value at a point from entry `k` on, to the bit that of `numpy.interp`."""
    if k + 1 == len(x) or at == x[k]:
        return y[k]
    return (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (at - x[k]) + y[k]


def _check_force(force: Floats, force_max: float) -> None:
    low, high = int(np.argmin(force)), int(np.argmax(force))
    if force[low] < 0:
        raise checks.refuse(f"normal_force[{low}]", ">= 0", float(force[low]), "N")
    if force[high] > force_max * (1 + 1e-6):
        raise checks.refuse(f"normal_force[{high}]", f"<= force_max = {force_max:g}", float(force[high]), "N")


def _increasing(center_x: npt.ArrayLike, time: Floats) -> Floats | None:
    """Positions of the disc, where they give the time."""
    x = np.asarray(center_x, dtype=float).ravel()
    return x if x.shape == time.shape and len(x) > 1 and bool(np.all(np.diff(x) > 0)) else None
