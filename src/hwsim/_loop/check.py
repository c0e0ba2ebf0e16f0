"""Whether a plant and a controller fit: all faults in one report, before the first tick."""

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np

from hwsim._part.clock import Clock, common_tick, exact
from hwsim._part.routes import Route, ambiguous, commands_of, controllers, reads_of, routes
from hwsim.protocols import Controller, Machine, Plant
from sdpgrind.base.checks import shown

# problem -> the machine that was meant
_MACHINES = {
    "CycleProblem": "PlungeGrinder",
    "FinishingProblem": "FinishingCell",
    "PassProblem": "ForceTableStand",
    "Ring": "Probe",
}
# plan -> the controller that was meant
_FOLLOWERS = {
    "CyclePlan": "plunge.CycleController(plan.problem) comes near it",
    "Locus": "locus.LocusController(curve, along=...) follows it",
    "Motion": "finishing.TorqueController(axis, motion, normal_force=1.11) follows it",
    "SequencePolicy": (
        "weldbead.SequenceController(policy) follows it, or weldbead.Hierarchy(policy, disc, loop)"
    ),
    "PassPlan": "force.ForceController(plan, loop) follows it",
    "Policy": "write a class with period, reset and step, which looks up policy.action",
}


class _Retimed(Protocol):
    def with_tick(self, tick: float) -> Plant: ...


@dataclass(frozen=True)
class CheckReport:
    """Result of `check`: false when something is wrong; prints one line a fault."""

    plant: str
    controller: str
    faults: tuple[str, ...]
    notes: tuple[str, ...] = ()  # what a user of the machine must know though they fit

    def __bool__(self) -> bool:
        return not self.faults

    def __str__(self) -> str:
        if self:
            return "\n".join([f"{self.controller} and {self.plant} fit", *(f"- {n}" for n in self.notes)])
        head = f"{self.controller} and {self.plant} do not fit:"
        if len(self.faults) == 1:
            return f"{head} {self.faults[0]}"
        return "\n".join([head, *(f"- {fault}" for fault in self.faults)])


def check(plant: Plant, controller: Controller) -> CheckReport:
    """Say what is missing for `run(plant, controller)`, and try a first measurement.

    Parameters
    ----------
    plant : Plant
        The machine. It is started (with seed 0) and measured, a real one only measured; nothing is commanded.
    controller : Controller
        The controller; it is not stepped.

    Returns
    -------
    Report
        True without faults; ``print(report)`` gives one line a fault.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> class Unfinished:
    ...     period = 0.1
    ...     def step(self, *, height, temperature):
    ...         return {}
    >>> print(hwsim.check(hwsim.WeldBeadStand(weldbead.preset("P1")), Unfinished()))
    Unfinished and WeldBeadStand do not fit:
    - controller lacks reset
    - controller's step needs temperature, which the plant does not measure
    """
    faults = list(_faults(plant, controller))
    notes = tuple(getattr(plant, "notes", ()))
    if _knows(plant, Plant) and not _lacks("plant", plant, Plant):
        faults += _first_moments(plant)
    return CheckReport(type(plant).__name__, type(controller).__name__, tuple(faults), notes)


def checked_clock(plant: Plant, controller: Controller, name: str = "") -> tuple[Plant, Clock]:
    """Return plant and clock of a run; ValueError when plant and controller (called `name`) do not fit."""
    faults = tuple(_faults(plant, controller))
    if faults:
        report = str(CheckReport(type(plant).__name__, type(controller).__name__, faults))
        raise ValueError(f"controllers[{name!r}]: {report}" if name else report)
    clock = _clock(plant, controller)
    if clock.tick != exact("tick of the plant", plant.tick):
        plant = cast(_Retimed, plant).with_tick(float(clock.tick))  # checked in _rates
    return plant, clock


def _faults(plant: Any, controller: Any) -> Iterator[str]:
    if strangers := _strangers(plant, controller):
        yield from strangers
        return
    missing = [*_lacks("plant", plant, Plant), *_lacks("controller", controller, Controller)]
    if not missing:
        for each in controllers(controller).values():
            missing += _lacks("controller", each, Controller)
    yield from missing
    if any(fault.startswith("plant") for fault in missing):
        return
    tiers = controllers(controller)
    for name, route in routes(plant, tiers).items():
        who = f"controller {name}" if len(tiers) > 1 else "controller"
        yield from _misread(plant, tiers[name], route, who)
        yield from _misdirected(plant, tiers[name], route, who)
    yield from ambiguous(plant, tiers)
    yield from other_job(plant, controller)
    if not missing:
        yield from _rates(plant, controller)


def _strangers(plant: Any, controller: Any) -> list[str]:
    """One line for each argument that is no plant or no controller, with the likely meaning."""
    if (
        not _knows(plant, Plant)
        and not _knows(controller, Controller)
        and _knows(plant, Controller)
        and _knows(controller, Plant)
    ):
        return [
            f"plant and controller must be given in this order; got {shown(plant)}, then {shown(controller)}"
        ]
    faults = []
    if not _knows(plant, Plant):
        machine = _MACHINES.get(type(plant).__name__, "WeldBeadStand")
        faults.append(f"plant must be a machine, as hwsim.{machine}(problem) is one; got {shown(plant)}")
    if not _knows(controller, Controller):
        hint = (
            "an object of it is meant"
            if isinstance(controller, type)
            else _FOLLOWERS.get(type(controller).__name__)
        )
        faults.append(
            f"controller must be a controller; got {shown(controller)}" + (f": {hint}" if hint else "")
        )
    return faults


