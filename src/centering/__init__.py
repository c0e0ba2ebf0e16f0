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
    from centering._identify import identify
    from centering.circle._estimator.estimator import GeometryEstimator
    from centering.circle._estimator.measuring import MeasuringController
    from centering.circle._estimator.printed import PrintedEstimator, PrintedHistory
    from centering.circle._fit.curve import circle_derivatives, circle_reading, radial_position
    from centering.circle._fit.estimate import CircleEstimate
    from centering.circle._fit.fit import fit_circle
    from centering.circle._fit.form import form_gain
    from centering.circle._fit.identify import identify_circle
    from centering.circle._fit.limacon import (
        corrected_radius,
        limacon_bias,
        limacon_radius,
        limacon_reading,
        limacon_wave,
        linear_gauge_offset,
    )
    from centering.circle._fit.picture import plot_centers
    from centering.circle._fit.residuals import ResidualChecks, residual_checks
    from centering.cycle._control.controller import CenteringController
    from centering.cycle._control.following import Follower, FollowingGains, FollowingLimits, FollowingMap, tune_following
    from centering.cycle._control.settings import CycleSettings
    from centering.cycle._control.states import CycleState
    from centering.cycle._source.controller import PrintedController
    from centering.cycle._source.correction import StrokeCorrection, travelled
    from centering.cycle._strategy.belief import Belief
    from centering.cycle._strategy.choice import PushChoice
    from centering.cycle._strategy.outcomes import OutcomeTable, PushKind
    from centering.cycle._strategy.plan import plan
    from centering.cycle._strategy.runs import CenteringRuns
    from centering.cycle._strategy.strategy import Strategy
    from centering.cycle._strategy.timing import CycleTiming
    from centering.friction._bristle_laws import DahlFriction, ElastoPlasticFriction, LuGreFriction, friction_law
    from centering.friction._drift import FrictionTrace, friction_drift, simulate_friction
    from centering.friction._estimator import FrictionEstimator, identify_friction
    from centering.friction._laws import CoulombFriction, StribeckFriction, ViscousFriction
    from centering.friction._printed import PrintedFriction
    from centering.monitoring._alarm import DriftAlarm
    from centering.monitoring._chart import ChartLimits, ChartSignal, ControlChart
    from centering.monitoring._drift import DriftTrack
    from centering.push._contact.free_slide import FreeSlideTable, free_slide_table
    from centering.push._contact.impact import (
        FreeSlide,
        contact_stiffness,
        energy_balance_speed,
        free_slide,
        mass_ratio,
        restitution,
        sliding_speed,
    )
    from centering.push._contact.reaction import simulate_pushes
    from centering.push._contact.resonance import StictionResonance, implied_stiffness, resonance_over_speed, stiction_resonance
    from centering.push._contact.trace import PushTrace, simulate_push
    from centering.push._fastest.push import OptimalPush, PushStatus
    from centering.push._fastest.search import minimum_time_push
    from centering.push._machine.model import Part, PushModel
    from centering.push._machine.presets import preset, presets
    from centering.push._machine.problem import CenteringLimits, CenteringProblem, PushScatter
    from centering.push._plan.arrival import Arrival
    from centering.push._plan.direction import Touch, plan_touch
    from centering.push._plan.push import Push, plan_push
    from centering.push._profile.bandstop import band_stop_lag, band_stop_profile
    from centering.push._profile.gentle import gentle_profile, tap_profile
    from centering.push._profile.profile import TipProfile
    from centering.push._profile.timing import StoppingWay, move_peak, move_time, stopping_way
    from centering.push.turning._lead import rim_advance
    from centering.push.turning._limits import (
        RimMotion,
        SpeedLimit,
        closing_distance,
        max_rim_slope,
        rim_motion,
        spindle_acceleration_limit,
        spindle_speed_limit,
    )
    from centering.push.turning._sliding import RingFriction, RingLaunch, RingSlide, launch_for, ring_friction, slide_to_rest
    from centering.push.turning._turning import TableProfile, turning_profile
    from centering.push.turning._turning_trace import TablePushTrace, simulate_table_push
    from centering.roundness._circles import reference_circle
    from centering.roundness._profile import Profile
    from centering.roundness._roundness import Roundness
    from centering.roundness._runout import Runout
    from centering.roundness._spectrum import Spectrum
    from centering.setup._allowance import Allowance, best_allowance
    from centering.setup._changeover import BothRules, Changeover
    from centering.setup._changeover_plan import plan_changeover
    from centering.setup._chatter import ChatterBand, ChatterCheck, chatter_check
    from centering.setup._stock import Stock

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
    "circle_derivatives": "circle._fit.curve",
    "circle_reading": "circle._fit.curve",
    "radial_position": "circle._fit.curve",
    "CircleEstimate": "circle._fit.estimate",
    "GeometryEstimator": "circle._estimator.estimator",
    "fit_circle": "circle._fit.fit",
    "form_gain": "circle._fit.form",
    "identify_circle": "circle._fit.identify",
    "corrected_radius": "circle._fit.limacon",
    "limacon_bias": "circle._fit.limacon",
    "limacon_radius": "circle._fit.limacon",
    "limacon_reading": "circle._fit.limacon",
    "limacon_wave": "circle._fit.limacon",
    "linear_gauge_offset": "circle._fit.limacon",
    "MeasuringController": "circle._estimator.measuring",
    "plot_centers": "circle._fit.picture",
    "PrintedEstimator": "circle._estimator.printed",
    "PrintedHistory": "circle._estimator.printed",
    "ResidualChecks": "circle._fit.residuals",
    "residual_checks": "circle._fit.residuals",
    "reference_circle": "roundness._circles",
    "Profile": "roundness._profile",
    "Roundness": "roundness._roundness",
    "Runout": "roundness._runout",
    "Spectrum": "roundness._spectrum",
    "DriftAlarm": "monitoring._alarm",
    "Allowance": "setup._allowance",
    "best_allowance": "setup._allowance",
    "BothRules": "setup._changeover",
    "Changeover": "setup._changeover",
    "plan_changeover": "setup._changeover_plan",
    "ChartLimits": "monitoring._chart",
    "ChartSignal": "monitoring._chart",
    "ControlChart": "monitoring._chart",
    "ChatterBand": "setup._chatter",
    "ChatterCheck": "setup._chatter",
    "chatter_check": "setup._chatter",
    "DriftTrack": "monitoring._drift",
    "Stock": "setup._stock",
    "Arrival": "push._plan.arrival",
    "band_stop_lag": "push._profile.bandstop",
    "band_stop_profile": "push._profile.bandstop",
    "Touch": "push._plan.direction",
    "plan_touch": "push._plan.direction",
    "FreeSlideTable": "push._contact.free_slide",
    "free_slide_table": "push._contact.free_slide",
    "gentle_profile": "push._profile.gentle",
    "tap_profile": "push._profile.gentle",
    "FreeSlide": "push._contact.impact",
    "contact_stiffness": "push._contact.impact",
    "energy_balance_speed": "push._contact.impact",
    "free_slide": "push._contact.impact",
    "mass_ratio": "push._contact.impact",
    "restitution": "push._contact.impact",
    "sliding_speed": "push._contact.impact",
    "rim_advance": "push._turning.lead",
    "RimMotion": "push._turning.limits",
    "SpeedLimit": "push._turning.limits",
    "closing_distance": "push._turning.limits",
    "max_rim_slope": "push._turning.limits",
    "rim_motion": "push._turning.limits",
    "spindle_acceleration_limit": "push._turning.limits",
    "spindle_speed_limit": "push._turning.limits",
    "Part": "push._machine.model",
    "PushModel": "push._machine.model",
    "minimum_time_push": "push._fastest.search",
    "OptimalPush": "push._fastest.push",
    "PushStatus": "push._fastest.push",
    "preset": "push._machine.presets",
    "presets": "push._machine.presets",
    "CenteringLimits": "push._machine.problem",
    "CenteringProblem": "push._machine.problem",
    "PushScatter": "push._machine.problem",
    "TipProfile": "push._profile.profile",
    "Push": "push._plan.push",
    "plan_push": "push._plan.push",
    "simulate_pushes": "push._contact.reaction",
    "StictionResonance": "push._contact.resonance",
    "implied_stiffness": "push._contact.resonance",
    "resonance_over_speed": "push._contact.resonance",
    "stiction_resonance": "push._contact.resonance",
    "RingLaunch": "push._turning.sliding",
    "RingFriction": "push._turning.sliding",
    "RingSlide": "push._turning.sliding",
    "launch_for": "push._turning.sliding",
    "ring_friction": "push._turning.sliding",
    "slide_to_rest": "push._turning.sliding",
    "StoppingWay": "push._profile.timing",
    "move_peak": "push._profile.timing",
    "move_time": "push._profile.timing",
    "stopping_way": "push._profile.timing",
    "PushTrace": "push._contact.trace",
    "simulate_push": "push._contact.trace",
    "TableProfile": "push._turning.turning",
    "turning_profile": "push._turning.turning",
    "TablePushTrace": "push._turning.turning_trace",
    "simulate_table_push": "push._turning.turning_trace",
    "DahlFriction": "friction._bristle_laws",
    "ElastoPlasticFriction": "friction._bristle_laws",
    "LuGreFriction": "friction._bristle_laws",
    "friction_law": "friction._bristle_laws",
    "FrictionTrace": "friction._drift",
    "friction_drift": "friction._drift",
    "simulate_friction": "friction._drift",
    "FrictionEstimator": "friction._estimator",
    "identify_friction": "friction._estimator",
    "CoulombFriction": "friction._laws",
    "StribeckFriction": "friction._laws",
    "ViscousFriction": "friction._laws",
    "PrintedFriction": "friction._printed",
    "Belief": "cycle._strategy.belief",
    "CenteringController": "cycle._control.controller",
    "StrokeCorrection": "cycle._source.correction",
    "travelled": "cycle._source.correction",
    "Follower": "cycle._control.following",
    "FollowingGains": "cycle._control.following",
    "FollowingLimits": "cycle._control.following",
    "FollowingMap": "cycle._control.following",
    "tune_following": "cycle._control.following",
    "OutcomeTable": "cycle._strategy.outcomes",
    "PushKind": "cycle._strategy.outcomes",
    "plan": "cycle._strategy.plan",
    "PrintedController": "cycle._source.controller",
    "CycleSettings": "cycle._control.settings",
    "CycleState": "cycle._control.states",
    "PushChoice": "cycle._strategy.choice",
    "Strategy": "cycle._strategy.strategy",
    "CenteringRuns": "cycle._strategy.runs",
    "CycleTiming": "cycle._strategy.timing",
    "identify": "_identify",
}  # compiled loops and tables bring their libraries along: imported when first used


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return getattr(import_module(f"centering.{_MODULES[name]}"), name)
    raise AttributeError(f"module 'centering' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
