"""First use of plunge: the kernels that `sdpgrind.warm` compiles."""

from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.presets import preset
from sdpgrind.plunge._plan.plan import plan


def first_use() -> None:
    """Plan a cycle and step its controller."""
    controller = CycleController(plan(preset("simulation")).problem)
    for size in (0.0, 0.001, 0.003):  # mm
        controller.step(size=size, grinding_power=100.0)
