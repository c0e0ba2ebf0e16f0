"""Sheets of roundness: whole and sealed, with circle, filter, corrections and method on each of them."""

import html5lib
import numpy as np
import pytest
from measured_rings import turn

from centering.roundness import Harmonics, Instrument, Profile, RoundnessInterval, SpindleError
from sdpgrind import units
from sdpgrind.base.sheets import seal

ANGLE = turn(1, 720)
SPINDLE = SpindleError(Harmonics([2, 5], [1e-4, 6e-5], [1.9, 0.3], [1e-6, 1e-6]), np.array([36]))
TESTER = Instrument(spindle_error=units.um(0.05), gain_sd=0.01)


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    form = np.cos(3 * ANGLE) + 0.1 * np.random.default_rng(0).normal(size=ANGLE.size)  # um
    path = tmp_path_factory.mktemp("sheets") / "ring.csv"
    rows = [f"{angle:.2f},{each:.4f}" for angle, each in zip(np.degrees(ANGLE), form, strict=True)]
    path.write_text("\n".join(["phi (deg),dev (um)", *rows]))
    return Profile.read(path, angle="phi", deviation="dev", radius=30.0)


def test_asperities_and_limits_of_harmonics_are_on_the_sheet(ring):
    """3 upr of 1 um, of which the filter passes exp2(-(3/50)^2) = 0.9975."""
    dusty = Profile(ring.angle, ring.reading + np.where(np.arange(ANGLE.size) == 200, 0.05, 0.0))
    circle = dusty.remove_asperities().filter(upr=50).roundness("MZC")
    told = circle.report(limits={"RONt": units.um(2.5), (2, 15): units.um(1.2), 3: units.um(0.9)})
    assert "step: 1 reading of 1 asperity more than 6 sd" in told
    assert (
        "2 to 15 upr: largest amplitude at 3 upr 0.9" in told
        and "limit 1.2 µm: accepted (after the filter)" in told
    )
    assert "3 upr: amplitude 0.9" in told and "limit 0.9 µm: rejected (after the filter)" in told
    with pytest.raises(ValueError, match=r"limits\[3\]: harmonics are told of a filtered even turn alone"):
        ring.roundness().report(limits={3: units.um(0.9)})


@pytest.mark.parametrize("kind", ["LSC", "MZC", "MCC", "MIC"])
def test_every_sheet_says_circle_filter_corrections_and_method(kind, ring):
    told = ring.correct(SPINDLE).filter(upr=50).roundness(kind).report()
    assert f"{kind}, " in told and "Gaussian low-pass, 50 upr" in told and "points" in told
    assert "step: error of the spindle taken off" in told and "spindle's error separated, lost 36 upr" in told
    method = (
        "Method calibrated: noise drawn"
        if kind in ("LSC", "MZC")
        else f"no interval of RONt is proved about {kind}, only"
    )
    assert method in told and "ring.csv: " in told and "sha256 " in told and "library" in told
    raw = ring.roundness(kind).report()
    assert "none: all undulations" in raw and "corrections: spindle's error not separated" in raw


