"""Where a turning ring lies, and how round it is: ``python benchmarks/centering_geometry.py [--only PART]``.

Medians of runs in turn, so that all see the same load; peers in the same run.
"""

import argparse
from collections.abc import Callable

import centering_peers as peers
import numpy as np
from measure import in_turn
from numba import njit

import centering
from sdpgrind.identify import RecursiveLeastSquares, kernels

RADIUS, OFFSET, TURN = 61.94, 3.6, 2.0 * np.pi  # mm, mm, rad
BARS: list[tuple[str, str, str, bool]] = []


def most(what: str, value: float, bar: float, unit: str) -> None:
    BARS.append((what, f"{value:.3g} {unit}", f"<= {bar:g} {unit}", value <= bar))


def least(what: str, value: float, bar: float) -> None:
    BARS.append((what, f"{value:.3g} times", f">= {bar:g} times", value >= bar))


def told(took: dict[str, float], ours: str, unit: float, name: str) -> None:
    """One row for each, and how many times ours it takes."""
    print(f"| | [{name}] | times ours |\n|---|---|---|")
    for what, seconds in took.items():
        print(f"| {what} | {seconds / unit:.3g} | {seconds / took[ours]:.3g} |")


@njit(cache=True)
def rotated(rows, array, out):
    """All rows into a triangle, the values solved for after each."""
    work = np.empty(rows.shape[1])
    for k in range(rows.shape[0]):
        work[:] = rows[k]
        kernels.rotate(array, work)
        kernels.solve(array, out)


@njit(cache=True)
def folded(rows, value, inv_info):
    """All rows into a covariance."""
    gain = np.empty(value.size)
    for k in range(rows.shape[0]):
        kernels.covariance_step(value, inv_info, rows[k, :-1], rows[k, -1], 1.0, gain)


