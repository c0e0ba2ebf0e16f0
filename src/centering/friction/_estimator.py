"""Friction of a part, estimated push by push with Bayes' rule on a grid, for any part and any push."""

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
from sdpgrind.base.tables import tables_in
from sdpgrind.identify import Estimate, Status

NAMES = ("mu_static", "mu_kinetic")
_OFF = 25.0  # chosen: misfit at the best friction, squared sds, beyond which readings are refused (5 sd)
_BELOW = 5.0  # chosen: standard deviations of noise by which a reading may be below 0
_TOLD = 0.5  # chosen: information in perfectly read pushes from which a coefficient counts as learned


class FrictionEstimator:
    """Estimate both coefficients of friction of a part from its pushes, by Bayes' rule on a grid.

    Each push is simulated with 189 frictions about the believed ones and compared with the readings of peak
    force, free slide and final position. The friction of a part persists; single pushes scatter about it by
    `PushScatter.friction_push_sd`, both coefficients together, so that n pushes estimate it to that over
    sqrt(n) at best. Where predictions jump between frictions (stick and slip) they count less. Errors of the
    model count as independent from push to push; a persistent error becomes part of the friction found. So
    does a wrong contact: with a stiffness 20 % off, 12 to 17 of 60 parts are called impossible; with one 20 %
    below the true one, 95 % intervals of mu_kinetic hold 55 to 58 %. Measure the contact first
    (`contact_stiffness`).

    The peak force of a slow push, up to a few mm/s, determines mu_static of a heavy part; above, speed times
    contact damping and stiffness make the force. The free slide after a fast push or a hard stop determines
    mu_kinetic; for a light part it is the only information, Mears (6.2). A gentle push, which leaves the part
    where the tip stops, gives little. The grid replaces an unscented filter, whose 95 % intervals hold 50 to
    80 % under stick and slip.

    Parameters
    ----------
    problem : CenteringProblem
        Its model is the expectation; its scatter the deviation of a part from it.
    ratio_sd : float
        Standard deviation of mu_static/mu_kinetic from part to part, relative; the source finds the ratio
        within 15 %.
    force_sd : float
        Standard deviation of a peak force reading, N.
    position_sd : float, optional
        Standard deviation of a reading of free slide or final position, mm. Default: of the stop and of two
        measurements, from the scatter.
    model_error : float
        Error of the model, relative, in the force and in the way of the part beyond the tip.
    way_error : float
        Error of a final position over the travel of the tip; 0 for a table at rest, or a way along the
        contact normal. The whole way over a table is longer by some 0.001 at 20 rpm, 0.02 at 100 rpm;
        `turning_profile` gives the profile.

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
        force = checks.positive("force_sd", force_sd, "N")
        position = checks.positive("position_sd", place, "mm")
        self._sd = np.array([force, position, position])
        self._error = checks.within("model_error", model_error, 0.0, 1.0, "relative")
        self._way_error = checks.within("way_error", way_error, 0.0, 1.0, "relative")
        self._problem = problem
        self._ratio_sd = checks.within("ratio_sd", ratio_sd, 0.0, 1.0, "relative")
        self.reset()

    def reset(self) -> None:
        """Forget the pushes, before the next part."""
        scatter = self._problem.scatter
        sds = scatter.friction_part_sd, scatter.friction_push_sd, self._ratio_sd
        self._belief = FrictionBelief(self._problem.model, *sds)
        self._pushes = self._refused = 0

    @property
    def pushes(self) -> int:
        """Number of pushes in the estimate, unit 1."""
        return self._pushes

    @property
    def refused(self) -> int:
        """Number of ignored pushes, whose readings no friction explains, unit 1."""
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
        """Learn from a push: from its trace, or from readings (None or NaN: not read) and a profile.

        Parameters
        ----------
        trace : PushTrace, optional
            Simulated push with all readings; other arguments replace its own.
        profile : TipProfile, optional
            Motion of the tip from first touch on (mm, s).
        peak_force : float, optional
            Greatest contact force, N.
        free_slide : float, optional
            Longest way between leaving the tip and the next contact or rest, mm.
        final_position : float, optional
            Travel of the part, mm.

        Raises
        ------
        ValueError, TypeError
            Without a profile or any reading, or for a reading below 0 by more than 5 standard deviations,
            infinite, or above the range of the sensor, 446 N.
        """
        self._learn(trace, profile, peak_force, free_slide, final_position)

    def _learn(
        self,
        trace: PushTrace | None = None,
        profile: TipProfile | None = None,
        peak_force: float | None = None,
        free_slide: float | None = None,
        final_position: float | None = None,
        blur: Floats | float = 0.0,
    ) -> None:
        """Learn from a push; `blur` adds to the standard deviations of its readings (N, mm, mm)."""
        path, read = _readings(self._sd, trace, profile, peak_force, free_slide, final_position)
        farthest = float(path.position(np.cumsum(path.duration)).max())
        noise_sd = np.hypot(np.hypot(self._sd, [0.0, 0.0, self._way_error * farthest]), blur)
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
        """Both coefficients with their covariance (unit 1); the message names those not determined."""
        mean, covariance = self._belief.moments(self._belief.weight)
        status, message = self._judged(mean, covariance)
        return Estimate(NAMES, mean, covariance, status, message, ("1", "1"))

    @property
    def told(self) -> dict[str, float]:
        """Information on each coefficient in perfectly read pushes, unit 1; about 0: none."""
        mean, covariance = self._belief.moments(self._belief.weight)
        first, before = self._belief.moments(self._belief.prior)
        gained = mean**2 / np.diag(covariance) - first**2 / np.diag(before)
        scatter = max(self._problem.scatter.friction_push_sd, self._error)
        return dict(zip(NAMES, (gained * scatter**2).tolist(), strict=True))

    def _judged(self, mean: Floats, covariance: Floats) -> tuple[Status, str]:
        """Status of the estimate, and a sentence for it."""
        if self._refused > self._pushes:
            return Status.IMPOSSIBLE, (
                f"no friction explains {self._refused} of {self._refused + self._pushes} pushes: look for a"
                " contact stiffness or damping that is not the machine's, bad readings, a wrong unit or"
                " profile, or a part that is not the one of the problem"
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
    "mu_kinetic": "for mu_kinetic let it slide free, by a fast push with a hard stop,"
    " and read how far it went",
}


_SEEN = " of 0.2 mm or more"
_LOGGED = {"model_error": 0.05, "way_error": 0.03}


def identify_friction(
    data: Any, problem: CenteringProblem, *, part: int | None = None, throw: bool = True, **options: Any
) -> Estimate:
    """Estimate both coefficients of friction of one part from its pushes.

    Parameters
    ----------
    data : PushTrace, sequence of PushTrace or mapping, or log
        Pushes in any order; a mapping has ``profile`` (TipProfile) and any of ``peak_force`` (N),
        ``free_slide`` (mm), ``final_position`` (mm), see `FrictionEstimator.update`. Or the log of a
        centering cycle, its table "control", or the arrays of it: the motion of the tip then follows from the
        readings of the slide, the way of the part from the reported centres. Samples of 10 ms determine the
        friction of a heavy part; for one of 7 kg they say little, and the message says so.
    problem : CenteringProblem
        Expected friction and its scatter.
    part : int, optional
        Part of the log, unit 1; needed where there are several.
    throw : bool
        Raise where no friction explains the pushes. False: the status says so.
    **options
        Noise, see `FrictionEstimator`. Defaults for a log, whose samples blur a push: model_error 0.05,
        way_error 0.03.

    Returns
    -------
    Estimate
        Of ``mu_static`` and ``mu_kinetic``.

    Raises
    ------
    ValueError, TypeError
        When `FrictionEstimator` refuses, or for no pushes, or pushes that no friction explains.

    Examples
    --------
    >>> from centering import TipProfile, preset, simulate_push
    >>> problem = preset("printed")
    >>> push = simulate_push(problem.model, TipProfile.constant_speed(40.0, 0.1))
    >>> bool(abs(identify_friction([push, push], problem)["mu_static"] - 0.2) < 0.01)
    True
    """
    logged = hasattr(data, "tiers") or (isinstance(data, Mapping) and _is_logged(data))
    estimator = FrictionEstimator(problem, **(_LOGGED | options if logged else options))
    for push in logged_pushes(data, problem, part) if logged else map(_told, _pushes(data)):
        estimator._learn(**push)
    if not estimator.pushes + estimator.refused:
        raise ValueError(f"data must be at least one push{_SEEN if logged else ''}; got none")
    estimate = estimator.estimate
    if throw and estimate.status is Status.IMPOSSIBLE:
        raise ValueError(estimate.message)
    return estimate


def _is_logged(data: Mapping[str, Any]) -> bool:
    """Whether a mapping holds the columns or the tables of a log, not the readings of one push."""
    return "pushing" in data or bool(tables_in(data, "control"))


def _pushes(data: Any) -> list[Any]:
    """List of the pushes."""
    if isinstance(data, PushTrace | Mapping):
        return [data]
    if not isinstance(data, Iterable):
        raise TypeError(f"data must be pushes; got {checks.shown(data)}")
    return list(data)


def _told(push: Any) -> dict[str, Any]:
    """Arguments of `FrictionEstimator.update` of a push."""
    if isinstance(push, PushTrace):
        return {"trace": push}
    for key in checks.kind("each push", push, dict, ", or a PushTrace"):
        checks.one_of("a key of a push", key, ("profile", *(name for name, _, _ in _READ)))
    return dict(push)


def _readings(
    sd: Floats, trace: PushTrace | None, profile: TipProfile | None, *given: float | None
) -> tuple[TipProfile, Floats]:
    """Motion of the tip, and (peak force, free slide, final position), NaN without a reading."""
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
    """Check a reading; NaN without one."""
    name, unit, most = kind
    if value is None or value != value:
        return nan
    return checks.within(name, value, -_BELOW * sd, most, unit)