def test_a_page_is_valid_sealed_and_has_a_place_to_sign(ring, tmp_path):
    circle = ring.filter(upr=50).roundness("MZC")
    limits = {"RONt": units.um(2.5), "RONq": units.um(0.5)}
    path = circle.report(tmp_path / "ring.html", limits=limits, instrument=TESTER)
    text = (tmp_path / "ring.html").read_text("utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert path == str(tmp_path / "ring.html") and not seal.changes(text)
    assert text.count("<svg") == 2 and ": left out, " not in text and len(text) < 1_500_000
    for word in ("Roundness: ring.csv", "Uncertainty budget", "Supplement 1", "signature", "date", "name"):
        assert word in text
    assert seal.changes(text.replace("2.5 µm: accepted", "2.6 µm: accepted"))


def test_decisions_are_those_of_the_interval(ring):
    circle = ring.filter(upr=50).roundness()
    budget = circle.budget(TESTER)
    ends = budget.interval()
    for limit in (ends.high * 1.01, ends.value, ends.low * 0.99):
        told = budget.report(limits={"RONt": limit})
        assert f"{budget.verdict(limit)} (ISO" in told and f": {budget.conforms(limit)}" in told
        assert f"limit {1e3 * limit:.4g} µm: {budget.conforms(limit)}" in budget.verdict(limit)
        assert f", {ends.middle} without the lift of noise ({ends.ends}, 95 % calib" in budget.verdict(limit)
        assert told == circle.report(limits={"RONt": limit}, instrument=TESTER)
    told = circle.report(limits={"RONq": 1e-4})
    assert (
        f"RONq (LSC) {1e3 * circle.ron_q:.4g} µm, limit 0.1 µm: not decided, above the limit as measured, no interval"
        in told
    )


def test_the_worst_case_of_a_spindle_stands_beside(ring):
    circle = ring.filter(upr=50).roundness()
    worst = circle.budget(TESTER).worst_case().ends
    assert f"by 0.05 µm at most, up or down: {worst} µm" in circle.report(instrument=TESTER)
    budget = circle.budget(TESTER)
    between = 0.5 * (budget.interval().high + budget.worst_case().high)
    above = f"the worst case of the spindle, {1e3 * budget.worst_case().high:.4g} µm, is above the limit"
    assert budget.conforms(between) == "accepted" and f"accepted; {above}" in budget.verdict(between)
    assert "worst case" not in budget.verdict(1.001 * budget.worst_case().high)
    assert repr(budget.worst_case()).endswith(
        f"{worst} µm, worst case of the spindle; by the other sources 95 %)"
    )
    corrected = ring.correct(SPINDLE).filter(upr=50).roundness()
    assert "at most, up or down" not in corrected.report(instrument=TESTER)
    assert "as noise; of lost harmonics rectangular" in corrected.report(instrument=TESTER)


def test_without_noise_there_is_no_interval_and_it_says_so(ring):
    told = ring.filter("robust", upr=50).roundness().report(limits={"RONt": units.um(2.5)})
    assert "limit 2.5 µm: not decided, no interval of RONt is proved after a robust" in told
    assert "no interval of RONt is proved after a robust filter, which is not linear" in told


def test_an_interval_without_width_has_five_digits():
    still = RoundnessInterval(2e-3, 2e-3, 2e-3, 0.95, "calibrated")
    assert still.ends == "2.0000 .. 2.0000" and still.middle == "2.0000"
    assert RoundnessInterval(0.0, 0.0, 0.0, 0.95, "calibrated").ends.startswith("0.0")


def test_refusals(ring):
    circle = ring.filter(upr=50).roundness("MIC")
    with pytest.raises(ValueError, match="limits must be one of RONt"):
        circle.report(limits={"RONz": 0.001})
    with pytest.raises(ValueError, match=r"got 'ront'; is 'RONt' meant\?"):
        circle.report(limits={"ront": 0.001})
    with pytest.raises(ValueError, match=r"limits\['RONt'\] must be in mm, some 0.003; units.um"):
        circle.report(limits={"RONt": 2.5})
    with pytest.raises(ValueError, match="kind must be LSC or MZC for a budget"):
        circle.budget(TESTER)


@pytest.mark.parametrize(("filter", "kind"), [("gaussian", "MCC"), ("gaussian", "MIC"), ("robust", "LSC")])
def test_a_budget_that_is_not_known_is_left_out(filter, kind, ring):
    circle = ring.filter(filter, upr=50).roundness(kind)
    told = circle.report(limits={"RONt": units.um(2.5)}, instrument=TESTER)
    assert f"uncertainty budget left out: {circle.why_no_budget}" in told and "(GUM)" not in told
    assert "µm: not decided, no interval of RONt is proved" in told and "budget left" not in circle.report()


def test_a_value_above_its_own_interval_is_explained(tmp_path):
    """Noise of 0.3 um lifts RONt of 2 um by some 0.3 um; the same words in print, on the sheet, in a budget."""
    noise = 3e-4 * np.random.default_rng(0).normal(size=1024)
    noisy = Profile(30.0 + 1e-3 * np.cos(3 * turn(1, 1024)) + noise).filter(upr=50).roundness()
    assert noisy.ron_t > noisy.interval().high > 2e-3
    (told,) = noisy.remarks
    assert told.startswith(
        f"the measured RONt of {1e3 * noisy.ron_t:.4g} µm is above its interval: noise lifts"
    )
    assert str(noisy) == f"{noisy!r}\n{told}" and told in noisy.report()
    budget = noisy.budget(Instrument(gain_sd=1e-6))
    assert budget.remarks == (told,) and str(budget).endswith(told) and told in budget.report()
    assert not noisy.budget(Instrument(gain_sd=0.2)).remarks  # the tester's errors widen it beyond the value
    calm = Profile(30.0 + 1e-3 * np.cos(3 * turn(1, 1024)) + noise / 100).filter(upr=50).roundness("MIC")
    assert not calm.remarks and str(calm) == repr(calm)


@pytest.mark.parametrize("rng", range(3))
@pytest.mark.parametrize("kind", ["LSC", "MZC"])
def test_a_measured_value_is_never_below_its_interval(kind, rng):
    """RONt is convex: of noise and its negative one at least raises it."""
    noise = 5e-4 * np.random.default_rng(rng).normal(size=512)
    found = Profile(30.0 + 2e-4 * np.cos(3 * turn(1, 512)) + noise).filter(upr=50).roundness(kind)
    assert min(found.interval().low, found.interval(method="guaranteed").low) <= found.ron_t
    assert found.interval().low < found.ron_t


@pytest.mark.parametrize("kind", ["LSC", "MZC", "MCC", "MIC"])
def test_rows_of_the_sheet(kind, ring):
    """Crests of cos 3 t lie at 0, 120 and 240 degrees: none of the angles is below 0."""
    circle = ring.filter(upr=50).roundness(kind)
    told = circle.report().splitlines()
    angles = [line.split("]")[1] for line in told if line.startswith(("contacts [deg", "direction of"))]
    numbers = [float(each) for line in angles for each in line.split(",")]
    assert len(angles) == (1 if kind == "LSC" else 2) and min(numbers) >= 0 and max(numbers) < 360
    assert len(numbers) == 1 + circle.contacts.size and numbers[1:] == sorted(numbers[1:])
    np.testing.assert_allclose(
        np.sort(np.cos(np.radians(numbers[1:]))), np.sort(np.cos(circle.contact_angles)), atol=2e-3
    )
    assert next(line for line in told if line.startswith("radius of the tip")).endswith("not given")
    nothing = {"MCC": circle.ron_p, "MIC": circle.ron_v}.get(kind, 0.0)
    assert nothing == 0 and circle.ron_t == pytest.approx(np.ptp(circle.deviation), abs=1e-13)
    tipped = Profile(ring.angle, ring.reading, tip_radius=1.5).roundness(kind).report()
    assert next(line for line in tipped.splitlines() if line.startswith("radius of the tip")).endswith(" 1.5")
