"""Pass planner, force loop and the three tiers: ``python benchmarks/tiers.py [--beads N] [--only NAME]``.
Medians.
"""

import argparse
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from measure import median

import hwsim
from sdpgrind import units, weldbead
from sdpgrind.weldbead import force, passes

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
SEQUENCE = weldbead.preset("P4").replace(
    model=PROCESS, bead_length=150.0, durations=range(12, 41, 4), stage=4.0, horizon=120.0
)
NAMES = ("K1", "K2", "mu")
LEADS = 12.0  # mm; way of a pass beside the bead of the stand
BEADS = SEQUENCE.replace(
    scatter=weldbead.Scatter(NAMES, (0.15,) * 3, law="lognormal"),
    bead_scatter=weldbead.CoefficientScatter(0.15, 0.15, 0.15),
    lead_length=LEADS,
)
LIMITS = force.DesignLimits(runout_response=0.1)


def bead() -> passes.PassProblem:
    x = np.linspace(0, 150, 1501)
    wavy = passes.Contour(x, 1.0 + 0.15 * np.sin(2 * np.pi * x / 60))
    return passes.PassProblem(DISC, wavy, mean_cut=0.25, feed_rate=20.0)


def one_pass() -> None:
    print("\n## One pass of 7.5 s, nodes 0.05 mm apart")
    plan = passes.plan(bead())
    print("| what | time |\n|---|---|")
    print(f"| forward simulation | {1e3 * median(plan.simulate, 21):.1f} ms |")
    for method, times in (("inverse", 21), ("static", 21), ("pi", 11), ("collocation", 3)):
        took = median(lambda m=method: passes.plan(bead(), method=m), times)
        print(f"| plan, {method} | {1e3 * took:.1f} ms |")
    solved = passes.plan(bead(), method="collocation").collocation
    print(f"collocation: {solved}")


def feedback() -> None:
    print(
        "\n## Feedback designs within the same limits (runout response 0.1, Ms 2, Mt 1.5), one sample of delay"
    )
    begin = time.perf_counter()
    table = force.design_table(force.designs(limits=LIMITS))
    print(f"designed in {time.perf_counter() - begin:.1f} s")
    print("| design | f_b [Hz] | GM [dB] | PM [deg] | Ms | runout |\n|---|---|---|---|---|---|")
    for k in range(table.sizes["design"]):
        row = table.isel(design=k)
        print(
            f"| {row.design.item()} | {row.bandwidth.item() / units.hz(1):.2f} | {row.gain_margin_db.item():.1f} "
            f"| {row.phase_margin.item() / units.deg(1):.1f} | {row.sensitivity_peak.item():.2f} "
            f"| {row.runout_response.item():.3f} |"
        )


def _controllers() -> dict[str, weldbead.Hierarchy]:
    loop = force.PI.design(crossover=units.hz(3.0), drive=force.table_drive())
    policy = weldbead.plan(SEQUENCE, tolerance=1e-4)
    certain = weldbead.plan(SEQUENCE.replace(scatter=weldbead.Scatter("C1", 0.0)), tolerance=None, nodes=401)
    learned = weldbead.plan(BEADS, tolerance=None, nodes=401)
    return {
        "learns the bead": weldbead.Hierarchy(learned, DISC, loop),
        "re-estimates": weldbead.Hierarchy(policy, DISC, loop),
        "does not re-estimate": weldbead.Hierarchy(policy, DISC, loop, reestimate=False),
        "zero variance": weldbead.Hierarchy(certain, DISC, loop, reestimate=False),
        "does not replan": weldbead.Hierarchy(policy, DISC, loop, reestimate=False, replan=False),
    }


def real_time() -> None:
    print("\n## The stand with all three tiers, against real time")
    tiers = _controllers()["re-estimates"]
    stand = hwsim.ForceTableStand(bead())
    begin = time.perf_counter()
    log = hwsim.run(stand, tiers, parts=10, rng=0)
    took = time.perf_counter() - begin
    print(
        f"{float(log.outcome.time.sum()) / took:.0f} x; {took / float(log.outcome.passes.sum()):.3f} s a pass"
    )


def beads(number: int) -> None:
    print(
        f"\n## {number} beads, 15 % scatter of the coefficients between beads and between passes, same seeds for all"
    )
    scatter = hwsim.CoefficientScatter(0.15, 0.15, 0.15)
    stand = hwsim.ForceTableStand(bead(), bead_scatter=scatter, pass_scatter=scatter, time=60.0)
    begin = time.perf_counter()
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        outcome = hwsim.compare(stand, _controllers(), parts=number, rng=0, executor=pool).outcome
    print(f"{time.perf_counter() - begin:.0f} s")
    print(
        "| tiers | penalty [$] | more than the first, 95 % | planned [$] | passes | overground mean, worst [mm] |"
    )
    print("|---|---|---|---|---|---|")
    root = number**0.5
    for k, name in enumerate(outcome.controller.values):
        one = outcome.isel(controller=k)
        paired = (one.penalty - outcome.penalty[0]).values
        print(
            f"| {name} | {one.penalty.values.mean():.4f} +- {1.96 * one.penalty.values.std(ddof=1) / root:.4f} "
            f"| {paired.mean():+.4f} +- {1.96 * paired.std(ddof=1) / root:.4f} | {one.penalty_planned.values.mean():.4f} "
            f"| {one.passes.values.mean():.2f} | {one.overground.values.mean():.4f}, {one.overground_worst.values.mean():.4f} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beads", type=int, default=200, help="beads in the comparison of controllers")
    parser.add_argument("--only", default="", help="name of one benchmark")
    given = parser.parse_args()
    for run in (one_pass, feedback, real_time, beads):
        if given.only in ("", run.__name__):
            run(given.beads) if run is beads else run()


if __name__ == "__main__":
    main()
