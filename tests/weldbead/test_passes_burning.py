"""No step of a planned pass burns, by any method; both problems and files know the same limits."""

import numpy as np
import pytest

from sdpgrind import units, weldbead
from sdpgrind.base.quantities import specs
from sdpgrind.weldbead import passes

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
X = np.linspace(0, 60, 601)
WAVY = passes.Contour(X, 1.0 + 0.1 * np.sin(2 * np.pi * X / 40))
COEFFICIENT = 14.0  # N/(mm/s)^(1/2): 62.6 N at 20 mm/s
PROBLEM = passes.PassProblem(
    DISC, WAVY, mean_cut=0.2, feed_rate=20.0, burn_limit=weldbead.ForceBurnLimit(COEFFICIENT)
)
FREEDOM = passes.Freedom(feed_rate_min=5.0, feed_rate_max=50.0, time_weight=1e-3)


def left(plan):
    """Least of C sqrt(V) - F over the steps, from positions and times alone."""
    feed = np.diff(plan.center_x) / np.diff(plan.time)
    return np.min(COEFFICIENT * np.sqrt(feed) - plan.normal_force[1:])


@pytest.mark.parametrize("method", ["inverse", "pi", "collocation"])
def test_the_limit_holds_on_every_bump(method):
    plan = passes.plan(PROBLEM, method=method)
    assert plan.burn_margin == pytest.approx(left(plan), abs=1e-6)
    assert plan.burn_margin > -1e-6
    assert plan.shortfall > 0.03 * PROBLEM.volume
    held = "leaves" if method == "collocation" else "limited to 62.61 N"  # collocation keeps a reserve
    assert plan.status.startswith(held)
    # The mean force is well within the limit, and without it the pass would burn.
    cutting = plan.normal_force > 0
    assert plan.normal_force[cutting].mean() < 0.85 * 62.61
    assert left(passes.plan(PROBLEM.replace(burn_limit=None), method=method)) < -5.0


def test_a_free_feed_is_limited_where_it_is():
    plan = passes.plan(PROBLEM, method="collocation", freedom=FREEDOM)
    assert plan.collocation.message == "Solve_Succeeded"
    assert plan.burn_margin == pytest.approx(left(plan), abs=1e-6)
    assert plan.burn_margin > 0.0
    assert plan.feed_rate.max() > 2 * plan.feed_rate.min()  # one limit for all feeds would be another
    assert "burns" not in plan.status


def test_an_optimal_control_whose_replay_burns_is_not_used():
    """On short waves the part before the control begins does, fed at another speed than its heights were
    planned for.
    """
    problem = PROBLEM.replace(bead=passes.Contour(X, 1.0 + 0.1 * np.sin(2 * np.pi * X / 17)))
    plan = passes.plan(problem, method="collocation", freedom=FREEDOM)
    assert plan.collocation.message.startswith("the replay burns, by up to 1.0")
    assert plan.burn_margin > -1e-6
    np.testing.assert_array_equal(plan.fly_height, passes.plan(problem).fly_height)


def test_power_and_force_limit_alike_without_droop():
    same = weldbead.PowerBurnLimit(COEFFICIENT * 500.0 * 0.33 * 88.9e-3)  # W: omega mu R F
    plans = [passes.plan(PROBLEM.replace(burn_limit=limit)) for limit in (PROBLEM.burn_limit, same)]
    np.testing.assert_allclose(plans[0].normal_force, plans[1].normal_force, atol=1e-6)
    allowed = same.burn_coefficient * np.sqrt(20.0)
    assert plans[1].grinding_power.max() == pytest.approx(allowed, rel=1e-9)


@pytest.mark.parametrize("method", ["static", "quasistatic"])
def test_heights_that_follow_no_limit_say_that_they_burn(method):
    plan = passes.plan(PROBLEM, method=method)
    assert plan.burn_margin == pytest.approx(left(plan), abs=1e-6)
    assert plan.burn_margin < -1.0
    assert plan.status.startswith(f"burns, by up to {-left(plan):.3g} N; leaves ")


def test_forces_that_burn_at_many_feeds():
    feed = np.array([[20.0, 5.0], [20.0, 45.0]])
    np.testing.assert_allclose(PROBLEM.burn_force(feed), COEFFICIENT * np.sqrt(feed))
    malkin = weldbead.MalkinBurnLimit.published(diameter=170.0)
    expected = [[float(malkin.interval(PROCESS, rate)[1]) for rate in row] for row in feed]
    np.testing.assert_allclose(PROBLEM.replace(burn_limit=malkin).burn_force(feed), expected)
    assert np.all(np.isinf(PROBLEM.replace(burn_limit=None).burn_force(feed)))
    assert PROBLEM.grinder_limit == 90.0 and PROBLEM.force_limit == pytest.approx(COEFFICIENT * np.sqrt(20.0))


class Half:
    """A limit of one's own: half the force of another one."""

    def __init__(self, of):
        self.of = of

    def interval(self, process, feed_rate):
        low, high = self.of.interval(process, feed_rate)
        return low, high / 2

    def margin(self, process, normal_force, feed_rate):
        return self.interval(process, feed_rate)[1] - normal_force


def test_a_limit_of_ones_own_holds_in_sequence_and_pass():
    own = Half(PROBLEM.burn_limit)
    assert PROBLEM.replace(burn_limit=own).burn_force(20.0) == pytest.approx(COEFFICIENT * 20.0**0.5 / 2)
    p1 = weldbead.preset("P1").replace(burn_limit=own)
    assert p1.force_interval(20.0)[1] == pytest.approx(COEFFICIENT * (50 / 18) ** 0.5 / 2)


def test_sequence_and_pass_refuse_what_has_no_margin():
    class NoMargin:
        interval = Half.interval

    for problem in (PROBLEM, weldbead.preset("P1")):
        with pytest.raises(
            TypeError, match=r"burn_limit must be .*ForceBurnLimit.* or MalkinBurnLimit; got a NoMargin"
        ):
            problem.replace(burn_limit=NoMargin())


def test_sequence_pass_and_files_know_the_same_limits():
    limits = specs(weldbead.SequenceProblem)["burn_limit"].made_of
    assert limits is specs(passes.PassProblem)["burn_limit"].made_of
    assert list(limits) == ["force", "power", "malkin"]
    assert all(getattr(weldbead.sequence, cls.__name__) is cls for cls in limits.values())
