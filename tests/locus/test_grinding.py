"""Grinding on the verge of burning: the locus in closed form against searches, published statements,
dressing, refusals.
"""

import math

import numpy as np
import pytest
from closed_forms import (
    ON_GRINDING_LOCUS,
    dressed_point,
    excess_power,
    fastest_removal,
    named,
    removal_rate_at,
    slacks,
    slsqp,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from locus_inside import _presets
from scipy.optimize import brentq

from sdpgrind import physics, units
from sdpgrind.locus.processes import DressedGrinding, Grinding, Roughness

PROBLEM = _presets.preset("grinding")
GRINDING = PROBLEM.model
DRESSED = _presets.preset("grinding-roughness")
RATES = st.floats(0.05, 20.0)
DIAMETERS = {25.0: 27.272727272727273, 50.0: 60.0, 100.0: 150.0, 200.0: 600.0}  # D_e -> d_w with d_s = 300 mm


def of_diameter(equivalent):
    return GRINDING.replace(work_diameter=DIAMETERS[equivalent])


@pytest.mark.parametrize(
    ("area", "rate", "speed", "depth"), [(area, *point) for area, point in ON_GRINDING_LOCUS.items()]
)
def test_points_of_the_locus(area, rate, speed, depth):
    removal = removal_rate_at(GRINDING, area)
    found = float(GRINDING.work_speed_on_locus(removal))
    assert (removal, found, 1e3 * removal / found) == (
        pytest.approx(rate, rel=2e-6), pytest.approx(speed, rel=2e-6), pytest.approx(depth, rel=1e-4)
    )  # fmt: skip
    assert fastest_removal(GRINDING, area) == (
        pytest.approx(removal, rel=1e-9),
        pytest.approx(found, rel=1e-4),
    )
    point = {"infeed_rate": GRINDING.infeed_rate(removal), "work_rotation": GRINDING.work_rotation(found)}
    assert slacks(PROBLEM, {"wear_flat_area": area}, point)[0] == pytest.approx(0.0, abs=1e-9)
    best = slsqp(PROBLEM, {"wear_flat_area": area}, {name: 0.9 * value for name, value in point.items()})
    assert best["infeed_rate"] == pytest.approx(point["infeed_rate"], rel=1e-5)


@given(RATES, st.floats(10.0, 2000.0), st.floats(0.001, 0.02))
def test_power_over_the_whole_width_is_that_written_out(rate, speed, area):
    point = {"infeed_rate": GRINDING.infeed_rate(rate), "work_rotation": GRINDING.work_rotation(speed)}
    left = slacks(PROBLEM, {"wear_flat_area": area}, point)[0]
    assert -left == pytest.approx(9.3 * excess_power(GRINDING, rate, speed, area), rel=1e-9, abs=1e-7)
    assert PROBLEM.objective(None, named(**point)) == pytest.approx(-rate)


def test_burning_power_is_that_of_koren():
    """(29): K1 f + K2 (v f)^l, with f the infeed rate, v the speed of the work, l = 1/4."""
    infeed, speed, wide, b = 0.012, 350.0, 50.0, 9.3
    K1 = 6.2 * math.pi * 60.0 * b
    K2 = 7.2 * b * (math.pi * 60.0 * wide) ** 0.25
    assert GRINDING.burning_power(infeed, GRINDING.work_rotation(speed)) == pytest.approx(
        K1 * infeed + K2 * (infeed * speed) ** 0.25
    )


@given(RATES, st.sampled_from(sorted(DIAMETERS)))
@settings(max_examples=60)
def test_locus_is_where_power_is_least_beyond_burning(rate, wide):
    """Equal to burning power there, and more at any other speed."""
    grinding = of_diameter(wide)
    speed, area = float(grinding.work_speed_on_locus(rate)), float(grinding.wear_flat_area_on_locus(rate))
    size = 0.962 * 30 + 7.6 * rate
    assert excess_power(grinding, rate, speed, area) == pytest.approx(0.0, abs=1e-12 * size)
    assert all(excess_power(grinding, rate, speed * k, area) > 1e-6 * size for k in (0.5, 0.98, 1.02, 2.0))
    assert 2.1e6 * speed / (7.55 * 30e3 * wide) > 3


@given(RATES, st.floats(1.001, 3.0), st.sampled_from(sorted(DIAMETERS)))
def test_a_dull_wheel_grinds_slower(rate, more, wide):
    grinding = of_diameter(wide)
    assert grinding.wear_flat_area_on_locus(rate) > grinding.wear_flat_area_on_locus(rate * more)


def test_a_larger_equivalent_diameter_bears_more_wear():
    rates = np.geomspace(0.01, 20, 300)
    greatest = [of_diameter(wide).wear_flat_area_on_locus(rates).max() for wide in sorted(DIAMETERS)]
    assert np.all(np.diff(greatest) > 0)
    for wide, bound in zip(sorted(DIAMETERS), greatest, strict=True):
        assert bound < 250 * wide * 7.2**2 / (2.1e6 * 0.962 * 30)  # limit without infeed


@pytest.mark.parametrize("wide", sorted(DIAMETERS))
def test_work_runs_slowest_at_one_removal_rate(wide):
    grinding = of_diameter(wide)
    slowest = grinding.slowest_removal_rate
    assert slowest == pytest.approx(1.2658, abs=5e-5)
    rates = np.geomspace(0.1, 10, 100001)
    assert rates[np.argmin(grinding.work_speed_on_locus(rates))] == pytest.approx(slowest, rel=1e-3)


def test_dull_wheels_want_a_faster_work_again():
    grinding = of_diameter(100.0)
    speeds = [
        float(grinding.work_speed_on_locus(removal_rate_at(grinding, area))) for area in (0.010, 0.015, 0.020)
    ]
    np.testing.assert_allclose(speeds, (260, 179, 409), atol=0.5)


def test_beyond_an_area_everything_burns():
    """At the greatest rotation, as the locus wants more: where the lower and the upper rate meet."""

    def gap(area):
        rates = GRINDING.burn_free_rates(63.0, area)
        return rates[1] - rates[0]

    end = 0.010540244
    assert gap(end * (1 - 1e-6)) > 0 > gap(end * (1 + 1e-6))
    assert fastest_removal(GRINDING, end * (1 + 1e-6))[0] == 0.0
    top = brentq(lambda z: float(GRINDING.work_speed_on_locus(math.exp(z))) - 63.0 * 30, math.log(0.01), 0.0)
    assert GRINDING.wear_flat_area_on_locus(math.exp(top)) == pytest.approx(0.010530967, abs=1e-9)


@pytest.mark.parametrize("area", [0.004, 0.006, 0.01, 0.0104])
def test_hidden_range_of_the_preset_has_best_points_inside_all_ranges(area):
    removal = removal_rate_at(GRINDING, area)
    speed = float(GRINDING.work_speed_on_locus(removal))
    found = {"infeed_rate": GRINDING.infeed_rate(removal), "work_rotation": GRINDING.work_rotation(speed)}
    for name, value in found.items():
        low, high = PROBLEM.controls[name]
        assert 1.5 * low < value < high / 1.3
    assert fastest_removal(GRINDING, area)[0] == pytest.approx(removal, rel=1e-8)


def test_an_arbitrarily_small_infeed_rate_burns():
    rotation = 10.0
    low, high = GRINDING.burn_free_rates(rotation, 0.006)
    for rate, sign in (
        (1e-3 * low, -1),
        (0.99 * low, -1),
        (1.01 * low, 1),
        (0.99 * high, 1),
        (1.01 * high, -1),
    ):
        left = GRINDING.burning_power(rate, rotation) - GRINDING.grinding_power(rate, rotation, 0.006)
        assert left * sign > 0
    assert GRINDING.burn_free_rates(rotation, 0.02) == (math.inf, 0.0)
    start = GRINDING.burning_power(0.0, rotation) - GRINDING.grinding_power(0.0, rotation, 0.006)
    assert start == pytest.approx(-9.3 * 0.962 * 30)


def test_loop_slope_and_limits_of_the_printed_gains():
    """(36) with K1 3.3 and K2 5.3 um/(s kW): slope of limit - response along the locus, kW s/um, at A =
    0.0060.
    """
    area = 0.006
    rate = GRINDING.infeed_rate(removal_rate_at(GRINDING, area))
    assert 1e3 * rate == pytest.approx(15.10, abs=5e-3)

    def error(infeed):
        removal = GRINDING.specific_removal_rate(infeed)
        return -9.3e-3 * excess_power(GRINDING, removal, float(GRINDING.work_speed_on_locus(removal)), area)

    step = 1e-5
    slope = (error(rate + step) - error(rate - step)) / (2e3 * step)
    assert slope == pytest.approx(-0.01389, rel=1e-3)

    def radius(g):
        return np.abs(np.roots([1, -(1 - (3.3 + 5.3) * g), -5.3 * g])).max()

    limit = brentq(lambda g: radius(g) - 1, 0.1, 0.2)
    assert limit == pytest.approx(2 / (3.3 + 2 * 5.3)) == pytest.approx(0.1439, abs=5e-5)


def test_bore():
    bore = Grinding(wheel_diameter=50.0, work_diameter=70.0, width=9.0, wheel_speed=30e3, internal=True)
    assert bore.equivalent_diameter == pytest.approx(175.0)
    rate = 2.0
    speed, area = float(bore.work_speed_on_locus(rate)), float(bore.wear_flat_area_on_locus(rate))
    assert fastest_removal(bore, area, speeds=(50.0, 20000.0))[0] == pytest.approx(rate, rel=1e-8)
    assert excess_power(bore, rate, speed, area) == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize(("dullness", "state"), [(0.8, 0.7), (0.8, 1.4), (1.0, 1.0), (1.6, 0.7), (1.6, 1.4)])
def test_dressed_grinding_has_one_best_point(dullness, state):
    process, hidden = DRESSED.model, {"dullness": dullness, "dressing_state": state}
    rate, speed, lead = dressed_point(process, dullness, state)
    wheel = process.grinding
    point = {
        "infeed_rate": wheel.infeed_rate(rate), "work_rotation": float(wheel.work_rotation(speed)), "dressing_lead": lead
    }  # fmt: skip
    assert all(low < point[name] < high for name, (low, high) in DRESSED.controls.items())
    power, rough = slacks(DRESSED, hidden, point)
    assert (power, rough) == (pytest.approx(0.0, abs=1e-8), pytest.approx(0.0, abs=1e-14))
    for shift in (0.8, 1.2):
        start = {name: value * shift for name, value in point.items()}
        best = slsqp(DRESSED, hidden, {**start, "infeed_rate": 0.7 * point["infeed_rate"]})
        for name, value in point.items():
            assert best[name] == pytest.approx(value, rel=1e-4)


def test_a_dressing_that_stays_only_caps_the_removal_rate():
    """On the cap all work speeds with burning power to spare are as good as each other."""
    law = Roughness(roughness_max=units.um(0.4), base=units.um(0.5), exponent=0.4)
    problem = PROBLEM.replace(roughness=law)
    assert [one.name for one in problem.varying] == ["grinding_power", "roughness"]
    cap = law.chip_thickness_max(law.lead, 1.0) * 30e3
    assert law.roughness(cap / 30e3, law.lead, 1.0) == pytest.approx(4e-4)
    hidden = {"wear_flat_area": 0.006, "dressing_state": 1.0}
    for rotation in (8.0, 10.0, 12.0):
        point = {"infeed_rate": GRINDING.infeed_rate(cap), "work_rotation": rotation}
        power, rough = slacks(problem, hidden, point)
        assert power > 0
        assert rough == pytest.approx(0.0, abs=1e-14)


def test_roughness_has_the_printed_powers():
    law = Roughness(
        roughness_max=1e-3, base=5e-4, exponent=0.4, chip_thickness=1e-4, lead_reference=0.1, depth_ratio=16.0
    )
    once = law.roughness(1e-4, 0.1, 1.0)
    assert once == pytest.approx(5e-4 * 2)
    assert law.roughness(1e-4, 0.4, 3.0) == pytest.approx(once * 2 * 3)
    assert law.roughness(3.2e-3, 0.1, 1.0) == pytest.approx(once * 4)


WHEEL = {"wheel_diameter": 300.0, "work_diameter": 60.0, "width": 9.3, "wheel_speed": 30e3}


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Grinding(**{**WHEEL, "width": 0.0}), "width must be > 0 .mm.; got 0.0"),
        (
            lambda: Grinding(**{**WHEEL, "wheel_speed": 30.0}),
            "wheel_speed must be in mm/s, .*units.m_per_s.*; got 30.0",
        ),
        (
            lambda: Grinding(**WHEEL, internal=True),
            "wheel_diameter must be < work_diameter = 60 in a bore .mm.; got 300",
        ),
        (
            lambda: GRINDING.check({}, {"wear_flat_area": (0.4, 1.04)}),
            "wear_flat_area must be a part of 1.*percent; got 1.04",
        ),
        (
            lambda: GRINDING.check({"work_rotation": (4.0, 600.0)}, {}),
            "work_rotation must be in rad/s, .*below 6000 mm/s; units.rpm.*; got 600.0",
        ),
        (lambda: DRESSED.model.check({"work_rotation": (4.0, 600.0)}, {}), "work_rotation must be in rad/s"),
        (lambda: GRINDING.work_speed_on_locus(0.0), "specific_removal_rate must be > 0, .*; got 0.0"),
        (
            lambda: GRINDING.replace(power=physics.GrindingPower(specific_energy=6.0)).slowest_removal_rate,
            "power.specific_energy must be > burning.u0 = 6.2 for a least work speed",
        ),
        (lambda: GRINDING.burn_free_rates(10.0, 1.5), "wear_flat_area must be in .0, 1.; got 1.5"),
        (
            lambda: DressedGrinding(grinding=GRINDING, area=0.006, area_exponent=0.3),
            "grinding must have a roughness",
        ),
        (
            lambda: Roughness(roughness_max=0.8, base=5e-4, exponent=0.4),
            "roughness_max must be in mm, < 0.1; units.um",
        ),
        (lambda: Roughness(roughness_max=8e-4, base=5e-4, exponent=0.0), "exponent must be > 0"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_closed_forms_are_of_malkins_sliding_only():
    other = GRINDING.replace(power=physics.GrindingPower(sliding=physics.DongSliding()))
    with pytest.raises(
        TypeError, match=r"power\.sliding must be a MalkinSliding, whose locus has a closed form"
    ):
        other.work_speed_on_locus(1.0)
