"""Plunge cycles in closed loop, many parts: ``python benchmarks/plunge_loop.py [--series N] [--only NAME]``."""

import argparse
import multiprocessing
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import xarray as xr
from measure import median

import hwsim
from sdpgrind import physics, plunge

PROBLEM = plunge.preset("simulation")
FACTORS = (0.9, 1.1)


def dull(problem: plunge.CycleProblem) -> plunge.CycleProblem:
    """What a controller believes: a wheel 10 % sharper than it is."""
    return problem.replace(wear_flat_area=0.9 * problem.model.wear_flat_area)


@dataclass(frozen=True)
class Scattered:
    """A wear flat area that scatters from part to part, and a normal force of another ratio."""

    area_sd: float = 0.0
    ratio: float = 1.0

    def __call__(self, rng: np.random.Generator) -> plunge.PlungeModel:
        model = PROBLEM.model
        area = model.wear_flat_area * (1 + self.area_sd * rng.standard_normal())
        return model.replace(wear_flat_area=area, normal_force_ratio=self.ratio * model.normal_force_ratio)


def line(name: str, outcome: xr.Dataset, fastest: float) -> str:
    time = outcome.time.mean("series").values
    over = 100 * (time[[1, 2, -1]] / fastest - 1)
    parts = outcome.burned.size
    late = outcome.isel(part=slice(1, None))
    return (
        f"| {name} | {time[0]:.2f} | {over[0]:.2f} / {over[1]:.2f} / {over[2]:.2f} | {int(outcome.burned.sum())} of {parts} | "
        f"{1e3 * float(late.out_of_round.mean()):.1f} | {1e3 * float(outcome.part_slack.min()):.2f} |"
    )


HEAD = "| what | first part [s] | parts 2 / 3 / last over the optimum [%] | burned | out of round [1/1000] | least slack [um] |\n"
HEAD += "|---|---|---|---|---|---|"


def controllers(executor: Executor, series: int) -> None:
    print("\n## Controllers that know the truth, no noise, the smallest safe margin")
    print("| spark-out | sample [s] | margin [um] | time [s] | over the optimum [%] | out of round [um] |")
    print("|---|---|---|---|---|---|")
    for sparkout in ("printed", "p_end"):
        for sample in (0.04, 0.02, 0.01):
            problem = PROBLEM.replace(sample_time=sample)
            grinder = hwsim.PlungeGrinder(problem, noise=None)
            own = {"sparkout": sparkout, "roundness_margin": 0.0, "observer_gain": 1.0, "online": False}
            for margin in np.arange(0.0, 0.005, 5e-5):
                controller = plunge.CycleController(problem, margin, **own)
                outcome = hwsim.run(grinder, controller).outcome
                if not outcome.burned.any():
                    break
            time, roundness = float(outcome.time[0]), 1e3 * float(outcome.roundness[0])
            over = 100 * (time / plunge.plan(problem).time - 1)
            print(
                f"| {sparkout} | {sample:g} | {1e3 * margin:.2f} | {time:.2f} | {over:.2f} | {roundness:.3f} |"
            )


def bounding(executor: Executor, series: int) -> None:
    print("\n## Recursive Constraint Bounding, 0.5 um and 1 % of noise, wheel believed 10 % too sharp")
    print(
        "| step | rule | series with a burned part [%] | the same, area scatters 1 % | mean time [s] |\n|---|---|---|---|---|"
    )
    controller = plunge.CycleController(dull(PROBLEM), 0.05, sparkout="printed", roundness_margin=0.0)
    learned: dict[tuple[str, str], Callable[[], object]] = {
        (f"{step:.2f}", rule): (lambda s=step, r=rule: plunge.learning.MarginBounding(s, 0.005, rule=r))
        for step in (0.10, 0.25, 0.40, 0.80)
        for rule in ("printed", "contracting")
    }
    learned["chance", "0.99"] = lambda: plunge.learning.ChanceMargin(0.99)
    for (step, rule), adapt in learned.items():
        burned, times = [], []
        for truth in (None, Scattered(0.01)):
            outcome = hwsim.repeat(
                hwsim.PlungeGrinder(PROBLEM, truth=truth), controller, series=series, parts=12, rng=11, adapt=adapt(),
                executor=executor,
            )  # fmt: skip
            burned.append(100 * float((outcome.burned.sum("part") > 0).mean()))
            times.append(float(outcome.time.mean()))
        print(f"| {step} | {rule} | {burned[0]:.1f} | {burned[1]:.1f} | {times[0]:.2f} |")


