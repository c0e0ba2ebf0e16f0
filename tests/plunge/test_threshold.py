"""Burn threshold learned from inspected parts: a published table, calibration of the prediction, reserves."""

import numpy as np
import pytest
from plunge_inside import replayed

import hwsim
from sdpgrind import plunge
from sdpgrind.identify import Status

PROBLEM = plunge.preset("simulation").replace(burning_sd=0.045)
SEVERE = tuple(
    {"reserve": reserve, "severity": severity, "severity_sd": 0.03}
    for reserve, severity in ((0.14, 0.88), (0.10, 0.93))
)
# of the project's derivation: readings; mean, sd and margin of eta
ROWS = [
    ((), (0.0, 0.0450, 0.1399)),
    (({"reserve": 0.10, "burned": False},), (-0.00158, 0.0432, 0.1035)),
    (({"reserve": 0.02, "burned": False}, {"reserve": -0.01, "burned": True}), (0.00476, 0.00984, 0.0355)),
    (({"reserve": 0.02, "burned": True, "miss": 0.02, "false_alarm": 0.05},), (0.04224, 0.03279, 0.1530)),
    (SEVERE[:1], (0.00835, 0.0252, 0.0877)),
    ((*SEVERE, {"reserve": 0.06, "burned": False}), (0.01543, 0.01864, 0.0659)),
]


@pytest.mark.parametrize(("readings", "found"), ROWS)
def test_table(readings, found):
    threshold = plunge.BurnThreshold(PROBLEM)
    for reading in readings:
        threshold.update(**reading)
    assert (threshold.mean, threshold.sd, threshold.margin) == pytest.approx(found, abs=2e-4)


def test_the_order_of_readings_is_of_no_account():
    one, other = plunge.BurnThreshold(PROBLEM), plunge.BurnThreshold(PROBLEM)
    for reading in SEVERE:
        one.update(**reading)
    for reading in reversed(SEVERE):
        other.update(**reading)
    np.testing.assert_allclose(one.density, other.density, atol=1e-15)


def test_the_estimate_has_the_predicted_chance():
    """A normal doubt with the estimate's sd burns a part of that margin with the chance allowed."""
    threshold = plunge.BurnThreshold(PROBLEM)
    for reading in SEVERE:
        threshold.update(**reading)
    updated = PROBLEM.updated(threshold.estimate)
    assert (
        pytest.approx(PROBLEM.model.burning.B * np.exp(-threshold.mean), rel=1e-12) == updated.model.burning.B
    )
    assert updated.uncertainty.burning_sd * 3.0902 == pytest.approx(
        threshold.margin - threshold.mean, rel=1e-4
    )
    gained = plunge.plan(PROBLEM, confidence=0.999).time - plunge.plan(updated, confidence=0.999).time
    assert gained > 0.3


def test_good_parts_at_the_margin_burn_as_predicted():
    """Given the past each part burns with 1 - confidence: 20 +- 4.5 of 2000 at 0.99, 5 sd allowed."""
    rng, burned = np.random.default_rng(3), 0
    for _ in range(40):
        threshold, eta = plunge.BurnThreshold(PROBLEM, confidence=0.99), 0.045 * rng.standard_normal()
        for _ in range(50):
            margin = threshold.margin
            bad = bool(eta + 0.005 * rng.standard_normal() > margin)
            burned += bad
            threshold.update(reserve=margin, burned=bad)
    assert 1 <= burned <= 43


def test_good_parts_teach_little_and_a_test_much():
    """Ten good parts leave a margin of 0.107; four at the median an sd of 0.74 percent of a prior of 5."""
    etched, rng, sds = plunge.BurnThreshold(PROBLEM), np.random.default_rng(1), []
    for _ in range(10):
        etched.update(reserve=etched.margin, burned=False)
    for _ in range(60):
        tested, eta = plunge.BurnThreshold(PROBLEM.replace(burning_sd=0.05)), 0.05 * rng.standard_normal()
        for _ in range(4):
            median = float(np.interp(0.5, np.cumsum(tested.density), tested.eta))
            tested.update(reserve=median, burned=bool(eta + 0.005 * rng.standard_normal() > median))
        sds.append(tested.sd)
    assert etched.margin == pytest.approx(0.107, abs=2e-3)
    assert np.mean(sds) == pytest.approx(0.0074, rel=0.2)
    found = plunge.BurnThreshold(PROBLEM).next_test()
    assert found.reserve == pytest.approx(0.0, abs=1e-3) and found.saving > 0.1 and 10 < found.parts < 100
    assert found.controller.confidence == 0.5


