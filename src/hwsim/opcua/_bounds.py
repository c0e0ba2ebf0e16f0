"""Bounds of what a peer may send, before anything parses it: asyncua collects and parses without one."""

import asyncio
import logging
import socket
from collections.abc import Iterator
from typing import Any, Final

from asyncua import Server
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol

CHUNK: Final = 65535  # bytes; source: OPC 10000-6, 6.7.1, the size that is agreed on at the beginning
# s, s, number, ms; chosen: a peer whose cable was pulled is gone within 5 + 3 * 2 s, be it silent or owed an
# answer, as its session is within 10 s; else it would stay among the few connections that a server takes.
_PROBES = {"TCP_KEEPIDLE": 5, "TCP_KEEPINTVL": 2, "TCP_KEEPCNT": 3, "TCP_USER_TIMEOUT": 11_000}
_BEFORE: Final = 1 << 18  # bytes before a session is active; chosen: with certificates it takes some 10 kB
_HEAD, _CHANNEL = 8, 12  # bytes of a head, with the number of its channel; source: OPC 10000-6, 6.7.2
_KINDS = {
    b"HEL": (_HEAD, b"F"),
    b"OPN": (_CHANNEL, b"F"),
    b"CLO": (_CHANNEL, b"F"),
    b"MSG": (_CHANNEL, b"FCA"),
}
_log = logging.getLogger(__name__)


class MalformedError(Exception):
    """What a peer sends is no message of OPC UA."""


def messages(received: bytearray, first: bool) -> Iterator[bytes]:
    """Take the whole messages out of what was received; what is left is the begin of the next.

    Parameters
    ----------
    received : bytearray
        Bytes of a peer; they are used up.
    first : bool
        Whether nothing was taken before: the first message is a hello, and no other is.

    Raises
    ------
    MalformedError
        At a head that no message has.
    """
    while len(received) >= _HEAD:
        kind, chunk = bytes(received[:3]), bytes(received[3:4])
        size = int.from_bytes(received[4:_HEAD], "little")
        least, chunks = _KINDS.get(kind, (0, b""))
        if chunk not in chunks or (kind == b"HEL") != first or not least <= size <= CHUNK:
            raise MalformedError(f"a message begins with {bytes(received[:_HEAD])!r}")
        if len(received) < size:
            return
        message = bytes(received[:size])
        del received[:size]
        first = False
        yield message


class BoundedPeer(OPCUAProtocol):  # type: ignore[misc]  # asyncua is not followed
    """A connection that is cut at the first malformed head, and at too much before a session is active."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._received, self._count, self._cut = bytearray(), 0, False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Let the system find out when the peer has gone without a word."""
        _probe(transport.get_extra_info("socket"))
        super().connection_made(transport)

    def data_received(self, data: bytes) -> None:
        """Give whole messages on."""
        if self._cut:
            return
        self._received += data
        try:
            for message in messages(self._received, self._count == 0):
                self._count += len(message)
                super().data_received(message)
            if self._count + len(self._received) > _BEFORE and not self._active():
                raise MalformedError(f"{self._count} bytes came without a session")
        except MalformedError as error:
            _log.info("%s was cut off: %s", self.peer_name, error)
            self._cut = True
            self._received.clear()
            if self.transport is not None:
                self.transport.abort()

    def connection_lost(self, ex: BaseException | None) -> None:
        """End the session with its connection; asyncua keeps one with subscriptions until it is too old."""
        super().connection_lost(ex)
        if self.processor is not None and (session := self.processor.session) is not None:
            self.closing_tasks.append(asyncio.create_task(session.close_session()))

    def _active(self) -> bool:
        session = None if self.processor is None else self.processor.session
        return session is not None and session.is_activated()


def _probe(connection: Any) -> None:
    """Ask the peer of a silent connection now and then whether it is there."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _PROBES.items():
        if hasattr(socket, name):  # by system
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


class _Listener(BinaryServer):  # type: ignore[misc]
    """Listens for bounded peers."""

    def _make_protocol(self) -> BoundedPeer:
        return BoundedPeer(
            iserver=self.iserver,
            policies=self._policies,
            clients=self.clients,
            closing_tasks=self.closing_tasks,
            limits=self.limits,
        )


class BoundedServer(Server):  # type: ignore[misc]
    """A server of bounded peers."""

    async def start(self) -> None:
        """Listen."""
        await self._setup_server_nodes()
        await self.iserver.start()
        self.bserver = _Listener(self.iserver, *self._get_bind_socket_info(), self.limits)
        self.bserver.set_policies(self._policies)
        try:
            await self.bserver.start()
        except BaseException:
            await self.iserver.stop()
            raise
