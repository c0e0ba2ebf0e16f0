"""What a plan that learns promises: against the stand, the forward recursion, and what must be ordered."""

import pickle

import numpy as np
import pytest
from stand_job import ALONE, BOTH

import hwsim
import sdpgrind
from sdpgrind import weldbead
from sdpgrind.weldbead import CoefficientScatter, SequenceController

STATE = (0.5, 36.0)


@pytest.fixture(scope="module")
def policy():
    return weldbead.plan(BOTH, tolerance=None, nodes=201)


@pytest.fixture(scope="module")
def promise(policy):
    return policy.risk(*STATE, rng=1, finished_within=0.04)


def test_it_is_what_the_stand_realises(policy, promise):
    """Two samples of the same beads' law: their means differ by at most 4 standard errors."""
    stand = hwsim.WeldBeadStand(
        BOTH, height=STATE[0], time=STATE[1], height_noise=0.0, power_noise=0.0, force_noise=0.0
    )
    outcome = hwsim.run(stand, SequenceController(policy), parts=100, rng=7).outcome
    realised = {
        "mean": outcome.penalty.values,
        "overground": outcome.height.values < 0,
        "passes": outcome.passes.values,
        "finished": np.abs(outcome.height.values) <= 0.04,
        "height": outcome.height.values,
    }
    for name, values in realised.items():
        both = np.hypot(promise.error[name] / 1.96, values.std(ddof=1) / np.sqrt(values.size))
        assert getattr(promise, name) == pytest.approx(values.mean(), abs=4 * both), name


def test_learning_pays_and_knowing_would_pay_more(policy, promise):
    assert promise.learning > 0 and promise.knowing > -promise.error["knowing"]
    assert promise.mean < policy.value(*STATE)  # the plan's own figure, as if each pass had another bead
    assert promise.cvar > promise.mean > 0


def test_beads_that_are_alike_promise_what_the_recursion_does():
    """No scatter of beads: nothing to learn or to know, and the table's own risk."""
    alike = BOTH.replace(bead_scatter=CoefficientScatter(0.0, 0.0, 0.0))
    found = weldbead.plan(alike, tolerance=None, nodes=201).risk(*STATE, rng=3)
    exact = weldbead.plan(ALONE, tolerance=None, nodes=201).risk(*STATE)
    for name in ("mean", "overground", "passes", "finished", "height"):
        error = 2 * found.error[name] + exact.error[name]
        assert getattr(found, name) == pytest.approx(getattr(exact, name), abs=error), name
    for name in ("learning", "knowing"):  # forces of replans and of the table differ by what 2e-4 $ leave
        assert getattr(found, name) == pytest.approx(0.0, abs=2 * found.error[name] + 1e-3)


def test_the_same_seed_promises_the_same_and_an_asked_error_is_kept(policy):
    wide = policy.risk(*STATE, error=0.06, rng=2)
    assert wide.error["mean"] <= 0.06
    assert wide.mean == policy.risk(*STATE, error=0.06, rng=2).mean


def test_a_saved_plan_keeps_its_promise(policy, promise, tmp_path):
    policy.save(tmp_path / "plan.nc")
    loaded = sdpgrind.load(tmp_path / "plan.nc")
    assert loaded.dataset.identical(policy.dataset)  # a promise makes no other plan of it
    assert pickle.loads(pickle.dumps(policy))._promises.keys() == policy._promises.keys()
    kept = loaded.risk(*STATE, rng=1, finished_within=0.04, progress=_refuse)
    assert vars(kept) == vars(promise)


def _refuse(share, text):
    raise AssertionError("a kept promise is not drawn again")


def test_a_confidence_that_leaves_one_bead_is_not_told_as_exact(policy):
    rare = policy.risk(*STATE, confidence=0.999, error=1.0, rng=5)
    assert rare.error["cvar"] == np.inf and rare.cvar >= policy.risk(*STATE, error=1.0, rng=5).cvar


def test_beads_that_no_force_removes_are_counted_as_left(policy):
    broad = BOTH.replace(bead_scatter=CoefficientScatter(0.1, 0.9, 0.9))
    wide = weldbead.plan(broad, tolerance=None, nodes=51)
    assert any(known is None for _, known in wide._known_beads)
    assert policy.lower_bound(1.0, 48.0) < wide.lower_bound(1.0, 48.0) < 2.0


def test_ends_of_the_recursion_are_those_of_simulated_beads():
    policy = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=401)
    risk = policy.risk(1.0, 24.0, finished_within=0.1)
    height = policy.simulate(runs=40_000, height=1.0, time_left=24.0, rng=0).final["height"]
    for found, sample in ((risk.finished, np.abs(height) <= 0.1), (risk.height, height)):
        assert found == pytest.approx(sample.mean(), abs=4 * sample.std() / np.sqrt(sample.size) + 1e-3)
    assert risk.learning == risk.knowing == 0.0


def test_known_beads_cost_less_than_learned_ones(policy, promise):
    """Two ways to what known beads cost: 27 plans by Gauss's rule, and the drawn beads of a promise."""
    known = float(policy.lower_bound(*STATE))
    assert promise.mean - promise.knowing == pytest.approx(known, abs=2 * promise.error["mean"] + 1e-3)
    assert known < promise.mean + promise.error["mean"]
    short = policy.lower_bound([0.5, 1.0], 36.0)
    assert short[0] < policy.value(0.5, 36.0) and short[1] > policy.value(1.0, 36.0)
    alike = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=101)
    assert alike.lower_bound(1.0, 20.0) == alike.value(1.0, 20.0)


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("error", 0.0, r"error must be > 0 \(\$\)"),
        ("finished_within", -0.1, r"finished_within must be >= 0 \(mm\)"),
        ("confidence", 1.5, "confidence"),
        ("rng", -1, "rng must be"),
        ("last_duration", 6.0, "last_duration must be None where beads differ"),
    ],
)
def test_wrong_options_are_refused(policy, option, value, words):
    with pytest.raises((ValueError, TypeError), match=words):
        policy.risk(*STATE, **{option: value})
