"""Commissioning of a plunge grinder: ``python benchmarks/machine.py [--machines N] [--only NAME]``.

Each machine is drawn anew: force ratio, wear flat area, specific energy, idle power, contact, wheel wear and
lags 10 to 40 % off what is believed; an air cut, holds at the greatest rate, 0.3 and 0.1 of it, 4 s of
spark-out; noise of 0.5 um and 1 %. The plant is that of the simulated grinder.
"""

import argparse
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy import signal

from sdpgrind import plunge
from sdpgrind.plunge import kernels

BELIEVED = plunge.preset("simulation").replace(
    drive=plunge.Drive(feed_lag=0.05, power_lag=0.1, idle_power=300.0), grinding_ratio=46.667
)
STEP, SPARK_OUT, AIR = 0.04, 4.0, 0.1  # s, s, mm; 0.6 of it are 33 samples
SHARES = (1.0, 0.3, 0.1)  # of the greatest rate
NAMES = (
    "normal_force_ratio", "wear_flat_area", "specific_energy", "ploughing_force", "idle_power", "wheel_wear",
    "feed_lag", "power_lag", "contact_zero",
)  # fmt: skip
TOLD = {"idle_power": 0.01, "normal_force_ratio": 0.005, "wear_flat_area": 0.03}  # bars, relative
WRONG = {
    "size in um": ("size", 1000.0), "size in inch": ("size", 1 / 25.4), "size of the diameter": ("size", 2.0),
    "rate in um/s": ("command_rate", 1000.0), "rate in mm/min": ("command_rate", 60.0),
    "rate of the diameter": ("command_rate", 2.0), "time in ms": ("time", 1000.0),
    "power in kW": ("grinding_power", 1e-3),
}  # fmt: skip
NAMED = {
    "size in um": "size in um", "size in inch": "size in in,", "size of the diameter": "size of the diameter",
    "rate in um/s": "command_rate in um/s", "rate in mm/min": "command_rate in mm/min",
    "rate of the diameter": "command_rate of the diameter", "time in ms": "time in ms",
    "power in kW": "grinding_power in kW",
}  # fmt: skip
"""What the first sentence of the refusal names."""


class Recorded(NamedTuple):
    """Readings of a cycle and the true values, by name."""

    data: dict[str, np.ndarray]
    truth: dict[str, float]


def machine(rng: np.random.Generator) -> dict[str, float]:
    """True values of a machine."""
    believed = dict(zip(NAMES, (9.78, 0.026, 13.8, 0.962, 300.0, 0.03, 0.05, 0.1, -AIR), strict=True))
    drawn = {name: value * _off(rng) for name, value in believed.items()}
    return drawn | {"ploughing_force": believed["ploughing_force"]}


def _off(rng: np.random.Generator) -> float:
    return float(1 + rng.choice((-1.0, 1.0)) * rng.uniform(0.1, 0.4))


def model_of(truth: dict[str, float]) -> plunge.PlungeModel:
    model = BELIEVED.model
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return model.replace(
            normal_force_ratio=truth["normal_force_ratio"],
            wear_flat_area=truth["wear_flat_area"],
            power=model.power.replace(
                specific_energy=truth["specific_energy"], ploughing_force=truth["ploughing_force"]
            ),
        )


def recorded(
    seed: int, *, hold: float = 6.0, step: float = STEP, settled: bool = False, correlation: float = 0.0,
    truth: dict[str, float] | None = None,
) -> Recorded:  # fmt: skip
    """Record a cycle; `settled`: holds of at least 3.2 time constants at the greatest rate."""
    rng = np.random.default_rng(seed)
    truth = machine(rng) if truth is None else truth
    model, most = model_of(truth), BELIEVED.command_rate_max
    if settled:
        hold = max(hold, 3.2 * float(model.deflection(most) - model.deflection(0.1 * most)) / (0.9 * most))
    seconds = [hold - truth["contact_zero"] / most, hold, hold]
    rate = np.concatenate(
        [np.full(round(s / step), share * most) for s, share in zip(seconds, SHARES, strict=True)]
        + [np.zeros(round(SPARK_OUT / step))]
    )
    clean = ground(model, truth, rate, step)
    size = clean[:, 0] + 5e-4 * noise(rng, rate.size, correlation)
    power = clean[:, 1] * (1 + 0.01 * noise(rng, rate.size, correlation))
    data = {"time": step * np.arange(rate.size), "command_rate": rate, "size": size, "grinding_power": power}
    return Recorded(data, truth)


def ground(model: plunge.PlungeModel, truth: dict[str, float], rate: np.ndarray, step: float) -> np.ndarray:
    """Sizes (mm) and powers (W) without noise, by the plant."""
    drive = plunge.Drive(**{name: truth[name] for name in ("feed_lag", "power_lag", "idle_power")})
    rig = kernels.driven(kernels.rig(model, 1.0, step), drive)._replace(
        contact_zero=-truth["contact_zero"], wheel_wear=truth["wheel_wear"]
    )
    state, out = kernels.part_state(rig), np.empty((rate.size, 2))
    kernels.start_part(state, rig)
    for k, each in enumerate(rate.tolist()):
        out[k] = kernels.read(state, rig, 0.0, 0.0)[:2]
        kernels.advance(state, rig, each)
    return out


def noise(rng: np.random.Generator, count: int, rho: float) -> np.ndarray:
    """First-order noise of variance 1."""
    white = rng.standard_normal(count) * np.append(1.0, np.full(count - 1, np.sqrt(1 - rho**2)))
    return np.asarray(signal.lfilter([1.0], [1.0, -rho], white))


