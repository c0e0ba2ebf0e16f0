"""Problem of a plunge cycle: stock, greatest rate and roundness."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from math import inf, isclose
from typing import Any, ClassVar, Self

import numpy as np
from scipy.optimize import brentq

from sdpgrind.base import checks
from sdpgrind.base.doubts.record import Doubts, asked
from sdpgrind.base.quantities import Described, described, part, quantity, valued
from sdpgrind.base.rng import Seed, generator
from sdpgrind.base.warned import warn
from sdpgrind.identify import Estimate
from sdpgrind.plunge._model.always_burns import always_burns
from sdpgrind.plunge._model.chance import BurnChance
from sdpgrind.plunge._model.drive import Drive
from sdpgrind.plunge._model.dynamics import coolest_rate
from sdpgrind.plunge._model.model import PlungeModel
from sdpgrind.plunge._model.taken import OF_DEFLECTION, grinding_ratio, taken
from sdpgrind.plunge._model.time_constants import contradiction, of_deflection, with_time_constant
from sdpgrind.plunge._model.uncertainty import Uncertainty

DEEPEST = 1.0  # chosen: depth of cut per turn that no wheel plunges, mm


@described("plunge.cycle_problem")
class CycleProblem(Described):
    """Removal of a stock in the least time, with no burned layer left and within the roundness.

    Parameters
    ----------
    model : PlungeModel
        Wheel, work, machine and heat.
    stock : float
        Radial stock, mm.
    command_rate_max : float
        Greatest commanded infeed rate u_max, mm/s.
    roundness_max : float
        Greatest out-of-roundness, mm.
    time_constant : float, optional
        Time constant of `CycleController` with ``sparkout="printed"``, s; plans take the deflection of the
        model. Default: secant slope of deflection between the final rate and the burn rate. `replace` keeps
        it, but where stiffness, force ratio or linear lag are changed.
    sample_time : float
        Sample time of the controller, s.
    uncertainty : Uncertainty
        What is not known, as standard deviations.
    drive : Drive
        Lags and dead time of feed drive and power monitor.

    Raises
    ------
    ValueError
        If a value is out of range, no rate is round enough, or the work burns at every rate.

    Examples
    --------
    >>> from sdpgrind import plunge, units
    >>> problem = plunge.preset("simulation")
    >>> round(problem.final_rate, 6), round(problem.time_constant, 4)
    (0.002564, 1.9334)
    >>> problem.replace(wear_flat_area=0.03).time_constant == problem.time_constant
    True
    """

    _inside: ClassVar = ("model", "uncertainty", "drive")

    model: PlungeModel = part(PlungeModel)
    stock: float = quantity("mm", above=0, usual=(1e-3, inf), typical=0.3)
    command_rate_max: float = quantity("mm/s", above=0, usual=(1e-4, 0.5), typical=0.05)
    roundness_max: float = quantity("mm", usual=(-inf, 0.5), typical=0.003)
    time_constant: float | None = quantity("s", above=0, default=None)
    sample_time: float = quantity("s", above=0, usual=(1e-4, 10.0), typical=0.04, default=0.04)
    uncertainty: Uncertainty = part(Uncertainty, default=Uncertainty())
    drive: Drive = part(Drive, default=Drive())

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed; warn of a time constant (s) that changes no plan.

        Parameters
        ----------
        **changes
            Fields of the problem, its model, uncertainty and drive, in their own units.

        Raises
        ------
        ValueError
            If a name is no field, or a value is out of range.
        """
        if changes.keys() & OF_DEFLECTION:
            changes = {"time_constant": None} | changes
        changed = super().replace(**changes)
        asked = changes.get("time_constant")
        if asked is not None and asked != self.time_constant and (told := contradiction(changed)):
            warn(told)
        return changed

    def _check(self) -> None:
        self._refuse_other_units()
        base = self.model.roundness_base
        if self.roundness_max <= base:
            raise self._refused("roundness_max", f"> roundness_base = {base:g}: no rate is round enough")
        if self.model.burn_rate == 0.0:
            raise ValueError(always_burns(self.model))
        if self.final_rate >= self.command_rate_max:
            warn(
                f"no spark-out is needed: roundness_max allows {self.final_rate:.4g} mm/s at the end, and the"
                f" command no more than {self.command_rate_max:.4g}"
            )
        if self.time_constant is None:
            object.__setattr__(self, "time_constant", of_deflection(self))
        longest = checks.positive("time_constant", self.time_constant) / 4
        if self.sample_time > longest:
            raise self._refused("sample_time", f"<= time_constant/4 = {longest:.4g}")
        if self.drive.feed_lag > longest:
            raise ValueError(
                f"feed_lag must be <= time_constant/4 = {longest:.4g} (s): beyond, the axis and not the"
                f" deflection limits the rate; got {self.drive.feed_lag:g}"
            )
        self._warn_of_delay()

    def __deepcopy__(self, memo: object) -> Self:
        return self  # immutable

    def _warn_of_delay(self) -> None:
        delay, samples = self.drive.feed_delay, self.drive.delay_samples(self.sample_time)
        if not isclose(delay, samples * self.sample_time, rel_tol=1e-9):
            warn(f"feed_delay = {delay:g} s counts as {samples} samples, {samples * self.sample_time:g} s")

    def _refuse_other_units(self) -> None:
        if self.stock >= self.model.work_diameter / 4:
            rule = "radial and in mm, < work_diameter/4; units.um(...) for micrometres"
            raise ValueError(f"stock must be {rule}; got {self.stock!r}")
        if self.model.depth_of_cut(self.command_rate_max) >= DEEPEST:
            raise ValueError(
                f"command_rate_max must be less than {DEEPEST:g} mm a turn of the work (mm/s);"
                f" got {self.command_rate_max!r}"
            )

    @property
    def final_rate(self) -> float:
        """Greatest infeed rate v_f (mm/s) at which the part is round enough."""
        m = self.model
        return float(m.turns * (self.roundness_max - m.roundness_base) / m.roundness_gain)

    @property
    def burn_chance(self) -> BurnChance:
        """Chance of damage below the finished surface, from a rate (mm/s) and a remaining stock (mm)."""
        doubts = self.uncertainty
        return BurnChance(
            self.model.core, doubts.burning_sd or 0.0, doubts.diffusivity_sd, doubts.sharpness_sd
        )

    @property
    def learned_chance(self) -> BurnChance:
        """The same (mm/s, mm) where the wear flat area is learned during the part."""
        return replace(self.burn_chance, sharpness_sd=0.0)

    def safe_rate(self, remaining: float, confidence: float = 0.999) -> float:
        """Return the greatest infeed rate that burns no finished surface, with a confidence.

        Parameters
        ----------
        remaining : float
            Remaining stock, mm.
        confidence : float
            Chance that damage stays within the remaining stock, at least 0.5.

        Returns
        -------
        float
            Rate, mm/s, at most `command_rate_max`.

        Raises
        ------
        ValueError
            If an argument is out of range, or no rate is safe at this stock (mm).

        Examples
        --------
        >>> from sdpgrind import plunge
        >>> known = plunge.Uncertainty(sharpness_sd=0.0)
        >>> problem = plunge.preset("simulation").replace(uncertainty=known)
        >>> [round(problem.replace(burning_sd=sd).safe_rate(0.02), 6) for sd in (0.0, 0.03)]  # mm/s
        [0.015628, 0.012415]
        """
        checks.nonnegative("remaining", remaining, "mm")
        checks.confidence("confidence", confidence)
        return safe_rate_of(self, self.burn_chance, remaining, confidence)

    def draw(self, rng: Seed) -> PlungeModel:
        """Return a model with B, diffusivity, wear flat area, force ratio and wheel wear drawn as declared.

        The values are in the units of the model, such as mm^2/s. A change of the wheel within a part is not
        drawn: give the model its `wear`.

        Parameters
        ----------
        rng : int or Generator
            Seed of the draw.

        Returns
        -------
        PlungeModel
            One machine and steel: the truth of a series.

        Examples
        --------
        >>> from sdpgrind import plunge
        >>> problem = plunge.preset("simulation").replace(burning_sd=0.03)
        >>> problem.draw(rng=1).burning.B != problem.model.burning.B
        True
        """
        moved, doubts, model = generator(rng).standard_normal(5), self.uncertainty, self.model
        shares = (doubts.burning_sd or 0.0, doubts.diffusivity_sd, doubts.sharpness_sd, doubts.deflection_sd)
        burning, diffusivity, area, force = np.exp(np.array(shares) * moved[:4])
        wear = model.wheel_wear + doubts.wheel_wear_sd * moved[4]
        return model.replace(
            burning=model.burning.replace(B=model.burning.B * float(burning)),
            diffusivity=model.diffusivity * float(diffusivity),
            wear_flat_area=model.wear_flat_area * float(area),
            normal_force_ratio=model.normal_force_ratio * float(force),
            grinding_ratio=grinding_ratio(model, float(wear)),
        )

    @cached_property
    def job(self) -> Mapping[str, object]:
        """Part and machine, name -> (value, unit), without estimated values."""
        diameters = valued(self.model, ("wheel_diameter", "work_diameter", "width"))
        rates = valued(self, ("command_rate_max",)) | valued(self.model, ("work_rotation",))
        return diameters | rates | valued(self, ("stock", "sample_time"))

    def updated(self, estimate: Estimate) -> Self:
        """Return the problem with estimated values.

        Parameters
        ----------
        estimate : Estimate
            Result of `plunge.identify` or `BurnThreshold.estimate`: fields of the model, of its power and of
            the drive by name in their units (wear flat area 1, force ratio 1, stiffness N/mm, idle power W);
            ``wheel_wear`` sets the grinding ratio; a contact zero beside others is left out: it is that of
            one part. Declared standard deviations stay, but ``burning_sd``. A time constant (s) is that of
            the controller and of the plan: the linear lag of a model that has one, else the stiffness is
            scaled so that the deflection has this time constant. A force ratio or stiffness gives the
            controller the time constant of the new deflection.

        Raises
        ------
        ValueError
            If the estimate failed, names another quantity, or would change nothing.
        """
        if not hasattr(estimate, "ok"):
            raise TypeError(f"estimate must be what plunge.identify gives; got {checks.shown(estimate)}")
        if not estimate.ok:
            raise ValueError(f"estimate must have succeeded; got {estimate.message!r}")
        values = taken(self.model, estimate)
        time_constant = values.pop("time_constant", None)
        if time_constant is not None:
            return with_time_constant(self.replace(**values), time_constant)
        if values.keys() & OF_DEFLECTION:
            values["time_constant"] = values.get("linear_time_constant")
        return self.replace(**values)

    def doubts(self, data: Any) -> Doubts:
        """Return what parts say about this problem, what they do not, and what it costs not to know.

        Time constant, contact zero, force ratio and wear flat area with their intervals against the values of
        the problem; the alignment of the commands that the sizes prefer; noise, step and bent residuals; the
        time of the cycle planned again at both ends of each interval.

        Parameters
        ----------
        data : mapping of arrays, log, or table of a log
            As for `plunge.identify`: time (s), command_rate (mm/s), size (mm) and, if measured,
            grinding_power (W).

        Returns
        -------
        Doubts
            Rows, sentences, alignment and stakes; ``print`` shows the page.

        Raises
        ------
        ValueError, TypeError
            For missing or bad data.

        Examples
        --------
        >>> import numpy as np
        >>> from sdpgrind import plunge
        >>> time = np.arange(0.0, 8.0, 0.04)
        >>> lag = 0.0448 * 1.5 * (np.exp(-np.maximum(time - 5.0, 0.0) / 1.5) - np.exp(-time / 1.5))
        >>> data = {"time": time, "command_rate": np.where(time < 4.99, 0.0448, 0.0),
        ...         "size": 0.0448 * np.minimum(time, 5.0) - lag}
        >>> found = plunge.preset("simulation").doubts(data)
        >>> row = found["time_constant"]
        >>> round(row.believed, 3), round(row.told, 3), row.verdict, found.alignment
        (1.933, 1.5, 'differs', 'begin')
        """
        return asked("sdpgrind.plunge._doubts.doubts:doubts", self, data)


