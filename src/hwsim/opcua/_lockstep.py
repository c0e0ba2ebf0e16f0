"""A part in lockstep: it advances when it is told to, bit-equal to a part of `hwsim.run`."""

import time
from collections.abc import Mapping, Sequence
from typing import Any

from hwsim.opcua._driver import Answer, Refused
from hwsim.opcua._packing import given, packed, seeded
from hwsim.opcua._shown import Shown
from hwsim.protocols import FOREVER, Machine, Plant

_SHOWN = 0.1  # s between measurements on show; chosen: enough for a screen, and a step costs no more


class Lockstep:
    """The parts of a plant in lockstep, one after the other (`Driver`)."""

    def __init__(self, plant: Plant, shown: Shown) -> None:
        self._plant, self._shown, self._produced = plant, shown, shown.produced
        self._shown_at = 0.0
        self._machine: Machine | None = None
        self._measures, self._accepts = tuple(plant.measures), tuple(plant.accepts)

    async def start(self, part: int, seed: str) -> None:
        """Start a part."""
        if self._produced.paused:
            raise Refused("the machine is paused: no part is begun")
        try:
            rng, past = seeded(seed)
            plant: Any = self._plant
            for outcome in past:
                plant = plant.after(outcome)
            self._machine = plant.start(rng)
        except ValueError as error:
            raise Refused(str(error)) from None
        await self._produced.begun(part)

    async def advance(self, values: Sequence[float], ticks: int) -> Answer:
        """Take commands, advance, and answer."""
        machine = self._machine
        if machine is None:
            raise Refused("a part must be started before it is advanced")
        try:
            if not 0 <= ticks <= 2 * FOREVER:
                raise ValueError(f"ticks must be in [0, 2**63]; got {ticks}")
            reading = machine.step(given(self._accepts, values), ticks)
        except Exception as error:
            return [], machine.time, machine.event, machine.done, str(error)
        if machine.done or time.monotonic() - self._shown_at > _SHOWN:
            self._shown_at = time.monotonic()
            self._shown.reading(reading)
        if machine.done:
            await self._produced.finished(machine.outcome())
        return packed(self._measures, reading), machine.time, machine.event, machine.done, ""

    async def take(self, command: Mapping[str, Any]) -> None:
        """Refuse: in lockstep, commands come with the steps."""
        raise Refused("a machine in lockstep takes commands by Advance")

    def beat(self, count: int) -> None:
        """Ignore the heartbeat: in lockstep no time passes by itself."""

    async def pause(self, paused: bool) -> None:
        """Begin no part, or go on."""
        await self._produced.hold(paused)

    async def abort(self, reason: str) -> None:
        """End the part."""
        machine, self._machine = self._machine, None
        if machine is not None and not machine.done:
            await self._produced.aborted(machine.outcome(), reason)

    def close(self) -> None:
        """Forget the part."""
        self._machine = None

    async def reset(self) -> None:
        """Forget the part."""
        self._machine = None
