"""The four reference circles of a profile (ISO 12181-1): exact, each with what proves it."""

import numpy as np
import numpy.typing as npt

from centering.roundness import _exchange as exchange
from centering.roundness._roundness import KINDS, Roundness
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
    """Give a reference circle of a profile, and the roundness about it.

    Each is exact: the centre is that of the points which fix the circle, found by exchange on true distances, not on a limacon.
    That no other centre is better is proved, from the contacts alone or by a search, and told in the `certificate`. Points may
    come in any order, at any distance from the origin, in several turns, with gaps. Of minimum zones those are compared whose
    centre is no further from that of the result than half the inner radius; of inscribed circles those with their centre in the
    hull of the points. Where many of these are all but as good, as between flats, the certificate says so and how much better
    one could still be. Half a turn is 180 deg, less what form and noise put its centre off (at most 1 deg): where there is no
    form, nothing is let pass.

    Parameters
    ----------
    points : array, (n, 2)
        Points of the profile, mm, on half a turn at least. Where a round tip has felt it, those of the tip's centre,
        (reading + tip_radius) (cos angle, sin angle): its distance from a circle is exact.
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Least squares, minimum circumscribed, maximum inscribed or minimum zone circle.
    tip_radius : float
        Radius of the tip, mm; it is taken off the radius. For an internal surface give it with a minus sign.
    noise_sd : float or array, (n,), optional
        Standard deviation of one reading, or of each, mm; then `Roundness.value_sd` and `Roundness.value_bias` are given.
    noise_upr : array, (m,), optional
        Of points that have been through a filter: amplitudes of the undulations 0 to m - 1 of what noise it has left, to scale.
        By default the noise of a point is its own.
    filter : str
        What the points have been through; passed on.

    Returns
    -------
    Roundness
        The circle (mm), the roundness about it (mm), contacts, and what is proved.

    Raises
    ------
    ValueError
        When `points` are fewer than 3 (MZC: 4), lie on a line or cover less than 180 deg; when points on one side leave an
        inscribed circle free to move away; when the tip is larger than the circle.

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.radians(np.arange(0.0, 360.0, 2.0))
    >>> radius = 30.0 + 0.002 * np.cos(3.0 * angle)
    >>> points = np.column_stack([radius * np.cos(angle) + 1.5, radius * np.sin(angle)])
    >>> found = reference_circle(points, "MCC", noise_sd=0.0001)
    >>> found
    Roundness(MCC: RONt 4 ± 0.073 µm about (1.5, 0) mm, radius 30.002 mm; 3 contacts)
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
    """Refuse what is no profile."""
    xy = checks.finite_array("points", points, "mm")
    if xy.ndim != 2 or xy.shape[1] != 2:
        raise ValueError(f"points must be of shape (n, 2) (mm); got {xy.shape}")
    if len(xy) < least:
        raise ValueError(f"points must be at least {least}; got {len(xy)}")
    return xy


def _noise(noise_sd: npt.ArrayLike | None, size: int) -> Floats:
    """Noise of all points or of each; of none where it is not known."""
    if noise_sd is None:
        return np.empty(0)
    sd = np.atleast_1d(checks.finite_array("noise_sd", noise_sd, "mm"))
    if sd.shape not in ((1,), (size,)):
        raise ValueError(f"noise_sd must be one number or one for each of {size} points (mm); got {sd.shape}")
    if np.any(sd < 0):
        raise checks.refuse("noise_sd", ">= 0", float(sd.min()), "mm")
    return sd
