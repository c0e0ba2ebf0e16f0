"""Structure of the optimal policies of P1 to P5: the arguments of Brown (1988), chapter 5, as far as computed."""

import numpy as np
import pytest
from bead_plans import NAMES, dense, plain, table, tall

from sdpgrind import sdp, weldbead

PLACE = 0.005 + 1e-9
"""How well a position is known, mm: the spacing of the grid that it was computed on."""


def first(height, true):
    """Lowest height at which something is true, for each column."""
    assert np.all(true.any(axis=0))
    return height[np.argmax(true, axis=0)]


def test_no_grind_band_before_the_deadline():
    height, value, action = table(plain("P1"), [0, 2, 4])
    assert np.all(action.stop)
    np.testing.assert_allclose(value, np.broadcast_to(2.0 * height[:, None], value.shape), rtol=1e-15)


def test_overground_is_charged_exactly():
    depth = np.array([0.0, 1e-9, 0.01, 0.3, 5.0])
    for time in range(0, 61, 2):
        np.testing.assert_allclose(plain("P1").value(-depth, time), 10 * depth, rtol=1e-15)
    assert np.all(plain("P1").action(-depth, 60.0).stop)
    np.testing.assert_allclose(plain("P5").value(-depth, -6.0), 20 * depth**2 + 0.36, rtol=1e-15)


def test_bands_of_the_fastest_pass():
    height, value, _ = table(plain("P1"), np.arange(0, 61, 2))
    low = value[height <= 0.25]
    for b in range(1, 10):
        assert np.max(np.abs(low[:, 3 * b + 1] - low[:, 3 * b])) < 2e-6
        assert np.max(np.abs(low[:, 3 * b + 2] - low[:, 3 * b])) < 2e-6
        assert np.all(low[1:, 3 * b] < low[1:, 3 * b - 1])  # a jump down at each 6 b
    assert np.all(low[1:, 30] < low[1:, 29])


BANDS = [6, 12, 18, 24, 36, 48, 60]


def test_threshold_of_the_greatest_force():
    height, _, action = table(plain("P1"), BANDS)
    found = first(height, np.nan_to_num(action.normal_force) >= 50 - 1e-9)
    np.testing.assert_allclose(found, [0.415, 0.470, 0.505, 0.525, 0.555, 0.575, 0.595], atol=PLACE)
    assert np.all(np.diff(found) > 0)


def test_anxiety_at_the_deadline():
    found = plain("P1").action(0.2, np.array(BANDS, dtype=float)).mean_cut / 0.2
    np.testing.assert_allclose(found, [0.8039, 0.7037, 0.6602, 0.6308, 0.5852, 0.5503, 0.5223], atol=5e-4)
    assert np.all(np.diff(found) < 0)


def test_cut_fraction_is_not_constant_where_the_law_is_translated():
    policy = plain("P1")
    assert policy.action(0.05, 6.0).mean_cut / 0.05 == pytest.approx(0.66, abs=0.01)
    assert policy.action(0.3, 6.0).mean_cut / 0.3 == pytest.approx(0.82, abs=0.01)


def test_durations_finish_at_the_deadline():
    policy = plain("P1")
    for time in (6.0, 8.0, 10.0, 12.0):
        assert policy.action(1.0, time).duration == time
    assert policy.action(2.0, 24.0).duration == 16.0


def test_slowest_feed_is_not_the_rule():
    # With 24 s left a pass of 20 s leaves 4 s unused.
    costs = plain("P1").alternatives(2.0, 24.0, within=1.0)
    assert costs["16 s"] == pytest.approx(0.6333, abs=2e-4)
    assert costs["20 s"] == pytest.approx(1.0297, abs=2e-4)
    assert next(iter(costs)) == "16 s"


def test_fastest_pass_below_the_threshold():
    height, _, action = table(plain("P1"), np.arange(6, 61, 2))
    below = ~action.stop & (np.nan_to_num(action.normal_force) < 50 - 1e-6) & (height[:, None] < 0.415)
    assert np.all(action.duration[below & (action.gap > 1e-6)] == 6)
    assert np.mean(action.gap[below] > 1e-6) > 0.9


