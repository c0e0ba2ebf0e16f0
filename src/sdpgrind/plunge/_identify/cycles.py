"""Cycles as read from a log: command, size, power; faults of the size gauge; means over parts."""

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import means
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._plan.replay_kernels import lags

MOVING = 10  # chosen: least number of readings of a moving size; fewer leave the variance unknown
_STILL = 10  # chosen: equal readings in a row of a gauge that is frozen, or of a size at rest
_UNSEEN = 2.0  # measured: steps of the gauge; a size at rest lacks at most 1.1 to its end
_UNTOLD = 3.0  # chosen: standard deviations of a reading within which no growth is missed
_SIGMAS = 5.0  # chosen: rejects one good Gaussian reading in 1.7 million
_ANOTHER = 0.5  # chosen: share of its range so far by which a size jumps back where another part begins
_QUANTITIES = {"command_rate": "mm/s", "size": "mm", "grinding_power": "W", "power_saturated": "1"}


@dataclasses.dataclass(frozen=True, eq=False)
class Cycle:
    """One part: time (s), command rate (mm/s), size (mm), power (W), clip flag; NaN: no reading."""

    label: str
    time: Floats
    command_rate: Floats
    size: Floats
    grinding_power: Floats
    power_saturated: Floats

    @cached_property
    def step(self) -> Floats:
        """Durations between rows, s."""
        return np.diff(self.time)

    @cached_property
    def infeed(self) -> Floats:
        """Commanded infeed p, mm."""
        return np.concatenate([[0.0], np.cumsum(self.command_rate[:-1] * self.step)])

    @cached_property
    def read(self) -> Any:
        """Rows with a size."""
        return np.isfinite(self.size)

    @property
    def missing(self) -> int:
        """Number of missing sizes."""
        return int(np.sum(~self.read))

    @cached_property
    def noise_sd(self) -> float:
        """Standard deviation of the size, mm, from second differences, almost free of smooth motion."""
        bends = np.abs(np.diff(self.size, 2))
        bends = bends[bends > 0]  # 0: quantized or frozen gauge
        return float(np.median(bends) / 0.6745 / np.sqrt(6)) if bends.size else 0.0

    @cached_property
    def quantum(self) -> float:
        """Step of the gauge, mm."""
        return step_of(self.size[self.read])

    @cached_property
    def jitter(self) -> float:
        """Greatest change between two sizes explained by noise and quantization, mm."""
        return max(_SIGMAS * 2**0.5 * self.noise_sd, 1.5 * self.quantum, 1e-9)

    @cached_property
    def moving(self) -> Any:
        """Rows with a size well above the first one."""
        first = self.size[self.read][:1]
        return self.read & (self.size > (first[0] if first.size else 0.0) + self.jitter)


def cycles(
    data: Any, *, power: bool = False, size: bool = True, part: int | Sequence[int] | None = None
) -> tuple[Cycle, ...]:
    """Parts of a log, or of arrays by name."""
    needed = {"size": size, "grinding_power": power, "power_saturated": False}
    optional = [name for name in needed if not needed[name]]
    found = idf.series(
        data, _QUANTITIES, tier="controller", commands=("command_rate",), optional=optional, part=part
    )
    return tuple(
        Cycle(
            s.label,
            s.time,
            s["command_rate"],
            *(s[name] if name in s else np.full(s.time.size, np.nan) for name in needed),
        )
        for s in found
    )


def step_of(size: Floats) -> float:
    """Least change between two sizes, mm: upper bound of the gauge's resolution."""
    changes = np.abs(np.diff(size))
    return float(changes[changes > 0].min()) if np.any(changes > 0) else 0.0


def fault(cycle: Cycle) -> str:
    """Reason why the size of a cycle is unusable; empty: it is usable."""
    if not cycle.infeed[-1] > 0.0:
        return (
            _withdrawn(cycle) or f"the command feeds {cycle.infeed[-1]:.4g} mm in all: a part needs an infeed"
        )
    if still := _stands_still(cycle):
        return still
    if back := _jump_back(cycle):
        return another_part(cycle) or back
    if (count := int(np.sum(cycle.moving))) < MOVING:
        few = f"{count} readings of a moving size are too few: at least {MOVING} are needed"
        return f"{few} ({cycle.missing} are missing)"
    return ""


