"""The limacon's bias in closed form, its inverse, the source's correction (4.22), and what an arc does to it."""

import numpy as np
import pytest
from circle_inside import limacon
from scipy.integrate import quad
from scipy.special import ellipe

from centering.circle import (
    circle_reading,
    corrected_radius,
    limacon_bias,
    limacon_radius,
    limacon_reading,
    limacon_wave,
    linear_gauge_offset,
)

RADIUS = 61.9
TABLE_4_1 = {6.030: (61.3, 61.753), 12.480: (60.3, 61.266), 18.800: (60.7, 60.447), 26.400: (58.9, 58.981)}
"""Offset (mm) -> radius measured and predicted, mm; row 3 is a misprint."""


def turn(samples=360, start=0.0):
    return start + np.arange(samples) * 2 * np.pi / samples


def fitted(angle, reading):
    columns = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
    return np.linalg.lstsq(columns, reading, rcond=None)[0]


@pytest.mark.parametrize(
    ("share", "ratio"),
    [
        (0.1, 1.00251),
        (0.2, 1.010179),
        (0.5, 1.070417),
        (0.9, 1.340616),
        (0.95, 1.424472),
        (0.99, 1.527305),
        (1.0, 1.570796),
    ],
)
def test_published_ratios(share, ratio):
    assert 1 / limacon_radius(1.0, share) == pytest.approx(ratio, abs=1e-6)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.3, 0.9, 0.999])
def test_closed_form_against_the_integral_and_a_fit(share):
    mean = (
        quad(lambda psi: np.sqrt(1 - (share * np.sin(psi)) ** 2), 0, np.pi / 2, epsabs=1e-13)[0] * 2 / np.pi
    )
    assert limacon_radius(RADIUS, share * RADIUS) == pytest.approx(RADIUS * mean, rel=1e-12)
    angle = turn(4000, 0.123)  # the trapezoidal rule is exact to rounding but at the very edge
    found = fitted(angle, circle_reading(angle, RADIUS, share * RADIUS, 0.7))
    assert found[0] == pytest.approx(limacon_radius(RADIUS, share * RADIUS), rel=1e-11)
    assert np.hypot(found[1], found[2]) == pytest.approx(share * RADIUS, abs=1e-11 * RADIUS)
    if share:
        assert np.arctan2(found[2], found[1]) == pytest.approx(0.7, abs=1e-10)


def test_series_for_small_offsets():
    k = 1e-2
    assert 1 / limacon_radius(1.0, k) == pytest.approx(1 + k**2 / 4 + 7 * k**4 / 64, abs=2 * k**6)
    x = k / limacon_radius(1.0, k)
    assert 1 / limacon_radius(1.0, k) == pytest.approx(1 + x**2 / 4 - x**4 / 64, abs=2 * k**6)


@pytest.mark.parametrize(
    ("steps", "shares", "within"),
    [(2, np.linspace(0, 0.95, 96), 1e-9), (5, 1 - np.logspace(-6, 0, 200), 1e-11)],
)
def test_newton_steps(monkeypatch, steps, shares, within):
    """Four steps would leave 3.5e-8 at k = 0.9995."""
    monkeypatch.setattr(limacon, "NEWTON_STEPS", steps)
    found = [corrected_radius(limacon_radius(RADIUS, k * RADIUS), k * RADIUS) / RADIUS - 1 for k in shares]
    assert np.abs(found).max() <= within


def test_the_inverse_is_good_up_to_the_edge():
    shares = np.concatenate([np.linspace(0, 1, 201), 1 - np.logspace(-12, -1, 30)])
    found = [corrected_radius(limacon_radius(RADIUS, k * RADIUS), k * RADIUS) / RADIUS - 1 for k in shares]
    assert np.abs(found).max() < 2e-12


