"""A plant that replays recorded measurements and finds commands that differ from the recorded ones."""

from collections.abc import Iterator, Mapping
from copy import copy
from typing import Any, Self

import numpy as np

from hwsim._log.labels import LIVE_COLUMNS
from hwsim._log.log import Log
from hwsim._part.clock import Clock, common_tick, exact, simplest
from hwsim._part.motions import Column
from hwsim._replay.difference import unpadded
from hwsim._replay.recorded_motions import motions
from hwsim._replay.replay import Instant, Replay
from sdpgrind.base import checks

_COMMAND, _PLANNED, _DIGEST = "_command", "_planned", "_digest"
_COARSE = 1e-3  # tick of a recording without a grid, s; chosen: its steps go from sample to sample anyway
_EVEN = 1e-9  # s; chosen: above the rounding of equal steps


class _Accepted(dict[str, str]):
    """Recorded commands, units; other names are accepted too (as a difference), except tiers' set-points."""

    def __init__(self, recorded: Mapping[str, str], set_points: frozenset[str]) -> None:
        super().__init__(recorded)
        self.set_points = set_points

    def __contains__(self, name: object) -> bool:
        return name not in self.set_points

    def __reduce__(self) -> tuple[type, tuple[dict[str, str], frozenset[str]]]:
        return _Accepted, (dict(self), self.set_points)


class Recording:
    """One part of a log as a plant: it replays the measurements and compares the commands.

    ``hwsim.run(hwsim.Recording(log), controller)`` tries the controller of the log, or a changed one, on the
    record of a simulated or real machine. The part ends with the recording or at the first command that
    differs. Motions are compared row by row: ``profile[2, 1]`` is the second entry of the third row,
    ``profile`` a difference in the number of rows. Where the log lacks the rows (beyond a million, an old
    log), digests are compared: ``motion_digest``.

    Outcome: ``same`` (1: every command equals the recorded one bit for bit), ``steps`` compared, and of the
    first difference ``difference_time`` (s), ``difference_name`` and the values ``recorded`` and
    ``commanded`` (NaN: none). A command under a name that was never recorded is a difference.

    Parameters
    ----------
    log : Log
        Log of `hwsim.run`, new or loaded.
    part : int
        Number of the part.

    Raises
    ------
    ValueError
        When the log holds several controllers, or no such part.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem)
    >>> recording = hwsim.Recording(hwsim.run(hwsim.PlungeGrinder(problem), controller))
    >>> hwsim.run(recording, controller).outcome.same.values
    array([1.])
    >>> bolder = plunge.CycleController(problem, safety_margin=0.004)
    >>> outcome = hwsim.run(recording, bolder).outcome.isel(part=0)
    >>> bool(outcome.same), str(outcome.difference_name.values)
    (False, 'command_rate')
    """

    def __init__(self, log: Log, *, part: int = 0) -> None:
        checks.kind("log", log, Log, " of hwsim.run")
        if "controller" in log.outcome.dims:
            raise ValueError("log must be of one controller, as hwsim.run gives it; got one of hwsim.compare")
        if not log.tiers:
            raise checks.refuse("log", "with a table of what was commanded", log)
        if checks.count("part", part, 0) >= len(log):
            raise checks.refuse("part", f"< the number of parts in the log, {len(log)}", part)
        tables = {tier: _columns(log[tier], part) for tier in log.tiers}
        self._tables = {
            tier: {name: values for name, (values, _) in table.items()} for tier, table in tables.items()
        }
        self._units = {name: unit for table in tables.values() for name, (_, unit) in table.items()}
        self._motions = {
            (tier, name, row): motion
            for tier, table in self._tables.items()
            for name in table
            for row, motion in motions(log, tier, name, part)
        }
        self._set_points = frozenset(_set_points(self._tables))
        self._of = str(log.outcome.attrs.get("plant", ""))
        times = sorted({float(time) for table in self._tables.values() for time in table["time"]})
        self._times, self._grid = times, _on_a_grid(times)
        self._tick = _COARSE if self._grid is None else self._grid

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the recorded measurements, and ``time`` (s) of the sample."""
        names = (
            name
            for name in self._units
            if not name.endswith((_COMMAND, _PLANNED))
            and name not in self._set_points
            and name not in LIVE_COLUMNS
        )
        return {name: self._units[name] for name in names}

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the recorded commands; other names are accepted, too."""
        recorded = {
            n: unit
            for n, unit in self._units.items()
            if n.endswith(_COMMAND) and not n.endswith(_DIGEST + _COMMAND)
        }
        bare = {name.removesuffix(_COMMAND): unit for name, unit in recorded.items()}
        return _Accepted(
            {n: unit for n, unit in {**bare, **recorded}.items() if n not in self._set_points},
            self._set_points,
        )

    @property
    def outcomes(self) -> Mapping[str, str]:
        """Name -> unit of the result of the comparison."""
        return {
            "same": "",
            "steps": "",
            "difference_time": "s",
            "difference_name": "",
            "recorded": "",
            "commanded": "",
        }

    @property
    def description(self) -> Mapping[str, float | str]:
        """Name of the recorded plant (no unit), for the log."""
        return {"recorded_plant": self._of}

    @property
    def tick(self) -> float:
        """Common tick of the recorded times, s."""
        return self._tick

    def with_tick(self, tick: float) -> Self:
        """Return the same recording with another `tick` (s)."""
        other = copy(self)
        other._tick = checks.positive("tick", tick, "s")
        return other

    def start(self, rng: np.random.Generator) -> Replay:
        """Return the recording at its first sample, at time 0 s; `rng` is not used."""
        return Replay(
            list(self._instants()), None if self._grid is None else Clock(exact("tick", self._tick))
        )

    def _instants(self) -> Iterator[Instant]:
        """Readings and commands of all tiers, in order of time; events at one time one after the other."""
        at: dict[tuple[float, int], dict[str, int]] = {}
        for tier, table in self._tables.items():
            again = np.arange(table["time"].size) - np.searchsorted(table["time"], table["time"])
            for row, when in enumerate(zip(table["time"].tolist(), again.tolist(), strict=True)):
                at.setdefault(when, {})[tier] = row
        passes = _with_events(self._tables)
        late = [span for table in self._tables.values() if "overrun" in table for span in _late(table)]
        for (time, _), here in sorted(at.items()):
            reading: dict[str, Any] = {}
            commands: dict[str, Any] = {}
            for tier, row in here.items():
                for name, values in self._tables[tier].items():
                    self._sort(name, self._motion(tier, name, row, _entry(values, row)), reading, commands)
            missed = any(begin < time <= end for begin, end in late)
            yield Instant(time, reading, commands, bool(passes & here.keys()), missed)

    def _motion(self, tier: str, name: str, row: int, value: Any) -> Any:
        """The motion where the log has its rows; else its number of rows."""
        motion = self._motions.get((tier, name, row))
        return value if motion is None or len(motion) != value else motion

    def _sort(self, name: str, value: Any, reading: dict[str, Any], commands: dict[str, Any]) -> None:
        """Put a column's value among the readings or, for the first tier that has it, the commands."""
        bare = name.removesuffix(_COMMAND)
        if bare in self._set_points or name in LIVE_COLUMNS or name.endswith(_PLANNED):
            return
        if bare == name:
            reading.setdefault(name, value)
        elif not _missing(value):
            commands.setdefault(bare, value)


