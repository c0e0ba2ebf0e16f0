"""Friction from peak force and free slide of a push by the source's formulas for its heaviest part."""

import warnings
from math import sqrt

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, flag, quantity
from sdpgrind.identify import Estimate

MASS = 18.9  # kg; source: Mears (2006), chapter 6, part that his formulas are fitted to
SENSOR_RANGE = 446.0  # N; source: Mears (2006), range of his force sensor
WEIGHTS = ("sensitivity", "minimum_variance")

_MASS_BAND = 0.1  # chosen: relative; parts of other masses have other formulas
_PER_MINUTE = 60.0  # mm/min of a mm/s; derived from the units
_MICRONS = 1e3  # µm of a mm; derived from the units
_FORCE_OFFSET = 14.1  # N; source: Mears (6.1)
_FORCE_OF_SPEED = 0.0529  # N min/mm; source: Mears (6.5)
_FORCE_OF_FRICTION = 146.2  # N; source: Mears (6.5)
_SLOWEST = 500.0  # mm/min; chosen: at rest (6.5) gives 146.2 mu_static, physics 185 mu_static
_MU_0 = 0.3415  # source: Mears (6.9)
_C_1, _K_1 = 0.00041, 1.8997  # µm (min/mm)^k_1; source: Mears (6.8)
_C_2, _K_2 = 0.07379, 1.6428  # µm (min/mm)^k_2; source: Mears (6.8)
_FORCE_PER_SLIDE = 0.0062  # N/µm at 5000 mm/min; source: Mears (6.15)


