"""Protocols of controllers, plants, machines and adaptations; classes need not import or inherit them.

**Order of one tick**: measure; step the controllers that are due, by priority; commands take effect; the
plant advances; log. Time is counted in whole ticks from the start of a part, independently of the wall clock.

**Set-points**: with several controllers (``tiers``) a controller may command what the plant does not accept
and a controller below it reads. That controller gets it by name in the same tick, and until it is changed
(NaN before); numbers or arrays. Units on both sides are compared before the first tick. The log has it as
``<name>_command`` where it was commanded, and, if a number, also where it was read. The table of one of
several controllers has the measurements that it ``reads``. For a commanded array of two dimensions (a motion)
the table has the number of rows and, in ``<name>_digest_command``, a hash of the entries; the rows of each
motion stand once, at its first command, in a table ``<tier>:<name>``.

Optional attributes:

========== =================== ===============================================================================
of         name                meaning
========== =================== ===============================================================================
controller ``report()``        mapping of predictions or decisions, logged as ``<name>_planned`` with each
                               command; the first report of a controller without a period is also in the
                               outcome
controller ``verdict()``       mapping name -> number about a finished part, names as in ``reports``; in the
                               outcome, unless the plant has that name
controller ``tier``            name of its table in the log (default ``"controller"``)
controller ``tiers``           mapping name -> controller: several controllers of one part, the first has
                               priority; each is stepped at its own period
controller ``reads``           mapping name -> unit of the measurements that it needs
controller ``commands``        mapping name -> unit of its commands
controller ``reports``         mapping name -> unit of its reports
both       ``job``             mapping that identifies part and machine: name -> (value, unit), or a value
                               without unit; where names of both differ in value, the run is refused
both       ``description``     mapping of plain values (start, limits) for the attributes of the log
plant      ``outcomes``        mapping name -> unit of the outcome, or (unit, dimension) of an array
plant      ``with_tick(tick)`` returns the same plant with another tick (s), for plants that can advance by
                               any time
plant      ``after(outcome)``  returns the plant of the next part of a series, from the outcome of the last
                               part (a duller wheel); parts then run one after the other
plant      ``safe``            mapping of the command that makes the machine safe at any moment: {"stop": 1.0}
plant      ``ranges``          mapping of commands -> (least, greatest) that the machine takes, in their units
plant      ``sample_ticks``    ticks between two samples of the machine's own computer, which takes commands
                               only then (default 1)
plant      ``tables``          names of the commands that are tables (motions)
plant      ``look()``          returns every measurement of a machine that must not be started to be checked
machine    ``whole(...)``      given the controller, returns the tables of the whole part at once where both
                               have compiled cores, bit-equal to the loop, and is done; None otherwise
========== =================== ===============================================================================
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FOREVER", "Adaptation", "Controller", "Machine", "PartLog", "Plant"]


def __dir__() -> list[str]:
    """Public names only, as of packages."""
    return sorted(__all__)


FOREVER: Final = 2**62
"""Number of ticks that means "until the next event"; chosen: time + FOREVER fits 64 bits."""


@runtime_checkable
class Controller(Protocol):
    """Decides: measurements in, commands out; it keeps a state, and has no clock, input or output.

    Examples
    --------
    >>> from hwsim.protocols import Controller
    >>> class TurnOff:
    ...     period = None
    ...     def reset(self): ...
    ...     def step(self, **measurement):
    ...         return {"stop": 1.0}
    >>> isinstance(TurnOff(), Controller)
    True
    """

    @property
    def period(self) -> float | None:
        """Time between two steps, s. None: one step at each event of the plant (a pass, a part)."""

    def reset(self) -> None:
        """Forget the last part; called once before each part."""

    # The loop passes names only; ``*nothing`` lets a step that names its measurements fit this protocol.
    def step(self, *nothing: Any, **measurement: Any) -> Mapping[str, Any]:
        """Return commands to the plant by names that it accepts, in their units; an empty mapping: no change.

        Parameters
        ----------
        *nothing
            Unused: measurements are passed by name.
        **measurement
            Everything that the plant measures, in its units: floats, or arrays (a scanned profile). NaN: no
            reading.
        """


@runtime_checkable
class Machine(Protocol):
    """One live part on a plant, with all that changes, hidden truth included; it can be copied at any tick.

    Examples
    --------
    >>> from hwsim.protocols import Machine
    >>> isinstance(object(), Machine)
    False
    """

    @property
    def time(self) -> int:
        """Ticks since the start of the part."""

    @property
    def done(self) -> bool:
        """Whether the part is finished; it is not stepped any more."""

    @property
    def event(self) -> bool:
        """Whether the last step ended at an event (end of a pass): controllers without period are due."""

    def step(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        """Apply `command`, advance, and return a new mapping of measurements.

        Parameters
        ----------
        command : mapping
            Changed commands, by names that the plant accepts and in their units; others are held.
        ticks : int
            Number of ticks (of the plant's ``tick``, s) to advance; an event or the end stops earlier. 0:
            only measure. `FOREVER`: until the next event; a machine with nothing under way does not move.
        """

    def outcome(self) -> Mapping[str, Any]:
        """Return the result of the part: floats or arrays, in the units of the plant's ``outcomes``."""


@runtime_checkable
class Plant(Protocol):
    """Description of a machine tool, simulated, recorded or real; immutable: `start` makes a live part.

    Examples
    --------
    >>> import hwsim
    >>> from hwsim.protocols import Plant
    >>> from sdpgrind import weldbead
    >>> isinstance(hwsim.WeldBeadStand(weldbead.preset("P1")), Plant)
    True
    """

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of every measurement."""

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of every command."""

    @property
    def tick(self) -> float:
        """Smallest time step of a machine, s; periods of controllers are multiples of it."""

    def start(self, rng: np.random.Generator) -> Machine:
        """Draw the hidden truth of the next part from `rng` and return the part at time 0."""


@runtime_checkable
class PartLog(Protocol):
    """A log in the units of its plant, as adaptations (last part) and pictures (all parts) see it.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> class Leave:
    ...     period = None
    ...     def reset(self): ...
    ...     def step(self, **measured):
    ...         return {"stop": 1.0}
    >>> log = hwsim.run(hwsim.WeldBeadStand(weldbead.preset("P1")), Leave())
    >>> isinstance(log, hwsim.protocols.PartLog), len(log)
    (True, 1)
    """

    @property
    def tiers(self) -> tuple[str, ...]:
        """Names of the tables."""

    @property
    def outcome(self) -> "xr.Dataset":
        """Outcome of each part (dimension ``part``), units in the attributes."""

    def __getitem__(self, tier: str, /) -> "xr.Dataset":
        """Return the table of a tier."""

    def column(self, tier: str, name: str) -> Any:
        """Return a column of a table as an array, in its unit.

        Parameters
        ----------
        tier, name : str
            Table and column.
        """

    def figure(self, name: str) -> Any:
        """Return an outcome of each part as an array, in its unit.

        Parameters
        ----------
        name : str
            Name of the outcome.
        """

    def __len__(self) -> int:
        """Return the number of parts."""


@runtime_checkable
class Adaptation(Protocol):
    """Learns between parts: re-estimates, shifts a margin, plans anew.

    It may depend only on its initial state and the logs passed to it, so that a killed series can be replayed
    from its journal. That log has the rows of all motions of the part, also of those that earlier parts
    commanded; beyond a million rows of different motions the digests alone.

    Examples
    --------
    >>> from hwsim.protocols import Adaptation
    >>> class Keep:
    ...     def next(self, controller, part_log):
    ...         return controller
    >>> isinstance(Keep(), Adaptation)
    True
    """

    def next(self, controller: Controller, part_log: PartLog) -> Controller:
        """Return the next controller from the last one (in its initial state) and its `part_log`."""
