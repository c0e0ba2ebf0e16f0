"""Protocols of controllers, plants, machines and adaptations; nobody has to import or inherit these.

**Order of one tick**: measure; step the controllers that are due, by priority; commands take effect; the
plant advances; log. Time is counted in whole ticks from the start of a part; nothing here reads the wall
clock.

**Set-points**: of several controllers (``tiers``), one may command what the plant does not accept and a
controller below it reads. That controller gets it by name in the same tick, and then until it is changed (NaN
before); numbers or arrays. Units on both sides are compared before the first tick. It is logged where it was
commanded, as ``<name>_command``, and where it is a number also where it was read. The table of one of several
controllers holds what it ``reads``. Of an array of two dimensions that is commanded (a motion) the table
holds the number of its rows and, in ``<name>_digest_command``, a number that tells whether its entries were
the same; the rows themselves, where they are at most 64, stand in a table ``<tier>:<name>``.

Beside what the protocols demand, `hwsim` uses what it finds:

========== =================== ===============================================================================
of         name                meaning
========== =================== ===============================================================================
controller ``report()``        mapping of what it predicts or decided, logged as ``<name>_planned`` beside its
                               command; the first report of a controller without a period is in the outcome,
                               too
controller ``verdict()``       mapping of what it says of a part that is done: name -> number, names as in
                               ``reports``; in the outcome, where the plant has none of that name
controller ``tier``            name of its table in the log (default ``"controller"``)
controller ``tiers``           mapping name -> controller: several controllers of one part, the first has
                               priority; each is stepped at its own period
controller ``reads``           mapping name -> unit of the measurements that it needs
controller ``commands``        mapping name -> unit of what it commands
controller ``reports``         mapping name -> unit of what it reports
both       ``job``             mapping of what tells the part and the machine from others: name -> (value,
                               unit), or a plain value without unit; names of both must be equal, or nothing
                               is run
both       ``description``     mapping of plain values (start, limits, what is played) that the log keeps
                               among its attributes
plant      ``outcomes``        mapping name -> unit of the outcome, or (unit, dimension) of an array
plant      ``with_tick(tick)`` gives the same plant with another tick (s), for plants that can advance by any
                               time
plant      ``after(outcome)``  gives the plant that the next part of a series finds, from the outcome of the
                               part before: a part may leave something (a duller wheel); parts then follow
                               each other
machine    ``whole(...)``      given the controller, the tables of the whole part at once where both have
                               compiled cores, to the bits that the loop would give, and is done then; None:
                               it cannot
========== =================== ===============================================================================
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FOREVER", "Adaptation", "Controller", "Machine", "PartLog", "Plant"]

FOREVER: Final = 2**62
"""Number of ticks that means "until your next event"; chosen: a time plus it still fits a word."""


@runtime_checkable
class Controller(Protocol):
    """Decides: measurements in, commands out; a state of its own, no clock, no input or output.

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
        """Time between two steps (s); None: one step at each event of the plant (a pass, a part)."""

    def reset(self) -> None:
        """Forget the part before; called once before each part."""

    # The loop passes names only; ``*nothing`` lets a step that names its measurements fit this protocol.
    def step(self, *nothing: Any, **measurement: Any) -> Mapping[str, Any]:
        """Return commands to the plant by names that it accepts, in their units; an empty mapping: go on.

        Parameters
        ----------
        *nothing
            Nothing: measurements come by name.
        **measurement
            Everything that the plant measures, in its units: floats, or arrays (a scanned profile). NaN is a
            missing reading.
        """


@runtime_checkable
class Machine(Protocol):
    """One live part on a plant: holds all that changes, the hidden truth included; can be copied at any tick.

    Examples
    --------
    >>> from hwsim.protocols import Machine
    >>> isinstance(object(), Machine)
    False
    """

    @property
    def time(self) -> int:
        """Ticks since the part was started."""

    @property
    def done(self) -> bool:
        """Whether the part is finished; nothing is stepped any more."""

    @property
    def event(self) -> bool:
        """Whether the last step ended at an event (a pass is over): controllers without period are due."""

    def step(self, command: Mapping[str, Any], ticks: int) -> Mapping[str, Any]:
        """Take `command`, advance, and return a fresh mapping of what is measured then.

        Parameters
        ----------
        command : mapping
            What changes, by names that the plant accepts and in their units; what was commanded before is
            held.
        ticks : int
            Advance by so many ticks (of the plant's ``tick``, s), or by fewer when an event or the end comes
            first. 0: only measure. `FOREVER`: until the next event; a machine with nothing under way does not
            move then.
        """

    def outcome(self) -> Mapping[str, Any]:
        """Return what the part became: floats, or arrays, in the units of the plant's ``outcomes``."""


@runtime_checkable
class Plant(Protocol):
    """A machine tool as it is described: simulated, recorded or real. Never changes; `start` makes what does.

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
        """Name -> unit of everything measured."""

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of everything that can be commanded."""

    @property
    def tick(self) -> float:
        """Smallest time by which a machine advances (s); periods of controllers are whole numbers of it."""

    def start(self, rng: np.random.Generator) -> Machine:
        """Draw the hidden truth of the next part from `rng` and return the part, ready, at time 0."""


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
        """Return the values of a column of a table, in its unit, without labels.

        Parameters
        ----------
        tier, name : str
            Table and column.
        """

    def figure(self, name: str) -> Any:
        """Return a figure of the outcome, in its unit, part by part, without labels.

        Parameters
        ----------
        name : str
            Which.
        """

    def __len__(self) -> int:
        """Return the number of parts."""


@runtime_checkable
class Adaptation(Protocol):
    """Learns between parts: re-estimates, shifts a margin, plans anew.

    It must depend on nothing but its own start and what it was shown, so that a killed series can be replayed
    from its journal.

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
        """Return the next controller from that of the last part (as it began) and its `part_log`."""
