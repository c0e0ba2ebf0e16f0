"""Profiles of deviations, files and tables."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Self

import numpy.typing as npt
import pandas as pd

from centering.roundness._part_readings import PartReadings
from centering.roundness._read import Turned, samples
from centering.roundness._turn import NOT_GIVEN, UNKNOWN_RADIUS, nominal_radius, warn_of_form
from sdpgrind.base import checks
from sdpgrind.base.columns.plausible import refuse_other_length
from sdpgrind.base.columns.table import quantity_of


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class GivenReadings(PartReadings):
    """Readings as a user has them: deviations, files, tables."""

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
        plausible: bool = True,
    ) -> Self:
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
        tip_radius, internal, plausible
            As of a profile (mm); `plausible` is of the radius.

        Returns
        -------
        Profile
            The profile about the spindle axis.

        Raises
        ------
        ValueError, TypeError
            As of a profile; without a radius unless `centred`; for deviations of more than 10 % of the radius
            from peak to valley; for a tip radius without a radius.

        Warns
        -----
        UserWarning
            Where the form, without narrow places such as slots, is higher than 2 % of the radius.

        Examples
        --------
        >>> import numpy as np
        >>> from centering.roundness import Profile
        >>> turn = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> ring = Profile.from_deviation(0.001 * np.cos(3 * turn), radius=None, centred=True)
        >>> ring.radius, round(ring.roundness("MZC").ron_t, 6)  # mm
        (None, 0.002)
        """
        height = checks.finite_array("deviation", deviation, "mm")
        nominal = nominal_radius(height, radius, centred)
        if radius is not None and checks.kind("plausible", plausible, bool):
            refuse_other_length("radius", nominal, quantity_of("reading"))
        if radius is None:
            _refuse_tip(tip_radius)
        places = NOT_GIVEN if angle is None else angle
        known = plausible and radius is not None
        own: dict[str, Any] = {"tip_radius": tip_radius, "internal": internal, "plausible": known}
        profile = cls(places, nominal + height, **own)  # type: ignore[arg-type]
        if radius is None:
            profile._note(steps=(*profile._origin.steps, UNKNOWN_RADIUS), radius_known=False)
        elif known:
            warn_of_form(profile.reading - profile.circle.reading(profile.angle), nominal)
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
    ) -> Self:
        """Read a file of a form tester, or a table; units stand in the call or in the file.

        Parameters
        ----------
        data : path, pandas.DataFrame, xarray.Dataset, mapping of arrays
            Text (.csv, .tsv, .txt, .dat, .log, .prn, .lvm, .asc), .tdms, .h5, .hdf5 or .x3p. In X3P x is
            the length of arc and z the deviation.
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
        >>> import numpy as np
        >>> from centering.roundness import Profile
        >>> angle = np.arange(0.0, 360.0, 2.0)
        >>> table = {"angle (deg)": angle, "dev (um)": 50 * np.cos(np.radians(angle))}
        >>> round(Profile.read(table, angle="angle", deviation="dev", radius=40.0).circle.offset, 4)  # mm
        0.05
        """
        found = samples(
            data, angle, reading, deviation, radius, tip_radius, group, missing, plausible,
            section=section, centred=centred,
        )  # fmt: skip
        return cls._of_turn(found, tip_radius, internal)

    @classmethod
    def _of_turn(cls, found: Turned, tip_radius: float, internal: bool) -> Self:
        """The profile of what was read, with its origin."""
        if not found.radius_known:
            _refuse_tip(tip_radius)
        profile = cls(
            found.angle, found.reading, tip_radius=tip_radius, internal=internal, plausible=False
        )  # as far as it was asked for, it is: `samples`
        profile._note(source=found.source.to_json())
        if not found.radius_known:
            profile._note(steps=(*profile._origin.steps, UNKNOWN_RADIUS), radius_known=False)
        return profile

    def to_dataframe(self) -> pd.DataFrame:
        """Return a table of the samples: angle in rad, reading and deviation in mm.

        Returns
        -------
        pandas.DataFrame
            A row for each sample.
        """
        return pd.DataFrame({name: getattr(self, name) for name in ("angle", "reading", "deviation")})


def _refuse_tip(tip_radius: float) -> None:
    """Refuse a tip beside a radius that is not known, whose curvature would be taken for the tip's."""
    if tip_radius:
        raise checks.refuse("tip_radius", "0 where the radius is not known", tip_radius, "mm")
