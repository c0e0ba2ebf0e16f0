"""Way of a pass beside the bead, from feeds and durations: feed (T - t_R) less the length of the bead."""

import dataclasses
from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.tables import column_of, rows_of_parts, table_of, tables_in
from sdpgrind.weldbead.sequence._problem import SequenceProblem

LEAD_METHODS = ("mean",)
_TIER, _PASS_TIER = "sequence", "pass"
_READ = {"feed_rate": "mm/s", "duration": "s"}
_ROUNDING = 1e-6  # chosen: share of the length of a bead, below which a negative way is rounding


def estimate_lead(data: Any, *, problem: SequenceProblem | None, throw: bool) -> idf.Estimate:
    """Estimate the way beside the bead, mm, of passes alike; see `identify`."""
    problem = checks.kind(
        "problem", problem, SequenceProblem, ", whose bead_length and reset_time tell the way beside the bead"
    )
    logs = data if isinstance(data, list | tuple) else [data]
    found = [_read(each, problem.stage) for each in logs]
    arrays = {name: np.concatenate([read[name] for read in found]) for name in _READ}
    read = idf.Readings(arrays, _READ, "passes", sum(each.dropped for each in found)).require(2)
    least = float(read["duration"].min())
    if least <= problem.reset_time:
        raise checks.refuse("duration", f"> reset_time, {problem.reset_time:g} s", least, "s")
    if np.any(read["feed_rate"] <= 0):
        raise checks.refuse("feed_rate", "> 0", float(read["feed_rate"].min()), "mm/s")
    ways = read["feed_rate"] * (read["duration"] - problem.reset_time) - problem.bead_length
    return _concluded(ways, read, problem, throw)


def _read(data: Any, stage: float) -> idf.Readings:
    """Feed and duration of each pass; a log that names no duration tells it by its clock."""
    table, is_log = table_of(data, _TIER)
    if not is_log or "duration" in table or "duration_command" in table:
        return idf.readings(data, _READ, tier=_TIER, each="passes")
    feed, took = _feeds(data, table), _took(table, stage)
    kept = np.isfinite(feed) & np.isfinite(took)
    arrays = {"feed_rate": feed[kept], "duration": took[kept]}
    read = idf.readings(arrays, _READ, tier=_TIER, each="passes")
    return dataclasses.replace(read, dropped=int(np.sum(~kept)))


def _took(table: Any, stage: float) -> Floats:
    """Time of the pass that ended in each row, s, in whole stages: a plan has no other; NaN: none ended."""
    left = column_of(table, "time_left", "s")
    took = np.full(left.size, np.nan)
    for _, rows in rows_of_parts(table, left.size, None):
        took[rows][1:] = -np.diff(left[rows])
    return np.asarray(stage * np.round(took / stage))


def _feeds(data: Any, table: Any) -> Floats:
    """Feed of the pass that ended in each row, mm/s; of three tiers the one that "pass" commanded."""
    tiers = tables_in(data, _TIER)
    if "feed_rate" in table or _PASS_TIER not in tiers:
        return column_of(table, "feed_rate", "mm/s")
    asked = column_of(data[_PASS_TIER], "feed_rate_command", "mm/s")
    feed = np.full(asked.size, np.nan)
    for _, rows in rows_of_parts(data[_PASS_TIER], asked.size, None):
        feed[rows][1:] = asked[rows][:-1]
    return feed


def _concluded(ways: Floats, read: idf.Readings, problem: SequenceProblem, throw: bool) -> idf.Estimate:
    """Mean with the variance of a mean; below 0 it is 0, or impossible where no chance makes it so."""
    variance = np.full((1, 1), float(np.var(ways, ddof=1)) / ways.size)
    found = idf.Estimate(
        ("lead_length",), np.array([ways.mean()]), variance,
        message=read.message, units=("mm",), freedom=ways.size - 1.0, noise_sd=float(np.std(ways, ddof=1)),
    )  # fmt: skip
    if found.interval()[0, 1] >= -_ROUNDING * problem.bead_length:
        return found.replace(value=np.maximum(found.value, 0.0))
    told = (
        f"lead_length must be >= 0 (mm): the passes went {found.value[0]:.4g} mm beyond a bead of"
        f" {problem.bead_length:g} mm with {problem.reset_time:g} s of reset: look for another bead_length,"
        f" reset_time or unit ({read.message})"
    )
    if throw:
        raise ValueError(told)
    return found.replace(status=idf.Status.IMPOSSIBLE, message=told)
