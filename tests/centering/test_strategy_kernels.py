"""Kernels of the strategy against slow twins."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from push_inside import (
    FRACTIONS,
    FRICTION_SCALES,
    WORTH,
    KindOfPush,
    Size,
    choose,
    cycle_timing,
    draws,
    learned,
    moments,
    prepared,
    prior,
    push_cells,
    push_once,
    push_to_push,
    table_speeds,
    turn_time,
)
from strategy_twins import made_up_table, posterior_twin, push_twin, stroke_twin, travel_twin, turned_twin

from centering import preset
from centering.cycle import PushKind
from sdpgrind.base.progress import silent

TABLE = made_up_table()
PUSHES = push_cells(TABLE.grid, FRICTION_SCALES.size, 0.04)
STATES = 6  # chosen: 24 in all; each is simulated draw by draw


@pytest.fixture(scope="module")
def ground():
    kinds = (PushKind("trapezoid", 5.0, True), PushKind("gentle", 40.0, True))
    return prepared(preset("printed"), "scheduled", kinds, Size(24, 3), None, silent)


@settings(deadline=None)
@given(st.floats(0.001, 40.0), st.floats(0.5, 1.5))
def test_travel_is_bilinear(stroke, scale):
    assert TABLE.expected(0, stroke, scale) == pytest.approx(travel_twin(TABLE, 0, stroke, scale), abs=1e-9)


@settings(deadline=None)
@given(st.floats(0.001, 15.0), st.floats(0.7, 1.3))
def test_a_stroke_reaches_the_wanted_mean_travel(travel, scale):
    stroke = TABLE.stroke_for(0, travel, scale)
    twin = stroke_twin(TABLE, 0, scale, travel)
    assert stroke == pytest.approx(twin, rel=1e-4)  # the search has 5000 steps over a factor of 1.1


def test_no_stroke_reaches_too_far():
    assert TABLE.stroke_for(0, 100.0, 1.0) == np.inf


def test_mean_travel_is_the_mean_over_a_normal_friction_scale():
    rng = np.random.default_rng(0)
    scale = 1.0 + 0.045 * rng.standard_normal(20_000)
    middle = int(np.argmin(np.abs(FRICTION_SCALES - 1.0)))
    assert abs(FRICTION_SCALES[middle] - 1.0) < 1e-12
    for node in (20, 40):
        drawn = np.interp(scale, FRICTION_SCALES, TABLE.travel[0, node])
        error = 5 * drawn.std() / np.sqrt(scale.size) + 1e-5
        assert TABLE.mean_travel[0, node, middle] == pytest.approx(drawn.mean(), abs=error)
    assert np.all(np.diff(TABLE.mean_travel[0, :, middle]) >= 0)


@settings(deadline=None)
@given(
    st.floats(0.01, 4 * pi),
    st.floats(0.5, 12.0),
    st.floats(0.5, 12.0),
    st.floats(0.5, 20.0),
    st.floats(0.0, 0.3),
    st.floats(0.0, 0.2),
)
def test_a_table_has_turned_by_the_angle(angle, before, speed, rate, held, steady):
    """Also a table that slows, which is not steady, and one that is there before its speed changes."""
    time, late = turn_time(angle, before, speed, rate, held, steady), steady if speed >= before else 0.0
    assert turned_twin(time, before, speed, rate, held, late) == pytest.approx(angle, abs=1e-3 * angle)
    kept = turn_time(angle, before, speed, rate, held, 0.0)
    assert speed < before or time >= kept - 1e-12


def test_a_push_waits_for_its_measurement():
    tip, times = (0.04, 0.1, 0.05, 0.03), (0.4, 0.05, 0.03)
    soonest = 0.02 + 0.1 + 0.4 / 10.0 + 0.05  # s: push, rest, 0.4 rad at 10 rad/s, launch
    for phase in (10.0 * soonest + 1e-6, 10.0 * soonest - 1e-6):
        time, speed = push_to_push(phase, 0.02, tip, 10.0, 10.0, 5.0, *times)
        assert time == pytest.approx(soonest + (0.2 * pi if phase < 10.0 * soonest else 0.0), abs=1e-6)
        assert speed == 10.0


@pytest.mark.parametrize(
    ("travel", "offset", "phase"), [(0.9, 0.1, 2 * pi), (1.1, 0.1, pi), (0.0, 1.0, 2 * pi)]
)
def test_after_too_little_a_whole_turn_after_too_much_half(travel, offset, phase):
    after, angle = push_once(1.0, travel, 0.0)
    assert after == pytest.approx(offset)
    assert angle == pytest.approx(phase)


@settings(deadline=None)
@given(st.floats(0.01, 10.0), st.floats(0.0, 12.0), st.floats(-0.3, 0.3))
def test_a_push_obeys_the_law_of_cosines(offset, travel, angle):
    after, phase = push_once(offset, travel, angle)
    assert after**2 == pytest.approx(offset**2 + travel**2 - 2 * offset * travel * np.cos(angle), abs=1e-9)
    assert 0 < phase <= 2 * pi


@pytest.mark.parametrize("seen", [0, 4])
@pytest.mark.parametrize("kind", [0, 1])
def test_all_draws_against_one_by_one(ground, kind, seen):
    rng = np.random.default_rng(kind + 2 * seen)
    # the first push told by its force: 4 % of scatter from push to push, and 7 % of error
    evidence = 0.04**2 / (0.04**2 + 0.07**2) + WORTH * (seen - 1) if seen else 0.0
    where, scale = ground.axes
    offset = np.geomspace(where.low, where.high, 9)[rng.integers(0, 9, STATES)]
    friction, share = rng.uniform(scale.low, scale.high, STATES), rng.choice(FRACTIONS, STATES)
    time, (starts, columns, weights) = KindOfPush(ground, kind, 6)._follow(offset, friction, share, seen)
    for p in range(STATES):
        slow, on_nodes = push_twin(
            ground, kind, offset[p], friction[p], share[p], seen, evidence, draws(ground.problem)
        )
        assert time[p] == pytest.approx(slow, rel=1e-9)
        row = dict(zip(columns[starts[p] : starts[p + 1]], weights[starts[p] : starts[p + 1]], strict=True))
        assert sum(row.values()) <= 1 + 1e-12
        for node, weight in on_nodes.items():
            assert row.get(node, 0.0) == pytest.approx(weight, abs=1e-10)


def test_a_table_gains_speed_as_friction_was_known_before_the_push():
    """What the first push shows is known when the part is measured again: too late for the second run-up."""
    problem, offsets = (
        preset("printed").replace(mu_static=0.08, mu_kinetic=0.06),
        np.geomspace(0.002, 15.0, 16),
    )
    timing = cycle_timing(problem, TABLE, offsets, table_speeds(problem, offsets, "scheduled"))
    least = 0.8 * (1 - 3.0902 * 0.08)  # of the range, 99.9 % of the parts
    rate = 0.9003 * least * 0.08 * 9807.0 / 89.5  # rad/s^2, of a thin ring near the axis
    speed = timing.next_push(0, 0.05, 6.0, 2.0, 0.1, 0, 0.0)[1]
    assert 0.85 * 2 * rate * 6.0 < speed**2 - 2.0**2 < 2 * rate * 6.0


def test_draws_are_standard():
    friction, direction, place, _, weight = draws(preset("printed").replace(tolerance=0.0025))
    scatter = preset("printed").scatter
    assert weight.sum() == pytest.approx(1.0)
    for drawn, sd in (
        (friction, 1.0),
        (direction, scatter.direction_sd),
        (place, np.hypot(scatter.stop_sd, scatter.measuring_sd)),
    ):
        assert weight @ drawn == pytest.approx(0.0, abs=0.02 * sd)
        assert np.sqrt(weight @ drawn**2) == pytest.approx(sd, rel=0.03)  # 101 points cut the tails off
    assert abs(weight @ (friction * place)) < 0.05 * place.std()
    assert np.unique(friction).size == friction.size


def normal(mean, sd):
    """Weights of a normal law on the scales of the tables."""
    weights = np.exp(-0.5 * ((FRICTION_SCALES - mean) / sd) ** 2) * np.gradient(FRICTION_SCALES)
    return weights / weights.sum()


def after(before, stroke, noise, travelled):
    """Mean and sd after a push of the made-up table."""
    expected, seen = TABLE.travels(0, stroke)[None], np.array([travelled])
    return moments(learned(expected, PUSHES, before, np.array([noise]), seen))


@pytest.mark.parametrize("travelled", [0.035, 0.045, 0.05, 0.06])
def test_bayes_rule_against_a_fine_grid(travelled):
    stroke, noise = 0.08, 0.004
    mean, sd = after(normal(1.02, 0.08), stroke, noise, travelled)

    travels = np.array([TABLE.expected(0, stroke, float(r)) for r in np.linspace(0.2, 1.9, 1701)])

    def travel_of(scale):
        return travels.take(np.clip(np.round((scale - 0.2) / 0.001).astype(int), 0, 1700))

    slow_mean, slow_sd = posterior_twin(travel_of, 1.02, 0.08, 0.04, noise, travelled)
    assert mean == pytest.approx(slow_mean, abs=0.08 * 0.06)
    assert sd == pytest.approx(slow_sd, rel=0.06)


@pytest.mark.parametrize("scale", [0.5, 0.6, 1.4, 1.6, 2.0])
def test_a_travel_far_outside_what_is_told_is_believed(scale):
    """Of 0.08 mm of stroke the travel falls by 0.038 mm per unit of scale: the noise of 0.5 µm is 0.013, a
    push's own 0.04.
    """
    before = prior(preset("printed"), 1.0, 0.0)
    travelled = TABLE.expected(0, 0.08, scale)
    mean, sd = after(before, 0.08, 5e-4, travelled)
    own = np.hypot(0.04 * scale, 5e-4 / 0.038)
    assert abs(mean - scale) < own
    assert sd == pytest.approx(own, rel=0.4)  # the nodes are as far apart as that


def test_a_travel_that_says_nothing_changes_nothing():
    before, flat = normal(1.1, 0.05), np.full((1, 62), 0.5)
    known = learned(flat, PUSHES, before, np.array([0.001]), np.array([0.5]))
    np.testing.assert_allclose(known, before, rtol=1e-12)


def test_two_values_share_the_friction_of_their_push():
    """Two exact ones of a push that scatters by 4 % say no more of the part than one."""
    before, exact = normal(1.0, 0.08), np.array([1e-4, 1e-4])
    row, seen = 1.0 * FRICTION_SCALES, np.array([1.05, 1.05])
    both = learned(np.stack([row, row]), PUSHES, before, exact, seen)
    one = learned(row[None], PUSHES, before, exact[:1], seen[:1])
    for mean, sd in (moments(both), moments(one)):
        assert mean == pytest.approx(1.04, abs=2e-3)  # 0.05 times 0.8: variances of 64 and 16
        assert sd == pytest.approx(0.04 * np.sqrt(0.8), rel=0.05)


@settings(deadline=None)
@given(st.floats(1e-3, 40.0))
def test_travels_at_the_scales_of_the_table(stroke):
    expected = [TABLE.expected(0, stroke, float(scale)) for scale in FRICTION_SCALES]
    np.testing.assert_allclose(TABLE.travels(0, stroke), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("offset", "friction"), [(np.nan, 1.0), (0.5, np.nan)])
def test_a_state_that_is_no_number_is_no_place_in_a_table(offset, friction):
    """Its integer would be an index far outside: another one on each processor."""
    nodes, travel = np.array([-3.0, 0.1, -0.5, 0.1]), np.cumsum(np.ones((2, 30, 8)), axis=1)
    policy = np.zeros((1, 5, 4), np.int64), np.full((1, 5, 4), 0.5)
    outcomes = travel, travel, np.array([20, 20]), nodes
    axes = (-3.0, 0.5, 5, 0.5, 0.25, 4)
    known = choose(policy, outcomes, np.ones(5), axes, 0.5, 1.0, 0)
    assert known[0] == 0 and known[1] == 0.25 and np.isfinite(known[2:]).all()
    kind, *rest = choose(policy, outcomes, np.ones(5), axes, offset, friction, 0)
    assert kind == -1 and np.isnan(rest).all()
