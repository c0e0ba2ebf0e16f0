"""All benchmarks in one run: ``python benchmarks/run.py [--quick]``. Medians; peers in the same run; peak
memory apart.

Beads by the hundred, controllers side by side: ``python benchmarks/tiers.py --only beads``.
"""

import argparse
import os
import platform
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import same_process
import tiers
from measure import median, peak_memory

from sdpgrind import sdp, weldbead

QUICK = "--quick" in sys.argv


def fine_grid() -> None:
    print("\n## Ten times finer in both (201 heights x 0.2 s), force searched to 1e-5 $")
    print("| | time | extra memory | largest error of the force search |")
    print("|---|---|---|---|")
    for name in ("P1", "P5"):
        fine = weldbead.preset(name).replace(stage=0.2)
        policy = sdp.plan(weldbead.sequence.sdp_problem(fine, 201))
        exact = sdp.plan(weldbead.sequence.sdp_problem(fine, 201, levels=3201))
        error = float(np.max(np.abs(policy.table.value - exact.table.value)))
        took = median(lambda f=fine: sdp.plan(weldbead.sequence.sdp_problem(f, 201)), 3 if QUICK else 7)
        memory = peak_memory(lambda f=fine: sdp.plan(weldbead.sequence.sdp_problem(f, 201)))
        print(f"| {name} | {took:.3f} s | {memory:.0f} MB | {error:.1e} $ |")


def tolerances() -> None:
    print("\n## To a tolerance (true error: largest over all nodes, against a grid 8 times finer)")
    print("| | tolerance | time | nodes | estimated error | true error | ratio |")
    print("|---|---|---|---|---|---|---|")
    for name in ("P1", "P2", "P3", "P4", "P5"):
        for tolerance in (1e-4, 1e-5):
            problem = weldbead.preset(name)
            begin = time.perf_counter()
            policy = weldbead.plan(problem, tolerance=tolerance)
            took = time.perf_counter() - begin
            nodes = policy.table.grid.size
            true = float("nan")
            if (nodes - 1) * 8 <= 3200 or (tolerance < 1e-4 and not QUICK and name == "P1"):
                factor = min(8, 12800 // (nodes - 1))
                reference = sdp.plan(
                    weldbead.sequence.sdp_problem(problem, factor * (nodes - 1) + 1, levels=801)
                )
                true = float(np.max(np.abs(policy.table.table.value - reference.table.value[:, :, ::factor])))
            print(
                f"| {name} | {tolerance:g} $ | {took:.2f} s | {nodes} | {policy.error:.1e} $ "
                f"| {true:.1e} $ | {policy.error / true:.1f} |"
            )


def look_ups() -> None:
    print("\n## Look-ups")
    policy = weldbead.plan(weldbead.preset("P1"), tolerance=1e-4)
    height, left = 1.0123, 24.0
    switch = _switch_height(policy)
    rng = np.random.default_rng(0)
    many = {"height": rng.uniform(0, 2, 1_000_000), "time_left": rng.uniform(0, 60, 1_000_000)}
    rows = {
        "value": (lambda: policy.value(height=height, time_left=left), 20_000),
        "action, corners share one duration": (lambda: policy.action(height=height, time_left=left), 20_000),
        "action, across a change of duration": (lambda: policy.action(height=switch, time_left=left), 20_000),
        "action and its mean_cut": (lambda: policy.action(height=height, time_left=left).mean_cut, 5_000),
        "value of 1e6 states": (lambda: policy.value(**many), 1),
        "action of 1e6 states": (lambda: policy.action(**many), 1),
    }
    print("| what | time |\n|---|---|")
    for what, (run, times) in rows.items():
        took = median(lambda r=run, n=times: [r() for _ in range(n)], 5) / times
        print(f"| {what} | {1e6 * took:.2f} us |" if took < 1e-3 else f"| {what} | {took:.3f} s |")


def _switch_height(policy: weldbead.SequencePolicy) -> float:
    """A height inside a cell whose nodes have different durations."""
    row = round(24.0 / policy.problem.stage)
    best = policy.table.table.best[row, 0]
    cell = int(np.flatnonzero(np.diff(best))[-1])
    return float(policy.table.grid.points[0][cell : cell + 2].mean())


def monte_carlo() -> None:
    print("\n## Monte-Carlo, 1e6 sequences of P1 from (1.5 mm, 30 s)")
    policy = weldbead.plan(weldbead.preset("P1"), tolerance=1e-4)
    took = median(lambda: policy.simulate(runs=1_000_000, height=1.5, time_left=30.0), 3)
    snapped = policy.simulate(runs=1_000_000, height=1.5, time_left=30.0, snap=True, rng=1)
    free = policy.simulate(runs=1_000_000, height=1.5, time_left=30.0, rng=2)
    value = policy.value(height=1.5, time_left=30.0)
    print(
        f"{took:.2f} s; snapped z = {(snapped.mean - value) / snapped.standard_error:.2f};"
        f" continuous {100 * (free.mean / value - 1):+.2f} % (se {100 * free.standard_error / value:.2f} %)"
    )


def scaling() -> None:
    print("\n## Scaling of P1 (401 levels, searched)")
    print("| nodes | stage [s] | levels | time [s] | order in that number |\n|---|---|---|---|---|")
    cases = [
        (201, 2.0, 401),
        (401, 2.0, 401),
        (801, 2.0, 401),
        (401, 1.0, 401),
        (401, 0.5, 401),
        (401, 2.0, 801),
        (401, 2.0, 1601),
    ]
    times = {
        case: median(
            lambda c=case: sdp.plan(
                weldbead.sequence.sdp_problem(weldbead.preset("P1").replace(stage=c[1]), c[0], levels=c[2])
            ),
            3,
        )
        for case in cases
    }
    before = {
        (401, 2.0, 401): (201, 2.0, 401),
        (801, 2.0, 401): (401, 2.0, 401),
        (401, 1.0, 401): (401, 2.0, 401),
        (401, 0.5, 401): (401, 1.0, 401),
        (401, 2.0, 801): (401, 2.0, 401),
        (401, 2.0, 1601): (401, 2.0, 801),
    }
    for case, took in times.items():
        order = f"{np.log2(took / times[before[case]]):.2f}" if case in before else ""
        print(f"| {case[0]} | {case[1]:g} | {case[2]} | {took:.3f} | {order} |")


def imports() -> None:
    print("\n## Import")
    for module in ("sdpgrind", "hwsim", "sdpgrind.weldbead"):
        took = [
            float(
                subprocess.run(
                    [
                        sys.executable,
                        "-c",
                        f"import time; t=time.perf_counter(); import {module}; print(time.perf_counter()-t)",
                    ],
                    capture_output=True,
                    text=True,
                    check=True,
                ).stdout
            )
            for _ in range(5)
        ]
        print(f"import {module}: {np.median(took):.3f} s")


BENCHMARKS = (fine_grid, tolerances, look_ups, monte_carlo, scaling, imports)


def machine() -> str:
    """Words for the machine: processor and number of cores."""
    told = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*: (.*)", told.read_text()) if told.exists() else []
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--quick", action="store_true", help="fewer repetitions, no reference solutions for 1e-5 $"
    )
    parser.add_argument("--only", default="", help="name of one benchmark")
    only = parser.parse_args().only
    print(f"# Benchmarks, Python {platform.python_version()}, {machine()}")
    for run in (same_process.same_process, *BENCHMARKS, tiers.one_pass, tiers.feedback, tiers.real_time):
        if only in ("", run.__name__):
            run()


if __name__ == "__main__":
    main()
