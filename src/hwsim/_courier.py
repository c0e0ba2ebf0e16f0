"""Records over a link that may lose messages and break: kept until acknowledged, sent again, in order, none twice.

Each message says which courier sends it, how many records of which courier on the other side have arrived, the number of the
oldest record that is not known to have arrived, and, unless it is a mere sign of life, one record and its number. What was not
acknowledged for some time, or was sent over a link that is no more, is sent again from the oldest on (go back n); of what
arrives only the next number is taken.
"""

import struct
import uuid
from collections import deque
from itertools import islice
from typing import Any, Self

from hwsim._links import Link
from hwsim._tasks import NANOSECONDS
from sdpgrind.base import checks

_HEADER = struct.Struct("!BQQQQQ")  # kind, who sends, whose records have arrived, how many of them, the oldest, this one
_SIGN, _RECORD = 1, 2
_WINDOW = 64  # records that are under way at once


class Courier:
    """One side of an exchange of records between a machine and its host.

    A `Link` that loses nothing: `send` keeps a record until the other side's courier has acknowledged it, whatever becomes of the
    link below. `advance`, called again and again, moves records and is a sign of life; after the link broke, `attach` a new one
    and nothing is lost or doubled.

    A courier that is new knows nothing of what an older one sent or took, and the other side notices: it goes on with what the
    older one had not acknowledged. A copy is the same courier, so that a controller that is copied talks on.

    Parameters
    ----------
    link : Link, optional
        To begin with; None: records wait until one is attached.
    resend_time : float
        What is not acknowledged is sent again after so long, s; more than a message there and back takes.

    Raises
    ------
    ValueError
        When the time is not > 0.

    Examples
    --------
    >>> from hwsim._links import QueueLink
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

    def __init__(self, link: Link | None = None, *, resend_time: float = 0.5) -> None:
        self._resend_time = checks.positive("resend_time", resend_time, "s")
        self._name = uuid.uuid4().int >> 64
        self._link: Link | None = None
        self._kept: deque[bytes] = deque()
        self._oldest = 0  # number of the first that is kept
        self._next = 0  # number of the next to be sent over this link
        self._since = 0.0  # s, when the oldest was sent or the one before it acknowledged
        self._other = 0  # who is on the other side
        self._taken = 0  # records taken from there
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
        """How long nothing was heard from the other side, s; a courier that never heard anything counts from time 0."""
        return round((self._time - self._heard) * NANOSECONDS) / NANOSECONDS  # so that 20 steps of 0.01 s are 0.2 s

    @property
    def waiting(self) -> int:
        """How many records are not acknowledged, a whole number."""
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
        >>> from hwsim._links import QueueLink
        >>> machine = Courier()
        >>> machine.attach(QueueLink().start()[0])
        >>> machine.closed
        False
        """
        self._link = checks.able("link", link, "a link", "send", "receive", "advance", "close")
        self._next = self._oldest

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
        """Return the records (bytes) that are new since the last call, in the order in which they were sent, each once."""
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
        """Take what a message says: at most one record is new."""
        if len(message) < _HEADER.size or message[0] not in (_SIGN, _RECORD):
            self.close()
            return
        kind, other, whose, arrived, oldest, number = _HEADER.unpack_from(message)
        if whose == self._name and not self._acknowledged(arrived):
            return
        self._heard = self._time
        if other != self._other:
            self._other, self._taken = other, oldest
        if kind == _RECORD and number == self._taken:
            self._taken += 1
            self._received.append(message[_HEADER.size :])

    def _acknowledged(self, arrived: int) -> bool:
        """Let go of what has arrived; a peer that has more than was sent talks nonsense."""
        if arrived > self._oldest + len(self._kept):
            self.close()
            return False
        while self._oldest < arrived:
            self._kept.popleft()
            self._oldest += 1
            self._since = self._time
        self._next = max(self._next, self._oldest)
        return True

    def _tell(self, link: Link) -> None:
        """Send what is due."""
        if self._next == self._oldest or self._time - self._since >= self._resend_time:
            self._next, self._since = self._oldest, self._time
        due: list[bytes | None] = list(islice(self._kept, self._next - self._oldest, _WINDOW))
        for record in due or [None]:
            if link.closed:
                return
            link.send(self._message(record))
            self._next += record is not None

    def _message(self, record: bytes | None) -> bytes:
        kind, number = (_SIGN, 0) if record is None else (_RECORD, self._next)
        return _HEADER.pack(kind, self._name, self._other, self._taken, self._oldest, number) + (record or b"")

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self
