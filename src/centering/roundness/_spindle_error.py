"""The error of a tester's spindle over its angle, as a separation finds it."""

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.roundness._harmonics import Harmonics, above_noise
from centering.roundness._polar import draw_circle, draw_profile, polar_axes, polar_scale
from sdpgrind.base import pictures
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, described, part
from sdpgrind.base.results import Result
from sdpgrind.base.units import UM

_PLACES = 16  # chosen: points for each wave of the highest harmonic; a peak between them is 0.5 % higher
_NAMED = 3  # chosen: harmonics named one by one; more fill a line


@described("centering.spindle_error")
class SpindleError(Described, ByValue, Result):
    """Error of the spindle towards the probe, over the spindle angle, the same at each turn.

    Part of a `Separation`; `Profile.correct` takes it off later measurements.

    Parameters
    ----------
    harmonics : Harmonics
        Amplitudes, mm, and phases, rad, from 2 upr on, with their standard deviation: 1 upr looks like an
        eccentric part and is never separated.
    lost : array of int
        Harmonics that may be the part's or the spindle's, upr: 0 in `harmonics`, with their joint amplitude
        in the standard deviation.

    Raises
    ------
    ValueError
        For a harmonic below 2 upr.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile, Harmonics, SpindleError
    >>> spindle = SpindleError(Harmonics([2, 5], [1e-4, 6e-5], [1.9, 0.3]))
    >>> spindle
    SpindleError(0.309 µm from peak to valley, sd 0 µm; 2 upr 0.1 µm, 5 upr 0.06 µm)
    >>> angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
    >>> ball = Profile(angle, 30.0 + spindle.deviation(angle))
    >>> round(ball.correct(spindle).roundness().ron_t, 9)
    0.0
    """

    harmonics: Harmonics = part(Harmonics)
    lost: npt.NDArray[np.int64] = array("", np.int64, finite=False, default_factory=lambda: np.empty(0, int))

    def _check(self) -> None:
        if np.any(self.harmonics.upr < 2):
            raise self._refused("harmonics", "from 2 upr on", float(self.harmonics.upr.min()))

    def deviation(self, angle: npt.ArrayLike) -> Floats:
        """Return the error, mm, of the shape of `angle`: added to the readings, positive outward.

        Parameters
        ----------
        angle : array_like
            Spindle angle, rad.
        """
        return self.harmonics.deviation(angle)

    @cached_property
    def range(self) -> float:
        """Height from valley to peak, mm."""
        return float(np.ptp(self.deviation(self._turn)))

    @property
    def noise_sd(self) -> float:
        """Standard deviation of the error at one angle, mm, lost harmonics included."""
        return float(np.sqrt(np.sum(self.harmonics.sd**2)))

    @property
    def _turn(self) -> Floats:
        places = _PLACES * int(max(self.harmonics.upr.max(initial=0), _PLACES))
        return np.asarray(np.linspace(0.0, 2 * np.pi, places, endpoint=False))

    def plot(self, ax: Any = None) -> Any:
        """Draw the error (µm) about its mean, into polar axes `ax` or a new figure; return the figure.

        Parameters
        ----------
        ax : matplotlib polar axes, optional
            Axes to draw into.
        """
        turn = self._turn
        error = self.deviation(turn)
        scale = polar_scale(error)
        ax = polar_axes(scale, error, ax)
        draw_circle(ax, scale, color=pictures.LIMIT, linewidth=0.9, linestyle="--")
        draw_profile(ax, scale, turn, error, color=pictures.ACTUAL)
        ax.set_title(f"spindle: {UM * self.range:.3g} µm from peak to valley", fontsize=9)
        return ax.figure

    def __repr__(self) -> str:
        seen = above_noise(self.harmonics, _NAMED)
        largest = ", ".join(f"{upr:g} upr {UM * size:.3g} µm" for upr, size in seen) or "nothing above noise"
        lost = f"; {told_lost(self.lost)}" if self.lost.size else ""
        height = f"{UM * self.range:.3g} µm from peak to valley, sd {UM * self.noise_sd:.2g} µm"
        return f"SpindleError({height}; {largest}{lost})"


def told_lost(lost: npt.NDArray[np.int64]) -> str:
    """Words on the harmonics that are lost; "nothing lost" without any."""
    if not lost.size:
        return "nothing lost"
    named = ", ".join(f"{upr}" for upr in lost[:_NAMED])
    return f"lost {named}{f', ... {lost[-1]}' if lost.size > _NAMED else ''} upr"
