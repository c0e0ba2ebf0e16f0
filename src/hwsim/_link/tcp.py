"""A link over TCP between processes of one computer; only `TcpLink.wait` and `TcpListener.accept` block.

It is retired: nothing proves who the peer is. A mark (two bytes) and the length (four bytes, big-endian)
precede each message in the stream.
"""

import ipaddress
import select
import socket
import struct
import time
from typing import Self

from sdpgrind.base import checks

Address = tuple[str, int]
LARGEST = 16 * 2**20  # largest message, bytes; chosen: a scanned profile has some 10 kB
_MARK = 0xC35A  # chosen: begins no text, so that a peer of another protocol fails at once
_PREFIX = struct.Struct("!HI")
_CHUNK = 2**16  # bytes sent at once; chosen: the usual buffer of a socket
_READ = 2**14  # bytes read at once; chosen: 2700 messages at most, some 1 ms
# read in one call, beyond the last piece; chosen: what a courier takes: a flood waits in the network
_MESSAGES, _PIECES = 128, 64


class TcpLink:
    """One end of a TCP connection, a `Link` whose messages arrive whole.

    A peer that closes or vanishes, a wrong prefix and a message that is too large close the link; `reason`
    says why. A peer that is silent does not: a `Watchdog` notices it.

    Parameters
    ----------
    connection : socket.socket
        A connected stream, owned by the link from now on.
    largest : int
        Largest message in either direction, bytes.

    Examples
    --------
    >>> with TcpListener() as listener:
    ...     host = TcpLink.connect(listener.address)
    ...     machine = listener.accept(timeout=5.0)
    >>> machine.send(b"here I am")
    >>> host.wait(5.0), host.receive()  # s
    (True, [b'here I am'])
    >>> host.close(), machine.close()
    (None, None)
    """

    def __init__(self, connection: socket.socket, *, largest: int = LARGEST) -> None:
        self._largest = checks.count("largest", largest)
        _refuse_other_computer("connection", connection.getpeername())
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = connection
        self._unpacker = Unpacker(self._largest)
        self._arrived: list[bytes] = []
        self._outgoing = bytearray()
        self._reason = ""

    @classmethod
    def connect(cls, address: Address, *, timeout: float = 5.0, largest: int = LARGEST) -> Self:
        """Connect to a listener.

        Parameters
        ----------
        address : tuple
            Host, of this computer, and port.
        timeout : float
            Time limit, s.
        largest : int
            Largest message in either direction, bytes.

        Raises
        ------
        OSError
            When nobody answers.
        ValueError
            When the host is another computer.

        Examples
        --------
        >>> with TcpListener() as listener, TcpLink.connect(listener.address, timeout=5.0) as link:
        ...     link.closed
        False
        """
        _refuse_other_computer("address", address)
        return cls(
            socket.create_connection(address, checks.positive("timeout", timeout, "s")), largest=largest
        )

    @property
    def closed(self) -> bool:
        """Whether the link is broken or was closed."""
        return bool(self._reason)

    @property
    def reason(self) -> str:
        """Why the link is closed; empty while it is open."""
        return self._reason

    @property
    def unsent(self) -> int:
        """Bytes that the network has not taken yet."""
        return len(self._outgoing)

    def advance(self, time: float) -> None:
        """Do nothing (see `Link`): this link follows real `time` (s)."""

    def send(self, message: bytes) -> None:
        """Send a message (bytes) without blocking; later calls send what the network does not take at once.

        See `Link`. ConnectionError when the link is closed, ValueError when the message is too large.
        """
        if self.closed:
            raise ConnectionError(f"the link is closed: {self._reason}")
        self._outgoing += packed(message, self._largest)
        self._flush()

    def receive(self) -> list[bytes]:
        """Return the messages (bytes) that arrived since the last call, without blocking."""
        if not self.closed:
            self._flush()
            self._read()
        arrived, self._arrived = self._arrived, []
        return arrived

    def wait(self, timeout: float) -> bool:
        """Send what is left, wait for `timeout` (s); return whether a message arrived or the link closed."""
        deadline = time.monotonic() + checks.nonnegative("timeout", timeout, "s")
        while not (self._arrived or self.closed):
            left = max(0.0, deadline - time.monotonic())
            readable, writable, _ = select.select(
                [self._socket], [self._socket] if self._outgoing else [], [], left
            )
            if not (readable or writable):
                return False
            self._flush()
            self._read()
        return True

    def close(self) -> None:
        """Close the link; unsent bytes are lost."""
        self._close("it was closed here")

    def _read(self) -> None:
        for _ in range(_PIECES):
            if self.closed or len(self._arrived) >= _MESSAGES:
                return
            try:
                piece = self._socket.recv(_READ)
            except BlockingIOError:
                return
            except OSError as error:
                self._close(f"the peer vanished ({error})")
                return
            if not piece:
                self._close(f"the peer closed it{' within a message' if self._unpacker.partial else ''}")
                return
            self._arrived += self._unpacker.feed(piece)
            if fault := self._unpacker.fault():
                self._close(fault)

    def _flush(self) -> None:
        while self._outgoing and not self.closed:
            try:
                sent = self._socket.send(bytes(self._outgoing[:_CHUNK]))
            except BlockingIOError:
                return
            except OSError as error:
                self._read()  # keeps what had arrived
                self._close(f"the peer vanished ({error})")
                return
            del self._outgoing[:sent]

    def _close(self, reason: str) -> None:
        if not self._reason:
            self._reason = reason
            self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"TcpLink({self._reason or 'open'})"