def _withdrawn(cycle: Cycle) -> str:
    """Since when the command takes the wheel off the work, in words; empty: it does not.

    That is where it has gone back and is behind the size: no deflection is left.
    """
    rows = np.flatnonzero(cycle.read)
    infeed, ground = cycle.infeed[rows], cycle.size[rows] - cycle.size[rows][:1]
    gone_back = np.maximum.accumulate(cycle.infeed)[rows] - infeed
    off = rows[(gone_back > cycle.jitter) & (infeed < ground - cycle.jitter)]
    if not off.size:
        return ""
    before = cycle.infeed[: off[0] + 1]
    since = cycle.time[np.flatnonzero(before == before.max())[-1]]
    return f"the command takes the wheel off the work from {since:.2f} s on: leave out the rows after it"


def fault_of_lag(cycle: Cycle) -> str:
    """The same for a linear lag, which would pull at the work when the wheel leaves it."""
    return fault(cycle) or _withdrawn(cycle)


def _stands_still(cycle: Cycle) -> str:
    """First run of equal sizes after growth, to which growth is due, in words; empty: there is none."""
    rows = np.flatnonzero(cycle.read)
    size, time = cycle.size[rows], cycle.time[rows]
    for first, last in runs(size):
        before = size[first] - size[max(0, 2 * first - last)]
        if before >= max(cycle.jitter, 3 * cycle.quantum) and _misses(cycle, rows, first, last):
            span = f"from {time[first]:.2f} to {time[last]:.2f} s"
            return f"the gauge stands still at {size[first]:.4f} mm {span} while the work is ground"
    return ""


def _misses(cycle: Cycle, rows: Any, first: int, last: int) -> bool:
    """Whether growth is due to equal sizes, from reading `first` to `last`, that the gauge does not show.

    Noise of a filter may hide it: then the size neither jumps at the end nor lags behind for as long again.
    """
    size, due = cycle.size[rows], _due(cycle, rows[first], rows[last])
    if due < max(_UNSEEN * cycle.quantum, _UNTOLD * cycle.noise_sd):
        return False
    later = min(2 * last - first, size.size - 1)
    jumps = later > last and size[last + 1] - size[last] > due / 2
    return bool(jumps or size[later] - size[first] < _due(cycle, rows[first], rows[later]) / 2)


def _due(cycle: Cycle, first: int, last: int) -> float:
    """Growth of the size (mm) from one row to another that is due to the lag of the rows before.

    That of s' = (p - z - s)/tau, by least squares of its integral over the moving sizes s, for the command p
    and any contact z. Where they tell none, what the command feeds.
    """
    fed, before = float(cycle.infeed[last] - cycle.infeed[first]), np.flatnonzero(cycle.moving[: first + 1])
    time, behind = cycle.time[before], (cycle.infeed - cycle.size)[before]
    area = np.cumsum(np.diff(time, prepend=time[:1]) * (behind + np.append(behind[:1], behind[:-1])) / 2)
    matrix = np.column_stack([np.ones(time.size), area, -time])
    _, rate, pull = np.linalg.lstsq(matrix, cycle.size[before], rcond=None)[0]
    if not rate > 0:
        return fed
    left = max(float(cycle.infeed[first] - cycle.size[first] - pull / rate), 0.0)
    pole = np.exp(-rate * cycle.step[first:last])
    return fed + left - float(lags(left, pole, cycle.command_rate[first:last] * (1 - pole) / rate)[-1])


