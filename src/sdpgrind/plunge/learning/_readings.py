"""Slack, roundness and power of a part from its log, corrected for the bias of noise."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import ndtr

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._plant import part_kernels as kernels
from sdpgrind.plunge._plant.simulation import simulated_part
from sdpgrind.plunge._stages.controller import StagedController

PARTS = 64  # chosen: simulated parts for the effect of noise; fewer scatter the margins
_READ = ("size", "grinding_power", "power_saturated", "infeed_rate_planned")
_WINDOW = 1.0  # chosen: window of the slope of the unexplained size, s; shorter passes noise into the rate
_SIGMAS, _POINTS = 6.0, 100  # chosen: range (standard deviations) and nodes of the maximum's distribution
# derived: median magnitude of second differences of white noise over its standard deviation
_SPREAD = 0.6745 * np.sqrt(6.0)


def measured_slack(part_log: Any, controller: CycleController) -> float:
    """Balance slack (8), mm: least measured stock less damage by measured power; NaN without balance.

    Clipped and missing readings are left out.
    """
    return _least(_readings(_columns(part_log), controller))


def at_size(part_log: Any) -> bool:
    """Whether the controller ground the part to size."""
    return bool(part_log.column("controller", "remaining_planned")[-1] <= 0.0)


def scatter_of_slack(part_log: Any, controller: CycleController) -> float:
    """Standard deviation of one reading of the slack, mm; NaN: too few readings."""
    return _scatter(_readings(_columns(part_log), controller))


def _columns(part_log: Any) -> dict[str, Floats]:
    names = ("size", "grinding_power", "power_saturated", "balancing_command", "infeed_rate_planned")
    return {name: part_log.column("controller", name) for name in names}


def _readings(columns: Mapping[str, Floats], controller: CycleController) -> Floats:
    used = (columns["balancing_command"] > 0) & (columns["power_saturated"] == 0)
    used &= np.isfinite(columns["size"]) & np.isfinite(columns["grinding_power"])
    rate = columns["infeed_rate_planned"][used]
    power = columns["grinding_power"][used] - controller.problem.drive.idle_power
    burn = np.maximum(controller.problem.model.burn_depth(rate, power), 0.0)
    return np.asarray(controller.problem.stock - columns["size"][used] - burn)


def _least(readings: Floats) -> float:
    return float(readings.min()) if readings.size else float("nan")


def _scatter(readings: Floats) -> float:
    """Standard deviation by second differences, almost free of smooth motion."""
    return float(np.sqrt(np.mean(np.diff(readings, 2) ** 2) / 6)) if readings.size > 2 else float("nan")


@lru_cache(maxsize=512)
def noise_of_slack(controller: CycleController) -> tuple[float, float, float]:
    """Mean bias and standard deviation of the measured slack, and that of one reading, mm, by simulation.

    The parts of the controller's own model have its noise, whose minimum is biased low. Without balance:
    zeros.
    """
    rng = np.random.default_rng(0)
    parts = [
        (true - _least(readings), _scatter(readings))
        for true, readings in (_true_and_measured(controller, rng) for _ in range(PARTS))
    ]
    off, each = np.array([part for part in parts if np.all(np.isfinite(part))]).reshape(-1, 2).T
    return (
        (float(np.mean(off)), float(np.std(off)), float(np.mean(each))) if len(off) > 1 else (0.0, 0.0, 0.0)
    )


@lru_cache(maxsize=512)
def scatter_of_roundness(controller: CycleController) -> float:
    """Upper semideviation of the out-of-roundness, mm, by simulation, plus two standard errors.

    The parts of the controller's own model have its noise and unknown contacts.
    """
    rng, model = np.random.default_rng(0), controller.problem.model
    contacts = controller.problem.uncertainty.contact_zero_sd * rng.standard_normal(PARTS)
    ends = [simulated_part(controller.problem, controller.law, rng=rng, contact=each)[0] for each in contacts]
    left = [model.roundness(end[kernels.RATE]) for end in ends]
    beyond = np.array(left) - np.mean(left)
    beyond = beyond[beyond > 0]
    return float(np.sqrt(np.mean(beyond**2)) * (1 + 2 / np.sqrt(2 * beyond.size))) if beyond.size else 0.0


def _true_and_measured(controller: CycleController, rng: np.random.Generator) -> tuple[float, Floats]:
    """True balance slack and its readings (mm) of a simulated part."""
    state, columns = simulated_part(controller.problem, controller.law, rng=rng)
    return float(state[kernels.SLACK]), _readings(columns, controller)


def measured(part_log: Any, controller: StagedController) -> dict[str, float]:
    """Burned layer and out-of-roundness (mm) and greatest power (W) of a part; NaN without readings.

    The burned layer is the maximum of damage, by measured power, less measured stock; negative: all removed.
    Its infeed rate is that of the model, corrected by the slope of the unexplained size.
    """
    read = _StageReadings({name: part_log.column("controller", name) for name in _READ}, controller)
    own = _StageReadings(simulated_part(controller.problem, controller.law)[1], controller)
    size_sd, power_sd = read.noise
    return {
        "burned_layer": read.burned_layer - own.layer_bias(size_sd, power_sd),
        "roundness": float(part_log.figure("roundness")[-1]),
        "grinding_power": read.grinding_power - own.power_bias(power_sd),
    }


class _StageReadings:
    """Rows of a part with size and power at rates where the work can burn."""

    def __init__(self, columns: Mapping[str, Floats], controller: StagedController) -> None:
        model = controller.problem.model
        low, high = model.burn_onset
        # above the artefact of ploughing
        fast = np.sqrt(low * min(high, controller.problem.command_rate_max))
        rate = _rate(columns["size"], columns["infeed_rate_planned"], controller.problem.sample_time)
        used = np.isfinite(columns["size"]) & np.isfinite(columns["grinding_power"]) & (rate > fast)
        self.rate = rate[used]
        size, power, clipped = (columns[name][used] for name in _READ[:3])
        self.power = power - controller.problem.drive.idle_power
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
        """Standard deviation of size (mm) and power (relative), by second differences."""
        if self.rate.size < 10:
            return 0.0, 0.0
        bends = np.diff(self.size, 2), np.diff(np.log(np.maximum(self.power, 1e-9)), 2)
        size, power = (float(np.median(np.abs(each))) / _SPREAD for each in bends)
        return size, power

    def layer_bias(self, size_sd: float, power_sd: float) -> float:
        """Bias of the burned layer by noise, mm."""
        if not np.isfinite(self.burned_layer) or size_sd + power_sd == 0:
            return 0.0
        slope = (self.model.burn_depth(self.rate, self.power * 1.001) - self.damage) / 0.001
        spread = np.hypot(size_sd, slope * power_sd)
        return _expected_maximum(self.damage, self.left, spread) - self.burned_layer

    def power_bias(self, power_sd: float) -> float:
        """Bias of the greatest power by noise, W."""
        if power_sd == 0 or not self.power.size:
            return 0.0
        return (
            _expected_maximum(self.power, np.zeros(self.power.size), power_sd * self.power)
            - self.grinding_power
        )


def _rate(size: Floats, foreseen: Floats, step: float) -> Floats:
    """Infeed rate (mm/s) of the model, corrected by the slope of the unexplained size (mm)."""
    read, half = np.isfinite(size), round(0.5 * _WINDOW / step)
    if read.sum() < 4 * half:
        return foreseen
    gone = np.concatenate([[0.0], np.cumsum(0.5 * (foreseen[1:] + foreseen[:-1]) * step)])
    index = np.arange(size.size)
    unexplained = np.interp(index, index[read], (size - gone)[read])
    weights = np.arange(-half, half + 1.0)
    # least squares in each window
    slope = np.correlate(unexplained, weights / (weights @ weights * step), "valid")
    return np.asarray(foreseen + np.pad(slope, half, "edge"))


def _expected_maximum(value: Floats, less: Floats, sd: Floats) -> float:
    """Expected maximum of value - less with noise in the values; only values above 0 count."""
    top, reach = value - less, _SIGMAS * sd
    begin = float(np.max((top - reach)[value > 0]))
    near = (top + reach > begin) & (value + reach > 0)
    end = float(np.max((top + reach)[near]))
    level = np.linspace(begin, end, _POINTS)
    below = ndtr((np.maximum(level[:, None] + less[near], 0.0) - value[near]) / sd[near]).prod(axis=1)
    return begin + float(np.trapezoid(1 - below, level))
