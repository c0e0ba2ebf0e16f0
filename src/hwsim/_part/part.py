"""One part through the loop.

Order of one tick: measure; step the controllers that are due, by priority; commands take effect; the plant
advances; log. A lower tier reads the set-point of a higher tier in the same tick. Rows are collected in lists
and labelled after the run.
"""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from hwsim._part.clock import Clock
from hwsim._part.motions import as_table, command_column, digest, digest_name, is_table, row_table
from hwsim._part.routes import Route, controllers, reads_of, routes
from hwsim.protocols import FOREVER, Controller, Machine, Plant

Column = npt.NDArray[Any]
# ticks, measured, commanded, reported
Row = tuple[int, Mapping[str, Any], Mapping[str, Any], Mapping[str, Any]]
_NOTHING: Mapping[str, Any] = {}


@dataclass(frozen=True)
class LivePart:
    """Result of one part: tables (name -> column) of tiers and of rows of motions, and the outcome."""

    tables: Mapping[str, Mapping[str, Column]]
    outcome: Mapping[str, Column]


@dataclass
class Tier:
    """One controller in the loop: schedule, names that it reads and commands, and its rows."""

    name: str
    controller: Controller
    period: int | None  # ticks
    report: Callable[[], Mapping[str, Any]] | None
    route: Route
    logged: tuple[str, ...]  # measurements in its table
    units: Mapping[str, str]  # units of its commands
    accepted: Container[str]  # names that the plant accepts; of a recording any
    held: dict[str, Any]  # set-points from higher tiers
    step: Callable[..., Any]  # of the controller
    due: int = 0
    missed: int = 0  # releases before the last step that passed by; none but on a machine with its own clock
    rows: list[Row] = field(default_factory=list)
    timing: dict[str, list[float]] = field(default_factory=dict)  # further columns, a value a step


def run_part(plant: Plant, controller: Controller, clock: Clock, rng: np.random.Generator) -> LivePart:
    """Run one part from its start until it is done."""
    machine = plant.start(rng)
    controller.reset()
    if (part := _at_once(machine, controller)) is not None:
        return part
    loop = PartLoop(plant, machine, controller, clock)
    loop.run()
    return loop.result()


class PartLoop:
    """Loop of one part on a machine at time 0, with a controller that was reset."""

    def __init__(self, plant: Plant, machine: Machine, controller: Controller, clock: Clock) -> None:
        self.tiers = _tiers(plant, controllers(controller), clock)
        self.machine = machine
        self.unanswered: list[tuple[Tier, Row]] = []  # steps whose commands the machine has not taken yet
        self._clock, self._measures = clock, dict(plant.measures)
        self._reading: Mapping[str, Any] = dict.fromkeys(self._measures, nan)
        self._read_at = 0  # ticks

    def run(self) -> None:
        """Step until the part is done."""
        tiers, machine, measures = self.tiers, self.machine, self._measures
        self._reading = _whole(machine.step(_NOTHING, 0), measures)
        event = True  # at the start
        while not machine.done:
            now = machine.time
            try:
                command, self.unanswered = _decide(tiers, now, event, self._reading)
                self._reading = _whole(machine.step(command, _wait(tiers, now)), measures)
                self._read_at = machine.time
            except Exception as error:
                error.add_note(f"at {self._clock.seconds(now):g} s of the part")
                raise
            self.answered()
            event = machine.event
            if not event and machine.time == now and not machine.done:
                raise RuntimeError("nothing is under way and nothing was commanded: the part would never end")

    def try_first_step(self, *, advance: bool = False) -> None:
        """Step the controllers once: what is compiled at first use is ready then.

        `advance`: let the machine go on to the second step; otherwise nothing is commanded.
        """
        self._reading, now = _whole(self.machine.step(_NOTHING, 0), self._measures), self.machine.time
        command, _ = _decide(self.tiers, now, True, self._reading)
        if advance:
            self.machine.step(command, _wait(self.tiers, now))

    def answered(self) -> None:
        """Keep the rows of the last steps: the machine has taken their commands."""
        for tier, row in self.unanswered:
            tier.rows.append(row)
        self.unanswered = []

    def tables(self) -> dict[str, dict[str, Column]]:
        """Tables of the rows so far."""
        return {
            key: table
            for tier in self.tiers
            if tier.rows
            for key, table in _tables(tier, self._clock).items()
        }

    def result(self, *, finished: bool = True) -> LivePart:
        """Tables and outcome of what was run; of a part that was broken off no verdict of the controllers."""
        end = self._read_at, self._reading
        return _finished(self.tiers, self.machine, end, self._clock, verdicts=finished)


