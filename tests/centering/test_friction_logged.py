"""Friction from the samples of a logged cycle, against the hidden truth of the machine."""

import functools

import numpy as np
import pytest
from circle_inside import UNITS, logged_pushes

import hwsim
from centering import preset
from centering.cycle import PrintedController
from centering.friction import identify_friction
from centering.push import Part
from sdpgrind.identify import Status

RING_7 = preset("printed").replace(part=Part(7.0, 85.0))


@functools.cache
def logged(mass, parts):
    problem = preset("printed").replace(mass=mass, pushes_max=4)
    machine = hwsim.CenteringMachine(problem)
    return problem, hwsim.run(machine, PrintedController(problem), parts=parts, rng=3)


def test_friction_of_each_part_is_found():
    """8 parts that scatter by 8 %, pushes of one by 4 %: the stated errors are small, and true.

    The median of 8 errors is above 1.64 standard deviations once in a thousand.
    """
    problem, log = logged(18.9, 8)
    stated, sure = [], []
    for part in range(8):
        found = identify_friction(log, problem, part=part, throw=False)
        true = np.array([log.outcome.true_mu_static[part], log.outcome.true_mu_kinetic[part]])
        stated.append(found.sd / found.value)
        sure.append((found.value - true) / found.sd)
    assert np.all(np.array(stated) < (0.07, 0.055))
    assert np.all(np.median(np.abs(sure), axis=0) < 1.64)
    assert np.mean(np.abs(sure) < 2.0) >= 0.8


def test_pushes_are_those_of_the_machine():
    """Their ways are those of the hidden centre, up to their bend; forces are those of the contact at any speed."""
    problem, log = logged(18.9, 8)
    x, y = log.outcome.center_x.values[0], log.outcome.center_y.values[0]
    ways = np.hypot(np.diff(x), np.diff(y))
    ways = ways[ways > 0.21]
    pushes = logged_pushes(log, problem, 0)
    assert len(pushes) >= ways.size > 1
    found = np.array([push["final_position"] for push in pushes])[: ways.size]
    assert found == pytest.approx(ways, rel=0.05, abs=5e-3)
    assert all(push["peak_force"] > 0.9 * problem.model.breakaway_force for push in pushes)


def test_arrays_by_name_are_a_log():
    problem, log = logged(18.9, 8)
    kept = log["control"].part.values == 2
    arrays = {name: log["control"][name].values[kept] for name in UNITS}
    arrays["time"] = log["control"].time.values[kept]
    one, other = identify_friction(arrays, problem), identify_friction(log, problem, part=2)
    assert np.array_equal(one.value, other.value) and one.status in (Status.OK, Status.UNSURE)


def test_refused():
    problem, log = logged(18.9, 8)
    with pytest.raises(ValueError, match="part must say which part"):
        identify_friction(log, problem)
    still = {name: np.zeros(5) for name in UNITS} | {"time": np.arange(5.0)}
    with pytest.raises(ValueError, match=r"data must be at least one push of 0.2 mm or more; got none"):
        identify_friction(still, problem)


def one_push(depth):
    """Samples of a push at 35 mm/s."""
    time = np.arange(0.0, 0.2, 0.01)
    slide = np.maximum(86.5 - 35.0 * np.maximum(time - 0.02, 0.0), 86.0 - depth)
    return {
        "time": time,
        "angle": 0.1 * time,
        "slide": slide,
        "peak_force": np.where(slide < 86.0, 50.0, 0.0),
        "spindle_speed": np.full(time.size, 0.1),
        "pushing": np.where((time > 0.015) & (time < 0.1), 1.0, 0.0),
        "offset_planned": np.where(time < 0.15, 1.0, 1.0 - depth),
        "offset_angle_planned": np.zeros(time.size),
    }


@pytest.mark.parametrize(("depth", "blurred"), [(0.25, True), (1.1, False)])
def test_a_push_between_two_samples_is_blurred(depth, blurred):
    """Of 7 and 31 ms at 35 mm/s: how the tip moved in the first no reconstruction tells to 5 % of its force.

    Taken as samples show them, such pushes of rings of 7 kg gave 95 % intervals of mu_kinetic that held 62 %.
    """
    (push,) = logged_pushes(one_push(depth), RING_7)
    assert (push["blur"][0] > 0.05 * 50.0) == blurred


@pytest.mark.parametrize("name", ["slide", "spindle_speed", "angle"])
def test_a_push_with_a_missing_sample_is_left_out(name):
    """The other push of the log tells the same as it does alone."""
    whole, spoilt = one_push(1.1), one_push(1.1)
    spoilt[name][5] = np.nan
    later = {"time": 0.2 + whole["time"]}
    rows = {key: np.concatenate((spoilt[key], (whole | later)[key])) for key in whole}
    (push,), (alone,) = logged_pushes(rows, RING_7), logged_pushes(whole, RING_7)
    assert push["final_position"] == pytest.approx(alone["final_position"], rel=1e-9)  # times are rounded
    with pytest.raises(ValueError, match="data must be at least one push"):
        identify_friction(spoilt, RING_7)


def test_forces_that_were_not_read_are_no_reading():
    rows = one_push(1.1)
    rows["peak_force"][5] = np.nan
    assert logged_pushes(rows, RING_7)[0]["peak_force"] == 50.0
    rows["peak_force"][:] = np.nan
    (push,) = logged_pushes(rows, RING_7)
    found = identify_friction(rows, RING_7, throw=False)
    assert push["peak_force"] is None and np.all(np.isfinite(found.value))
