"""Records over a link that may lose messages and break: acknowledged, in order, none twice.

Messages are numbered as they are sent, records as they are to be received. Each message says who sends it,
how many records of whom on the other side have arrived in order and which of the 64 behind those, and the
number of the last message that arrived; and, unless it is a mere sign of life, it holds one record. As a link
keeps messages in order, a record that went with an earlier message than the last that arrived, and has not
arrived itself, is lost: it is sent again at once, and no other is (selective repeat). No time is guessed: the
next sign of life tells.
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

# kind, who sends; of whom, records in order, records behind them, last message; number of this message,
# oldest record, this one
_HEADER = struct.Struct("!B8Q")
_SIGN, _RECORD = 3, 4
_WINDOW = 64  # derived: records under way at once are the bits of one word of the header
_LENGTH = struct.Struct("!Q")  # of a record in the file of a backlog
NEAR = 4096  # records in memory; chosen: 40 s of a controller of 100 Hz


class Courier:
    """One side of an exchange of records between a machine and its host.

    A `Link` that loses nothing: `send` keeps a record until the other side's courier has acknowledged it,
    whatever becomes of the link below. `advance`, called again and again, moves records and is a sign of
    life; after the link broke, `attach` a new one and nothing is lost or doubled.

    A courier that is new knows nothing of what an older one sent or took, and the other side notices: it goes
    on with what the older one had not acknowledged. A copy is the same courier, so that a controller that is
    copied talks on.

    Parameters
    ----------
    link : Link, optional
        To begin with; None: records wait until one is attached.

    Notes
    -----
    Up to 64 records are under way at once; over a link of 20 ms that loses every second message 100 records a
    second get through. Of those that wait the first 4096 are in memory, the others in a temporary file: it
    grows with the silence of the host, and ends with the process, as everything here does. What must outlast
    that is in the journal of the run.

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
        self._oldest = 0  # number of the first that is kept
        self._under_way: dict[int, int] = {}  # record -> message with which it went last, over this link
        self._behind: set[int] = set()  # records that have arrived before the oldest
        self._messages = count(1)
        self._reached = 0  # of them, the last that arrived
        self._other = 0  # who is on the other side
        self._last = 0  # message that came from there
        self._taken = 0  # records taken from there
        self._early: dict[int, bytes] = {}  # those that came before one that was lost
        self._received: list[bytes] = []
        self._time = self._heard = 0.0
        if link is not None:
            self.attach(link)

    @property
    def time(self) -> float:
        """Time that was told last, s."""
        return self._time

    @property
    def silence(self) -> float:
        """Time since the other side was heard, s; counted from time 0 before it was ever heard."""
        # rounded, so that 20 steps of 0.01 s are 0.2 s
        return round((self._time - self._heard) * NANOSECONDS) / NANOSECONDS

    @property
    def waiting(self) -> int:
        """Number of records that are not acknowledged, a whole number."""
        return len(self._kept)

    @property
    def unsent(self) -> int:
        """Bytes that the link below has not taken yet."""
        return 0 if self._link is None else self._link.unsent

    @property
    def closed(self) -> bool:
        """Whether there is no link, or it is closed, until one is attached."""
        return self._link is None or self._link.closed

    def attach(self, link: Link) -> None:
        """Go on over another link, from the oldest record that is not acknowledged.

        Parameters
        ----------
        link : Link
            An open one.

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
        """Keep a record and send it with the next `advance`.

        Parameters
        ----------
        record : bytes
            Anything.
        """
        if not isinstance(record, bytes):
            raise TypeError(f"record must be bytes; got {checks.shown(record)}")
        self._kept.append(record)

    def receive(self) -> list[bytes]:
        """Return the records (bytes) that are new since the last call, in the order of sending, each once."""
        received, self._received = self._received, []
        return received

    def close(self) -> None:
        """Close the link; records are kept."""
        if self._link is not None:
            self._link.close()

    def advance(self, time: float) -> None:
        """Hear what has arrived and send what is to be sent, at least a sign of life.

        Parameters
        ----------
        time : float
            Now, s: of the simulation, or of a clock that never goes back.

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
        if not (self._link.closed or self._link.unsent):  # what cannot be taken must not pile up
            self._tell(self._link)

    def _hear(self, message: bytes) -> None:
        """Take what a message says: at most one record is in it."""
        if len(message) < _HEADER.size or message[0] not in (_SIGN, _RECORD):
            self.close()
            return
        kind, other, whose, arrived, behind, reached, number, oldest, record = _HEADER.unpack_from(message)
        ours = whose == self._name
        if ours and arrived + behind.bit_length() + (behind > 0) > self._oldest + len(self._kept):
            self.close()  # who has more than there is talks nonsense
            return
        # a new courier, or one that has given records to another in between
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
        """Let go of what has arrived, and note what is behind it."""
        while self._oldest < arrived:
            self._kept.popleft()
            self._under_way.pop(self._oldest, None)
            self._oldest += 1
        self._behind = {arrived + 1 + k for k in range(behind.bit_length()) if behind >> k & 1}
        self._reached = reached

    def _take(self) -> None:
        """Give out what is next in order."""
        while self._taken in self._early:
            self._received.append(self._early.pop(self._taken))
            self._taken += 1

    def _tell(self, link: Link) -> None:
        """Send what is due, or a sign of life."""
        due: list[int | None] = [*self._due()]
        for number in due or [None]:
            if link.closed:
                return
            link.send(self._message(number))

    def _due(self) -> list[int]:
        """Records that were not sent over this link, or lost there."""
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
    """A queue of records: the first in memory, the others in a temporary file that ends with the process."""

    def __init__(self) -> None:
        self._near: deque[bytes] = deque()
        self._far: IO[bytes] | None = None
        self._read = self._behind = 0  # where in the file the next begins, how many are there

    def __len__(self) -> int:
        return len(self._near) + self._behind

    def __getitem__(self, place: int) -> bytes:
        return self._near[place]

    def append(self, record: bytes) -> None:
        """Put a record behind all others."""
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
        """Take the first record away."""
        record = self._near.popleft()
        if self._far is not None and self._behind:
            self._near.append(self._fetched(self._far))
        return record

    def _fetched(self, far: IO[bytes]) -> bytes:
        """The next record of the file; an emptied file begins anew."""
        far.seek(self._read)
        (length,) = _LENGTH.unpack(far.read(_LENGTH.size))
        record = far.read(length)
        self._read += _LENGTH.size + length
        self._behind -= 1
        if not self._behind:
            self._read = 0
            far.truncate(0)
        return record
