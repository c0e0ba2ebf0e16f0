"""Budgets of RONt: both laws, bounds of spindle and points, what a separation leaves, decisions, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from circle_inside import DrawnNoise
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_rings import turn

import sdpgrind
from centering.roundness import Budget, Harmonics, Instrument, Profile, SpindleError, reference_circle
from hwsim.command._toml import read
from sdpgrind import units

ANGLE = turn(1, 1024)
TESTER = Instrument(
    spindle_error=units.um(0.05), gain_sd=0.01, probe_linearity=0.005, temperature_sd=0.01,
    column_straightness=units.um(0.3), noise_sd=units.um(0.01),
)  # fmt: skip
FORM = 1e-3 * (
    np.cos(3 * ANGLE) + 0.5 * np.cos(7 * ANGLE - 1) + 0.3 * np.cos(16 * ANGLE - 2)
)  # few near ties


def measured(noise, seed=0, form=FORM):
    return Profile(ANGLE, 30.0 + form + noise * np.random.default_rng(seed).normal(size=ANGLE.size))


@pytest.fixture(scope="module")
def circles():
    smooth = measured(5e-5).filter(upr=50)
    return {kind: smooth.roundness(kind) for kind in ("LSC", "MZC", "MCC")}


def contributions(budget):
    return {row.source: row.contribution for row in budget.rows}


@pytest.mark.parametrize("kind", ["LSC", "MZC"])
@pytest.mark.parametrize("instrument", [Instrument(), TESTER])
def test_both_laws_agree_where_ront_is_linear(kind, instrument, circles):
    """The linear law takes the places of contact, Monte Carlo the circle of each draw; its sd is known to 2 %."""
    budget = circles[kind].budget(instrument)
    assert budget.sd == pytest.approx(budget.linear_sd, rel=0.05)


def test_they_part_where_many_places_tie():
    """Of 42 crests the highest counts: noise moves it less than it moves one."""
    budget = measured(1e-4, form=1e-3 * np.cos(42 * ANGLE)).filter(upr=50).roundness().budget(Instrument())
    assert budget.sd < 0.8 * budget.linear_sd


def test_contributions_are_those_of_the_laws(circles):
    found, value = contributions(circles["LSC"].budget(TESTER)), circles["LSC"].ron_t
    assert found["gain"] == pytest.approx(0.01 * value, rel=1e-6)
    assert found["probe linearity"] == pytest.approx(0.005 * value / np.sqrt(3))
    assert found["spindle error"] == pytest.approx(units.um(0.05) / np.sqrt(6))  # of a triangle
    assert found["temperature"] == pytest.approx(11.5e-6 * 30.0 * 0.01, rel=1e-5)
    assert found["column straightness"] == 0.0 and "separation" not in found


@pytest.mark.parametrize("kind", ["LSC", "MZC"])
def test_noise_contributes_what_many_copies_scatter(kind):
    """Brute force: 300 copies of the form; their sd is known to 4 %."""
    exact = measured(0.0).filter(upr=50).roundness(kind)
    rng, passed = np.random.default_rng(1), np.exp2(-((np.arange(513) / 50) ** 2))
    waves = np.fft.rfft(5e-5 * rng.standard_normal((300, ANGLE.size))) * passed
    waves[:, :2] = 0.0
    radii = 30.0 + exact.deviation + np.fft.irfft(waves, ANGLE.size)
    turned = np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])
    copies = [reference_circle(radius[:, np.newaxis] * turned, kind).ron_t for radius in radii]
    noise = contributions(measured(5e-5).filter(upr=50).roundness(kind).budget(Instrument()))["noise"]
    assert noise == pytest.approx(np.std(copies), rel=0.15)  # 4 sd of 300 copies


def test_a_perfect_tester_leaves_the_interval_of_the_noise(circles):
    for kind in ("LSC", "MZC"):
        mine, whole = circles[kind].interval(), circles[kind].budget(Instrument()).interval()
        assert (whole.low, whole.high) == pytest.approx(
            (mine.low, mine.high), abs=0.02 * (mine.high - mine.low)
        )
        assert whole.method == "calibrated"


def test_a_worse_tester_widens_and_its_worst_case_holds_its_interval(circles):
    budgets = [circles["MZC"].budget(each) for each in (Instrument(), TESTER, TESTER.replace(gain_sd=0.05))]
    widths = [budget.interval().high - budget.interval().low for budget in budgets]
    assert widths == sorted(widths) and widths[2] > 2 * widths[0]
    ends, worst = budgets[1].interval(), budgets[1].worst_case()
    assert worst.low < ends.low < ends.high < worst.high
    assert budgets[0].spindle_bound == 0.0 and budgets[0].worst_case() == budgets[0].interval()


def test_no_draw_exceeds_the_worst_case_without_other_errors():
    """Noise-free: all that is left is the spindle, at most its error from valley to peak."""
    quiet = measured(0.0).filter(upr=50).roundness()
    exact = quiet.replace(noise_sd=np.zeros(1), origin=replace(quiet.origin, hidden=""))
    budget = exact.budget(Instrument(spindle_error=units.um(0.1)))
    ends, worst = budget.interval(0.999), budget.worst_case()
    assert worst.high - exact.ron_t == pytest.approx(1e-4) and worst.low < ends.low and ends.high < worst.high
    assert budget.sd == pytest.approx(1e-4 / np.sqrt(6), rel=0.3)  # one draw of noise: ten of the others


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_a_spindle_changes_ront_by_its_own_height_at_most(seed):
    rng, angle = np.random.default_rng(seed), turn(1, 180)
    waves = np.zeros((2, 91), dtype=complex)
    waves[:, 2:12] = rng.normal(size=(2, 10, 2)) @ [1, 1j]
    part, spindle = 1e-4 * np.fft.irfft(waves, 180)
    turned = np.column_stack([np.cos(angle), np.sin(angle)])
    for kind in ("LSC", "MZC"):
        true, seen = (
            reference_circle((30.0 + form)[:, np.newaxis] * turned, kind).ron_t
            for form in (part, part + spindle)
        )
        assert abs(seen - true) <= np.ptp(spindle) + 1e-7  # heights squared over the radius


def test_the_budget_holds_the_truth_of_testers_that_err():
    """Form, noise, gain and spindle drawn anew: of 24 copies at 95 % fewer than 20 hold once in 150."""
    tester = Instrument(spindle_error=units.um(0.2), gain_sd=0.02)
    true = measured(0.0).filter(upr=50).roundness().ron_t
    held = 0
    for rng in np.random.default_rng(3).spawn(24):
        spindle = np.cos(2 * ANGLE - rng.uniform(0, 6)) + np.cos(5 * ANGLE - rng.uniform(0, 6))
        read = (FORM + units.um(0.2) * spindle / np.ptp(spindle)) * (1 + 0.02 * rng.normal())
        waves = np.fft.rfft(1e-4 * rng.normal(size=ANGLE.size))
        waves[:2] = 0.0
        form = Profile(ANGLE, 30.0 + read + np.fft.irfft(waves)).filter(upr=50).roundness()
        ends = form.budget(tester).interval()
        held += ends.low <= true <= ends.high
    assert held >= 20


def test_what_a_separation_leaves_stands_in_a_row_of_its_own():
    spindle = SpindleError(Harmonics([2, 12], [2e-4, 0.0], [0.3, 0.0], [2e-5, 1e-4]), np.array([12]))
    circle = measured(2e-5).correct(spindle).filter(upr=50).roundness()
    budget = circle.budget(TESTER)
    row = next(row for row in budget.rows if row.source == "separation")
    passed = np.exp2(-((np.array([2, 12]) / 50) ** 2))
    level = np.linalg.norm(passed * [2e-5, 1e-4])
    assert row.half_width == pytest.approx(1.96 * level, rel=1e-4) and row.unit == "mm"
    ends = (int(np.argmax(circle.deviation)), int(np.argmin(circle.deviation)))
    apart = [abs(np.exp(1j * n * ANGLE[ends[0]]) - np.exp(1j * n * ANGLE[ends[1]])) for n in (2, 12)]
    assert row.contribution == pytest.approx(np.linalg.norm(passed * [2e-5, 1e-4] * apart), rel=1e-3)
    assert budget.spindle_bound == 0.0 and "spindle error" not in contributions(budget)
    clean = measured(2e-5).filter(upr=50).roundness().budget(Instrument())
    assert contributions(budget)["noise"] == pytest.approx(contributions(clean)["noise"], rel=0.1)


def test_a_lost_harmonic_is_drawn_from_a_rectangle():
    sd = np.zeros(60)
    sd[2:50], sd[12] = 1e-6, 1e-4
    for lost, bound in (((12,), 1.7321), ((), np.inf)):
        (drawn,) = DrawnNoise(sd, 200, lost).draws()
        wave = 2 * np.fft.rfft(drawn)[:, 12] / drawn.shape[1]
        assert np.std(wave.real) == pytest.approx(1e-4, rel=0.15)  # 200 draws, 3 sd
        assert (np.abs(wave.real).max() <= bound * 1e-4) and (lost or np.abs(wave.real).max() > 2e-4)


@pytest.mark.filterwarnings("ignore:.* points a turn are:UserWarning")
@pytest.mark.parametrize(
    ("points", "last"), [(300, "peaks between the points"), (720, "column straightness")]
)
def test_few_points_for_each_undulation_miss_crests_upward(points, last):
    angle = turn(1, points)
    noise = 1e-6 * np.random.default_rng(0).normal(size=points)
    circle = Profile(angle, 30.0 + 1e-3 * np.cos(3 * angle) + noise).filter(upr=50).roundness()
    row = circle.replace(noise_sd=np.full(points, 1e-6)).budget(Instrument()).rows[-1]
    assert row.source == last
    if points == 300:
        assert row.half_width == pytest.approx((1 / np.cos(np.pi / 6) - 1) / 2)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_a_crest_between_points_is_within_the_bound(seed):
    waves = np.zeros(2001, dtype=complex)
    waves[1:51] = np.random.default_rng(seed).normal(size=(50, 2)) @ [1, 1j]
    fine = np.abs(np.fft.irfft(waves, 6000))
    assert fine.max() <= fine[::20].max() / np.cos(np.pi * 50 / 300) * (1 + 1e-12)


def test_an_unfiltered_profile_has_a_budget_by_the_guaranteed_ends():
    circle = measured(5e-5).roundness()
    budget, ends = circle.budget(Instrument()), circle.interval()
    assert budget.interval().method == "guaranteed"
    assert budget.interval().high == pytest.approx(ends.high, abs=0.02 * (ends.high - ends.low))


def test_noise_of_the_tester_serves_where_the_profile_shows_none(circles):
    silent = circles["LSC"].replace(noise_sd=np.empty(0), noise_upr=np.empty(0))
    rows = silent.budget(TESTER).rows
    assert rows[0].contribution == pytest.approx(np.sqrt(2) * units.um(0.01))
    assert contributions(circles["LSC"].budget(TESTER))["noise"] > 1.2 * rows[0].contribution  # its own
    with pytest.raises(ValueError, match="a budget needs the noise of the deviations"):
        silent.budget(Instrument())


def test_decisions(circles):
    budget = circles["MZC"].budget(TESTER)
    ends = budget.interval()
    for limit, found in (
        (ends.high * 1.01, "accepted"), (ends.low * 0.99, "rejected"), (ends.value, "not decided")
    ):  # fmt: skip
        assert budget.conforms(limit) == found
    with pytest.raises(ValueError, match=r"limit must be > 0 \(mm\); got -1"):
        budget.conforms(-1.0)


def test_refusals(circles):
    with pytest.raises(ValueError, match=r"kind must be LSC or MZC for a budget: .* got 'MCC'"):
        circles["MCC"].budget(TESTER)
    with pytest.raises(TypeError, match=r"instrument must be an? .*Instrument"):
        circles["LSC"].budget("talyrond")
    with pytest.raises(ValueError, match=r"height must be given \(mm\)"):
        circles["LSC"].budget(TESTER.replace(spindle_error_per_height=3e-7))
    with pytest.raises(ValueError, match=r"height must be >= 0 \(mm\); got -1"):
        circles["LSC"].budget(TESTER, height=-1.0)
    robust = measured(5e-5).filter("robust", upr=50).roundness()
    with pytest.raises(ValueError, match="after a robust filter, which is not linear, no budget is known"):
        robust.budget(TESTER)
    with pytest.raises(ValueError, match=r"confidence must be in \[0.5, 0.999\]"):
        circles["LSC"].budget(TESTER).interval(95)
    with pytest.raises(ValueError, match=r"spindle_error must be in mm, some 5e-05; units.um\(...\)"):
        Instrument(spindle_error=0.05)
    with pytest.raises(ValueError, match=r"gain_sd must be in \[0, 0.2\]"):
        Instrument(gain_sd=1.0)


def test_height_adds_to_the_spindle(circles):
    tester = TESTER.replace(spindle_error_per_height=3e-7)
    assert circles["LSC"].budget(tester, height=100.0).spindle_bound == pytest.approx(units.um(0.08))


def test_a_budget_is_saved(circles, tmp_path):
    budget = circles["MZC"].budget(TESTER, height=12.0)
    budget.save(tmp_path / "budget.nc")
    again = sdpgrind.load(tmp_path / "budget.nc")
    assert type(again) is Budget and again == budget and again.rows == budget.rows
    assert again.interval() == budget.interval() and str(again) == str(budget)
    assert "standard uncertainty" in str(budget) and "noise" in budget._repr_html_()


def test_an_instrument_is_read_from_a_file(tmp_path):
    path = tmp_path / "tester.toml"
    path.write_text('[instrument]\nspindle_error = "0.05 um"\ngain_sd = "1 %"\ntemperature_sd = 0.01\n')
    found = read(path, lambda table: table.table("instrument").one(Instrument))
    assert found == Instrument(spindle_error=units.um(0.05), gain_sd=0.01, temperature_sd=0.01)


def test_temperature_needs_the_radius():
    noise = 1e-5 * np.random.default_rng(0).normal(size=ANGLE.size)
    form = Profile.from_deviation(FORM + noise, radius=None, centred=True).filter(upr=50).roundness()
    with pytest.raises(ValueError, match=r"temperature_sd needs the radius \(mm\).*got 0.05 K"):
        form.budget(Instrument(temperature_sd=0.05))
    assert form.budget(Instrument(gain_sd=0.01)).sd > 0


def test_a_limit_in_micrometres_is_refused(circles):
    circle = measured(1e-5).filter(upr=50).roundness()
    for decides in (circle, circle.budget(TESTER)):
        with pytest.raises(ValueError, match=r"limit must be in mm, some 0.003; units.um\(...\)"):
            decides.conforms(2.5)
