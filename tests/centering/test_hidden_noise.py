"""Readings that were filtered before, or rounded, hide their noise: no interval, and no decision."""

import numpy as np
import pytest

import centering
from centering import roundness
from centering.roundness._hidden_noise import hidden_noise

ANGLE = {n: np.linspace(0.0, 2 * np.pi, n, endpoint=False) for n in (1024, 3600)}
NOISE = 1e-4  # mm


def ring(n, noise, seed, form=0.0):
    lobes = 1.2e-3 * np.cos(3 * ANGLE[n]) + 3e-4 * np.cos(7 * ANGLE[n] - 1.0)
    return 30.0 + lobes + form + noise * np.random.default_rng(seed).normal(size=n)


def low_passed(reading, upr):
    waves = np.fft.rfft(reading)
    return np.fft.irfft(waves * np.exp2(-((np.arange(waves.size) / upr) ** 2)), reading.size)


def profile(reading, **options):
    return roundness.Profile(ANGLE[reading.size], reading, **options)


@pytest.mark.parametrize("upr", [120, 150, 500])
@pytest.mark.parametrize("decimals", [7, 16])
def test_what_a_tester_filtered_has_no_interval(upr, decimals):
    filtered = profile(np.round(low_passed(ring(3600, NOISE, 0), upr), decimals))
    found = filtered.filter(upr=50).roundness("MZC")
    assert "filtered before" in found.why_no_interval
    with pytest.raises(ValueError, match="no interval of RONt: "):
        found.interval()
    with pytest.raises(ValueError, match="no budget of RONt: "):
        found.budget(roundness.Instrument(noise_sd=NOISE))
    assert "filtered before" in filtered.roundness("LSC").why_no_interval


def test_a_given_noise_that_the_highest_undulations_lack_is_contradicted():
    quiet = profile(ring(3600, NOISE / 10, 0)).with_noise_sd(NOISE)
    told = quiet.filter(upr=50).roundness().why_no_interval
    assert "the given noise of 0.1 µm is not in the highest undulations, which have 0.0" in told
    assert (
        not profile(ring(3600, NOISE / 2, 0)).with_noise_sd(NOISE).filter(upr=50).roundness().why_no_interval
    )


def test_white_noise_of_testers_is_seen_whatever_the_form():
    steep = {
        "square": 1.5e-3 * np.sign(np.sin(4 * ANGLE[1024])),
        "triangle": 1e-3 * np.abs(((4 * ANGLE[1024] / np.pi) % 2) - 1),
        "dent": -4e-3 * np.exp(-(((ANGLE[1024] - 2) / 0.04) ** 2)),
    }
    for form in steep.values():
        for noise in (NOISE / 2, 3 * NOISE):
            assert not [seed for seed in range(20) if hidden_noise(profile(ring(1024, noise, seed, form)))]


@pytest.mark.parametrize("decimals", [4, 5])
def test_digits_beside_noise_hide_nothing(decimals):
    rounded = [np.round(ring(3600, 3e-5, seed), decimals) for seed in range(10)]
    assert not any(hidden_noise(profile(each)) for each in rounded)


def test_digits_that_swallow_the_noise_hide_it():
    assert hidden_noise(profile(np.round(ring(3600, 1e-6, 0), 4))).startswith("the readings show no noise")


def test_few_readings_are_not_judged():
    for turns in (1, 4):
        few = np.linspace(0.0, 2 * np.pi * turns, 250 * turns, endpoint=False)
        assert hidden_noise(roundness.Profile(few, 30.0 + 1e-3 * np.cos(3 * few))) == ""


def turned(turns, points, filtered, seed=0, form=0.0, offset=0.0):
    """Readings of several turns, or parts of them; a tester has filtered each turn, all as they came, or none."""
    angle = np.arange(round(turns * points)) * 2 * np.pi / points
    noise = NOISE * np.random.default_rng(seed).normal(size=2 * angle.size)  # twice as long: no ends that fit
    if filtered == "all":
        noise = low_passed(noise, points / 12 * 2 * turns)
    if filtered == "each":
        noise = np.concatenate([low_passed(each, points / 12) for each in noise.reshape(-1, points)])
    lobes = 1.2e-3 * np.cos(3 * angle) + offset * np.cos(angle) + form * np.sign(np.sin(4 * angle))
    return roundness.Profile(angle, 30.0 + lobes + noise[: angle.size])


@pytest.mark.parametrize("points", [256, 1024])
@pytest.mark.parametrize(
    ("turns", "filtered"), [(2, "each"), (5, "each"), (2, "all"), (5, "all"), (2.4, "all")]
)
def test_several_turns_that_were_filtered_have_no_interval(points, turns, filtered):
    for seed in range(5):
        profile = turned(turns, points, filtered, seed)
        assert "filtered before" in profile.filter(upr=15).roundness().why_no_interval
    with pytest.raises(ValueError, match="no interval of RONt: the noise falls off"):
        profile.filter(upr=15).roundness().interval()


@pytest.mark.parametrize("turns", [2, 2.4, 7])
def test_noise_of_several_turns_is_seen_whatever_the_form(turns):
    for seed in range(10):
        profile = turned(turns, 360, None, seed, 1.5e-3 * (seed % 2), 5e-3 * (seed % 3 == 0))
        assert not hidden_noise(profile) and not hidden_noise(profile.with_noise_sd(NOISE))
    assert "the given noise of 1 µm" in hidden_noise(turned(turns, 360, None).with_noise_sd(1e-3))


def test_turns_that_repeat_to_the_last_digit_show_no_noise():
    twice = centering.Profile(np.arange(2048) * 2 * np.pi / 1024, np.tile(ring(1024, NOISE, 0), 2))
    assert hidden_noise(twice).startswith("the readings show no noise beyond their last digit")


@pytest.mark.parametrize("step", [0.1, 0.25, 0.5])
@pytest.mark.parametrize("turns", [1, 2])
def test_degrees_of_fine_steps_are_refused(step, turns):
    angle = np.arange(0.0, 360.0 * turns, step)
    with pytest.raises(ValueError, match=r"angle must be in rad; a span of .* smells of degrees"):
        roundness.Profile(angle, 30.0 + NOISE * np.random.default_rng(0).normal(size=angle.size))


def test_many_turns_in_rad_are_taken():
    for turns in (57, 58, 115, 172):
        angle = np.linspace(0.0, 2 * np.pi * turns, 100 * turns, endpoint=False)
        reading = 30.0 + 1e-3 * np.cos(3 * angle) + NOISE * np.random.default_rng(0).normal(size=angle.size)
        assert roundness.Profile(angle, reading).turns == pytest.approx(turns, rel=1e-3)
