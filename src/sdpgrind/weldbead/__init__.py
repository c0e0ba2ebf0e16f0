"""Weld-bead grinding: stochastic dynamic programming of a grinding sequence (Brown 1988).

Given a bead of mean height x and the time left to a deadline, `plan` says whether to stop, or which feed and normal force
the next pass should use, so that the expected penalty at the end of the whole sequence is least.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.weldbead._identify.attribution import ScatterEstimate
from sdpgrind.weldbead._identify.coefficients import FrictionEstimator, PowerEstimator
from sdpgrind.weldbead._identify.identify import identify
from sdpgrind.weldbead.sequence._as_sdp import sdp_problem
from sdpgrind.weldbead.sequence._burn import BurnLimit, ForceBurnLimit, MalkinBurnLimit, PowerBurnLimit
from sdpgrind.weldbead.sequence._controller import SequenceController
from sdpgrind.weldbead.sequence._plan import plan
from sdpgrind.weldbead.sequence._policy import SequenceAction, SequencePolicy
from sdpgrind.weldbead.sequence._presets import preset, presets
from sdpgrind.weldbead.sequence._problem import FinishCharge, SequenceProblem
from sdpgrind.weldbead.sequence._process import Coefficients, GrindingProcess
from sdpgrind.weldbead.sequence._risk import Risk
from sdpgrind.weldbead.sequence._scatter import Scatter
from sdpgrind.weldbead.sequence._sweep import Sensitivity, sensitivity, sweep

if TYPE_CHECKING:
    from sdpgrind.weldbead import force, passes
    from sdpgrind.weldbead._hierarchy.hierarchy import Hierarchy

__all__ = [
    "BurnLimit",
    "Coefficients",
    "FinishCharge",
    "ForceBurnLimit",
    "FrictionEstimator",
    "GrindingProcess",
    "Hierarchy",
    "MalkinBurnLimit",
    "PowerBurnLimit",
    "PowerEstimator",
    "PresetInfo",
    "Risk",
    "Scatter",
    "ScatterEstimate",
    "Sensitivity",
    "SequenceAction",
    "SequenceController",
    "SequencePolicy",
    "SequenceProblem",
    "force",
    "identify",
    "passes",
    "plan",
    "preset",
    "presets",
    "sdp_problem",
    "sensitivity",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name in ("force", "passes"):  # the tiers below stand on scipy.signal, which takes half a second to import
        return import_module(f"sdpgrind.weldbead.{name}")
    if name == "Hierarchy":
        return import_module("sdpgrind.weldbead._hierarchy.hierarchy").Hierarchy
    raise AttributeError(f"module 'sdpgrind.weldbead' has no attribute {name!r}")
