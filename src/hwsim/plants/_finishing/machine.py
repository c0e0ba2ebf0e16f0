"""One part in the finishing cell: the compiled core, tick by tick or for the whole part."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from hwsim._part.clock import Clock, exact
from hwsim._part.motions import digest, row_table
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing import TorqueController
from sdpgrind.finishing import kernels as torque_axis
from sdpgrind.finishing.kernels import (
    CellTruth,
    cell_settings,
    course_of,
    forces_of,
    loop_of,
    roughness_of,
    standing,
)
from sdpgrind.finishing.kernels import cell as core
from sdpgrind.finishing.torque import gravity_torque

_SAMPLES = 5000  # most rows of a trace; chosen: more are not seen in a picture
_BLOCK = 8192  # ticks in one block of rows; chosen: fewer cost a call each
# default time limit: times the duration of the motion, plus s; chosen: half the feed is still enough
_LONGEST, _IDLE = 2.0, 60.0


class FinishingSetup(NamedTuple):
    """The cell, its truth in this part, and draws for the encoder (rad) and the roughness (1)."""

    cell: Any  # a FinishingCell, defined above this module
    truth: CellTruth
    offset: float
    normal: float


class FinishingPart:
    """A part under the tool; see `hwsim.protocols.Machine`."""

    def __init__(self, setup: FinishingSetup) -> None:
        self.done, self.event = False, False
        self._setup, self._begun = setup, False
        cell, truth = setup.cell, setup.truth
        self._clock = Clock(exact("sample_time of the axis", cell.tick))
        self._course = standing(cell.problem, cell.first, self._weight)
        field = truth.height
        self._waves = np.column_stack([field.waves, field.phases, field.amplitudes])
        self._loop = loop_of(truth.table, cell.tick)
        self._cell, self._axis = (
            cell_settings(cell, truth, setup.offset),
            truth.axis.replace(sample_time=cell.tick).parameters,
        )
        self._state, self._axis_state = np.zeros(core.STATES), np.zeros(torque_axis.STATES)
        self._state[core.TOUCHED], self._state[core.EVERY] = -1.0, 1.0
        self._state[core.FORCE_MIN] = math.inf
        self._axis_state[torque_axis.ANGLE] = -cell.gap / (
            cell.problem.lever_arm * math.cos(cell.problem.contact_angle)
        )
        self._trace = np.empty((_SAMPLES, len(core.TRACE)))
        self._current, self._override, self._most = 0.0, 0.0, self._ticks_max(0.0)
        core.begin(self._course, self._waves, self._loop, self._cell, self._state)

    @property
    def time(self) -> int:
        """Ticks since the start."""
        return int(self._state[core.TICKS])

    @property
    def _weight(self) -> float:
        return float(gravity_torque(self._setup.truth.tool_mass, self._setup.truth.mass_radius, 0.0))

    def _ticks_max(self, duration: float) -> int:
        longest = self._setup.cell.max_time
        longest = _LONGEST * duration + _IDLE if longest is None else longest
        return math.ceil(longest / float(self._setup.cell.tick))

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, float]:
        """Take a command, advance by `ticks`, measure."""
        if command:
            self._take(command)
        if not self.done:
            for _ in range(min(ticks, FOREVER, self._most - self.time)):
                core.tick(*self._core, self._current, self._override)
                if self._finished:
                    self.done = True
                    break
        return {
            "motor_angle": float(core.shown(self._cell, self._axis_state)),
            "path_time": float(self._state[core.PLAYED]),
        }

    @property
    def _core(self) -> tuple[Floats, ...]:
        held = self._course, self._waves, self._loop, self._cell, self._axis
        return *held, self._state, self._axis_state, self._trace

    @property
    def _finished(self) -> bool:
        played = self._begun and self._state[core.PLAYED] >= self._course[-1, core.TIME]
        return bool(played or self.time >= self._most)

    def _take(self, command: Mapping[str, Any]) -> None:
        if "motion" in command:
            self._begin(command["motion"])
        if "current" in command:
            self._current = checks.number("current", command["current"], "A")
        if "feed_override" in command:
            override = checks.within("feed_override", command["feed_override"], 0.0, 1.0)
            if override > 0 and not self._begun:
                raise ValueError(f"feed_override must be 0 before a motion is given; got {override!r}")
            self._override = override

    def _begin(self, motion: Any) -> None:
        """Start playing a motion."""
        if self._begun:
            raise ValueError("motion must be given once in a part, before it is played")
        cell = self._setup.cell
        self._course = course_of(cell.problem, motion, cell.tree, self._weight)
        self._begun, self._most = True, self._ticks_max(float(self._course[-1, core.TIME]))
        core.begin(self._course, self._waves, self._loop, self._cell, self._state)

    def whole(self, controller: Any) -> dict[str, dict[str, Floats]] | None:
        """Finish the part under a controller with a compiled core, bit-equal to the loop; None otherwise."""
        if type(controller) is not TorqueController or controller.period != self._setup.cell.tick:
            return None
        if controller.motion is None:
            raise ValueError(
                "controller must have a motion to be played in the cell: TorqueController(axis, "
                "motion, ...); got None"
            )
        if controller.kind == "pidff" and controller.setting.observer == "ideal":
            return None
        motion, law = controller.motion.profile, controller.law
        self._begin(motion)
        held, blocks = (law.parameters, law.start.copy(), law.time, law.torque, law.load), []
        while not self.done:
            rows = np.empty((min(_BLOCK, self._most - self.time), len(core.ROWS)))
            used, self.done = core.finish(*self._core, *held, rows, self._most)
            blocks.append(rows[:used])
        table = self._labelled(np.concatenate(blocks), motion)
        tier = getattr(controller, "tier", "controller")
        return {tier: table, **row_table(tier, "motion", table["time"], [motion])}

    def _labelled(self, rows: Floats, motion: Floats) -> dict[str, Floats]:
        last = self.step({}, 0)
        columns = dict(
            zip(
                core.ROWS,
                np.concatenate([rows, np.full((1, len(core.ROWS)), math.nan)]).T.copy(),
                strict=True,
            )
        )
        for name, value in last.items():
            columns[name][-1] = value
        given = np.full((2, len(rows) + 1), math.nan)
        given[:, 0] = len(motion), digest(motion)
        commanded = {"motion_command": given[0], "motion_digest_command": given[1]}
        return {"time": self._clock.all_seconds(range(len(rows) + 1)), **columns, **commanded}

    def outcome(self) -> dict[str, Any]:
        """Result of the part; see the plant."""
        state, cell, truth = self._state, self._setup.cell, self._setup.truth
        forces = forces_of(state, cell.target_force)
        trace = self._trace[: int(state[core.SAMPLES])]
        return {
            "time": self._clock.seconds(self.time),
            "touch_down": self._clock.seconds(int(state[core.TOUCHED]))
            if state[core.TOUCHED] > 0
            else math.nan,
            **forces,
            "path_deviation": float(state[core.DEVIATION]),
            **roughness_of(cell.problem, truth, forces["normal_force"], self._setup.normal),
            "timed_out": float(not self._begun or state[core.PLAYED] < self._course[-1, core.TIME]),
            "true_torque_constant": float(truth.axis.torque_constant),
            "true_contact_angular_stiffness": float(truth.axis.contact_angular_stiffness),
            "true_friction_ratio": float(truth.friction_ratio),
            "true_load_torque": float(truth.load_torque),
            **{name: column.copy() for name, column in zip(core.TRACE, trace.T, strict=True)},
        }
