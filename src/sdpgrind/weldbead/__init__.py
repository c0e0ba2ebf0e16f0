"""Weld-bead grinding (Brown 1988)."""

from sdpgrind.weldbead._burn import BurnLimit, ForceBurnLimit, MalkinBurnLimit, PowerBurnLimit
from sdpgrind.weldbead._presets import PresetInfo, preset, presets
from sdpgrind.weldbead._problem import FinishCharge, SequenceProblem
from sdpgrind.weldbead._process import Coefficients, GrindingProcess
from sdpgrind.weldbead._scatter import Scatter

__all__ = [
    "BurnLimit",
    "Coefficients",
    "FinishCharge",
    "ForceBurnLimit",
    "GrindingProcess",
    "MalkinBurnLimit",
    "PowerBurnLimit",
    "PresetInfo",
    "Scatter",
    "SequenceProblem",
    "preset",
    "presets",
]
