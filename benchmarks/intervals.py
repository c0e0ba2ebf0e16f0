"""Coverage of the 95 % intervals of every estimator: ``python benchmarks/intervals.py [--files N] [--only NAME]``.

Each file is drawn anew: white noise, a gauge that reads in steps, noise of correlation 0.8 from reading to
reading where the readings are a series. 2000 files tell a coverage to 0.5 %.
"""

import argparse
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy import signal

import centering
from sdpgrind import finishing, plunge, units, weldbead
from sdpgrind.base import progress
from sdpgrind.identify import Estimate

ALIKE = 0.8  # correlation of the noise from reading to reading
TAU, STEP = 1.7, 0.05
BEGINS = -0.147  # where the gauge of the simulated grinder begins, mm: unknown to the estimators
SIMULATION = plunge.preset("simulation")
AXIS = finishing.TorqueAxis()
BEAD = {"specific_energy": 12.8, "idle_power": 114.0, "friction_ratio": 0.33}


class Noise(NamedTuple):
    """Noise of a gauge: correlation of its readings, and its step in standard deviations; 0: none."""

    correlation: float = 0.0
    step: float = 0.0

    def spoil(self, rng: np.random.Generator, clean: np.ndarray, sd: float | np.ndarray) -> np.ndarray:
        """Readings of `clean` values with noise of standard deviation `sd`, in its steps."""
        rho, count = self.correlation, clean.size
        white = rng.standard_normal(count) * np.append(1.0, np.full(count - 1, np.sqrt(1 - rho**2)))
        read = clean + sd * signal.lfilter([1.0], [1.0, -rho], white)
        return np.round(read / (self.step * np.mean(sd))) * self.step * np.mean(sd) if self.step else read


WHITE, STEPS = Noise(), Noise(step=2.0)
NOISES = {
    "white": WHITE,
    "steps": STEPS,
    "alike 0.5": Noise(0.5),
    "alike 0.8": Noise(ALIKE),
    "alike 0.9": Noise(0.9),
}
SERIES, PASSES = ("white", "steps", "alike 0.8"), ("white", "steps")


def lag(rows: int) -> dict[str, np.ndarray]:
    """Cycle of a linear machine: 0.04, 0.01 and 0 mm/s."""
    time = STEP * np.arange(rows)
    rate = np.select([time < 4.2 - 1e-9, time < 5.7 - 1e-9], [0.04, 0.01], 0.0)
    pole = np.exp(-STEP / TAU)
    infeed = np.append(0.0, np.cumsum(rate[:-1])) * STEP
    size = infeed - signal.lfilter([0.0, (1 - pole) * TAU], [1.0, -pole], rate)
    return {"time": time, "command_rate": rate, "size": size}


def time_constant(rows: int) -> Callable[..., Estimate]:
    clean = lag(rows)

    def one(rng: np.random.Generator, noise: Noise) -> Estimate:
        data = clean | {"size": noise.spoil(rng, clean["size"], units.um(0.5))}
        return plunge.identify(data, "time_constant")

    return one


def after_air(gap: float, parts: int) -> Callable[..., Estimate]:
    """Parts that the wheel reaches after `gap` mm of command at 0.04 mm/s; then as of `lag`."""
    ground, air = lag(220), round(gap / 0.04 / STEP)
    still = np.zeros(air)
    clean = np.concatenate([still, ground["size"]])
    rate = np.concatenate([still + 0.04, ground["command_rate"]])
    data = {
        "time": np.tile(STEP * np.arange(rate.size), parts),
        "command_rate": np.tile(rate, parts),
        "part": np.repeat(np.arange(parts), rate.size),
    }

    def one(rng: np.random.Generator, noise: Noise) -> Estimate:
        size = [noise.spoil(rng, clean, units.um(0.5)) for _ in range(parts)]
        return plunge.identify(data | {"size": np.concatenate(size)}, "time_constant")

    return one


def cycle() -> dict[str, np.ndarray]:
    """Cycle of the simulated grinder: full rate, falling rate, spark-out; 5 um to contact."""
    from scipy.integrate import solve_ivp

    time = np.arange(0, 13.0, 0.04)
    rate = np.select([time < 6.4, time < 9.0], [0.0448, 0.02 * np.exp(-(time - 6.4) / 3.0)], 0.0)
    infeed, model = np.append(0.0, np.cumsum(rate[:-1])) * 0.04, SIMULATION.model

    def speed(t: float, ground: np.ndarray) -> float:
        return float(model.infeed_rate(max(np.interp(t, time, infeed) + 0.005 - float(ground[0]), 0.0)))

    size = solve_ivp(speed, (0, time[-1]), [0.0], t_eval=time, max_step=0.02, rtol=1e-8, atol=1e-10).y[0]
    v = np.array([speed(t, [s]) for t, s in zip(time, size, strict=True)])
    power = np.where(v > 0, model.grinding_power(v), 0.0)
    return {"time": time, "command_rate": rate, "size": BEGINS + size, "grinding_power": power}


def of_cycle(what: str) -> Callable[..., Estimate]:
    clean = cycle()

    def one(rng: np.random.Generator, noise: Noise) -> Estimate:
        size = noise.spoil(rng, clean["size"], units.um(0.5))
        power = noise.spoil(rng, clean["grinding_power"], 15.0)
        return plunge.identify(clean | {"size": size, "grinding_power": power}, what, problem=SIMULATION)

    return one


