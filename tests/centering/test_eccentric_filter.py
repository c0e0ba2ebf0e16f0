"""Filter of a ring a few um off its axis: by FFT, beside dense algebra and beside the fit at its own angles."""

import numpy as np
import pytest
from measured_rings import turn

from centering.roundness import Profile, _profile_steps, _reading_noise
from centering.roundness._evened import evened
from centering.roundness._filters import Filter

RADIUS, NOISE = 30.0, 1e-4  # mm
EXACT = 1e-6  # of the root mean square of the readings, as the module says


def readings(angle, offset, noise=NOISE, rng=0):
    """Exact readings of lobes at their own angle about the centre of a ring off the axis, by fixed point."""
    x, y = offset * np.cos(0.8), offset * np.sin(0.8)
    far = np.full(angle.size, RADIUS)
    for _ in range(6):
        own = np.arctan2(far * np.sin(angle) - y, far * np.cos(angle) - x)
        lobes = RADIUS + 1e-3 * np.cos(3 * own) + 4e-4 * np.cos(17 * own - 1) + 1e-4 * np.cos(49 * own + 1)
        across = x * np.sin(angle) - y * np.cos(angle)
        far = x * np.cos(angle) + y * np.sin(angle) + np.sqrt(lobes**2 - across**2)
    return far + noise * np.random.default_rng(rng).normal(size=angle.size)


