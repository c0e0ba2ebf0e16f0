"""One smooth run: the joints as a spline over arc length."""

from functools import cached_property
from math import factorial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, described, units_of
from sdpgrind.finishing.timing import _path_kernels as path_kernels

DEGREE = 5  # derived: four continuous derivatives, so that the jerk of a joint is continuous


class Pieces(NamedTuple):
    """Polynomials of a spline: starts (k + 1,), mm, and coefficients (k, 6, n), lowest power first."""

    breaks: Floats
    polynomials: Floats


@described(eq=False)
class JointPath(Described):
    """One smooth run: a quintic spline over arc length through samples of the joints.

    Four derivatives are continuous. Fewer than six samples are joined by one polynomial.

    Parameters
    ----------
    length : array, (m,)
        Arc length of the contact point at each sample, mm, rising from any value.
    joints : array, (m, n)
        The joints there, rad or mm.

    Raises
    ------
    ValueError
        When there are fewer than two samples, or the length does not rise; the message names the sample.

    Examples
    --------
    >>> x = np.linspace(0, 10, 21)
    >>> run = JointPath(x, np.stack([np.sin(x), x**2], axis=1))
    >>> run.at(5.0, derivative=1).round(3).tolist()
    [0.284, 10.0]
    """

    length: Floats = array("mm")
    joints: Floats = array("rad or mm")

    def _check(self) -> None:
        length, joints = self.length, self.joints
        if length.ndim != 1 or length.size < 2:
            raise self._refused("length", "of shape (m,) with m >= 2", length.shape)
        if joints.ndim != 2 or len(joints) != length.size:
            raise self._refused("joints", f"of shape ({length.size}, n), as many as lengths", joints.shape)
        for k in np.flatnonzero(np.diff(length) <= 0)[:1]:
            pair = float(length[k]), float(length[k + 1])
            raise self._refused("length", f"rising: points {k} and {k + 1} coincide or go back", pair)

    @property
    def span(self) -> float:
        """Arc length of the run, mm."""
        return float(self.length[-1] - self.length[0])

    @cached_property
    def pieces(self) -> Pieces:
        """Polynomials of the spline, in mm and rad or mm."""
        degree = min(DEGREE, self.length.size - 1)
        spline = make_interp_spline(self.length, self.joints, k=degree, check_finite=False)
        breaks = spline.t[degree:-degree]  # the end knots are there degree times more
        polynomials = np.zeros((breaks.size - 1, DEGREE + 1, self.joints.shape[1]))
        for power in range(degree + 1):
            polynomials[:, power] = spline(breaks[:-1], power) / factorial(power)
        return Pieces(breaks, polynomials)

    @cached_property
    def steepest(self) -> Floats:
        """Greatest slope of each joint at the samples, rad or mm per mm."""
        return np.asarray(np.abs(self.derivatives(self.length)[:, 1]).max(axis=0))

    def at(self, length: npt.ArrayLike, derivative: int = 0) -> Floats:
        """Return the joints at arc lengths, or a derivative of them over arc length.

        Parameters
        ----------
        length : array, (...)
            Arc lengths on the run, mm.
        derivative : int
            0 to 3: joints in rad or mm, per mm, per mm^2, per mm^3.

        Returns
        -------
        array, (..., n)

        Raises
        ------
        ValueError
            When a length is not on the run, or there is no such derivative.
        """
        order = checks.one_of("derivative", derivative, range(4))
        unit = units_of(JointPath)["length"]
        low, high, slack = self.length[0], self.length[-1], 1e-9 * self.span
        where = checks.inside("length", length, low, high, unit, slack=slack)
        return self.derivatives(where.ravel())[:, order].reshape(*where.shape, -1)

    def derivatives(self, length: Floats) -> Floats:
        """Return joints with three derivatives, (m, 4, n), rad or mm and per mm, at trusted lengths, mm."""
        out = np.empty((length.size, 4, self.joints.shape[1]))
        path_kernels.evaluate(*self.pieces, np.ascontiguousarray(length), out)
        return out
