"""Commissioning: the values of a machine by one fit of the sizes and powers of parts."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import serial
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.plunge._identify import rounding
from sdpgrind.plunge._identify.cycles import MOVING, Cycle, cycles, fault, not_identified
from sdpgrind.plunge._identify.declared_units import CANNOT_TELL, refuse_other_units
from sdpgrind.plunge._identify.machine_estimate import MachineEstimate
from sdpgrind.plunge._identify.machine_fit import AIR, MachineFit, fitted
from sdpgrind.plunge._identify.machine_goodness import goodness, misfit
from sdpgrind.plunge._identify.machine_model import (
    AREA,
    CONTACT,
    ENERGY,
    FEED_LAG,
    IDLE,
    PLOUGHING,
    POWER_LAG,
    RATIO,
    SHARED,
    WEAR,
)
from sdpgrind.plunge._identify.machine_start import air, declared, started
from sdpgrind.plunge._identify.sharpness import clipped_rows
from sdpgrind.plunge._model.problem import CycleProblem

_NAMES = {
    RATIO: ("normal_force_ratio", "1"),
    AREA: ("wear_flat_area", "1"),
    ENERGY: ("specific_energy", "J/mm^3"),
    PLOUGHING: ("ploughing_force", "N/mm"),
    IDLE: ("idle_power", "W"),
    WEAR: ("wheel_wear", "1"),
    FEED_LAG: ("feed_lag", "s"),
    POWER_LAG: ("power_lag", "s"),
}
_LINEAR = ("linear_time_constant", "s")  # stands for the force ratio where the lag is linear
_CONTACT = ("contact_zero", "mm")
_CHIPS = "a hold at a second rate tells chips from sliding"
_LONGER = "longer holds, at rates far apart, tell more"
_STEP = "a step of the rate while grinding tells the lags"
_HINTS = {
    ENERGY: _CHIPS,
    AREA: _CHIPS,
    PLOUGHING: "a spark-out tells ploughing",
    IDLE: f"an air cut of {AIR} samples, before contact or before the first feed, tells idle_power",
    WEAR: "long holds at two rates tell wear from deflection",
    FEED_LAG: _STEP,
    POWER_LAG: _STEP,
}
_POOR = 0.03  # chosen: relative standard deviation beyond which chips and sliding are told apart poorly


def machine(
    data: Any, problem: CycleProblem, part: int | Sequence[int] | None, power_max: float | None
) -> idf.Estimate:
    """Values of a machine; see `plunge.identify`."""
    each = cycles(data, power=True, part=part)
    checked = refuse_other_units(each, problem, data)
    reasons = [(cycle, _fault(cycle, power_max)) for cycle in each]
    good = [cycle for cycle, reason in reasons if not reason]
    lost = [f"{cycle.label}: {reason}".removeprefix(": ") for cycle, reason in reasons if reason]
    if not good:
        return not_identified(*_named(problem)[0], lost[0])
    with one_blas_thread():
        fit = started(good, problem, power_max)
        left = _settled(fit, fit.model.believed(problem.drive))
        found = _estimate(fit, left, good, problem)
    notes = [f"from {counted(len(good), 'part')}", *([f"{len(lost)} left out, {lost[0]}"] if lost else [])]
    notes += _untold(fit, problem, left) or _poorly(found, good)
    if not checked:  # first where the fit is bad, since a wrong unit may be why
        notes.insert(len(notes) if found.ok else 0, CANNOT_TELL)
    if not found.ok:
        notes.insert(0, found.message)
    return found.replace(message="; ".join(notes))


def _fault(cycle: Cycle, power_max: float | None) -> str:
    """Reason why a part is unusable; empty: it is usable."""
    if not np.any(np.isfinite(cycle.grinding_power) & ~clipped_rows(cycle, power_max)):
        return "there is no power, or all of it is clipped"
    return fault(cycle)


def _named(problem: CycleProblem) -> list[tuple[str, str]]:
    """Names and units of the shared values."""
    first = _NAMES[RATIO] if problem.model.linear_time_constant is None else _LINEAR
    return [first, *(_NAMES[place] for place in range(RATIO + 1, SHARED))]


def _settled(fit: MachineFit, believed: Floats) -> list[int]:
    """Fit; return the places left at what is believed.

    derived: cutting, the wheel takes the idle power and that of ploughing, and size grows from contact less
    the deflection of ploughing. A loaded wheel shows the same where ploughing takes some watts more, the idle
    power as many less, and the wheel begins as much deeper. Only the air tells them apart.
    """
    left = fitted(fit, believed)
    return left if air(fit).size >= AIR else [*{*left, IDLE, PLOUGHING}]


def _estimate(
    fit: MachineFit, left: list[int], each: Sequence[Cycle], problem: CycleProblem
) -> MachineEstimate:
    """Values and covariance of a fit; infinite variances of what is left at what is believed."""
    count = len(each)
    contacts = [(f"{_CONTACT[0]}_{k}" * (count > 1) or _CONTACT[0], _CONTACT[1]) for k in range(count)]
    names, units = zip(*(_named(problem) + contacts), strict=True)
    values = np.concatenate([fit.values[0, :SHARED], fit.values[:, CONTACT]])
    values[left] = fit.model.believed(problem.drive)[left]
    noise, doubts = declared(each, problem), problem.uncertainty
    freedom, (size, power) = fit.freedom(), _residuals(fit)
    effective = [serial.effective(n, 0, rho) for n, rho in zip(freedom, fit.noise.correlation, strict=True)]
    good = goodness(fit, freedom, noise)
    ends = [_at_its_end(*_named(problem)[place], fit.values[0, place]) for place in fit.at_the_end()]
    told, rounded = (doubts.size_sd > 0.0, doubts.power_sd > 0.0), rounding.most(each) / noise.sd[0] ** 2
    wrong = "; ".join(ends + misfit(good, effective, noise, told, rounded))
    return MachineEstimate(
        names,
        values,
        _all_covariances(fit, left),
        idf.Status.MISFIT if wrong else idf.Status.OK,
        f"{idf.Status.MISFIT}: {wrong}" if wrong else "",
        units,
        freedom=sum(effective),
        fit=good,
        time=np.concatenate([each.cycle.time for each in fit.parts]),
        size_residual=size,
        power_residual=power,
    )


def _at_its_end(name: str, unit: str, value: float) -> str:
    """Sentence on a positive value that has none of its own."""
    return f"{name} runs to {value:.3g} {unit}".removesuffix(" 1") + ", the end of its range"


def _all_covariances(fit: MachineFit, left: list[int]) -> Floats:
    """Covariance of the shared values and the contacts; infinite variances of the places that are left."""
    count = len(fit.parts)
    told = [place for place in fit.free if place not in left] + list(range(SHARED, SHARED + count))
    fitted_places = [k for k, place in enumerate(fit.free) if place not in left]
    fitted_places += range(len(fit.free), fit.count, 2)
    covariance = np.diag(np.full(SHARED + count, np.inf))
    covariance[np.ix_(told, told)] = _covariance(fit)[np.ix_(fitted_places, fitted_places)]
    if IDLE in left and PLOUGHING not in fit.free:  # derived: ploughing takes 0 to all of it, evenly
        power = fit.model.at_contact(fit.values[0])
        covariance[SHARED:, SHARED:] += fit.model.pressed(power, fit.values[0]) ** 2 / 3.0
    return covariance


def _covariance(fit: MachineFit) -> Floats:
    """Covariance of the fitted values, by the noise that the residuals show and the rounding of the gauge."""
    u, s, vt = np.linalg.svd(fit.slopes_there(), full_matrices=False)
    return np.asarray(sum(_by_part(fit, (vt.T * (fit.scales()[:, None] / s)) @ u.T)))


def _by_part(fit: MachineFit, weights: Floats) -> Iterator[Floats]:
    """Covariance of the fitted values by size and power of each part, for the weights of the residuals."""
    begin, sd, rho = 0, fit.noise.sd[0], fit.noise.correlation[0]
    for each in fit.parts:
        read, apart = each.cycle.size[each.sized], each.channels()[0][3]
        middle = begin + read.size
        end = middle + int(each.powered.sum())
        by_size, by_power = weights[:, begin:middle], weights[:, middle:end]
        own = rounding.unrounded(rho, read, sd, fit.count)
        moved = fit.noise.white_back(by_size, 0, apart) / sd
        yield rounding.covariance(read, moved, apart, own, rho, sd) + by_power @ by_power.T
        begin = end


def _residuals(fit: MachineFit) -> Any:
    """Readings of all rows less the model: sizes (mm) and powers (W)."""
    off = [
        np.column_stack([each.cycle.size, np.where(each.usable, each.cycle.grinding_power, np.nan)])
        - response
        for each, response in zip(fit.parts, fit.responses(), strict=True)
    ]
    return np.concatenate(off).T


def _untold(fit: MachineFit, problem: CycleProblem, left: list[int]) -> list[str]:
    """Note on the values that are left at what is believed, with the experiments that would tell them."""
    if not left:
        return []
    names = ", ".join(_named(problem)[place][0] for place in sorted(left))
    asked = [
        place for place in sorted(left) if place in _HINTS and (place, IDLE in left) != (PLOUGHING, True)
    ]
    notes = [f"not told, and left as believed: {names}", *dict.fromkeys(_HINTS[place] for place in asked)]
    return notes + ([_together(fit, problem)] if IDLE in left else [])


def _together(fit: MachineFit, problem: CycleProblem) -> str:
    """Sentence on the power that idling and ploughing take, which is told without an air cut."""
    at_contact = fit.model.at_contact
    told, believed = at_contact(fit.values[0]), at_contact(fit.model.believed(problem.drive))
    return f"idle_power and ploughing_force take {told:.0f} W together, {believed:.0f} W as believed"


def _poorly(found: MachineEstimate, each: Sequence[Cycle]) -> list[str]:
    """Note where chips and sliding are hardly told apart, with the experiment that tells more."""
    shares = {
        name: found.sd[found.names.index(name)] / found[name]
        for name in ("specific_energy", "wear_flat_area")
    }
    if max(shares.values()) <= _POOR:
        return []
    told = ", ".join(f"{name} \N{PLUS-MINUS SIGN} {100 * share:.1f} %" for name, share in shares.items())
    advice = _CHIPS if max(len(_held_rates(cycle)) for cycle in each) < 2 else _LONGER
    return [f"chips and sliding are told apart poorly ({told}): {advice}"]


def _held_rates(cycle: Cycle) -> set[float]:
    """Rates (mm/s) above 0 that are held for some readings."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(cycle.command_rate)) + 1, [cycle.command_rate.size]])
    rates = cycle.command_rate[edges[:-1]]
    return {
        float(rate) for rate, rows in zip(rates, np.diff(edges), strict=True) if rate > 0 and rows >= MOVING
    }
