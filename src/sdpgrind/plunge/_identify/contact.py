"""Contact zero and scale of the deflection: output error of the size of a part.

The model of the size is command plus contact zero less scale times deflection at the model's rate, 0 until
the wheel grinds, plus the offset of the gauge. The contact zero shows where the size begins to move, the
scale where the rate changes; so one part determines all three.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify import rounding
from sdpgrind.plunge._identify import time_constant as lag
from sdpgrind.plunge._identify.cycles import Cycle, concluded, fault, not_identified
from sdpgrind.plunge._identify.preference import preferred_law
from sdpgrind.plunge._identify.time_constant import FAINT
from sdpgrind.plunge._model.model import PlungeModel
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._model.time_constants import of_deflection
from sdpgrind.plunge._plan.replay_kernels import deflections

CONTACT, RATIO, TAU = ("contact_zero", "mm"), ("normal_force_ratio", "1"), ("time_constant", "s")
SCALES = (0.1, 10.0)  # chosen: range of the deflection relative to the model
_MISFIT = (
    "a linear lag fits the sizes better than the deflection of the model, on which this rests; without a"
    " problem, 'time_constant' is that of the linear lag"
)
_FIRST = 3  # chosen: readings of the first guess of the offset; of more the part has moved
_KEPT = 2  # derived: a fit asks for sizes, and for slopes there or at the values before
_STEPS = 2  # measured: Runge-Kutta steps per sample, error of the cycle time 1e-9 s


class ContactCourse(NamedTuple):
    """Size (mm) and infeed rate (mm/s) of the model at each reading.

    `by_contact` (unit 1) and `by_scale` (mm): derivatives of the size.
    """

    size: Floats
    infeed_rate: Floats
    by_contact: Floats
    by_scale: Floats


def course(cycle: Cycle, model: PlungeModel, contact_zero: float = 0.0, scale: float = 1.0) -> ContactCourse:
    """Run the model on the command, with `scale` times its deflection."""
    core = model.core
    core = core._replace(K0=scale * core.K0, K1=scale * core.K1, K2=scale * core.K2)
    first = contact_zero - core.K0
    y, rate, by_first, by_log = deflections(first, cycle.command_rate, cycle.step, _STEPS, core).T
    return ContactCourse(cycle.infeed + first - y, rate, 1.0 - by_first, -(core.K0 + by_log) / scale)


def fitted(cycle: Cycle, model: PlungeModel) -> idf.Estimate:
    """Contact zero (mm), scale of the deflection and offset of the gauge (mm), by least squares of the size.

    The first two are those of `course`. The offset is a value of its own, as a gauge may begin anywhere.
    """
    reach, begin = float(cycle.infeed[-1]), float(np.mean(cycle.size[cycle.read][:_FIRST]))

    @lru_cache(maxsize=_KEPT)
    def at(zero: float, scale: float) -> ContactCourse:
        return course(cycle, model, zero, scale)

    def slopes(values: Floats) -> Floats:
        found = at(values[0], values[1])
        each = [found.by_contact, found.by_scale, np.ones(cycle.time.size)]
        return np.asarray(-np.column_stack(each)[cycle.read])

    fit = idf.output_error(
        lambda values: _left(cycle, at(values[0], values[1]).size, values[2]),
        [0.0, 1.0, begin],
        scale=[1e-2, 0.1, 1e-3],
        low=[-reach, SCALES[0], -np.inf],
        high=[reach, SCALES[1], np.inf],
        jacobian=slopes,
        throw=False,
    )
    told = rounding.widened(fit, cycle, lambda values: residual(cycle, model, values))
    return told.replace(names=("contact_zero", "scale", "offset"), units=("mm", "1", "mm"))


def residual(cycle: Cycle, model: PlungeModel, values: Floats) -> Floats:
    """Sizes read (mm) less those of the model, for values as in `fitted`."""
    zero, scale, offset = values
    return _left(cycle, course(cycle, model, zero, scale).size, offset)


def _left(cycle: Cycle, size: Floats, offset: float) -> Floats:
    return np.asarray((cycle.size - size)[cycle.read] - offset)


def contact_zero(cycle: Cycle, problem: CycleProblem) -> idf.Estimate:
    """Command lacking at contact, mm; negative: contact after the command is 0."""
    return _value_of_fit(cycle, problem, 0, CONTACT, 1.0)


def normal_force_ratio(cycle: Cycle, problem: CycleProblem) -> idf.Estimate:
    """Force ratio of the model times the scale of its deflection."""
    return _value_of_fit(cycle, problem, 1, RATIO, problem.model.normal_force_ratio)


def secant(cycle: Cycle, problem: CycleProblem) -> idf.Estimate:
    """Time constant of spark-out, s: that of the model times the scale of its deflection."""
    return _value_of_fit(cycle, problem, 1, TAU, of_deflection(problem))


def _value_of_fit(
    cycle: Cycle, problem: CycleProblem, which: int, name: tuple[str, str], times: float
) -> idf.Estimate:
    """Value number `which` of `fitted`, times a constant."""
    if reason := fault(cycle):
        return not_identified(*name, reason)
    fit = fitted(cycle, problem.model)
    scale, sd = fit["scale"], fit.sd[1]
    inside = sd < scale and SCALES[0] * 1.001 < scale < SCALES[1] / 1.001
    status = fit.status if inside else idf.Status.NOT_IDENTIFIED
    only = slice(which, which + 1)
    found = idf.Estimate(
        name[:1],
        times * fit.value[only],
        times**2 * fit.covariance[only, only],
        status,
        units=name[1:],
        freedom=fit.freedom,
    )
    told = concluded(found, FAINT) if which == 1 else _reached(found, float(cycle.infeed[-1]))
    return told.replace(message=_MISFIT) if told.ok and _linear(cycle, problem.model, fit) else told


def _linear(cycle: Cycle, model: PlungeModel, fit: idf.Estimate) -> bool:
    """Whether a linear lag fits the sizes better than the deflection of the model, beyond chance."""
    if model.linear_time_constant is not None:
        return False
    straight, time = lag.fitted(cycle), cycle.time[cycle.read]
    rho = min(fit, straight, key=lambda each: each.noise_sd).noise_correlation
    left = {
        "model": [residual(cycle, model, fit.value)],
        "linear": [lag.residual(cycle, straight.value)],
    }
    found = preferred_law(left, [cycle.size[cycle.read]], [time], rho, fit.value.size)
    return found.preferred == "linear"


def _reached(zero: idf.Estimate, infeed: float) -> idf.Estimate:
    """Estimate of the contact zero; failed where its interval leaves the commanded infeed, mm."""
    if zero.ok and np.all(np.abs(zero.interval()[0]) < infeed):
        return zero
    return not_identified(*CONTACT, FAINT)
