"""Power without contact: taken off each reading, and its error covered by the doubt of the gain."""

import pytest
from plunge_inside import measured_slack

import hwsim
from sdpgrind import plunge

PROBLEM = plunge.preset("simulation").replace(idle_power=300.0)
DULL = PROBLEM.model.replace(wear_flat_area=0.029)


def ground(believed, noise, **doubts):
    """Log of a part on a machine that idles at 300 W, by a controller that believes another idle power."""
    problem = PROBLEM.replace(idle_power=believed, wear_flat_area=0.0261, **doubts)
    plant = hwsim.PlungeGrinder(problem, truth=DULL, drive=PROBLEM.drive, noise=noise)
    return hwsim.run(plant, plunge.CycleController(problem), parts=1, rng=0), problem


def test_the_wear_flat_area_is_that_of_the_power_at_the_contact():
    """Counted as power of the contact, 300 W would be an area of 0.049."""
    log, problem = ground(300.0, hwsim.GrinderNoise())
    found = plunge.identify(log, "wear_flat_area", problem=problem)
    assert found["wear_flat_area"] == pytest.approx(0.029, abs=4 * found.sd[0]) and found.sd[0] < 0.001


def test_the_slack_is_that_of_the_power_at_the_contact():
    log, problem = ground(300.0, None)
    slack = measured_slack(log, plunge.CycleController(problem))
    assert slack == pytest.approx(float(log.outcome.slack[0]), abs=1e-6)


def test_an_idle_power_that_is_believed_too_high():
    """5 % too high, most parts burn; a doubt of the gain of 15 W over the 500 W at the end covers it."""
    burned = {}
    for gain in (0.0, 0.03):
        problem = PROBLEM.replace(idle_power=315.0, power_gain_sd=gain)
        plant = hwsim.PlungeGrinder(problem, drive=PROBLEM.drive)
        out = hwsim.run(plant, plunge.CycleController(problem), parts=24, rng=1).outcome
        burned[gain] = int(out.burned.values.sum())
    assert burned[0.0] > 12 and burned[0.03] == 0