def test_errors_of_the_source_correction():
    """(4.22): 0.009 and 0.6 % are right, "-0.2 %" is not."""
    k = np.linspace(0.0, 1.0, 20001)[1:]
    seen = 2 / np.pi * ellipe(k**2)
    error = np.array([corrected_radius(1.0, x, method="mears") for x in k / seen]) - 1 / seen
    assert np.abs(error).max() == pytest.approx(0.00913, abs=5e-6)
    assert k[np.abs(error).argmax()] == pytest.approx(0.993, abs=2e-3)
    assert np.abs(error * seen).max() == pytest.approx(0.00594, abs=5e-6)
    assert (error * seen).min() == pytest.approx(-0.0038, abs=5e-5)
    assert k[(error * seen).argmin()] == pytest.approx(0.66, abs=0.01)
    small = corrected_radius(1.0, 0.01, method="mears") - 1, corrected_radius(1.0, 0.01) - 1
    assert small[0] / small[1] == pytest.approx(0.94, abs=0.002)  # 6 % low where it matters least


def test_the_worked_numbers_of_the_source():
    assert round(26.4 / 58.9, 5) == 0.44822  # (4.23)
    ratio = corrected_radius(58.9, 26.4, method="mears") / 58.9
    assert ratio == pytest.approx(1.04713, abs=5e-6)  # (4.24)
    assert 1 / ratio - 1 == pytest.approx(-0.0450, abs=5e-5)  # (4.25)
    exact = corrected_radius(58.9, 26.4) / 58.9
    assert exact == pytest.approx(1.0496, abs=5e-5)
    assert 1 / exact - 1 == pytest.approx(-0.0473, abs=5e-5)
    assert limacon_radius(1.0, 0.99) - 1 == pytest.approx(-0.34525, abs=5e-6)
    assert limacon_radius(1.0, 1.0) - 1 == pytest.approx(-0.3634, abs=5e-5)


@pytest.mark.parametrize("offset", TABLE_4_1)
def test_table_4_1(offset):
    measured, predicted = TABLE_4_1[offset]
    assert limacon_radius(RADIUS, offset) == pytest.approx(predicted, abs=1e-3)
    near = abs(measured - predicted) < 0.5
    assert near == (offset != 12.480)
    corrected = {6.030: 61.44, 18.800: 62.07, 26.400: 61.68}
    if near:
        assert corrected_radius(measured, offset, method="mears") == pytest.approx(
            corrected[offset], abs=6e-3
        )
    if offset == 26.400:
        assert corrected_radius(measured, offset) == pytest.approx(61.82, abs=5e-3)


@pytest.mark.parametrize(
    ("radius", "offset", "wave"), [(30.0, 0.1, 83e-6), (61.94, 1.0, 4.0e-3), (83.5, 3.6, 39e-3)]
)
def test_the_false_wave(radius, offset, wave):
    """It is what a limacon leaves at 2 upr; about d^2/(4 R)."""
    angle = turn(3600)
    left = circle_reading(angle, radius, offset, 0.0) - limacon_reading(angle, radius, offset, 0.0)
    lobes = 2 * np.abs(np.fft.rfft(left)) / angle.size
    assert limacon_wave(radius, offset) == pytest.approx(lobes[2], rel=1e-9)
    assert limacon_wave(radius, offset) == pytest.approx(offset**2 / (4 * radius), rel=1e-3)
    assert limacon_wave(radius, offset) == pytest.approx(wave, rel=0.015)


@pytest.mark.parametrize("share", [0.5, 0.9, 0.99])
def test_the_false_wave_at_large_offsets(share):
    angle = turn(8192)
    lobes = 2 * np.abs(np.fft.rfft(circle_reading(angle, 1.0, share, 0.0))) / angle.size
    assert limacon_wave(1.0, share) == pytest.approx(lobes[2], rel=1e-9)


WORST = {(0.2, 30): 0.20, (0.2, 120): 0.16, (0.2, 180): 0.11, (0.2, 270): 0.043}
WORST |= {(0.05, 30): 0.049, (0.05, 120): 0.039, (0.05, 180): 0.028, (0.05, 270): 0.011}


