"""Coverage of the intervals of RONt, form by form: ``python benchmarks/coverage_roundness.py [--copies N]``."""

import argparse

import numpy as np

from centering import Profile
from centering.roundness import RoundnessInterval
from sdpgrind import units

RANGE, RADIUS = units.um(2.0), 30.0  # mm: RONt of each form without noise, before the filter
NOISES = (0.1, 0.3, 0.5)  # um: standard deviation of a reading


def forms(points: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Forms of any height on an even turn, phases drawn anew; the first eight are those of the bars."""
    angle = np.arange(points) * 2 * np.pi / points

    def wave(upr: int) -> np.ndarray:
        return np.cos(upr * angle - rng.uniform(0, 2 * np.pi))

    def dip(degrees: float) -> np.ndarray:
        return -np.exp(-0.5 * (away(rng) / np.radians(degrees)) ** 2)

    def away(rng: np.random.Generator) -> np.ndarray:
        return np.angle(np.exp(1j * (angle - rng.uniform(0, 2 * np.pi))))

    return {
        "oval": wave(2),
        "3 lobes": wave(3),
        "3 + 7 + 16 upr": wave(3) + 0.5 * wave(7) + 0.3 * wave(16),
        "1/n, 2 to 50 upr": sum(wave(n) / n for n in range(2, 51)),
        "flat, 2 to 50 upr": sum(wave(n) for n in range(2, 51)),
        "chatter of 42 upr": wave(42),
        "dip of 4 deg on an oval": 0.5 * wave(2) + dip(4.0),
        "5 + 50 upr": wave(5) + wave(50),
        "trapezium of 4 lobes": np.clip(1.6 * wave(4), -0.8, 0.8),
        "oval clipped at 0.6": np.clip(wave(2), -0.6, 0.6),
        "square of 9 lobes": np.sign(wave(9)),
        "slot of 30 deg": -1.0 * (np.abs(away(rng)) < np.radians(15)),
        "dent of 3 deg": dip(3.0),
    }


def scaled(form: np.ndarray) -> np.ndarray:
    """The form without 0 and 1 upr, `RANGE` high."""
    waves = np.fft.rfft(form)
    waves[:2] = 0.0
    form = np.fft.irfft(waves, form.size)
    return RANGE * form / np.ptp(form)


def found(form: np.ndarray, circle: str, kind: str, upr: float, methods: tuple[str, ...]) -> list:
    """RONt of a form, mm, and its intervals by each method."""
    angle = np.arange(form.size) * 2 * np.pi / form.size
    result = Profile(angle, RADIUS + form).filter(kind, upr=upr).roundness(circle)
    return [result.ron_t, *(result.interval(method=method) for method in methods)]


def covered(
    circle: str, noise: float, copies: int, points: int = 1024, kind: str = "gaussian", seed: int = 0
):
    """Rows of form, coverage of both methods (1), width and median error (um), in units of the bars."""
    rows: dict[str, list] = {}
    for rng in np.random.default_rng(seed).spawn(copies):
        for name, form in forms(points, rng).items():
            exact = scaled(form)
            noisy = exact + units.um(noise) * rng.standard_normal(points)
            (true,) = found(exact, circle, kind, 50, ())
            _, usual, sure = found(noisy, circle, kind, 50, ("calibrated", "guaranteed"))
            rows.setdefault(name, []).append(_row(true, usual, sure))
    return {name: np.array(each) for name, each in rows.items()}


def _row(true: float, usual: RoundnessInterval, sure: RoundnessInterval) -> tuple[float, ...]:
    holds = [each.low <= true <= each.high for each in (usual, sure)]
    return *holds, 1e3 * (usual.high - usual.low), 1e3 * (sure.high - sure.low), 1e3 * (usual.value - true)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--copies", type=int, default=1000)
    parser.add_argument("--points", type=int, default=1024)
    parser.add_argument("--kind", default="gaussian")
    parser.add_argument("--circles", nargs="+", default=["LSC", "MZC"])
    given = parser.parse_args()
    print(f"{given.kind} of 50 upr, {given.points} points, {given.copies} copies")
    print(
        "| circle | noise um | form | calibrated % | guaranteed % | width um | guaranteed | median error um |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for circle in given.circles:
        for noise in NOISES:
            for name, rows in covered(circle, noise, given.copies, given.points, given.kind).items():
                held, sure, width, wide = rows[:, :4].mean(axis=0)
                off = np.median(rows[:, 4])
                print(
                    f"| {circle} | {noise} | {name} | {100 * held:.1f} | {100 * sure:.1f} | {width:.3f}"
                    f" | {wide:.3f} | {off:+.3f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
