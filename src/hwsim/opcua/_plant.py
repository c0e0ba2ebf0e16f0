"""A machine behind OPC UA as a plant."""

import os
import weakref
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn, Self

import numpy as np

from hwsim.opcua._address import address_of
from hwsim.protocols import Machine
from sdpgrind.base import checks
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from hwsim._live.live import Live
    from hwsim._live.machine import LiveMachine
    from hwsim.opcua._declaration import Declaration

_LATCH = (
    "nodes gives no machine.aborted: it is not seen whether the machine latches, and one that does not may "
    "take a command that a stalled network delivers late"
)


class OpcuaPlant:
    """A plant whose machine is behind OPC UA: one of `hwsim.serve`, or a foreign one with a table of nodes.

    Names, units, ranges, part and machine are read at the first session. A machine in lockstep takes part in
    every run; one with its own time needs ``hwsim.run(..., live=hwsim.Live(...))``.

    **This is no safety function**, see `Live`.

    Parameters
    ----------
    url : str
        Address of the machine: "opc.tcp://127.0.0.1:4840".
    nodes : path, optional
        TOML table of nodes of a machine that is not one of `hwsim.serve`: ``[measures.size]`` with ``node``,
        ``unit`` and, if it is there, ``sample``, a counter of samples; ``[commands.velocity]`` with ``node``,
        ``unit`` and, if there is a range, ``min`` and ``max``; ``[machine]`` with the nodes ``done``,
        ``heartbeat`` (else it is not commanded), ``event``, ``start``, ``aborted``. Values are converted to
        the library's units.
    security : path or "none"
        Folder of certificates (``hwsim keys FOLDER`` makes one): signed and encrypted messages, with a server
        whose certificate is in its folder ``trusted``. "none": neither, on a loopback address only.
    user : tuple, optional
        Name and password.

    Raises
    ------
    ConnectionError
        When no machine answers there.
    PermissionError
        When the server is not trusted, or does not take certificate or user.
    ValueError
        When an argument is wrong, or a certificate of the folder is not valid.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"), height=1.0)
    >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
    ...     machine = hwsim.OpcuaPlant(server.url, security="none")
    ...     print(machine, machine.measures["height"])
    <hwsim.OpcuaPlant: WeldBeadStand at opc.tcp://127.0.0.1:..., lockstep> mm
    """

    def __init__(
        self,
        url: str,
        *,
        nodes: str | os.PathLike[str] | None = None,
        security: str | os.PathLike[str] | None = None,
        user: tuple[str, str] | None = None,
    ) -> None:
        need("asyncua", "opcua")
        from hwsim.opcua._foreign import ForeignMachine, read_nodes
        from hwsim.opcua._keys import read_keys
        from hwsim.opcua._link import ClientLink
        from hwsim.opcua._remote import Remote

        address = address_of(url)
        keys, table = read_keys(security), None if nodes is None else read_nodes(nodes)
        if keys is None and not address.loopback:
            raise ValueError(
                f'security must be a folder of certificates but on a loopback address; got "none" for {url}'
            )
        self._link = ClientLink(url, keys, _checked_user(user))
        self._closing = weakref.finalize(self, self._link.close)
        self._shadow = False
        self._past: tuple[Mapping[str, float], ...] = ()  # outcomes of a series that changes the machine
        try:
            self._link.connect()
            found: Any = ForeignMachine.found(self._link, table) if table else Remote.found(self._link)
            self._remote: Any = self._link.loop.run(found)
            self._told: Declaration = self._link.loop.run(self._remote.declaration())
            if self.lockstep:
                self._link.patient()
                self._link.connect()
        except BaseException:
            self._closing()
            raise

    @property
    def url(self) -> str:
        """Address of the machine."""
        return self._link.url

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        actual = {f"{name}_actual": unit for name, unit in self._told.accepts.items()}
        return {**self._told.measures, **(actual if self._shadow else {})}

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands."""
        return self._told.accepts

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Name -> least and greatest value of a command, in its unit, where the machine tells them."""
        return self._told.ranges

    @property
    def safe(self) -> Mapping[str, float]:
        """The machine's own safe command, in its units, where the machine tells it."""
        return self._told.safe

    @property
    def notes(self) -> tuple[str, ...]:
        """What `hwsim.check` tells beside faults: why the machine is not commanded, limits, latch."""
        if self._shadow or self.lockstep:
            return ()
        why = "machine.heartbeat is missing" if self._remote.table else "it has its own control"
        alone = [f"the machine is listened to only, hwsim.Live(shadow=True): {why}"] if self._told.own else []
        free = ", ".join(name for name in self._told.accepts if name not in self._told.ranges)
        limits = [f"nodes gives no min and max of {free}: only the machine's own limits are kept"]
        table = self._remote.table
        latch = [_LATCH] if table and not self._told.own and "aborted" not in table.machine else []
        return (*alone, *(limits if free and table else ()), *latch)

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit (and dimension of arrays) of the outcomes."""
        counted = {} if self._told.speed is None else {"bad_quality": ""}
        return {**self._told.outcomes, **counted}

    @property
    def description(self) -> Mapping[str, float | str]:
        """Start and limits of the machine, in its units, for the log; empty where it tells none."""
        return self._told.description

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine, in their units; a controller for another job is refused."""
        return self._told.job

    @property
    def tick(self) -> float:
        """Smallest time step of the machine, s."""
        return self._told.tick

    @property
    def lockstep(self) -> bool:
        """Whether the machine advances by the steps of its client, and has no clock of its own."""
        return self._told.speed is None

    @property
    def identity(self) -> tuple[Any, ...]:
        """What tells the machine from others in a journal: its declarations, not its address."""
        told = self._told
        return told.plant, told.measures, told.accepts, told.job, told.description, told.tick

    def look(self) -> Mapping[str, Any]:
        """Read every measurement once, in its unit, without starting a part.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import weldbead
        >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
        >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
        ...     sorted(hwsim.OpcuaPlant(server.url, security="none").look())[:2]
        ['cut_depth', 'feed_rate']
        """
        self._link.reconnect()
        from hwsim.opcua._link import reads

        names = self._paths()
        told = self._link.loop.run(self._link.read(reads(self._remote.nodes(names))))
        reading: Mapping[str, Any] = self._remote.seen(names, told, 0).reading
        return reading

    def start(self, rng: np.random.Generator) -> Machine:
        """Start a part in lockstep, its truth drawn from `rng`; ValueError on a machine with its own time."""
        from hwsim.opcua._packing import seed_text
        from hwsim.opcua._remote import LockstepPart

        if not self.lockstep:
            raise ValueError(
                f"live must be given: the machine at {self.url} keeps its own time; "
                "hwsim.run(..., live=hwsim.Live(safe=...))"
            )
        self._link.reconnect()
        self._link.loop.run(self._remote.start(0, seed_text(rng, self._past)))
        return LockstepPart(self._remote, self._told)

    def start_live(self, rng: np.random.Generator, live: "Live", period: int | None) -> "LiveMachine":
        """Start a part on a machine with its own time; called by `run`.

        Parameters
        ----------
        rng : numpy.random.Generator
            Random source of a simulated part.
        live : Live
            Safe command, deadline, operator.
        period : int or None
            Ticks between two steps of the fastest controller; None: events.
        """
        from hwsim.opcua._begin import begun
        from hwsim.opcua._packing import seed_text

        seed = "" if live.shadow else seed_text(rng, self._past)
        return begun(self._remote, self._told, self._paths(), live, period, seed)

    def listening(self) -> Self:
        """Return the machine for a run in shadow: it also measures its own commands, in their units.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import weldbead
        >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
        >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
        ...     hwsim.OpcuaPlant(server.url, security="none").listening().measures["stop_actual"]
        ''
        """
        return self._view(_shadow=True)

    def _paths(self) -> dict[str, str]:
        """Name of a measurement -> path of its node."""
        paths = {name: f"Monitoring.{name}" for name in self._told.measures}
        actual = {f"{name}_actual": f"Commands.{name}" for name in self._told.accepts}
        return {**paths, **actual} if self._shadow else paths

    def after(self, outcome: Mapping[str, Any]) -> Self:
        """Return the machine for the next part of a series, as a simulated one is changed by each part.

        Parameters
        ----------
        outcome : mapping
            Outcome of the last part, in the plant's units.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import weldbead
        >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))  # a part does not change it
        >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
        ...     machine = hwsim.OpcuaPlant(server.url, security="none")
        ...     machine.after({"height": 0.0}) is machine
        True
        """
        if not self._told.changes:
            return self
        from hwsim.opcua._packing import scalars

        return self._view(_past=(*self._past, scalars(outcome)))

    def _view(self, **changes: Any) -> Self:
        """The same machine with other attributes; it keeps the first one, and with it the session."""
        view = object.__new__(type(self))
        view.__dict__.update(self.__dict__, **changes, _of=self)
        return view

    def close(self) -> None:
        """End the session; it also ends with the plant and the process.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import weldbead
        >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
        >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
        ...     hwsim.OpcuaPlant(server.url, security="none").close()
        """
        self._closing()

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            f"an OpcuaPlant cannot be copied or sent to another process; make one there: {self!r}"
        )

    def __repr__(self) -> str:
        how = "lockstep" if self.lockstep else f"{self._told.speed:g} s a second"
        return f"<hwsim.OpcuaPlant: {self._told.plant} at {self.url}, {how}>"


def _checked_user(user: Any) -> tuple[str, str] | None:
    if user is None:
        return None
    if not isinstance(user, tuple) or len(user) != 2 or not all(isinstance(each, str) for each in user):
        raise TypeError(f"user must be a name and a password; got {checks.shown(type(user))}")
    return user
