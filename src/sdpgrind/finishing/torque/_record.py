"""Record of runs of the torque axis with settling, overshoot, ripple and amplitude at a frequency."""

import dataclasses
from math import inf
from typing import Any

import numpy as np

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats

_LAST = 0.1  # chosen: last share of a run that must lie within the band


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AxisRecord:
    """Runs of the torque axis from several start angles, from `simulate_axis`.

    Attributes
    ----------
    time : array, (n,)
        s.
    angle : array, (runs, n)
        True motor angle, rad.
    current : array, (runs, n)
        Current from that time on, A.
    contact_torque, estimate : array, (runs, n)
        True and estimated contact torque, N m.
    normal_force : array, (runs, n)
        True normal force, N.
    target_force : float
        Reference of the normal force, N.
    height_error : array, (n,)
        Height error of the surface, mm.
    """

    time: Floats
    angle: Floats
    current: Floats
    contact_torque: Floats
    estimate: Floats
    normal_force: Floats
    target_force: float
    height_error: Floats

    def settling(self, band: float = 0.02) -> Floats:
        """Return the settling time of each run, (runs,), s; infinite: not within the run.

        Parameters
        ----------
        band : float
            Half width of the band over the target.
        """
        outside = (
            np.abs(self.normal_force - self.target_force) > checks.share("band", band) * self.target_force
        )
        n = self.time.size
        last = n - 1 - np.argmax(outside[:, ::-1], axis=1)  # meaningless where it never is outside
        step = self.time[1] - self.time[0]
        after = np.where(outside.any(axis=1), (last + 1) * step, 0.0)
        return np.where(outside[:, n - max(int(_LAST * n), 1) :].any(axis=1), inf, after)

    @property
    def overshoot(self) -> Floats:
        """Greatest force beyond the target, over the target, (runs,), unit 1."""
        return np.asarray(self.normal_force.max(axis=1) / self.target_force - 1.0)

    @property
    def ripple(self) -> Floats:
        """Root mean square of the force about its mean in the second half of each run, (runs,), N."""
        return np.asarray(self._second_half.std(axis=1))

    @property
    def rms_error(self) -> Floats:
        """Root mean square error of the force in the second half of each run, (runs,), N."""
        return np.asarray(np.sqrt(np.mean((self._second_half - self.target_force) ** 2, axis=1)))

    @property
    def offset(self) -> Floats:
        """Mean error of the force in the second half of each run, (runs,), N."""
        return np.asarray(self._second_half.mean(axis=1) - self.target_force)

    def error_amplitude(self, frequency: float) -> Floats:
        """Return the amplitude of the force at a frequency in the second half of each run, (runs,), N.

        Parameters
        ----------
        frequency : float
            rad/s; at least two periods must fit.
        """
        w = checks.positive("frequency", frequency, "rad/s")
        force = self._second_half
        time = self.time[-force.shape[1] :]
        least = 4 * np.pi / (time[-1] - time[0])
        if w < least:
            raise checks.refuse("frequency", f">= {least:.4g} for two periods in the second half", w, "rad/s")
        # Hann's window: other frequencies must not leak in
        window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(time.size) + 0.5) / time.size)
        turned = window * np.exp(-1j * w * time)
        return np.asarray(2 * np.abs((force - force.mean(axis=1, keepdims=True)) @ turned) / window.sum())

    @property
    def figures(self) -> dict[str, float]:
        """Means over runs: settling to 2 and 5 % (s), overshoot (unit 1), offset, ripple, error rms (N)."""
        means = {
            "settling_2": self.settling(0.02),
            "settling_5": self.settling(0.05),
            "overshoot": self.overshoot,
        }
        found = {name: float(np.mean(values)) for name, values in means.items()}
        squares = {"ripple": self.ripple, "rms_error": self.rms_error}
        found |= {name: float(np.sqrt(np.mean(values**2))) for name, values in squares.items()}
        return found | {"offset": float(np.mean(self.offset))}

    def plot(self, ax: Any = None) -> Any:
        """Draw the normal force of every run over time (N, s); return the figure.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into. Default: a new figure.
        """
        if ax is None:
            ax = pictures.axes_of(7, 4)
        ax.plot(self.time, self.normal_force.T, color="C0", linewidth=0.7, alpha=0.5)
        ax.axhline(self.target_force, color="k", linewidth=0.7)
        ax.set(xlabel="time [s]", ylabel="normal force [N]")
        return ax.figure

    def __repr__(self) -> str:
        found, (runs, samples) = self.figures, self.normal_force.shape
        duration = samples * float(self.time[1] - self.time[0])
        settled = f"2 % within {found['settling_2']:.3g} s, overshoot {100 * found['overshoot']:.3g} %"
        told = f"{settled}, ripple {found['ripple']:.3g} N"
        return f"AxisRecord({runs} runs of {duration:.3g} s, {self.target_force:g} N: {told})"

    @property
    def _second_half(self) -> Floats:
        return self.normal_force[:, self.time.size // 2 :]
