"""The planned sequence as a user meets it: looked up, predicted from, saved."""

import dataclasses
import math

import numpy as np
import pytest
from bead_plans import NAMES, plain
from hypothesis import example, given, settings
from hypothesis import strategies as st
from weldbead_inside import between_nodes, default_tolerance

import sdpgrind
from sdpgrind import sdp, weldbead

FINISH = weldbead.preset("P1").replace(
    finish_charge=weldbead.FinishCharge(0.4, reference_rate=12.5),
    min_cut=0.02,
    pass_charge=0.01,
    horizon=30.0,
)


@pytest.fixture(scope="module")
def finish():
    return weldbead.plan(FINISH, tolerance=None, nodes=201)


def same_action(one, many):
    """A scalar action against an array action of one state."""
    assert bool(one.stop) == bool(many.stop[0])
    assert one.duration == many.duration[0]
    np.testing.assert_array_equal(one.feed_rate, many.feed_rate[0])
    np.testing.assert_allclose(one.normal_force, many.normal_force[0], rtol=1e-13)
    np.testing.assert_allclose(one.gap, many.gap[0], rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(one.mean_cut, many.mean_cut[0], rtol=1e-12)


@settings(max_examples=150, deadline=None)
@given(name=st.sampled_from(NAMES), height=st.floats(0.0, 2.0), time=st.floats(0.0, 60.0))
@example(name="P1", height=2.0, time=60.0)
@example(name="P2", height=0.0, time=0.0)
@example(name="P3", height=2.0, time=0.0)
@example(name="P5", height=1.0, time=5.999999)
def test_fast_path_is_the_array_path(name, height, time):
    policy = plain(name)
    value = policy.value(height, time)
    assert type(value) is float
    assert value == pytest.approx(policy.value(np.array([height]), time)[0], rel=1e-13, abs=1e-15)
    cell = height / 0.005
    stage = time / 2
    if abs(cell - round(cell)) > 1e-6 and abs(stage - round(stage)) > 1e-6:
        same_action(policy.action(height, time), policy.action(np.array([height]), time))


def test_numbers_are_looked_up_without_the_table(monkeypatch):
    policy = plain("P1")
    states = [(0.731, 34.0), (1, 20), (0.0, 0.0), (2.0, 60.0), (0.2, 2.0)]
    found = [(policy.value(*each), policy.action(*each).duration) for each in states]

    def read(*_, **__):
        raise AssertionError("the table was read")

    for name in ("value", "locate", "act"):
        monkeypatch.setattr(policy.table, name, read)
    assert found == [(policy.value(*each), policy.action(*each).duration) for each in states]
    with pytest.raises(AssertionError):
        policy.value(np.array([0.731]), 34.0)


@pytest.mark.parametrize("name", NAMES)
def test_fast_path_at_every_node(name):
    # Node coordinates may round to either side of the node: the action must not care.
    policy = plain(name)
    height = policy.states()[0]
    for time in (6.0, 8.0, 24.0, 60.0):
        many = policy.action(height, time)
        for k in (0, 1, 57, 115, 200, 399, 400):
            same_action(policy.action(float(height[k]), time), policy.action(height[[k]], time))
            assert policy.action(float(height[k]), time).duration == many.duration[k]
            assert policy.value(float(height[k]), time) == pytest.approx(
                policy.table.table.value[-31 + round(time / 2), 0, k]
            )


@pytest.mark.parametrize("wrong", ["1", "1,5", True, np.bool_(True), None, [1.0, "2"], [True, False]])
def test_what_is_no_number_is_refused(finish, wrong):
    for policy in (plain("P1"), finish):
        for ask in (policy.value, policy.action, policy.gradient):
            with pytest.raises(TypeError, match=r"height must be a number, or an array of them \(mm\); got"):
                ask(height=wrong, time_left=24.0)
        with pytest.raises(TypeError, match=r"time_left must be a number, or an array of them \(s\); got"):
            policy.action(1.0, wrong)
    for ask in (plain("P1").table.value, plain("P1").table.action):  # of a policy of `sdp`
        with pytest.raises(TypeError, match=r"height must be a number"):
            ask(height=wrong, time_left=24.0)


def test_noise_of_a_scan_in_micrometres_is_refused():
    with pytest.raises(ValueError, match=r"height_noise must be in mm, some 0.002; units.um"):
        plain("P1").simulate(height=1.5, time_left=30.0, height_noise=3.0, runs=1)


@pytest.mark.parametrize("height", [1, 1.0, np.float64(1), np.int64(1), np.float32(1), np.array(1.0)])
@pytest.mark.parametrize("time", [24, 24.0, np.float64(24), np.int32(24)])
def test_any_kind_of_number(height, time):
    policy = plain("P1")
    assert policy.value(height, time) == policy.value(1.0, 24.0)
    assert isinstance(policy.value(height, time), float)
    action = policy.action(height, time)
    assert isinstance(action, weldbead.sequence.SequenceAction)
    assert isinstance(action.normal_force, float) and action.stop is False
    assert (action.duration, action.normal_force) == (
        policy.action(1.0, 24.0).duration,
        policy.action(1.0, 24.0).normal_force,
    )
    assert action.feed_rate == policy.problem.feed_rate(action.duration)


def test_arrays_broadcast():
    policy = plain("P5")
    height, time = np.array([[-0.1], [0.3], [1.7]]), np.array([-8.0, 0.0, 7.0, 30.0])
    value, action, slope = (
        policy.value(height, time),
        policy.action(height, time),
        policy.gradient(height, time),
    )
    for field in (
        value,
        action.stop,
        action.duration,
        action.feed_rate,
        action.normal_force,
        action.gap,
        action.mean_cut,
        slope,
    ):
        assert field.shape == (3, 4)
    for i in range(3):
        for j in range(4):
            assert value[i, j] == pytest.approx(policy.value(float(height[i, 0]), float(time[j])), rel=1e-14)
    assert (
        np.all(action.stop[0])
        and np.all(np.isnan(action.normal_force[0]))
        and np.all(action.duration[0] == 0)
    )
    assert np.all(action.mean_cut[action.stop] == 0)


def test_one_type_of_action():
    policy = plain("P1")
    for state in ((1.0, 24.0), (1.0, 2.0), (-0.5, 10.0), (0.0, 60.0), (np.array([1.0, -1.0]), 24.0)):
        action = policy.action(*state)
        assert type(action) is weldbead.sequence.SequenceAction
        assert "SequenceAction(" in repr(action)
    stopped = policy.action(1.0, 2.0)
    assert (
        stopped.stop and stopped.duration == 0 and math.isnan(stopped.feed_rate) and stopped.mean_cut == 0.0
    )


@settings(max_examples=60, deadline=None)
@given(stage=st.integers(0, 30), part=st.floats(0.0, 0.999), height=st.floats(-0.2, 2.0))
def test_between_stages_the_stage_below_answers(stage, part, height):
    policy = plain("P2")
    assert policy.value(height, min(60.0, 2.0 * (stage + part))) == policy.value(height, 2.0 * stage)
    # Rounding just below a stage does not lose it.
    assert policy.value(height, 2.0 * stage * (1 - 1e-15)) == policy.value(height, 2.0 * stage)


def test_late_side():
    for name, rate in (("P2", 0.25), ("P3", 0.10)):
        policy = plain(name)
        height = np.linspace(-0.2, 2, 45)
        base = policy.value(height, -2.0) - 2 * rate
        for late in (0.7, 4.0, 123.456):  # a linear charge is solved for all times, on stages or off them
            np.testing.assert_allclose(policy.value(height, -late), base + rate * late, rtol=1e-13)
    policy = plain("P5")
    np.testing.assert_allclose(policy.value(1.0, -70.0), 2.0 + 49.0)  # beyond the window one stops
    assert policy.action(1.0, -71.3).stop


def test_overground():
    policy = plain("P5")
    assert policy.value(-0.1, -10.0) == pytest.approx(20 * 0.01 + 0.01 * 100)
    assert policy.gradient(-0.1, -10.0) == pytest.approx(-4.0)
    assert policy.action(-0.1, 60.0).stop
    assert plain("P1").action(0.0, 60.0).stop


@pytest.mark.parametrize(
    ("height", "time", "message"),
    [
        (2.001, 10.0, r"height must be <= 2 \(mm\); got 2.001"),
        (1.0, 60.5, r"time_left must be <= 60, the horizon of the policy \(s\); got 60.5"),
        (1.0, 60.001, r"time_left must be <= 60, the horizon of the policy \(s\); got 60.001"),
        (1.0, -2.0, r"time_left must be >= 0, .* \(s\); got -2.0"),
        (math.nan, 10.0, r"height must be finite \(mm\); got nan"),
        (1.0, math.inf, r"time_left must be <= 60.* got inf"),
        (1.0, math.nan, r"time_left must be .* got nan"),
    ],
)
def test_refused_states(height, time, message):
    policy = plain("P1")
    for look_up in (policy.value, policy.action, policy.gradient):
        for state in ((height, time), (np.array([1.0, height]), np.array([10.0, time]))):
            with pytest.raises(ValueError, match=message):
                look_up(*state)


def test_off_lattice_late_states_are_refused():
    for look_up in (plain("P5").value, plain("P5").action):
        with pytest.raises(
            ValueError, match=r"time_left must be a multiple of 2 where it is < 0 \(s\); got -7.3"
        ):
            look_up(1.0, -7.3)


@settings(max_examples=60, deadline=None)
@given(cell=st.integers(0, 399), part=st.floats(0.01, 0.99), stage=st.integers(3, 30))
def test_force_is_interpolated_inside_a_duration(cell, part, stage):
    policy = plain("P1")
    ends = policy.action(policy.states()[0][cell : cell + 2], 2.0 * stage)
    found = policy.action(0.005 * (cell + part), 2.0 * stage)
    row = policy.table.locate({"height": 1.0, "time_left": 2.0 * stage}).row[0]
    if policy.table.kinks.at[row, 0, cell] < 0:  # nothing changes in this cell
        expected = ends.normal_force[0] + part * (ends.normal_force[1] - ends.normal_force[0])
        assert found.normal_force == pytest.approx(expected, rel=1e-12, nan_ok=True)
        assert found.duration == ends.duration[0] == ends.duration[1]
    assert found.stop in ends.stop


@pytest.mark.parametrize(
    ("name", "times"), [("P1", (14.0, 24.0, 40.0)), ("P3", (-4.0, 0.0, 8.0)), ("P5", (-6.0, 2.0, 20.0))]
)
def test_switches_lie_where_both_actions_are_equally_good(name, times):
    policy = plain(name)
    height = policy.states()[0]
    # Costs are curved inside a cell: by how much one step of the recursion tells, at any height.
    known = between_nodes(policy.table) + 2 * policy.table.table.search_error
    assert known < 2e-4
    seen = 0
    for time in times:
        inside = (height[:-1, None] + 0.005 * np.linspace(0.02, 0.98, 97)).ravel()
        duration = policy.action(inside, time).duration
        for k in np.flatnonzero((duration[1:] != duration[:-1]) & (np.arange(inside.size - 1) % 97 != 96)):
            seen += 1
            at = 0.5 * (inside[k] + inside[k + 1])
            sides = [policy.action(inside[i], time) for i in (k, k + 1)]
            costs = [cost(policy, at, time, side.duration, side.normal_force) for side in sides]
            assert costs[0] == pytest.approx(costs[1], abs=known)
            assert policy.value(at, time) == pytest.approx(min(costs), abs=known)
    assert seen > 5


def cost(policy, height, time, duration, force):
    """Expected penalty of one pass and the policy after it, from the law itself by quadrature of its
    interpolation.
    """
    if duration == 0:
        late = policy.problem.lateness_charge
        return float(policy.problem.height_charge(height)) + (
            0.0 if late is None else float(late(max(0.0, -time)))
        )
    law = policy.problem.cut(duration, force)
    node = np.concatenate([[-0.005], policy.states()[0]])
    under = law.over  # E (D - y)+ at y = height - node has second differences that are the weights
    value = policy.value(policy.states()[0], time - duration)
    h = 0.005
    curve = under(height - np.append(node, 2.005))
    weight = (curve[2:] - 2 * curve[1:-1] + curve[:-2]) / h
    gone = float(law.over(height, 0))
    weight[0] -= gone - (float(law.over(height)) - float(law.over(height + h))) / h
    late = policy.problem.lateness_charge
    extra = 0.0 if late is None else float(late(max(0.0, duration - time)))
    beyond = policy.problem.height_charge.over.expected_over(law, height)
    return float(weight @ value + beyond + gone * extra)


def test_cost_of_these_tests_is_the_table():
    policy = plain("P3")
    for height, time in ((0.5, 12.0), (1.0, 24.0), (1.5, -2.0), (2.0, 4.0)):
        action = policy.action(height, time)
        assert cost(policy, height, time, action.duration, action.normal_force) == pytest.approx(
            policy.value(height, time), abs=2e-6
        )


def test_gradient_is_the_finite_difference():
    policy = plain("P1")
    height = np.linspace(0.031, 1.97, 97)
    for time in (6.0, 20.0, 44.0):
        row = policy.table.table.value[policy.table.locate({"height": 1.0, "time_left": time}).row[0], 0]

        def chord(x, row=row):
            return np.interp(x, policy.states()[0], row)

        difference = (chord(height + 0.005) - chord(height - 0.005)) / 0.01
        np.testing.assert_allclose(policy.gradient(height, time), difference, atol=1e-9)


def test_gradient_by_the_envelope_theorem():
    # The optimal control does not move J at first order: J'(x) = E J'(x - d), overground - 10 $/mm.
    policy = plain("P1")
    rng = np.random.default_rng(3)
    for height, time in ((0.3, 6.0), (0.4, 12.0), (0.25, 18.0)):
        action = policy.action(height, time)
        left = height - policy.problem.cut(action.duration, action.normal_force).sample(rng, 400_000)
        slope = np.where(left < 0, -10.0, policy.gradient(np.maximum(left, 0.0), time - action.duration))
        error = np.std(slope) / np.sqrt(slope.size)
        assert policy.gradient(height, time) == pytest.approx(slope.mean(), abs=4 * error + 2e-3)


def test_alternatives():
    policy = plain("P4")
    costs = policy.alternatives(1.5, 24.0, within=0.1)
    assert list(costs)[:3] == ["6 s", "8 s", "10 s"] or min(costs.values()) == pytest.approx(
        policy.value(1.5, 24.0)
    )
    np.testing.assert_allclose(list(costs.values())[:3], [0.3084, 0.3154, 0.3760], atol=2e-4)
    action = policy.action(1.5, 24.0)
    ordered = list(costs.values())
    assert ordered == sorted(ordered)
    assert ordered[0] == pytest.approx(policy.value(1.5, 24.0), abs=1e-12)
    assert ordered[1] - ordered[0] == pytest.approx(action.gap, abs=1e-12)
    assert list(policy.alternatives(1.5, 24.0, within=0.0)) == ["6 s"]
    assert policy.alternatives(1.0, 2.0, within=5.0) == {"stop": pytest.approx(2.0)}
    assert policy.alternatives(-0.1, 20.0, within=0.0) == {"stop": pytest.approx(1.0)}


def test_alternatives_late():
    policy = plain("P3")
    for time in (-2.0, -31.0):
        costs = policy.alternatives(1.0, time, within=5.0)
        assert min(costs.values()) == pytest.approx(policy.value(1.0, time), abs=1e-12)
        assert costs["stop"] == pytest.approx(2.0 - 0.1 * time)


def problems():
    names = {name: weldbead.preset(name) for name in (*NAMES, "C0")}
    empirical = weldbead.Scatter("K1", 0.2, law="empirical", sample=(0.8, 0.9, 1.0, 1.05, 1.4), bandwidth=0.2)
    names["finish"] = FINISH
    names["mixed"] = weldbead.preset("P1").replace(
        scatter=weldbead.Scatter(("C1", "K2"), (0.1, 0.2), law="lognormal"),
        burn_limit=weldbead.PowerBurnLimit(180.0),
    )
    names["empirical"] = weldbead.preset("P2").replace(
        scatter=empirical, idle_power=20.0, burn_limit=weldbead.MalkinBurnLimit.published(170.0)
    )
    return names


@pytest.mark.parametrize("name", list(problems()))
def test_saved_and_loaded(tmp_path, name):
    policy = weldbead.plan(problems()[name].replace(horizon=24.0), tolerance=None, nodes=61)
    policy.save(tmp_path / "policy.nc")
    loaded = sdpgrind.load(tmp_path / "policy.nc")
    assert type(loaded) is weldbead.SequencePolicy
    assert loaded.problem == policy.problem
    for field in dataclasses.fields(policy.table.table):
        one, two = getattr(policy.table.table, field.name), getattr(loaded.table.table, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, two)
            assert one.dtype == two.dtype
    top = policy.problem.height_max
    height, time = np.linspace(-0.1, top, 47)[:, None], np.arange(0.0, 24.1, 1.0)
    np.testing.assert_array_equal(policy.value(height, time), loaded.value(height, time))
    for field in ("stop", "duration", "feed_rate", "normal_force", "gap"):
        np.testing.assert_array_equal(
            getattr(policy.action(height, time), field), getattr(loaded.action(height, time), field)
        )
    one, two = (p.simulate(runs=2000, height=0.7 * top, time_left=24.0, rng=3) for p in (policy, loaded))
    np.testing.assert_array_equal(one.penalty, two.penalty)
    assert policy.risk(0.7 * top, 24.0).cvar == loaded.risk(0.7 * top, 24.0).cvar
    assert policy.alternatives(0.7 * top, 24.0, within=0.1) == loaded.alternatives(
        0.7 * top, 24.0, within=0.1
    )
    assert repr(policy) == repr(loaded)


def test_error_estimate_is_saved(tmp_path):
    policy = weldbead.plan(weldbead.preset("P2").replace(horizon=12.0), tolerance=1e-2)
    policy.save(tmp_path / "policy.nc")
    assert sdpgrind.load(tmp_path / "policy.nc").error == policy.error <= 1e-2
    again = weldbead.sequence.SequencePolicy(policy.problem, sdp.plan(policy.table.problem))
    assert again.error is None and "not estimated" in repr(again)


def test_dataset_has_units():
    data = plain("P2").dataset
    assert data["value"].attrs["units"] == "$" and data["height"].attrs["units"] == "mm"
    assert data["stage"].attrs["units"] == "s"
    assert "weldbead.problem" in data.attrs["problem"]


def test_pictures():
    plt = pytest.importorskip("matplotlib.pyplot")
    for policy in (plain("P1"), plain("P3")):
        figure = policy.plot()
        assert [ax.get_xlabel() for ax in figure.axes[:3]] == ["time left [s]"] * 3
        plt.close(figure)


def test_last_duration(finish):
    charge = [float(FINISH.finish_charge(FINISH.feed_rate(t))) for t in FINISH.durations]
    for duration, extra in zip(FINISH.durations, charge, strict=True):
        assert finish.value(0.0, 10.0, last_duration=duration) == pytest.approx(extra)
        assert finish.value(-0.1, 10.0, last_duration=duration) == pytest.approx(1.0 + extra)
        assert finish.value(1.0, 0.0, last_duration=duration) == pytest.approx(2.0 + extra)
        assert finish.value(1.0, 24.0, last_duration=duration) >= finish.value(1.0, 24.0)
    found = finish.value(np.array([0.0, 0.5, 1.0]), 10.0, last_duration=np.array([6.0, 8.0, 20.0]))
    states = ((0.0, 6.0), (0.5, 8.0), (1.0, 20.0))
    np.testing.assert_array_equal(found, [finish.value(h, 10.0, last_duration=t) for h, t in states])
    assert finish.action(0.0, 24.0, last_duration=6.0).stop
    with pytest.raises(ValueError, match=r"last_duration must be one of 6, 8, .* \(s\); got 7.0"):
        finish.value(1.0, 24.0, last_duration=7.0)


def test_last_duration_matters_only_where_the_finish_is_charged():
    policy = plain("P1")
    assert policy.value(1.0, 24.0, last_duration=6.0) == policy.value(1.0, 24.0)
    with pytest.raises(ValueError, match=r"last_duration must be one of 6, 8, .* \(s\); got 7.0"):
        policy.value(1.0, 24.0, last_duration=7.0)


@pytest.mark.parametrize("duration", [6.0, 14.0, 20.0])
@pytest.mark.parametrize("height", [0.003, 0.3, 1.0])
def test_risk_and_runs_from_a_bead_with_a_last_pass(finish, height, duration):
    """The finish of the last pass is still to pay where one stops; 0.003 mm lies between the first two nodes."""
    value = finish.value(height, 10.0, last_duration=duration)
    assert finish.risk(height, 10.0, last_duration=duration).mean == pytest.approx(value, abs=3e-3)
    runs = finish.simulate(
        runs=100_000, height=height, time_left=10.0, last_duration=duration, rng=6, snap=True
    )
    assert abs(runs.mean - value) < 4 * runs.standard_error + 3e-3  # of a chord over a cell of 0.01 mm
    at_rest = finish.risk(0.0, 10.0, last_duration=duration)
    assert (
        at_rest.mean == pytest.approx(float(FINISH.finish_charge(FINISH.feed_rate(duration))))
        and at_rest.passes == 0
    )


def test_where_the_finish_is_charged_no_cell_has_a_jump():
    """Just above the target one more pass may be worth it, at the target none is made: look-ups between must
    not mix them.
    """
    coarse, fine = (weldbead.plan(FINISH, tolerance=None, nodes=n) for n in (201, 1601))
    height = np.linspace(1e-6, 0.01, 41)
    for duration in FINISH.durations:
        found = coarse.value(height, 24.0, last_duration=duration)
        np.testing.assert_allclose(found, fine.value(height, 24.0, last_duration=duration), atol=5e-3)
    fast = fine.value(np.array([0.0, 1e-6]), 24.0, last_duration=6.0)
    assert fast[0] == pytest.approx(0.4) and fast[1] < 0.35


def test_finish_risk_and_simulation(finish):
    risk = finish.risk(1.0, 24.0)
    snapped = finish.table.distribution(**finish._state(1.0, 24.0, None))
    assert snapped.mean == pytest.approx(finish.value(1.0, 24.0), abs=1e-6)
    assert risk.distribution.on_the_way == pytest.approx(0.01 * risk.passes)
    between = finish.simulate(runs=100_000, height=1.0, time_left=24.0, rng=5)
    assert abs(between.mean - risk.mean) < 4 * between.standard_error + risk.error["mean"]
    runs = finish.simulate(runs=100_000, height=1.0, time_left=24.0, rng=6, snap=True)
    assert abs(runs.mean - finish.value(1.0, 24.0)) < 4 * runs.standard_error


def test_the_default_tolerance_suits_the_charges():
    for name in (*NAMES, "C0"):
        assert default_tolerance(weldbead.preset(name)) == 1e-5
    dear = weldbead.preset("P1").replace(
        height_charge=sdp.Charge(under=sdp.Linear(200.0), over=sdp.Linear(1000.0))
    )
    assert default_tolerance(dear) == pytest.approx(4e-4)  # a millionth of 400 $
    policy = weldbead.plan(dear, tolerance=1e-2)
    # All charges a hundred times those of P1: so is the penalty, to the tolerance.
    assert policy.value(1.0, 24.0) == pytest.approx(100 * 0.070643, abs=1e-2)
    with pytest.raises(ValueError, match="tolerance must be one of auto"):
        weldbead.plan(dear, tolerance="high")


@pytest.mark.parametrize("state", [(1.14125, 14.0), (1.37, 16.0), (0.513, 22.0)])
def test_risk_and_snapped_runs_begin_where_the_bead_is(state):
    """Between nodes whose passes differ the first pass is that of the bead: no mixture of theirs."""
    policy = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=101)
    value = policy.value(*state)
    snapped = policy.table.distribution(height=state[0], time_left=state[1])
    assert snapped.mean == pytest.approx(value, abs=1e-4)  # of a chord over a cell of 0.02 mm
    risk, between = (
        policy.risk(*state),
        policy.simulate(runs=200_000, height=state[0], time_left=state[1], rng=4),
    )
    assert abs(between.mean - risk.mean) < 4 * between.standard_error + risk.error["mean"]
    runs = policy.simulate(runs=200_000, height=state[0], time_left=state[1], rng=3, snap=True)
    assert abs(runs.mean - value) < 4 * runs.standard_error + 1e-4
