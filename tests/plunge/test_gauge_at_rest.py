"""A gauge in steps that keeps its reading: a work at rest is not a frozen gauge, and its rounding does not average out."""

import numpy as np
import pytest
from cycle_readings import NOMINAL, cycle, found

from sdpgrind import plunge
from sdpgrind.base import serial

TAU, STEP = 1.7, 0.05
TIME = STEP * np.arange(514)  # 4.2 s at 0.04 mm/s, 1.5 s at 0.01, 20 s of spark-out
RATE = np.select([TIME < 4.2 - 1e-9, TIME < 5.7 - 1e-9], [0.04, 0.01], 0.0)
POLE = np.exp(-STEP / TAU)


def ground():
    deflection = np.zeros(TIME.size)
    for k in range(TIME.size - 1):
        deflection[k + 1] = POLE * deflection[k] + RATE[k] * TAU * (1 - POLE)
    return np.append(0.0, np.cumsum(RATE[:-1])) * STEP - deflection


SIZE = ground()


def read(seed, step=1e-3, noise=1e-4):
    """Sizes of a gauge in steps that begins anywhere between two."""
    rng = np.random.default_rng(seed)
    return np.round((SIZE + rng.uniform(0, step) + rng.normal(0, noise, TIME.size)) / step) * step


def test_a_work_at_rest_is_no_frozen_gauge():
    """30 files of 1 um steps and 12 time constants of spark-out: all were refused, or told of another lag."""
    inside = []
    for seed in range(30):
        fit = found(cycle(read(seed), TIME, RATE))
        assert fit.ok and "leaves more than noise" not in fit.message
        low, high = fit.interval()[0]
        inside.append(low <= TAU <= high)
    assert sum(inside) >= 25  # of 200 files 93 to 100 %, by the noise; as if white 40 %


@pytest.mark.parametrize("what", ["contact_zero", "normal_force_ratio"])
def test_contact_and_force_ratio_of_a_work_at_rest(what):
    assert plunge.identify(cycle(read(0), TIME, RATE), what, problem=NOMINAL).ok


@pytest.mark.parametrize("at", [3.0, 5.0, 5.7, 6.7, 7.7, 8.7])
def test_a_gauge_that_freezes_is_told_in_spark_out_too(at):
    """Up to three seconds of it, when 6 um are lacking."""
    size = read(1)
    first = np.argmax(at <= TIME)
    size[first:] = size[first]
    fit = found(cycle(size, TIME, RATE), throw=False)
    assert not fit.ok and "the gauge stands still at" in fit.message


def test_noise_of_a_filter_that_hides_growth_for_a_while_is_no_frozen_gauge():
    """Half a second of equal readings, made up for in the next: 26 of 2400 files with such noise were refused, now 7."""
    size, first = read(1), np.argmax(TIME >= 4.8)
    size[first : first + 21] = np.concatenate(
        [np.full(10, size[first]), np.linspace(*size[first : first + 21 : 20], 11)]
    )
    assert found(cycle(np.round(size, 3), TIME, RATE)).ok
    size[first + 10 : first + 20] = size[first]  # a second of them that ends with a jump
    fit = found(cycle(np.round(size, 3), TIME, RATE), throw=False)
    assert not fit.ok and "the gauge stands still at" in fit.message


def test_a_dwell_is_no_frozen_gauge():
    """The command stops for 6 s and goes on: the size rests until the deflection is there again."""
    rate = np.select([TIME < 4.0 - 1e-9, TIME < 10.0 - 1e-9, TIME < 13.0 - 1e-9], [0.04, 0.0, 0.02], 0.0)
    pole, deflection = np.exp(-STEP / 0.5), np.zeros(TIME.size)
    for k in range(TIME.size - 1):
        deflection[k + 1] = pole * deflection[k] + rate[k] * 0.5 * (1 - pole)
    size = np.round(np.append(0.0, np.cumsum(rate[:-1])) * STEP - deflection + 3e-4, 3)
    fit = found(cycle(size, TIME, rate))
    assert fit.ok and abs(fit["time_constant"] - 0.5) < 3 * fit.sd[0]


def test_noise_as_large_as_the_step_averages_out():
    """Few readings are equal in a row then; a gauge without steps has none, and its bits stay."""
    fit = found(cycle(read(0, noise=5e-4), TIME, RATE))
    assert fit.sd[0] < 0.004


def test_the_transpose_of_the_filter():
    rng = np.random.default_rng(0)
    apart = np.concatenate([[np.inf], rng.uniform(0.5, 3.0, 6), [np.inf], rng.uniform(0.5, 3.0, 4)])
    one, other = rng.normal(size=(2, 12))
    for rho in (0.0, 0.7):
        there, back = serial.filtered(one, rho, apart), serial.filtered_back(other, rho, apart)
        assert other @ there == pytest.approx(back @ one, rel=1e-12)


@pytest.mark.parametrize("rate", [-0.5, -0.02])
def test_a_wheel_that_is_taken_off_is_told(rate):
    """The size stays where it is: a slow retreat gave 2.1 s, and a lag that differs from rate to rate; a fast one no infeed."""
    off = np.where(TIME < 12.0 - 1e-9, RATE, rate)
    size = SIZE + np.random.default_rng(0).normal(0.0, 5e-4, TIME.size)
    fit = found(cycle(size, TIME, off), throw=False)
    assert not fit.ok and "takes the wheel off the work from 12.00 s on" in fit.message


def test_a_relief_that_leaves_deflection_is_part_of_the_cycle():
    """The command goes back 20 um of 68: the wheel grinds on."""
    rate = np.where((TIME >= 4.2 - 1e-9) & (TIME < 4.7 - 1e-9), -0.04, np.where(TIME < 4.2 - 1e-9, 0.04, 0.0))
    deflection = np.zeros(TIME.size)
    for k in range(TIME.size - 1):
        deflection[k + 1] = POLE * deflection[k] + rate[k] * TAU * (1 - POLE)
    assert deflection.min() >= 0.0
    size = np.append(0.0, np.cumsum(rate[:-1])) * STEP - deflection
    fit = found(cycle(size + np.random.default_rng(0).normal(0.0, 5e-4, TIME.size), TIME, rate))
    assert fit.ok and abs(fit["time_constant"] - TAU) < 4 * fit.sd[0]


def test_a_rest_at_the_edge_of_a_step_shares_an_error_too():
    """A lag of 0.4 s and 20 s of rest, an eighth of a step from the edge: 7 of ten intervals held it."""
    pole, deflection = np.exp(-STEP / 0.4), np.zeros(TIME.size)
    for k in range(TIME.size - 1):
        deflection[k + 1] = pole * deflection[k] + RATE[k] * 0.4 * (1 - pole)
    size, inside = np.append(0.0, np.cumsum(RATE[:-1])) * STEP - deflection, []
    for seed in range(10):
        noise = np.random.default_rng(seed).normal(0.0, 1e-4, TIME.size)
        read = np.round(size - size[-1] + 0.375e-3 + noise, 3)
        low, high = found(cycle(read, TIME, RATE)).interval()[0]
        inside.append(low <= 0.4 <= high)
    assert sum(inside) >= 9
