"""Risk of a strategy where friction is not what it was told: against the machine, kept, refused."""

import numpy as np
import pytest
from push_inside import Size, felt_model
from scipy.stats import binomtest
from strategy_twins import QUICK, quick_strategy

import hwsim
import sdpgrind
from centering import CenteringController, Strategy, preset
from centering.cycle import RiskTable
from centering.cycle._strategy.limit_curve import needed

PROBLEM = preset("printed").replace(mass=12.0, radius=85.0, friction_range=(0.6, 1.4))


@pytest.fixture(scope="module")
def strategy():
    return quick_strategy(PROBLEM, kinds=QUICK, size=Size(40, 3))


@pytest.fixture(scope="module")
def risk(strategy):
    return strategy.robust()


def test_factors_and_columns(risk):
    assert risk.factor.tolist() == [0.6, 0.8, 1.0, 1.2, 1.4]
    table = risk.to_dataframe()
    assert list(table.columns) == ["time", "time_95", "pushes", "thrown", "unfinished"]
    assert np.all(table["time"] < table["time_95"]) and np.all(table["unfinished"] == 0.0)
    assert np.all(table["thrown"] <= 0.01)  # the table is kept slow enough for the range


@pytest.mark.parametrize(("row", "parts"), [(0, 12), (4, 12)])
def test_against_the_machine(strategy, risk, row, parts):
    """Bar: 15 % of the mean time; 12 parts are known to 8 %, those of the table to 2 %."""
    truth = felt_model(PROBLEM.model, float(risk.factor[row]))
    machine = hwsim.CenteringMachine(PROBLEM, truth=truth)
    out = hwsim.run(machine, CenteringController(strategy), parts=parts, rng=3).outcome
    assert float(out.time.mean()) == pytest.approx(risk.time[row], rel=0.15 + 1.5 * 0.08)
    assert out.slipped.sum() == 0 and out.collisions.sum() == 0 and np.all(out.finished == 1)


def test_a_range_that_was_not_told_throws_parts(strategy):
    """At 0.41 of the friction three parts of four fly; the plan is for 0.6 less three sd: 0.45."""
    risk = strategy.robust((0.41, 1.0), runs=60)
    assert risk.thrown[0] > 0.5 > risk.thrown[1]
    assert np.all(np.diff(risk.thrown) <= 0.0)
    assert risk.thrown[-1] == 0.0 and np.all(np.diff(risk.factor) > 0.0)


def test_none_of_some_is_no_share_of_0(risk, tmp_path):
    """The upper end of the 95 % interval of a share that was never seen: the chance of that is 2.5 % there."""
    still = risk.replace(thrown=np.zeros(5), unfinished=np.array([0.0, 0.0, 0.0, 0.0, 0.015]))
    none = (
        "; none of 200 thrown (1.8 % at most, 95 %); 3 of 200 left uncentred (4.3 % at most, 95 %) at x 1.4"
    )
    assert risk.runs == 200 and still.told.endswith(none)
    assert binomtest(0, 200).proportion_ci(0.95).high == pytest.approx(1 - 0.025 ** (1 / 200), rel=1e-9)
    assert "none of 60 thrown (6.0 % at most, 95 %)" in still.replace(runs=60).told
    assert "at most 0 % of the parts simulated thrown;" in still.replace(runs=0).told
    assert repr(still) == f"RiskTable({still.told})"
    still.save(tmp_path / "risk.nc")
    assert sdpgrind.load(tmp_path / "risk.nc").runs == 200


@pytest.mark.parametrize("found", [1, 4, 199, 200])
def test_a_share_that_was_seen_has_its_upper_end(risk, found):
    """By Clopper and Pearson as of none; the rule by an independent program."""
    thrown = np.array([0.0, found / 200, 0.0, 0.0, 0.0])
    most = 100 * binomtest(found, 200).proportion_ci(0.95).high
    told = risk.replace(thrown=thrown).told
    said = next(part for part in told.split("; ") if "thrown" in part)
    assert said.startswith(f"{found} of 200 thrown (") and said.endswith(" % at most, 95 %) at x 0.8")
    assert float(said.split("(")[1].split()[0]) == pytest.approx(most, rel=0.02)
    assert f"s, 95 % of parts within {risk.time_95[risk.worst]:.2f} s; " in told


def test_it_is_repeatable_and_says_the_worst(strategy):
    one, two = (strategy.robust(runs=20, rng=4) for _ in range(2))
    assert one == two
    assert one != strategy.robust(runs=20, rng=5)
    assert f"slowest on average at x {one.factor[one.worst]:g}" in repr(one)
    assert "friction x 0.6 to 1.4, worst x" in repr(strategy)


def test_kept_and_loaded(risk, strategy, tmp_path):
    risk.save(tmp_path / "risk.nc")
    assert RiskTable.from_file(tmp_path / "risk.nc") == risk
    strategy.save(tmp_path / "strategy.nc")
    again = Strategy.from_file(tmp_path / "strategy.nc")
    assert again.problem.friction_range == (0.6, 1.4) and again.robust(runs=20) == strategy.robust(runs=20)


def test_what_is_refused(strategy):
    with pytest.raises(ValueError, match=r"friction_range\[0\] must be in \(0, 1\]"):
        strategy.robust((0.0, 1.2))
    with pytest.raises(
        ValueError, match=r"friction_range must be in \[0.41, 2.46\], the factors that the tables"
    ):
        strategy.robust((0.05, 1e3))
    for wrong in ((), np.array([0.6, 1.4])):
        with pytest.raises(TypeError, match=r"friction_range must be a pair \(lowest, highest factor\)"):
            strategy.robust(wrong)
    with pytest.raises(ValueError, match="runs must be"):
        strategy.robust(runs=0)


def test_times_refuse_the_offsets_that_the_strategy_does_not_hold(strategy):
    for time in (strategy.start_time, strategy.cycle_time):
        with pytest.raises(ValueError, match=r"offset must be <= .* \(the strategy's\) \(mm\); got 500.0"):
            time(500.0)
        with pytest.raises(ValueError, match=r"offset must be >= 0 \(mm\); got -1.0"):
            time(-1.0)
    assert 0.0 < strategy.start_time(strategy.offset_max) < strategy.cycle_time(strategy.offset_max)


def test_friction_that_a_ring_needs_against_a_sum_along_it():
    """Even pressure, slip in one direction with a spin: force and moment of each ratio need just their mu g."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20_001)[:-1]
    for ratio in (0.2, 0.5, 0.7854, 1.0, 1.4):
        slide, spin = np.cos(ratio), np.sin(ratio)
        x, y = slide - spin * np.sin(turn), spin * np.cos(turn)
        fast = np.hypot(x, y)
        pull, moment = np.mean(x / fast), np.mean((y * np.cos(turn) - x * np.sin(turn)) / fast)
        assert needed(np.array([pull]), np.array([moment]))[0] == pytest.approx(1.0, abs=1e-3)
    assert needed(np.array([3.0, 0.0]), np.array([0.0, 2.0])) == pytest.approx([3.0, 2.0])
