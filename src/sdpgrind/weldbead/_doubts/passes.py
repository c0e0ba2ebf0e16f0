"""Readings of passes against each other and the problem: steps, products, the range of the forces."""

from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind import physics
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.removal import ENERGY, median_ratio
from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.words import amount, significant
from sdpgrind.weldbead.sequence._problem import SequenceProblem

_READ = ("removal_rate", "cut_depth", "feed_rate", "grinding_power", "tangential_force", "normal_force")
# chosen: relative; a bead that is narrower, and a power with its idle part, make less, kgf for N makes 9.8
_PRODUCT, _POWER = 0.3, 0.5
_FREE = ", or the power is that of a motor, with what it takes while the disc touches nothing: take that off"
_GAIN = 0.9  # chosen: share of the standard deviation below which more passes are worth a sentence
# chosen: passes at each end of the range; more narrow the interval little, by the root of their number
_MORE = 2


def of_power(problem: SequenceProblem, table: Any) -> list[str]:
    """Sentences on the line of removal rate over power: noise, step, clipping, more forces."""
    units = {"grinding_power": "W", "removal_rate": "mm^3/s"}
    read = idf.readings(table, units, tier="sequence", each="passes")
    power, rate = read["grinding_power"], read["removal_rate"]
    if read.points < 4 or np.ptp(power) == 0:
        return []
    rows = np.column_stack([np.ones(power.size), power])
    fit = idf.least_squares(rows, rate, throw=False)
    left = rate - rows @ fit.value
    sd = float(np.sqrt(left @ left / (rate.size - 2)))
    noise = sd / max(abs(float(fit.value[1])), 1e-9)
    found = [
        f"Passes scatter about the line of power and removal rate by {amount(sd, 'mm^3/s')}, or"
        f" {amount(noise, 'W')}; {gauge.step_words(power, noise, 'W')}.",
        gauge.clipped_sentence("grinding_power", "W", power),
        _two_more(problem, power, fit.value),
    ]
    return [sentence for sentence in found if sentence]


def _two_more(problem: SequenceProblem, power: Floats, line: Floats) -> str:
    """Gain of two more passes at the greatest admissible force and two at the least power read."""
    top = float(problem.model.grinding_power(min(problem.force_max, problem.model.peak_force)))
    ends = np.array([max(top, float(power.max())), float(power.min())])
    more = np.concatenate([power, np.repeat(ends, _MORE)])
    now, then = (float(np.sqrt(_variance(each, line))) for each in (power, more))
    if then >= _GAIN * now:
        return ""
    return (
        f"Two more passes each at {ends[0]:.0f} W and {ends[1]:.0f} W would narrow the idle power to"
        f" {100 * then / now:.0f} % of its interval."
    )


def _variance(power: Floats, line: Floats) -> float:
    """Variance of the idle power -a/b, up to that of the noise."""
    rows = np.column_stack([np.ones(power.size), power])
    slope = np.array([-1 / line[1], line[0] / line[1] ** 2])
    return float(slope @ np.linalg.inv(rows.T @ rows) @ slope)


def checks_of(problem: SequenceProblem, table: Any) -> list[str]:
    """Sentences on products of columns that contradict the problem, and on forces beyond its limit."""
    model, found = problem.model, []
    read = {name: np.asarray(table[name], dtype=float) for name in _READ if name in table}
    if {"removal_rate", "cut_depth", "feed_rate"} <= read.keys():
        product = model.bead_width * read["cut_depth"] * read["feed_rate"]
        found.append(
            _ratio(
                "removal_rate", "bead_width x cut_depth x feed_rate", read["removal_rate"] / product, _PRODUCT
            )
        )
    elif {"grinding_power", "cut_depth", "feed_rate"} <= read.keys():
        rate = model.bead_width * read["cut_depth"] * read["feed_rate"]
        found.append(_unusual_energy(median_ratio(read["grinding_power"], rate)))
    if {"grinding_power", "tangential_force"} <= read.keys():
        torque = read["tangential_force"] * model.disk_radius
        product = np.asarray(physics.disk_power(torque, model.free_speed, model.speed_droop))
        found.append(
            _ratio(
                "grinding_power",
                "tangential_force x disc speed",
                read["grinding_power"] / product,
                _POWER,
                greater=_FREE,
            )
        )
    if "normal_force" in read:
        force = read["normal_force"]
        low, high = float(np.nanmin(force)), float(np.nanmax(force))
        found.append(
            f"Forces of {low:.3g} to {high:.3g} N were read; the problem grinds with"
            f" {model.threshold_force:.3g} to {problem.force_max:.3g} N."
        )
    return [sentence for sentence in found if sentence]


def _unusual_energy(energy: float) -> str:
    """Sentence on a specific energy (J/mm^3) that grinding does not have; NaN: not known."""
    low, high = ENERGY
    if low <= energy <= high or energy != energy:
        return ""
    return (
        f"grinding_power over bead_width x cut_depth x feed_rate is a specific energy of {energy:.3g} J/mm^3;"
        f" usual are {low:g} to {high:g}: a unit, as inches taken for mm, or a size of the problem, is wrong."
    )


def _ratio(name: str, product: str, ratio: Floats, tolerance: float, greater: str = "") -> str:
    """Sentence on a median ratio that is not 1; `greater`: a further cause of one above 1."""
    middle = float(np.nanmedian(ratio))
    if abs(middle - 1) <= tolerance:
        return ""
    causes = f"a unit, or a size of the problem, is wrong{greater if middle > 1 else ''}"
    return f"{name} is {significant(middle, 3)} times {product}: {causes}."
