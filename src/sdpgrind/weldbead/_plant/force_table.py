"""A bead during its passes on the force table: disc, grinder, motor, table and force sensors."""

from dataclasses import dataclass
from math import floor, inf, sqrt
from typing import Any, ClassVar

import numpy as np

from sdpgrind.base.controllers import Stateful
from sdpgrind.base.states import flat
from sdpgrind.weldbead._plant import force_table_kernels as kernels
from sdpgrind.weldbead._plant.force_table_bead import GroundBead, drop, reach
from sdpgrind.weldbead._plant.force_table_kernels import Grinder, TableLayout
from sdpgrind.weldbead._plant.force_table_truth import Motor
from sdpgrind.weldbead.passes import TiltedDisc
from sdpgrind.weldbead.passes import kernels as cutting

SUB_STEPS = 56  # of table and sensors in a sample; derived: a multiple of the 8 inside the sensor
# grinding sub-steps of a sample; chosen: with inertia the grinder rings at 50 Hz
_GRINDING, _BOUNCING = 14, 56
_DAMPING = 0.05  # damping ratio of the grinder on its compliance; chosen: at 0 it rings on
IDLE, LEAD_IN, ON_BEAD, LEAD_OUT, RESET = range(5)


@dataclass
class GroundPass:
    """Truth of one pass."""

    disc: TiltedDisc
    volume: float = 0.0  # mm^3
    force: float = 0.0  # sum of the mean forces of samples on the bead, N
    samples: int = 0
    over: float = 0.0  # time beyond the burn limit, s


