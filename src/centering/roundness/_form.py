"""The form of a profile as harmonics about a centre from the same fit."""

import dataclasses
from math import ceil, inf, pi

import numpy as np

from centering.roundness._certainty import amplitude_sd, deviation_sd, leaks_of
from centering.roundness._harmonic_fit import HarmonicFit, fit_harmonics, values_at
from centering.roundness._roller import RollerError
from centering.roundness._samples import CONDITION_MAX, Samples
from centering.roundness._sampling import even_turn, supported, widest_gap
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.parallel import one_blas_thread

ENOUGH = 10  # chosen: degrees of freedom; fewer give no reliable noise
LEFT = 0.25  # chosen: degrees of freedom over samples from which residuals are noise
_ROUNDS = 10  # chosen: refits about a moved centre, at most
_STILL = 1e-7  # chosen: move over radius that ends them; the error of the centre is its square
_FIRST = 8  # chosen: harmonics of the first fit, which brings the centre near at low cost
_FEWER = (2.0, 1.75, 1.5, 1.25, 1.0)  # chosen: harmonics over the cut-off, tried across a gap
_BRIDGED = 10.0  # chosen: largest condition across a gap, in which noise and other form grow by as much


@dataclasses.dataclass(frozen=True)
class Form:
    """Harmonics about a centre: coefficients (mm) without the first two, sd of amplitudes (mm), origin."""

    coef: Complex
    sd: Floats
    circle: Floats
    noise_sd: float
    part_angle: Floats
    fit: HarmonicFit
    leaks: Complex
    runout: RollerError | None

    def of_noise(self, noise_sd: float) -> "Form":
        """The form with another noise of a reading, mm."""
        sd = amplitude_sd(self.fit, noise_sd, self.leaks, self.runout)
        return dataclasses.replace(self, noise_sd=noise_sd, sd=sd)

    def deviation_sd(self, passed: Floats, size: int) -> Floats:
        """Standard deviation of the form on an even turn, mm, with the transmission of each harmonic."""
        return deviation_sd(self.fit, self.noise_sd, self.leaks, self.runout, passed, size)


def has_residuals(freedom: int, size: int) -> bool:
    """Whether residuals tell the noise better than the upper half of the harmonics does."""
    return freedom >= max(ENOUGH, LEFT * size)


def form_of(samples: Samples, degree: int, asked: str = "upr_max", limit: float = CONDITION_MAX) -> Form:
    """Harmonics 2..degree about the circle without harmonics 0 and 1; `asked`: argument named in errors."""
    with one_blas_thread():
        circle = _settled(samples, min(degree, _FIRST), samples.circle, 1)[2]
        fit, part_angle, circle = _settled(samples, degree, circle, _ROUNDS)
        _refuse_ill(asked, fit.condition, limit, degree, part_angle)
        told = has_residuals(fit.freedom, part_angle.size) and not samples.noise_given
        sure = told or samples.noise_sd is None
        noise = fit.noise_sd if sure and fit.freedom >= ENOUGH else samples.noise_sd or inf
        leaks = leaks_of(fit, samples.runout, part_angle)
        sd = amplitude_sd(fit, noise, leaks, samples.runout)
    coef = fit.coef.copy()
    coef[:2] = 0.0
    return Form(coef, sd, circle, noise, part_angle, fit, leaks, samples.runout)


def _settled(
    samples: Samples, degree: int, circle: Floats, rounds: int
) -> tuple[HarmonicFit, Floats, Floats]:
    """Fit about a settled circle, the part angles used, and the circle."""
    for _ in range(rounds):
        part_angle, deviation = samples.about(circle, samples.tip_radius)
        fit = fit_harmonics(part_angle, deviation, degree)
        if fit.condition > CONDITION_MAX:
            break
        moved = np.array([fit.coef[0].real, 2 * fit.coef[1].real, -2 * fit.coef[1].imag])
        circle = circle + moved
        if np.abs(moved).max() <= _STILL * circle[0]:
            break
    return fit, part_angle, circle


def _refuse_ill(asked: str, condition: float, limit: float, degree: int, part_angle: Floats) -> None:
    if condition > limit:
        gap = widest_gap(part_angle)
        raise ValueError(
            f"{asked} must ask for waves that the samples determine; got {degree} upr with a gap of"
            f" {np.degrees(gap):.3g} degrees (condition of their fit {condition:.3g}, at most {limit:g}):"
            f" up to {supported(gap)} upr are sure"
        )


def broad_form(samples: Samples, cut_off: float, needed: float, most: int) -> Form:
    """Form up to `needed` upr or `most`; across a gap up to as few harmonics as the cut-off requires."""
    sure = min(supported(widest_gap(samples.part_angle)), most)
    if sure >= min(2 * cut_off, most):
        return form_of(samples, max(int(min(needed, sure)), 1), "upr")
    degrees = [min(ceil(share * cut_off), most) for share in _FEWER]
    return form_of(samples, max(_allowed(samples.part_angle, degrees), 1), "upr", _BRIDGED)


def _allowed(part_angle: Floats, degrees: list[int]) -> int:
    """First of falling degrees whose harmonics do not grow in a gap, or the last."""
    for degree in degrees[:-1]:
        if fit_harmonics(part_angle, np.zeros_like(part_angle), degree).condition <= _BRIDGED:
            return degree
    return degrees[-1]


def largest_between(coef: Complex, circle: Floats, tip_radius: float, about: Floats) -> float:
    """Largest distance of a form from an axis minus the tip's radius, between samples too, mm."""
    return extreme_between(coef, circle, tip_radius, about, 1)[1]


def extreme_between(
    coef: Complex, circle: Floats, tip_radius: float, about: Floats, side: int
) -> tuple[float, float]:
    """Part angle (rad) and distance (mm) of the point of a form farthest from an axis; side -1: nearest."""
    size = 16 * max(coef.size, 8)
    part_angle = even_turn(size)
    best = float(part_angle[_highest(side * _distance(coef, circle, tip_radius, about, part_angle))])
    step = 2 * pi / size
    for _ in range(4):  # each round refines the step 16 times
        near = np.asarray(best + step * np.linspace(-1, 1, 33), dtype=float)
        best, step = (
            float(near[np.argmax(side * _distance(coef, circle, tip_radius, about, near))]),
            step / 16,
        )
    return best, float(_distance(coef, circle, tip_radius, about, np.array([best]))[0]) - tip_radius


def _highest(values: Floats) -> int:
    """Index of the highest peak on an even turn, by parabolas: the true top may lie between points."""
    left, right = np.roll(values, 1), np.roll(values, -1)
    bend = 2 * values - left - right
    top = values + np.where(bend > 0, (right - left) ** 2 / (8 * np.where(bend > 0, bend, 1.0)), 0.0)
    return int(np.argmax(np.where((values >= left) & (values >= right), top, -inf)))


def _distance(coef: Complex, circle: Floats, tip_radius: float, about: Floats, part_angle: Floats) -> Floats:
    """Distance of the tip's centre from an axis, mm, on a form at these part angles."""
    far = circle[0] + tip_radius + values_at(coef, part_angle)
    x, y = circle[1:] - about
    return np.asarray(np.hypot(x + far * np.cos(part_angle), y + far * np.sin(part_angle)))
