"""Protocol of a link between a machine and its host, and a link in memory on the simulated clock."""

from collections import deque
from typing import Protocol, runtime_checkable

import numpy as np

from hwsim._processor.tasks import NANOSECONDS
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.rng import Seed, children

_AT_ONCE = 4500  # messages; chosen: a courier closes a link at fewer, and 3 ms are enough for that


@runtime_checkable
class Link(Protocol):
    """One end of a link that carries messages (bytes) in order; it may lose messages and break.

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
        """Bytes that wait for the network; later messages follow them."""

    def advance(self, time: float) -> None:
        """Set the time.

        Parameters
        ----------
        time : float
            Time of the simulation, s; a real link ignores it.
        """

    def send(self, message: bytes) -> None:
        """Send a message without blocking.

        Parameters
        ----------
        message : bytes
            Content.
        """

    def receive(self) -> list[bytes]:
        """Return the messages (bytes) that arrived since the last call, without blocking."""

    def close(self) -> None:
        """Close the link; messages under way are lost."""


@described()
class QueueLink(Described):
    """A link in memory with latency and loss; messages stay in order.

    Parameters
    ----------
    latency : float
        Transmission time, s.
    jitter : float
        Upper limit of a uniform additional delay, s; no message overtakes another.
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
        """Return both ends of a new link, at time 0 s.

        Parameters
        ----------
        rng : int, Generator or SeedSequence
            Random source; each direction draws from its own child.

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
        """Send a message; a lost one draws as much, so that a larger loss only adds losses."""
        lost, late = self.rng.random(2)
        if lost >= self.link.loss:
            arrival = now + round((self.link.latency + late * self.link.jitter) * NANOSECONDS)
            self.under_way.append((arrival, message))

    def take(self, now: int) -> list[bytes]:
        """Messages that have arrived; a late one holds up those behind it, and a closed lane brings none."""
        arrived: list[bytes] = []
        while self.under_way and not self.closed and self.under_way[0][0] <= now and len(arrived) < _AT_ONCE:
            arrived.append(self.under_way.popleft()[1])
        return arrived

    def close(self) -> None:
        """Bring nothing any more; messages under way go with the lane, as to free 100 000 takes 7 ms."""
        self.closed = True


class QueueEnd:
    """One end of a `QueueLink`, a `Link`; its owner sets the time (s).

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
        """Whether either end closed the link."""
        return self._outgoing.closed

    @property
    def unsent(self) -> int:
        """Always 0 bytes: the queue is unlimited."""
        return 0

    def advance(self, time: float) -> None:
        """Set the time, s; ValueError when it goes back."""
        now = round(checks.number("time", time, "s") * NANOSECONDS)
        if now < self._now:
            raise checks.refuse("time", f">= that of the link, {self._now / NANOSECONDS:g}", time, "s")
        self._now = now

    def send(self, message: bytes) -> None:
        """Send a message to the other end; ConnectionError when the link is closed."""
        if not isinstance(message, bytes):
            raise TypeError(f"message must be bytes; got {checks.shown(message)}")
        if self.closed:
            raise ConnectionError("the link is closed")
        self._outgoing.put(message, self._now)

    def receive(self) -> list[bytes]:
        """Return the messages (bytes) that have arrived, the oldest first; at most 4500, the others later."""
        return self._incoming.take(self._now)

    def close(self) -> None:
        """Close both ends; messages under way are lost."""
        self._outgoing.close()
        self._incoming.close()
