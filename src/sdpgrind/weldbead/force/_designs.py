"""Feedback laws designed for given limits: tuned PI, disturbance observer, convex design as yardstick."""

from collections.abc import Callable
from functools import cached_property
from typing import TypeAlias

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.base.quantities import Described, described, part, quantity
from sdpgrind.base.units import hz
from sdpgrind.control import Law, QLimits, Sampled, q_design, slope_bandwidth
from sdpgrind.weldbead.force._feedback import PI, ForceLoop, ForcePlant
from sdpgrind.weldbead.force._margins import RUNOUT_BAND, moved

_Family: TypeAlias = Callable[[float, float], Law]
_Ranges: TypeAlias = tuple[tuple[float, float], tuple[float, float]]


@described("force.limits")
class DesignLimits(Described):
    """Limits at which feedback designs are compared.

    Parameters
    ----------
    runout_response : float
        Greatest force at the alias of the disc speed, 20 to 50 Hz, per runout force, unit 1.
    sensitivity_max, complementary_max : float
        Ms and Mt, unit 1; Ms = 2 implies a gain margin of 6 dB.

    Examples
    --------
    >>> DesignLimits(runout_response=0.05).sensitivity_max
    2.0
    """

    runout_response: float = quantity("1", above=0, default=0.1)
    sensitivity_max: float = quantity("1", above=1, default=2.0)
    complementary_max: float = quantity("1", above=1, default=1.5)


def runout_weight(plant: ForcePlant) -> tuple[Floats, Floats]:
    """Angular frequencies, rad/s, below half the rate, and the weight of runout on abs(C S), N/mm."""
    spin = np.linspace(*RUNOUT_BAND, 241)
    seen = np.round(plant.sensor.alias(spin), 9)
    weight = np.abs(plant.sensor.response(spin)) * moved(plant, seen)
    unique, place = np.unique(seen, return_inverse=True)
    largest = np.zeros(len(unique))
    np.maximum.at(largest, place, weight)
    return unique, largest


def _given(plant: ForcePlant | None, limits: DesignLimits | None) -> tuple[ForcePlant, DesignLimits]:
    """Check the arguments, and fill in defaults."""
    plant = ForcePlant() if plant is None else checks.kind("plant", plant, ForcePlant)
    return plant, DesignLimits() if limits is None else checks.kind("limits", limits, DesignLimits)


def q_loop(
    plant: ForcePlant | None = None, limits: DesignLimits | None = None, *, taps: int = 40
) -> ForceLoop:
    """Return the loop of largest bandwidth that any linear law reaches within the limits: the yardstick.

    Parameters
    ----------
    plant : ForcePlant, optional
        Plant (mm to N).
    limits : DesignLimits, optional
        Limits, dimensionless.
    taps : int
        Coefficients of the filter Q, a whole number.

    Raises
    ------
    ValueError
        When no law keeps the limits.
    """
    plant, limits = _given(plant, limits)
    seen, weight = runout_weight(plant)
    both = QLimits(
        *(limits.sensitivity_max, limits.complementary_max),
        tuple(seen),
        tuple(weight),
        limits.runout_response,
    )
    filter, _ = q_design(plant.sampled, both, taps=taps)
    return ForceLoop(Law.internal_model(plant.sampled, filter), plant, "convex")


def tuned_pi(plant: ForcePlant | None = None, limits: DesignLimits | None = None) -> ForceLoop:
    """Return the PI loop of largest bandwidth within `limits` on a `plant` (mm to N), over both gains.

    Examples
    --------
    >>> from sdpgrind.weldbead import force
    >>> margin = force.margins(force.tuned_pi(limits=force.DesignLimits(runout_response=0.1)))
    >>> margin.runout_response <= 0.1001, margin.sensitivity_peak <= 2.001
    (True, True)
    """
    plant, limits = _given(plant, limits)
    slow = plant.drive.reduced[0]

    def law(crossover: float, lead: float) -> Law:
        ki = hz(crossover) / plant.contact_stiffness
        return PI(kp=lead * ki / slow, ki=ki, sample_time=plant.sample_time).law

    return tuned(law, ((0.2, 8.0), (0.05, 2.5)), plant, limits, "PI")


