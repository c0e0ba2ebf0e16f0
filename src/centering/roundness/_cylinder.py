"""A reference cylinder of a part, its deviations, and how far it is proved."""

import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.roundness._cylinder_ls import taper
from centering.roundness._cylinder_surface import CylinderPoints, axis_distances
from centering.roundness._saved_side import SavedSide
from sdpgrind.base import checks, pictures, units
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.by_name import called
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, array, custom, described, flag

CYLINDERS = {
    "LSC": "least squares cylinder",
    "MCC": "minimum circumscribed cylinder",
    "MIC": "maximum inscribed cylinder",
    "MZC": "minimum zone cylinders",
}


@described("centering.cylinder")
class Cylinder(Described, ByValue, SavedSide):
    """Reference cylinder with the cylindricity about it (ISO 12180), the result of `Sections.cylinder`.

    Parameters
    ----------
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Kind of cylinder.
    axis : array, (4,)
        Axis (x, y, u, v) through (x, y, 0) along (u, v, 1): x and y in mm relative to the spindle axis, u and
        v unit 1.
    radius : float
        Radius of the part's cylinder, mm, without the tip; for MZC the mean of the two.
    contacts : array of int, (m,)
        Indices of the points that fix the cylinder; none for LSC.
    outer : array of bool, (m,)
        Whether a contact is on the outer cylinder.
    bound : float
        Lower bound of `cyl_t` (MZC) or of the radius (MCC), upper bound of the radius (MIC), mm, by the
        linear program of all points within `reach`; `cyl_q` for LSC. Second order may better it by 1e-6 mm.
    reach : float
        Distance by which the ends of the axis may move for `bound` to hold, mm; 0 for LSC.
    points : array, (n, 3)
        Points of the sections, mm: centres of the tip about the spindle axis, and heights.
    tip_radius : float
        Radius of the tip, mm; negative for a bore read from within.
    certificate : str
        Sentence on the proof, which is local.
    internal : bool
        Whether a bore is read, from within. Default: as the tip says.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile, Sections
    >>> angle = np.radians(np.arange(360.0))
    >>> ovals = [Profile(angle, 20.0 + 1e-3 * np.cos(2 * angle - turn)) for turn in (0.0, 0.2, 0.4)]
    >>> found = Sections(ovals, [0.0, 10.0, 20.0]).cylinder("MZC")
    >>> found
    Cylinder(MZC: CYLt 2 µm about (0, 0) mm, tilt (0, 0) µm/mm, radius 20 mm)
    >>> print(found.certificate.partition(":")[0], round(found.reach, 5))  # mm
    local, no global proof 0.00283
    """

    kind: str = custom()
    axis: Floats = array("mm", finite=False)
    radius: float = custom(unit="mm")
    contacts: npt.NDArray[np.int64] = array("", np.int64, finite=False)
    outer: Bools = array("", bool, finite=False)
    bound: float = custom(unit="mm")
    reach: float = custom(unit="mm")
    points: Floats = array("mm", finite=False)
    tip_radius: float = custom(unit="mm", default=0.0)
    certificate: str = custom(default="")
    internal: bool = flag(default=False)

    @cached_property
    def deviation(self) -> Floats:
        """Distance of each point from the cylinder, (n,), mm; positive outside. Read-only."""
        return lasting(axis_distances(self.points, self.axis) - (self.radius + self.tip_radius))

    def _check(self) -> None:
        object.__setattr__(self, "internal", self.internal or self.tip_radius < 0)

    @cached_property
    def _sides(self) -> tuple[float, float]:
        """Deviations of the points farthest out and in, mm; nothing lies outside MCC, nothing inside MIC."""
        out = 0.0 if self.kind == "MCC" else float(self.deviation.max())
        return out, 0.0 if self.kind == "MIC" else float(self.deviation.min())

    @property
    def cyl_t(self) -> float:
        """Cylindricity CYLt, mm: highest peak to deepest valley."""
        return self.cyl_p + self.cyl_v

    @cached_property
    def cyl_p(self) -> float:
        """Height of the highest peak, CYLp, mm: out of the material; 0 of MCC of a shaft, MIC of a bore."""
        return -self._sides[1] + 0.0 if self.internal else self._sides[0]

    @cached_property
    def cyl_v(self) -> float:
        """Depth of the deepest valley, CYLv, mm: into the material; 0 of MIC of a shaft, of MCC of a bore."""
        return self._sides[0] if self.internal else -self._sides[1] + 0.0

    @cached_property
    def cyl_q(self) -> float:
        """Root mean square deviation from the cylinder, CYLq, mm."""
        return float(np.sqrt(np.mean(self.deviation**2)))

    @cached_property
    def taper(self) -> float:
        """Slope of the radius over the height, unit 1: of the least-squares cone about nearly this axis."""
        surface = CylinderPoints.of(self.points)
        return taper(surface, surface.place_of(self.axis))

    def at(self, height: float) -> tuple[float, float]:
        """Return the axis at a height, (x, y) in mm: the datum of a section there.

        Parameters
        ----------
        height : float
            Height, mm, from where those of the sections count.
        """
        z = checks.number("height", height, "mm")
        x, y = (self.axis[:2] + z * self.axis[2:]).tolist()
        return x, y

    def report(
        self, path: str | os.PathLike[str] | None = None, *, limits: Mapping[str, float] | None = None
    ) -> str:
        """Write one HTML page: limits, parameters, axis, certificate, picture, digest.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping, optional
            Limits of "CYLt", "CYLp", "CYLv", "CYLq", mm. No interval is measured: they are held against the
            values alone.

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
        >>> import numpy as np
        >>> from centering.roundness import Profile, Sections
        >>> oval = Profile(20.0 + 1e-3 * np.cos(2 * np.radians(np.arange(360.0))))
        >>> found = Sections([oval] * 3, [0.0, 10.0, 20.0]).cylinder("MZC")
        >>> print(found.report(limits={"CYLt": 0.003}).splitlines()[3])
        CYLt (MZC) 2 µm, limit 3 µm: not decided, within the limit as measured, no interval
        """
        return str(called("centering.roundness._cylinder_sheet:report", self, path, limits))

    def plot(self) -> Any:
        """Draw the deviations of the sections, magnified, unrolled over height (mm); return the figure."""
        return pictures.drawn("centering.roundness._cylinder_picture:plot", self)

    def __repr__(self) -> str:
        (x, y), (u, v) = (np.round(part, 9) + 0.0 for part in np.split(self.axis * [1, 1, 1e3, 1e3], 2))
        place = f"about ({x:.6g}, {y:.6g}) mm, tilt ({u:.4g}, {v:.4g}) µm/mm, radius {self.radius:.8g} mm"
        return f"Cylinder({self.kind}: CYLt {self.cyl_t / units.um(1.0):.4g} µm {place})"
