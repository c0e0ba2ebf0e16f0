"""The fastest push that keeps contact and stops near enough for every friction in a range; the simulator has the last word."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from math import sqrt
from typing import Any

import numpy as np

from centering._push.gentle import gentle_profile
from centering._push.model import PushModel
from centering._push.optimal_model import SOLVED, STARTS, Found, Program, Task
from centering._push.problem import CenteringProblem
from centering._push.profile import TipProfile
from centering._push.trace import PushTrace, simulate_push
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_MARGIN = 0.05  # of F_k: the contact force that is kept
_CLEAR = 0.5  # mm that the tip is drawn back by
_SAMPLES = 4001
_SLACK = 2e-5  # mm: by which the simulator's stop may be further off than was asked


class PushStatus(StrEnum):
    """How the search for a push ended; the text says what to try. No unit."""

    OK = "found; the simulator confirms it for every friction"
    NOT_FOUND = "no push keeps all bounds: allow a larger stop error, less contact force, or less spread of friction"
    NOT_CONFIRMED = "found, but a simulated part leaves the tip or stops too far off: ask for more contact force or finer steps"


@dataclass(frozen=True, eq=False, repr=False)
class OptimalPush:
    """A push of least time, with what the simulator says of it; `minimum_time_push` makes it.

    Attributes
    ----------
    problem : CenteringProblem
        That it was made for.
    distance : float
        That the part shall move, mm.
    status : PushStatus
        Whether it was found.
    message : str
        What the solver says.
    steps : int
        Of the solver.
    profile : TipProfile
        The tip from first touch on, drawn back at the end; `gentle_profile` where no push was found.
    friction : array, (m,)
        Ratios to the friction of the problem that it was simulated with, dimensionless.
    traces : tuple of PushTrace
        Of each.
    """

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
        """From first touch until the part rests, of each friction, (m,), s."""
        return np.array([_motion(trace)[1] for trace in self.traces])

    @property
    def time(self) -> float:
        """From first touch until the last part rests, s."""
        return float(self.rest_time.max())

    @property
    def stop_error(self) -> Floats:
        """Where the part stops beyond the wanted distance, of each friction, (m,), mm."""
        return np.array([trace.final_position for trace in self.traces]) - self.distance

    @property
    def spread(self) -> float:
        """Greatest less least stop error, mm."""
        return float(np.ptp(self.stop_error))

    @property
    def least_force(self) -> Floats:
        """Least contact force while the part moves, of each friction, (m,), N."""
        return np.array([_least_force(trace) for trace in self.traces])

    @property
    def peak_force(self) -> float:
        """Greatest contact force, N."""
        return max(trace.peak_force for trace in self.traces)

    def plot(self) -> Any:
        """Draw the speed of the tip (mm/s) and the contact forces (N) over time (s); return the figure."""
        from centering._push.optimal_picture import plot_optimal  # the picture imports what it draws

        return plot_optimal(self)

    def __repr__(self) -> str:
        errors = f"{1e3 * self.stop_error.min():+.2f} to {1e3 * self.stop_error.max():+.2f} um"
        told = f"{self.distance:g} mm in {self.time:.4g} s, stops {errors}, force up to {self.peak_force:.1f} N"
        return f"OptimalPush({told}; {self.status.name})"


def minimum_time_push(
    problem: CenteringProblem,
    distance: float,
    *,
    friction: Sequence[float] = (0.9, 1.1),
    contact_margin: float | None = None,
    stop_error_max: float | None = None,
    force_max: float | None = None,
    fineness: float = 1.0,
) -> OptimalPush:
    """Return the push of least time that the part does not leave and that ends near the wanted place for every given friction.

    One motion of the tip, in segments of constant acceleration, has to do for all frictions: at each the part breaks away, slips
    in contact and comes to rest. A nonlinear program (CasADi, IPOPT) with exact dynamics finds it, from two guesses; what is
    reported is by `simulate_push`, also at frictions between. The tip may touch at speed, which a run-up has to give it. Parts in
    contact move alike but for what their contacts are closed by: stops spread by (F_k,max - F_k,min)/k, less what is left of the
    swing after breaking away; much less cannot be asked.

    Parameters
    ----------
    problem : CenteringProblem
        Its model is pushed; push_speed_max (mm/s) and max_acceleration (mm/s^2) of its limits hold for the tip.
    distance : float
        That the part shall move, mm.
    friction : sequence of float
        Ratios to mu_static and mu_kinetic (both together), dimensionless.
    contact_margin : float, optional
        Least contact force while the part moves, N; by default a twentieth of the Coulomb force.
    stop_error_max : float, optional
        How far from the wanted place the part may stop, mm; by default the tolerance of the problem.
    force_max : float, optional
        Greatest contact force, N.
    fineness : float
        Number of segments relative to about one in 1.2 sqrt(M/k) at both ends and fewer between, dimensionless.

    Raises
    ------
    ValueError
        When a value is out of range. A push that does not exist is no error: `status` says so.

    Examples
    --------
    >>> from centering._push.presets import preset
    >>> problem = preset("printed")
    >>> push = minimum_time_push(problem.replace(limits=problem.limits.replace(push_speed_max=40.0)), 1.0)  # mm/s, mm
    >>> push.ok, round(push.time, 3), push.spread < 0.005  # s, mm; `gentle_profile`: 0.1 s and 0.058 mm
    (True, 0.045, True)
    """
    checks.kind("problem", problem, CenteringProblem)
    d, model = checks.positive("distance", distance, "mm"), problem.model
    ratios = _ratios(friction)
    error = checks.positive("stop_error_max", problem.tolerance if stop_error_max is None else stop_error_max, "mm")
    least = _MARGIN * model.coulomb_force if contact_margin is None else contact_margin
    margin = checks.nonnegative("contact_margin", least, "N")
    force = _force(model, ratios, margin, force_max)
    finer = checks.positive("fineness", fineness, "1")
    length, time = model.coulomb_force / model.contact_stiffness, sqrt(model.inertia / model.contact_stiffness)
    scaled, limits = sqrt(model.contact_stiffness * model.inertia), problem.limits
    tasks = [
        Task(
            contact=model.contact_damping / scaled,
            viscous=model.viscous_coefficient / scaled,
            breakaway=model.mu_static / model.mu_kinetic,
            frictions=(ratios[0], ratios[-1]) if len(ratios) > 1 else tuple(ratios),
            distance=d / length,
            speed=limits.push_speed_max * time / length,
            acceleration=limits.max_acceleration * time**2 / length,
            margin=margin / model.coulomb_force,
            force=force / model.coulomb_force,
            error=error / length,
            fineness=finer,
            at_once=at_once,
        )
        for at_once in _sequences(model, ratios, limits.push_speed_max, force)
    ]
    found = [Program(task, start).solved() for task in tasks for start in STARTS]
    pushes = [_judged(problem, d, ratios, error, each, length, time) for each in found]
    return min(pushes, key=lambda push: (list(PushStatus).index(push.status) != 0, push.time))


def _ratios(friction: Sequence[float]) -> list[float]:
    """Ratios of friction in order, checked."""
    values = np.unique(np.atleast_1d(checks.finite_array("friction", friction, "1")))
    if values.size == 0 or values[0] <= 0.0:
        raise checks.refuse("friction", "one or more ratios > 0", friction, "1")
    return [float(value) for value in values]


def _force(model: PushModel, ratios: Sequence[float], margin: float, force_max: float | None) -> float:
    """The greatest force, which must at least set the part in motion."""
    if force_max is None:
        return np.inf
    needed = ratios[-1] * model.breakaway_force
    if checks.positive("force_max", force_max, "N") <= max(needed, margin):
        raise checks.refuse("force_max", f"> the margin and {needed:.4g}, which the part breaks away at", force_max, "N")
    return force_max


def _sequences(model: PushModel, ratios: Sequence[float], speed: float, force: float) -> list[bool]:
    """Ways to break away: after sticking, and, where the damper's force at touch can do it for all, at once."""
    needed = ratios[-1] * model.breakaway_force
    return [False, True] if needed < min(model.contact_damping * speed, force) else [False]


