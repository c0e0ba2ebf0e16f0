"""One bead on the stand: passes, scans, the hidden truth of each pass."""

from collections.abc import Mapping
from math import nan
from typing import Any, NamedTuple

import numpy as np

from hwsim._part.clock import Clock, simplest
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.weldbead import CoefficientScatter, GrindingProcess, Scatter, SequenceProblem
from sdpgrind.weldbead.kernels import PassCoefficients, blamed, grinding_power

_AGREE = 1e-9  # relative; chosen: above the rounding of feed rates and forces
_BURNS = 1e-6  # excess over the burn limit, W or N; chosen: a pass planned on the limit does not burn
OF_PASS = ("grinding_power", "normal_force", "tangential_force", "removal_rate", "feed_rate", "cut_depth")


class WeldBeadSetup(NamedTuple):
    """The bead before its first pass, with the truth of process and scatter."""

    problem: SequenceProblem
    process: GrindingProcess  # true process of this bead
    scatter: Scatter  # of the depth
    pass_scatter: CoefficientScatter | None  # of the coefficients instead
    height: float  # mm
    time: float  # s until the deadline


class Noise(NamedTuple):
    """Standard deviations of the readings."""

    height: float  # mm
    power: float  # W
    force: float  # N


class Pass(NamedTuple):
    """A commanded pass."""

    ticks: int
    feed_rate: float  # mm/s
    normal_force: float  # N


