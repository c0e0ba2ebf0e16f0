"""Risk of a planned sequence: distribution of the penalty, and predicted beads."""

import numpy as np
import pytest
from bead_plans import plain
from weldbead_inside import LARGEST

from sdpgrind import sdp, weldbead


@pytest.mark.parametrize(("name", "height", "time"), [("P1", 1.5, 30.0), ("P3", 1.0, 3.0), ("P5", 1.2, 8.0)])
def test_risk_against_monte_carlo(name, height, time):
    policy = plain(name)
    risk = policy.risk(height, time, confidence=0.9)
    assert risk.distribution.total == pytest.approx(1.0, abs=1e-10)
    assert risk.mean == pytest.approx(policy.value(height, time), abs=2 * risk.error["mean"])
    runs = policy.simulate(runs=200_000, height=height, time_left=time, rng=5)
    n = runs.penalty.size
    over = np.mean(runs.final["height"] < 0)
    assert risk.overground == pytest.approx(over, abs=4 * np.sqrt(over * (1 - over) / n) + 4 / n)
    assert risk.passes == pytest.approx(
        np.mean(runs.moves), abs=4 * np.std(runs.moves) / np.sqrt(n) + risk.error["passes"] + 1e-12
    )
    assert risk.error["passes"] < 0.01 * risk.passes
    worst = np.sort(runs.penalty)[-n // 10 :]
    assert risk.cvar == pytest.approx(
        worst.mean(), abs=6 * np.std(worst) / np.sqrt(worst.size) + risk.error["cvar"]
    )
    level = float(np.quantile(runs.penalty, 0.8)) * 1.001
    cell = float(
        np.diff(policy.problem.height_charge(policy.problem.height_max * np.array([1 - LARGEST, 1.0])))[0]
    )
    # $ from atom to atom of the distribution, at most
    above, bar = np.mean(runs.penalty > level), 4 * 0.5 / np.sqrt(n)
    assert (
        risk.distribution.exceeds(level + cell) - bar
        <= above
        <= risk.distribution.exceeds(level - cell) + bar
    )
    assert risk.cvar >= risk.mean
    assert "CVaR" in repr(risk)


@pytest.mark.parametrize(("name", "height", "time"), [("P1", 1.5, 30.0), ("P3", 1.0, 3.0), ("P5", 1.2, 8.0)])
def test_the_distribution_on_the_table_is_that_of_outcomes_on_its_nodes(name, height, time):
    policy = plain(name)
    found = policy.table.distribution(height=height, time_left=time)
    # the search's parabola against the law
    assert found.mean == pytest.approx(policy.value(height, time), abs=1e-6)
    runs = policy.simulate(runs=200_000, height=height, time_left=time, rng=5, snap=True)
    over = np.mean(runs.final["height"] < 0)
    n = runs.penalty.size
    assert found.probability_below == pytest.approx(over, abs=4 * np.sqrt(over * (1 - over) / n) + 4 / n)


@pytest.fixture(scope="module")
def many_small_cuts():
    """A job whose last cuts, of 2 to 6 µm, are smaller than the cells of its table."""
    process = weldbead.GrindingProcess(14.5, 160.0, 0.35, 62.5, 880.0, 0.01, 9.0)
    return weldbead.SequenceProblem(
        process,
        bead_length=210.0,
        reset_time=4.0,
        durations=range(10, 31, 5),
        force_max=80.0,
        burn_limit=None,
        scatter=weldbead.Scatter("K1", 0.20, law="lognormal"),
        height_max=3.2,
        horizon=120.0,
        stage=5.0,
        height_charge=sdp.Charge(under=sdp.Linear(3.0), over=sdp.Linear(25.0)),
    )


@pytest.fixture(scope="module")
def small_cuts_planned(many_small_cuts):
    return weldbead.plan(many_small_cuts, tolerance=None, nodes=201)


def test_risk_where_last_cuts_are_smaller_than_a_cell(small_cuts_planned):
    policy = small_cuts_planned
    risk = policy.risk(2.6, 120.0, confidence=0.9)
    runs = policy.simulate(runs=100_000, height=2.6, time_left=120.0, rng=3)
    n, over = runs.penalty.size, np.mean(runs.final["height"] < 0)
    assert risk.overground == pytest.approx(
        over, abs=4 * np.sqrt(over * (1 - over) / n) + risk.error["overground"]
    )
    assert risk.passes == pytest.approx(
        np.mean(runs.moves), abs=4 * np.std(runs.moves) / np.sqrt(n) + risk.error["passes"] + 1e-12
    )
    worst = np.sort(runs.penalty)[-n // 10 :]
    assert risk.cvar == pytest.approx(
        worst.mean(), abs=6 * np.std(worst) / np.sqrt(worst.size) + risk.error["cvar"]
    )
    assert risk.error["overground"] < 0.01 * risk.overground
    # what snapping makes of it
    assert policy.table.distribution(height=2.6, time_left=120.0).probability_below < 0.7 * over


def test_noise_of_the_scan_that_is_larger_than_the_last_cuts_is_ground(small_cuts_planned):
    policy = small_cuts_planned
    start = {"height": 2.6, "time_left": 120.0, "runs": 20_000, "rng": 3}
    clear, noisy = (policy.simulate(height_noise=sd, **start) for sd in (0.0, 0.003))
    np.testing.assert_array_equal(clear.penalty, policy.simulate(**start).penalty)
    assert noisy.mean > 3 * clear.mean  # on the stand it was 0.0276 $ for 0.0059 $
    coarse = plain("P1")
    read = {"height": 1.5, "time_left": 30.0, "runs": 20_000, "rng": 3}
    found, exact = coarse.simulate(height_noise=0.003, **read), coarse.simulate(**read)
    assert abs(found.mean - exact.mean) < 4 * np.hypot(found.standard_error, exact.standard_error) + 2e-3
    with pytest.raises(ValueError, match=r"height_noise must be >= 0 \(mm\)"):
        policy.simulate(height_noise=-1.0, **start)
    with pytest.raises(ValueError, match="noise must be one of height; got"):
        policy.table.simulate(noise={"heigth": 0.1}, height=1.0, time_left=20.0)


def test_risk_that_is_unsure_says_so(many_small_cuts):
    # With 2 % of scatter each pass leaves 50 times less: the last cuts are far below every cell.
    sharp = many_small_cuts.replace(scatter=weldbead.Scatter("K1", 0.02, law="lognormal"))
    policy = weldbead.plan(sharp, tolerance=None, nodes=101)
    with pytest.warns(UserWarning, match=r"risk figures are unsure \(.*overground .*; ask simulate"):
        risk = policy.risk(2.6, 120.0)
    assert risk.error["overground"] > 0.05 * risk.overground


def test_risk_of_one_pass_is_the_law():
    policy = plain("P1")
    action = policy.action(0.3, 6.0)
    law = policy.problem.cut(6.0, action.normal_force)
    risk = policy.risk(0.3, 6.0)
    assert risk.overground == pytest.approx(float(law.over(0.3, 0)), rel=1e-9)
    assert risk.passes == pytest.approx(1.0)


def test_risk_grows_with_confidence():
    policy = plain("P1")
    found = [policy.risk(1.0, 24.0, confidence=c).cvar for c in (0.0, 0.5, 0.9, 0.99)]
    assert found[0] == pytest.approx(policy.risk(1.0, 24.0).mean, abs=1e-9)
    assert all(np.diff(found) > 0)


def test_risk_of_states_that_are_settled():
    policy = plain("P1")
    risk = policy.risk(-0.1, 10.0)
    assert (risk.mean, risk.overground, risk.passes) == (pytest.approx(1.0), 1.0, 0.0)
    assert risk.cvar == pytest.approx(1.0, rel=1e-6)
    assert risk.distribution.total == 1.0
    stop = policy.risk(1.0, 4.0)
    assert (stop.mean, stop.overground, stop.passes) == (pytest.approx(2.0), 0.0, 0.0)
    assert plain("P2").risk(-0.1, -6.0).mean == pytest.approx(1.0 + 1.5)


@pytest.mark.parametrize("time", [-2.0, -7.0, -0.3])
def test_late_states_off_the_stages(time):
    # Linear lateness is solved for all times, so its prediction must agree with its value there.
    policy = plain("P3")
    value = policy.value(1.0, time) if time <= -2 else policy.value(1.0, -2.0) - 0.1 * (2 + time)
    assert policy.table.distribution(height=1.0, time_left=time).mean == pytest.approx(value, abs=1e-9)
    risk = policy.risk(1.0, time)
    assert risk.mean == pytest.approx(value, abs=2 * risk.error["mean"] + 1e-9)
    runs = policy.simulate(runs=60_000, height=1.0, time_left=time, rng=2, snap=True)
    assert abs(runs.mean - value) < 4 * runs.standard_error
    assert np.max(runs.final["time_left"]) <= time
    assert np.all(
        np.abs((runs.final["time_left"] - time) / 2 - np.round((runs.final["time_left"] - time) / 2)) < 1e-9
    )


def test_simulation_is_reproducible_and_labelled():
    policy = plain("P1")
    one, two = (policy.simulate(runs=5000, height=1.5, time_left=30.0, rng=4) for _ in range(2))
    np.testing.assert_array_equal(one.penalty, two.penalty)
    assert not np.array_equal(
        one.penalty, policy.simulate(runs=5000, height=1.5, time_left=30.0, rng=5).penalty
    )
    assert set(one.final) == {"height", "time_left"}
    assert one.dataset["final_height"].attrs["units"] == "mm"
    np.testing.assert_allclose(one.penalty, policy.problem.height_charge(one.final["height"]))
    assert policy.simulate(runs=1, height=1.0, time_left=20.0).standard_error == np.inf


def test_simulation_on_another_process():
    policy = plain("P1")
    same = policy.simulate(policy.problem.model, runs=20_000, height=1.5, time_left=30.0, rng=4)
    np.testing.assert_array_equal(
        same.penalty, policy.simulate(runs=20_000, height=1.5, time_left=30.0, rng=4).penalty
    )
    hard = policy.problem.model.replace(specific_energy=13.0)
    runs = policy.simulate(hard, runs=20_000, height=1.5, time_left=30.0, rng=4)
    assert runs.mean > policy.value(1.5, 30.0) + 10 * runs.standard_error
    best = weldbead.plan(policy.problem.replace(model=hard), tolerance=None, nodes=401)
    assert runs.mean > best.value(1.5, 30.0) - 3 * runs.standard_error  # nothing beats the plan for the truth


def test_simulation_on_another_scatter_is_exact_for_one_pass():
    policy = plain("P1")
    truth = policy.problem.replace(scatter=weldbead.Scatter("C1", 0.3))
    force = policy.action(0.3, 6.0).normal_force
    law = truth.cut(6.0, force)
    expected = 10 * float(law.over(0.3)) + 2 * float(law.under(0.3))
    runs = policy.simulate(truth, runs=200_000, height=0.3, time_left=6.0, rng=8)
    assert abs(runs.mean - expected) < 4 * runs.standard_error


def test_simulation_keeps_moves_that_the_truth_would_not_admit():
    # A least cut of 0.3 mm rules the fastest pass out of the truth's own plan, not out of this one.
    problem = weldbead.preset("P1").replace(min_cut=0.3)
    policy = weldbead.plan(problem, tolerance=None, nodes=201)
    weak = problem.model.replace(idle_power=200.0)
    assert len(weldbead.sequence.sdp_problem(problem.replace(model=weak)).moves) < len(
        policy.table.layout.moves
    )
    runs = policy.simulate(weak, runs=50_000, height=0.5, time_left=6.0, rng=1)
    assert np.all(runs.final["time_left"] == 0)
    law = problem.replace(model=weak).cut(6.0, policy.action(0.5, 6.0).normal_force)
    expected = 10 * float(law.over(0.5)) + 2 * float(law.under(0.5))
    assert abs(runs.mean - expected) < 4 * runs.standard_error
    assert np.all(policy.simulate(weak, runs=2000, height=1.5, time_left=30.0, rng=1).final["time_left"] >= 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stage": 1.0}, r"model.stage must be that of the plan, 2.0; got 1.0"),
        ({"bead_length": 60.0}, r"model.bead_length must be that of the plan, 50.0; got 60.0"),
        ({"durations": (6, 8)}, r"model.durations must be that of the plan"),
        (
            {"lateness_charge": sdp.Linear(1.0)},
            r"model.lateness_charge must be None or not as in the plan, None; got Linear",
        ),
        (
            {"finish_charge": weldbead.FinishCharge(1.0)},
            r"model.finish_charge must be None or not as in the plan",
        ),
    ],
)
def test_truth_of_another_job_is_refused(change, message):
    policy = plain("P1")
    with pytest.raises(ValueError, match=message):
        policy.simulate(policy.problem.replace(**change), runs=10, height=1.0, time_left=20.0)


def test_refused_simulations():
    policy = plain("P1")
    with pytest.raises(ValueError, match="simulate must start from one state; got 2"):
        policy.simulate(runs=10, height=[1.0, 2.0], time_left=20.0)
    with pytest.raises(ValueError, match="runs must be >= 1"):
        policy.simulate(runs=0, height=1.0, time_left=20.0)
    with pytest.raises(ValueError, match=r"confidence must be in \[0, 1\]"):
        policy.risk(1.0, 20.0, confidence=1.5)