class TcpListener:
    """Accepts connections of `TcpLink` on this computer.

    Parameters
    ----------
    port : int
        TCP port. 0: a free one.
    host : str
        Loopback address of this computer to listen on.
    largest : int
        Largest message in either direction, bytes; a whole number.

    Examples
    --------
    >>> with TcpListener() as listener:
    ...     listener.address[0]
    '127.0.0.1'
    """

    def __init__(self, port: int = 0, *, host: str = "127.0.0.1", largest: int = LARGEST) -> None:
        self._largest = checks.count("largest", largest)
        _refuse_other_computer("host", (host, port))
        self._socket = socket.create_server((host, checks.count("port", port, 0)))

    @property
    def address(self) -> Address:
        """Host and port."""
        name: Address = self._socket.getsockname()[:2]
        return name

    def accept(self, timeout: float) -> TcpLink:
        """Wait for a peer and return the link to it.

        Parameters
        ----------
        timeout : float
            Time limit, s.

        Raises
        ------
        TimeoutError
            When nobody came.

        Examples
        --------
        >>> with TcpListener() as listener:
        ...     listener.accept(timeout=0.01)
        Traceback (most recent call last):
            ...
        TimeoutError: timed out
        """
        self._socket.settimeout(checks.positive("timeout", timeout, "s"))
        return TcpLink(self._socket.accept()[0], largest=self._largest)

    def close(self) -> None:
        """Stop listening; links that were made stay open."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _refuse_other_computer(name: str, address: Address) -> None:
    """Refuse an address that is not loopback."""
    host = address[0]
    try:
        loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        advice = "between computers, OPC UA: hwsim.serve and hwsim.OpcuaPlant"
        raise ValueError(f"{name} must be a loopback address, such as 127.0.0.1 ({advice}); got {host!r}")


def packed(message: bytes, largest: int = LARGEST) -> bytes:
    """Return a message with its prefix."""
    if not isinstance(message, bytes | bytearray | memoryview):
        raise TypeError(f"message must be bytes; got {checks.shown(message)}")
    size = memoryview(message).nbytes
    if size > largest:
        raise checks.refuse("message", f"of at most {largest} bytes", size)
    return _PREFIX.pack(_MARK, size) + bytes(message)


class Unpacker:
    """Finds the messages in a stream cut into arbitrary pieces."""

    def __init__(self, largest: int = LARGEST) -> None:
        self._largest = largest
        self._rest = bytearray()

    @property
    def partial(self) -> bool:
        """Whether a message is incomplete."""
        return bool(self._rest)

    def feed(self, piece: bytes) -> list[bytes]:
        """Return the messages that a piece of the stream completes."""
        self._rest += piece
        messages, at = [], 0
        while (end := self._end(at)) is not None and end <= len(self._rest):
            messages.append(bytes(self._rest[at + _PREFIX.size : end]))
            at = end
        del self._rest[:at]
        return messages

    def fault(self) -> str:
        """Say what is wrong with the next prefix; empty when it is valid or incomplete."""
        if len(self._rest) < _PREFIX.size:
            return ""
        mark, size = _PREFIX.unpack_from(self._rest)
        if mark != _MARK:
            return f"prefix of a message must begin with {_MARK:04x}; got {mark:04x}"
        return (
            f"a message must be of at most {self._largest} bytes; got one of {size}"
            if size > self._largest
            else ""
        )

    def _end(self, at: int) -> int | None:
        """End of the message whose prefix begins at `at`; None: the prefix is incomplete or wrong."""
        if len(self._rest) - at < _PREFIX.size:
            return None
        mark, size = _PREFIX.unpack_from(self._rest, at)
        return at + _PREFIX.size + size if mark == _MARK and size <= self._largest else None
