"""Controllers of plunge cycles: full rate, balance of damage and stock, spark-out; and the stages of an ordinary machine."""

import dataclasses
from collections.abc import Mapping
from functools import cached_property
from math import exp
from typing import Any, ClassVar

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.plunge import _control_kernels as kernels
from sdpgrind.plunge._control_kernels import Law
from sdpgrind.plunge._problem import CycleProblem

_FORMS = {"p_end": kernels.P_END, "gauge": kernels.GAUGE, "printed": kernels.PRINTED}
_NONNEGATIVE = {
    "safety_margin": "mm",
    "roundness_margin": "mm",
    "size_sd": "mm",
    "power_sd": "",
    "contact_zero_sd": "mm",
    "deflection_sd": "",
    "sharpness_sd": "",
}
REPORTS: Mapping[str, str] = {
    "section": "",
    "infeed_rate": "mm/s",
    "remaining": "mm",
    "wear_flat_area": "",
    "contact_zero": "mm",
    "deflection_scale": "",
}
"""What a controller of a cycle reports: name -> unit."""


class _Sampled:
    """What steps in compiled code once in a sample; a batch of parts runs the same code on the same state."""

    problem: CycleProblem
    reads: ClassVar[Mapping[str, str]] = {"size": "mm", "grinding_power": "W", "power_saturated": ""}
    commands: ClassVar[Mapping[str, str]] = {"command_rate": "mm/s", "balancing": "", "retract": ""}
    reports: ClassVar[Mapping[str, str]] = REPORTS

    @property
    def period(self) -> float:
        """Sample time, s."""
        return self.problem.sample_time

    @property
    def job(self) -> Mapping[str, object]:
        """What the machine must have set up: stock and diameters in mm, the greatest rate in mm/s."""
        return self.problem.job

    @cached_property
    def law(self) -> Law:
        """What the compiled core knows, in mm, s and N."""
        return self._compiled()

    def _compiled(self) -> Law:
        """Of the problem and what the controller makes of it."""
        return _law(self.problem, _final_rate(self.problem, 0.0))

    @cached_property
    def state(self) -> Floats:
        """State of the compiled core, in mm, s and N."""
        state = np.zeros(kernels.STATES)
        kernels.start_control(state, self.law)
        return state

    def reset(self) -> None:
        """Forget the part before."""
        kernels.start_control(self.state, self.law)

    def step(
        self, *, size: float, grinding_power: float = np.nan, power_saturated: float = 0.0, **others: Any
    ) -> dict[str, float]:
        """Return the command rate (mm/s) of the next sample, or ``{"retract": 1.0}``.

        Parameters
        ----------
        size : float
            Radial stock that is ground off, mm; NaN: no reading.
        grinding_power : float
            Power, W; NaN: no reading.
        power_saturated : float
            Not 0 where the power is clipped: it is not used then; unit 1.
        **others
            Whatever else the plant measures; not used.

        Returns
        -------
        dict
            ``command_rate`` (mm/s) and ``balancing`` (1 while damage and stock are balanced); or ``retract``.

        Raises
        ------
        ValueError
            When the gauge says before any feed that nothing is left to grind (mm).
        """
        command = kernels.control_step(self.state, self.law, float(size), np.nan if power_saturated else float(grinding_power))
        if self.state[kernels.SECTION] == kernels.RETRACT:
            self.check_fed()
            return {"retract": 1.0}
        return {"command_rate": float(command), "balancing": float(self.state[kernels.BALANCED])}

    def report(self) -> dict[str, float]:
        """Return what it estimates: section, rate (mm/s), remaining stock and contact zero (mm), area, scale of deflection."""
        area = self.problem.model.wear_flat_area
        s = self.state
        values = (s[kernels.SECTION], s[kernels.RATE], s[kernels.REMAINING])
        learned = (s[kernels.SHARPNESS] * area, s[kernels.ZERO], s[kernels.SCALE])
        return dict(zip(self.reports, map(float, (*values, *learned)), strict=True))

    def check_fed(self) -> None:
        """Raise ValueError where a part is done before any feed, as the gauge says that nothing is left (mm)."""
        if self.state[kernels.SECTION] == kernels.RETRACT and self.state[kernels.COMMANDED] == 0.0 and not self.lost:
            size, stock = float(self.state[kernels.SIZE]), self.problem.stock
            raise checks.refuse("size", f"< stock = {stock:g} before any feed", size, "mm")

    @property
    def lost(self) -> bool:
        """Whether the part was broken off as the size was missing, frozen or jumped for 5 samples (dimensionless)."""
        return bool(self.state[kernels.MISSED] >= kernels.MISSED_MAX)


