"""The friction of a part, learned push by push from what each one showed: Bayes' rule over a grid, for any part and any push."""

from collections.abc import Iterable, Mapping
from math import hypot, nan, sqrt
from typing import Any

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.friction._belief import FrictionBelief
from centering.friction._logged import logged_pushes
from centering.friction._prediction import likelihood
from centering.friction._printed import SENSOR_RANGE
from centering.push._contact.trace import PushTrace
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Estimate, Status

NAMES = ("mu_static", "mu_kinetic")
_OFF = 25.0
"""Squared standard deviations by which readings may be off at the nearest friction, before they are refused."""
_BELOW = 5.0
"""Standard deviations by which a reading may be below 0."""
_TOLD = 0.5
"""Perfectly read pushes, from whose worth on a value counts as learned."""


class FrictionEstimator:
    """Learn both coefficients of friction of a part from its pushes, by Bayes' rule over a grid (Mears, chapter 6, made general).

    Each push is simulated with 189 frictions about those that are believed; peak force, free slide and final position that were
    read are compared with what each predicts. The friction of a part persists; what a push meets scatters about it by
    `PushScatter.friction_push_sd`, both coefficients together, so that n pushes tell a part's friction no better than to
    that over sqrt(n). Where what is predicted jumps from friction to friction (stick and slip), it counts for less. Errors of the
    model are taken as independent from push to push; what persists of them becomes part of the friction found. So does a contact
    that is not the one of the problem: with a stiffness 20 % off, 12 to 17 of 60 parts are called impossible; with one 20 % below
    the true one, 95 % intervals of mu_kinetic hold 55 to 58 %. Measure the contact first (`contact_stiffness`).

    What tells what: the peak force of a slow push tells mu_static of a heavy part, up to a few mm/s (above, speed times contact
    damping and stiffness make the force); the way that a part slides free after a fast push or a hard stop tells mu_kinetic. Of a
    light part only that way tells anything, Mears (6.2). A gentle push, which leaves the part where the tip stops, tells little.
    A grid, as an unscented filter is far too sure of what stick and slip show: its 95 % intervals hold 50 to 80 % then.

    Parameters
    ----------
    problem : CenteringProblem
        Its model is what is expected at first; its scatter how far a part may be from it.
    ratio_sd : float
        Standard deviation of mu_static/mu_kinetic from part to part, relative; the source finds the ratio within 15 %.
    force_sd : float
        Of a peak force as read, N.
    position_sd : float, optional
        Of a free slide or a final position as read, mm; by default of the stop and of two measurements, from the scatter.
    model_error : float
        Of what the model predicts, relative: of the force, and of the way that the part slides beyond the tip.
    way_error : float
        Of a final position, over how far the tip goes; 0 for a table that stands, or where the way along the contact normal was
        read. The whole way over a table at 20 rpm is some 0.001 longer, at 100 rpm 0.02; `turning_profile` gives the profile.

    Raises
    ------
    ValueError, TypeError
        When a value is out of range, or the scatter has no spread of friction from part to part.

    Examples
    --------
    >>> from centering import TipProfile, preset, simulate_push
    >>> problem, push = preset("printed"), TipProfile.constant_speed(40.0, 0.1)
    >>> friction = FrictionEstimator(problem)
    >>> friction.update(simulate_push(problem.model.replace(mu_static=0.22, mu_kinetic=0.165), push))
    >>> bool(abs(friction.estimate["mu_kinetic"] / 0.165 - 1.0) < 0.05), friction.pushes
    (True, 1)
    """

    def __init__(
        self,
        problem: CenteringProblem,
        *,
        ratio_sd: float = 0.05,
        force_sd: float = 0.5,
        position_sd: float | None = None,
        model_error: float = 0.02,
        way_error: float = 0.0,
    ) -> None:
        checks.kind("problem", problem, CenteringProblem)
        scatter = problem.scatter
        if scatter.friction_part_sd == 0:
            raise checks.refuse(
                "problem.scatter.friction_part_sd", "> 0, else there is nothing to learn", 0.0, "relative"
            )
        stop = hypot(scatter.stop_sd, sqrt(2.0) * scatter.measuring_sd)
        place = stop if position_sd is None else position_sd
        force, position = (
            checks.positive("force_sd", force_sd, "N"),
            checks.positive("position_sd", place, "mm"),
        )
        self._sd = np.array([force, position, position])
        self._error = checks.within("model_error", model_error, 0.0, 1.0, "relative")
        self._way_error = checks.within("way_error", way_error, 0.0, 1.0, "relative")
        self._problem = problem
        self._ratio_sd = checks.within("ratio_sd", ratio_sd, 0.0, 1.0, "relative")
        self.reset()

    def reset(self) -> None:
        """Forget the pushes, as for the next part."""
        scatter = self._problem.scatter
        sds = scatter.friction_part_sd, scatter.friction_push_sd, self._ratio_sd
        self._belief = FrictionBelief(self._problem.model, *sds)
        self._pushes = self._refused = 0

    @property
    def pushes(self) -> int:
        """Pushes that were learned from, unit 1."""
        return self._pushes

    @property
    def refused(self) -> int:
        """Pushes whose readings no friction explains, and which therefore count for nothing, unit 1."""
        return self._refused

    def update(
        self,
        trace: PushTrace | None = None,
        *,
        profile: TipProfile | None = None,
        peak_force: float | None = None,
        free_slide: float | None = None,
        final_position: float | None = None,
    ) -> None:
        """Learn from a push: from its trace, or from what was read and how the tip moved. NaN or None: not read.

        Parameters
        ----------
        trace : PushTrace, optional
            A push with all that it shows; numbers given besides take the place of its own.
        profile : TipProfile, optional
            How the tip moved, from first touch on (mm, s).
        peak_force : float, optional
            Greatest contact force, N.
        free_slide : float, optional
            Way from leaving the tip to meeting it again or to rest, the greatest, mm.
        final_position : float, optional
            How far the part was moved, mm.

        Raises
        ------
        ValueError, TypeError
            Without a profile or any reading, or for one that is below 0 by more than 5 of its standard deviations, infinite, or
            beyond the range of the sensor, 446 N. Noise may take the reading of nothing a little below 0.
        """
        path, read = _readings(self._sd, trace, profile, peak_force, free_slide, final_position)
        farthest = float(path.position(np.cumsum(path.duration)).max())
        noise_sd = np.hypot(self._sd, [0.0, 0.0, self._way_error * farthest])
        likely, off = likelihood(
            self._belief, self._problem.model, path, read, noise_sd, (self._error, farthest)
        )
        if off > _OFF:
            self._refused += 1
            return
        self._belief.take(likely)
        self._pushes += 1

    @property
    def estimate(self) -> Estimate:
        """Both coefficients with their covariance (dimensionless); the message says which one the pushes have not told."""
        mean, covariance = self._belief.moments(self._belief.weight)
        status, message = self._judged(mean, covariance)
        return Estimate(NAMES, mean, covariance, status, message, ("1", "1"))

    @property
    def told(self) -> dict[str, float]:
        """How many perfectly read pushes all were worth, for each coefficient, unit 1; about 0: they told nothing of it."""
        mean, covariance = self._belief.moments(self._belief.weight)
        first, before = self._belief.moments(self._belief.prior)
        gained = mean**2 / np.diag(covariance) - first**2 / np.diag(before)
        scatter = max(self._problem.scatter.friction_push_sd, self._error)
        return dict(zip(NAMES, (gained * scatter**2).tolist(), strict=True))

    def _judged(self, mean: Floats, covariance: Floats) -> tuple[Status, str]:
        """How far the pushes have told the friction, in a word and in a sentence."""
        if self._refused > self._pushes:
            return Status.IMPOSSIBLE, (
                f"no friction explains {self._refused} of {self._refused + self._pushes} pushes: look for a contact stiffness or"
                " damping that is not the machine's, bad readings, a wrong unit or profile, or a part that is not the one of the"
                " problem"
            )
        if not self._pushes:
            return Status.UNDETERMINED, "no pushes yet: what was expected"
        enough = 0.5 * self._problem.scatter.friction_push_sd * mean
        sure = np.sqrt(np.diag(covariance)) <= enough
        vague = [
            name
            for name, share, known in zip(NAMES, self.told.values(), sure, strict=True)
            if share < _TOLD and not known
        ]
        refused = f", {self._refused} more explained by no friction" if self._refused else ""
        counted = f"{self._pushes} push{'' if self._pushes == 1 else 'es'}{refused}"
        if not vague:
            settled = 2 * self._refused <= self._pushes
            return Status.OK if settled else Status.UNSURE, f"from {counted}"
        what = ", ".join(_ADVICE[name] for name in vague)
        return Status.UNSURE, f"{counted} told little of {' and '.join(vague)}; {what}"


