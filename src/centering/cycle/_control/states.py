"""States of a centering cycle, with the reasons for its end."""

from enum import IntEnum


class CycleState(IntEnum):
    """State of the cycle: Mears (2006), figure 3.2; logged as its number, unit 1.

    Examples
    --------
    >>> CycleState(2).name, CycleState.LOST.failed
    ('WAIT', True)
    """

    APPROACH = 0
    """The slide approaches until the probe touches."""
    COLLECT = 1
    """Readings go to the estimator."""
    WAIT = 2
    """The estimate suffices; the trigger angle is ahead."""
    PUSH = 3
    """A profile runs."""
    REFOLLOW = 4
    """The tip retracts; the part may still slide."""
    CHECK = 5
    """The part is probably centred; more readings confirm it."""
    CENTERED = 6
    """Done."""
    TIMEOUT = 7
    """Abandoned: time limit."""
    COLLISION = 8
    """Abandoned: force without a push, or beyond the range of the sensor."""
    LOST = 9
    """Abandoned: the probe finds no part."""
    BEYOND = 10
    """Abandoned: offset beyond the range of the strategy."""
    PUSHES_MAX = 11
    """Abandoned: greatest number of pushes reached."""
    FRICTION = 12
    """Abandoned: friction outside the range of the strategy, and pushes that do not reduce the offset."""

    THROWN = 13
    """Abandoned: the table threw the part, a second time or out of reach of the probe."""

    @property
    def failed(self) -> bool:
        """Whether the cycle ended without a centred part."""
        return self >= CycleState.TIMEOUT

    @property
    def over(self) -> bool:
        """Whether the cycle has ended."""
        return self >= CycleState.CENTERED
