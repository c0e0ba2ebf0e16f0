"""Intervals of RONt: what norms promise, coverage of drawn forms, decisions, refusals."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from circle_inside import DrawnNoise, Filter, _without_ripple, lifts, seen, zone_widths
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_rings import turn
from scipy.stats import norm

import sdpgrind
from centering import Profile
from centering.roundness import Instrument, reference_circle

_SPEC = importlib.util.spec_from_file_location(
    "coverage_roundness", Path(__file__).parents[2] / "benchmarks" / "coverage_roundness.py"
)
coverage = importlib.util.module_from_spec(_SPEC)
sys.modules["coverage_roundness"] = coverage
_SPEC.loader.exec_module(coverage)

ANGLE = turn(1, 720)


def lobed(noise=3e-4, seed=0, height=1e-3):
    drawn = noise * np.random.default_rng(seed).normal(size=ANGLE.size)
    return Profile(ANGLE, 30.0 + height * np.cos(3 * ANGLE) + drawn)


@pytest.fixture(scope="module")
def found():
    return {kind: lobed().filter(upr=50).roundness(kind) for kind in ("LSC", "MZC", "MCC")}


def waves(rng, size, most):
    coef = np.zeros(size // 2 + 1, dtype=complex)
    coef[2:most] = rng.normal(size=(most - 2, 2)) @ [1, 1j]
    return np.fft.irfft(coef, size)


@pytest.mark.parametrize("kind", ["LSC", "MZC"])
def test_noise_above_what_was_measured_leaves_the_guaranteed_interval(kind):
    """Turns 40 um apart: their difference is taken for noise, and draws of it lift above the measured form."""
    angle = np.concatenate([ANGLE, ANGLE + 2 * np.pi])
    shift = np.repeat([0.02, -0.02], ANGLE.size) * np.cos(angle)
    noise = 2e-5 * np.random.default_rng(3).normal(size=angle.size)
    circle = Profile(angle, 30.0 + shift + 1e-3 * np.cos(3 * angle) + noise).filter(upr=50).roundness(kind)
    ends = circle.interval()
    assert ends == circle.interval(method="guaranteed") and ends.method == "guaranteed"
    assert ends.low <= ends.value == circle.ron_t < ends.high


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_minimum_zones_of_many_forms_are_norms(seed):
    """The kernel of the draws against the exact circle, and what both methods rest on."""
    rng = np.random.default_rng(seed)
    one, other = 1e-3 * waves(rng, 128, 20), 1e-3 * waves(rng, 128, 20)
    angle = turn(1, 128)
    both = zone_widths(np.array([one, other, one + other, 2 * one]), 30.0)
    for form, width in zip((one, other), both, strict=False):
        points = (30.0 + form)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        assert width == pytest.approx(reference_circle(points, "MZC").value, abs=1e-9)
    bend = 4e-6 / 30.0  # heights squared over the radius: what distances differ from a norm by
    assert both[2] <= both[0] + both[1] + bend
    assert both[3] == pytest.approx(2 * both[0], abs=bend)


def test_noise_of_the_draws_is_that_of_the_profile():
    sd = np.concatenate([[0, 0], 1e-4 * np.exp2(-((np.arange(2, 200) / 50.0) ** 2))])
    noise = DrawnNoise(sd, 1000)
    (drawn,) = DrawnNoise(sd, 250).draws()
    drawn = np.concatenate([drawn, *list(noise.draws())[1:]])
    assert drawn.std() == pytest.approx(noise.deviation_sd, rel=4 / np.sqrt(2 * 1000 * 60))
    power = np.mean(np.abs(np.fft.rfft(drawn, axis=1)) ** 2, axis=0)
    alike = np.fft.irfft(power, noise.size) / noise.size / noise.deviation_sd**2  # at every shift
    assert alike[0] == pytest.approx(1.0, abs=0.02)
    assert noise.least_correlation == pytest.approx(min(alike), abs=0.02)
    assert -0.05 < noise.least_correlation < -0.03  # -0.041 of a Gaussian


def test_the_guaranteed_ends(found):
    """The upper one is 1.96 sd of the difference of two deviations above RONt."""
    form = found["LSC"]
    ends, noise = form.interval(method="guaranteed"), DrawnNoise(form.noise_upr)
    spread = noise.deviation_sd * np.sqrt(2 * (1 - noise.least_correlation))
    assert ends.high == pytest.approx(form.ron_t + norm.ppf(0.975) * spread, abs=1e-12)
    assert ends.value == form.ron_t and ends.method == "guaranteed"
    lifted = np.sort(np.ptp(next(noise.draws()), axis=1))
    assert lifted[193] <= form.ron_t - ends.low <= lifted[195]


def test_plateaus_tie_as_in_the_form_that_noise_hides():
    """An oval clipped at 0.3: noise lifts the form that is seen as much as the true one, in sd of a deviation."""
    rng, passed = np.random.default_rng(4), np.exp2(-((np.arange(256) / 50.0) ** 2))
    passed[:2] = 0.0
    sd = 5e-5 * np.sqrt(2 / 512) * passed  # of 50 nm a reading, 2 um high
    noise = DrawnNoise(sd)
    true = np.fft.rfft(np.clip(np.cos(2 * turn(1, 512)), -0.3, 0.3) / 300)[2:256] / 256 * passed[2:]
    gaps = []
    for _ in range(6):
        measured = true + sd[2:] * (rng.normal(size=(254, 2)) @ [1, 1j])
        both = noise.values(true[: noise.sd.size]), _without_ripple(seen(measured, noise), noise)
        told, found = np.median(lifts("LSC", np.array(both), noise, 30.0), axis=1)
        gaps.append((found - told) / noise.deviation_sd)
    assert abs(np.mean(gaps)) < 0.03  # their scatter is 0.01; plateaus of 1.5 sd lift 0.16 less


@pytest.mark.parametrize("circle", ["LSC", "MZC"])
def test_both_hold_the_truth(circle):
    """13 forms, a few copies each: of all 26 (MZC) or 39 (LSC) intervals 95 % but for chance."""
    copies = {"LSC": 3, "MZC": 2}[circle]
    rows = np.concatenate(list(coverage.covered(circle, 0.3, copies, points=512, seed=2).values()))
    calibrated, guaranteed = rows[:, :2].mean(axis=0)
    scatter = np.sqrt(0.95 * 0.05 / len(rows))
    assert calibrated > 0.95 - 2.1 * scatter and guaranteed > 0.97 - 2.1 * scatter
    assert rows[:, 2].mean() < 0.7 * rows[:, 3].mean()  # and the calibrated one is worth it


def test_what_noise_lifts_is_taken_off(found):
    for kind in ("LSC", "MZC"):
        ends = found[kind].interval()
        assert ends.low < 2e-3 < ends.high and abs(ends.value - 2e-3) < 0.5 * abs(found[kind].ron_t - 2e-3)
        assert ends == found[kind].interval() and ends.method == "calibrated"


def test_a_surer_interval_is_wider(found):
    widths = [np.ptp([e.low, e.high]) for e in map(found["LSC"].interval, (0.8, 0.95, 0.99, 0.999))]
    assert np.all(np.diff(widths) > 0)


def test_without_a_filter_it_is_guaranteed():
    raw = lobed().roundness("LSC")
    assert raw.interval().method == "guaranteed" and raw.interval().low < 2e-3 < raw.interval().high
    with pytest.raises(ValueError, match="method must be one of guaranteed; got 'calibrated'"):
        raw.interval(method="calibrated")
    still = reference_circle(raw.points, "MZC", noise_sd=0.0).interval()
    assert still.low == still.high == pytest.approx(reference_circle(raw.points, "MZC").value)


@pytest.mark.parametrize("kind", ["spline", "2rc"])
def test_other_linear_filters(kind):
    ends = lobed().filter(kind, upr=50).roundness().interval()
    assert ends.method == "calibrated" and ends.low < 2e-3 < ends.high


@pytest.mark.parametrize("upr", [(2, 15), (15, 30), (15, None)])
def test_noise_of_a_band_on_an_even_turn(upr):
    """Beside 1000 turns of noise alone, filtered; without 1 upr the turn stays even."""
    rng, angle = np.random.default_rng(3), turn(1, 256)
    form = 1e-3 * np.cos(3 * angle) + 5e-4 * np.cos(20 * angle)
    profile = Profile(angle, 30.0 + form + 1e-4 * coverage.centred(rng.standard_normal(256)))
    band, passed = profile.filter(upr=upr), Filter("gaussian", upr[0], upr[1] or np.inf)
    drawn = [passed.applied(coverage.centred(row)) for row in rng.standard_normal((1000, 256))]
    np.testing.assert_allclose(band.deviation_sd, profile.noise_sd * np.std(drawn), rtol=0.02)
    ends = band.roundness().interval(method="calibrated")
    assert ends.low < np.ptp(passed.applied(form)) < ends.high


def test_bands_that_were_not_measured_are_guaranteed():
    ways = {("gaussian", (15, 90)): "calibrated", ("gaussian", (15, None)): "guaranteed"}
    ways |= {(kind, (15, 90)): "guaranteed" for kind in ("spline", "2rc")}
    waves = Profile(ANGLE, lobed().reading + 1e-3 * np.cos(30 * ANGLE))  # something is left in each band
    assert {each: waves.filter(each[0], upr=each[1]).roundness().interval().method for each in ways} == ways


def test_decisions(found, tmp_path):
    form = found["MZC"]
    assert [form.conforms(limit) for limit in (1e-3, 2e-3, 3e-3)] == ["rejected", "not decided", "accepted"]
    ends = form.interval()
    assert f"RONt {1e3 * form.ron_t:.4g} ({ends.ends}, 95 %) µm" in repr(form)
    profile = lobed().filter(upr=50)
    profile.save(tmp_path / "ring.nc")
    assert sdpgrind.load(tmp_path / "ring.nc").roundness("MZC").interval() == ends


def test_a_measured_value_above_the_limit_is_accepted_by_its_correction_and_says_so(found):
    form = found["MZC"]
    ends = form.interval()
    assert ends.high < form.ron_t  # noise lifts it so far
    told = form.verdict(0.5 * (ends.high + form.ron_t))
    assert told.endswith("accepted after the correction for noise, as measured it is above the limit")
    assert form.verdict(3e-3).endswith("limit 3 µm: accepted")


def test_of_readings_that_are_mostly_noise_nothing_is_taken_off():
    """The form of angles in a wrong order is noise: a limit below what was measured is not accepted."""
    form = np.random.default_rng(0).permutation(lobed(0.0).reading - 30.0)
    found = Profile(ANGLE, 30.0 + form).filter(upr=50).roundness()
    ends = found.interval()
    assert (ends.method, ends.low, ends.value) == ("guaranteed", 0.0, found.ron_t)
    assert ends == found.interval(method="guaranteed")
    limit = 0.99 * found.ron_t
    assert found.conforms(limit) == found.budget(Instrument()).conforms(limit) == "not decided"
    assert found.verdict(limit).endswith("not decided, most of the measured value is noise")
    assert found.conforms(1.01 * ends.high) == "accepted"  # with all the noise in it
    assert any("most of the measured RONt of" in each for each in found.remarks)
    assert not any("most of" in each for each in lobed().filter(upr=50).roundness().remarks)


def test_what_has_no_interval(found):
    with pytest.raises(ValueError, match=r"kind must be LSC or MZC for an interval; .* got 'MCC'"):
        found["MCC"].interval()
    assert "95 %" not in repr(found["MCC"])
    with pytest.raises(ValueError, match=r"an interval needs the noise of the deviations: .* after a robust"):
        lobed().filter("robust", upr=15).roundness().interval()
    with pytest.raises(ValueError, match=r"confidence must be in \[0.5, 0.999\]; got 95.0"):
        found["LSC"].interval(95)
    with pytest.raises(ValueError, match=r"limit must be > 0 \(mm\)"):
        found["LSC"].conforms(0.0)
    for name in ("value_sd", "value_bias"):
        with pytest.warns(DeprecationWarning, match=f"Roundness.{name} is deprecated: interval"):
            getattr(found["LSC"], name)


def points_of(form):
    angle = turn(1, form.size)
    return (30.0 + form)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def test_amplitudes_of_noise_are_relative_and_points_come_in_any_order():
    form = lobed().filter(upr=50).roundness()
    again = reference_circle(form.points, "LSC", noise_sd=form.noise_sd, noise_upr=7.0 * form.noise_upr)
    assert again.interval().low == pytest.approx(form.interval().low, abs=1e-9)
    shuffled = np.random.default_rng(0).permutation(form.points)
    anyhow = reference_circle(shuffled, "LSC", noise_sd=form.noise_sd[0], noise_upr=form.noise_upr).interval()
    sure = form.interval(method="guaranteed")
    assert anyhow.method == "guaranteed"  # the other is for an even turn in order
    assert (anyhow.low, anyhow.high) == pytest.approx((sure.low, sure.high), abs=0.1 * (sure.high - sure.low))


@pytest.mark.filterwarnings("ignore:Gaussian low-pass, 50 upr. a gap")
def test_a_bridged_gap_is_as_unsure_as_it_says():
    """A bump where nothing was measured: no draw of even noise tells that."""
    angle = ANGLE[(ANGLE < 1.0) | (ANGLE > 1.12)]
    held = 0
    for rng in np.random.default_rng(4).spawn(20):
        bump = 2e-3 * np.exp(-0.5 * ((angle - 1.06) / np.radians(5)) ** 2)
        profile = Profile(angle, 30.0 + bump + 3e-4 * rng.normal(size=angle.size)).filter(upr=50)
        ends = profile.roundness().interval()
        whole = 2e-3 * np.exp(-0.5 * ((ANGLE - 1.06) / np.radians(5)) ** 2)
        truth = Profile(ANGLE, 30.0 + whole).filter(upr=50).roundness().ron_t
        held += ends.low <= truth <= ends.high
        assert ends.method == "guaranteed"
    assert held >= 18


def test_an_unfiltered_interval_widens_with_the_confidence():
    raw = reference_circle(points_of(1e-3 * np.cos(3 * turn(1, 120))), "LSC", noise_sd=1e-4)
    lows = [raw.interval(share).low for share in (0.9, 0.95, 0.99, 0.998)]
    assert np.all(np.diff(lows) < 0)
