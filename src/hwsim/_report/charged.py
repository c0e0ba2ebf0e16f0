"""Figures that a plant's plan is charged for: outcomes, planned values, reasons for a difference.

A plant's module has ``CHARGED``, names of outcomes, the first being what parts are ranked by; ``planned(log,
plan)``, an interval or a value of each part by name; and ``reasons(log, plan)``, sentences by name. It may
have ``events(log)``, sentences on what was done between parts, and ``MEANINGS``, words for outcomes by name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from hwsim._log.columns import modelled
from hwsim._report.statistics import Promise
from hwsim._report.worst import badness, broken_off, worst_part
from sdpgrind.base.checks import Floats

# Plant -> module; a table, since a file must not name code to import
_MODULES = {
    "AdaptiveGrinder": "hwsim._report.locus",
    "CenteringMachine": "hwsim._report.centering",
    "FinishingCell": "hwsim._report.finishing",
    "ForceTableStand": "hwsim._report.weldbead",
    "PlungeGrinder": "hwsim._report.plunge",
    "WeldBeadStand": "hwsim._report.weldbead",
}
_OF_FINISHED = (
    "time", "part_slack", "slack", "roundness", "out_of_round", "offset", "pushes", "roughness_ra",
    "removal_rate",
)  # fmt: skip
# flags and amounts that must be 0, with words for the parts that have them
FAULTS = {
    "burned": "burned",
    "out_of_round": "out of round",
    "overground": "ground below the target in places",
    "lateness": "late",
    "stalls": "stalled",
    "collisions": "with a collision",
    "slipped": "slipped",
    "lost": "lost",
    "extrapolated": "beyond the model",
}
# outcomes that are 0 or 1, counted instead of averaged
FLAGS = (
    "burned", "out_of_round", "slipped", "lost", "extrapolated",
    "unfinished", "timed_out", "finished", "said_finished",
)  # fmt: skip
_MAGNITUDES = (
    "time", "penalty", "passes", "pushes", "overground", "overground_worst", "roundness", "roughness_ra",
    "offset", "path_deviation", "lift_off", "peak_force", "convergence_time", "burn_time", *FAULTS,
)  # fmt: skip
_SCRAP = ("burned", "out_of_round")  # faults that no other figure of a part makes good
_LIKE = 0.7  # least correlation that is told; chosen: half of the variance
_FEW = 8  # parts for a correlation; chosen: 0.7 is then beyond chance (5 %)


@dataclass(frozen=True)
class Charges:
    """Charged outcomes of a log, and what was planned for them."""

    names: tuple[str, ...]
    planned: Mapping[str, Promise]
    reasons: Callable[[], Mapping[str, str]]


def charges_of(log: Any, plan: Any) -> Charges:
    """Return the charges of a log's plant, or all outcomes that are numbers."""
    known, there = _module_of(log), charged_names(log)
    planned = known.planned(log, plan) if known else {}
    reasons = (lambda: known.reasons(log, plan)) if known else dict
    promised = {n: Promise(_of_known(each, values_of(log, n))) for n, each in planned.items() if n in there}
    return Charges(there, promised, reasons)


def _of_known(planned: Any, values: Floats) -> Any:
    """What was planned; part by part for those of which a value is known, as a mean leaves out the others."""
    if not isinstance(planned, np.ndarray) or not np.isfinite(values).any():
        return planned
    return np.where(np.isfinite(values), planned, np.nan)


def charged_names(log: Any) -> tuple[str, ...]:
    """Return the charged outcomes of a log's plant, else all outcomes, without hidden truths and faults."""
    outcome, known = log.outcome, _module_of(log)
    names = known.CHARGED if known else [str(n) for n, v in outcome.data_vars.items() if v.dims == ("part",)]
    return tuple(n for n in names if n in outcome and not n.startswith("true_") and n not in FAULTS)


def events_of(log: Any) -> list[str]:
    """Return sentences on what was done between the parts of a log."""
    told = getattr(_module_of(log), "events", None)
    return list(told(log)) if told else []


def meanings_of(log: Any) -> list[str]:
    """Return sentences on outcomes whose names and units do not say what they are."""
    told = getattr(_module_of(log), "MEANINGS", {})
    return [f"{name.replace('_', ' ')}: {words}" for name, words in told.items() if name in log.outcome]


def _module_of(log: Any) -> Any:
    """Module of a log's plant; None: it has none."""
    module = _MODULES.get(str(log.outcome.attrs.get("plant", "")))
    return None if module is None else import_module(module)


def values_of(log: Any, name: str) -> Floats:
    """Return an outcome of each part; NaN where the part was broken off and it counts for finished ones.

    Texts have no value, and roughness beyond its model has none: NaN.
    """
    found = modelled(log.outcome)[name].values
    values = np.array(found, dtype=float) if found.dtype.kind in "biuf" else np.full(len(log), np.nan)
    if name in _OF_FINISHED:
        values[[bool(each) for each in broken_off(log.outcome)]] = np.nan
    elif "aborted" in log.outcome and name not in (*FLAGS, *FAULTS):  # a part that was stopped from outside
        values[log.outcome.aborted.values == 1] = np.nan
    return values


def least_of(name: str) -> float:
    """Return the smallest value that an outcome can have: 0 of a magnitude."""
    return 0.0 if name in _MAGNITUDES else -np.inf


def telling(log: Any, names: tuple[str, ...]) -> list[str]:
    """Return the charged outcomes by which parts differ, in the order in which they count."""
    return [name for name in names if worst_part(name, values_of(log, name)) is not None]


def ranked_by(log: Any, names: tuple[str, ...]) -> list[str]:
    """Return by what parts are ranked, in the order in which it counts: what spoils a part comes first."""
    broken = ["broken off"] if len({bool(each) for each in broken_off(log.outcome)}) > 1 else []
    spoiled = [FAULTS[name] for name in _SCRAP if name in log.outcome and np.ptp(log.outcome[name].values)]
    scrap = [" or ".join(spoiled)] if spoiled else []
    return [*broken, *scrap, *(name.replace("_", " ") for name in telling(log, names))]


def worst_parts(log: Any, names: tuple[str, ...], count: int) -> list[int]:
    """Return the worst parts, worst first: broken off, then scrap, then by the charged outcomes that differ.

    The first of them counts; the next where parts are alike in it.
    """
    broken = np.array([bool(each) for each in broken_off(log.outcome)])
    scrap = np.sum([log.outcome[name].values > 0 for name in _SCRAP if name in log.outcome], axis=0)
    ranks = [badness(name, values_of(log, name)) for name in telling(log, names)]
    keys = [-np.nan_to_num(rank, nan=-np.inf) for rank in reversed(ranks)]  # the last key counts most
    order = np.lexsort((*keys, -scrap * np.ones(len(log)), ~broken))
    return [int(k) for k in order[:count]]


def likeness(log: Any, name: str) -> str:
    """Return words for the hidden truth that an outcome goes with over the parts; "": there is none."""
    values, best = values_of(log, name), ("", 0.0)
    for other, variable in log.outcome.data_vars.items():
        if variable.dims != ("part",) or not str(other).startswith("true_"):
            continue
        paired = np.array([values, np.asarray(variable.values, dtype=float)])
        paired = paired[:, np.isfinite(paired).all(axis=0)]
        if paired.shape[1] < _FEW or not np.ptp(paired, axis=1).all():
            continue
        found = float(np.corrcoef(paired)[0, 1])
        if abs(found) > max(_LIKE, abs(best[1])):
            best = (str(other).replace("_", " "), found)
    return f"over the parts it goes with {best[0]} (correlation {best[1]:.2f})" if best[0] else ""
