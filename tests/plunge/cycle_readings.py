"""Readings of a linear machine for tests of identification."""

import numpy as np

from sdpgrind import plunge

TAU, STEP, RATE, LONG = 1.935, 0.04, 0.0448, 6.4
TIME = np.arange(round(LONG / STEP) + 1) * STEP
SIZE = RATE * (TIME - TAU * (1 - np.exp(-TIME / TAU)))
NOMINAL = plunge.preset("simulation")
EXPERIMENT = plunge.preset("experiment")


def cycle(size=SIZE, time=TIME, command_rate=None, power=None):
    u = np.full(time.size, RATE) if command_rate is None else command_rate
    return {"time": time, "command_rate": u, "size": size} | (
        {} if power is None else {"grinding_power": power}
    )


def noisy(sd, seed, offset=0.0):
    return cycle(SIZE + offset + np.random.default_rng(seed).normal(0.0, sd, SIZE.size))


def found(data, **options):
    return plunge.identify(data, "time_constant", **options)


def spread(sd, count, offset=0.0, **options):
    """Mean and standard deviation of the estimates over seeds, and mean of their own standard deviations."""
    each = [found(noisy(sd, seed, offset), **options) for seed in range(count)]
    values = np.array([one["time_constant"] for one in each])
    return values.mean(), values.std(ddof=1), np.sqrt(np.mean([one.covariance[0, 0] for one in each]))


def cramer_rao(sd, long, first=0, touched=False):
    """Least standard deviation of an unbiased estimate with an unknown offset, and touch-in: every 0.04 s."""
    t = STEP * np.arange(first, round(long / STEP) + 1)
    slope = -RATE * (1 - np.exp(-t / TAU) * (1 + t / TAU))
    known = np.stack([np.ones_like(t), 1 - np.exp(-t / TAU)][: 1 + touched], axis=1)
    return sd / np.linalg.norm(slope - known @ np.linalg.lstsq(known, slope, rcond=None)[0])
