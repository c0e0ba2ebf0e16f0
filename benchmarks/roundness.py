"""Circles, filters, cylinders and intervals of the roundness tester beside their rivals.

``python benchmarks/roundness.py [--times N]``: medians of runs in turn, so that all see the same load; with
``BENCH_CLOCK=cpu OPENBLAS_NUM_THREADS=1`` CPU time of one thread. Every rival gives the same number; the last
column tells how far it is off.
"""

import argparse
from collections.abc import Callable

import centering_peers as circles
import numpy as np
import roundness_peers as peers
from measure import in_turn

from centering.roundness import Profile, RoundnessInterval, Sections, reference_circle
from sdpgrind import units

RADIUS = 30.0  # mm


def ring(size: int, seed: int = 0) -> np.ndarray:
    """Deviations of lobes and noise, mm, without 0 and 1 upr."""
    rng, angle = np.random.default_rng(seed), np.arange(size) * 2 * np.pi / size
    waves = sum(rng.normal() / n * np.cos(n * angle - rng.uniform(0, 2 * np.pi)) for n in range(2, 40))
    return centred(units.um(waves + 0.1 * rng.normal(size=size)))


def profile_of(deviation: np.ndarray) -> Profile:
    """Profile of deviations of an even turn."""
    return Profile(np.arange(deviation.size) * 2 * np.pi / deviation.size, RADIUS + deviation)


def shaft(sections: int, size: int) -> Sections:
    """Sections with lobes, noise, a bent median line and a tilt."""
    rng, heights = np.random.default_rng(1), np.linspace(0.0, 60.0, sections)
    profiles, angle = [], np.arange(size) * 2 * np.pi / size
    for k, z in enumerate(heights):
        x, y = units.um(3.0 * rng.normal(size=2)) + np.array([1e-4, -5e-5]) * z
        profiles.append(Profile(angle, RADIUS + ring(size, k) + x * np.cos(angle) + y * np.sin(angle)))
    return Sections(profiles, heights)


Runs = dict[str, Callable[[], float | np.ndarray]]


def round_circles() -> dict[str, Runs]:
    """Reference circles of one profile a call: RONt of LSC and MZC, radius of MCC and MIC."""
    deviation = ring(4096)
    angle = np.arange(4096) * 2 * np.pi / 4096
    points = (RADIUS + deviation)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    points += units.um(np.array([3.0, -1.0]))
    by_kind: dict[str, Runs] = {
        "LSC": {"numpy": lambda: peers.least_squares_by_numpy(points)},
        "MZC": {
            "numpy": lambda: circles.zone_by_exchange(points),
            "cvxpy": lambda: circles.zone_by_cvxpy(points, "HIGHS"),
        },
        "MCC": {
            "numpy": lambda: peers.one_sided_by_exchange(points, True),
            "cvxpy": lambda: circles.enclosing_by_cvxpy(points),
        },
        "MIC": {
            "numpy": lambda: peers.one_sided_by_exchange(points, False),
            "cvxpy": lambda: peers.inscribed_by_cvxpy(points),
        },
    }

    def ours(kind: str) -> float:
        found = reference_circle(points, kind)
        return found.radius if kind in ("MCC", "MIC") else found.ron_t

    return {
        f"{kind}, 4096 points": {"ours": lambda kind=kind: ours(kind), **rivals}
        for kind, rivals in by_kind.items()
    }


def centred(deviation: np.ndarray) -> np.ndarray:
    """Deviations without 0 and 1 upr, as they are about their own circle."""
    coef = np.fft.rfft(deviation)
    coef[:2] = 0.0
    return np.fft.irfft(coef, deviation.size)


def filters() -> dict[str, Runs]:
    """Filters of one profile a call, deviations in mm; the Gaussian one from the readings of a ring off its axis."""
    deviation = ring(3600)
    angle = np.arange(3600) * 2 * np.pi / 3600
    reading = RADIUS + deviation + units.um(1.0) * np.cos(angle - 1.0)
    dusty = deviation.copy()
    dusty[200] += units.um(50.0)
    dirty = profile_of(dusty)
    return {
        "Gaussian filter, 3600 points, 1 um off": {
            "ours": lambda: Profile(angle, reading).filter("gaussian", upr=50).deviation,
            "numpy": lambda: centred(peers.eccentric_by_numpy(angle, reading, 50.0)),
        },
        "robust filter, 3600 points": {
            "ours": lambda: dirty.filter("robust", upr=50).deviation,
            "numpy": lambda: centred(peers.robust_by_numpy(dirty.deviation, 50.0)),
        },
    }


def ends(interval: RoundnessInterval) -> np.ndarray:
    return np.array([interval.low, interval.high])


def intervals() -> dict[str, Runs]:
    """Calibrated intervals: 400 widths of drawn forms a call, in a batch on both sides."""
    filtered = profile_of(ring(1024)).filter("gaussian", upr=50)
    passed = np.exp2(-((np.arange(2, 512) / 50) ** 2))
    found: dict[str, Runs] = {}
    for kind in ("LSC", "MZC"):
        circle = filtered.roundness(kind)
        reading_sd = float(circle.noise_sd.mean() / np.sqrt(2 / 1024 * (passed @ passed)))
        found[f"interval of {kind}, 1024 points"] = {
            "ours": lambda circle=circle: ends(circle.interval()),
            "numpy": lambda kind=kind, sd=reading_sd: np.array(
                peers.interval_by_numpy(filtered.deviation, sd, 50.0, kind == "MZC")
            ),
        }
    return found


def cylinders() -> dict[str, Runs]:
    """Cylinders of 7 sections a call: cylindricity, mm."""
    sections = shaft(7, 360)
    points = sections.points
    return {
        "LS cylinder, 7 x 360 points": {
            "ours": lambda: sections.cylinder("LSC").cyl_t,
            "numpy": lambda: float(np.ptp(peers._distances(points, peers.cylinder_by_numpy(points))[0])),
        },
        "MZ cylinder, 7 x 360 points": {
            "ours": lambda: sections.cylinder("MZC").cyl_t,
            "scipy": lambda: peers.cylinder_zone_by_generation(points),
            "cvxpy": lambda: peers.cylinder_zone_by_cvxpy(points),
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=11)
    times = parser.parse_args().times
    print(
        "| what | ours [ms] | rival | rival [ms] | rival over ours | off by [nm] |\n|---|---|---|---|---|---|"
    )
    for what, runs in (round_circles() | filters() | intervals() | cylinders()).items():
        took, exact = in_turn(runs, times), np.asarray(runs["ours"]())
        for name, run in runs.items():
            if name != "ours":
                off = 1e6 * float(np.max(np.abs(run() - exact)))
                print(
                    f"| {what} | {1e3 * took['ours']:.3g} | {name} | {1e3 * took[name]:.3g}"
                    f" | {took[name] / took['ours']:.2g} | {off:.1e} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
