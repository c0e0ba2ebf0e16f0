"""Promise of a plan that learns: drawn beads are ground in the model by the loop as it will be run.

Each bead is ground three times with the same draws: by a controller that learns it, by the plan alone, and by
one that knows the bead's coefficients.
"""

from collections.abc import Iterator, Mapping
from math import ceil, inf, sqrt
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress
from sdpgrind.base.rng import Seed, generator
from sdpgrind.weldbead.sequence._controller import SequenceController, knowing
from sdpgrind.weldbead.sequence._policy import SequencePolicy
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._risk import SURE, Risk
from sdpgrind.weldbead.sequence._waves import Waves

BEADS = 200  # chosen: beads without an asked error; the mean is then known to 15 % or so
BATCH = 50  # chosen: beads between two looks at the error
MOST = 20_000  # chosen: beads at most; they tell the mean to 1.5 % or so


class Ground(NamedTuple):
    """A ground bead."""

    penalty: float  # $
    height: float  # mm
    passes: int


def promised(
    policy: SequencePolicy,
    height: float,
    time_left: float,
    confidence: float,
    within: float,
    error: float | None,
    rng: Seed,
    progress: Progress,
) -> Risk:
    """Return the risk of a plan that learns, from a height (mm) and a time left (s).

    Beads are drawn until 1.96 standard errors of the mean are at most `error`, $.
    """
    ground: tuple[list[Ground], ...] = ([], [], [])
    learned = ground[0]
    for bead in _beads(policy, (height, time_left), generator(rng)):
        for planner, each in zip(ground, bead, strict=True):
            planner.append(each)
        if len(learned) % BATCH == 0:
            share = _share(learned, error)
            progress(share, f"{len(learned)} beads")
            if share >= 1 or len(learned) >= MOST:
                break
    return _risk([np.array(each, dtype=float).T for each in ground], confidence, within)


def _share(learned: list[Ground], error: float | None) -> float:
    """Share of the beads that an error, $, asks for."""
    if error is None:
        return len(learned) / BEADS
    half = _half(np.array([each.penalty for each in learned]))
    return (error / half) ** 2 if half > 0 else 1.0


def _beads(
    policy: SequencePolicy, state: tuple[float, float], rng: np.random.Generator
) -> Iterator[list[Ground]]:
    """Grind one bead after another: learned, by the plan alone, and known."""
    problem = policy.problem
    assert problem.bead_scatter is not None
    learns, never = SequenceController(policy), SequenceController(policy, learn=False)
    while True:
        process = problem.bead_scatter.drawn(problem.model, rng)
        seed = int(rng.integers(2**63))
        each = (learns, never, knowing(policy, process))
        yield [_ground(one, problem, process, *state, np.random.default_rng(seed)) for one in each]


def _ground(
    controller: SequenceController,
    problem: SequenceProblem,
    process: GrindingProcess,
    height: float,
    time_left: float,
    rng: np.random.Generator,
) -> Ground:
    """Grind one bead to its end."""
    assert problem.pass_scatter is not None
    controller.reset()
    readings: Mapping[str, float] = {}
    passes, feed, waves = 0, None, Waves.of(problem.waviness)
    while True:
        command = controller.step(height=height, time_left=time_left, **readings)
        if command["stop"]:
            return Ground(_penalty(problem, height, time_left, passes, feed), height, passes)
        now, feed = problem.pass_scatter.drawn(process, rng), command["feed_rate"]
        cut = waves.cut(controller.problem, now, command)
        readings = _read(now, cut, feed)
        height, time_left = height - readings["cut_depth"], time_left - command["duration"]
        passes += 1


def _read(now: GrindingProcess, cut: float, feed: float) -> dict[str, float]:
    """Readings of exact gauges of a pass of a depth (mm) and a feed (mm/s)."""
    force = float(now.normal_force(cut, feed))
    return {
        "normal_force": force,
        "tangential_force": now.friction_ratio * force,
        "grinding_power": float(now.grinding_power(force)),
        "removal_rate": cut * now.bead_width * feed,
        "cut_depth": cut,
    }


def _penalty(
    problem: SequenceProblem, height: float, time_left: float, passes: int, feed: float | None
) -> float:
    total: float = float(problem.height_charge(height)) + problem.pass_charge * passes
    if problem.lateness_charge is not None:
        total += float(np.asarray(problem.lateness_charge(np.asarray(max(-time_left, 0.0)))))
    if problem.finish_charge is not None and feed is not None:
        total += float(problem.finish_charge(feed))
    return total


def _half(sample: Floats) -> float:
    """Half of the 95 % interval of a mean."""
    return SURE * float(sample.std(ddof=1)) / sqrt(sample.size)


def _risk(ground: list[Floats], confidence: float, within: float) -> Risk:
    """Figures of beads that were learned, ground by the plan alone, and known: rows of `Ground`."""
    (penalty, height, passes), never, knows = ground
    worst = np.sort(penalty)[-max(1, penalty.size - ceil(confidence * penalty.size - 1e-9)) :]
    samples = {
        "mean": penalty,
        "overground": (height < 0).astype(float),
        "passes": passes,
        "finished": (np.abs(height) <= within).astype(float),
        "height": height,
        "learning": never[0] - penalty,
        "knowing": penalty - knows[0],
    }
    figures = {name: float(sample.mean()) for name, sample in samples.items()}
    errors = {name: _half(sample) for name, sample in samples.items()}
    half = _half(worst) if worst.size > 1 else inf
    return Risk(figures | {"cvar": float(worst.mean())}, errors | {"cvar": half}, confidence)