def test_expensive_time_late():
    policy = plain("P2")
    height = policy.states()[0]
    for time in (0.0, -2.0, -7.0, -30.0, -1000.5):
        assert np.all(policy.action(height, time).stop)
        np.testing.assert_allclose(policy.value(height, time), 2 * height + 0.25 * abs(time), rtol=1e-13)
    assert np.all(policy.action(height, 2.0).stop)
    large = policy.action(height[height > 1.0], 4.0)
    assert np.all(large.duration == 6) and np.all(large.normal_force == 50)


def test_expensive_time_switches_continuously():
    # A fastest pass at t s saves 2 x 0.344 $ and costs 0.25 (6 - t) $: equal at 3.248 s.
    exact = 6 - 2 * 0.344 / 0.25
    assert exact == pytest.approx(3.2480, abs=1e-12)
    problem = weldbead.preset("P2").replace(horizon=6.0)
    coarse = weldbead.plan(problem.replace(stage=0.5), tolerance=None, nodes=201)
    assert coarse.action(2.0, 3.0).stop and coarse.action(2.0, 3.5).duration == 6
    finer = weldbead.plan(problem.replace(stage=0.0625), tolerance=None, nodes=51)
    time = np.arange(0, 6, 0.0625)
    switch = time[np.argmin(finer.action(2.0, time).stop)]
    assert exact <= switch < exact + 0.0625
    gain = [coarse.alternatives(2.0, t, within=10.0) for t in (3.0, 3.5)]
    ahead = [costs["stop"] - costs["6 s"] for costs in gain]
    assert 3.0 - 0.5 * ahead[0] / (ahead[1] - ahead[0]) == pytest.approx(exact, abs=1e-9)


def test_cheap_time_grinds_on_after_the_deadline():
    policy = plain("P3")
    height, value, action = table(policy, [-2.0, -40.0, -1e6])
    np.testing.assert_allclose(first(height, ~action.stop), 0.400, atol=PLACE)
    for column in range(3):
        assert np.all(np.diff(action.stop[:, column].astype(int)) <= 0)
    base = value[:, 0] - 0.2
    np.testing.assert_allclose(value[:, 1], base + 4.0, rtol=1e-13)
    np.testing.assert_allclose(value[:, 2], base + 1e5, rtol=1e-13)
    assert policy.value(1.0, -3.3) == pytest.approx(policy.value(1.0, -2.0) + 0.13, rel=1e-13)


def test_cheap_time_slope():
    # Far from the target every pass of 20 s (1.548 mm) costs 2 $: on average 1.292 $/mm.
    policy = tall()
    height = np.arange(2.0, 6.0 - 1.548, 0.005)
    rise = policy.value(height + 1.548, -2.0) - policy.value(height, -2.0)
    np.testing.assert_allclose(rise, 2.0, rtol=5e-3)
    assert rise.mean() == pytest.approx(2.0, rel=2e-3)
    mean_slope = (policy.value(6.0, -2.0) - policy.value(2.0, -2.0)) / 4
    assert mean_slope == pytest.approx(2 / 1.548, rel=2e-3)
    assert pytest.approx(1.292, abs=5e-4) == 2 / 1.548
    slope = policy.gradient(height, -2.0)
    assert slope.min() < 1.25 and slope.max() > 1.33  # the local slope swings


def test_the_true_test_of_cheapness():
    # Late passes pay when 2/rate > (L/a)(1 + t_R/(T - t_R)) s/mm: 12.92 for T = 20 s; without the reset
    # 11.63.
    limit = 50 / 4.3 * (1 + 2 / 18)
    assert limit == pytest.approx(12.92, abs=5e-3)
    for ratio, pays in ((12.6, False), (13.2, True)):
        problem = weldbead.preset("P2").replace(lateness_charge=sdp.Linear(2 / ratio), horizon=2.0)
        policy = weldbead.plan(problem, tolerance=None, nodes=201)
        assert np.any(~policy.action(np.linspace(0, 2, 201), -10.0).stop) == pays