@described()
class PrintedFriction(Described):
    """The source's friction estimators, Mears (6.1)-(6.15): regressions for a part of 18.9 kg.

    They take mu_kinetic = 0.75 mu_static and know no scatter. `FrictionEstimator` serves any part and any
    push.

    Parameters
    ----------
    mass : float
        Mass of the part, kg.
    any_mass : bool
        Allow a mass other than 18.9 kg +- 10 %, for which the formulas are wrong; a warning says so.

    Raises
    ------
    ValueError
        For another mass without `any_mass`.

    Examples
    --------
    The dry part of Table 6.3, pushed at 5000 mm/min:

    >>> from sdpgrind import units
    >>> printed, speed = PrintedFriction(), units.mm_per_min(5000.0)
    >>> round(printed.from_force(283.9, speed), 4), round(printed.from_slide(8.175, speed), 4)
    (0.1327, 0.1334)
    >>> round(printed.combine(283.9, 8.175, speed)["mu_static"], 4)
    0.1331
    """

    mass: float = quantity("kg", above=0, default=MASS)
    any_mass: bool = flag(default=False)

    def _check(self) -> None:
        if abs(self.mass - MASS) <= _MASS_BAND * MASS:
            return
        if not self.any_mass:
            rule = f"{MASS:g} +- 10 %, as the printed formulas hold for no other without any_mass=True"
            raise self._refused("mass", rule)
        warnings.warn(
            f"the printed formulas are those of a part of {MASS:g} kg; this one has {self.mass:g} kg",
            stacklevel=4,
        )

    def corrected_force(self, peak_force: float) -> float:
        """Return the peak force of the source's model, N, Mears (6.1).

        The source's Table 6.2 uses forces without this correction; so do the other formulas.

        Parameters
        ----------
        peak_force : float
            Observed peak force, N.

        Raises
        ------
        ValueError
            For a force outside 0 to 446 N, the range of the sensor.
        """
        return _force(peak_force) + _FORCE_OFFSET

    def peak_force(self, mu_static: float, push_speed: float) -> float:
        """Return the peak force of a push at constant speed, N, Mears (6.5).

        Parameters
        ----------
        mu_static, push_speed : float
            Coefficient of friction at rest, dimensionless; push speed, mm/s, at least 8.33 (500 mm/min).

        Raises
        ------
        ValueError
            For a slower push: at rest the formula gives 146.2 mu_static, physics 185 mu_static.
        """
        return _FORCE_OF_SPEED * _fast(push_speed) + _FORCE_OF_FRICTION * checks.positive(
            "mu_static", mu_static, "1"
        )

    def from_force(self, peak_force: float, push_speed: float) -> float:
        """Return mu_static from the peak force of a push at constant speed, dimensionless, Mears (6.6).

        Parameters
        ----------
        peak_force, push_speed : float
            Observed peak force, N, from 3.174 N s/mm times the speed up to 446 N; speed, mm/s, at least 8.33.

        Raises
        ------
        ValueError
            For a slower push, or a force that no friction >= 0 explains or the sensor does not read.
        """
        least = _FORCE_OF_SPEED * _fast(push_speed)
        if _force(peak_force) < least:
            raise checks.refuse(
                "peak_force", f">= {least:.6g}, else mu_static is below 0", float(peak_force), "N"
            )
        return (float(peak_force) - least) / _FORCE_OF_FRICTION

    def free_slide(self, mu_static: float, push_speed: float) -> float:
        """Return the free slide of the part, mm, Mears (6.7)-(6.9).

        Parameters
        ----------
        mu_static, push_speed : float
            Coefficient of friction at rest, dimensionless, up to 0.3415; push speed, mm/s.

        Raises
        ------
        ValueError
            For a friction beyond the minimum of the parabola, or a speed that is not > 0.
        """
        low, scale = _parabola(push_speed)
        mu = checks.within("mu_static", mu_static, 0.0, _MU_0, "1")
        return (low + scale * (mu - _MU_0) ** 2) / _MICRONS

    def slide_range(self, push_speed: float) -> tuple[float, float]:
        """Return the least and the greatest invertible free slide, mm: those of mu_static 0.3415 and 0.

        Parameters
        ----------
        push_speed : float
            Push speed, mm/s.

        Raises
        ------
        ValueError
            For a speed that is not > 0.
        """
        low, scale = _parabola(push_speed)
        return low / _MICRONS, (low + scale * _MU_0**2) / _MICRONS

    def from_slide(self, free_slide: float, push_speed: float) -> float:
        """Return mu_static from the free slide, dimensionless, Mears (6.10) and (6.11).

        Parameters
        ----------
        free_slide, push_speed : float
            Free slide, mm, within `slide_range`; push speed, mm/s.

        Raises
        ------
        ValueError
            For a slide outside `slide_range`.
        """
        least, most = self.slide_range(push_speed)
        slide = checks.number("free_slide", free_slide, "mm")
        if not least <= slide <= most:
            speed = f"{float(push_speed):.6g} mm/s"
            rule = f"in [{least:.6g}, {most:.6g}], where Mears (6.10) has a solution at {speed}"
            raise checks.refuse("free_slide", rule, slide, "mm")
        low, scale = _parabola(push_speed)
        return _MU_0 - sqrt(max(slide * _MICRONS - low, 0.0) / scale)

    @property
    def force_sensitivity(self) -> float:
        """Slope of the peak force over mu_static, N, Mears (6.13)."""
        return _FORCE_OF_FRICTION

    def slide_sensitivity(self, mu_static: float, push_speed: float) -> float:
        """Return the magnitude of the slope of the free slide over mu_static, mm, Mears (6.14).

        The source's constant term mu_0^2 should be A mu_0^2; the slope is right.

        Parameters
        ----------
        mu_static, push_speed : float
            Coefficient of friction at rest, dimensionless, up to 0.3415; push speed, mm/s.

        Raises
        ------
        ValueError
            As `free_slide`.
        """
        mu = checks.within("mu_static", mu_static, 0.0, _MU_0, "1")
        return 2.0 * _parabola(push_speed)[1] * (_MU_0 - mu) / _MICRONS

    def combine(
        self,
        peak_force: float,
        free_slide: float,
        push_speed: float,
        *,
        weights: str = "sensitivity",
        force_sd: float = 1.0,
        slide_sd: float = 0.05,
    ) -> Estimate:
        """Return mu_static from force and slide together.

        Parameters
        ----------
        peak_force, free_slide, push_speed : float
            Of a push, N, mm, mm/s.
        weights : {"sensitivity", "minimum_variance"}
            Slopes g_i, Mears (6.12), with the slide's turned into a force by the ratio (6.15), which the
            source gives for 5000 mm/min only; or g_i^2/sd_i^2, of least variance.
        force_sd, slide_sd : float
            Standard deviations of force (N) and slide (mm), from which the variance of the result follows.

        Returns
        -------
        Estimate
            Of ``mu_static``.

        Raises
        ------
        ValueError
            As `from_force` and `from_slide`, for another word, or for a standard deviation that is not > 0.

        Examples
        --------
        >>> best = PrintedFriction().combine(283.9, 8.175, 83.33, weights="minimum_variance")
        >>> round(best["mu_static"], 4), round(float(best.sd[0]), 4)
        (0.1334, 0.0013)
        """
        checks.one_of("weights", weights, WEIGHTS)
        noise = np.array(
            [checks.positive("force_sd", force_sd, "N"), checks.positive("slide_sd", slide_sd, "mm")]
        )
        found = np.array([self.from_force(peak_force, push_speed), self.from_slide(free_slide, push_speed)])
        slopes = np.array([self.force_sensitivity, self.slide_sensitivity(found[1], push_speed)])
        share = (
            (slopes / noise) ** 2
            if weights == "minimum_variance"
            else slopes * [1.0, _FORCE_PER_SLIDE * _MICRONS]
        )
        share = share / share.sum()
        variance = (
            float(np.sum((share * noise) ** 2 / slopes**2))
            if slopes[1] > 0
            else float((noise[0] / slopes[0]) ** 2)
        )
        return Estimate(("mu_static",), np.array([share @ found]), np.array([[variance]]), units=("1",))


def _force(peak_force: object) -> float:
    """Check a force of the sensor."""
    return checks.within("peak_force", peak_force, 0.0, SENSOR_RANGE, "N")


def _fast(push_speed: object) -> float:
    """Checked speed in mm/min, within the range of the force formula."""
    speed = checks.positive("push_speed", push_speed, "mm/s") * _PER_MINUTE
    if speed < _SLOWEST * (1.0 - 1e-12):
        raise checks.refuse(
            "push_speed", f">= {_SLOWEST / _PER_MINUTE:.6g} (500 mm/min)", speed / _PER_MINUTE, "mm/s"
        )
    return speed


def _parabola(push_speed: object) -> tuple[float, float]:
    """Minimum and opening of the parabola, both µm, Mears (6.8)."""
    speed = checks.positive("push_speed", push_speed, "mm/s") * _PER_MINUTE
    return _C_1 * speed**_K_1, _C_2 * speed**_K_2
