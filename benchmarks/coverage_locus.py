"""Coverage of the 95 % interval of one field of a locus: ``python benchmarks/coverage_locus.py [--files N]``."""

import argparse

import numpy as np

from sdpgrind import locus

PROBLEM = locus.preset("grinding")
FIELD, TRUTH = "specific_energy", 13.8  # J/mm^3
NOISES = ("white", "steps", "correlated")
SD, STEP, ALIKE = 10.0, 20.0, 0.8  # W, W, unit 1
BAR = (0.93, 0.97)


def shaft(rows: int) -> dict[str, np.ndarray]:
    """Three infeed rates, one after the other, while the wheel dulls; power without noise, W."""
    time = 0.1 * np.arange(rows)
    rate = np.repeat([0.008, 0.012, 0.016], -(-rows // 3))[:rows]
    area = 0.006 + 3e-3 * np.cumsum(0.1 * rate)
    read = {"infeed_rate": rate, "work_rotation": np.full(rows, 10.4), "wear_flat_area": area}
    model = PROBLEM.model.replace(**{FIELD: TRUTH})
    return {"time": time, **read, "grinding_power": model.grinding_power(*read.values())}


def noise_of(kind: str, power: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Readings of a power, W: white noise, shown in steps, or noise of first order."""
    draws = rng.standard_normal(power.size)
    if kind == "correlated":
        for k in range(1, power.size):
            draws[k] = ALIKE * draws[k - 1] + np.sqrt(1 - ALIKE**2) * draws[k]
    read = power + SD * draws
    return np.round(read / STEP) * STEP if kind == "steps" else read


def locus_field(noise: str, *, files: int = 2000, rows: int = 200, seed: int = 0) -> float:
    """Share of drawn files whose 95 % interval of the field holds the truth, unit 1."""
    exact, held = shaft(rows), 0
    for rng in np.random.default_rng(seed).spawn(files):
        data = exact | {"grinding_power": noise_of(noise, exact["grinding_power"], rng)}
        low, high = locus.identify(data, FIELD, problem=PROBLEM, throw=False).interval()[0]
        held += bool(low <= TRUTH <= high)
    return held / files


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=2000)
    files = parser.parse_args().files
    print(f"| noise | coverage of {files} files [%] | bar [%] |\n|---|---|---|")
    for noise in NOISES:
        share = locus_field(noise, files=files)
        print(f"| {noise} | {100 * share:.1f} | {100 * BAR[0]:.0f} to {100 * BAR[1]:.0f} |", flush=True)


if __name__ == "__main__":
    main()
