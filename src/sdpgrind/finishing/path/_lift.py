"""Lift of the tool off the work between runs."""

import math

from sdpgrind.base.quantities import Described, described, quantity

AIR_FEEDS = 0.1, 3000.0  # mm/s, chosen: no robot that holds such a tool moves faster


@described("finishing.lift")
class Lift(Described):
    """How the tool leaves the work behind a run, moves through the air, and comes back.

    It leaves along an arc that begins in the direction of feed and turns towards the normal, then goes
    straight; a straight line at the height leads to the next start. The arc has continuous curvature, at
    its beginning that of the path, and runs at the feed of the process; the tool rests at its end.

    Parameters
    ----------
    height : float
        Height over the surface, along the normal at the contact, mm.
    angle : float
        Angle of the straight line to the surface, rad, in (0, pi/2]. pi/2: along the normal.
    radius : float
        Size of the arc, mm: that of a circle with its ends and their directions.
    air_feed : float
        Greatest speed on the straight lines, mm/s.

    Raises
    ------
    ValueError
        When a value is out of range, or the arc ends above the height.

    Examples
    --------
    >>> Lift(height=10.0).rise  # mm, of the arc
    5.0
    """

    height: float = quantity("mm", above=0, usual=(0.1, 2000.0), typical=20, default=20.0)
    angle: float = quantity("rad", above=0, default=math.pi / 2)
    radius: float = quantity("mm", above=0, usual=(0.01, 1000.0), typical=5, default=5.0)
    air_feed: float = quantity("mm/s", above=0, usual=AIR_FEEDS, typical=100, default=100.0)

    def _check(self) -> None:
        if self.angle > math.pi / 2:
            raise self._refused("angle", "<= pi/2; units.deg(90) for degrees")
        if self.rise >= self.height:
            raise self._refused("height", f"> {self.rise:.4g}, the rise of the arc")

    @property
    def rise(self) -> float:
        """Height at the end of the arc, mm."""
        return self.radius * (1 - math.cos(self.angle)) if self.angle < math.pi / 2 else self.radius
