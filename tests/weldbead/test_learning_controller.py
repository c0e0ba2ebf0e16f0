"""The sequence as it learns a bead: belief, plans of the time left, drawn beads, the tiers."""

from copy import deepcopy

import numpy as np
import pytest
from stand_job import ALONE, BOTH, PROCESS

import hwsim
from sdpgrind import sdp, weldbead
from sdpgrind.weldbead import BeadEstimator, CoefficientScatter, SequenceController
from sdpgrind.weldbead.sequence._replan import next_pass

READ = ("normal_force", "tangential_force", "grinding_power", "removal_rate", "cut_depth")


@pytest.fixture(scope="module")
def policy():
    return weldbead.plan(BOTH, tolerance=None, nodes=201)


@pytest.fixture(scope="module")
def stand():
    return hwsim.WeldBeadStand(BOTH, height=1.0, time=60.0)


@pytest.fixture(scope="module")
def log(policy, stand):
    return hwsim.run(stand, SequenceController(policy), parts=20, rng=0)


def test_it_believes_what_an_estimator_does_that_is_told_the_log(policy, log):
    belief = BeadEstimator(BOTH)
    table = log["sequence"].isel(row=log["sequence"].part.values == 3)
    for k in range(table.sizes["row"]):
        row = table.isel(row=k)
        if k:
            belief.learn(**{name: float(row[name]) for name in READ})
        for name, value in belief.report().items():
            assert float(row[f"{name}_planned"]) == value


def test_the_plan_of_the_time_left_is_that_of_the_whole_horizon(policy):
    """97 heights and 28 levels against 1601 and 401: the promise within 2e-4 $, a cut within 1 %."""
    controller = SequenceController(policy)
    controller.step(height=1.0, time_left=60.0)
    reading = dict(zip(READ, (50.0, 18.0, 800.0, 60.0, 0.3), strict=True))
    controller.step(height=0.7, time_left=48.0, **reading)
    belief = BeadEstimator(BOTH)
    belief.update(**reading)
    fine = weldbead.plan(belief.believed, tolerance=None, nodes=1601)
    assert controller.report()["penalty"] == pytest.approx(fine.value(0.7, 48.0), abs=2e-4)
    assert controller.report()["mean_cut"] == pytest.approx(fine.action(0.7, 48.0).mean_cut, rel=0.01)


def test_same_seed_same_log(policy, stand, log):
    again = hwsim.run(stand, SequenceController(policy), parts=20, rng=0)
    assert again.outcome.identical(log.outcome)


def test_learning_pays(policy, stand, log):
    """Paired: a plan that knows of passes alone and never learns costs more, 0.036 +- 0.012 $ with 700 beads."""
    nominal = weldbead.plan(
        BOTH.replace(bead_scatter=None, scatter=weldbead.Scatter("C1", 0.15)), tolerance=None, nodes=201
    )
    other = hwsim.run(stand, SequenceController(nominal), parts=20, rng=0)
    assert float((other.outcome.penalty - log.outcome.penalty).mean()) > 0
    assert float(log.outcome.penalty.mean()) == pytest.approx(0.111, abs=0.055)  # 2 standard errors


def test_it_may_follow_without_learning(policy):
    told = dict(zip(READ, (50.0, 30.0, 800.0, 60.0, 0.3), strict=True))
    still = SequenceController(policy, learn=False)
    assert "grinding_power" not in still.reads and "learns" not in still.reports
    for controller, same in ((still, True), (SequenceController(policy), False)):
        controller.step(height=1.0, time_left=60.0)
        command = controller.step(height=0.6, time_left=44.0, **told)
        assert (command["normal_force"] == policy.action(0.6, 44.0).normal_force) is same


def test_each_bead_begins_afresh_and_copies_learn_apart(policy):
    one = SequenceController(policy)
    first = one.step(height=1.0, time_left=60.0)
    twin = deepcopy(one)
    one.step(height=0.6, time_left=44.0, **dict(zip(READ, (50.0, 30.0, 800.0, 60.0, 0.3), strict=True)))
    assert one.report()["friction_ratio"] > 0.4 and one.problem.model.friction_ratio > 0.4
    twin.step(height=0.6, time_left=44.0)
    assert twin.report()["friction_ratio"] == pytest.approx(0.33, rel=1e-12)
    one.reset()
    assert one.step(height=1.0, time_left=60.0) == first and one.problem is policy.problem


def test_an_estimator_of_other_beads_is_refused(policy):
    other = BeadEstimator(BOTH.replace(bead_scatter=CoefficientScatter(0.3, 0.15, 0.15)))
    with pytest.raises(ValueError, match=r"estimator\.problem\.bead_scatter must be that of the policy"):
        SequenceController(policy, estimator=other)
    noisy = SequenceController(policy, estimator=BeadEstimator(BOTH, force_noise=1.0))
    assert noisy.identity != SequenceController(policy).identity


def learned(**noise):
    """Belief after a pass that told of much friction."""
    belief = BeadEstimator(BOTH, **noise)
    belief.update(**dict(zip(READ, (50.0, 30.0, 800.0, 60.0, 0.3), strict=True)))
    return belief