def _columns(table: Any, part: int) -> dict[str, tuple[Column, str]]:
    """Values and unit of each column of a table, for one part."""
    rows = np.flatnonzero(table["part"].values == part)
    named = {"time": table["time"], **{str(name): variable for name, variable in table.data_vars.items()}}
    return {name: (variable.values[rows], _unit(variable)) for name, variable in named.items()}


def _unit(variable: Any) -> str:
    unit = str(variable.attrs.get("units", ""))
    return "" if unit == "1" else unit


def _set_points(tables: Mapping[str, Mapping[str, Column]]) -> Iterator[str]:
    """Names that one tier commands another; arrays are logged with the upper tier alone."""
    lowest = list(tables)[-1]
    for tier, table in tables.items():
        for name, values in table.items():
            bare = name.removesuffix(_COMMAND)
            if bare == name or bare.endswith(_DIGEST):
                continue
            below = tier != lowest and values.ndim == 2
            if below or any(bare in other for each, other in tables.items() if each != tier):
                yield bare


def _on_a_grid(times: list[float]) -> float | None:
    """Largest tick (s) of which all times are multiples; None: there is none."""
    try:
        steps = {simplest(time) for time in times if time > 0}
        return (
            float(common_tick({f"time {k}": float(step) for k, step in enumerate(steps)}))
            if steps
            else _COARSE
        )
    except ValueError:
        return None


def _with_events(tables: Mapping[str, Mapping[str, Column]]) -> set[str]:
    """Tiers stepped at events: those of uneven steps or twice at one time, else those with the fewest."""
    steps = {tier: _steps(table) for tier, table in tables.items()}
    uneven = {tier for tier, step in steps.items() if step.size < 2 or np.ptp(step) > _EVEN}
    uneven |= {tier for tier, table in tables.items() if not np.diff(table["time"]).all()}
    fewest = min(step.size for step in steps.values())
    return uneven or {tier for tier, step in steps.items() if step.size == fewest}


def _steps(table: Mapping[str, Column]) -> Column:
    """Steps of a tier, s, without the last; those with missed releases in a run against the clock divided."""
    steps = np.diff(table["time"][:-1])
    return steps / (1.0 + table["overrun"][1:-1]) if "overrun" in table else steps


def _late(table: Mapping[str, Column]) -> Iterator[tuple[float, float]]:
    """Spans (s) from the first missed release of a late step to the next step of the tier."""
    time, overrun = table["time"], table["overrun"]
    for begin, end, missed in zip(time[:-1].tolist(), time[1:].tolist(), overrun[1:].tolist(), strict=True):
        if missed > 0:
            yield begin + (end - begin) / (1.0 + missed) + _EVEN, end
        elif missed != missed:  # the part ended, perhaps within a late step
            yield begin, end


def _entry(values: Column, row: int) -> Any:
    """An entry of a column: a number, an unpadded array, or a text."""
    value = values[row]
    if np.ndim(value) == 0:
        return float(value) if isinstance(value, np.number) else str(value)
    return unpadded(np.array(value))


def _missing(value: Any) -> bool:
    """Whether nothing was commanded."""
    return value.size == 0 if isinstance(value, np.ndarray) else value != value or value == "nan"