class BeadOnTable(Stateful):
    """State of a bead and of the machine around it; `stand` has the fields of `hwsim.ForceTableStand`."""

    _changing: ClassVar[tuple[str, ...]] = (
        "z",
        "state",
        "drive",
        "passes",
        "_cut",
        "_sensors",
        "_queue",
        "_metal",
    )

    def __init__(self, stand: Any, bead: GroundBead, disc: TiltedDisc, spin_angle: float) -> None:
        self._stand, self._bead, self._disc, self.z = stand, bead, disc, bead.z.copy()
        self._ends = float(bead.x[0]), float(bead.x[-1])
        grinding = _BOUNCING if stand.grinder_inertia > 0 else _GRINDING
        step = stand.tick / SUB_STEPS
        drive_core, self._sensor_core = stand.drive.core(step), stand.sensor.core(step)
        self._layout = TableLayout(grinding, SUB_STEPS // grinding, stand.datum, disc.contact_stiffness)
        self._machine_row = flat(*self._layout, *drive_core, *self._sensor_core)
        self.state, self._cut = np.zeros(kernels.STATES), np.zeros(cutting.STATES)
        self.state[kernels.PHASE], self.state[kernels.SPIN] = spin_angle, self.free_speed
        self.state[kernels.CENTER] = stand.start_x
        self.drive = stand.drive.start(self.drawn_back())
        self._sensors = np.zeros((2, stand.sensor.start().size))
        self.passes: list[GroundPass] = []
        self.phase, self.stalls, self.lead_samples, self.feed = IDLE, 0, 0, 0.0

    @property
    def free_speed(self) -> float:
        """Speed of the disc without load, rad/s."""
        motor = self._stand.motor
        return float(self._disc.model.free_speed if motor is None else motor.free_speed)

    def drawn_back(self) -> float:
        """Platform position with the disc clear of the bead, mm."""
        return float(self._stand.datum - self.z.max() - drop(self._disc) - self._stand.clearance)

    def begin(self, disc: TiltedDisc, start: float, feed: float) -> None:
        """Begin a pass with a disc at `start` (mm) and a feed (mm/s); spin angle, spin and wear are kept."""
        stand, back = self._stand, self.drawn_back()
        self.passes.append(GroundPass(disc))
        self._metal = self._bead.metal(self.z, disc.model.bead_width)
        self._grinder = self._grinder_core(disc)
        metal = self._metal
        self._ground_row = flat(metal.start, metal.spacing, *self._grinder, *self._disc_core(disc))
        self.drive[:] = stand.drive.start(back)
        self._sensors[:] = stand.sensor.start()
        self._queue, self._last_command = [back] * stand.delay_samples, back
        kept, worn = self.state[[kernels.PHASE, kernels.SPIN]], self._cut[cutting.WEAR]
        self.state[:], self._cut[:] = 0.0, 0.0
        self.state[[kernels.PHASE, kernels.SPIN]], self._cut[cutting.WEAR] = kept, worn
        self.state[kernels.CENTER] = start
        self._cut[cutting.TIP_X] = start - reach(disc)
        self._cut[cutting.TIP_Z] = stand.datum - back - drop(disc)
        limit = stand.problem.burn_limit or stand.charges.burn_limit
        self._burning = inf if limit is None else float(limit.interval(disc.model, feed)[1])  # N
        self.phase, self.feed = LEAD_IN, feed

    def _grinder_core(self, disc: TiltedDisc) -> Grinder:
        stand, motor, model = self._stand, self._stand.motor, disc.model
        inertia, stiffness = stand.grinder_inertia, disc.rotational_stiffness or 0.0
        motor = Motor(model.free_speed, model.speed_droop, spin_time=0.0) if motor is None else motor
        damping = 2 * _DAMPING * sqrt(inertia * stiffness)
        return Grinder(
            *(stand.tick / self._layout.grinding, disc.relaxed_angle, stiffness, inertia, damping),
            *(motor.free_speed, motor.speed_droop, motor.spin_time, stand.runout),
            reads_spring=stand.spring_first,
        )

    def _disc_core(self, disc: TiltedDisc) -> cutting.CutCore:
        """Core of the disc; inertia adds the stiffness that turns the grinder in one sub-step."""
        core = disc.core
        core = core._replace(
            angles=np.ascontiguousarray(core.angles), torques=np.ascontiguousarray(core.torques)
        )
        if self._grinder.inertia == 0.0:
            return core
        slope, _ = kernels.inertial(self._grinder, np.zeros(kernels.STATES))
        return core._replace(torques=np.array([0.0, self._grinder.stiffness + slope]))

    def advance(self, command: float) -> None:
        """Advance by one control sample with a platform command, mm."""
        state, done = self.state, self.passes[-1]
        kernels.sample(
            *(self._metal.z, self._metal.area, self._metal.top, self._machine_row, self._ground_row),
            *(self._cut, state, self.drive, self._sensors, self.feed, self._applied(command)),
        )
        if self.phase == ON_BEAD:
            done.samples += 1
            done.force += float(state[kernels.FORCE_SUM])
        else:
            self.lead_samples += 1
        if state[kernels.FORCE_SUM] > self._burning:
            done.over += self._stand.tick

    def _applied(self, command: float) -> float:
        """Command after the delay, limited by the guard against a stall."""
        self._queue.append(command)
        command = self._queue.pop(0)
        motor = self._stand.motor
        if motor is not None and self.state[kernels.SPIN] < motor.guard * motor.free_speed:
            command = min(command, self._last_command)
        self._last_command = command
        return command

    def read(self, normal: float, tangential: float) -> tuple[float, float]:
        """Readings of both force sensors with their noise, N."""
        core = self._sensor_core
        force, friction = self._sensors[:, core.output.size + 3].tolist()
        return _quantised(force + normal, core.quantum), _quantised(friction + tangential, core.quantum)

    def go_on(self) -> None:
        """Go on to the next phase; a stalled or overloaded grinder is drawn back at once."""
        (begin, end), tip, stand = self._ends, self._cut.item(cutting.TIP_X), self._stand
        motor = stand.motor
        stalled = 0.0 if motor is None else motor.stall * motor.free_speed
        if self.state.item(kernels.SPIN) <= stalled or self.state.item(kernels.FORCE) > stand.overload:
            self.stalls += 1
            self._end()
        elif tip > end + stand.lead_out:
            self._end()
        else:
            self.phase = LEAD_IN if tip < begin else ON_BEAD if tip <= end else LEAD_OUT

    def _end(self) -> None:
        self.passes[-1].volume = float(self.state[kernels.REMOVED])
        self.phase = RESET
        self.state[kernels.SPIN] = self.free_speed


def _quantised(value: float, quantum: float) -> float:
    """Value in whole quanta, N, as `sensor_read` gives it; calls of that kernel take ten times as long."""
    return float(quantum * floor(value / quantum + 0.5)) if quantum > 0 else value
