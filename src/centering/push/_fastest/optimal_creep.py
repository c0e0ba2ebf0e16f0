"""Creeping on after a push: one last small jump, after which parts of different friction lie closer together.

Parts that come to rest in contact are apart by what their contacts are closed by: they differ like F_k/k. When the tip goes on
slowly each sticks until F_s and jumps; then the contact is closed by about (2 F_k - F_s)/k, and that differs less.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from centering.push._contact.reaction import simulate_pushes
from centering.push._machine.model import PushModel
from centering.push._profile.profile import TipProfile
from sdpgrind.base.checks import Floats

_SPEEDS = np.geomspace(0.25, 4.0, 13)  # of (F_s - F_k)/sqrt(k M): the speed of a jump
_LENGTHS = np.linspace(0.5, 3.0, 41)  # of F_s/k: what the contact closes by until the part breaks away
_LEAST = 1e-9  # s
_SHARE = 0.97  # of the stop error that may be used up: the push before it will be another by a hair


class Creep(NamedTuple):
    """A slow end of a push: rows of its profile (s, mm/s, mm/s^2), its time (s), where it leaves the middle of the parts (mm)."""

    rows: Floats
    time: float
    middle: float


def creeps(
    models: Sequence[PushModel], before: TipProfile, after: Floats, error: float, acceleration: float
) -> tuple[Creep, ...]:
    """Slow ends that bring all parts within an error (mm) of one place, by time; `after` are the rows that draw the tip back."""
    possible = [(rows, float(rows[:, 0].sum())) for rows in _possible(models[-1], acceleration)]
    profiles = [TipProfile(*np.vstack((before.segments, rows, after)).T) for rows, _ in possible]
    ends = np.array([simulate_pushes(model, profiles)[:, 0] for model in models])
    middle, reach = 0.5 * (ends.max(axis=0) + ends.min(axis=0)), 0.5 * np.ptp(ends, axis=0)
    near = [Creep(*each, float(place)) for each, place, far in zip(possible, middle, reach, strict=True) if far <= _SHARE * error]
    return tuple(sorted(near, key=lambda creep: creep.time))


def _possible(model: PushModel, acceleration: float) -> list[Floats]:
    """Rows from rest to rest, of several speeds and lengths."""
    jump = (model.breakaway_force - model.coulomb_force) / sqrt(model.contact_stiffness * model.inertia)
    closing = model.breakaway_force / model.contact_stiffness
    moves = [TipProfile.move(share * closing, part * jump, acceleration) for part in _SPEEDS for share in _LENGTHS]
    return [move.segments[move.duration > _LEAST] for move in moves]
