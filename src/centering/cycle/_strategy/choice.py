"""Push chosen by a strategy, complete for planning and sending."""

from typing import NamedTuple


class PushChoice(NamedTuple):
    """Push chosen by a strategy.

    Attributes
    ----------
    aim : float
        Intended mean travel of the part, mm.
    stroke : float
        Greatest travel of the tip after the first touch, mm.
    push_speed : float
        Greatest speed of the tip, mm/s.
    shape : str
        ``"trapezoid"`` or ``"gentle"``.
    retract : bool
        Whether the tip retracts at once.
    spindle_speed : float
        Table speed, rad/s.
    kind : int
        Index in `Strategy.kinds`.
    """

    aim: float
    stroke: float
    push_speed: float
    shape: str
    retract: bool
    spindle_speed: float
    kind: int