def _knows(thing: Any, protocol: type) -> bool:
    """Whether an object has any attribute of a protocol."""
    names = [name for name in vars(protocol) if not name.startswith("_")]
    return not isinstance(thing, type) and any(hasattr(thing, name) for name in names)


def _lacks(role: str, thing: Any, protocol: type) -> list[str]:
    names = [name for name in vars(protocol) if not name.startswith("_") and not hasattr(thing, name)]
    return [f"{role} lacks {name}" for name in names]


def _misread(plant: Plant, controller: Any, route: Route, who: str) -> Iterator[str]:
    """Faults in names and units that a controller reads, from the plant or a tier above."""
    for name, wanted in reads_of(controller).items():
        given = {**route.takes, **plant.measures}.get(name)
        source = "the plant measures it" if name in plant.measures else "the tier above commands it"
        if given is None:
            yield f"{who}'s step needs {name}, which the plant does not measure"
        elif wanted is not None and wanted != given:
            yield f"{who} reads {name} in {_unit(wanted)}, {source} in {_unit(given)}"


def _misdirected(plant: Plant, controller: Any, route: Route, who: str) -> Iterator[str]:
    """Faults in names and units that a controller commands, to the plant or a tier below."""
    for name, unit in commands_of(controller).items():
        if name not in plant.accepts and name not in route.sends:
            yield (
                f"{who} commands {name}, which the plant does not accept; "
                f"it accepts {', '.join(plant.accepts)}"
            )
        elif unit != (accepted := plant.accepts.get(name, unit)):
            yield f"{who} commands {name} in {_unit(unit)}, the plant accepts it in {_unit(accepted)}"


def _unit(unit: str) -> str:
    return unit or "1"


def other_job(plant: Plant, controller: Controller) -> list[str]:
    """Differences between the parts or machines of plant and controller."""
    ours: Mapping[str, object] = getattr(plant, "job", {})
    faults: dict[str, None] = {}
    for each in (controller, *controllers(controller).values()):
        theirs: Mapping[str, object] = getattr(each, "job", {})
        differ = [name for name in theirs if name in ours and not _same_value(theirs[name], ours[name])]
        named = (
            f"{name} is {_shown(theirs[name])}, that of the plant {_shown(ours[name])}" for name in differ
        )
        if differ:
            faults[f"controller is made for another part or machine: its {', its '.join(named)}"] = None
    return list(faults)


def _same_value(one: object, other: object) -> bool:
    (value, unit), (against, its) = _quantity(one), _quantity(other)
    if isinstance(value, float) and isinstance(against, float):
        return unit == its and value == against
    return unit == its and np.array_equal(np.asarray(value), np.asarray(against))


def _quantity(value: object) -> tuple[Any, str]:
    """Value and unit of a pair; the value itself and no unit otherwise."""
    return (
        value if isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], str) else (value, "")
    )


def _shown(value: object) -> str:
    number, unit = _quantity(value)
    return f"{number!r} {unit}".rstrip()


def _rates(plant: Plant, controller: Controller) -> Iterator[str]:
    """Fault when a period is no whole number of ticks and the plant cannot change its tick."""
    try:
        tick = _clock(plant, controller).tick
    except (TypeError, ValueError) as error:
        yield str(error)
        return
    if tick != exact("tick of the plant", plant.tick) and not callable(getattr(plant, "with_tick", None)):
        ticks = f"the plant's ticks of {plant.tick:g} s"
        fits = f"a tick of {tick} s would fit"
        if hasattr(plant, "start_live"):  # whose tick is not this user's to choose
            periods = [each.period for each in controllers(controller).values() if each.period is not None]
            fits = f"a period of {plant.tick * max(1, round(min(periods) / plant.tick)):g} s would fit"
        yield f"controller's period is no whole number of {ticks}; {fits}"


def _clock(plant: Plant, controller: Controller) -> Clock:
    periods = {f"period of {name}": each.period for name, each in controllers(controller).items()}
    rates = {name: period for name, period in periods.items() if period is not None}
    return Clock(common_tick({"tick of the plant": plant.tick, **rates}))


def _first_moments(plant: Plant) -> list[str]:
    """Faults of a part that is started and measured: names, repeatability, copies.

    A plant with ``look`` is a machine that must not be started to be checked.
    """
    look = getattr(plant, "look", None)
    if look is not None:
        return list(_unannounced(plant, look()))
    machine = plant.start(np.random.default_rng(0))
    missing = _lacks("machine", machine, Machine)
    return missing or list(_measured(plant, machine))


def _measured(plant: Plant, machine: Machine) -> Iterator[str]:
    reading = machine.step({}, 0)
    yield from _unannounced(plant, reading)
    if machine.time != 0:
        yield f"machine must be at time 0 when it is started and measured; its time is {machine.time}"
    again = plant.start(np.random.default_rng(0)).step({}, 0)
    if not _equal(reading, again):
        yield "plant measures differently when it is started twice with equal rng: something else is random"
    if not _equal(reading, copy.deepcopy(machine).step({}, 0)):
        yield "a copy of the machine measures differently from the machine"


def _unannounced(plant: Plant, reading: Mapping[str, Any]) -> Iterator[str]:
    for name in reading:
        if name not in plant.measures:
            yield f"machine measures {name}, which the plant does not announce in measures"


def _equal(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    names = one.keys() == other.keys()
    return names and all(
        np.array_equal(np.asarray(one[n]), np.asarray(other[n]), equal_nan=True) for n in one
    )
