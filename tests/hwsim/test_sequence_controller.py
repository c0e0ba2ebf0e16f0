"""The controller that follows a policy: what it looks up, commands and reports; missing readings; refusals."""

import copy
from math import nan
from types import SimpleNamespace

import pytest

import hwsim
from sdpgrind import units, weldbead
from sdpgrind.weldbead import SequenceController, force, passes

P1 = weldbead.preset("P1")


class Thirds:
    """A policy of one sentence: every pass takes a third of the bead in 8 s, until 0.1 mm are left."""

    problem = P1
    dataset = None

    def __init__(self):
        self.asked = []

    def value(self, height, time_left, last_duration=None):
        return 0.5 * height

    def action(self, height, time_left, last_duration=None):
        self.asked.append((height, time_left))
        self.last = last_duration
        stop = height < 0.1
        return SimpleNamespace(
            stop=stop,
            duration=nan if stop else 8.0,
            feed_rate=nan if stop else 50.0 / 6.0,
            normal_force=nan if stop else 30.0,
            mean_cut=nan if stop else height / 3,
            gap=0.25,
        )


def test_looks_up_what_was_measured():
    policy = Thirds()
    controller = SequenceController(policy)
    command = controller.step(height=1.2, time_left=20.0, grinding_power=nan)
    assert command == {"duration": 8.0, "feed_rate": 50.0 / 6.0, "normal_force": 30.0, "stop": 0.0}
    assert controller.report() == {"penalty": 0.6, "mean_cut": pytest.approx(0.4), "gap": 0.25}
    assert controller.step(height=0.05, time_left=12.0) == {"stop": 1.0}
    assert controller.report() == {"penalty": 0.025, "mean_cut": 0.0, "gap": 0.25}
    assert policy.asked == [(1.2, 20.0), (0.05, 12.0)]


def test_missing_readings_are_replaced_by_what_was_expected():
    policy = Thirds()
    controller = SequenceController(policy)
    controller.step(height=0.9, time_left=20.0)
    controller.step(height=nan, time_left=12.0)
    controller.step(height=0.3, time_left=nan)
    assert policy.asked[1:] == [(pytest.approx(0.6), 12.0), (0.3, 4.0)]


def test_late_time_is_passed_on():
    policy = Thirds()
    SequenceController(policy).step(height=0.9, time_left=-6.0)
    assert policy.asked == [(0.9, -6.0)]


def test_last_pass_is_told_where_its_finish_is_charged():
    policy = Thirds()
    controller = SequenceController(policy)
    controller.step(height=0.9, time_left=20.0)
    controller.step(height=0.6, time_left=12.0)
    assert policy.last is None
    policy.problem = P1.replace(finish_charge=weldbead.FinishCharge(0.4, reference_rate=12.5))
    controller.reset()
    controller.step(height=0.9, time_left=20.0)
    assert policy.last is None
    controller.step(height=0.6, time_left=12.0)
    assert policy.last == 8.0


def test_copies_have_a_state_of_their_own_and_share_the_policy():
    controller = SequenceController(Thirds())
    controller.step(height=0.9, time_left=20.0)
    twin = copy.deepcopy(controller)
    controller.step(height=0.3, time_left=12.0)
    twin.step(height=nan, time_left=12.0)
    assert controller.policy.asked[-1] == (pytest.approx(0.6), 12.0) and twin.policy is controller.policy


def test_reset_forgets():
    controller = SequenceController(Thirds())
    controller.step(height=0.9, time_left=20.0)
    controller.reset()
    with pytest.raises(
        ValueError, match=r"height \(mm\) and time_left \(s\) must both be read before the first pass"
    ):
        controller.step(height=nan, time_left=20.0)


def test_bead_beyond_the_plan_is_refused_with_advice():
    controller = SequenceController(Thirds())
    with pytest.raises(
        ValueError, match=r"height must be <= height_max = 2 of the policy \(mm\); got 2.1: plan with a"
    ):
        controller.step(height=2.1, time_left=20.0)
    with pytest.raises(
        ValueError, match=r"time_left must be <= horizon = 60 of the policy \(s\); got 61.0: plan with a"
    ):
        controller.step(height=1.0, time_left=61.0)


def test_only_policies_are_followed():
    with pytest.raises(
        TypeError, match=r"policy must be a policy, as weldbead.plan gives it; got a SequenceProblem"
    ):
        SequenceController(P1)


def test_a_bead_of_the_greatest_height_is_ground_whatever_the_scan_reads():
    problem = weldbead.preset("P1")
    policy = weldbead.plan(problem, tolerance=1e-2)
    stand = hwsim.WeldBeadStand(problem, height=problem.height_max)
    log = hwsim.run(stand, weldbead.SequenceController(policy), parts=20, rng=0)
    assert (log["sequence"].height.values[log["sequence"].time.values == 0] > problem.height_max).any()
    exact, above = weldbead.SequenceController(policy), weldbead.SequenceController(policy)
    assert exact.step(height=2.0, time_left=30.0) == above.step(height=2.0199, time_left=30.0)
    with pytest.raises(
        ValueError, match=r"height must be <= height_max = 2 of the policy \(mm\); got 2.0201"
    ):
        above.step(height=2.0201, time_left=30.0)


def test_another_policy_takes_over_what_is_known_of_the_bead():
    """As where coefficients are estimated again after a pass: readings may be missing then too."""
    controller, second = SequenceController(Thirds()), Thirds()
    controller.step(height=0.9, time_left=20.0)
    controller.follow(second)
    controller.step(height=nan, time_left=nan)
    assert second.asked == [(pytest.approx(0.6), 12.0)]
    with pytest.raises(TypeError, match=r"policy must be a policy, as weldbead\.plan gives it; got None"):
        controller.follow(None)


def test_the_next_policy_knows_the_last_pass_where_its_finish_is_charged():
    charged = P1.replace(finish_charge=weldbead.FinishCharge(0.1))
    first, second = Thirds(), Thirds()
    first.problem = second.problem = charged
    controller = SequenceController(first)
    controller.step(height=0.9, time_left=20.0)
    controller.follow(second)
    controller.step(height=0.6, time_left=12.0)
    assert second.last == 8.0


def test_coefficients_are_learned_though_the_bead_is_not_scanned_again():
    policy = weldbead.plan(P1, tolerance=None, nodes=51)
    disc = passes.TiltedDisc(P1.model, relaxed_angle=units.deg(20.0), rotational_stiffness=6e5)
    tier = weldbead.Hierarchy(policy, disc, force.PI.design(crossover=units.hz(3.0)), replan=False).tiers[
        "sequence"
    ]
    first = tier.step(height=1.5, time_left=30.0)
    learned = {"grinding_power": 900.0, "removal_rate": 60.0, "normal_force": 50.0, "tangential_force": 15.0}
    second = tier.step(height=0.1, time_left=18.0, **learned)
    assert second["specific_energy"] > first["specific_energy"]
    left = 1.5 - first["mean_cut"]
    assert (
        tier.report()["penalty"]
        > policy.value(height=left, time_left=18.0)
        > policy.value(height=0.1, time_left=18.0)
    )
