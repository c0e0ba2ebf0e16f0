"""Errors of a probe."""

from typing import Any

from sdpgrind.base.quantities import Described, count, described, quantity


def _small(default: float) -> Any:
    """Declare a length of at most 0.25 mm; chosen: a larger number means micrometres."""
    return quantity("mm", at_least=0, at_most=0.25, hint="; units.um(...) for micrometres", default=default)


@described()
class ProbeErrors(Described):
    """Errors of a `Probe`.

    Parameters
    ----------
    probe_quantum, slide_quantum : float
        Steps of the encoders of probe and slide, mm. 0: none.
    counts : int
        Steps of the spindle's encoder in a turn, a whole number. 0: none.
    noise_sd : float
        Standard deviation of the reading, mm.
    skew : float
        Delay of the spindle's reading after those of probe and slide, s.
    runout : float
        Amplitude of the roller's runout, mm: ``runout*cos(R/tip_radius*(1 - slip)*beta - runout_phase)`` at
        the polar angle beta of the contact on the part.
    runout_phase : float, optional
        Phase of the runout, rad. None: drawn for each part.
    slip : float
        Slip of the roller over its rolled length, unit 1.
    dust : float
        Probability of dust under a sample, unit 1; it only adds.
    dust_size : float
        Mean height of dust, mm; uniform within 50 % of it.

    Raises
    ------
    ValueError
        When a value is out of range, or a length seems to be in micrometres.

    Examples
    --------
    >>> ProbeErrors(dust=0.01).replace(noise_sd=1e-4).dust_size  # mm
    0.01
    """

    probe_quantum: float = _small(5e-5)
    slide_quantum: float = _small(2e-5)
    counts: int = count(0, default=4000)
    noise_sd: float = _small(3e-5)
    skew: float = quantity("s", default=0.0)
    runout: float = _small(1.5e-3)
    runout_phase: float | None = quantity("rad", default=None)
    slip: float = quantity("1", at_least=-1, at_most=1, default=0.0)
    dust: float = quantity("1", at_least=0, at_most=1, default=0.0)
    dust_size: float = _small(0.01)


NO_ERRORS = ProbeErrors(probe_quantum=0.0, slide_quantum=0.0, counts=0, noise_sd=0.0, runout=0.0)
