"""Faults in a value: no reading, a constant error, an outlier."""

from dataclasses import KW_ONLY
from math import nan
from typing import Any, ClassVar

import numpy as np

from hwsim.faults._striking import Past, Striking
from sdpgrind.base import checks
from sdpgrind.base.quantities import custom, described


@described()
class Dropped(Striking):
    """Readings that do not come: NaN.

    Outcome: ``seen_dropped``, or ``seen_dropped_<of>``, the number of struck samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    of : str, optional
        Measurement that is missing. None: all of them.
    share : float, optional
        Probability that a sample is struck, in [0, 1].
    at : int or sequence of int, optional
        Numbers of the struck samples, from 0; instead of `share`.

    Raises
    ------
    ValueError
        When `of` is not measured, or not exactly one of `share` and `at` is given.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.Dropped(stand, of="time_left", at=[1, 3]).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(4))  # s
    (6.0, nan, 4.0, nan, 2.0)
    """

    def _changed(self, reading: dict[str, Any], past: Past, error: float) -> dict[str, Any]:
        return self._replaced(reading, {})


@described()
class Wrong(Striking):
    """Base of the faults that add an error to one measurement."""

    def _check(self) -> None:
        if self.of is None:
            raise self._not_measured()
        super()._check()

    def _in_unit(self, name: str) -> float:
        """Check a number in the unit of the measurement, and keep it."""
        assert self.of is not None
        value = checks.number(name, getattr(self, name), self.measures[self.of])
        object.__setattr__(self, name, value)
        return value

    def _changed(self, reading: dict[str, Any], past: Past, error: float) -> dict[str, Any]:
        assert self.of is not None
        return {**reading, self.of: reading.get(self.of, nan) + error}


@described()
class Bias(Wrong):
    """A gauge that reads too much, always or in some samples.

    Outcome: ``seen_bias_<of>``, the number of struck samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    of : str
        Measurement with the error; of an array each entry.
    by : float
        Reading minus true reading, in the unit of the measurement.
    share : float, optional
        Probability that a sample is struck, in [0, 1]. None, and no `at`: all samples.
    at : int or sequence of int, optional
        Numbers of the struck samples, from 0; instead of `share`.

    Raises
    ------
    ValueError
        When `of` is not measured, `by` is not finite, or both `share` and `at` are given.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.Bias(stand, of="time_left", by=-0.5).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], bead.step({}, 1000)["time_left"]  # s
    (5.5, 4.5)
    """

    _always: ClassVar[bool] = True

    _: KW_ONLY
    by: float = custom()

    def _check(self) -> None:
        super()._check()
        self._in_unit("by")

    def _error(self, rng: np.random.Generator) -> float:
        return self.by


@described()
class Spike(Wrong):
    """Outliers: single readings far off.

    Outcome: ``seen_spike_<of>``, the number of struck samples.

    Parameters
    ----------
    plant : Plant
        Simulated plant, perhaps one with other faults.
    of : str
        Measurement with the outliers; of an array all entries are shifted by the same.
    size : float
        Mean of reading minus true reading, in the unit of the measurement.
    sd : float
        Its standard deviation (normal distribution), in the unit of the measurement.
    share : float, optional
        Probability that a sample is struck, in [0, 1].
    at : int or sequence of int, optional
        Numbers of the struck samples, from 0; instead of `share`.

    Raises
    ------
    ValueError
        When `of` is not measured, `size` or `sd` is not finite, `sd` is negative, or not exactly one of
        `share` and `at` is given.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), time=6.0)
    >>> bead = hwsim.faults.Spike(stand, of="time_left", size=60.0, at=1).start(np.random.default_rng(0))
    >>> bead.step({}, 0)["time_left"], *(bead.step({}, 1000)["time_left"] for _ in range(2))  # s
    (6.0, 65.0, 4.0)
    """

    _: KW_ONLY
    size: float = custom()
    sd: float = custom(default=0.0)

    def _check(self) -> None:
        super()._check()
        self._in_unit("size")
        if self._in_unit("sd") < 0:
            raise checks.refuse("sd", ">= 0", self.sd, self.measures[self.of or ""])

    def _error(self, rng: np.random.Generator) -> float:
        return self.size + self.sd * float(rng.standard_normal())
