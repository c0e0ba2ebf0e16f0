"""Experiments that would tell more of the lag, with the interval that they would leave."""

from collections.abc import Sequence
from math import ceil

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.plunge._doubts.alignment import Aligned
from sdpgrind.plunge._doubts.lag import LagFit, LagPart, information
from sdpgrind.plunge._identify.cycles import Cycle

_LONG = 3.0  # chosen: time constants of a spark-out after which 5 % of the deflection is left
_GAIN = 0.8  # chosen: share of the standard deviation below which an experiment is worth a sentence
_MORE = 3  # chosen: parts of an experiment


def sentences(each: Sequence[Cycle], aligned: Aligned, told: idf.Estimate) -> list[str]:
    """Return what would tell more than is `told` of the time constant: parts, a spark-out, a rate, a step."""
    found = []
    if told.ok:
        scattered = told.freedom < len(each)  # fewer than parts: the variance is that of their scatter
        found.append(_more_parts(told) if scattered else _spark_out(aligned.fit, told))
    if len({round(float(rate), 9) for cycle in each for rate in cycle.command_rate if rate > 0}) < 2:
        found.append(
            "Readings at a second infeed rate would tell whether the lag is the same at other rates."
        )
    if not aligned.alignment.sure:
        found.append(
            "A step of the command within the part (roughing to finishing, finishing to spark-out), or rows"
            " further apart, would tell the alignment of the commands."
        )
    return [sentence for sentence in found if sentence]


def _more_parts(told: idf.Estimate) -> str:
    """Gain of further parts, where these differ by more than noise."""
    count = int(told.freedom) + 1
    further = told.replace(covariance=told.covariance * count / (count + _MORE), freedom=told.freedom + _MORE)
    return (
        "The time constants of the parts differ by more than the noise of their sizes explains, so longer"
        f" parts would not narrow the interval; {_MORE} more parts with the same spread would, from"
        f" ±{_reach(told):.2g} s to ±{_reach(further):.2g} s (95 %)."
    )


def _spark_out(fit: LagFit, told: idf.Estimate) -> str:
    """Gain of a spark-out after the last row of each part."""
    added = ceil(_LONG * fit.time_constant)
    share = _sd(fit, float(added)) / _sd(fit, 0.0)
    if not share < _GAIN:
        return ""
    now = _reach(told)
    return (
        f"A spark-out of {added} s after the last row of each part would narrow the time constant from"
        f" ±{now:.2g} s to ±{share * now:.2g} s (95 %)."
    )


def _reach(told: idf.Estimate) -> float:
    """Half of the 95 % interval, s."""
    low, high = told.interval()[0]
    return float(high - low) / 2


def _sd(fit: LagFit, seconds: float) -> float:
    """Standard deviation of the time constant (s) if every part ended with a spark-out of `seconds`."""
    known = sum(
        information(_longer(part, seconds), value, fit.time_constant, fit.filter)
        for part, value in zip(fit.parts, fit.values, strict=True)
    )
    return float(fit.noise_sd * np.sqrt((1 - fit.filter**2) / known))


def _longer(part: LagPart, seconds: float) -> LagPart:
    step = float(np.median(np.diff(part.time)))
    time = part.time[-1] + step * np.arange(1, round(seconds / step) + 1)
    rest = np.zeros(time.size)
    rate = np.concatenate([part.command_rate[:-1], np.zeros(1), rest])  # the last command holds for no row
    return LagPart(np.concatenate([part.time, time]), rate, np.concatenate([part.size, rest]))
