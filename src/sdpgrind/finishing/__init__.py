"""Robot-assisted finishing: paths over curved surfaces, joints and time laws, a torque axis, experiments (Wang and Jan 2001)."""

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.finishing._problem.identify import identify
from sdpgrind.finishing._problem.motion import Motion, MotionError, MotionState, Posture
from sdpgrind.finishing._problem.plan import plan
from sdpgrind.finishing._problem.presets import preset, presets
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._branches import ArmChoice, choose_branches
from sdpgrind.finishing.arm._heading import CornerJumps, corner_jumps
from sdpgrind.finishing.arm._lever import feed_angle, torque_per_force
from sdpgrind.finishing.arm._tool import tool_poses
from sdpgrind.finishing.path._hilbert import hilbert, hilbert_lsystem, hilbert_nodes
from sdpgrind.finishing.path._metrics import PathMetrics
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._samples import PathSamples
from sdpgrind.finishing.path._scallop import ball_footprint, cusp_roughness, scallop_height
from sdpgrind.finishing.path._zigzag import zigzag
from sdpgrind.finishing.roughness._fit import LeaveOneOut, leave_one_out
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.roughness._refinish import refinish_problem
from sdpgrind.finishing.study._anova import AnovaRow, AnovaTable
from sdpgrind.finishing.study._arrays import OrthogonalArray, orthogonal_array
from sdpgrind.finishing.study._best import Best, Tie
from sdpgrind.finishing.study._confounding import Confounding
from sdpgrind.finishing.study._means import LevelMean, LevelMeans
from sdpgrind.finishing.study._next_runs import NextRun, NextRuns
from sdpgrind.finishing.study._pooling import Pooling
from sdpgrind.finishing.study._power import Power
from sdpgrind.finishing.study._prediction import Prediction
from sdpgrind.finishing.study._ratios import sn_ratio
from sdpgrind.finishing.study._study import Study
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives
from sdpgrind.finishing.surface._presets import cylinder_surface, flat_surface, nominal_surface, sphere_surface, uneven_surfaces
from sdpgrind.finishing.surface._surface import Surface
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._laws import time_laws
from sdpgrind.finishing.timing._limits import JointLimits
from sdpgrind.finishing.timing._table_loop import SampledTable, TableLoop
from sdpgrind.finishing.timing._time_law import TimeLaw
from sdpgrind.finishing.timing._trapezoid import Trapezoid
from sdpgrind.finishing.timing._violations import Violation, worst_violation
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._controller import TorqueController
from sdpgrind.finishing.torque._gains import DampingGains, LqgGains, PidffGains
from sdpgrind.finishing.torque._law import TorqueLaw
from sdpgrind.finishing.torque._load_torque import gravity_torque
from sdpgrind.finishing.torque._loop import AxisLoop
from sdpgrind.finishing.torque._observer import ObservedTorque, observed_torque
from sdpgrind.finishing.torque._poles import AxisPoles
from sdpgrind.finishing.torque._record import AxisRecord
from sdpgrind.finishing.torque._simulate import simulate_axis
from sdpgrind.finishing.torque._step_response import StepFigures, contact_step, step_figures, triple_pole_step
from sdpgrind.finishing.torque._tolerance import StiffnessCase, stiffness_range, worst_case

__all__ = [
    "AnovaRow",
    "AnovaTable",
    "Arm",
    "ArmChoice",
    "AxisLoop",
    "AxisPoles",
    "AxisRecord",
    "Best",
    "Confounding",
    "CornerJumps",
    "DampingGains",
    "FinishingProblem",
    "JointLimits",
    "JointPath",
    "LeaveOneOut",
    "LevelMean",
    "LevelMeans",
    "LqgGains",
    "Motion",
    "MotionError",
    "MotionState",
    "NextRun",
    "NextRuns",
    "ObservedTorque",
    "OrthogonalArray",
    "Path",
    "PathMetrics",
    "PathSamples",
    "PidffGains",
    "Pooling",
    "Posture",
    "Power",
    "Prediction",
    "PresetInfo",
    "RoughnessModel",
    "SampledTable",
    "StepFigures",
    "StiffnessCase",
    "Study",
    "Surface",
    "SurfaceDerivatives",
    "TableLoop",
    "Tie",
    "TimeLaw",
    "TorqueAxis",
    "TorqueController",
    "TorqueLaw",
    "Trapezoid",
    "Violation",
    "ball_footprint",
    "choose_branches",
    "contact_step",
    "corner_jumps",
    "cusp_roughness",
    "cylinder_surface",
    "feed_angle",
    "flat_surface",
    "gravity_torque",
    "hilbert",
    "hilbert_lsystem",
    "hilbert_nodes",
    "identify",
    "leave_one_out",
    "nominal_surface",
    "observed_torque",
    "orthogonal_array",
    "plan",
    "preset",
    "presets",
    "refinish_problem",
    "scallop_height",
    "simulate_axis",
    "sn_ratio",
    "sphere_surface",
    "step_figures",
    "stiffness_range",
    "time_laws",
    "tool_poses",
    "torque_per_force",
    "triple_pole_step",
    "uneven_surfaces",
    "worst_case",
    "worst_violation",
    "zigzag",
]
