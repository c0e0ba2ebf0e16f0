"""Messages between two couriers: a header of whole numbers, then at most one record."""

import struct
from typing import Any, Final, NamedTuple

WINDOW: Final = 64  # derived: records under way at once are the bits of one word of the header
SIGN, RECORD = range(3, 5)  # kinds of message
# kind, sender; acknowledged: courier, records in order, bits of records behind them, last message; number of
# this message, oldest record, this record
_HEADER = struct.Struct("!B8Q")
_MOST = 2**48  # chosen: 89 000 years of 100 messages a second; sums of such numbers fit the header


class LinkFrame(NamedTuple):
    """A message; `sender` and `whose` are names of couriers, `behind` is a set of bits."""

    kind: int
    sender: int
    whose: int  # courier whose records are acknowledged; 0: none was heard
    arrived: int  # records that arrived in order
    behind: int  # those that arrived behind the next one
    reached: int  # last message that arrived
    number: int  # of this message, from 1
    oldest: int  # first record that the sender keeps
    record: int
    content: bytes = b""

    @property
    def top(self) -> int:
        """Number after the last record that is acknowledged."""
        return self.arrived + self.behind.bit_length() + (self.behind > 0)

    def packed(self) -> bytes:
        """The message."""
        return _HEADER.pack(*self[:9]) + self.content


def parsed(message: Any) -> LinkFrame | str:
    """Return the frame of a message, or what is wrong with it."""
    if not isinstance(message, bytes) or len(message) < _HEADER.size or message[0] not in (SIGN, RECORD):
        return "a message was of another language"
    frame = LinkFrame._make((*_HEADER.unpack_from(message), message[_HEADER.size :]))
    numbers = frame.arrived, frame.reached, frame.number, frame.oldest, frame.record
    if max(numbers) > _MOST or not frame.number or not frame.sender:
        return f"a message had a number out of its range, [0, 2^48]: {max(numbers)}"
    if frame.kind == SIGN and (frame.content or frame.record):
        return "a sign of life carried a record"
    return frame
