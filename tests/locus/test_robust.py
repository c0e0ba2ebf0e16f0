"""Loci for models that disagree: against brute force, against the second-order loss, and with a sensor that
is biased.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from koren_stretch import u_of, v_of
from locus_inside import feedback_points
from scipy.optimize import minimize_scalar

from sdpgrind import locus
from sdpgrind.locus import robust_locus

RANGE = (0.6, 5.0)


def model(power=1.0, slope=0.0, x=RANGE, **changed):
    """Koren's example whose speed counts with another power, or whose cost has a term more."""
    given = {
        "controls": {"u": (0.0, 5.0), "v": (0.01, 10.0)},
        "hidden": {"x": x},
        "cost": lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2 + slope * c.u,
        "constraints": [
            locus.Varying(
                response=lambda s, c: s.x * c.v**power + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v
            )
        ],
    }
    return locus.Problem(**given | changed)


@pytest.fixture(scope="module")
def three():
    return [model(1.0), model(1.3, slope=0.3), model(0.9, slope=-0.2)]


@pytest.fixture(scope="module")
def mean(three):
    return robust_locus(three, along="v", weights=[2, 1, 1])


def optimum(power, slope, x):
    """Least cost by a search along the constraint u = x v^p - 1, and where it is."""

    def cost(v):
        u = x * v**power - 1
        return (u - 1) ** 2 + (v - 4) ** 2 + slope * u

    if x * 4**power - 1 < 1 - slope / 2:  # not active
        return 2 * slope / 2 * (1 - slope / 4), 4.0
    found = minimize_scalar(cost, bounds=(0.01, 10), method="bounded", options={"xatol": 1e-12})
    return found.fun, found.x


def test_of_one_model_it_is_the_locus_itself():
    same = robust_locus([model(), model()], along="v")
    for x in (0.7, 1.0, 2.0, 4.5):
        assert same.path.coordinate_of(x) == pytest.approx(v_of(x), abs=2e-6)
        assert same.path.at(v_of(x)).controls["u"] == pytest.approx(u_of(x), abs=2e-6)
    np.testing.assert_allclose(same.losses.loss.sel(way=["nominal", "robust"]), 0, atol=1e-11)


def test_a_sample_without_weight_does_not_count():
    alone = robust_locus([model(), model(1.3)], along="v", weights=[0, 1])
    for x in (1.0, 3.0):
        v = optimum(1.3, 0.0, x)[1]
        assert alone.path.at(v).controls["u"] == pytest.approx(x * v**1.3 - 1, abs=1e-6)


def sampled_loss(v, u, weights, models):
    """Mean loss of a polygon of a locus by its definition: where each constraint crosses it, for many hidden
    states.
    """
    x, total = np.linspace(*RANGE, 1501), 0.0
    for weight, (power, slope) in zip(weights, models, strict=True):
        belongs = (u + 1) / v**power  # falls with v
        place = np.interp(x, belongs[::-1], v[::-1])
        least = np.array([optimum_cost(power, slope, float(state)) for state in x])
        other = x * place**power - 1
        total += weight * np.mean((other - 1) ** 2 + (place - 4) ** 2 + slope * other - least)
    return total


@cache
def optimum_cost(power, slope, x):
    return optimum(power, slope, x)[0]


def test_no_bump_makes_the_mean_loss_less(mean):
    models, weights = [(1.0, 0.0), (1.3, 0.3), (0.9, -0.2)], [0.5, 0.25, 0.25]
    v = np.linspace(mean.path.low, mean.path.high, 4001)
    u = mean.path.rows(v)[:, 0]
    least, size = sampled_loss(v, u, weights, models), 0.05
    for middle in (1.2, 1.7, 2.2):  # all samples meet these coordinates within the range
        bump = size * np.maximum(1 - ((v - middle) / 0.4) ** 2, 0) ** 2
        more = [sampled_loss(v, u + sign * bump, weights, models) - least for sign in (1, -1)]
        assert min(more) > 0
        slope, curvature = (more[0] - more[1]) / 2, (more[0] + more[1]) / 2
        assert abs(slope) < 0.05 * curvature  # a bump a tenth as large is no better either way


