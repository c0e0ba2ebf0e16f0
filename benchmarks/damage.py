"""Damage every kind of file in every place and see what loads: ``python benchmarks/damage.py [--only KIND]``.

Each file gets single flipped bits (half of them in its first 6 kB), lost ends and pairs of exchanged blocks.
What loads must be what was saved, everything else one `sdpgrind.DamagedFileError` that names the file. A bit
in the free space of a journal changes nothing that is read: it loads as it was. Prints a row a kind; exit
status 1 when anything loaded with other content, or any other error came.
"""

import argparse
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import centering
import hwsim
import sdpgrind
from centering import Profile, roundness
from sdpgrind import plunge, units

SAVED = Path(__file__).parents[1] / "tests" / "data" / "saved-0.1.0"  # small ones of most kinds
HEAD = 6000  # bytes; half of the flips are among them


def turn(count: int = 360) -> np.ndarray:
    return np.arange(count) * (2 * np.pi / count)


@cache
def ring() -> Profile:
    noise = 1e-4 * np.random.default_rng(0).normal(size=360)
    return Profile(turn(), 30.0 + 1e-3 * np.cos(3 * turn()) + noise)


def roller_error() -> Any:
    angle = np.concatenate([turn() + 2 * np.pi * k for k in range(3)])
    rolled = Profile(angle, 62.0 + 1e-3 * np.cos(61.94 / 3.75 * angle - 1.0), tip_radius=3.75)
    return rolled.remove_roller_error().roller_error


def sections() -> roundness.Sections:
    return roundness.Sections([ring(), ring(), ring()], [0.0, 10.0, 20.0])


def separation() -> roundness.Separation:
    steps = units.deg(1) * np.array([0, 72, 144, 216, 288])
    return roundness.multistep([ring() for _ in steps], steps)


def budget() -> roundness.Budget:
    tester = roundness.Instrument(spindle_error=units.um(0.05))
    return ring().filter(upr=50).roundness("LSC").budget(tester)


@cache
def strategy() -> centering.Strategy:
    """On a coarse grid: how good it is does not matter here."""
    from centering.cycle._strategy import plan

    kinds, size = plan.default_kinds, plan.Size
    plan.default_kinds = lambda top_speed: kinds(top_speed)[::2]
    plan.Size = lambda: size(offsets=32, frictions=3)
    problem = centering.preset("printed").replace(friction_range=(0.8, 1.2))
    made = centering.plan(problem)
    plan.default_kinds, plan.Size = kinds, size
    return made


def doubts() -> Any:
    job = plunge.preset("simulation")
    return job.doubts(hwsim.run(hwsim.PlungeGrinder(job), plunge.CycleController(job)))


MAKERS: dict[str, Callable[[], Any]] = {
    "centering.sections": sections,
    "centering.form_change": lambda: ring().filter(upr=50).compare(ring().filter(upr=50), rotation=0.0),
    "centering.separation": separation,
    "centering.roundness": lambda: ring().filter(upr=50).roundness("MZC"),
    "centering.roundness_interval": lambda: ring().filter(upr=50).roundness("MZC").interval(),
    "centering.roundness_budget": budget,
    "centering.cylinder": lambda: sections().cylinder("MZC"),
    "centering.spectrum": lambda: ring().harmonics(upr_max=15),
    "centering.runout": roller_error,
    "centering.spindle_error": lambda: separation().spindle,
    "centering.slope": lambda: ring().slope(units.deg(30)),
    "centering.strategy": strategy,
    "centering.risk": lambda: strategy().robust(runs=20),
    "identify.doubts": doubts,
}


def kinds() -> list[str]:
    """All kinds of files, the journal included."""
    from importlib.metadata import entry_points

    return sorted(entry.name for entry in entry_points(group="sdpgrind.records"))


def write(kind: str, path: Path) -> None:
    """Write a file of a kind."""
    if kind == "hwsim.journal":
        job = plunge.preset("simulation")
        hwsim.run(hwsim.PlungeGrinder(job), plunge.CycleController(job), parts=5, journal=path)
    elif kind in MAKERS:
        MAKERS[kind]().save(path)
    else:
        with warnings.catch_warnings(action="ignore", category=sdpgrind.OldFileWarning):
            sdpgrind.load(SAVED / f"{kind}.nc").save(path)


