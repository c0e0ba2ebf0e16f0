"""What can be set at a centering cycle, beside its problem."""

from dataclasses import dataclass
from math import pi, sqrt

from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen

_LENGTHS = ("probe_reach", "margin", "radius_sd", "form_sd", "noise_sd")
_ROUNDED = 2.0 * pi / 4000.0 / sqrt(12.0)  # rad


@dataclass(frozen=True)
class CycleSettings(Frozen):
    """What can be set at a cycle of `CenteringController`, beside its problem.

    Parameters
    ----------
    probe_closed : float
        What the probe shows when it is pressed in to the level of the pusher tip, Mears (5.2), mm.
    probe_reach : float
        How far the probe reaches beyond the pusher tip, mm.
    tip_radius : float
        Of the probe's roller, mm.
    margin : float
        Between the pusher tip and the furthest that the rim comes while the slide waits, mm.
    radius_sd : float
        How well the radius of the part is known beforehand, as a standard deviation, mm.
    form_sd : float
        How large lobes of 2 to 7 undulations may be: standard deviation of the cosine and the sine of each beforehand, mm. Larger
        ones are found, too, once a turn has shown them.
    noise_sd : float
        Least standard deviation of a reading, mm.
    angle_sd : float
        Standard deviation of the angle at which a reading is taken, rad; by default that of rounding to 4000 counts a turn.
    doubt : float
        Share of its band of 99.9 % by which the measured offset must be within the tolerance before the part is called centred.
    turns_in_doubt : float
        Turns of measuring after which a part that may be centred or not is pushed, unit 1.
    following_lag : float
        How late the slide follows once it is loaded, s: following error over speed, as in Mears' Table 3.2; 0 for a drive that
        knows its load. It is made up for.
    manual_lead : float
        Added to each lead angle, rad.
    timeout : float
        After this the part is given up, s.
    lost_after : float
        The same, where the probe has shown nothing for so long, s.
    force_idle : float
        Greatest force while nothing is pushed, N: more is a collision.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> CycleSettings(timeout=60.0).replace(margin=0.3).timeout  # s
    60.0
    """

    probe_closed: float = 0.0
    probe_reach: float = 25.0
    tip_radius: float = 3.75
    margin: float = 0.5
    radius_sd: float = 0.05
    form_sd: float = 1e-4
    noise_sd: float = 1e-4
    angle_sd: float = _ROUNDED
    doubt: float = 0.8
    turns_in_doubt: float = 1.5
    following_lag: float = 0.0
    manual_lead: float = 0.0
    timeout: float = 300.0
    lost_after: float = 0.5
    force_idle: float = 20.0

    def __post_init__(self) -> None:
        checks.number("probe_closed", self.probe_closed, "mm")
        for name in _LENGTHS:
            checks.positive(name, getattr(self, name), "mm")
        checks.nonnegative("tip_radius", self.tip_radius, "mm")
        checks.nonnegative("angle_sd", self.angle_sd, "rad")
        checks.positive("doubt", self.doubt, "1")
        checks.positive("turns_in_doubt", self.turns_in_doubt, "1")
        checks.number("manual_lead", self.manual_lead, "rad")
        for name in ("timeout", "lost_after"):
            checks.positive(name, getattr(self, name), "s")
        checks.positive("force_idle", self.force_idle, "N")
        checks.nonnegative("following_lag", self.following_lag, "s")
