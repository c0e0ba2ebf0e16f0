"""Steps of a profile: what was taken off or filtered, and what each step leaves of the readings."""

import dataclasses
from functools import cached_property
from typing import Any, Self

import numpy as np

from centering.roundness import _profile_steps as steps_of
from centering.roundness._asperities import asked_for, suspects, without_asperities
from centering.roundness._correction import corrected
from centering.roundness._evened import Evened, evened
from centering.roundness._filters import filter_of, warn_if_sparse
from centering.roundness._given_readings import GivenReadings
from centering.roundness._gone_round import unlike
from centering.roundness._hidden_noise import hidden_noise
from centering.roundness._known_noise import with_known_noise
from centering.roundness._origin import Made
from centering.roundness._reading_noise import noise_sd
from centering.roundness._robust_filter import LEAST
from centering.roundness._roller import RollerError
from centering.roundness._roller_task import task_of
from centering.roundness._samples import Samples
from centering.roundness._sampling import is_even
from centering.roundness._spindle_error import SpindleError
from centering.roundness._stuck import stuck
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SteppedReadings(GivenReadings):
    """Readings with their steps; each step gives another profile of the same ring."""

    _left: Floats | None = dataclasses.field(default=None, init=False, compare=False)
    _sd: Floats | None = dataclasses.field(default=None, init=False, compare=False)

    @classmethod
    def _made(cls, made: Made) -> Self:
        """The profile made by a step."""
        profile = cls.__new__(cls)
        left, sd = (None if each is None else lasting(each) for each in (made.left, made.sd))
        fields = {
            "angle": lasting(made.angle),
            "reading": lasting(made.reading),
            "tip_radius": made.tip_radius,
            "internal": made.internal,
            "circle": made.circle,
            "_origin": made.origin,
            "_left": left,
            "_sd": sd,
        }
        for name, value in fields.items():
            object.__setattr__(profile, name, value)
        return profile

    @property
    def steps(self) -> tuple[str, ...]:
        """Sentences on the steps so far (lengths in µm or mm)."""
        return self._origin.steps

    @property
    def roller_error(self) -> RollerError | None:
        """Error of the roller (mm, rad), removed if `seen`; None before `remove_roller_error`."""
        return self._origin.runout

    @cached_property
    def residuals(self) -> Floats:
        """Residuals of the last step for each of its readings, mm; before any step, of the circle."""
        return lasting(self.reading - self.circle.reading(self.angle)) if self._left is None else self._left

    @cached_property
    def noise_sd(self) -> float:
        """Standard deviation of one deviation without form, mm; infinite with too few samples.

        Over several turns: about all harmonics that the samples determine. Over one turn: from the median of
        their upper half, insensitive to a few lobes. A gap, or form above Nyquist's limit, makes it an upper
        bound. Filtered: that of the filtered noise. After `correct` that of the spindle's error is in it.
        """
        return noise_sd(self)

    @property
    def deviation_sd(self) -> Floats:
        """Standard deviation of each deviation, (n,), mm: `noise_sd`; larger in gaps once filtered."""
        return np.full(self.angle.size, self.noise_sd) if self._sd is None else self._sd

    @property
    def _samples(self) -> Samples:
        known = self.roller_error, self._origin.noise_sd, self._origin.noise_given
        return Samples(self.angle, self.reading, self._tip, self.circle.value, *known)

    def with_noise_sd(self, noise_sd: float) -> Self:
        """Return the profile with a known standard deviation of a reading, instead of that found in them.

        Parameters
        ----------
        noise_sd : float
            Standard deviation of one reading, mm, of repeated readings of one place.

        Returns
        -------
        Profile
            The same samples; `steps` tell both.

        Raises
        ------
        ValueError
            For a value not > 0, or above the height of the readings; for a profile that was filtered or
            separated.

        Examples
        --------
        >>> from centering.roundness import Profile
        >>> angle, noise = np.linspace(0.0, 2 * np.pi, 720, endpoint=False), np.random.default_rng(0)
        >>> rough = Profile(30.0 + 1e-3 * np.cos(3 * angle) + 2e-4 * noise.normal(size=720))  # of the surface
        >>> [f"{each.noise_sd:.5f}" for each in (rough, rough.with_noise_sd(5e-5))]  # mm
        ['0.00021', '0.00005']
        """
        return self._made(with_known_noise(self, noise_sd))

    def remove_roller_error(
        self,
        ratio: float | None = None,
        *,
        upr_max: int | None = None,
        refine: bool = True,
        near_integer: bool = False,
    ) -> Self:
        """Remove the runout of the probe's roller, Mears (6.19), (6.20), from each reading.

        A roller without slip turns R/tip_radius times as fast as the part and follows the arc along it: an
        offset modulates its phase. Runout and the part's harmonics come from one least-squares fit over all
        turns, with the centre and, unless disabled, the roller's radius within 0.5 %, which becomes the
        `tip_radius` of the profile where no ratio is given. Where noise, a single turn or a near whole number
        do not determine the ratio, the given one is used. A runout below the noise stays in the readings, and
        `steps` say so. A steady slip is indistinguishable from another radius. Several calls remove several
        waves, as of an oval roller.

        Parameters
        ----------
        ratio : float, optional
            Turns of the roller for one of the part, unit 1. Default: radius over tip radius.
        upr_max : int, optional
            Highest harmonic of the part in the fit, upr. Default: over several turns all that the samples
            determine, up to 200; else 50 (more for a ratio above 40), within the limit of the points of a
            turn.
        refine : bool
            Whether the ratio is fitted within 0.5 %.
        near_integer : bool
            Whether a ratio within 0.02 of a whole number is allowed.

        Returns
        -------
        Profile
            The same samples without it; `roller_error` holds it, and whether the roller slipped.

        Raises
        ------
        ValueError
            Without tip radius and ratio, or the part's radius and ratio; for an offset ring without tip
            radius; for a ratio near a whole number; for more harmonics than samples allow; when the turns do
            not separate runout from form (the message says how many more do); for a filtered profile.
        """
        if self._origin.filter:
            rule = "remove_roller_error must come before a filter, which keeps no turns"
            raise ValueError(f"{rule}; got {self._origin.filter}")
        if ratio is None:
            self._need_radius("ratio, the radius over tip_radius,")
        task = task_of(self._samples, ratio=ratio, upr_max=upr_max, refine=refine, near_integer=near_integer)
        return self._made(steps_of.without_runout(self, task))

    def remove_asperities(
        self, sigmas: float = 6.0, *, width: float | None = None, both: bool = False
    ) -> Self:
        """Take out readings that stand out of the form, as those of dust and burrs; before a filter.

        The form is that of the robust filter at 150 upr, or a twentieth of the points of a turn if that is
        less; the standard deviation follows from the median of the residuals, as of normal noise: with the
        heavier tails of a Laplace distribution 12 sd are as rare as 6. Above it is away from the material, in
        a bore towards the axis. An asperity ends where the residuals fall below twice that.
        The edge of a slot or a keyway is none: the readings go on level on one side of it; nor is the land
        between two slots, beyond which the readings are level with it again. Dust within some undulations of
        that cut-off beside an edge is missed, or taken out with the readings up to the edge.
        Nothing is put in its place: harmonics are fitted to the other readings. `removed` keeps what was
        taken out, and the contact with a grinder still counts it.

        Parameters
        ----------
        sigmas : float
            Least height of an asperity above the form, standard deviations, unit 1, > 2.
        width : float, optional
            Greatest width of an asperity in the part angle, rad; a wider one is form and stays. Default: any.
        both : bool
            Whether pits are taken out, too; in a bore they lie away from the axis.

        Returns
        -------
        Profile
            The samples that are left, with `removed`; `steps` say how many.

        Raises
        ------
        ValueError, TypeError
            For more than 2 % of the readings, which are form; for fewer than 64 samples; for a profile that
            was filtered or separated.

        Examples
        --------
        >>> from centering.roundness import Profile
        >>> angle, noise = np.linspace(0.0, 2 * np.pi, 720, endpoint=False), np.random.default_rng(0)
        >>> form = 1e-3 * np.cos(3 * angle) + 1e-4 * noise.normal(size=720)
        >>> form[200] += 0.05  # dust
        >>> clean = Profile(30.0 + form).remove_asperities()
        >>> clean.removed.shape, round(1e3 * clean.filter(upr=50).roundness().ron_t, 1)
        ((1, 2), 2.1)
        """
        asked = asked_for(sigmas, both, width)
        return self._made(without_asperities(self, asked))

    def correct(self, spindle: SpindleError) -> Self:
        """Take the error of the tester's spindle off each reading; before a filter.

        The error belongs to the spindle angle of the setup in which it was found, and to the probe's side.
        Its standard deviation is added to the noise.

        Parameters
        ----------
        spindle : SpindleError
            Error of the spindle, mm, of a `Separation`.

        Returns
        -------
        Profile
            The same samples without the error.

        Raises
        ------
        ValueError, TypeError
            For a profile that was filtered, separated or corrected before.

        Examples
        --------
        >>> from centering.roundness import Profile, reverse
        >>> angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> part, spindle = 3e-4 * np.cos(3 * angle), 1e-4 * np.cos(2 * angle)
        >>> found = reverse(Profile(angle, 30.0 + part + spindle), Profile(angle, 30.0 + part - spindle))
        >>> later = Profile(angle, 40.0 + 2e-4 * np.cos(5 * angle) + spindle)
        >>> round(later.roundness().ron_t, 6), round(later.correct(found.spindle).roundness().ron_t, 6)
        (0.000582, 0.0004)
        """
        return self._made(corrected(self, spindle))

    def filter(
        self,
        kind: str = "gaussian",
        upr: float | tuple[float | None, float | None] | str = 50,
        *,
        tension: float = 0.0,
    ) -> Self:
        """Filter the form, closed: low pass, high pass or band (ISO 16610-21, -22, -31; ISO 12181-2).

        Of harmonic n with the cut-off c pass exp2(-(n/c)^2) (Gaussian), 1/(1 + (1 - b) q^2 + b q) with q =
        (sin(pi n/N)/sin(pi c/N))^2 on N points and the tension b (spline), or 1/(1 + (n/c)^2/3), the two RC
        members of old drawings without their phase. The robust filter fits a parabola about each point;
        outliers lose their weight by Tukey's rule.

        A turn on an even grid is filtered by FFT, also where part angles lie up to 0.2 steps beside it, as of
        3600 points of a ring 10 µm off its axis. Other samples (several turns, gaps, a ring farther off)
        give harmonics by least squares, for a Gaussian up to five cut-offs, for other filters all that the
        samples tell (seconds for some thousands), across a gap two to one; several turns are averaged. The
        eccentricity is removed exactly before.

        Parameters
        ----------
        kind : {"gaussian", "spline", "2rc", "robust"}
            Filter.
        upr : float, tuple or str
            Cut-off of a low pass, upr (unit 1); usual are 15, 50, 150, 500 and 1500. A pair is a band,
            ``(15, 150)``, or a high pass, ``(15, None)``; a usual band is named by ``"15-150"``. A lower
            cut-off of 1 takes off nothing but mean and 1 upr.
        tension : float
            Tension of the spline, 0 ... 1, unit 1; 0.62524 resembles the Gaussian.

        Returns
        -------
        Profile
            One turn on an even grid of the part angle, with the points of a turn so far, at the same offset.

        Raises
        ------
        ValueError
            For a cut-off not below half of the points of a turn, fewer than 2 upr + 1 samples (robust: 64),
            or gaps in which noise and form would grow (a condition above 10).

        Warns
        -----
        UserWarning
            Where a turn has fewer than 7 points for each undulation at the cut-off; where the standard
            deviation of the form in a gap is above twice that of a reading.

        Examples
        --------
        >>> from centering.roundness import Profile
        >>> angle = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
        >>> form = 1e-3 * np.cos(2 * angle) + 2e-4 * np.cos(30 * angle)
        >>> form[200] += 0.05  # dust
        >>> dusty = Profile(angle, 30.0 + form)
        >>> [round(1e3 * dusty.filter(kind, upr=50).roundness().value, 1) for kind in ("gaussian", "robust")]
        [7.5, 2.3]
        """
        asked = filter_of(kind, upr, tension, self.nyquist)
        least = LEAST if kind == "robust" else int(2 * asked.cut_off) + 1
        if self.angle.size < least:
            needed = f"at least {least} samples for a {asked}"
            raise ValueError(f"reading must have {needed}; got {self.angle.size}")
        warn_if_sparse(2 * self.nyquist, asked.cut_off)
        if kind == "robust":
            return self._made(steps_of.filtered_robustly(self, asked))
        even = self._evened
        made = steps_of.filtered(self, asked) if even is None else steps_of.filtered_evenly(self, asked, even)
        profile = self._made(made)
        profile._note(**self._looked_for)
        return profile

    @cached_property
    def _evened(self) -> Evened | None:
        """Deviations on an even turn; None where angles are not near one, or a roller's error is unsure."""
        if self.roller_error is not None and not is_even(self.part_angle):
            return None
        return evened(self.part_angle, self.deviation, self.circle.value)

    @property
    def _looked_for(self) -> dict[str, Any]:
        """What is looked for before a filter, by the name that it has in the origin."""
        return {
            "suspects": self._suspects,
            "hidden": self._hidden,
            "stuck": self._stuck,
            "unlike": self._unlike,
        }

    @cached_property
    def _hidden(self) -> str:
        """Reason why the noise cannot be known from the readings; "": it can."""
        known = self._origin.hidden
        return (known or "") if known is not None or self._origin.sd else hidden_noise(self)

    @cached_property
    def _stuck(self) -> str:
        """Sentence on equal readings in a row, as of a probe that stood still; "": there are none."""
        known = self._origin.stuck
        return (known or "") if known is not None or self._origin.sd else stuck(self.angle, self.reading)

    @cached_property
    def _unlike(self) -> str:
        """Sentence on turns that do not repeat; "": they do."""
        known = self._origin.unlike
        return (known or "") if known is not None or self._origin.sd else unlike(self.angle, self.reading)

    @cached_property
    def _suspects(self) -> int:
        """Readings that look like asperities; 0 once they were taken out, or looked for."""
        known = self._origin.suspects
        return suspects(self) if known < 0 and not self._origin.sd else max(known, 0)
