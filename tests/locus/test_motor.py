"""The motor whose load's inertia drifts: closed forms against a search, refusals."""

import math

import pytest
from closed_forms import named, slacks, slsqp
from hypothesis import given, settings
from hypothesis import strategies as st
from locus_inside import _presets

from sdpgrind.locus.processes import MotorAxis

PROBLEM = _presets.preset("motor")
AXIS = PROBLEM.model


def best(inertia):
    acceleration = AXIS.best_acceleration(inertia)
    return {"speed": min(AXIS.speed_on_locus(acceleration), 300.0), "acceleration": acceleration}


@pytest.mark.parametrize("inertia", [50.0, 400.0, 566.0, 568.0, 900.0, 1500.0])
def test_best_point_against_a_search(inertia):
    found = slsqp(PROBLEM, {"inertia": inertia}, {"speed": 100.0, "acceleration": 300.0})
    for name, value in best(inertia).items():
        assert found[name] == pytest.approx(value, rel=2e-6)


@given(st.floats(50.0, 1500.0))
@settings(max_examples=50)
def test_torque_is_spent_and_the_speed_is_stationary(inertia):
    point = best(inertia)
    assert slacks(PROBLEM, {"inertia": inertia}, point)[0] == pytest.approx(0.0, abs=1e-9)
    torque = (100.0 + inertia) * 1e-6 * point["acceleration"]  # N m, of kg m^2
    assert torque == pytest.approx(1.0)
    limit = PROBLEM.varying[0].limit(None, named(**point))
    assert limit == pytest.approx(torque * point["speed"])  # W
    slower, faster = (
        AXIS.cost(None, named(speed=point["speed"] * k, acceleration=point["acceleration"]))
        for k in (0.99, 1.01)
    )
    time = AXIS.cost(None, named(**point))
    assert slower > time
    assert faster > time or point["speed"] == 300.0


def test_time_of_a_move_is_that_of_its_speed_over_time():
    speed, acceleration = 100.0, 500.0
    ramp = speed / acceleration
    rest = (AXIS.angle - ramp * speed) / speed  # time at constant speed, s
    assert AXIS.cost(None, named(speed=speed, acceleration=acceleration)) == pytest.approx(2 * ramp + rest)


def test_greatest_speed_holds_up_to_the_onset():
    onset = AXIS.onset_inertia(speed_max=300.0)
    assert onset == pytest.approx(1e6 * 60 / 300**2 - 100)
    assert AXIS.speed_on_locus(AXIS.best_acceleration(onset)) == pytest.approx(300.0)


@pytest.mark.parametrize("name", ["inertia_base", "torque_max", "angle"])
def test_refusals(name):
    good = {"inertia_base": 1.0, "torque_max": 1.0, "angle": 1.0}
    with pytest.raises(ValueError, match=f"{name} must be > 0"):
        MotorAxis(**{**good, name: -1.0})
    with pytest.raises(ValueError, match=f"{name} must be finite"):
        MotorAxis(**{**good, name: math.nan})
