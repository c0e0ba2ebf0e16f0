"""Undulations of a part that excite a grinder's resonance or stay in step with its wheel; free speeds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor, hypot, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats

# derived: sqrt(2 ln 1000), the amplitude of noise over its sd (Rayleigh) that is exceeded once in 1000
_NOISE_FACTOR = 3.717
_DAMPING_MAX = 0.35  # chosen: a half-power band exists up to sin(pi/8) = 0.383, very wide above this
_PER_TURN = 2 * pi


class ChatterBand(NamedTuple):
    """Rotations of the work at which an undulation meets a resonance or a multiple of the wheel's rotation.

    Attributes
    ----------
    cause : str
        Name of the resonance, or "wheel".
    order : int
        Waves per turn of the wheel; 0: a resonance.
    upr : float
        Undulation, unit 1.
    amplitude : float
        Amplitude of the undulation, mm.
    low, high : float
        Ends of the band, rad/s.
    center : float
        Rotation of exact coincidence, rad/s.
    gain : float
        Greatest gain within the speed error at the work's rotation, unit 1. Resonance: dynamic over static
        deflection. Wheel: share of its waves that adds up on the undulation, 0 from half a wave away.
    """

    cause: str
    order: int
    upr: float
    amplitude: float
    low: float
    high: float
    center: float
    gain: float

    def __str__(self) -> str:
        what = f"{self.upr:g} upr of {1e3 * self.amplitude:.3g} µm"
        if self.order:
            waves = f"{self.order} waves a turn of the wheel"
            return f"{what} in step with {waves}: up to {100 * self.gain:.0f} % of them add up"
        return f"{what} at the {self.cause}, which magnifies up to {self.gain:.3g} times"


@dataclass(frozen=True, eq=False, repr=False)
class ChatterCheck:
    """Result of `chatter_check`.

    Attributes
    ----------
    bands : tuple of ChatterBand
        All bands within reach of the work's rotation, rad/s.
    work_rotation, wheel_rotation : float
        Rotations of the check, rad/s.
    speeds : (float, float)
        Checked range of the work's rotation, rad/s.
    upr, amplitude : array, shape (n,)
        Harmonics: unit 1, and mm.
    counted : array of bool, shape (n,)
        Undulations large enough to count.
    """

    bands: tuple[ChatterBand, ...]
    work_rotation: float
    wheel_rotation: float
    speeds: tuple[float, float]
    upr: Floats
    amplitude: Floats
    counted: checks.Bools

    @property
    def found(self) -> tuple[ChatterBand, ...]:
        """Bands at the work's rotation (rad/s), by falling product of amplitude and gain."""
        met = [band for band in self.bands if band.low < self.work_rotation < band.high]
        return tuple(sorted(met, key=lambda band: -band.amplitude * band.gain))

    @property
    def ok(self) -> bool:
        """Whether no band contains the work's rotation."""
        return not self.found

    @property
    def free(self) -> tuple[tuple[float, float], ...]:
        """Ranges of the work's rotation without bands, rad/s, rising."""
        low, gaps = self.speeds[0], []
        for band in sorted(self.bands, key=lambda band: band.low):
            if band.low > low:
                gaps.append((low, min(band.low, self.speeds[1])))
            low = max(low, band.high)
        if low < self.speeds[1]:
            gaps.append((low, self.speeds[1]))
        return tuple(gap for gap in gaps if gap[0] < self.speeds[1])

    @property
    def nearest(self) -> tuple[float, ...]:
        """Nearest free rotations of the work, rad/s: its own if free, else at most one on each side."""
        if self.ok:
            return (self.work_rotation,)
        below = [high for _, high in self.free if high <= self.work_rotation]
        above = [low for low, _ in self.free if low >= self.work_rotation]
        return tuple(sorted([*below[-1:], *above[:1]], key=lambda speed: abs(speed - self.work_rotation)))

    def plot(self) -> Any:
        """Draw the spectrum (µm) with its bands, and the free rotations (rev/min); return the figure."""
        return pictures.drawn("centering.setup._chatter_picture:plot", self)

    def __repr__(self) -> str:
        at = f"at {self.work_rotation * 60 / _PER_TURN:.4g} rev/min"
        if self.ok:
            return f"ChatterCheck({at} nothing is met)"
        away = " or ".join(f"{speed * 60 / _PER_TURN:.4g}" for speed in self.nearest)
        advice = f"free: {away} rev/min" if away else "no rotation in reach is free"
        return f"ChatterCheck({at} {'; '.join(map(str, self.found))}; {advice})"


