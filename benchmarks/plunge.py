"""Cycles of plunge grinding: ``python benchmarks/plunge.py [--times N] [--only plan|second_control]``.
Medians.
"""

import argparse
import time
import warnings
from collections.abc import Iterator

import numpy as np
from measure import median

from sdpgrind import physics, plunge, units

NOMINAL = plunge.preset("simulation")
SETS = 8


def drawn() -> Iterator[plunge.CycleProblem]:
    """The nominal problem, and some with parameters drawn at large; again where no rate is without damage."""
    yield NOMINAL
    rng, left = np.random.default_rng(0), SETS
    while left:
        share = rng.uniform(size=7)
        try:
            yield NOMINAL.replace(
                command_rate_max=0.03 + 0.06 * share[0], burning=physics.BurningLimit(6.205, 3 + 4.2 * share[1]),
                stock=0.15 + 0.25 * share[2], stiffness=4e3 + 26e3 * share[3], wear_flat_area=0.008 + 0.024 * share[4],
                roundness_max=units.um(2 + 4 * share[5]), work_rotation=units.hz(3 + 3 * share[6]), sample_time=1e-3,
                time_constant=None,
            )  # fmt: skip
            left -= 1
        except ValueError:
            continue


def plan(times: int) -> None:
    print(
        f"\n## The nominal cycle and {SETS} drawn at large, by three methods, each with and without a margin of 0.03 mm"
    )
    print(
        "Difference: from the exact time, relative; too deep: damage of the commands, played back, beyond what is allowed."
    )
    print(
        "| set, margin | exact [s] | takes | dp: difference | its error | too deep [um] | takes"
        " | collocation: difference | its error | residual | too deep [um] | takes |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    worst = {"dp": 0.0, "collocation": 0.0}
    for number, problem in enumerate(drawn()):
        for margin in (0.0, 0.03):
            print(_row(f"{number}, {margin:g}", problem, margin, times, worst))
    print(f"largest differences: dp {worst['dp']:.1e}, collocation {worst['collocation']:.1e}")


def _row(name: str, problem: plunge.CycleProblem, margin: float, times: int, worst: dict[str, float]) -> str:
    exact = plunge.plan(problem, safety_margin=margin)
    took = median(lambda: plunge.plan(problem, safety_margin=margin), 5 * times)
    row = f"| {name} | {exact.time:.4f} | {1e3 * took:.1f} ms "
    for method in worst:
        best = plunge.plan(problem, method=method, safety_margin=margin)
        took = median(lambda m=method: plunge.plan(problem, method=m, safety_margin=margin), times)
        off, deeper = best.time / exact.time - 1, 1e3 * best.solution.excess
        worst[method] = max(worst[method], abs(off))
        residual = f"| {best.solution.residual:.0e} " if method == "collocation" else ""
        row += f"| {off:+.1e} | {best.error / exact.time:.1e} {residual}| {deeper:.3f} | {took:.2f} s "
    return row + "|"


def second_control(times: int) -> None:
    print(
        "\n## Rotation of the work as a second control (2 to 8 1/s), sliding force of Malkin, and wheel wear"
    )
    problem = NOMINAL.replace(
        power=physics.GrindingPower(sliding=physics.MalkinSliding()), wear_flat_area=0.0059, time_constant=None,
        burning=physics.BurningLimit(6.205, 4.2),
    )  # fmt: skip
    low, high = units.hz(2), units.hz(8)
    constant = [
        (_exact(problem.replace(work_rotation=n, time_constant=None)), n) for n in np.linspace(low, high, 61)
    ]
    begin = time.perf_counter()
    best = plunge.plan(problem, method="collocation", work_rotation_range=(low, high))
    print(
        f"best constant rotation of 61: {min(constant)[0]:.3f} s at {min(constant)[1] / units.hz(1):.2f} 1/s"
    )
    print(
        f"free rotation: {best.time:.3f} s, error {best.error:.2g} s, in {time.perf_counter() - begin:.2f} s; {best.status}"
    )
    print("| growth [1/mm], exponent | dp [s] | collocation [s] | takes |\n|---|---|---|---|")
    for wear in (
        plunge.Wear(0.02),
        plunge.Wear(0.05),
        plunge.Wear(0.02, 0.5, 0.02),
        plunge.Wear(0.02, 1.0, 0.02),
    ):
        worn = NOMINAL.replace(wear=wear)
        stages = f"{plunge.plan(worn, method='dp').time:.4f}" if wear.exponent == 0 else ""
        took = median(lambda p=worn: plunge.plan(p, method="collocation"), times)
        found = plunge.plan(worn, method="collocation")
        print(
            f"| {wear.growth:g}, {wear.exponent:g} | {stages} | {found.time:.4f} +- {found.error:.2g} | {took:.2f} s |"
        )


def _exact(problem: plunge.CycleProblem) -> float:
    return plunge.plan(problem).time


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=3, help="runs of which the median is told")
    parser.add_argument("--only", default="", help="name of one benchmark")
    given = parser.parse_args()
    warnings.filterwarnings("ignore", "an area of one sliding law")
    for run in (plan, second_control):
        if given.only in ("", run.__name__):
            run(given.times)


if __name__ == "__main__":
    main()
