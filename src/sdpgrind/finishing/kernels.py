"""Compiled steps of torque axis, controllers and table for compiled loops: plain arrays, in place, serial.

One tick of a loop is::

    shown = encoder_reading(axis_state[ANGLE], resolution)                             # rad
    current = controller_step(law, state, shown, path_time, time, torque, 0.0, 0.0)    # A
    override = feed_override(law, state)                            # 0.0 or 1.0, for the next tick
    x = table_step(loop, table_state, command)                      # mm, from its start
    contact_torque = axis_tick(axis_state, current, load_torque, surface, next_surface, axis)  # N m

`loop` is ``TableLoop.sampled(tick).parameters``, `axis` is `TorqueAxis.parameters`; `TorqueController.law`
holds `law`, `state`, `time` and `torque`. Each `state` is changed in place: hand over a copy.
`controller_step` runs `torque_at`, then `controller_sample`. The arrays are rows of `MOTOR` (state of the
axis) and `CONTROLLER`: in a kernel ``state.view(MOTOR)[0].angle`` is the angle (see `sdpgrind.base.states`).
Indices of the axis state: `ANGLE`, `SPEED`, `MEAN_TORQUE`; of a controller state: `CURRENT`, `ESTIMATE`,
`REFERENCE`, `COUNT`. Sizes of the states: `STATES`, `CONTROL`, and `TABLE` of the table.

Hidden physics of a simulated cell: `cell`, its compiled steps; `course_of` a motion; `CellTruth`,
`CellScatter`, `HeightField`; `check_pressed` refuses a tool that no torque presses. `worth_of` the placement
of a problem is the least margin of its joints; `check_options` refuses what no program has, `check_axes` a
robot whose work is carried by axes that the controller of a program lacks.
"""

from sdpgrind.base.states import places, width
from sdpgrind.finishing._plant import kernels as cell
from sdpgrind.finishing._plant.course import course_of, loop_of, standing
from sdpgrind.finishing._plant.height import HeightField
from sdpgrind.finishing._plant.part import cell_settings, forces_of, roughness_of
from sdpgrind.finishing._plant.truth import CellScatter, CellTruth
from sdpgrind.finishing._problem.place import worth_of
from sdpgrind.finishing._problem.problem import check_pressed
from sdpgrind.finishing._program.options import check_axes, check_options
from sdpgrind.finishing.timing._table_kernels import TABLE, table_step
from sdpgrind.finishing.torque._axis_kernels import axis_tick, encoder_reading
from sdpgrind.finishing.torque._controller_kernels import (
    controller_sample,
    controller_step,
    feed_override,
    torque_at,
)
from sdpgrind.finishing.torque._states import CONTROLLER, MOTOR

ANGLE, SPEED, MEAN_TORQUE = places(MOTOR, "angle", "speed", "mean_torque")
CURRENT, ESTIMATE, REFERENCE, COUNT = places(CONTROLLER, "current", "estimate", "reference", "count")
STATES, CONTROL = width(MOTOR), width(CONTROLLER)

__all__ = [
    "ANGLE",
    "CONTROL",
    "CONTROLLER",
    "COUNT",
    "CURRENT",
    "ESTIMATE",
    "MEAN_TORQUE",
    "MOTOR",
    "REFERENCE",
    "SPEED",
    "STATES",
    "TABLE",
    "CellScatter",
    "CellTruth",
    "HeightField",
    "axis_tick",
    "cell",
    "cell_settings",
    "check_axes",
    "check_options",
    "check_pressed",
    "controller_sample",
    "controller_step",
    "course_of",
    "encoder_reading",
    "feed_override",
    "forces_of",
    "loop_of",
    "roughness_of",
    "standing",
    "table_step",
    "torque_at",
    "worth_of",
]
