"""Cylindrical plunge grinding: cycles of least time without burned layers (Dong, Danai and Malkin 2004, Part 2)."""

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.plunge._bounding import ConstraintBounding
from sdpgrind.plunge._chain import Chain, SharpnessUpdate, adaptation
from sdpgrind.plunge._controller import CycleController
from sdpgrind.plunge._cycle import CycleError, CyclePlan, CycleSolution
from sdpgrind.plunge._dressing import RoughnessLaw
from sdpgrind.plunge._identify import identify
from sdpgrind.plunge._margins import ChanceMargin, MarginBounding, RoundnessMargin
from sdpgrind.plunge._model import PlungeModel, Wear
from sdpgrind.plunge._plan import plan
from sdpgrind.plunge._presets import preset, presets
from sdpgrind.plunge._problem import CycleProblem
from sdpgrind.plunge._staged import StagedController
from sdpgrind.plunge._time_constant import TimeConstantEstimator

__all__ = [
    "Chain",
    "ChanceMargin",
    "ConstraintBounding",
    "CycleController",
    "CycleError",
    "CyclePlan",
    "CycleProblem",
    "CycleSolution",
    "MarginBounding",
    "PlungeModel",
    "PresetInfo",
    "RoughnessLaw",
    "RoundnessMargin",
    "SharpnessUpdate",
    "StagedController",
    "TimeConstantEstimator",
    "Wear",
    "adaptation",
    "identify",
    "plan",
    "preset",
    "presets",
]
