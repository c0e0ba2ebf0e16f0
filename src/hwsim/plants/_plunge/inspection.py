"""Inspection of finished parts for burn: etching, and a severity such as Barkhausen noise."""

import numpy as np

from sdpgrind.base.quantities import Described, described, quantity


@described()
class Inspection(Described):
    """Inspection of each finished part.

    Parameters
    ----------
    miss, false_alarm : float
        Chances that etching finds a burned part good, and a good one burned; unit 1.
    severity_sd : float
        Relative standard deviation of the severity: hottest temperature of the finished surface over that of
        damage, from Barkhausen noise or hardness; unit 1. 0: exact.

    Raises
    ------
    ValueError
        If a value is out of range, or readings say nothing: miss + false_alarm >= 1.

    Examples
    --------
    >>> Inspection(severity_sd=0.03)
    Inspection(severity_sd=0.03)
    """

    miss: float = quantity("1", at_least=0, below=1, default=0.0)
    false_alarm: float = quantity("1", at_least=0, below=1, default=0.0)
    severity_sd: float = quantity("1", at_least=0, at_most=0.5, hint=" (0.03 for 3 %)", default=0.0)

    def _check(self) -> None:
        if self.miss + self.false_alarm >= 1.0:
            raise self._refused(
                "miss", f"< 1 - false_alarm = {1.0 - self.false_alarm:g}: else etching says nothing"
            )

    def read(self, reserve: float, rng: np.random.Generator) -> dict[str, float]:
        """Return the readings of a part with a `reserve` (ln of temperature, unit 1), drawn by `rng`."""
        chance = 1.0 - self.miss if reserve < 0.0 else self.false_alarm
        burned, noise = float(rng.random() < chance), float(rng.standard_normal())
        return {
            "burned_reading": burned,
            "severity_reading": float(np.exp(self.severity_sd * noise - reserve)),
        }
