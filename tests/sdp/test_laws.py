"""Every closed form against quadrature of the density and against samples; invariants as properties."""

import itertools
import pickle
from math import erf, exp, log, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats
from sdp_inside import hats, quick

from sdpgrind import sdp

SAMPLE = np.array([0.3, 0.5, 0.55, 0.8, 1.4])


def rayleigh_density(mean, sd):
    q = sd / sqrt(2 - pi / 2)
    start = mean - q * sqrt(pi / 2)
    if start < 0:
        q, start = mean / sqrt(pi / 2), 0.0
    return (lambda d: (d - start) / q**2 * exp(-((d - start) ** 2) / (2 * q * q))), start, start + 9.5 * q


def lognormal_density(mean, sd):
    var = log(1 + (sd / mean) ** 2)
    mu, s = log(mean) - var / 2, sqrt(var)
    return (
        (lambda d: exp(-((log(d) - mu) ** 2) / (2 * var)) / (d * s * sqrt(2 * pi))),
        exp(mu - 9.5 * s),
        exp(mu + 9.5 * s),
    )


def normal_density(mean, sd):
    return (
        (lambda d: exp(-(((d - mean) / sd) ** 2) / 2) / (sd * sqrt(2 * pi))),
        mean - 9.5 * sd,
        mean + 9.5 * sd,
    )


CONTINUOUS = {
    "rayleigh": (sdp.Rayleigh, rayleigh_density),
    "lognormal": (sdp.LogNormal, lognormal_density),
    "normal": (sdp.Normal, normal_density),
}


def by_quadrature(density, low, high, y, power, side):
    """E((y - D)+)^p or E((D - y)+)^p by adaptive quadrature in panels; relative accuracy since nothing
    cancels.
    """
    a, b = (low, min(max(y, low), high)) if side == "under" else (min(max(y, low), high), high)
    edges = np.linspace(a, b, 17)
    weight = (lambda d: (y - d) ** power) if side == "under" else (lambda d: (d - y) ** power)
    parts = [
        integrate.quad(lambda d: weight(d) * density(d), p, q, epsabs=0, epsrel=1e-12, limit=200)[0]
        for p, q in itertools.pairwise(edges)
        if q > p
    ]
    return sum(parts)


@pytest.mark.parametrize("name", CONTINUOUS)
@pytest.mark.parametrize(("mean", "sd"), [(1.0, 0.15), (0.05, 0.0375), (0.3, 0.3 / 1.9130583)])
@pytest.mark.parametrize("side", ["under", "over"])
@pytest.mark.parametrize("power", [0, 1, 2])
def test_partial_moments_against_quadrature(name, mean, sd, side, power):
    law_class, density_of = CONTINUOUS[name]
    law = law_class(mean, sd)
    density, low, high = density_of(mean, sd)
    # Far tails included: 6 standard deviations out, the relative error still has to be small.
    for y in mean + sd * np.array([-2.5, -1.7, -0.6, 0.0, 0.3, 2.0, 6.0]):
        expected = by_quadrature(density, low, high, y, power, side)
        got = float(getattr(law, side)(y, power))
        assert got == pytest.approx(expected, rel=2e-10, abs=1e-14 * sd**power)


@pytest.mark.parametrize("power", [0, 1, 2])
def test_lower_tail_of_rayleigh_keeps_relative_accuracy(power):
    # Two terms of the series about the start of the support, u = 1e-3: E((u - Rho)+)^p.
    law, u = sdp.Rayleigh(sqrt(pi / 2), sqrt(2 - pi / 2)), 1e-3
    leading = {0: u**2 / 2 - u**4 / 8, 1: u**3 / 6 - u**5 / 40, 2: u**4 / 12 - u**6 / 120}[power]
    assert float(law.under(u, power)) == pytest.approx(leading, rel=1e-11)


def test_rayleigh_series_meets_closed_form():
    law = sdp.Rayleigh(sqrt(pi / 2), sqrt(2 - pi / 2))
    for power in (1, 2):
        below, above = law.under([1 - 1e-12, 1 + 1e-12], power)
        assert above == pytest.approx(below, rel=1e-11)


