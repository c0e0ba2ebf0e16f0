"""A plunge grinder: a wheel fed into a turning work, a power monitor, a size gauge, a stepper."""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import Any, TypeAlias

import numpy as np

from hwsim.plants._plunge.inspection import Inspection
from hwsim.plants._plunge.machine import PlungePart
from sdpgrind.base import checks, stored
from sdpgrind.base.quantities import Described, choice, described, flag, part, quantity
from sdpgrind.plunge import CycleProblem, Drive, PlungeModel, kernels

Truth: TypeAlias = PlungeModel | Callable[[np.random.Generator], PlungeModel] | None
_MONITORS = (5.0, 1e6)  # chosen: ranges of power monitors, W; below, kilowatts are meant
_LONGEST = 10.0  # default time limit in cycles at the final rate; chosen: longer than any useful cycle


@described()
class GrinderNoise(Described):
    """Noise of the gauges of a `PlungeGrinder`.

    Parameters
    ----------
    size_sd : float
        Standard deviation of the size gauge, mm.
    power_sd : float
        Standard deviation of the power monitor, relative.

    Raises
    ------
    ValueError
        When a value is negative.

    Examples
    --------
    >>> GrinderNoise(size_sd=0.001)  # mm
    GrinderNoise(size_sd=0.001 mm)
    """

    size_sd: float = quantity("mm", at_least=0, usual=(0.0, 0.1), typical=5e-4, default=0.0005)
    power_sd: float = quantity("1", at_least=0, at_most=0.5, default=0.01)


def _written(problem: CycleProblem) -> dict[str, str]:
    """The problem as text; empty with a user's own sliding law."""
    try:
        return {"problem": stored.encode(problem)}
    except TypeError:
        return {}


