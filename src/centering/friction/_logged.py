"""Pushes of a logged centering cycle in the form of the friction estimator: tip and rim from the samples."""

from collections.abc import Iterator
from math import cos, nan, sin
from typing import Any

import numpy as np

from centering._problem.model import PushModel
from centering._problem.problem import CenteringProblem
from centering.push._contact.trace import PushTrace
from centering.push._plan.touch import profile_of
from centering.push._profile.profile import TipProfile
from centering.push.turning._shooting import landing, ring_state
from centering.push.turning._table_profile import TableProfile, turning_profile
from centering.push.turning._table_trace import simulate_table_push
from sdpgrind import identify as idf
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Series

UNITS = {
    "angle": "rad",
    "slide": "mm",
    "peak_force": "N",
    "spindle_speed": "rad/s",
    "pushing": "",
    "offset_planned": "mm",
    "offset_angle_planned": "rad",
}
"""Columns of the log: readings of the machine and reports of the controller."""

_LEAST = 0.2  # mm, chosen: samples of a shorter push say too little about friction
_AFTER = 3  # chosen: samples after the profile that still belong to the push
_MOTION = ("angle", "slide", "spindle_speed")
_READ = ("peak_force", "free_slide", "final_position")
_TURN = 0.05  # rad, chosen: turn of the table per step of the search for first touch
_SHORTEST = 1e-6  # s, chosen: a shorter first segment is rounding
_ERROR = 1e-6  # mm, chosen: integration error of a step in the plane, below the errors of readings


def logged_pushes(log: Any, problem: CenteringProblem, part: int | None = None) -> list[dict[str, Any]]:
    """Return profile (`TableProfile`), peak force (N), way (mm) and blur of each push of 0.2 mm or more.

    `blur`: what samples leave open of peak force (N), free slide and way (mm): the difference of predictions
    by a smooth motion of the tip and by one at constant speed from sample to sample.

    A push of which a sample lacks angle, slide or speed tells nothing and is left out. `peak_force` is None
    where no sample has it.

    `log` holds the table "control" of a run with the columns of `UNITS`; `part` is needed for a log of
    several. Radius and model of the problem give the contact with the rim and the bend of the way.
    """
    found = idf.series(log, UNITS, tier="control", part=part)
    if len(found) != 1:
        raise ValueError(
            f"part must say which part (unit 1); data hold {', '.join(one.label for one in found) or 'none'}"
        )
    return list(_pushes(found[0], problem))


def _pushes(rows: Series, problem: CenteringProblem) -> Iterator[dict[str, Any]]:
    runs = rows["pushing"] > 0.5
    begins = np.flatnonzero(runs[1:] & ~runs[:-1])  # the last sample before each
    # The last before the next, which knows where this one led.
    until = np.append(begins[1:], runs.size - 1)
    until = until[: begins.size]
    for first, last in zip(begins.tolist(), until.tolist(), strict=True):
        still = np.flatnonzero(~runs[first + 1 : last + 1])
        end = min(first + int(still[0]) + 1 + _AFTER, last) if still.size else last
        before, after = (_center(rows, k) for k in (first, last))
        kept = slice(first, end + 1)
        if end > first + 2 and np.isfinite(before) and _whole(rows, kept):
            push = _push(rows, kept, before, problem)
            if push is not None and not abs(after - before) < _LEAST:
                share, peak = push.pop("share"), _peak(rows["peak_force"][first + 1 : end + 1])
                yield push | {"peak_force": peak, "final_position": abs(after - before) * share}


def _peak(forces: Floats) -> float | None:
    """Greatest force, N; None: not read."""
    read = forces[np.isfinite(forces)]
    return float(read.max()) if read.size else None


def _whole(rows: Series, kept: slice) -> bool:
    """Whether all samples of a push have angle, slide and speed."""
    return all(bool(np.isfinite(rows[name][kept]).all()) for name in _MOTION)


