"""A stand that grinds a weld bead in whole passes, with one draw of the removed depth a pass."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import Any, TypeAlias

import numpy as np

from hwsim._part.clock import Clock, common_tick
from hwsim.plants._weldbead.machine import Noise, WeldBead, WeldBeadSetup
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described, part, quantity, units_of
from sdpgrind.weldbead import GrindingProcess, SequenceProblem
from sdpgrind.weldbead.kernels import NOISES

Truth: TypeAlias = GrindingProcess | SequenceProblem | Callable[[np.random.Generator], Any] | None
# s, chosen: passes last whole milliseconds, or whole ticks where the stage needs finer ones
_RESOLUTION = 1e-3


def _checked_truth(name: str, truth: Any) -> Any:
    if truth is not None and not isinstance(truth, GrindingProcess | SequenceProblem) and not callable(truth):
        raise TypeError(
            f"{name} must be None, a GrindingProcess, a SequenceProblem or a function of rng; "
            f"got {checks.shown(truth)}"
        )
    return truth


@described()
class WeldBeadStand(Described):
    """A weld bead under a grinder: each pass removes a random depth of it, as the planner assumes.

    A pass is one event, after which the bead is scanned. Time runs while a pass is ground and the grinder
    returns (``reset_time``), never while a controller thinks.

    Measures ``height`` (mm, scanned), ``time_left`` (s, < 0: late), and of the last pass (NaN before the
    first) ``grinding_power`` (W), ``normal_force`` and ``tangential_force`` (N), ``removal_rate`` (mm^3/s)
    and ``cut_depth`` (mm), both from the two scans, and ``feed_rate`` (mm/s). Accepts ``normal_force`` (N)
    with ``duration`` (s, reset included), ``feed_rate`` (mm/s) or both, and ``stop``.

    Outcome of a bead: ``penalty`` ($: height, lateness, finish and pass charges), final ``height`` (mm),
    ``overground`` (mm), ``passes``, ``time`` (s), ``lateness`` (s), ``burned`` (passes beyond the burn
    limit), and the hidden truth of each pass: ``true_cut_depth`` (mm), ``true_specific_energy`` (J/mm^3),
    ``true_idle_power`` (W) and ``true_friction_ratio`` of the process whose static cut is the removed depth.

    Parameters
    ----------
    problem : SequenceProblem
        Bead, limits and charges as believed.
    truth : GrindingProcess, SequenceProblem or callable, optional
        True process, a problem with the true process and scatters, or a function of a Generator that draws
        one of them for each bead. None: process and scatters of the problem. A `bead_scatter` draws the
        process of each bead, and the coefficients of each pass about it; without one the depth is drawn, for
        which the plan is exact.
    height : float, optional
        Initial height of the bead, mm. Default: 0.75 ``height_max``.
    time : float, optional
        Time until the deadline at the start, s. Default: half the horizon.
    height_noise : float
        Standard deviation of the scanned mean height, mm.
    power_noise : float
        Standard deviation of the measured power, W.
    force_noise : float
        Standard deviation of the measured forces, N.

    Raises
    ------
    ValueError
        When a value is out of range, or a command cannot be carried out (a force above ``force_max``, a pass
        beyond a fixed deadline, a duration that contradicts the feed rate).

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), height=1.0, time=20.0, height_noise=0.0)
    >>> bead = stand.start(np.random.default_rng(1))
    >>> bead.step({}, 0)["height"]
    1.0
    >>> scan = bead.step({"duration": 8.0, "normal_force": 30.0}, hwsim.protocols.FOREVER)
    >>> scan["time_left"], scan["feed_rate"], bead.outcome()["passes"]
    (12.0, 8.333333333333334, 1)
    """

    problem: SequenceProblem = part(SequenceProblem)
    _: KW_ONLY
    truth: Truth = custom(_checked_truth, default=None)
    height: float | None = quantity("mm", default=None)
    time: float | None = quantity("s", default=None)
    height_noise: float = quantity("mm", at_least=0, usual=NOISES, typical=0.002, default=0.002)
    power_noise: float = quantity("W", at_least=0, default=5.0)
    force_noise: float = quantity("N", at_least=0, default=0.5)

    def _check(self) -> None:
        if self.problem.lateness_charge is None and self.start_time < 0:
            raise self._refused("time", ">= 0")

    @property
    def start_height(self) -> float:
        """Initial height of the bead, mm."""
        return 0.75 * self.problem.height_max if self.height is None else self.height

    @property
    def start_time(self) -> float:
        """Time until the deadline at the start, s."""
        return 0.5 * self.problem.horizon if self.time is None else self.time

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        return {
            "height": units_of(type(self))["height"],
            "time_left": "s",
            "grinding_power": "W",
            "normal_force": "N",
            "tangential_force": "N",
            "removal_rate": "mm^3/s",
            "feed_rate": "mm/s",
            "cut_depth": "mm",
        }

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands: a pass, and ``stop``."""
        return {"duration": "s", "feed_rate": "mm/s", "normal_force": "N", "stop": ""}

    @property
    def safe(self) -> Mapping[str, float]:
        """Command that lifts the wheel, at any moment; unit 1."""
        return {"stop": 1.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command (N)."""
        return {"normal_force": (0.0, float(self.problem.force_max)), "stop": (0.0, 1.0)}

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit (and dimension of arrays) of the outcomes."""
        own = units_of(type(self))
        return {
            "penalty": "$",
            "height": own["height"],
            "overground": "mm",
            "passes": "",
            "time": own["time"],
            "lateness": "s",
            "burned": "",
            "true_cut_depth": ("mm", "pass"),
            "true_specific_energy": ("J/mm^3", "pass"),
            "true_idle_power": ("W", "pass"),
            "true_friction_ratio": ("", "pass"),
        }

    @property
    def description(self) -> Mapping[str, float | str]:
        """Start and size of the bead, in mm, s, N, for the log."""
        problem = self.problem
        return {
            "start_height": float(self.start_height),
            "start_time": float(self.start_time),
            "bead_length": float(problem.bead_length),
            "bead_width": float(problem.model.bead_width),
            "reset_time": float(problem.reset_time),
            "force_max": float(problem.force_max),
        }

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine (mm, s, N) of the problem; `truth` may differ."""
        return self.problem.job

    @property
    def tick(self) -> float:
        """One millisecond, or a finer tick (s) that divides the problem's stage."""
        return float(self._clock.tick)

    @property
    def _clock(self) -> Clock:
        return Clock(common_tick({"stage": self.problem.stage, "resolution": _RESOLUTION}))

    def start(self, rng: np.random.Generator) -> WeldBead:
        """Draw the truth of the next bead from `rng` and return it at time 0 s.

        Truth, cuts and noise draw from a child each: controllers are compared on equal draws.
        """
        of_truth, of_cuts, of_noise = rng.spawn(3)
        process, told = self._drawn(self.truth, of_truth)
        setup = WeldBeadSetup(
            self.problem, process, told.scatter, told.pass_scatter, self.start_height, self.start_time
        )
        noise = Noise(self.height_noise, self.power_noise, self.force_noise)
        return WeldBead(setup, noise, self._clock, of_cuts, of_noise)

    def _drawn(self, truth: Any, rng: np.random.Generator) -> tuple[GrindingProcess, SequenceProblem]:
        """Process of the next bead, and the problem that tells how its passes scatter."""
        if isinstance(truth, GrindingProcess):
            return truth, self.problem
        if callable(truth):
            return self._drawn(_checked_draw(truth(rng)), rng)
        problem = self.problem if truth is None else truth
        beads = problem.bead_scatter
        return problem.model if beads is None else beads.drawn(problem.model, rng), problem


def _checked_draw(truth: Any) -> Any:
    if not isinstance(truth, GrindingProcess | SequenceProblem):
        raise TypeError(
            f"truth(rng) must give a GrindingProcess or a SequenceProblem; got {checks.shown(truth)}"
        )
    return truth
