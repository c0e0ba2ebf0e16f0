"""What a probe reads of a ring in some turns, all at once."""

from dataclasses import dataclass, fields

from hwsim.plants._probe_ring import Ring
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats


@dataclass(frozen=True, eq=False)
class ProbeScan(ByValue):
    """Samples of a ring on a turning table; `Probe.scan` makes it.

    Parameters
    ----------
    angle : array
        Spindle angle, rad; it goes on over turns.
    reading : array
        Position of the surface on the probe line, mm from the spindle's axis: slide and probe together; NaN: none.
    slide, probe : array
        What each of them shows, mm.
    time : array
        When, s.
    ring : Ring
        The ring that was measured, as it lay at the start.

    Examples
    --------
    >>> import hwsim
    >>> scan = hwsim.Probe(hwsim.Ring(61.94, 3.6), errors=None).scan(turns=0.25)
    >>> scan.time[-1], len(scan.reading)  # s
    (np.float64(0.74), 75)
    """

    angle: Floats
    reading: Floats
    slide: Floats
    probe: Floats
    time: Floats
    ring: Ring

    def __post_init__(self) -> None:
        for each in fields(self)[:-1]:
            object.__setattr__(self, each.name, lasting(getattr(self, each.name)))
