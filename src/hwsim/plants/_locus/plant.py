"""A grinder under adaptive control: commanded infeed and work speed, measured power, a wheel that dulls."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import Any, Self, TypeAlias

import numpy as np

from hwsim.devices import Gauge
from hwsim.plants._locus.dressed import DressedPart, Wheel
from hwsim.plants._locus.machine import AdaptivePart, AdaptiveRig
from sdpgrind.base import checks, stored
from sdpgrind.base.quantities import Described, custom, described, part, quantity, units_of
from sdpgrind.locus import Problem
from sdpgrind.locus.kernels import Ranges
from sdpgrind.locus.processes import DressedGrinding, Grinding

Process: TypeAlias = Grinding | DressedGrinding
Truth: TypeAlias = Process | Callable[[np.random.Generator], Process] | None
_SHORTEST = 1e-4  # shortest lag, s; chosen: shorter ones act like 0
_CONTROLS = {"infeed_rate", "work_rotation"}
_OF_DRESSING = ("dullness", "dressing_state", "dressing_lead", "roughness_gauge")


def _ground(name: str, value: object) -> Problem:
    """A problem of grinding with valid ranges: limited by burning, with a dressed wheel by roughness, too."""
    problem = checks.kind(name, value, Problem, ' (see locus.preset("grinding"))')
    dressed = isinstance(problem.model, DressedGrinding)
    if not dressed:
        _check_process("problem.model", problem.model, Grinding)
    wanted = [*sorted(_CONTROLS), "dressing_lead"] if dressed else sorted(_CONTROLS)
    if set(problem.controls) != set(wanted):
        words = f"{', '.join(wanted[:-1])} and {wanted[-1]}"
        raise checks.refuse("problem.controls", words, ", ".join(problem.controls))
    checks.positive('problem.controls["work_rotation"][0]', problem.controls["work_rotation"][0], "rad/s")
    return problem


def _check_process(name: str, process: object, wanted: type[Process]) -> Process:
    """Return a process of the kind of the problem's model."""
    known = checks.kind(name, process, wanted, f" (see locus.processes.{wanted.__name__})")
    if isinstance(known, Grinding) and known.roughness is not None:
        raise ValueError(
            f"{name}.roughness must be None: this machine has no gauge of roughness; got {known.roughness!r}"
        )
    return known


def _truth(name: str, value: Any) -> Truth:
    """A process, or a function that draws one; `_check` compares its kind with that of the model."""
    if callable(value) or isinstance(value, DressedGrinding):
        known: Truth = value
        return known
    return checks.kind(name, value, Grinding, " (see locus.processes.Grinding)")


