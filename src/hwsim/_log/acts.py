"""Acts of the operator in a run against the clock."""

from typing import NamedTuple


class OperatorAct(NamedTuple):
    """One act of the operator, as the journal holds it."""

    part: int
    civil: str  # ISO 8601, UTC
    monotonic: int  # ns
    who: str  # "program", a signal, "machine"
    what: str  # "pause", "resume", "abort: <reason>"
