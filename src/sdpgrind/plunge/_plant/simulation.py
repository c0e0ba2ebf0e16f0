"""Part simulated with the controller's own model, without a plant."""

from math import ceil

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.states import named
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import start_control
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plant import part_kernels as kernels

_SPARE = 1000  # chosen: samples beyond those that the whole stock takes at the slowest rate


def simulated_part(
    problem: CycleProblem, law: Floats, *, rng: np.random.Generator | None = None, contact: float = 0.0
) -> tuple[Floats, dict[str, Floats]]:
    """Return the final state of a part and its table by the column names of a log.

    With `rng` the gauges have the noise assumed by the controller, and the wheel touches `contact` (mm) late.
    """
    slowest = min(problem.final_rate, problem.command_rate_max, problem.model.burn_rate)
    rows = ceil(problem.stock / slowest / problem.sample_time) + _SPARE
    exact = kernels.rig(problem.model, problem.stock, problem.sample_time, rows - 1)
    rig = kernels.driven(exact, problem.drive)._replace(contact_zero=contact)
    normals = np.zeros((rows, 2))
    if rng is not None:
        gauges = named(law, at.LAW)
        rig = rig._replace(size_sd=gauges.size_sd, power_sd=gauges.power_sd)
        normals = rng.standard_normal((rows, 2))
    state, control = kernels.part_state(rig), np.zeros(at.STATES)
    kernels.start_part(state, rig)
    start_control(control, law)
    table = np.empty((rows, len(kernels.ROW)))
    done = abs(kernels.grind(state, rig, control, law, normals, table, 0))
    return state, dict(zip(_NAMES, table[:done].T, strict=True))


def _name(column: str) -> str:
    """Name of a column in a log."""
    if column in kernels.PLANNED:
        return f"{column}_planned"
    return f"{column}_command" if column in ("command_rate", "balancing") else column


_NAMES = tuple(map(_name, kernels.ROW))