_ADVICE = {
    "mu_static": "for mu_static break the part away slowly and read the peak force",
    "mu_kinetic": "for mu_kinetic let it slide free, by a fast push with a hard stop, and read how far it went",
}


_LOGGED = {"model_error": 0.05, "way_error": 0.03}


def identify_friction(
    data: Any, problem: CenteringProblem, *, part: int | None = None, throw: bool = True, **options: Any
) -> Estimate:
    """Estimate both coefficients of friction of one part from its pushes.

    Parameters
    ----------
    data : PushTrace, sequence of PushTrace or mapping, or log
        The pushes, in any order; a mapping has ``profile`` (TipProfile) and any of ``peak_force`` (N), ``free_slide`` (mm) and
        ``final_position`` (mm), as `FrictionEstimator.update` takes them. Or the log of a centering cycle, or a mapping of the
        arrays of its table "control": the motion of the tip is taken from the slide's readings, the way of the part from the
        centres that the controller reports. Samples of 10 ms tell the friction of a heavy part; of one of 5 kg they tell little.
    problem : CenteringProblem
        What is expected, and how far a part may be from it.
    part : int, optional
        Which part of a log, unit 1; needed where there are several.
    throw : bool
        Raise where no friction explains the pushes; else the status says so.
    **options
        Noise, see `FrictionEstimator`; of a log, whose samples blur a push, model_error is 0.05 and way_error 0.03 by default.

    Returns
    -------
    Estimate
        Of ``mu_static`` and ``mu_kinetic``.

    Raises
    ------
    ValueError, TypeError
        For what `FrictionEstimator` refuses, no pushes, or pushes that no friction explains.

    Examples
    --------
    >>> from centering import TipProfile, preset, simulate_push
    >>> problem = preset("printed")
    >>> push = simulate_push(problem.model, TipProfile.constant_speed(40.0, 0.1))
    >>> bool(abs(identify_friction([push, push], problem)["mu_static"] - 0.2) < 0.01)
    True
    """
    logged = hasattr(data, "tiers") or (isinstance(data, Mapping) and "pushing" in data)
    estimator = FrictionEstimator(problem, **(_LOGGED | options if logged else options))
    for push in logged_pushes(data, problem, part) if logged else _pushes(data):
        if isinstance(push, PushTrace):
            estimator.update(push)
        else:
            estimator.update(**checks.kind("each push", push, dict, ", or a PushTrace"))
    if not estimator.pushes + estimator.refused:
        raise checks.refuse("data", "at least one push", [])
    estimate = estimator.estimate
    if throw and estimate.status is Status.IMPOSSIBLE:
        raise ValueError(estimate.message)
    return estimate


