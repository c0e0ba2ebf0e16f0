"""Force sensor: analogue filter, inner sampling, digital filter, output at the rate of the controller."""

from math import pi

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.quantities import Described, count, described, quantity
from sdpgrind.base.units import hz
from sdpgrind.control import Sampled, continuous, ramped
from sdpgrind.weldbead.force import _butterworth as butterworth
from sdpgrind.weldbead.force._kernels import SensorCore


@described("force.sensor")
class SensorChain(Described):
    """Chain from the force at the grinder to the reading of the controller; Brown (1988), 7.2.

    The filter of 30 Hz at an output rate of 60 Hz is no anti-alias filter: 50 Hz are read as 10 Hz.

    Parameters
    ----------
    analogue_cutoff : float or None
        Three-pole Butterworth before the inner sampling, rad/s; None: left out.
    cutoff : float
        Two-pole Butterworth low-pass behind it, rad/s.
    inner_rate : int or None
        Inner samples per output, a whole number (8: 480 Hz). None: analogue low-pass and sampled output only,
        a simpler design model.
    sample_time : float
        Time between two outputs, s.
    noise_sd : float
        White noise of the output, N.
    quantum : float
        Step of the output, N; 0: none.

    Raises
    ------
    ValueError
        When a value is not finite or not positive, or `cutoff` (rad/s) is not below half the inner rate.

    Examples
    --------
    >>> import numpy as np
    >>> gain = SensorChain(analogue_cutoff=None).response(2 * np.pi * np.array([50.0, 58.0]))
    >>> np.round(20 * np.log10(np.abs(gain)), 1)
    array([ -9.8, -12.4])
    """

    analogue_cutoff: float | None = quantity("rad/s", above=0, default=hz(120.0))
    cutoff: float = quantity("rad/s", above=0, default=hz(30.0))
    inner_rate: int | None = count(default=8)
    sample_time: float = quantity("s", above=0, default=1 / 60)
    noise_sd: float = quantity("N", at_least=0, default=0.2)
    quantum: float = quantity("N", at_least=0, default=0.1)

    def _check(self) -> None:
        if self.inner_rate is not None:
            half = pi * self.inner_rate / self.sample_time
            if self.cutoff >= half * (1 - 1e-9):
                raise self._refused("cutoff", f"< {half:g}, half the rate inside the sensor")

    @property
    def inner_time(self) -> float:
        """Time between two inner samples, s."""
        return self.sample_time / (self.inner_rate or 1)

    @property
    def analogue(self) -> tuple[Floats, Floats]:
        """Numerator and denominator of all analogue filters (s in rad/s), dimensionless gain 1 at 0."""
        top, low = np.ones(1), np.ones(1)
        if self.analogue_cutoff is not None:
            top, low = butterworth.analogue(3, self.analogue_cutoff)
        if self.inner_rate is None:
            second = butterworth.analogue(2, self.cutoff)
            products = np.polymul(top, second[0]), np.polymul(low, second[1])
            top, low = (np.asarray(each, dtype=float) for each in products)
        return top, low

    @property
    def digital(self) -> tuple[Floats, Floats]:
        """Numerator and denominator of the digital low-pass in powers of 1/z, dimensionless gain 1 at 0."""
        if self.inner_rate is None:
            return np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
        return butterworth.digital(2, self.cutoff, self.inner_time)

    @property
    def digital_system(self) -> Sampled:
        """Digital low-pass as a sampled system (sample time in s)."""
        (b0, b1, b2), (_, a1, a2) = self.digital
        A = np.array([[-a1, 1.0], [-a2, 0.0]])
        return Sampled(
            A, np.array([b1 - a1 * b0, b2 - a2 * b0]), np.array([1.0, 0.0]), float(b0), self.inner_time
        )

    def response(self, frequency: npt.ArrayLike) -> Complex:
        """Return the gain (N/N) from force to unsampled output at a `frequency`, rad/s; see `alias`."""
        w = np.asarray(frequency, dtype=float)
        top, low = self.analogue
        smooth = np.polyval(top, 1j * w) / np.polyval(low, 1j * w)
        return np.asarray(smooth * self.digital_system.response(w))

    def alias(self, frequency: npt.ArrayLike) -> Floats:
        """Return the angular frequency, rad/s, of the output for a force of `frequency`, rad/s."""
        rate = 2 * pi / self.sample_time
        return np.asarray(np.abs((np.asarray(frequency, dtype=float) + rate / 2) % rate - rate / 2))

    def core(self, step: float) -> SensorCore:
        """Return constants of `sensor_step` for sub-steps of `step`, s, whole parts of the inner time."""
        ratio = self.inner_time / checks.positive("step", step, "s")
        if abs(ratio - round(ratio)) > 1e-6 or round(ratio) < 1:
            raise checks.refuse("step", f"a whole part of {self.inner_time:g}", step, "s")
        top, low = self.digital
        if len(self.analogue[1]) == 1:
            one, nothing = np.ones(1), np.zeros(1)
            return SensorCore(np.zeros((1, 1)), nothing, one, one, top, low, round(ratio), self.quantum)
        A, B, C, _ = continuous(*self.analogue)
        transition, old, new = (np.ascontiguousarray(each) for each in ramped(A, B, step))
        return SensorCore(transition, old, new, np.ascontiguousarray(C), top, low, round(ratio), self.quantum)

    def start(self) -> Floats:
        """Return the state of `sensor_step` at rest (0 N)."""
        order = max(1, len(self.analogue[1]) - 1)
        return np.zeros(2 * order + 5)