def flips(raw: bytes, count: int, rng: np.random.Generator) -> Iterator[bytes]:
    """One flipped bit each, half of them in the first `HEAD` bytes."""
    for k in range(count):
        place = int(rng.integers(min(HEAD, len(raw)) if k % 2 else len(raw)))
        changed = bytearray(raw)
        changed[place] ^= 1 << int(rng.integers(8))
        yield bytes(changed)


def truncations(raw: bytes, count: int, rng: np.random.Generator) -> Iterator[bytes]:
    """Lost ends: of nothing, of a few bytes, of one byte, and of any length."""
    lengths = [0, 3, 17, len(raw) - 1, *rng.integers(len(raw), size=count).tolist()]
    return (raw[:length] for length in lengths[:count])


def swaps(raw: bytes, count: int, rng: np.random.Generator) -> Iterator[bytes]:
    """Two exchanged blocks each, of 16 bytes to 4 kB, that differ."""
    while count:
        size = min(int(2 ** rng.uniform(4, 12)), len(raw) // 2)
        one, other = sorted(int(place) for place in rng.integers(len(raw) - size + 1, size=2))
        if other - one >= size and raw[one : one + size] != raw[other : other + size]:
            middle = raw[one + size : other]
            yield raw[:one] + raw[other : other + size] + middle + raw[one : one + size] + raw[other + size :]
            count -= 1


def content(path: Path) -> Any:
    """All that a file gives, in a form that can be compared."""
    thing = sdpgrind.load(path)
    if not isinstance(thing, hwsim.Journal):
        return sdpgrind.base.records.read(path)
    with thing:
        log = thing.log()
        return [log.outcome, *(log[tier] for tier in log.tiers)]


def equal(one: Any, other: Any) -> bool:
    if isinstance(one, list):
        return len(one) == len(other) and all(map(equal, one, other))
    return bool(one.identical(other))


def tried(path: Path, whole: Any) -> str:
    """What became of a damaged file: "told", "same", "silent" or the error."""
    try:
        found = content(path)
    except sdpgrind.DamagedFileError as error:
        return "told" if str(path) in str(error) else "without name"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "same" if equal(found, whole) else "silent"


def attack(path: Path, times: float, rng: np.random.Generator) -> dict[str, Counter[str]]:
    """Damage a file 1000, 100 and 100 times, times `times`; the file itself stays as it is."""
    raw, whole, damaged = path.read_bytes(), content(path), path.with_name(f"damaged{path.suffix}")
    found: dict[str, Counter[str]] = {}
    with warnings.catch_warnings(action="error"):  # a damaged file must not pass for an old one
        for way, count in ((flips, 1000), (truncations, 100), (swaps, 100)):
            found[way.__name__] = Counter()
            for changed in way(raw, round(count * times), rng):
                damaged.write_bytes(changed)
                found[way.__name__][tried(damaged, whole)] += 1
    return found


def faults(found: dict[str, Counter[str]]) -> int:
    """Number of files that loaded with other content or gave another error."""
    return sum(n for each in found.values() for how, n in each.items() if how not in ("told", "same"))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=float, default=1.0, help="share of 1000 flips, 100 ends, 100 swaps")
    parser.add_argument("--rng", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    worst = 0
    print("| kind | bytes | flips | truncations | swaps |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds():
            if options.only in kind:
                path = Path(folder, f"{kind}.nc")
                write(kind, path)
                found = attack(path, options.times, np.random.default_rng(options.rng))
                told = " | ".join(
                    ", ".join(f"{n} {how}" for how, n in each.items()) for each in found.values()
                )
                print(f"| {kind} | {path.stat().st_size} | {told} |", flush=True)
                worst += faults(found)
    print(f"\n{worst} silent changes or other errors")
    return int(worst > 0)


if __name__ == "__main__":
    sys.exit(main())
