"""The fastest point that does not burn, as the adaptive grinder knows it: closed form, ends of ranges, brute
force.
"""

import numpy as np
import pytest
from adaptive_fakes import NOMINAL, best_rate, burning, needed, rotation_on_locus

from sdpgrind import physics
from sdpgrind.locus._plant.truth import Ranges, best_point, best_rates

RANGES = Ranges(0.05, 0.4, 63.0)


def test_the_best_point_is_on_the_locus():
    for area in (0.0055, 0.006, 0.0075, 0.0099):
        rate, rotation = best_point(NOMINAL, RANGES, area)
        assert rate == pytest.approx(best_rate(area), rel=1e-10)
        assert rotation == pytest.approx(rotation_on_locus(best_rate(area)), rel=1e-5)


@pytest.mark.parametrize(("low", "high"), [(0.4, 8.0), (14.0, 63.0)])
def test_the_best_point_at_an_end_of_the_range(low, high):
    rate, rotation = best_point(NOMINAL, Ranges(0.1, low, high), 0.006)
    assert rotation == pytest.approx(min(max(rotation_on_locus(best_rate(0.006)), low), high), rel=1e-6)
    assert burning(rate, rotation) == pytest.approx(needed(rate, rotation, 0.006), rel=1e-6)


def test_the_best_point_of_another_sliding_law_by_brute_force():
    process = NOMINAL.replace(power=physics.GrindingPower(sliding=physics.DongSliding()))
    rates, rotations = np.meshgrid(np.geomspace(1e-3, 0.1, 2001), np.geomspace(0.4, 63.0, 201))
    free = process.grinding_power(rates, rotations, 0.02) < process.burning_power(rates, rotations)
    assert best_point(process, RANGES, 0.02)[0] == pytest.approx(min(rates[free].max(), 0.05), rel=5e-3)


def test_there_may_be_no_best_point():
    assert best_point(NOMINAL, RANGES, 0.05)[0] == 0.0
    assert np.isnan(best_rates(NOMINAL, RANGES, np.array([0.005, 0.05]))).all()
    assert np.isnan(best_rates(NOMINAL, RANGES, np.array([0.05, 0.05]))).all()
    assert best_point(NOMINAL, RANGES._replace(infeed_rate_max=0.002), 0.006)[0] == 0.002
