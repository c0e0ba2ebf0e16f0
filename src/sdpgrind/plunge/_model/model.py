"""Plunge grinding of a bore or a shaft: power, burning, deflection and roundness over the infeed rate."""

import math
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind import physics
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, another_unit, described, flag, part, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.base.warned import warn
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.kernels import PlungeCore

# chosen: least speed of the wheel over that of the work; a smaller one, some 60, is rev/min taken as rad/s
SPEED_RATIO = 5.0
# chosen, mm/s (twice) and rad/s: beyond them another unit is meant
SLOWEST_WHEEL, FASTEST_WHEEL, FASTEST_WORK = 1000.0, 300e3, 300.0
# chosen, N/mm and mm^2/s, ten times beyond what exists: machines of 1e3 to 1e5, materials of 1 to 117
_STIFFNESSES, _DIFFUSIVITIES = (100.0, 1e6), (0.1, 1000.0)
_SOFTEST, _USUAL_STIFFNESS = 1.0, 10000.0  # chosen, N/mm: of quills of small bores and of slender shafts
_STEEPEST = 5.0  # chosen: some five times beyond wear in proportion to the depth of cut
_LONGEST, _SLOW = 50.0, 0.01  # chosen: s, at a rate in mm/s; one in N/µm taken as N/mm lags some 1000 s
# chosen, ten times beyond normal over tangential forces of 1.2 to 10 and roundness gains of 0.5 to 5
_LEAST_RATIO, _MOST_RATIO, _MOST_GAIN = 0.12, 100.0, 50.0


@described("plunge.wear")
class Wear(Described):
    """Growth of the wear flat area A with the radial infeed q: dA/dq = growth (v/reference_rate)^exponent.

    Dong, Danai and Malkin (2004) let it grow in proportion to the stock: exponent 0.

    Parameters
    ----------
    growth : float
        Growth of the area per radial infeed, 1/mm.
    exponent : float
        Exponent of the infeed rate, unit 1.
    reference_rate : float
        Infeed rate at which `growth` holds, mm/s.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> Wear(growth=0.02).rate(infeed_rate=0.01)  # 1/s
    0.0002
    """

    growth: float = quantity("1/mm", at_least=0)
    exponent: float = quantity("1", at_least=0, at_most=_STEEPEST, default=0.0)
    reference_rate: float = quantity("mm/s", above=0, usual=(1e-4, 10.0), typical=0.01, default=0.01)

    def rate(self, infeed_rate: Any) -> Any:
        """Return the growth of the area per time, 1/s, at an infeed rate (mm/s)."""
        return self.growth * (infeed_rate / self.reference_rate) ** self.exponent * infeed_rate


