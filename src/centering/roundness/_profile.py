"""A measured profile of a ring and its steps: removed errors, filters, harmonics, reference circles, file."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from centering.roundness import _profile_record as profile_record
from centering.roundness import _profile_steps as steps_of
from centering.roundness._former_names import FormerNames
from centering.roundness._harmonics import Harmonics
from centering.roundness._profile_sheet import report as sheet_of_profile
from centering.roundness._read import Turned, samples
from centering.roundness._roundness import Roundness
from centering.roundness._sampling import checked_degree
from centering.roundness._stepped_readings import SteppedReadings
from centering.roundness._turn import NOT_GIVEN, UNKNOWN_RADIUS, nominal_radius, told_radius
from sdpgrind.base import checks, pictures
from sdpgrind.base.brief import counted
from sdpgrind.base.plans import Plan


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
        For unequal lengths, values that are not finite, readings <= 0, readings of both signs, which are
        deviations, fewer than 4 different angles, angles that suggest degrees, a tip radius < 0 or too large
        for the bore; for a last reading at the place of the first that differs from it by more than 10
        standard deviations of a reading; when the readings determine no circle about the spindle axis.

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

    @classmethod
    def from_deviation(
        cls,
        deviation: npt.ArrayLike,
        *,
        radius: float | None,
        angle: npt.ArrayLike | None = None,
        centred: bool = False,
        tip_radius: float = 0.0,
        internal: bool = False,
    ) -> "Profile":
        """Return the profile of deviations from a radius, as a form tester writes them.

        The radius places the curvature: another one changes RONt about an offset circle by some offset^2 /
        (2 radius).

        Parameters
        ----------
        deviation : array_like, shape (n,)
            Deviation from the radius, mm, positive outward.
        radius : float or None
            Nominal radius, mm. None: not known, allowed with `centred`; `radius` of the profile is None then,
            and what needs it is refused.
        angle : array_like, shape (n,), optional
            Spindle angle, rad. Default: an even turn that begins at 0.
        centred : bool
            Whether deviations are from the tester's own circle.
        tip_radius, internal
            As of a profile (mm).

        Returns
        -------
        Profile
            The profile about the spindle axis.

        Raises
        ------
        ValueError, TypeError
            As of a profile; without a radius unless `centred`; for deviations of more than 10 % of the radius
            from peak to valley; for a tip radius without a radius.

        Examples
        --------
        >>> turn = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> ring = Profile.from_deviation(0.001 * np.cos(3 * turn), radius=None, centred=True)
        >>> ring.radius, round(ring.roundness("MZC").ron_t, 6)  # mm
        (None, 0.002)
        """
        height = checks.finite_array("deviation", deviation, "mm")
        reading = nominal_radius(height, radius, centred) + height
        if radius is None and tip_radius:
            raise checks.refuse("tip_radius", "0 where the radius is not known", tip_radius, "mm")
        places = NOT_GIVEN if angle is None else angle
        profile = cls(places, reading, tip_radius=tip_radius, internal=internal)  # type: ignore[arg-type]
        if radius is None:
            profile._note(steps=(*profile.steps, UNKNOWN_RADIUS), radius_known=False)
        return profile

    @classmethod
    def read(
        cls,
        data: Any,
        *,
        angle: Any = None,
        reading: Any = None,
        deviation: Any = None,
        radius: float | None = None,
        centred: bool = False,
        tip_radius: float = 0.0,
        internal: bool = False,
        section: tuple[str, Any] | None = None,
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
            Default: the rows are one even turn that begins at 0, if the file has no column of angles.
        reading, deviation : str or tuple, optional
            Header of the radial position, or of what it deviates from `radius`: ``("dev", "um")``. Of the two
            one is given. Default for X3P: deviation z.
        radius : float, optional
            Nominal radius of deviations, mm.
        centred : bool
            Whether deviations are from the tester's own circle, so that the radius may be left out; not for
            X3P.
        tip_radius, internal
            As of a profile (mm).
        section : tuple, optional
            Header of the sections in a file of several, and the one to read, ``("section", 3)``. Default: the
            file holds one.
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
        found = samples(
            data, angle, reading, deviation, radius, tip_radius, group, missing, plausible,
            section=section, centred=centred,
        )  # fmt: skip
        return profile_read(found, tip_radius, internal)

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
        return cls._made(profile_record.made_from(dataset))

    def _told(self) -> str:
        circle, done = self.circle, "; ".join(self.steps) or "as measured"
        height = f"{1e3 * float(np.ptp(self.deviation)):.4g} µm from peak to valley"
        return (
            f"{self.angle.size} points on {counted(self.turns, 'turn')}, {told_radius(self.radius, 7)}"
            f" at offset {circle.offset:.4g} mm, {height}; {done}"
        )


def profile_read(found: Turned, tip_radius: float, internal: bool) -> Profile:
    """The profile of what was read, with its origin."""
    profile = Profile(found.angle, found.reading, tip_radius=tip_radius, internal=internal)
    profile._note(source=found.source.to_json())
    if not found.radius_known:
        profile._note(steps=(*profile.steps, UNKNOWN_RADIUS), radius_known=False)
    return profile
