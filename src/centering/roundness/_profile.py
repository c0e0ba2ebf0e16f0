"""A measured profile of a ring and its steps: removed errors, filters, harmonics, reference circles, file."""

import dataclasses
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from centering.roundness import _profile_record as profile_record
from centering.roundness import _profile_steps as steps_of
from centering.roundness._comparison import compared
from centering.roundness._form_change import FormChange
from centering.roundness._former_names import FormerNames
from centering.roundness._harmonics import Harmonics
from centering.roundness._profile_sheet import report as sheet_of_profile
from centering.roundness._roundness import Roundness
from centering.roundness._sampling import checked_degree
from centering.roundness._stepped_readings import SteppedReadings
from centering.roundness._turn import told_radius
from sdpgrind.base import checks, pictures
from sdpgrind.base.brief import counted
from sdpgrind.base.plans import Plan
from sdpgrind.base.warned import warn

_USUAL = 50  # source: ISO 12181-2, a usual cut-off, upr


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Profile(FormerNames, SteppedReadings, Plan):
    """Readings of a ring over the spindle angle; immutable.

    Exact at any offset of the ring: the tip's centre lies at reading + tip_radius from the spindle axis (in a
    bore at reading - tip_radius); part angle and deviation refer to the part's own centre. Angles may repeat,
    lie in any order, leave gaps and span several turns; those of an encoder that restarts at each turn are
    unwrapped. Readings alone are one even turn that begins at 0, whose last point is not the first again. Of
    one turn with angles a last reading at the place of the first, within a quarter of a step, is dropped.

    Parameters
    ----------
    angle, reading : array_like, shape (n,)
        Spindle angle, rad, and radial position of the probe's contact, mm, > 0.
    tip_radius : float
        Radius of the probe's tip or roller, mm, >= 0.
    internal : bool
        Whether a bore is read, from within. Readings count away from the axis as well; peaks are at
        narrow places, where the material stands out, valleys at wide ones (ISO 12181-1).
    plausible : bool
        Whether readings and tip radius are held against what a gauge can mean: 1 ... 3000 mm and
        0.001 ... 50 mm.

    Attributes
    ----------
    circle : CircleEstimate
        The part's circle about the spindle, mm: least squares of the exact curve, or the result of a later
        step.

    Raises
    ------
    ValueError, TypeError
        For unequal lengths, values that are not finite, readings <= 0 or implausible, readings of both signs,
        which are deviations, fewer than 4 different angles, angles that suggest degrees, a tip radius < 0,
        implausible or too large for the bore; for a last reading at the place of the first that differs
        from it by more than 10 standard deviations of a reading; when the readings determine no circle about
        the spindle axis.

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

    def harmonics(
        self,
        upr_max: int | None = None,
        *,
        limits: Mapping[int | tuple[int, int], float] | None = None,
        as_range: bool = False,
    ) -> Harmonics:
        """Return amplitude and phase of undulations about the centre (no 1 upr): least squares, all turns.

        The offset, of 1 upr, is in `circle`.

        Parameters
        ----------
        upr_max : int, optional
            Highest harmonic, upr. Default: all that the samples determine or a filter has passed.
        limits : mapping, optional
            Largest amplitudes, mm, of bands and harmonics, ``{(2, 15): units.um(0.5), 42: units.um(0.05)}``;
            `exceeds` of the result tells which are above them.
        as_range : bool
            Whether limits and tables are of the height from valley to peak, twice the amplitude.

        Returns
        -------
        Harmonics
            Amplitudes and their sd in mm, phases in the part angle in rad.

        Raises
        ------
        ValueError
            For more than half of the points of a turn, fewer than 2 upr_max + 1 samples, or gaps that leave
            the harmonics undetermined (a condition above 1000); by default also where not even 2 upr are
            determined; for a limit of a harmonic that was not measured.

        Warns
        -----
        UserWarning
            Where, by default, a gap leaves less than half of the harmonics that the points of a turn would
            determine; for limits after a filter.

        Examples
        --------
        >>> turn = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> ring = Profile(40.0 + 4e-4 * np.cos(3 * turn) + 8e-5 * np.cos(42 * turn))
        >>> found = ring.harmonics(upr_max=60, limits={(2, 15): 0.0005, 42: 5e-5})
        >>> [(row.upr, round(row.size, 6), row.limit) for row in found.exceeds]  # upr, mm
        [(42, 8e-05, 5e-05)]
        """
        if limits is not None and self._origin.filter:
            told = f"limits are held against the form after a {self._origin.filter}, which lowers harmonics"
            warn(f"{told}: those of the profile before it are the part's")
        degree = None if upr_max is None else checked_degree("upr_max", upr_max, 2 * self.nyquist)
        if degree is not None and self.angle.size < 2 * degree + 1:
            raise ValueError(
                f"reading must have at least {2 * degree + 1} samples for {degree} upr; got {self.angle.size}"
            )
        found = steps_of.harmonics(self, degree)
        return found.replace(limits={} if limits is None else limits, as_range=as_range)

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
        found = steps_of.roundness(self, kind)
        return found.replace(origin=dataclasses.replace(found.origin, **self._looked_for))

    def compare(
        self,
        before: "Profile",
        *,
        upr: float | tuple[float | None, float | None] | str | None = None,
        rotation: float | None = None,
    ) -> FormChange:
        """Compare the part with the measurement before grinding: form, RONt, chance that it fell.

        Parameters
        ----------
        before : Profile
            The same part before, mm; filtered as this profile, or both not.
        upr : float, tuple or str, optional
            Cut-off or band of the Gaussian filter for both, upr (unit 1), as of `filter`. Default: 50; none
            for profiles that are filtered.
        rotation : float, optional
            Turn of the part on the spindle since `before`, rad; 0 for an indexed part. Default: that of the
            highest correlation of the forms.

        Returns
        -------
        FormChange
            Harmonics of both, their change, RONt of both with intervals, probability that RONt fell, files.

        Raises
        ------
        ValueError, TypeError
            For profiles of different filters, of a bore and a shaft, and where a filter of one is refused.

        Warns
        -----
        UserWarning
            Where the forms do not tell the rotation: several fit alike, or none does well.

        Examples
        --------
        >>> turn = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> before = Profile(30.0 + 2e-3 * np.cos(2 * turn) + 1e-3 * np.cos(3 * turn))
        >>> after = Profile(29.9 + 5e-4 * np.cos(2 * (turn - 0.3)) + 5e-4 * np.cos(3 * (turn - 0.3)))
        >>> change = after.compare(before)
        >>> round(change.rotation, 6), change.ratio.round(3).tolist()
        (0.3, [0.25, 0.5])
        """
        checks.kind("before", before, Profile)
        mine, its = self._origin.filter, before._origin.filter
        if mine != its:
            raise checks.refuse(
                "before", f"filtered as this profile, {mine or 'not at all'}", its or "no filter"
            )
        if mine and upr is not None:
            raise ValueError(f"upr must be left out where both profiles are filtered, {mine}; got {upr!r}")
        if mine:
            return compared(before, self, rotation)
        cut_off = _USUAL if upr is None else upr
        return compared(before.filter(upr=cut_off), self.filter(upr=cut_off), rotation)

    def plot(self) -> Any:
        """Draw the profile magnified about its circle (µm) and its harmonics (µm); return the figure."""
        return pictures.drawn("centering.roundness._profile_picture:plot", self)

    def report(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        limits: Mapping[str | int | tuple[int, int], float] | None = None,
    ) -> str:
        """Write one HTML page: limits, four reference circles, undulations, pictures, source, digest.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping, optional
            Limits of "RONt", "RONp", "RONv", "RONq" about the least-squares circle, mm, or about another as
            "RONt (MZC)"; of an unfiltered profile also of amplitudes of harmonics, by upr, as of
            `harmonics`. What has its limit within its 95 % interval is not decided.

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
        RONt (LSC) 0.4562 µm as measured (0.38 .. 0.48, 95 % guaranteed); limit 1 µm: accepted
        """
        return sheet_of_profile(self, path, limits)

    @property
    def dataset(self) -> xr.Dataset:
        """Samples as labelled arrays: angles in rad, lengths in mm; steps and their results as attributes."""
        return profile_record.dataset_of(self, self._left, self._sd)

    @property
    def unlike_turns(self) -> str:
        """Sentence on turns that do not repeat, as of two rings or angles in a false unit; empty: they do."""
        return self._unlike

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> "Profile":
        return cls._made(profile_record.made_from(dataset))

    def _told(self) -> str:
        circle, done = self.circle, "; ".join(self.steps) or "as measured"
        height = f"{1e3 * float(np.ptp(self.deviation)):.4g} µm from peak to valley"
        return (
            f"{self.angle.size} points on {counted(self.turns, 'turn')}, {told_radius(self.radius, 7)}"
            f" at offset {circle.offset:.4g} mm, {height}; {done}"
        )
