"""The session of a client: lists of values in one message each, methods, a fresh session after a cut."""

import asyncio
import contextlib
import logging
import os
import socket
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from asyncua import Client, Node, ua
from asyncua.client.ua_client import UaClientState
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from cryptography import x509

from hwsim.opcua._address import address_of
from hwsim.opcua._keys import Keys
from hwsim.opcua._thread import LoopThread

if TYPE_CHECKING:
    from hwsim.opcua._gate import Gate

logging.getLogger("asyncua").addHandler(logging.NullHandler())  # else its warnings go to stderr
CONNECTING, CLOSING = 10.0, 1.0  # s; chosen: a login takes 0.1 s, a dead peer never answers
GONE = 600_000  # ms; chosen: the longest that asyncua grants; a served machine revises it
ANSWER, STEP = 2.0, 600.0  # s; chosen: an answer takes milliseconds, a step in lockstep may compile first
_WAITS = (0.1, 0.2, 0.4, 0.8, 1.6, *(2.0,) * 12)  # s between attempts; chosen: soon, then seldom
_FAULTS = (OSError, asyncio.TimeoutError, ua.UaError)
_errors = ua.uaerrors
# source: OPC 10000-4, 7.39.2: of services, those that say that session, channel or connection is gone
_CUT: Final = (
    OSError,
    asyncio.TimeoutError,
    _errors.BadCommunicationError,
    _errors.BadConnectionClosed,
    _errors.BadConnectionRejected,
    _errors.BadDisconnect,
    _errors.BadNotConnected,
    _errors.BadRequestTimeout,
    _errors.BadSecureChannelClosed,
    _errors.BadSecureChannelIdInvalid,
    _errors.BadSecureChannelTokenUnknown,
    _errors.BadServerHalted,
    _errors.BadServerNotConnected,
    _errors.BadSessionClosed,
    _errors.BadSessionIdInvalid,
    _errors.BadSessionNotActivated,
    _errors.BadShutdown,
    _errors.BadTcpInternalError,
    _errors.BadTimeout,
)
_AT_ONCE: Final = struct.pack("hh" if os.name == "nt" else "ii", 1, 0)  # SO_LINGER: on, for 0 s


