"""The estimated error of the search between levels, against levels 24 times as fine."""

from statistics import median

import numpy as np

from sdpgrind import sdp

FINER = 24


def drawn(seed, shifted=False):
    """A random problem as a function of its number of levels, and that number."""
    rng = np.random.default_rng(seed)
    levels, stages = int(rng.integers(6, 50)), int(rng.choice([1, 2, 3, 5, 8, 12]))
    nodes, scatter = int(rng.integers(41, 161)), float(rng.uniform(0.08, 0.4))
    under, over, charge = rng.uniform([0.5, 2.0, 0.0], [3.0, 12.0, 0.1])
    axis = sdp.Axis("x", -1.0, 2.0, nodes, "mm", below="hold", above="hold")
    noise = {"noise": sdp.Normal(1.0, scatter)}
    to = sdp.Sampled(lambda s, c, e: (s.x - c.by * e.noise,), noise, points=7, compiled=False)
    if shifted:
        to = sdp.Shift("x", lambda s, c: sdp.Normal(c.by, scatter * c.by))
    stop = sdp.Stop("stop", lambda s: np.where(s.x > 0, under * s.x, -over * s.x))
    low = float(rng.choice([0.0, 0.1]))

    def problem(count):
        move = sdp.Move("cut", {"by": sdp.Levels(low, 1.8, count)}, to, charge=charge)
        return sdp.Problem([axis], [move], [stop], sdp.Stages(stages, 1.0))

    return problem, levels


def test_the_error_of_the_search_of_sampled_moves_covers_and_is_not_far_too_wide():
    """Their cost has a kink at each control from which a point of the noise ends at a node."""
    wide = []
    for seed in range(20):
        problem, levels = drawn(seed)
        plan, fine = sdp.plan(problem(levels)), sdp.plan(problem((levels - 1) * FINER + 1))
        true = np.max(np.abs(plan.table.value - fine.table.value))
        assert plan.table.search_error >= true, seed
        wide.append(plan.table.search_error / true)
    assert median(wide) < 5.0


def test_the_stated_error_of_the_search_of_shifts_covers_where_its_estimate_does_not():
    """A kink of the value-to-go that a law hardly smooths: cubic and parabola agree on what both miss."""
    within, below = [], []
    for seed in range(20):
        problem, levels = drawn(seed, shifted=True)
        plan, fine = sdp.plan(problem(levels)), sdp.plan(problem((levels - 1) * FINER + 1))
        true = np.max(np.abs(plan.table.value - fine.table.value))
        within.append(true <= plan.search_error)
        below.append(true <= plan.table.search_error)
    assert sum(within) >= 19  # 95 %
    assert sum(below) < 19
