"""The tracer against closed forms of the built-in processes, published numbers and conditions of optimality
of its own tables.
"""

import functools

import casadi as ca
import numpy as np
import pytest
from closed_forms import (
    GAINS,
    M_PER_MIN,
    ON_GRINDING_LOCUS,
    ON_TURNING_LOCUS,
    dressed_point,
    excess_power,
    fastest_removal,
    koren_run,
    last_area,
    named,
    removal_rate_at,
    turning_rates,
)
from scipy.optimize import brentq

from sdpgrind import locus

ONE_HIDDEN = ("koren-example", "turning", "milling", "grinding", "motor")
EXAMPLE = locus.processes.KorenExample()


@functools.cache
def traced(name):
    return locus.plan(locus.preset(name), points=1000)


def rows(curve):
    """Controls (k, n), hidden state (k,), and the tables themselves, of all best pieces."""
    tables = [piece.table for piece in curve.best]
    return np.concatenate([t.controls for t in tables]), np.concatenate([t.hidden for t in tables]), tables


def event(curve, kind):
    return next(found for found in curve.events if found.kind == kind)


# Any problem


@pytest.mark.parametrize("name", ONE_HIDDEN)
def test_every_point_of_the_table_satisfies_the_conditions_of_a_best_point(name):
    """With derivatives of the process's own functions, in the user's units: nothing of the tracer but its
    numbers.
    """
    curve = traced(name)
    problem = curve.problem
    z, x = ca.SX.sym("z", len(problem.names)), ca.SX.sym("x")
    s, c = named(**{curve.hidden_name: x}), named(**dict(zip(problem.names, ca.vertsplit(z), strict=True)))
    (one,) = problem.varying
    excess, cost = one.response(s, c) - one.limit(s, c), problem.objective(s, c)
    parts = ca.Function("f", [z, x], [ca.gradient(cost, z), ca.gradient(excess, z), excess, one.limit(s, c)])
    assert curve.error < 1e-10
    for piece in curve.best:
        t = piece.table
        by_cost, by_limit, left, limit = (
            np.asarray(part) for part in parts.map(len(t.hidden))(t.controls.T, t.hidden)
        )
        size = np.abs(by_cost * t.controls.T).max(axis=0) + 1e-3
        pull = (by_cost + t.multipliers.T * by_limit) * t.controls.T / size
        for k, control in enumerate(problem.names):
            sign = {"least": 1, "greatest": -1}.get(piece.bounds.get(control, ""), 0)
            np.testing.assert_array_less(-1e-8, sign * pull[k])
            if not sign:
                np.testing.assert_allclose(pull[k], 0.0, atol=1e-8)
        assert np.all(t.multipliers >= 0)
        scale = np.abs(limit).max()
        assert np.all(left <= 1e-9 * scale)
        if piece.active:
            np.testing.assert_allclose(left / scale, 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ONE_HIDDEN)
def test_least_cost_never_falls_as_the_limit_tightens(name):
    """All of these presets tighten with their hidden state: feasible sets are nested."""
    cost = np.concatenate([table.cost for table in rows(traced(name))[2]])
    assert np.all(np.diff(cost) >= -1e-12 * np.abs(cost).max())


@pytest.mark.parametrize("name", ONE_HIDDEN)
def test_slopes_are_differences_of_solved_points(name):
    curve = traced(name)
    for piece in curve.best:
        low, high = piece.range
        for share in (0.2, 0.7):
            x, step = low + share * (high - low), 1e-5 * (high - low)
            before, at, after = (curve.at(**{curve.hidden_name: value}) for value in (x - step, x, x + step))
            for control in curve.names:
                difference = (after.controls[control] - before.controls[control]) / (2 * step)
                assert at.slope[control] == pytest.approx(
                    difference, rel=1e-6, abs=1e-8 * at.controls[control] / (high - low)
                )


