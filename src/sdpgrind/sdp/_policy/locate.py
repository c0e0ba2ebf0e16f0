"""Position of states in a policy table, and states beyond its edges."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats, reals, refuse
from sdpgrind.sdp._problem.countdown import ROUNDING, Countdown
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._problem.layout import Layout
from sdpgrind.sdp._transitions.edges import passed

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Place:
    """States located in the table: slice, late charge, mode, place on each axis (cells), coordinates, stage.

    The late charge is the one missing in the slice, 0 except in the slice before the first stage ("base").
    """

    row: Ints
    late: Floats
    mode: Ints
    index: Floats
    points: tuple[Floats, ...]
    shape: tuple[int, ...]
    time: Floats


@dataclass(frozen=True)
class Locator:
    """Locates states."""

    layout: Layout
    countdown: Countdown

    def locate(self, state: dict[str, Any]) -> Place:
        """Locate states (numbers or arrays by name) in the table; refuse those outside."""
        layout = self.layout
        names = [axis.name for axis in layout.axes] + ([] if layout.endless else [layout.stage_name])
        if set(state) - {"mode"} != set(names):
            wanted = ", ".join([*names, "mode"] if len(layout.modes) > 1 else names)
            raise TypeError(f"a state is given by {wanted}; got {', '.join(state) or 'nothing'}")
        units = [axis.unit for axis in layout.axes] + ([] if layout.endless else [layout.stage_unit])
        numbers = (reals(name, state[name], unit) for name, unit in zip(names, units, strict=True))
        *arrays, modes = np.broadcast_arrays(*numbers, np.asarray(self.mode(state.get("mode", 0))))
        points = tuple(np.ravel(a) for a in arrays[: len(layout.axes)])
        mode = np.ravel(modes).astype(np.int64)
        time = np.zeros(mode.size) if layout.endless else np.ravel(arrays[-1])
        row, late = (
            (np.zeros(mode.size, np.int64), np.zeros(mode.size)) if layout.endless else self._rows(time)
        )
        index = np.array([self._position(k, x) for k, x in enumerate(points)]).reshape(len(points), mode.size)
        return Place(row, late, mode, index, points, modes.shape, time)

    def mode(self, mode: Any) -> Any:
        """Return the number of a mode given by name or number; refuse unknown ones."""
        modes = self.layout.modes
        if isinstance(mode, str):
            if mode not in modes:
                raise refuse("mode", "one of " + ", ".join(modes), mode)
            return modes.index(mode)
        number = np.asarray(mode)
        if not np.all((number >= 0) & (number < len(modes)) & (number == np.floor(number))):
            raise refuse("mode", f"a whole number in [0, {len(modes) - 1}]", mode)
        return mode

    def _rows(self, time: Floats) -> tuple[Ints, Floats]:
        """Slices of stage coordinates, and the late charge missing in the base slice."""
        layout, stage = self.layout, time / self.layout.step
        self._refuse(
            time,
            ~(stage <= layout.count + ROUNDING),
            f"<= {layout.count * layout.step:g}, the horizon of the policy",
        )
        below = np.floor(stage + ROUNDING).astype(np.int64)
        lowest = self.countdown.lowest
        if not self.countdown.has_base:
            self._refuse(time, below < lowest, f">= {lowest * layout.step:g}, where the policy ends")
        between = (below < 0) & (below >= lowest) & (np.abs(stage - below) > ROUNDING)
        self._refuse(time, between, f"a multiple of {layout.step:g} where it is < 0")
        return self.countdown.row(below), np.where(below < lowest, self.countdown.late(time), 0.0)

    def _refuse(self, time: Floats, bad: Mask, rule: str) -> None:
        if np.any(bad):
            raise refuse(self.layout.stage_name, rule, float(time[bad][0]), self.layout.stage_unit)

    def _position(self, k: int, x: Floats) -> Floats:
        axis = self.layout.axes[k]
        if not np.all(np.isfinite(x)):
            raise refuse(axis.name, "finite", float(x[~np.isfinite(x)][0]), axis.unit)
        with np.errstate(divide="ignore", invalid="ignore"):
            index = np.nan_to_num(self.layout.grid.index(k, x), nan=-1.0, neginf=-1.0)
        ends = (
            (index < -ROUNDING, axis.below, ">=", axis.low),
            (index > axis.nodes - 1 + ROUNDING, axis.above, "<=", axis.high),
        )
        for beyond, edge, sign, end in ends:
            if edge == "refuse" and np.any(beyond):
                raise refuse(axis.name, f"{sign} {end:g}", float(x[beyond][0]), axis.unit)
        return np.asarray(index)

    def _exits(self, place: Place) -> list[tuple[Mask, Any, Floats]]:
        """Masks of states beyond each edge that ends the process, the edge, and the coordinate."""
        out = []
        for axis, x in zip(self.layout.axes, place.points, strict=True):
            for beyond, edge, _ in passed(axis, x):
                if edge not in ("hold", "refuse") and np.any(beyond):
                    out.append((beyond, edge, x))
        return out

    def outside(self, place: Place) -> Mask:
        """Return the mask of states beyond an edge at which the process ends."""
        gone = np.zeros(place.row.size, dtype=bool)
        for beyond, _, _ in self._exits(place):
            gone |= beyond
        return gone

    def with_exits(self, place: Place, value: Floats) -> Floats:
        """Replace values of states beyond an edge at which the process ends by the exact charge."""
        charge = self.layout.edge_charge
        for beyond, edge, x in self._exits(place):
            if edge != "stop":
                value[beyond] = edge
            elif charge is not None:
                extra = np.asarray(self.layout.edge_extra)[place.mode[beyond]]
                value[beyond] = charge(x[beyond]) + extra + self.late_at(place)[beyond]
        return value

    def with_exit_slopes(self, place: Place, slope: Floats) -> Floats:
        """Replace slopes there by that of the charge."""
        charge = self.layout.edge_charge
        for beyond, edge, x in self._exits(place):
            slope[beyond] = charge.slope(x[beyond]) if edge == "stop" and charge is not None else 0.0
        return slope

    def late_at(self, place: Place) -> Floats:
        """Late charge of located states, $."""
        count = self.countdown
        return np.where(count.in_base(place.row), place.late, count.late(count.time(place.row)))
