"""The best point of a process whose limit drifts with a state that nobody can measure (Koren 1989)."""

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.locus._control._learned import LearnedStart
from sdpgrind.locus._control.area_controller import AreaController
from sdpgrind.locus._control.batch import LoopRecord
from sdpgrind.locus._control.controller import LocusController
from sdpgrind.locus._correct.modifiers import ModifierController
from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._curve.locus import Event, Locus
from sdpgrind.locus._curve.plan import plan
from sdpgrind.locus._curve.point import Point
from sdpgrind.locus._problem.problem import Problem, Process, Varying
from sdpgrind.locus._robust.robust import RobustLocus, robust_locus
from sdpgrind.locus._stretch._stretch_point import StretchPoint
from sdpgrind.locus._stretch.calibration import Calibration
from sdpgrind.locus._stretch.stretch import Stretch
from sdpgrind.locus._trace.pieces import Columns, Piece
from sdpgrind.locus.gains._decoupling import decoupling_gains, spectral_radius
from sdpgrind.locus.gains._design_gain import design_gain
from sdpgrind.locus.gains._gain_design import GainDesign
from sdpgrind.locus.gains._gain_schedule import GainSchedule
from sdpgrind.locus.processes._dressed_grinding import DressedGrinding
from sdpgrind.locus.processes._grinding import Grinding
from sdpgrind.locus.processes._koren_example import KorenExample
from sdpgrind.locus.processes._motor import MotorAxis
from sdpgrind.locus.processes._presets import preset, presets
from sdpgrind.locus.processes._roughness import Roughness
from sdpgrind.locus.processes._turning import Turning, tool_change_time

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
