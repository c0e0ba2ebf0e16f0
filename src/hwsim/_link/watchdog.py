"""A guard around any controller: reports each step to a host; makes the machine safe if it is silent."""

import json
from collections.abc import Mapping
from functools import wraps
from math import inf
from typing import Any

import numpy as np

from hwsim._link.courier import Courier
from hwsim._part.routes import commands_of, controllers
from hwsim.protocols import Controller
from sdpgrind.base import checks


class _Pulse:
    """State shared by the tiers of a guarded controller: the courier, and whether the host fell silent."""

    def __init__(self, courier: Courier, timeout: float, safe_command: Mapping[str, Any]) -> None:
        self.courier, self.timeout, self.safe_command = courier, timeout, safe_command
        self.tripped = False
        self.steps = 0  # steps of the fastest tier in this part
        self._origin: float | None = (
            None  # courier's time at the start of the part, s; none passes between parts
        )

    def reset(self) -> None:
        """Begin a new part."""
        self.tripped, self._origin, self.steps = False, None, 0

    def beat(self, time: float) -> None:
        """Exchange records at a time of the part, s; trip when the host was silent for too long."""
        courier = self.courier
        if self._origin is None:
            self._origin = courier.time - time
        courier.advance(max(courier.time, self._origin + time))
        self.steps += 1
        self.tripped = self.tripped or courier.silence > self.timeout


class _Guard:
    """One guarded controller; other attributes are the controller's own."""

    def __init__(self, controller: Controller, pulse: _Pulse, name: str, *, leads: bool) -> None:
        self._controller, self._pulse, self._name, self._leads = controller, pulse, name, leads

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._controller, name)

    @property
    def period(self) -> float | None:
        """Period of the controller, s."""
        return self._controller.period

    @property
    def step(self) -> Any:
        """Step of the controller, with its measurements (in their units), or the safe command."""

        @wraps(self._controller.step)
        def guarded(**measurement: Any) -> dict[str, Any]:
            return self._step(measurement)

        return guarded

    @property
    def reports(self) -> Mapping[str, str]:
        """Name -> unit of the controller's reports, and ``link_lost``."""
        return {**getattr(self._controller, "reports", {}), "link_lost": ""}

    def reset(self) -> None:
        """Forget the part before; the courier keeps its records."""
        self._pulse.reset()
        self._controller.reset()

    def report(self) -> dict[str, Any]:
        """Report of the controller (in its units) while it commands, and ``link_lost``: 1 afterwards."""
        lost = self._pulse.tripped
        said = getattr(self._controller, "report", dict) if not lost else dict
        return {**said(), "link_lost": float(lost)}

    def _step(self, measurement: Mapping[str, Any]) -> dict[str, Any]:
        if self._leads:
            self._pulse.beat(self._time(measurement))
        safe = self._pulse.safe_command
        command = dict(safe if self._pulse.tripped else self._controller.step(**measurement))
        self._pulse.courier.send(_record(self._name, self._pulse.courier.time, measurement, command))
        return command

    def _time(self, measurement: Mapping[str, Any]) -> float:
        """Time in the part, s."""
        if self.period is not None:
            return self._pulse.steps * self.period
        if "time" not in measurement:
            raise ValueError("time (s) must be measured where a guarded controller has no period")
        return float(measurement["time"])


class Watchdog(_Guard):
    """Any controller, supervised by a host: when the host falls silent, the machine is made safe.

    The host receives each step of each tier as a JSON record of ``tier``, ``time`` (s), ``read`` and
    ``command``. Once the host has been silent for longer than the timeout, the safe command replaces the
    controller until the end of the part, even when the host is heard again.

    Time is counted in periods of the fastest tier (s); where no tier has a period, ``time`` must be measured.
    The log has a column ``link_lost_planned``.

    Parameters
    ----------
    controller : Controller
        Guarded controller, with or without tiers.
    courier : Courier
        Courier to the host. The host's courier must advance more often than the timeout.
    timeout : float
        Longest silence allowed, s; greater than the period.
    safe_command : mapping
        Command once the host is silent, in names and units that the plant accepts:
        {"velocity": 0.0, "retract": 1.0}.

    Raises
    ------
    ValueError
        When the timeout is not longer than the period, or no tier has a command of `safe_command`.

    Examples
    --------
    >>> from hwsim._link.courier import Courier
    >>> class Push:
    ...     period = 0.01
    ...     def reset(self): ...
    ...     def step(self, **measured):
    ...         return {"velocity": 10.0}
    >>> guarded = Watchdog(Push(), Courier(), timeout=0.02, safe_command={"velocity": 0.0, "retract": 1.0})
    >>> guarded.reset()
    >>> for _ in range(4):
    ...     print(guarded.step(probe=0.0))
    {'velocity': 10.0}
    {'velocity': 10.0}
    {'velocity': 10.0}
    {'velocity': 0.0, 'retract': 1.0}
    """

    def __init__(
        self, controller: Controller, courier: Courier, *, timeout: float, safe_command: Mapping[str, float]
    ) -> None:
        checks.able("controller", controller, "a controller", "reset", "step")
        checks.kind("courier", courier, Courier)
        named = controllers(controller)
        periods = {name: inf if each.period is None else each.period for name, each in named.items()}
        leader = min(periods, key=lambda name: periods[name])
        fastest = periods[leader]
        if checks.positive("timeout", timeout, "s") <= fastest < inf:
            raise checks.refuse("timeout", f"> period of the controller, {fastest:g}", timeout, "s")
        pulse = _Pulse(courier, timeout, _checked(safe_command, named))
        super().__init__(controller, pulse, leader, leads=True)
        self.tiers: dict[str, _Guard] | None = None
        if getattr(controller, "tiers", None) is not None:
            self.tiers = {
                name: _Guard(each, pulse, name, leads=name == leader) for name, each in named.items()
            }

    @property
    def tripped(self) -> bool:
        """Whether the host fell silent in this part."""
        return self._pulse.tripped


def _checked(safe_command: Mapping[str, float], named: Mapping[str, Controller]) -> dict[str, float]:
    if not isinstance(safe_command, Mapping) or not safe_command:
        raise TypeError(f"safe_command must be a mapping of commands; got {checks.shown(safe_command)}")
    known = [commands_of(each) for each in named.values()]
    for name, value in safe_command.items():
        checks.number(f"safe_command[{name!r}]", value)
        if all(known) and not any(name in commands for commands in known):
            raise checks.refuse("safe_command", "of commands of the controller", name)
    return dict(safe_command)


def _record(tier: str, time: float, read: Mapping[str, Any], command: Mapping[str, Any]) -> bytes:
    """One step as JSON; NaN: no reading."""
    return json.dumps(
        {"tier": tier, "time": time, "read": dict(read), "command": command}, default=_plain
    ).encode()


def _plain(value: Any) -> Any:
    return np.asarray(value).tolist()
