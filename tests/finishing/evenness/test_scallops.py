"""Scallops: closed forms on a flat, next to a cylinder by circles that meet, roughness by quadrature."""

from math import asin, cos, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from sdpgrind.finishing.path import ball_footprint, cusp_roughness, scallop_height


def next_to_cylinder(ball, pitch, curvature):
    """Height over a cylinder of that curvature (> 0: ball inside) of the point where two circles meet; passes
    along its axis.
    """
    radius, centre = 1 / curvature, 1 / curvature - ball
    half = pitch * curvature / 2
    return radius - centre * cos(half) - sqrt(ball**2 - (centre * sin(half)) ** 2)


@given(st.floats(0.5, 50), st.floats(1e-4, 1.9))
def test_flat_is_exact(radius, share):
    pitch = share * radius
    assert scallop_height(radius, pitch) == pytest.approx(
        radius - sqrt(radius**2 - pitch**2 / 4), abs=4e-16 * radius
    )


@pytest.mark.parametrize("curvature", [0.02, -0.02, 0.1, -0.1])
def test_curved_is_right_to_the_share_that_is_told(curvature):
    """Off by a share of k pitch^2/(16 R) [..], which falls with the square of the pitch."""
    ball, shares = 2.0, []
    for pitch in (0.4, 0.2):
        exact = next_to_cylinder(ball, pitch, curvature)
        shares.append(scallop_height(ball, pitch, curvature) / exact - 1)
    assert shares[0] / shares[1] == pytest.approx(4, rel=0.02)
    radius, centre = 1 / curvature, 1 / curvature - ball
    bend = ball**2 / 24 + centre * ball / 6 + centre**2 / 8
    assert shares[1] == pytest.approx(0.2**2 / 2 * bend / (ball * radius**3), rel=0.02)
    if abs(curvature) < 0.05:
        assert shares[1] == pytest.approx(curvature * 0.2**2 / (16 * ball), rel=0.12)


def test_a_ball_in_a_groove_of_nearly_its_radius_leaves_nearly_nothing():
    assert scallop_height(2.0, 1.0, 0.4999) == pytest.approx(2e-4 * scallop_height(2.0, 1.0), rel=0.03)


@given(st.floats(0.5, 50), st.floats(1e-5, 1.999))
def test_roughness_by_quadrature(radius, share):
    half = share * radius / 2

    def height(x):
        return x * x / (radius + sqrt(radius**2 - x * x))

    if share < 0.01:  # parabolas
        assert cusp_roughness(radius, 2 * half) == pytest.approx(4 / (9 * sqrt(3)) * height(half), rel=1e-5)
        return
    mean = radius - (half * sqrt(radius**2 - half**2) + radius**2 * asin(half / radius)) / (2 * half)
    cross = sqrt(mean * (2 * radius - mean))
    found = (
        quad(lambda x: abs(height(x) - mean), 0, half, points=[cross], epsabs=0, epsrel=1e-9, limit=200)[0]
        / half
    )
    assert cusp_roughness(radius, 2 * half) == pytest.approx(found, rel=1e-7)


def test_roughness_of_parabolas():
    """4/(9 sqrt 3) = 0.2566 of the height, and more by a share that falls with the square of the pitch."""
    off = [cusp_roughness(2.0, p) / scallop_height(2.0, p) * 9 * sqrt(3) / 4 - 1 for p in (0.8, 0.4, 0.2)]
    assert off[0] / off[1] == pytest.approx(4, rel=0.1) and off[1] / off[2] == pytest.approx(4, rel=0.03)
    assert abs(off[2]) < 1e-3 and 4 / (9 * sqrt(3)) == pytest.approx(0.2566, abs=5e-5)


def test_curvature_stands_for_another_ball():
    assert cusp_roughness(2.0, 0.3, 0.25) == pytest.approx(cusp_roughness(4.0, 0.3), rel=1e-13)
    assert scallop_height(2.0, 0.3, -0.5) == pytest.approx(scallop_height(1.0, 0.3), rel=1e-13)


def test_footprint_of_a_ball():
    exact = [sqrt(2 * 2.0 * d - d * d) for d in (0.02, 0.01)]
    off = [ball_footprint(2.0, d) / r - 1 for d, r in zip((0.02, 0.01), exact, strict=True)]
    assert off[1] == pytest.approx(0.01 / 8, rel=0.01) and off[0] / off[1] == pytest.approx(2, rel=0.01)
    assert ball_footprint(3.0, 3.0) == pytest.approx(3 * sqrt(2))


@pytest.mark.parametrize("function", [scallop_height, cusp_roughness])
@pytest.mark.parametrize(
    ("given_values", "message"),
    [
        ((0.0, 0.2), r"^tool_radius must be > 0 \(mm\); got 0.0$"),
        ((2.0, -0.2), r"^pitch must be > 0 \(mm\); got -0.2$"),
        ((2.0, float("nan")), r"^pitch must be finite \(mm\); got nan$"),
        (
            (2.0, 0.2, 0.5),
            r"^normal_curvature must be < 1/tool_radius = 0.5: else the ball gouges \(1/mm\); got 0.5$",
        ),
        ((2.0, 4.1), r"^pitch must be <= 4: else passes of the ball do not meet \(mm\); got 4.1$"),
        ((2.0, 2.1, -0.5), r"^pitch must be <= 2: else passes of the ball do not meet \(mm\); got 2.1$"),
    ],
)
def test_refused_scallops(function, given_values, message):
    with pytest.raises(ValueError, match=message):
        function(*given_values)


def test_refused_footprints():
    with pytest.raises(ValueError, match=r"^depth must be > 0 \(mm\); got 0.0$"):
        ball_footprint(2.0, 0.0)
    with pytest.raises(ValueError, match=r"^depth must be <= tool_radius = 2 \(mm\); got 2.5$"):
        ball_footprint(2.0, 2.5)