def ring(count: int, *, sd: float = 0.010, turns: int = 1, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Readings (mm) of an offset circle with noise of that standard deviation (mm), and their angles (rad)."""
    angle = TURN * np.arange(count * turns) / count
    psi = angle - 1.0
    exact = OFFSET * np.cos(psi) + np.sqrt(RADIUS**2 - (OFFSET * np.sin(psi)) ** 2)
    return angle, exact + sd * np.random.default_rng(seed).normal(size=angle.size)


def lobed(count: int, *, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, readings and points of a ring 3 um off-centre with 58 lobes of some tenths of a micrometre."""
    angle, rng = TURN * np.arange(count) / count, np.random.default_rng(seed)
    upr = np.arange(2, 60)
    waves = 1e-3 * rng.normal(size=58) / upr * np.cos(np.outer(angle, upr) + rng.uniform(0, TURN, 58))
    reading = RADIUS + 0.003 * np.cos(angle - 1.0) + waves.sum(axis=1)
    return angle, reading, reading[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def updates() -> None:
    print(
        "\n## One more reading, three values (360 readings, limaçon; ours also with the exact curve, weights and all)"
    )
    angle, reading = ring(360)
    rows = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    full = np.column_stack([rows, reading])
    many = np.tile(full, (100, 1))
    far, near = ring(360, turns=100)
    value = np.empty(3)

    estimator = centering.GeometryEstimator(noise_sd=0.010)

    def from_python() -> None:
        estimator.reset()
        for a, r in zip(angle.tolist(), reading.tolist(), strict=True):
            estimator.update(angle=a, reading=r)
            _ = estimator.valid

    runs = {
        "ours, triangle, compiled loop": lambda: rotated(many, np.zeros((3, 4)), value),
        "ours, covariance, compiled loop": lambda: folded(many, np.zeros(3), 1e6 * np.eye(3)),
        "ours, estimator of the exact curve, compiled loop": lambda: centering.GeometryEstimator(
            noise_sd=0.010
        ).extend(far, near),
        "ours, update() and valid from Python": from_python,
        "numpy, running sums, compiled loops of its own": lambda: peers.by_sums(many[:, :3], many[:, 3]),
        "numpy, matrices": lambda: peers.by_numpy(rows, reading),
        "numpy, all data again": lambda: peers.by_refits(rows, reading),
        "padasip FilterRLS": lambda: peers.by_padasip(rows, reading),
        "filterpy KalmanFilter": lambda: peers.by_filterpy(rows, reading),
    }
    each = {name: 360e-6 * (100 if "compiled" in name else 1) for name in runs}
    took = {name: seconds / each[name] * 1e-6 for name, seconds in in_turn(runs, 21).items()}
    told(took, "ours, triangle, compiled loop", 1e-6, "us")
    rotated(full, np.zeros((3, 4)), value)
    apart = max(np.max(np.abs(run(rows, reading) - value)) for run in (peers.by_padasip, peers.by_filterpy))
    print(f"largest difference from padasip and filterpy: {apart:.1e} mm (they begin with a weak guess)")
    off = np.max(np.abs(peers.by_sums(rows, reading)[-1] - value))
    print(f"largest difference from running sums: {off:.1e} mm")
    most("recursive update, compiled loop", 1e6 * took["ours, triangle, compiled loop"], 0.2, "us")
    most(
        "estimator, compiled loop", 1e6 * took["ours, estimator of the exact curve, compiled loop"], 0.2, "us"
    )
    most("update() and valid from Python", 1e6 * took["ours, update() and valid from Python"], 2.0, "us")
    for peer in ("padasip FilterRLS", "filterpy KalmanFilter"):
        least(f"{peer} over ours, compiled", took[peer] / took["ours, triangle, compiled loop"], 100.0)
    streamed(rows, reading, from_python)


def streamed(rows: np.ndarray, reading: np.ndarray, estimator: Callable[[], None]) -> None:
    """Call with call: each reading handed over from Python, on both sides."""
    print("\n### One reading a call, both sides from Python")

    def by_ours() -> np.ndarray:
        found = RecursiveLeastSquares(("radius", "x", "y"))
        for row, target in zip(rows, reading.tolist(), strict=True):
            found.update(row, target)
        return found.estimate.value

    def by_kernel() -> np.ndarray:
        value, inv_info, gain = np.zeros(3), peers.FLAT * np.eye(3), np.empty(3)
        for row, target in zip(rows, reading.tolist(), strict=True):
            kernels.covariance_step(value, inv_info, row, target, 1.0, gain)
        return value

    runs = {
        "ours, update() and valid: exact curve, weights and all": estimator,
        "ours, RecursiveLeastSquares.update(), values once": by_ours,
        "ours, kernels.covariance_step": by_kernel,
        "numpy, matrices": lambda: peers.streamed_numpy(rows, reading),
        "padasip FilterRLS": lambda: peers.by_padasip(rows, reading),
        "filterpy KalmanFilter": lambda: peers.by_filterpy(rows, reading),
    }
    took = {name: seconds / reading.size for name, seconds in in_turn(runs, 21).items()}
    told(took, next(iter(runs)), 1e-6, "us")
    apart = [np.max(np.abs(run() - by_ours())) for run in list(runs.values())[2:]]
    print(f"largest difference of the other values from RecursiveLeastSquares': {max(apart):.1e} mm")


def fits() -> None:
    for count in (360, 4096):
        print(
            f"\n## A circle through {count} readings (ours: exact curve, two Gauss-Newton steps, covariance)"
        )
        angle, reading = ring(count)
        points = reading[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        runs = {"ours": lambda a=angle, r=reading: centering.fit_circle(a, r)}
        runs |= peers.fits(points) | {
            "scipy least_squares": lambda a=angle, r=reading: peers.fit_by_scipy(a, r)
        }
        took = in_turn(runs, 101)
        told(took, "ours", 1e-6, "us")
        found = centering.fit_circle(angle, reading)
        apart = np.max(np.abs(found.value - peers.fit_by_scipy(angle, reading)))
        print(f"largest difference from scipy's: {apart:.1e} mm")
        if count == 360:
            most("circle fit, 360 readings", 1e6 * took["ours"], 100.0, "us")


def circles() -> None:
    print("\n## Reference circles of 4096 points")
    points = lobed(4096)[2]
    zone = {"ours": lambda: centering.roundness.reference_circle(points, "MZC")}
    zone |= {
        f"cvxpy, {name}": lambda s=name: peers.zone_by_cvxpy(points, s) for name in ("HIGHS", "CLARABEL")
    }
    zone["scipy linprog (HiGHS)"] = lambda: peers.zone_by_scipy(points)
    zone["scipy linprog, of the points that matter"] = lambda: peers.zone_by_generation(points)
    zone["numpy, exchange of one point of four"] = lambda: peers.zone_by_exchange(points)
    around = {
        "ours": lambda: centering.roundness.reference_circle(points, "MCC"),
        "cvxpy, Clarabel, scaled": lambda: peers.enclosing_by_cvxpy(points),
    }
    inside = {
        "ours": lambda: centering.roundness.reference_circle(points, "MIC"),
        "scipy Voronoi": lambda: peers.inscribed_by_scipy(points),
    }
    for kind, runs, bar in (("MZC", zone, 0.5), ("MCC", around, 1.0), ("MIC", inside, 5.0)):
        print(f"\n### {kind}")
        took = in_turn(runs, 11)
        told(took, "ours", 1e-3, "ms")
        ours = centering.roundness.reference_circle(points, kind)
        for name, run in runs.items():
            if name != "ours":
                print(
                    f"{name}: {1e6 * (run() - (ours.value if kind == 'MZC' else ours.radius)):+.2e} nm from ours"
                )
        most(f"{kind}, 4096 points", 1e3 * took["ours"], bar, "ms")


def profiles() -> None:
    print("\n## A profile: filter, and the runout of the roller")
    angle, reading, _ = lobed(4096)
    profile = centering.Profile(angle, reading)
    deviation = profile.deviation
    runs = {
        "ours, filter, 4096 points": lambda: profile.filter("gaussian", upr=50).deviation,
        "convolution, written out as a matrix": lambda: peers.filter_by_matrix(deviation, 50.0),
    }
    told(in_turn(runs, 5), "ours, filter, 4096 points", 1e-3, "ms")
    angle, reading = ring(360, sd=1e-4, turns=4)
    reading = reading + 0.0015 * np.cos(RADIUS / 3.75 * angle)
    turned = centering.Profile(angle, reading, tip_radius=3.75)
    beta, radii = turned.part_angle, turned.deviation
    runs = {
        "ours, remove_roller_error, ratio refined": lambda: turned.remove_roller_error(upr_max=50),
        "scipy lstsq, ratio known": lambda: peers.harmonics_by_scipy(beta, radii, RADIUS / 3.75, 50),
    }
    print("\n1440 readings of four turns, 50 harmonics")
    told(in_turn(runs, 5), "ours, remove_roller_error, ratio refined", 1e-3, "ms")


PARTS = {"updates": updates, "fits": fits, "circles": circles, "profiles": profiles}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PARTS)
    chosen = parser.parse_args().only
    for key, part_of in PARTS.items():
        if chosen in (None, key):
            part_of()
    print("\n## Bars\n| what | here | bar | holds |\n|---|---|---|---|")
    for what, here, bar_text, holds in BARS:
        print(f"| {what} | {here} | {bar_text} | {'yes' if holds else 'NO'} |")
