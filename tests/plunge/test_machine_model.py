"""Forward model of commissioning against an integrator, the plant, and its own symmetries."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machine_readings import MODEL, MOST, PROBLEM, STEP, TRUTH, commands, ground, integrated, model_of
from plunge_inside import cycles as _cycles
from plunge_inside import machine_fit as _fit
from plunge_inside import machine_model as _model
from plunge_inside import machine_start as _start
from scipy import optimize

from sdpgrind import plunge

SHORT = ((1.0, 3.2), (0.2, 1.2), (0.0, 0.8))
NAMES = (
    "normal_force_ratio", "wear_flat_area", "specific_energy", "ploughing_force", "idle_power", "wheel_wear",
    "feed_lag", "power_lag", "contact_zero",
)  # fmt: skip
WORN = MODEL.replace(wear=plunge.Wear(growth=0.02, exponent=0.5))


def record(time, rate, size=None, power=None):
    blank = np.full(time.size, np.nan)
    return _cycles.Cycle(
        "", time, rate, blank if size is None else size, blank if power is None else power, blank
    )


def values(truth, linear=None):
    each = [truth[name] for name in NAMES] + [0.0]
    return np.array([linear, *each[1:]] if linear else each)


def response(problem, truth, time, rate, linear=None):
    line = _model.timeline(record(time, rate), problem.drive, problem.sample_time)
    return _model.MachineModel(problem).response(line, values(truth, linear))


@pytest.mark.parametrize(
    ("problem", "truth", "delay"),
    [
        (PROBLEM, {"feed_lag": 0.0, "wheel_wear": 0.0}, 0.0),
        (PROBLEM, {}, 0.0),
        (PROBLEM.replace(feed_delay=0.08), {"wheel_wear": -0.03}, 0.08),
        (PROBLEM.replace(wear=WORN.wear), {"wear_flat_area": 0.026}, 0.0),
        (plunge.preset("experiment").replace(grinding_ratio=30.0), {}, 0.0),
    ],
    ids=["plain", "lags and wear", "dead time", "area grows", "linear"],
)
@pytest.mark.parametrize("even", [True, False], ids=["even", "uneven"])
def test_the_response_against_an_integrator(problem, truth, delay, even):
    """Size to 1e-7 mm. Power is linear over steps h of 0.02 s: where it bends by 1.2 kW/s, at contact, its
    mean errs by h/8 of that, and a monitor of 0.15 s by h/0.15 of the mean, 0.4 W; where it jumps, as with a
    linear lag, by h/2/0.15 of the jump.
    """
    truth = TRUTH | {"contact_zero": -0.02} | truth
    rate = commands(SHORT)
    time = STEP * np.arange(rate.size)
    if not even:
        time = time + 0.4 * STEP * np.sin(np.arange(rate.size))
        time -= time[0]
    linear = problem.model.linear_time_constant
    model = problem.model if linear else model_of(truth, problem)
    shown = response(problem, truth, time, rate, linear)
    if linear:
        model = problem.model.replace(
            wear_flat_area=truth["wear_flat_area"],
            power=problem.model.power.replace(
                specific_energy=truth["specific_energy"], ploughing_force=truth["ploughing_force"]
            ),
        )
    true = integrated(model, truth, time, rate, delay)
    np.testing.assert_allclose(shown[:, 0], true[:, 0], atol=1e-7, rtol=0)
    error = model.core.power0 * 0.01 / truth["power_lag"] if linear else 0.45
    np.testing.assert_allclose(shown[:, 1], true[:, 1], atol=error, rtol=0)


@pytest.mark.parametrize("delay", [0, 2])
def test_the_response_against_the_plant(delay):
    truth, rate = TRUTH | {"power_lag": 0.0}, commands(SHORT)
    time = STEP * np.arange(rate.size)
    shown = response(PROBLEM.replace(feed_delay=delay * STEP), truth, time, rate)
    np.testing.assert_allclose(shown, ground(truth, rate, delay=delay), rtol=1e-11, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.sampled_from([0.02, 0.04, 0.1]), min_size=3, max_size=30),
    st.integers(0, 5),
    st.integers(0, 2**32 - 1),
)
def test_a_timeline_is_the_command_later(steps, delay, seed):
    """All of the time, every row once, and the infeed of the command before the dead time."""
    time = np.concatenate([[0.0], np.cumsum(steps)])
    rate = np.random.default_rng(seed).uniform(0, MOST, time.size)
    cycle, late = record(time, rate), delay * STEP
    line = _model.timeline(cycle, plunge.Drive(feed_delay=late), STEP)
    assert line.duration.sum() == pytest.approx(time[-1]) and line.shown.sum() == time.size - 1
    assert np.all(line.duration > 0) and np.all(line.duration / line.steps < 0.0201)
    fed = np.concatenate([[0.0], np.cumsum(line.duration * line.command)])
    rows = np.concatenate([[0], 1 + np.flatnonzero(line.shown)])
    np.testing.assert_allclose(fed[rows], np.interp(time - late, time, cycle.infeed), atol=1e-12)


def test_a_drive_in_steps_feeds_whole_ones():
    rate = np.full(100, 0.0123)
    line = _model.timeline(record(STEP * np.arange(100), rate), plunge.Drive(command_quantum=1e-3), STEP)
    fed = np.cumsum(line.duration * line.command)
    assert np.allclose(fed / 1e-3, np.rint(fed / 1e-3)) and abs(fed[-1] - 99 * STEP * 0.0123) <= 0.5e-3


def begun(seed=0, parts=2):
    rate = commands()
    each = []
    for part in range(parts):
        clean = ground(TRUTH | {"contact_zero": -0.05 - 0.01 * part}, rate)
        rng = np.random.default_rng([seed, part])
        size = clean[:, 0] + 5e-4 * rng.standard_normal(rate.size)
        power = clean[:, 1] * (1 + 0.01 * rng.standard_normal(rate.size))
        each.append(record(STEP * np.arange(rate.size), rate, size, power))
    return _start.started(each, PROBLEM, None)


def test_slopes_against_central_differences():
    fit = begun()
    fit.noise = fit.noise._replace(correlation=(0.4, 0.2))
    at, scales = fit.vector(), fit.scales()
    shown = fit.slopes(at) * scales
    for k in range(at.size):
        step = np.zeros(at.size)
        step[k] = 1e-4 * scales[k]
        wanted = (fit.residual(at + step) - fit.residual(at - step)) / 2e-4
        assert np.linalg.norm(shown[:, k] - wanted) < 1e-3 * np.linalg.norm(wanted) + 1e-6


def test_the_fit_against_another_search():
    """The squares are least: Nelder and Mead find no lower ones from there, nor does a step along an axis."""
    fit = begun(parts=1)
    fit.solve(1e-9)
    at, scales = fit.vector(), fit.scales()
    least = float(np.sum(fit.residual(at) ** 2))

    def square(moved):
        return float(np.sum(fit.residual(at + 1e-3 * scales * moved) ** 2))

    found = optimize.minimize(square, np.zeros(at.size), method="Nelder-Mead", options={"maxfev": 400})
    assert found.fun > least * (1 - 1e-6)
    assert all(square(sign * axis) > least for axis in np.eye(at.size) for sign in (-1, 1))


def test_a_value_that_nothing_shows_is_left():
    """Without power no fit tells ploughing from what else deflects."""
    fit = begun(parts=1)
    fit.parts = [
        _fit.dataclasses.replace(each, usable=each.usable & (np.arange(each.usable.size) < 5))
        for each in fit.parts
    ]
    believed = fit.model.believed(PROBLEM.drive)
    left = _fit.fitted(fit, believed)
    assert {_model.PLOUGHING, _model.POWER_LAG} <= set(left)
    assert all(np.all(fit.values[:, place] == believed[place]) for place in left)