def test_rayleigh_closed_form_of_the_source():
    # G = u - q sqrt(pi/2) erf(u/(q sqrt 2)) written out by hand.
    mean, sd, y = 1.0, 0.15, 1.1
    q = sd / sqrt(2 - pi / 2)
    u = y - (mean - q * sqrt(pi / 2))
    assert float(sdp.Rayleigh(mean, sd).under(y)) == pytest.approx(
        u - q * sqrt(pi / 2) * erf(u / (q * sqrt(2))), rel=1e-13
    )


def test_rayleigh_switch():
    assert pytest.approx(1.913058, abs=5e-7) == sdp.Rayleigh.SWITCH
    mean = sdp.Rayleigh.SWITCH * 0.1
    below, above = sdp.Rayleigh(mean * (1 - 1e-9), 0.1), sdp.Rayleigh(mean * (1 + 1e-9), 0.1)
    y = np.linspace(-0.1, 0.6, 57)
    for power in (0, 1, 2):
        np.testing.assert_allclose(below.under(y, power), above.under(y, power), atol=1e-8)
        np.testing.assert_allclose(below.over(y, power), above.over(y, power), atol=1e-8)
    cut = sdp.Rayleigh(0.1, 0.1)
    assert cut.sd == pytest.approx(0.522723 * 0.1, rel=1e-6)
    assert cut.support[0] == 0.0


LAWS = {
    "rayleigh": lambda m, s: sdp.Rayleigh(m, s),
    "lognormal": lambda m, s: sdp.LogNormal(m, s),
    "normal": lambda m, s: sdp.Normal(m, s),
    "rectified": lambda m, s: sdp.RectifiedNormal(m, s),
    "empirical": lambda m, s: sdp.Empirical(m, s, SAMPLE),
    "two-sided empirical": lambda m, s: sdp.Empirical(m, s, SAMPLE, rectified=False),
    "smoothed": lambda m, s: sdp.Empirical(m, s, SAMPLE, bandwidth=0.3),
    "two-sided smoothed": lambda m, s: sdp.Empirical(m, s, SAMPLE, bandwidth=0.3, rectified=False),
    "discrete": lambda m, s: sdp.Discrete(np.stack(np.broadcast_arrays(m - s, m + s), axis=-1)),
}
HONEST = {"rayleigh", "lognormal", "normal", "two-sided empirical", "two-sided smoothed", "discrete"}


@pytest.mark.parametrize("name", LAWS)
@settings(max_examples=40, deadline=None)
@given(mean=st.floats(0.0, 2.0), ratio=st.floats(0.0, 0.5), step=st.sampled_from([1e-3, 1e-2, 0.1]))
def test_second_differences_are_probabilities(name, mean, ratio, step):
    sd = ratio * mean
    law = LAWS[name](np.array(mean), np.array(sd))
    low, high = law.support
    k = np.arange(np.floor(low / step) - 2, np.ceil(high / step) + 3)
    weights = np.diff(law.under(k * step), 2) / step
    # Rounding of numbers as large as the last argument, three of them, over one step.
    tolerance = 8 * np.finfo(float).eps * (abs(k[-1]) + abs(k[0]) + 1) + 2e-13
    assert weights.min() >= -tolerance
    assert weights.sum() == pytest.approx(1.0, abs=1e-11)
    # The hat functions reproduce the mean exactly and add at most h^2/4 to the variance.
    middle = (k[1:-1] * step) @ weights
    assert middle == pytest.approx(float(law.mean), abs=1e-9)
    variance = (k[1:-1] * step - law.mean) ** 2 @ weights
    assert law.sd**2 - 1e-9 <= variance <= law.sd**2 + step**2 / 4 + 1e-9