@described()
class AdaptiveGrinder(Described):
    """Plunge grinding as fast as a dulling wheel allows without burning: plant of Koren (1989), eq. (36).

    It accepts ``infeed_rate`` (of the radius, mm/s) and ``work_rotation`` (rad/s) and holds them. The slide
    follows with a lag, the work at once. It measures ``grinding_power`` (W, without idle power, with the lag
    of the monitor), ``infeed_rate`` (of the slide, mm/s) and ``removed`` (mm of radius). Lags are solved in
    closed form, the monitor by quadrature, both exact to 1e-9 relative.

    A part begins with the slide at rest and ends when the stock is gone, to a tick. The removed depth dulls
    the wheel for the next part of the series, unless it is dressed in between: parts run one after the other.

    Outcome of a part: ``time`` (s); ``slack`` (W, least burning power minus grinding power after the
    touch-in; negative: ``burned``) and ``part_slack`` (W, the same with the touch-in, when the wheel only
    ploughs and in the model burns for a moment, at b F_pl V_s below the limit); ``convergence_time`` (s,
    first sample from which on the infeed is within 5 % of the best one; NaN: never); mean ``removal_rate``
    (mm^3/s); the stock ``remaining`` (mm); ``timed_out``; the hidden ``true_wear_flat_area`` at the end. By
    sample (s, mm/s, W): ``sample_time``, ``true_infeed_rate``, ``best_infeed_rate`` (NaN where every point
    burns), ``true_grinding_power`` and ``burning_power``.

    With a `locus.processes.DressedGrinding` it also accepts ``dressing_lead`` (mm), which counts when the
    wheel is dressed, and not afterwards: before each part, or with `dress_at` before the first and after
    parts that leave a dull wheel. It also measures ``dressing_lead`` (mm, of the wheel; NaN before it is
    dressed) and, once, when the part is ground, ``roughness`` (mm). The outcome also has the true
    ``roughness``, ``roughness_slack`` (greatest minus true roughness) and ``dressing_lead`` (all mm).

    Parameters
    ----------
    problem : locus.Problem
        Problem with the believed process and the ranges of the machine.
    truth : locus.processes.Grinding, DressedGrinding or callable, optional
        True process, or a function of a Generator that draws it for each part. None: the problem's model.
    wear_flat_area : float
        Wear flat area before the first part, 0..1; of a wheel that is not dressed before.
    dulling : float
        Increase of the wear flat area for each mm of radius ground off, 1/mm.
    dress_at, dressed_area : float
        Wear flat areas at which the wheel is dressed after a part, and after dressing, 0..1. None: never;
        with a dressed wheel before each part. A dressed wheel has its area from lead and dullness.
    dullness, dressing_state : float
        Hidden states of a dressed wheel, after dressing, unit 1.
    dressing_lead : float, optional
        Lead of the wheel before the first part, mm. None: it is dressed then.
    roughness_gauge : devices.Gauge, optional
        Noise and step of the roughness gauge, mm. None: exact.
    stock : float
        Stock, mm of radius.
    infeed_lag, power_lag : float
        Time constants of slide and power monitor, s. 0: none.
    power_gauge : devices.Gauge
        Noise and step of the monitor, W.
    idle_error : float
        Constant offset of the measured power, W.
    touch_in : float
        Initial time that ``slack`` leaves out, s.
    max_time : float
        Time limit for one part, s.
    tick : float
        Time step, s.

    Raises
    ------
    ValueError
        When a value is out of range, a command cannot be carried out, or the process has limits other than
        burning; for a value of dressing where the wheel is not dressed.
    TypeError
        When the problem's model is no process of grinding, or the truth another one than the model.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import locus
    >>> class Steady:
    ...     period = 0.5  # s
    ...     def reset(self): ...
    ...     def step(self, *, grinding_power, **measured):
    ...         return {"infeed_rate": 0.015, "work_rotation": 10.4}
    >>> log = hwsim.run(hwsim.AdaptiveGrinder(locus.preset("grinding")), Steady(), parts=2)
    >>> log.outcome.slack.values.round(1)  # W: a wheel that dulls burns
    array([ -6.9, -15.3])
    >>> log.outcome.true_wear_flat_area.values.round(6)
    array([0.0061, 0.0062])

    Roughness is the second limit, read once a part; the wheel is dressed before each:

    >>> problem = locus.preset("grinding-roughness")
    >>> controller = locus.AreaController(locus.plan(problem), per_part="dressing_lead", period=0.5)
    >>> grinder = hwsim.AdaptiveGrinder(problem, dullness=1.2, dressing_state=1.0)
    >>> log = hwsim.run(grinder, controller, parts=2, adapt=locus.LearnedStart())
    >>> (1e3 * log.outcome.roughness_slack.values).round(2)  # um
    array([0.23, 0.14])
    """

    problem: Problem = custom(_ground)
    _: KW_ONLY
    truth: Truth = custom(_truth, default=None)
    wear_flat_area: float = quantity("1", above=0, at_most=1, default=0.006)
    dulling: float = quantity("1/mm", at_least=0, default=1e-4 / 0.3)
    dress_at: float | None = quantity("1", default=None)
    dressed_area: float = quantity("1", above=0, at_most=1, default=0.006)
    stock: float = quantity("mm", above=0, usual=(1e-3, 250.0), typical=0.3, default=0.3)
    infeed_lag: float = quantity("s", at_least=0, default=1.25)
    power_lag: float = quantity("s", at_least=0, default=0.2)
    power_gauge: Gauge = part(Gauge, " (see hwsim.devices)", default_factory=Gauge)
    idle_error: float = quantity("W", default=0.0)
    touch_in: float = quantity("s", at_least=0, default=3.0)
    max_time: float = quantity("s", above=0, default=1200.0)
    tick: float = quantity("s", above=0, default=0.01)
    dullness: float = quantity("1", above=0, default=1.0)
    dressing_state: float = quantity("1", above=0, default=1.0)
    dressing_lead: float | None = quantity("mm", above=0, default=None)
    roughness_gauge: Gauge | None = part(Gauge, " (see hwsim.devices)", default=None)

    def _check(self) -> None:
        for name, lag in (("infeed_lag", self.infeed_lag), ("power_lag", self.power_lag)):
            if 0 < lag < _SHORTEST:
                raise self._refused(name, f"0 or >= {_SHORTEST:g}")
        self._check_dressing()
        if not (self.truth is None or callable(self.truth)):
            _check_process("truth", self.truth, type(self.problem.model))

    def _check_dressing(self) -> None:
        if self._dresses:
            if self.dressing_lead is not None:
                low, high = self.problem.controls["dressing_lead"]
                if not low <= self.dressing_lead <= high:
                    raise self._refused("dressing_lead", f"in [{low:g}, {high:g}]")
            return
        if self.dress_at is not None and not self.dress_at > self.dressed_area:
            raise self._refused("dress_at", f"> dressed_area = {self.dressed_area:g}")
        for name in _OF_DRESSING:
            if getattr(self, name) != self._declared[name].default:
                raise self._refused(name, "left out where dressing_lead is no control of the problem")

    @property
    def _dresses(self) -> bool:
        return isinstance(self.problem.model, DressedGrinding)

    @property
    def _lead(self) -> dict[str, str]:
        """Name of the lead to its unit."""
        return {"dressing_lead": units_of(type(self))["dressing_lead"]}

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        always = {"grinding_power": "W", "infeed_rate": "mm/s", "removed": "mm"}
        return {**always, "roughness": "mm", **self._lead} if self._dresses else always

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands."""
        always = {"infeed_rate": "mm/s", "work_rotation": "rad/s"}
        return {**always, **self._lead} if self._dresses else always

    @property
    def safe(self) -> Mapping[str, float]:
        """Command that stops the infeed (mm/s), at any moment."""
        return {"infeed_rate": 0.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command (mm/s, rad/s)."""
        most, low, high = self._ranges
        return {"infeed_rate": (0.0, most), "work_rotation": (low, high)}

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit of the outcomes, with the dimension of those by sample."""
        part = {
            "time": "s",
            "slack": "W",
            "part_slack": "W",
            "burned": "",
            "convergence_time": "s",
            "removal_rate": "mm^3/s",
        }
        end = {"remaining": "mm", "timed_out": "", "true_wear_flat_area": ""}
        rates = {"sample_time": "s", "true_infeed_rate": "mm/s", "best_infeed_rate": "mm/s"}
        samples = {**rates, "true_grinding_power": "W", "burning_power": "W"}
        rough = {"roughness": "mm", "roughness_slack": "mm", **self._lead} if self._dresses else {}
        return {**part, **end, **{name: (unit, "sample") for name, unit in samples.items()}, **rough}

    @property
    def description(self) -> Mapping[str, float | str]:
        """Stock (mm), touch-in (s), ranges (mm/s, rad/s), the process unless user-defined, for the log."""
        plain = {"stock": self.stock, "touch_in": self.touch_in, **self._ranges._asdict()}
        try:
            return {**plain, "process": stored.encode(self.problem.model)}
        except TypeError:  # a sliding law of one's own
            return plain

    @property
    def job(self) -> Mapping[str, object]:
        """Wheel and work (mm, mm/s) of the problem; `truth` may differ."""
        return dict(self.problem.model.job)

    @property
    def _ranges(self) -> Ranges:
        low, high = self.problem.controls["work_rotation"]
        return Ranges(float(self.problem.controls["infeed_rate"][1]), float(low), float(high))

    def with_tick(self, tick: float) -> Self:
        """Return the same plant with another `tick` (s)."""
        return self.replace(tick=tick)

    def after(self, outcome: Mapping[str, Any]) -> Self:
        """Return the plant after a part of this `outcome` (in its units), its wheel duller or dressed."""
        area = min(1.0, float(outcome["true_wear_flat_area"]))
        if self._dresses:
            kept = self.dress_at is not None and area < self.dress_at
            lead = float(outcome["dressing_lead"])
            return self.replace(wear_flat_area=area, dressing_lead=lead if kept else None)
        dressed = self.dress_at is not None and area >= self.dress_at
        return self.replace(wear_flat_area=self.dressed_area if dressed else area)

    def start(self, rng: np.random.Generator) -> AdaptivePart:
        """Draw truth and noise of the next part from children of `rng`; return it at time 0 s."""
        of_truth, of_noise = rng.spawn(2)
        process: Process = self.problem.model if self.truth is None else self._drawn(of_truth)
        rig = AdaptiveRig(*(getattr(self, name) for name in AdaptiveRig._fields))
        if isinstance(process, DressedGrinding):
            return DressedPart(rig, process, self._wheel, self._ranges, of_noise)
        return AdaptivePart(rig, process, self._ranges, of_noise)

    def _drawn(self, rng: np.random.Generator) -> Process:
        if callable(self.truth):
            return _check_process("truth(rng)", self.truth(rng), type(self.problem.model))
        assert self.truth is not None
        return self.truth

    @property
    def _wheel(self) -> Wheel:
        leads = self.problem.controls["dressing_lead"]
        gauge = Gauge() if self.roughness_gauge is None else self.roughness_gauge
        return Wheel(self.dullness, self.dressing_state, self.dressing_lead, leads, gauge)
