"""Planner, controller and stand together: what was promised is what comes out."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from math import sqrt

import numpy as np
import pytest

import hwsim
from hwsim._log.log import same
from sdpgrind import weldbead

P1 = weldbead.preset("P1")
FINISH = weldbead.preset("P5").replace(
    finish_charge=weldbead.FinishCharge(0.1, reference_rate=12.5), pass_charge=0.01, min_cut=0.02
)
PROBLEMS = {
    "P1": P1,
    "P2": weldbead.preset("P2"),
    "P4": weldbead.preset("P4"),
    "P5": weldbead.preset("P5"),
    "finish": FINISH,
    "K2, log-normal": P1.replace(scatter=weldbead.Scatter("K2", 0.3, law="lognormal")),
    "K1 and mu": weldbead.preset("P4").replace(scatter=weldbead.Scatter(("K1", "mu"), (0.1, 0.1))),
}
START = {"P2": {"height": 1.5, "time": 4.0}, "P5": {"height": 1.5, "time": 14.0}}


@pytest.fixture(scope="module")
def controller():
    return weldbead.SequenceController(weldbead.plan(P1, tolerance=None, nodes=101))


@pytest.mark.parametrize("name", PROBLEMS)
def test_realised_penalty_is_the_planned_one(name):
    problem = PROBLEMS[name]
    stand = hwsim.WeldBeadStand(problem, height_noise=0.0, **START.get(name, {}))
    policy = weldbead.plan(problem, tolerance=None, nodes=201)  # within 1e-3 $ of the converged ones
    log = hwsim.run(stand, weldbead.SequenceController(policy), parts=150, rng=11)
    penalty, planned = log.outcome.penalty.values, log.outcome.penalty_planned.values
    assert np.ptp(planned) == 0.0
    assert planned[0] == policy.value(height=stand.start_height, time_left=stand.start_time)
    assert abs(penalty.mean() - planned[0]) < 4 * penalty.std() / sqrt(150) + 1e-3
    risk = policy.risk(height=stand.start_height, time_left=stand.start_time)
    passes = log.outcome.passes.values
    assert abs(passes.mean() - risk.passes) < 4 * passes.std() / sqrt(150) + 1e-3
    assert log.outcome.burned.values.sum() == 0


def test_beads_of_linear_lateness_end_late_where_it_pays():
    problem = weldbead.preset("P3")
    policy = weldbead.plan(problem, tolerance=None, nodes=201)
    stand = hwsim.WeldBeadStand(problem, height=2.0, time=0.0, height_noise=0.0)
    log = hwsim.run(stand, weldbead.SequenceController(policy), parts=200)
    penalty = log.outcome.penalty.values
    assert (log.outcome.lateness.values > 0).all()
    assert abs(penalty.mean() - 2.903457) < 4 * penalty.std() / sqrt(200) + 1e-2  # spec, J(2, 0) of P3


def test_controllers_are_compared_on_equal_beads(controller):
    class Hasty:
        """Grinds at full force until half a millimetre is left."""

        period = None

        def reset(self):
            pass

        def step(self, *, height, time_left, **others):
            stop = height < 0.5 or time_left < 6.0
            return {"stop": 1.0} if stop else {"duration": 6.0, "normal_force": 50.0}

    log = hwsim.compare(hwsim.WeldBeadStand(P1), {"plan": controller, "hasty": Hasty()}, parts=40, rng=3)
    penalty = log.outcome.penalty
    better = penalty.sel(controller="hasty") - penalty.sel(controller="plan")
    assert float(better.mean()) > 10 * float(better.std()) / sqrt(40)
    assert set(log.tiers) == {"sequence", "controller"}


def test_from_log_back_to_the_model(controller):
    truth = P1.model.replace(specific_energy=13.0, idle_power=120.0)
    log = hwsim.run(hwsim.WeldBeadStand(P1, truth=truth), controller, parts=60, rng=5)
    estimate = weldbead.identify(log, "power")
    assert abs(estimate["specific_energy"] - 13.0) < 4 * estimate.sd[0]
    assert P1.updated(estimate).model.specific_energy == estimate["specific_energy"]


def test_replanning_between_parts_resumes_with_equal_results(tmp_path):
    log = {}
    for journal in (None, tmp_path / "run.db"):
        run = {"rng": 2, "adapt": Replan(), "journal": journal}
        stand = hwsim.WeldBeadStand(P1, truth=P1.model.replace(specific_energy=13.0))
        first = weldbead.SequenceController(weldbead.plan(P1, tolerance=None, nodes=51))
        if journal is not None:
            hwsim.run(stand, first, parts=1, **run)
        log[journal] = hwsim.run(stand, first, parts=3, **run)
    assert same(*log.values())
    assert np.unique(log[None].outcome.penalty_planned.values).size == 3


class Replan:
    """Estimates the specific energy from all beads so far and plans anew."""

    def __init__(self):
        self.power, self.rate = [], []

    def next(self, controller, part_log):
        table = part_log["sequence"]
        read = np.isfinite(table.grinding_power.values)
        self.power += table.grinding_power.values[read].tolist()
        self.rate += table.removal_rate.values[read].tolist()
        estimate = weldbead.identify({"grinding_power": self.power, "removal_rate": self.rate}, "power")
        problem = P1.replace(specific_energy=estimate["specific_energy"])
        return weldbead.SequenceController(weldbead.plan(problem, tolerance=None, nodes=51))


def test_workers_give_the_same_beads(controller):
    stand = hwsim.WeldBeadStand(P1)
    serial = hwsim.run(stand, controller, parts=20, rng=1)
    with ThreadPoolExecutor(3) as threads:
        assert same(hwsim.run(stand, controller, parts=20, rng=1, executor=threads), serial)
    assert same(hwsim.run(*pickle.loads(pickle.dumps((stand, controller))), parts=20, rng=1), serial)


def test_controller_goes_to_another_process_as_it_is(controller):
    twin = pickle.loads(pickle.dumps(controller))
    assert twin.step(height=1.0, time_left=10.0) == controller.step(height=1.0, time_left=10.0)


@pytest.mark.parametrize(
    ("stand", "said"),
    [
        ({"bead_width": 10.0}, "its bead_width is 12.5 mm, that of the plant 10.0 mm"),
        ({"bead_length": 60.0}, "its bead_length is 50.0 mm, that of the plant 60.0 mm"),
        ({"disk_radius": 80.0}, "its disk_radius is 85.0 mm, that of the plant 80.0 mm"),
        ({"reset_time": 1.0}, "its reset_time is 2.0 s, that of the plant 1.0 s"),
        ({"force_max": 40.0}, "its force_max is 50.0 N, that of the plant 40.0 N"),
        (
            {"burn_limit": weldbead.ForceBurnLimit(40.0)},
            "its burn_limit is None, that of the plant ForceBurnLimit(",
        ),
    ],
)
def test_policy_of_another_job_is_refused(controller, stand, said):
    with pytest.raises(ValueError) as caught:
        hwsim.run(hwsim.WeldBeadStand(P1.replace(**stand)), controller)
    head = "SequenceController and WeldBeadStand do not fit: controller is made for another part or machine: "
    assert str(caught.value).startswith(head + said) and "\n" not in str(caught.value)


def test_what_is_estimated_charged_or_hidden_may_differ(controller):
    truth = P1.model.replace(specific_energy=12.0, bead_width=12.0, disk_radius=84.0)
    other = P1.replace(
        specific_energy=11.0, idle_power=90.0, friction_ratio=0.31, free_speed=480.0, speed_droop=0.001
    )
    charged = other.replace(
        pass_charge=0.1,
        horizon=80.0,
        durations=(6.0, 8.0),
        height_max=3.0,
        scatter=weldbead.Scatter("K1", 0.1),
    )
    log = hwsim.run(hwsim.WeldBeadStand(charged, truth=truth, height=1.0, time=20.0), controller, parts=2)
    assert len(log) == 2


def test_replanned_policy_runs_on_the_same_stand(controller):
    stand = hwsim.WeldBeadStand(P1)
    estimate = weldbead.identify(hwsim.run(stand, controller, parts=10, rng=1), "power")
    problem = P1.updated(estimate)
    assert problem != P1 and problem.job == P1.job
    assert hwsim.check(stand, weldbead.SequenceController(weldbead.plan(problem, tolerance=None, nodes=51)))
