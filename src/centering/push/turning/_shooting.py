"""Where a push on a turning table leaves the ring, by following it in the plane; and how to begin it so that this is the axis."""

from cmath import exp
from typing import NamedTuple

import numpy as np

from centering.push._machine.model import PushModel
from centering.push.turning import _direction_kernels as at
from centering.push.turning import _shooting_kernels as search
from sdpgrind.base.checks import Floats


def ring_state(offset: float, offset_angle: float, radius: float, spindle_speed: float) -> Floats:
    """State for `push_on_table` of a ring (mm, rad) that rests on the turning table (rad/s) with the tip at its rim."""
    state = np.empty(at.STATES)
    at.place(offset, offset_angle, radius, spindle_speed, state)
    return state


def landing(model: PushModel, spindle_speed: float, rows: Floats, state: Floats, tolerance: float) -> complex:
    """Where the ring comes to rest, x + i y mm in the table's frame at the begin; the tip stays where its profile ends.

    `tolerance` (mm) is what a step may err by. A ring that goes on sliding (RESTS of the state is 0) is where it was seen last.
    """
    at.land(model.parameters, model.part.radius, spindle_speed, rows, tolerance, state)
    return complex(state[at.X], state[at.Y]) * exp(-1j * spindle_speed * state[at.CLOCK])


class Aim(NamedTuple):
    """Angle of first touch (rad), lengthening of the stroke (mm); what they miss, astray (rad) and left along the way (mm).

    `left`: distance from the axis at which the ring is left, mm; infinite where it is not pushed. `rests`: it stays there.
    """

    angle: float
    longer: float
    astray: float
    along: float
    left: float
    rests: bool


def aimed(model: PushModel, spindle_speed: float, push: Floats, offset: float, angle: float) -> Aim:
    """The push with which nothing is missed, near an angle of first touch (rad); else of those tried the one that leaves least.

    `push` is what `push_rows` takes. A ring that is thrown so far that no stroke does is aimed at the axis in its direction only.
    """
    aim = np.empty(search.SEARCH)
    search.aimed(model.parameters, model.part.radius, spindle_speed, push, offset, angle, aim)
    angle, longer, astray, along, still = aim[: search.STILL + 1].tolist()
    return Aim(angle, longer * offset, astray, along * offset, search.left_of(aim) * offset, still > 0.5)
