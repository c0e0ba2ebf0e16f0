"""Charges on the distance from the target, on one side; expectations by a law's partial moments."""

import dataclasses
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.sdp._distributions.law import Law


class OneSided(ABC):
    """Charge ($) on the distance z >= 0 from the target, on one side: Brown (1988), section 2.2.

    It is 0 at the target and does not fall with distance.
    """

    tolerance: float

    @abstractmethod
    def __call__(self, z: npt.ArrayLike) -> Floats:
        """Return the charge ($) at distance `z` >= 0."""

    @abstractmethod
    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of z) at `z` >= 0; the inner one at a kink."""

    @abstractmethod
    def expected_over(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((D - x)+), $, for D of `law`; `x` in the unit of D broadcasts with `law`."""

    @abstractmethod
    def expected_under(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((x - D)+), $, for D of `law`; `x` in the unit of D broadcasts with `law`."""

    @property
    @abstractmethod
    def zero(self) -> bool:
        """Whether nothing is ever charged."""

    @property
    @abstractmethod
    def convex(self) -> bool:
        """Whether the charge is a convex function of distance."""


@stored("sdp.constant")
@dataclasses.dataclass(frozen=True)
class Constant(OneSided, Frozen):
    """Constant charge outside the tolerance: `amount` where z > 0 and z >= tolerance.

    Its expectation is the amount times the probability of a distance outside, Brown (2.3).

    Parameters
    ----------
    amount : float
        Charge >= 0, $.
    tolerance : float
        Least charged distance >= 0, in the unit of z.

    Raises
    ------
    ValueError
        When a value is negative or not finite.

    Examples
    --------
    >>> Constant(5.0, tolerance=0.1)([0.0, 0.09, 0.1]).tolist()
    [0.0, 0.0, 5.0]
    """

    amount: float
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        _check(self, "amount", "$")

    def __call__(self, z: npt.ArrayLike) -> Floats:
        """Return the charge ($) at distance `z` >= 0."""
        z = np.asarray(z, dtype=float)
        return np.where((z > 0) & (z >= self.tolerance), self.amount, 0.0)

    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative, 0 $ per unit of z everywhere (the jump has none)."""
        return np.zeros(np.shape(z))

    def expected_over(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((D - x)+), $; see `OneSided`."""
        start = np.add(x, self.tolerance)
        return self.amount * law.over(np.nextafter(start, -np.inf) if self.tolerance else start, 0)

    def expected_under(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((x - D)+), $; see `OneSided`."""
        start = np.subtract(x, self.tolerance)
        return self.amount * law.under(start if self.tolerance else np.nextafter(start, -np.inf), 0)

    @property
    def zero(self) -> bool:
        """Whether nothing is ever charged."""
        return self.amount == 0

    @property
    def convex(self) -> bool:
        """Whether the charge is a convex function of distance: only if it is 0."""
        return self.zero


class _Power(OneSided, Frozen):
    """Charge ``factor ((z - tolerance)+)^power``."""

    _power: ClassVar[int]

    @property
    @abstractmethod
    def _factor(self) -> float: ...

    def __call__(self, z: npt.ArrayLike) -> Floats:
        """Return the charge ($) at distance `z` >= 0."""
        charged: Floats = np.maximum(np.subtract(z, self.tolerance), 0.0)
        return self._factor * charged**self._power

    def expected_over(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((D - x)+), $; see `OneSided`."""
        return self._factor * law.over(np.add(x, self.tolerance), self._power)

    def expected_under(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((x - D)+), $; see `OneSided`."""
        return self._factor * law.under(np.subtract(x, self.tolerance), self._power)

    @property
    def zero(self) -> bool:
        """Whether nothing is ever charged."""
        return self._factor == 0

    @property
    def convex(self) -> bool:
        """Whether the charge is a convex function of distance: it is."""
        return True


@stored("sdp.linear")
@dataclasses.dataclass(frozen=True)
class Linear(_Power):
    """Charge proportional to the distance beyond the tolerance: rate (z - tolerance)+.

    Parameters
    ----------
    rate : float
        Charge >= 0 per unit of distance, $ per unit of z.
    tolerance : float
        Distance >= 0 that is free, in the unit of z.

    Raises
    ------
    ValueError
        When a value is negative or not finite.

    Examples
    --------
    >>> Linear(2.0, tolerance=0.5)([0.25, 1.5]).tolist()
    [0.0, 2.0]
    """

    rate: float
    tolerance: float = 0.0

    _power = 1

    def __post_init__(self) -> None:
        _check(self, "rate", "$ per unit of distance")

    @property
    def _factor(self) -> float:
        return self.rate

    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of z) at distance `z` >= 0."""
        return np.where(np.greater(z, self.tolerance), self.rate, 0.0)


@stored("sdp.quadratic")
@dataclasses.dataclass(frozen=True)
class Quadratic(_Power):
    """Charge proportional to the squared distance beyond the tolerance: factor ((z - tolerance)+)^2.

    A charge A0 at the distance D0 gives the factor A0/D0^2, Brown (2.6).

    Parameters
    ----------
    factor : float
        Charge >= 0 per squared unit of distance, $ per unit of z squared.
    tolerance : float
        Distance >= 0 that is free, in the unit of z.

    Raises
    ------
    ValueError
        When a value is negative or not finite.

    Examples
    --------
    >>> Quadratic(2.0)([0.5, 1.0]).tolist()
    [0.5, 2.0]
    """

    factor: float
    tolerance: float = 0.0

    _power = 2

    def __post_init__(self) -> None:
        _check(self, "factor", "$ per squared unit of distance")

    @property
    def _factor(self) -> float:
        return self.factor

    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of z) at distance `z` >= 0."""
        return 2 * self.factor * np.maximum(np.subtract(z, self.tolerance), 0.0)


def _check(charge: OneSided, name: str, unit: str) -> None:
    object.__setattr__(charge, name, checks.nonnegative(name, getattr(charge, name), unit))
    object.__setattr__(
        charge, "tolerance", checks.nonnegative("tolerance", charge.tolerance, "unit of distance")
    )
