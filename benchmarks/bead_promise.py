"""Whether the promise of a plan that learns comes true: ``python benchmarks/bead_promise.py [--beads N] [--seeds N]``.

Three jobs with leads, on level beads of the stand of whole passes, whose gauges have their noise. Each seed promises
from beads of its own; what is realised comes from other beads.
"""

import argparse
from collections.abc import Iterator

import numpy as np
from bead_learning import planned, problem_of

import hwsim
from sdpgrind import weldbead

JOBS = {  # passes, beads (relative sd); leads, mm; height, mm; time, s
    "1.0 mm in 60 s": (0.15, 0.15, 12.0, 1.0, 60.0),
    "0.5 mm in 36 s": (0.15, 0.15, 15.0, 0.5, 36.0),
    "0.8 mm in 48 s, beads differ more": (0.10, 0.25, 15.0, 0.8, 48.0),
}
ERROR = 0.1  # 1.96 standard errors of a promise over the mean: 300 to 600 beads


def realised(policy: weldbead.SequencePolicy, height: float, left: float, beads: int) -> np.ndarray:
    """Penalties of beads on the stand, $."""
    stand = hwsim.WeldBeadStand(policy.problem, height=height, time=left)
    return hwsim.run(stand, weldbead.SequenceController(policy), parts=beads, rng=1000).outcome.penalty.values


def promises(
    policy: weldbead.SequencePolicy, height: float, left: float, error: float, seeds: int
) -> Iterator[tuple[float, float]]:
    """Mean and its error, $, of each seed."""
    for seed in range(seeds):
        risk = policy.risk(height, left, error=error, rng=seed)
        yield risk.mean, risk.error["mean"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beads", type=int, default=2000, help="beads on the stand")
    parser.add_argument("--seeds", type=int, default=10)
    given = parser.parse_args()
    print("| job | realised [$] | promised, mean of seeds [$] | inside its interval |\n|---|---|---|---|")
    for name, (passes, beads, leads, height, left) in JOBS.items():
        policy = planned(problem_of(passes, beads).replace(lead_length=leads))
        penalty = realised(policy, height, left, given.beads)
        mean, half = penalty.mean(), 1.96 * penalty.std() / penalty.size**0.5
        told = np.array(list(promises(policy, height, left, ERROR * mean, given.seeds)))
        inside = int(np.sum(np.abs(told[:, 0] - mean) <= told[:, 1]))
        print(
            f"| {name} | {mean:.4f} +- {half:.4f} | {told[:, 0].mean():.4f} ({told[:, 0].mean() / mean - 1:+.1%}) "
            f"| {inside} of {given.seeds} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
