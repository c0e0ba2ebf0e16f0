"""Contours and the shift that takes a volume off: closed forms, brute force, refusals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.weldbead import passes


def brute(bead, lower, width, points=400_001):
    """Volume by the midpoint rule."""
    x = np.linspace(bead.x[0], bead.x[-1], points)
    x = 0.5 * (x[1:] + x[:-1])
    across = width.at(x) if isinstance(width, passes.Contour) else width
    return np.mean(np.maximum(0.0, bead.at(x) - lower.at(x)) * across) * bead.length


heights = st.lists(st.floats(-1, 1), min_size=3, max_size=9)


@settings(max_examples=60, deadline=None)
@given(upper=heights, lower=heights, width=st.lists(st.floats(1, 20), min_size=2, max_size=4))
def test_volume_is_exact(upper, lower, width):
    bead = passes.Contour(np.linspace(0, 30, len(upper)), upper)
    under = passes.Contour(np.linspace(-1, 31, len(lower)), lower)
    across = passes.Contour(np.linspace(0, 30, len(width)), width)
    # The midpoint rule errs by h^2/24 of what the slopes change by.
    assert passes.volume_between(bead, under, across) == pytest.approx(brute(bead, under, across), abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(upper=heights, lower=heights, volume=st.floats(0.01, 400))
def test_shift_takes_the_volume_off(upper, lower, volume):
    bead = passes.Contour(np.linspace(0, 30, len(upper)), upper)
    shape = passes.Contour(np.linspace(0, 30, len(lower)), lower)
    shift = passes.contour_shift(bead, shape, volume, 12.5)
    assert passes.volume_between(bead, shape.shifted(shift), 12.5) == pytest.approx(volume, rel=1e-10)


@pytest.mark.parametrize("volume", [0.0, 0.3, 12.0, 39.9])
def test_shift_of_a_triangle(volume):
    half, height, width = 10.0, 2.0, 4.0
    triangle = passes.Contour([0, half, 2 * half], [0, height, 0])
    level = passes.Contour([0, 20], [0, 0])
    found = passes.contour_shift(triangle, level, volume, width)
    assert found == pytest.approx(height - np.sqrt(volume * height / (width * half)), abs=1e-13)


def test_more_than_all_of_it_goes_on_linearly():
    bead, level = passes.Contour([0, 10], [1, 1]), passes.Contour([0, 10], [0, 0])
    assert passes.contour_shift(bead, level, 60.0, 5.0) == pytest.approx(1 - 60 / 50, abs=1e-14)


@pytest.mark.parametrize(
    ("x", "z", "message"),
    [
        ([0], [1], r"x must be at least 2 points \(mm\); got 1"),
        ([0, 1, 1], [1, 1, 1], r"x must increase \(mm\); got 1 followed by 1"),
        ([0, 1], [1, 1, 1], r"x and z must be of one length \(mm\); got shapes \(2,\) and \(3,\)"),
        ([0, np.nan], [1, 1], r"x\[1\] must be finite \(mm\); got nan"),
    ],
)
def test_contours_that_are_none(x, z, message):
    with pytest.raises(ValueError, match=message):
        passes.Contour(x, z)


def test_a_shape_must_cover_the_bead():
    with pytest.raises(ValueError, match=r"the target shape must cover the bead, 0 to 10 mm; got 1 to 10"):
        passes.contour_shift(passes.Contour([0, 10], [1, 1]), passes.Contour([1, 10], [0, 0]), 1.0, 5.0)
    with pytest.raises(ValueError, match=r"volume must be >= 0 \(mm\^3\); got -1"):
        passes.contour_shift(passes.Contour([0, 10], [1, 1]), passes.Contour([0, 10], [0, 0]), -1.0, 5.0)


@pytest.mark.parametrize("width", [0.0, -5.0])
def test_widths_that_are_none(width):
    flat = passes.Contour([0, 10], [1, 1])
    with pytest.raises(ValueError, match=rf"width must be > 0 \(mm\); got {width}"):
        passes.contour_shift(flat, passes.Contour([0, 10], [0, 0]), 5.0, width)


def test_what_must_reach_over_the_bead():
    flat, short = passes.Contour([0, 10], [1, 1]), passes.Contour([1, 10], [0.5, 0.5])
    with pytest.raises(ValueError, match="lower must reach over upper, 0 to 10 mm; got 1 to 10"):
        passes.volume_between(flat, short, 4.0)
    with pytest.raises(ValueError, match="width must reach over the bead, 0 to 10 mm; got 1 to 10"):
        passes.volume_between(flat, passes.Contour([0, 10], [0, 0]), short)
