"""Recipe of a streaming estimator: one reading, its settings, and readings for the self-test."""

import math
from dataclasses import dataclass

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.update_kernels import exported_step
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Signal

_OUTPUTS = {
    "radius": Signal("mm", "radius of the ring, without the probe's tip"),
    "center_x": Signal("mm", "centre of the ring from the spindle's axis, along angle 0"),
    "center_y": Signal("mm", "centre of the ring from the spindle's axis, along an angle of a quarter turn"),
    "valid": Signal("", "1 where the centre is certain enough, else 0"),
    "band": Signal("mm", "greatest error of the centre at the confidence that was asked; infinite while"
                   " readings are few"),
    "restarts": Signal("", "moves of the part that were found since the last reset; each restarts the"
                       " estimate"),
}  # fmt: skip
_STATUS = (
    "taken",
    "refused: an outlier",
    "taken, the last of the start",
    "moved: most refused",
    "moved: a shift",
)
_PLACES = ("seen", "used", "covered", "index", "prior_radius", "prior_sd")
_ANGLE_MAX, _READING_MAX = 1e6, 1e5  # chosen: rad, mm; 160 000 turns; no ring is as wide
_LENGTH = 80  # chosen: readings of a chain of the self-test
_LENGTHS = {"shifted": 400, "crawl": 400, "short": 150, "eased": 150}  # a shift is told from form after 240
_RADIUS = 60.0  # chosen: mm, of the rings of the self-test
_FAULTS = (
    "none", "dust", "moved", "slow", "shifted", "back", "burr", "coarse", "degrees", "short", "crawl",
    "eased", "beside",
)  # fmt: skip


def recipe_of(state: Floats) -> Recipe:
    """Return the recipe of an estimator in this state, before its first reading (rad, mm)."""
    limacon = bool(state[at.LIMACON])
    return Recipe(
        "estimator",
        exported_step,
        _inputs(limacon),
        _OUTPUTS,
        state=state,
        settings=tuple(range(at.SETTINGS)),
        status=_STATUS,
        places={name: getattr(at, name.upper()) for name in _PLACES},
        equations="least squares of the exact curve of an offset circle; certainty: see centering.circle",
        vectors=_Rings(limacon).chains,
        kind="GeometryEstimator",
    )


def _inputs(limacon: bool) -> dict[str, Signal]:
    """Return angle (rad) and reading (mm), of a ring about the axis or of the limacon."""
    angle = (
        "angle of the spindle in the order of time, in either sense, whole turns counted or not;"
        " refused (-1): a jump of more than a turn, and what follows a dozen even steps of more than"
        " 0.75 rad (degrees?)"
    )
    reading = "radial position of the probe, > 0 away from the spindle's axis"
    reading += "" if limacon else "; 0 is refused (-1)"
    least = -_READING_MAX if limacon else 0.0
    return {
        "angle": Signal("rad", angle, -_ANGLE_MAX, _ANGLE_MAX, spread=0.02),
        "reading": Signal("mm", reading, least, _READING_MAX, spread=0.004),
    }


@dataclass(frozen=True)
class _Rings:
    """Readings of offset rings: noise, dust, moves of the part, a spindle that rests or turns back."""

    limacon: bool

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` readings (rad, mm) in chains, each fault once at least."""
        found: list[Floats] = []
        while len(found) < len(_FAULTS) or sum(map(len, found)) < count:
            fault = _FAULTS[len(found) % len(_FAULTS)]
            found.append(self._ring(rng, fault, _LENGTHS.get(fault, _LENGTH)))
        return found

    def _ring(self, rng: np.random.Generator, fault: str, length: int) -> Floats:
        usual = rng.choice([0.02, 0.1, 0.3])
        step = {"slow": 0.0, "coarse": 0.7, "degrees": 1.5, "short": 0.002, "crawl": 0.01}.get(fault, usual)
        steps = np.full(length, step)
        if fault == "slow":
            steps[length // 4 :] = 0.05
        if fault == "back":
            steps[length // 2 :] *= -1.0
        angle = rng.uniform(0.0, 6.0) + np.cumsum(steps)
        offset, phase = np.full(length, rng.uniform(0.01, 0.3) * _RADIUS), rng.uniform(0.0, 2.0 * math.pi)
        if fault == "moved":
            offset[length // 2 :] *= 0.5
        if fault in ("short", "crawl"):
            offset[2 * length // 3 :] += 0.3
        if fault == "eased":
            offset[70:] += 0.0004 * np.arange(length - 70)
        if fault == "beside":
            offset[:] = 0.999 * _RADIUS
        if fault == "shifted":  # less than an outlier, after more than a turn
            angle, offset[340:] = angle[0] + 0.3 * np.arange(length), offset[340:] + 0.006
        reading = self._curve(angle - phase, offset) + rng.normal(0.0, 0.002, length)
        if fault in ("dust", "burr"):
            wrong = rng.random(length) < (0.1 if fault == "dust" else 0.4)
            reading[wrong] += rng.uniform(0.1, 2.0, int(wrong.sum()))
        return np.column_stack([angle, reading])

    def _curve(self, angle: Floats, offset: Floats) -> Floats:
        along = offset * np.cos(angle)
        if self.limacon:
            return along
        found: Floats = along + np.sqrt(_RADIUS**2 - (offset * np.sin(angle)) ** 2)
        return found
