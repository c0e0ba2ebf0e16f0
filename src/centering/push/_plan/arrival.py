"""Expected final position of the ring after a push, and its covariance."""

from cmath import exp, phase
from math import hypot, sqrt

import numpy as np
from scipy.special import ndtr

from centering._problem.model import PushModel
from centering._problem.problem import PushScatter
from centering.push._plan.touch import Touch
from centering.push.turning import _plane_kernels as at
from centering.push.turning._shooting import landing, ring_state
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss
from sdpgrind.base.quantities import Described, array, custom, described

_BEFORE = 0.05  # mm, chosen: run-up before planned first touch, so that a ring that lies nearer is met too
_WEIGHTS = np.array([2.0, 0.5, 0.5]) / 3.0  # derived: Gauss-Hermite weights of 0 and +-sqrt(3) sd
_NODES, _REACH = 64, 9.0  # chosen: nodes of the quadrature over position; its reach in standard deviations
_ERROR = 1e-8  # mm, chosen: error of an integration step, far below the scatter
_CHANGE = 0.01  # mm, chosen: step of the finite differences by position


@described()
class Arrival(ByValue, Described):
    """Expected final position of the ring's centre on the table; `Push.arrival` makes it.

    The x axis runs from the table's axis, the origin, through the centre before the push.

    Attributes
    ----------
    x, y : float
        Expected position, mm.
    covariance : array, (2, 2)
        Covariance, mm^2, from friction, direction, stop and measuring.

    Examples
    --------
    >>> Arrival(3.0, 4.0, [[1e-4, 0.0], [0.0, 4e-4]]).offset  # mm
    5.0
    """

    x: float = custom(unit="mm")
    y: float = custom(unit="mm")
    covariance: Floats = array("mm^2", finite=False)

    @property
    def offset(self) -> float:
        """Distance of the expected position from the axis, mm."""
        return hypot(self.x, self.y)

    @property
    def sd(self) -> Floats:
        """Standard deviations of x and y, (2,), mm."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def probability_within(self, tolerance: float) -> float:
        """Return the probability that the centre stops within a distance of the axis (normal scatter).

        Parameters
        ----------
        tolerance : float
            Distance from the axis, mm.

        Examples
        --------
        >>> there = Arrival(0.0, 0.0, [[0.01**2, 0.0], [0.0, 0.01**2]])
        >>> round(there.probability_within(0.02), 6)  # 1 - exp(-2)
        0.864665
        """
        r = checks.positive("tolerance", tolerance, "mm")
        variances, axes = np.linalg.eigh(self.covariance)
        (narrow, wide), (m, n) = np.sqrt(np.maximum(variances, (1e-9 * r) ** 2)), axes.T @ (self.x, self.y)
        low, high = max(-r, n - _REACH * wide), min(r, n + _REACH * wide)
        if low >= high:
            return 0.0
        v, weight = leggauss(_NODES)
        v = 0.5 * (low + high) + 0.5 * (high - low) * v
        half = np.sqrt(np.maximum(r * r - v * v, 0.0))
        chord = ndtr((half - m) / narrow) - ndtr((-half - m) / narrow)
        density = np.exp(-0.5 * ((v - n) / wide) ** 2) / (wide * np.sqrt(2.0 * np.pi))
        return float(0.5 * (high - low) * np.sum(weight * chord * density))

    def __repr__(self) -> str:
        along, across = 1e3 * self.sd
        sure = f"give or take {along:.3g} µm along and {across:.3g} µm across"
        return f"Arrival({1e3 * self.offset:.3g} µm from the axis, {sure})"


def arrival(
    model: PushModel, scatter: PushScatter, touch: Touch, offset: float, spindle_speed: float
) -> Arrival:
    """Follow the push in the plane as planned, and with each scattering quantity changed."""

    def end(friction: float = 0.0, place: complex = 0.0, nearer: float = 0.0) -> complex:
        scaled = model.replace(
            mu_static=model.mu_static * (1 + friction), mu_kinetic=model.mu_kinetic * (1 + friction)
        )
        return _end(scaled, touch, offset + place, nearer, offset, spindle_speed)

    spread = sqrt(3.0) * min(hypot(scatter.friction_part_sd, scatter.friction_push_sd), 0.5)
    nominal = end()
    slips = np.array([nominal, end(spread), end(-spread)])  # Gauss-Hermite points: friction bends the way
    measuring = [scatter.measuring_sd * (end(place=_CHANGE * way) - nominal) / _CHANGE for way in (1.0, 1j)]
    stop = scatter.stop_sd * (end(nearer=_CHANGE) - nominal) / _CHANGE
    shares = [
        *np.sqrt(_WEIGHTS) * (slips - _WEIGHTS @ slips),
        *measuring,
        stop,
        *_turned(nominal - offset, scatter.direction_sd),
    ]
    moved = np.array([(share.real, share.imag) for share in shares])
    return Arrival(nominal.real, nominal.imag, moved.T @ moved)


def _turned(way: complex, sd: float) -> tuple[complex, complex]:
    """Standard deviations along and across of a way turned by a random angle (sd in rad), to all orders."""
    return way * (1.0 - exp(-sd * sd).real) / sqrt(2.0), 1j * way * sqrt(
        (1.0 - exp(-2.0 * sd * sd).real) / 2.0
    )


def _end(model: PushModel, touch: Touch, start: complex, nearer: float, offset: float, w: float) -> complex:
    """Final position of a ring that lies at `start`, under a tip `nearer` to the axis than planned, mm."""
    rows, radius = touch.push_profile.segments, model.part.radius
    before = _BEFORE / float(rows[0, 1])
    turned = exp(1j * (touch.angle + w * before))
    place = start / turned
    state = ring_state(abs(place), phase(place), radius, w)
    state[at.TIP] = ring_state(offset, -touch.angle, radius, w)[at.TIP] + _BEFORE - nearer
    whole = np.vstack(([(before, rows[0, 1], 0.0)], rows))
    return landing(model, w, whole, state, _ERROR) * turned
