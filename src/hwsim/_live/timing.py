"""Times of the steps of a live part, as columns of the tables and figures of the outcome; see the labels."""

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hwsim._live.machine import LiveMachine
from hwsim._log.labels import LIVE_COLUMNS
from hwsim._part.part import Column, PartLoop, Tier


def attach(loop: PartLoop, machine: LiveMachine) -> None:
    """Time the steps of a part."""
    for tier in loop.tiers:
        tier.timing = {name: [] for name in LIVE_COLUMNS}
        tier.step = _timed(tier, machine)


def _timed(tier: Tier, machine: LiveMachine) -> Callable[..., Any]:
    step, columns = tier.step, tier.timing

    def timed(**read: Any) -> Any:
        begun = time.monotonic_ns()
        try:
            return step(**read)
        finally:
            ended = time.monotonic_ns()
            columns["release_delay"].append((begun - machine.released) / 1e9)
            columns["step_time"].append((ended - begun) / 1e9)
            columns["sample_age"].append((begun - machine.sampled) / 1e9)
            columns["overrun"].append(float(tier.missed))

    return timed


def outcome(loop: PartLoop, machine: LiveMachine, begun: str) -> Mapping[str, Column]:
    """Figures of a part, finished or aborted."""
    each = [tier.timing for tier in loop.tiers]
    trip = machine.trip
    steps = [seconds for timing in each for seconds in timing["step_time"]]
    values = {
        "begun": begun,
        "overruns": sum(sum(timing["overrun"]) for timing in each),
        "longest_step": max(steps, default=0.0),
        "aborted": float(trip is not None),
        "abort_reason": trip.reason if trip else "",
        "safe_delay": trip.delay if trip else np.nan,
        "safe_by": trip.by if trip else "",
    }
    return {name: np.asarray(value) for name, value in values.items()}
