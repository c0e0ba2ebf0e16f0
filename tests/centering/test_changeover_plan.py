"""From a profile to the changeover: the radius is never less than the true one, between samples and about any axis."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from centering._handover.plan import plan_changeover
from centering._handover.stock import Stock
from centering._roundness.profile import Profile
from sdpgrind import units

STOCK = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
HOW = {"finish_radius": 61.9, "gap": 0.010, "approach_rate": units.mm_per_min(1.56)}
BORE = {"finish_radius": 62.2, "internal": True}
RADIUS = 62.05


class Ring:
    """A ring with waves, anywhere; points of its surface, exactly."""

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

    def profile(self, count=360, noise=0.0, turns=1):
        angle, reading = self.distances((0.0, 0.0), count)
        angle = np.concatenate([np.unwrap(angle) + 2 * np.pi * turn for turn in range(turns)])
        reading = np.tile(reading, turns)
        return Profile(angle, reading + noise * self.rng.standard_normal(angle.size))


def planned(profile, **options):
    return plan_changeover(profile, STOCK, **HOW | options)


@given(
    seed=st.integers(0, 10_000), offset=st.sampled_from([0.0, 0.005, 0.05]), waves=st.sampled_from([(50,), (2, 49, 50), (43, 2)])
)
@settings(max_examples=25, deadline=None)
def test_the_largest_radius_about_the_spindle_is_never_less_than_the_true_one(seed, offset, waves):
    ring = Ring(seed, waves=waves, offset=offset)
    true = ring.distances((0.0, 0.0), 50_000)[1]
    profile = ring.profile()
    found = planned(profile, radius_sd=0.0).largest_radius
    rise = (profile.rise_between_samples(50) - 1) * np.ptp(true)
    assert true.max() - 1e-9 <= found <= true.max() + rise + offset * 1e-3
    bore = planned(profile, radius_sd=0.0, **BORE).largest_radius
    assert true.min() + 1e-9 >= bore >= true.min() - rise - offset * 1e-3


@given(seed=st.integers(0, 10_000), eccentricity=st.floats(0.0, 0.01))
@settings(max_examples=8, deadline=None)
def test_a_part_that_is_centred_anew_stays_within_its_circle(seed, eccentricity):
    """About any axis that lies so far from the centre of the circle."""
    ring = Ring(seed, offset=0.3, waves=(2, 3, 7))
    profile = ring.profile(720)
    for kind, sign, options in (("MCC", 1, {}), ("MIC", -1, BORE)):
        change = planned(profile, eccentricity=eccentricity, radius_sd=0.0, upr=10, **options)
        center = profile.roundness(kind).center
        for way in np.linspace(0, 2 * np.pi, 7):
            true = ring.distances(center + eccentricity * np.array([np.cos(way), np.sin(way)]), 20_000)[1]
            assert sign * change.largest_radius >= (sign * true).max() - 1e-9
        circle = profile.roundness(kind).radius + sign * eccentricity
        assert change.largest_radius == pytest.approx(circle, abs=(profile.rise_between_samples(10) - 1) * 0.01 + 1e-6)


def test_parts_stand_out_no_oftener_than_told():
    """150 noisy profiles at z = 1: at most 16 % of the parts reach into the gap, and the sd is that of the noise."""
    out = []
    for seed in range(150):
        ring = Ring(seed, waves=(2,))
        change = planned(ring.profile(noise=1e-4), sigmas=1.0, upr=5)
        out.append(ring.distances((0.0, 0.0), 3600)[1].max() > change.position - change.gap)
        assert change.radius_sd == pytest.approx(1e-4, rel=0.25)
    assert np.mean(out) <= change.contact_probability.part + 3 * np.sqrt(0.16 * 0.84 / 150)


def test_form_is_no_uncertainty():
    """A part 120 um out of round is known as well as a round one, its centre too."""
    ring = Ring(1, waves=(2,), size=0.06)
    sure = planned(ring.profile(noise=1e-4), eccentricity=0.0, upr=5)
    assert 1e-4 * 0.75 < sure.radius_sd < 1e-4 * 1.3


def test_several_turns_and_what_was_told():
    ring = Ring(2)
    change = planned(ring.profile(turns=3, noise=1e-4), crash_time=300.0, combine="rss")
    assert change.combine == "rss" and change.crash_time == 300.0 and change.time_saved > 0
    assert change.largest_radius == pytest.approx(ring.distances((0.0, 0.0), 5000)[1].max(), abs=2e-3)
    assert planned(ring.profile(noise=1e-4), radius_sd=0.002).radius_sd == 0.002


# Refusals and warnings -----------------------------------------------------------------------------------------------


def test_warnings():
    with pytest.warns(
        UserWarning, match=r"largest_radius of 65\.\d+ mm lies beyond the changeover .* at 62\.142 mm: .*3\.3 mm off the spindle"
    ):
        change = planned(Ring(3, offset=3.3).profile(noise=1e-4))
    assert change.outside_population and change.time_saved < 0
    with pytest.warns(UserWarning, match=r"smallest_radius of 6\d\.\d+ mm lies beyond"):
        planned(Ring(3, offset=0.3).profile(noise=1e-4), **BORE)
    with pytest.warns(UserWarning, match=r"the part is outside the population$"):
        planned(Ring(3).profile(noise=1e-4), finish_radius=61.7, eccentricity=0.0)
    with pytest.warns(UserWarning, match=r"leaves nothing to grind to 62\.1 mm"):
        planned(Ring(3).profile(noise=1e-4), finish_radius=62.1)
    with pytest.warns(
        UserWarning, match="profile should not be filtered, as that takes peaks off: it is Gaussian low-pass, 15 upr"
    ):
        planned(Ring(3).profile(noise=1e-4).filter("gaussian", upr=15))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"gap": -0.01}, r"gap must be >= 0 \(mm\); got -0.01"),
        ({"approach_rate": 0.0}, r"approach_rate must be > 0 \(mm/s\); got 0.0"),
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
        ValueError, match=r"radius_sd must be given \(mm\) where the profile tells no noise: 4 samples are too few"
    ):
        planned(few, upr=1.0)
