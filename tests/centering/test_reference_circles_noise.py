"""What a roundness tells of its noise, against Monte-Carlo studies of forms that are known."""

from functools import cache

import numpy as np
import pytest
from circle_twins import on_rays

from centering import Profile
from centering.roundness import reference_circle

pytestmark = pytest.mark.filterwarnings("ignore:Roundness.value_:DeprecationWarning")

KINDS = ("LSC", "MCC", "MIC", "MZC")
TURN = np.arange(360) * 2 * np.pi / 360
NOISE = 1e-4  # mm
STUDY = 240  # parts: their sd is known to 4.6 %
FORMS = {  # mm
    "round": 0 * TURN,
    "oval": 0.005 * np.cos(2 * TURN + 0.3),
    "much oval": 0.05 * np.cos(2 * TURN + 0.3),
    "three lobes": 0.005 * np.cos(3 * TURN + 0.3),
    "rough": 0.002 * np.random.default_rng(3).normal(size=360),
    "less rough": 0.0002 * np.random.default_rng(3).normal(size=360),
}


def noisy(form, rng):
    return on_rays(TURN, 30 + FORMS[form] + NOISE * rng.normal(size=TURN.size), (0.5, 0.2))


@cache
def filtered(form):
    scans = 30 + FORMS[form] + NOISE * np.random.default_rng(7).normal(size=(80, TURN.size))
    return [Profile(TURN, scan).filter("gaussian", upr=50) for scan in scans]


@cache
def parts(form):
    rng = np.random.default_rng(5)
    return [noisy(form, rng) for _ in range(STUDY)]


@cache
def study(form, kind):
    return [reference_circle(points, kind, noise_sd=NOISE) for points in parts(form)]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("form", FORMS)
def test_uncertainty_is_that_of_a_study(form, kind):
    found = study(form, kind)
    told = np.array([circle.value_sd for circle in found[:8]]) / np.std([circle.value for circle in found])
    assert 0.7 < np.median(told) < 1.4
    assert 0.7 < np.sqrt(np.mean(told**2)) < 1.4
    assert told.min() > 0.5 and told.max() < 2


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("form", ["round", "three lobes", "rough", "less rough"])
def test_what_noise_adds_is_that_of_a_study(form, kind):
    found = study(form, kind)
    true = (
        np.mean([circle.value for circle in found])
        - reference_circle(on_rays(TURN, 30 + FORMS[form]), kind).value
    )
    told = np.mean([circle.value_bias for circle in found[:16]])
    assert 0.7 * true - 0.4 * NOISE < told < 1.4 * true + (2 if "rough" in form else 0.4) * NOISE
    if form == "round":
        assert told == pytest.approx(2 * NOISE * np.sqrt(2 * np.log(360)), rel=0.25)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("form", ["oval", "three lobes"])
def test_noise_that_a_filter_has_passed_is_not_white(form, kind):
    found = [profile.roundness(kind) for profile in filtered(form)]
    told = np.mean([circle.value_sd for circle in found[:8]]) / np.std([circle.value for circle in found])
    assert 0.7 < told < 1.4
    exact = Profile(TURN, 30 + FORMS[form]).filter("gaussian", upr=50).roundness(kind).value
    if form == "three lobes":
        true = np.mean([circle.value for circle in found]) - exact
        assert 0.7 * true < np.mean([circle.value_bias for circle in found[:8]]) < 1.8 * true


def test_noise_of_each_point_counts_where_it_is():
    """Quiet but at the peak: the sd is that of the peak alone."""
    peak = np.arange(360) == 40
    form, sd = np.where(peak, 0.02, FORMS["three lobes"]), np.where(peak, 1e-4, 1e-9)
    found = reference_circle(on_rays(TURN, 30 + form), "LSC", noise_sd=sd)
    assert found.value_sd == pytest.approx(1e-4, rel=0.02)
    assert abs(found.value_bias) < 1e-7


def test_what_is_told_does_not_change_from_one_time_to_the_next():
    points = noisy("oval", np.random.default_rng(8))
    once, again = (reference_circle(points, "MCC", noise_sd=NOISE) for _ in range(2))
    assert (once.value_sd, once.value_bias) == (again.value_sd, again.value_bias)
    twice = reference_circle(points, "MCC", noise_sd=np.full(len(points), NOISE))
    assert twice.value_sd == once.value_sd
    still = reference_circle(points, "MCC", noise_sd=0.0)
    assert (still.value_sd, still.value_bias) == (0.0, 0.0)
    assert reference_circle(points, "MCC").value_bias is None