@described()
class PlungeGrinder(Described):
    """A bore or a shaft on a plunge grinder: Dong, Danai and Malkin (2004), section 4.

    Each sample it measures ``size`` (removed radial stock, mm), ``grinding_power`` (W) and
    ``power_saturated`` (1: the monitor is at its end), and accepts ``command_rate`` (mm/s), ``balancing`` (1:
    the controller balances damage and stock; these samples make the ``slack``) and ``retract``.

    Outcome of a part: ``time`` (s); ``slack`` (mm, least remaining stock minus burn depth while balancing;
    NaN: no balancing or no damage), ``part_slack`` (mm, the same of all samples with damage; ``burned``:
    below -1 nm; NaN: no damage), ``roundness`` (mm) and ``out_of_round`` (1: beyond the limit), the stock
    ``remaining`` (mm), ``unfinished`` (1: more than 2 % of it remain), ``timed_out``, and the hidden
    ``true_wear_flat_area`` at the end and ``true_contact_zero`` (mm); ``reserve`` (rise of ln of the
    temperature that would damage the finished surface) and ``severity`` (exp of minus that).

    Parameters
    ----------
    problem : CycleProblem
        Part and machine as believed.
    truth : PlungeModel or callable, optional
        True model, or a function of a Generator that draws it for each part. None: the problem's model.
    noise : GrinderNoise, optional
        Noise of the gauges (mm, relative). None: none.
    dynamics : {"nonlinear", "first_order"}
        Deflection of the machine: by the force, or infeed rate times the time constant of the problem.
    drive : Drive, optional
        Lag, dead time and step of the feed, lag of the power monitor, idle power. None: the problem's.
    contact_zero_sd : float
        Standard deviation of the contact position from part to part, mm.
    power_gain_sd, threshold_scatter : float
        Relative standard deviations, from part to part, of the gain of the power monitor and of the burn
        threshold B.
    inspection : Inspection, optional
        Inspection of each part; adds ``burned_reading`` and ``severity_reading`` to the outcome.
    power_gain, power_max, power_lag : float
        Gain of the power monitor, unit 1; its range, W; its time constant, s (0: the drive's).
    size_offset : float
        Constant offset of the size gauge (reading minus true size), mm.
    size_delay : bool
        Whether the size gauge is one sample late.
    command_quantum : float
        Step of the feed, mm; rests are fed later. 0: the drive's.
    max_time : float, optional
        Time limit for one part, s. Default: 10 * stock / final_rate.

    Raises
    ------
    ValueError
        When a value is out of range, or a command cannot be carried out.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem, noise=None), plunge.CycleController(problem))
    >>> log.outcome.time.values, log.outcome.burned.values  # s; the fastest is 12.02
    (array([12.08]), array([0.]))
    """

    problem: CycleProblem = part(CycleProblem, " (see plunge.preset)")
    _: KW_ONLY
    truth: Truth = part(PlungeModel, ", a function of rng, or None", or_function=True, default=None)
    noise: GrinderNoise | None = part(GrinderNoise, default_factory=GrinderNoise)
    dynamics: str = choice("nonlinear", "first_order", default="nonlinear")
    drive: Drive | None = part(Drive, default=None)
    contact_zero_sd: float = quantity("mm", at_least=0, usual=(0.0, 1.0), typical=0.01, default=0.0)
    power_gain_sd: float = quantity("1", at_least=0, at_most=0.5, default=0.0)
    threshold_scatter: float = quantity("1", at_least=0, at_most=0.5, default=0.0)
    inspection: Inspection | None = part(Inspection, default=None)
    power_gain: float = quantity("1", above=0, default=1.0)
    power_max: float = quantity("W", above=0, usual=_MONITORS, typical=3000, default=math.inf)
    power_lag: float = quantity("s", at_least=0, default=0.0)
    size_offset: float = quantity("mm", default=0.0)
    size_delay: bool = flag(default=False)
    command_quantum: float = quantity("mm", at_least=0, usual=(0.0, 0.5), typical=0.001, default=0.0)
    max_time: float | None = quantity("s", above=0, default=None)

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        return {"size": "mm", "grinding_power": "W", "power_saturated": ""}

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands."""
        return {"command_rate": "mm/s", "balancing": "", "retract": ""}

    @property
    def safe(self) -> Mapping[str, float]:
        """Command that retracts the wheel, at any moment; unit 1."""
        return {"retract": 1.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command (mm/s)."""
        most = float(self.problem.command_rate_max)
        return {"command_rate": (0.0, most), "balancing": (0.0, 1.0), "retract": (0.0, 1.0)}

    @property
    def outcomes(self) -> Mapping[str, str]:
        """Name -> unit of the outcomes."""
        lengths = {
            "slack": "mm",
            "part_slack": "mm",
            "roundness": "mm",
            "burned": "",
            "out_of_round": "",
            "remaining": "mm",
        }
        return {
            "time": "s",
            **lengths,
            "unfinished": "",
            "timed_out": "",
            "true_wear_flat_area": "",
            "true_contact_zero": "mm",
            "reserve": "",
            "severity": "",
            **({} if self.inspection is None else {"burned_reading": "", "severity_reading": ""}),
        }

    @property
    def description(self) -> Mapping[str, float | str]:
        """Stock (mm), limits (mm, mm/s), errors of the inspection, problem unless it has a user's own law."""
        p = self.problem
        rates = {"command_rate_max": float(p.command_rate_max), "burn_rate": float(p.model.burn_rate)}
        return {"stock": float(p.stock), "roundness_max": float(p.roundness_max), **rates,
                **self._errors(), **_written(p)}  # fmt: skip

    def _errors(self) -> dict[str, float]:
        inspection = self.inspection
        names = () if inspection is None else ("miss", "false_alarm", "severity_sd")
        return {name: float(getattr(inspection, name)) for name in names}

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine (mm, mm/s, s) of the problem; `truth` may differ."""
        return self.problem.job

    @property
    def tick(self) -> float:
        """Sample time of the gauges, s."""
        return self.problem.sample_time

    def start(self, rng: np.random.Generator) -> PlungePart:
        """Draw the truth of the next part from a child of `rng`, its noise from another; return it at 0 s."""
        of_truth, of_noise, of_inspection = rng.spawn(3)
        model = self._drawn(of_truth)
        contact, gain, threshold = of_truth.standard_normal(3)
        model = self._scattered(model, self.threshold_scatter * float(threshold))
        rig = kernels.driven(
            kernels.rig(model, self.problem.stock, self.tick, self._samples_max), self._own_drive()
        )._replace(
            contact_zero=self.contact_zero_sd * float(contact),
            power_gain=self.power_gain * math.exp(self.power_gain_sd * float(gain)),
            **self._gauges(),
        )
        return PlungePart(self.problem, model, rig, of_noise, self._inspected(of_inspection))

    def _gauges(self) -> dict[str, Any]:
        """Fields of the rig that are the gauges'."""
        noise = GrinderNoise(0.0, 0.0) if self.noise is None else self.noise
        return {
            "size_sd": float(noise.size_sd),
            "size_offset": float(self.size_offset),
            "size_delay": bool(self.size_delay),
            "power_sd": float(noise.power_sd),
            "power_max": float(self.power_max),
        }

    def _own_drive(self) -> Drive:
        """Feed drive and power monitor, with the lag and step that the plant overrides."""
        drive = self.problem.drive if self.drive is None else self.drive
        own = {name: getattr(self, name) for name in ("power_lag", "command_quantum")}
        changed = {name: value for name, value in own.items() if value}
        return drive.replace(**changed) if changed else drive

    def _inspected(self, rng: np.random.Generator) -> Callable[[float], dict[str, float]]:
        """Readings of an inspection by the reserve of a part."""
        inspection = self.inspection
        return lambda reserve: {} if inspection is None else inspection.read(reserve, rng)

    @staticmethod
    def _scattered(model: PlungeModel, moved: float) -> PlungeModel:
        if moved == 0.0:
            return model
        return model.replace(burning=model.burning.replace(B=model.burning.B * math.exp(moved)))

    def _drawn(self, rng: np.random.Generator) -> PlungeModel:
        truth = self.problem.model if self.truth is None else self.truth
        model = (
            truth if isinstance(truth, PlungeModel) else checks.kind("truth(rng)", truth(rng), PlungeModel)
        )
        if self.dynamics == "first_order":
            return model.replace(linear_time_constant=self.problem.time_constant)
        return model

    @property
    def _samples_max(self) -> int:
        longest = self.max_time
        if longest is None:
            longest = (
                _LONGEST * self.problem.stock / min(self.problem.final_rate, self.problem.command_rate_max)
            )
        return math.ceil(longest / self.tick)
