"""What a push that was sent shows of friction: force and travel, against those of other frictions."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
import numpy.typing as npt

from centering._problem.model import PushModel
from centering.cycle._control.launch import Approach, SentPush, felt_model, followed
from centering.cycle._control.push_force_kernels import force_sum
from centering.cycle._strategy.belief import PushEvidence
from centering.cycle._strategy.outcomes import FRICTION_SCALES
from centering.push.turning._plane_kernels import TIP
from centering.push.turning._shooting import ring_state
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

_EACH = 3  # chosen: scales between two simulated ones; travel and force are nearly straight between them
_UNLIKELY = 1e-6  # chosen: weight of a scale that no push makes likely again
_ERROR = 1e-5  # mm, chosen: of a step of a simulated push; far below the scatter of travels
_TRAVEL = 0.015  # measured: relative sd of the travel of 120 pushes; the direction of a push scatters
_FORCE = 0.05  # chosen: relative sd of the sum of forces, 2 % measured; the contact is not known exactly
_FELT = 5.0  # N, chosen: a smaller sum of forces is no contact, or there is no sensor


@dataclass(frozen=True)
class FeltPush(Frozen):
    """Push that was sent, with the forces of its samples.

    Parameters
    ----------
    push : SentPush
        The push.
    start : Approach
        Its start.
    model : PushModel
        Told model of the part.
    times, forces : sequence of float
        Times from the start, s, and forces of the samples, N.
    force_max : float
        End of the range of the force sensor, N.
    """

    push: SentPush
    start: Approach
    model: PushModel
    times: Sequence[float]
    forces: Sequence[float]
    force_max: float

    def evidence(self, weights: Floats, travelled: float, noise: float) -> PushEvidence:
        """Return expected and observed travel and force; `travelled` and its `noise` in mm.

        Scales without weight before the push get the values of their likely neighbours.
        """
        scales = self._likely(weights)
        models = [felt_model(self.model, float(FRICTION_SCALES[k])) for k in scales]
        travel = np.array([self._travel(model) for model in models])
        expected, seen, sd = [travel], [travelled], [hypot(noise, _TRAVEL * travelled)]
        total = float(np.nansum(self.forces))
        if total > _FELT:
            expected.append(np.array([self._force(model) for model in models]))
            seen.append(total)
            sd.append(_FORCE * total)
        everywhere = np.arange(FRICTION_SCALES.size)
        rows = np.array([np.interp(everywhere, scales, row) for row in expected])
        return PushEvidence(rows, np.array(sd), np.array(seen))

    @staticmethod
    def _likely(weights: Floats) -> npt.NDArray[np.int64]:
        """Scales to simulate: some between the lowest and the highest likely one."""
        likely = np.flatnonzero(weights > _UNLIKELY)
        count = max(2, 1 + (likely[-1] - likely[0]) // _EACH)
        return np.unique(np.linspace(likely[0], likely[-1], count).round().astype(np.int64))

    def _travel(self, model: PushModel) -> float:
        """Travel with a model, mm."""
        along, across = followed(self.push.rows, self.start, model, self.push.lead, _ERROR)
        return hypot(self.start.offset - along, across)

    def _force(self, model: PushModel) -> float:
        """Sum of the forces of the samples with a model, N."""
        start, radius = self.start, model.part.radius
        state = ring_state(start.offset, -self.push.lead, radius, start.spindle_speed)
        state[TIP] = radius + start.offset + start.room
        times = np.array(self.times)
        return float(
            force_sum(
                model.parameters,
                radius,
                start.spindle_speed,
                self.push.rows,
                times,
                _ERROR,
                self.force_max,
                state,
            )
        )
