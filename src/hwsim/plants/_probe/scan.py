"""Readings of a probe in some turns, all at once."""

import numpy as np

from hwsim.plants._probe.ring import Ring
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, described, part


@described()
class ProbeScan(Described, ByValue):
    """Samples of a ring on a turning table; made by `Probe.scan`.

    Parameters
    ----------
    angle : array
        Spindle angle, rad, continuous over turns.
    reading : array
        Position of the surface on the probe line, mm from the spindle's axis: slide plus probe. NaN: none.
    slide, probe : array
        Readings of slide and probe, mm.
    time : array
        Time, s.
    ring : Ring
        The ring as it lay at the start.

    Examples
    --------
    >>> import hwsim
    >>> scan = hwsim.Probe(hwsim.Ring(61.94, 3.6), errors=None).scan(turns=0.25)
    >>> scan
    ProbeScan(75 readings on 0.2467 turns in 0.74 s: radius 61.94 mm, offset 3.6 mm)
    """

    angle: Floats = array("rad", finite=False)
    reading: Floats = array("mm", finite=False)
    slide: Floats = array("mm", finite=False)
    probe: Floats = array("mm", finite=False)
    time: Floats = array("s", finite=False)
    ring: Ring = part(Ring)

    def __repr__(self) -> str:
        missing = int(np.isnan(self.reading).sum())
        none = f" ({missing} without the surface)" if missing else ""
        turns = float(np.ptp(self.angle)) / (2 * np.pi)
        sampled = f"{self.reading.size} readings{none} on {turns:.4g} turns in {np.ptp(self.time):.4g} s"
        return f"ProbeScan({sampled}: radius {self.ring.radius:.7g} mm, offset {self.ring.offset:.4g} mm)"