@described("force.observer")
class DisturbanceObserver(Described):
    """Law that feeds back the low-passed error of the loop's model.

    Q(z) = (1 - a/z)/(1 - a) ((1 - p)/(1 - p/z))^2 / K_x with p = exp(-cutoff T); a = lead exp(-b1 T) inverts
    the slowest pole of the drive. The observed disturbance is a force (N), the correction a position (mm).

    Parameters
    ----------
    cutoff : float
        Cut-off of the low-pass, rad/s.
    lead : float
        Inverted share of the slowest pole, unit 1, 0 to 1.
    plant : ForcePlant
        Plant.

    Raises
    ------
    ValueError
        When a value is out of its range.

    Examples
    --------
    >>> from sdpgrind import units
    >>> DisturbanceObserver(cutoff=units.hz(3.0)).loop.name
    'observer'
    """

    cutoff: float = quantity("rad/s", above=0)
    lead: float = quantity("1", at_least=0, at_most=1, default=1.0)
    plant: ForcePlant = part(ForcePlant, default_factory=ForcePlant)

    @property
    def law(self) -> Law:
        """Law in plain arrays, mm per N."""
        return self._law(self.cutoff, self.lead)

    @cached_property
    def loop(self) -> ForceLoop:
        """Loop closed by this law (mm, N, s)."""
        return ForceLoop(self.law, self.plant, "observer")

    @classmethod
    def design(cls, plant: ForcePlant | None = None, limits: DesignLimits | None = None) -> ForceLoop:
        """Return the observer loop of largest bandwidth within `limits` on a `plant` (mm to N)."""
        plant = ForcePlant() if plant is None else plant
        one = cls(1.0, plant=plant)
        return tuned(
            lambda cut, lead: one._law(hz(cut), lead - 1.0),
            ((0.2, 30.0), (1.0, 2.0)),
            plant,
            limits,
            "observer",
        )

    def _law(self, cutoff: float, lead: float) -> Law:
        T, slow = self.plant.sample_time, self.plant.drive.reduced[0]
        a, p = lead * np.exp(-slow * T), np.exp(-cutoff * T)
        first = Sampled(np.array([[p]]), np.array([1 - p]), np.array([p]), 1 - p, T)
        zero = Sampled(np.zeros((1, 1)), np.ones(1), np.array([-a / (1 - a)]), 1 / (1 - a), T)
        return Law.internal_model(
            self.plant.sampled, first.then(first).then(zero).scaled(1 / self.plant.contact_stiffness)
        )


def tuned(
    family: _Family, ranges: _Ranges, plant: ForcePlant, limits: DesignLimits | None, name: str
) -> ForceLoop:
    """Return the loop of largest bandwidth of a family of two positive parameters."""
    return ForceLoop(family(*best_parameters(family, ranges, plant, limits, name)), plant, name)


def best_parameters(
    family: _Family, ranges: _Ranges, plant: ForcePlant, limits: DesignLimits | None, name: str
) -> tuple[float, float]:
    """Return the parameters of largest bandwidth: a logarithmic grid that shrinks to its best point."""
    judge = _Judge(plant, DesignLimits() if limits is None else limits)
    low, high = np.log(np.array(ranges)).T
    best, width, number, value = (low + high) / 2, (high - low) / 2, 21, -np.inf
    for _ in range(8):
        points = _points(best, width, low, high, number)
        with one_blas_thread():
            values = [judge(family(*np.exp(point))) for point in points]
        k = int(np.argmax(values))
        if values[k] >= value:
            best, value = points[k], values[k]
        width, number = width * (0.15 if number == 21 else 0.5), 7
    if not np.isfinite(value):
        raise ValueError(f"limits leave no {name} law in the range searched; got {judge.limits!r}")
    first, second = np.exp(best)
    return float(first), float(second)


def _points(centre: Floats, width: Floats, low: Floats, high: Floats, number: int) -> Floats:
    lines = [
        np.clip(np.linspace(c - w, c + w, number), a, b)
        for c, w, a, b in zip(centre, width, low, high, strict=True)
    ]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)


class _Judge:
    """Bandwidth of a law within the limits; keeps the plant's responses."""

    def __init__(self, plant: ForcePlant, limits: DesignLimits) -> None:
        self.limits, self._plant = limits, plant.sampled
        top = np.pi / plant.sample_time
        low = np.geomspace(1e-4 * top, 0.02 * top, 60, endpoint=False)
        self._frequency = np.concatenate([low, np.linspace(0.02 * top, top, 240)])
        self._response = self._plant.response(self._frequency)
        self._seen, self._weight = runout_weight(plant)
        self._there = self._plant.response(self._seen)

    def __call__(self, law: Law) -> float:
        loop = law.system.response(self._frequency) * self._response
        sensitivity, tracking = np.abs(1 / (1 + loop)), np.abs(loop / (1 + loop))
        control = law.system.response(self._seen)
        runout = np.max(self._weight * np.abs(control / (1 + control * self._there)))
        peaks = (sensitivity.max(), tracking.max(), runout)
        allowed = (self.limits.sensitivity_max, self.limits.complementary_max, self.limits.runout_response)
        if any(peak > limit for peak, limit in zip(peaks, allowed, strict=True)):
            return -np.inf
        if not law.system.then(self._plant).closed().stable:
            return -np.inf
        return slope_bandwidth(self._frequency, sensitivity)
