"""The server of one plant: transport, bounds, address space, desk and machine, put together."""

import contextlib
import gc
import socket
from collections.abc import Mapping
from typing import Any

from asyncua import Server, ua
from asyncua.common.connection import TransportLimits

from hwsim._live.prompt import hurry, leave
from hwsim.opcua._address import Address
from hwsim.opcua._bounds import CHUNK, BoundedServer
from hwsim.opcua._declaration import declared
from hwsim.opcua._desk import FrontDesk
from hwsim.opcua._driver import Driver
from hwsim.opcua._keys import ServerKeys
from hwsim.opcua._lockstep import Lockstep
from hwsim.opcua._own import OwnControl
from hwsim.opcua._paced import Paced
from hwsim.opcua._produced import Produced
from hwsim.opcua._sessions import SessionServer
from hwsim.opcua._shown import Shown
from hwsim.opcua._space import URI, Space, filled
from hwsim.opcua._thread import LoopThread
from hwsim.protocols import Controller, Plant
from sdpgrind.base.rng import Seed

_CLOSING = 5.0  # s; chosen: a peer that does not answer holds nobody longer
_SOCKETS, _HANDSHAKE = 64, 10.0  # connections; s: chosen, a session is made within milliseconds
_MESSAGE = 1 << 20  # bytes; chosen: a motion of 40 000 rows needs 960 kB
_GONE = 10_000.0  # ms; chosen: an operator whose cable was cut holds a machine no longer


class House:
    """Everything of one server; its coroutines run in the server's thread."""

    def __init__(
        self,
        plant: Plant,
        address: Address,
        *,
        speed: float | None,
        controller: Controller | None,
        keys: ServerKeys | None,
        rng: Seed,
        timeout: float,
    ) -> None:
        self.told = declared(plant, speed=speed, timeout=timeout, own=controller is not None)
        self._plant, self._address, self._keys = plant, address, keys
        self._controller, self._rng = controller, rng
        self._server: Server | None = None
        self._driver: Driver | None = None
        self.url = address.url
        self._hurried = False  # whether threads switch sooner for this server
        self._froze = False  # whether this server keeps objects out of the collector

    async def open(self) -> None:
        """Build the address space, then listen."""
        _refuse_taken(self._address)
        inner = SessionServer(user_manager=None if self._keys is None else self._keys.users)
        self._server = server = BoundedServer(iserver=inner)
        _bound(server, lockstep=self.told.speed is None)
        await server.init()
        server.set_server_name(f"hwsim {self.told.plant}")
        server.set_endpoint(self._address.url)
        await self._secure(server)
        namespace = await server.register_namespace(URI)
        space = Space(server, namespace, self.told.plant)
        plant = await filled(space, server, self.told, getattr(self._plant, "tables", ()))
        self.produced = Produced(space)
        self._driver = self._driven(space)
        inner.desk = self._desk = FrontDesk(space, self.told, self._driver, self.produced, self._keys)
        await self._desk.add_methods(plant)
        await server.start()
        assert server.bserver is not None
        self.url = self._address._replace(port=server.bserver.port).url
        hurry()
        self._hurried = True
        self._froze = not gc.get_freeze_count()  # else the user's choice stays
        gc.freeze()  # a full collection walks through 100 000 nodes of the standard: half a second of silence

    def _driven(self, space: Space) -> Driver:
        shown = Shown(space, self.produced)
        if self.told.speed is None:
            return Lockstep(self._plant, shown)
        if self._controller is not None:
            return OwnControl(self._plant, self.told, shown, self._rng, self._controller)
        return Paced(self._plant, self.told, shown, self._rng)

    async def _secure(self, server: Server) -> None:
        if self._keys is None:
            server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
            server.set_identity_tokens([ua.AnonymousIdentityToken])
            return
        await server.set_application_uri(self._keys.own.uri)
        server.iserver.certificate, server.iserver.private_key = (
            self._keys.own.certificate,
            self._keys.own.key,
        )
        server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
        server.set_identity_tokens([ua.UserNameIdentityToken])

    def state(self) -> Mapping[str, Any]:
        """State of machine and desk."""
        return {**self.produced.state(), "writes": self._desk.writes, "operator": self._desk.operator}

    def stop(self, thread: LoopThread) -> None:
        """Stop machine, server and thread."""
        if self._driver is not None:
            self._driver.close()
        with contextlib.suppress(TimeoutError):
            thread.run(self._close(), _CLOSING)
        if self._hurried:
            leave()
            self._hurried = False
        if self._froze:
            gc.unfreeze()
            self._froze = False
        thread.stop()

    async def _close(self) -> None:
        server, self._server = self._server, None
        if server is None or server.bserver is None:
            return
        if (clock := server.iserver.time_task) is not None:
            clock.cancel()  # else it ends within a second
            server.iserver.time_task = None
        for client in server.bserver.clients:
            if client.transport is not None:
                client.transport.abort()
        await server.stop()


def _bound(server: Server, *, lockstep: bool) -> None:
    """Bound what peers may take."""
    inner = server.iserver
    inner.max_connections, inner.max_pending_activation_seconds = _SOCKETS, _HANDSHAKE
    if not lockstep:  # a step in lockstep may take long
        inner.max_session_timeout_ms = _GONE
    inner.allow_remote_admin = False
    server.limits = TransportLimits(CHUNK, CHUNK, -(-_MESSAGE // CHUNK) + 1, _MESSAGE)


def _refuse_taken(address: Address) -> None:
    """Refuse a port that is in use; asyncua would say so in a traceback of its log."""
    if not address.port:
        return
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((address.host, address.port))
        except OSError as error:
            raise OSError(error.errno, f"{address.url} cannot be served: {error.strerror}") from None
