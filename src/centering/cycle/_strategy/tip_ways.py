"""Ways of the tip around a push: waiting place, approach and retreat, and the rest of the part after it."""

from math import sqrt

import numpy as np

from centering._problem.model import GRAVITY, PushModel
from centering._problem.problem import CenteringLimits, CenteringProblem
from centering.cycle._measuring.rotations import FEWEST
from centering.cycle._measuring.settings import CycleSettings
from centering.cycle._strategy.outcomes import PushKind
from centering.push._profile.rows import retraction
from sdpgrind.base.checks import Floats

LATEST = 1.3  # chosen: samples before its start until which a push can be sent
FREEZE = 5.0  # chosen: samples before its start from which on slide and table keep their speed
_NEXT = 0.5  # derived: mean time to the next sample, in samples
_MARGIN = CycleSettings().margin
_LEAST_ROOM = 0.3  # chosen: least distance of a waiting tip from the furthest rim over the margin
_UNSURE = 4.0  # chosen: standard deviations of the place by which the tip waits further out
_PAUSE = 0.02  # s, chosen: rest of a tip that does not retract at once
_CLEAR = 0.5  # mm, chosen: its retreat


def run_up(speed: float, limits: CenteringLimits) -> float:
    """Return the distance (mm) over which the slide accelerates from rest to a speed (mm/s)."""
    return speed * speed / (2.0 * limits.acceleration_max)


def waiting_room(need: float, place_sd: float, margin: float) -> float:
    """Return the distance (mm) of a waiting tip from the furthest rim.

    Parameters
    ----------
    need : float
        Distance in which the tip gains its speed, mm.
    place_sd : float
        Standard deviation of the place of the part, mm.
    margin : float
        `CycleSettings.margin`, mm.
    """
    return max(need, _LEAST_ROOM * margin) + min(_UNSURE * place_sd, margin)


def approach_rows(room: float, speed: float, limits: CenteringLimits) -> Floats:
    """Return the fastest motion over the room (mm) before the rim that ends at a speed (mm/s)."""
    most = limits.acceleration_max
    top = min(sqrt(most * room + 0.5 * speed * speed), limits.slide_speed_max)
    if top <= speed:  # too near to run up: the tip is still gaining speed where it should have it
        top = speed
    rise, fall = top / most, (top - speed) / most
    cruise = max((room - 0.5 * top * rise - 0.5 * (top + speed) * fall) / top, 0.0)
    rows = [(rise, 0.0, most), (cruise, top, 0.0), (fall, top, -most)]
    return np.array([row for row in rows if row[0] > 0.0])


def drawn_back_rows(limits: CenteringLimits) -> Floats:
    """Return the pause and the retreat of a tip that does not retract at once."""
    half = sqrt(_CLEAR / limits.acceleration_max)
    most = limits.acceleration_max
    return np.array([(_PAUSE, 0.0, 0.0), (half, 0.0, -most), (half, -most * half, most)])


def coasting_time(shape: str, push_speed: float, model: PushModel) -> float:
    """Return the longest time (s) in which a part still slides once the tip of a push (mm/s) turns back.

    An elastic contact throws it at up to twice the speed of the tip; a gentle push leaves it at the tip.
    """
    return 0.0 if shape == "gentle" else 2.0 * push_speed / (model.mu_kinetic * GRAVITY)


def approach_times(problem: CenteringProblem, kind: PushKind, place_sd: Floats, longest: float) -> Floats:
    """Return the times (s) from the start of a push to its touch, of parts whose place has a sd (mm).

    `longest`: a stroke long enough for the speed of the push, mm.
    """
    limits = problem.limits
    speed = float(kind.profile(problem.model, longest, limits.acceleration_max).velocity[0])
    need = run_up(kind.push_speed, limits)
    rooms = [waiting_room(need, float(sd), _MARGIN) for sd in place_sd]
    return np.array([approach_rows(room, speed, limits)[:, 0].sum() for room in rooms])


def times_after(problem: CenteringProblem, kind: PushKind) -> tuple[float, float, float, float]:
    """Return times from the turning point of the tip, s, and the time of the fewest readings.

    To the change of the table's speed, once the tip stands; to the first reading of a part at rest; to the
    first decision.
    """
    limits, sample = problem.limits, problem.limits.sample_time
    back = retraction(limits.acceleration_max) if kind.retract else drawn_back_rows(limits)
    done = float(back[:, 0].sum()) + _NEXT * sample
    rest = coasting_time(kind.shape, kind.push_speed, problem.model) + (1.0 + _NEXT) * sample
    return done, rest, done + sample, (FEWEST - 1) * sample
