"""Feed lag, dead time, wheel wear, lag of the power monitor: the plant against tables and other integrators."""

import math
import warnings

import numpy as np
import pytest
from plunge_inside import DeflectionLaw, rate
from scipy.integrate import solve_ivp

import hwsim
from sdpgrind import plunge
from sdpgrind.plunge import kernels

PROBLEM = plunge.preset("simulation")
# of the project's derivation: effects; size (mm), wheel loss (mm) and power (W) after 2, 8 and 14 s
ROWS = [
    ({}, [(0.027624, 0.0, 1875.77), (0.238341, 0.0, 1406.13), (0.279472, 0.0, 403.38)]),
    ({"feed_lag": 0.1}, [(0.024888, 0.0, 1822.97), (0.236382, 0.0, 1441.19), (0.279353, 0.0, 406.99)]),
    ({"feed_delay": 0.08}, [(0.025425, 0.0, 1833.85), (0.236809, 0.0, 1433.11), (0.279380, 0.0, 406.17)]),
    (
        {"ratio": 20.0},
        [(0.027090, 0.001896, 1834.51), (0.225841, 0.015809, 1305.98), (0.261703, 0.018319, 386.75)],
    ),
    (
        {"ratio": 100.0, "feed_lag": 0.05, "power_lag": 0.2, "contact": 0.01},
        [(0.020325, 0.000285, 1583.09), (0.225046, 0.003151, 1473.78), (0.265821, 0.003721, 408.69)],
    ),
]


def command(time):
    return 0.0448 if time < 6.0 - 1e-9 else 0.008 if time < 9.0 - 1e-9 else 0.0


def played(ratio=math.inf, contact=0.0, feed_delay=0.0, power_lag=0.0, feed_lag=0.0):
    """Size, wheel loss and power at 2, 8 and 14 s of the compiled part."""
    model = PROBLEM.model.replace(grinding_ratio=ratio)
    drive = plunge.Drive(feed_lag=feed_lag, feed_delay=feed_delay, power_lag=power_lag)
    rig = kernels.driven(kernels.rig(model, 10.0, 0.04), drive)._replace(contact_zero=contact)
    state, rows = kernels.part_state(rig), []
    kernels.start_part(state, rig)
    for k in range(351):
        size, power, _ = kernels.read(state, rig, 0.0, 0.0)
        rows.append((size, rig.wheel_wear * size, power))
        kernels.advance(state, rig, command(k * 0.04))
    return np.array(rows)[[50, 200, 350]]


@pytest.mark.parametrize(("effects", "rows"), ROWS)
def test_table(effects, rows):
    assert np.all(np.abs(played(**effects) - rows) <= (1e-5, 1e-5, 0.1))


@pytest.mark.parametrize("lag", [0.0, 0.003, 0.3])
def test_against_another_integrator(lag):
    """LSODA on the equations of axis, wheel and work; a lag may be shorter than a sample."""
    core, growth = PROBLEM.model.core, 1 + PROBLEM.model.replace(grinding_ratio=30.0).wheel_wear
    law, state = DeflectionLaw(core.K1, core.K2, core.p), np.zeros(3)
    for begin, end in ((0.0, 6.0), (6.0, 9.0), (9.0, 14.0)):
        speed = command(0.5 * (begin + end))

        def slopes(time, state, speed=speed):
            target, position, removed = state
            at = position if lag else target
            v = rate(at - growth * removed - core.K0 - 0.01, law)
            return speed, (target - position) / lag if lag else speed, v

        found = solve_ivp(slopes, (begin, end), state, method="LSODA", rtol=1e-10, atol=1e-13, max_step=0.02)
        state = found.y[:, -1]
    size = played(ratio=30.0, contact=0.01, feed_lag=lag)[2, 0]
    assert size == pytest.approx(state[-1], abs=2e-8)


