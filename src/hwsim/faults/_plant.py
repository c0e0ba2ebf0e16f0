"""A plant wrapped in a fault: what it passes on, its name in the outcome, its random numbers."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hwsim._part.clock import exact, simplest
from hwsim.faults._machine import FaultyMachine
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described
from sdpgrind.base.warned import warn

_PASSED = ("job", "safe", "ranges", "sample_ticks", "tables")  # as the plant has them
_WRAPPED = ("with_tick", "after")  # they return another plant
_APART = 0xFA017  # chosen: first word of the keys of all faults; no plant makes so many children
_PLANT = "a simulated plant, such as hwsim.WeldBeadStand(problem)"


def checked_plant(name: str, plant: Any) -> Any:
    """Return a plant; refuse what is none, or has a clock of its own."""
    if isinstance(plant, type) or not all(
        hasattr(plant, each) for each in ("measures", "accepts", "tick", "start")
    ):
        raise TypeError(f"{name} must be {_PLANT}; got {checks.shown(plant)}")
    if hasattr(plant, "start_live"):
        raise TypeError(
            f"{name} must be {_PLANT}: a real machine has faults of its own; got {checks.shown(plant)}"
        )
    return plant


def warn_of_idle(plant: Any, outcomes: Sequence[Mapping[str, Any]]) -> None:
    """Warn of each fault that was told when to strike, and struck in no part of a run."""
    if not isinstance(plant, Faulty):
        return
    warn_of_idle(plant.plant, outcomes)
    if plant._has_place and not any(float(told.get(plant.seen, 1.0)) for told in outcomes):
        own = Described.__repr__(plant)
        warn(f"{own} never struck: no part of the run came so far; outcome {plant.seen} is 0")


def class_name(plant: Any) -> str:
    """Name of the class of a plant, without its faults."""
    return class_name(plant.plant) if isinstance(plant, Faulty) else type(plant).__name__


@described()
class Faulty(Described):
    """Base of the faults: everything of the plant but what the fault changes."""

    _inside = ()

    plant: Any = custom(checked_plant, repr=False)

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements of the plant."""
        measures: Mapping[str, str] = self.plant.measures
        return measures

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands of the plant."""
        accepts: Mapping[str, str] = self.plant.accepts
        return accepts

    @property
    def tick(self) -> float:
        """Tick of the plant, s."""
        return float(self.plant.tick)

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit of the outcomes of the plant, and ``seen_...``: samples that the fault struck."""
        return {**getattr(self.plant, "outcomes", {}), self.seen: ""}

    @property
    def description(self) -> Mapping[str, float | str]:
        """What the plant tells of itself, in its units, and the faults, from the inside to the outside."""
        told: Mapping[str, float | str] = getattr(self.plant, "description", {})
        before = f"{told['faults']}; " if isinstance(self.plant, Faulty) else ""
        return {**told, "faults": before + super().__repr__()}

    @property
    def seen(self) -> str:
        """Name of the outcome that counts the struck samples: ``seen_late_height``; no unit.

        A second fault of the same kind on the same measurement is ``seen_late_height_2``.
        """
        kind = re.sub(r"(?<!^)(?=[A-Z])", "_", type(self).__name__).lower()
        of = getattr(self, "of", None)
        name = f"seen_{kind}_{of}" if of is not None else f"seen_{kind}"
        others = getattr(self.plant, "outcomes", {})
        number = 2
        while name in others:
            name, number = f"{name.removesuffix(f'_{number - 1}')}_{number}", number + 1
        return name

    def start(self, rng: np.random.Generator) -> FaultyMachine:
        """Draw the truth of the next part from `rng`, as the plant does, and return it at time 0 s.

        The fault draws from a child of its own, named by its kind and measurement.
        """
        own = self._child(rng)
        return self._machine(self.plant.start(rng), own)

    @property
    def _has_place(self) -> bool:
        """Whether it strikes at a place in the part that is told, and not by chance."""
        return getattr(self, "at", None) is not None

    def _machine(self, machine: Any, rng: np.random.Generator) -> FaultyMachine:
        return FaultyMachine(machine, self.seen)

    def _child(self, rng: np.random.Generator) -> np.random.Generator:
        """Child of `rng` that the plant never draws from; `rng` itself stays as it is."""
        seed = rng.bit_generator.seed_seq
        if not isinstance(seed, np.random.SeedSequence):
            raise TypeError(f"rng must be a generator of numpy.random.default_rng; got {rng!r}")
        word = hashlib.blake2b(self.seen.encode(), digest_size=8).digest()
        key = (*seed.spawn_key, _APART, seed.n_children_spawned, int.from_bytes(word))
        return np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=key))

    def _ticks(self, seconds: float) -> int:
        """First tick at or after a time."""
        return int(-(-simplest(seconds) // exact("tick of the plant", self.tick)))

    def __repr__(self) -> str:
        return f"{super().__repr__()} on {self.plant!r}"

    def __getattr__(self, name: str) -> Any:
        if name in _PASSED and "plant" in self.__dict__:
            return getattr(self.plant, name)
        if name in _WRAPPED and "plant" in self.__dict__:
            make = getattr(self.plant, name)
            return lambda given: self.replace(plant=make(given))
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