@pytest.mark.parametrize("name", LAWS)
@settings(max_examples=40, deadline=None)
@given(mean=st.floats(0.01, 2.0), ratio=st.floats(0.0, 0.5), y=st.floats(-1.0, 4.0))
def test_under_and_over_agree(name, mean, ratio, y):
    law = LAWS[name](np.array(mean), np.array(ratio * mean))
    gap = y - law.mean
    assert law.under(y, 0) + law.over(y, 0) == pytest.approx(1.0, abs=1e-12)
    assert law.under(y) - law.over(y) == pytest.approx(gap, abs=1e-12)
    assert law.under(y, 2) + law.over(y, 2) == pytest.approx(law.sd**2 + gap**2, rel=1e-9, abs=1e-11)
    rounding = 1e-15 * (mean + abs(y)) ** 2  # of a second moment whose terms cancel
    assert (law.under(y, 2) + rounding) * law.under(y, 0) >= law.under(y) ** 2 * (
        1 - 1e-9
    ) - 1e-18  # Cauchy and Schwarz


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("side", ["under", "over"])
@pytest.mark.parametrize("power", [0, 1, 2])
def test_quick_moments_are_those_of_the_law(name, side, power):
    mean, ratio = np.meshgrid([0.0, 0.02, 0.4, 2.0], [0.0, 1e-9, 0.01, 0.2, 0.5])
    law = LAWS[name](mean[..., None], (ratio * mean)[..., None])
    y = np.sort(np.append(np.linspace(-1.0, 5.0, 1201), [0.02, 0.4, 2.0]))
    # Roundings of moments up to 5: of y less its place, of its share of a cell, and of the sum.
    found, expected = getattr(quick(law), side)(y, power), getattr(law, side)(y, power)
    np.testing.assert_allclose(found, expected, rtol=0, atol=16 * np.finfo(float).eps)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("ratio", [0.0, 1e-9, 0.01, 0.3])
def test_hats_are_second_differences_on_nodes_of_any_distance(name, ratio):
    place = np.sort(np.append(np.linspace(-1.0, 2.0, 41), np.linspace(0.01, 0.3, 18)))
    x = np.linspace(-1.2, 2.2, 35)
    mean = np.linspace(0.0, 2.5, x.size)
    law = LAWS[name](mean, ratio * mean)
    curve = law.under(x - place[:, None])
    twin = np.diff(np.diff(curve, axis=0) / np.diff(place)[:, None], axis=0).T
    # Roundings of moments up to 5, over the least distance.
    atol = 16 * np.finfo(float).eps / np.diff(place).min()
    np.testing.assert_allclose(hats(law, x, place), twin, rtol=0, atol=atol)


@pytest.mark.parametrize("name", LAWS)
def test_samples_follow_the_law(name):
    law = LAWS[name](np.array([1.0, 0.4]), np.array([0.3, 0.2]))
    drawn = law.sample(7, (100_000, 2))
    error = 4.5 / sqrt(100_000)
    np.testing.assert_allclose(drawn.mean(axis=0), law.mean, atol=error * 0.3)
    np.testing.assert_allclose(drawn.std(axis=0), law.sd, atol=3 * error * 0.3)
    for y in (0.2, 0.7, 1.2):
        np.testing.assert_allclose((drawn <= y).mean(axis=0), law.under(y, 0), atol=error / 2)
        np.testing.assert_allclose(np.maximum(drawn - y, 0).mean(axis=0), law.over(y), atol=error * 0.3)


@pytest.mark.parametrize("name", LAWS)
def test_sizes_and_seeds(name):
    law = LAWS[name](np.array([1.0, 0.4]), np.array([0.3, 0.2]))
    assert law.shape == (2,)
    assert law.sample(1).shape == (2,)
    assert law.sample(np.random.default_rng(3), (5, 2)).shape == (5, 2)
    np.testing.assert_array_equal(law.sample(4, (3, 2)), law.sample(4, (3, 2)))
    assert law.under(np.zeros((4, 1))).shape == (4, 2)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(law)).under(0.7), law.under(0.7))


@pytest.mark.parametrize("name", LAWS)
def test_beyond_the_support_there_is_nothing(name):
    law = LAWS[name](np.array([1.0, 0.4]), np.array([0.3, 0.2]))
    low, high = law.support
    assert np.all(law.over(high, 0) < 1e-17)
    assert np.all(law.under(np.nextafter(low, -np.inf), 0) < 1e-17)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(("mean", "sd"), [(0.7, 0.0), (0.0, 0.0)])
