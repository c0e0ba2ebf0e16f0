"""Controllers of the locus on the adaptive grinder: Koren's cycles, what the loop was designed for, what the
lags cost.
"""

import warnings

import numpy as np
import pytest
from adaptive_fakes import PROBLEM, Learned, Printed

import hwsim
from hwsim.devices import Gauge
from sdpgrind import locus

CURVE = locus.plan(PROBLEM)
GRINDER = hwsim.AdaptiveGrinder(PROBLEM)
KOREN = {"gain": 3.3e-6, "kp": 5.3e-6, "at": "command", "hold": 3.0, "start": 1e-3, "floor": 8e-4}
LAGS = {"lag": 1.25, "sensor_lag": 0.2, "period": 0.5}


def walking(curve=CURVE, **options):
    return locus.LocusController(curve, along="infeed_rate", **options)


def ground(parts=5, grinder=GRINDER, **options):
    return hwsim.run(grinder, walking(**options), parts=parts, adapt=locus.LearnedStart()).outcome


def test_koren_s_controller_on_the_traced_locus_is_the_one_of_the_closed_form():
    ours, theirs = ground(**KOREN), hwsim.run(GRINDER, Printed(), parts=5, adapt=Learned()).outcome
    np.testing.assert_array_equal(ours.convergence_time, [27.5, 4.0, 3.5, 3.5, 3.5])
    np.testing.assert_array_equal(ours.time, theirs.time)
    np.testing.assert_allclose(ours.slack, theirs.slack, atol=1e-3)
    np.testing.assert_allclose(ours.true_infeed_rate, theirs.true_infeed_rate, rtol=1e-6)


def test_what_the_hold_is_worth():
    """Later cycles: the worst slack without and with the hold.

    The limit at the actual infeed alone does not undo the windup of (36), as commands still add up; a law
    that goes on from the actual infeed does."""
    changes = {"hold": "none"}, {}, {"at": "actual", "hold": "none"}
    naive, held, actual = (ground(**{**KOREN, **change}).slack.values[1:] for change in changes)
    assert naive.max() < -30
    assert held.min() > -6.5 and held.max() < -2
    assert naive.min() < actual.min() < held.min() - 10
    assert ground(hold="none").slack.values.min() > -6


def test_the_designed_gain_is_faster_and_nearer_to_the_limit():
    ours, koren = ground(), ground(**KOREN)
    assert ours.convergence_time.values[0] < 0.6 * koren.convergence_time.values[0]
    np.testing.assert_array_equal(ours.convergence_time.values[1:], 4.0)
    assert ours.slack.values.min() > -1.0


def test_the_margin_of_the_drift_is_what_dulling_takes():
    """The loop is behind a wheel that dulls from sample to sample; here the lags add to that."""
    rate = GRINDER.dulling * 0.0151 * 0.5
    design = walking().design
    margin = design.drift_margin(rate, gain=design.schedule())
    assert 0.3 < margin < 1.0
    assert ground(parts=3, margin=2 * margin).burned.values.sum() == 0
    assert ground(parts=3, margin=0.3 * margin).burned.values.all()


def test_a_known_lag_is_as_good_as_a_measured_one():
    class Blind:
        """The same controller without the reading of the slide."""

        def __init__(self, inside):
            self.inside, self.period = inside, inside.period

        def reset(self):
            self.inside.reset()

        def step(self, *, grinding_power, **others):
            return self.inside.step(grinding_power=grinding_power)

    known = hwsim.run(GRINDER, Blind(walking(lag=1.25))).outcome
    measured = hwsim.run(GRINDER, walking()).outcome
    np.testing.assert_allclose(known.true_infeed_rate, measured.true_infeed_rate, rtol=1e-9)


def test_idle_power_that_is_taken_off_wrongly_costs_time():
    times = [
        hwsim.run(GRINDER.replace(idle_error=error), walking(start=0.014)).outcome.time.values
        for error in (0.0, 100.0)
    ]
    assert times[1] > 1.1 * times[0]


def test_inversion_is_there_at_once():
    outcome = ground(method="inversion", start=1e-3)
    assert outcome.convergence_time.values[0] < 10
    assert abs(outcome.slack.values[1:]).max() < 2.0


