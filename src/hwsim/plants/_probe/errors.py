"""What a probe does not tell truly."""

from dataclasses import dataclass

from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen

_LENGTHS = ("probe_quantum", "slide_quantum", "noise_sd", "runout", "dust_size")
_LONGEST = 0.25  # mm: beyond it micrometres are meant


@dataclass(frozen=True)
class ProbeErrors(Frozen):
    """What a `Probe` does not tell truly.

    Parameters
    ----------
    probe_quantum, slide_quantum : float
        Steps of the encoders of probe and slide, mm; 0: none.
    counts : int
        Steps of the spindle's encoder in a turn, a whole number; 0: none.
    noise_sd : float
        Standard deviation of the reading, mm.
    skew : float
        How much later than probe and slide the spindle is read, s; it turns the part by speed times skew.
    runout : float
        Amplitude of the roller's runout, mm: ``runout*cos(R/tip_radius*(1 - slip)*beta - runout_phase)`` with the angle beta at
        which the part is touched, so that it follows the length rolled.
    runout_phase : float, optional
        rad; None: drawn for each part.
    slip : float
        Share of the way that the roller slips, unit 1.
    dust : float
        Probability that dust lies under a sample; it only adds.
    dust_size : float
        Mean height of dust, mm; uniform within half of it on either side.

    Raises
    ------
    ValueError
        When a value is out of range, or a length smells of micrometres.

    Examples
    --------
    >>> ProbeErrors(dust=0.01).replace(noise_sd=1e-4).dust_size  # mm
    0.01
    """

    probe_quantum: float = 5e-5
    slide_quantum: float = 2e-5
    counts: int = 4000
    noise_sd: float = 3e-5
    skew: float = 0.0
    runout: float = 1.5e-3
    runout_phase: float | None = None
    slip: float = 0.0
    dust: float = 0.0
    dust_size: float = 0.01

    def __post_init__(self) -> None:
        for name in _LENGTHS:
            length = checks.nonnegative(name, getattr(self, name), "mm")
            if length > _LONGEST:
                raise checks.refuse(name, f"<= {_LONGEST:g}; units.um(...) for micrometres", length, "mm")
        checks.count("counts", self.counts, 0)
        checks.number("skew", self.skew, "s")
        checks.within("slip", self.slip, -1.0, 1.0)
        checks.within("dust", self.dust, 0.0, 1.0)
        if self.runout_phase is not None:
            checks.number("runout_phase", self.runout_phase, "rad")


NO_ERRORS = ProbeErrors(probe_quantum=0.0, slide_quantum=0.0, counts=0, noise_sd=0.0, runout=0.0)
