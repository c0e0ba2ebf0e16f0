"""Robot-assisted finishing: paths over curved surfaces, joints and time laws, a torque axis, experiments (Wang and Jan 2001)."""

from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.finishing._arm.arm import Arm
from sdpgrind.finishing._arm.branches import ArmChoice, choose_branches
from sdpgrind.finishing._arm.heading import CornerJumps, corner_jumps
from sdpgrind.finishing._arm.lever import feed_angle, torque_per_force
from sdpgrind.finishing._arm.tool import tool_poses
from sdpgrind.finishing._path.hilbert import hilbert, hilbert_lsystem, hilbert_nodes
from sdpgrind.finishing._path.metrics import PathMetrics
from sdpgrind.finishing._path.path import Path
from sdpgrind.finishing._path.samples import PathSamples
from sdpgrind.finishing._path.scallop import ball_footprint, cusp_roughness, scallop_height
from sdpgrind.finishing._path.zigzag import zigzag
from sdpgrind.finishing._problem.identify import identify
from sdpgrind.finishing._problem.motion import Motion, MotionError, MotionState, Posture
from sdpgrind.finishing._problem.plan import plan
from sdpgrind.finishing._problem.presets import preset, presets
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing._roughness.fit import LeaveOneOut, leave_one_out
from sdpgrind.finishing._roughness.model import RoughnessModel
from sdpgrind.finishing._roughness.refinish import refinish_problem
from sdpgrind.finishing._study.anova import AnovaRow, AnovaTable
from sdpgrind.finishing._study.arrays import OrthogonalArray, orthogonal_array
from sdpgrind.finishing._study.best import Best, Tie
from sdpgrind.finishing._study.confounding import Confounding
from sdpgrind.finishing._study.means import LevelMean, LevelMeans
from sdpgrind.finishing._study.next_runs import NextRun, NextRuns
from sdpgrind.finishing._study.pooling import Pooling
from sdpgrind.finishing._study.power import Power
from sdpgrind.finishing._study.prediction import Prediction
from sdpgrind.finishing._study.ratios import sn_ratio
from sdpgrind.finishing._study.study import Study
from sdpgrind.finishing._surface.derivatives import SurfaceDerivatives
from sdpgrind.finishing._surface.presets import cylinder_surface, flat_surface, nominal_surface, sphere_surface, uneven_surfaces
from sdpgrind.finishing._surface.surface import Surface
from sdpgrind.finishing._timing.joint_path import JointPath
from sdpgrind.finishing._timing.laws import time_laws
from sdpgrind.finishing._timing.limits import JointLimits
from sdpgrind.finishing._timing.table_loop import SampledTable, TableLoop
from sdpgrind.finishing._timing.time_law import TimeLaw
from sdpgrind.finishing._timing.trapezoid import Trapezoid
from sdpgrind.finishing._timing.violations import Violation, worst_violation
from sdpgrind.finishing._torque.axis import TorqueAxis
from sdpgrind.finishing._torque.controller import TorqueController
from sdpgrind.finishing._torque.gains import DampingGains, LqgGains, PidffGains
from sdpgrind.finishing._torque.law import TorqueLaw
from sdpgrind.finishing._torque.load_torque import gravity_torque
from sdpgrind.finishing._torque.loop import AxisLoop
from sdpgrind.finishing._torque.observer import ObservedTorque, observed_torque
from sdpgrind.finishing._torque.poles import AxisPoles
from sdpgrind.finishing._torque.record import AxisRecord
from sdpgrind.finishing._torque.simulate import simulate_axis
from sdpgrind.finishing._torque.step_response import StepFigures, contact_step, step_figures, triple_pole_step
from sdpgrind.finishing._torque.tolerance import StiffnessCase, stiffness_range, worst_case

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
