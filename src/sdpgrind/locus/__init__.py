"""The best point of a process whose limit drifts with a state that nobody can measure (Koren 1989)."""

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.locus._area import Area
from sdpgrind.locus._area_controller import AreaController
from sdpgrind.locus._batch import LoopRecord
from sdpgrind.locus._calibration import Calibration
from sdpgrind.locus._controller import LocusController
from sdpgrind.locus._decoupling import decoupling_gains, spectral_radius
from sdpgrind.locus._design_gain import design_gain
from sdpgrind.locus._dressed_grinding import DressedGrinding
from sdpgrind.locus._gain_design import GainDesign
from sdpgrind.locus._gain_schedule import GainSchedule
from sdpgrind.locus._grinding import Grinding
from sdpgrind.locus._koren_example import KorenExample
from sdpgrind.locus._learned import LearnedStart
from sdpgrind.locus._locus import Event, Locus
from sdpgrind.locus._modifiers import ModifierController
from sdpgrind.locus._motor import MotorAxis
from sdpgrind.locus._pieces import Columns, Piece
from sdpgrind.locus._plan import plan
from sdpgrind.locus._point import Point
from sdpgrind.locus._presets import preset, presets
from sdpgrind.locus._problem import Problem, Process, Varying
from sdpgrind.locus._robust import RobustLocus, robust_locus
from sdpgrind.locus._roughness import Roughness
from sdpgrind.locus._stretch import Stretch
from sdpgrind.locus._stretch_point import StretchPoint
from sdpgrind.locus._turning import Turning, tool_change_time

__all__ = [
    "Area",
    "AreaController",
    "Calibration",
    "Columns",
    "DressedGrinding",
    "Event",
    "GainDesign",
    "GainSchedule",
    "Grinding",
    "KorenExample",
    "LearnedStart",
    "Locus",
    "LocusController",
    "LoopRecord",
    "ModifierController",
    "MotorAxis",
    "Piece",
    "Point",
    "PresetInfo",
    "Problem",
    "Process",
    "RobustLocus",
    "Roughness",
    "Stretch",
    "StretchPoint",
    "Turning",
    "Varying",
    "decoupling_gains",
    "design_gain",
    "plan",
    "preset",
    "presets",
    "robust_locus",
    "spectral_radius",
    "tool_change_time",
]
