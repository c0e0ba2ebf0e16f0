"""First use of the area, from which `sdpgrind.warm` compiles its kernels."""

from sdpgrind.finishing._problem.plan import plan
from sdpgrind.finishing._problem.presets import preset


def first_use() -> None:
    """Plan a motion over a small flat surface."""
    plan(preset("specimen"))