def test_the_grinder_takes_the_problems_drive_or_its_own():
    drive = plunge.Drive(feed_lag=0.1, feed_delay=0.08, power_lag=0.1, idle_power=300.0)
    slow = PROBLEM.replace(drive=drive)
    steps = [{"command_rate": 0.0448}] * 60

    def last(grinder):
        part = grinder.start(np.random.default_rng(0))
        return [part.step(each, 1) for each in steps][-1]

    one, same, fast = (
        last(grinder)
        for grinder in (
            hwsim.PlungeGrinder(slow, noise=None),
            hwsim.PlungeGrinder(PROBLEM, noise=None, drive=drive),
            hwsim.PlungeGrinder(slow, noise=None, drive=plunge.Drive()),
        )
    )
    assert one == same and one["size"] < fast["size"]
    assert last(hwsim.PlungeGrinder(PROBLEM, noise=None, power_lag=0.1)) == last(
        hwsim.PlungeGrinder(PROBLEM, noise=None, drive=plunge.Drive(power_lag=0.1))
    )
    air = hwsim.PlungeGrinder(slow, noise=None).start(np.random.default_rng(0)).step({}, 1)
    assert air["grinding_power"] == 300.0


def test_reserve_is_that_of_the_threshold():
    """A part burns exactly where the threshold is lowered by more than its reserve."""
    log = hwsim.run(
        hwsim.PlungeGrinder(PROBLEM, noise=None), plunge.CycleController(PROBLEM, safety_margin=0.005)
    )
    reserve = float(log.outcome.reserve[0])
    assert 0.0 < reserve < 0.1 and float(log.outcome.severity[0]) == math.exp(-reserve)
    commands = log["controller"].command_rate_command.values

    def burned(share):
        model = PROBLEM.model.replace(
            burning=PROBLEM.model.burning.replace(B=PROBLEM.model.burning.B * share)
        )
        part = hwsim.PlungeGrinder(PROBLEM, truth=model, noise=None).start(np.random.default_rng(0))
        for fed in commands[:-1]:
            part.step({"command_rate": fed}, 1)
        part.step({"retract": 1.0}, 0)
        return part.outcome()["burned"]

    assert burned(math.exp(-reserve * 0.98)) == 0.0 and burned(math.exp(-reserve * 1.02)) == 1.0


def test_inspection():
    fair = hwsim.Inspection(miss=0.2, false_alarm=0.1, severity_sd=0.03)
    rng = np.random.default_rng(1)
    bad, good = ([fair.read(reserve, rng) for _ in range(4000)] for reserve in (-0.02, 0.1))
    assert np.mean([each["burned_reading"] for each in bad]) == pytest.approx(0.8, abs=0.03)
    assert np.mean([each["burned_reading"] for each in good]) == pytest.approx(0.1, abs=0.03)
    severity = np.log([each["severity_reading"] for each in good])
    assert severity.mean() == pytest.approx(-0.1, abs=0.003) and severity.std() == pytest.approx(
        0.03, rel=0.06
    )
    log = hwsim.run(
        hwsim.PlungeGrinder(PROBLEM, inspection=hwsim.Inspection()), plunge.CycleController(PROBLEM), parts=2
    )
    np.testing.assert_allclose(log.outcome.severity_reading, log.outcome.severity)
    with pytest.raises(ValueError, match=r"miss must be < 1 - false_alarm = 0.5"):
        hwsim.Inspection(miss=0.5, false_alarm=0.5)


def test_inspection_changes_no_part():
    plain, seen = (
        hwsim.run(
            hwsim.PlungeGrinder(PROBLEM, inspection=each), plunge.CycleController(PROBLEM), parts=3, rng=4
        )
        for each in (None, hwsim.Inspection(severity_sd=0.03))
    )
    np.testing.assert_array_equal(plain.outcome.time, seen.outcome.time)
    np.testing.assert_array_equal(plain.outcome.reserve, seen.outcome.reserve)


def test_refusals_of_the_drive():
    with pytest.raises(
        ValueError, match=r"feed_delay must be in s, some 0.05; multiply by 0.001 for ms; got 40"
    ):
        plunge.Drive(feed_delay=40.0)
    with pytest.raises(ValueError, match=r"feed_lag must be <= time_constant/4 = 0.4834 \(s\)"):
        PROBLEM.replace(feed_lag=0.6)
    with pytest.warns(UserWarning, match=r"feed_delay = 0.05 s counts as 2 samples, 0.08 s"):
        PROBLEM.replace(feed_delay=0.05)
    with pytest.warns(UserWarning, match=r"grinding_ratio = 0.5: the wheel loses more than the work"):
        PROBLEM.replace(grinding_ratio=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PROBLEM.replace(feed_delay=0.12)
