"""Spline, 2RC, robust filter and bands: published forms, second ways, what passes where."""

import numpy as np
import pytest
from circle_inside import Filter, robust_gaussian
from measured_rings import turn
from scipy.integrate import quad
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import spsolve

from centering.roundness import Profile
from sdpgrind import units

WAVES = ((2, 1.0, 0.3), (7, 0.4, 1.1), (33, 0.15, 2.0), (120, 0.08, 0.5))
"""The form of the tables: upr, amplitude (um), phase (rad)."""


def wavy(size, waves=WAVES):
    """The form on an even turn, mm."""
    angle = turn(1, size)
    return units.um(sum(amplitude * np.cos(upr * angle - phase) for upr, amplitude, phase in waves))


def ring(form):
    return Profile(turn(1, form.size), 30.0 + form)


TABLE = [  # RONp, RONv, RONt, RONq about the least squares circle, RONt of the minimum zone, um
    ("gaussian", 0.0, (1.416563, 1.402800, 2.819363, 0.763478, 2.725858)),
    ("spline", 0.0, (1.435347, 1.424576, 2.859922, 0.766736, 2.766427)),
    ("spline", 0.62524, (1.416358, 1.407310, 2.823668, 0.763737, 2.729187)),
    ("2rc", 0.0, (1.448969, 1.451402, 2.900372, 0.766411, 2.804128)),
]


@pytest.mark.parametrize(("kind", "tension", "figures"), TABLE)
def test_the_form_by_each_filter(kind, tension, figures):
    found = ring(wavy(3600)).filter(kind, upr=50, tension=tension)
    lsc, mzc = found.roundness("LSC"), found.roundness("MZC")
    got = np.array([lsc.ron_p, lsc.ron_v, lsc.value, lsc.ron_q, mzc.value])
    np.testing.assert_allclose(got, units.um(np.array(figures)), atol=units.um(1e-5))


BANDS = {
    "1-15": (2.582592, 0.739591),
    "1-50": (2.819363, 0.763478),
    "1-150": (2.977548, 0.769073),
    "2-15": (1.631371, 0.425557),
    "15-150": (0.502342, 0.112945),
    "15-500": (0.561894, 0.122534),
}


@pytest.mark.parametrize("name", BANDS)
def test_bands_of_the_form(name):
    found = ring(wavy(3600)).filter(upr=name).roundness()
    assert (found.value, found.ron_q) == pytest.approx(units.um(np.array(BANDS[name])), abs=units.um(1e-5))


def test_a_band_without_1_upr_has_no_circle_of_its_own(tmp_path):
    from sdpgrind import load

    band = ring(wavy(720)).filter("spline", upr=(15, None))
    assert band.roundness().value == pytest.approx(np.ptp(band.deviation), abs=1e-12)
    with pytest.raises(ValueError, match="kind must be 'LSC' after spline high-pass, 15 upr: another circle"):
        band.roundness("MZC")
    band.save(tmp_path / "band.nc")
    with pytest.raises(ValueError, match="kind must be 'LSC'"):
        load(tmp_path / "band.nc").filter(upr=50).roundness("MCC")
    whole = ring(wavy(720)).filter(upr=(1, 50))
    assert whole.roundness("MZC").value == ring(wavy(720)).filter(upr=50).roundness("MZC").value


@pytest.mark.parametrize(("size", "cut_off"), [(512, 50), (513, 50), (1024, 15), (3600, 150), (7199, 500)])
@pytest.mark.parametrize("tension", [0.0, 0.62524, 1.0])
def test_the_spline_is_a_cyclic_system(size, cut_off, tension):
    """Second way: w + a^2 b D'D w + a^4 (1 - b) (D'D)^2 w = h, 20 random profiles of a size."""
    profiles = np.random.default_rng(size).normal(size=(size, 20))
    step = csc_array(eye_array(size) - eye_array(size, k=1) - eye_array(size, k=1 - size))
    bend = step.T @ step
    stiff = 1 / (2 * np.sin(np.pi * cut_off / size))
    system = eye_array(size) + tension * stiff**2 * bend + (1 - tension) * stiff**4 * (bend @ bend)
    exact = spsolve(csc_array(system), profiles)
    wave = Filter("spline", 1.0, cut_off, tension)
    found = np.column_stack([wave.applied(profile) for profile in profiles.T])
    # the condition of the system, 16 a^4, times the rounding of a number
    assert np.abs(found - exact).max() < 1e-13 * max(16 * stiff**4, 10.0)