def fits(count: int, first: int, **options: Any) -> Iterator[tuple[Any, dict[str, float], float]]:
    """Estimate, truth and CPU seconds of each machine."""
    plunge.identify(recorded(first, **options).data, "machine", problem=BELIEVED)
    for seed in range(first, first + count):
        data, truth = recorded(seed, **options)
        begin = time.process_time()
        found = plunge.identify(data, "machine", problem=BELIEVED)
        yield found, truth, time.process_time() - begin


def values(count: int) -> None:
    for words, options in (
        ("holds of 6 s, a reading each 0.04 s", {}),
        ("holds of 12 s, a reading each 0.02 s", {"hold": 12.0, "step": 0.02}),
        ("noise of correlation 0.7", {"correlation": 0.7}),
    ):
        _values(words, list(fits(count, 1000, **options)))


def _values(words: str, each: list[tuple[Any, dict[str, float], float]]) -> None:
    print(f"\n## {len(each)} machines: {words}")
    good = [one for one in each if one[0].ok]
    print(f"{len(good)} ok; others: {Counter(found.message[:60] for found, *_ in each if not found.ok)}")
    seconds = [one[2] for one in each]
    print(f"{np.median(seconds):.2f} s of CPU each, at most {max(seconds):.2f} s")
    for name in ("size", "power"):
        squares = [found.fit[f"{name}_chi_square"] for found, *_ in each]
        print(f"chi^2/dof of {name}: {min(squares):.3f} to {max(squares):.3f}, mean {np.mean(squares):.3f}")
    print(
        "| value | in its 95 % interval | told | rms off | most off | mean sd | bar |\n|---|---|---|---|---|---|---|"
    )
    for name in NAMES:
        at = [found.names.index(name) for found, *_ in good]
        sd = np.array([found.sd[k] for (found, *_), k in zip(good, at, strict=True)])
        told = np.isfinite(sd)
        inside = [
            bool(low <= truth[name] <= high)
            for (found, truth, _), k in zip(good, at, strict=True)
            for low, high in [found.interval()[k]]
        ]
        off = np.array([found[name] / truth[name] - 1 for found, truth, _ in good])
        share = np.array([s / abs(truth[name]) for s, (_, truth, _) in zip(sd, good, strict=True)])
        print(
            f"| {name} | {np.mean(np.array(inside)[told]):.1%} | {told.sum()} | {np.sqrt(np.mean(off**2)):.2%}"
            f" | {np.abs(off).max():.2%} | {share[told].mean():.2%} | {TOLD.get(name, np.nan):.1%} |"
        )


def known_wheel(count: int) -> None:
    """The recorded cycle of the specification: area 0.020 and no wear, 0.04 s; scatter over seeds."""
    believed = dict(zip(NAMES, (9.78, 0.020, 13.8, 0.962, 300.0, 0.0, 0.0, 0.0, -0.05), strict=True))
    print(f"\n## The recorded cycle of the specification, {count} seeds")
    each = list(fits(count, 5000, truth=believed))
    print("| value | truth | mean | sd over seeds | mean sd told |\n|---|---|---|---|---|")
    for name in NAMES:
        found = np.array([one[0][name] for one in each])
        sds = np.array([one[0].sd[one[0].names.index(name)] for one in each])
        told = sds[np.isfinite(sds)].mean()
        print(f"| {name} | {believed[name]:.5g} | {found.mean():.6g} | {found.std():.2g} | {told:.2g} |")
    for name in ("size", "power"):
        squares = [found.fit[f"{name}_chi_square"] for found, *_ in each]
        print(f"chi^2/dof of {name}: {min(squares):.3f} to {max(squares):.3f}")


def units(count: int) -> None:
    """Ten sets with each wrong unit, and right ones."""
    print("\n## Wrong units")
    for kind, (name, factor) in WRONG.items():
        told: Counter[str] = Counter()
        for seed in range(2000, 2010):
            data = recorded(seed, settled=True).data
            told[_refusal(data | {name: data[name] * factor}).partition("? Say")[0]] += 1
        right = sum(n for words, n in told.items() if words.endswith(NAMED[kind]) or NAMED[kind] in words)
        print(f"{kind}: {right} of 10 named; {dict(told)}")
    false = [words for seed in range(3000, 3200) if (words := _refusal(recorded(seed, settled=True).data))]
    print(f"right sets: {len(false)} of 200 refused {false[:2]}")


def _refusal(data: dict[str, np.ndarray]) -> str:
    try:
        plunge.identify(data, "machine", problem=BELIEVED)
    except ValueError as error:
        return str(error).partition(": ")[2]
    return ""


def wrong(count: int) -> None:
    """A linear lag fitted to machines whose deflection is by the force."""
    print("\n## A linear time constant fitted to the nonlinear machine")
    linear = BELIEVED.replace(linear_time_constant=float(BELIEVED.time_constant or 0.0))
    each = [
        plunge.identify(recorded(seed).data, "machine", problem=linear) for seed in range(4000, 4000 + count)
    ]
    print(Counter(str(one.status) for one in each))
    print("chi^2/dof of size", sorted(round(one.fit["size_chi_square"], 2) for one in each))


PARTS: dict[str, Callable[[int], None]] = {
    "values": values,
    "known_wheel": known_wheel,
    "units": units,
    "wrong": wrong,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=50)
    parser.add_argument("--only", choices=list(PARTS))
    given = parser.parse_args()
    for name, part in PARTS.items():
        if given.only in (None, name):
            part(given.machines)


if __name__ == "__main__":
    main()
