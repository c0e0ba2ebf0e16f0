"""Controller of plunge cycles: full rate, balance of damage and stock, spark-out."""

import dataclasses
from math import exp

from scipy.special import ndtri

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, choice, described, flag, part, quantity
from sdpgrind.plunge._control.base import SampledCycle
from sdpgrind.plunge._control.state import CONFIDENT, GAUGE, P_END, PRINTED, final_rate, law_of
from sdpgrind.plunge._model.dynamics import coolest_rate
from sdpgrind.plunge._model.problem import CycleProblem

_FORMS = {"p_end": P_END, "gauge": GAUGE, "printed": PRINTED}


@described()
class CycleController(SampledCycle, Described):
    """Full rate, balance of damage and stock, spark-out: Dong, Danai and Malkin (2004), section 2.

    The structure is that of the fastest cycle (`plan`). Damage is that of the model; the stock is measured.
    Spark-out begins when releasing the deflection leaves the final rate at size.

    With ``online`` a Kalman filter estimates contact zero, scale of deflection and sharpness from size and
    power during the part. Errors of wear flat area and contact zero then matter little; an unknown gain of
    the power monitor must be covered by the margin.

    Five sizes in a row that are missing, frozen or jump end the part: the command is ``retract``.

    Parameters
    ----------
    problem : CycleProblem
        Problem as assumed by the controller.
    safety_margin : float
        Minimum distance between burn depth and remaining stock, mm; (7).
    sparkout : {"p_end", "gauge", "printed"}
        Begin of spark-out: at a command known beforehand (it needs the contact zero), by the measured size,
        or by (2) and (3) as printed, with the constant `problem.time_constant`.
    online : bool, optional
        Estimate during the part. Default: True unless `sparkout` is printed or the model is linear.
    no_burn : bool
        Never burn, even where the stock would remove the damage.
    roundness_margin : float
        Distance of the aimed out-of-roundness from its limit, mm; gauge noise scatters it by some 1e-5.
    observer_gain : float
        Gain of the size observer in (0, 1] without online estimation; 1: the gauge alone; unit 1.
    size_sd, power_sd : float
        Standard deviation of size, mm, and of power, relative.
    contact_zero_sd : float
        Standard deviation of the contact position while power is not measured, mm.
    deflection_sd, sharpness_sd : float
        Standard deviation of deflection and wear flat area at the start, relative.
    confidence : float, optional
        Chance that no finished surface is burned, unit 1: the doubts, noise and machine are then those that
        the problem declares (`uncertainty`, `drive`), not those given here. None: by the safety margin.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> controller = plunge.CycleController(plunge.preset("simulation"))
    >>> controller.step(size=0.0, grinding_power=0.0)
    {'command_rate': 0.0448, 'balancing': 0.0}
    """

    problem: CycleProblem = part(CycleProblem, " (see plunge.preset)")
    safety_margin: float = quantity("mm", at_least=0, default=0.0)
    _: dataclasses.KW_ONLY
    sparkout: str = choice(*_FORMS, default="p_end")
    online: bool | None = flag(default=None)
    no_burn: bool = flag(default=False)
    roundness_margin: float = quantity("mm", at_least=0, default=3e-5)
    observer_gain: float = quantity("1", above=0, at_most=1, default=0.1)
    size_sd: float = quantity("mm", at_least=0, default=5e-4)
    power_sd: float = quantity("1", at_least=0, default=0.01)
    contact_zero_sd: float = quantity("mm", at_least=0, default=0.01)
    deflection_sd: float = quantity("1", at_least=0, default=0.1)
    sharpness_sd: float = quantity("1", at_least=0, default=0.1)
    confidence: float | None = quantity("1", at_least=0.5, below=1, default=None)

    def _check(self) -> None:
        stock = self.problem.stock
        if self.size_sd > 0.1 * stock:
            raise self._refused("size_sd", f"in [0, {0.1 * stock:g}]")
        if self.power_sd > 0.5:
            raise self._refused("power_sd", "in [0, 0.5]")
        if self.safety_margin >= stock:
            raise self._refused("safety_margin", f"< stock = {stock:g}")
        if self.online and not self._may_learn:
            raise self._refused("online", "False with sparkout='printed' or a linear model")
        final_rate(self.problem, self.roundness_margin)

    @property
    def _may_learn(self) -> bool:
        return self.sparkout != "printed" and self.problem.model.linear_time_constant is None

    @property
    def final_rate(self) -> float:
        """Infeed rate aimed at when the size is reached, mm/s."""
        return final_rate(self.problem, self.roundness_margin)

    def _confident(self) -> dict[str, float]:
        """Settings of the rule that keeps a confidence."""
        if self.confidence is None:
            return {}
        doubts, drive, model = self.problem.uncertainty, self.problem.drive, self.problem.model
        tick, lag = self.problem.sample_time, drive.power_lag
        return {
            "form": CONFIDENT,
            "k_static": float(ndtri(self.confidence)),
            "k_filter": float(ndtri(1.0 - 0.1 * (1.0 - self.confidence))),
            "burning_sd": doubts.burning_sd or 0.0,
            "diffusivity_sd": doubts.diffusivity_sd,
            "size_sd": doubts.size_sd,
            "power_sd": doubts.power_sd,
            "zero_sd": doubts.contact_zero_sd,
            "scale_sd": doubts.deflection_sd,
            "sharpness_sd": doubts.sharpness_sd,
            "gain_sd": doubts.power_gain_sd,
            "wheel_wear": model.wheel_wear,
            "wear_sd": doubts.wheel_wear_sd,
            "coolest_rate": float(coolest_rate(model.core)),
            "feed_lag": drive.feed_lag,
            "feed_delay": drive.delay_samples(tick),
            "power_lag": lag,
            "power_pole": exp(-tick / lag) if lag else 0.0,
            "idle_power": drive.idle_power,
        }

    def _compiled(self) -> Floats:
        model = self.problem.model
        settings = {
            "form": _FORMS[self.sparkout],
            "no_burn": self.no_burn,
            "online": self._may_learn if self.online is None else self.online,
            "safety_margin": self.safety_margin,
            "gain": self.observer_gain,
            "size_sd": self.size_sd,
            "power_sd": self.power_sd,
            "zero_sd": self.contact_zero_sd,
            "scale_sd": self.deflection_sd,
            "sharpness_sd": self.sharpness_sd,
            "growth": 0.0 if model.wear is None else model.wear.growth / model.wear_flat_area,
        }
        return law_of(self.problem, self.final_rate, **(settings | self._confident()))
