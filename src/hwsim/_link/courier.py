"""Records over a link that may lose messages and break: acknowledged, in order, none twice.

Selective repeat: a header acknowledges the records that arrived, in order and among the 64 behind those, and
names the last message that arrived. A link keeps messages in order; a record that went with an earlier
message and did not arrive is therefore lost, and is sent again at once. No timer is needed.
"""

import struct
import tempfile
import uuid
import weakref
from collections import deque
from itertools import count
from typing import IO, Any, Self

from hwsim._link.links import Link
from hwsim._processor.tasks import NANOSECONDS
from sdpgrind.base import checks

# kind, sender; acknowledged: courier, records in order, bits of records behind them, last message; number of
# this message, oldest record, this record
_HEADER = struct.Struct("!B8Q")
_SIGN, _RECORD = range(3, 5)  # kinds of message
_WINDOW = 64  # derived: records under way at once are the bits of one word of the header
_LENGTH = struct.Struct("!Q")  # length of a record in the file of a backlog
NEAR = 4096  # records in memory; chosen: 40 s of a controller of 100 Hz


class Courier:
    """One side of a reliable exchange of records between a machine and its host.

    `send` keeps a record until the courier on the other side has acknowledged it. `advance`, called
    repeatedly, sends and receives records or a sign of life. After a break, `attach` another link: no record
    is lost or doubled.

    A new courier replaces an older one on the same side: the other side sends it what the older one had not
    acknowledged. A copy is the same courier.

    Parameters
    ----------
    link : Link, optional
        First link. None: records wait until one is attached.

    Notes
    -----
    At most 64 records are under way: 100 records a second pass a link with a latency of 20 ms that loses
    every second message. Of the waiting records 4096 are in memory, the others in a temporary file that ends
    with the process; the journal of the run is what lasts.

    Examples
    --------
    >>> from hwsim._link.links import QueueLink
    >>> near, far = QueueLink().start()
    >>> machine, host = Courier(near), Courier()
    >>> machine.send(b"one")
    >>> machine.advance(0.0)  # s
    >>> near.close()  # before it arrived
    >>> near, far = QueueLink().start()
    >>> machine.attach(near)
    >>> host.attach(far)
    >>> machine.advance(0.1)
    >>> host.advance(0.1)
    >>> host.receive(), machine.waiting
    ([b'one'], 1)
    >>> machine.advance(0.2)
    >>> machine.waiting
    0
    """

    def __init__(self, link: Link | None = None) -> None:
        self._name = uuid.uuid4().int >> 64
        self._link: Link | None = None
        self._kept = Backlog()
        self._oldest = 0  # number of the first record kept
        self._under_way: dict[int, int] = {}  # record -> last message that carried it over this link
        self._behind: set[int] = set()  # records newer than the oldest that have arrived
        self._messages = count(1)
        self._reached = 0  # number of our last message that arrived
        self._other = 0  # courier on the other side
        self._last = 0  # number of its last message
        self._taken = 0  # number of its records delivered in order
        self._early: dict[int, bytes] = {}  # its records that arrived out of order
        self._received: list[bytes] = []
        self._time = self._heard = 0.0
        if link is not None:
            self.attach(link)

    @property
    def time(self) -> float:
        """Time of the last `advance`, s."""
        return self._time

    @property
    def silence(self) -> float:
        """Time since the other side was last heard, s; before it was ever heard, since time 0."""
        # rounded to 1 ns: 20 steps of 0.01 s are 0.2 s
        return round((self._time - self._heard) * NANOSECONDS) / NANOSECONDS

    @property
    def waiting(self) -> int:
        """Number of records that are not acknowledged, a whole number."""
        return len(self._kept)

    @property
    def unsent(self) -> int:
        """Bytes that the link has not sent yet."""
        return 0 if self._link is None else self._link.unsent

    @property
    def closed(self) -> bool:
        """Whether no link is attached, or it is closed."""
        return self._link is None or self._link.closed

    def attach(self, link: Link) -> None:
        """Continue over another link, from the oldest record that is not acknowledged.

        Parameters
        ----------
        link : Link
            An open link.

        Examples
        --------
        >>> from hwsim._link.links import QueueLink
        >>> machine = Courier()
        >>> machine.attach(QueueLink().start()[0])
        >>> machine.closed
        False
        """
        self._link = checks.able("link", link, "a link", "send", "receive", "advance", "close")
        self._under_way.clear()

    def send(self, record: bytes) -> None:
        """Keep a record (bytes) and send it with the next `advance`."""
        if not isinstance(record, bytes):
            raise TypeError(f"record must be bytes; got {checks.shown(record)}")
        self._kept.append(record)

    def receive(self) -> list[bytes]:
        """Return the records (bytes) that arrived since the last call, in the order of sending."""
        received, self._received = self._received, []
        return received

    def close(self) -> None:
        """Close the link; records are kept."""
        if self._link is not None:
            self._link.close()

    def advance(self, time: float) -> None:
        """Receive what has arrived; send what is due, at least a sign of life.

        Parameters
        ----------
        time : float
            Time of the simulation or of a clock that never goes back, s.

        Raises
        ------
        ValueError
            When the time goes back.

        Examples
        --------
        >>> machine = Courier()
        >>> machine.advance(0.5)
        >>> machine.silence  # s
        0.5
        """
        if checks.number("time", time, "s") < self._time:
            raise checks.refuse("time", f">= {self._time:g}, that was told last", time, "s")
        self._time = float(time)
        if self._link is None:
            return
        self._link.advance(self._time)
        for message in self._link.receive():
            self._hear(message)
        if not (self._link.closed or self._link.unsent):  # nothing piles up in a blocked link
            self._tell(self._link)

    def _hear(self, message: bytes) -> None:
        """Receive a message, with at most one record in it."""
        if len(message) < _HEADER.size or message[0] not in (_SIGN, _RECORD):
            self.close()
            return
        kind, other, whose, arrived, behind, reached, number, oldest, record = _HEADER.unpack_from(message)
        ours = whose == self._name
        if ours and arrived + behind.bit_length() + (behind > 0) > self._oldest + len(self._kept):
            self.close()  # more is acknowledged than was sent: no courier is there
            return
        # a new courier, or one whose records were acknowledged by another courier in between
        if other != self._other or oldest > self._taken:
            self._other, self._taken = other, oldest
            self._early.clear()
        if ours:
            self._let_go(arrived, behind, reached)
        self._heard, self._last = self._time, number
        if kind == _RECORD and self._taken <= record < self._taken + _WINDOW:
            self._early[record] = message[_HEADER.size :]
            self._take()

    def _let_go(self, arrived: int, behind: int, reached: int) -> None:
        """Drop the records that have arrived, and note those behind them that have."""
        while self._oldest < arrived:
            self._kept.popleft()
            self._under_way.pop(self._oldest, None)
            self._oldest += 1
        self._behind = {arrived + 1 + k for k in range(behind.bit_length()) if behind >> k & 1}
        self._reached = reached

    def _take(self) -> None:
        """Deliver the records that are next in order."""
        while self._taken in self._early:
            self._received.append(self._early.pop(self._taken))
            self._taken += 1

    def _tell(self, link: Link) -> None:
        """Send the records that are due, or a sign of life."""
        due: list[int | None] = [*self._due()]
        for number in due or [None]:
            if link.closed:
                return
            link.send(self._message(number))

    def _due(self) -> list[int]:
        """Records in the window that were not sent over this link, or were lost there."""
        window = range(self._oldest, self._oldest + min(_WINDOW, len(self._kept)))
        return [
            each
            for each in window
            if each not in self._behind and self._under_way.get(each, 0) <= self._reached
        ]

    def _message(self, record: int | None) -> bytes:
        number = next(self._messages)
        behind = sum(1 << each - self._taken - 1 for each in self._early)
        told = self._other, self._taken, behind, self._last, number, self._oldest
        if record is None:
            return _HEADER.pack(_SIGN, self._name, *told, 0)
        self._under_way[record] = number
        return _HEADER.pack(_RECORD, self._name, *told, record) + self._kept[record - self._oldest]

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


