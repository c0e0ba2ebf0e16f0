"""Commands recorded at the begin, the end or the centre of their interval: the bias, and what tells it."""

import numpy as np
import pytest
from cycle_readings import found
from plunge_inside import cycles as _records
from plunge_inside import of_cycles
from scipy import signal

from sdpgrind.base.columns.commands import held

STEP, COUNT = 0.05, 220
TIME = STEP * np.arange(COUNT)
RATE = np.select([TIME < 4.2 - 1e-9, TIME < 5.7 - 1e-9], [0.04, 0.01], 0.0)
LED = np.append(0.0, RATE[:-1])  # command that led to each row; none to the first
RECORDED = {"begin": RATE, "end": LED, "centre": 0.5 * (LED + RATE)}


def log(place, tau=1.7, noise=0.0):
    pole = np.exp(-STEP / tau)
    infeed = np.append(0.0, np.cumsum(RATE[:-1])) * STEP
    deflection = signal.lfilter([0.0, (1 - pole) * tau], [1.0, -pole], RATE)
    return {"time": TIME, "command_rate": RECORDED[place], "size": infeed - deflection + noise}


@pytest.mark.parametrize(("place", "wrong"), [("begin", 1.7), ("end", 1.6374), ("centre", 1.6685)])
def test_the_bias_without_noise(place, wrong):
    """Two ways: the whole estimator against numbers that another solver gave; then commands put right."""
    data = log(place)
    assert found(data)["time_constant"] == pytest.approx(wrong, abs=5e-4)
    (cycle,) = _records.cycles(data)
    assert of_cycles([cycle]).alignment.preferred == place
    right = data | {"command_rate": held(cycle.command_rate, place)}
    assert found(right)["time_constant"] == pytest.approx(1.7, abs=5e-4)


def test_parts_are_added():
    """Each part has its own contact zero and first rate, all one time constant: the decision is surer."""
    rng = np.random.default_rng(0)
    each = [log("end", noise=1e-3 * rng.standard_normal(COUNT)) for _ in range(4)]
    cycles = [_records.cycles(data)[0] for data in each]
    together = of_cycles(cycles).alignment
    alone = [of_cycles([cycle]).alignment for cycle in cycles]
    assert together.preferred == "end"
    assert together.decisiveness > np.median([one.decisiveness for one in alone])


def test_noise_that_is_filtered_and_rounded_decides_less():
    """Half a step of correlation 0.8 with its rounding, which shows 0.6, scatters 1.75 times as much as 0.6 does.

    That is of slow differences, by (0.75 x 9 + 0.25)/4; of seven files, whose correlations are 0.05 off.
    """
    spread = []
    for seed in range(7):
        white = np.random.default_rng(seed).normal(0.0, 5e-4 * 0.6, COUNT + 100)
        data = log("end", noise=signal.lfilter([1.0], [1.0, -0.8], white)[100:])
        for size in (data["size"], np.round(data["size"], 3)):
            (cycle,) = _records.cycles(data | {"size": size})
            spread.append(of_cycles([cycle]).alignment.needed * (COUNT - 2) / 4)
    assert np.median(np.reshape(spread, (7, 2)), axis=0) == pytest.approx([1.0, 1.75], rel=0.2)
