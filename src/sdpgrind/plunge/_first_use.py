"""First use of plunge: the kernels that `sdpgrind.warm` compiles."""

import numpy as np

from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.presets import preset
from sdpgrind.plunge._plan.plan import plan
from sdpgrind.plunge.learning._replay import replayed


def first_use() -> None:
    """Plan a cycle, step its controller, replay a part."""
    problem = plan(preset("simulation")).problem
    controller = CycleController(problem)
    for size in (0.0, 0.001, 0.003):  # mm
        controller.step(size=size, grinding_power=100.0)
    time = 0.05 * np.arange(40)  # s
    ground = {"time": time, "size": 0.01 * time, "command_rate": np.full(40, 0.01)}
    replayed(ground | {"grinding_power": np.full(40, 100.0)}, problem)
