"""Harmonics of a part's form: amplitude and phase of undulations per revolution, with their uncertainty."""

from math import sqrt
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from centering.roundness._harmonic_fit import values_at
from centering.roundness._harmonic_limits import (
    Exceeded,
    LimitDecision,
    Limits,
    decision,
    exceeded,
    least_limits,
    limits_of,
    refuse_unmeasured,
)
from centering.roundness._roller import SEEN
from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, custom, described, flag, quantity
from sdpgrind.base.results import Result


@described("centering.spectrum")
class Harmonics(Described, ByValue, Result):
    """Amplitude and phase of each undulation: ``deviation = sum amplitude cos(upr part_angle - phase)``.

    Parameters
    ----------
    upr, amplitude, phase : array, shape (n,)
        Undulations per revolution, unit 1, half their height from valley to peak, mm, and phase in the angle
        about the part's centre, rad.
    sd : array, shape (n,), optional
        Standard deviation of the amplitudes, mm; infinite where samples are as few as harmonics. Default: 0.
    nyquist : float, optional
        Half of the points of one turn, upr: the limit of the harmonics. Default: the highest `upr`.
    limits : mapping, optional
        Largest amplitudes, mm: of a band of harmonics as ``{(2, 15): 0.0005}``, or of one, ``{42: 5e-5}``.
    as_range : bool
        Whether `limits` and tables are of the height from valley to peak, twice the amplitude.

    Raises
    ------
    ValueError
        When the lengths differ, an amplitude is negative or an undulation is not above 0; for a limit of a
        harmonic that was not measured.

    Examples
    --------
    >>> form = Harmonics([2, 3], [0.155e-3, 0.206e-3], [0.0, 1.0])
    >>> float(round(form.rms * 1e3, 4)), float(round(form.bound * 1e3, 3))
    (0.1823, 0.722)
    >>> form
    Harmonics(3 upr 0.206 µm, 2 upr 0.155 µm; rms 0.182 µm)
    >>> [(row.upr, row.limit) for row in form.replace(limits={(2, 3): 0.2e-3}).exceeds]
    [(3, 0.0002)]
    """

    upr: Floats = array("1")
    amplitude: Floats = array("mm")
    phase: Floats = array("rad")
    sd: Floats = array("mm", finite=False, default_factory=lambda: np.zeros(0))
    nyquist: float = quantity("upr", at_least=0, default=0.0)
    limits: Limits = custom(limits_of, unit="mm", default=())
    as_range: bool = flag(default=False)

    def _check(self) -> None:
        if not self.sd.size:
            object.__setattr__(self, "sd", lasting(np.zeros_like(self.upr)))
        for name in ("upr", "amplitude", "phase", "sd"):
            if (shape := getattr(self, name).shape) != (self.upr.size,):
                raise ValueError(
                    f"{name} must be one-dimensional with {self.upr.size} entries; got shape {shape}"
                )
        if np.any(self.upr <= 0):
            raise self._refused("upr", "> 0", float(self.upr.min()))
        if np.any(self.amplitude < 0):
            raise self._refused("amplitude", ">= 0", float(self.amplitude.min()))
        object.__setattr__(self, "nyquist", self.nyquist or float(self.upr.max(initial=0.0)))
        refuse_unmeasured(self.limits, self.upr)

    @property
    def crest(self) -> Floats:
        """Direction of the first crest of each undulation in the part angle, (n,), rad, in [0, 2 pi/upr)."""
        step = 2 * np.pi / self.upr
        return np.asarray(np.mod(np.mod(self.phase, 2 * np.pi) / self.upr, step))

    @property
    def exceeds(self) -> tuple[Exceeded, ...]:
        """Harmonics above their limits, in mm, with how far they are above them in standard deviations."""
        sizes = self._scale * self.amplitude, self._scale * self.sd
        return exceeded(self.limits, self.upr, *sizes)

    @property
    def decisions(self) -> tuple[LimitDecision, ...]:
        """Whether each limit is kept by the 95 % interval of the size (mm): `found`; as text a sentence."""
        sizes = self._scale * self.amplitude, self._scale * self.sd
        name = "range" if self.as_range else "amplitude"
        return tuple(decision(limit, self.upr, *sizes, name) for limit in self.limits)

    @property
    def _scale(self) -> float:
        return 2.0 if self.as_range else 1.0

    def to_dataframe(self) -> pd.DataFrame:
        """Return a table of undulations: amplitude (or range), sd and limit in mm, phase and crest in rad.

        Returns
        -------
        pandas.DataFrame
            A row for each of `upr`; with `limits` a column of the least limit of each, NaN without one.

        Examples
        --------
        >>> table = Harmonics([2, 3], [0.155e-3, 0.206e-3], [0.0, 1.5]).to_dataframe()
        >>> list(table.columns), float(table.loc[3, "crest"])
        (['amplitude', 'phase', 'crest', 'sd'], 0.5)
        """
        columns = {
            "range" if self.as_range else "amplitude": self._scale * self.amplitude,
            "phase": self.phase,
            "crest": self.crest,
            "sd": self._scale * self.sd,
        }
        if self.limits:
            columns["limit"] = least_limits(self.limits, self.upr)
        return pd.DataFrame(columns, index=pd.Index(self.upr, name="upr"))

    @property
    def rms(self) -> float:
        """Root mean square of the form, mm."""
        return sqrt(float(self.amplitude @ self.amplitude) / 2)

    @property
    def bound(self) -> float:
        """Greatest height from valley to peak of these amplitudes with any phases, mm."""
        return 2 * float(self.amplitude.sum())

    def deviation(self, part_angle: npt.ArrayLike) -> Floats:
        """Return the form, mm, of the shape of `part_angle`.

        Parameters
        ----------
        part_angle : array_like
            Angle about the part's centre, rad.
        """
        angle = checks.finite_array("part_angle", part_angle, "rad")
        whole = self.upr.astype(int)
        if not np.array_equal(whole, self.upr):
            waves = np.cos(np.multiply.outer(angle, self.upr) - self.phase) @ self.amplitude
            return np.asarray(waves)
        coef = np.zeros(int(whole.max(initial=0)) + 1, dtype=complex)
        np.add.at(coef, whole, self.amplitude / 2 * np.exp(-1j * self.phase))
        return values_at(coef, angle.ravel()).reshape(angle.shape)

    def largest(self, count: int = 10) -> list[tuple[float, float]]:
        """Return the largest undulations, falling: pairs of upr and amplitude in mm, as in Mears, Table 6.5.

        Parameters
        ----------
        count : int
            Largest number of pairs.
        """
        order = np.argsort(-self.amplitude, kind="stable")[: checks.count("count", count)]
        return [(float(self.upr[k]), float(self.amplitude[k])) for k in order]

    def plot(self, ax: Any = None) -> Any:
        """Draw the amplitudes (µm) over upr, into the axes `ax` or a new figure; return the figure.

        The largest above the noise are named. The grey range is the amplitude that noise alone exceeds in one
        of 20 undulations. Limits are red lines.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into.
        """
        if ax is None:
            ax = pictures.axes_of(7, 3.5)
        sd = np.where(np.isfinite(self.sd), self.sd, 0.0)
        ax.fill_between(self.upr, 0, 1e3 * SEEN * sd, color="0.82", lw=0, step="mid")
        ax.vlines(self.upr, 0, 1e3 * self.amplitude, color="#2a6f97", lw=1.4)
        for upr, amplitude in above_noise(self, _NAMED):
            ax.annotate(f"{upr:g}", (upr, 1e3 * amplitude), (0, 2), **_NUMBER)
        for low, high, most in self.limits:
            ends = (low - 0.4, high + 0.4)
            ax.hlines(1e3 * most / self._scale, *ends, color=pictures.LIMIT, lw=1.2)
        ax.set(
            xlabel="undulations per revolution [upr]",
            ylabel="amplitude [µm]",
            xlim=(0, self.upr.max(initial=1) + 1),
        )
        ax.margins(y=0.12)
        ax.set_ylim(0, None)
        return ax.figure

    def __repr__(self) -> str:
        shown = ", ".join(f"{upr:g} upr {1e3 * amplitude:.3g} µm" for upr, amplitude in self.largest(_NAMED))
        above = f"; {len(self.exceeds)} above their limits" if self.exceeds else ""
        return f"Harmonics({shown}; rms {1e3 * self.rms:.3g} µm{above})"


def above_noise(spectrum: Harmonics, count: int) -> list[tuple[float, float]]:
    """Return the largest undulations (upr, mm) that are above the greatest amplitude of noise, falling."""
    highest = dict(zip(spectrum.upr.tolist(), noise_height(spectrum.sd).tolist(), strict=True))
    return [(upr, size) for upr, size in spectrum.largest(count) if size > highest[upr]]


def noise_height(sd: Floats) -> Floats:
    """Return the amplitude (mm) that the greatest of noise alone exceeds in one of 20 (sd in mm)."""
    above = np.sqrt(2 * np.log(max(sd.size, 1) / _CHANCE))  # of the greatest Rayleigh amplitude
    return np.asarray(above * sd)


_CHANCE = 0.05  # chosen: share of profiles in which noise alone is named
_NAMED = 5  # chosen: labelled waves; more would overlap
_NUMBER: dict[str, Any] = {
    "textcoords": "offset points",
    "ha": "center",
    "fontsize": 8,
    "bbox": {"facecolor": "w", "edgecolor": "none", "alpha": 0.8, "pad": 0.3},
}
