"""What the estimate of a circle tells: polar quantities with their scatter, uncertainty, and that it can be
kept.
"""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from centering.circle import CircleEstimate, circle_reading, limacon_reading
from sdpgrind import identify
from sdpgrind.base import stored

COVARIANCE = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -2.0], [0.5, -2.0, 6.0]]) * 1e-6
CIRCLE = CircleEstimate(
    np.array([61.94, 3.0, 4.0]), COVARIANCE, freedom=357.0, samples=360, swept=6.27, noise_sd=0.04
)


def test_values():
    assert (CIRCLE.radius, CIRCLE.center_x, CIRCLE.center_y) == (61.94, 3.0, 4.0)
    assert (CIRCLE["radius"], CIRCLE["center_x"], CIRCLE["center_y"]) == (61.94, 3.0, 4.0)
    assert (
        CIRCLE.offset == 5.0 and CIRCLE.offset_angle == np.arctan2(4, 3) and CIRCLE.offset_ratio == 5 / 61.94
    )
    assert CIRCLE.units == ("mm", "mm", "mm") and CIRCLE.ok
    assert CIRCLE.offset_squared == pytest.approx(25 - 15e-6, abs=1e-12)


@given(x=st.floats(-5, 5), y=st.floats(-5, 5), seed=st.integers(0, 1000))
def test_scatter_of_polar_quantities(x, y, seed):
    """By the derivatives of hypot and atan2, in matrices."""
    root = np.random.default_rng(seed).normal(size=(3, 3)) * 1e-3
    circle = CircleEstimate(np.array([60.0, x, y]), root @ root.T)
    d = np.hypot(x, y)
    if d < 1e-3:
        return
    slope = np.array([[x / d, y / d], [-y / d**2, x / d**2]])
    sds = np.sqrt(np.diag(slope @ circle.covariance[1:, 1:] @ slope.T))
    assert [circle.offset_sd, circle.offset_angle_sd] == pytest.approx(sds, rel=1e-6, abs=1e-9)
    assert circle.center_sd == pytest.approx(
        np.sqrt(np.linalg.eigvalsh(circle.covariance[1:, 1:])[-1]), rel=1e-9
    )
    assert circle.radius_sd == pytest.approx(circle.sd[0])
    assert circle.angle_known == (d >= 2 * circle.center_sd)


def test_the_unbiased_square():
    """Where noise is as large as the offset, offset^2 is too large; offset_squared is not."""
    rng, true = np.random.default_rng(0), np.array([0.002, 0.001])
    seen = rng.multivariate_normal(true, COVARIANCE[1:, 1:], 20000)
    found = [CircleEstimate(np.array([61.94, *centre]), COVARIANCE) for centre in seen]
    spread = np.std([one.offset_squared for one in found]) / np.sqrt(20000)
    assert np.mean([one.offset_squared for one in found]) == pytest.approx(true @ true, abs=4 * spread)
    assert np.mean([one.offset**2 for one in found]) > true @ true + 100 * spread


@pytest.mark.parametrize("freedom", [1.0, 7.0, 357.0, np.inf])
@pytest.mark.parametrize("confidence", [0.5, 0.95, 0.999])
def test_uncertainty(freedom, confidence):
    circle = CIRCLE.replace(freedom=freedom, inflation=2.0, form_bound=0.003)
    one = (
        stats.t.ppf((1 + confidence) / 2, freedom)
        if np.isfinite(freedom)
        else stats.norm.ppf((1 + confidence) / 2)
    )
    both = (
        np.sqrt(2 * stats.f.ppf(confidence, 2, freedom))
        if np.isfinite(freedom)
        else np.sqrt(stats.chi2.ppf(confidence, 2))
    )
    assert circle.uncertainty(confidence) == pytest.approx(one * circle.center_sd + 0.003, rel=1e-9)
    assert circle.uncertainty(confidence, joint=True) == pytest.approx(
        both * circle.center_sd + 0.003, rel=1e-9
    )


def test_one_axis_holds_less_than_both():
    """A quantile of one axis on an isotropic centre gives 99.55 % for 99.9 %; the joint one holds."""
    rng = np.random.default_rng(1)
    circle = CircleEstimate(np.array([61.94, 3.0, 4.0]), np.eye(3) * 1e-6)
    away = np.linalg.norm(rng.normal(0, 1e-3, (200000, 2)), axis=1)
    assert np.mean(away < circle.uncertainty(0.999)) == pytest.approx(0.9955, abs=6e-4)
    assert np.mean(away < circle.uncertainty(0.999, joint=True)) == pytest.approx(0.999, abs=3e-4)


def test_not_determined():
    circle = CircleEstimate(np.array([61.94, 0.0, 0.0]), np.diag([np.inf] * 3), identify.Status.UNDETERMINED)
    assert circle.center_sd == circle.offset_sd == circle.offset_angle_sd == circle.uncertainty() == np.inf
    assert not circle.ok and not circle.angle_known and "not known" in repr(circle)
    centred = CircleEstimate(np.array([61.94, 0.0, 0.0]), COVARIANCE)
    assert centred.offset_angle_sd == np.inf and np.isfinite(centred.offset_sd)


def test_unsure_is_not_ok():
    unsure = CIRCLE.replace(status=identify.Status.UNSURE, message="", limited_by="arc", arc_needed=0.7)
    assert not unsure.ok and unsure.message == "determined, but not yet as surely as was asked"


def test_readings_by_model():
    angle = np.linspace(0, 7, 20)
    polar = CIRCLE.offset, CIRCLE.offset_angle
    tipped = CIRCLE.replace(tip_radius=3.75)
    assert tipped.reading(angle) == pytest.approx(circle_reading(angle, 61.94, *polar, 3.75))
    assert tipped.replace(model="limacon").reading(angle) == pytest.approx(
        limacon_reading(angle, 61.94, *polar)
    )


def test_kept_and_compared():
    twin = stored.decode(stored.encode(CIRCLE))
    assert twin == CIRCLE and hash(twin) == hash(CIRCLE) and twin is not CIRCLE
    changes = {"samples": 3, "noise_sd": 0.1, "limited_by": "arc", "model": "limacon", "message": "other"}
    assert all(CIRCLE.replace(**{name: value}) != CIRCLE for name, value in changes.items())
    assert identify.Estimate(CIRCLE.names, CIRCLE.value, CIRCLE.covariance) != CIRCLE
    with pytest.raises(ValueError, match="read-only"):
        CIRCLE.value[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        CIRCLE.samples = 3


def test_shown():
    assert repr(CIRCLE) == (
        "CircleEstimate(radius = 61.94 ± 0.002 mm, offset = 5 ± 0.0023 mm, offset_angle = 0.927295 ± 0.00063 rad,"
        " from 360 readings; the data determine the values)"
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ("radius", "x", "y")}, r"names must be radius, center_x, center_y; got"),
        ({"model": "ellipse"}, r"model must be one of exact, limacon, printed; got 'ellipse'"),
        ({"limited_by": "luck"}, r"limited_by must be one of .*arc, noise.*; got 'luck'"),
        ({"value": [1.0, 2.0]}, r"value and covariance must be of shape \(3,\) and \(3, 3\)"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(ValueError, match=message):
        CIRCLE.replace(**change)
    with pytest.raises(ValueError, match=r"confidence must be in \(0, 1\)"):
        CIRCLE.uncertainty(1.0)
