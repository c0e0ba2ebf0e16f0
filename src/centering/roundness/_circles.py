"""The four reference circles of a profile (ISO 12181-1), exact and with a certificate."""

import numpy as np
import numpy.typing as npt

from centering.roundness import _exchange as exchange
from centering.roundness._deviations_about import KINDS
from centering.roundness._roundness import Roundness
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_FIND = {
    "LSC": exchange.least_squares,
    "MCC": exchange.circumscribed,
    "MIC": exchange.inscribed,
    "MZC": exchange.minimum_zone,
}


def reference_circle(
    points: npt.ArrayLike,
    kind: str = "LSC",
    *,
    tip_radius: float = 0.0,
    noise_sd: npt.ArrayLike | None = None,
    noise_upr: npt.ArrayLike = (),
    filter: str = "",
) -> Roundness:
    """Return a reference circle of a profile, with the roundness about it.

    The centre is exact for the points that fix the circle, found by exchange on true distances. Contacts
    alone or a search prove that no other centre is better; the `certificate` says how. Points may come in any
    order, at any distance from the origin, in several turns, with gaps. Minimum zones are compared up to half
    the inner radius from the centre, inscribed circles with a centre in the hull of the points. Between flats
    many centres are nearly as good; the certificate then gives the largest possible improvement. The points
    may lack up to 1 deg of half a turn where form and noise shift their centre by as much.

    Parameters
    ----------
    points : array, (n, 2)
        Points of the profile, mm, on at least half a turn. For a round tip the points of its centre, (reading
        + tip_radius) (cos angle, sin angle): their distance from a circle is exact.
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Least squares, minimum circumscribed, maximum inscribed or minimum zone circle.
    tip_radius : float
        Radius of the tip, mm, subtracted from the radius; negative for an internal surface.
    noise_sd : float or array, (n,), optional
        Standard deviation of one reading, or of each, mm, for
        `Roundness.interval`.
    noise_upr : array, (m,), optional
        Relative amplitudes of filtered noise at 0 to m - 1 upr. Default: independent noise of each point.
    filter : str
        Filter of the points, passed on to the result.

    Returns
    -------
    Roundness
        Circle (mm), roundness about it (mm), contacts and certificate.

    Raises
    ------
    ValueError
        When `points` are fewer than 3 (MZC: 4), lie on a line or cover less than 180 deg; when an inscribed
        circle is free to leave on one side; when the tip is larger than the circle.

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.radians(np.arange(0.0, 360.0, 2.0))
    >>> radius = 30.0 + 0.002 * np.cos(3.0 * angle)
    >>> points = np.column_stack([radius * np.cos(angle) + 1.5, radius * np.sin(angle)])
    >>> found = reference_circle(points, "MCC", noise_sd=0.0001)
    >>> found
    Roundness(MCC: RONt 4 µm about (1.5, 0) mm, radius 30.002 mm; 3 contacts)
    >>> print(found.certificate)
    no point lies outside, and three contacts stand about the centre: no smaller circle holds these alone
    """
    xy = _points(points, 4 if checks.one_of("kind", kind, KINDS) == "MZC" else 3)
    tip = checks.number("tip_radius", tip_radius, "mm")
    sd, upr = _noise(noise_sd, len(xy)), checks.finite_array("noise_upr", noise_upr, "mm")
    middle = np.array([xy[:, 0].mean(), xy[:, 1].mean()])
    found = _FIND[kind](xy[:, 0] - middle[0], xy[:, 1] - middle[1])
    if found.radius <= tip:
        raise checks.refuse(
            "tip_radius", f"< {found.radius:.6g}, the radius of the circle of the tip's centre", tip, "mm"
        )
    order = np.argsort(found.contacts)
    return Roundness(
        kind, middle + found.center, found.radius - tip, found.contacts[order], found.outer[order],
        found.bound - (tip if kind in ("MCC", "MIC") else 0.0), xy,
        tip_radius=tip, noise_sd=sd, noise_upr=upr, filter=filter, certificate=found.certificate,
    )  # fmt: skip


def _points(points: npt.ArrayLike, least: int) -> Floats:
    """Points of a profile, checked."""
    xy = checks.finite_array("points", points, "mm")
    if xy.ndim != 2 or xy.shape[1] != 2:
        raise ValueError(f"points must be of shape (n, 2) (mm); got {xy.shape}")
    if len(xy) < least:
        raise ValueError(f"points must be at least {least}; got {len(xy)}")
    return xy


def _noise(noise_sd: npt.ArrayLike | None, size: int) -> Floats:
    """Noise of all points or of each, checked; empty if unknown."""
    if noise_sd is None:
        return np.empty(0)
    sd = np.atleast_1d(checks.finite_array("noise_sd", noise_sd, "mm"))
    if sd.shape not in ((1,), (size,)):
        raise ValueError(f"noise_sd must be one number or one for each of {size} points (mm); got {sd.shape}")
    if np.any(sd < 0):
        raise checks.refuse("noise_sd", ">= 0", float(sd.min()), "mm")
    return sd
