"""Whether a column is in its unit: against the range that a machine can mean."""

from collections.abc import Mapping
from math import inf

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.request import Bound, unit_of_name
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.table import TEXT, TRAVELS, Meant, quantity_of
from sdpgrind.base.unit_text import factor, near

_MOST = 0.95  # chosen: quantile held against the upper limit, so that a rapid approach or a spike passes
_TURNS = 60.0  # chosen: rad, some ten turns; greater angles in steps of 0.1 are degrees
_STEP, _ROUNDING = 0.1, 1e-6  # chosen: degrees; the finest scale that is written without binary rounding


def refuse_other_units(columns: Mapping[str, Column], bounds: Mapping[str, Bound], where: str) -> None:
    """Refuse the first column whose magnitude no machine means, with the units that would do."""
    for name, values in columns.items():
        unit = unit_of_name(bounds[name].request.name)
        if unit != TEXT and values.dtype.kind == "f":
            fault = _fault(values, quantity_of(name), bounds[name])
            if fault:
                raise ValueError(
                    f"{where}, column {bounds[name].heading.header!r}: {bounds[name].request.name} {fault}"
                )


def refuse_other_length(name: str, value: float, meant: Meant) -> None:
    """Refuse a number (mm; 0: none) that no machine means, with the conversions that would do."""
    if value == 0 or _inside(value, value, meant):
        return
    by = {other: value * factor(other, meant.unit) for other in near(meant.unit)}
    calls = " or ".join(f"{name}={mm:.6g} ({other})" for other, mm in by.items() if _inside(mm, mm, meant))
    raise ValueError(
        f"{name} must be {_range(meant)} {meant.unit}; got {value:.6g} {meant.unit}"
        + (f"; if given in another unit: {calls}" if calls else "")
        + " (plausible=False takes it as it is)"
    )


def ends(values: Floats) -> tuple[float, float]:
    """Greatest magnitude, and the quantile of the others than zero that the upper limit is for; 0: none."""
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    return (float(sizes.max()), float(np.quantile(sizes, _MOST))) if sizes.size else (0.0, 0.0)


def travel(values: Floats) -> float:
    """How far a column moves, without spikes; 0: it has no reading."""
    known = values[np.isfinite(values)]
    return float(np.subtract(*np.quantile(known, [_MOST, 1 - _MOST]))) if known.size else 0.0


def is_meant(values: Floats, meant: Meant) -> bool:
    """Whether a machine can mean the magnitude of a column."""
    return _inside(*ends(values), meant)


def _inside(greatest: float, most: float, meant: Meant) -> bool:
    return greatest >= meant.least and most <= meant.greatest


def _fault(values: Floats, meant: Meant, bound: Bound) -> str:
    greatest, most = ends(values)
    if bound.request.name in TRAVELS:
        most = min(most, travel(values))  # a gauge may show the whole radius
    if greatest == 0 or _inside(greatest, most, meant):
        return _degrees(values, bound) if meant.unit == "rad" and bound.factor == 1.0 else ""
    if bound.request.name == "reading" and _both_signs(values):
        call = bound._replace(request=bound.request._replace(name="deviation")).call()
        return f"must be radii, > 0; these are deviations: say {call}, radius=..."
    unit = meant.unit or "1"
    told = greatest if greatest < meant.least else most
    rule = f"must be {_range(meant)} {unit}; got {told:.6g} {unit}, recorded in {bound.unit}"
    used = factor(bound.unit, meant.unit)
    by = {other: factor(other, meant.unit) / used for other in (meant.unit or "1", *near(meant.unit))}
    fitting = [
        other
        for other in by
        if other != bound.unit and _inside(greatest * by[other], most * by[other], meant)
    ]
    if bound.heading.origin == "bracket" and bound.heading.unit in fitting:
        fitting = [bound.heading.unit]  # as the header says
    calls = " or ".join(bound.call(unit=other) for other in fitting)
    return rule + (f"; in another unit: {calls}" if calls else "") + " (plausible=False takes it as it is)"


def _both_signs(values: Floats) -> bool:
    """Whether values are on either side of zero, as radii are not."""
    low, high = np.quantile(values[np.isfinite(values)], [1 - _MOST, _MOST])
    return bool(low < 0 < high)


def _range(meant: Meant) -> str:
    if meant.greatest == inf:
        return f">= {meant.least:g}"
    return f"<= {meant.greatest:g}" if meant.least == 0 else f"{meant.least:g} ... {meant.greatest:g}"


def _degrees(values: Floats, bound: Bound) -> str:
    """Angles beyond several turns in steps of 0.1 are degrees."""
    known = values[np.isfinite(values)]
    tenths = known / _STEP
    if (
        known.size
        and np.ptp(known) > _TURNS
        and np.all(np.abs(tenths - np.round(tenths)) < _ROUNDING * np.abs(tenths) + _ROUNDING)
    ):
        told = f"must be in rad; got {float(np.ptp(known)):.6g} in steps of 0.1: {bound.call(unit='deg')}"
        return told + " (plausible=False takes it as it is)"
    return ""
