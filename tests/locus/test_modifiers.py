"""Modifier adaptation: the optimum of the plant, the cost of slopes, comparison with a locus."""

from copy import deepcopy
from itertools import product

import numpy as np
import pytest
from locus_inside import pattern
from scipy.optimize import minimize

from sdpgrind import locus
from sdpgrind.locus import ModifierController, robust_locus


def problem(power=1.0, slope=0.0, x=(0.2, 5.0)):
    """Koren's example with another power of the speed and a term more in its cost."""
    return locus.Problem(
        controls={"u": (0.0, 5.0), "v": (0.0, 10.0)},
        hidden={"x": x},
        cost=lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2 + slope * c.u * c.v,
        constraints=[
            locus.Varying(
                response=lambda s, c: s.x * c.v**power + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v
            )
        ],
    )


def plant(controls, x, power, slope):
    u, v = controls.values()
    return x * v**power + 16 - 4 * v, (u - 1) ** 2 + (v - 4) ** 2 + slope * u * v


def settle(controller, x, power, slope, samples=400):
    for _ in range(samples):
        response, cost = plant(controller.command, x, power, slope)
        controller.step(response=response, cost=cost)
    return controller.center


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_the_pattern_tells_slopes_from_each_other_from_curvature_and_from_a_trend(n):
    signs, trend = pattern(n), np.arange(2 ** (n + 1)) - (2**n - 0.5)
    np.testing.assert_array_equal(signs.T @ signs, len(signs) * np.eye(n))
    np.testing.assert_array_equal(trend @ signs, 0)
    assert all((signs[:, i] * signs[:, j]) @ signs[:, k] == 0 for i, j, k in product(range(n), repeat=3))


@pytest.mark.parametrize("feedback", ["state", "bias"])
@pytest.mark.parametrize(("x", "power", "slope"), [(1.0, 1.2, 0.0), (1.5, 1.3, 0.1), (1.2, 0.8, -0.1)])
def test_where_it_rests_the_conditions_of_the_plant_hold(feedback, x, power, slope):
    controller = ModifierController(problem(), hidden=1.2, dither=2e-4, feedback=feedback)
    u, v = settle(controller, x, power, slope).values()
    gradient = np.array([2 * (u - 1) + slope * v, 2 * (v - 4) + slope * u])
    normal = np.array([-1.0, power * x * v ** (power - 1)])
    assert abs(x * v**power - u - 1) < 1e-6
    multiplier = -(gradient @ normal) / (normal @ normal)
    np.testing.assert_allclose(gradient + multiplier * normal, 0, atol=1e-6)
    assert multiplier > 0.1
    best = minimize(
        lambda z: (z[0] - 1) ** 2 + (z[1] - 4) ** 2 + slope * z[0] * z[1],
        [2.0, 2.0],
        constraints={"type": "ineq", "fun": lambda z: z[0] + 1 - x * z[1] ** power},
        options={"ftol": 1e-15},
    )
    np.testing.assert_allclose((u, v), best.x, atol=1e-5)
    # the model alone would be elsewhere
    assert np.hypot(u - locus.plan(problem()).at(x=x).controls["u"], v) > 0.1


def test_the_error_falls_with_the_square_of_the_dither():
    best = settle(ModifierController(problem(), hidden=1.2, dither=2e-4), 1.0, 1.2, 0.0)
    errors = [
        settle(ModifierController(problem(), hidden=1.2, dither=d), 1.0, 1.2, 0.0)["v"] - best["v"]
        for d in (0.008, 0.004)
    ]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


def test_a_model_that_is_right_stays_where_it_is():
    controller = ModifierController(problem(), hidden=1.0, dither=1e-3)
    for _ in range(40):
        response, cost = plant(controller.command, 1.0, 1.0, 0.0)
        controller.step(response=response, cost=cost)
        np.testing.assert_allclose(list(controller.center.values()), (2, 3), atol=1e-4)


def test_a_known_cost_needs_no_reading_but_must_be_right():
    blind = ModifierController(problem(), hidden=1.2, dither=2e-4, cost=None)
    right = settle(ModifierController(problem(), hidden=1.2, dither=2e-4), 1.0, 1.3, 0.0)
    assert settle(blind, 1.0, 1.3, 0.0) == pytest.approx(right, abs=1e-6)
    assert tuple(blind.reads) == ("response",)
    wrong = settle(ModifierController(problem(), hidden=1.2, dither=2e-4, cost=None), 1.0, 1.3, 0.2)
    other = settle(ModifierController(problem(), hidden=1.2, dither=2e-4), 1.0, 1.3, 0.2)
    assert abs(wrong["v"] - other["v"]) > 0.05


def test_where_nothing_is_active_it_finds_the_plant_s_own_optimum():
    controller = ModifierController(problem(), hidden=0.25, dither=1e-3)
    u, v = settle(controller, 0.25, 1.0, 0.2).values()
    assert 2 * (u - 1) + 0.2 * v == pytest.approx(0, abs=1e-5)
    assert 2 * (v - 4) + 0.2 * u == pytest.approx(0, abs=1e-5)
    assert 0.25 * v - u - 1 < 0


