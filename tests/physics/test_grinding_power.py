"""Power, sliding laws and burning of a wheel: published points, both roots of the onset, one body for numbers
and symbols.
"""

import casadi
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sdpgrind import physics, units

# Dong, Danai and Malkin (2004), section 4: wheel and work of 50 and 70 mm, internal; 37 m/s; 5 turns a
# second.
DIAMETER = 50.0 * 70.0 / 20.0
WHEEL = {
    "work_speed": np.pi * 70.0 * 5.0,
    "wheel_speed": units.m_per_s(37.0),
    "equivalent_diameter": DIAMETER,
}
WORK = {name: WHEEL[name] for name in ("work_speed", "equivalent_diameter")}
DONG = physics.GrindingPower(sliding=physics.DongSliding())
CALIBRATED = physics.BurningLimit(u0=6.205, B=3.32)


@pytest.mark.parametrize(
    ("rate", "power", "burning"),
    [(0.003, 521.5, 600.9), (0.010, 925.3, 884.9), (0.020, 1464.8, 1151.9), (0.0448, 2731.2, 1658.9)],
)
def test_power_and_burning_power(rate, power, burning):
    """Of the specification's page, worked out apart from this code."""
    depth = rate / 5.0
    assert DONG.power(depth_of_cut=depth, **WHEEL, wear_flat_area=0.026, width=9.0) == pytest.approx(
        power, abs=0.06
    )
    assert CALIBRATED.power(depth_of_cut=depth, **WORK, width=9.0) == pytest.approx(burning, abs=0.06)


def test_parts_by_hand():
    """Dong's (6) in its own units: 0.842 kW for the whole wheel of 9 mm, with speeds in m/s."""
    depth = 0.026 / 5.0
    sliding = 842.0 * (DIAMETER * depth) ** 0.85 * 37.0 * 0.026
    whole = 9.0 * (13.8 * WHEEL["work_speed"] * depth + 0.962 * 37.0) + sliding
    assert DONG.power(depth_of_cut=depth, **WHEEL, wear_flat_area=0.026, width=9.0) == pytest.approx(
        whole, rel=1e-13
    )
    assert whole == pytest.approx(1778, abs=1.0)


def test_the_sliding_laws_mean_another_area():
    """Equal power at 0.02 mm/s needs 0.0059 in Malkin's law; the same 0.026 gives 2.64 kW of sliding instead
    of 0.60.
    """
    point = {"depth_of_cut": 0.02 / 5.0, **WHEEL}
    watts = 9.0 * 37.0
    malkin, dong = physics.MalkinSliding(), physics.DongSliding()
    assert watts * malkin.force(**point, wear_flat_area=0.026) == pytest.approx(2640, abs=10)
    assert watts * dong.force(**point, wear_flat_area=0.026) == pytest.approx(600, abs=3)
    same = dong.force(**point, wear_flat_area=0.026) / malkin.force(**point, wear_flat_area=1.0)
    assert same == pytest.approx(0.0059, abs=5e-5)
    assert watts * malkin.force(**point, wear_flat_area=same) == pytest.approx(
        watts * dong.force(**point, wear_flat_area=0.026)
    )


@pytest.mark.parametrize(
    ("area", "upper"), [(0.026, 0.0082569), (0.9 * 0.026, 0.0096581), (0.032, 0.0058196)]
)
def test_rate_at_which_it_begins_to_burn(area, upper):
    onset = physics.burn_onset(DONG, CALIBRATED, **WHEEL, wear_flat_area=area)
    assert 5.0 * onset.upper == pytest.approx(upper, abs=2e-6)
    if area == 0.026:
        assert 5.0 * onset.lower == pytest.approx(4.5e-4, abs=0.1e-4)


@settings(max_examples=60, deadline=None)
@given(
    area=st.floats(0.0, 0.04),
    B=st.floats(1.0, 8.0),
    ploughing=st.floats(0.0, 2.0),
    work_speed=st.floats(200.0, 2000.0),
    malkin=st.booleans(),
)
def test_between_the_roots_it_does_not_burn(area, B, ploughing, work_speed, malkin):
    sliding = physics.MalkinSliding() if malkin else physics.DongSliding()
    law, limit = (
        physics.GrindingPower(ploughing_force=ploughing, sliding=sliding),
        physics.BurningLimit(6.2, B),
    )
    wheel = WHEEL | {"work_speed": work_speed}
    work = {name: wheel[name] for name in WORK}

    def excess(depth):
        return law.power(depth_of_cut=depth, **wheel, wear_flat_area=area) - limit.power(
            depth_of_cut=depth, **work
        )

    onset = physics.burn_onset(law, limit, **wheel, wear_flat_area=area, depth_max=0.5)
    grid = np.geomspace(1e-9, 0.5, 400)
    burns = excess(grid) > 0
    if onset.upper < onset.lower:
        assert burns.all()
        return
    assume(onset.upper > 1.01 * onset.lower)
    inside = (grid > onset.lower * 1.001) & (grid < onset.upper * 0.999)
    assert not burns[inside].any()
    assert burns[(grid < onset.lower * 0.999) | (grid > onset.upper * 1.001)].all()


def test_one_body_for_symbols():
    depth = casadi.SX.sym("depth")
    power = casadi.Function("power", [depth], [DONG.power(depth_of_cut=depth, **WHEEL, wear_flat_area=0.026)])
    burning = casadi.Function("burning", [depth], [CALIBRATED.power(depth_of_cut=depth, **WORK)])
    assert float(power(0.004)) == pytest.approx(
        DONG.power(depth_of_cut=0.004, **WHEEL, wear_flat_area=0.026), rel=1e-14
    )
    assert float(burning(0.004)) == pytest.approx(CALIBRATED.power(depth_of_cut=0.004, **WORK), rel=1e-14)


def test_the_published_limit_in_metric():
    limit = physics.BurningLimit.published()
    assert (limit.u0, limit.B) == (pytest.approx(6.2053, rel=1e-5), pytest.approx(7.1802, rel=1e-5))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: physics.BurningLimit(0.0, 7.0), r"u0 must be > 0 \(J/mm\^3\); got 0.0"),
        (lambda: physics.BurningLimit(6.0, -7.0), r"B must be > 0 \(J/\(mm\^2 s\^\(1/2\)\)\); got -7.0"),
        (lambda: physics.GrindingPower(specific_energy=-1), r"specific_energy must be > 0 \(J/mm\^3\)"),
        (lambda: physics.DongSliding(coefficient=0), r"coefficient must be > 0 \(N/mm\^2.7\)"),
        (lambda: physics.DongSliding(exponent=1e30), r"exponent must be in \(0, 5\]"),
        (lambda: physics.MalkinSliding(pressure=-1), r"pressure must be >= 0 \(N/mm\^2\)"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
