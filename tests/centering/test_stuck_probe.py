"""A probe that stood still is told; a gauge with few digits at the top of a wave is not."""

import re

import numpy as np
import pytest
from measured_rings import turn

from centering.roundness import Profile
from sdpgrind import load

ANGLE = turn(1, 1440)


def ring(noise=5e-5, step=0.0, seed=0):
    form = 4e-3 * np.cos(ANGLE - 1.1) + 1.5e-3 * np.cos(3 * ANGLE - 0.7)
    found = form + noise * np.random.default_rng(seed).normal(size=ANGLE.size)
    return np.round(found / step) * step if step else found


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-4])
def test_a_probe_that_stuck_for_ten_degrees_is_told(step, tmp_path):
    deviation = ring(step=step)
    deviation[100:141] = deviation[100]  # 25 to 35 degrees
    profile = Profile(ANGLE, 30.0 + deviation)
    for form in (profile, profile.filter(upr=50)):
        (told,) = [each for each in form.roundness().remarks if "in a row" in each]
        assert told.startswith(
            "41 readings in a row are equal, from 25 to 35 degrees: the probe stuck, or was"
        )
    profile.filter(upr=50).save(tmp_path / "ring.nc")
    assert told in load(tmp_path / "ring.nc").roundness().remarks
    assert told in profile.filter(upr=50).roundness().report()


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-5, 1e-4, 5e-4, 2e-3])
@pytest.mark.parametrize("noise", [0.0, 1e-6, 5e-5])
def test_digits_do_not_look_like_a_stuck_probe(step, noise):
    """Of 2 um a reading stays for 45 degrees at the top of the wave."""
    for seed in range(2):
        profile = Profile(ANGLE, 30.0 + ring(noise, step, seed))
        assert not any("in a row" in each for each in profile.roundness().remarks)
    still = Profile(ANGLE, np.full(ANGLE.size, 30.0)).roundness()
    assert not any("in a row" in each for each in still.remarks)


def test_the_sheet_says_that_its_amplitudes_are_those_after_the_filter():
    form = Profile(ANGLE, 30.0 + ring() + 2e-4 * np.cos(11 * ANGLE))
    told = form.filter("gaussian", 50).roundness().report()
    assert "Largest amplitudes after the filter, above the noise" in told
    assert re.search(r"^ *11 +0\.19", told, re.M)  # 0.2 um times exp2(-(11/50)^2) = 0.1934
