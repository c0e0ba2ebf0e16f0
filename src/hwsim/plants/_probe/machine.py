"""One ring under the probe: the compiled core with its random numbers, by sample or many at once."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from centering.kernels import ProbeScan, Ring, lobes_of
from centering.kernels import probe as kernels
from hwsim._part.clock import Clock
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_BLOCK = 512  # samples whose random numbers are drawn together; chosen: fewer cost a call each
_FASTEST = 300.0  # rad/s; chosen: a larger number has another unit
_FEWEST = 3  # samples in a turn; derived: a circle has three unknowns


def checked_speed(speed: object, sample_time: float | None) -> float:
    """A spindle speed (rad/s) with enough samples in a turn; `sample_time` None: the angle triggers them."""
    fastest = _FASTEST if sample_time is None else min(_FASTEST, 2 * math.pi / (_FEWEST * sample_time))
    checked = checks.positive("spindle_speed", speed, "rad/s")
    if checked > fastest:
        why = "" if fastest == _FASTEST else f" for {_FEWEST} samples in a turn"
        raise checks.refuse(
            "spindle_speed", f"<= {fastest:.4g}{why}; units.rpm(20) for rev/min", checked, "rad/s"
        )
    return checked


class ProbePart:
    """A live part; see `hwsim.protocols.Machine`. `shape`, `cell`, `state`: arrays of the compiled core."""

    def __init__(
        self,
        ring: Ring,
        shape: Floats,
        cell: Floats,
        state: Floats,
        turns_max: float,
        clock: Clock,
        rng: np.random.Generator,
    ) -> None:
        self.done, self.event, self.time = False, False, 0
        self._ring, self._cell, self._state, self._clock, self._rng = ring, cell, state, clock, rng
        self._shape, self._lobes = shape, lobes_of(ring)
        self._begun, self._angle_max = float(state[kernels.ANGLE]), 2 * math.pi * turns_max
        self._normals, self._uniforms = np.empty(0), np.empty((0, 2))
        self._timed_out = False
        self._seen = self.rows(1)[0]

    def rows(self, number: int) -> Floats:
        """Measure the next samples, one a row, in the columns of the compiled core."""
        table = np.empty((number, len(kernels.COLUMNS)))
        self._draw(number)
        kernels.measure(
            self._shape, self._lobes, self._cell, self._state, self._normals, self._uniforms, table
        )
        self._normals, self._uniforms = self._normals[number:], self._uniforms[number:]
        self.time = int(table[-1, -1])
        return table

    def scan(self, number: int) -> ProbeScan:
        """The first `number` samples of a part that has just been started."""
        begun = self._seen[np.newaxis]
        table = np.concatenate([begun, self.rows(number - 1)]) if number > 1 else begun
        angle, reading, slide, probe, ticks = np.ascontiguousarray(table.T)
        return ProbeScan(angle, reading, slide, probe, self._clock.all_seconds(ticks), self._ring)

    def _draw(self, number: int) -> None:
        """Draw random numbers in whole blocks until there are enough for `number` samples."""
        blocks = max(0, -(-(number - len(self._normals)) // _BLOCK))
        drawn = [(self._rng.standard_normal(_BLOCK), self._rng.random((_BLOCK, 2))) for _ in range(blocks)]
        if drawn:
            self._normals = np.concatenate([self._normals, *(normals for normals, _ in drawn)])
            self._uniforms = np.concatenate([self._uniforms, *(uniforms for _, uniforms in drawn)])

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, float]:
        """Take a command, turn until the next sample or for `ticks`, measure."""
        if command:
            self._take(command)
        if ticks and not self.done:
            self._advance(ticks)
        return dict(zip(kernels.COLUMNS[:4], self._seen[:4].tolist(), strict=True))

    def _advance(self, ticks: int) -> None:
        until = self.time + ticks
        self.event = ticks >= FOREVER or kernels.due(self._cell, self._state)[0] <= until
        if not self.event:
            self.time = until
            return
        self._seen = self.rows(1)[0]
        if self._seen[0] - self._begun > self._angle_max:
            self.done = self._timed_out = True

    def _take(self, command: Mapping[str, Any]) -> None:
        if command.get("stop"):
            self.done = True
            return
        if "spindle_speed" in command:
            triggered = self._cell[kernels.PER_TURN] != 0
            speed = checked_speed(command["spindle_speed"], None if triggered else self._clock.seconds(1))
            state, now = self._state, self._clock.seconds(self.time)
            state[kernels.ANGLE] += state[kernels.SPEED] * (now - state[kernels.SINCE])
            state[kernels.SINCE], state[kernels.SPEED] = now, speed

    def outcome(self) -> dict[str, float]:
        """Result of the part; see the plant."""
        state, ring = self._state, self._ring
        x, y = float(state[kernels.CENTER_X]), float(state[kernels.CENTER_Y])
        return {
            "time": self._clock.seconds(self.time),
            "turns": (float(self._seen[0]) - self._begun) / (2 * math.pi),
            "samples": float(state[kernels.NEXT]),
            "lost": float(state[kernels.LOST]),
            "timed_out": float(self._timed_out),
            "true_radius": float(ring.radius),
            "true_center_x": x,
            "true_center_y": y,
            "true_offset": math.hypot(x, y),
            "true_roundness": ring.roundness,
        }
