"""State of kernels by name: a row of floats, viewed once, with the bits of numbered places."""

import copy
import pickle

import numpy as np
import pytest

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.compiling.kernel_digest import digest
from sdpgrind.base.states import floats, named, places, record, units, width

AXIS = record("angle rad, speed rad/s, load_torque N m, gain[2] N m/rad, ticks 1")
OTHER = record("speed rad/s, angle rad, load_torque N m, gain[2] N m/rad, ticks 1")


@compiled
def by_name(state, tick):
    return _by_name(state.view(AXIS)[0], tick)


@compiled
def _by_name(axis, tick):
    torque = axis.gain[0] * axis.angle + axis.gain[1] * axis.speed
    axis.speed -= tick * (torque + axis.load_torque) / 0.3
    axis.angle += tick * axis.speed
    axis.ticks += 1.0
    return torque


@compiled
def by_place(state, tick):
    torque = state[3] * state[0] + state[4] * state[1]
    state[1] -= tick * (torque + state[2]) / 0.3
    state[0] += tick * state[1]
    state[5] += 1.0
    return torque


@compiled
def of_the_other(state):
    return state.view(OTHER)[0].angle


def test_a_record_knows_places_and_units():
    assert width(AXIS) == 6 and floats(AXIS).tolist() == [0.0] * 6
    assert places(AXIS) == (0, 1, 2, 3, 5) and places(AXIS, "ticks", "gain") == (5, 3)
    assert units(AXIS) == {
        "angle": "rad",
        "speed": "rad/s",
        "load_torque": "N m",
        "gain": "N m/rad",
        "ticks": "1",
    }


def test_names_and_places_give_the_same_bits():
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(2, 6))
    rows[1] = rows[0]
    for _ in range(100):
        assert by_name(rows[0], 0.01) == by_place(rows[1], 0.01)
    assert rows[0].tobytes() == rows[1].tobytes()


def test_the_compiled_step_is_that_of_python():
    row = np.random.default_rng(1).normal(size=6)
    twin = row.copy()
    for _ in range(10):
        assert by_name(row, 0.01) == _by_name.py_func(named(twin, AXIS), 0.01)
    assert row.tobytes() == twin.tobytes()


def test_what_is_set_by_name_is_set_in_the_row():
    row = floats(AXIS)
    state = named(row, AXIS)
    state.speed, state.gain, state.gain[1] = 2.0, 3.0, 4.0
    assert row.tolist() == [0.0, 2.0, 0.0, 3.0, 4.0, 0.0] and state.speed == 2.0
    kept = copy.deepcopy(row), pickle.loads(pickle.dumps(row))
    assert all(
        type(each) is np.ndarray and each.dtype == float and each.tolist() == row.tolist() for each in kept
    )


def test_an_order_that_changes_compiles_anew():
    assert of_the_other(np.arange(6.0)) == 1.0
    before, plain = digest(of_the_other), of_the_other.py_func.__globals__
    try:
        plain["OTHER"] = AXIS
        again = compiled(of_the_other.py_func)
        assert again(np.arange(6.0)) == 0.0 and digest(again) != before
    finally:
        plain["OTHER"] = record("speed rad/s, angle rad, load_torque N m, gain[2] N m/rad, ticks 1")


@pytest.mark.parametrize("fields", ["angle", "angle rad, angle rad", "2 rad", "angle rad,", ""])
def test_fields_are_refused(fields):
    with pytest.raises(ValueError, match=r"fields must be 'name unit, name unit, ...', no name twice; got '"):
        record(fields)


def test_a_row_of_another_width_is_refused():
    with pytest.raises(ValueError, match=r"^row must be of shape \(6,\), as its record is; got \(5,\)$"):
        named(np.zeros(5), AXIS)
    with pytest.raises(ValueError, match="must be a divisor of the total size in bytes"):
        by_name(np.zeros(5), 0.01)
