"""Many runs of a controller on the model, by the compiled kernels of `step`."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._control.walking import Walking
from sdpgrind.locus._path import law_kernels as core
from sdpgrind.locus._path.inverse import balanced, hidden_of


@dataclass(frozen=True)
class LoopRecord:
    """Result of a controller on the model, sample by sample.

    Attributes
    ----------
    coordinate : array, (..., steps)
        Coordinate of each reading, in its unit.
    hidden : array, (..., steps)
        Hidden state at each reading, in its unit.
    limit, response : array, (..., steps)
        P_b and the true P_c at each reading, in their unit.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import locus
    >>> curve = locus.plan(locus.preset("koren-example"))
    >>> controller = locus.LocusController(curve, along="v", gain=0.6, x=(0.76, 1.72), start=44 / 401)
    >>> record = controller.simulate(np.full(6, 1.0))
    >>> record.coordinate.round(4).tolist(), float(record.worst_violation)  # Koren's run, without units
    ([0.1097, 1.3606, 2.4299, 2.8886, 2.9866, 2.9986], 0.0)
    """

    coordinate: Floats
    hidden: Floats
    limit: Floats
    response: Floats

    @property
    def slack(self) -> Floats:
        """Limit less response (..., steps), in their unit; negative where the limit is violated."""
        return np.asarray(self.limit - self.response)

    @property
    def worst_violation(self) -> Floats:
        """Greatest response - limit of each run (...,), in their unit; 0 without violation."""
        return np.asarray(np.maximum(-self.slack.min(axis=-1), 0.0))


def simulate(controller: Walking, hidden: Any, noise: Any) -> LoopRecord:
    stretch, law = controller.stretch, controller.law
    name = stretch.hidden_name
    given = checks.finite_array(name, hidden, stretch.units.get(name, ""))
    if given.ndim == 0 or given.size == 0:
        raise checks.refuse(name, "of shape (..., steps), one step at least", given.shape)
    added = np.broadcast_to(checks.finite_array("noise", noise), given.shape).reshape(-1, given.shape[-1])
    states = np.ascontiguousarray(given.reshape(-1, given.shape[-1]).T)  # sample by sample, as they are used
    (steps, runs), n = states.shape, len(stretch.names)
    inner = np.zeros((runs, core.STATES))
    inner[:, core.PLACE] = inner[:, core.ACTUAL] = controller.start_place
    believed: Floats | None = None
    out = np.empty((3, *states.shape))
    for i in range(steps):
        rows = stretch.rows(inner[:, core.PLACE])
        response, limit = stretch.values(rows[:, :n], states[i])
        out[0, i], out[1, i], out[2, i] = inner[:, core.PLACE], limit, response
        reading = response + added[:, i]
        if controller.method == "inversion":
            found = hidden_of(stretch.values, rows[:, :n], reading, stretch.x)
            believed = found if believed is None else believed + controller.filter * (found - believed)
            inner[:, core.PLACE] = np.clip(balanced(stretch, believed, controller.margin), law.low, law.high)
        else:
            core.advance_many(inner, law, rows[:, n + 1] - controller.margin - reading)
    places, limits, responses = (column.T.reshape(given.shape) for column in out)
    return LoopRecord(places, given, limits, responses)
