import numpy as np
import pytest
from circle_inside import fit_harmonics, values_at
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_rings import LOBES, TABLE, TIP, form, measured, phases, turn, vector

from centering import roundness
from centering.roundness import Harmonics, Profile
from sdpgrind.base.stored import decode, encode


def dense(angle, values, degree):
    """Harmonics by least squares of all columns: solution, inverse normal matrix, condition of the
    exponential basis.
    """
    waves = [wave(k * angle) for k in range(1, degree + 1) for wave in (np.cos, np.sin)]
    columns = np.column_stack([np.ones_like(angle), *waves])
    solution = np.linalg.lstsq(columns, values, rcond=None)[0]
    exponential = np.exp(1j * np.outer(angle, np.arange(-degree, degree + 1)))
    return columns, solution, np.linalg.inv(columns.T @ columns), np.linalg.cond(exponential)


def sd_along(inverse, solution, upr):
    """Sd of an amplitude in the direction of its phase."""
    own = slice(2 * upr - 1, 2 * upr + 1)
    towards = solution[own] / np.linalg.norm(solution[own])
    return float(np.sqrt(towards @ inverse[own, own] @ towards))


PLACES = {
    "even": turn(1, 300),
    "offset": turn(1, 300) + 0.3 * np.sin(turn(1, 300)),
    "random": np.random.default_rng(1).uniform(0, 4 * np.pi, 900),
    "gap": np.random.default_rng(2).uniform(0.2, 2 * np.pi, 400),
}


@pytest.mark.parametrize("place", PLACES)
def test_harmonics_equal_dense_least_squares(place):
    angle = PLACES[place]
    values = np.random.default_rng(3).normal(size=angle.size)
    found = fit_harmonics(angle, values, 40)
    columns, solution, inverse, condition = dense(angle, values, 40)
    exact = 1e-14 * condition**2  # what normal equations leave
    assert found.residual == pytest.approx(values - columns @ solution, abs=10 * exact)
    assert 2 * found.coef[1:] == pytest.approx(solution[1::2] - 1j * solution[2::2], abs=10 * exact)
    spread = [sd_along(inverse, solution, upr) for upr in range(1, 41)]
    assert found.amplitude_spread[1:] == pytest.approx(spread, rel=100 * exact)
    assert found.amplitude_spread[0] == pytest.approx(np.sqrt(inverse[0, 0]), rel=100 * exact)
    assert found.condition == pytest.approx(condition, rel=0.1)
    assert found.condition <= condition * (1 + 1e-6)  # Lanczos sees the outermost eigenvalues from within


def test_values_at_is_the_sum_of_the_waves():
    rng = np.random.default_rng(4)
    coef, angle = rng.normal(size=8) + 1j * rng.normal(size=8), rng.uniform(-9, 9, 50)
    slow = coef[0].real + sum(2 * (coef[k] * np.exp(1j * k * angle)).real for k in range(1, 8))
    assert values_at(coef, angle) == pytest.approx(slow, abs=1e-12)


@pytest.mark.parametrize("offset", [0.0, 3.6, 30.0])
def test_lines_of_a_ring_at_any_offset(offset):
    lobes = phases(0)
    angle = turn(1, 720)
    found = Profile(angle, measured(angle, offset=offset, lobes=lobes), tip_radius=TIP).harmonics(60)
    for upr in range(1, 61):
        amplitude, phase = lobes.get(upr, (0.0, 0.0))
        assert abs(vector(found, upr) - amplitude * np.exp(1j * phase)) < 1e-11
    assert found.nyquist == pytest.approx(360)
    assert found.largest(3) == [
        (43.0, pytest.approx(0.235e-3)),
        (3.0, pytest.approx(0.206e-3)),
        (2.0, pytest.approx(0.155e-3)),
    ]


@settings(max_examples=20, deadline=None)
@given(by=st.floats(-3, 3), direction=st.floats(-3, 3))
def test_a_turned_part_has_turned_phases(by, direction):
    angle, lobes = turn(1, 240), {2: (1e-3, 0.3), 5: (2e-3, -1.0), 17: (5e-4, 2.0)}
    turned = {upr: (a, p + upr * by) for upr, (a, p) in lobes.items()}
    found = Profile(
        angle, measured(angle, offset=2.0, direction=direction, lobes=turned), tip_radius=TIP
    ).harmonics(20)
    for upr, (amplitude, phase) in lobes.items():
        assert abs(vector(found, upr) - amplitude * np.exp(1j * (phase + upr * by))) < 1e-10