class WeldBead:
    """A bead under the grinder (`hwsim.protocols.Machine`)."""

    def __init__(
        self,
        setup: WeldBeadSetup,
        sd: Noise,
        clock: Clock,
        cuts: np.random.Generator,
        noise: np.random.Generator,
    ) -> None:
        self.time, self.done, self.event = 0, False, False
        self._problem, self._process = setup.problem, setup.process
        self._scatter, self._pass_scatter = setup.scatter, setup.pass_scatter
        self._sd, self._clock, self._cuts, self._noise = sd, clock, cuts, noise
        self._deadline = simplest(setup.time)
        self._height = float(setup.height)
        self._under_way: Pass | None = None
        self._ticks_left = 0
        self._finish = 0.0  # finish charge of the last deep enough pass, $
        self._burned = 0
        self._truth: list[tuple[float, PassCoefficients]] = []
        self._scan = self._scanned()
        self._of_pass = dict.fromkeys(OF_PASS, nan)

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, float]:
        """Begin the commanded pass, advance by at most `ticks`, measure."""
        if command:
            self._take(command)
        if ticks and not self.done:
            self._advance(ticks)
        return {"height": self._scan, "time_left": self._time_left(), **self._of_pass}

    def _take(self, command: Mapping[str, Any]) -> None:
        if command.get("stop"):
            self._break_off()
            self.done = True
        elif self._under_way is not None:
            raise ValueError(f"a command must wait for the end of the pass; got {dict(command)!r} during it")
        elif command.keys() - {"stop"}:
            self._under_way = self._checked(command)
            self._ticks_left = self._under_way.ticks

    def _checked(self, command: Mapping[str, Any]) -> Pass:
        """Refuse a pass that the stand cannot do."""
        problem = self._problem
        if "normal_force" not in command:
            raise ValueError(
                f"a pass needs normal_force (N) and duration (s) or feed_rate (mm/s); got {dict(command)!r}"
            )
        force = checks.positive("normal_force", command["normal_force"], "N")
        if force > problem.force_max * (1 + _AGREE):
            raise checks.refuse("normal_force", f"<= force_max = {problem.force_max:g}", force, "N")
        duration, feed_rate = self._duration_and_feed(command)
        ticks = self._clock.nearest(duration)
        if problem.lateness_charge is None and ticks * self._clock.tick > self._deadline - self._elapsed():
            rule = f"<= the {self._time_left():g} left before the fixed deadline"
            raise checks.refuse("duration", rule, duration, "s")
        return Pass(ticks, feed_rate, force)

    def _duration_and_feed(self, command: Mapping[str, Any]) -> tuple[float, float]:
        problem = self._problem
        if "feed_rate" not in command and "duration" not in command:
            raise ValueError(f"a pass needs duration (s) or feed_rate (mm/s); got {dict(command)!r}")
        if "duration" not in command:
            feed_rate = checks.positive("feed_rate", command["feed_rate"], "mm/s")
            return float(problem.duration(feed_rate)), feed_rate
        duration = checks.number("duration", command["duration"], "s")
        if duration <= problem.reset_time:
            raise checks.refuse("duration", f"> reset_time = {problem.reset_time:g}", duration, "s")
        needed = problem.feed_rate(duration)
        feed_rate = checks.positive("feed_rate", command.get("feed_rate", needed), "mm/s")
        if abs(problem.duration(feed_rate) - duration) > _AGREE * duration:
            rule = (
                f"{needed:g} to do this bead of {problem.bead_length:g} mm in {duration:g} s, "
                f"reset {problem.reset_time:g} s"
            )
            raise checks.refuse("feed_rate", rule, feed_rate, "mm/s")
        return duration, feed_rate

    def _advance(self, ticks: int) -> None:
        self.event = False
        if self._under_way is None:
            self.time += ticks if ticks < FOREVER else 0  # idle; for ever would be for ever
            return
        moved = min(ticks, self._ticks_left)
        self.time += moved
        self._ticks_left -= moved
        if not self._ticks_left:
            self._finish_pass(self._under_way)
            self._under_way, self.event = None, True

    def _break_off(self) -> None:
        """Lift the wheel within a pass: what lies behind it is ground, the mean height falls by its share."""
        if (broken := self._under_way) is not None:
            cut, _ = self._drawn(broken.normal_force, broken.feed_rate)
            self._height -= cut * (1 - self._ticks_left / broken.ticks)
            self._under_way = None

    def _finish_pass(self, done: Pass) -> None:
        cut, truth = self._drawn(done.normal_force, done.feed_rate)
        self._truth.append((cut, truth))
        self._height -= cut
        self._charge(done)
        before, self._scan = self._scan, self._scanned()
        self._of_pass = self._sensed(done, truth, before - self._scan)

    def _drawn(self, force: float, feed: float) -> tuple[float, PassCoefficients]:
        """Depth (mm) of a pass and the coefficients behind it."""
        if self._pass_scatter is None:
            cut = float(self._scatter.cut(self._process, force, feed).sample(self._cuts))
            return cut, blamed(self._scatter, self._process, force, feed, cut)
        now = self._pass_scatter.drawn(self._process, self._cuts)
        truth = PassCoefficients(now.specific_energy, now.idle_power, now.friction_ratio)
        return float(now.mean_cut(force, feed)), truth

    def _charge(self, done: Pass) -> None:
        """Add finish charge and burn of the commanded pass."""
        problem = self._problem
        pass_ = done.normal_force, done.feed_rate
        if problem.finish_charge is not None:
            mean_cut = float(problem.scatter.expected(problem.model).mean_cut(*pass_))
            if mean_cut >= problem.min_cut * (1 - _AGREE):
                self._finish = float(problem.finish_charge(done.feed_rate))
        if problem.burn_limit is not None:
            self._burned += float(problem.burn_limit.margin(self._process, *pass_)) < -_BURNS

    def _scanned(self) -> float:
        return self._height + self._sd.height * float(self._noise.standard_normal())

    def _sensed(self, done: Pass, truth: PassCoefficients, cut: float) -> dict[str, float]:
        """Measurements of the last pass; `cut` is the difference of its scans, mm."""
        power, normal, tangential = self._noise.standard_normal(3).tolist()
        force_noise = self._sd.force
        true_power = grinding_power(self._process, truth, done.normal_force)
        return {
            "grinding_power": true_power + self._sd.power * power,
            "normal_force": done.normal_force + force_noise * normal,
            "tangential_force": truth.friction_ratio * done.normal_force + force_noise * tangential,
            "removal_rate": cut * self._process.bead_width * done.feed_rate,
            "feed_rate": done.feed_rate,
            "cut_depth": cut,
        }

    def _elapsed(self) -> Any:
        return self.time * self._clock.tick

    def _time_left(self) -> float:
        return float(self._deadline - self._elapsed())

    def outcome(self) -> dict[str, Any]:
        """Result of the bead; see the stand."""
        problem = self._problem
        lateness = max(0.0, -self._time_left())
        penalty = (
            float(problem.height_charge(self._height)) + self._finish + problem.pass_charge * len(self._truth)
        )
        if problem.lateness_charge is not None:
            penalty += float(np.asarray(problem.lateness_charge(np.asarray(lateness))))
        return {
            "penalty": penalty,
            "height": self._height,
            "overground": max(0.0, -self._height),
            "passes": len(self._truth),
            "time": float(self._elapsed()),
            "lateness": lateness,
            "burned": self._burned,
            "true_cut_depth": [cut for cut, _ in self._truth],
            "true_specific_energy": [truth.specific_energy for _, truth in self._truth],
            "true_idle_power": [truth.idle_power for _, truth in self._truth],
            "true_friction_ratio": [truth.friction_ratio for _, truth in self._truth],
        }
