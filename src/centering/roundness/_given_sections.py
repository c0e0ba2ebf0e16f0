"""Sections of a part as a user has them: profiles at heights, points along a path, tables."""

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from centering.roundness._profile import Profile
from centering.roundness._read import samples
from centering.roundness._scan import PathScan, refuse_one_height, scan_of
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats

_SECTIONS = 3  # derived: two show no bend of the median line


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class GivenSections(ByValue):
    """Profiles at heights, or readings along a path; `Sections` describes the fields (mm)."""

    profiles: tuple[Profile, ...]
    heights: Floats
    names: tuple[str, ...] = ()
    _scan: PathScan | None = dataclasses.field(default=None, init=False)

    def __post_init__(self) -> None:
        profiles = tuple(checks.kind("profiles", each, Profile) for each in self.profiles)
        heights = checks.finite_array("heights", self.heights, "mm")
        if len(profiles) < _SECTIONS:
            raise ValueError(f"profiles must be at least {_SECTIONS} sections; got {len(profiles)}")
        if heights.shape != (len(profiles),):
            raise ValueError(
                f"heights must be one for each of {len(profiles)} profiles (mm); got {heights.shape}"
            )
        refuse_one_height("heights", heights)
        _refuse_other_tips(profiles)
        for each in profiles:
            each._need_radius("profiles")
        object.__setattr__(self, "names", _checked_names(self.names, profiles))
        object.__setattr__(self, "profiles", profiles)
        object.__setattr__(self, "heights", lasting(heights))

    @classmethod
    def from_points(
        cls,
        angle: npt.ArrayLike,
        height: npt.ArrayLike,
        reading: npt.ArrayLike,
        *,
        tip_radius: float = 0.0,
        internal: bool = False,
    ) -> Self:
        """Return readings along a helix, lines or any path; they have a cylinder, but no median line.

        Parameters
        ----------
        angle, height, reading : array_like, shape (n,)
            Spindle angle, rad, height, mm, and radial position of the probe's contact, mm, > 0.
        tip_radius, internal
            As of a profile (mm).

        Raises
        ------
        ValueError
            For unequal lengths, values that are not finite, readings <= 0, or one height for all.

        Examples
        --------
        >>> angle = np.linspace(0.0, 20 * np.pi, 3600)
        >>> from centering.roundness import Sections
        >>> helix = Sections.from_points(angle, angle, 25.0 + 1e-3 * np.cos(3 * angle))
        >>> round(helix.cylinder("MZC").cyl_t, 6)  # mm
        0.002
        """
        made = cls.__new__(cls)
        scan = scan_of(angle, height, reading, tip_radius, internal)
        for name, value in {"profiles": (), "heights": lasting([]), "names": (), "_scan": scan}.items():
            object.__setattr__(made, name, value)
        return made

    @classmethod
    def read(
        cls,
        data: Any,
        *,
        height: Any,
        section: str | None = None,
        angle: Any = None,
        reading: Any = None,
        deviation: Any = None,
        radius: float | None = None,
        tip_radius: float = 0.0,
        internal: bool = False,
        group: str | None = None,
        missing: Sequence[str] = (),
        plausible: bool = True,
    ) -> Self:
        """Read sections from one table; rows of one height, or of one name, are one section.

        Parameters
        ----------
        data : path, pandas.DataFrame, xarray.Dataset, mapping of arrays
            As of `Profile.read`, but X3P.
        height : str or tuple
            Header of the height, ``("z", "mm")``.
        section : str, optional
            Header of the number or name of the section of each row, whose height is the mean of its rows;
            `names` keep it. Default: rows of one height are one section.
        angle, reading, deviation, radius, tip_radius, internal, group, missing, plausible
            As of `Profile.read` (rad, mm).

        Returns
        -------
        Sections
            The sections, from the lowest on; the `source` of each profile tells what was read.

        Raises
        ------
        ValueError
            As of `Profile.read`; for a section of fewer than 4 readings, or one whose heights scatter by more
            than half of the distance to the next.

        Examples
        --------
        >>> from centering.roundness import Sections
        >>> turn = np.arange(0.0, 360.0, 2.0)
        >>> table = {"z (mm)": np.repeat([0.0, 5.0, 10.0], 180), "angle (deg)": np.tile(turn, 3)}
        >>> table["dev (um)"] = np.tile(2 * np.cos(np.radians(3 * turn)), 3)
        >>> shaft = Sections.read(table, height="z", angle="angle", deviation="dev", radius=25.0)
        >>> round(shaft.cylinder("MZC").cyl_t, 6)  # mm
        0.004
        """
        found = samples(
            data, angle, reading, deviation, radius, tip_radius, group, missing, plausible,
            height=height, section=section,
        )  # fmt: skip
        sections = found.sections(plausible)
        profiles = [Profile._of_turn(each.turned, tip_radius, internal) for each in sections]
        names = tuple(each.name for each in sections if each.name)
        return cls(tuple(profiles), np.array([each.height for each in sections]), names)

    @cached_property
    def points(self) -> Floats:
        """Centres of the tip about the spindle axis, and heights, (n, 3), mm."""
        if self._scan is not None:
            return lasting(self._scan.points)
        pairs = zip(self.profiles, self.heights, strict=True)
        return lasting(np.vstack([np.insert(profile.points, 2, z, axis=1) for profile, z in pairs]))

    @cached_property
    def centers(self) -> Floats:
        """Centres of the sections' circles and their heights, (m, 3), mm: the median line."""
        circles = np.array([profile.circle.value[1:] for profile in self.profiles]).reshape(-1, 2)
        return lasting(np.column_stack([circles, self.heights]))

    @property
    def _tip(self) -> float:
        """Distance of the tip's centre beyond the surface, mm; negative in a bore."""
        return self.profiles[0]._tip if self._scan is None else self._scan.tip

    def _need_sections(self, name: str) -> None:
        if not self.profiles:
            count = counted(len(self.points), "reading")
            raise ValueError(
                f"{name} must be asked of profiles at heights, whose centres it compares; got {count} of no"
                " section"
            )


def _refuse_other_tips(profiles: tuple[Profile, ...]) -> None:
    """Refuse sections of different tips, or of a bore and a shaft."""
    first = profiles[0]
    for k, each in enumerate(profiles):
        for name in ("tip_radius", "internal"):
            one, other = getattr(first, name), getattr(each, name)
            if one != other:
                raise ValueError(
                    f"profiles must have one {name}; got {one} of profiles[0] and {other} of profiles[{k}]"
                )


def _checked_names(names: Sequence[str], profiles: tuple[Profile, ...]) -> tuple[str, ...]:
    """Names of the sections as given, or of the files that they were read from, one each; else none."""
    if isinstance(names, str) or not all(isinstance(each, str) and each for each in names):
        raise TypeError(f"names must be a text for each of the profiles; got {checks.shown(names)}")
    if names and len(names) != len(profiles):
        raise ValueError(f"names must be one for each of {len(profiles)} profiles; got {len(names)}")
    files = [each.source.files[0].name for each in profiles if each.source is not None]
    return tuple(names or (files if len(set(files)) == len(profiles) else ()))
