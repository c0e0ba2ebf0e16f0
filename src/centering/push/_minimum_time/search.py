"""The fastest push that keeps contact and stops near enough for every friction in a range; the simulator has the last word."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, inf, sqrt
from typing import NamedTuple

import numpy as np

from centering._problem.model import PushModel
from centering._problem.problem import CenteringProblem
from centering.push._contact.reaction import simulate_pushes
from centering.push._minimum_time.program import SOLVED, STARTS, PushProgram, PushTask
from centering.push._minimum_time.push import OptimalPush, PushStatus, judged, with_friction
from centering.push._profile.gentle import gentle_profile
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_MARGIN = 0.05  # chosen: of F_k: the contact force that is kept
_CLEAR = 0.5  # chosen: mm that the tip is drawn back by
_BEFORE, _ROOM = (
    1.5,
    1.2,
)  # of F_s/k: how much shorter the push before a creep is; of half the spread: its stop error
_TRIES = 3  # chosen: creeps
_SWING = 4.0  # chosen: of the spread: parts that break away in turn may begin so far apart
_LEAST = 1e-9  # s, chosen
_SPEEDS = np.geomspace(0.25, 4.0, 13)  # of (F_s - F_k)/sqrt(k M), the speed of a jump
_LENGTHS = np.linspace(0.5, 3.0, 41)  # of F_s/k, by which the contact closes until the part breaks away
_SHARE = 0.97  # chosen: of the stop error that a creep may use up, as the push before it changes by a hair


@dataclass(frozen=True)
class _Wish:
    """What is asked: distance and error (mm), ratios of friction, least and greatest force (N), relative number of segments."""

    problem: CenteringProblem
    distance: float
    error: float
    ratios: tuple[float, ...]
    margin: float
    force: float
    fineness: float

    @property
    def units(self) -> tuple[float, float]:
        """Of the program: F_k/k (mm) and sqrt(M/k) (s)."""
        model = self.problem.model
        return model.coulomb_force / model.contact_stiffness, sqrt(model.inertia / model.contact_stiffness)

    @property
    def tasks(self) -> list[PushTask]:
        """Programs that may have the answer: the part sticks before it breaks away, or the touch sets it off at once."""
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
        """How far parts in contact are apart at the same force of inertia, mm."""
        return (self.ratios[-1] - self.ratios[0]) * self.units[0]

    @property
    def nearer_than_contact_gives(self) -> bool:
        """Whether stops shall be nearer to each other, though what is left of the swing after breaking away can hardly matter."""
        model, speed = self.problem.model, self.problem.limits.push_speed_max
        damping = model.contact_damping + model.viscous_coefficient
        left = exp(-0.5 * damping / model.inertia * self.distance / speed)
        return 2.0 * self.error < self.spread * (1.0 - _SWING * left)

    def judged(self, profile: TipProfile, message: str, steps: int) -> OptimalPush:
        """What the simulator says of a profile."""
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
    """Return the push of least time that the part does not leave and that ends near the wanted place for every given friction.

    One motion of the tip, in segments of constant acceleration, has to do for all frictions: at each the part breaks away, slips
    in contact and comes to rest. A nonlinear program (CasADi, IPOPT) with exact dynamics finds it, from two guesses; what is
    reported is by `simulate_push`, also at frictions between. The tip may touch at speed, which a run-up has to give it. Parts in
    contact move alike but for what their contacts are closed by: stops spread by (F_k,max - F_k,min)/k, less what is left of the
    swing after breaking away. Where that is too much the tip creeps on for one last small jump, which brings them closer.

    Parameters
    ----------
    problem : CenteringProblem
        Its model is pushed; push_speed_max (mm/s) and acceleration_max (mm/s^2) of its limits hold for the tip.
    distance : float
        That the part shall move, mm.
    friction : sequence of float
        Ratios to mu_static and mu_kinetic (both together), dimensionless.
    contact_margin : float, optional
        Least contact force while the part moves, N; by default a twentieth of the Coulomb force.
    stop_error_max : float, optional
        How far from the wanted place the part may stop, mm; by default the tolerance of the problem.
    force_max : float, optional
        Greatest contact force, N; without it the tip touches hard, and the force may be several times that of `gentle_profile`.
    fineness : float
        Number of segments relative to about one in 1.2 sqrt(M/k) at both ends and fewer between, dimensionless.

    Raises
    ------
    ValueError
        When a value is out of range. A push that does not exist is no error: `status` says so.

    Examples
    --------
    >>> from centering import preset
    >>> problem = preset("printed").replace(push_speed_max=40.0)  # mm/s
    >>> push = minimum_time_push(problem, 1.0)  # mm
    >>> push.ok, round(push.time, 3), push.spread < 0.005  # s, mm; `gentle_profile`: 0.1 s and 0.058 mm
    (True, 0.045, True)
    """
    wish = _wish(problem, distance, friction, contact_margin, stop_error_max, force_max, fineness)
    near = wish.nearer_than_contact_gives
    crept = _creeping(wish) if near else None
    if crept is not None:
        return crept
    push, _ = _fastest(wish)
    return push if push.ok or near or len(wish.ratios) == 1 else _creeping(wish) or push


def _wish(
    problem: CenteringProblem,
    distance: float,
    friction: Sequence[float],
    margin: float | None,
    error: float | None,
    force: float | None,
    fineness: float,
) -> _Wish:
    """The arguments, checked."""
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
    return _Wish(problem, d, near, tuple(ratios), least, _force(model, ratios, least, force), finer)


def _fastest(wish: _Wish, guesses: int = len(STARTS)) -> tuple[OptimalPush, TipProfile]:
    """The fastest confirmed push, and it without its way back; where none is, the gentle one or one that is not confirmed."""
    limits, (length, time) = wish.problem.limits, wish.units
    plain = gentle_profile(
        wish.problem.model, wish.distance, limits.push_speed_max, acceleration_max=limits.acceleration_max
    )
    pushes = []
    for found in [PushProgram(task, start).solved() for task in wish.tasks for start in STARTS[:guesses]]:
        if found.message == SOLVED:
            rows = np.column_stack(
                (found.duration * time, found.velocity * length / time, found.acceleration * length / time**2)
            )
            stopped = TipProfile(*_stopped(rows, limits.acceleration_max).T)
            pushes.append((wish.judged(_with_way_back(stopped, wish), found.message, found.steps), stopped))
        else:
            pushes.append(
                (replace(wish.judged(plain, found.message, found.steps), status=PushStatus.NOT_FOUND), plain)
            )
    ranks = list(PushStatus)
    return min(pushes, key=lambda each: (not each[0].ok, ranks.index(each[0].status), each[0].time))


def _creeping(wish: _Wish) -> OptimalPush | None:
    """A push whose tip creeps on at the end; None where that does not help."""
    model, most = wish.problem.model, wish.problem.limits.acceleration_max
    first = replace(
        wish,
        distance=wish.distance - _BEFORE * model.breakaway_force / model.contact_stiffness,
        error=max(wish.error, 0.5 * _ROOM * wish.spread),
    )
    if first.distance <= 0.0:
        return None
    push, stopped = _fastest(first, 1)
    if not push.ok:
        return None
    models = [with_friction(model, ratio) for ratio in push.friction]
    for creep in creeps(models, stopped, _way_back(most), wish.error, most)[:_TRIES]:
        _, other = _fastest(replace(first, distance=first.distance + wish.distance - creep.middle), 1)
        whole = TipProfile(*np.vstack((other.segments, creep.rows)).T)
        push = wish.judged(_with_way_back(whole, wish), push.message, push.steps)
        if push.ok:
            return push
    return None


def _ratios(friction: Sequence[float]) -> list[float]:
    """Ratios of friction in order, checked."""
    values = np.unique(np.atleast_1d(checks.finite_array("friction", friction, "1")))
    if values.size == 0 or values[0] <= 0.0:
        raise checks.refuse("friction", "one or more ratios > 0", friction, "1")
    return [float(value) for value in values]


def _force(model: PushModel, ratios: Sequence[float], margin: float, force_max: float | None) -> float:
    """The greatest force, which must at least set the part in motion."""
    if force_max is None:
        return inf
    needed = ratios[-1] * model.breakaway_force
    if checks.positive("force_max", force_max, "N") <= max(needed, margin):
        raise checks.refuse(
            "force_max", f"> the margin and {needed:.4g}, which the part breaks away at", force_max, "N"
        )
    return force_max


def _stopped(rows: Floats, acceleration: float) -> Floats:
    """Rows and a brake after them where the tip is still in motion."""
    speed = rows[-1, 1] + rows[-1, 2] * rows[-1, 0]
    brake = [speed / acceleration, speed, -acceleration]
    return np.vstack((rows, brake)) if brake[0] > _LEAST else rows


def _way_back(acceleration: float) -> Floats:
    """Rows that draw the tip back, from rest to rest."""
    half = sqrt(_CLEAR / acceleration)
    return np.array([[half, 0.0, -acceleration], [half, -acceleration * half, acceleration]])


def _with_way_back(stopped: TipProfile, wish: _Wish) -> TipProfile:
    return TipProfile(*np.vstack((stopped.segments, _way_back(wish.problem.limits.acceleration_max))).T)


class Creep(NamedTuple):
    """A slow end of a push: rows of its profile (s, mm/s, mm/s^2), its time (s), the middle of where it leaves the parts (mm).

    Parts that come to rest in contact are apart by the closing of their contacts, in proportion to F_k/k. When the tip goes on
    slowly each sticks until F_s and jumps; then the contact is closed by about (2 F_k - F_s)/k, which differs less.
    """

    rows: Floats
    time: float
    middle: float


def creeps(
    models: Sequence[PushModel], before: TipProfile, after: Floats, error: float, acceleration: float
) -> tuple[Creep, ...]:
    """Slow ends that bring all parts within an error (mm) of one place, by time; `after` are the rows that draw the tip back."""
    possible = [(rows, float(rows[:, 0].sum())) for rows in _possible(models[-1], acceleration)]
    profiles = [TipProfile(*np.vstack((before.segments, rows, after)).T) for rows, _ in possible]
    ends = np.array([simulate_pushes(model, profiles)[:, 0] for model in models])
    middle, reach = 0.5 * (ends.max(axis=0) + ends.min(axis=0)), 0.5 * np.ptp(ends, axis=0)
    near = [
        Creep(*each, float(place))
        for each, place, far in zip(possible, middle, reach, strict=True)
        if far <= _SHARE * error
    ]
    return tuple(sorted(near, key=lambda creep: creep.time))


def _possible(model: PushModel, acceleration: float) -> list[Floats]:
    """Rows from rest to rest, of several speeds and lengths."""
    jump = (model.breakaway_force - model.coulomb_force) / sqrt(model.contact_stiffness * model.inertia)
    closing = model.breakaway_force / model.contact_stiffness
    moves = [
        TipProfile.move(share * closing, part * jump, acceleration) for part in _SPEEDS for share in _LENGTHS
    ]
    return [move.segments[move.duration > _LEAST] for move in moves]
