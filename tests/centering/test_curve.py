"""The exact curve of an offset circle, its derivatives, and where slide and probe put the contact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from centering.circle import circle_derivatives, circle_reading, radial_position

LENGTHS = st.floats(-200.0, 200.0)
RADII = st.floats(1.0, 200.0)
SHARES = st.floats(0.0, 0.99)
ANGLES = st.floats(-10.0, 10.0)


@given(slide=LENGTHS, probe=LENGTHS, moved=LENGTHS, calibration=LENGTHS)
def test_moving_the_slide_of_a_still_part_changes_nothing(slide, probe, moved, calibration):
    before = radial_position(slide, probe, calibration)
    after = radial_position(slide + moved, probe - moved, calibration)
    assert after == pytest.approx(before, abs=1e-12 * 1000)


def test_both_axes_are_positive_outward():
    assert radial_position([1.0, 2.0], [0.0, 0.0], 50.0).tolist() == [51.0, 52.0]
    assert radial_position(0.0, [1.0, 2.0], 50.0).tolist() == [51.0, 52.0]


@given(angle=ANGLES, radius=RADII, share=SHARES, direction=ANGLES, tip=st.floats(0.0, 10.0))
def test_the_tip_touches_the_circle(angle, radius, share, direction, tip):
    """The tip's centre is R + rho from the part's centre, and on the outer side of it."""
    offset = share * radius
    reached = circle_reading(angle, radius, offset, direction, tip) + tip
    centre = offset * np.exp(1j * direction)
    assert abs(reached * np.exp(1j * angle) - centre) == pytest.approx(radius + tip, rel=1e-13)
    assert reached > offset * np.cos(angle - direction)


@pytest.mark.parametrize(("angle", "offset", "tip"), [(0.3, 3.6, 0.0), (2.0, 30.0, 3.75), (3.1, 58.8, 3.75)])
def test_by_looking_for_the_point_on_the_line(angle, offset, tip):
    centre = offset * np.exp(0.7j)

    def gap(reading):
        return abs((reading + tip) * np.exp(1j * angle) - centre) - (61.94 + tip)

    found = brentq(gap, max((centre * np.exp(-1j * angle)).real, 0.0) - tip, 200.0, xtol=1e-13, rtol=1e-15)
    assert circle_reading(angle, 61.94, offset, 0.7, tip) == pytest.approx(found, abs=1e-12)


def _plain(angle, radius, offset, direction, tip):
    """Section 2 as it stands, which takes complex numbers too."""
    psi = angle - direction
    return offset * np.cos(psi) + np.sqrt((radius + tip) ** 2 - offset**2 * np.sin(psi) ** 2) - tip


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.95])
@pytest.mark.parametrize("tip", [0.0, 3.75])
def test_derivatives_by_a_complex_step(share, tip):
    angle, at = np.linspace(-4.0, 7.0, 23), np.array([61.94, share * 61.94, 0.7])
    found = circle_derivatives(angle, *at, tip)
    for k in range(3):
        step = 1e-30 * np.eye(3)[k]
        assert found[:, k] == pytest.approx(
            _plain(angle, *(at + 1j * step), tip).imag / 1e-30, abs=1e-12 * 61.94
        )


def test_without_an_offset_all_readings_are_the_radius():
    assert np.ptp(circle_reading(np.linspace(0, 7, 50), 30.0, 0.0, 0.0, 3.0)) < 1e-13
    assert circle_derivatives([0.0, 2.0], 30.0, 0.0, 0.0)[:, 2].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: circle_reading(0.0, 0.0, 0.0, 0.0), r"radius must be > 0 \(mm\); got 0\.0"),
        (
            lambda: circle_reading(0.0, 5.8, 5.8, 0.0),
            r"offset must be < radius, 5\.8: the spindle's axis lies in the part \(mm\); got",
        ),
        (lambda: circle_reading(0.0, 5.8, -1.0, 0.0), r"offset must be >= 0 \(mm\); got -1\.0"),
        (lambda: circle_reading(0.0, 5.8, 1.0, 0.0, -1.0), r"tip_radius must be >= 0 \(mm\); got -1\.0"),
        (lambda: circle_reading([0.0, np.nan], 5.8, 1.0, 0.0), r"angle\[1\] must be finite \(rad\); got nan"),
        (lambda: circle_derivatives([0.0], 5.8, 7.0, 0.0), r"offset must be < radius"),
        (lambda: radial_position([0.0, np.inf], 0.0, 1.0), r"slide\[1\] must be finite \(mm\); got inf"),
        (lambda: radial_position(0.0, [0.0], np.nan), r"calibration must be finite \(mm\); got nan"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_slide_and_probe_of_different_lengths():
    with pytest.raises(ValueError, match=r"slide and probe must be of one shape; got \(3,\) and \(2,\)"):
        radial_position([1.0, 2.0, 3.0], [1.0, 2.0], 50.0)
    assert radial_position(1.0, [1.0, 2.0], 50.0).tolist() == [52.0, 53.0]
