"""What a plan that learns the bead is worth: ``python benchmarks/bead_learning.py [--beads N] [--told PASSES BEADS]``.

Coefficients scatter by 15 % from bead to bead and by 15 % from pass to pass; 1 mm in 60 s on the bar of the force
table. Every planner grinds the same beads with the same draws; differences are paired, with 95 % intervals.
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from tiers import PROCESS, SEQUENCE

import hwsim
from sdpgrind import weldbead
from sdpgrind.base import progress

HEIGHT, TIME, NODES = 1.0, 60.0, 401  # mm, s; nodes of the plans before the first pass
Follow = Callable[[weldbead.GrindingProcess], weldbead.SequenceController]


def problem_of(passes: float, beads: float) -> weldbead.SequenceProblem:
    """The job with relative standard deviations of the coefficients."""
    return SEQUENCE.replace(
        scatter=weldbead.Scatter(("K1", "K2", "mu"), (passes,) * 3, law="lognormal"),
        bead_scatter=weldbead.CoefficientScatter(beads, beads, beads),
        horizon=TIME,
    )


def planned(problem: weldbead.SequenceProblem, **options: Any) -> weldbead.SequencePolicy:
    return weldbead.plan(problem, tolerance=None, nodes=NODES, **options)


def planners(told: weldbead.SequenceProblem, true: weldbead.SequenceProblem) -> dict[str, Follow]:
    """Controllers by name, each from the process of the bead, which "known" alone looks at."""
    cautious, certain = planned(told), planned(told, method="certain")
    nominal = planned(told.replace(bead_scatter=None, scatter=weldbead.Scatter("C1", 0.15)))
    passes = true.replace(bead_scatter=None, scatter=true.scatter.replace(mean="coefficient"))

    def known(process: weldbead.GrindingProcess) -> weldbead.SequenceController:
        plan = weldbead.plan(passes.replace(model=process, height_max=HEIGHT), tolerance=None, nodes=97)
        return weldbead.SequenceController(plan)

    return {
        "cautious": lambda _: weldbead.SequenceController(cautious),
        "certain": lambda _: weldbead.SequenceController(certain),
        "predictive, never learns": lambda _: weldbead.SequenceController(cautious, learn=False),
        "C1 15 %, never learns": lambda _: weldbead.SequenceController(nominal),
        "coefficients known": known,
    }


def ground(follow: dict[str, Follow], problem: weldbead.SequenceProblem, beads: int) -> dict[str, Any]:
    """Penalties ($) and final heights (mm) of each planner on the same beads."""
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in follow}
    line = progress.UnaskedLine()
    assert problem.bead_scatter is not None
    for seed in range(beads):
        process = problem.bead_scatter.drawn(PROCESS, np.random.default_rng([seed, 1]))
        stand = hwsim.WeldBeadStand(problem, truth=process, height=HEIGHT, time=TIME)
        for name, controller in follow.items():
            outcome = hwsim.run(stand, controller(process), rng=seed).outcome
            found[name].append((float(outcome.penalty[0]), float(outcome.height[0])))
        line(seed / beads, f"{seed} beads")
    return {name: np.array(rows).T for name, rows in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beads", type=int, default=2000)
    parser.add_argument("--told", type=float, nargs=2, default=(0.15, 0.15), help="passes, beads")
    given = parser.parse_args()
    true = problem_of(0.15, 0.15)
    begin = time.process_time()
    found = ground(planners(problem_of(*given.told), true), true, given.beads)
    first, half = found["cautious"][0], 1.96 / given.beads**0.5
    print(f"{given.beads} beads, {time.process_time() - begin:.0f} s of CPU")
    print("| planner | penalty [$] | less cautious [$] | ends below 0 [%] |\n|---|---|---|---|")
    for name, (penalty, height) in found.items():
        less = penalty - first
        print(
            f"| {name} | {penalty.mean():.4f} +- {half * penalty.std():.4f} "
            f"| {less.mean():+.4f} +- {half * less.std():.4f} | {100 * np.mean(height < 0):.0f} |"
        )


if __name__ == "__main__":
    main()
