"""Turning and milling: published forms, searches without a locus, refusals."""

import math

import casadi as ca
import numpy as np
import pytest
from closed_forms import M_PER_MIN, ON_TURNING_LOCUS, named, slacks, slsqp, turning_rates
from hypothesis import given, settings
from hypothesis import strategies as st
from locus_inside import _presets
from scipy.optimize import brentq, minimize_scalar

from sdpgrind.locus.processes import Turning, tool_change_time

PROBLEM = _presets.preset("turning")
TURNING = PROBLEM.model
MILLING = _presets.preset("milling")


def test_corner_that_nothing_limits():
    speed = TURNING.taylor_speed(0.5)
    assert speed / M_PER_MIN == pytest.approx(160.42, rel=1e-6)
    assert TURNING.tool_life(speed, 0.5) == pytest.approx(10.5 * 60, rel=1e-12)
    cost = TURNING.cost(None, named(cutting_speed=speed, feed=0.5))
    assert cost * M_PER_MIN == pytest.approx(0.0166230, abs=5e-8)  # of m/min
    for k in (0.999, 1.001):
        assert TURNING.cost(None, named(cutting_speed=k * speed, feed=0.5)) > cost


def test_onset_end_and_strongest_feed():
    assert TURNING.onset_wear(0.5) == pytest.approx(0.160981, abs=5e-7)
    assert TURNING.end_wear(350 * M_PER_MIN) == pytest.approx(0.599836, abs=5e-7)
    assert TURNING.strongest_feed == pytest.approx(0.098897, abs=5e-7)
    feeds = np.linspace(0.02, 0.5, 200001)
    wear = TURNING.wear_at_limit(350 * M_PER_MIN, feeds)
    assert wear.max() == pytest.approx(TURNING.end_wear(350 * M_PER_MIN), rel=1e-9)
    assert feeds[np.argmax(wear)] == pytest.approx(TURNING.strongest_feed, abs=3e-6)


@pytest.mark.parametrize(
    ("wear", "speed", "feed"), [(wear, *point) for wear, point in ON_TURNING_LOCUS.items()]
)
def test_points_of_the_locus(wear, speed, feed):
    assert turning_rates(wear) == (pytest.approx(speed, rel=1e-6), pytest.approx(feed, rel=2e-6))

    def residual(f):
        """The speed is that of the limit at this feed."""
        v = (TURNING.cutting_force(0.0, f, wear) - TURNING.breaking(f)) / TURNING.speed_force
        return TURNING.force_residual(v, f)

    found = brentq(residual, 0.8 * feed, min(1.2 * feed, 0.5), xtol=1e-15)
    assert found == pytest.approx(feed, abs=6e-7)
    best = slsqp(PROBLEM, {"flank_wear": wear}, {"cutting_speed": 4000.0, "feed": 0.2})
    assert (best["cutting_speed"] / M_PER_MIN, best["feed"]) == (
        pytest.approx(speed, rel=1e-5),
        pytest.approx(feed, rel=1e-5),
    )


def test_before_the_onset_the_corner_is_best_and_near_the_end_the_greatest_speed():
    speed, feed = turning_rates(0.1)
    assert (speed, feed) == (pytest.approx(160.42, rel=1e-6), pytest.approx(0.5))
    speed, feed = turning_rates(0.595)
    assert speed == pytest.approx(350, rel=1e-6)
    assert TURNING.wear_at_limit(350 * M_PER_MIN, feed) == pytest.approx(0.595, abs=1e-6)


@given(st.floats(60.0, 350.0), st.floats(0.02, 0.5), st.floats(0.0, 0.6))
@settings(max_examples=50)
def test_residuals_are_stationarity_of_cost_and_limit(speed, feed, wear):
    """Against derivatives of the process's own functions, at the wear at which the limit is active."""
    process = TURNING.replace(power_max=6000.0)
    q = ca.SX.sym("q", 2)
    c = named(cutting_speed=ca.exp(q[0]), feed=ca.exp(q[1]))
    at = ca.DM([math.log(speed * M_PER_MIN), math.log(feed)])
    force, power = process.constraints
    v, f = speed * M_PER_MIN, feed
    spent = (1e3 * 6000.0 / v - process.cutting_force(v, f, 0.0)) / process.wear_force
    for varying, w, residual, sign in (
        (force, process.wear_at_limit(v, f), process.force_residual(v, f), 1),
        (power, spent, process.power_residual(v, f), -1),
    ):
        s = named(flank_wear=w)
        slack = varying.limit(s, c) - varying.response(s, c)
        slopes = ca.Function(
            "slopes", [q], [ca.gradient(process.cost(s, c), q), ca.gradient(slack, q), slack]
        )
        cost, limit, left = (np.asarray(part).ravel() for part in slopes(at))
        assert abs(left[0]) < 1e-9 * 6000
        size = abs(cost[0] * limit[1]) + abs(cost[1] * limit[0])
        by_hand = -residual * sign / (v * f)
        assert cost[0] * limit[1] - cost[1] * limit[0] == pytest.approx(by_hand, abs=1e-10 * size)


