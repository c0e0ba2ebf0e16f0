"""First use of a locus, which `sdpgrind.warm` compiles."""

from sdpgrind.locus._control.controller import LocusController
from sdpgrind.locus._curve.plan import plan
from sdpgrind.locus.processes._presets import preset


def first_use() -> None:
    """Trace a locus and control one sample."""
    controller = LocusController(plan(preset("koren-example")), along="v", gain=0.6, x=(0.76, 1.72))
    controller.step(response=11.3)
