"""What the platform may do, and how it behaves without contact."""

import dataclasses
from math import inf

from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored


@stored("force.command_limits")
@dataclasses.dataclass(frozen=True)
class Limits(Frozen):
    """What the platform may do, and how it behaves without contact.

    Parameters
    ----------
    command_min, command_max : float
        Range of the platform command, mm; infinite: no limit.
    command_rate_max : float
        Largest speed of the command, mm/s.
    contact_force : float
        A reading below this means no contact, where more is demanded, N.
    patience : int
        Samples without contact, a whole number, until the law is frozen and the platform creeps up.
    approach_rate_max : float
        Speed of that approach, mm/s.

    Examples
    --------
    >>> Limits(command_rate_max=20.0).approach_rate_max
    1.0
    """

    command_min: float = -inf
    command_max: float = inf
    command_rate_max: float = inf
    contact_force: float = 1.0
    patience: int = 6
    approach_rate_max: float = 1.0

    def __post_init__(self) -> None:
        if not self.command_min < self.command_max:
            raise checks.refuse("command_max", f"> command_min = {self.command_min:g}", self.command_max, "mm")
        if not self.command_rate_max > 0:
            raise checks.refuse("command_rate_max", "> 0", self.command_rate_max, "mm/s")
        checks.nonnegative("contact_force", self.contact_force, "N")
        checks.count("patience", self.patience)
        checks.nonnegative("approach_rate_max", self.approach_rate_max, "mm/s")