@pytest.mark.parametrize(
    ("name", "along", "x"),
    [
        ("turning", "cutting_speed", (0.18, 0.58)),
        ("grinding", "infeed_rate", None),
        ("motor", "acceleration", (600.0, 1500.0)),
    ],
)
def test_reading_the_response_again_and_again_runs_away_on_every_physical_locus(name, along, x):
    """Limit and slack move against each other along it: rho = 1 - e_s/P_b,s is above 1. Of the motor it is 3:
    3/2 over 1/2.
    """
    known = traced(name).stretch(along, x=x).calibrated()
    assert known.monotone
    assert np.all(known.rho > 1)
    assert known.usable == ()
    if name == "motor":
        np.testing.assert_allclose(known.rho, 3.0, rtol=1e-9)


# Koren's example


def test_example_is_unconstrained_up_to_one_half():
    point = traced("koren-example").at(x=0.3)
    assert point.kind == "interior"
    assert (point.controls["u"], point.controls["v"]) == (
        pytest.approx(1.0, abs=1e-9),
        pytest.approx(4.0, abs=1e-9),
    )
    assert event(traced("koren-example"), "response active").hidden == pytest.approx(0.5, abs=1e-9)


def test_example_at_one():
    point = traced("koren-example").at(x=1.0)
    found = [
        point.controls["u"],
        point.controls["v"],
        point.response,
        point.limit,
        point.multipliers["response"],
    ]
    np.testing.assert_allclose(found, (2, 3, 7, 7, 2), atol=1e-9)


def test_example_is_found_from_one_measurement():
    # the response of x = 1 there
    retrieved = traced("koren-example").retrieve(u=2.1, v=2.8, response=2.8 + 16 - 4 * 2.8)
    np.testing.assert_allclose(list(retrieved.controls.values()), (2, 3), atol=1e-9)


def test_example_is_a_circle_with_all_its_closed_forms():
    (piece,) = (piece for piece in traced("koren-example").best if piece.active)
    t = piece.table
    u, v = t.controls.T
    assert len(t.hidden) > 900
    np.testing.assert_allclose(u**2 + (v - 2) ** 2, 5.0, atol=1e-9)
    np.testing.assert_allclose(np.array([u, v]), EXAMPLE.point(t.hidden), atol=1e-10)
    np.testing.assert_allclose(t.multipliers[:, 0], EXAMPLE.multiplier(t.hidden), atol=1e-9)
    np.testing.assert_allclose((v[-1], u[-1]), (0.1097257, 1.1945137), atol=1e-7)


def test_example_stability_from_the_traced_loop_slope():
    walk = traced("koren-example").stretch("v", x=(0.5, 20.0))
    np.testing.assert_allclose(walk.loop_slope, EXAMPLE.loop_slope(walk.hidden), rtol=1e-9)
    for x, (stable, no_overshoot) in GAINS.items():
        slope = abs(walk.at(walk.coordinate_of(x)).loop_slope)
        assert (2 / slope, 1 / slope) == (
            pytest.approx(stable, abs=5e-5),
            pytest.approx(no_overshoot, abs=5e-5),
        )

    def slope(x):
        return abs(walk.at(walk.coordinate_of(x)).loop_slope)

    for gain, bracket, limit in ((0.6, (2, 10), 4.05217), (0.9, (0.5, 1.0), 0.54758), (0.9, (2, 4), 2.61890)):
        assert brentq(lambda x, gain=gain: gain * slope(x) - 2, *bracket, xtol=1e-12) == pytest.approx(
            limit, abs=1e-5
        )


def test_example_by_its_response():
    """The limit is monotone along the circle; reading again and again converges up to x = 6.92738."""
    known = traced("koren-example").stretch("v", x=(0.5, 20.0)).calibrated()
    assert known.monotone
    np.testing.assert_allclose(known.rho, EXAMPLE.retrieval_multiplier(known.hidden), rtol=1e-8)
    ((low, high),) = known.usable
    assert (low, high) == (pytest.approx(0.5), pytest.approx(6.92738, abs=1e-5))


def walked(walk, x, gain, start):
    """v(i+1) = v(i) + k e on the traced locus."""
    v, out = start, []
    for value in x:
        v = min(max(v, walk.low), walk.high)
        point = walk.at(v)
        e = float(walk.slack(v, value))
        out.append((v, point.controls["u"], e))
        v += gain * e
    return np.array(out)