@described("plunge.model")
class PlungeModel(Described):
    """A wheel fed into a turning work: power, deflection of the machine, thermal damage of the surface.

    All infeeds, rates and depths are radial. Power is that of `physics.GrindingPower`; the work burns where
    it exceeds `physics.BurningLimit`. The machine deflects by x = F_n/k with F_n = R_n F_t, so that x = K0 +
    K1 v + K2 v^p at an infeed rate v: the commanded infeed is the actual one plus x.

    Parameters
    ----------
    wheel_diameter, work_diameter : float
        Diameters d_s and d_w, mm.
    width : float
        Width of cut b, mm.
    wheel_speed : float
        Surface speed of the wheel v_s, mm/s: units.m_per_s(37).
    work_rotation : float
        Rotation of the work, rad/s: units.hz(5).
    wear_flat_area : float
        Effective wear flat area A as defined by the sliding law of `power`, 0..1.
    stiffness : float
        Stiffness k of the whole machine, N/mm.
    normal_force_ratio : float
        Normal over tangential force R_n, unit 1. Only R_n/k matters.
    power : GrindingPower
        Power of chips, ploughing and sliding, W.
    burning : BurningLimit
        Power at which the surface burns, W.
    diffusivity : float
        Thermal diffusivity of the work, mm^2/s.
    roundness_base, roundness_gain : float
        Out-of-roundness R_0 + k_r a at the depth of cut a of the last turn: R_0 in mm, k_r unit 1.
    internal : bool
        True: a bore; False: a shaft.
    wear : Wear, optional
        Growth of the wear flat area during the part, 1/mm. None: it is constant.
    linear_time_constant : float, optional
        Deflection over infeed rate, s, in place of x = F_n/k: (1) and (5) of Dong as a plant.
    grinding_ratio : float
        Volume of work over volume of wheel worn, unit 1; inf: the wheel does not wear.

    Raises
    ------
    ValueError
        If a value is out of range, or probably in another unit.

    Examples
    --------
    >>> from sdpgrind import physics, units
    >>> model = PlungeModel(
    ...     wheel_diameter=50.0, work_diameter=70.0, width=9.0, wheel_speed=units.m_per_s(37),
    ...     work_rotation=units.hz(5), wear_flat_area=0.026, stiffness=8000.0, normal_force_ratio=9.78,
    ...     power=physics.GrindingPower(sliding=physics.DongSliding()), diffusivity=12.5,
    ...     burning=physics.BurningLimit(6.205, 3.32), roundness_base=units.um(1.59), roundness_gain=2.75)
    >>> round(float(model.burn_depth(0.02)), 4), round(model.burn_rate, 6)  # mm, mm/s
    (0.0316, 0.008257)
    """

    wheel_diameter: float = quantity("mm", above=0, usual=(1.0, 3000.0), typical=50)
    work_diameter: float = quantity("mm", above=0, usual=(1.0, 10000.0), typical=70)
    width: float = quantity("mm", above=0, usual=(0.1, 1000.0), typical=10)
    wheel_speed: float = quantity("mm/s", above=0, usual=(SLOWEST_WHEEL, FASTEST_WHEEL), typical=30000)
    work_rotation: float = quantity("rad/s", above=0, usual=(0.0, FASTEST_WORK), typical=30)
    wear_flat_area: float = quantity("1", above=0, at_most=1)
    stiffness: float = quantity("N/mm", above=0, usual=(_SOFTEST, _STIFFNESSES[1]), typical=_USUAL_STIFFNESS)
    normal_force_ratio: float = quantity(
        "1", at_least=_LEAST_RATIO, at_most=_MOST_RATIO, hint=" (normal over tangential: 4, not 0.25)"
    )
    power: physics.GrindingPower = part(physics.GrindingPower)
    burning: physics.BurningLimit = part(physics.BurningLimit)
    diffusivity: float = quantity("mm^2/s", above=0, usual=_DIFFUSIVITIES, typical=12)
    roundness_base: float = quantity("mm", at_least=0, usual=(0.0, 0.5), typical=0.002)
    roundness_gain: float = quantity("1", above=0, at_most=_MOST_GAIN, hint=" (mm per mm: 2 for 2000 µm/mm)")
    internal: bool = flag(default=True)
    wear: Wear | None = part(Wear, default=None)
    linear_time_constant: float | None = quantity("s", above=0, default=None)
    grinding_ratio: float = quantity("1", above=0, default=math.inf)

    def _check(self) -> None:
        if self.internal and self.wheel_diameter >= self.work_diameter:
            raise self._refused("wheel_diameter", f"< work_diameter = {self.work_diameter:g} in a bore")
        surface = self.wheel_speed / SPEED_RATIO
        if self.work_rotation * self.work_diameter / 2 > surface:
            raise ValueError(
                f"work_rotation must be in rad/s, up to {2 * surface / self.work_diameter:.4g}, with the"
                f" work's surface below {surface:g} mm/s; units.rpm(...) for rev/min;"
                f" got {self.work_rotation!r}"
            )
        self._refuse_other_stiffness()
        self._warn_of_area()
        if self.grinding_ratio < 1.0:
            warn(f"grinding_ratio = {self.grinding_ratio:g}: the wheel loses more than the work")

    def __deepcopy__(self, memo: object) -> Self:
        return self  # immutable

    def _refuse_other_stiffness(self) -> None:
        lag = _LONGEST if self.linear_time_constant is not None else self.local_time_constant(_SLOW)
        if self.stiffness < _STIFFNESSES[0] and lag >= _LONGEST:
            usual = (_STIFFNESSES, _USUAL_STIFFNESS)
            raise ValueError(
                another_unit("stiffness", self.stiffness, self._field_units()["stiffness"], *usual)
            )

    def _warn_of_area(self) -> None:
        law = self.power.sliding
        low, high = law.areas
        if not low <= self.wear_flat_area <= high:
            name = type(law).__name__
            warn(
                f"wear_flat_area = {self.wear_flat_area:g} lies outside {low:g} to {high:g}, which {name} is"
                " meant for: an area of one sliding law is none of another"
            )

    @property
    def wheel_wear(self) -> float:
        """Radial wear of the wheel per radial stock, mm/mm: d_w/(d_s grinding_ratio)."""
        return self.work_diameter / (self.wheel_diameter * self.grinding_ratio)

    @property
    def equivalent_diameter(self) -> float:
        """Equivalent diameter d_e: of a wheel with the same contact on a plane, mm."""
        sign = -1.0 if self.internal else 1.0
        return self.wheel_diameter * self.work_diameter / (self.work_diameter + sign * self.wheel_diameter)

    @property
    def turns(self) -> float:
        """Turns of the work in a second, n_w, 1/s."""
        return self.work_rotation / (2 * np.pi)

    @property
    def work_speed(self) -> float:
        """Speed of the work's surface v_w, mm/s."""
        return np.pi * self.work_diameter * self.turns

    def depth_of_cut(self, infeed_rate: npt.ArrayLike) -> Floats:
        """Return the depth of cut in one turn of the work (mm) at an infeed rate (mm/s): a = v/n_w."""
        return np.asarray(infeed_rate, dtype=float) / self.turns

    def grinding_power(self, infeed_rate: npt.ArrayLike) -> Floats:
        """Return the power (W) at an infeed rate (mm/s)."""
        return np.asarray(
            self.power.power(
                depth_of_cut=self.depth_of_cut(infeed_rate), work_speed=self.work_speed,
                wheel_speed=self.wheel_speed, equivalent_diameter=self.equivalent_diameter,
                wear_flat_area=self.wear_flat_area, width=self.width,
            )
        )  # fmt: skip

    def burning_power(self, infeed_rate: npt.ArrayLike) -> Floats:
        """Return the power (W) at which the work begins to burn at an infeed rate (mm/s)."""
        speeds = {"work_speed": self.work_speed, "equivalent_diameter": self.equivalent_diameter}
        return np.asarray(
            self.burning.power(depth_of_cut=self.depth_of_cut(infeed_rate), **speeds, width=self.width)
        )

    def burn_depth(self, infeed_rate: npt.ArrayLike, grinding_power: npt.ArrayLike | None = None) -> Floats:
        """Return the depth of damage (mm) at an infeed rate (mm/s); negative: distance to damage.

        The depth to which a moving band heats the work to the temperature of damage: z = sqrt(alpha
        l_c/v_w)/0.915 ln((P - u_0 Q)/(P_b - u_0 Q)). Below the lower rate of `burn_onset` it is positive
        again, as the ploughing force does not vanish with the rate: an artefact that plans, controllers and
        plants ignore.

        Parameters
        ----------
        infeed_rate : float or array
            Actual infeed rate, mm/s.
        grinding_power : float or array, optional
            Measured power, W. Default: that of the model.
        """
        rate = np.asarray(infeed_rate, dtype=float)
        power = np.asarray(
            self.grinding_power(rate) if grinding_power is None else grinding_power, dtype=float
        )
        chips = self.burning.u0 * self.width * self.work_speed * self.depth_of_cut(rate)
        contact = np.sqrt(self.equivalent_diameter * self.depth_of_cut(rate))
        reach = np.sqrt(self.diffusivity * contact / self.work_speed) / _kernels.DECAY
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(reach * np.log((power - chips) / (self.burning_power(rate) - chips)))

    def deflection(self, infeed_rate: npt.ArrayLike) -> Floats:
        """Return the deflection of the machine (mm) at an infeed rate (mm/s): x = R_n P/(v_s k), or tau v."""
        if self.linear_time_constant is not None:
            return np.asarray(self.linear_time_constant * np.asarray(infeed_rate, dtype=float))
        tangential = self.grinding_power(infeed_rate) * N_MM_S_PER_W / self.wheel_speed
        return np.asarray(self.normal_force_ratio * tangential / self.stiffness)

    def infeed_rate(self, deflection: npt.ArrayLike) -> Floats:
        """Return the infeed rate (mm/s) at a deflection (mm); 0 where the wheel only ploughs."""
        x = np.asarray(deflection, dtype=float) - self.core.K0
        return np.asarray(_kernels.rates(np.ravel(x), self.core)).reshape(x.shape)

    def local_time_constant(self, infeed_rate: npt.ArrayLike) -> Floats:
        """Return the local time constant dx/dv (s) at an infeed rate (mm/s)."""
        c, v = self.core, np.asarray(infeed_rate, dtype=float)
        if self.linear_time_constant is not None:
            return np.full(v.shape, c.K1)
        return np.asarray(c.K1 + c.p * c.K2 * v ** (c.p - 1))

    def roundness(self, infeed_rate: npt.ArrayLike) -> Floats:
        """Return the out-of-roundness (mm) after a last turn at an infeed rate (mm/s)."""
        return np.asarray(self.roundness_base + self.roundness_gain * self.depth_of_cut(infeed_rate))

    @cached_property
    def burn_onset(self) -> tuple[float, float]:
        """Least and greatest rate without burning, mm/s; the least is an artefact, see `burn_depth`."""
        onset = physics.burn_onset(
            self.power, self.burning, work_speed=self.work_speed, wheel_speed=self.wheel_speed,
            equivalent_diameter=self.equivalent_diameter, wear_flat_area=self.wear_flat_area,
        )  # fmt: skip
        return onset.lower * self.turns, onset.upper * self.turns

    @property
    def burn_rate(self) -> float:
        """Greatest infeed rate v_b (mm/s) without burning. 0: every rate burns; inf: none does."""
        low, high = self.burn_onset
        return high if high >= low else 0.0

    @cached_property
    def core(self) -> PlungeCore:
        """Coefficients of this model for compiled kernels, in mm, s and N."""
        a1 = 1.0 / self.turns  # depth of cut at 1 mm/s
        ratio = self.normal_force_ratio / self.stiffness
        power = self.power
        sliding: Any = power.sliding.force(
            depth_of_cut=a1, work_speed=self.work_speed, wheel_speed=self.wheel_speed,
            equivalent_diameter=self.equivalent_diameter, wear_flat_area=self.wear_flat_area,
        )  # fmt: skip
        # N/mm at 1 mm/s
        chips = power.specific_energy * self.work_speed * a1 * N_MM_S_PER_W / self.wheel_speed
        heat = self.wheel_speed / N_MM_S_PER_W
        band = self.burning.B * (self.equivalent_diameter * a1) ** 0.25 * self.work_speed**0.5
        contact = np.sqrt(self.equivalent_diameter * a1)
        deflections = ratio * self.width * np.array([power.ploughing_force, chips, float(sliding)])
        if self.linear_time_constant is not None:
            deflections = np.array([0.0, self.linear_time_constant, 0.0])
        return PlungeCore(
            K0=float(deflections[0]),
            K1=float(deflections[1]),
            K2=float(deflections[2]),
            p=float(power.sliding.exponent),
            heat0=heat * power.ploughing_force / band,
            heat1=(power.specific_energy - self.burning.u0) * self.work_speed * a1 / band,
            heat2=heat * float(sliding) / band,
            reach=float(np.sqrt(self.diffusivity * contact / self.work_speed) / _kernels.DECAY),
            power0=heat * self.width * power.ploughing_force,
            power1=heat * self.width * chips,
            power2=heat * self.width * float(sliding),
        )
