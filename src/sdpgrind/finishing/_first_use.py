"""First use of the area, from which `sdpgrind.warm` compiles its kernels."""

from sdpgrind.finishing._problem.plan import plan
from sdpgrind.finishing._problem.presets import preset
from sdpgrind.finishing.arm._choice import choose
from sdpgrind.finishing.arm._robot_presets import robot
from sdpgrind.finishing.arm._spin_states import spins_of, states_of
from sdpgrind.finishing.arm._spin_sweep import swept


def first_use() -> None:
    """Plan a motion over a small flat surface; choose the branch of a serial robot, and turns of its tool."""
    plan(preset("specimen"))
    serial = robot("ur10")
    poses = serial.forward([[0.3, -1.5, 1.8, -1.8, -1.5, 0.1]] * 2)
    choose(serial, poses)
    swept(states_of(serial, spins_of(2)), poses)