def test_runs_of_the_paper_on_the_traced_locus():
    walk = traced("koren-example").stretch("v", x=(0.5, 20.0))
    path = walked(walk, np.ones(6), 0.6, 44 / 401)
    np.testing.assert_allclose(path[1:, 0], [1.36060, 2.42986, 2.88856, 2.98659, 2.99863], atol=1e-5)
    np.testing.assert_allclose(path, koren_run(1.0, 0.6, 5), atol=1e-6)
    x = np.maximum(1 - 0.01 * np.arange(61), 0.52)
    u, v = EXAMPLE.point(x)
    behind = 100 * np.abs(walked(walk, x, 0.6, 44 / 401)[:, :2] / np.array([v, u]).T - 1)[4:]
    np.testing.assert_allclose(behind.max(axis=0), (1.21, 2.09), atol=0.01)


# Turning and milling


@pytest.mark.parametrize(
    ("wear", "speed", "feed"), [(wear, *point) for wear, point in ON_TURNING_LOCUS.items()]
)
def test_turning_points(wear, speed, feed):
    point = traced("turning").at(flank_wear=wear)
    found = point.controls["cutting_speed"] / M_PER_MIN, point.controls["feed"]
    assert found == (pytest.approx(speed, rel=1e-6), pytest.approx(feed, rel=2e-6))  # digits printed
    np.testing.assert_allclose(found, turning_rates(wear), rtol=1e-6)
    force = traced("turning").problem.model.breaking(found[1])
    assert traced("turning").problem.model.force_residual(found[0] * M_PER_MIN, found[1]) == pytest.approx(
        0.0, abs=1e-8 * force
    )
    assert point.kind == "locus"


def test_turning_locus_is_that_of_the_closed_form():
    (piece,) = (piece for piece in traced("turning").best if piece.kind == "locus")
    model, (v, f) = traced("turning").problem.model, piece.table.controls.T
    np.testing.assert_allclose(model.force_residual(v, f) / model.breaking(f), 0.0, atol=1e-9)
    np.testing.assert_allclose(model.wear_at_limit(v, f), piece.table.hidden, rtol=1e-9)
    assert np.all(v > model.taylor_speed(f))


def test_turning_corner_onset_and_end():
    corner = traced("turning").at(flank_wear=0.05)
    assert corner.controls["cutting_speed"] / M_PER_MIN == pytest.approx(160.42, rel=1e-6)
    assert corner.controls["feed"] == pytest.approx(0.5, rel=1e-12)
    assert corner.cost * M_PER_MIN == pytest.approx(0.0166230, abs=5e-8)
    worn = locus.plan(locus.preset("turning").replace(hidden={"flank_wear": (0.0, 0.65)}))
    model = worn.problem.model
    onset, end = event(worn, "cutting_force active"), event(worn, "infeasible")
    assert onset.hidden == pytest.approx(0.160981, abs=1e-6)
    assert onset.hidden == pytest.approx(model.onset_wear(0.5), abs=1e-10)
    assert end.hidden == pytest.approx(0.599836, abs=1e-6)
    assert end.hidden == pytest.approx(model.end_wear(350 * M_PER_MIN), abs=1e-9)
    # there the feed falls with infinite slope
    assert end.controls["feed"] == pytest.approx(0.098897, abs=2e-5)
    assert worn.at(flank_wear=0.595).controls["cutting_speed"] == pytest.approx(350 * M_PER_MIN)


def test_turning_that_takes_the_whole_power_too():
    curve = locus.plan(locus.preset("turning").replace(power_max=6000.0))
    (vertex,) = (piece for piece in curve.best if piece.kind == "vertex")
    assert vertex.active == ("cutting_force", "cutting_power")
    v, f = vertex.table.controls.T
    model = curve.problem.model
    force = model.cutting_force(v, f, vertex.table.hidden)
    np.testing.assert_allclose(force, model.breaking(f), rtol=1e-9)
    np.testing.assert_allclose(force * v, 6e6, rtol=1e-9)
    assert np.all(vertex.table.multipliers >= 0)