def _center(rows: Series, k: int) -> complex:
    """Centre on the table as reported by the controller, mm."""
    d, phi = rows["offset_planned"][k], rows["offset_angle_planned"][k]
    return complex(d * cos(phi), d * sin(phi)) if np.isfinite(d + phi) else complex(nan, nan)


def _push(rows: Series, kept: slice, before: complex, problem: CenteringProblem) -> dict[str, Any] | None:
    """Tip from first touch on, along the contact normal; way over distance; blur. None: no contact."""
    model, w = problem.model, float(rows["spindle_speed"][kept.start])
    samples = rows.time[kept] - rows.time[kept.start], -rows["slide"][kept]
    angle = rows["angle"][kept.start] - float(np.angle(before))
    met = _met(_smooth(*samples), angle, w, before, model)
    straight = _met(_straight(*samples), angle, w, before, model)
    if met is None or straight is None:
        return None
    (profile, turned, line, shown), (*_, other) = met, straight
    state = ring_state(abs(before), turned, model.part.radius, w)
    rest = landing(model, w, profile.segments, state, _ERROR)
    direct = abs(rest - abs(before) * np.exp(1j * turned))
    blur = np.abs([getattr(shown, name) - getattr(other, name) for name in _READ])
    return {"profile": line, "share": shown.final_position / direct if direct > 0.0 else 1.0, "blur": blur}


def _met(
    path: TipProfile, angle: float, w: float, before: complex, model: PushModel
) -> tuple[TipProfile, float, TableProfile, PushTrace] | None:
    """Tip from first touch on, angle then, tip along the contact normal, push; None: no contact."""
    touched = _touch(path, angle, w, abs(before), model.part.radius)
    if touched is None:
        return None
    profile, turned = profile_of(_from(path.segments, touched), 0.0), angle + w * touched
    line = turning_profile(profile, model, offset=abs(before), touch_angle=-turned, spindle_speed=w)
    return profile, turned, line, simulate_table_push(model, line)


def _smooth(time: Floats, position: Floats) -> TipProfile:
    """Motion through samples without jumps of speed: two constant accelerations between neighbours."""
    step, moved = np.diff(time), np.diff(position)
    speed = np.gradient(position, time)
    middle = 2.0 * moved / step - 0.5 * (speed[:-1] + speed[1:])
    starts = np.column_stack((speed[:-1], middle)).ravel()
    ends = np.column_stack((middle, speed[1:])).ravel()
    half = np.repeat(0.5 * step, 2)
    return TipProfile(half, starts, (ends - starts) / half, start=float(position[0]))


def _straight(time: Floats, position: Floats) -> TipProfile:
    """Motion through samples at constant speed between neighbours."""
    step = np.diff(time)
    return TipProfile(step, np.diff(position) / step, np.zeros(step.size), start=float(position[0]))


def _touch(path: TipProfile, angle: float, w: float, offset: float, radius: float) -> float | None:
    """Time at which the tip meets the rim, s from the beginning; None: never, or before."""
    time = np.linspace(0.0, path.total_time, 2 + int(path.total_time * max(abs(w) / _TURN, 2000.0)))
    turned = angle + w * time
    across = offset * np.sin(turned)
    gap = -path.position(time) - offset * np.cos(turned) - np.sqrt(radius**2 - across**2)
    met = np.flatnonzero(gap <= 0.0)
    if not met.size or met[0] == 0:
        return None
    k = int(met[0])
    return float(time[k - 1] + (time[k] - time[k - 1]) * gap[k - 1] / (gap[k - 1] - gap[k]))


def _from(segments: Floats, time: float) -> Floats:
    """Rows of a profile from a time on."""
    ends = np.cumsum(segments[:, 0])
    k = int(np.searchsorted(ends, time + _SHORTEST, side="right"))
    rows = segments[k:].copy()
    gone = segments[k, 0] - (ends[k] - time)
    rows[0] = ends[k] - time, segments[k, 1] + segments[k, 2] * gone, segments[k, 2]
    return rows
