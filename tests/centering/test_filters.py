import warnings

import numpy as np
import pytest
from circle_inside import Filter, gaussian
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_rings import TIP, form, measured, phases, turn, vector

from centering.roundness import Profile

pytestmark = pytest.mark.filterwarnings("ignore:Roundness.value_:DeprecationWarning")


def iso_weights(size, cut_off):
    """Weight function of ISO 16610-21 on an even turn, put on end over the turns: exp(-pi (x/(alpha
    cut))^2)/(alpha cut).
    """
    alpha, cut = np.sqrt(np.log(2) / np.pi), 2 * np.pi / cut_off
    place = np.arange(-8 * size, 8 * size) * 2 * np.pi / size
    weights = np.exp(-np.pi * (place / (alpha * cut)) ** 2) / (alpha * cut) * 2 * np.pi / size
    return weights.reshape(16, size).sum(axis=0)


def convolved(values, weights):
    """Circular convolution, sum by sum."""
    size = values.size
    return np.array([sum(weights[k] * values[(j - k) % size] for k in range(size)) for j in range(size)])


@pytest.mark.parametrize(("size", "cut_off"), [(600, 15), (513, 24.5), (1024, 50)])
def test_fft_equals_the_direct_convolution(size, cut_off):
    values = np.random.default_rng(0).normal(size=size)
    assert Filter("gaussian", 1.0, cut_off).applied(values) == pytest.approx(
        convolved(values, iso_weights(size, cut_off)), abs=1e-13
    )


@pytest.mark.parametrize(("size", "cut_off"), [(3600, 50), (1024, 50), (1025, 24.5), (720, 15)])
def test_another_package_filters_alike(size, cut_off):
    """surfalize ends its kernel at 4 sd, beyond which 6.3e-5 of it lies: as much of each amplitude is missing."""
    from surfalize import Profile as Line
    from surfalize.filter import GaussianFilter

    rng, angle = np.random.default_rng(size), turn(1, size)
    waves = [rng.normal() * np.cos(n * angle - rng.uniform(0, 2 * np.pi)) for n in range(2, 3 * int(cut_off))]
    deviation = 1e-4 * sum(waves)
    ours = Profile.from_deviation(deviation, radius=30.0).filter("gaussian", upr=cut_off).deviation
    other = GaussianFilter(size / cut_off, "lowpass", endeffect_mode="wrap")(Line(deviation, 1.0)).data
    np.testing.assert_allclose(
        other - other.mean(), ours - ours.mean(), rtol=0, atol=1e-4 * np.ptp(deviation)
    )


@pytest.mark.parametrize("cut_off", [15, 50, 150, 500, 1500])
def test_one_half_passes_at_the_cut_off(cut_off):
    assert gaussian(cut_off, cut_off) == 0.5
    values = np.cos(cut_off * turn(1, 8 * cut_off) - 0.4)
    assert Filter("gaussian", 1.0, cut_off).applied(values) == pytest.approx(values / 2, abs=1e-12)


@pytest.mark.parametrize("offset", [0.0, 3.6, 25.0])
def test_lines_of_an_offset_ring(offset):
    lobes, angle = phases(0), turn(1, 720)
    clean = Profile(angle, measured(angle, offset=offset, lobes=lobes), tip_radius=TIP).filter(
        "gaussian", upr=50
    )
    found = clean.harmonics(60)
    for upr in range(2, 61):
        amplitude, phase = lobes.get(upr, (0.0, 0.0))
        assert abs(vector(found, upr) - 0.5 ** ((upr / 50) ** 2) * amplitude * np.exp(1j * phase)) < 1e-10
    passed = {upr: (0.5 ** ((upr / 50) ** 2) * a, p) for upr, (a, p) in lobes.items()}
    assert clean.deviation == pytest.approx(form(clean.part_angle, passed), abs=1e-10)


def test_a_filtered_profile_is_the_same_ring():
    angle, lobes = turn(1, 720), phases(1)
    before = Profile(angle, measured(angle, offset=3.6, direction=-2.0, lobes=lobes), tip_radius=TIP)
    after = before.filter(upr=50)
    assert after.circle.offset == pytest.approx(3.6, abs=1e-9)
    assert after.circle.offset_angle == pytest.approx(-2.0, abs=1e-9)
    assert after.circle.radius == pytest.approx(61.94, abs=1e-9)
    assert after.part_angle == pytest.approx(turn(1, 720), abs=1e-12)  # an even grid of the part's angle
    assert (after.turns, after.points_per_turn) == pytest.approx((1.0, 720.0), rel=1e-3)
    x, y = after.points.T  # the tip's centre about the spindle, from the samples themselves
    center = 3.6 * np.array([np.cos(-2.0), np.sin(-2.0)])
    assert np.hypot(x - center[0], y - center[1]) - TIP == pytest.approx(after.radii, abs=1e-8)
    assert after.steps[0].startswith(
        "Gaussian low-pass, 50 upr, 250 harmonics by least squares of 720 samples, condition 1.0"
    )


