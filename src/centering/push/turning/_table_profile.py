"""Push on a turning table as motion along the contact normal, with the rim's own advance."""

from typing import Self

import numpy as np

from centering._problem.model import GRAVITY, PushModel
from centering.push._profile.profile import TipProfile, column
from centering.push.turning import _plane_kernels as at
from centering.push.turning._shooting import ring_state
from centering.push.turning._table_kernels import PIECE_COLUMNS, follow
from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import described

# rad, chosen: greatest turn of the table in a piece; speed is nearly linear, loads constant in it
_TURN = 0.02
_PIECES = 25  # chosen: least pieces of a push, for the same reason
_STANDS = 1e-9  # s, chosen: last piece, after which the tip stays against the part or recedes
_ERROR = 1e-8  # mm, chosen: integration error of a step in the plane
_PARTS = 16  # chosen: a slide after the stroke is followed in this many parts and once as many again


@described("centering.table_profile")
class TableProfile(TipProfile):
    """Motion of a tip along the contact normal against a turning table, with loads on the friction.

    `turning_profile` makes it.

    Parameters
    ----------
    duration, velocity, acceleration, start
        See `TipProfile`; s, mm/s, mm/s^2, mm, along the contact normal against the table.
    held, slid : array, (n,)
        Loads added to friction at rest and in motion, N.

    Raises
    ------
    ValueError
        When a value is not finite or the lengths differ.

    Examples
    --------
    >>> profile = TableProfile([0.1], [10.0], [0.0], held=[3.0], slid=[2.0])
    >>> profile.pieces
    array([[ 0.1, 10. ,  0. ,  3. ,  2. ]])
    """

    held: Floats | tuple[float, ...] = column("N", default=())
    slid: Floats | tuple[float, ...] = column("N", default=())

    def _check(self) -> None:
        super()._check()
        for name in ("held", "slid"):
            given = getattr(self, name)
            loads = given if len(given) else lasting(np.zeros(self.duration.size))
            if loads.shape != self.duration.shape:
                raise checks.refuse(name, f"of the {self.duration.size} segments", loads.shape)
            object.__setattr__(self, name, loads)

    @property
    def pieces(self) -> Floats:
        """Duration (s), speed (mm/s), acceleration (mm/s^2), both loads (N) of each segment, (n, 5)."""
        return np.column_stack((self.duration, self.velocity, self.acceleration, self.held, self.slid))

    def then(self, other: TipProfile) -> Self:
        """Return this profile followed by another one; a plain `TipProfile` has no loads.

        Parameters
        ----------
        other : TipProfile
            Profile that follows; its `start` (mm) is ignored.

        Examples
        --------
        >>> profile = TableProfile([0.1], [10.0], [0.0], held=[3.0], slid=[2.0])
        >>> profile.then(TipProfile.constant_speed(5.0, 0.1)).held  # N
        array([3., 0.])
        """
        whole = super().then(other)
        nothing = np.zeros(other.duration.size)
        loads = {
            name: np.concatenate((getattr(self, name), getattr(other, name, nothing)))
            for name in ("held", "slid")
        }
        return whole.replace(**loads)


def turning_profile(
    profile: TipProfile, model: PushModel, *, offset: float, touch_angle: float, spindle_speed: float
) -> TableProfile:
    """Return the motion of a tip against a part on a turning table, along the contact normal.

    It is the input of `simulate_table_push` and `FrictionEstimator` for a push on a turning table. The table
    carries the part against the tip, which pushes it farther and faster than the slide moves, and throws it
    outward; Mears has neither. With c the centre, n the contact normal from the tip to it, J a quarter turn,
    u the slip on the table, and u_n, u_t its components along n and across: the contact closes by s - u_n, s
    = -n . w J c - v n_x, and ``M du_n/dt = F_c - F_k u_n/|u| - k_v u_n`` + M w^2 c . n + M (w + dbeta/dt)
    u_t. Speed and loads follow the motion in the plane, linear and constant over pieces of 0.02 rad or less.
    Positions are along the normal; travel across it is left out. After the profile the tip stays, or goes on
    receding, until the part rests.

    Parameters
    ----------
    profile : TipProfile
        Slide from first touch on, positive toward the axis (mm, s), as `Push.push_profile`.
    model : PushModel
        Model of part and contact.
    offset : float
        Distance of the part's centre from the axis at first touch, mm.
    touch_angle : float
        Angle of the centre before the push line at first touch, rad, as `Touch.angle`.
    spindle_speed : float
        Speed of the table, rad/s.

    Raises
    ------
    ValueError, TypeError
        When a value is out of range, or the profile does not begin at first touch.

    Examples
    --------
    >>> from centering import preset
    >>> push, model = TipProfile.move(1.0, 10.0, 2560.0), preset("printed").model
    >>> place = {"offset": 1.0, "touch_angle": 0.1}  # mm, rad
    >>> [round(turning_profile(push, model, **place, spindle_speed=w).end, 3) for w in (0.0, 2.0)]  # mm
    [1.0, 1.005]
    """
    checks.kind("profile", profile, TipProfile)
    checks.kind("model", model, PushModel)
    if profile.start != 0:
        raise checks.refuse("profile.start", "0: it begins at first touch", profile.start, "mm")
    w = checks.number("spindle_speed", spindle_speed, "rad/s")
    angle = checks.number("touch_angle", touch_angle, "rad")
    d = checks.nonnegative("offset", offset, "mm")
    if d >= model.part.radius:
        raise checks.refuse("offset", f"< the radius of the part = {model.part.radius:g}", d, "mm")
    return _followed(profile, model, w, ring_state(d, -angle, model.part.radius, w))


def _followed(profile: TipProfile, model: PushModel, w: float, state: Floats) -> TableProfile:
    """Profile along the way of a ring in a state, until it rests."""
    rows = profile.segments
    longest = min(profile.total_time / _PIECES, _TURN / max(abs(w), 1e-9))
    speed = min(profile.final_velocity, 0.0)
    slide = 2.0 * (float(np.abs(rows[:, 1]).max()) + 1.0) / (model.mu_kinetic * GRAVITY)
    wait = np.array([[slide / _PARTS, speed, 0.0]])
    pieces = [_pieces(rows, model, w, longest, state)]
    for _ in range(2 * _PARTS):
        if state[at.RESTS] > 0.5:
            break
        pieces.append(_pieces(wait, model, w, longest, state))
    last = pieces[-1][-1]
    pieces.append(np.array([[_STANDS, min(last[1] + last[2] * last[0], 0.0), 0.0, *last[3:]]]))
    duration, velocity, acceleration, held, slid = np.vstack(pieces).T
    return TableProfile(duration, velocity, acceleration, held=held, slid=slid)


def _pieces(rows: Floats, model: PushModel, w: float, longest: float, state: Floats) -> Floats:
    """Pieces of the rows of a profile, (n, 5)."""
    out = np.empty((int(np.ceil(rows[:, 0] / longest).sum()) + len(rows), PIECE_COLUMNS))
    count = follow(model.parameters, model.part.radius, w, rows, _ERROR, longest, state, out)
    return np.asarray(out[:count])
