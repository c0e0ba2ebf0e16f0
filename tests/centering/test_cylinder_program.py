"""The linear program of a cylinder: against HiGHS over all points, ties and all, and proved by its prices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from centering.roundness import Profile, Sections
from centering.roundness import _cylinder_zone as zones
from centering.roundness._program_kernels import program

KINDS = ["MZC", "MCC", "MIC"]


def drawn(seed, size, levels):
    """Heights and slopes of sections at few heights; rounded heights tie, and repeated points do wholly."""
    rng = np.random.default_rng(seed)
    angle, tilt = rng.integers(0, 24, size) * np.pi / 12, rng.choice(np.linspace(-1, 1, levels), size)
    level = -np.column_stack([np.cos(angle), np.sin(angle)])
    height = np.round(rng.uniform(-0.5, 0.5, size), rng.integers(1, 9))
    return height, np.column_stack([level, level * tilt[:, np.newaxis]])


def by_highs(height, slope, box, sides):
    """The same program with all points."""
    ones, none = np.ones(height.size), np.zeros(height.size)
    outer, inner = np.c_[slope, -ones, none], np.c_[-slope, none, ones]
    rows = np.vstack([each for each, counts in zip((outer, inner), sides, strict=True) if counts])
    limits = np.concatenate([each for each, counts in zip((-height, height), sides, strict=True) if counts])
    cost = [0, 0, 0, 0, float(sides.outer), -float(sides.inner)]
    bounds = [(-box, box)] * 4 + [(None, None) if each else (0, 0) for each in sides]
    return linprog(cost, rows, limits, bounds=bounds, method="highs-ds").fun


@pytest.mark.parametrize("kind", KINDS)
@given(st.integers(0, 2**32 - 1), st.integers(3, 300), st.integers(1, 7), st.floats(-3, 3))
def test_least_width_with_ties(kind, seed, size, levels, box):
    """Within the tolerance of HiGHS, 1e-7 a row, whose prices add up to 2 at most."""
    height, slope = drawn(seed, size, levels)
    sides, rows, box = zones.SIDES[kind], np.empty(6, dtype=np.int64), 10.0**box
    unknown, _, solved = program(height, slope, box, *sides, rows)
    assert solved
    width = unknown[4] * sides.outer - unknown[5] * sides.inner
    moved = height + slope @ unknown[:4]
    assert not sides.outer or moved.max() <= unknown[4] + 1e-10 * max(1.0, box)
    assert not sides.inner or moved.min() >= unknown[5] - 1e-10 * max(1.0, box)
    assert np.abs(unknown[:4]).max() <= box * (1 + 1e-9) + 1e-10
    assert width == pytest.approx(by_highs(height, slope, box, sides), abs=4e-7 * max(1.0, box))


@pytest.mark.parametrize("kind", KINDS)
@given(st.integers(0, 2**32 - 1), st.integers(3, 300), st.integers(1, 7))
def test_prices_prove_the_width(kind, seed, size, levels):
    """Of any step within the box, prices weigh rows so that the step falls out, but for the walls it meets."""
    height, slope = drawn(seed, size, levels)
    sides, rows, box = zones.SIDES[kind], np.empty(6, dtype=np.int64), 2.0
    unknown, prices, _ = program(height, slope, box, *sides, rows)
    assert prices.min() >= -1e-12
    n = height.size
    above, below = (rows < n), (rows >= n) & (rows < 2 * n)
    weights = np.zeros(n)
    np.add.at(weights, rows[above], prices[above])
    np.add.at(weights, rows[below] - n, -prices[below])
    assert prices[above].sum() == pytest.approx(float(sides.outer), abs=1e-12)
    assert prices[below].sum() == pytest.approx(float(sides.inner), abs=1e-12)
    proved = weights @ height - box * np.abs(weights @ slope).sum()
    assert unknown[4] * sides.outer - unknown[5] * sides.inner == pytest.approx(proved, abs=1e-11)


@pytest.mark.parametrize("spike", [123, 257, 298, 303])
def test_a_small_share_beside_a_large_one_of_the_same_ratio_is_no_cycle(spike):
    """One reading 10 µm high on a perfect cylinder of 5 x 90."""
    around = np.linspace(0.0, 2 * np.pi, 90, endpoint=False)
    reading = np.full((5, 90), 25.0)
    reading.flat[spike] += 0.01
    shaft = Sections([Profile(around, row) for row in reading], np.linspace(0.0, 30.0, 5))
    found = shaft.cylinder("MCC")
    assert 0.0 < found.cyl_t <= 0.01 + 1e-9


@pytest.mark.parametrize("seed", range(40))
def test_rows_that_nearly_repeat_are_solved(seed):
    height, slope = drawn(seed, 60, 5)
    rng = np.random.default_rng(seed)
    near = 10.0 ** rng.uniform(-12, -4)
    height = np.concatenate([height, height + near * rng.normal(size=60)])
    slope = np.vstack([slope, slope + near * rng.normal(size=slope.shape)])
    for outer, inner in ((True, True), (True, False), (False, True)):
        assert program(height, slope, 1.0, outer, inner, np.zeros(6, dtype=np.int64))[2]