@dataclasses.dataclass(frozen=True)
class CycleController(_Sampled, Frozen):
    """Full rate, then as fast as the damage still comes off, then spark-out: Dong, Danai and Malkin (2004), section 2.

    The structure is that of the fastest cycle (`plan`). Damage is that of the model; the stock is measured. Spark-out begins
    when the deflection that is given back leaves the final rate at size.

    With ``online`` (default) a Kalman filter learns from size and power during the part: where the wheel touched, how the
    machine really gives way, how sharp the wheel is. Then neither a wrong wear flat area nor a wrong contact zero matter much;
    a gain of the power monitor that is not known does, and has to be covered by the margin.

    Parameters
    ----------
    problem : CycleProblem
        What is ground, as it is believed to be.
    safety_margin : float
        By how much less than the remaining stock the damage may go down, mm: (7).
    sparkout : {"p_end", "gauge", "printed"}
        Spark-out begins at a command that is known beforehand (it needs the contact zero), by the measured size, or by (2) and
        (3) as printed, with a constant time constant (`problem.time_constant`).
    online : bool, optional
        Learn during the part; True unless `sparkout` is printed or the model is linear.
    no_burn : bool
        Never burn, not even what would come off again.
    roundness_margin : float
        Aim at so much less out-of-roundness, mm: noise of the gauge scatters it by some 1e-5.
    observer_gain : float
        Gain of the observer of the size (0, 1] where nothing is learned: 1 believes the gauge, unit 1.
    size_sd, power_sd : float
        Noise of the gauge, mm, and of the power monitor, relative.
    contact_zero_sd : float
        What is not known of the contact zero where power is missing, mm.
    deflection_sd, sharpness_sd : float
        What is not known of the deflection and of the wear flat area at the start, relative.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> controller = plunge.CycleController(plunge.preset("simulation"))
    >>> controller.step(size=0.0, grinding_power=0.0)
    {'command_rate': 0.0448, 'balancing': 0.0}
    """

    problem: CycleProblem
    safety_margin: float = 0.0
    _: dataclasses.KW_ONLY
    sparkout: str = "p_end"
    online: bool | None = None
    no_burn: bool = False
    roundness_margin: float = 3e-5
    observer_gain: float = 0.1
    size_sd: float = 5e-4
    power_sd: float = 0.01
    contact_zero_sd: float = 0.01
    deflection_sd: float = 0.1
    sharpness_sd: float = 0.1

    def __post_init__(self) -> None:
        checks.kind("problem", self.problem, CycleProblem, " (see plunge.preset)")
        checks.one_of("sparkout", self.sparkout, _FORMS)
        for name, unit in _NONNEGATIVE.items():
            checks.nonnegative(name, getattr(self, name), unit)
        if self.safety_margin >= self.problem.stock:
            raise checks.refuse("safety_margin", f"< stock = {self.problem.stock:g}", self.safety_margin, "mm")
        if not 0 < checks.number("observer_gain", self.observer_gain) <= 1:
            raise checks.refuse("observer_gain", "in (0, 1]", self.observer_gain)
        if self.online and not self._may_learn:
            raise checks.refuse("online", "False with sparkout='printed' or a linear model", self.online)
        _final_rate(self.problem, self.roundness_margin)

    @property
    def _may_learn(self) -> bool:
        return self.sparkout != "printed" and self.problem.model.linear_time_constant is None

    @property
    def final_rate(self) -> float:
        """Infeed rate at size that it aims at, mm/s."""
        return _final_rate(self.problem, self.roundness_margin)

    def _compiled(self) -> Law:
        model = self.problem.model
        return _law(self.problem, self.final_rate)._replace(
            form=_FORMS[self.sparkout],
            no_burn=self.no_burn,
            online=self._may_learn if self.online is None else self.online,
            safety_margin=float(self.safety_margin),
            gain=float(self.observer_gain),
            size_sd=float(self.size_sd),
            power_sd=float(self.power_sd),
            zero_sd=float(self.contact_zero_sd),
            scale_sd=float(self.deflection_sd),
            sharpness_sd=float(self.sharpness_sd),
            growth=0.0 if model.wear is None else model.wear.growth / model.wear_flat_area,
        )


