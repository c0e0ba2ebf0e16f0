"""Time laws of a robot's joints: ``python benchmarks/finishing_timing.py [--only NAME]``. CPU times; toppra
is a peer.
"""

import argparse
import itertools
import time
from collections.abc import Sequence

import numpy as np
from measure import median

from sdpgrind import finishing
from sdpgrind.finishing.timing import JointLimits, JointPath, TimeLaw

ARM = JointLimits(
    ("q1", "q2", "q3", "q4", "q5", "X", "Y"),
    speed_max=(1.5,) * 5 + (200.0,) * 2,
    acceleration_max=(8.0,) * 5 + (2000.0,) * 2,
)
JERKY = ARM.replace(jerk_max=(80.0,) * 5 + (2e4,) * 2)  # full acceleration in 0.1 s


def wavy(seed: int, span: float = 60.0, samples: int = 121) -> JointPath:
    """Seven joints as sums of sines with random amplitudes and phases."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, span, samples)
    waves = [
        rng.normal(size=7) / k * np.sin(np.pi * k * s[:, None] / span + rng.uniform(0, 6, 7))
        for k in range(1, 7)
    ]
    return JointPath(s, np.sum(waves, axis=0) * np.array([0.15] * 5 + [15.0] * 2))


def corners(order: int) -> list[JointPath]:
    """Runs between the corners of a Hilbert path over 50 mm by 50 mm; the arm moves in proportion to the
    table.
    """
    nodes = finishing.path.hilbert_nodes(order) * 50.0 / 2**order
    turns = np.flatnonzero(np.any(np.diff(nodes, 2, axis=0) != 0, axis=1)) + 1
    ends = [0, *turns.tolist(), len(nodes) - 1]
    gains = np.random.default_rng(0).normal(size=(2, 5)) / 400
    runs = []
    for begin, end in itertools.pairwise(ends):
        way = np.linspace(nodes[begin], nodes[end], 9)
        length = np.linalg.norm(nodes[end] - nodes[begin]) * np.linspace(0, 1, 9)
        runs.append(JointPath(length, np.column_stack([way @ gains, way])))
    return runs


def report(
    name: str, runs: Sequence[JointPath], limits: JointLimits, method: str, feed_rate: float
) -> tuple[TimeLaw, ...]:
    """Make the first law, then all, and print the CPU time of these, their sum, and the closest limit."""
    finishing.timing.time_laws(runs[:1], limits, feed_rate=feed_rate, method=method)
    begin = time.process_time()
    laws = finishing.timing.time_laws(runs, limits, feed_rate=feed_rate, method=method)
    took = time.process_time() - begin
    worst = finishing.timing.worst_violation(runs, laws, limits=limits, feed_rate=feed_rate, refine=40)
    pieces, lasts = sum(law.length.size for law in laws), sum(law.duration for law in laws)
    least = finishing.timing.lower_bound(runs, limits, feed_rate=feed_rate)
    known = f"| {name} | {len(runs)} | {method} | {pieces} | {lasts:.4f} | {least:.4f} | {1e3 * took:.0f} |"
    print(f"{known} {worst.ratio - 1:+.1e} | {worst.quantity} |")
    return laws


def head() -> None:
    print(
        "| path | runs | method | pieces | duration [s] | none below [s] | took [ms] | beyond a limit | closest |"
    )
    print("|---|---|---|---|---|---|---|---|---|")


def by_toppra(run: JointPath, intervals: int) -> float:
    """Duration by toppra on equal intervals, s."""
    s = np.linspace(run.length[0], run.length[-1], intervals + 1)
    return finishing.timing.time_laws([JointPath(s, run.at(s))], ARM, feed_rate=1e3, method="toppra")[
        0
    ].duration


def against_toppra() -> None:
    print("\n## Twenty random paths of 60 mm, feed up to 1000 mm/s, no limits of jerk: ours over toppra's")
    print("toppra's error falls with its step; where it fails on 1440 or 720 intervals, on half as many")
    limit, same, beyond = [], [], []
    for run in [wavy(seed) for seed in range(20)]:
        (own,) = finishing.timing.time_laws([run], ARM, feed_rate=1e3, method="min_time")
        for intervals in (1440, 720, 360):
            try:
                fine, coarse = by_toppra(run, intervals), by_toppra(run, intervals // 2)
                break
            except ValueError:
                continue
        limit.append(100 * (own.duration / (2 * fine - coarse) - 1))
        same.append(100 * (own.duration / fine - 1))
        beyond.append(finishing.timing.worst_violation([run], [own], limits=ARM, feed_rate=1e3).ratio - 1)
    print(f"over toppra's limit of small steps: {min(limit):+.3f} % to {max(limit):+.3f} %")
    print(
        f"over toppra on 1440 intervals: {min(same):+.3f} % to {max(same):+.3f} %; ours beyond a limit: {max(beyond):+.1e}"
    )


def random_paths() -> None:
    print("\n## Ten random paths of 60 mm")
    head()
    runs = [wavy(seed) for seed in range(10)]
    for feed_rate in (25.0, 1e3):
        report(f"random, {feed_rate:g} mm/s", runs, ARM, "min_time", feed_rate)
        report(f"random, {feed_rate:g} mm/s", runs, JERKY, "min_time", feed_rate)
        report(f"random, {feed_rate:g} mm/s", runs, JERKY, "trapezoid", feed_rate)


def stops() -> None:
    print("\n## Hilbert path of order 5, at rest at every corner")
    head()
    runs = corners(5)
    for method in ("trapezoid", "toppra", "min_time"):
        report("order 5, no limit of jerk", runs, ARM, method, 25.0)
    for method in ("trapezoid", "min_time"):
        report("order 5, limits of jerk", runs, JERKY, method, 25.0)


def rounded() -> None:
    print("\n## One run through 1024 rounded corners, 1600 mm")
    head()
    s = np.linspace(0, 1600.0, 10001)
    turn = np.cumsum(0.5 * np.pi * np.sin(np.pi * s / 1.5625) ** 9) * (s[1] / 0.4)
    way = np.cumsum(np.column_stack([np.cos(turn), np.sin(turn)]), axis=0) * s[1]
    gains = np.random.default_rng(0).normal(size=(2, 5)) / 400
    long = JointPath(s, np.column_stack([way @ gains, way]))
    report("no limit of jerk", [long], ARM, "min_time", 25.0)
    part = JointPath(s[:1001], long.joints[:1001])
    for name, run in (("first 160 mm, limits of jerk", part), ("limits of jerk", long)):
        report(name, [run], JERKY, "min_time", 25.0)


def table() -> None:
    print("\n## Loop of the table, 100 000 samples")
    loop = finishing.timing.TableLoop()
    command = np.cumsum(np.random.default_rng(0).normal(size=100_000))
    print(f"{1e9 * median(lambda: loop.follow(command, 1e-3), 5) / command.size:.0f} ns a sample")


PARTS = {"toppra": against_toppra, "random": random_paths, "stops": stops, "rounded": rounded, "table": table}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PARTS)
    chosen = parser.parse_args().only
    for key, part_of in PARTS.items():
        if chosen in (None, key):
            part_of()
