"""Changeover from a profile: the true radius between samples about any axis, and how often it is exceeded."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from centering.roundness import Profile
from centering.setup import Stock, plan_changeover
from hwsim import Probe, ProbeErrors
from hwsim import Ring as TurnedRing
from sdpgrind import units

STOCK = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
HOW = {"finish_radius": 61.9, "gap": 0.010, "approach_rate": units.mm_per_min(1.56)}
BORE = {"finish_radius": 62.2}
RADIUS = 62.05


class Ring:
    """A wavy ring at any place, with exact points."""

    def __init__(self, seed, *, waves=(2, 3, 50), size=0.002, offset=0.0):
        rng = np.random.default_rng(seed)
        self.waves = [(n, size * rng.uniform(0.2, 1.0), rng.uniform(0, 2 * np.pi)) for n in waves]
        way = rng.uniform(0, 2 * np.pi)
        self.center = offset * np.array([np.cos(way), np.sin(way)])
        self.rng = rng

    def distances(self, about, count):
        beta = np.arange(count) * 2 * np.pi / count
        radius = RADIUS + sum(size * np.cos(n * beta - phase) for n, size, phase in self.waves)
        points = self.center + np.stack([radius * np.cos(beta), radius * np.sin(beta)], axis=1)
        x, y = (points - about).T
        return np.arctan2(y, x), np.hypot(x, y)

    def profile(self, count=360, noise=0.0, turns=1, internal=False):
        angle, reading = self.distances((0.0, 0.0), count)
        angle = np.concatenate([np.unwrap(angle) + 2 * np.pi * turn for turn in range(turns)])
        reading = np.tile(reading, turns)
        return Profile(angle, reading + noise * self.rng.standard_normal(angle.size), internal=internal)


def planned(profile, **options):
    return plan_changeover(profile, STOCK, **HOW | options)


@given(
    seed=st.integers(0, 10_000),
    offset=st.sampled_from([0.0, 0.005, 0.05]),
    waves=st.sampled_from([(50,), (2, 49, 50), (43, 2)]),
)
@example(seed=219, offset=0.0, waves=(2, 49, 50))
@settings(max_examples=25, deadline=None)
def test_the_largest_radius_about_the_spindle_is_the_true_one_between_samples_too(seed, offset, waves):
    ring = Ring(seed, waves=waves, offset=offset)
    true = ring.distances((0.0, 0.0), 50_000)[1]
    found = planned(ring.profile(), radius_sd=0.0).largest_radius
    assert found == pytest.approx(true.max(), abs=1e-6)
    bore = planned(ring.profile(internal=True), radius_sd=0.0, **BORE)
    assert bore.internal and bore.largest_radius == pytest.approx(true.min(), abs=1e-6)


@given(seed=st.integers(0, 10_000), eccentricity=st.floats(0.0, 0.01))
@settings(max_examples=8, deadline=None)
def test_a_part_that_is_centred_anew_stays_within_its_circle(seed, eccentricity):
    """About any axis at that distance from the centre."""
    ring = Ring(seed, offset=0.3, waves=(2, 3, 7))
    for kind, sign, options in (("MCC", 1, {}), ("MIC", -1, BORE)):
        profile = ring.profile(720, internal=sign < 0)
        change = planned(profile, eccentricity=eccentricity, radius_sd=0.0, upr=10, **options)
        center = profile.roundness(kind).center
        for way in np.linspace(0, 2 * np.pi, 7):
            true = ring.distances(center + eccentricity * np.array([np.cos(way), np.sin(way)]), 20_000)[1]
            assert sign * change.largest_radius >= (sign * true).max() - 1e-6
        circle = profile.roundness(kind).radius + sign * eccentricity
        assert change.largest_radius == pytest.approx(
            circle, abs=(profile.rise_between_samples(10) - 1) * 0.01 + 1e-6
        )


def errors_of(lobes, noise_sd, runs, offset=0.05, **options):
    """Measured less true largest radius, over its sd, of rings on the simulated table."""
    found = []
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        turned = {n: (size, rng.uniform(-3, 3)) for n, size in lobes.items()}
        ring = TurnedRing(RADIUS, offset, rng.uniform(-3, 3), lobes=turned)
        scan = Probe(ring, errors=ProbeErrors(runout=0.0, noise_sd=noise_sd), samples_per_turn=180).scan(
            turns=1, rng=seed
        )
        change = planned(Profile(scan.angle, scan.reading, tip_radius=3.75), **options)
        beta = np.linspace(0, 2 * np.pi, 4001)  # the highest is 2e-8 mm above, a thousandth of an sd
        surface = ring.surface(beta)
        true = np.hypot(ring.center_x + surface * np.cos(beta), ring.center_y + surface * np.sin(beta)).max()
        found.append((change.largest_radius - true) / change.radius_sd)
    return np.array(found)


def test_parts_stand_out_as_often_as_told():
    """150 rings with one highest place exceed 0, 1 and 2 sd as often as the probability says."""
    errors, runs = errors_of({2: 0.002}, 3e-5, 150), 300  # bounds of twice as many
    assert errors.mean() == pytest.approx(0.1, abs=4 / np.sqrt(runs))
    assert errors.std() == pytest.approx(1.0, abs=4 / np.sqrt(2 * runs))
    for z, fewest in ((0.0, 0.5), (1.0, 0.75), (2.0, 0.3)):
        told = norm.sf(z)
        scatter = np.sqrt(told * (1 - told) / runs)
        assert fewest * told - 2 * scatter < np.mean(errors < -z) < told + 3 * scatter


def test_parts_of_many_high_places_stand_out_more_seldom():
    """Noise as large as the form: the fitted maximum is one or two sd too high."""
    errors = errors_of({2: 0.002}, 1e-3, 60)
    assert 0.5 < errors.mean() < 2.0
    assert np.mean(errors < 0) <= 0.5 and np.mean(errors < -1) <= 0.16


def test_the_radius_sd_is_that_of_the_fitted_form():
    """One even turn: sd of a reading times sqrt((2 degree + 1)/samples), less with more turns."""
    for turns, upr in ((1, 50.0), (4, 50.0), (1, 5.0)):
        change = planned(Ring(1, waves=(2,)).profile(noise=1e-3, turns=turns), upr=upr)
        told = 1e-3 * np.sqrt((2 * upr + 1) / (360 * turns))
        assert change.radius_sd == pytest.approx(told, rel=0.15)


def test_errors_that_come_again_every_turn_are_not_averaged():
    """Errors of the encoder; large ones count as form, with more harmonics."""
    rng, angle = np.random.default_rng(3), np.arange(4 * 360) * 2 * np.pi / 360
    form = RADIUS + 0.002 * np.cos(2 * angle)
    every, own = np.tile(rng.standard_normal(360), 4), rng.standard_normal(4 * 360)
    for share, told in ((0.0, 0.25), (0.1, 0.325)):
        errors = 1e-4 * (np.sqrt(share) * every + np.sqrt(1 - share) * own)
        sd = planned(Profile(angle, form + errors)).radius_sd
        assert sd == pytest.approx(1e-4 * np.sqrt(101 / 360 * told), rel=0.08)
    assert planned(Profile(angle, form + 1e-4 * every)).radius_sd > 1e-4 * np.sqrt(101 / 360) * 0.9


@pytest.mark.parametrize("upr", [80, 120])
def test_form_beyond_what_was_said_is_seen(upr):
    """Lobes of 1 um above `upr`."""
    assert errors_of({2: 0.002, upr: 0.001}, 3e-5, 15).min() > -4


@pytest.mark.parametrize("internal", [False, True])
@pytest.mark.parametrize("width", [1, 3, 8])
@pytest.mark.parametrize("height", [0.002, 0.02])
def test_a_burr_counts_as_it_was_read(width, height, internal):
    """On the highest place of a part, the lowest of a bore."""
    side = -1 if internal else 1
    angle = np.arange(720) * 2 * np.pi / 360
    form = 0.004 * np.cos(2 * angle) + 1e-4 * np.random.default_rng(5).standard_normal(720)
    burr = np.where((np.arange(720) % 360 - (90 if internal else 0)) % 360 < width, side * height, 0.0)
    change = planned(Profile(angle, RADIUS + form + burr, internal=internal), **(BORE if internal else {}))
    true = RADIUS + side * (0.004 + height)
    assert -3e-4 < side * (change.largest_radius - true) < 0.15 * height + 1e-3
    assert side * (change.position - change.gap * side - true) > 0
    assert change.radius_sd < 1e-3


def test_a_burr_in_a_valley_does_not_count():
    angle = np.arange(720) * 2 * np.pi / 360
    reading = RADIUS + 0.02 * np.cos(2 * angle) + 1e-4 * np.random.default_rng(5).standard_normal(720)
    reading[[90, 450]] += 0.005
    assert planned(Profile(angle, reading)).largest_radius == pytest.approx(RADIUS + 0.02, abs=1e-3)


def test_rounded_readings_are_no_surer_than_their_steps():
    """40 rings without noise, in steps of 50 nm."""
    angle, step = np.arange(360) * 2 * np.pi / 360, 5e-5
    for seed in range(40):
        rng = np.random.default_rng(seed)
        radius, way = RADIUS + step * rng.uniform(), rng.uniform(0, 2 * np.pi)
        reading = radius + 0.6 * step * np.cos(angle - way)
        change = planned(Profile(angle, step * np.round(reading / step)), gap=0.0)
        assert change.radius_sd >= step / np.sqrt(12) * 0.999 and change.position > radius + 0.6 * step
    with pytest.raises(ValueError, match=r"radius_sd must be given \(mm\) where readings are all alike"):
        planned(Profile(angle, np.full(360, RADIUS)))
    assert planned(Profile(angle, np.full(360, RADIUS)), radius_sd=1e-4).largest_radius == pytest.approx(
        RADIUS
    )


def test_form_is_no_uncertainty():
    """120 um of form change neither the sd of the radius nor that of the centre."""
    ring = Ring(1, waves=(2,), size=0.06)
    sure = planned(ring.profile(noise=1e-4), eccentricity=0.0, upr=5)
    assert 1e-4 * 0.12 < sure.radius_sd < 1e-4 * 0.3


@pytest.mark.parametrize("offset", [0.3, 3.6])
def test_a_bore_that_was_read_with_a_tip(offset):
    """Smallest radius about the spindle's axis; as a part it errs by more than the roundness."""
    angle, radius, tip = np.arange(720) * 2 * np.pi / 360, 30.0, 3.75
    reading = offset * np.cos(angle) + np.sqrt((radius - tip) ** 2 - (offset * np.sin(angle)) ** 2) + tip
    bore = Profile(angle, reading, tip_radius=tip, internal=True)
    change = planned(bore, radius_sd=1e-4, finish_radius=30.15 - offset)
    assert change.internal and change.largest_radius == pytest.approx(radius - offset, abs=1e-7)
    centred = planned(bore, radius_sd=1e-4, finish_radius=30.15, eccentricity=0.0)
    assert centred.largest_radius == pytest.approx(radius, abs=1e-7)


