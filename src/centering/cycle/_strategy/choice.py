"""What a strategy answers: a push in full, as the controller plans and sends it."""

from typing import NamedTuple


class PushChoice(NamedTuple):
    """A push that a strategy chooses.

    Attributes
    ----------
    aim : float
        Mean travel of the part that is wanted, mm.
    stroke : float
        Greatest travel of the tip after the first touch, mm.
    push_speed : float
        Greatest speed of the tip, mm/s.
    shape : str
        ``"trapezoid"`` or ``"gentle"``.
    retract : bool
        Whether the tip is drawn back at once.
    spindle_speed : float
        Table speed, rad/s.
    kind : int
        Number of the kind of push among `Strategy.kinds`.
    """

    aim: float
    stroke: float
    push_speed: float
    shape: str
    retract: bool
    spindle_speed: float
    kind: int