def _at_once(machine: Machine, controller: Controller) -> LivePart | None:
    """The whole part at once, where machine and controller have compiled cores; None otherwise."""
    whole = getattr(machine, "whole", None)
    tables = whole(controller) if whole else None
    if tables is None:
        return None
    return LivePart(tables, {name: _figure(value) for name, value in machine.outcome().items()})


def _whole(measured: Mapping[str, Any], measures: Mapping[str, str]) -> dict[str, Any]:
    """A copy of the measurements, with NaN for missing names."""
    if len(measured) == len(measures):
        return dict(measured)
    return dict.fromkeys(measures, nan) | dict(measured)


def _tiers(plant: Plant, named: Mapping[str, Controller], clock: Clock) -> list[Tier]:
    between = routes(plant, named)
    return [
        _tier(plant, name, each, between[name], clock, alone=len(named) == 1) for name, each in named.items()
    ]


def _tier(
    plant: Plant, name: str, controller: Controller, route: Route, clock: Clock, *, alone: bool
) -> Tier:
    """One tier; its table has what it declares in ``reads``, a single controller's everything measured."""
    period = None if controller.period is None else clock.ticks(f"period of {name}", controller.period)
    everything = alone or not hasattr(controller, "reads")
    logged = tuple(each for each in plant.measures if everything or each in reads_of(controller))
    units = {**plant.accepts, **route.sends}
    report, held = getattr(controller, "report", None), dict.fromkeys(route.takes, nan)
    return Tier(name, controller, period, report, route, logged, units, plant.accepts, held, controller.step)


def _decide(
    tiers: list[Tier], now: int, event: bool, reading: Mapping[str, Any]
) -> tuple[dict[str, Any], list[tuple[Tier, Row]]]:
    """Step the controllers that are due; the first that commands a name wins."""
    command: dict[str, Any] = {}
    fresh: list[tuple[Tier, Row]] = []
    for k, tier in enumerate(tiers):
        if tier.due > now or (now % tier.period if tier.period else not event):
            continue  # between two releases of its grid, too: a release passed by during a late step
        read = {**reading, **tier.held} if tier.held else reading
        if tier.period is not None:
            tier.missed = (now - tier.due) // tier.period
            tier.due += (tier.missed + 1) * tier.period
        given = tier.step(**read)
        _check_command(tier, given)
        given = dict(given)
        fresh.append((tier, (now, read, given, dict(tier.report()) if tier.report else _NOTHING)))
        passed = _passed_down(tiers[k + 1 :], tier.route.sends, given) if tier.route.sends else given
        command = passed | command if command else passed
    return command, fresh


def _passed_down(below: list[Tier], sends: Mapping[str, str], given: Mapping[str, Any]) -> dict[str, Any]:
    """Store set-points for the tiers below; return the commands to the plant."""
    for tier in below:
        for name in tier.held:
            if name in sends and name in given:
                tier.held[name] = given[name]
    return {name: value for name, value in given.items() if name not in sends}