def test_milling_keeps_the_greatest_feed():
    curve = traced("milling")
    controls, wear, _ = rows(curve)
    model = curve.problem.model
    v, f = controls.T
    np.testing.assert_allclose(f, 0.25, rtol=1e-12)
    spent = model.cutting_force(v, f, wear) * v / 1e6
    onset = event(curve, "cutting_power active").hidden
    np.testing.assert_allclose(spent[wear >= onset], 14.0, rtol=1e-9)
    np.testing.assert_allclose(v[wear <= onset], model.taylor_speed(0.25), rtol=1e-9)


# Grinding


@pytest.mark.parametrize(
    ("area", "rate", "speed", "depth"), [(area, *point) for area, point in ON_GRINDING_LOCUS.items()]
)
def test_grinding_points(area, rate, speed, depth):
    point, model = traced("grinding").at(wear_flat_area=area), traced("grinding").problem.model
    found = -point.cost, model.work_speed(point.controls["work_rotation"])
    assert found == (pytest.approx(rate, rel=1e-5), pytest.approx(speed, rel=1e-5))
    assert 1e3 * found[0] / found[1] == pytest.approx(depth, rel=1e-4)
    removal = removal_rate_at(model, area)
    np.testing.assert_allclose(found, (removal, model.work_speed_on_locus(removal)), rtol=1e-9)
    assert fastest_removal(model, area)[0] == pytest.approx(found[0], rel=1e-8)


def test_grinding_locus_is_that_of_the_closed_form():
    controls, area, _ = rows(traced("grinding"))
    model = traced("grinding").problem.model
    removal = model.specific_removal_rate(controls[:, 0])
    np.testing.assert_allclose(
        model.work_speed(controls[:, 1]), model.work_speed_on_locus(removal), rtol=1e-8
    )
    np.testing.assert_allclose(area, model.wear_flat_area_on_locus(removal), rtol=1e-10)
    slowest = removal[np.argmin(controls[:, 1])]
    assert slowest == pytest.approx(1.2658, rel=0.02)  # between points of the table


@pytest.mark.parametrize("work_diameter", [27.272727272727273, 150.0])
def test_grinding_at_other_equivalent_diameters(work_diameter):
    """D_e = 25 and 100 mm: the shape is the same, up to where everything burns."""
    ranges = {"infeed_rate": (1e-6, 0.05), "work_rotation": (0.4, 63.0)}
    problem = locus.preset("grinding").replace(work_diameter=work_diameter, controls=ranges)
    model = problem.model
    end = last_area(model, 63.0 * work_diameter / 2)
    curve = locus.plan(problem.replace(hidden={"wear_flat_area": (0.6 * end, 1.02 * end)}))
    assert event(curve, "infeasible").hidden == pytest.approx(end, rel=1e-9)
    (piece,) = (piece for piece in curve.best if piece.kind == "locus")
    removal = model.specific_removal_rate(piece.table.controls[:, 0])
    assert np.all(np.diff(removal) < 0)
    np.testing.assert_allclose(piece.table.hidden, model.wear_flat_area_on_locus(removal), rtol=1e-9)
    assert end < 250 * model.equivalent_diameter * 7.2**2 / (2.1e6 * 0.962 * 30)


def test_grinding_ends_where_everything_burns():
    curve = locus.plan(locus.preset("grinding").replace(hidden={"wear_flat_area": (0.004, 0.0112)}))
    assert event(curve, "work_rotation greatest").hidden == pytest.approx(0.010530967, abs=1e-9)
    assert event(curve, "infeasible").hidden == pytest.approx(0.010540244, abs=1e-9)


