"""Search for the push of minimum time that keeps contact and stops near the target at every friction."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, inf, sqrt
from typing import NamedTuple

import numpy as np

from centering._problem.model import PushModel
from centering._problem.problem import CenteringProblem
from centering.push._contact.reaction import pushed
from centering.push._contact.reaction_kernels import FINAL_POSITION, TRAVEL
from centering.push._minimum_time.program import SOLVED, STARTS, PushFound, PushProgram, PushTask
from centering.push._minimum_time.push import OptimalPush, PushStatus, judged, with_friction
from centering.push._profile.gentle import gentle_profile
from centering.push._profile.profile import TipProfile
from centering.push._profile.rows import retraction
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_MARGIN = 0.05  # chosen: default margin of the contact force over F_k
# chosen: shortening of the push before a creep, F_s/k; its stop error over half the spread
_BEFORE, _ROOM = 1.5, 1.2
_TRIES = 3  # chosen: creeps that are tried, the fastest first
_SWING = 4.0  # chosen: greatest swing of parts that break away in turn, over the spread
_LEAST = 1e-9  # s, chosen: shorter segments are rounding
_SPEEDS = np.geomspace(0.25, 4.0, 13)  # chosen: of creeps, over the speed of a jump (F_s - F_k)/sqrt(k M)
_LENGTHS = np.linspace(0.5, 3.0, 41)  # chosen: of creeps, over the closing at breakaway F_s/k
_SHARE = 0.97  # chosen: share of the stop error left to a creep; the push before it changes a little


@dataclass(frozen=True)
class _Request:
    """Checked arguments: distance and error (mm), friction ratios, least and greatest force (N), fineness."""

    problem: CenteringProblem
    distance: float
    error: float
    ratios: tuple[float, ...]
    margin: float
    force: float
    fineness: float

    @property
    def units(self) -> tuple[float, float]:
        """Units of the program: F_k/k (mm) and sqrt(M/k) (s)."""
        model = self.problem.model
        return model.coulomb_force / model.contact_stiffness, sqrt(model.inertia / model.contact_stiffness)

    @property
    def tasks(self) -> list[PushTask]:
        """Candidate programs: the part sticks before it breaks away, or breaks away at touch."""
        model, limits, (length, time) = self.problem.model, self.problem.limits, self.units
        scaled = sqrt(model.contact_stiffness * model.inertia)
        task = PushTask(
            contact=model.contact_damping / scaled,
            viscous=model.viscous_coefficient / scaled,
            breakaway=model.mu_static / model.mu_kinetic,
            frictions=tuple(sorted({self.ratios[0], self.ratios[-1]})),
            distance=self.distance / length,
            speed=limits.push_speed_max * time / length,
            acceleration=limits.acceleration_max * time**2 / length,
            margin=self.margin / model.coulomb_force,
            force=self.force / model.coulomb_force,
            error=self.error / length,
            fineness=self.fineness,
            at_once=False,
        )
        needed = self.ratios[-1] * model.breakaway_force
        sudden = needed < min(model.contact_damping * limits.push_speed_max, self.force)
        return [task, task._replace(at_once=True)] if sudden else [task]

    @property
    def spread(self) -> float:
        """Difference of the positions of parts in contact at the same force of inertia, mm."""
        return (self.ratios[-1] - self.ratios[0]) * self.units[0]

    @property
    def nearer_than_contact_gives(self) -> bool:
        """Whether the stop error is below half the spread and the swing from breakaway is over."""
        model, speed = self.problem.model, self.problem.limits.push_speed_max
        damping = model.contact_damping + model.viscous_coefficient
        left = exp(-0.5 * damping / model.inertia * self.distance / speed)
        return 2.0 * self.error < self.spread * (1.0 - _SWING * left)

    def judged(self, profile: TipProfile, message: str, steps: int) -> OptimalPush:
        """Simulate a profile."""
        return judged(self.problem, self.distance, self.ratios, self.error, profile, message, steps)


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
    """Return the push of minimum time that keeps contact and stops near the target at every given friction.

    One motion of the tip, in segments of constant acceleration, serves all frictions: at each the part breaks
    away, slips in contact and comes to rest. A nonlinear program (CasADi, IPOPT) with exact dynamics finds it
    from two first guesses; `simulate_push` confirms it, also at frictions between. The tip may touch at
    speed, after a run-up. Parts in contact differ in position by the closing of their contacts, so that stops
    spread by (F_k,max - F_k,min)/k, less the swing left from breakaway. Where that is too much the tip creeps
    on for a last small jump, which brings them closer.

    Parameters
    ----------
    problem : CenteringProblem
        Model of the push; push_speed_max (mm/s) and acceleration_max (mm/s^2) limit the tip.
    distance : float
        Wanted travel of the part, mm.
    friction : sequence of float
        Ratios to mu_static and mu_kinetic (both together), dimensionless.
    contact_margin : float, optional
        Least contact force while the part moves, N. Default: a twentieth of the Coulomb force.
    stop_error_max : float, optional
        Greatest distance of the stop from the target, mm. Default: tolerance of the problem.
    force_max : float, optional
        Greatest contact force, N. None: no limit; the tip touches hard, and the force may be several times
        that of `gentle_profile`.
    fineness : float
        Relative number of segments, dimensionless; 1: one in 1.2 sqrt(M/k) at both ends, fewer between.

    Raises
    ------
    ValueError
        When a value is out of range. A push that does not exist is no error: see `status`.

    Examples
    --------
    >>> from centering import preset
    >>> problem = preset("printed").replace(push_speed_max=40.0)  # mm/s
    >>> push = minimum_time_push(problem, 1.0)  # mm
    >>> push.ok, round(push.time, 3), push.spread < 0.005  # s, mm; `gentle_profile`: 0.1 s and 0.058 mm
    (True, 0.045, True)
    """
    request = _requested(problem, distance, friction, contact_margin, stop_error_max, force_max, fineness)
    near = request.nearer_than_contact_gives
    crept = _creeping(request) if near else None
    if crept is not None:
        return crept
    push, _ = _fastest(request)
    return push if push.ok or near or len(request.ratios) == 1 else _creeping(request) or push


def _requested(
    problem: CenteringProblem,
    distance: float,
    friction: Sequence[float],
    margin: float | None,
    error: float | None,
    force: float | None,
    fineness: float,
) -> _Request:
    """Check the arguments."""
    model = checks.kind("problem", problem, CenteringProblem).model
    d, ratios = checks.positive("distance", distance, "mm"), _ratios(friction)
    near = checks.positive("stop_error_max", problem.tolerance if error is None else error, "mm")
    least = checks.nonnegative(
        "contact_margin", _MARGIN * model.coulomb_force if margin is None else margin, "N"
    )
    if least >= ratios[0] * model.coulomb_force:
        rule = (
            f"< {ratios[0] * model.coulomb_force:.4g}, the least Coulomb force, which has to brake the part"
        )
        raise checks.refuse("contact_margin", rule, least, "N")
    finer = checks.positive("fineness", fineness, "1")
    return _Request(problem, d, near, tuple(ratios), least, _force(model, ratios, least, force), finer)


def _fastest(request: _Request, guesses: int = len(STARTS)) -> tuple[OptimalPush, TipProfile]:
    """Fastest confirmed push, and it without its retraction; else the gentle one or an unconfirmed one."""
    found = [PushProgram(task, start).solved() for task in request.tasks for start in STARTS[:guesses]]
    pushes, ranks = [_simulated(each, request) for each in found], list(PushStatus)
    return min(pushes, key=lambda each: (not each[0].ok, ranks.index(each[0].status), each[0].time))


def _simulated(found: PushFound, request: _Request) -> tuple[OptimalPush, TipProfile]:
    """Simulated push of a program, and it without its retraction; the gentle one without a solution."""
    limits, (length, time) = request.problem.limits, request.units
    fast, most = limits.push_speed_max, limits.acceleration_max
    if found.message != SOLVED:
        plain = gentle_profile(request.problem.model, request.distance, fast, acceleration_max=most)
        push = request.judged(plain, found.message, found.steps)
        return replace(push, status=PushStatus.NOT_FOUND), plain
    speeds, gains = found.velocity * length / time, found.acceleration * length / time**2
    stopped = TipProfile(*_stopped(np.column_stack((found.duration * time, speeds, gains)), most).T)
    return request.judged(_retracted(stopped, request), found.message, found.steps), stopped


def _creeping(request: _Request) -> OptimalPush | None:
    """Push whose tip creeps on at the end; None where that does not help."""
    model, most = request.problem.model, request.problem.limits.acceleration_max
    first = replace(
        request,
        distance=request.distance - _BEFORE * model.breakaway_force / model.contact_stiffness,
        error=max(request.error, 0.5 * _ROOM * request.spread),
    )
    if first.distance <= 0.0:
        return None
    push, stopped = _fastest(first, 1)
    if not push.ok:
        return None
    models = [with_friction(model, ratio) for ratio in push.friction]
    for creep in creeps(models, stopped, retraction(most), request.error, most)[:_TRIES]:
        _, other = _fastest(replace(first, distance=first.distance + request.distance - creep.middle), 1)
        whole = TipProfile(*np.vstack((other.segments, creep.rows)).T)
        push = request.judged(_retracted(whole, request), push.message, push.steps)
        if push.ok:
            return push
    return None


def _ratios(friction: Sequence[float]) -> list[float]:
    """Check and sort ratios of friction."""
    values = np.unique(np.atleast_1d(checks.finite_array("friction", friction, "1")))
    if values.size == 0 or values[0] <= 0.0:
        raise checks.refuse("friction", "one or more ratios > 0", friction, "1")
    return [float(value) for value in values]


def _force(model: PushModel, ratios: Sequence[float], margin: float, force_max: float | None) -> float:
    """Greatest force, which must at least set the part in motion."""
    if force_max is None:
        return inf
    needed = ratios[-1] * model.breakaway_force
    if checks.positive("force_max", force_max, "N") <= max(needed, margin):
        raise checks.refuse(
            "force_max", f"> the margin and {needed:.4g}, which the part breaks away at", force_max, "N"
        )
    return force_max


def _stopped(rows: Floats, acceleration: float) -> Floats:
    """Rows, and a stop after them where the tip still moves."""
    speed = rows[-1, 1] + rows[-1, 2] * rows[-1, 0]
    brake = [speed / acceleration, speed, -acceleration]
    return np.vstack((rows, brake)) if brake[0] > _LEAST else rows


def _retracted(stopped: TipProfile, request: _Request) -> TipProfile:
    return TipProfile(*np.vstack((stopped.segments, retraction(request.problem.limits.acceleration_max))).T)


class Creep(NamedTuple):
    """Slow end of a push: rows (s, mm/s, mm/s^2), duration (s), middle of the final positions (mm).

    Parts that come to rest in contact differ by the closing of their contacts, in proportion to F_k/k. When
    the tip goes on slowly, each sticks until F_s and jumps; the closing left is then about (2 F_k - F_s)/k,
    which differs less.
    """

    rows: Floats
    time: float
    middle: float


def creeps(
    models: Sequence[PushModel], before: TipProfile, after: Floats, error: float, acceleration: float
) -> tuple[Creep, ...]:
    """Slow ends that bring all parts within an error (mm) of one place, the fastest first."""
    possible = [(rows, float(rows[:, 0].sum())) for rows in _possible(models[-1], acceleration)]
    profiles = [TipProfile(*np.vstack((before.segments, rows, after)).T) for rows, _ in possible]
    ends = np.array([pushed(model, profiles, TRAVEL)[:, FINAL_POSITION] for model in models])
    middle, reach = 0.5 * (ends.max(axis=0) + ends.min(axis=0)), 0.5 * np.ptp(ends, axis=0)
    near = [
        Creep(*each, float(place))
        for each, place, far in zip(possible, middle, reach, strict=True)
        if far <= _SHARE * error
    ]
    return tuple(sorted(near, key=lambda creep: creep.time))


def _possible(model: PushModel, acceleration: float) -> list[Floats]:
    """Rows of moves from rest to rest, of several speeds and lengths."""
    jump = (model.breakaway_force - model.coulomb_force) / sqrt(model.contact_stiffness * model.inertia)
    closing = model.breakaway_force / model.contact_stiffness
    moves = [
        TipProfile.move(share * closing, part * jump, acceleration) for part in _SPEEDS for share in _LENGTHS
    ]
    return [move.segments[move.duration > _LEAST] for move in moves]
