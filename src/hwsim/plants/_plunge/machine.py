"""One part on a plunge grinder: the compiled core with its random numbers, by sample or all at once."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hwsim._part.clock import Clock, exact
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.plunge import CycleController, CycleProblem, PlungeModel, StagedController
from sdpgrind.plunge import kernels as cycle

_LEFT = 0.02  # unfinished: rest over stock; chosen: above the errors of gauges
_BLOCK = 512  # samples whose random numbers are drawn together; chosen: fewer cost a call each


class PlungePart:
    """A live part; see `hwsim.protocols.Machine`."""

    def __init__(
        self,
        problem: CycleProblem,
        model: PlungeModel,
        rig: cycle.PartRig,
        rng: np.random.Generator,
        inspected: Callable[[float], dict[str, float]],
    ) -> None:
        self.done, self.event = False, False
        self._inspected = inspected
        self._problem, self._model, self._rig, self._rng = problem, model, rig, rng
        self._clock = Clock(exact("sample_time", problem.sample_time))
        self._state = cycle.part_state(rig)
        cycle.start_part(self._state, rig)
        self._command = 0.0
        self._balancing = False
        self._normals, self._next = np.empty((0, 2)), 0
        self._seen = self._read()

    @property
    def time(self) -> int:
        """Samples since the start."""
        return int(self._state[cycle.SAMPLES])

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, float]:
        """Take a command, feed for `ticks` samples, measure."""
        if command:
            self._take(command)
        if ticks and not self.done:
            if ticks >= FOREVER:
                ticks = self._rig.samples_max
            for _ in range(ticks):
                cycle.update_slacks(self._state, self._rig, self._balancing)
                cycle.advance(self._state, self._rig, self._command)
                self._balancing = False
                if self.time >= self._rig.samples_max:
                    self.done = True
                    break
            self._seen = self._read()
        return dict(self._seen)

    def _take(self, command: Mapping[str, Any]) -> None:
        if command.get("retract"):
            cycle.update_slacks(self._state, self._rig, False)
            self.done = True
            return
        if "command_rate" in command:
            rate = checks.nonnegative("command_rate", command["command_rate"], "mm/s")
            limit = self._problem.command_rate_max
            if rate > limit * (1 + 1e-9):
                raise checks.refuse("command_rate", f"<= command_rate_max = {limit:g}", rate, "mm/s")
            self._command = rate
        self._balancing = bool(command.get("balancing"))

    def _read(self) -> dict[str, float]:
        if self._next == len(self._normals):
            self._normals, self._next = self._rng.standard_normal((_BLOCK, 2)), 0
        normals = self._normals[self._next]
        self._next += 1
        size, power, saturated = cycle.read(self._state, self._rig, normals[0], normals[1])
        return {"size": float(size), "grinding_power": float(power), "power_saturated": float(saturated)}

    def whole(self, controller: Any) -> dict[str, dict[str, Floats]] | None:
        """Grind the whole part under a controller with a compiled core, bit-equal to the loop; else None."""
        if type(controller) not in (CycleController, StagedController):
            return None
        table, row, normals = np.empty((4 * _BLOCK, len(cycle.ROW))), 0, self._normals
        while row >= 0:
            if row + _BLOCK >= len(table):
                table = np.concatenate([table, np.empty_like(table)])
            row = cycle.grind(self._state, self._rig, controller.state, controller.law, normals, table, row)
            if row >= 0:
                normals = self._rng.standard_normal((_BLOCK, 2))
        controller.check_fed()
        self.done = True
        return {"controller": self._labelled(table[:-row], controller)}

    def _labelled(self, rows: Floats, controller: CycleController | StagedController) -> dict[str, Floats]:
        columns = dict(zip(cycle.ROW, rows.T.copy(), strict=True))
        table = {"time": self._clock.all_seconds(columns["samples"])}
        table |= {name: columns[name] for name in cycle.COLUMNS}
        table["command_rate_command"], table["balancing_command"] = (
            columns["command_rate"],
            columns["balancing"],
        )
        if columns["section"][-1] == cycle.RETRACT:
            table["retract_command"] = np.append(np.full(len(rows) - 1, math.nan), 1.0)
        columns["wear_flat_area"] *= controller.problem.model.wear_flat_area
        return table | {f"{name}_planned": columns[name] for name in cycle.PLANNED}

    def outcome(self) -> dict[str, float]:
        """Result of the part; see the plant."""
        state, model = self._state, self._model
        slack, part_slack = (
            float(state[k]) if np.isfinite(state[k]) else math.nan for k in (cycle.SLACK, cycle.PART_SLACK)
        )
        roundness = float(model.roundness(state[cycle.RATE]))
        reserve = float(state[cycle.RESERVE]) if np.isfinite(state[cycle.RESERVE]) else math.nan
        return {
            "time": self._clock.seconds(self.time),
            "slack": slack,
            "part_slack": part_slack,
            "roundness": roundness,
            "burned": float(part_slack < -cycle.DAMAGE_TOLERANCE),
            "out_of_round": float(roundness > self._problem.roundness_max),
            "remaining": float(state[cycle.REMAINING]),
            "unfinished": float(state[cycle.REMAINING] > _LEFT * self._rig.stock),
            "timed_out": float(self.time >= self._rig.samples_max),
            "true_wear_flat_area": float(model.wear_flat_area * state[cycle.WORN]),
            "true_contact_zero": -self._rig.contact_zero,
            "reserve": reserve,
            "severity": math.exp(-reserve),
            **self._inspected(reserve),
        }