def test_grinding_with_another_sliding_power():
    model = locus.preset("grinding")
    sliding = model.model.power.sliding
    truth = model.replace(power=model.model.power.replace(sliding=sliding.replace(curvature_pressure=1.5e6)))
    area, grinding = 0.0085, truth.model
    controller = ModifierController(model, hidden=0.006, dither=0.005, cost=None)
    for _ in range(400):
        rate, rotation = controller.command.values()
        controller.step(grinding_power=float(grinding.grinding_power(rate, rotation, area)))
    best, point = locus.plan(truth).at(wear_flat_area=area).controls, controller.center
    assert sliding.curvature_pressure == 2.1e6
    assert point["infeed_rate"] == pytest.approx(best["infeed_rate"], rel=1e-4)
    assert point["work_rotation"] == pytest.approx(best["work_rotation"], rel=2e-3)
    assert controller.reports["slack"] == "W"


def test_a_missing_reading_changes_nothing_that_was_learned():
    controller = ModifierController(problem(), hidden=1.2, dither=1e-3)
    settle(controller, 1.0, 1.2, 0.0)
    before, row = controller.center, controller.state.row
    controller.step(response=float("nan"), cost=1.0)
    assert controller.center == pytest.approx(before, abs=1e-9)
    assert controller.state.row == (row + 1) % 4


def test_a_copy_goes_its_own_way_and_reset_forgets():
    controller = ModifierController(problem(), hidden=1.2, dither=1e-3)
    first = controller.command
    settle(controller, 1.0, 1.2, 0.0, samples=10)
    twin = deepcopy(controller)
    assert settle(twin, 1.0, 1.2, 0.0, samples=10) == settle(controller, 1.0, 1.2, 0.0, samples=10)
    settle(twin, 2.0, 1.2, 0.0)
    assert twin.center != controller.center
    controller.reset()
    assert controller.command == first
    assert controller.report() == pytest.approx({"x": 1.2, "bias": 0.0, "slack": float("nan")}, nan_ok=True)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"feedback": "none"}, "feedback must be"),
        ({"dither": 0.0}, r"dither must be in \(0, 0.25\)"),
        ({"across": -0.1}, r"across must be in \[0, 0.25\)"),
        ({"filter": 0.0}, r"filter must be in \(0, 1\]"),
        ({"hidden": 9.0}, "x must be"),
        ({"period": 0.0}, "period must be"),
        (
            {"problem": locus.preset("grinding-roughness")},
            "problem must have one hidden state and one constraint; got 2 and 2",
        ),
    ],
)
def test_messages(given, message):
    with pytest.raises(ValueError, match=message):
        ModifierController(**{"problem": problem()} | given)


def test_a_reading_that_is_not_given_is_missed():
    with pytest.raises(ValueError, match="measurement must have 'cost'; got response"):
        ModifierController(problem()).step(response=1.0)


MODEL, POWERS = problem(x=(0.6, 5.0)), (1.0, 1.15, 1.3)


@pytest.fixture(scope="module")
def ways():
    curve = locus.plan(MODEL)
    robust = robust_locus([MODEL, problem(1.3, x=(0.6, 5.0))], along="v")
    walk = {"along": "v", "period": None, "x": (0.8, 4.0)}
    return {
        "nominal": locus.LocusController(
            curve, gain=locus.gains.design_gain(curve, along="v", x=(0.8, 4)).schedule(0.5), **walk
        ),
        "robust": locus.LocusController(
            robust, gain=locus.gains.design_gain(robust, along="v", x=(0.8, 4)).schedule(0.5), **walk
        ),
        "bias": ModifierController(MODEL, hidden=2.0, dither=0.01, feedback="bias", gain=0.5, filter=0.1),
        "both": ModifierController(MODEL, hidden=2.0, dither=0.01, gain=0.5, filter=0.1),
    }


def charge(controller, power, rate, noise):
    """Mean cost beyond the plant's optimum, a violation at twice its multiplier, after 120 samples."""
    controller.reset()
    curve, rng = locus.plan(problem(power, x=(0.6, 5.0))), np.random.default_rng(7)
    tops = {float(x): curve.at(x=float(x)) for x in np.linspace(1.0, 3.0, 41)}
    grid = np.array(list(tops))
    least, price = (
        np.array([p.cost for p in tops.values()]),
        np.array([p.multipliers["response"] for p in tops.values()]),
    )
    total = 0.0
    for i in range(280):
        x = 1 + abs((i * rate + 1) % 4 - 2)
        u, v = controller.command.values()
        response, cost = plant({"u": u, "v": v}, x, power, 0.0)
        P = response - 17 - u + 4 * v
        if i >= 120:
            total += cost - np.interp(x, grid, least) + 2 * np.interp(x, grid, price) * max(P, 0)
        e = noise * rng.standard_normal(2)
        controller.step(response=response + e[0], cost=cost + e[1])
    return total / 160


def test_when_it_beats_the_locus(ways):
    """Exact model: the locus wins. Wrong model, constant state: modifiers. One of its samples: the robust locus."""
    still = {power: {name: charge(one, power, 0.0, 0.0) for name, one in ways.items()} for power in POWERS}
    assert still[1.0]["nominal"] < 1e-3 < still[1.0]["both"] < 0.006  # the dither
    for power in (1.15, 1.3):
        assert still[power]["both"] < 0.3 * still[power]["nominal"]
    assert still[1.15]["robust"] < 0.2 * still[1.15]["both"]
    assert still[1.3]["both"] < 0.5 * still[1.3]["robust"]


def test_noise_is_what_it_costs_and_drift_what_a_bias_costs(ways):
    noisy = {name: charge(one, 1.0, 0.0, 0.1) for name, one in ways.items()}
    assert noisy["both"] > 1.1 * noisy["nominal"]
    drifting = {name: charge(one, 1.3, 0.01, 0.0) for name, one in ways.items()}
    assert drifting["both"] < 0.9 * drifting["bias"]
    assert drifting["both"] < 0.6 * drifting["nominal"]