class Backlog:
    """Queue of records: the first in memory, the others in a temporary file that ends with the process."""

    def __init__(self) -> None:
        self._near: deque[bytes] = deque()
        self._far: IO[bytes] | None = None
        self._read = self._behind = 0  # position of the next record in the file, bytes; records there

    def __len__(self) -> int:
        return len(self._near) + self._behind

    def __getitem__(self, place: int) -> bytes:
        return self._near[place]

    def append(self, record: bytes) -> None:
        """Append a record."""
        if len(self._near) < NEAR and not self._behind:
            self._near.append(record)
            return
        if self._far is None:
            self._far = tempfile.TemporaryFile(prefix="hwsim-")  # noqa: SIM115
            weakref.finalize(self, self._far.close)
        self._far.seek(0, 2)
        self._far.write(_LENGTH.pack(len(record)) + record)
        self._behind += 1

    def popleft(self) -> bytes:
        """Remove and return the first record."""
        record = self._near.popleft()
        if self._far is not None and self._behind:
            self._near.append(self._fetched(self._far))
        return record

    def _fetched(self, far: IO[bytes]) -> bytes:
        """Read the next record from the file; truncate the file once it is empty."""
        far.seek(self._read)
        (length,) = _LENGTH.unpack(far.read(_LENGTH.size))
        record = far.read(length)
        self._read += _LENGTH.size + length
        self._behind -= 1
        if not self._behind:
            self._read = 0
            far.truncate(0)
        return record
