"""Pushes, strategies and whole cycles of centering: ``python benchmarks/centering_cycle.py [--only PART]
[--parts N]``.

Medians of runs in turn, so that all see the same load; one core, except for whole cycles, which take all
there are.
"""

import argparse
import contextlib
import os
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from measure import in_turn

import centering
import hwsim
from sdpgrind import units

BARS: list[tuple[str, str, str, bool]] = []
MASSES = {0.8: 61.95, 5.0: 85.0, 18.9: 89.5}  # kg: mm
DOUBTED = {12.0: 85.0, 18.9: 89.5}  # kg: mm
SLOWEST = {0.6: 3.1, 1.0: 2.6, 1.4: 3.3}  # factor of friction: bar of the mean time of 18.9 kg, s
PRINTED = centering.preset("printed")
warnings.filterwarnings("ignore", message=".*stick and slip.*")


def most(what: str, value: float, bar: float, unit: str) -> None:
    BARS.append((what, f"{value:.3g} {unit}", f"<= {bar:g} {unit}", value <= bar))


def least(what: str, value: float, bar: float, unit: str) -> None:
    BARS.append((what, f"{value:.3g} {unit}", f">= {bar:g} {unit}", value >= bar))


def told(took: dict[str, float], first: str, unit: float, name: str) -> None:
    """One row for each, and how many times the first it takes."""
    print(f"| | [{name}] | times the first |\n|---|---|---|")
    for what, seconds in took.items():
        print(f"| {what} | {seconds / unit:.3g} | {seconds / took[first]:.3g} |")


def ring(mass: float, preset: str = "printed") -> centering.CenteringProblem:
    return centering.preset(preset).replace(part=centering.push.Part(mass, MASSES[mass]))


def stepped(parameters: np.ndarray, speed: float, duration: float, step: float) -> float:
    """Where the same push ends by time stepping, semi-implicit; as plain as it can be."""
    inertia, k, b, breakaway, coulomb, viscous = parameters
    x = v = 0.0
    for n in range(round(duration / step)):
        closure = speed * n * step - x
        force = max(0.0, k * closure + b * (speed - v)) if closure > 0.0 else 0.0
        if v == 0.0 and force <= breakaway:
            continue
        v = max(0.0, v + step * (force - coulomb - viscous * v) / inertia)
        x += step * v
    return x


def pushes() -> None:
    print("\n## Pushes of 0.4 s at constant speed, 18.9 kg, one core")
    model, count = PRINTED.model, 2000
    at_600 = [centering.TipProfile.constant_speed(10.0, 0.4)] * count
    speeds = units.mm_per_min(np.linspace(100.0, 5000.0, count))
    anywhere = [centering.TipProfile.constant_speed(float(speed), 0.4) for speed in speeds]
    runs = {
        "600 mm/min": lambda: centering.push.simulate_pushes(model, at_600),
        "100 to 5000 mm/min": lambda: centering.push.simulate_pushes(model, anywhere),
    }
    took = {name: seconds / count for name, seconds in in_turn(runs, 11).items()}
    small = PRINTED.replace(mass=0.8).model
    took["0.8 kg, 100 to 5000 mm/min"] = (
        in_turn({"": lambda: centering.push.simulate_pushes(small, anywhere)}, 5)[""] / count
    )
    begin = time.perf_counter()
    apart = (
        stepped(model.parameters, 10.0, 0.4, 1e-5) - centering.push.simulate_pushes(model, at_600[:1])[0, 0]
    )
    took["600 mm/min, time stepping by 10 us, Python"] = time.perf_counter() - begin
    told(took, "600 mm/min", 1e-6, "us")
    print(f"time stepping ends {1e6 * apart:+.1f} nm from the events")
    residual = max(
        float(centering.push.simulate_pushes(each, anywhere)[:, 5].max()) for each in (model, small)
    )
    print(f"largest residual of the energy balance: {residual:.1e}")
    least("pushes, 600 mm/min", 1 / took["600 mm/min"], 25_000, "1/s")
    least("pushes, 100 to 5000 mm/min", 1 / took["100 to 5000 mm/min"], 8_000, "1/s")
    most("energy balance", residual, 1e-9, "")


def exact_plans(count: int) -> list[float]:
    """How long exact plans of any mass, preset, offset, speed, table and shape take, ms; those that are
    refused left out.
    """
    rng, found = np.random.default_rng(0), []
    for _ in range(count):
        problem = ring(float(rng.choice(list(MASSES))), str(rng.choice(["printed", "identified"])))
        task = {
            "offset": 10.0 ** rng.uniform(-2.0, 1.0),
            "push_speed": rng.uniform(2.0, 40.0),
            "follow_gap": 40.0,
        }
        task |= {
            "spindle_speed": units.rpm(rng.uniform(5.0, 100.0)),
            "shape": str(rng.choice(["trapezoid", "gentle"])),
        }
        with warnings.catch_warnings(), contextlib.suppress(ValueError):
            warnings.simplefilter("ignore")
            took = in_turn({"": lambda problem=problem, task=task: centering.plan_push(problem, **task)}, 5)
            found.append(1e3 * took[""])
    return found