def waves(angle, size):
    """Columns of the wave forms of an even turn of so many points, up to half of them."""
    upr = np.arange(1, (size + 1) // 2)
    nyquist = [np.cos(size // 2 * angle)] if size % 2 == 0 else []
    return np.column_stack(
        [np.ones_like(angle), *np.cos(upr[:, None] * angle), *np.sin(upr[:, None] * angle), *nyquist]
    )


def low_passed(part_angle, cut_off):
    """Matrix from readings at these angles to the filtered form on the even turn, without 0 and 1 upr."""
    size = part_angle.size
    upr = np.arange(1, (size + 1) // 2)
    upr = np.concatenate([[0], upr, upr, [size // 2] * (size % 2 == 0)])
    passed = np.where(upr < 2, 0.0, np.exp2(-((upr / cut_off) ** 2)))
    return waves(turn(1, size), size) * passed @ np.linalg.inv(waves(part_angle, size))


@pytest.mark.parametrize("size", [240, 241])
@pytest.mark.parametrize("steps", [0.0, 0.01, 0.19])
@pytest.mark.parametrize("start", [0.0, 1.234])
def test_as_the_dense_solution(size, steps, start):
    """The wave form through all readings, filtered; a turn may begin at any angle."""
    profile = Profile(
        start + turn(1, size), readings(start + turn(1, size), steps * 2 * np.pi / size * RADIUS)
    )
    found = profile.filter(upr=15)
    assert "by FFT of readings moved by up to" in found.steps[-1]  # noise, too, moves the centre
    dense = low_passed(profile.part_angle, 15) @ profile.deviation
    rms = np.sqrt(np.mean(profile.deviation**2))
    far = np.sqrt(np.mean((found.deviation - found.deviation.mean() - dense) ** 2))
    assert far < EXACT * rms
    left = waves(profile.part_angle, size) @ np.linalg.solve(waves(turn(1, size), size), found.deviation)
    moved = profile.deviation - (found.circle.radius - profile.circle.radius)  # by less than 1 nm
    # noise of n/2 upr, 1e-4 / sqrt(240), has no phase that turns with the start
    assert found.residuals == pytest.approx(moved - left, abs=2e-5 if start else 1e-6)


@pytest.mark.parametrize("offset", [1e-4, 1e-3, 1e-2])
def test_as_the_fit_at_its_own_angles(offset):
    """A fit of 250 harmonics weighs noise above them otherwise: by less than 1e-6 of it at 10 um."""
    profile = Profile(turn(1, 3600), readings(turn(1, 3600), offset))
    quick, slow = profile.filter(upr=50), _profile_steps.filtered(profile, Filter("gaussian", 1.0, 50.0))
    away = slow.reading - slow.reading.mean() - (quick.reading - quick.reading.mean())
    assert np.abs(away).max() < 1e-6 * NOISE + EXACT * 7e-4
    assert quick.circle.value == pytest.approx(slow.circle.value, abs=1e-9)
    assert quick.noise_sd == pytest.approx(slow.origin.noise_sd, rel=1e-3)  # what 250 upr leave
    exact = readings(turn(1, 3600), 0.0, 0.0) - RADIUS
    assert np.std(quick.deviation - Filter("gaussian", 1.0, 50.0).applied(exact)) < 2 * quick.noise_sd


@pytest.mark.parametrize("steps", [0.05, 0.19])
def test_noise_of_the_even_formula(steps):
    """Each deviation's sd by the dense matrix differs by half the change of the steps, e/(2 R), as derived."""
    size = 240
    offset = steps * 2 * np.pi / size * RADIUS
    profile = Profile(turn(1, size), readings(turn(1, size), offset))
    even = np.linalg.norm(low_passed(turn(1, size), 15), axis=1)
    own = np.linalg.norm(low_passed(profile.part_angle, 15), axis=1)
    apart = own / even - 1
    assert np.abs(apart).max() == pytest.approx(offset / RADIUS / 2, rel=0.1)
    change = np.diff(profile.part_angle, append=profile.part_angle[0] + 2 * np.pi) * size / (2 * np.pi) - 1
    assert apart == pytest.approx(change / 2, abs=0.1 * offset / RADIUS)


def test_angles_that_are_not_near_are_fitted():
    """Beyond 0.2 steps the sweeps need not converge; where steps change fast, noise is not that of an even turn."""
    far = Profile(turn(1, 720), readings(turn(1, 720), 0.25 * 2 * np.pi / 720 * RADIUS))
    shaken = turn(1, 720) + 0.02 * 2 * np.pi / 720 * np.random.default_rng(0).uniform(-1, 1, 720)
    for profile in (
        far,
        Profile(shaken, readings(shaken, 0.0)),
        Profile(turn(2, 720), readings(turn(2, 720), 1e-3)),
    ):
        assert profile._evened is None and "by least squares" in profile.filter(upr=50).steps[-1]


@pytest.mark.parametrize("size", [1024, 8000])
def test_noise_is_found_alike(size):
    """By FFT and by a fit of all harmonics: from their upper half, or from what they leave."""
    profile = Profile(turn(1, size), readings(turn(1, size), 1e-3))
    by_fft = profile.noise_sd
    object.__setattr__(profile, "_evened", None)
    assert by_fft == pytest.approx(_reading_noise.noise_sd(profile), rel=1e-3) and by_fft != NOISE
    assert by_fft == pytest.approx(NOISE, rel=0.15)


def test_each_fit_is_made_once(monkeypatch):
    """None for a ring near its axis, one for other samples, whose own residuals or harmonics tell the noise."""
    made = []
    for module in (_profile_steps, _reading_noise):
        monkeypatch.setattr(module, "form_of", lambda *a, k=module.form_of: made.append(a) or k(*a))
    monkeypatch.setattr(
        _profile_steps, "broad_form", lambda *a, k=_profile_steps.broad_form: made.append(a) or k(*a)
    )
    monkeypatch.setattr(
        _profile_steps, "averaged_sd", lambda *_: pytest.fail("noise of readings is the same at each")
    )
    near = Profile(turn(1, 512), readings(turn(1, 512), 1e-3))
    assert np.all(near.filter(upr=50).deviation_sd == near.filter(upr=50).noise_sd) and not made
    Profile(turn(1, 512), readings(turn(1, 512), 1.0)).filter(upr=50)
    assert len(made) == 1
    made.clear()
    Profile(turn(1, 512), readings(turn(1, 512), 1.0)).harmonics()
    assert len(made) == 1


def test_evened_of_an_even_turn_is_itself():
    values = readings(turn(1, 100), 0.0) - RADIUS
    same = evened(turn(1, 100), values, np.array([RADIUS, 0.0, 0.0]))
    assert same.values is values and same.at_readings(values) is values