def test_without_scatter_a_point_mass(name, mean, sd):
    law = LAWS[name](np.array(mean), np.array(sd))
    point = sdp.Point(mean)
    y = np.array([-1.0, 0.0, 0.699, 0.7, 0.701, 3.0])
    for power in (0, 1, 2):
        np.testing.assert_array_equal(law.under(y, power), point.under(y, power))
        np.testing.assert_array_equal(law.over(y, power), point.over(y, power))
    assert float(law.mean) == mean
    assert float(law.sd) == 0.0
    points, weights = law.nodes(4)
    assert weights.sum() == pytest.approx(1.0)
    assert points @ weights == pytest.approx(mean, abs=1e-14)
    assert float(law.sample(0)) == mean


@pytest.mark.parametrize("law_class", [sdp.Rayleigh, sdp.LogNormal])
def test_no_mean_no_removal(law_class):
    law = law_class([0.0, 1.0], 0.2)
    np.testing.assert_array_equal(law.under([-0.1, 1.0], 0), [0.0, law_class(1.0, 0.2).under(1.0, 0)])
    assert law.sd[0] == 0.0


@pytest.mark.parametrize("name", sorted(HONEST))
def test_requested_moments_are_the_law_s(name):
    law = LAWS[name](np.array([1.0, 0.4]), np.array([0.3, 0.2]))
    np.testing.assert_allclose(law.mean, [1.0, 0.4], rtol=1e-14)
    np.testing.assert_allclose(law.sd, [0.3, 0.2], rtol=1e-14)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_nodes_are_exact_for_polynomials(name, n):
    law = LAWS[name](np.array([1.0, 0.4]), np.array([0.3, 0.2]))
    points, weights = law.nodes(n)
    assert points.shape == weights.shape == (2, points.shape[-1])
    assert points.shape[-1] == n or (name == "discrete" or "empirical" in name)
    np.testing.assert_allclose(weights.sum(axis=-1), 1.0, rtol=1e-13)
    np.testing.assert_allclose(np.sum(points * weights, axis=-1), law.mean, rtol=1e-11)
    if points.shape[-1] > 1 and name != "discrete":
        variance = np.sum((points - law.mean[:, None]) ** 2 * weights, axis=-1)
        np.testing.assert_allclose(variance, law.sd**2, rtol=1e-10)


@pytest.mark.parametrize("name", CONTINUOUS)
def test_nodes_against_higher_moments(name):
    law_class, density_of = CONTINUOUS[name]
    law = law_class(1.0, 0.3)
    density, low, high = density_of(1.0, 0.3)
    points, weights = law.nodes(4)
    for degree in range(8):
        expected = sum(
            integrate.quad(lambda d, p=degree: d**p * density(d), a, b, epsrel=1e-12)[0]
            for a, b in zip(np.linspace(low, high, 20), np.linspace(low, high, 20)[1:], strict=False)
        )
        assert points**degree @ weights == pytest.approx(expected, rel=1e-9)


def test_rectified_normal_against_scipy():
    mean, sd = 0.3, 0.2
    law = sdp.RectifiedNormal(mean, sd)
    norm = stats.norm(mean, sd)
    assert float(law.lost) == pytest.approx(norm.cdf(0), rel=1e-13)
    first = norm.expect(lambda d: d, lb=0)
    second = norm.expect(lambda d: d * d, lb=0)
    assert float(law.mean) == pytest.approx(first, rel=1e-10)
    assert float(law.sd) == pytest.approx(sqrt(second - first**2), rel=1e-9)
    assert float(law.under(0.0, 0)) == pytest.approx(norm.cdf(0), rel=1e-13)
    assert float(law.under(0.25)) == pytest.approx(
        0.25 * norm.cdf(0) + norm.expect(lambda d: 0.25 - d, lb=0, ub=0.25), rel=1e-10
    )
    wholly_below = sdp.RectifiedNormal(-5.0, 0.1)
    assert float(wholly_below.mean) == pytest.approx(0.0, abs=1e-300)
    assert float(wholly_below.sd) == pytest.approx(0.0, abs=1e-150)


