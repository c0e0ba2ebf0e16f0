"""What a confidence of 0.999 costs and keeps: ``python benchmarks/plunge_safety.py [--parts N] [--only NAME ...]``.

Each row grinds parts on the simulated grinder by the controller that declares its doubts, with the wear flat
area believed 10 % low, 0.5 um and 1 % of noise, and counts burned parts; times are told over the exact optimum
of the true machine. A bar of 8 burned of 4000 is one of 1e-3 with two standard deviations.
"""

import argparse
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from typing import Any

import numpy as np

import hwsim
from sdpgrind import physics, plunge, units

SIMULATION = plunge.preset("simulation")
CONFIDENCE = 0.999
PIECE = 50  # parts of one task
BEYOND = (0.0, units.um(0.05), units.um(0.2))  # mm beyond the limit of roundness whose shares are told
ALL = {"sharpness_sd": 0.1, "deflection_sd": 0.1, "contact_zero_sd": 0.01, "burning_sd": 0.03,
       "diffusivity_sd": 0.05, "power_gain_sd": 0.01}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One row: changes of what is believed and of the truth, what is drawn and how often, and its bars."""

    name: str
    burned: int
    over: float
    """Bars: burned of all parts; time over the optimum, %."""
    believed: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)
    drawn: dict[str, float] = field(default_factory=dict)
    grinder: dict[str, Any] = field(default_factory=dict)
    parts: int = 4000
    series: int = 1
    """Parts on one drawn machine, with the recommended adaptation where there are several."""
    confidence: float = CONFIDENCE
    low: float = 0.9
    """Wear flat area believed over the true one."""
    problem: plunge.CycleProblem = SIMULATION
    roundness: float = np.inf
    """Bar: greatest out-of-roundness, mm; of a series: from its second part."""
    note: str = ""


def rows() -> Iterator[Row]:
    """Rows in the order of the bars."""
    yield Row("roundness 3 um", 8, 1.0)
    yield Row("roundness 8 um", 8, 0.5, {"roundness_max": 8e-3}, {"roundness_max": 8e-3})
    noisy = {"noise": hwsim.GrinderNoise(units.um(0.5), 0.02)}
    rough = {"roundness_max": 8e-3}
    yield Row("8 um, 2 % power noise", 8, 0.6, rough | {"power_sd": 0.02}, rough, grinder=noisy)
    for sd, over in ((0.01, 2.0), (0.02, 3.2), (0.03, 4.8), (0.045, 8.5)):
        yield Row(f"B sd {100 * sd:g} %", 8, over, {"burning_sd": sd}, drawn={"burning_sd": sd})
    yield Row("all declared", 8, 6.0, ALL, drawn=ALL, series=20, low=1.0)
    burning = SIMULATION.model.burning
    lower = {"burning": burning.replace(B=0.95 * burning.B)}
    yield Row("B x0.95, declared 5 %", 0, np.inf, {"burning_sd": 0.05}, lower, parts=400)
    wider = {"diffusivity": 1.1 * SIMULATION.model.diffusivity}
    yield Row("diffusivity x1.1, declared 5 %", 0, np.inf, {"diffusivity_sd": 0.05}, wider, parts=400)
    gain = {"power_gain": 0.98}
    yield Row("power gain 0.98, declared 2 %", 0, np.inf, {"power_gain_sd": 0.02}, grinder=gain, parts=400)
    for by, tick, burned in ((0.01, 0.04, 8), (0.02, 0.04, 20), (0.02, 0.01, 8)):
        dulls = {"wear": plunge.Wear(by * SIMULATION.model.wear_flat_area / SIMULATION.stock)}
        name, sampled = f"dulls by {by:.0%} in a part, unknown, {1000 * tick:g} ms", {"sample_time": tick}
        yield Row(name, burned, 0.8, sampled, dulls | sampled, note=f"{100 * by:g} sd of its change")
    dulls = {"wear": plunge.Wear(0.05 * SIMULATION.model.wear_flat_area / SIMULATION.stock)}
    yield Row("dulls by 5% in a part, declared 2 %", 20, 1.0, {"sharpness_change_sd": 0.02}, dulls)
    yield Row("confidence 0.99, B sd 2 %", 60, np.inf, {"burning_sd": 0.02}, drawn={"burning_sd": 0.02},
              confidence=0.99, note="calibrated where 12 to 60 burn")  # fmt: skip
    round_enough = 3.05e-3
    for name, drive, over in (
        ("dead time 1 sample", {"feed_delay": 0.04}, 1.6), ("dead time 2 samples", {"feed_delay": 0.08}, 2.3),
        ("feed lag 0.1 s", {"feed_lag": 0.1}, 2.2), ("power lag 0.2 s", {"power_lag": 0.2}, 4.0),
    ):  # fmt: skip
        yield Row(name, 8, over, drive, roundness=round_enough)
    for ratio, over in ((100.0, 1.2), (20.0, 1.6)):
        worn = {"grinding_ratio": ratio}
        yield Row(f"grinding ratio {ratio:g}, doubted", 8, over, {"wheel_wear_sd": 0.05}, worn, series=4,
                  roundness=3.2e-3)  # fmt: skip
    machine = {"feed_delay": 0.04, "feed_lag": 0.05, "power_lag": 0.2}
    yield Row("all of the machine", 8, 6.0, machine | {"wheel_wear_sd": 0.05}, {"grinding_ratio": 100.0}, series=4,
              roundness=3.2e-3)  # fmt: skip
    first = {"sharpness_sd": 0.1, "deflection_sd": 0.1, "contact_zero_sd": 0.01}
    yield Row("first part, A, force, contact", 8, 1.5, first, drawn=first, low=1.0)
    for number, problem in enumerate(drawn_jobs(), 1):
        yield Row(f"job {number}, all declared", 8, 6.0, ALL, drawn=ALL, low=1.0, problem=problem, parts=1000,
                  note=f"of it price of B and diffusivity {unlearned(problem):+.1f} %")  # fmt: skip


def unlearned(problem: plunge.CycleProblem) -> float:
    """Time (%) that the doubts which no reading shows cost the exact plan: no controller is faster."""
    shown = dict.fromkeys(("sharpness_sd", "deflection_sd", "contact_zero_sd", "power_gain_sd"), 0.0)
    best = plunge.plan(problem.replace(**(ALL | shown)), confidence=CONFIDENCE)
    return 100.0 * best.price["all"] / (best.time - best.price["all"])


def drawn_jobs() -> list[plunge.CycleProblem]:
    """Eight jobs with random machine, work and limits, none of which burns at every rate."""
    rng, found = np.random.default_rng(0), []
    while len(found) < 8:
        share = rng.uniform(size=7)
        try:
            job = SIMULATION.replace(
                command_rate_max=0.03 + 0.06 * share[0], burning=physics.BurningLimit(6.205, 3 + 4.2 * share[1]),
                stock=0.15 + 0.25 * share[2], stiffness=4e3 + 26e3 * share[3],
                wear_flat_area=0.008 + 0.024 * share[4], roundness_max=units.um(2 + 4 * share[5]),
                work_rotation=units.hz(3 + 3 * share[6]), sample_time=1e-3, time_constant=None,
            )  # fmt: skip
        except ValueError:
            continue
        found.append(job.replace(sample_time=min(0.04, np.floor(250 * job.time_constant) / 1000)))
    return found


def ground(row: Row, piece: tuple[int, int]) -> np.ndarray:
    """Burned, time over the optimum (%), out-of-roundness, remaining (mm), first of its series: a row a part."""
    seed, parts = piece
    truth = row.problem.replace(**row.truth)
    believed = truth.replace(wear_flat_area=row.low * truth.model.wear_flat_area, **row.believed)
    if "grinding_ratio" in row.truth:
        believed = believed.replace(grinding_ratio=np.inf)
    if "wear" in row.truth:
        believed = believed.replace(wear=None)
    if "burning" in row.truth or "diffusivity" in row.truth:
        believed = believed.replace(**{name: getattr(row.problem.model, name) for name in row.truth})
    names = ("burning_sd", "diffusivity_sd", "sharpness_sd", "deflection_sd")
    known = truth.replace(**{name: row.drawn.get(name, 0.0) for name in names}, wheel_wear_sd=0.0)
    options = {"contact_zero_sd": row.drawn.get("contact_zero_sd", 0.0)} | row.grinder
    rng, found = np.random.default_rng([seed, 17]), []
    for _ in range(parts // row.series):
        model = known.draw(rng)
        gain = row.drawn.get("power_gain_sd", 0.0) * rng.standard_normal()
        plant = hwsim.PlungeGrinder(believed, truth=model, **({"power_gain": np.exp(gain)} | options))
        adapt = plunge.adaptation(believed) if row.series > 1 else None
        controller = plunge.CycleController(believed, confidence=row.confidence)
        out = hwsim.run(plant, controller, parts=row.series, rng=rng, adapt=adapt).outcome
        over = 100.0 * (out.time.values / (optimum_of(truth, model) if row.drawn else optimum(truth)) - 1.0)
        first = np.arange(row.series) == 0
        found.append(np.array([out.burned.values, over, out.roundness.values, out.remaining.values, first]))
    return np.concatenate(found, axis=1)


def optimum_of(problem: plunge.CycleProblem, model: plunge.PlungeModel) -> float:
    """Time (s) of the fastest cycle of a drawn model; NaN: its work burns at every rate."""
    try:
        return plunge.plan(problem.replace(model=model)).time
    except ValueError:
        return np.nan


def optimum(problem: plunge.CycleProblem) -> float:
    """Time (s) of the fastest cycle of a model, kept."""
    key = repr(problem)
    if key not in _OPTIMA:
        method = "exact" if problem.model.wear is None else "dp"
        _OPTIMA[key] = plunge.plan(problem, method=method).time
    return _OPTIMA[key]


_OPTIMA: dict[str, float] = {}


def told(row: Row, executor: Executor, parts: int) -> str:
    """Grind the parts of a row; its line of the table."""
    count = min(row.parts, parts)
    pieces = [(k, max(PIECE, row.series)) for k in range(max(count // max(PIECE, row.series), 1))]
    try:
        found = np.concatenate(list(executor.map(partial(ground, row), pieces)), axis=1)
    except ValueError as refused:
        return f"| {row.name} | refused: {refused} ||||||"
    burned, over, roundness, remaining, first = found
    later = roundness[first == 0.0] if row.series > 1 else roundness
    beyond = later - row.problem.replace(**row.truth).roundness_max
    shares = " / ".join(f"{100 * np.mean(beyond > each):.2f}" for each in BEYOND)
    error = np.nanstd(over) / np.sqrt(over.size)
    return (
        f"| {row.name} | {int(burned.sum())} of {burned.size} (bar {row.burned} of {row.parts})"
        f" | {np.nanmean(over):+.2f} ± {error:.2f}{barred('+', row.over)}"
        f" | {1e3 * roundness.max():.3f}{barred('', 1e3 * row.roundness)} | {1e3 * later.max():.3f} | {shares}"
        f" | {1e3 * remaining.min():+.2f} {1e3 * remaining.max():+.2f} | {row.note} |"
    )


def barred(sign: str, value: float) -> str:
    """A bar in brackets; nothing: there is none."""
    return "" if np.isinf(value) else f" (bar {sign}{value:g})"


def inspected(executor: Executor) -> None:
    """Severity read after each part: 200 series of 5; prior 4.5 %, read to 3 %."""
    found = np.concatenate(list(executor.map(severity_series, range(200))), axis=1)
    burned, over = found[0].reshape(-1, 5), found[1].reshape(-1, 5)
    print(f"severity 3 %, prior 4.5 %: {int(burned.sum())} burned of {burned.size} (bar 4); over the optimum by part:",
          ", ".join(f"{each:+.2f} %" for each in np.nanmean(over, axis=0)), "(bar +3 in the fifth)")  # fmt: skip


def severity_series(seed: int) -> np.ndarray:
    """Burned, and time over the optimum (%), of five parts whose severity is read."""
    problem = SIMULATION.replace(burning_sd=0.045)
    rng = np.random.default_rng([seed, 3])
    model = problem.replace(sharpness_sd=0.0, deflection_sd=0.0).draw(rng)
    grinder = hwsim.PlungeGrinder(problem, truth=model, contact_zero_sd=0.01, threshold_scatter=0.005,
                                  inspection=hwsim.Inspection(severity_sd=0.03))  # fmt: skip
    learning = plunge.learning.ThresholdUpdate(problem)
    out = hwsim.run(grinder, plunge.CycleController(problem), parts=5, rng=rng, adapt=learning).outcome
    best = optimum_of(SIMULATION, model)
    return np.array([out.burned.values, 100.0 * (out.time.values / best - 1.0)])


def etched(executor: Executor) -> None:
    """Good parts only, each ground at the margin then in force and etched: 1000 series of 100."""
    burned = sum(executor.map(etched_series, range(1000)))
    print(f"etched, predictive margin: {burned} burned of 100000, {burned / 1000:.3f} % (bar 0.07 to 0.13)")


def etched_series(seed: int) -> int:
    """Parts burned of a hundred whose reserve is the predictive margin; the series goes on as declared."""
    rng, scatter = np.random.default_rng([seed, 5]), 0.005
    threshold = plunge.BurnThreshold(SIMULATION.replace(burning_sd=0.045, threshold_scatter=scatter))
    eta, burned = 0.045 * rng.standard_normal(), 0
    for _ in range(100):
        reserve = threshold.margin
        bad = bool(eta + scatter * rng.standard_normal() > reserve)
        threshold.update(reserve=reserve, burned=bad)
        burned += bad
    return burned


def speed() -> None:
    """Time of one step, warm; of 200 series of 12 parts on two cores."""
    problem = SIMULATION.replace(burning_sd=0.03, diffusivity_sd=0.05)
    controller = plunge.CycleController(problem)
    seen = {"size": 0.0, "grinding_power": 0.0}
    part = hwsim.PlungeGrinder(problem).start(np.random.default_rng(0))
    took = []
    while not part.done:
        begin = time.perf_counter()
        command = controller.step(**seen)
        took.append(time.perf_counter() - begin)
        seen = part.step(command, 1)
    print(f"step {1e3 * np.median(took[5:]):.4f} ms, worst {1e3 * max(took[5:]):.4f} (bar 0.05)")
    grinder = hwsim.PlungeGrinder(problem)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as two:
        hwsim.repeat(grinder, controller, series=2, parts=2, executor=two)
        begin = time.perf_counter()
        both = hwsim.repeat(grinder, controller, series=200, parts=12, rng=1, executor=two)
        print(f"200 series of 12 parts on two cores {time.perf_counter() - begin:.2f} s (bar 6)", end=" ")
    alone = hwsim.repeat(grinder, controller, series=200, parts=12, rng=1)
    print(
        "bit-equal" if all(np.array_equal(both[n], alone[n], equal_nan=True) for n in both) else "DIFFERENT"
    )


HEAD = """
| what | burned | time over the optimum [%] | worst out-of-roundness [um] | from part 2 | over its limit by 0, 0.05, 0.2 um from part 2 [%] | least and greatest stock left [um] | |
|---|---|---|---|---|---|---|---|"""
OTHERS: dict[str, Callable[..., None]] = {"severity": inspected, "etched": etched}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--parts", type=int, default=4000)
    options.add_argument("--only", nargs="*", default=[])
    options.add_argument("--processes", type=int, default=os.cpu_count())
    given = options.parse_args()
    asked = [row for row in rows() if not given.only or any(word in row.name for word in given.only)]
    if not given.only or "speed" in given.only:
        speed()
    with ProcessPoolExecutor(given.processes, mp_context=get_context("spawn")) as executor:
        print(HEAD, flush=True)
        for row in asked:
            begin = time.perf_counter()
            print(told(row, executor, given.parts), f"{time.perf_counter() - begin:.0f} s", flush=True)
        for name, run in OTHERS.items():
            if not given.only or name in given.only:
                run(executor)


if __name__ == "__main__":
    main()
