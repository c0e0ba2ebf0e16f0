"""Sections of a part over its height: cylinder, median line, total run-out, coaxiality."""

import dataclasses
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from centering.roundness import _sections_record as record
from centering.roundness._cylinder import Cylinder
from centering.roundness._cylinder_find import reference_cylinder
from centering.roundness._cylinder_surface import axis_distances
from centering.roundness._datum import axis_of
from centering.roundness._given_sections import GivenSections
from centering.roundness._median_line import least_squares_tube, smallest_tube
from centering.roundness._profile import Profile
from sdpgrind.base import checks, units
from sdpgrind.base.brief import counted
from sdpgrind.base.by_name import called
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan

_TUBES = {"MZC": smallest_tube, "ls": least_squares_tube}

Datum = tuple[float, float] | Cylinder | tuple[Profile, Profile] | None


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Sections(GivenSections, Plan):
    """Profiles of one part at several heights; immutable.

    The tester's column is taken as straight and parallel to the spindle: its errors enter as tilt and bend.

    Parameters
    ----------
    profiles : sequence of Profile
        At least three, all with one tip radius and from one side, angles from one mark of the part.
    heights : array_like, shape (m,)
        Height of each section along the spindle axis, mm.
    names : sequence of str, optional
        Name of each section, for pages. Default: the words of a file's column of sections, or the files of
        profiles that were read from one each; none of others.

    Raises
    ------
    ValueError, TypeError
        For fewer than three sections, one height for all, another number of heights; for sections of
        different tips, or of a bore and a shaft.

    Examples
    --------
    >>> angle = np.linspace(0.0, 2 * np.pi, 120, endpoint=False)
    >>> heights = np.array([0.0, 10.0, 20.0])
    >>> leans = [Profile(angle, 25.0 + (0.002 + 1e-4 * z) * np.cos(angle)) for z in heights]
    >>> shaft = Sections(leans, heights)
    >>> round(shaft.total_runout(), 6), round(shaft.coaxiality(), 6)  # mm
    (0.008, 0.008)
    >>> datum = shaft.cylinder("MZC")
    >>> round(shaft.total_runout(datum), 6), round(shaft.straightness(), 6)
    (0.0, 0.0)
    >>> shaft.profiles[2].concentricity(datum.at(20.0)) < 1e-6
    True
    """

    kind = "centering.sections"
    _title = "Sections of a part"

    def cylinder(self, kind: str = "LSC") -> Cylinder:
        """Return a reference cylinder on true distances, with cylindricity and taper (ISO 12180).

        Minimum zone, circumscribed and inscribed cylinders are found from the least-squares one by
        successive linear programs. The problem is not convex: the certificate is a local one.

        Parameters
        ----------
        kind : {"LSC", "MCC", "MIC", "MZC"}
            Least squares, minimum circumscribed, maximum inscribed or minimum zone cylinders.

        Returns
        -------
        Cylinder
            Axis and radius (mm), deviations, contacts and certificate.

        Raises
        ------
        ValueError
            When the readings cover less than half a turn, lie along too few lines, or hold no inscribed
            cylinder.
        """
        bore = self.profiles[0].internal if self._scan is None else self._scan.internal
        return reference_cylinder(self.points, kind, self._tip).replace(internal=bore)

    def straightness(self, method: str = "MZC") -> float:
        """Return the straightness of the median line, mm: diameter of a tube about the sections' centres.

        Parameters
        ----------
        method : {"MZC", "ls"}
            The thinnest tube, or that about the least-squares line.

        Raises
        ------
        ValueError
            For readings without sections.
        """
        self._need_sections("straightness")
        return _TUBES[checks.one_of("method", method, _TUBES)](self.centers)

    def total_runout(self, datum: Datum = None) -> float:
        """Return the total radial run-out about a datum axis, mm: the range of all readings (ISO 1101).

        Parameters
        ----------
        datum : (float, float), Cylinder or (Profile, Profile), optional
            Datum axis: parallel to the spindle axis, relative to it, mm, the axis of a cylinder, or the line
            through the centres of two of the `profiles`. Default: the spindle axis.
        """
        return float(np.ptp(axis_distances(self.points, self._axis_of(datum))))

    def coaxiality(self, datum: Datum = None) -> float:
        """Return the coaxiality to a datum axis, mm: twice the largest eccentricity of a section.

        The tolerance zone of ISO 1101 is a cylinder about the datum, whose diameter this is.

        Parameters
        ----------
        datum : (float, float), Cylinder or (Profile, Profile), optional
            As of `total_runout` (mm).

        Raises
        ------
        ValueError
            For readings without sections.
        """
        self._need_sections("coaxiality")
        return 2 * float(axis_distances(self.centers, self._axis_of(datum)).max())

    def report(
        self, path: str | os.PathLike[str] | None = None, *, limits: Mapping[str, float] | None = None
    ) -> str:
        """Write one HTML page: limits, cylinders, run-out, each section, steps, files with digests.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping, optional
            Limits of "CYLt", "CYLp", "CYLv", "CYLq" about the least squares cylinder, mm, or about another as
            "CYLt (MZC)"; of "total run-out" and "coaxiality" to the spindle axis, and of "straightness". No
            interval is measured for these: they are held against the values alone.

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
        >>> oval = Profile(20.0 + 1e-3 * np.cos(2 * np.linspace(0.0, 2 * np.pi, 360, endpoint=False)))
        >>> shaft = Sections([oval] * 3, [0.0, 10.0, 20.0])
        >>> print(shaft.report(limits={"total run-out": 0.003}).splitlines()[5])
        total run-out 2 µm, limit 3 µm: not decided, within the limit as measured, no interval
        """
        return str(called("centering.roundness._sections_sheet:report", self, path, limits))

    def _axis_of(self, datum: Datum) -> Floats:
        """Axis (x, y, u, v) of a datum, checked."""
        if isinstance(datum, Cylinder):
            return datum.axis
        if isinstance(datum, tuple) and any(isinstance(each, Profile) for each in datum):
            (first, low), (second, high) = (self._middle(each) for each in datum)
            if low == high:
                raise ValueError("datum must be two sections of different heights (mm); got one twice")
            slope = (second - first) / (high - low)
            return np.concatenate([first - low * slope, slope])
        if datum is not None and np.shape(datum) != (2,):
            given = checks.shown(datum)
            raise ValueError(f"datum must be (x, y) (mm), a Cylinder, or two of the profiles; got {given}")
        return np.append(axis_of("datum", (0.0, 0.0) if datum is None else datum), [0.0, 0.0])

    def _middle(self, section: Any) -> tuple[Floats, float]:
        """Centre and height of one of the sections, mm."""
        for k, each in enumerate(self.profiles):
            if each is section:
                return self.centers[k, :2], float(self.heights[k])
        raise ValueError(f"datum must be two of the profiles of these sections; got {checks.shown(section)}")

    @property
    def dataset(self) -> xr.Dataset:
        """Samples as labelled arrays: angles in rad, lengths in mm; a number tells the section of each."""
        return (
            record.of_sections(self.profiles, self.heights, self.names)
            if self._scan is None
            else record.of_scan(self._scan)
        )

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> "Sections":
        if "section" in dataset.dims:
            profiles = tuple(record.profiles_of(dataset))
            return cls(profiles, dataset["height"].values, record.names_of(dataset))
        scan = record.scan_from(dataset)
        return cls.from_points(
            scan.angle, scan.height, scan.reading, tip_radius=scan.tip_radius, internal=scan.internal
        )

    def _told(self) -> str:
        count = counted(len(self.profiles), "section") if self.profiles else "no sections"
        return (
            f"{count} over {np.ptp(self.points[:, 2]):.6g} mm, {len(self.points)} points;"
            f" total run-out {self.total_runout() / units.um(1.0):.4g} µm about the spindle"
        )
