"""Records over a link that may lose messages and break: acknowledged, in order, none twice.

Selective repeat: a header acknowledges the records that arrived, in order and among the 64 behind those, and
names the last message that arrived. A link keeps messages in order; a record that went with an earlier
message and did not arrive is therefore lost, and is sent again at once. No timer is needed.
"""

import uuid
from collections import deque
from contextlib import suppress
from typing import Any, Self

from hwsim._link.backlog import Backlog
from hwsim._link.frames import RECORD, SIGN, WINDOW, LinkFrame, parsed
from hwsim._link.links import Link
from hwsim._processor.tasks import NANOSECONDS
from sdpgrind.base import checks

# in one call of `advance`; chosen: twice the messages of a full window, some 0.5 ms
_MESSAGES, _BYTES = 128, 2**20
# messages and bytes that may wait for the next calls; chosen: 32 calls, four of the largest records of 16 MiB
_WAITING, _WAITING_BYTES = 4096, 2**26
_UNREAD = 4096  # records that wait for `receive`; chosen: as many as a backlog has in memory


class Courier:
    """One side of a reliable exchange of records between a machine and its host.

    `send` keeps a record until the courier on the other side has acknowledged it. `advance`, called
    repeatedly, sends and receives records or a sign of life. After a break, `attach` another link: no record
    is lost or doubled.

    What the other side sends is not trusted: a message that no courier sends closes the link (`reason`),
    which is silence; one that is not newer than the last is no sign of life. One call takes 128 messages and
    1 MiB, the rest waits; more than 4096, or 64 MiB, close the link. Nothing proves who the other side is:
    between computers, OPC UA does (`hwsim.serve`, `hwsim.OpcuaPlant`).

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
        self._sent = 0  # number of our last message
        self._carried = 0  # records that any message has carried
        self._reached = 0  # number of our last message that arrived
        self._other = 0  # courier on the other side
        self._last = 0  # number of its last message
        self._kept_there = 0  # its oldest record
        self._taken = 0  # number of its records delivered in order
        self._known = False  # whether it was heard over this link
        self._reason = ""
        self._arrived: deque[bytes] = deque()  # messages that wait for the next `advance`
        self._bytes = 0  # in them
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

    @property
    def reason(self) -> str:
        """Why the link was closed, in words; empty while it is open, or where the link does not tell."""
        return self._reason or str(getattr(self._link, "reason", ""))

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
        self._forget()
        self._known, self._reason = False, ""

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
        self._hear_some(self._link)
        if not (self._link.closed or self._link.unsent):  # nothing piles up in a blocked link
            self._tell(self._link)

    def _hear_some(self, link: Link) -> None:
        """Receive what one call may take; the rest waits."""
        try:
            fresh = link.receive()
            self._bytes += sum(map(len, fresh))
            self._arrived += fresh
        except Exception as error:  # a link that fails is cut
            self._cut(f"the link failed: {type(error).__name__}: {error}")
        messages, left = 0, _BYTES
        while self._arrived and messages < _MESSAGES and (not messages or len(self._arrived[0]) <= left):
            message = self._arrived.popleft()
            messages, left, self._bytes = messages + 1, left - len(message), self._bytes - len(message)
            self._hear(message)
        if len(self._arrived) > _WAITING or self._bytes > _WAITING_BYTES:
            self._cut(f"more than {_WAITING} messages or {_WAITING_BYTES} bytes wait")

    def _cut(self, reason: str) -> None:
        """Close the link for a reason, and forget what waits."""
        self._reason = self._reason or reason
        self._forget()
        with suppress(Exception):  # it may have failed
            self.close()

    def _forget(self) -> None:
        """Forget the messages that wait."""
        self._arrived.clear()
        self._bytes = 0

    def _hear(self, message: bytes) -> None:
        """Receive a message, with at most one record in it."""
        frame = parsed(message)
        if isinstance(frame, str):
            self._cut(frame)
            return
        new, ours = frame.sender != self._other, frame.whose == self._name
        if not new and (frame.number <= self._last or (ours and frame.reached < self._reached)):
            return  # no sign of life: it was heard before
        if reason := self._fault(frame, new=new, ours=ours):
            self._cut(reason)
            return
        self._heard, self._known = self._time, True
        self._follow(frame, new=new)
        if ours:
            self._let_go(frame)
        if frame.kind == RECORD and frame.record >= self._taken and len(self._received) < _UNREAD:
            self._early[frame.record] = frame.content
            self._take()

    def _fault(self, frame: LinkFrame, *, new: bool, ours: bool) -> str:
        """Say why no courier sends such a message; empty: one may."""
        if frame.sender == self._name:
            return "its own messages came back"
        if ours and (frame.top > max(self._carried, self._oldest) or frame.reached > self._sent):
            return "more was acknowledged than was sent"
        # another courier may have acknowledged what this one never saw, but not while this one is addressed
        floor = 0 if new else self._kept_there
        ceiling = self._taken if self._known and ours and not new else frame.oldest
        if not floor <= frame.oldest <= ceiling:
            return f"the oldest record must be in [{floor}, {ceiling}]; it was {frame.oldest}"
        end = WINDOW + (frame.oldest if new else max(frame.oldest, self._taken))
        if frame.kind == RECORD and not frame.oldest <= frame.record < end:
            return f"a record must be in [{frame.oldest}, {end}); it was {frame.record}"
        return ""

    def _follow(self, frame: LinkFrame, *, new: bool) -> None:
        """Note who sends, and from which record on."""
        if new:
            self._reached = 0
        if new or frame.oldest > self._taken:
            self._other, self._taken = frame.sender, frame.oldest
            self._early.clear()
        self._last, self._kept_there = frame.number, frame.oldest

    def _let_go(self, frame: LinkFrame) -> None:
        """Drop the records that have arrived, and note those behind them that have."""
        while self._oldest < frame.arrived:
            self._kept.popleft()
            self._under_way.pop(self._oldest, None)
            self._oldest += 1
        bits = range(frame.behind.bit_length())
        self._behind = {frame.arrived + 1 + k for k in bits if frame.behind >> k & 1}
        self._reached = frame.reached

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
            try:
                link.send(self._message(number))
            except Exception as error:  # a link that fails is cut
                self._cut(f"the link failed: {type(error).__name__}: {error}")

    def _due(self) -> list[int]:
        """Records in the window that were not sent over this link, or were lost there."""
        window = range(self._oldest, self._oldest + min(WINDOW, len(self._kept)))
        return [
            each
            for each in window
            if each not in self._behind and self._under_way.get(each, 0) <= self._reached
        ]

    def _message(self, record: int | None) -> bytes:
        self._sent += 1
        behind = sum(1 << each - self._taken - 1 for each in self._early)
        told = self._other, self._taken, behind, self._last, self._sent, self._oldest
        if record is None:
            return LinkFrame(SIGN, self._name, *told, 0).packed()
        self._under_way[record] = self._sent
        self._carried = max(self._carried, record + 1)
        return LinkFrame(RECORD, self._name, *told, record, self._kept[record - self._oldest]).packed()

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self
