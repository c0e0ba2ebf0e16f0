"""Limits of the platform, and its behaviour without contact."""

from math import inf

from sdpgrind.base.quantities import Described, count, described, quantity


@described("force.command_limits")
class Limits(Described):
    """Limits of the platform command, and behaviour without contact.

    Parameters
    ----------
    command_min, command_max : float
        Range of the platform command, mm; infinite: no limit.
    command_rate_max : float
        Greatest speed of the command, mm/s.
    contact_force : float
        Reading below which contact is lost where more is foreseen, N.
    patience : int
        Samples without contact until the law is frozen and the platform approaches, a whole number.
    approach_rate_max : float
        Speed of that approach, mm/s.

    Examples
    --------
    >>> Limits(command_rate_max=20.0).approach_rate_max
    1.0
    """

    command_min: float = quantity("mm", usual=(-1000.0, 1000.0), typical=10, default=-inf)
    command_max: float = quantity("mm", usual=(-1000.0, 1000.0), typical=10, default=inf)
    command_rate_max: float = quantity("mm/s", above=0, usual=(0.05, 1000.0), typical=20, default=inf)
    contact_force: float = quantity("N", at_least=0, default=1.0)
    patience: int = count(default=6)
    approach_rate_max: float = quantity("mm/s", at_least=0, usual=(0.0, 500.0), typical=1, default=1.0)

    def _check(self) -> None:
        if not self.command_min < self.command_max:
            raise self._refused("command_max", f"> command_min = {self.command_min:g}")
