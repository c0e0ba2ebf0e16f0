"""Messages in a stream of bytes: two bytes of mark and four of length (big-endian) before each, so that any split is undone."""

import struct

from sdpgrind.base import checks

LARGEST = 16 * 2**20  # bytes of one message
_MARK = 0xC35A  # no text begins like this: whoever speaks another language is found out at the first prefix
_PREFIX = struct.Struct("!HI")


def packed(message: bytes, largest: int = LARGEST) -> bytes:
    """Return a message with its prefix."""
    if not isinstance(message, bytes | bytearray | memoryview):
        raise TypeError(f"message must be bytes; got {checks.shown(message)}")
    size = memoryview(message).nbytes
    if size > largest:
        raise checks.refuse("message", f"of at most {largest} bytes", size)
    return _PREFIX.pack(_MARK, size) + bytes(message)


class Unpacker:
    """Finds the messages in a stream that comes in any pieces."""

    def __init__(self, largest: int = LARGEST) -> None:
        self._largest = largest
        self._rest = bytearray()

    @property
    def partial(self) -> bool:
        """Whether the stream stands in the middle of a message."""
        return bool(self._rest)

    def feed(self, piece: bytes) -> list[bytes]:
        """Take a piece of the stream and return the messages that are whole now."""
        self._rest += piece
        messages, at = [], 0
        while (end := self._end(at)) is not None and end <= len(self._rest):
            messages.append(bytes(self._rest[at + _PREFIX.size : end]))
            at = end
        del self._rest[:at]
        return messages

    def fault(self) -> str:
        """Say what is wrong with the prefix that comes next; nothing, where nothing is."""
        if len(self._rest) < _PREFIX.size:
            return ""
        mark, size = _PREFIX.unpack_from(self._rest)
        if mark != _MARK:
            return f"prefix of a message must begin with {_MARK:04x}; got {mark:04x}"
        return f"a message must be of at most {self._largest} bytes; got one of {size}" if size > self._largest else ""

    def _end(self, at: int) -> int | None:
        """Where the message ends whose prefix begins at `at`; None: that is not known, or it is refused."""
        if len(self._rest) - at < _PREFIX.size:
            return None
        mark, size = _PREFIX.unpack_from(self._rest, at)
        return at + _PREFIX.size + size if mark == _MARK and size <= self._largest else None