def test_the_worst_loss_is_least_at_every_coordinate(three):
    worst = robust_locus(three, along="v", objective="worst")
    mean = robust_locus(three, along="v")

    def largest(v, u):
        return max(
            (u - 1) ** 2 + (v - 4) ** 2 + a * u - optimum(p, a, (u + 1) / v**p)[0]
            for p, a in [(1, 0), (1.3, 0.3), (0.9, -0.2)]
        )

    for v in (1.2, 1.7, 2.2):
        u = worst.path.at(v).controls["u"]
        tried = np.linspace(u - 0.3, u + 0.3, 601)
        by_search = min(largest(v, one) for one in tried)
        assert largest(v, u) <= by_search + 1e-9
        assert largest(v, u) < largest(v, mean.path.at(v).controls["u"])
    ways = worst.losses.loss.max(["sample", "x"])
    assert ways.sel(way="robust") < 0.6 * ways.sel(way="nominal")


def test_losses_against_searches(mean):
    losses = mean.losses_with(points=5)
    for j, (power, slope) in enumerate([(1.0, 0.0), (1.3, 0.3), (0.9, -0.2)]):
        for k, x in enumerate(losses.x.values):
            least = optimum(power, slope, x)[0]
            ((u, v),) = feedback_points(mean.nominal, mean.curves[j], np.array([x]))
            assert u == pytest.approx(x * v**power - 1, abs=1e-9)  # the true constraint is met
            loss = (u - 1) ** 2 + (v - 4) ** 2 + slope * u - least
            assert float(losses.loss[j, 0, k]) == pytest.approx(loss, abs=1e-9)
            opened = (u_of(x) - 1) ** 2 + (v_of(x) - 4) ** 2 + slope * u_of(x) - least
            assert float(losses.loss[j, 2, k]) == pytest.approx(opened, abs=1e-9)
    assert float(losses.loss.sel(way=["nominal", "robust"]).min()) > -1e-9
    assert abs(losses.violation.sel(way=["nominal", "robust"])).max() < 1e-9
    # cheap, as it violates the limit
    assert losses.loss.sel(way="open loop").min() < -0.01 < 0.1 < losses.violation.max()


def test_the_loss_of_a_wrong_locus_is_half_t_squared_of_the_lagrangian():
    """A locus that is shifted by t along a straight constraint of a quadratic cost loses t^2 (1/2 * 2):
    exactly, either way.
    """
    curve, x = locus.plan(model()), 1.7
    true = np.array([u_of(x), v_of(x)])
    along = np.array([x, 1.0]) / np.hypot(x, 1.0)  # on x v - u - 1 = 0
    right = curve.stretch("v")
    for t in (0.2, 0.05, -0.05, -0.2):
        moved = shifted(right, t * along)
        found = feedback_points(moved, curve, np.array([x]))[0]
        cost = curve.system.values(found, np.array([x]))[0] - curve.at(x=x).cost
        assert cost == pytest.approx(np.sum((found - true) ** 2), rel=1e-7)  # L_tt = 2 for (u-1)^2 + (v-4)^2
        np.testing.assert_allclose(found - true, t * along, atol=1e-7)


def shifted(stretch, by):
    """A locus that is wrong by the same everywhere."""
    controls = stretch.controls + by
    coordinate = stretch.coordinate + by[1]
    return replace(
        stretch, controls=controls, coordinate=coordinate, limit=17 + controls[:, 0] - 4 * controls[:, 1]
    )


@pytest.mark.parametrize("bias", [0.02, -0.02, 0.3, -0.3])
def test_a_biased_sensor_shifts_to_first_order_and_bends_to_second(bias):
    """With the true locus the loss above the optimum of the shifted limit is of second order, unlike the shift."""
    truth = robust_locus([model(), model()], along="v")
    loss = truth.losses_with(points=9, bias=bias)
    for k, x in enumerate(loss.x.values):
        lost = float(loss.loss.sel(way="nominal")[0, k])
        assert float(loss.violation.sel(way="nominal")[0, k]) == pytest.approx(-bias, abs=1e-9)
        multiplier = 2 * (u_of(x) - 1)
        gap2 = 1 + x**2  # of x v - u - 1 + d = 0: the optimum moves by d along the normal
        shift = multiplier * bias + bias**2 / gap2
        bend = lost - shift
        assert lost == pytest.approx(multiplier * bias, abs=2.5 * bias**2)
        assert -1e-9 <= bend < 0.75 * bias**2
    assert max(loss.loss.sel(way="nominal")[0].values, key=abs) / bias == pytest.approx(
        2 * (np.sqrt(5) - 1), rel=0.3
    )


