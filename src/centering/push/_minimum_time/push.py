"""Push of minimum time with its simulation at several frictions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import Any, Self

import numpy as np
import xarray as xr

from centering._problem.model import PushModel
from centering._problem.problem import CenteringProblem
from centering.push._contact.trace import PushTrace, simulate_push
from centering.push._plan import record as plan_record
from centering.push._profile.profile import TipProfile
from sdpgrind.base import pictures
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan

_SAMPLES = 4001  # chosen: samples of the contact force; fewer miss its minimum
_SLACK = 2e-5  # mm, chosen: allowance for the tolerance of the solver in the simulated stop


class PushStatus(StrEnum):
    """Result of the search for a push; the text advises on failure. No unit."""

    OK = "found; the simulator confirms it for every friction"
    NOT_FOUND = (
        "no push keeps all bounds: allow a larger stop error, less contact force, or less spread of friction"
    )
    NOT_CONFIRMED = (
        "found, but a simulated part leaves the tip or stops too far off:"
        " ask for more contact force or finer steps"
    )


@dataclass(frozen=True, eq=False, repr=False)
class OptimalPush(ByValue, Plan):
    """Push of minimum time, with its simulation; `minimum_time_push` makes it.

    Attributes
    ----------
    problem : CenteringProblem
        Problem of the search.
    distance : float
        Wanted travel of the part, mm.
    status : PushStatus
        Result of the search.
    message : str
        Message of the solver.
    steps : int
        Iterations of the solver.
    profile : TipProfile
        Tip from first touch to retraction; `gentle_profile` where no push was found.
    friction : array, (m,)
        Simulated ratios to the friction of the problem, dimensionless.
    traces : tuple of PushTrace
        Simulation at each ratio.
    """

    kind = "centering.optimal_push"
    problem: CenteringProblem
    distance: float
    status: PushStatus
    message: str
    steps: int
    profile: TipProfile
    friction: Floats
    traces: tuple[PushTrace, ...]

    @property
    def ok(self) -> bool:
        """Whether it was found and confirmed."""
        return self.status is PushStatus.OK

    @property
    def rest_time(self) -> Floats:
        """Time from first touch until the part rests, for each friction, (m,), s."""
        return np.array([_motion(trace)[1] for trace in self.traces])

    @property
    def time(self) -> float:
        """Time from first touch until the last part rests, s."""
        return float(self.rest_time.max())

    @property
    def stop_error(self) -> Floats:
        """Final position less the wanted distance, for each friction, (m,), mm."""
        return np.array([trace.final_position for trace in self.traces]) - self.distance

    @property
    def spread(self) -> float:
        """Greatest less least stop error, mm."""
        return float(np.ptp(self.stop_error))

    @property
    def least_force(self) -> Floats:
        """Least contact force while the part moves, for each friction, (m,), N."""
        return np.array([_least_force(trace) for trace in self.traces])

    @property
    def peak_force(self) -> float:
        """Greatest contact force, N."""
        return max(trace.peak_force for trace in self.traces)

    @property
    def dataset(self) -> xr.Dataset:
        """Motion and results at every friction, labelled (mm, s, N); the whole push as attribute."""
        plain = {
            "problem": self.problem,
            "profile": self.profile,
            "message": self.message,
            "steps": self.steps,
        }
        plain |= {"distance": self.distance, "status": self.status.name}
        return plan_record.optimal_dataset(self, self.profile, self.traces, plain)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        fields = plan_record.optimal_fields(dataset)
        return cls(**fields | {"status": PushStatus[fields["status"]]})

    def plot(self) -> Any:
        """Draw the speed of the tip (mm/s) and the contact forces (N) over time (s); return the figure."""
        return pictures.drawn("centering.push._minimum_time.picture:plot_optimal", self)

    def _told(self) -> str:
        errors = f"{1e3 * self.stop_error.min():+.2f} to {1e3 * self.stop_error.max():+.2f} µm"
        told = (
            f"{self.distance:g} mm in {self.time:.4g} s, stops {errors}, force up to {self.peak_force:.1f} N"
        )
        return f"{told}; {self.status.name}"


def judged(
    problem: CenteringProblem,
    distance: float,
    ratios: Sequence[float],
    error: float,
    profile: TipProfile,
    message: str,
    steps: int,
) -> OptimalPush:
    """Simulate a profile at the given frictions, between them, and at that of the problem."""
    friction = _frictions(ratios)
    traces = tuple(simulate_push(with_friction(problem.model, r), profile) for r in friction)
    push = OptimalPush(problem, distance, PushStatus.OK, message, steps, profile, friction, traces)
    kept = all("free" not in trace.event_mode for trace in traces)
    if kept and bool(np.all(np.abs(push.stop_error) <= error + _SLACK)):
        return push
    return replace(push, status=PushStatus.NOT_CONFIRMED)


def _frictions(ratios: Sequence[float]) -> Floats:
    between = [0.5 * (a + b) for a, b in pairwise(ratios)]
    return lasting(np.unique([*ratios, *between, *([1.0] if ratios[0] < 1.0 < ratios[-1] else [])]))


def with_friction(model: PushModel, ratio: float) -> PushModel:
    """Model with both coefficients of friction times a ratio."""
    return model.replace(mu_static=ratio * model.mu_static, mu_kinetic=ratio * model.mu_kinetic)


def _motion(trace: PushTrace) -> tuple[float, float]:
    """Times of first breakaway and of final rest, s."""
    moving = [k for k, mode in enumerate(trace.event_mode) if mode in ("slip", "free")]
    return (
        (float(trace.phases[moving[0], 0]), float(trace.phases[moving[-1] + 1, 0])) if moving else (0.0, 0.0)
    )


def _least_force(trace: PushTrace) -> float:
    """Least contact force while the part moves, N."""
    begin, end = _motion(trace)
    inside = np.linspace(begin, end, _SAMPLES)[1:-1]
    return float(trace.at(inside).contact_force.values.min()) if end > begin else 0.0
