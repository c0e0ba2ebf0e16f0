"""What a distance from the target costs, for each side of it; expectations through a law's partial moments."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.records import stored
from sdpgrind.sdp._law import Law

Function = Callable[[Floats], npt.ArrayLike]


class OneSided(ABC):
    """A charge ($) on the distance z >= 0 from the target, on one side of it: Brown (1988), section 2.2.

    It is 0 at the target and never falls with distance.
    """

    tolerance: float

    @abstractmethod
    def __call__(self, z: npt.ArrayLike) -> Floats:
        """Return the charge ($) at distance `z` >= 0."""

    @abstractmethod
    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of z) at distance `z` >= 0; at a kink, of the inner side."""

    @abstractmethod
    def expected_over(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((D - x)+), $, for D of `law`; `x` in the unit of D, broadcast with the law's shape."""

    @abstractmethod
    def expected_under(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((x - D)+), $, for D of `law`; `x` in the unit of D, broadcast with the law's shape."""

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
    """The same charge at any distance outside the tolerance: `amount` where z > 0 and z >= tolerance.

    Its expectation is the amount times the probability of being out, Brown (2.3).

    Parameters
    ----------
    amount : float
        Charge >= 0, $.
    tolerance : float
        Distance, >= 0 and in the unit of z, from which on is charged.

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
        """Whether the charge is a convex function of distance: only where it is nothing."""
        return self.zero


@stored("sdp.linear")
@dataclasses.dataclass(frozen=True)
class Linear(OneSided, Frozen):
    """A charge in proportion to the distance beyond the tolerance: rate (z - tolerance)+.

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

    def __post_init__(self) -> None:
        _check(self, "rate", "$ per unit of distance")

    def __call__(self, z: npt.ArrayLike) -> Floats:
        """Return the charge ($) at distance `z` >= 0."""
        return self.rate * np.maximum(np.subtract(z, self.tolerance), 0.0)

    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of z) at distance `z` >= 0."""
        return np.where(np.greater(z, self.tolerance), self.rate, 0.0)

    def expected_over(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((D - x)+), $; see `OneSided`."""
        return self.rate * law.over(np.add(x, self.tolerance), 1)

    def expected_under(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((x - D)+), $; see `OneSided`."""
        return self.rate * law.under(np.subtract(x, self.tolerance), 1)

    @property
    def zero(self) -> bool:
        """Whether nothing is ever charged."""
        return self.rate == 0

    @property
    def convex(self) -> bool:
        """Whether the charge is a convex function of distance: it is."""
        return True


@stored("sdp.quadratic")
@dataclasses.dataclass(frozen=True)
class Quadratic(OneSided, Frozen):
    """A charge in proportion to the square of the distance beyond the tolerance: factor ((z - tolerance)+)^2.

    A charge A0 at the distance D0 makes the factor A0/D0^2, Brown (2.6).

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

    def __post_init__(self) -> None:
        _check(self, "factor", "$ per squared unit of distance")

    def __call__(self, z: npt.ArrayLike) -> Floats:
        """Return the charge ($) at distance `z` >= 0."""
        return self.factor * np.maximum(np.subtract(z, self.tolerance), 0.0) ** 2

    def slope(self, z: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of z) at distance `z` >= 0."""
        return 2 * self.factor * np.maximum(np.subtract(z, self.tolerance), 0.0)

    def expected_over(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((D - x)+), $; see `OneSided`."""
        return self.factor * law.over(np.add(x, self.tolerance), 2)

    def expected_under(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge((x - D)+), $; see `OneSided`."""
        return self.factor * law.under(np.subtract(x, self.tolerance), 2)

    @property
    def zero(self) -> bool:
        """Whether nothing is ever charged."""
        return self.factor == 0

    @property
    def convex(self) -> bool:
        """Whether the charge is a convex function of distance: it is."""
        return True


def _check(charge: OneSided, name: str, unit: str) -> None:
    object.__setattr__(charge, name, checks.nonnegative(name, getattr(charge, name), unit))
    object.__setattr__(charge, "tolerance", checks.nonnegative("tolerance", charge.tolerance, "unit of distance"))


@stored("sdp.charge")
@dataclasses.dataclass(frozen=True)
class Charge(Frozen):
    """What it costs to end at x: one charge for each side of the target 0.

    Parameters
    ----------
    under : OneSided or callable, optional
        Charge ($) on the distance x where x > 0 (not enough has been done). A plain function of an array of distances
        will do where no closed form is needed; `check` tests it.
    over : OneSided, optional
        Charge ($) on the distance -x where x < 0 (too much has been done).

    Raises
    ------
    TypeError
        When a side is something else.

    Examples
    --------
    >>> charge = Charge(under=Linear(2.0), over=Linear(10.0))
    >>> charge([-0.1, 0.0, 1.0]).tolist()
    [1.0, 0.0, 2.0]
    """

    under: OneSided | Function | None = None
    over: OneSided | None = None

    def __post_init__(self) -> None:
        if self.under is not None and not callable(self.under):
            raise TypeError(f"under must be a one-sided charge, a function or None; got {self.under!r}")
        if self.over is not None and not isinstance(self.over, OneSided):
            raise TypeError(f"over must be Constant, Linear, Quadratic or None; got {self.over!r}")

    def __call__(self, x: npt.ArrayLike) -> Floats:
        """Return the charge ($) at the signed distance `x`, positive on the side of `under`."""
        x = np.asarray(x, dtype=float)
        total = np.zeros(x.shape)
        if self.under is not None:
            total += np.where(x > 0, self.under(np.maximum(x, 0.0)), 0.0)
        if self.over is not None:
            total += np.where(x < 0, self.over(np.maximum(-x, 0.0)), 0.0)
        return total

    def slope(self, x: npt.ArrayLike) -> Floats:
        """Return the derivative of the charge ($ per unit of x) at `x`; of a plain function by differences."""
        x = np.asarray(x, dtype=float)
        total = np.zeros(x.shape)
        if self.under is not None:
            total += np.where(x > 0, _slope(self.under, np.maximum(x, 0.0)), 0.0)
        if self.over is not None:
            total -= np.where(x < 0, self.over.slope(np.maximum(-x, 0.0)), 0.0)
        return total

    def expected(self, law: Law, x: npt.ArrayLike) -> Floats:
        """Return E charge(x - D) for D of `law`, Brown (2.8).

        Parameters
        ----------
        law : Law
            Law of the amount D that is taken from `x`.
        x : array_like
            Where one starts, unit of D; broadcasts with the law's shape.

        Returns
        -------
        array
            Expected charge, $. Exact for one-sided charges; a plain function is taken as linear between 2001 points.
        """
        x = np.asarray(x, dtype=float)
        total = np.zeros(np.broadcast_shapes(x.shape, law.shape))
        if isinstance(self.under, OneSided):
            total += self.under.expected_under(law, x)
        elif self.under is not None:
            total += _expected_function(self.under, law, x)
        if self.over is not None:
            total += self.over.expected_over(law, x)
        return total

    def check(self, limit: float) -> None:
        """Refuse a plain function that is no charge, on 1001 distances from 0 to `limit` (unit of x).

        Raises
        ------
        ValueError
            When the charge is not finite, not 0 at the target, negative, or falls with distance.
        """
        if self.under is not None and not isinstance(self.under, OneSided):
            check_function("under", self.under, limit)


def check_function(name: str, function: Function, limit: float) -> None:
    """Refuse a function of distance that is not finite, 0 at 0, non-negative and non-decreasing up to `limit`."""
    z = np.linspace(0.0, limit, 1001)
    charge = np.broadcast_to(np.asarray(function(z), dtype=float), z.shape)
    rules = {
        "finite": ~np.isfinite(charge),
        "0 at the target": (z == 0) & (charge != 0),
        ">= 0": charge < 0,
        "non-decreasing away from the target": np.concatenate([[False], charge[1:] < charge[:-1]]),
    }
    for rule, broken in rules.items():
        if np.any(broken):
            k = int(np.argmax(broken))
            raise ValueError(f"{name} must be {rule} ($); got {charge[k]:g} at distance {z[k]:g}")


def _slope(under: OneSided | Function, z: Floats) -> Floats:
    if isinstance(under, OneSided):
        return under.slope(z)
    step = 1e-6 * np.maximum(z, 1.0)
    low = np.maximum(z - step, 0.0)
    return np.asarray((np.asarray(under(z + step)) - np.asarray(under(low))) / (z + step - low))


def _expected_function(under: Function, law: Law, x: Floats) -> Floats:
    """E under((x - D)+) of the polygon through 2001 points: each of its kinks adds a multiple of E(x - z - D)+."""
    limit = float(np.max(x - law.support[0], initial=0.0))
    total = np.zeros(np.broadcast_shapes(x.shape, law.shape))
    if limit <= 0:
        return total
    z = np.linspace(0.0, limit, 2001)
    kinks = np.diff(np.diff(np.asarray(under(z), dtype=float)) / np.diff(z), prepend=0.0)
    for place, kink in zip(z[:-1], kinks, strict=True):
        if kink:
            total += kink * law.under(x - place)
    return total