def _pushes(data: Any) -> list[Any]:
    """The pushes, one by one."""
    if isinstance(data, PushTrace | Mapping):
        return [data]
    if not isinstance(data, Iterable):
        raise TypeError(f"data must be pushes; got {checks.shown(data)}")
    return list(data)


def _readings(
    sd: Floats, trace: PushTrace | None, profile: TipProfile | None, *given: float | None
) -> tuple[TipProfile, Floats]:
    """The tip's way, and (peak force, free slide, final position), NaN for what was not read."""
    if trace is not None:
        checks.kind("trace", trace, PushTrace)
        profile = trace.profile if profile is None else profile
        shown = trace.peak_force, trace.free_slide, trace.final_position
        given = tuple(own if other is None else other for own, other in zip(shown, given, strict=True))
    path = checks.kind("profile", profile, TipProfile, ", how the tip moved")
    read = np.array([_reading(*each) for each in zip(_READ, sd.tolist(), given, strict=True)])
    if not np.isfinite(read).any():
        raise ValueError(f"at least one of {', '.join(name for name, _, _ in _READ)} must be given; got none")
    return path, read


_READ = (("peak_force", "N", SENSOR_RANGE), ("free_slide", "mm", 1e3), ("final_position", "mm", 1e3))


def _reading(kind: tuple[str, str, float], sd: float, value: float | None) -> float:
    """A reading; NaN where there is none."""
    name, unit, most = kind
    if value is None or value != value:
        return nan
    return checks.within(name, value, -_BELOW * sd, most, unit)