def test_no_result_depends_on_a_late_window():
    policy = plain("P3")
    _height, value, _ = table(policy, np.arange(0, 61, 4))
    off = []
    for window in (20.0, 40.0, 80.0):
        windowed = weldbead.plan(policy.problem.replace(late_window=window), tolerance=None, nodes=401)
        difference = table(windowed, np.arange(0, 61, 4))[1] - value
        assert difference.min() > -1e-9  # a window only takes something away
        off.append(difference.max())
    assert off[0] > off[1] >= off[2] and off[2] < 1e-9


def test_burn_limit_only_costs():
    free, limited = dense("P1"), dense("P4")
    _, least, action = table(free, np.arange(0, 61, 2))
    more = table(limited, np.arange(0, 61, 2))[1] - least
    assert more.min() > -1e-7  # what the search leaves open
    kept = kept_by(action)
    assert 0.1 < kept.mean() < 0.9
    assert np.max(np.abs(more[kept])) < 2e-6
    assert more[~kept].max() > 0.3


def kept_by(action):
    """Where the optimal controls of all states that can follow obey F <= 16 sqrt(V)."""
    ok, reachable = np.zeros((2, *action.stop.shape), dtype=bool)
    for column in range(ok.shape[1]):
        for node in range(ok.shape[0]):
            if action.stop[node, column]:
                ok[node, column] = True
            elif action.normal_force[node, column] <= 16 * np.sqrt(action.feed_rate[node, column]):
                ok[node, column] = reachable[node, column - round(action.duration[node, column] / 2)]
        reachable[:, column] = np.logical_and.accumulate(ok[:, column])
    return ok


def test_burn_limit_is_met_on_its_boundary():
    height, _, action = table(plain("P4"), np.arange(0, 61, 2))
    force, feed = action.normal_force[~action.stop], action.feed_rate[~action.stop]
    limit = np.minimum(50.0, 16 * np.sqrt(feed))
    assert np.all(force <= limit * (1 + 1e-12))
    deep = (~action.stop & (height[:, None] > 1.6))[~action.stop]
    assert np.mean(np.isclose(force[deep], limit[deep], rtol=1e-9)) > 0.5


def test_quit_boundary_of_quadratic_charges():
    times = np.arange(-14, 5, 2)
    height, _, action = table(plain("P5"), times)
    found = first(height, ~action.stop)
    expected = [1.915, 1.71, 1.50, 1.295, 1.085, 0.88, 0.67, 0.465, 0.295, 0.15]
    np.testing.assert_allclose(found, expected, atol=PLACE)
    assert np.all(np.diff(found) < 0)
    assert np.all(table(plain("P5"), np.arange(-60, -15, 2))[2].stop)


def test_default_late_window_of_a_convex_charge_is_enough():
    given = plain("P5")
    free = weldbead.plan(given.problem.replace(late_window=None), tolerance=None, nodes=401)
    times = np.arange(-14, 61, 2)
    np.testing.assert_allclose(table(free, times)[1], table(given, times)[1], rtol=1e-13)


@pytest.mark.parametrize("name", NAMES)
def test_more_time_never_costs(name):
    late = [] if name in ("P1", "P4") else list(range(-30, 0, 2))
    value = table(plain(name), [*late, *range(0, 61, 2)])[1]
    assert np.max(np.diff(value, axis=1)) <= 1e-8


@pytest.mark.parametrize("name", NAMES)
def test_value_never_above_stopping(name):
    policy = plain(name)
    charge, late = policy.problem.height_charge, policy.problem.lateness_charge
    for time in (0.0, 20.0, 60.0) if late is None else (-8.0, 0.0, 60.0):
        height = policy.states()[0]
        stop = charge(height) + (0.0 if late is None else late(max(0.0, -time)))
        assert np.all(policy.value(height, time) <= stop + 1e-12)
