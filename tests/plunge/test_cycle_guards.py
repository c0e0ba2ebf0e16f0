"""What a controller of cycles refuses, warns of, or ends a part for."""

import subprocess
import sys

import numpy as np
import pytest
from cycle_parts import PROBLEM
from test_cycle_gauges import grind, replaced

import hwsim
from sdpgrind import plunge


def test_a_dead_time_that_the_filter_cannot_hold():
    """128 samples are; a longer one wrote beyond the queue."""
    fine = PROBLEM.replace(sample_time=0.005)
    held = plunge.CycleController(fine.replace(feed_delay=0.64))
    out = hwsim.run(hwsim.PlungeGrinder(held.problem), held, rng=1).outcome
    assert float(out.burned[0]) == 0 and abs(float(out.remaining[0])) < 1e-3
    with pytest.raises(ValueError, match=r"feed_delay must be <= 128 samples, 0.64 s; got 1"):
        plunge.CycleController(fine.replace(feed_delay=1.0))
    assert (
        plunge.CycleController(fine.replace(feed_delay=1.0), sparkout="printed").problem.sample_time == 0.005
    )


@pytest.mark.parametrize("shown", [0.0, -50.0])
def test_a_power_monitor_that_is_off_ends_the_part(shown):
    """Sizes grow and no power shows it: some samples of feed, not the stock and more."""
    controller = plunge.CycleController(PROBLEM)
    out = grind(controller, replaced("grinding_power", 0, 10_000, shown), noise=hwsim.GrinderNoise())
    assert controller.lost and 0.25 < out["remaining"] < PROBLEM.stock


@pytest.mark.parametrize("power_sd", [0.1, 0.25, 0.5])
def test_a_rough_power_monitor_shows_the_contact_too(power_sd):
    rough = PROBLEM.replace(power_sd=power_sd)
    plant = hwsim.PlungeGrinder(rough, noise=hwsim.GrinderNoise(power_sd=power_sd), contact_zero_sd=0.01)
    out = hwsim.run(plant, plunge.CycleController(rough), parts=10, rng=2).outcome
    assert not out.burned.any() and float(abs(out.remaining).max()) < 2e-3


def test_doubts_of_half_the_machine():
    """Deflection 0.4 and 2.2 times as believed, area 0.6 and 1.4: the power is linear in what is learned."""
    wide = PROBLEM.replace(sharpness_sd=0.3, deflection_sd=0.3)
    model = PROBLEM.model
    for area, ratio in ((0.6, 0.4), (1.4, 0.4), (1.4, 0.6), (1.4, 2.2)):
        truth = model.replace(
            wear_flat_area=area * model.wear_flat_area, normal_force_ratio=ratio * model.normal_force_ratio
        )
        plant = hwsim.PlungeGrinder(wide, truth=truth, contact_zero_sd=0.01)
        out = hwsim.run(plant, plunge.CycleController(wide), parts=6, rng=3).outcome
        assert not out.burned.any() and float(abs(out.remaining).max()) < 5e-4


@pytest.mark.parametrize("confidence", [0.49, 1.0, 99.9, float("nan")])
@pytest.mark.parametrize(
    "take",
    [
        lambda each: PROBLEM.safe_rate(0.0, each),
        lambda each: plunge.plan(PROBLEM, confidence=each),
        lambda each: plunge.CycleController(PROBLEM, confidence=each),
        lambda each: plunge.BurnThreshold(PROBLEM.replace(burning_sd=0.03), confidence=each),
        plunge.learning.ChanceMargin,
        plunge.learning.RoundnessMargin,
    ],
)
def test_a_confidence_is_the_same_range_everywhere(take, confidence):
    with pytest.raises(ValueError, match=r"confidence must be .*; got"):
        take(confidence)


@pytest.mark.parametrize("sd", [None, 0.03])
def test_log_and_page_say_what_is_known_of_the_threshold(sd):
    problem = PROBLEM.replace(burning_sd=sd)
    known = "taken as exactly known" if sd is None else "doubted by 3 %"
    grinder = hwsim.PlungeGrinder(problem)
    for controller in (plunge.StagedController(problem), plunge.CycleController(problem)):
        assert hwsim.run(grinder, controller, rng=1).outcome.attrs["burn_threshold"] == known
    assert "a confidence of 0.999" in plunge.plan(problem, confidence=0.999).report()
    assert "all values are taken as exact" in plunge.plan(problem).report()


def test_the_threshold_keeps_the_confidence_of_the_controller():
    problem = PROBLEM.replace(burning_sd=0.03)
    grinder = hwsim.PlungeGrinder(problem, inspection=hwsim.Inspection(severity_sd=0.03))
    learner = plunge.learning.ThresholdUpdate(problem)
    careful = plunge.CycleController(problem, confidence=0.9999)
    following = learner.next(careful, hwsim.run(grinder, careful, rng=3))
    assert following.confidence == learner.threshold.confidence == 0.9999


@pytest.mark.parametrize(("reserve", "burned"), [(1.1, True), (5.0, True), (-2.0, False)])
def test_a_finding_far_from_what_was_believed_leaves_a_density(reserve, burned):
    threshold = plunge.BurnThreshold(PROBLEM.replace(burning_sd=0.03))
    threshold.update(reserve=reserve, burned=burned)
    assert threshold.density.sum() == pytest.approx(1.0) and np.isfinite(threshold.margin)
    assert not threshold.estimate.ok and "find the cause" in threshold.estimate.message


@pytest.mark.parametrize(
    ("reading", "message"),
    [
        ({"burned": "no"}, "burned must be True or False, as etching finds it; got 'no'"),
        ({"burned": 0.5}, "burned must be True or False"),
        ({"severity": 95.0}, r"severity must be in \[0.1, 10\].*0.95 for 95 %; got 95"),
        (
            {"severity": 0.95, "severity_sd": 3.0},
            r"severity_sd must be in \[0, 0.5\], relative; 0.03 for 3 %; got 3",
        ),
    ],
)
def test_findings_that_are_none(reading, message):
    threshold = plunge.BurnThreshold(PROBLEM.replace(burning_sd=0.03))
    with pytest.raises(ValueError, match=message):
        threshold.update(reserve=0.1, **reading)


def test_an_error_of_the_severity_that_is_not_stated_warns_once():
    told, silent = (plunge.BurnThreshold(PROBLEM.replace(burning_sd=0.03)) for _ in range(2))
    with pytest.warns(UserWarning, match=r"severity_sd is not stated: 0.03 is assumed"):
        silent.update(reserve=0.1, severity=0.95)
    silent.update(reserve=0.1, severity=0.95)
    for _ in range(2):
        told.update(reserve=0.1, severity=0.95, severity_sd=0.03)
    np.testing.assert_array_equal(silent.density, told.density)


def test_a_wide_prior_fits_on_the_grid():
    """A margin of 3.09 standard deviations, and the scatter."""
    threshold = plunge.BurnThreshold(PROBLEM.replace(burning_sd=0.3))
    assert threshold.margin == pytest.approx(3.0902 * np.hypot(0.3, 0.005), rel=1e-3)
    assert threshold.next_test.__self__ is threshold and "margin 0.927" in repr(threshold)


def test_the_sub_package_is_there_at_once_and_solvers_when_they_are_needed():
    code = "import sys; from sdpgrind import plunge; print(plunge.learning.ChanceMargin.__name__);"
    code += " plunge.plan(plunge.preset('simulation')); print('casadi' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["ChanceMargin", "False"]
