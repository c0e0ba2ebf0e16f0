"""Standard deviations of harmonics and of the form, from noise and from the uncertainty of the runout."""

import numpy as np

from centering.roundness._harmonic_fit import (
    HarmonicFit,
    even_harmonics,
    even_values,
    fitted_again,
    value_spread,
    values_at,
)
from centering.roundness._roller import RollerError
from centering.roundness._sampling import even_turn
from sdpgrind.base.checks import Complex, Floats

_PLACES = 16  # chosen: places for each wave of the highest passed harmonic; the sd varies little between


def leaks_of(fit: HarmonicFit, runout: RollerError | None, part_angle: Floats) -> Complex:
    """Derivatives of the harmonics by each value of a removed runout, (3, n + 1); (0, n + 1) without one."""
    columns = runout.derivatives(part_angle).T if runout is not None else np.zeros((0, part_angle.size))
    leaks = [fitted_again(fit, part_angle, column) for column in columns]
    return np.array(leaks, dtype=complex).reshape(len(columns), fit.coef.size)


def amplitude_sd(fit: HarmonicFit, noise_sd: float, leaks: Complex, runout: RollerError | None) -> Floats:
    """Standard deviation of the amplitudes, mm, in the direction of their phases."""
    along = 2 * (leaks * np.exp(-1j * np.angle(fit.coef))).real
    along[:, 0] /= 2
    return np.asarray(np.hypot(noise_sd * fit.amplitude_spread, _spread(along, runout)))


def deviation_sd(
    fit: HarmonicFit, noise_sd: float, leaks: Complex, runout: RollerError | None, passed: Floats, size: int
) -> Floats:
    """Standard deviation of the form on an even turn, mm, with the transmission of each harmonic."""
    passed = np.where(np.arange(passed.size) < 2, 0.0, passed)
    count = np.flatnonzero(passed > 1e-3).max(initial=1) + 1
    turn = even_turn(min(size, _PLACES * int(count)))
    noise = noise_sd * value_spread(fit, passed, turn)
    along = np.array([values_at(leak * passed, turn) for leak in leaks]).reshape(len(leaks), turn.size)
    known = np.hypot(noise, _spread(along, runout))
    return np.asarray(np.interp(even_turn(size), turn, known, period=2 * np.pi))


def averaged_sd(sd: Floats, passed: Floats, noise_sd: float, before: float) -> Floats:
    """Standard deviation of a form that is filtered again: smoothed, at the level of its harmonics.

    `passed` is of the low pass alone: a band takes off the mean of the form, not of its noise.
    """
    if not np.isfinite(noise_sd):
        return np.full(sd.size, np.inf)
    coef = even_harmonics(sd)
    smooth = np.maximum(even_values(coef * np.pad(passed, (0, coef.size))[: coef.size], sd.size), 0.0)
    return np.asarray(smooth * (noise_sd / before if before > 0 else 1.0))


def _spread(along: Floats, runout: RollerError | None) -> Floats:
    """Standard deviation by the covariance of a runout; infinite where that is unknown."""
    if runout is None:
        return np.zeros(along.shape[1])
    if not np.all(np.isfinite(runout.covariance)):
        return np.full(along.shape[1], np.inf)
    variance = np.einsum("ik,ij,jk->k", along, runout.covariance, along)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