def another_part(cycle: Cycle) -> str:
    """Reason why rows are those of more than one part; empty: nothing shows it."""
    size = cycle.size[cycle.read]
    so_far = np.maximum.accumulate(size) - np.minimum.accumulate(size)
    back = size[:-1] - size[1:] > np.maximum(_ANOTHER * so_far[:-1], cycle.jitter)
    for after in (np.flatnonzero(back) + 1).tolist():
        low, high = size[after] + cycle.jitter, size[after - 1] - cycle.jitter
        through = (size > low) & (size < high)
        if min(through[:after].sum(), through[after:].sum()) >= MOVING:
            return f'{_jump_at(cycle, after)}; of another part? Log.read takes its column, part="header"'
    return ""  # a spike, or a gauge that is withdrawn, jumps over what a part grows through


def _jump_back(cycle: Cycle) -> str:
    """Greatest jump of the size to a smaller one, in words; empty: noise explains it."""
    drops = np.diff(cycle.size[cycle.read])
    if not drops.size or drops.min() >= -cycle.jitter:
        return ""
    return _jump_at(cycle, int(np.argmin(drops)) + 1)


def _jump_at(cycle: Cycle, after: int) -> str:
    """Jump of the size back to the reading `after`, in words."""
    size, time = cycle.size[cycle.read], cycle.time[cycle.read]
    size_of_it = f"the size jumps back by {size[after - 1] - size[after]:.4g} mm at {time[after]:.2f} s"
    return f"{size_of_it}, more than {_SIGMAS:g} standard deviations of its noise"


def runs(size: Floats) -> list[tuple[int, int]]:
    """First and last index of each run of equal readings that is long enough to count as frozen."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(size)) + 1, [size.size]])
    return [(int(a), int(b) - 1) for a, b in pairwise(edges) if b - a >= _STILL]


def not_identified(name: str, unit: str, reason: str) -> idf.Estimate:
    """Failed estimate of one value, with its reason."""
    status = idf.Status.NOT_IDENTIFIED
    return idf.Estimate((name,), np.zeros(1), np.full((1, 1), np.inf), status, f"{status}: {reason}", (unit,))


def concluded(estimate: idf.Estimate, reason: str) -> idf.Estimate:
    """Estimate of a positive value; failed where the standard deviation exceeds the value."""
    name, unit = estimate.names[0], estimate.units[0]
    if not estimate.ok:
        return not_identified(name, unit, reason)
    if not estimate.value[0] > estimate.sd[0]:
        shown = f"{estimate.value[0]:.3g} ± {estimate.sd[0]:.3g} {unit}".removesuffix(" 1")
        return not_identified(name, unit, f"{reason} ({shown})")
    return estimate


def mean_of_parts(
    each: Sequence[Cycle], one: Callable[[Cycle], idf.Estimate], name: str, unit: str
) -> idf.Estimate:
    """Mean of the estimates of the parts; failed parts are left out and counted."""
    found = [(cycle, one(cycle)) for cycle in each]
    good = [estimate for _, estimate in found if estimate.ok]
    reasons = [f"{c.label}: {e.message}" if len(found) > 1 else e.message for c, e in found if not e.ok]
    if not good:
        first = reasons[0].replace(f"{idf.Status.NOT_IDENTIFIED}: ", "") if reasons else "there is no part"
        return not_identified(name, unit, first)
    kept = [cycle for cycle, estimate in found if estimate.ok]
    lost = sum(cycle.missing for cycle in kept)
    message = f"from {counted(len(good), 'part')}"
    message += f", {lost} readings missing" if lost else ""
    message += f"; {len(reasons)} left out, {reasons[0]}" if reasons else ""
    message += next((f"; {e.message}" for e in good if e.message != str(e.status)), "")
    return (pooled(good) if len(good) > 1 else good[0]).replace(message=message)


def pooled(each: Sequence[idf.Estimate]) -> idf.Estimate:
    """Mean of estimates of one value by inverse variance; its variance covers their scatter."""
    values = np.array([estimate.value[0] for estimate in each])
    variances = np.array([estimate.covariance[0, 0] for estimate in each])
    mean, variance, freedom = means.pooled(values, variances, sum(estimate.freedom for estimate in each))
    return each[0].replace(value=np.array([mean]), covariance=np.full((1, 1), variance), freedom=freedom)
