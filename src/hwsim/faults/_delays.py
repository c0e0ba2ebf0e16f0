"""Faults in time: readings that come late, twice, or stand still."""

from dataclasses import KW_ONLY
from typing import Any, ClassVar

import numpy as np

from hwsim.faults._machine import ShownFaults, shown_faults
from hwsim.faults._striking import OfReading, Past, ReadingMachine, Striking
from hwsim.protocols import Machine
from sdpgrind.base import checks
from sdpgrind.base.quantities import count, custom, described


@described()
class DeadTime(OfReading):
    """A gauge with a dead time: each reading is that of some samples before, NaN at the start.

    A sample is one reading of the plant: a period of the fastest controller, or an event (a pass). Outcome:
    ``seen_dead_time``, or ``seen_dead_time_<of>``, the number of samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    samples : int
        Dead time in samples, >= 1.
    of : str, optional
        Measurement with the dead time. None: all of them.

    Raises
    ------
    ValueError
        When `samples` is out of range, or `of` is not measured.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.DeadTime(stand, of="time_left").start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(3))  # s
    (nan, 6.0, 5.0, 4.0)
    """

    _: KW_ONLY
    samples: int = count(default=1)

    @property
    def _reach(self) -> int:  # type: ignore[override]  # of the others a constant
        return self.samples

    def _strikes(self, sample: int, rng: np.random.Generator) -> bool:
        return True

    def _changed(self, reading: dict[str, Any], past: Past, error: float) -> dict[str, Any]:
        return self._replaced(reading, past[0] if len(past) == self.samples else {})


@described()
class Repeating(Striking):
    """Base of the faults that repeat the sample before; sample 0 has none and is never struck."""

    _reach: ClassVar[int] = 1

    def _check(self) -> None:
        super()._check()
        if isinstance(self.at, tuple) and 0 in self.at:
            raise checks.refuse("at", ">= 1: sample 0 has none before it", 0)

    def _strikes(self, sample: int, rng: np.random.Generator) -> bool:
        return super()._strikes(sample, rng) and sample > 0

    def _changed(self, reading: dict[str, Any], past: Past, error: float) -> dict[str, Any]:
        return self._replaced(reading, past[-1])


@described()
class Duplicated(Repeating):
    """Readings that repeat the one of the sample before, as if they were new.

    In simulated time the readings are those of `Late`. Served (`hwsim.serve`), the number of samples,
    ``sequence``, moves with each of them, so that only physics can tell that a value was repeated. Outcome:
    ``seen_duplicated``, or ``seen_duplicated_<of>``, the number of struck samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    of : str, optional
        Measurement that is repeated. None: all of them.
    share : float, optional
        Probability that a sample is struck, in [0, 1]; never sample 0, which has none before it.
    at : int or sequence of int, optional
        Numbers of the struck samples, from 1; instead of `share`.

    Raises
    ------
    ValueError
        When `of` is not measured, a number is 0, or not exactly one of `share` and `at` is given.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.Duplicated(stand, at=[1, 3]).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(4))  # s
    (6.0, 6.0, 4.0, 4.0, 2.0)
    """


@described()
class Late(Repeating):
    """Readings that come a sample late: in their place the one before is read again.

    Served (`hwsim.serve`), the number of samples, ``sequence``, lags with them: a client can see that the
    sample is old. In simulated time the readings are those of `Duplicated`. Outcome: ``seen_late``, or
    ``seen_late_<of>``, the number of struck samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    of : str, optional
        Measurement that is late. None: all of them.
    share : float, optional
        Probability that a sample is struck, in [0, 1]; never sample 0, which has none before it.
    at : int or sequence of int, optional
        Numbers of the struck samples, from 1; instead of `share`.

    Raises
    ------
    ValueError
        When `of` is not measured, a number is 0, or not exactly one of `share` and `at` is given.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.Late(stand, of="time_left", at=[1, 2]).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(3))  # s
    (6.0, 6.0, 5.0, 3.0)
    """

    def _machine(self, machine: Machine, rng: np.random.Generator) -> ReadingMachine:
        return _LateMachine(machine, self, rng)


class _LateMachine(ReadingMachine):
    """A machine whose samples come late; it tells by how many."""

    _lags = 0, 0  # of the machine inside: at the sample before, now

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        if fresh:
            self._lags = self._lags[1], shown_faults(self.inner).lag
        return super()._strikes(reading, fresh)

    @property
    def shown_faults(self) -> ShownFaults:
        """What the faults do to the server: a late sample is one older than the sample before."""
        before, now = self._lags
        return shown_faults(self.inner)._replace(lag=before + 1 if self._struck else now)


@described()
class Stuck(OfReading):
    """A gauge that sticks: from a sample on it repeats one reading.

    Outcome: ``seen_stuck``, or ``seen_stuck_<of>``, the number of repeated samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    at : int
        Number of the last good sample, from 0. A run whose parts all end before warns, as for every fault
        that is told when to strike.
    of : str, optional
        Measurement that sticks. None: all of them.

    Raises
    ------
    ValueError
        When `at` is negative, or `of` is not measured.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.Stuck(stand, of="time_left", at=1).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(3))  # s
    (6.0, 5.0, 5.0, 5.0)
    """

    _reach: ClassVar[int] = 1

    _: KW_ONLY
    at: int = custom(checks.whole)

    def _strikes(self, sample: int, rng: np.random.Generator) -> bool:
        return sample > self.at

    def _machine(self, machine: Machine, rng: np.random.Generator) -> ReadingMachine:
        return _StuckMachine(machine, self, rng)

    def _changed(self, reading: dict[str, Any], past: Past, error: float) -> dict[str, Any]:
        return self._replaced(reading, past[-1])


class _StuckMachine(ReadingMachine):
    """A machine that keeps the last good sample."""

    def _strikes(self, reading: dict[str, Any], fresh: bool) -> bool:
        struck = super()._strikes(reading, fresh)
        if struck:
            self._now = self._past[-1]
        return struck
