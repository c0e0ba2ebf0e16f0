"""The form of a profile as harmonics about a centre that comes out of the same fit."""

import dataclasses
from math import inf, pi

import numpy as np

from centering._roundness.filters import PASSED
from centering._roundness.harmonics import HarmonicFit, fit_harmonics, values_at
from centering._roundness.part_frame import into_part
from centering._roundness.runout import Runout
from centering._roundness.sampling import even_turn, supported, widest_gap
from centering._roundness.scan import TOO_BAD, Scan
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.parallel import one_blas_thread

ENOUGH = 10
"""Degrees of freedom: with fewer, what a fit leaves does not tell the noise."""

_ROUNDS = 10
_STILL = 1e-7  # of the radius: the angles that a fit has used are right to as much; the centre itself is to its square
_FIRST = 8  # harmonics
_FEWER = (2.0, 1.5, 1.25, 1.0)  # of the cut-off: harmonics that are tried where samples are missing


@dataclasses.dataclass(frozen=True)
class Form:
    """Harmonics of a scan about a centre: coefficients (mm) without the first two, sd of the amplitudes, what is left (mm)."""

    coef: Complex
    sd: Floats
    circle: Floats
    condition: float
    residual: Floats
    noise_sd: float
    part_angle: Floats


def form_of(scan: Scan, degree: int, asked: str = "upr_max") -> Form:
    """Harmonics 2..degree about the centre and radius that leave no harmonics 0 and 1; `asked` is what asks for so many."""
    with one_blas_thread():
        circle = _settled(scan, min(degree, _FIRST), scan.circle, 1)[2]  # few harmonics bring the centre near at low cost
        fit, part_angle, circle = _settled(scan, degree, circle, _ROUNDS)
        _refuse_ill(asked, fit.condition, degree, part_angle)
        noise = fit.noise_sd if fit.freedom >= ENOUGH else scan.noise_sd or inf
        sd = np.hypot(noise * fit.amplitude_spread, _runout_sd(fit, scan.runout, part_angle))
    coef = fit.coef.copy()
    coef[:2] = 0.0
    return Form(coef, sd, circle, fit.condition, fit.residual, noise, part_angle)


def _settled(scan: Scan, degree: int, circle: Floats, rounds: int) -> tuple[HarmonicFit, Floats, Floats]:
    """The fit about a circle that stays, with the part angles that it has used."""
    for _ in range(rounds):
        part_angle, distance = into_part(scan.angle, scan.reading, scan.tip_radius, circle[1:])
        fit = fit_harmonics(part_angle, distance - scan.tip_radius - circle[0], degree)
        if fit.condition > TOO_BAD:
            break
        moved = np.array([fit.coef[0].real, 2 * fit.coef[1].real, -2 * fit.coef[1].imag])
        circle = circle + moved
        if np.abs(moved).max() <= _STILL * circle[0]:
            break
    return fit, part_angle, circle


def _runout_sd(fit: HarmonicFit, runout: Runout | None, part_angle: Floats) -> Floats:
    """Sd of the amplitudes from what is not known of the runout that was taken off, mm."""
    if runout is None or not np.all(np.isfinite(runout.covariance)):
        return np.zeros(fit.coef.size) if runout is None else np.full(fit.coef.size, np.inf)
    columns = runout.derivatives(part_angle).T
    leaks = np.array([fit_harmonics(part_angle, column, fit.coef.size - 1).coef for column in columns])
    along = 2 * (leaks * np.exp(-1j * np.angle(fit.coef))).real
    along[:, 0] /= 2
    variance = np.einsum("ik,ij,jk->k", along, runout.covariance, along)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _refuse_ill(asked: str, condition: float, degree: int, part_angle: Floats) -> None:
    if condition > TOO_BAD:
        gap = widest_gap(part_angle)
        raise ValueError(
            f"{asked} must leave the samples a condition <= {TOO_BAD:g}; got {condition:.3g} for {degree} upr with a gap of"
            f" {np.degrees(gap):.3g} degrees: {supported(gap)} upr are sure"
        )


def broad_form(scan: Scan, cut_off: float, most: int) -> Form:
    """The form up to five cut-offs or `most`; where samples are missing, as far as the others allow."""
    part_angle = into_part(scan.angle, scan.reading, scan.tip_radius, scan.circle[1:])[0]
    sure = min(supported(widest_gap(part_angle)), most)
    wanted = min(PASSED * int(np.ceil(cut_off)), sure)
    if sure < min(2 * cut_off, most):
        wanted = _allowed(part_angle, [min(int(np.ceil(share * cut_off)), most) for share in _FEWER])
    return form_of(scan, max(wanted, 1), "upr")


def _allowed(part_angle: Floats, degrees: list[int]) -> int:
    """The first of falling degrees that the samples can tell, or the last."""
    for degree in degrees[:-1]:
        if fit_harmonics(part_angle, np.zeros_like(part_angle), degree).condition <= TOO_BAD:
            return degree
    return degrees[-1]


def largest_between(coef: Complex, circle: Floats, tip_radius: float, about: Floats) -> float:
    """Largest distance of a form from an axis, less the tip's radius, between samples too, mm."""
    size = 16 * max(coef.size, 8)
    part_angle = even_turn(size)
    best = float(part_angle[np.argmax(_distance(coef, circle, tip_radius, about, part_angle))])
    step = 2 * pi / size
    for _ in range(4):  # each finds the highest of 33 points between the neighbours of the last
        near = np.asarray(best + step * np.linspace(-1, 1, 33), dtype=float)
        best, step = float(near[np.argmax(_distance(coef, circle, tip_radius, about, near))]), step / 16
    return float(_distance(coef, circle, tip_radius, about, np.array([best]))[0]) - tip_radius


def _distance(coef: Complex, circle: Floats, tip_radius: float, about: Floats, part_angle: Floats) -> Floats:
    far = circle[0] + tip_radius + values_at(coef, part_angle)
    x, y = circle[1:] - about
    return np.asarray(np.hypot(x + far * np.cos(part_angle), y + far * np.sin(part_angle)))