def plans() -> None:
    print("\n## Planning a push: 1 mm, 20 1/min, 10 mm/s, 18.9 kg")
    task = {"offset": 1.0, "spindle_speed": units.rpm(20), "push_speed": 10.0}
    names = ("end", "contact", "quasi-static", "exact")
    runs = {name: lambda name=name: centering.plan_push(PRINTED, **task, direction=name) for name in names}
    took = in_turn(runs, 51)
    told(took, "end", 1e-3, "ms")
    most("lead and stroke (5.1) to (5.17)", 1e3 * took["end"], 1.0, "ms")
    drawn = exact_plans(200)
    median, slow = np.quantile(drawn, (0.5, 0.95))
    print(f"exact, {len(drawn)} drawn: median {median:.2f} ms, 95 % {slow:.2f} ms, most {max(drawn):.2f} ms")
    most("exact lead and stroke, median of those drawn", float(median), 1.0, "ms")
    friction = centering.FrictionEstimator(PRINTED)
    trace = centering.simulate_push(PRINTED.model, centering.TipProfile.move(5.0, 40.0, 2560.0))
    print(
        f"friction estimator, one update: {1e3 * in_turn({'': lambda: friction.update(trace)}, 31)['']:.2f} ms"
    )


def strategies() -> None:
    print("\n## A strategy: planning, one process, and looking up\n| kg | [s] |\n|---|---|")
    for mass in MASSES:
        begin = time.process_time()
        strategy = centering.plan(ring(mass))
        print(f"| {mass:g} | {time.process_time() - begin:.1f} |")
    push = strategy.push(offset=1.0)
    runs = {
        "push": lambda: [strategy.push(offset=0.3, friction=1.05, evidence=2) for _ in range(1000)],
        "value": lambda: [strategy.value(offset=0.3, friction=1.05, evidence=2) for _ in range(1000)],
        "update_belief": lambda: [
            strategy.update_belief(1.0, 1.0, push, 0.98 * push.aim) for _ in range(1000)
        ],
    }
    took = {name: seconds / 1000 for name, seconds in in_turn(runs, 21).items()}
    told(took, "push", 1e-6, "us")
    most("looking up a push", 1e6 * took["push"], 10.0, "us")


def steps() -> None:
    print("\n## A step of the controller, a tick of the machine, a part of 0.8 kg")
    problem = ring(0.8)
    strategy = centering.plan(problem)
    machine, ours = hwsim.CenteringMachine(problem), centering.CenteringController(strategy)
    log = hwsim.run(machine, ours, parts=5, rng=0)
    samples = log["control"].sizes["row"]
    ticks = float(log.outcome.time.sum()) / machine.tick
    ideal = machine.replace(scheduler=None)
    runs = {
        "a step of ours, on a recording": lambda: hwsim.run(hwsim.Recording(log), ours, rng=0),
        "five parts": lambda: hwsim.run(machine, ours, parts=5, rng=0),
        "five parts, no scheduler": lambda: hwsim.run(ideal, ours, parts=5, rng=0),
    }
    took = in_turn(runs, 7)
    first = int((log["control"].part.values == 0).sum())
    took["a step of ours, on a recording"] /= first
    print(f"controller with recording: {1e6 * took['a step of ours, on a recording']:.0f} us a step")
    print(
        f"whole: {1e6 * took['five parts'] / samples:.0f} us a sample, {1e6 * took['five parts'] / ticks:.1f} us a tick of 1 ms;"
    )
    print(
        f"{float(log.outcome.time.sum()) / took['five parts']:.0f} times as fast as the machine would be;",
        end=" ",
    )
    print(f"without scheduler {took['five parts, no scheduler'] / took['five parts']:.2f} of the time")


def cycles(parts: int) -> None:
    print(f"\n## Whole cycles, {parts} parts each: source / ours")
    print(
        "| preset | kg | time, mean [s] | 95 % [s] | pushes, mean | 95 % | not finished | planned [s] |\n"
        + "|---" * 8
        + "|"
    )
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        for preset in ("printed", "identified"):
            for mass in MASSES:
                _cycle(preset, mass, parts, executor)