def test_each_bead_begins_with_what_a_given_estimator_believes(policy):
    given = learned()
    one, believed = SequenceController(policy, estimator=given), given.believed
    first = one.step(height=0.3, time_left=24.0)
    assert first["normal_force"] == next_pass(believed, "cautious", 0.3, 24.0).action.normal_force
    assert first["normal_force"] != policy.action(0.3, 24.0).normal_force
    one.step(height=0.1, time_left=12.0, **dict(zip(READ, (50.0, 10.0, 800.0, 60.0, 0.3), strict=True)))
    given.reset()  # the controller has a copy
    assert one.report()["friction_ratio"] < believed.model.friction_ratio
    one.reset()
    assert one.problem == believed and one.step(height=0.3, time_left=24.0) == first
    assert one.identity == SequenceController(policy, estimator=learned()).identity
    assert one.identity != SequenceController(policy).identity
    assert SequenceController(policy).identity == SequenceController(policy, estimator=given).identity


def test_what_is_learned_serves_the_policy_that_is_followed(policy):
    told = dict(zip(READ, (50.0, 30.0, 800.0, 60.0, 0.3), strict=True))
    dear = BOTH.replace(height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(40.0)))
    second = weldbead.plan(dear, tolerance=None, nodes=101, method="certain")
    one = SequenceController(policy)
    one.step(height=1.0, time_left=60.0)
    one.step(height=0.8, time_left=52.0, **told)
    one.follow(second)
    assert one.identity == SequenceController(second).identity and one.job == dear.job
    belief = learned()
    belief.update(**told)
    expected = next_pass(belief.believed.replace(height_charge=dear.height_charge), "certain", 0.6, 44.0)
    assert one.step(height=0.6, time_left=44.0, **told)["normal_force"] == expected.action.normal_force
    other = BOTH.replace(bead_scatter=CoefficientScatter(0.3, 0.15, 0.15))
    with pytest.raises(
        ValueError, match=r"policy\.problem\.bead_scatter must be that of the beads that are l"
    ):
        one.follow(weldbead.plan(other, tolerance=None, nodes=51))


def test_the_stand_draws_beads_and_then_passes():
    """Components of variance of the logs of 400 beads of a few passes, within 4 standard errors."""
    problem = BOTH.replace(bead_scatter=CoefficientScatter(0.25, 0.1, 0.2))
    stand = hwsim.WeldBeadStand(problem, height=1.5, time=60.0)

    class Steady:
        period = None

        def reset(self):
            self.left = 4

        def step(self, **read):
            self.left -= 1
            return {"stop": 1.0} if self.left < 0 else {"duration": 12.0, "normal_force": 30.0}

    out = hwsim.run(stand, Steady(), parts=400, rng=1).outcome
    for name, beads in (("specific_energy", 0.25), ("idle_power", 0.1), ("friction_ratio", 0.2)):
        logs = np.log(out[f"true_{name}"].values)
        within = np.log1p(0.15**2)
        assert logs.var(axis=1, ddof=1).mean() == pytest.approx(within, rel=4 * np.sqrt(2 / 1200))
        between = np.log1p(beads**2) + within / 4
        assert logs.mean(axis=1).var(ddof=1) == pytest.approx(between, rel=4 * np.sqrt(2 / 400))
        mean = out[f"true_{name}"].mean(axis=1)
        spread = float(mean.std() / mean.mean())
        assert float(mean.mean()) == pytest.approx(getattr(PROCESS, name), rel=4 * spread / 20)


def test_depths_are_still_drawn_where_coefficients_are_not():
    stand = hwsim.WeldBeadStand(ALONE.replace(scatter=weldbead.Scatter("C1", 0.15)), height=1.0, time=60.0)
    bead = stand.start(np.random.default_rng(0))
    bead.step({"duration": 12.0, "normal_force": 40.0}, hwsim.protocols.FOREVER)
    energy, idle = (bead.outcome()[f"true_{name}"][0] for name in ("specific_energy", "idle_power"))
    assert energy / 12.8 == pytest.approx(idle / 114.0, rel=1e-12)  # C1 moves both together


@pytest.mark.parametrize("height", [0.004, 0.0101, 1.0, 2.0])
def test_low_and_high_beads_are_planned_again(policy, height):
    controller = SequenceController(policy)
    controller.step(height=2.0, time_left=60.0)
    command = controller.step(
        height=height, time_left=44.0, **dict(zip(READ, (50.0, 18.0, 800.0, 60.0, 0.3), strict=True))
    )
    assert controller.problem.model.friction_ratio == controller.report()["friction_ratio"]
    assert controller.report()["penalty"] <= BOTH.height_charge(height) and command["stop"] == (height < 0.02)


def test_a_bead_believed_to_be_beyond_any_force_keeps_the_last_plan():
    weak = BOTH.replace(force_max=11.0)  # the threshold force of the mean process is 8 N
    policy = weldbead.plan(weak, tolerance=None, nodes=51)
    controller = SequenceController(policy)
    controller.step(height=1.0, time_left=60.0)
    told = {"normal_force": 11.0, "tangential_force": 0.4}  # mu of 0.036: nothing is removed below 70 N
    for _ in range(2):
        controller.step(height=0.99, time_left=44.0, **told)
    assert controller.problem is policy.problem and controller.report()["friction_ratio"] < 0.2