def test_grinding_loop_slope():
    """-0.01389 kW s/um at an infeed rate of 15.10 um/s, and 0.1439 as the limit of the printed gains."""
    walk = traced("grinding").stretch("infeed_rate")
    at = walk.at(walk.coordinate_of(0.006))
    assert 1e3 * at.controls["infeed_rate"] == pytest.approx(15.10, abs=5e-3)
    assert at.loop_slope * 1e-6 == pytest.approx(-0.01389, rel=1e-3)  # W s/mm to kW s/um
    assert np.all(walk.loop_slope < 0)


# Motor


def test_motor_leaves_its_greatest_speed_at_the_onset():
    curve = traced("motor")
    axis = curve.problem.model
    assert event(curve, "speed released").hidden == pytest.approx(axis.onset_inertia(300.0), rel=1e-10)
    controls, inertia, _ = rows(curve)
    best = axis.best_acceleration(inertia)
    np.testing.assert_allclose(controls[:, 1], best, rtol=1e-9)
    np.testing.assert_allclose(controls[:, 0], np.minimum(axis.speed_on_locus(best), 300.0), rtol=1e-9)


# Two hidden states, two limits, three controls


@pytest.mark.parametrize(
    ("dullness", "state"), [(0.8, 0.7), (0.83, 1.37), (1.0, 1.0), (1.21, 0.93), (1.6, 0.7), (1.6, 1.4)]
)
def test_dressed_grinding(dullness, state):
    """Both limits are active, and the work speed is that of the locus of the area: against the closed form."""
    area = traced("grinding-roughness")
    process = area.problem.model
    point = area.at(dullness=dullness, dressing_state=state)
    found = (
        process.grinding.specific_removal_rate(point.controls["infeed_rate"]),
        process.grinding.work_speed(point.controls["work_rotation"]),
        point.controls["dressing_lead"],
    )
    np.testing.assert_allclose(found, dressed_point(process, dullness, state), rtol=1e-9)
    assert all(value > 0 for value in point.multipliers.values())
    assert point.margin > 0
    measured = {name: point.response[name] for name in area.responses}
    again = area.retrieve(**point.controls, **measured)
    for name, value in point.controls.items():
        assert again.controls[name] == pytest.approx(value, rel=1e-6)
    elsewhere = {name: 0.9 * value for name, value in point.controls.items()}
    s, c = named(dullness=dullness, dressing_state=state), named(**elsewhere)
    measured = {one.name: one.response(s, c) for one in area.problem.varying}
    again = area.retrieve(**elsewhere, **measured)
    for name, value in point.controls.items():
        assert again.controls[name] == pytest.approx(value, rel=1e-6)


def test_a_dressing_that_stays_leaves_the_work_speed_open():
    """On the cap of Z' the speed of most burning power to spare is taken; where power limits, it is the locus
    of before.
    """
    law, plain = (
        locus.processes.Roughness(roughness_max=4e-4, base=5e-4, exponent=0.4),
        locus.preset("grinding"),
    )
    model = plain.model
    rough = locus.Varying(
        response=lambda s, c: law.roughness(
            model.specific_removal_rate(c.infeed_rate) / model.wheel_speed, law.lead, 1.0
        ),
        limit=lambda s, c: law.roughness_max,
        name="roughness",
    )
    constraints = (*model.constraints, rough)
    curve = locus.plan(
        locus.Problem(controls=plain.controls, hidden=plain.hidden, cost=model.cost, constraints=constraints)
    )
    assert curve.degenerate
    cap = law.chip_thickness_max(law.lead, 1.0) * model.wheel_speed
    onset = event(curve, "grinding_power active").hidden
    assert onset == pytest.approx(float(model.wear_flat_area_on_locus(cap)), rel=1e-6)
    capped, free = curve.at(wear_flat_area=0.006), curve.at(wear_flat_area=0.01)
    assert -capped.cost == pytest.approx(cap, rel=1e-9)
    speeds = np.geomspace(20, 1800, 20001)
    spare = [-excess_power(model, cap, speed, 0.006) for speed in speeds]
    assert model.work_speed(capped.controls["work_rotation"]) == pytest.approx(
        speeds[np.argmax(spare)], rel=1e-3
    )
    assert -free.cost == pytest.approx(removal_rate_at(model, 0.01), rel=1e-6)