def _judged(
    problem: CenteringProblem, d: float, ratios: Sequence[float], error: float, found: Found, length: float, time: float
) -> OptimalPush:
    """What was found, simulated at the given frictions, those between and the problem's own."""
    limits, done = problem.limits, found.message == SOLVED
    if done:
        rows = np.column_stack((found.duration * time, found.velocity * length / time, found.acceleration * length / time**2))
        profile = TipProfile(*np.vstack((rows, _drawn_back(rows[-1], limits.max_acceleration))).T)
    else:
        profile = gentle_profile(problem.model, d, limits.push_speed_max, max_acceleration=limits.max_acceleration)
    between = [0.5 * (a + b) for a, b in pairwise(ratios)]
    friction = np.unique([*ratios, *between, *([1.0] if ratios[0] < 1.0 < ratios[-1] else [])])
    friction.flags.writeable = False
    traces = tuple(simulate_push(_with(problem.model, r), profile) for r in friction)
    push = OptimalPush(problem, d, PushStatus.OK, found.message, found.steps, profile, friction, traces)
    status = PushStatus.NOT_FOUND if not done else PushStatus.OK if _confirmed(push, error) else PushStatus.NOT_CONFIRMED
    return OptimalPush(problem, d, status, found.message, found.steps, profile, friction, traces)


def _confirmed(push: OptimalPush, error: float) -> bool:
    """Whether all keep contact and stop near enough."""
    kept = all("free" not in trace.event_mode for trace in push.traces)
    return kept and bool(np.all(np.abs(push.stop_error) <= error + _SLACK))


def _with(model: PushModel, ratio: float) -> PushModel:
    """The model with another friction."""
    return model.replace(mu_static=ratio * model.mu_static, mu_kinetic=ratio * model.mu_kinetic)


def _drawn_back(last: Floats, acceleration: float) -> list[list[float]]:
    """Braked after the last segment, and away from the part, from rest to rest."""
    speed, half = last[1] + last[2] * last[0], sqrt(_CLEAR / acceleration)
    return [[half + speed / acceleration, speed, -acceleration], [half, -acceleration * half, acceleration]]


def _motion(trace: PushTrace) -> tuple[float, float]:
    """When the part first breaks away and when it finally rests, s."""
    moving = [k for k, mode in enumerate(trace.event_mode) if mode in ("slip", "free")]
    return (float(trace.phases[moving[0], 0]), float(trace.phases[moving[-1] + 1, 0])) if moving else (0.0, 0.0)


def _least_force(trace: PushTrace) -> float:
    """Least force of the contact while the part moves, N."""
    begin, end = _motion(trace)
    inside = np.linspace(begin, end, _SAMPLES)[1:-1]
    return float(trace.at(inside).contact_force.values.min()) if end > begin else 0.0