@pytest.mark.parametrize("place", [0, 115, 458])
def test_2rc_is_a_convolution_with_exponentials(place):
    """Second way: weights exp(-c sqrt(3) |x|) c sqrt(3)/2, whose transform is 1/(1 + (n/c)^2/3)."""
    cut_off = 5.0
    rate, at = cut_off * np.sqrt(3), turn(1, 720)[place]

    def form(angle):
        return sum(amplitude * np.cos(upr * angle - phase) for upr, amplitude, phase in WAVES[:2])

    def weighed(x):
        return rate / 2 * np.exp(-rate * x) * (form(at - x) + form(at + x))

    exact = quad(weighed, 0.0, 40.0 / rate, limit=200, epsabs=1e-13)[0]
    assert Filter("2rc", 1.0, cut_off).applied(form(turn(1, 720)))[place] == pytest.approx(exact, abs=1e-11)


@pytest.mark.parametrize(
    ("tension", "cut_off", "upr", "passed"),
    [
        (0.0, 15, (7, 15, 30), (0.954716, 0.5, 0.058843)),
        (0.0, 50, (25, 50, 100), (0.941124, 0.5, 0.059035)),
        (0.62524, 15, (7, 15, 30), (0.866593, 0.5, 0.105323)),
        (0.62524, 50, (25, 50, 100), (0.847580, 0.5, 0.105601)),
    ],
)
def test_transmission_of_the_spline(tension, cut_off, upr, passed):
    found = Filter("spline", 1.0, cut_off, tension).transmission(upr, 3600)
    np.testing.assert_allclose(found, passed, atol=1e-6)


def test_a_high_pass_of_2rc_passes_three_quarters_at_its_cut_off():
    passed = Filter("2rc", 15.0, np.inf).transmission([0, 15, 1e6], 10**7)
    np.testing.assert_allclose(passed, [0.0, 0.75, 1.0], atol=1e-9)


def test_one_grain_of_dust():
    """50 um at one of 720 readings: the Gaussian makes 180 % of it, the robust filter 0.2 %."""
    clean = wavy(720, WAVES[:3])
    dusty = clean + np.where(np.arange(720) == 200, units.um(50.0), 0.0)
    found = [
        1e3 * ring(form).filter(kind, upr=50).roundness().value
        for kind in ("gaussian", "robust")
        for form in (clean, dusty)
    ]
    # dust moves the centre by 0.14 um of 30 mm, and part angles by 5e-6 rad: as much of 7.9 um
    np.testing.assert_allclose(found, [2.817970, 7.902722, 2.852400, 2.848451], atol=4e-5)


def test_dust_leaves_neither_radius_nor_centre():
    """50 um at one reading moves the least squares circle by 0.07 and 0.14 um; the filtered one by what the
    form itself changes where the reading lost its weight: a twentieth.
    """
    dust = np.where(np.arange(720) == 200, units.um(50.0), 0.0)
    clean, dusty = (ring(wavy(720, WAVES[:3]) + each).filter("robust", upr=50) for each in (0.0, dust))
    assert np.abs(dusty.circle.value - clean.circle.value).max() < units.um(0.14 / 20)
    assert dusty.harmonics(10).amplitude[0] < units.um(1e-4)
    assert dusty.deviation == pytest.approx(dusty.roundness("LSC").deviation, abs=units.um(1e-4))


