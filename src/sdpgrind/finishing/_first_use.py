"""First use of the area, from which `sdpgrind.warm` compiles its kernels."""

from sdpgrind.finishing._problem.plan import plan
from sdpgrind.finishing._problem.presets import preset
from sdpgrind.finishing.arm._choice import choose
from sdpgrind.finishing.arm._robot_presets import robot


def first_use() -> None:
    """Plan a motion over a small flat surface; choose the branch of a serial robot."""
    plan(preset("specimen"))
    serial = robot("ur10")
    choose(serial, serial.forward([[0.3, -1.5, 1.8, -1.8, -1.5, 0.1]] * 2))
