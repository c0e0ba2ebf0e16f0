"""Forward model of commissioning: recorded commands of a part to its sizes and powers, for trial values."""

from math import ceil
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._identify.machine_kernels import respond
from sdpgrind.plunge._model.drive import Drive
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plant.part_kernels import PartRig, rig

RATIO, AREA, ENERGY, PLOUGHING, IDLE, WEAR, FEED_LAG, POWER_LAG, SHARED = range(9)
"""Places of the values that parts share."""
CONTACT, OFFSET = SHARED, SHARED + 1
"""Places of those of a part: contact zero and offset of the gauge, mm."""
VALUES = SHARED + 2
_FINEST = 0.02  # measured: s; Runge-Kutta steps of 0.02 s end a cycle within 1e-9 s
_TOGETHER = 1e-9  # chosen: s; a command that acts so close to a row acts at it


class Timeline(NamedTuple):
    """Commands as they act: durations (s), rates (mm/s), steps of integration, whether a reading follows."""

    duration: Floats
    command: Floats
    steps: npt.NDArray[np.int64]
    shown: npt.NDArray[np.int64]


def timeline(cycle: Cycle, drive: Drive, sample_time: float) -> Timeline:
    """Return the commands of a part after the steps and the dead time of the feed drive."""
    late = cycle.time + drive.delay_samples(sample_time) * sample_time
    rows = np.searchsorted(cycle.time, late - _TOGETHER)  # the first row that is not before
    inside = rows < cycle.time.size
    apart = inside & (np.abs(cycle.time[np.minimum(rows, cycle.time.size - 1)] - late) > _TOGETHER)
    ends = np.concatenate([cycle.time, late[apart]])
    order = np.argsort(ends, kind="stable")
    ends, shown = ends[order], (order < cycle.time.size).astype(np.int64)
    acting = np.searchsorted(late, ends[:-1] + _TOGETHER, side="right") - 1
    rate = _stepped(cycle, drive.command_quantum)
    command = np.where(acting >= 0, rate[np.maximum(acting, 0)], 0.0)
    duration = np.diff(ends)
    steps = np.array([max(1, ceil(each / _FINEST - _TOGETHER)) for each in duration.tolist()])
    return Timeline(duration, command, steps, shown[1:])


def _stepped(cycle: Cycle, quantum: float) -> Floats:
    """Command rates (mm/s) in whole steps of the drive (mm), with the remainder kept."""
    if quantum <= 0.0:
        return cycle.command_rate
    fed = np.rint(cycle.infeed / quantum) * quantum
    return np.concatenate([np.diff(fed) / cycle.step, [0.0]])


class MachineModel:
    """Sizes and powers of parts of a problem's machine, by trial values.

    The values stand at the places of this module: force ratio (linear time constant, s, of a model that has
    one), wear flat area, specific energy (J/mm^3), ploughing force (N/mm), idle power (W), wheel wear, lags
    of feed drive and power monitor (s), contact zero and offset of the gauge (mm).
    """

    def __init__(self, problem: CycleProblem) -> None:
        model = self._model = problem.model
        self.is_linear = model.linear_time_constant is not None
        core, power = model.core, model.power
        heat = model.wheel_speed / N_MM_S_PER_W
        # derived: the power is linear in ploughing force, specific energy and wear flat area
        self._ploughing = heat * model.width
        self._chips = core.power1 / power.specific_energy
        self._sliding = core.power2 / model.wear_flat_area
        self._compliance = 1.0 / (heat * model.stiffness)
        self._rig = rig(model, 0.0, problem.sample_time)

    def believed(self, drive: Drive) -> Floats:
        """Return the values of the problem."""
        model, power = self._model, self._model.power
        first = model.linear_time_constant if self.is_linear else model.normal_force_ratio
        return np.array(
            [
                first, model.wear_flat_area, power.specific_energy, power.ploughing_force, drive.idle_power,
                model.wheel_wear, drive.feed_lag, drive.power_lag, 0.0, 0.0,
            ]
        )  # fmt: skip

    def at_contact(self, values: Floats) -> float:
        """Return the power (W) of a wheel that rubs without cutting: idle power and that of ploughing."""
        return float(values[IDLE] + self._ploughing * values[PLOUGHING])

    def pressed(self, power: float, values: Floats) -> float:
        """Return the deflection (mm) at which a wheel that does not cut takes a power (W)."""
        return 0.0 if self.is_linear else float(power * values[RATIO] * self._compliance)

    def response(self, line: Timeline, values: Floats) -> Floats:
        """Return sizes (mm) and powers (W) at the readings, (n, 2)."""
        out = np.asarray(respond(self._with(values), float(values[POWER_LAG]), *line))
        return out + values[[OFFSET, IDLE]]

    def _with(self, values: Floats) -> PartRig:
        given = [float(value) for value in values]
        powers = (
            self._ploughing * given[PLOUGHING],
            self._chips * given[ENERGY],
            self._sliding * given[AREA],
        )
        deflections = (0.0, given[RATIO], 0.0)
        if not self.is_linear:
            scale = given[RATIO] * self._compliance
            deflections = (scale * powers[0], scale * powers[1], scale * powers[2])
        core = self._rig.core._replace(**dict(zip(_CORE, (*deflections, *powers), strict=True)))
        wear = self._model.wear
        return self._rig._replace(
            core=core,
            growth=0.0 if wear is None else wear.growth / given[AREA],
            contact_zero=-given[CONTACT],
            feed_lag=given[FEED_LAG],
            wheel_wear=given[WEAR],
        )


_CORE = ("K0", "K1", "K2", "power0", "power1", "power2")