@settings(max_examples=20, deadline=None)
@given(one=st.floats(5, 50), other=st.floats(5, 50))
def test_two_filters_are_one(one, other):
    """Gaussians multiply: 1/c^2 adds up."""
    angle = turn(1, 400)
    profile = Profile(angle, measured(angle, offset=1.0, lobes=phases(2)), tip_radius=TIP)
    twice = profile.filter(upr=one).filter(upr=other)
    both = gaussian(np.arange(2, 60), (one**-2 + other**-2) ** -0.5)
    assert twice.harmonics(59).amplitude[1:] == pytest.approx(
        profile.harmonics(59).amplitude[1:] * both, abs=1e-10
    )
    assert twice.steps[1].endswith("by FFT")


def test_several_turns_are_averaged():
    lobes = {3: (1e-3, 0.4), 20: (5e-4, 1.0)}
    one, nine = turn(1, 180), turn(9, 180)
    errors = []
    for angle in (one, nine):
        exact = (
            Profile(angle, measured(angle, offset=2.0, lobes=lobes), tip_radius=TIP).filter(upr=20).deviation
        )
        noisy = [measured(angle, offset=2.0, lobes=lobes, noise=1e-4, rng=seed) for seed in range(12)]
        found = [Profile(angle, reading, tip_radius=TIP).filter(upr=20) for reading in noisy]
        errors.append(np.sqrt(np.mean([(p.deviation - exact) ** 2 for p in found])))
        # and each says how sure it is
        assert np.mean([p.noise_sd for p in found]) == pytest.approx(errors[-1], rel=0.15)
    assert errors[0] / errors[1] == pytest.approx(3.0, rel=0.15)


@pytest.mark.parametrize("lost", ["uneven", "missing", "repeated"])
def test_samples_as_they_lie(lost):
    rng = np.random.default_rng(3)
    angle = turn(2, 360) + rng.uniform(-0.005, 0.005, 720)
    if lost == "missing":
        angle = np.delete(angle, [*range(40, 44), *range(400, 404), *rng.integers(0, 700, 40)])
    if lost == "repeated":
        angle = rng.permutation(np.concatenate([angle, angle[:50], angle[:50]]))
    lobes = {2: (1e-3, 0.2), 7: (2e-3, 1.0), 30: (1e-3, -1.0)}
    found = (
        Profile(angle, measured(angle, offset=3.6, lobes=lobes), tip_radius=TIP).filter(upr=30).harmonics(40)
    )
    for upr in (2, 7, 30):
        amplitude, phase = lobes[upr]
        assert abs(vector(found, upr) - 0.5 ** ((upr / 30) ** 2) * amplitude * np.exp(1j * phase)) < 1e-9


@pytest.mark.filterwarnings("ignore:Gaussian low-pass, 50 upr. a gap")
def test_a_gap_takes_fewer_harmonics():
    angle = turn(1, 720)
    angle = angle[(angle < 1.0) | (angle > 1.12)]
    lobes = {2: (1e-3, 0.2), 7: (2e-3, 1.0), 45: (1e-3, -1.0)}
    clean = Profile(angle, measured(angle, offset=1.0, lobes=lobes), tip_radius=TIP).filter(upr=50)
    found = clean.harmonics(50)
    for upr, (amplitude, phase) in lobes.items():
        assert abs(vector(found, upr) - 0.5 ** ((upr / 50) ** 2) * amplitude * np.exp(1j * phase)) < 1e-9
    assert "50 harmonics by least squares of 706 samples" in clean.steps[0]
    assert "a gap of 7.61 degrees is bridged, not measured" in clean.steps[0]


def over_an_arc(degrees, cut_off, seed, lobes=None):
    angle = np.radians(np.arange(0.0, degrees))
    reading = measured(angle, offset=1.0, lobes=lobes or {3: (1e-3, 0.4)}, noise=1e-5, rng=seed)
    return Profile(angle, reading, tip_radius=TIP).filter(upr=cut_off)


def test_nothing_is_invented_over_a_gap():
    """An arc of 320 degrees, 15 harmonics: condition 63; a form of 2 um would come out as 3 to 7."""
    with pytest.raises(
        ValueError,
        match=r"got 15 upr with a gap of 41.3 degrees \(condition of their fit 62.8, at most 10\): up to 4 upr",
    ):
        over_an_arc(320, 15, 0)


