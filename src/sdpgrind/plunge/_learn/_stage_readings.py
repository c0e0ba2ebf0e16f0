"""What a part of three stages left of its limits: measured, and cleared of what noise does to a greatest value."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.special import ndtr

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._control.foreseen import foreseen
from sdpgrind.plunge._stages.controller import StagedController

_READ = ("size", "grinding_power", "power_saturated", "infeed_rate_planned")
_WINDOW = 1.0
"""Time over which the size that the model does not explain is smoothed, s."""
_SIGMAS, _POINTS = 6.0, 100
_SPREAD = 0.6745 * np.sqrt(6.0)
"""Median of the magnitude of second differences of white noise, in its standard deviations."""


def measured(part_log: Any, controller: StagedController) -> dict[str, float]:
    """Return burned layer and out-of-roundness (mm) and greatest power (W) of a part; NaN where there is no reading.

    The burned layer is the greatest of depth of damage, from measured power, less measured stock: negative where all came off.
    The infeed rate that goes with the power is that of the model, corrected by the slope of what size it does not explain.
    """
    read = _Readings({name: part_log.column("controller", name) for name in _READ}, controller)
    own = _Readings(foreseen(controller.problem, controller.law)[1], controller)
    size_sd, power_sd = read.noise
    return {
        "burned_layer": read.burned_layer - own.layer_bias(size_sd, power_sd),
        "roundness": float(part_log.figure("roundness")[-1]),
        "grinding_power": read.grinding_power - own.power_bias(power_sd),
    }


class _Readings:
    """Rows of a part with size and power, once the wheel cuts as fast as it could burn."""

    def __init__(self, columns: Mapping[str, Floats], controller: StagedController) -> None:
        model = controller.problem.model
        low, high = model.burn_onset
        fast = np.sqrt(low * min(high, controller.problem.command_rate_max))  # well above the artefact of ploughing
        rate = _rate(columns["size"], columns["infeed_rate_planned"], controller.problem.sample_time)
        used = np.isfinite(columns["size"]) & np.isfinite(columns["grinding_power"]) & (rate > fast)
        self.rate = rate[used]
        size, self.power, clipped = (columns[name][used] for name in _READ[:3])
        self.model, self.left, self.size = model, controller.problem.stock - size, size
        damage = model.burn_depth(self.rate, self.power)
        foreseen = model.burn_depth(self.rate)
        self.damage = np.where(clipped > 0, np.maximum(damage, foreseen), damage)

    @property
    def burned_layer(self) -> float:
        """Greatest damage less stock, mm."""
        layers = (self.damage - self.left)[self.damage > 0]
        return float(layers.max()) if layers.size else float("nan")

    @property
    def grinding_power(self) -> float:
        """Greatest power, W."""
        return float(self.power.max()) if self.power.size else float("nan")

    @property
    def noise(self) -> tuple[float, float]:
        """Of size (mm) and power (relative), from second differences, which a smooth course leaves alone."""
        if self.rate.size < 10:
            return 0.0, 0.0
        bends = np.diff(self.size, 2), np.diff(np.log(np.maximum(self.power, 1e-9)), 2)
        size, power = (float(np.median(np.abs(each))) / _SPREAD for each in bends)
        return size, power

    def layer_bias(self, size_sd: float, power_sd: float) -> float:
        """By how much noise makes the burned layer seem deeper, mm."""
        if not np.isfinite(self.burned_layer) or size_sd + power_sd == 0:
            return 0.0
        slope = (self.model.burn_depth(self.rate, self.power * 1.001) - self.damage) / 0.001
        spread = np.hypot(size_sd, slope * power_sd)
        return _greatest(self.damage, self.left, spread) - self.burned_layer

    def power_bias(self, power_sd: float) -> float:
        """By how much noise makes the greatest power seem greater, W."""
        if power_sd == 0 or not self.power.size:
            return 0.0
        return _greatest(self.power, np.zeros(self.power.size), power_sd * self.power) - self.grinding_power


def _rate(size: Floats, foreseen: Floats, step: float) -> Floats:
    """Infeed rate (mm/s) from that of the model and readings of size (mm)."""
    read, half = np.isfinite(size), round(0.5 * _WINDOW / step)
    if read.sum() < 4 * half:
        return foreseen
    gone = np.concatenate([[0.0], np.cumsum(0.5 * (foreseen[1:] + foreseen[:-1]) * step)])
    index = np.arange(size.size)
    unexplained = np.interp(index, index[read], (size - gone)[read])
    weights = np.arange(-half, half + 1.0)
    slope = np.correlate(unexplained, weights / (weights @ weights * step), "valid")  # of the line nearest to a window
    return np.asarray(foreseen + np.pad(slope, half, "edge"))


def _greatest(value: Floats, less: Floats, sd: Floats) -> float:
    """Mean of the greatest of value - less with noise in the values, of which only those above 0 count."""
    top, reach = value - less, _SIGMAS * sd
    begin = float(np.max((top - reach)[value > 0]))
    near = (top + reach > begin) & (value + reach > 0)
    end = float(np.max((top + reach)[near]))
    level = np.linspace(begin, end, _POINTS)
    below = ndtr((np.maximum(level[:, None] + less[near], 0.0) - value[near]) / sd[near]).prod(axis=1)
    return begin + float(np.trapezoid(1 - below, level))