def chain(executor: Executor, series: int) -> None:
    print("\n## The recommended chain, 12 parts, wheel believed 10 % too sharp")
    print(HEAD)
    recommended(executor, "nominal", PROBLEM, series)
    for name in (
        "command_rate_max",
        "B",
        "stock",
        "stiffness",
        "work_rotation",
        "wear_flat_area",
        "diffusivity",
    ):
        for factor in FACTORS:
            recommended(executor, f"{name} x {factor:g}", changed(name, factor), series // 2)


def recommended(executor: Executor, name: str, problem: plunge.CycleProblem, series: int) -> None:
    outcome = hwsim.repeat(
        hwsim.PlungeGrinder(problem), plunge.CycleController(dull(problem)), series=series, parts=12, rng=5,
        adapt=plunge.adaptation(problem), executor=executor,
    )  # fmt: skip
    print(line(name, outcome, plunge.plan(problem).time))


def changed(name: str, factor: float) -> plunge.CycleProblem:
    if name == "B":
        return PROBLEM.replace(
            burning=physics.BurningLimit(PROBLEM.model.burning.u0, factor * PROBLEM.model.burning.B)
        )
    owner = PROBLEM if hasattr(PROBLEM, name) else PROBLEM.model
    return PROBLEM.replace(**{name: factor * getattr(owner, name)})


def robust(executor: Executor, series: int) -> None:
    print("\n## Contact zero 10 um, normal force +-10 %, gain of the power monitor +-2 %, area scatters 1 %")
    print(HEAD)
    believed = dull(PROBLEM).replace(power_gain_sd=0.02)
    learned = plunge.adaptation(believed)
    margins = plunge.learning.Chain(
        plunge.learning.SharpnessUpdate(),
        plunge.learning.ChanceMargin(0.999, power_gain_tolerance=0.02),
        plunge.learning.RoundnessMargin(),
    )
    makers = {
        "learns during the part": plunge.CycleController(believed),
        "does not learn": plunge.CycleController(believed, online=False),
        "printed": plunge.CycleController(believed, 0.05, sparkout="printed"),
    }
    for name, controller in makers.items():
        for ratio in FACTORS:
            for gain in (0.98, 1.02):
                truth = Scattered(0.01, ratio)
                grinder = hwsim.PlungeGrinder(PROBLEM, truth=truth, contact_zero_sd=0.01, power_gain=gain)
                outcome = hwsim.repeat(
                    grinder, controller, series=series // 4, parts=12, rng=5, executor=executor,
                    adapt=margins if name == "printed" else learned,
                )  # fmt: skip
                fastest = plunge.plan(
                    PROBLEM.replace(normal_force_ratio=ratio * PROBLEM.model.normal_force_ratio)
                ).time
                print(line(f"{name}, force x {ratio:g}, gain {gain:g}", outcome, fastest))


def speed(executor: Executor, series: int) -> None:
    print("\n## Speed")
    grinder, controller = hwsim.PlungeGrinder(PROBLEM), plunge.CycleController(dull(PROBLEM))
    adapt = plunge.adaptation(PROBLEM)
    own = {"series": 200, "parts": 12, "rng": 0}
    print("| what | time |\n|---|---|")
    step = median(lambda: [controller.step(size=0.0, grinding_power=50.0) for _ in range(1000)], 5)
    print(f"| one step of the controller | {1e3 * step:.2f} us |")
    print(
        f"| one noisy cycle, log included | {1e3 * median(lambda: hwsim.run(grinder, controller, parts=100), 5) / 100:.2f} ms |"
    )
    batch = median(lambda: hwsim.repeat(grinder, controller, **own, executor=executor), 3)
    print(f"| 200 x 12 noisy cycles, two processes | {batch:.2f} s |")
    batch = median(lambda: hwsim.repeat(grinder, controller, **own, adapt=adapt, executor=executor), 3)
    print(f"| the same with the recommended chain | {batch:.2f} s |")


SECTIONS = {
    "controllers": controllers,
    "bounding": bounding,
    "chain": chain,
    "robust": robust,
    "speed": speed,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--series", type=int, default=200)
    parser.add_argument("--only", choices=SECTIONS)
    given = parser.parse_args()
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        for name, section in SECTIONS.items():
            if given.only in (None, name):
                section(executor, given.series)


if __name__ == "__main__":
    main()
