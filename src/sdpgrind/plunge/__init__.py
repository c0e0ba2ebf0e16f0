"""Cylindrical plunge grinding: cycles of least time without burned layers (Dong, Danai and Malkin 2004, Part 2)."""

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._identify.identify import identify
from sdpgrind.plunge._identify.time_constant import TimeConstantEstimator
from sdpgrind.plunge._learn.bounding import ConstraintBounding
from sdpgrind.plunge._learn.chain import Chain, SharpnessUpdate, adaptation
from sdpgrind.plunge._learn.margins import ChanceMargin, MarginBounding, RoundnessMargin
from sdpgrind.plunge._model.dressing import RoughnessLaw
from sdpgrind.plunge._model.model import PlungeModel, Wear
from sdpgrind.plunge._model.presets import preset, presets
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.cycle import CycleError, CyclePlan, CycleSolution
from sdpgrind.plunge._plan.plan import plan
from sdpgrind.plunge._stages.controller import StagedController

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
