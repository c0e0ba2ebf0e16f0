"""Settings of a centering cycle besides its problem."""

from math import pi, sqrt

from centering._problem.model import FORCE_MAX
from sdpgrind.base.quantities import Described, described, quantity

_ROUNDED = 2.0 * pi / 4000.0 / sqrt(12.0)  # rad, derived: sd of rounding to 4000 counts a turn


@described()
class CycleSettings(Described):
    """Settings of a cycle of `CenteringController`, besides its problem.

    Parameters
    ----------
    probe_closed : float
        Reading of the probe pressed in to the level of the pusher tip, Mears (5.2), mm.
    probe_reach : float
        Reach of the probe beyond the pusher tip, mm.
    tip_radius : float
        Radius of the probe's roller, mm.
    margin : float
        Distance between the pusher tip and the furthest rim while the slide waits, mm.
    radius_sd : float
        Prior standard deviation of the radius of the part, mm.
    form_sd : float
        Prior standard deviation of cosine and sine of each lobe of 2 to 7 undulations, mm. Larger lobes are
        found within a turn.
    noise_sd : float
        Least standard deviation of a reading, mm.
    angle_sd : float
        Standard deviation of the angle of a reading, rad. Default: rounding to 4000 counts a turn.
    doubt : float
        Distance of the measured offset to the tolerance at which a part is called centred, over the half
        width of its 99.9 % interval, unit 1.
    turns_in_doubt : float
        Turns of measurement after which a doubtful part is pushed, unit 1.
    following_lag : float
        Delay of the loaded slide, s, compensated by the controller: following error over speed of Mears'
        Table 3.2; 0: a drive with load compensation.
    manual_lead : float
        Angle added to each lead angle, rad.
    timeout : float
        Time after which the part is abandoned, s.
    lost_after : float
        Time without a reading after which the part is abandoned, s.
    force_idle : float
        Greatest force without a push, N; more is a collision.
    force_max : float
        End of the range of the force sensor, N; greater forces are shown as this one. Default: Mears (2006).

    Raises
    ------
    ValueError
        A value is out of range.

    Examples
    --------
    >>> CycleSettings(timeout=60.0).replace(margin=0.3).timeout  # s
    60.0
    """

    probe_closed: float = quantity("mm", default=0.0)
    probe_reach: float = quantity("mm", above=0, usual=(0.1, 1000.0), typical=25, default=25.0)
    tip_radius: float = quantity("mm", at_least=0, usual=(0.0, 500.0), typical=4, default=3.75)
    margin: float = quantity("mm", above=0, usual=(0.002, 100.0), typical=0.5, default=0.5)
    radius_sd: float = quantity("mm", above=0, default=0.05)
    form_sd: float = quantity("mm", above=0, default=1e-4)
    noise_sd: float = quantity("mm", above=0, default=1e-4)
    angle_sd: float = quantity("rad", at_least=0, default=_ROUNDED)
    doubt: float = quantity("1", above=0, default=0.8)
    turns_in_doubt: float = quantity("1", above=0, default=1.5)
    following_lag: float = quantity("s", at_least=0, default=0.0)
    manual_lead: float = quantity("rad", usual=(-6.3, 6.3), typical=0.1, default=0.0)
    timeout: float = quantity("s", above=0, default=300.0)
    lost_after: float = quantity("s", above=0, default=0.5)
    force_idle: float = quantity("N", above=0, default=20.0)
    force_max: float = quantity("N", above=0, default=FORCE_MAX)
