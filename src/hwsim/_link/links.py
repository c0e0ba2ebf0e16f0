"""A link between a machine and its host: its protocol, and one in memory on the clock of the simulation."""

from collections import deque
from typing import Protocol, runtime_checkable

import numpy as np

from hwsim._processor.tasks import NANOSECONDS
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.rng import Seed, children


@runtime_checkable
class Link(Protocol):
    """One end of a link that carries messages (bytes) in order; it may lose some, and it may break.

    Examples
    --------
    >>> near, far = QueueLink().start()
    >>> isinstance(near, Link)
    True
    """

    @property
    def closed(self) -> bool:
        """Whether the link is broken or was closed."""

    @property
    def unsent(self) -> int:
        """Bytes that wait for the network; what is sent meanwhile follows them."""

    def advance(self, time: float) -> None:
        """Say what time it is.

        Parameters
        ----------
        time : float
            Of the simulation, s; a link to the real world has its own time.
        """

    def send(self, message: bytes) -> None:
        """Hand a message over; returns at once.

        Parameters
        ----------
        message : bytes
            Anything.
        """

    def receive(self) -> list[bytes]:
        """Return the messages (bytes) that have arrived since the last call; returns at once."""

    def close(self) -> None:
        """Break the link; what is under way is lost."""


@described()
class QueueLink(Described):
    """A link in memory: messages arrive late, some never; always in order.

    Parameters
    ----------
    latency : float
        From sending to arriving, s.
    jitter : float
        A message takes longer by a uniform draw between 0 and this, s; none overtakes another.
    loss : float
        Probability that a message is lost, in [0, 1].

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> machine, host = QueueLink(latency=0.02).start()
    >>> machine.send(b"here I am")
    >>> host.advance(0.01)  # s
    >>> host.receive()
    []
    >>> host.advance(0.02)
    >>> host.receive()
    [b'here I am']
    """

    latency: float = quantity("s", at_least=0, default=0)
    jitter: float = quantity("s", at_least=0, default=0)
    loss: float = quantity("1", at_least=0, at_most=1, default=0)

    def start(self, rng: Seed = 0) -> tuple["QueueEnd", "QueueEnd"]:
        """Return both ends of a fresh link, at time 0 s.

        Parameters
        ----------
        rng : int, Generator or SeedSequence
            Random source; each direction draws from a child of its own.

        Examples
        --------
        >>> near, far = QueueLink(loss=0.5).start(1)
        >>> for number in range(8):
        ...     near.send(bytes([number]))
        >>> len(far.receive()) < 8
        True
        """
        there, back = (_Lane(self, each) for each in children(rng, 2))
        return QueueEnd(there, back), QueueEnd(back, there)


class _Lane:
    """One direction of a link in memory, times in ns."""

    def __init__(self, link: QueueLink, rng: np.random.Generator) -> None:
        self.link, self.rng = link, rng
        self.closed = False
        self.under_way: deque[tuple[int, bytes]] = deque()

    def put(self, message: bytes, now: int) -> None:
        """Send a message; lost or not it draws as much, so that a larger loss only adds to what is lost."""
        lost, late = self.rng.random(2)
        if lost >= self.link.loss:
            arrival = now + round((self.link.latency + late * self.link.jitter) * NANOSECONDS)
            self.under_way.append((arrival, message))

    def take(self, now: int) -> list[bytes]:
        """Messages that have arrived; one that is late holds up those behind it."""
        arrived = []
        while self.under_way and self.under_way[0][0] <= now:
            arrived.append(self.under_way.popleft()[1])
        return arrived

    def close(self) -> None:
        """Lose what is under way."""
        self.closed = True
        self.under_way.clear()


class QueueEnd:
    """One end of a `QueueLink`, a `Link`. Each end is told the time (s) by whoever owns it.

    Examples
    --------
    >>> near, far = QueueLink().start()
    >>> near.send(b"to the host")
    >>> far.receive()
    [b'to the host']
    """

    def __init__(self, outgoing: _Lane, incoming: _Lane) -> None:
        self._outgoing, self._incoming = outgoing, incoming
        self._now = 0

    @property
    def closed(self) -> bool:
        """Whether one of the two ends closed the link."""
        return self._outgoing.closed

    @property
    def unsent(self) -> int:
        """None, 0 bytes: a queue takes all."""
        return 0

    def advance(self, time: float) -> None:
        """Say what time it is.

        Parameters
        ----------
        time : float
            Time of the simulation, s; it never goes back.

        Raises
        ------
        ValueError
            When it goes back.
        """
        now = round(checks.number("time", time, "s") * NANOSECONDS)
        if now < self._now:
            raise checks.refuse("time", f">= that of the link, {self._now / NANOSECONDS:g}", time, "s")
        self._now = now

    def send(self, message: bytes) -> None:
        """Send a message to the other end.

        Parameters
        ----------
        message : bytes
            Anything.

        Raises
        ------
        ConnectionError
            When the link is closed.
        """
        if not isinstance(message, bytes):
            raise TypeError(f"message must be bytes; got {checks.shown(message)}")
        if self.closed:
            raise ConnectionError("the link is closed")
        self._outgoing.put(message, self._now)

    def receive(self) -> list[bytes]:
        """Return the messages (bytes) that have arrived by now, the oldest first."""
        return self._incoming.take(self._now)

    def close(self) -> None:
        """Break the link at both ends; what is under way is lost."""
        self._outgoing.close()
        self._incoming.close()