def test_empirical_is_its_sample():
    unit = (SAMPLE - SAMPLE.mean()) / SAMPLE.std()
    values = 1.0 + 0.4 * unit
    law = sdp.Empirical(1.0, 0.4, SAMPLE)
    twin = sdp.Discrete(np.maximum(values, 0.0))
    y = np.linspace(-0.5, 2.5, 101)
    for power in (0, 1, 2):
        np.testing.assert_allclose(law.under(y, power), twin.under(y, power), atol=1e-14)
        np.testing.assert_allclose(law.over(y, power), twin.over(y, power), atol=1e-14)


@pytest.mark.parametrize("bandwidth", [0.01, 0.2, 1.5])
def test_smoothed_empirical_is_a_mixture_of_normals(bandwidth):
    law = sdp.Empirical(1.0, 0.4, SAMPLE, bandwidth=bandwidth, rectified=False)
    shrink = 0.4 / sqrt(1 + bandwidth**2)
    centres = 1.0 + shrink * (SAMPLE - SAMPLE.mean()) / SAMPLE.std()
    mixture = sdp.Normal(centres, shrink * bandwidth)
    y = np.linspace(-2, 4, 201)
    for power in (0, 1, 2):
        np.testing.assert_allclose(
            law.under(y, power), mixture.under(y[:, None], power).mean(axis=1), atol=2e-12
        )
        np.testing.assert_allclose(
            law.over(y, power), mixture.over(y[:, None], power).mean(axis=1), atol=2e-12
        )


def test_discrete_weights():
    law = sdp.Discrete([[0.0, 1.0, 4.0], [1.0, 1.0, 1.0]], weights=[2, 1, 1])
    np.testing.assert_allclose(law.mean, [1.25, 1.0])
    np.testing.assert_allclose(law.under(2.0), [0.5 * 2 + 0.25, 1.0])
    np.testing.assert_allclose(law.over(0.0, 0), [0.5, 1.0])  # P(D > y), P(D <= y): the atom at y is below
    drawn = law.sample(0, (40_000, 2))
    assert (drawn[:, 0] == 4.0).mean() == pytest.approx(0.25, abs=0.01)
    _, weights = law.nodes(2)
    np.testing.assert_allclose(weights, [[0.5, 0.25, 0.25]] * 2)


MESSAGES = [
    (lambda: sdp.Rayleigh(-0.1, 0.1), "mean must be >= 0; got -0.1"),
    (lambda: sdp.Rayleigh(0.1, -0.1), "sd must be >= 0; got -0.1"),
    (lambda: sdp.LogNormal([0.1, np.nan], 0.1), r"mean\[1\] must be finite; got nan"),
    (lambda: sdp.Normal(0.0, -2.0), "sd must be >= 0; got -2.0"),
    (lambda: sdp.Discrete([]), "weights must be of positive sum; got 0.0"),
    (lambda: sdp.Discrete([1.0, 2.0], [0.0, 0.0]), "weights must be of positive sum; got 0.0"),
    (lambda: sdp.Discrete([1.0, 2.0], [1.0, -1.0]), "weights must be >= 0; got -1.0"),
    (lambda: sdp.Empirical(1.0, 0.1, []), r"sample must be at least two different numbers; got \[\]"),
    (lambda: sdp.Empirical(1.0, 0.1, [2.0, 2.0]), "sample must be at least two different numbers"),
    (lambda: sdp.Empirical(1.0, 0.1, SAMPLE, bandwidth=0.001), r"bandwidth must be 0 or in \[0.01, 10\]"),
    (lambda: sdp.Normal(0.0, 1.0).under(0.0, 3), "power must be one of 0, 1, 2; got 3"),
    (lambda: sdp.Normal(0.0, 1.0).nodes(0), "n must be >= 1; got 0"),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