def test_sd_is_the_scatter():
    angle, lobes = np.delete(turn(1, 180), slice(30, 36)), {3: (1e-3, 0.5), 8: (1e-3, 1.0)}
    clean = measured(angle, offset=3.6, lobes=lobes)
    rng = np.random.default_rng(5)
    found = [Profile(angle, clean + 1e-4 * rng.normal(size=angle.size)).harmonics(20) for _ in range(300)]
    amplitudes = np.array([spectrum.amplitude for spectrum in found])
    ratio = amplitudes.std(axis=0)[[2, 7]] / np.mean([spectrum.sd for spectrum in found], axis=0)[[2, 7]]
    assert ratio == pytest.approx(1.0, abs=4 / np.sqrt(2 * 300))


def test_sd_of_a_full_even_turn():
    angle = turn(4, 360)
    found = Profile(angle, measured(angle, lobes={3: (1e-3, 0.5)}, noise=1e-4), tip_radius=TIP).harmonics(50)
    assert found.sd[1:] == pytest.approx(1e-4 * np.sqrt(2 / angle.size), rel=0.1)


def test_sd_where_hardly_anything_is_left():
    angle = turn(1, 360)
    profile = Profile(angle, measured(angle, lobes={3: (1e-3, 0.5)}, noise=1e-4))
    found = profile.harmonics()
    # what is left of one turn tells no noise: that of fewer harmonics is taken
    assert found.upr[-1] in (178, 179)
    assert found.sd[2] == pytest.approx(1e-4 * np.sqrt(2 / 360), rel=0.25)
    assert Profile(turn(1, 5), measured(turn(1, 5))).harmonics(2).sd[1] == np.inf


def test_table_6_5():
    lines = Harmonics(list(TABLE), [1e-3 * a for a in TABLE.values()], np.zeros(len(TABLE)))
    assert lines.rms == pytest.approx(0.2548e-3, abs=1e-7)
    assert lines.bound == pytest.approx(1.646e-3, abs=1e-12)
    rng, place = np.random.default_rng(6), turn(1, 1024)
    heights = [
        np.ptp(lines.replace(phase=rng.uniform(0, 2 * np.pi, len(TABLE))).deviation(place))
        for _ in range(2000)
    ]
    low, median, high = np.quantile(heights, [0.05, 0.5, 0.95])
    assert (1e3 * low, 1e3 * median, 1e3 * high) == pytest.approx((1.13, 1.23, 1.34), abs=0.02)


def test_what_one_turn_without_the_joint_fit_would_show():
    """Runout of 1.5 um at 16.517 upr leaks into the lines of one turn: why FFT, or a band-stop, of one turn
    will not do.
    """
    angle, worst = turn(1, 360), np.zeros(180)
    for phase in np.linspace(0, np.pi, 37):
        tone = 1.5e-3 * np.cos(16.517 * angle - phase)
        worst = np.maximum(worst, 2 * np.abs(np.fft.rfft(tone))[:180] / 360)
    assert 1e3 * worst[[2, 3, 16]] == pytest.approx([0.059, 0.060, 0.94], abs=0.005)
    seen = Profile(angle, measured(angle, runout=(1.5e-3, 16.517, 0.0))).harmonics(50)
    assert seen.amplitude[15] > 0.9e-3


def test_deviation_of_waves_that_do_not_close():
    lines = Harmonics([2.5, 3], [1e-3, 2e-3], [0.1, 0.2])
    place = np.linspace(0, 9, 12).reshape(3, 4)
    slow = 1e-3 * np.cos(2.5 * place - 0.1) + 2e-3 * np.cos(3 * place - 0.2)
    assert lines.deviation(place) == pytest.approx(slow, abs=1e-16)
    whole = Harmonics([2, 3], [1, 2], [0.1, 0.2]).deviation(place)
    assert whole == pytest.approx(form(place, {2: (1, 0.1), 3: (2, 0.2)}), abs=1e-13)
    assert Harmonics([3, 3], [1, 1], [0, 0]).deviation(0.0) == pytest.approx(2.0)


def test_a_spectrum_is_frozen_and_equal_by_value():
    lines = Harmonics([2, 3], [1e-3, 2e-3], [0.1, 0.2], [1e-6, 1e-6], 180)
    assert lines == decode(encode(lines))
    assert hash(lines) == hash(decode(encode(lines)))
    assert lines != lines.replace(nyquist=90.0)
    assert lines != "lines"
    with pytest.raises(ValueError, match="read-only"):
        lines.amplitude[0] = 1.0
    assert Harmonics([2, 7], [1, 1], [0, 0]).nyquist == 7


