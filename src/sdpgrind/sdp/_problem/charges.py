"""Charge for ending off the target: one for each side."""

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._problem.one_sided import OneSided

Function = Callable[[Floats], npt.ArrayLike]


@stored("sdp.charge")
@dataclasses.dataclass(frozen=True)
class Charge(Frozen):
    """Charge for ending at x: one for each side of the target 0.

    Parameters
    ----------
    under : OneSided or callable, optional
        Charge ($) on the distance x > 0 (too little done). A function of an array of distances is allowed
        where no closed form is needed; `check` tests it.
    over : OneSided, optional
        Charge ($) on the distance -x where x < 0 (too much done).

    Raises
    ------
    TypeError
        For any other side.

    Examples
    --------
    >>> from sdpgrind import sdp
    >>> charge = Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0))
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
        """Return the derivative of the charge ($ per unit of x) at `x`; differences for a plain function."""
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
            Law of the amount D taken from `x`.
        x : array_like
            Initial coordinate, unit of D; broadcasts with the law's shape.

        Returns
        -------
        array
            Expected charge, $. Exact for one-sided charges; a plain function is linear between 2001 points.
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
        """Test a plain function on 1001 distances from 0 to `limit` (unit of x).

        Raises
        ------
        ValueError
            When the charge is not finite, not 0 at the target, negative, or falls with distance.
        """
        if self.under is not None and not isinstance(self.under, OneSided):
            checks.charge("under", self.under, limit)


def _slope(under: OneSided | Function, z: Floats) -> Floats:
    if isinstance(under, OneSided):
        return under.slope(z)
    step = 1e-6 * np.maximum(z, 1.0)
    low = np.maximum(z - step, 0.0)
    return np.asarray((np.asarray(under(z + step)) - np.asarray(under(low))) / (z + step - low))


def _expected_function(under: Function, law: Law, x: Floats) -> Floats:
    """E under((x - D)+) of the polygon through 2001 points: each kink z adds a multiple of E(x - z - D)+."""
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