def _cycle(preset: str, mass: float, parts: int, executor: ProcessPoolExecutor) -> None:
    problem = ring(mass, preset)
    strategy = centering.plan(problem, executor=executor)
    both = {
        "source": centering.PrintedController(problem, scheduled=strategy),
        "ours": centering.CenteringController(strategy),
    }
    found = hwsim.compare(
        hwsim.CenteringMachine(problem), both, parts=parts, rng=0, executor=executor
    ).outcome
    start = np.hypot(found.center_x.sel(controller="ours"), found.center_y.sel(controller="ours"))[
        :, 0
    ].values
    expected = float(np.mean([strategy.cycle_time(min(float(x), problem.offset_max)) for x in start]))

    def pair(values: Any, form: str) -> str:
        return " / ".join(format(float(each), form) for each in values)

    cells = [pair(found.time.mean("part"), ".2f"), pair(found.time.quantile(0.95, "part"), ".2f")]
    cells += [pair(found.pushes.mean("part"), ".2f"), pair(found.pushes.quantile(0.95, "part"), ".1f")]
    print(
        f"| {preset} | {mass:g} | {' | '.join(cells)} | {pair((found.finished == 0).sum('part'), '.0f')} | {expected:.2f} |"
    )
    ours = float(found.time.sel(controller="ours").mean())
    most(f"{preset}, {mass:g} kg: predicted time off by", 100 * abs(expected / ours - 1), 15.0, "%")
    if preset == "printed":
        _bars(mass, found)


def _bars(mass: float, found: Any) -> None:
    source, ours = (float(found.time.sel(controller=name).mean()) for name in ("source", "ours"))
    done = 100 * float(found.finished.sel(controller="ours").mean())
    least(f"{mass:g} kg: finished", done, 99.0, "%")
    if mass != 5.0:
        most(f"{mass:g} kg: mean time", ours, {0.8: 4.0, 18.9: 4.5}[mass], "s")
    least(f"{mass:g} kg: time of the source's controller over ours", source / ours, 3.0, "")


def doubts(parts: int) -> None:
    print(f"\n## Friction that is not what was told: planned for 0.6 to 1.4 of it, {parts} parts each")
    print(
        "| kg | friction | thrown | collisions | unfinished | time, mean [s] | 95 % [s] | pushes | promised [s] |"
    )
    print("|---" * 9 + "|")
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        for mass, radius in DOUBTED.items():
            problem = PRINTED.replace(mass=mass, radius=radius, friction_range=(0.6, 1.4))
            strategy = centering.plan(problem, executor=executor)
            risk = strategy.robust()
            for row, factor in enumerate(risk.factor):
                out = _doubted(problem, strategy, float(factor), parts, executor)
                print(_doubt_row(mass, factor, out, risk.time[row]))
                _doubt_bars(mass, float(factor), out, risk, row)


def _doubted(
    problem: centering.CenteringProblem,
    strategy: centering.Strategy,
    factor: float,
    parts: int,
    executor: ProcessPoolExecutor,
) -> Any:
    """Outcome of parts whose mean friction is a factor of that told."""
    told = problem.model
    truth = told.replace(mu_static=factor * told.mu_static, mu_kinetic=factor * told.mu_kinetic)
    machine = hwsim.CenteringMachine(problem, truth=truth)
    controller = centering.CenteringController(strategy)
    return hwsim.run(machine, controller, parts=parts, rng=3, executor=executor).outcome


def _doubt_row(mass: float, factor: float, out: Any, promised: float) -> str:
    counts = [int(out.slipped.sum()), int(out.collisions.sum()), int((out.finished == 0).sum())]
    times = [float(out.time.mean()), float(out.time.quantile(0.95)), float(out.pushes.mean()), promised]
    cells = [f"{mass:g}", f"{factor:g}", *map(str, counts), *(f"{value:.2f}" for value in times)]
    return f"| {' | '.join(cells)} |"


def _doubt_bars(mass: float, factor: float, out: Any, risk: centering.cycle.RiskTable, row: int) -> None:
    where, mean = f"{mass:g} kg, friction x {factor:g}", float(out.time.mean())
    thrown = float(out.slipped.mean())
    most(f"{where}: thrown", 100 * thrown, 100 / 300, "%")
    most(f"{where}: collisions", float(out.collisions.sum()), 0.0, "")
    most(f"{where}: unfinished", float((out.finished == 0).sum()), 0.0, "")
    if mass == 18.9 and factor in SLOWEST:
        most(f"{where}: mean time", mean, SLOWEST[factor], "s")
    most(f"{where}: promised time off by", 100 * abs(risk.time[row] / mean - 1), 15.0, "%")
    most(f"{where}: promised share thrown off by", 100 * abs(risk.thrown[row] - thrown), 1.0, "%")


PARTS = {
    "pushes": pushes,
    "plans": plans,
    "strategies": strategies,
    "steps": steps,
    "cycles": cycles,
    "doubts": doubts,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--parts", type=int, default=200, help="of a whole cycle (200: half an hour)")
    arguments = parser.parse_args()
    for key, part_of in PARTS.items():
        if arguments.only in (None, key):
            part_of(*([arguments.parts] if key in ("cycles", "doubts") else []))
    print("\n## Bars\n| what | here | bar | holds |\n|---|---|---|---|")
    for what, here, bar_text, holds in BARS:
        print(f"| {what} | {here} | {bar_text} | {'yes' if holds else 'NO'} |")
