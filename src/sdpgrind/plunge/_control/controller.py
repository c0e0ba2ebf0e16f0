"""Controller of plunge cycles: the axis keeps to the greatest position that is safe."""

import dataclasses
from collections.abc import Mapping

from scipy.special import ndtri

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, choice, described, flag, part, quantity
from sdpgrind.base.warned import warn
from sdpgrind.plunge._control.base import SampledCycle
from sdpgrind.plunge._control.filter_state import QUEUE
from sdpgrind.plunge._control.state import ENVELOPE, PRINTED, final_rate, law_of
from sdpgrind.plunge._model.dynamics import coolest_rate
from sdpgrind.plunge._model.problem import CycleProblem, safe_rate_of

_DRAWS = 10  # chosen: independent errors of the filter in one part, of which none may burn it
_OWN = ("size_sd", "power_sd", "contact_zero_sd", "deflection_sd", "sharpness_sd")  # of 0.1.0


@described()
class CycleController(SampledCycle, Described):
    """Full rate, balance of damage and stock, spark-out, by one rule: the commanded position stays safe.

    A position is safe if, with nothing more commanded, damage never exceeds the remaining stock, with the
    confidence, and the part ends round. So the structure is that of the fastest cycle (`plan`; Dong, Danai
    and Malkin (2004), section 2). What is not known, and the machine, are those of the problem
    (`uncertainty`, `drive`); without `burning_sd` the burn threshold is taken as exactly known.

    With ``online`` a Kalman filter estimates size, contact, deflection, sharpness, wheel wear and the gain of
    the power monitor from size and power during the part.

    Five sizes in a row that are missing, frozen or jump end the part: the command is ``retract``.

    Parameters
    ----------
    problem : CycleProblem
        Problem as assumed by the controller.
    safety_margin : float
        Minimum distance between burn depth and remaining stock, on top of the confidence, mm; (7).
    confidence : float
        Chance that no finished surface is burned, unit 1. Without effect on the printed cycle, which has its
        margin alone.
    sparkout : {"p_end", "printed"}
        Rule of the safe position, or sections by (2) and (3) as printed, with the constant
        `problem.time_constant`. "gauge" is deprecated, and the same as "p_end".
    online : bool, optional
        Estimate during the part. Default: True unless `sparkout` is printed or the model is linear. False:
        the size alone is read, and the deflection is that of the model.
    no_burn : bool
        Never burn, even where the stock would remove the damage.
    roundness_margin : float
        Distance of the aimed out-of-roundness from its limit, mm; gauge noise scatters it by some 1e-5.
    observer_gain : float
        Gain of the size observer in (0, 1] without online estimation; 1: the gauge alone; unit 1.
    size_sd, contact_zero_sd : float, optional
        Deprecated: `uncertainty` of the problem holds them, mm.
    power_sd, deflection_sd, sharpness_sd : float, optional
        Deprecated: `uncertainty` of the problem holds them, unit 1.

    Raises
    ------
    ValueError
        If a value is out of range, or no rate is safe at size.

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
    confidence: float = quantity("1", at_least=0.5, below=1, hint=" (0.999 for 99.9 %)", default=0.999)
    sparkout: str = choice("p_end", "gauge", "printed", default="p_end")
    online: bool | None = flag(default=None)
    no_burn: bool = flag(default=False)
    roundness_margin: float = quantity("mm", at_least=0, default=3e-5)
    observer_gain: float = quantity("1", above=0, at_most=1, default=0.1)
    size_sd: float | None = quantity("mm", at_least=0, default=None)
    power_sd: float | None = quantity("1", at_least=0, default=None)
    contact_zero_sd: float | None = quantity("mm", at_least=0, default=None)
    deflection_sd: float | None = quantity("1", at_least=0, default=None)
    sharpness_sd: float | None = quantity("1", at_least=0, default=None)

    def _check(self) -> None:
        self._declare()
        if self.sparkout == "gauge":
            warn("sparkout='gauge' is deprecated: 'p_end' is the same, and the default", DeprecationWarning)
        stock = self.problem.stock
        if self.safety_margin >= stock:
            raise self._refused("safety_margin", f"< stock = {stock:g}")
        if self.online and not self._may_learn:
            raise self._refused("online", "False with sparkout='printed' or a linear model")
        final_rate(self.problem, self.roundness_margin)
        if self.sparkout != "printed":
            self._check_dead_time()
        if self.sparkout != "printed" and self.problem.uncertainty.burning_sd:
            safe_rate_of(self.problem, self.problem.learned_chance, 0.0, self.confidence)  # refuses

    def _check_dead_time(self) -> None:
        """Refuse a dead time that the filter cannot hold."""
        tick = self.problem.sample_time
        if self.problem.drive.delay_samples(tick) > QUEUE:
            longest = QUEUE * tick
            raise ValueError(
                f"feed_delay must be <= {QUEUE} samples, {longest:g} s; got {self.problem.drive.feed_delay:g}"
            )

    def _declare(self) -> None:
        """Move standard deviations given here, as up to 0.1.0, to the problem's uncertainty."""
        own = {name: value for name in _OWN if (value := getattr(self, name)) is not None}
        if not own:
            return
        named = ", ".join(f"{name}={value:g}" for name, value in own.items())
        warn(f"deprecated: problem.replace({named}) declares what the controller doubts", DeprecationWarning)
        object.__setattr__(self, "problem", self.problem.replace(**own))
        for name in own:
            object.__setattr__(self, name, None)

    @property
    def _may_learn(self) -> bool:
        return self.sparkout != "printed" and self.problem.model.linear_time_constant is None

    @property
    def learns(self) -> bool:
        """Whether it estimates during the part (unit 1)."""
        return self._may_learn if self.online is None else self.online

    @property
    def description(self) -> Mapping[str, float | str]:
        """Confidence (unit 1) and what is known of the burn threshold, for the log."""
        known = super().description
        return known if self.sparkout == "printed" else {"confidence": self.confidence, **known}

    @property
    def final_rate(self) -> float:
        """Infeed rate aimed at when the size is reached, mm/s."""
        return final_rate(self.problem, self.roundness_margin)

    def _compiled(self) -> Floats:
        model, doubts = self.problem.model, self.problem.uncertainty
        settings = {
            "form": PRINTED if self.sparkout == "printed" else ENVELOPE,
            "no_burn": self.no_burn,
            "online": self.learns,
            "safety_margin": self.safety_margin,
            "gain": self.observer_gain,
            "growth": 0.0 if model.wear is None else model.wear.growth / model.wear_flat_area,
            "coolest_rate": float(coolest_rate(model.core)),
            "burning_sd": doubts.burning_sd or 0.0,
            "diffusivity_sd": doubts.diffusivity_sd,
            "size_sd": doubts.size_sd,
            "power_sd": doubts.power_sd,
            "scale_sd": doubts.deflection_sd,
            "sharpness_sd": doubts.sharpness_sd,
            "sharpness_walk": doubts.sharpness_change_sd**2 / self.problem.stock,
            "wheel_wear": model.wheel_wear,
            "wear_sd": doubts.wheel_wear_sd,
        }
        return law_of(self.problem, self.final_rate, **(settings | self._quantiles() | self._machine()))

    def _quantiles(self) -> dict[str, float]:
        """Standard deviations kept of doubts that last a part, and of errors of the filter that change."""
        static = float(ndtri(self.confidence))
        if not self.learns:  # what is not learned lasts; contact and gain are not used
            return {"k_static": static, "k_filter": static}
        doubts = self.problem.uncertainty
        return {
            "k_static": static,
            "k_filter": float(ndtri(1.0 - (1.0 - self.confidence) / _DRAWS)),
            "zero_sd": doubts.contact_zero_sd,
            "gain_sd": doubts.power_gain_sd,
        }

    def _machine(self) -> dict[str, float]:
        """Lags, dead time and idle power."""
        drive, tick = self.problem.drive, self.problem.sample_time
        return {
            "feed_lag": drive.feed_lag,
            "feed_delay": drive.delay_samples(tick),
            "power_lag": drive.power_lag,
            "power_pole": drive.power_pole(tick),
            "idle_power": drive.idle_power,
        }