def _check_command(tier: Tier, given: Any) -> None:
    """Refuse unknown names and NaN."""
    if type(given) is not dict and not isinstance(given, Mapping):
        raise TypeError(f"step of {tier.name} must return a mapping of commands; got {given!r}")
    units = tier.units
    for name, value in given.items():
        if name not in units and name not in tier.accepted:
            raise ValueError(f"a command of {tier.name} must be one of {', '.join(units)}; got {name!r}")
        if isinstance(value, float) and value != value:
            raise ValueError(
                f"{name} commanded by {tier.name} must be a number ({units.get(name) or '1'}); got nan"
            )


def _wait(tiers: list[Tier], now: int) -> int:
    """Ticks until the next controller with a period is due."""
    due = FOREVER + now
    for tier in tiers:
        if tier.period is not None:
            due = min(due, tier.due if tier.due > now else now - now % tier.period + tier.period)
    return due - now


def _finished(
    tiers: list[Tier], machine: Machine, end: tuple[int, Mapping[str, Any]], clock: Clock, *, verdicts: bool
) -> LivePart:
    """Turn rows into columns; a last row without a command has the final measurements."""
    said: dict[str, Any] = {}
    for tier in tiers:
        first = tier.rows[0][3] if tier.rows and tier.period is None else _NOTHING
        said |= {f"{name}_planned": value for name, value in first.items()}
        said |= getattr(tier.controller, "verdict", dict)() if verdicts else {}
        if not tier.rows or tier.rows[-1][0] < end[0]:
            tier.rows.append((end[0], {**end[1], **tier.held}, _NOTHING, _NOTHING))
    outcome = dict(machine.outcome())
    outcome = outcome | said | outcome  # order of the machine's names, and its values
    tables: dict[str, Mapping[str, Column]] = {}
    for tier in tiers:
        tables |= _tables(tier, clock)
    return LivePart(tables, {name: _figure(value) for name, value in outcome.items()})


def _tables(tier: Tier, clock: Clock) -> dict[str, dict[str, Column]]:
    """The table of a tier, and those of the rows of its motions."""
    ticks, read, commanded, reported = (list(entries) for entries in zip(*tier.rows, strict=True))
    table = {"time": clock.all_seconds(ticks)}
    of_rows: dict[str, dict[str, Column]] = {}
    for name in (*tier.logged, *_scalars(tier.route.takes, read)):
        table[name] = column([row[name] for row in read])
    given = set[str]().union(*commanded)
    for name in (*tier.units, *sorted(given - tier.units.keys())):
        if name in given:
            values = [as_table(row.get(name, nan)) for row in commanded]
            table |= _commanded(name, values)
            of_rows |= row_table(tier.name, name, table["time"], values)
    for name in dict.fromkeys(name for row in reported for name in row):
        table[f"{name}_planned"] = column([row.get(name, nan) for row in reported])
    for name, values in tier.timing.items():
        table[name] = column([*values, *[nan] * (len(ticks) - len(values))][: len(ticks)])
    return {tier.name: table, **of_rows}


def _commanded(name: str, values: list[Any]) -> dict[str, Column]:
    """Columns of a command; of motions the number of rows and a digest."""
    tables = [is_table(value) for value in values]
    entries = [len(value) if table else value for value, table in zip(values, tables, strict=True)]
    columns = {command_column(name): column(entries)}
    if any(tables):
        told = [digest(value) if table else nan for value, table in zip(values, tables, strict=True)]
        columns[command_column(digest_name(name))] = column(told)
    return columns


def _scalars(names: Mapping[str, str], read: list[Mapping[str, Any]]) -> list[str]:
    """Set-points that are numbers; arrays are logged with the tier that commanded them."""
    return [name for name in names if not any(np.ndim(row[name]) for row in read)]


def _figure(value: Any) -> Column:
    """A number or an array of numbers; other values as text."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return np.asarray(str(value))


def column(values: list[Any]) -> Column:
    """Return numbers as an array, arrays of unequal length as rows padded with NaN, other values as text."""
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