@pytest.mark.filterwarnings("ignore:Gaussian low-pass, 15 upr. a gap")
def test_a_bridged_gap_says_how_sure_it_is():
    """The sd of each deviation, and that of the roundness, are the scatter; even in the gap."""
    found = [over_an_arc(335, 15, seed) for seed in range(40)]
    scatter = np.std([profile.deviation for profile in found], axis=0, ddof=1)
    told = np.mean([profile.deviation_sd for profile in found], axis=0)
    # 24 coefficients pass
    assert np.sqrt(np.mean((scatter / told) ** 2)) == pytest.approx(1.0, abs=4 / np.sqrt(2 * 39 * 24))
    gap = np.argmax(told)
    assert scatter[gap] == pytest.approx(told[gap], rel=4 / np.sqrt(2 * 40))
    assert told[gap] > 5 * np.median(told)
    assert 335 < np.degrees(found[0].part_angle[gap]) < 360
    for kind in ("LSC", "MZC"):
        values = [profile.roundness(kind) for profile in found]
        heights = np.array([circle.value for circle in values])
        assert heights == pytest.approx(2e-3 * 0.5 ** ((3 / 15) ** 2), abs=5e-5)  # five sd of a reading
        assert heights.std() <= 1.4 * np.mean([circle.value_sd for circle in values])


@pytest.mark.filterwarnings("ignore:Gaussian low-pass, 15 upr. a gap")
def test_a_peak_in_a_gap_is_unsure():
    """Of a roundness with its peak where nothing was measured the sd is that of the gap."""
    lobes = {3: (1e-3, 3 * np.radians(348.0))}
    found = [over_an_arc(335, 15, seed, lobes).roundness("LSC") for seed in range(40)]
    scatter = np.std([circle.value for circle in found])
    assert np.mean([circle.value_sd for circle in found]) > 0.5 * scatter
    assert scatter > 8e-6


def test_a_gap_is_told_and_warned_of():
    with pytest.warns(
        UserWarning, match=r"15 upr: a gap of 21.2 degrees is bridged, .* to ± 0.02 µm \(sd\), elsewhere"
    ):
        clean = over_an_arc(340, 15, 0)
    assert "19 harmonics" in clean.steps[0] and "is bridged" in clean.steps[0]
    assert clean.filter(upr=5).deviation_sd.max() < clean.deviation_sd.max()
    assert "is bridged" not in over_an_arc(360, 15, 0).steps[0]


def test_what_a_filter_takes_away():
    angle, lobes = turn(3, 360), {3: (1e-3, 0.4), 100: (5e-4, 1.0)}
    profile = Profile(angle, measured(angle, offset=2.0, lobes=lobes), tip_radius=TIP)
    clean = profile.filter(upr=50)
    taken = form(
        profile.part_angle, {n: ((1 - 0.5 ** ((n / 50) ** 2)) * a, p) for n, (a, p) in lobes.items()}
    )
    assert clean.residuals == pytest.approx(taken, abs=1e-9)
    again = clean.filter(upr=5)
    assert again.residuals == pytest.approx(clean.deviation - again.deviation, abs=1e-12)


def test_few_samples_for_each_undulation_are_warned_of():
    angle = turn(1, 360)
    profile = Profile(angle, measured(angle, lobes={3: (1e-3, 0.5)}), tip_radius=TIP)
    with pytest.warns(
        UserWarning,
        match=r"360 points a turn are 2.4 for each undulation at the cut-off of 150 upr.*51.4 upr at most",
    ):
        profile.filter(upr=150)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        profile.filter(upr=50)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"upr": 45}, r"upr must be < 45, half of the points of one turn \(upr\); got 45.0"),
        ({"kind": "Gauss"}, "kind must be one of gaussian, spline, 2rc, robust; got 'Gauss'"),
        (
            {"upr": (15, 5)},
            r"upr must be a pair \(low, high\) with 1 <= low < high, one of them given \(upr\)",
        ),
        ({"upr": (None, None)}, "upr must be a pair"),
        ({"upr": (1, 2, 3)}, r"upr must be a cut-off or a pair of them, as \(15, 150\) or \(15, None\)"),
        ({"upr": "15-50"}, "upr must be one of 1-15, 1-50, 1-150, 1-500, 2-15, 15-150, 15-500; got '15-50'"),
        ({"kind": "spline", "tension": 1.5, "upr": 5}, r"tension must be in \[0, 1\]; got 1.5"),
        (
            {"tension": 0.5, "upr": 5},
            "tension must be left out of kind gaussian: it belongs to spline; got 0.5",
        ),
        ({"kind": "robust", "upr": (5, 15)}, "upr must be one cut-off for kind robust"),
        ({"upr": 0}, r"upr must be > 0 \(upr\); got 0.0"),
    ],
)
def test_bad_filters(asked, said):
    angle = turn(2, 90)
    with pytest.raises(ValueError, match=said):
        Profile(angle, measured(angle)).filter(**asked)


def test_samples_that_do_not_allow_a_filter():
    angle = turn(0.75, 120)
    with pytest.raises(
        ValueError, match="reading must have at least 101 samples for a Gaussian low-pass, 50 upr; got 90"
    ):
        Profile(angle, measured(angle)).filter(upr=50)
    half = turn(0.5, 720)
    with pytest.raises(
        ValueError,
        match=r"upr must ask for waves that the samples determine; got 50 upr with a gap of 18\d deg.*at most 10\)",
    ):
        Profile(half, measured(half)).filter(upr=50)
