"""Faults of readings: which measurement, which samples, and the machine under such a fault."""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY
from math import nan
from typing import Any, ClassVar

import numpy as np

from hwsim.faults._machine import FaultyMachine
from hwsim.faults._plant import Faulty
from hwsim.protocols import Machine
from sdpgrind.base import checks
from sdpgrind.base.quantities import custom, described, quantity, text

Past = deque[Mapping[str, Any]]
"""Earlier samples without the fault, the last one at the end."""


def _checked_numbers(name: str, value: Any) -> tuple[int, ...]:
    """Return numbers of samples in order, from one or several."""
    several = list(value) if isinstance(value, Iterable) and not isinstance(value, str) else [value]
    if not several:
        raise checks.refuse(name, "at least one sample", value)
    return tuple(sorted({checks.whole(name, each) for each in several}))


@described()
class OfReading(Faulty):
    """Base of the faults that change one measurement, or all of them."""

    _reach: ClassVar[int] = 0  # earlier samples that it needs

    _: KW_ONLY
    of: str | None = text(default=None)

    def _check(self) -> None:
        if self.of is not None and self.of not in self.measures:
            raise self._not_measured()

    def _not_measured(self) -> ValueError:
        known = ", ".join(self.measures)
        return checks.refuse("of", f"one of the measurements of the plant: {known}", self.of)

    def _machine(self, machine: Machine, rng: np.random.Generator) -> "ReadingMachine":
        return ReadingMachine(machine, self, rng)

    def _replaced(self, reading: dict[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
        """Measurements with those of the fault from elsewhere; NaN where there are none."""
        names = self.measures if self.of is None else (self.of,)
        return reading | {name: other.get(name, nan) for name in names}

    def _error(self, rng: np.random.Generator) -> float:
        """Draw the error of a sample, struck or not."""
        return 0.0

    def _strikes(self, sample: int, rng: np.random.Generator) -> bool:
        """Whether a sample is struck."""
        return False

    def _changed(self, reading: dict[str, Any], past: Past, error: float) -> dict[str, Any]:
        """Measurements of a struck sample."""
        return reading


@described()
class Striking(OfReading):
    """Base of the faults that strike some samples."""

    _always: ClassVar[bool] = False  # whether all samples are struck when none are named

    _: KW_ONLY
    share: float | None = quantity("1", at_least=0, at_most=1, default=None)
    at: int | Iterable[int] | None = custom(_checked_numbers, default=None)

    def _check(self) -> None:
        super()._check()
        if (self.share is None) != (self.at is None) or (self._always and self.share is None):
            return
        got = "neither" if self.share is None else f"share={self.share:g} and at={self.at}"
        rule = "share (probability a sample) or at (numbers of samples, from 0)"
        raise ValueError(f"one of {rule} must be given; got {got}")

    def _strikes(self, sample: int, rng: np.random.Generator) -> bool:
        """Draw whether a sample is struck: a greater share strikes the samples of a smaller one, too."""
        chance = float(rng.random())
        if self.share is not None:
            return chance < self.share
        assert self.at is None or isinstance(self.at, tuple)
        return self.at is None or sample in self.at


class ReadingMachine(FaultyMachine):
    """A machine with a fault in its readings."""

    def __init__(self, machine: Machine, fault: OfReading, rng: np.random.Generator) -> None:
        super().__init__(machine, fault.seen)
        self._fault, self._rng = fault, rng
        self._past: Past = deque(maxlen=fault._reach)
        self._now: Mapping[str, Any] = {}
        self._struck, self._error = False, 0.0

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        if fresh:
            if self._sample > 0:
                self._past.append(self._now)
            self._error = self._fault._error(self._rng)
            self._struck = self._fault._strikes(self._sample, self._rng)
        self._now = reading
        return self._struck

    def _changed(self, reading: dict[str, Any]) -> dict[str, Any]:
        return self._fault._changed(reading, self._past, self._error)
