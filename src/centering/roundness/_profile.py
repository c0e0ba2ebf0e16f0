"""A measured profile of a ring and its steps: removed errors, filters, harmonics, reference circles, file."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from centering.roundness import _profile_record as profile_record
from centering.roundness import _profile_steps as steps_of
from centering.roundness._correction import corrected
from centering.roundness._filters import filter_of, warn_if_sparse
from centering.roundness._former_names import FormerNames
from centering.roundness._harmonics import Harmonics
from centering.roundness._origin import Made
from centering.roundness._part_readings import PartReadings
from centering.roundness._profile_sheet import report as sheet_of_profile
from centering.roundness._read import Turned, samples
from centering.roundness._robust_filter import LEAST
from centering.roundness._roller import RollerError
from centering.roundness._roller_task import task_of
from centering.roundness._roundness import Roundness
from centering.roundness._samples import Samples
from centering.roundness._sampling import checked_degree, is_even
from centering.roundness._spindle_error import SpindleError
from sdpgrind.base import pictures
from sdpgrind.base.arrays import lasting
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Profile(FormerNames, PartReadings, Plan):
    """Readings of a ring over the spindle angle; immutable.

    Exact at any offset of the ring: the tip's centre lies at reading + tip_radius from the spindle axis (in a
    bore at reading - tip_radius); part angle and deviation refer to the part's own centre. Angles may repeat,
    lie in any order, leave gaps and span several turns; those of an encoder that restarts at each turn are
    unwrapped.

    Parameters
    ----------
    angle, reading : array_like, shape (n,)
        Spindle angle, rad, and radial position of the probe's contact, mm, > 0.
    tip_radius : float
        Radius of the probe's tip or roller, mm, >= 0.
    internal : bool
        Whether a bore is read, from within. Readings count away from the axis as well; peaks are at wide
        places.

    Attributes
    ----------
    circle : CircleEstimate
        The part's circle about the spindle, mm: least squares of the exact curve, or the result of a later
        step.

    Raises
    ------
    ValueError, TypeError
        For unequal lengths, values that are not finite, readings <= 0, fewer than 4 different angles, angles
        that suggest degrees, a tip radius < 0 or too large for the bore; when the readings determine no
        circle about the spindle axis.

    Examples
    --------
    >>> angle = np.arange(4 * 360) * 2 * np.pi / 360
    >>> tip_center = 65.69 + 2e-4 * np.cos(3 * angle) + 1.5e-3 * np.cos(61.94 / 3.75 * angle - 1.0)  # centred
    >>> profile = Profile(angle, tip_center - 3.75, tip_radius=3.75)
    >>> clean = profile.remove_roller_error().filter("gaussian", upr=50)
    >>> clean.harmonics(upr_max=60).largest(1)[0][0], round(clean.roller_error.amplitude, 6)
    (3.0, 0.0015)
    """

    kind = "centering.profile"
    _left: Floats | None = dataclasses.field(default=None, init=False, compare=False)
    _sd: Floats | None = dataclasses.field(default=None, init=False, compare=False)

    @classmethod
    def read(
        cls,
        data: Any,
        *,
        angle: Any = None,
        reading: Any = None,
        deviation: Any = None,
        radius: float | None = None,
        tip_radius: float = 0.0,
        internal: bool = False,
        group: str | None = None,
        missing: Sequence[str] = (),
        plausible: bool = True,
    ) -> "Profile":
        """Read a file of a form tester, or a table; units stand in the call or in the file.

        Parameters
        ----------
        data : path, pandas.DataFrame, xarray.Dataset, mapping of arrays
            Text (.csv, .txt, .dat, .lvm, .asc), .tdms, .h5, .hdf5 or .x3p. In X3P x is the length of arc
            and z the deviation.
        angle : str or tuple, optional
            Header of the spindle angle, ``("angle", "deg")``; it may start again at each turn. Not for X3P.
        reading, deviation : str or tuple, optional
            Header of the radial position, or of what it deviates from `radius`: ``("dev", "um")``. Of the two
            one is given. Default for X3P: deviation z.
        radius : float, optional
            Nominal radius of deviations, mm.
        tip_radius, internal
            As of a profile (mm).
        group : str, optional
            Group of a TDMS or HDF5 file. Default: all that hold the columns.
        missing : sequence of str
            Further words for no reading. Points without one are left out.
        plausible : bool
            Whether units, radius and tip radius are held against what a gauge can mean, angles must leave no
            more than a quarter of the ring without a reading, and turns of X3P must be alike. False takes an
            arc.

        Returns
        -------
        Profile
            The profile; its `source` tells what was read.

        Raises
        ------
        ValueError
            For a missing or wrong unit, header or number (in one sentence with file, header and value);
            without the radius of deviations; for a radius outside 1 ... 3000 mm or a tip radius outside
            0.001 ... 50 mm.
        ImportError
            Without the library of the format (extra ``io``).

        Examples
        --------
        >>> angle = np.arange(0.0, 360.0, 2.0)
        >>> table = {"angle (deg)": angle, "dev (um)": 50 * np.cos(np.radians(angle))}
        >>> round(Profile.read(table, angle="angle", deviation="dev", radius=40.0).circle.offset, 4)  # mm
        0.05
        """
        found = samples(data, angle, reading, deviation, radius, tip_radius, group, missing, plausible)
        return profile_read(found, tip_radius, internal)

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
        return steps_of.noise_sd(self)

    @property
    def deviation_sd(self) -> Floats:
        """Standard deviation of each deviation, (n,), mm: `noise_sd`; larger in gaps once filtered."""
        return np.full(self.angle.size, self.noise_sd) if self._sd is None else self._sd

    @property
    def _samples(self) -> Samples:
        return Samples(
            self.angle, self.reading, self._tip, self.circle.value, self.roller_error, self._origin.noise_sd
        )

    def remove_roller_error(
        self,
        ratio: float | None = None,
        *,
        upr_max: int | None = None,
        refine: bool = True,
        near_integer: bool = False,
    ) -> "Profile":
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
            Without tip radius and ratio, or for an offset ring without tip radius; for a ratio near a whole
            number; for more harmonics than samples allow; when the turns do not separate runout from form
            (the message says how many more do); for a filtered profile.
        """
        if self._origin.filter:
            rule = "remove_roller_error must come before a filter, which keeps no turns"
            raise ValueError(f"{rule}; got {self._origin.filter}")
        task = task_of(self._samples, ratio=ratio, upr_max=upr_max, refine=refine, near_integer=near_integer)
        return _profile(steps_of.without_runout(self, task))

    def correct(self, spindle: SpindleError) -> "Profile":
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
        >>> from centering.roundness import reverse
        >>> angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> part, spindle = 3e-4 * np.cos(3 * angle), 1e-4 * np.cos(2 * angle)
        >>> found = reverse(Profile(angle, 30.0 + part + spindle), Profile(angle, 30.0 + part - spindle))
        >>> later = Profile(angle, 40.0 + 2e-4 * np.cos(5 * angle) + spindle)
        >>> round(later.roundness().ron_t, 6), round(later.correct(found.spindle).roundness().ron_t, 6)
        (0.000582, 0.0004)
        """
        return _profile(corrected(self, spindle))

    def filter(
        self,
        kind: str = "gaussian",
        *,
        upr: float | tuple[float | None, float | None] | str = 50,
        tension: float = 0.0,
    ) -> "Profile":
        """Filter the form, closed: low pass, high pass or band (ISO 16610-21, -22, -31; ISO 12181-2).

        Of harmonic n with the cut-off c pass exp2(-(n/c)^2) (Gaussian), 1/(1 + (1 - b) q^2 + b q) with q =
        (sin(pi n/N)/sin(pi c/N))^2 on N points and the tension b (spline), or 1/(1 + (n/c)^2/3), the two RC
        members of old drawings without their phase. The robust filter fits a parabola about each point;
        outliers lose their weight by Tukey's rule.

        A turn on an even grid is filtered by FFT. Other samples (several turns, gaps, an offset ring) give
        harmonics by least squares, for a Gaussian up to five cut-offs, for other filters all that the samples
        tell (seconds for some thousands), across a gap two to one; several turns are averaged. The
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
            return _profile(steps_of.filtered_robustly(self, asked))
        how = steps_of.filtered_evenly if is_even(self.part_angle) else steps_of.filtered
        return _profile(how(self, asked))

    def harmonics(self, upr_max: int | None = None) -> Harmonics:
        """Return amplitude and phase of undulations about the centre (no 1 upr): least squares, all turns.

        The offset, of 1 upr, is in `circle`.

        Parameters
        ----------
        upr_max : int, optional
            Highest harmonic, upr. Default: all that the samples determine or a filter has passed.

        Returns
        -------
        Harmonics
            Amplitudes and their sd in mm, phases in the part angle in rad.

        Raises
        ------
        ValueError
            For more than half of the points of a turn, fewer than 2 upr_max + 1 samples, or gaps that leave
            the harmonics undetermined (a condition above 1000); by default also where not even 2 upr are
            determined.

        Warns
        -----
        UserWarning
            Where, by default, a gap leaves less than half of the harmonics that the points of a turn would
            determine.
        """
        degree = None if upr_max is None else checked_degree("upr_max", upr_max, 2 * self.nyquist)
        if degree is not None and self.angle.size < 2 * degree + 1:
            raise ValueError(
                f"reading must have at least {2 * degree + 1} samples for {degree} upr; got {self.angle.size}"
            )
        return steps_of.harmonics(self, degree)

    def roundness(self, kind: str = "LSC") -> Roundness:
        """Return a reference circle of the profile and the roundness about it, ISO 12181-1.

        Parameters
        ----------
        kind : {"LSC", "MCC", "MIC", "MZC"}
            Least squares, minimum circumscribed, maximum inscribed or minimum zone circle.

        Returns
        -------
        Roundness
            Circle about the spindle axis and roundness, mm, with contacts and certificate.

        Raises
        ------
        ValueError
            When the samples cover less than half a turn, or nothing fixes the circle.
        """
        return steps_of.roundness(self, kind)

    def plot(self) -> Any:
        """Draw the profile magnified about its circle (µm) and its harmonics (µm); return the figure."""
        return pictures.drawn("centering.roundness._profile_picture:plot", self)

    def report(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        limits: Mapping[str, float] | None = None,
    ) -> str:
        """Write one HTML page: limits, four reference circles, undulations, pictures, source, digest.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping of str to float, optional
            Limits of "RONt", "RONp", "RONv", "RONq" about the least-squares circle, mm, or about another as
            "RONt (MZC)"; a RONt whose 95 % interval holds its limit is not decided.

        Returns
        -------
        str
            The path of the file, or the text of the page.

        Raises
        ------
        ValueError
            For a limit of another name, not > 0, or above 0.5 mm.
        ImportError
            With a path, without the extra ``report``.

        Examples
        --------
        >>> angle = np.arange(4 * 360) * 2 * np.pi / 360
        >>> noise = 1e-5 * np.random.default_rng(0).normal(size=angle.size)
        >>> profile = Profile(angle, 65.69 + 2e-4 * np.cos(3 * angle) + noise)
        >>> print(profile.report(limits={"RONt": 0.001}).splitlines()[5])
        RONt (LSC) 0.4562 µm (0.38 .. 0.48, 95 % guaranteed), limit 1 µm: kept
        """
        return sheet_of_profile(self, path, limits)

    @property
    def dataset(self) -> xr.Dataset:
        """Samples as labelled arrays: angles in rad, lengths in mm; steps and their results as attributes."""
        return profile_record.dataset_of(self, self._left, self._sd)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> "Profile":
        return _profile(profile_record.made_from(dataset))

    def _told(self) -> str:
        circle, done = self.circle, "; ".join(self.steps) or "as measured"
        height = f"{1e3 * float(np.ptp(self.deviation)):.4g} µm from peak to valley"
        return (
            f"{self.angle.size} points on {counted(self.turns, 'turn')}, radius {circle.radius:.7g} mm"
            f" at offset {circle.offset:.4g} mm, {height}; {done}"
        )


def profile_read(found: Turned, tip_radius: float, internal: bool) -> Profile:
    """The profile of what was read, with its origin."""
    profile = Profile(found.angle, found.reading, tip_radius=tip_radius, internal=internal)
    origin = dataclasses.replace(profile._origin, source=found.source.to_json())
    object.__setattr__(profile, "_origin", origin)
    return profile


def _profile(made: Made) -> Profile:
    """The profile made by a step."""
    profile = Profile.__new__(Profile)
    fields = {"angle": lasting(made.angle), "reading": lasting(made.reading), "tip_radius": made.tip_radius}
    left, sd = (None if each is None else lasting(each) for each in (made.left, made.sd))
    found = {
        "internal": made.internal,
        "circle": made.circle,
        "_origin": made.origin,
        "_left": left,
        "_sd": sd,
    }
    for name, value in {**fields, **found}.items():
        object.__setattr__(profile, name, value)
    return profile
