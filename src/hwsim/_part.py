"""One part through the loop.

Order of one tick: measure; step the controllers that are due, by priority; commands take effect; the plant advances;
log. Everything is collected in plain lists; labelling comes after the run.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from hwsim._clock import Clock
from hwsim.protocols import FOREVER, Controller, Machine, Plant

Column = npt.NDArray[Any]
Row = tuple[int, Mapping[str, Any], Mapping[str, Any], Mapping[str, Any]]  # ticks, measured, commanded, reported
_NOTHING: Mapping[str, Any] = {}


@dataclass(frozen=True)
class Part:
    """What one part left behind: a table (name -> column) for each tier, and the outcome."""

    tables: Mapping[str, Mapping[str, Column]]
    outcome: Mapping[str, Column]


@dataclass
class Tier:
    """One controller in the loop, when it is due, and its rows so far."""

    name: str
    controller: Controller
    period: int | None  # ticks
    report: Callable[[], Mapping[str, Any]] | None
    due: int = 0
    rows: list[Row] = field(default_factory=list)


def controllers(controller: Controller) -> dict[str, Controller]:
    """Name the controllers of one part, the first has priority."""
    tiers = getattr(controller, "tiers", None)
    return dict(tiers) if tiers is not None else {getattr(controller, "tier", "controller"): controller}


def run_part(plant: Plant, controller: Controller, clock: Clock, rng: np.random.Generator) -> Part:
    """Run one part from its start until it is done."""
    machine = plant.start(rng)
    controller.reset()
    tiers = [_tier(name, each, clock) for name, each in controllers(controller).items()]
    measures, accepts = dict(plant.measures), dict(plant.accepts)
    reading = _whole(machine.step(_NOTHING, 0), measures)
    event = True  # the start is one
    while not machine.done:
        now = machine.time
        try:
            command, fresh = _decide(tiers, now, event, reading, accepts)
            reading = _whole(machine.step(command, _wait(tiers, now)), measures)
        except Exception as error:
            error.add_note(f"at {clock.seconds(now):g} s of the part")
            raise
        for tier, row in fresh:
            tier.rows.append(row)
        event = machine.event
        if not event and machine.time == now and not machine.done:
            raise RuntimeError("nothing is under way and nothing was commanded: the part would never end")
    return _finished(tiers, machine, reading, plant, clock)


def _whole(measured: Mapping[str, Any], measures: Mapping[str, str]) -> dict[str, Any]:
    """A copy of what was measured; what is missing is NaN."""
    if len(measured) == len(measures):
        return dict(measured)
    return dict.fromkeys(measures, nan) | dict(measured)


def _tier(name: str, controller: Controller, clock: Clock) -> Tier:
    period = None if controller.period is None else clock.ticks(f"period of {name}", controller.period)
    return Tier(name, controller, period, getattr(controller, "report", None))


def _decide(
    tiers: list[Tier], now: int, event: bool, reading: Mapping[str, Any], accepts: Mapping[str, str]
) -> tuple[dict[str, Any], list[tuple[Tier, Row]]]:
    """Step the controllers that are due; the first that commands a name has it."""
    command: dict[str, Any] = {}
    fresh: list[tuple[Tier, Row]] = []
    for tier in tiers:
        if tier.due > now or (tier.period is None and not event):
            continue
        given = tier.controller.step(**reading)
        _check_command(tier.name, given, accepts)
        given = dict(given)
        command = given | command if command else given
        fresh.append((tier, (now, reading, given, dict(tier.report()) if tier.report else _NOTHING)))
        if tier.period is not None:
            tier.due = now + tier.period
    return command, fresh


def _check_command(tier: str, given: Any, accepts: Mapping[str, str]) -> None:
    """Refuse what the plant does not know; a NaN is no command."""
    if type(given) is not dict and not isinstance(given, Mapping):
        raise TypeError(f"step of {tier} must return a mapping of commands; got {given!r}")
    for name, value in given.items():
        if name not in accepts:
            raise ValueError(f"a command of {tier} must be one of {', '.join(accepts)}; got {name!r}")
        if isinstance(value, float) and value != value:
            raise ValueError(f"{name} commanded by {tier} must be a number ({accepts[name] or '1'}); got nan")


def _wait(tiers: list[Tier], now: int) -> int:
    """Ticks until the next controller with a period is due."""
    due = FOREVER + now
    for tier in tiers:
        if tier.period is not None and tier.due < due:
            due = tier.due
    return due - now


def _finished(tiers: list[Tier], machine: Machine, reading: Mapping[str, Any], plant: Plant, clock: Clock) -> Part:
    """Turn rows into columns; a last row without a command holds what was measured when the part was done."""
    planned: dict[str, Any] = {}
    for tier in tiers:
        first = tier.rows[0][3] if tier.rows else _NOTHING
        planned |= {f"{name}_planned": value for name, value in first.items()}
        if not tier.rows or tier.rows[-1][0] < machine.time:
            tier.rows.append((machine.time, reading, _NOTHING, _NOTHING))
    outcome = dict(machine.outcome()) | planned
    return Part(
        {tier.name: _table(tier.rows, plant, clock) for tier in tiers},
        {name: _figure(value) for name, value in outcome.items()},
    )


def _table(rows: list[Row], plant: Plant, clock: Clock) -> dict[str, Column]:
    ticks, measured, commanded, reported = (list(entries) for entries in zip(*rows, strict=True))
    table = {"time": clock.all_seconds(ticks)}
    for name in plant.measures:
        table[name] = column([row[name] for row in measured])
    for name in plant.accepts:
        if any(name in row for row in commanded):
            table[f"{name}_command"] = column([row.get(name, nan) for row in commanded])
    for name in dict.fromkeys(name for row in reported for name in row):
        table[f"{name}_planned"] = column([row.get(name, nan) for row in reported])
    return table


def _figure(value: Any) -> Column:
    """A number or an array of numbers; anything else as text."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return np.asarray(str(value))


def column(values: list[Any]) -> Column:
    """Return numbers as an array, arrays of unequal length as rows padded with NaN, anything else as text."""
    try:
        numbers = np.array(values, dtype=float)
        return numbers if numbers.ndim <= 2 else numbers.reshape(len(values), -1)
    except (TypeError, ValueError):
        pass
    try:
        return _padded([np.atleast_1d(np.asarray(value, dtype=float)).ravel() for value in values])
    except (TypeError, ValueError):
        return np.array([str(value) for value in values])


def _padded(rows: list[npt.NDArray[np.float64]]) -> Column:
    table = np.full((len(rows), max(row.size for row in rows)), nan)
    for line, row in zip(table, rows, strict=True):
        line[: row.size] = row
    return table