@pytest.mark.parametrize(("share", "arc"), WORST)
def test_bias_over_an_arc(share, arc):
    """Error of the centre over the offset, at the worst start."""
    places = np.radians(np.linspace(0.0, arc, 2 * arc + 1))
    errors = [limacon_bias(start + places, 1.0, share, 0.0) for start in np.radians(np.arange(0, 360, 5))]
    last = 0.5 * 10.0 ** np.floor(np.log10(WORST[share, arc]) - 1)
    assert max(np.hypot(e[1], e[2]) for e in errors) / share == pytest.approx(
        WORST[share, arc], abs=1.2 * last
    )
    twin = fitted(0.3 + places, circle_reading(0.3 + places, 1.0, share, 0.0)) - [1.0, share, 0.0]
    assert limacon_bias(0.3 + places, 1.0, share, 0.0) == pytest.approx(twin, abs=1e-11)


def test_over_a_turn_the_centre_has_no_bias():
    error = limacon_bias(turn(), RADIUS, 20.0, 0.4)
    assert error[0] == pytest.approx(limacon_radius(RADIUS, 20.0) - RADIUS, abs=1e-11)
    assert np.abs(error[1:]).max() < 1e-11


@pytest.mark.parametrize("turns", [1, 3])
def test_whole_turns_are_told_from_arcs(turns):
    angle = np.arange(360 * turns) * np.pi / 180
    assert limacon.whole_turns(angle)
    assert limacon.whole_turns(np.append(angle, angle[-1] + np.pi / 180))  # the first direction twice
    gap = int(angle.size * limacon.EVEN / (1 + limacon.EVEN))  # a gap of m of n readings leaves m/(n - m)
    assert limacon.whole_turns(angle[:-gap])
    assert not limacon.whole_turns(angle[: -gap - 1])
    assert not limacon.whole_turns(angle[: -180 if turns == 1 else -90])
    assert not limacon.whole_turns(np.delete(angle, np.s_[100:130]))


@pytest.mark.parametrize(("upr", "even"), [(1, False), (2, False), (3, False), (4, True)])
def test_readings_denser_at_the_places_of_a_lobe_are_no_even_turn(upr, even):
    """The closed forms hold where readings of 1, 2 and 3 undulations add up to nothing; 4 do them no harm."""
    angle = turn()
    assert limacon.whole_turns(angle + 0.05 * np.cos(upr * angle)) == even


def test_the_linear_gauge_reads_noise_as_offset():
    rng = np.random.default_rng(4)
    shown = [linear_gauge_offset(np.cos(turn()) + rng.normal(0, 0.5, 360)) for _ in range(400)]
    assert np.mean(shown) == pytest.approx(2.17, abs=0.03)
    assert linear_gauge_offset(np.cos(turn())) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: limacon_radius(10.0, 11.0), r"offset must be in \[0, 10\] \(mm\); got 11\.0"),
        (lambda: limacon_wave(0.0, 0.0), r"radius must be > 0 \(mm\); got 0\.0"),
        (
            lambda: corrected_radius(10.0, 15.8),
            r"fitted_offset must be <= pi/2 fitted_radius, 15\.708: .* \(mm\); got 15\.8",
        ),
        (lambda: corrected_radius(-1.0, 0.0), r"fitted_radius must be > 0 \(mm\); got -1\.0"),
        (lambda: corrected_radius(10.0, 1.0, "taylor"), r"method must be one of exact, mears; got 'taylor'"),
        (lambda: limacon_reading(0.0, -3.0, 1.0, 0.0), r"radius must be > 0 \(mm\); got -3\.0"),
        (lambda: limacon_reading(0.0, 3.0, -1.0, 0.0), r"offset must be >= 0 \(mm\); got -1\.0"),
        (lambda: limacon_bias([0.0, 1.0], 3.0, 1.0, 0.0), r"angle must be at least 3 angles; got 2"),
        (lambda: linear_gauge_offset([]), r"reading must be at least one reading; got 0"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()
