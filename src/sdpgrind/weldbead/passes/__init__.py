"""Pass planner: a depth asked for becomes a contour, a height and a force, along a measured bead: Brown (1988), chapter 6."""

from sdpgrind.weldbead.passes._collocation import Collocation, Freedom
from sdpgrind.weldbead.passes._contour import Contour, contour_shift, volume_between
from sdpgrind.weldbead.passes._disc import GrinderStalled, Linearized, TiltedDisc
from sdpgrind.weldbead.passes._plan import PassPlan, plan
from sdpgrind.weldbead.passes._problem import PassProblem
from sdpgrind.weldbead.passes._relaxation import RelaxedPass, relax
from sdpgrind.weldbead.passes._simulate import PassRecord, simulate

__all__ = [
    "Collocation",
    "Contour",
    "Freedom",
    "GrinderStalled",
    "Linearized",
    "PassPlan",
    "PassProblem",
    "PassRecord",
    "RelaxedPass",
    "TiltedDisc",
    "contour_shift",
    "plan",
    "relax",
    "simulate",
    "volume_between",
]
