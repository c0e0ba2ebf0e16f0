"""A wheel that loses radius: the plan feeds for it, within the greatest command, and open loop ends at size."""

import numpy as np
import pytest

import hwsim
from sdpgrind import plunge

PROBLEM = plunge.preset("simulation").replace(grinding_ratio=20.0)
GAMMA = PROBLEM.model.work_diameter / PROBLEM.model.wheel_diameter / 20.0


@pytest.fixture(scope="module")
def exact():
    return plunge.plan(PROBLEM)


@pytest.fixture(scope="module", params=["exact", "dp"])
def best(request, exact):
    return exact if request.param == "exact" else plunge.plan(PROBLEM, method="dp", steps=80)


def test_it_feeds_stock_deflection_and_the_radius_of_the_wheel(best):
    """The command adds up to all three, and its greatest value is that of the machine."""
    course = best.trajectory
    fed = np.trapezoid(course.command_rate.values, course.time.values)
    deflected = float(course.deflection[-1])
    if best.method == "exact":
        assert fed == pytest.approx((1.0 + GAMMA) * PROBLEM.stock + deflected, abs=2e-6)  # of the trapezoids
    assert float(course.command_rate.max()) <= PROBLEM.command_rate_max * (1.0 + 1e-12)


def test_played_open_loop_it_ends_at_size(best):
    """On a machine that wears: the axis follows straight lines of a sample, 1e-5 mm from the program."""
    step = PROBLEM.sample_time
    axis = best.program("csv", deviation=1e-4, certain=True).course
    time = step * np.arange(int(best.time / step) + 3)
    part = hwsim.PlungeGrinder(PROBLEM.replace(stock=0.6), noise=None).start(np.random.default_rng(0))
    rates = np.maximum(np.diff(axis(time)), 0.0) / step
    sizes = [0.0, *(part.step({"command_rate": rate}, 1)["size"] for rate in rates)]
    assert np.interp(best.time, time, sizes) == pytest.approx(PROBLEM.stock, abs=1e-5)


def test_three_ways(exact):
    """Each within three times the error that it states; a wheel that keeps its size is faster."""
    stages = plunge.plan(PROBLEM, method="dp", steps=60)
    points = plunge.plan(PROBLEM, method="collocation", steps=60)
    assert exact.time == pytest.approx(12.0928, abs=2e-4)
    for other in (stages, points):
        assert other.time == pytest.approx(exact.time, abs=3 * other.error + 1e-6)
    kept = plunge.plan(PROBLEM.replace(grinding_ratio=np.inf))
    assert exact.time > kept.time + 0.05


@pytest.mark.parametrize("ratio", [20.0, 6.0])
def test_three_stages_end_at_size_at_the_final_rate(ratio):
    """The axis feeds for the wheel; without noise the part passes size by less than a sample, and is round.

    The stages cost what they cost without wear, 0.5 % and a sample, and as much again for the slower stage.
    """
    problem = PROBLEM.replace(grinding_ratio=ratio)
    controller = plunge.StagedController(problem)
    log = hwsim.run(hwsim.PlungeGrinder(problem, noise=None), controller)
    out, rate = log.outcome, problem.final_rate
    assert -rate * problem.sample_time <= float(out.remaining[0]) <= 1e-6
    assert problem.roundness_max - 5e-5 < float(out.roundness[0]) <= problem.roundness_max
    assert not out.burned.any() and float(out.time[0]) < 1.03 * plunge.plan(problem).time
    fed = np.nansum(log["controller"].command_rate_command.values) * problem.sample_time
    wear = problem.model.wheel_wear * (problem.stock - float(out.remaining[0]))
    assert fed == pytest.approx(problem.stock + wear + float(problem.model.deflection(rate)), abs=1e-4)


def test_stages_that_wait_for_size_keep_the_rate_of_the_work():
    """Believed too stiff: spark-out begins late enough to be fed on, by the way of work and wheel together."""
    believed = PROBLEM.replace(stiffness=1.1 * PROBLEM.model.stiffness)
    grinder = hwsim.PlungeGrinder(believed, truth=PROBLEM.model, noise=None)
    log = hwsim.run(grinder, plunge.StagedController(believed))
    fed = log["controller"].command_rate_command.values
    assert fed[-2] == pytest.approx((1.0 + GAMMA) * PROBLEM.final_rate, rel=1e-12)
    assert float(log.outcome.remaining[0]) < 2e-3


def test_the_doubts_of_a_worn_wheel():
    """The depth that counts is that at the rate of the work: exact and by stages."""
    doubted = PROBLEM.replace(burning_sd=0.03, sharpness_sd=0.0)
    by_bound = plunge.plan(doubted, confidence=0.999)
    stages = plunge.plan(doubted, confidence=0.999, method="dp", steps=60)
    assert stages.time == pytest.approx(by_bound.time, abs=3 * stages.error)
    remaining = by_bound.trajectory.remaining.values
    for k in np.flatnonzero(by_bound.trajectory.piece.values == 4)[::40]:
        safe = doubted.safe_rate(float(remaining[k]), 0.999)
        assert float(by_bound.trajectory.infeed_rate[k]) == pytest.approx(safe, rel=1e-6)