@dataclasses.dataclass(frozen=True)
class StagedController(_Sampled, Frozen):
    """A rough rate, a slower rate, spark-out: the cycle of an ordinary machine.

    Parameters
    ----------
    problem : CycleProblem
        What is ground, as it is believed to be.
    stage_remaining : float, optional
        Remaining stock at which the slower rate begins, mm.
    stage_rate : float, optional
        The slower rate, mm/s. Both are the fastest of the model with the margin when left out.
    safety_margin : float
        Slack that the stages that are searched for leave, mm; of no effect where they are given.
    rough_rate : float, optional
        Rate until then, mm/s; the greatest of the problem when left out.
    final_rate : float, optional
        Infeed rate at size, at which spark-out aims, mm/s; that of the problem, which is just round enough, when left out.
    observer_gain : float
        Gain of the observer of the size, (0, 1], unit 1.
    size_sd : float
        Noise of the gauge, mm.

    Raises
    ------
    ValueError
        When a value is out of range, or only one of both is given.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> controller = plunge.StagedController(plunge.preset("simulation"))
    >>> round(controller.stage_remaining, 2), round(controller.stage_rate, 3)  # mm, mm/s
    (0.09, 0.008)
    """

    problem: CycleProblem
    stage_remaining: float | None = None
    stage_rate: float | None = None
    _: dataclasses.KW_ONLY
    safety_margin: float = 0.001
    rough_rate: float | None = None
    final_rate: float | None = None
    observer_gain: float = 0.1
    size_sd: float = 5e-4

    def __post_init__(self) -> None:
        checks.kind("problem", self.problem, CycleProblem, " (see plunge.preset)")
        for name, own in {"rough_rate": self.problem.command_rate_max, "final_rate": self.problem.final_rate}.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, own)
            checks.positive(name, getattr(self, name), "mm/s")
        checks.within("safety_margin", self.safety_margin, 0.0, 0.5 * self.problem.stock, "mm")
        checks.within("rough_rate", self.rough_rate, 0.0, self.problem.command_rate_max, "mm/s")
        if (self.stage_remaining is None) != (self.stage_rate is None):
            raise ValueError("stage_remaining and stage_rate must both be given, or none")
        if self.stage_remaining is None or self.stage_rate is None:
            from sdpgrind.plunge._stages import fastest_stages

            for name, value in zip(
                ("stage_remaining", "stage_rate"), fastest_stages(self.problem, self.safety_margin), strict=True
            ):
                object.__setattr__(self, name, value)
        checks.within("stage_remaining", self.stage_remaining, 0.0, self.problem.stock, "mm")
        checks.positive("stage_rate", self.stage_rate, "mm/s")
        checks.within("stage_rate", self.stage_rate, 0.0, self.problem.command_rate_max, "mm/s")
        if not 0 < checks.number("observer_gain", self.observer_gain) <= 1:
            raise checks.refuse("observer_gain", "in (0, 1]", self.observer_gain)

    def _compiled(self) -> Law:
        assert self.stage_remaining is not None and self.stage_rate is not None
        assert self.rough_rate is not None and self.final_rate is not None
        return staged_law(self.problem, self.stage_remaining, self.stage_rate)._replace(
            rough_rate=float(self.rough_rate), final_rate=float(self.final_rate),
            gain=float(self.observer_gain), size_sd=float(self.size_sd),
        )  # fmt: skip


def staged_law(problem: CycleProblem, remaining: float, rate: float) -> Law:
    """What the compiled core needs of a cycle of three stages, mm and mm/s."""
    law = _law(problem, _final_rate(problem, 0.0))
    return law._replace(staged=True, stage_remaining=float(remaining), stage_rate=float(rate))


def _final_rate(problem: CycleProblem, margin: float) -> float:
    model = problem.model
    least = problem.roundness_max - model.roundness_base
    if margin >= least:
        raise checks.refuse("roundness_margin", f"< roundness_max - roundness_base = {least:g}", margin, "mm")
    return float(model.turns * (least - margin) / model.roundness_gain)


def _law(problem: CycleProblem, final_rate: float) -> Law:
    """What every controller of a problem knows; nothing is learned and the gauge is believed."""
    assert problem.time_constant is not None
    return Law(
        core=problem.model.core,
        form=kernels.P_END,
        no_burn=False,
        online=False,
        sample_time=float(problem.sample_time),
        stock=float(problem.stock),
        safety_margin=0.0,
        rate_max=float(problem.command_rate_max),
        final_rate=final_rate,
        burn_rate=float(min(problem.model.burn_rate, problem.command_rate_max)),
        pole=exp(-problem.sample_time / problem.time_constant),
        time_constant=float(problem.time_constant),
        gain=1.0,
        size_sd=0.0,
        power_sd=0.0,
        zero_sd=0.0,
        scale_sd=0.0,
        sharpness_sd=0.0,
        growth=0.0,
        staged=False,
        rough_rate=float(problem.command_rate_max),
        stage_remaining=0.0,
        stage_rate=0.0,
    )
