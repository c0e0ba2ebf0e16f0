"""When another pass is worth it: the planner's answer against optimal stopping in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import finishing as fin
from sdpgrind import sdp, units

MODEL = fin.roughness.RoughnessModel.published()
FINE = {"pattern": "hilbert5", "tool_diameter": 4.0, "normal_force": 1.301}
ROUGH = {"pattern": "zigzag", "tool_diameter": 4.0, "normal_force": 1.301}
RATE, FREE = 10.0 / units.um(1.0), units.um(3.0)  # $ a mm above what is free


def worth(passes, charges, rate=RATE, free=FREE):
    """Expected charge just before the pass, with n passes left: E min(g, k) = E g - E (g - k)+ of a linear
    charge g.

    One kind of pass after the other: min over kinds of charge + E min(g(R), what the passes after it are
    worth)."""
    found = [np.inf]
    for _ in range(passes):
        tried = []
        for how, charge in charges:
            law = MODEL.law(**how)
            saved = 0.0 if np.isinf(found[-1]) else float(law.over(free + found[-1] / rate))
            tried.append(charge + rate * (float(law.over(free)) - saved))
        found.append(min(tried))
    return found[1:]


def planned(passes, charges, **options):
    names = {f"kind {k}": how for k, (how, _) in enumerate(charges)}
    cost = {f"kind {k}": charge for k, (_, charge) in enumerate(charges)}
    problem = fin.roughness.refinish_problem(
        MODEL, names, pass_charge=cost, roughness_charge=sdp.Linear(RATE, tolerance=FREE), passes=passes
    )
    return problem, sdp.plan(problem, **options)


def test_values_and_thresholds_of_optimal_stopping():
    charges = [(FINE, 1.0)]
    wanted = worth(4, charges)
    problem, policy = planned(4, charges)
    width = problem.axes[0].high / (problem.axes[0].nodes - 1)
    for n, value in enumerate(wanted, start=1):
        assert policy.value(roughness=problem.axes[0].high, passes_left=n) == pytest.approx(value, abs=0.005)
        threshold = FREE + value / RATE
        assert policy.action(roughness=threshold - 1.01 * width, passes_left=n).stop
        assert policy.action(roughness=threshold + 1.01 * width, passes_left=n).name == "kind 0"
    assert wanted == sorted(wanted, reverse=True), "more passes left: less to expect, choosier"


def test_cheap_passes_and_many_of_them_are_right_to_a_thousandth():
    """Values are small there and thresholds close, so that cells matter most."""
    kinds = {"hilbert5": 0.15, "zigzag": 0.05, "hilbert4": 0.02}  # $
    settings = {name: FINE | {"pattern": name} for name in kinds}
    rate, free = 3.0 / units.um(1.0), units.um(3.4)
    charge = sdp.Linear(rate, tolerance=free)
    problem = fin.roughness.refinish_problem(
        MODEL, settings, pass_charge=kinds, roughness_charge=charge, passes=6
    )
    policy = sdp.plan(problem)
    wanted = worth(6, [(settings[name], kinds[name]) for name in kinds], rate, free)
    for n, value in enumerate(wanted, start=1):
        assert policy.value(roughness=problem.axes[0].high, passes_left=n) == pytest.approx(value, rel=1e-3)


def test_the_weights_are_those_of_the_law():
    """Of any law on the grid: probabilities that sum to 1 with its mean, and the expectation of a hat by
    drawing.
    """
    problem, _ = planned(1, [(FINE, 1.0)])
    move, axis = problem.moves[0], problem.axes[0]
    x = np.linspace(axis.low, axis.high, axis.nodes)
    weights = move.to.weights(x)
    assert weights.sum() == pytest.approx(1.0, abs=1e-12) and weights.min() > -1e-12
    assert weights @ x == pytest.approx(float(move.to.law.mean), rel=1e-10)
    drawn = move.to.law.sample(0, 40000)
    for node in (400, 448, 480):
        hat = np.clip(1 - np.abs(drawn - x[node]) / (x[1] - x[0]), 0, None)
        assert abs(weights[node] - hat.mean()) < 4 * hat.std() / 200
    low, high = move.to.weights(np.array([3.4e-3, 3.5e-3, 3.6e-3]))[[0, 2]]
    ends = [np.clip((3.5e-3 - drawn) / 1e-4, 0, 1), np.clip((drawn - 3.5e-3) / 1e-4, 0, 1)]
    assert abs(low - ends[0].mean()) < 0.01 and abs(high - ends[1].mean()) < 0.01


@pytest.mark.parametrize("roughness_max", [None, units.um(3.5), units.um(0.5)])
def test_one_step_from_anywhere_is_the_law(roughness_max):
    """All of it, where the table ends within the law or below it, too: what is beyond counts at the end."""
    problem = made(
        roughness_max=roughness_max, roughness_charge=sdp.Linear(RATE, tolerance=units.um(0.3)), passes=1
    )
    policy, end = sdp.plan(problem), problem.axes[0].high
    law, free = MODEL.law(**FINE), units.um(0.3)
    wanted = 1.0 + RATE * float(law.over(free) - law.over(end))
    assert policy.value(roughness=end, passes_left=1) == pytest.approx(
        min(wanted, RATE * (end - free)), rel=1e-3
    )


@given(st.floats(0.1, 30.0), st.floats(0.0, 40.0))
def test_a_node_is_where_the_charge_sets_in(roughness_max, free):
    axis = made(
        roughness_max=units.um(roughness_max), roughness_charge=sdp.Linear(RATE, tolerance=units.um(free))
    ).axes[0]
    step = axis.high / (axis.nodes - 1)
    assert (
        units.um(roughness_max) * (1 - 1e-9) <= axis.high <= units.um(roughness_max) + step
        and 1601 <= axis.nodes <= 3203
    )
    if roughness_max / 400 <= free <= roughness_max:
        assert abs(units.um(free) / step - round(units.um(free) / step)) < 1e-6


@pytest.mark.parametrize("tolerance", [0.02, 1e-4])
def test_a_tolerance_is_reached(tolerance):
    charges = [(FINE, 1.0)]
    problem, policy = planned(3, charges, tolerance=tolerance)
    for n, value in enumerate(worth(3, charges), start=1):
        assert (
            abs(policy.value(roughness=problem.axes[0].high, passes_left=n) - value)
            <= policy.error
            <= tolerance
        )


def test_a_cheaper_pass_is_taken_first_where_more_are_left():
    charges = [(FINE, 4.0), (ROUGH, 1.0)]
    wanted = worth(3, charges)
    problem, policy = planned(3, charges)
    for n, value in enumerate(wanted, start=1):
        assert policy.value(roughness=problem.axes[0].high, passes_left=n) == pytest.approx(value, abs=0.01)
    assert worth(1, charges[:1])[0] < worth(1, charges[1:])[0]
    assert policy.action(roughness=problem.axes[0].high, passes_left=1).name == "kind 0"


@settings(max_examples=8, deadline=None)
@given(st.floats(0.0, 5.0), st.integers(1, 3))
def test_any_charge_of_a_pass(charge, passes):
    _, policy = planned(passes, [(FINE, charge)])
    assert policy.value(roughness=0.006, passes_left=passes) == pytest.approx(
        worth(passes, [(FINE, charge)])[-1], abs=0.006
    )


def test_simulated_parts_pay_what_was_planned():
    problem, policy = planned(3, [(FINE, 1.0)])
    runs = policy.simulate(runs=4000, rng=0, roughness=0.006, passes_left=3)
    assert abs(runs.mean - worth(3, [(FINE, 1.0)])[-1]) < 4 * runs.standard_error
    assert sdp.check(problem).ok


def test_a_part_that_is_smooth_enough_is_delivered():
    _, policy = planned(3, [(FINE, 1.0)])
    assert policy.value(roughness=0.98 * FREE, passes_left=3) == pytest.approx(0.0, abs=1e-9)
    assert policy.action(roughness=0.0035, passes_left=3).name == "deliver"


def made(**changes):
    given = {
        "pass_charge": 1.0,
        "roughness_charge": sdp.Linear(RATE),
        "passes": 2,
        "settings": {"fine": FINE},
        "model": MODEL,
    }
    given |= changes
    return fin.roughness.refinish_problem(given.pop("model"), given.pop("settings"), **given)


REFUSED = [
    ({"model": 3}, r"model must be a RoughnessModel; got 3"),
    ({"settings": {}}, r"settings must be passes by name"),
    (
        {"settings": {"fine": {"pattern": "zigzag"}}},
        r"settings\['fine'\] must be a mapping with pattern, tool_diameter, normal_force",
    ),
    ({"settings": {"fine": FINE | {"normal_force": 9.0}}}, r"normal_force must be in \[0.556, 1.667\]"),
    (
        {"settings": {"fine": FINE | {"normal_force": [1.0, 1.1]}}},
        r"settings\['fine'\] must be of one pass; got arrays",
    ),
    ({"pass_charge": -1.0}, r"pass_charge must be >= 0 \(\$\); got -1.0"),
    ({"pass_charge": {}}, r"pass_charge must have an entry for each of the settings; 'fine' has none"),
    ({"roughness_charge": 3}, r"roughness_charge must be such as sdp.Linear\(rate, tolerance=...\); got 3"),
    ({"passes": 0}, r"passes must be >= 1; got 0"),
    ({"roughness_max": 0.0}, r"roughness_max must be > 0 \(mm\); got 0.0"),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_refusals(changes, message):
    with pytest.raises((ValueError, TypeError), match=message):
        made(**changes)
