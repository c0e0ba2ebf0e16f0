"""A simulated plant as an OPC UA server."""

import logging
import os
from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from hwsim._loop.check import checked_clock
from hwsim.opcua._address import Address, address_of
from hwsim.opcua._thread import LoopThread
from hwsim.protocols import Controller, Plant
from sdpgrind.base import checks
from sdpgrind.base.extras import need
from sdpgrind.base.rng import Seed

if TYPE_CHECKING:
    from hwsim.opcua._house import House

logging.getLogger("asyncua").addHandler(logging.NullHandler())  # else its warnings go to stderr


class Served:
    """A served plant, in a thread of its own; a context manager that stops it.

    Made by `serve`, of the house of a server and its thread (private to this package).

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
    >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
    ...     server.state["part"]
    0
    """

    def __init__(self, house: "House", thread: LoopThread) -> None:
        self._house, self._thread = house, thread

    @property
    def url(self) -> str:
        """Address of the server, with the port that it got."""
        return self._house.url

    @property
    def state(self) -> Mapping[str, Any]:
        """State of the machine.

        ``part`` (number of the last part begun), ``parts`` (finished), ``aborts``, ``aborted`` (why the last
        part was), ``paused``, ``writes`` (write lists and calls that came, refused ones too), ``slip`` (s by
        which its time lags behind), ``operator`` (who commands).
        """
        return self._house.state()

    def stop(self) -> None:
        """Stop the server; a part under way ends.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import weldbead
        >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
        >>> hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none").stop()
        """
        self._house.stop(self._thread)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<hwsim.opcua.Served: {self._house.told.plant} at {self.url}>"


def serve(
    plant: Plant,
    url: str,
    *,
    speed: float | None = 1.0,
    controller: Controller | None = None,
    security: str | os.PathLike[str] | None = None,
    users: Mapping[str, str] | None = None,
    listen: str | None = None,
    rng: Seed = 0,
    timeout: float = 0.5,
) -> Served:
    """Serve a simulated plant over OPC UA, in a thread.

    A client sees it like a machine: measurements with units, commands with ranges, a heartbeat, methods to
    start parts. Free running, it keeps wall time: a command takes effect at the first tick after it came, and
    a run cannot be repeated bit by bit. In lockstep it advances by the steps of its client, bit-equal to
    `hwsim.run`.

    **This is no safety function.** The watchdog rehearses that of a machine; it replaces no interlock, limit
    switch or emergency stop.

    Parameters
    ----------
    plant : Plant
        The simulated plant. Free running it has ``safe``, see `hwsim.protocols`.
    url : str
        Address such as "opc.tcp://127.0.0.1:4840"; port 0: any that is free.
    speed : float, optional
        Simulated time over wall time. None: lockstep.
    controller : Controller, optional
        The machine's own control: it makes one part after the other, and clients only listen.
    security : path or "none"
        Folder of certificates (``hwsim keys FOLDER`` makes one): signed and encrypted messages of trusted
        peers. "none": neither, on a loopback address only.
    users : mapping, optional
        Passwords of "operator", who commands, and "observer", who reads. Required but with security="none".
    listen : {"all"}, optional
        Listen at all addresses of this computer instead of that of `url`.
    rng : int, Generator or SeedSequence
        Random source of parts that are started without a seed, such as those of `controller`.
    timeout : float
        Time (s) of the machine's watchdog: without a new heartbeat the machine makes itself safe, and takes
        no command until the next part.

    Returns
    -------
    Served
        The server: a context manager with ``url`` and ``state``.

    Raises
    ------
    ValueError
        When an argument is out of range, a free-running plant has no ``safe``, or a certificate is not valid.
    OSError
        When the port is in use.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> class Leave:
    ...     period = None
    ...     def reset(self): ...
    ...     def step(self, **measured):
    ...         return {"stop": 1.0}
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
    >>> with hwsim.serve(stand, "opc.tcp://127.0.0.1:0", speed=None, security="none") as server:
    ...     log = hwsim.run(hwsim.OpcuaPlant(server.url, security="none"), Leave())
    >>> bool(log.outcome.height[0] == hwsim.run(stand, Leave()).outcome.height[0])
    True
    """
    need("asyncua", "opcua")
    address = _checked_address(address_of(url), listen, security)
    if speed is not None:
        speed = checks.positive("speed", speed)
    timeout = checks.positive("timeout", timeout, "s")
    if speed is not None and not getattr(plant, "safe", None):
        raise ValueError(
            f"speed must be None, lockstep, for a {type(plant).__name__}: it has no safe command, ``safe``"
        )
    if speed is not None and timeout < plant.tick / speed:
        least = f"{plant.tick / speed:g} s at this speed"
        raise ValueError(f"timeout must be >= a tick of the plant, {least} (s); got {timeout:g}")
    if controller is not None:
        if speed is None:
            raise ValueError("controller must be None in lockstep, where the client commands")
        plant, _ = checked_clock(plant, controller)
    from hwsim.opcua._house import House
    from hwsim.opcua._keys import server_keys

    keys = server_keys(security, users)
    house = House(plant, address, speed=speed, controller=controller, keys=keys, rng=rng, timeout=timeout)
    thread = LoopThread("hwsim server")
    try:
        thread.run(house.open())
    except BaseException:
        house.stop(thread)
        raise
    return Served(house, thread)


def _checked_address(address: Address, listen: str | None, security: Any) -> Address:
    if listen is not None:
        checks.one_of("listen", listen, ("all",))
    if security == "none" and (listen or not address.loopback):
        where = "all addresses" if listen else address.host or "all addresses"
        raise ValueError(
            f'security must be a folder of certificates but on a loopback address; got "none" on {where}'
        )
    if listen == "all":
        return address._replace(host="0.0.0.0")
    if address.host in ("", "0.0.0.0", "::"):
        raise ValueError(f'listen must be "all" to listen at all addresses; got url {address.url!r}')
    return address