def test_the_bend_is_what_the_calibration_by_a_biased_reading_costs():
    """Four times the bias, sixteen times the second part."""
    truth = robust_locus([model(), model()], along="v")

    def bend(bias):
        loss = truth.losses_with(points=2, bias=bias)
        x = loss.x.values
        return loss.loss.sel(way="nominal")[0].values - 2 * (u_of(x) - 1) * bias - bias**2 / (1 + x**2)

    np.testing.assert_allclose(bend(0.008) / bend(0.002), 16, rtol=0.1)


def test_a_controller_walks_on_it_and_stops_at_the_true_limit(mean):
    controller = locus.LocusController(mean, along="v", x=(0.7, 4.0), period=None)
    x, power = 1.5, 1.3
    for _ in range(60):
        c = controller.command
        controller.step(response=x * c["v"] ** power + 16 - 4 * c["v"])
    u, v = controller.command.values()
    assert x * v**power == pytest.approx(u + 1, abs=1e-9)
    np.testing.assert_allclose(feedback_points(mean.path, locus.plan(model(1.3)), np.array([x]))[0], (u, v))


def test_slopes_of_the_table_are_exact(mean):
    path, step = mean.path, 1e-5
    for v in (1.0, 2.0, 3.0):
        k = int(np.argmin(np.abs(path.coordinate - v)))
        s = path.coordinate[k]
        near = path.rows(np.array([s - step, s + step]))
        np.testing.assert_allclose(
            path.controls_slope[k], (near[1, :2] - near[0, :2]) / (2 * step), rtol=1e-4
        )
        np.testing.assert_allclose(path.hidden_slope[k], (near[1, 2] - near[0, 2]) / (2 * step), rtol=1e-4)
    coarse = robust_locus(
        [model(1.0), model(1.3, slope=0.3), model(0.9, slope=-0.2)], along="v", weights=[2, 1, 1], points=60
    )
    v = np.linspace(0.8, 3.2, 50)
    np.testing.assert_allclose(coarse.path.rows(v)[:, 0], path.rows(v)[:, 0], atol=2e-5)


def test_grinding_with_a_wrong_sliding_power():
    """The printed curvature term is suspect: with three fifths of it."""
    first = locus.preset("grinding")
    sliding = first.model.power.sliding
    other = first.replace(
        model=first.model.replace(
            power=first.model.power.replace(
                sliding=sliding.replace(curvature_pressure=0.6 * sliding.curvature_pressure)
            )
        )
    )
    robust = robust_locus([first, other], along="infeed_rate", x=(0.005, 0.009))
    loss = robust.losses.loss
    mean = loss.mean(["sample", "wear_flat_area"])
    assert loss.sel(way="nominal", sample=1).mean() > 0
    assert mean.sel(way="robust") < 0.5 * mean.sel(way="nominal")
    assert loss.wear_flat_area.attrs["units"] == "1"
    assert robust.losses.violation.attrs["units"] == "W"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"samples": [model()]}, "samples must be two problems or more"),
        ({"along": "w"}, "along must be"),
        ({"objective": "median"}, "objective must be"),
        ({"weights": [1.0]}, "weights must be 2 numbers"),
        ({"weights": [-1.0, 2.0]}, "weights must be 2 numbers"),
        ({"x": (2.0, 1.0)}, "x must be the least and the greatest x, rising"),
        ({"x": 1.0}, "x must be the least and the greatest x"),
        (
            {"samples": [model(), locus.preset("grinding")]},
            r"samples\[1\] must have controls and hidden state of samples\[0\]",
        ),
        (
            {
                "samples": [
                    model(),
                    model(
                        constraints=[locus.Varying(response=lambda s, c: s.x * c.v, limit=lambda s, c: c.u)]
                    ),
                ]
            },
            r"samples\[1\] must have the limit of samples\[0\]",
        ),
    ],
)
def test_messages(given, message):
    with pytest.raises(ValueError, match=message):
        robust_locus(**{"samples": [model(), model(1.2)], "along": "v"} | given)