def chatter_check(
    spectrum: Any,
    *,
    wheel_rotation: float,
    work_rotation: float,
    resonances: Mapping[str, float],
    damping: float | Mapping[str, float] = 0.03,
    amplitude_min: float = 1e-4,
    wheel_orders: int = 3,
    turns: int = 10,
    reach: float = 0.2,
    speed_error: float = 0.005,
) -> ChatterCheck:
    """Find undulations of a part that meet a resonance or waves of the wheel, and rotations free of them.

    An undulation of n upr on a part that turns at Omega modulates the depth of cut, and with it the force, at
    ``n Omega``.

    * Resonance. A mode of natural frequency w and damping ratio z responds with ``1/sqrt((1 - r^2)^2 + (2 z
      r)^2)`` of the static deflection, r = n Omega/w. An undulation counts in the half-power band ``r^2 = 1 -
      2 z^2 +- 2 z sqrt(1 - z^2)``.
    * Wheel. Waves of the wheel, m per turn, act on the part as ``m q`` upr with the ratio ``q =
      wheel_rotation/work_rotation``. From turn to turn of the part they shift by the distance s of ``m q``
      from a whole number. At s = 0 they hit the same places each turn and grind the undulation n = m q in
      instead of away. Over N turns the share ``|sin(pi N s)/(N sin(pi s))|`` of the waves adds up on the
      nearest undulation; it counts where ``N |n - m q| < 1/2`` within the speed error, where more than 2/pi =
      64 % may add up.

    Modes are linear, with the frequencies of wheel and part in contact; amplitudes are those of the part as
    it arrives. Stability of the cut (regenerative chatter) is not checked; it needs the stiffness of cut and
    contact.

    Parameters
    ----------
    spectrum : Harmonics
        Spectrum of the part: any object with arrays ``upr`` (unit 1) and ``amplitude`` (mm); with ``sd``
        (mm), amplitudes that noise exceeds once in 1000 do not count.
    wheel_rotation, work_rotation : float
        Rotations, rad/s.
    resonances : mapping of str to float
        Natural frequencies by name, rad/s; may be empty.
    damping : float or mapping of str to float
        Damping ratios, unit 1, within 0 and 0.35; one for all or by name.
    amplitude_min : float
        Least amplitude that counts, mm.
    wheel_orders : int
        Greatest number of waves per turn of the wheel; 1: out of balance or out of round.
    turns : int
        Turns of the part over which waves of the wheel add up.
    reach : float
        Possible relative change of the work's rotation, within 0 and 1, unit 1.
    speed_error : float
        Relative error of the speeds, unit 1: widens each band; gains are the greatest within it.

    Returns
    -------
    ChatterCheck
        Bands and free rotations of the work in rad/s.

    Raises
    ------
    ValueError, TypeError
        For a speed or frequency that is not > 0, damping out of range, or a spectrum without its arrays.

    Examples
    --------
    The part of Mears, Table 6.5, turning at 300 rev/min on a grinder that rings at 218 Hz:

    >>> from types import SimpleNamespace
    >>> from sdpgrind import units
    >>> form = SimpleNamespace(upr=[2, 3, 43], amplitude=[0.155e-3, 0.206e-3, 0.235e-3])
    >>> speeds = {"wheel_rotation": units.rpm(4210), "work_rotation": units.rpm(300)}
    >>> check = chatter_check(form, **speeds, resonances={"head": units.hz(218)})
    >>> print(*check.found)
    43 upr of 0.235 µm at the head, which magnifies up to 16.1 times
    >>> [round(speed / units.rpm(1), 1) for speed in check.nearest]  # rev/min
    [291.9, 314.5]
    """
    wheel = checks.positive("wheel_rotation", wheel_rotation, "rad/s")
    work = checks.positive("work_rotation", work_rotation, "rad/s")
    upr, amplitude, counted = _undulations(spectrum, checks.nonnegative("amplitude_min", amplitude_min, "mm"))
    part = 1 - checks.within("reach", reach, 1e-3, 0.99, "1")
    error = checks.within("speed_error", speed_error, 0.0, 0.1, "1")
    speeds = (work * part, work * (2 - part))
    modes = _modes(resonances, damping)
    orders, turns = checks.count("wheel_orders", wheel_orders, 0), checks.count("turns", turns)
    near, bands = (work / (1 + error), work / (1 - error)), []
    for n, size in zip(upr[counted].tolist(), amplitude[counted].tolist(), strict=True):
        bands += [_resonance_band(name, w, z, n, size, near) for name, (w, z) in modes.items()]
        bands += list(_wheel_bands(wheel, n, size, near, orders, turns, speeds))
    wider = [band._replace(low=band.low * (1 - error), high=band.high * (1 + error)) for band in bands]
    reached = tuple(band for band in wider if band.low < speeds[1] and band.high > speeds[0])
    return ChatterCheck(reached, work, wheel, speeds, upr, amplitude, counted)


