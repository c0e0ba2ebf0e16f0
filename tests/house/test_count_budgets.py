"""Jobs that memory does not hold are refused before they are begun, by name and with what to change."""

import sys

import numpy as np
import pytest

import hwsim
import sdpgrind
from sdpgrind import finishing, sdp, weldbead
from sdpgrind.base import budget
from sdpgrind.weldbead import force

P1 = weldbead.preset("P1")
COARSE = {"nodes": 101, "tolerance": None}


class Leave:
    period = None

    def reset(self): ...

    def step(self, **measured):
        return {"stop": 1.0}


@pytest.fixture
def poor(monkeypatch):
    """A computer with 200 MiB left."""
    monkeypatch.setattr(budget, "free_memory", lambda: 200 * 2.0**20)


def _controller():
    plan = type("Plan", (), {"time": [0.0, 5.0], "normal_force": [30.0, 30.0], "fly_height": [10.0, 10.0]})
    return force.ForceController(plan, force.PI.design(crossover=20.0))


def _roughness(runs):
    settings = {"pattern": ["zigzag"] * 18, "tool_diameter": [10.0] * 18, "normal_force": [1.0] * 18}
    return finishing.roughness.RoughnessModel.published().responses(settings, rng=0, runs=runs)


ASKED = {
    "nodes": (lambda: weldbead.plan(P1, nodes=10**9), "a grid of 1e+09 nodes must take less memory"),
    "runs": (
        lambda: weldbead.plan(P1, **COARSE).simulate(runs=2**30, rng=0, height=1.0, time_left=30.0),
        "runs = 1073741824 must take less memory: it would be 64 GiB, and half of what is free is",
    ),
    "parts": (
        lambda: hwsim.run(hwsim.WeldBeadStand(P1), Leave(), parts=10**9),
        "parts = 1000000000 must take less memory",
    ),
    "loops": (
        lambda: force.simulate_loop(_controller(), duration=2.0, runs=2**31),
        "2147483648 runs of 120 samples must take less memory",
    ),
    "studies": (lambda: _roughness(2**31), "runs = 2147483648 must take less memory"),
}


@pytest.mark.parametrize("what", ASKED)
def test_what_memory_does_not_hold_is_refused_by_name(what, poor):
    ask, said = ASKED[what]
    with pytest.raises(
        sdpgrind.BudgetError, match=r"half of what is free is 0\.0977 GiB; .+ (need less|tell as much)"
    ) as told:
        ask()
    assert str(told.value).startswith(said)


def test_what_fits_is_done(poor):
    runs = weldbead.plan(P1, **COARSE).simulate(runs=1000, rng=0, height=1.0, time_left=30.0)
    assert runs.penalty.size == 1000


def test_a_refused_series_keeps_its_first_part(poor, tmp_path):
    with pytest.raises(sdpgrind.BudgetError):
        hwsim.run(hwsim.WeldBeadStand(P1), Leave(), parts=10**9, journal=tmp_path / "run.db")
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert journal.parts == 1


def test_the_prediction_of_a_grid_covers_its_tables():
    problem = weldbead.sequence.sdp_problem(P1, 401)
    policy = sdp.plan(problem)
    kept = sum(array.nbytes for array in policy.table.arrays)
    from sdpgrind.sdp._plan.budget import _sweep_bytes, table_bytes

    assert kept <= table_bytes(problem, 1) + _sweep_bytes(problem, 1) <= 100 * kept


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_free_memory_is_that_of_this_computer():
    before = budget.free_memory()
    held = np.ones(2**26)  # 512 MiB
    after = budget.free_memory()
    assert 0.25 * held.nbytes < before - after < 6 * held.nbytes  # others use it, too


def test_a_container_bounds_it(monkeypatch, tmp_path):
    for name, text in {
        "max": "1000000\n",
        "current": "900000\n",
        "stat": "active_file 50000\ninactive_file 250000\n",
    }.items():
        (tmp_path / f"memory.{name}").write_text(text)
    monkeypatch.setattr(budget, "_GROUP", tmp_path)
    assert budget.free_memory() == 400_000.0
    (tmp_path / "memory.max").write_text("max\n")
    assert budget.free_memory() > 400_000.0
