"""Faults outside of the gauges: a link that is cut, a clock that jumps, a loss of power."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from math import nan
from typing import Any

import numpy as np

from hwsim.faults._machine import FaultyMachine, ShownFaults, shown_faults
from hwsim.faults._plant import Faulty
from hwsim.protocols import FOREVER, Machine
from sdpgrind.base import checks
from sdpgrind.base.quantities import described, quantity, text


@described()
class LinkCut(Faulty):
    """A link between controller and machine that is cut for some time.

    Meanwhile all measurements are NaN and the machine holds its last commands; the newest commands of that
    time reach it with the first step after the link is back. Served free running (`hwsim.serve`), the server
    closes the connections of its clients again and again until then, and the machine's own watchdog makes it
    safe where the cut is longer than its ``timeout``. Outcome: ``seen_link_cut``, the number of lost samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    at : float
        Time in the part at which the link is cut, s.
    duration : float
        Time until it is back, s.

    Raises
    ------
    ValueError
        When `at` is negative or `duration` is not positive.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.LinkCut(stand, at=0.5, duration=2.0).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(3))  # s
    (6.0, nan, nan, 3.0)
    """

    _: KW_ONLY
    at: float = quantity("s", at_least=0)
    duration: float = quantity("s", above=0)

    def _machine(self, machine: Machine, rng: np.random.Generator) -> FaultyMachine:
        return _CutMachine(machine, self.seen, self._ticks(self.at), self._ticks(self.at + self.duration))


class _CutMachine(FaultyMachine):
    """A machine whose link is cut from one tick until before another."""

    def __init__(self, machine: Machine, seen: str, begin: int, end: int) -> None:
        super().__init__(machine, seen)
        self._begin, self._end = begin, end
        self._kept: dict[str, Any] = {}  # commands of the time without a link

    @property
    def _cut(self) -> bool:
        return self._begin <= self.inner.time < self._end

    def _advanced(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        machine, now = self.inner, self.inner.time
        self._kept |= command
        if not self._cut:
            command, self._kept = self._kept, {}
            return machine.step(command, ticks)
        reading = machine.step({}, ticks)
        if self._kept and ticks >= FOREVER and machine.time == now and not machine.event:
            return machine.step({}, self._end - now)  # nothing is under way until the commands come
        return reading

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        return self._cut

    def _changed(self, reading: dict[str, Any]) -> dict[str, Any]:
        return dict.fromkeys(reading, nan)

    @property
    def shown_faults(self) -> ShownFaults:
        """What the faults do to the server: it has no link."""
        told = shown_faults(self.inner)
        return told._replace(cut=told.cut or self._cut)


@described()
class ClockJump(Faulty):
    """A machine whose clock jumps.

    From `at` on a measured time is reported with the error `by`; the machine itself goes on as before. A
    plant that measures no time tells its controller of none. Served free running (`hwsim.serve`), the
    variable ``time`` and the time stamps of the server jump. Outcome: ``seen_clock_jump``, the number of
    samples from then on.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    at : float
        Time in the part at which the clock jumps, s.
    by : float
        Time by which it is fast afterwards, s; < 0: slow.
    of : str, optional
        Measurement that is a time, s. None: ``time``, where the plant measures it.

    Raises
    ------
    ValueError
        When `at` is negative, `by` is not finite, or `of` is no measured time.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> jump = hwsim.faults.ClockJump(stand, at=1.5, by=60.0, of="time_left")
    >>> bead = jump.start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(3))  # s
    (6.0, 5.0, 64.0, 63.0)
    """

    _: KW_ONLY
    at: float = quantity("s", at_least=0)
    by: float = quantity("s")
    of: str | None = text(default=None)

    def _check(self) -> None:
        if self.of is not None and self.measures.get(self.of) != "s":
            times = ", ".join(name for name, unit in self.measures.items() if unit == "s") or "none"
            raise checks.refuse("of", f"a time that the plant measures in s: {times}", self.of)

    def _machine(self, machine: Machine, rng: np.random.Generator) -> FaultyMachine:
        of = self.of or "time"
        return _JumpingMachine(
            machine, self.seen, self._ticks(self.at), self.by, of if of in self.measures else None
        )


class _JumpingMachine(FaultyMachine):
    """A machine whose clock is wrong from a tick on."""

    def __init__(self, machine: Machine, seen: str, at: int, by: float, of: str | None) -> None:
        super().__init__(machine, seen)
        self._at, self._by, self._of = at, by, of

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        return self.inner.time >= self._at

    def _changed(self, reading: dict[str, Any]) -> dict[str, Any]:
        if self._of is None:
            return reading
        return {**reading, self._of: reading.get(self._of, nan) + self._by}

    @property
    def shown_faults(self) -> ShownFaults:
        """What the faults do to the server: its clock is wrong."""
        told = shown_faults(self.inner)
        return told._replace(shift=told.shift + self._by) if self.inner.time >= self._at else told


@described()
class PowerLoss(Faulty):
    """A machine that loses its power: the part ends, and nothing is measured any more.

    An adaptation never sees such a part, and the plant does not change by it (``after``). Served free running
    (`hwsim.serve`), the machine ends the part as aborted and the server closes the connections of its clients
    once, as a machine that starts again: it makes the next part. No process ends, as a stand that is served
    belongs to the program that serves it; `hwsim.opcua.Served.stop` ends a server for good. In lockstep the
    part ends as in a simulation. Outcome: ``aborted`` (1: the power was lost) and ``seen_power_loss``, the
    same.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    at : float
        Time in the part at which the power is lost, s. A part that ends before does not notice.

    Raises
    ------
    ValueError
        When `at` is not positive.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.PowerLoss(stand, at=1.5).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(2))  # s
    (6.0, 5.0, nan)
    >>> bead.done, bead.outcome()["aborted"], bead.outcome()["time"]  # s
    (True, 1.0, 1.5)
    """

    _: KW_ONLY
    at: float = quantity("s", above=0)

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit of the outcomes of the plant, ``aborted`` and ``seen_power_loss``."""
        inner = super().outcomes
        return {**inner, "aborted": inner.get("aborted", "")}

    def _machine(self, machine: Machine, rng: np.random.Generator) -> FaultyMachine:
        return _PoweredMachine(machine, self.seen, self._ticks(self.at))


class _PoweredMachine(FaultyMachine):
    """A machine without power from a tick on."""

    def __init__(self, machine: Machine, seen: str, at: int) -> None:
        super().__init__(machine, seen)
        self._at, self._lost = at, False

    @property
    def done(self) -> bool:
        """Whether the part is finished, or the power is lost."""
        return self._lost or self.inner.done

    @property
    def event(self) -> bool:
        """Whether the last step ended at an event."""
        return self.inner.event and not self._lost

    def _advanced(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        if self._lost:
            return self.inner.step({}, 0)
        return self.inner.step(command, min(ticks, self._at - self.inner.time))

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        self._lost = self._lost or (self.inner.time >= self._at and not self.inner.done)
        return self._lost

    def _changed(self, reading: dict[str, Any]) -> dict[str, Any]:
        return dict.fromkeys(reading, nan)

    def outcome(self) -> dict[str, Any]:
        """Outcome of the machine inside at the loss of power, and whether there was one."""
        told = super().outcome()
        return {**told, "aborted": max(float(told.get("aborted", 0.0)), float(self._lost))}

    @property
    def shown_faults(self) -> ShownFaults:
        """What the faults do to the server: its connections end without a word."""
        told = shown_faults(self.inner)
        return told._replace(cut=True, lost=told.lost or "power loss") if self._lost else told
