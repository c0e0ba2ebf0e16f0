"""Local slope, run-out and concentricity: published figures, straight loops, bounds of the standards."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_filter_kinds import ring, wavy

from centering.roundness import Profile, Sections
from sdpgrind import units

SLOPES = {5: 0.608148, 10: 0.817227, 30: 1.847080, 45: 1.997836}  # um by degrees


@pytest.mark.parametrize("degrees", SLOPES)
def test_slope_of_the_filtered_form(degrees):
    found = ring(wavy(3600)).filter(upr=50).slope(units.deg(degrees))
    assert found.value == pytest.approx(units.um(SLOPES[degrees]), abs=units.um(1e-5))
    assert found.steepest <= found.value


@given(
    st.integers(0, 2**32 - 1), st.integers(16, 60), st.floats(0.3, 3.0), st.sampled_from(["even", "anyhow"])
)
def test_slope_by_straight_loops(seed, size, window, how):
    rng = np.random.default_rng(seed)
    angle = np.arange(size) * 2 * np.pi / size
    if how == "anyhow":
        angle = rng.permutation(angle + rng.uniform(-0.2, 0.2, size) / size)
    profile = Profile(angle, 30.0 + 1e-3 * rng.normal(size=size))
    if window < 4.5 * np.pi / size:
        return
    found = profile.slope(window)
    order = np.argsort(np.mod(profile.part_angle, 2 * np.pi))
    place, high = np.mod(profile.part_angle, 2 * np.pi)[order], profile.deviation[order]
    rises, ends, begins = [], [], []
    for k, first in enumerate(place):
        ahead = np.mod(place - first, 2 * np.pi)
        inside = np.flatnonzero(ahead <= window * (1 + 1e-9))
        rises.append(np.ptp(high[inside]))
        ends.append(abs(high[inside[np.argmax(ahead[inside])]] - high[k]))
        begins.append(first)
    assert found.value == pytest.approx(max(rises), abs=1e-15)
    assert found.steepest == pytest.approx(max(ends), abs=1e-15)
    assert rises[begins.index(found.angle)] == found.value


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.05), st.floats(-np.pi, np.pi))
def test_run_out_lies_about_twice_the_eccentricity(seed, offset, direction):
    """2 e - RONt <= run-out <= 2 e + RONt about the circle's centre, to e^2/R."""
    rng = np.random.default_rng(seed)
    angle = np.arange(180) * 2 * np.pi / 180
    waves = sum(rng.normal() * 1e-3 / n * np.cos(n * angle - rng.uniform(0, 6)) for n in range(2, 8))
    profile = Profile(angle, 30.0 + offset * np.cos(angle - direction) + waves)
    datum = rng.uniform(-0.03, 0.03, 2)
    for kind in ("LSC", "MZC"):
        form = profile.roundness(kind)
        assert np.hypot(form.offset * np.cos(form.offset_angle) - form.center[0], 0) < 1e-12
        for about, runout in (((0, 0), profile.radial_runout()), (datum, profile.radial_runout(datum))):
            twice = 2 * np.hypot(*(form.center - about))
            assert twice - form.ron_t - 1e-4 <= runout <= twice + form.ron_t + 1e-4
    eccentricity = np.hypot(*(profile.circle.value[1:] - datum))
    assert profile.concentricity(datum) == pytest.approx(2 * eccentricity, abs=1e-12)


def test_windows_and_axes_that_are_refused():
    profile = ring(wavy(360))
    with pytest.raises(ValueError, match=r"window must be 0\.03491, two steps, ... pi \(rad\)"):
        profile.slope(0.01)
    with pytest.raises(ValueError, match=r"window must be 0\.03491, two steps"):
        profile.slope(10)
    with pytest.raises(
        ValueError, match=r"datum must be \(x, y\) \(mm\), a Cylinder, or two profiles; got 0.1"
    ):
        profile.radial_runout(0.1)


HEIGHTS = np.array([0.0, 8.0, 20.0, 30.0])


def shaft():
    """Three lobes on a shaft that leans and is bent, mm."""
    angle = np.arange(180) * 2 * np.pi / 180
    lean = [(0.004 + 2e-4 * z, 1e-4 * z - 1e-5 * z * (30 - z)) for z in HEIGHTS]
    made = [Profile(20 + x * np.cos(angle) + y * np.sin(angle) + 5e-4 * np.cos(3 * angle)) for x, y in lean]
    return Sections(made, HEIGHTS)


def test_run_out_about_two_bearings():
    """By hand: each reading about the point of the line through both centres at its height."""
    part = shaft()
    first, last = part.profiles[0], part.profiles[-1]
    widest, everything = [], []
    for profile, height, center in zip(part.profiles, HEIGHTS, part.centers, strict=True):
        x, y = part.centers[0, :2] + (part.centers[-1, :2] - part.centers[0, :2]) * height / 30
        radius = np.hypot(profile.points[:, 0] - x, profile.points[:, 1] - y)
        found = profile.radial_runout((first, last), heights=(height, 0.0, 30.0))
        assert found == pytest.approx(np.ptp(radius), abs=1e-12)
        widest.append(np.hypot(center[0] - x, center[1] - y))
        everything.append(radius)
    assert part.total_runout((first, last)) == pytest.approx(np.ptp(everything), abs=1e-7)  # tilt^2 R/2
    assert part.coaxiality((first, last)) == pytest.approx(2 * max(widest), abs=1e-9)
    assert first.radial_runout((first, last), heights=(0, 0, 30)) == pytest.approx(1e-3, abs=1e-6)


def test_run_out_about_a_cylinder():
    part = shaft()
    axis = part.cylinder("LSC")
    for profile, height in zip(part.profiles, HEIGHTS, strict=True):
        assert profile.radial_runout(axis, heights=height) == profile.radial_runout(axis.at(height))


def test_datums_that_are_refused():
    part = shaft()
    first, last = part.profiles[0], part.profiles[-1]
    for call, said in (
        (
            lambda: first.radial_runout((first, last)),
            r"heights must be of this section and of the two of datum",
        ),
        (lambda: first.radial_runout((first, last), heights=(0, 5, 5)), r"must differ \(mm\); got 5 of both"),
        (lambda: first.radial_runout(part.cylinder()), "heights must be that of this section for a cylinder"),
        (
            lambda: first.radial_runout((0.0, 0.0), heights=3.0),
            "heights must be left out for an axis parallel",
        ),
        (lambda: part.total_runout((first, ring(wavy(360)))), "datum must be two of the profiles of these"),
        (lambda: part.total_runout((first, first)), "two sections of different heights"),
        (lambda: part.coaxiality(0.1), r"datum must be \(x, y\) \(mm\), a Cylinder, or two of the profiles"),
    ):
        with pytest.raises(ValueError, match=said):
            call()
    with pytest.raises(TypeError, match=r"datum must be .* or two profiles"):
        first.radial_runout((first, 3.0), heights=(0, 1, 2))
