"""The way of a pass beside the bead, from logs of both stands, arrays by name, and what is refused."""

import numpy as np
import pytest
from scipy import stats
from stand_job import BOTH, PROCESS

import hwsim
from sdpgrind import units, weldbead
from sdpgrind.weldbead import force, passes


def found(data, **options):
    return weldbead.identify(data, "lead_length", **({"problem": BOTH} | options))


@pytest.fixture(scope="module")
def led():
    """Log of beads whose passes go 12 mm beside the bead, as planned."""
    problem = BOTH.replace(lead_length=12.0)
    policy = weldbead.plan(problem.replace(height_max=1.1), tolerance=None, nodes=41)
    stand = hwsim.WeldBeadStand(problem, height=1.0, time=60.0)
    return hwsim.run(stand, weldbead.SequenceController(policy, learn=False), parts=3, rng=0)


def test_a_stand_with_leads_tells_them(led):
    told = found(led)
    assert told["lead_length"] == pytest.approx(12.0, abs=1e-9)
    assert BOTH.updated(told).lead_length == told["lead_length"]
    assert BOTH.updated(told).replace(lead_length=0.0) == BOTH
    several = found([led, led["sequence"]])
    assert several.freedom == 2 * told.freedom + 1


def test_three_tiers_tell_the_way_by_which_their_feed_is_raised():
    """By hand: the feed of a pass is that of lead-in, bead and lead-out in the time less 0.4 s."""
    disc = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    times = {"bead_length": 40.0, "durations": range(6, 17, 2), "stage": 2.0, "horizon": 24.0}
    problem = BOTH.replace(**times, bead_scatter=None, height_max=0.7)
    x = np.linspace(0, 40, 161)
    bead = passes.PassProblem(disc, passes.Contour(x, np.full(161, 0.6)), mean_cut=0.2, feed_rate=10.0)
    policy = weldbead.plan(problem, tolerance=None, nodes=41)
    tiers = weldbead.Hierarchy(policy, disc, force.PI.design(crossover=units.hz(3.0)), reestimate=False)
    log = hwsim.run(hwsim.ForceTableStand(bead, sequence=problem, time=24.0), tiers, rng=1)
    told = found(log, problem=problem)
    feeds = log["pass"]["feed_rate_command"].values[:-1]
    asked = 40.0 / log["sequence"]["planned_feed_command"].values[:-1]  # s, duration less reset
    assert told["lead_length"] == pytest.approx(np.mean(feeds * asked - 40.0), rel=1e-12)
    way = 40.0 + told["lead_length"]  # of which 0.4 s are spent before and after the plan
    assert told["lead_length"] == pytest.approx(0.4 * np.mean(feeds) + bead.lead_in + 5.0, abs=0.02 * way)
    with pytest.raises(ValueError, match=r"data must hold feed_rate \(mm/s\)"):
        found(log["sequence"], problem=problem)


def test_arrays_by_name_give_mean_and_interval_of_student():
    rng = np.random.default_rng(0)
    duration = np.tile([12.0, 20.0, 28.0], 4)
    way = 10.0 + rng.standard_normal(12)
    told = found({"feed_rate": (150.0 + way) / (duration - 2.0), "duration": duration})
    low, high = stats.t(11, way.mean(), way.std(ddof=1) / np.sqrt(12)).interval(0.95)
    assert told["lead_length"] == pytest.approx(way.mean(), rel=1e-12)
    assert told.interval()[0] == pytest.approx((low, high), rel=1e-9)
    assert told.units == ("mm",) and told.message == "from 12 passes"


def test_no_way_beside_the_bead_is_an_estimate_and_a_negative_one_is_none():
    level = {"feed_rate": [15.0, 15.0 * (1 - 1e-12), 7.5], "duration": [12.0, 12.0, 22.0]}
    assert 0.0 <= found(level)["lead_length"] < 1e-9
    slow = {"feed_rate": [14.0, 14.1, 14.0], "duration": [12.0] * 3}
    with pytest.raises(ValueError, match=r"lead_length must be >= 0 \(mm\).*bead of 150 mm"):
        found(slow)
    told = found(slow, throw=False)
    with pytest.raises(ValueError, match="estimate must have succeeded"):
        BOTH.updated(told)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"feed_rate": [15.0, 15.0], "duration": [12.0, 2.0]}, "duration must be > reset_time, 2 s"),
        ({"feed_rate": [15.0, 0.0], "duration": [12.0, 12.0]}, "feed_rate must be > 0"),
        ({"feed_rate": [15.0], "duration": [12.0]}, "at least 2 passes"),
        ({"duration": [12.0, 12.0]}, r"data must hold feed_rate \(mm/s\)"),
        ({"feed_rate": [15.0, 15.0]}, r"data must hold duration \(s\)"),
    ],
)
def test_refused(data, message):
    with pytest.raises(ValueError, match=message):
        found(data)


def test_a_problem_is_asked_for():
    with pytest.raises(TypeError, match="problem must be"):
        found({"feed_rate": [15.0] * 3, "duration": [12.0] * 3}, problem=None)
