"""What passes at their limit of force leave on the waves of a bead."""

from itertools import pairwise

import numpy as np
import pytest
from stand_job import ALONE, BOTH, PROCESS

from sdpgrind import weldbead
from sdpgrind.weldbead.sequence._waves import Waves

AMPLITUDE = 0.15
WAVINESS = AMPLITUDE / np.sqrt(2)
EXACT = ALONE.replace(scatter=ALONE.scatter.replace(relative_sd=(0.0, 0.0, 0.0)))
PASS = {"duration": 12.0, "feed_rate": 15.0, "normal_force": 50.0}


def test_a_level_bead_loses_the_static_cut():
    assert Waves.of(0.0).cut(ALONE, PROCESS, PASS) == PROCESS.mean_cut(50.0, 15.0)


def test_the_first_pass_at_the_limit_loses_the_mean_of_half_waves():
    """clip(D + w, 0, D) of a sine is D less amplitude over pi; the believed and the true process are one."""
    cut = Waves.of(WAVINESS).cut(EXACT, PROCESS, PASS)
    assert cut == pytest.approx(float(PROCESS.mean_cut(50.0, 15.0)) - AMPLITUDE / np.pi, rel=1e-3)


def test_each_pass_levels_and_loses_less():
    waves = Waves.of(WAVINESS)
    cuts = [waves.cut(EXACT, PROCESS, PASS) for _ in range(6)]
    assert all(after >= before for before, after in pairwise(cuts)) and cuts[1] > 1.02 * cuts[0]
    assert cuts[-1] == pytest.approx(float(PROCESS.mean_cut(50.0, 15.0)), rel=0.03)


def test_a_light_pass_levels_at_once():
    waves = Waves.of(0.02)
    light = PASS | {"normal_force": 25.0}
    assert waves.cut(EXACT, PROCESS, light) == pytest.approx(float(PROCESS.mean_cut(25.0, 15.0)), rel=1e-9)
    assert np.ptp(waves._height) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("force", [8.2, 9.0, 12.0, 20.0])
def test_a_pass_below_its_limit_takes_what_is_asked(force):
    """The level of the tip takes the volume, also of a pass less deep than the waves are high."""
    small = WAVINESS / 3
    cut = Waves.of(small).cut(EXACT, PROCESS, PASS | {"normal_force": force})
    assert cut == pytest.approx(float(PROCESS.mean_cut(force, 15.0)), rel=1e-9)


def test_softer_metal_near_the_threshold_is_no_avalanche():
    soft = PROCESS.replace(friction_ratio=0.5)
    taken = float(soft.mean_cut(8.0, 15.0))
    assert Waves.of(WAVINESS).cut(ALONE, soft, PASS | {"normal_force": 8.0}) == pytest.approx(taken, rel=1e-9)


def test_softer_metal_gives_more_of_what_is_planned():
    soft = PROCESS.replace(specific_energy=10.0)
    ratio = Waves.of(WAVINESS).cut(ALONE, soft, PASS) / Waves.of(WAVINESS).cut(ALONE, PROCESS, PASS)
    assert ratio == pytest.approx(float(soft.mean_cut(50.0, 15.0) / PROCESS.mean_cut(50.0, 15.0)), rel=1e-12)


def test_waves_make_a_promise_dearer():
    state = {"height": 0.5, "time_left": 24.0, "error": 1.0}
    level, wavy = (
        weldbead.plan(BOTH.replace(waviness=w), tolerance=None, nodes=101).risk(**state)
        for w in (0.0, WAVINESS)
    )
    assert wavy.mean > level.mean and wavy.height > level.height