def safe_rate_of(problem: CycleProblem, chance: BurnChance, remaining: float, confidence: float) -> float:
    """Greatest infeed rate (mm/s) that burns no finished surface above a stock (mm); refused if none."""
    rate = chance.safe_rate(remaining, confidence, problem.command_rate_max)
    if rate == 0.0:
        raise _no_safe_rate(problem, chance, remaining, confidence)
    return rate


def _no_safe_rate(
    problem: CycleProblem, chance: BurnChance, remaining: float, confidence: float
) -> ValueError:
    """Error with the greatest doubt of B at which a rate is safe, and the greatest confidence."""
    coolest = _coolest(problem, chance, remaining)
    reached = greatest_confidence(problem, chance, remaining)

    def lacking(sd: float) -> float:
        return float(replace(chance, burning_sd=sd)(coolest, remaining)) - (1.0 - confidence)

    most = brentq(lacking, 0.0, chance.burning_sd) if lacking(0.0) <= 0.0 else 0.0
    rule, got = f"confidence must be less than {confidence:.10g}, even with burning_sd = 0,", confidence
    if most:
        rule = (
            f"burning_sd must be at most {np.floor(1e4 * most) / 1e4:g} for a confidence of {confidence:.10g}"
        )
        got = chance.burning_sd
    return ValueError(
        f"{rule} with {remaining:g} mm of stock: no infeed rate is safe; got {got:.10g}. A confidence of"
        f" {_floored(reached):.10g} is possible; inspecting parts for burn narrows the doubt"
    )


def _floored(confidence: float) -> float:
    """A confidence that is reached, with two digits of the chance that is left."""
    left = 1.0 - confidence
    scale = 10.0 ** (1.0 - np.floor(np.log10(left))) if left > 0.0 else 1.0
    return float(1.0 - np.ceil(left * scale) / scale)


def greatest_confidence(problem: CycleProblem, chance: BurnChance, remaining: float = 0.0) -> float:
    """Chance that damage stays within a remaining stock (mm), at the rate of the greatest."""
    return 1.0 - float(chance(_coolest(problem, chance, remaining), remaining))


def _coolest(problem: CycleProblem, chance: BurnChance, remaining: float) -> float:
    near = min(float(coolest_rate(problem.model.core)), problem.command_rate_max)
    return chance.coolest(near, remaining)