class ClientLink:
    """One session after the other at one URL; its event loop has a thread of its own."""

    def __init__(self, url: str, keys: Keys | None, user: tuple[str, str] | None) -> None:
        self.url = address_of(url).url
        self.loop = LoopThread("hwsim link")
        self.user = user
        self.gate: Gate | None = None  # the process that writes instead of this session
        self._keys = keys
        self._client: Client | None = None
        self._answer = ANSWER
        self._was_reset = False  # the connection of this session

    @property
    def alive(self) -> bool:
        """Whether the session is there."""
        there = self._client is not None and self._client.state is UaClientState.CONNECTED
        return there and not self._was_reset

    def patient(self) -> None:
        """Wait long for answers, as of a machine in lockstep; from the next session on."""
        self._answer = STEP

    def connect(self) -> None:
        """Begin a fresh session."""
        self.loop.run(self._connect())

    def reconnect(self) -> None:
        """Begin a fresh session unless there is one; try again at 0.1, 0.2, 0.4 ... 2 s."""
        if not self.alive:
            self.loop.run(self._reconnect())

    async def _reconnect(self) -> None:
        for wait in _WAITS:
            with contextlib.suppress(ConnectionError):
                await self._connect()
                return
            await asyncio.sleep(wait)
        await self._connect()

    async def _connect(self) -> None:
        await self.leave()
        client = Client(self.url, timeout=self._answer, watchdog_intervall=self._answer)
        client.name = client.description = "hwsim"
        client.session_timeout = GONE
        try:
            if self._keys is not None:
                await asyncio.wait_for(self._secure(client, self._keys), CONNECTING)
            if self.user is not None:
                client.set_user(self.user[0])
                client.set_password(self.user[1])
            await asyncio.wait_for(client.connect(), CONNECTING)
        except PermissionError:  # a server that is not trusted
            raise
        except (ua.uaerrors.BadUserAccessDenied, ua.uaerrors.BadIdentityTokenRejected):
            raise PermissionError(
                f"user must be one that {self.url} knows, with its password, "
                "or too many failed logins came from this address: wait a minute"
            ) from None
        except ua.uaerrors.BadCertificateUntrusted:
            raise PermissionError(f"{self.url} does not trust certificate.der of {self._folder}") from None
        except ua.UaError as error:
            if "No matching" in str(error) and self._keys is None:
                raise PermissionError(
                    f"security must be a folder of certificates: {self.url} encrypts"
                ) from None
            raise ConnectionError(f"no session at {self.url}: {_text(error)}") from None
        except _FAULTS as error:
            raise ConnectionError(f"no session at {self.url}: {_text(error)}") from None
        _hold_nothing_back(client)
        self._client, self._was_reset = client, False

    @property
    def _folder(self) -> Any:
        return "security" if self._keys is None else self._keys.own.folder

    async def _secure(self, client: Client, keys: Keys) -> None:
        """Encrypt, with the certificate that the server shows and the folder trusts."""
        shown = await Client(self.url, timeout=self._answer).connect_and_get_server_endpoints()
        mode = ua.MessageSecurityMode.SignAndEncrypt
        endpoint = Client.find_endpoint(shown, mode, SecurityPolicyBasic256Sha256.URI)
        told = endpoint.ServerCertificate
        if said := keys.refusal(told):
            raise PermissionError(f"the server at {self.url} is not trusted: {said}")
        assert told is not None
        peer = x509.load_der_x509_certificate(told)
        client.application_uri = keys.own.uri
        client.security_policy = SecurityPolicyBasic256Sha256(peer, keys.own.certificate, keys.own.key, mode)
        client.uaclient.set_security(client.security_policy)

    async def leave(self) -> None:
        """End the session; a dead peer is not waited for."""
        client, self._client = self._client, None
        if client is None:
            return
        try:
            await asyncio.wait_for(client.disconnect(), CLOSING)
        except _FAULTS:
            client.disconnect_socket()

    def close(self) -> None:
        """End session and thread."""
        if not self.loop.loop.is_closed():
            self.close_gate()
            self.loop.run(self.leave(), 2 * CLOSING)
            self.loop.stop()

    def close_gate(self) -> None:
        """End the process of the gate, if there is one."""
        gate, self.gate = self.gate, None
        if gate is not None:
            gate.close()

    @property
    def security(self) -> str:
        """Folder of its keys; "none": it has none."""
        return "none" if self._keys is None else str(self._keys.own.folder)

    @property
    def client(self) -> Client:
        """The session; ConnectionError when it was cut."""
        if self._client is None or self._was_reset:
            raise self.cut()
        return self._client

    def cut(self) -> ConnectionError:
        """Error of a cut link."""
        return ConnectionError(f"the link to {self.url} was cut")

    @contextlib.contextmanager
    def _answered(self, what: str) -> Iterator[None]:
        """Tell a cut link from a request that the other side, or this one, does not take."""
        try:
            yield
        except _CUT as error:
            self.reset()
            raise self.cut() from error
        except ua.UaError as error:
            said = f"{self.url} did not take {what}: {_named(error)}"
            kind = PermissionError if isinstance(error, _errors.BadUserAccessDenied) else ValueError
            raise kind(said) from error

    def reset(self) -> None:
        """Reset the connection: what was not sent is dropped, and the session not used again."""
        if self._client is not None and (transport := _transport(self._client)) is not None:
            transport.abort()
        self._was_reset = True

    async def read(self, parameters: ua.ReadParameters) -> list[ua.DataValue]:
        """Read a list of values in one message."""
        with self._answered("a list to read"):
            told: list[ua.DataValue] = await self.client.uaclient.session.read(parameters)
        return told

    async def write(self, parameters: ua.WriteParameters) -> list[ua.StatusCode]:
        """Write a list of values in one message; ConnectionError when the link was cut."""
        with self._answered("a list to write"):
            states: list[ua.StatusCode] = await self.client.uaclient.session.write(parameters)
        return states

    async def call(self, above: ua.NodeId, method: ua.NodeId, *arguments: ua.Variant) -> list[Any]:
        """Call a method and return its results."""
        request = ua.CallMethodRequest(ObjectId=above, MethodId=method, InputArguments=list(arguments))
        with self._answered("a call"):
            result = (await self.client.uaclient.session.call([request]))[0]
        if result.StatusCode.value == ua.StatusCodes.BadUserAccessDenied:
            raise PermissionError(self._refused())
        result.StatusCode.check()
        return [each.Value for each in result.OutputArguments or ()]

    def _refused(self) -> str:
        """Why this session may not command."""
        if self.user is not None and self.user[0] == "observer":
            return f"user must be the operator to command {self.url}; got 'observer'"
        return f"{self.url} is commanded by another session; one operator at a time"

    def node(self, node: ua.NodeId) -> Node:
        """Return a node of the session."""
        return self.client.get_node(node)


def reads(nodes: Sequence[ua.NodeId]) -> ua.ReadParameters:
    """A list of values to read."""
    return ua.ReadParameters(
        NodesToRead=[ua.ReadValueId(NodeId=node, AttributeId=ua.AttributeIds.Value) for node in nodes]
    )


def writes(values: Mapping[ua.NodeId, ua.Variant]) -> ua.WriteParameters:
    """A list of values to write."""
    return ua.WriteParameters(
        NodesToWrite=[
            ua.WriteValue(NodeId=node, AttributeId=ua.AttributeIds.Value, Value=ua.DataValue(value))
            for node, value in values.items()
        ]
    )


def _transport(client: Client) -> Any:
    protocol = client.uaclient.protocol
    return None if protocol is None else protocol.transport


def _hold_nothing_back(client: Client) -> None:
    """Let the end of the connection, that of a killed process too, drop what was not sent.

    Otherwise the system goes on delivering it for minutes: a command that a stalled network held up would
    move a machine that nobody commands any more.
    """
    if (transport := _transport(client)) is not None:
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _AT_ONCE)


def _named(error: ua.UaError) -> str:
    """Name and text of an error of OPC UA."""
    return f"{type(error).__name__}: {_text(error)}"


def _text(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
