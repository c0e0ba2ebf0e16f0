"""What a centering cycle is doing, and why one ended without a centred part."""

from enum import IntEnum


class CycleState(IntEnum):
    """What the cycle is doing: Mears (2006), figure 3.2; logged as its number, dimensionless.

    Examples
    --------
    >>> CycleState(2).name, CycleState.LOST.failed
    ('WAIT', True)
    """

    APPROACH = 0
    """The slide goes in until the probe touches."""
    COLLECT = 1
    """Readings go to the estimator."""
    WAIT = 2
    """The part is known well enough; the trigger angle is to come."""
    PUSH = 3
    """A profile runs."""
    REFOLLOW = 4
    """The tip goes back; the part may still slide."""
    CHECK = 5
    """It looks as if the part were centred: more readings are to make that sure."""
    CENTERED = 6
    """Done."""
    TIMEOUT = 7
    """Given up: too long."""
    COLLISION = 8
    """Given up: force on the slide while nothing was to be pushed, or more than the sensor's range."""
    LOST = 9
    """Given up: the probe finds no part."""
    BEYOND = 10
    """Given up: further from the axis than the strategy knows pushes for."""
    PUSHES_MAX = 11
    """Given up: pushed as often as the problem allows."""
    FRICTION = 12
    """Given up: friction outside what the strategy knows, and pushes that no longer bring the part nearer."""

    @property
    def failed(self) -> bool:
        """Whether the cycle ended without a centred part."""
        return self >= CycleState.TIMEOUT

    @property
    def over(self) -> bool:
        """Whether the cycle has ended."""
        return self >= CycleState.CENTERED