def test_several_turns_and_what_was_told():
    ring = Ring(2)
    change = planned(ring.profile(turns=3, noise=1e-4), crash_time=300.0, combine="rss")
    assert change.combine == "rss" and change.crash_time == 300.0 and change.time_saved > 0
    assert change.largest_radius == pytest.approx(ring.distances((0.0, 0.0), 5000)[1].max(), abs=2e-3)
    assert planned(ring.profile(noise=1e-4), radius_sd=0.002).radius_sd == 0.002


def test_warnings():
    with pytest.warns(
        UserWarning,
        match=r"largest_radius of 65\.\d+ mm lies beyond the changeover .* at 62\.142 mm: .*3\.3 mm off the spindle",
    ):
        change = planned(Ring(3, offset=3.3).profile(noise=1e-4))
    assert change.outside_population and change.time_saved < 0
    with pytest.warns(UserWarning, match=r"smallest_radius of 6\d\.\d+ mm lies beyond"):
        planned(Ring(3, offset=0.3).profile(noise=1e-4, internal=True), **BORE)
    with pytest.warns(UserWarning, match=r"the part is outside the population$"):
        planned(Ring(3).profile(noise=1e-4), finish_radius=61.7, eccentricity=0.0)
    with pytest.warns(UserWarning, match=r"leaves nothing to grind to 62\.1 mm"):
        planned(Ring(3).profile(noise=1e-4), finish_radius=62.1)
    filtered = Ring(3, waves=(2,)).profile(noise=1e-4).filter("gaussian", upr=15)
    with pytest.warns(
        UserWarning,
        match="profile should not be filtered, as that takes peaks off: it is Gaussian low-pass, 15",
    ):
        change = planned(filtered)
    assert (
        change.largest_radius == filtered.largest_radius() and change.radius_sd == filtered.deviation_sd.max()
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"gap": -0.01}, r"gap must be >= 0 \(mm\); got -0.01"),
        ({"approach_rate": 0.0}, r"approach_rate must be > 0 \(mm/s\); got 0.0"),
        ({"gap": 10.0}, r"gap must be < 3; units.um\(...\) for micrometres \(mm\); got 10.0"),
        ({"radius_sd": 5.0}, r"radius_sd must be < 3; units.um\(...\) for micrometres \(mm\); got 5.0"),
        (
            {"eccentricity": 20.0},
            r"eccentricity must be < 10; units.um\(...\) for micrometres \(mm\); got 20.0",
        ),
        ({"upr": -1.0}, r"upr must be >= 0 \(upr\); got -1.0"),
        ({"eccentricity": -1e-3}, r"eccentricity must be >= 0 \(mm\); got -0.001"),
        ({"upr": 200}, r"upr must be < 180 for a gap of 1 degrees \(upr\); got 200.0"),
        ({"combine": "max"}, "combine must be one of linear, rss; got 'max'"),
    ],
)
def test_refusals(options, said):
    with pytest.raises(ValueError, match=said):
        planned(Ring(4, waves=(2,)).profile(noise=1e-5), **options)


def test_other_refusals():
    with pytest.raises(TypeError, match=r"profile must be a Profile \(see centering.Profile\); got 62.05"):
        planned(RADIUS)
    with pytest.raises(TypeError, match="stock must be a Stock; got 3"):
        plan_changeover(Ring(4).profile(), 3, **HOW)
    few = Profile(np.arange(4) * np.pi / 2, [62.0, 62.001, 62.0, 62.001])
    with pytest.raises(
        ValueError,
        match=r"radius_sd must be given \(mm\) where the profile tells no noise: 4 samples are too few",
    ):
        planned(few, upr=1.0)