def test_a_picture_names_the_largest():
    figure = Harmonics(
        np.arange(1, 61), [LOBES.get(n, 0.0) for n in range(1, 61)], np.zeros(60), np.full(60, 1e-5)
    ).plot()
    assert {text.get_text() for text in figure.axes[0].texts} == {"43", "3", "2", "6", "44"}


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (([2, 3], [1.0], [0.0, 0.0]), r"amplitude must be one-dimensional with 2 entries; got shape \(1,\)"),
        (([0, 3], [1.0, 1.0], [0.0, 0.0]), r"upr must be > 0; got 0.0"),
        (([2], [-1.0], [0.0]), r"amplitude must be >= 0 \(mm\); got -1.0"),
        (([2], [np.nan], [0.0]), r"amplitude\[0\] must be finite"),
    ],
)
def test_bad_lines(fields, said):
    with pytest.raises(ValueError, match=said):
        Harmonics(*fields)


def test_what_samples_cannot_tell():
    angle = turn(1, 100)
    profile = Profile(angle, measured(angle))
    with pytest.raises(ValueError, match=r"upr_max must be <= 50, half of the points of one turn.*; got 51"):
        profile.harmonics(51)
    with pytest.raises(ValueError, match="reading must have at least 101 samples for 50 upr; got 100"):
        profile.harmonics(50)
    with pytest.raises(ValueError, match="upr_max must be >= 1; got 0"):
        profile.harmonics(0)
    half = Profile(angle[:70], measured(angle[:70]))
    with pytest.raises(
        ValueError,
        match=r"upr_max must ask for waves that .* upr with a gap of 112 degrees .*, at most 1000\)",
    ):
        half.harmonics(20)


@pytest.mark.parametrize("arc", [200, 270])
def test_an_arc_has_no_spectrum(arc):
    angle = np.radians(np.arange(0.0, arc))
    profile = Profile(angle, measured(angle, offset=1.0, lobes={3: (1e-3, 0.4)}), tip_radius=TIP)
    with pytest.raises(
        ValueError,
        match=r"angle must leave no gap above 90 degrees for a spectrum, .* 2 upr are sure; got \d+",
    ):
        profile.harmonics()
    figure = profile.plot()
    assert not figure.axes[1].axison
    assert "upr sure" in figure.axes[1].get_title()


def test_a_gap_in_a_spectrum_is_warned_of():
    angle = np.radians(np.arange(0.0, 300.0))
    profile = Profile(angle, measured(angle, offset=1.0, lobes={20: (2e-3, 0.4)}), tip_radius=TIP)
    with pytest.warns(
        UserWarning, match=r"a gap of 61.\d degrees leaves 2 upr sure: faster form is taken for noise"
    ):
        found = profile.harmonics()
    assert found.upr.tolist() == [1, 2]
    assert profile.harmonics(2) == found  # asked for, it is given without a word
    assert "leaves 2 upr sure" in profile.plot().axes[1].get_title()
    whole = turn(1, 360)
    for offset in (0.0, 3.6, 20.0):
        assert Profile(whole, measured(whole, offset=offset), tip_radius=TIP).plot().axes[1].get_title() == ""


@pytest.mark.parametrize(("old", "new"), [("Runout", "RollerError"), ("Spectrum", "Harmonics")])
def test_former_names_of_the_room_warn(old, new):
    with pytest.warns(
        DeprecationWarning, match=f"centering.roundness.{old} is now centering.roundness.{new}"
    ):
        assert getattr(roundness, old) is getattr(roundness, new)


def test_former_names_of_a_profile_warn():
    profile = Profile(turn(3, 90), measured(turn(3, 90)), tip_radius=TIP)
    with pytest.warns(DeprecationWarning, match="Profile.spectrum is now Profile.harmonics"):
        assert profile.spectrum(20) == profile.harmonics(20)
    with pytest.warns(DeprecationWarning, match="Profile.runout is now Profile.roller_error"):
        assert profile.runout is None
    with pytest.warns(DeprecationWarning, match="Profile.remove_runout is now"):
        assert profile.remove_runout() == profile.remove_roller_error()
    with pytest.raises(AttributeError, match="'Profile' object has no attribute 'nonsense'"):
        profile.nonsense  # noqa: B018
