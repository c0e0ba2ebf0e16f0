"""Cylindrical plunge grinding at the greatest rate without burning, with a dulling wheel."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from math import inf, pi
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from sdpgrind import physics
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, flag, part, quantity, valued
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.locus._problem.process import Varying
from sdpgrind.locus.processes._roughness import Roughness

FASTEST_INFEED = 1.0  # chosen: mm/s; a greater infeed rate is in another unit
RPM_LIKE = 5.0  # chosen: least ratio of wheel speed to work speed; below it the rotation is in rev/min


def _published() -> physics.BurningLimit:
    """Return Malkin's coefficients to the two digits of Koren's nominal set."""
    return physics.BurningLimit(u0=6.2, B=7.2)


@described("locus.grinding")
class Grinding(Described):
    """Plunge grinding without burning: Koren (29), section 6; Malkin's laws, Brown (1988) (4.2), (4.3).

    Controls: ``infeed_rate`` v_f (radial, mm/s), ``work_rotation`` n_w (rad/s). Hidden: ``wear_flat_area`` A,
    0..1 of the wheel's surface. The work speed is v_w = n_w d_w/2, the depth of cut a = 2 pi v_f/n_w.

    * Cost -Z', with the specific removal rate Z' = v_w a = pi d_w v_f, mm^2/s, linear in the infeed rate.
    * Constraint ``grinding_power`` <= burning power, both over the whole width, W.
    * With a `roughness`: constraint ``roughness`` (mm), hidden state ``dressing_state``. It only caps Z'; on
      the cap every work speed with spare burning power is optimal; see `DressedGrinding`.

    Parameters
    ----------
    wheel_diameter, work_diameter : float
        d_s and d_w, mm.
    width : float
        Width of cut b, mm.
    wheel_speed : float
        Wheel surface speed V_s, mm/s: units.m_per_s(30).
    power : GrindingPower
        Power of chips, ploughing and sliding. The closed forms of this class need `physics.MalkinSliding`.
    burning : BurningLimit
        Burning power.
    internal : bool
        Whether a bore is ground.
    roughness : Roughness, optional
        Second constraint.

    Raises
    ------
    ValueError
        When a value is out of range, or typical of another unit.

    Examples
    --------
    >>> from sdpgrind import units
    >>> grinding = Grinding(
    ...     wheel_diameter=300.0, work_diameter=60.0, width=9.3, wheel_speed=units.m_per_s(30))
    >>> grinding.equivalent_diameter  # mm
    50.0
    >>> removal = 1.4913694  # mm^2/s
    >>> round(float(grinding.work_speed_on_locus(removal)), 2)  # mm/s
    249.66
    >>> round(float(grinding.wear_flat_area_on_locus(removal)), 6)
    0.0075
    """

    _inside: ClassVar[tuple[str, ...]] = ("power", "burning", "roughness")
    _: KW_ONLY
    wheel_diameter: float = quantity("mm", above=0, usual=(2.0, 3000.0), typical=300)
    work_diameter: float = quantity("mm", above=0, usual=(2.0, 10000.0), typical=60)
    width: float = quantity("mm", above=0, usual=(0.05, 1000.0), typical=10)
    wheel_speed: float = quantity("mm/s", above=0, usual=(1000.0, inf), typical=30000)
    power: physics.GrindingPower = part(physics.GrindingPower, default_factory=physics.GrindingPower)
    burning: physics.BurningLimit = part(physics.BurningLimit, default_factory=_published)
    internal: bool = flag(default=False)
    roughness: Roughness | None = part(Roughness, " (see locus.processes.Roughness)", default=None)

    def _check(self) -> None:
        if self.internal and self.wheel_diameter >= self.work_diameter:
            raise self._refused("wheel_diameter", f"< work_diameter = {self.work_diameter:g} in a bore")

    def check(
        self, controls: Mapping[str, tuple[float, float]], hidden: Mapping[str, tuple[float, float]]
    ) -> None:
        """Refuse ranges (low, high) of controls and hidden states in another unit (rad/s, shares of 1).

        Raises
        ------
        ValueError
            When an area is outside 0..1, an infeed rate above 1 mm/s, or a work speed above a fifth of V_s.
        """
        for area in hidden.get("wear_flat_area", (0.0, 0.0)):
            if not 0 <= area <= 1:
                raise ValueError(
                    f"wear_flat_area must be a part of 1, in [0, 1]: divide by 100 for percent; got {area!r}"
                )
        infeed = controls.get("infeed_rate", (0.0, 0.0))[1]
        if infeed > FASTEST_INFEED:
            raise ValueError(
                f"infeed_rate must be in mm/s, up to {FASTEST_INFEED:g}; units.um(...) for um/s;"
                f" got {infeed!r}"
            )
        rotation = controls.get("work_rotation", (0.0, 0.0))[1]
        fastest = self.wheel_speed / RPM_LIKE
        if rotation * self.work_diameter / 2 > fastest:
            raise ValueError(
                f"work_rotation must be in rad/s, up to {2 * fastest / self.work_diameter:.4g}, with the"
                f" work's surface below {fastest:g} mm/s; units.rpm(...) for rev/min; got {rotation!r}"
            )

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Grinding power <= burning power (W), and roughness (mm) where given."""
        burning = Varying(response=self._power, limit=self._burning, name="grinding_power", unit="W")
        if self.roughness is None:
            return (burning,)
        return burning, Varying(
            response=self._roughness, limit=self._roughness_limit, name="roughness", unit="mm"
        )

    @property
    def units(self) -> Mapping[str, str]:
        """Units of controls, hidden states and cost."""
        of_all = {"infeed_rate": "mm/s", "work_rotation": "rad/s", "wear_flat_area": "1", "cost": "mm^2/s"}
        return of_all if self.roughness is None else {**of_all, "dressing_state": "1"}

    def cost(self, s: Any, c: Any) -> Any:
        """Return -Z' (mm^2/s) for controls ``c``; it does not depend on the hidden states ``s``."""
        return -self.specific_removal_rate(c.infeed_rate)

    def _power(self, s: Any, c: Any) -> Any:
        return self.grinding_power(c.infeed_rate, c.work_rotation, s.wear_flat_area)

    def _burning(self, s: Any, c: Any) -> Any:
        return self.burning_power(c.infeed_rate, c.work_rotation)

    def _roughness(self, s: Any, c: Any) -> Any:
        law: Any = self.roughness
        return law.roughness(
            self.specific_removal_rate(c.infeed_rate) / self.wheel_speed, law.lead, s.dressing_state
        )

    def _roughness_limit(self, s: Any, c: Any) -> Any:
        law: Any = self.roughness
        return law.roughness_max

    @property
    def job(self) -> Mapping[str, object]:
        """Wheel and work (mm, mm/s), which plan and machine must share."""
        shared = valued(self, ("wheel_diameter", "work_diameter", "width", "wheel_speed"))
        return {**shared, "internal": self.internal}

    @property
    def equivalent_diameter(self) -> float:
        """Equivalent diameter D_e of the contact, mm: Koren, Fig. 7."""
        sign = -1.0 if self.internal else 1.0
        return self.wheel_diameter * self.work_diameter / (self.work_diameter + sign * self.wheel_diameter)

    def specific_removal_rate(self, infeed_rate: Any) -> Any:
        """Return Z' = pi d_w v_f (mm^2/s) for an infeed rate (mm/s)."""
        return pi * self.work_diameter * infeed_rate

    def infeed_rate(self, specific_removal_rate: Any) -> Any:
        """Return the infeed rate (mm/s) for a specific removal rate (mm^2/s)."""
        return specific_removal_rate / (pi * self.work_diameter)

    def work_speed(self, work_rotation: Any) -> Any:
        """Return v_w = n_w d_w/2 (mm/s) for a work rotation (rad/s)."""
        return work_rotation * self.work_diameter / 2

    def work_rotation(self, work_speed: Any) -> Any:
        """Return the rotation (rad/s) for a work speed (mm/s)."""
        return 2 * work_speed / self.work_diameter

    def grinding_power(self, infeed_rate: Any, work_rotation: Any, wear_flat_area: Any) -> Any:
        """Return P_c (W) for an infeed rate (mm/s), work rotation (rad/s) and wear flat area (0..1)."""
        return self.power.power(
            depth_of_cut=2 * pi * infeed_rate / work_rotation, work_speed=self.work_speed(work_rotation),
            wheel_speed=self.wheel_speed, equivalent_diameter=self.equivalent_diameter,
            wear_flat_area=wear_flat_area, width=self.width,
        )  # fmt: skip

    def burning_power(self, infeed_rate: Any, work_rotation: Any) -> Any:
        """Return P_b (W) for an infeed rate (mm/s) and work rotation (rad/s): Koren (29), l = 1/4."""
        return self.burning.power(
            depth_of_cut=2 * pi * infeed_rate / work_rotation, work_speed=self.work_speed(work_rotation),
            equivalent_diameter=self.equivalent_diameter, width=self.width,
        )  # fmt: skip

    def burn_free_rates(self, work_rotation: float, wear_flat_area: float) -> tuple[float, float]:
        """Return least and greatest burn-free infeed rate, mm/s; (inf, 0): all rates burn.

        `work_rotation` is in rad/s, `wear_flat_area` in 0..1. Ploughing takes power at any infeed rate, while
        the burning power goes to 0 with it: "an arbitrary small" rate burns.
        """
        rotation = checks.positive("work_rotation", work_rotation, "rad/s")
        onset = physics.burn_onset(
            self.power, self.burning, work_speed=self.work_speed(rotation), wheel_speed=self.wheel_speed,
            equivalent_diameter=self.equivalent_diameter,
            wear_flat_area=checks.share("wear_flat_area", wear_flat_area),
        )  # fmt: skip
        turns = rotation / (2 * pi)
        return onset.lower * turns, onset.upper * turns

    def work_speed_on_locus(self, specific_removal_rate: npt.ArrayLike) -> Floats:
        """Return v_w (mm/s) of the locus at a specific removal rate Z' (mm^2/s), with the largest slack.

        With R = c3 v_w/(c2 V_s D_e), power = burning power and its stationarity in v_w give B (D_e Z'
        v_w)^(1/4) (R - 3)/(2 (R - 1)) = (u_ch - u_b) Z' + F_pl V_s. The left side rises from 0 at R = 3.
        """
        Z = checks.finite_array("specific_removal_rate", specific_removal_rate, "mm^2/s")
        power = self._chip_excess * Z + self._ploughing
        if not np.all((Z > 0) & (power > 0)):
            rule = "> 0, with chips and ploughing needing more than leaves with the chips"
            raise checks.refuse("specific_removal_rate", rule, specific_removal_rate, "mm^2/s")
        unit_speed = self._curvature_speed
        return unit_speed * _speed_ratio(
            2 * power / (self.burning.B * (self.equivalent_diameter * Z * unit_speed) ** 0.25)
        )

    def wear_flat_area_on_locus(self, specific_removal_rate: npt.ArrayLike) -> Floats:
        """Return the area (0..1) at which a specific removal rate Z' (mm^2/s) is optimal.

        It falls strictly: A = B (D_e Z' v_w)^(1/4)/[2 (R - 1) c2 V_s (D_e Z'/v_w)^(1/2)].
        """
        Z = np.asarray(specific_removal_rate, dtype=float)
        speed, wide = self.work_speed_on_locus(Z), self.equivalent_diameter
        sliding = self._malkin.pressure * self.wheel_speed / N_MM_S_PER_W * (wide * Z / speed) ** 0.5
        return (
            self.burning.B * (wide * Z * speed) ** 0.25 / (2 * (speed / self._curvature_speed - 1) * sliding)
        )

    @property
    def slowest_removal_rate(self) -> float:
        """Z' (mm^2/s) of the least work speed on the locus: F_pl V_s/(3 (u_ch - u_b)), for all diameters.

        A dulling wheel needs a slower work down to it, and a faster one beyond.

        Raises
        ------
        ValueError
            When u_ch <= u_b: the work speed falls everywhere.
        """
        if self._chip_excess <= 0:
            rule = f"> burning.u0 = {self.burning.u0:g} for a least work speed"
            raise checks.refuse("power.specific_energy", rule, self.power.specific_energy, "J/mm^3")
        return self._ploughing / (3 * self._chip_excess)

    @property
    def _chip_excess(self) -> float:
        """u_ch - u_b: chip energy above that carried off by chips, J/mm^3."""
        return self.power.specific_energy - self.burning.u0

    @property
    def _ploughing(self) -> float:
        """Ploughing power per width, W/mm."""
        return self.power.ploughing_force * self.wheel_speed / N_MM_S_PER_W

    @property
    def _malkin(self) -> physics.MalkinSliding:
        return checks.kind(
            "power.sliding", self.power.sliding, physics.MalkinSliding, ", whose locus has a closed form"
        )

    @property
    def _curvature_speed(self) -> float:
        """Work speed of R = 1, mm/s."""
        law = self._malkin
        checks.positive("curvature_pressure", law.curvature_pressure, "N/mm")
        return law.pressure * self.wheel_speed * self.equivalent_diameter / law.curvature_pressure


def _speed_ratio(size: Floats) -> Floats:
    """Return R > 3 with R^(1/4) (R - 3)/(R - 1) = size: Newton from below, monotone on a concave function."""
    ratio = np.maximum(3.0, size**4)
    for _ in range(60):
        slope = 0.25 * ratio**-0.75 * (ratio - 3) / (ratio - 1) + 2 * ratio**0.25 / (ratio - 1) ** 2
        step = (size - ratio**0.25 * (ratio - 3) / (ratio - 1)) / slope
        ratio = ratio + step
        if np.all(np.abs(step) <= 1e-15 * ratio):
            break
    return ratio
