"""Doubts over drawn plunge files: ``python benchmarks/alignment.py [--count N]``.

Alignment told right, wrong or not, and how often a believed value that is true is said to differ.
"""

import argparse
import warnings

import numpy as np

from sdpgrind import plunge
from sdpgrind.base.columns.commands import ALIGNMENTS

PERIOD = 11.0  # s of each file
# time step (s), noise (mm), its correlation from reading to reading
SETTINGS = ((0.05, 3e-4, 0.0), (0.05, 3e-4, 0.8), (0.02, 3e-4, 0.0), (0.05, 1e-3, 0.0), (0.05, 1e-3, 0.8))


def drawn(rng, step, sd, correlation, alignment, time_constant):
    """A file of a linear machine at three rates (0.04, 0.01, 0 mm/s), its commands recorded as asked."""
    time = step * np.arange(round(PERIOD / step))
    rate = np.select([time < 4.2 - 1e-9, time < 5.7 - 1e-9], [0.04, 0.01], 0.0)
    pole, lag = np.exp(-step / time_constant), np.zeros(time.size)
    for k in range(time.size - 1):
        lag[k + 1] = pole * lag[k] + rate[k] * time_constant * (1 - pole)
    noise = rng.normal(size=time.size)
    for k in range(1, time.size):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    size = np.concatenate([[0.0], np.cumsum(rate[:-1] * step)]) - lag + sd * noise
    before = np.concatenate([rate[:1], rate[:-1]])
    recorded = {"begin": rate, "centre": 0.5 * (rate + before), "end": before}[alignment]
    return {"time": time, "size": size, "command_rate": recorded}


def problem_of(time_constant):
    """The machine that drew a file, as believed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no spark-out is needed where the lag is short
        problem = plunge.preset("experiment").replace(command_rate_max=0.04)
        return problem.replace(linear_time_constant=time_constant, time_constant=time_constant)


def told(count, setting, alignments, seed):
    """Truth and doubts of drawn files."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        truth, tau = alignments[k % len(alignments)], rng.uniform(0.8, 3.0)
        yield truth, problem_of(tau).doubts(drawn(rng, *setting, truth, tau))


def alignment(count):
    print(f"\n## Alignment told by {count} files each, time constants 0.8 to 3 s")
    print("| step [s] | noise [um] | correlation | right | wrong | not sure |\n|---|---|---|---|---|---|")
    for setting in SETTINGS:
        found = [(truth, doubts.alignment) for truth, doubts in told(count, setting, ALIGNMENTS, 1)]
        right = sum(truth == said for truth, said in found)
        unsure = sum(said == "not sure" for _, said in found)
        step, sd, alike = setting
        print(
            f"| {step} | {1e3 * sd:g} | {alike} | {right} | {count - right - unsure} | {unsure} |", flush=True
        )


def chance(count):
    print(
        f"\n## Share of {count} files each whose doubts say 'differs' of a value that is true: 5 % is right"
    )
    print("| step [s] | noise [um] | correlation | time constant | contact zero |\n|---|---|---|---|---|")
    for setting in SETTINGS[:2]:
        found = [doubts for _, doubts in told(count, setting, ("begin",), 2)]
        shares = [
            100 * np.mean([doubts[name].verdict == "differs" for doubts in found])
            for name in ("time_constant", "contact_zero")
        ]
        step, sd, alike = setting
        print(f"| {step} | {1e3 * sd:g} | {alike} | {shares[0]:.1f} % | {shares[1]:.1f} % |", flush=True)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=200)
    count = arguments.parse_args().count
    alignment(count)
    chance(2 * count)
