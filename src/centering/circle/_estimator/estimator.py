"""The streaming estimator: radius and centre after each reading, and whether they are certain enough."""

from collections.abc import Mapping
from math import degrees, inf, log, pi
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from centering.circle._estimator import slots as at
from centering.circle._estimator.forecast_kernels import arc_needed
from centering.circle._estimator.restart_kernels import carry_radius
from centering.circle._estimator.settings import empty_state, refusal, write_quantiles
from centering.circle._estimator.start_kernels import clear
from centering.circle._estimator.update_kernels import run, update_step
from centering.circle._estimator.validity import evidence_of, limited_by, scale_of, sentence, unknown
from centering.circle._estimator.validity_kernels import holds_axis, judge
from centering.circle._fit.arguments import flag, pairs, radius_and_sd
from centering.circle._fit.estimate import CircleEstimate
from centering.circle._fit.form import assumed_lobes, known_harmonics
from sdpgrind.base import checks, units
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Status

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe


class GeometryEstimator:
    """Estimate radius and centre of an offset ring, by single readings, until the centre is certain enough.

    The estimate is the least-squares fit of the exact curve of an offset circle, at any offset and over any
    arc, by a recursion of constant cost. It is valid when the readings cover `arc_min` and the band

        max(t s, z noise_sd) u_c inflation + form bound  <=  max(rel_tol offset, abs_tol):

    u_c is the standard deviation of the centre in its worst direction for unit noise, s that of the
    residuals, t Student's and z the normal quantile of `confidence`. The inflation accounts for noise
    correlated between successive readings (AR(1)); it is 1 unless the correlation of the residuals is
    significant. Whole turns separate form (2 to 5 upr) from noise: the inflation may then be below 1, and the
    shift of the centre by form in a broken turn joins the form bound. (Mears (4.49)-(4.52) take the error of
    a mean for that of the offset.)

    Readings more than 5 standard deviations from the prediction are refused and kept in `rejected`. When more
    than half of the latest 30 are refused the part has moved: the estimate restarts from the latest readings,
    with the radius known. Smaller moves are found by comparing the latest 30 and 60 readings with those
    before, once the form is known: after a whole turn, or from the start where `form` or `harmonics` give it.
    Before that a difference significant at 1 % may be form, and the estimate is not valid until the next
    comparison, 30 readings later, or the whole turn. The first 30 readings are screened together, about a
    circle that most of them agree with.

    Parameters
    ----------
    noise_sd : float, optional
        Least standard deviation of one reading assumed in the band, mm. Default: only that of the residuals.
        Where many readings repeat the one before, rounding to the smallest step seen counts as noise too.
    confidence : float
        Probability in (0, 1) that the true centre lies within the band, unit 1.
    rel_tol, abs_tol : float
        Allowed error of the centre, the larger of two: relative to the offset (unit 1) and in mm.
    model : {"exact", "limacon"}
        Curve of an offset circle, or R + d cos(angle - phi) (Mears (4.4)), for which readings may have any
        sign.
    tip_radius : float
        Radius of the probe's tip, mm.
    arc_min : float
        Least angle that the readings must cover, rad.
    forgetting : float
        Weight of a reading after one turn of travel, in (0, 1], unit 1; a spindle at rest forgets nothing.
    form : mapping of int to float, optional
        Amplitude (mm) that the part may have at undulations per revolution; a bound on the error joins the
        band.
    harmonics : Harmonics, optional
        Known form (upr, amplitude in mm, phase in rad of the part's own angle), subtracted from the readings.
    joint : bool
        Whether the band holds for both coordinates of the centre at once, with sqrt(2 F) for t.
    radius_prior : pair of float, optional
        Known radius and its standard deviation, mm.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> angle = np.radians(np.arange(90.0))
    >>> estimator = GeometryEstimator(noise_sd=0.002)
    >>> for a, r in zip(angle, 3.0 * np.cos(angle) + np.sqrt(60.0**2 - 9.0 * np.sin(angle) ** 2)):
    ...     estimator.update(angle=a, reading=r)
    ...     if estimator.valid:
    ...         break
    >>> estimator.estimate.samples, round(estimator.estimate.radius, 6), round(estimator.estimate.offset, 6)
    (33, 60.0, 3.0)
    """

    def __init__(
        self,
        *,
        noise_sd: float | None = None,
        confidence: float = 0.999,
        rel_tol: float = 0.03,
        abs_tol: float = 0.002,
        model: str = "exact",
        tip_radius: float = 0.0,
        arc_min: float = units.deg(30.0),
        forgetting: float = 1.0,
        form: Mapping[int, float] | None = None,
        harmonics: Any = None,
        joint: bool = False,
        radius_prior: tuple[float, float] | None = None,
    ) -> None:
        lobes, known = assumed_lobes(form), known_harmonics(harmonics)
        self._model = checks.one_of("model", model, ("exact", "limacon"))
        self._state = empty_state(lobes, known)
        state = self._state
        state[at.LIMACON] = model == "limacon"
        state[at.TIP] = checks.nonnegative("tip_radius", tip_radius, "mm")
        state[at.NOISE] = 0.0 if noise_sd is None else checks.nonnegative("noise_sd", noise_sd, "mm")
        state[at.REL_TOL] = checks.nonnegative("rel_tol", rel_tol, "1")
        state[at.ABS_TOL] = checks.positive("abs_tol", abs_tol, "mm")
        self._arc_min = state[at.ARC_MIN] = checks.within("arc_min", arc_min, 0.0, 2 * pi, "rad")
        state[at.LOG_FORGETTING] = log(checks.share("forgetting", forgetting, "1")) / (2 * pi)
        state[at.JOINT] = flag("joint", joint)
        write_quantiles(state, checks.probability("confidence", confidence))
        self._prior = (0.0, 0.0) if radius_prior is None else radius_and_sd(radius_prior, float(tip_radius))
        self._rejected: dict[int, tuple[float, float]] = {}
        self.reset()
        self._fresh = state.copy()

    def reset(self, keep_radius: bool = False) -> None:
        """Forget the readings, as after a push.

        Parameters
        ----------
        keep_radius : bool
            Keep radius and noise, with their present uncertainty (standard deviation of the radius in mm), as
            prior knowledge, where the readings determine them.
        """
        state = self._state
        if keep_radius and state[at.USED] > 0:
            carry_radius(state)
        elif not keep_radius:
            state[at.PRIOR_RADIUS], state[at.PRIOR_SD] = self._prior
            state[at.PRIOR_NOISE] = state[at.PRIOR_FREEDOM] = 0.0
        clear(state)
        state[at.INDEX] = state[at.RESTARTS] = 0.0
        self._rejected.clear()

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it: settings and radius known, before the first reading."""
        from centering.circle._estimator.recipe import recipe_of

        return recipe_of(self._fresh)

    def update(self, *, angle: float, reading: float) -> None:
        """Take one reading.

        Parameters
        ----------
        angle, reading : float
            Spindle angle, rad, in the order of time, with or without whole turns counted, in either sense of
            rotation; radial position of the probe, mm.

        Raises
        ------
        ValueError
            For NaN, a step of more than a turn, coarse steps that suggest degrees, or a reading <= 0 (exact
            curve); the state is then unchanged.
        """
        try:
            code = update_step(self._state, float(angle + 0.0), float(reading + 0.0))
        except TypeError:
            code = update_step(
                self._state, checks.number("angle", angle, "rad"), checks.number("reading", reading, "mm")
            )
        if code != 0:
            self._note(code, float(angle), float(reading))

    def extend(self, angle: npt.ArrayLike, reading: npt.ArrayLike) -> None:
        """Take many readings, as `update` one by one.

        Parameters
        ----------
        angle, reading : array_like, shape (m,)
            Spindle angles (rad) and readings (mm).

        Raises
        ------
        ValueError
            As `update`; the readings before the refused one have been taken.
        """
        self._take(angle, reading, False)

    def first_valid(self, angle: npt.ArrayLike, reading: npt.ArrayLike) -> int | None:
        """Take readings until the estimate is valid; return the index of the last one, None if never valid.

        Parameters
        ----------
        angle, reading : array_like, shape (m,)
            Spindle angles (rad) and readings (mm), as for `extend`.
        """
        return self._take(angle, reading, True)

    @property
    def valid(self) -> bool:
        """Whether the centre is within tolerance at the confidence asked, over at least `arc_min` (rad)."""
        return bool(judge(self._state, self._arc_min))

    @property
    def estimate(self) -> CircleEstimate:
        """Radius and centre, mm, with the limiting cause and the arc still needed (rad)."""
        state = self._state
        common = {"tip_radius": float(state[at.TIP]), "model": self._model}
        if state[at.USED] == 0:
            known = max(float(state[at.PRIOR_RADIUS] - state[at.TIP]), 0.0) if state[at.PRIOR_SD] else 0.0
            return unknown([known, 0.0, 0.0], "no readings yet", common)
        valid = bool(judge(state, 0.0))
        arc = 0.0 if valid else float(arc_needed(state))
        limit = limited_by(state)
        common |= evidence_of(state, limit, arc)
        value, message = state[[at.RADIUS, at.FIT_X, at.FIT_Y]], sentence(state, limit, arc)
        if not np.isfinite(state[at.SCALE]):
            return unknown(value, message, common)
        scale, freedom = scale_of(state)
        covariance = (scale * state[at.INFLATION]) ** 2 * state[at.SHAPE : at.SHAPE + 9].reshape(3, 3)
        status = Status.OK if valid else Status.UNDETERMINED if limit == "samples" else Status.UNSURE
        if limit == "noise" and not holds_axis(state):
            status = Status.IMPOSSIBLE
        return CircleEstimate(
            value, 0.5 * (covariance + covariance.T), status, message, freedom=freedom, **common
        )

    @property
    def rejected(self) -> tuple[Floats, Floats]:
        """Angles (rad) and readings (mm) that were refused, in the order of time: dust or a burr."""
        kept = [self._rejected[index] for index in sorted(self._rejected)]
        angle, reading = np.array(kept, dtype=float).reshape(-1, 2).T
        return angle, reading

    @property
    def restarts(self) -> int:
        """Number of moves of the part found since the last `reset`, unit 1; each restarts the estimate."""
        return int(self._state[at.RESTARTS])

    @property
    def band(self) -> float:
        """Greatest error of the centre at the confidence asked, mm; inf while the readings are too few."""
        judge(self._state, 0.0)
        return float(self._state[at.BAND]) if self._state[at.USED] else inf

    def __repr__(self) -> str:
        circle, state = self.estimate, self._state
        known = f", radius known to {1e3 * state[at.PRIOR_SD]:.3g} µm" if state[at.PRIOR_SD] else ""
        if circle.samples == 0:
            return f"GeometryEstimator(no readings{known}; {self._model})"
        return (
            f"GeometryEstimator({circle.samples} readings over {degrees(circle.swept):.4g} deg{known};"
            f" radius {circle.radius:.7g} mm, offset {circle.offset:.4g} mm;"
            f" {'valid' if self.valid else 'not valid'}: {circle.message})"
        )

    def _take(self, angle: npt.ArrayLike, reading: npt.ArrayLike, until_valid: bool) -> int | None:
        """Take readings until the end or, if asked, until the estimate is valid: return that index."""
        angles, readings = pairs(angle, reading)
        done = 0
        while done < angles.size:
            done, code, valid = run(self._state, angles, readings, done, until_valid)
            if code != 0:
                self._note(code, angles[done - 1], readings[done - 1])
            if valid:
                return int(done) - 1
        return None

    def _note(self, code: int, angle: float, reading: float) -> None:
        """Raise for an invalid reading, or update the refused ones: a later screening may accept some."""
        if code < 0:
            raise refusal(code, angle, reading)
        cells = self._state[at.RING_AT : at.TAIL].reshape(at.RING, at.CELL)
        for cell in cells[: int(self._state[at.SEEN])]:
            if cell[2]:
                self._rejected[int(cell[4])] = (float(cell[0]), float(cell[1]))
            else:
                self._rejected.pop(int(cell[4]), None)
