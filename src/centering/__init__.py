"""Measuring an off-centre ring while it turns: geometry with its confidence, roundness, what the grinder is told (Mears 2006).

Begin with `GeometryEstimator` (reading by reading, sure or not yet) or `identify` (a batch); with `Profile` for roundness, free
of the roller's runout; with `plan_changeover` for the grinder. `DriftTrack` and `ControlChart` watch parts over weeks. Readings
are in mm, outward; angles in rad. `hwsim.Probe` simulates the measuring head. The first call of a kind compiles it, for up to
half a minute, once on a machine.

Examples
--------
>>> import centering
>>> import hwsim
>>> scan = hwsim.Probe(hwsim.Ring(radius=62.0, offset=2.0, offset_angle=0.5), samples_per_turn=360).scan(turns=1.0, rng=0)
>>> circle = centering.identify((scan.angle, scan.reading), "circle", tip_radius=3.75)
>>> bool(abs(circle.radius - 62.0) < 1e-3), bool(abs(circle.offset - 2.0) < 1e-3)  # mm
(True, True)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from centering._geometry.curve import circle_derivatives, circle_reading, radial_position
    from centering._geometry.estimate import CircleEstimate
    from centering._geometry.estimator import GeometryEstimator
    from centering._geometry.fit import fit_circle
    from centering._geometry.form import form_gain
    from centering._geometry.identify import identify
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
    from centering._roundness.circles import reference_circle
    from centering._roundness.profile import Profile
    from centering._roundness.roundness import Roundness
    from centering._roundness.runout import Runout
    from centering._roundness.spectrum import Spectrum

__all__ = [
    "Allowance",
    "BothRules",
    "Changeover",
    "ChartLimits",
    "ChartSignal",
    "ChatterBand",
    "ChatterCheck",
    "CircleEstimate",
    "ControlChart",
    "DriftAlarm",
    "DriftTrack",
    "GeometryEstimator",
    "MeasuringController",
    "PrintedEstimator",
    "PrintedHistory",
    "Profile",
    "ResidualChecks",
    "Roundness",
    "Runout",
    "Spectrum",
    "Stock",
    "best_allowance",
    "chatter_check",
    "circle_derivatives",
    "circle_reading",
    "corrected_radius",
    "fit_circle",
    "form_gain",
    "identify",
    "limacon_bias",
    "limacon_radius",
    "limacon_reading",
    "limacon_wave",
    "linear_gauge_offset",
    "plan_changeover",
    "plot_centers",
    "radial_position",
    "reference_circle",
    "residual_checks",
]

_MODULES = {
    "circle_derivatives": "_geometry.curve",
    "circle_reading": "_geometry.curve",
    "radial_position": "_geometry.curve",
    "CircleEstimate": "_geometry.estimate",
    "GeometryEstimator": "_geometry.estimator",
    "fit_circle": "_geometry.fit",
    "form_gain": "_geometry.form",
    "identify": "_geometry.identify",
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
    "reference_circle": "_roundness.circles",
    "Profile": "_roundness.profile",
    "Roundness": "_roundness.roundness",
    "Runout": "_roundness.runout",
    "Spectrum": "_roundness.spectrum",
}  # compiled loops and tables bring their libraries along: imported when first used


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return getattr(import_module(f"centering.{_MODULES[name]}"), name)
    raise AttributeError(f"module 'centering' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