def growth(width, area):
    """By what a small error grows from sample to sample: by the poles, and on the machine."""
    problem = PROBLEM.replace(width=width)
    curve = locus.plan(problem)
    best = curve.at(wear_flat_area=area).controls["infeed_rate"]
    near = (area * 0.9999, area * 1.0001)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that these gains may step beyond the limit
        controller = walking(
            curve, **{**KOREN, "hold": 12.0, "start": best * (1 - 1e-5), "floor": None}, x=near
        )
    poles = controller.design.radius(KOREN["gain"], kp=KOREN["kp"], **LAGS, x=area)
    grinder = hwsim.AdaptiveGrinder(problem, wear_flat_area=area, dulling=0.0, stock=100.0, max_time=80.0)
    rates = hwsim.run(grinder, controller).column("controller", "infeed_rate_command")
    error = np.abs(rates[np.isfinite(rates)] - best)[50:150]
    largest = np.log(error.reshape(10, 10).max(axis=1))
    return poles, float(np.exp(np.polyfit(10 * np.arange(10), largest, 1)[0]))


@pytest.mark.parametrize(
    ("width", "area"), [(9.3, 0.006), (40.0, 0.006), (43.0, 0.006), (45.0, 0.006), (28.0, 0.00833)]
)
def test_a_small_error_grows_as_the_poles_say(width, area):
    poles, grown = growth(width, area)
    assert grown == pytest.approx(poles, abs=2e-3)


@pytest.mark.parametrize(("rate", "width"), [(0.0151, 43.0), (0.005, 26.0), (0.0015, 11.0)])
def test_widths_beyond_which_the_printed_gains_are_unstable(rate, width):
    area = float(walking().stretch.at(rate).hidden)
    for share, stable in ((0.95, True), (1.05, False)):
        design = locus.gains.design_gain(
            locus.plan(PROBLEM.replace(width=share * width)), along="infeed_rate"
        )
        assert (design.radius(KOREN["gain"], kp=KOREN["kp"], **LAGS, x=area) < 1) == stable


def test_a_run_in_three_lines():
    grinding = locus.preset("grinding")
    curve = locus.plan(grinding)
    log = hwsim.run(
        hwsim.AdaptiveGrinder(grinding), locus.LocusController(curve, along="infeed_rate"), parts=5, rng=0
    )
    assert log.outcome.sizes["part"] == 5 and list(log["controller"].data_vars)[:3] == [
        "grinding_power",
        "infeed_rate",
        "removed",
    ]
    units = {
        name: log["controller"][name].units
        for name in ("coordinate_planned", "wear_flat_area_planned", "slack_planned")
    }
    assert units == {"coordinate_planned": "mm/s", "wear_flat_area_planned": "1", "slack_planned": "W"}


def test_the_wear_that_the_controller_believes_is_true():
    log = hwsim.run(GRINDER, walking(), parts=3, adapt=locus.LearnedStart())
    table = log["controller"]
    for part, truth in enumerate(log.outcome.true_wear_flat_area.values):
        believed = table.wear_flat_area_planned.values[table.part.values == part][-2]
        assert believed == pytest.approx(truth, rel=2e-3)


def test_feedback_keeps_the_power_at_the_limit_of_the_model():
    """A wider work needs more power and stands more: what is left is the margin, and the limit that the model
    does not know.
    """
    truth = PROBLEM.model.replace(width=9.4)
    outcome = hwsim.run(
        GRINDER.replace(truth=truth), walking(margin=5.0), parts=3, adapt=locus.LearnedStart()
    ).outcome
    limit = np.nanmin(outcome.burning_power.values[1:, 20:], axis=1)
    np.testing.assert_allclose(outcome.slack.values[1:], 5.0 + 0.1 / 9.4 * limit, atol=1.2)


def test_noise_needs_a_margin():
    noisy = GRINDER.replace(power_gauge=Gauge(noise_sd=5.0))
    burned = [
        hwsim.run(noisy, walking(margin=m), parts=6, rng=1, adapt=locus.LearnedStart())
        .outcome.burned.values[1:]
        .mean()
        for m in (0.0, 15.0)
    ]
    assert burned == [1.0, 0.0]


def test_a_curve_itself_is_no_controller():
    with pytest.raises(ValueError, match=r"locus.LocusController\(curve, along=...\) follows it"):
        hwsim.run(GRINDER, CURVE)