def regressed(values, weight, cut_off):
    """Parabolas about each point by least squares, one at a time."""
    place = (np.arange(values.size) + values.size // 2) % values.size - values.size // 2
    distance = place * cut_off / (0.7309134280731705 * values.size)
    window, powers = np.exp(-np.pi * distance**2), distance[:, None] ** np.arange(3)
    found = np.empty_like(values)
    for k in range(values.size):
        root = np.sqrt(window * np.roll(weight, -k))
        found[k] = np.linalg.lstsq(root[:, None] * powers, root * np.roll(values, -k), rcond=None)[0][0]
    return found


def test_the_robust_filter_by_straight_loops():
    values = wavy(96, WAVES[:2]) + np.random.default_rng(0).normal(size=96) * 5e-5
    values[40] += 0.02
    now = regressed(values, np.ones(96), 8.0)
    for _ in range(60):
        bound = 4.4478 * np.median(np.abs(values - now))
        weight = np.maximum(1 - ((values - now) / bound) ** 2, 0.0) ** 2
        now = regressed(values, weight, 8.0)
    # both end where a sweep moves them by 1e-9 of the range, at a rate of 0.8 or less
    assert robust_gaussian(values, 8.0) == pytest.approx(now, abs=1e-8 * np.ptp(now))


def test_the_robust_filter_keeps_what_a_parabola_is_and_says_nothing_of_its_noise():
    exact = ring(wavy(720, WAVES[:1])).filter("robust", upr=15)
    assert np.abs(exact.deviation - wavy(720, WAVES[:1])).max() < 0.02 * 1e-3
    noisy = ring(wavy(720) + 1e-5 * np.random.default_rng(1).normal(size=720)).filter("robust", upr=15)
    assert noisy.noise_sd == np.inf and noisy.roundness().noise_sd.size == 0
    assert noisy.steps == ("robust Gaussian low-pass, 15 upr, by regression",)


@pytest.mark.parametrize(("kind", "most"), [("spline", 1e-9), ("2rc", 1e-9), ("robust", 2e-8)])
def test_uneven_samples_are_filtered_as_even_ones(kind, most):
    """Harmonics of two turns that tremble, against the even turn they stand for (mm)."""
    rng = np.random.default_rng(2)
    angle = turn(2, 360) + rng.uniform(-0.004, 0.004, 720)
    form = units.um(sum(a * np.cos(n * angle - p) for n, a, p in WAVES))
    uneven = Profile(angle, 30.0 + form).filter(kind, upr=15)
    even = ring(wavy(360)).filter(kind, upr=15)
    assert uneven.angle.size == 360
    np.testing.assert_allclose(uneven.deviation, even.deviation, atol=most)


def test_few_points_for_the_robust_filter():
    with pytest.raises(ValueError, match="at least 64 samples for a robust Gaussian low-pass, 5 upr; got 63"):
        ring(wavy(63, WAVES[:1])).filter("robust", upr=5)


@pytest.mark.parametrize("kind", ["gaussian", "spline", "2rc"])
@pytest.mark.parametrize("size", [360, 361])
def test_a_noisy_turn_keeps_its_points(kind, size):
    noisy = wavy(size, WAVES[:2]) + 1e-4 * np.random.default_rng(0).normal(size=size)
    assert ring(noisy).filter(kind, upr=50).angle.size == size
    assert ring(noisy).filter(kind, upr=(15, 50)).angle.size == size


def test_a_high_pass_across_a_gap_is_refused():
    """The fast form that it is made to show is not told from noise there."""
    angle = turn(1, 720)
    angle = angle[(angle < 1.0) | (angle > 1.08)]
    profile = Profile(angle, 30.0 + 1e-3 * np.cos(3 * angle) + 2e-4 * np.cos(100 * angle))
    with pytest.raises(
        ValueError, match=r"upr must be a band with a higher cut-off: a gap of 5 degrees leaves"
    ):
        profile.filter(upr=(15, None))


def test_what_follows_a_robust_filter_has_no_noise_either():
    profile = ring(wavy(720) + 1e-5 * np.random.default_rng(1).normal(size=720)).filter("robust", upr=50)
    assert np.all(profile.filter(upr=15).deviation_sd == np.inf)
    told = profile.report()
    assert "Largest undulations (the noise of the deviations is not known)" in told and "from [" not in told
    with pytest.raises(ValueError, match=r"limits\['RONt \(MZC\)'\]: kind must be 'LSC' after"):
        ring(wavy(720)).filter(upr=(15, 50)).report(limits={"RONt (MZC)": 0.01})
