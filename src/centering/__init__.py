"""Centering of rings on a turning table, and measuring them there: where a ring lies, pushes, whole cycles (Mears 2006).

Where to begin:

* a ring's place: `GeometryEstimator` (reading by reading, sure or not yet) or `identify` (a batch);
* a push: `preset` gives a `CenteringProblem` (part, friction, limits, scatter), `plan_push` aims one, ``push.simulate()`` says
  what it does, `simulate_push` follows any `TipProfile`;
* friction from pushes: `FrictionEstimator`, then ``problem.updated(estimate)``;
* a cycle: `plan` solves for the `Strategy` of least time, `CenteringController` follows it, on `hwsim.CenteringMachine` or a real
  machine; `PrintedController` is the source's, to compare with;
* form: `Profile` for roundness, `plan_changeover` for the grinder, `DriftTrack` and `ControlChart` for parts over weeks.

Lengths are in mm, readings outward, angles in rad, forces in N. `hwsim.Probe` simulates the measuring head. The first call of a
kind compiles it, for up to half a minute, once on a machine.

Examples
--------
>>> import centering
>>> import hwsim
>>> scan = hwsim.Probe(hwsim.Ring(radius=62.0, offset=2.0, offset_angle=0.5), samples_per_turn=360).scan(turns=1.0, rng=0)
>>> circle = centering.identify((scan.angle, scan.reading), "circle", tip_radius=3.75)
>>> bool(abs(circle.radius - 62.0) < 1e-3), bool(abs(circle.offset - 2.0) < 1e-3)  # mm
(True, True)
>>> problem = centering.preset("printed").replace(mass=0.8)
>>> push = centering.plan_push(problem, offset=2.0, spindle_speed=2.0, push_speed=20.0)  # mm, rad/s, mm/s
>>> round(push.simulate().free_slide, 2) < 0.5, push.stroke > 2.0  # mm
(True, True)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from centering._cycle.belief import Belief
    from centering._cycle.controller import CenteringController
    from centering._cycle.correction import StrokeCorrection, travelled
    from centering._cycle.following import Follower, FollowingGains, FollowingLimits, FollowingMap, tune_following
    from centering._cycle.outcomes import OutcomeTable, PushKind
    from centering._cycle.plan import plan
    from centering._cycle.printed_controller import PrintedController
    from centering._cycle.settings import CycleSettings
    from centering._cycle.states import CycleState
    from centering._cycle.strategy import Strategy
    from centering._cycle.strategy_choice import PushChoice
    from centering._cycle.strategy_record import CenteringRuns
    from centering._cycle.strategy_timing import CycleTiming
    from centering._friction.bristle_laws import DahlFriction, ElastoPlasticFriction, LuGreFriction, friction_law
    from centering._friction.drift import FrictionTrace, friction_drift, simulate_friction
    from centering._friction.estimator import FrictionEstimator, identify_friction
    from centering._friction.laws import CoulombFriction, StribeckFriction, ViscousFriction
    from centering._friction.printed import PrintedFriction
    from centering._geometry.curve import circle_derivatives, circle_reading, radial_position
    from centering._geometry.estimate import CircleEstimate
    from centering._geometry.estimator import GeometryEstimator
    from centering._geometry.fit import fit_circle
    from centering._geometry.form import form_gain
    from centering._geometry.identify import identify_circle
    from centering._geometry.limacon import (
        corrected_radius,
        limacon_bias,
        limacon_radius,
        limacon_reading,
        limacon_wave,
        linear_gauge_offset,
    )
    from centering._geometry.measuring import MeasuringController
    from centering._geometry.picture import plot_centers
    from centering._geometry.printed import PrintedEstimator, PrintedHistory
    from centering._geometry.residuals import ResidualChecks, residual_checks
    from centering._handover.alarm import DriftAlarm
    from centering._handover.allowance import Allowance, best_allowance
    from centering._handover.changeover import BothRules, Changeover
    from centering._handover.changeover_plan import plan_changeover
    from centering._handover.chart import ChartLimits, ChartSignal, ControlChart
    from centering._handover.chatter import ChatterBand, ChatterCheck, chatter_check
    from centering._handover.drift import DriftTrack
    from centering._handover.stock import Stock
    from centering._identify import identify
    from centering._push.arrival import Arrival
    from centering._push.bandstop import band_stop_lag, band_stop_profile
    from centering._push.direction import Touch, plan_touch
    from centering._push.free_slide import FreeSlideTable, free_slide_table
    from centering._push.gentle import gentle_profile, tap_profile
    from centering._push.impact import (
        FreeSlide,
        contact_stiffness,
        energy_balance_speed,
        free_slide,
        mass_ratio,
        restitution,
        sliding_speed,
    )
    from centering._push.lead import rim_advance
    from centering._push.limits import (
        RimMotion,
        SpeedLimit,
        closing_distance,
        max_rim_slope,
        rim_motion,
        spindle_acceleration_limit,
        spindle_speed_limit,
    )
    from centering._push.model import Part, PushModel
    from centering._push.optimal import minimum_time_push
    from centering._push.optimal_push import OptimalPush, PushStatus
    from centering._push.presets import preset, presets
    from centering._push.problem import CenteringLimits, CenteringProblem, PushScatter
    from centering._push.profile import TipProfile
    from centering._push.push import Push, plan_push
    from centering._push.reaction import simulate_pushes
    from centering._push.resonance import StictionResonance, implied_stiffness, resonance_over_speed, stiction_resonance
    from centering._push.sliding import RingFriction, RingLaunch, RingSlide, launch_for, ring_friction, slide_to_rest
    from centering._push.timing import StoppingWay, move_peak, move_time, stopping_way
    from centering._push.trace import PushTrace, simulate_push
    from centering._push.turning import TableProfile, turning_profile
    from centering._push.turning_trace import TablePushTrace, simulate_table_push
    from centering._roundness.circles import reference_circle
    from centering._roundness.profile import Profile
    from centering._roundness.roundness import Roundness
    from centering._roundness.runout import Runout
    from centering._roundness.spectrum import Spectrum

__all__ = [
    "Allowance",
    "Arrival",
    "Belief",
    "BothRules",
    "CenteringController",
    "CenteringLimits",
    "CenteringProblem",
    "CenteringRuns",
    "Changeover",
    "ChartLimits",
    "ChartSignal",
    "ChatterBand",
    "ChatterCheck",
    "CircleEstimate",
    "ControlChart",
    "CoulombFriction",
    "CycleSettings",
    "CycleState",
    "CycleTiming",
    "DahlFriction",
    "DriftAlarm",
    "DriftTrack",
    "ElastoPlasticFriction",
    "Follower",
    "FollowingGains",
    "FollowingLimits",
    "FollowingMap",
    "FreeSlide",
    "FreeSlideTable",
    "FrictionEstimator",
    "FrictionTrace",
    "GeometryEstimator",
    "LuGreFriction",
    "MeasuringController",
    "OptimalPush",
    "OutcomeTable",
    "Part",
    "PrintedController",
    "PrintedEstimator",
    "PrintedFriction",
    "PrintedHistory",
    "Profile",
    "Push",
    "PushChoice",
    "PushKind",
    "PushModel",
    "PushScatter",
    "PushStatus",
    "PushTrace",
    "ResidualChecks",
    "RimMotion",
    "RingFriction",
    "RingLaunch",
    "RingSlide",
    "Roundness",
    "Runout",
    "Spectrum",
    "SpeedLimit",
    "StictionResonance",
    "Stock",
    "StoppingWay",
    "Strategy",
    "StribeckFriction",
    "StrokeCorrection",
    "TableProfile",
    "TablePushTrace",
    "TipProfile",
    "Touch",
    "ViscousFriction",
    "band_stop_lag",
    "band_stop_profile",
    "best_allowance",
    "chatter_check",
    "circle_derivatives",
    "circle_reading",
    "closing_distance",
    "contact_stiffness",
    "corrected_radius",
    "energy_balance_speed",
    "fit_circle",
    "form_gain",
    "free_slide",
    "free_slide_table",
    "friction_drift",
    "friction_law",
    "gentle_profile",
    "identify",
    "identify_circle",
    "identify_friction",
    "implied_stiffness",
    "launch_for",
    "limacon_bias",
    "limacon_radius",
    "limacon_reading",
    "limacon_wave",
    "linear_gauge_offset",
    "mass_ratio",
    "max_rim_slope",
    "minimum_time_push",
    "move_peak",
    "move_time",
    "plan",
    "plan_changeover",
    "plan_push",
    "plan_touch",
    "plot_centers",
    "preset",
    "presets",
    "radial_position",
    "reference_circle",
    "residual_checks",
    "resonance_over_speed",
    "restitution",
    "rim_advance",
    "rim_motion",
    "ring_friction",
    "simulate_friction",
    "simulate_push",
    "simulate_pushes",
    "simulate_table_push",
    "slide_to_rest",
    "sliding_speed",
    "spindle_acceleration_limit",
    "spindle_speed_limit",
    "stiction_resonance",
    "stopping_way",
    "tap_profile",
    "travelled",
    "tune_following",
    "turning_profile",
]

_MODULES = {
    "circle_derivatives": "_geometry.curve",
    "circle_reading": "_geometry.curve",
    "radial_position": "_geometry.curve",
    "CircleEstimate": "_geometry.estimate",
    "GeometryEstimator": "_geometry.estimator",
    "fit_circle": "_geometry.fit",
    "form_gain": "_geometry.form",
    "identify_circle": "_geometry.identify",
    "corrected_radius": "_geometry.limacon",
    "limacon_bias": "_geometry.limacon",
    "limacon_radius": "_geometry.limacon",
    "limacon_reading": "_geometry.limacon",
    "limacon_wave": "_geometry.limacon",
    "linear_gauge_offset": "_geometry.limacon",
    "MeasuringController": "_geometry.measuring",
    "plot_centers": "_geometry.picture",
    "PrintedEstimator": "_geometry.printed",
    "PrintedHistory": "_geometry.printed",
    "ResidualChecks": "_geometry.residuals",
    "residual_checks": "_geometry.residuals",
    "reference_circle": "_roundness.circles",
    "Profile": "_roundness.profile",
    "Roundness": "_roundness.roundness",
    "Runout": "_roundness.runout",
    "Spectrum": "_roundness.spectrum",
    "DriftAlarm": "_handover.alarm",
    "Allowance": "_handover.allowance",
    "best_allowance": "_handover.allowance",
    "BothRules": "_handover.changeover",
    "Changeover": "_handover.changeover",
    "plan_changeover": "_handover.changeover_plan",
    "ChartLimits": "_handover.chart",
    "ChartSignal": "_handover.chart",
    "ControlChart": "_handover.chart",
    "ChatterBand": "_handover.chatter",
    "ChatterCheck": "_handover.chatter",
    "chatter_check": "_handover.chatter",
    "DriftTrack": "_handover.drift",
    "Stock": "_handover.stock",
    "Arrival": "_push.arrival",
    "band_stop_lag": "_push.bandstop",
    "band_stop_profile": "_push.bandstop",
    "Touch": "_push.direction",
    "plan_touch": "_push.direction",
    "FreeSlideTable": "_push.free_slide",
    "free_slide_table": "_push.free_slide",
    "gentle_profile": "_push.gentle",
    "tap_profile": "_push.gentle",
    "FreeSlide": "_push.impact",
    "contact_stiffness": "_push.impact",
    "energy_balance_speed": "_push.impact",
    "free_slide": "_push.impact",
    "mass_ratio": "_push.impact",
    "restitution": "_push.impact",
    "sliding_speed": "_push.impact",
    "rim_advance": "_push.lead",
    "RimMotion": "_push.limits",
    "SpeedLimit": "_push.limits",
    "closing_distance": "_push.limits",
    "max_rim_slope": "_push.limits",
    "rim_motion": "_push.limits",
    "spindle_acceleration_limit": "_push.limits",
    "spindle_speed_limit": "_push.limits",
    "Part": "_push.model",
    "PushModel": "_push.model",
    "minimum_time_push": "_push.optimal",
    "OptimalPush": "_push.optimal_push",
    "PushStatus": "_push.optimal_push",
    "preset": "_push.presets",
    "presets": "_push.presets",
    "CenteringLimits": "_push.problem",
    "CenteringProblem": "_push.problem",
    "PushScatter": "_push.problem",
    "TipProfile": "_push.profile",
    "Push": "_push.push",
    "plan_push": "_push.push",
    "simulate_pushes": "_push.reaction",
    "StictionResonance": "_push.resonance",
    "implied_stiffness": "_push.resonance",
    "resonance_over_speed": "_push.resonance",
    "stiction_resonance": "_push.resonance",
    "RingLaunch": "_push.sliding",
    "RingFriction": "_push.sliding",
    "RingSlide": "_push.sliding",
    "launch_for": "_push.sliding",
    "ring_friction": "_push.sliding",
    "slide_to_rest": "_push.sliding",
    "StoppingWay": "_push.timing",
    "move_peak": "_push.timing",
    "move_time": "_push.timing",
    "stopping_way": "_push.timing",
    "PushTrace": "_push.trace",
    "simulate_push": "_push.trace",
    "TableProfile": "_push.turning",
    "turning_profile": "_push.turning",
    "TablePushTrace": "_push.turning_trace",
    "simulate_table_push": "_push.turning_trace",
    "DahlFriction": "_friction.bristle_laws",
    "ElastoPlasticFriction": "_friction.bristle_laws",
    "LuGreFriction": "_friction.bristle_laws",
    "friction_law": "_friction.bristle_laws",
    "FrictionTrace": "_friction.drift",
    "friction_drift": "_friction.drift",
    "simulate_friction": "_friction.drift",
    "FrictionEstimator": "_friction.estimator",
    "identify_friction": "_friction.estimator",
    "CoulombFriction": "_friction.laws",
    "StribeckFriction": "_friction.laws",
    "ViscousFriction": "_friction.laws",
    "PrintedFriction": "_friction.printed",
    "Belief": "_cycle.belief",
    "CenteringController": "_cycle.controller",
    "StrokeCorrection": "_cycle.correction",
    "travelled": "_cycle.correction",
    "Follower": "_cycle.following",
    "FollowingGains": "_cycle.following",
    "FollowingLimits": "_cycle.following",
    "FollowingMap": "_cycle.following",
    "tune_following": "_cycle.following",
    "OutcomeTable": "_cycle.outcomes",
    "PushKind": "_cycle.outcomes",
    "plan": "_cycle.plan",
    "PrintedController": "_cycle.printed_controller",
    "CycleSettings": "_cycle.settings",
    "CycleState": "_cycle.states",
    "PushChoice": "_cycle.strategy_choice",
    "Strategy": "_cycle.strategy",
    "CenteringRuns": "_cycle.strategy_record",
    "CycleTiming": "_cycle.strategy_timing",
    "identify": "_identify",
}  # compiled loops and tables bring their libraries along: imported when first used


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return getattr(import_module(f"centering.{_MODULES[name]}"), name)
    raise AttributeError(f"module 'centering' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