def _undulations(spectrum: Any, least: float) -> tuple[Floats, Floats, checks.Bools]:
    """Undulations, their amplitudes, and a mask of those that count."""
    if not all(hasattr(spectrum, name) for name in ("upr", "amplitude")):
        raise TypeError(
            "spectrum must have arrays upr and amplitude, as Profile.harmonics gives;"
            f" got {checks.shown(spectrum)}"
        )
    upr = checks.finite_array("upr", spectrum.upr, "1")
    amplitude = checks.finite_array("amplitude", spectrum.amplitude, "mm")
    if upr.ndim != 1 or amplitude.shape != upr.shape:
        raise ValueError(
            "upr and amplitude must be one-dimensional and of one length;"
            f" got {upr.shape} and {amplitude.shape}"
        )
    sd = np.broadcast_to(np.asarray(getattr(spectrum, "sd", 0.0), dtype=float), upr.shape)
    noise = _NOISE_FACTOR * np.where(np.isfinite(sd), sd, 0.0)
    return upr, amplitude, (upr > 1) & (amplitude > np.maximum(least, noise))


def _modes(
    resonances: Mapping[str, float], damping: float | Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """Natural frequency and damping ratio of each mode."""
    if not isinstance(resonances, Mapping):
        raise TypeError(
            "resonances must be a mapping of names to natural frequencies (rad/s);"
            f" got {checks.shown(resonances)}"
        )
    ratios = damping if isinstance(damping, Mapping) else dict.fromkeys(resonances, damping)
    for name in resonances:
        checks.one_of("names of damping", name, ratios)
    return {
        name: (
            checks.positive(name, w, "rad/s"),
            checks.within(f"damping of {name}", ratios[name], 1e-6, _DAMPING_MAX, "1"),
        )
        for name, w in resonances.items()
    }


def _resonance_band(
    name: str, w: float, damping: float, upr: float, amplitude: float, work: tuple[float, float]
) -> ChatterBand:
    """Half-power band of a mode in rotations of the work; gain at the rotation in `work` nearest its peak."""
    middle, half = 1 - 2 * damping**2, 2 * damping * sqrt(1 - damping**2)
    low, high = ((upr * speed / w) ** 2 for speed in work)
    ratio = min(max(middle, low), high)
    gain = 1 / hypot(1 - ratio, 2 * damping * sqrt(ratio))
    lowest, highest, center = (sqrt(square) * w / upr for square in (middle - half, middle + half, middle))
    return ChatterBand(name, 0, upr, amplitude, lowest, highest, center, gain)


def _wheel_bands(
    wheel: float,
    upr: float,
    amplitude: float,
    work: tuple[float, float],
    orders: int,
    turns: int,
    speeds: Sequence[float],
) -> Iterator[ChatterBand]:
    """Bands of rotations of the work in which waves of the wheel stay on an undulation."""
    last = min(orders, ceil(upr * speeds[1] / wheel))
    for order in range(max(1, floor(upr * speeds[0] / wheel)), last + 1):
        fewest, most = (order * wheel / speed for speed in reversed(work))
        shift = max(fewest - upr, upr - most, 0.0)
        low, high = (order * wheel / (upr + side * 0.5 / turns) for side in (1, -1))
        yield ChatterBand(
            "wheel", order, upr, amplitude, low, high, order * wheel / upr, _coherent_share(shift, turns)
        )


def _coherent_share(shift: float, turns: int) -> float:
    """Share of waves that adds up over `turns` turns with a shift per turn; 0 from half a wave on."""
    if shift < 1e-12:
        return 1.0
    return abs(sin(pi * turns * shift) / (turns * sin(pi * shift))) if shift < 0.5 else 0.0