def power(rng: np.random.Generator, noise: Noise) -> Estimate:
    removal = rng.uniform(14.0, 40.0, 30)
    read = noise.spoil(rng, removal, 0.3)
    data = {"grinding_power": BEAD["idle_power"] + BEAD["specific_energy"] * removal, "removal_rate": read}
    return weldbead.identify(data, "power")


def friction(rng: np.random.Generator, noise: Noise) -> Estimate:
    """3 % of the tangential force, as in the sample file."""
    normal = rng.uniform(17.0, 50.0, 30)
    tangential = BEAD["friction_ratio"] * normal
    data = {"normal_force": normal, "tangential_force": noise.spoil(rng, tangential, 0.03 * tangential)}
    return weldbead.identify(data, "friction")


def circle(rng: np.random.Generator, noise: Noise) -> Estimate:
    angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
    x, y = 0.3 * np.cos(0.7), 0.3 * np.sin(0.7)
    across = y * np.cos(angle) - x * np.sin(angle)
    clean = x * np.cos(angle) + y * np.sin(angle) + np.sqrt(40.0**2 - across**2)
    return centering.identify((angle, noise.spoil(rng, clean, units.um(0.5))), "circle")


def load_torque(rng: np.random.Generator, noise: Noise) -> Estimate:
    """0.1 s of free motion from any angle and speed; 0.2 counts of noise, and the encoder's counts."""
    time, count = np.arange(100) * AXIS.sample_time, AXIS.angle_step
    acceleration = (AXIS.torque_constant * 0.05 - 0.02) / AXIS.inertia
    angle = rng.uniform(0, 1) + rng.uniform(-3, 3) * time + 0.5 * acceleration * time**2
    if not noise.step:
        angle = noise.spoil(rng, angle, 0.2 * count)
    data = {"time": time, "motor_angle": np.round(angle / count) * count, "current": np.full(100, 0.05)}
    return finishing.identify(data, "load_torque", axis=AXIS, throw=False)


class Study(NamedTuple):
    """Estimator of a file, true values by name, noises."""

    one: Callable[[np.random.Generator, Noise], Estimate]
    truth: dict[str, float]
    noises: tuple[str, ...]


def studies() -> dict[str, Study]:
    centre = {"radius": 40.0, "center_x": 0.3 * np.cos(0.7), "center_y": 0.3 * np.sin(0.7)}
    return {
        **{
            f"time_constant {rows}": Study(time_constant(rows), {"time_constant": TAU}, tuple(NOISES))
            for rows in (220, 110, 60)
        },
        **{
            f"time_constant, {gap} mm of air, parts: {parts}": Study(
                after_air(gap, parts), {"time_constant": TAU}, tuple(NOISES)
            )
            for gap in (0.04, 0.1, 0.12)
            for parts in (1, 4)
        },
        "wear_flat_area": Study(
            of_cycle("wear_flat_area"), {"wear_flat_area": SIMULATION.model.wear_flat_area}, SERIES
        ),
        "contact_zero": Study(of_cycle("contact_zero"), {"contact_zero": 0.005}, SERIES),
        "normal_force_ratio": Study(
            of_cycle("normal_force_ratio"),
            {"normal_force_ratio": SIMULATION.model.normal_force_ratio},
            SERIES,
        ),
        "power": Study(power, {name: BEAD[name] for name in ("specific_energy", "idle_power")}, PASSES),
        "friction": Study(friction, {"friction_ratio": BEAD["friction_ratio"]}, PASSES),
        "circle": Study(circle, centre, SERIES),
        "load_torque": Study(load_torque, {"load_torque": 0.02}, SERIES),
    }


class Row(NamedTuple):
    """One line of the table: coverage, %, of a value under a noise; sd claimed, scatter, greatest error in sd."""

    coverage: float
    study: str
    value: str
    noise: str
    files: int
    claimed: float
    scatter: float
    farthest: float


def covered(name: str, study: Study, noise: str, files: int) -> Iterator[Row]:
    """Coverage of each value of a study; files that are not identified are left out and counted."""
    found: list[tuple[Any, Any, Any]] = []
    for seed in range(files):
        fit = study.one(np.random.default_rng(seed), NOISES[noise])
        if fit.ok:
            places = [fit.names.index(value) for value in study.truth]
            found.append((fit.value[places], fit.sd[places], fit.interval()[places]))
    values, sds, ends = (np.array(each) for each in zip(*found, strict=True))
    for k, (value, true) in enumerate(study.truth.items()):
        hit = 100 * float(np.mean((ends[:, k, 0] <= true) & (true <= ends[:, k, 1])))
        off = float(np.max(np.abs(values[:, k] - true) / sds[:, k]))
        claimed, scatter = float(sds[:, k].mean()), float(values[:, k].std())
        yield Row(hit, name, value, noise, len(found), claimed, scatter, off)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    work = [
        (name, study, noise)
        for name, study in studies().items()
        if given.only in name
        for noise in study.noises
    ]
    line, rows = progress.UnaskedLine(), []
    for k, (name, study, noise) in enumerate(work):
        line(k / len(work), f"{name}, {noise}")
        rows += covered(name, study, noise, given.files)
    line(1.0, "done")
    print(
        "| coverage [%] | estimator | value | noise | files | sd claimed | scatter | farthest [sd] |\n"
        "|---|---|---|---|---|---|---|---|"
    )
    for row in sorted(rows, key=lambda row: -abs(row.coverage - 95.0)):
        print(
            f"| {row.coverage:.1f} | {row.study} | {row.value} | {row.noise} | {row.files} | {row.claimed:.3g} | {row.scatter:.3g} |"
            f" {row.farthest:.1f} |"
        )


if __name__ == "__main__":
    main()