@pytest.mark.parametrize("confidence", [0.5, 0.55, 0.65, 0.999])
def test_the_doubt_at_an_even_chance(confidence):
    """A normal prediction has the same sd at each confidence; at 0.5 a margin of none does not tell it."""
    threshold = plunge.BurnThreshold(PROBLEM, confidence=confidence)
    assert threshold.estimate["burning_sd"] == pytest.approx(np.hypot(0.045, 0.005), rel=1e-4)
    threshold.update(reserve=0.14, severity=0.88, severity_sd=0.03)
    assert threshold.estimate["burning_sd"] == pytest.approx(np.hypot(threshold.sd, 0.005), rel=1e-4)


def test_a_series_at_an_even_chance():
    """As a sacrificial part is ground: half of them burn, and the doubt falls to that of the readings."""
    learner = plunge.learning.ThresholdUpdate(PROBLEM)
    grinder = hwsim.PlungeGrinder(PROBLEM, inspection=hwsim.Inspection(severity_sd=0.03))
    even = plunge.CycleController(PROBLEM, confidence=0.5)
    for part in range(4):
        even = learner.next(even, hwsim.run(grinder, even, rng=part))
    assert even.confidence == 0.5
    assert even.problem.uncertainty.burning_sd == pytest.approx(
        0.01524, rel=0.02
    )  # of 0.0304 four times, 0.045


def test_a_surprise_is_told():
    threshold = plunge.BurnThreshold(PROBLEM)
    threshold.update(reserve=0.3, burned=True)
    assert threshold.estimate.status is Status.IMPOSSIBLE
    assert threshold.estimate.message == "burned: find the cause"
    with pytest.raises(ValueError, match="estimate must have succeeded; got 'burned: find the cause'"):
        PROBLEM.updated(threshold.estimate)


def test_reserves_of_a_log():
    """By the readings alone, within 0.004 of the truth: less than the scatter of the threshold."""
    truth = PROBLEM.replace(wear_flat_area=PROBLEM.model.wear_flat_area / 0.9).model
    controller = plunge.CycleController(PROBLEM, confidence=0.999)
    log = hwsim.run(hwsim.PlungeGrinder(PROBLEM, truth=truth), controller, parts=8, rng=2)
    off = [replayed(log, PROBLEM, k).reserve - float(log.outcome.reserve[k]) for k in range(8)]
    assert np.max(np.abs(off)) < 0.004
    threshold = plunge.BurnThreshold(PROBLEM)
    threshold.update(log, part=3, severity=0.93, severity_sd=0.03)
    twin = plunge.BurnThreshold(PROBLEM)
    twin.update(reserve=replayed(log, PROBLEM, 3).reserve, severity=0.93, severity_sd=0.03)
    np.testing.assert_array_equal(threshold.density, twin.density)


def test_refusals():
    threshold = plunge.BurnThreshold(PROBLEM)
    with pytest.raises(ValueError, match=r"burning_sd must be > 0, such as 0\.045"):
        plunge.BurnThreshold(plunge.preset("simulation"))
    with pytest.raises(ValueError, match=r"burned or severity must be given, and not both"):
        threshold.update(reserve=0.1)
    with pytest.raises(ValueError, match="log or reserve must be given, and not both"):
        threshold.update(burned=True)
    with pytest.raises(ValueError, match=r"miss must be < 1 - false_alarm = 0\.5"):
        threshold.update(reserve=0.1, burned=True, miss=0.6, false_alarm=0.5)
    with pytest.raises(ValueError, match="severity must be > 0"):
        threshold.update(reserve=0.1, severity=0.0)
    with pytest.raises(ValueError, match="reserve must be finite; got inf"):
        threshold.update(reserve=np.inf, burned=True)
