"""Goodness of the fit of a machine: squares against the declared noise, order of the residuals."""

import dataclasses

from scipy.special import chdtri

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify.machine_fit import ChannelNoise, MachineFit

FITS = (0.8, 1.25)  # chosen: squares over the declared ones; 300 readings scatter by 8 %
CHANNELS = ("size", "power")
_RARELY = 1e-3  # chosen: probability by which noise alone leaves the range, or makes such an order
_UNITS = {"size": "mm", "power": "of the power"}


def goodness(fit: MachineFit, freedom: tuple[float, float], declared: ChannelNoise) -> dict[str, float]:
    """Return the numbers of `MachineEstimate.fit`."""
    found: dict[str, float] = {}
    slopes = dataclasses.replace(fit, noise=ChannelNoise(fit.noise.sd), there=None).slopes_there()
    each = zip(CHANNELS, fit.apart(), freedom, fit.masks(), strict=True)
    for k, (name, off, free, rows) in enumerate(each):
        variance = float(off @ off) / free * fit.noise.sd[k] ** 2
        found[f"{name}_chi_square"] = variance / declared.sd[k] ** 2
        found[f"{name}_autocorrelation"], found[f"{name}_autocorrelation_p"] = _order(off, slopes[rows])
        found[f"{name}_sd"] = variance**0.5
    return found


def _order(off: Floats, slopes: Floats) -> tuple[float, float]:
    """Autocorrelation of neighbours, and the probability of as much either way by chance."""
    square = float(off @ off)
    alike = float(off[1:] @ off[:-1]) / square if square > 0.0 else 0.0
    _, lesser = serial.durbin_watson(off, slopes)
    return alike, 2.0 * min(lesser, 1.0 - lesser)


def misfit(
    found: dict[str, float],
    effective: list[float],
    declared: ChannelNoise,
    is_declared: tuple[bool, bool],
    rounded: float,
) -> list[str]:
    """Return a sentence for each channel that the model fits badly, or too well for its noise.

    `effective` are the independent residuals of size and power. `rounded` is the most that readings kept by
    the gauge add to the square of the size; their rounding may as well be none.
    """
    told = []
    for k, name in enumerate(CHANNELS):
        low, high = _range(effective[k])
        if k == 0 and rounded > 0.0:
            low, high = 0.0, high + rounded
        square = found[f"{name}_chi_square"]
        if square > high or (is_declared[k] and square < low):
            words = f"chi^2/dof of {name} must be {FITS[0]:g} ... {FITS[1]:g}; got {square:.3g}"
            told.append(f"{words}{_cause(name, found, declared.sd[k])}")
    return told


def _range(freedom: float) -> tuple[float, float]:
    """Range of the square, widened for few readings by what chance makes."""
    low, high = (float(chdtri(freedom, share)) / freedom for share in (1 - _RARELY / 2, _RARELY / 2))
    return min(FITS[0], low), max(FITS[1], high)


def _cause(name: str, found: dict[str, float], declared: float) -> str:
    """What is probably wrong: the declared noise where the residuals have no order, else the model."""
    if found[f"{name}_autocorrelation_p"] < _RARELY:
        alike = found[f"{name}_autocorrelation"]
        return (
            f", and its residuals follow each other (correlation {alike:.2f}): the model does not follow the"
            " data, or the gauge filters; plot() shows the residuals"
        )
    return f": its noise is {found[f'{name}_sd']:.3g} {_UNITS[name]}, declared are {declared:.3g} ({name}_sd)"