@given(st.floats(0.17, 0.55))
@settings(max_examples=20, deadline=None)
def test_on_the_locus_speed_is_above_that_of_taylor(wear):
    speed, feed = turning_rates(wear)
    assert speed * M_PER_MIN > TURNING.taylor_speed(feed)
    assert feed > TURNING.strongest_feed


def test_power_and_force_together_leave_one_point():
    problem = PROBLEM.replace(power_max=6000.0)
    assert [one.name for one in problem.varying] == ["cutting_force", "cutting_power"]
    best = slsqp(problem, {"flank_wear": 0.5}, {"cutting_speed": 4000.0, "feed": 0.2})
    np.testing.assert_allclose(slacks(problem, {"flank_wear": 0.5}, best), 0.0, atol=1e-3)
    assert problem.varying[1].response(named(flank_wear=0.5), named(**best)) == pytest.approx(6000.0)  # N m/s
    force = TURNING.cutting_force(best["cutting_speed"], best["feed"], 0.5)
    assert force * best["cutting_speed"] / 1e3 == pytest.approx(6000.0)


@pytest.mark.parametrize("wear", [0.0, 0.09, 0.2, 0.4, 0.6])
def test_a_spindle_at_its_limit_wants_the_greatest_feed(wear):
    """At the greatest feed the speed is that of Taylor, or the one that takes the whole power, a root of a
    square.
    """
    model = MILLING.model
    force = model.cutting_force(0.0, 0.25, wear)
    spent = (force - math.sqrt(force**2 - 4 * model.speed_force * 14e6)) / (2 * model.speed_force)
    speed = min(spent, model.taylor_speed(0.25))
    best = slsqp(MILLING, {"flank_wear": wear}, {"cutting_speed": 1500.0, "feed": 0.1})
    assert (best["cutting_speed"], best["feed"]) == (pytest.approx(speed, rel=1e-6), pytest.approx(0.25))
    assert (spent < model.taylor_speed(0.25)) == (wear > 0.1)
    if wear > 0.1:
        assert model.power_residual(speed, 0.25) < 0  # it would rather feed more


def test_price_of_a_worn_edge():
    price = {"change": 90.0, "edge_cost": 1.5, "machine_rate": 0.0125}
    assert tool_change_time(**price) == pytest.approx(90 + 1.5 / 0.0125)
    assert tool_change_time(**price, profit_rate=math.inf) == 90.0
    gain, other = 4.0, 60.0  # $ for a part, and s that no speed changes

    def parts(v):
        """Time and costs of a part of 10^5 mm^2 at the feed 0.3 mm."""
        time = 1e5 / (v * 0.3)
        edges = time / TURNING.tool_life(v, 0.3)
        total = other + time + 90.0 * edges
        return total, gain - 0.0125 * total - 1.5 * edges

    best = minimize_scalar(
        lambda v: -parts(v)[1] / parts(v)[0], bounds=(500, 8000), method="bounded", options={"xatol": 1e-9}
    )
    tau = tool_change_time(**price, profit_rate=-best.fun)
    assert 90.0 < tau < 210.0
    assert TURNING.replace(tool_change_time=tau).taylor_speed(0.3) == pytest.approx(best.x, rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"taylor_v_exp": 1.0}, "taylor_v_exp must be > 1: else the fastest cut is the cheapest; got 1.0"),
        ({"tool_change_time": 0.0}, "tool_change_time must be > 0 .s.; got 0.0"),
        (
            {"breaking_exponent": 0.75},
            "breaking_exponent must be < force_exponent = 0.75: else no feed is too great",
        ),
        ({"breaking_force": None}, "breaking_force .N. or power_max .W. must be given"),
        ({"power_max": -5.0}, "power_max must be > 0 .W."),
        ({"life_speed": math.inf}, "life_speed must be finite"),
        ({"wear_force": 0.0}, "wear_force must be > 0 .N/mm."),
    ],
)
def test_refusals(changes, words):
    with pytest.raises(ValueError, match=words):
        TURNING.replace(**changes)


def test_refusals_of_closed_forms():
    with pytest.raises(ValueError, match="breaking_force must be given for strongest_feed"):
        _ = MILLING.model.strongest_feed
    with pytest.raises(ValueError, match="power_max must be given for power_residual"):
        TURNING.power_residual(3000.0, 0.2)
    with pytest.raises(
        ValueError, match="taylor_f_exp must be < taylor_v_exp = 4: else the least feed is the cheapest"
    ):
        TURNING.replace(taylor_f_exp=4.0).onset_wear(0.5)
    with pytest.raises(ValueError, match="machine_rate must be > 0"):
        tool_change_time(change=1.0, edge_cost=1.0, machine_rate=0.0)
    with pytest.raises(ValueError, match="profit_rate must be >= 0"):
        tool_change_time(change=1.0, edge_cost=1.0, machine_rate=1.0, profit_rate=-1.0)
    assert isinstance(TURNING, Turning)
