"""The optimal control of a pass with a free feed: limits, trade of time against the tip's distance, replay."""

import numpy as np
import pytest

import sdpgrind
from sdpgrind import units, weldbead
from sdpgrind.weldbead import passes

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
AIR = DISC.replace(model=PROCESS.replace(free_speed=units.hz(50.0), speed_droop=0.0821))
X = np.linspace(0, 60, 601)
WAVY = passes.Contour(X, 1.0 + 0.1 * np.sin(2 * np.pi * X / 40))


def planned(disc=DISC, feed=20.0, **freedom):
    problem = passes.PassProblem(disc, WAVY, mean_cut=0.2, feed_rate=feed)
    return passes.plan(problem, method="collocation", freedom=passes.Freedom(**freedom))


@pytest.fixture(scope="module")
def plans():
    return [
        planned(feed_rate_min=5.0, feed_rate_max=50.0, time_weight=weight) for weight in (1e-5, 1e-4, 1e-3)
    ]


def test_time_is_bought_with_distance(plans):
    times = [plan.time[-1] for plan in plans]
    off = [
        np.sqrt(np.mean((plan.contour.at(X[50:550]) - plan.problem.target.at(X[50:550])) ** 2))
        for plan in plans
    ]
    assert times[0] > times[1] > times[2]
    assert off[0] < off[1] < off[2]
    assert passes.plan(plans[0].problem).time[-1] > times[2]  # than at the feed that was asked for


def test_limits_hold_and_the_replay_agrees(plans):
    for plan in plans:
        assert plan.collocation.message == "Solve_Succeeded"
        assert plan.collocation.residual < 1e-7
        assert plan.collocation.replay_error < 3e-3  # mm
        assert plan.feed_rate.min() >= 5.0 * (1 - 1e-6) and plan.feed_rate.max() <= 50.0 * (1 + 1e-6)
        assert plan.normal_force.max() <= 90.0 * 1.01


def test_where_power_is_the_limit_the_feed_follows_the_depth():
    """An air motor, held at 80 % of its peak: deep places are passed slowly."""
    plan = planned(AIR, 5.0, feed_rate_min=2.0, feed_rate_max=40.0, time_weight=1e-4)
    inner = (plan.tip_x[1:] > 6) & (plan.tip_x[1:] < 54)
    depth = WAVY.at(plan.tip_x[1:]) - plan.contour.at(plan.tip_x[1:])
    assert np.corrcoef(plan.feed_rate[inner], depth[inner])[0, 1] < -0.8
    power = plan.grinding_power[1:][inner]
    assert np.mean(power > 0.97 * AIR.power_max) > 0.5  # held at the limit, most of the way
    assert power.max() <= 1.05 * AIR.power_max
    # By volume, at that power: no time is left to be won but at the ends.
    rate = (AIR.power_max - PROCESS.idle_power) / PROCESS.specific_energy
    assert plan.time[-1] == pytest.approx(plan.volume / rate, rel=0.15)


def test_rates_are_limited(plans):
    free = plans[2]
    held = planned(
        feed_rate_min=5.0, feed_rate_max=50.0, time_weight=1e-3, height_rate_max=0.5, force_rate_max=100.0
    )
    inner = (held.tip_x > 4) & (held.tip_x < 56)

    def fastest(plan, name):
        inner = (plan.tip_x > 4) & (plan.tip_x < 56)
        return np.abs(np.gradient(getattr(plan, name), plan.time))[inner].max()

    assert np.any(inner)
    assert fastest(held, "fly_height") <= 0.5 * 1.05 < fastest(free, "fly_height")
    assert held.time[-1] > free.time[-1]


def test_a_plan_of_varying_feed_is_replayed_saved_and_loaded(plans, tmp_path):
    plan = plans[1]
    np.testing.assert_allclose(plan.simulate().contour.z, plan.contour.z, atol=1e-9)
    plan.save(tmp_path / "pass.nc")
    again = sdpgrind.load(tmp_path / "pass.nc")
    np.testing.assert_allclose(again.feed_rate, plan.feed_rate, rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"feed_rate_min": 0.0}, r"feed_rate_min must be > 0 \(mm/s\); got 0.0"),
        ({"feed_rate_max": 4.0}, r"feed_rate_max must be >= feed_rate_min, 5 \(mm/s\); got 4.0"),
        ({"time_weight": -1.0}, r"time_weight must be >= 0 \(mm\^2\); got -1.0"),
        ({"force_rate_max": 0.0}, r"force_rate_max must be > 0 \(N/s\); got 0.0"),
        ({"height_rate_max": float("nan")}, r"height_rate_max must be > 0 \(mm/s\); got nan"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(ValueError, match=message):
        passes.Freedom(**({"feed_rate_min": 5.0, "feed_rate_max": 50.0} | change))


def test_freedom_is_for_collocation():
    problem = passes.PassProblem(DISC, WAVY, mean_cut=0.2, feed_rate=20.0)
    with pytest.raises(ValueError, match="freedom must be None with method 'inverse'"):
        passes.plan(problem, freedom=passes.Freedom(5.0, 50.0))


def test_a_feed_for_each_step():
    x = np.arange(80.0, 120.0, 0.1)
    height = np.full(x.size, 31.0)
    flat = passes.Contour([0, 30], [1.0, 1.0])
    even = passes.simulate(DISC, flat, center_x=x, fly_height=height, feed_rate=20.0)
    same = passes.simulate(DISC, flat, center_x=x, fly_height=height, feed_rate=np.full(x.size - 1, 20.0))
    np.testing.assert_array_equal(same.contour.z, even.contour.z)
    with pytest.raises(
        ValueError, match=r"feed_rate must be a number or have one entry for each step, 399 \(mm/s\)"
    ):
        passes.simulate(DISC, flat, center_x=x, fly_height=height, feed_rate=[20.0, 20.0])
    with pytest.raises(ValueError, match=r"center_x must be rising \(mm\)"):
        passes.simulate(DISC, flat, center_x=x[::-1], fly_height=height, feed_rate=20.0)
