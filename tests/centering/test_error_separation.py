"""Part and spindle separated: published figures, dense least squares, noise by Monte Carlo, signs, refusals."""

from itertools import combinations

import numpy as np
import pytest
from circle_inside import Setups, split
from measured_rings import turn

import sdpgrind
from centering.roundness import (
    Harmonics,
    Instrument,
    Profile,
    Separation,
    SpindleError,
    multistep,
    reverse,
    step_angles,
)
from sdpgrind import units

PART = ((2, 0.4, 0.2), (3, 0.3, 1.0), (8, 0.2, 0.4))
SPINDLE = ((2, 0.1, 1.9), (5, 0.06, 0.3))
"""Forms of the table: upr, amplitude (um), phase (rad)."""
RADIUS = 2.9e3  # mm; a part so large that the circle is as good as a straight line

UNEVEN = np.array([0, 1, 3, 8, 14, 20, 29]) * units.deg(10)


def wave(waves, angle):
    return units.um(sum(amplitude * np.cos(n * angle - phase) for n, amplitude, phase in waves))


def readings(form, *, radius=RADIUS, offset=0.0, towards=0.0, size=720):
    """Exact readings, mm, of a form over the part angle, on a part off the axis, over an even spindle angle.

    The contact at spindle angle t lies at r = offset cos(towards - t) + sqrt(far^2 - (offset sin(..))^2), far
    from the centre by far = radius + form, at the part angle t - asin(offset sin(towards - t)/far).
    """
    angle = turn(1, size)
    across, far = offset * np.sin(towards - angle), radius
    for _ in range(5):  # each round is better by offset/radius times the slope of the form
        far = radius + form(angle - np.arcsin(across / far))
    return offset * np.cos(towards - angle) + np.sqrt(far**2 - across**2)


def steps_of(turns, *, part=PART, spindle=SPINDLE, noise=0.0, rng=None, offset=0.0, radius=RADIUS):
    """Profiles of a part that is turned on the spindle, set anew each time."""
    angle, rng = turn(1, 720), np.random.default_rng(rng)
    found = []
    for step in turns:
        towards = rng.uniform(0, 2 * np.pi)
        read = readings(lambda a, s=step: wave(part, a - s), radius=radius, offset=offset, towards=towards)
        found.append(Profile(angle, read + wave(spindle, angle) + noise * rng.normal(size=angle.size)))
    return found


def um(value):
    return pytest.approx(units.um(value), abs=units.um(1e-6))


def spindle_range(found):
    """Height at the angles of the readings, as the table has it."""
    return np.ptp(found.spindle.deviation(turn(1, 720)))


def test_one_reading_makes_the_part_look_better():
    (only,) = steps_of([0.0])
    assert np.ptp(only.deviation) == um(1.477627) and np.ptp(wave(PART, turn(1, 720))) == um(1.568218)


@pytest.mark.parametrize(
    ("turns", "height", "lost"),
    [
        (np.arange(4) * np.pi / 2, 1.330894, [4, 8, 12]),
        (np.arange(8) * np.pi / 4, 1.330894, [8, 16, 24]),
        (np.arange(9) * 2 * np.pi / 9, 1.568218, [9, 18, 27]),
        (UNEVEN, 1.568218, [36, 72, 108]),
    ],
    ids=["4", "8", "9", "uneven 7"],
)
def test_multistep_of_the_table(turns, height, lost):
    found = multistep(steps_of(turns), turns)
    assert np.ptp(found.part.deviation) == um(height) and spindle_range(found) == um(0.308877)
    assert found.lost[:3].tolist() == lost
    assert found.joint[8 - 2] == um(0.2 if 8 in lost else 0.0)


def test_singular_values_of_the_uneven_set():
    found = multistep(steps_of(UNEVEN), UNEVEN)
    counted = found.upr <= 50
    kept = found.singular[counted][~np.isin(found.upr[counted], found.lost)]
    assert found.lost[found.lost <= 50].tolist() == [36] and kept.min() == pytest.approx(1.81, abs=0.005)
    for n, least in zip((2, 7, 35), found.singular[[0, 5, 33]], strict=True):
        columns = np.column_stack([np.exp(-1j * n * UNEVEN), np.ones(7)])
        assert least == pytest.approx(np.linalg.svd(columns, compute_uv=False)[-1], rel=1e-12)


def test_dense_least_squares_of_all_readings():
    """Cosines and sines of part and spindle as columns, all readings of anyhow steps at once."""
    rng, turns, size, top = np.random.default_rng(3), np.array([0.3, 1.4, 2.2, 5.0]), 24, 6
    angle, upr = turn(1, size), np.arange(2, top + 1)
    form = 1e-3 * rng.normal(size=(turns.size, size))
    found = multistep([Profile(angle, RADIUS + each) for each in form], turns)

    def columns(at):
        phases = np.outer(at, np.arange(2, size // 2))
        return np.hstack([np.cos(phases), np.sin(phases)])

    rows = [np.hstack([columns(angle - step), columns(angle)]) for step in turns]
    low = [np.hstack([np.ones((size, 1)), np.cos(angle)[:, None], np.sin(angle)[:, None]]) for _ in turns]
    dense = np.zeros((turns.size * size, rows[0].shape[1] + 3 * turns.size))
    for k, (row, own) in enumerate(zip(rows, low, strict=True)):
        dense[k * size : (k + 1) * size] = np.hstack([row, np.zeros((size, 3 * turns.size))])
        dense[k * size : (k + 1) * size, row.shape[1] + 3 * k :][:, :3] = own
    solved = np.linalg.lstsq(dense, form.ravel(), rcond=None)[0]
    half = columns(angle).shape[1]
    expected = [columns(angle)[:, : upr.size] @ solved[first : first + upr.size] for first in (0, half)]
    expected = [
        part + columns(angle)[:, half // 2 :][:, : upr.size] @ solved[first + half // 2 :][: upr.size]
        for part, first in zip(expected, (0, half), strict=True)
    ]
    spectrum, spindle = found.part.harmonics(top), found.spindle.harmonics
    assert not found.lost.size
    np.testing.assert_allclose(spectrum.deviation(angle), expected[0], atol=1e-9)  # 1e-6 um; RADIUS is finite
    got = sum(spindle.amplitude[k] * np.cos((k + 2) * angle - spindle.phase[k]) for k in range(upr.size))
    np.testing.assert_allclose(got, expected[1], atol=1e-9)


@pytest.mark.parametrize("senses", [(1, 1, 1), (1, -1)])
def test_covariance_by_monte_carlo(senses):
    """20 000 trials at one harmonic: an sd is then known to 0.5 %."""
    rng, trials, senses = np.random.default_rng(5), 20_000, np.array(senses, dtype=float)
    setups = Setups(np.array([0.1, 0.5, 1.7])[: senses.size], senses)
    upr = np.full(trials, 3.0)
    noise = rng.normal(size=(2, senses.size, trials))
    found = split(noise[0] + 1j * noise[1], setups, upr)
    share = setups.common(upr[:1])[0] / senses.size
    sd = found.sd(setups, upr, np.ones(trials))[0]
    for each in (found.part, found.spindle):
        assert np.std([each.real, each.imag]) == pytest.approx(sd, rel=0.02)
    crossed = np.mean(found.part * found.spindle.conj()) / 2
    assert crossed == pytest.approx(-share.conjugate() * sd**2, abs=0.03 * sd**2)


def test_covariance_of_a_separation():
    found = multistep(steps_of(UNEVEN, noise=1e-5, rng=2), UNEVEN)
    columns = np.column_stack([np.exp(-5j * UNEVEN), np.ones(7)])
    expected = found.noise_sd[3] ** 2 * np.linalg.inv(columns.conj().T @ columns)
    np.testing.assert_allclose(found.covariance[3], expected, rtol=1e-9, atol=0)
    assert found.noise_sd[0] == pytest.approx(1e-5 * np.sqrt(2 / 720), rel=0.06)  # 3500 degrees of freedom


def test_noise_of_the_part_is_that_of_its_errors():
    found = [multistep(steps_of(UNEVEN, noise=1e-5, rng=seed), UNEVEN) for seed in range(6)]
    errors = [each.part.deviation - wave(PART, turn(1, 720)) for each in found]
    # 4300 values, of which 36 upr and its multiples are paid as half of their joint amplitude
    assert np.std(errors) == pytest.approx(found[0].part.noise_sd, rel=0.04)


def test_roundness_of_the_part_at_ten_nanometres_of_noise():
    """The truth is 1.56 um; the sd of 200 trials is 1.8 nm."""
    truth = Profile(turn(1, 720), RADIUS + wave(PART, turn(1, 720))).filter(upr=50).roundness().ron_t
    for seed in range(5):
        found = multistep(steps_of(UNEVEN, noise=1e-5, rng=seed), UNEVEN)
        assert abs(found.part.filter(upr=50).roundness().ron_t - truth) < units.um(0.0075)  # 4 sd


def test_eccentric_parts_are_centred_exactly():
    """A limacon of 50 um on 30 mm would leave d^2/4R = 21 nm of 2 upr; the spindle's angle differs by d/R."""
    found = multistep(steps_of(UNEVEN, offset=0.05, radius=30.0, rng=4), UNEVEN)
    moved = units.um(0.1 * 2 + 0.06 * 5) * 0.05 / 30.0
    assert np.abs(found.part.deviation - wave(PART, turn(1, 720))).max() < moved
    assert np.abs(found.spindle.deviation(turn(1, 720)) - wave(SPINDLE, turn(1, 720))).max() < moved


def test_steps_against_the_turn_are_refused():
    with pytest.raises(ValueError, match="angles must count in the sense of the profile's angle"):
        multistep(steps_of(UNEVEN), -UNEVEN)


def test_a_part_that_begins_turned_is_told_at_turn_0():
    found = multistep(steps_of(UNEVEN + 0.7), UNEVEN + 0.7)
    np.testing.assert_allclose(found.part.deviation, wave(PART, turn(1, 720)), atol=units.um(1e-5))


def pair(*, late=0.0, offsets=((0.0, 0.0), (0.0, 0.0)), part=PART, sense=-1, noise=0.0):
    angle, rng = turn(1, 720), np.random.default_rng(0)
    found = []
    for side, turned, (offset, towards) in zip((1, sense), (0.0, late), offsets, strict=True):
        read = readings(lambda a, t=turned: wave(part, a - t), offset=offset, towards=towards, radius=RADIUS)
        read = read + side * wave(SPINDLE, angle) + noise * rng.normal(size=angle.size)
        found.append(Profile(angle, read))
    return found


def test_reversal():
    found = reverse(*pair(offsets=((0.004, 0.3), (0.006, 2.0))))
    angle = turn(1, 720)
    np.testing.assert_allclose(found.part.deviation, wave(PART, angle), atol=units.um(1e-5))
    np.testing.assert_allclose(found.spindle.deviation(angle), wave(SPINDLE, angle), atol=units.um(1e-5))
    assert np.ptp(found.part.deviation) == um(1.568218) and spindle_range(found) == um(0.308877)
    assert found.spindle.harmonics.upr[0] == 2


FINE = (*PART, *((n, 0.02, 0.7 * n**2) for n in range(16, 50, 3)))
"""A part with fine form, which tells its angle."""


def test_a_second_profile_set_by_hand_is_aligned():
    found = reverse(*pair(late=units.deg(1.2), part=FINE))
    angle = turn(1, 720)
    np.testing.assert_allclose(found.part.deviation, wave(FINE, angle), atol=units.um(1e-5))
    np.testing.assert_allclose(found.spindle.deviation(angle), wave(SPINDLE, angle), atol=units.um(1e-5))
    assert "aligned by 1.2 degrees" in found.part.steps[-1]
    assert found.turns[1] == pytest.approx(units.deg(1.2), abs=1e-9)


def test_a_smooth_part_is_not_aligned():
    """Its spindle and a turn of the part look alike: the angles are trusted."""
    assert reverse(*pair(noise=1e-5)).turns.tolist() == [0.0, 0.0]


def test_waves_of_the_motor_do_not_align():
    """48 upr of the spindle above the fine form of the part would fit at 48 angles, none of them 0."""
    angle = turn(1, 720)
    motor = wave(((48, 0.05, 1.0),), angle)
    first, second = pair()
    found = reverse(Profile(angle, first.reading + motor), Profile(angle, second.reading - motor))
    assert found.turns.tolist() == [0.0, 0.0]
    assert found.spindle.harmonics.amplitude[48 - 2] == um(0.05)


def test_noise_of_a_reversal():
    found = reverse(*pair(noise=1e-5))
    error = found.part.deviation - wave(PART, turn(1, 720))
    assert found.part.noise_sd == pytest.approx(1e-5 / np.sqrt(2), rel=0.1)  # of 180 upper harmonics each
    assert np.std(error) == pytest.approx(1e-5 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize(
    ("profiles", "message"),
    [
        (pair(sense=1, offsets=((0.005, 0.3), (0.005, 0.3))), "less 1 upr in its sum .* the probe moved?"),
        (
            pair(part=FINE, late=np.pi, sense=1),
            "its form above 15 upr fits 180 degrees away: was the probe",
        ),
        ((pair()[0], Profile(turn(1, 360), 30 + 0 * turn(1, 360))), "second must be one even turn, as many"),
        ((pair()[0], Profile(np.sort(turn(1, 720) ** 2 / 7), np.full(720, 30.0))), "not evenly"),
        ((pair()[0], pair()[1].filter(upr=50)), "second must have the filter of first, ''; got 'Gaussian"),
    ],
    ids=["1 upr", "half a turn", "points", "uneven", "filter"],
)
def test_pairs_that_are_refused(profiles, message):
    with pytest.raises(ValueError, match=message):
        reverse(*profiles)


@pytest.mark.parametrize(
    ("count", "angles", "message"),
    [
        (2, [0, 1], "profiles must be at least 3, one for each step; got 2"),
        (3, [0, 1], "angles must be one for each of 3 profiles"),
        (3, [0, 1, 1], r"angles must be different from each other in the turn \(rad\)"),
        (3, [0, 1, 2 * np.pi], r"angles must be different from each other"),
        (3, [0, 10, 30], r"angles must be in rad, within one turn; units\.deg"),
    ],
)
def test_steps_that_are_refused(count, angles, message):
    with pytest.raises(ValueError, match=message):
        multistep(steps_of(np.arange(count)), angles)


def test_a_correction_takes_the_spindle_off():
    found = multistep(steps_of(UNEVEN, noise=1e-5, rng=1), UNEVEN)
    angle = turn(1, 720)
    other = ((3, 0.2, 0.5), (4, 0.1, 0.1))
    (before,) = steps_of([0.0], part=other, noise=1e-5, rng=7)
    after = before.correct(found.spindle)
    error = after.deviation - wave(other, angle)
    assert np.std(error) == pytest.approx(after.noise_sd, rel=0.1)  # 720 readings; noise of the upper half
    assert after.noise_sd == pytest.approx(np.hypot(before.noise_sd, found.spindle.noise_sd), rel=1e-12)
    assert after.steps[-1].startswith("error of the spindle taken off, 0.3") and "lost 36" in after.steps[-1]
    spectrum = after.harmonics(20)
    assert spectrum.sd[7] > before.harmonics(20).sd[7]


def test_a_lost_harmonic_is_not_taken_for_white_noise():
    """8 upr that may be the spindle's passes a low pass of 50 upr as it is."""
    turns = np.arange(4) * np.pi / 2
    found = multistep(steps_of(turns), turns)
    half = units.um(0.2) / np.sqrt(3)
    assert found.part.noise_sd == pytest.approx(half, rel=1e-3)
    (read,) = steps_of([0.0])
    for profile in (found.part, read.correct(found.spindle)):
        form = profile.filter(upr=50)
        assert form.noise_sd == pytest.approx(half * 2 ** -((8 / 50) ** 2), rel=1e-3)
        assert form.harmonics().sd[7] == pytest.approx(form.noise_sd, rel=1e-6)


@pytest.mark.parametrize("offset", [0.0, 0.02])
def test_a_correction_of_several_turns(offset):
    """What may be the spindle's at 8 upr is the same at each turn: it is not averaged."""
    turns = np.arange(4) * np.pi / 2
    spindle = multistep(steps_of(turns), turns).spindle
    angle, other = turn(3, 360), ((3, 0.2, 0.5), (4, 0.1, 0.1))
    read = np.tile(readings(lambda a: wave(other, a), offset=offset, size=360), 3) + wave(SPINDLE, angle)
    form = Profile(angle, read + 1e-6 * np.random.default_rng(0).normal(size=angle.size)).correct(spindle)
    found = form.filter(upr=50)
    np.testing.assert_allclose(found.deviation, wave(other, found.part_angle), atol=units.um(0.003))  # 5 sd
    assert found.noise_sd == pytest.approx(units.um(0.2) / np.sqrt(3) * 2 ** -((8 / 50) ** 2), rel=1e-3)
    assert found.deviation_sd.min() == pytest.approx(found.noise_sd, rel=1e-3)
    assert form.harmonics(20).sd[7] == pytest.approx(units.um(0.2) / np.sqrt(3), rel=1e-3)


def test_robust_profiles_have_unknown_noise():
    found = multistep([each.filter("robust", upr=50) for each in steps_of(UNEVEN)], UNEVEN)
    assert found.part.noise_sd == np.inf and np.all(np.isinf(found.spindle.harmonics.sd))
    assert np.ptp(found.part.deviation) == pytest.approx(units.um(1.568), rel=0.01)  # as unfiltered


def test_a_correction_comes_once_and_before_a_filter():
    spindle = SpindleError(Harmonics([2], [1e-4], [0.0]))
    (read,) = steps_of([0.0])
    with pytest.raises(ValueError, match="correct must come before a filter or a separation; got Gaussian"):
        read.filter(upr=50).correct(spindle)
    with pytest.raises(ValueError, match="got spindle taken off by 7 steps"):
        multistep(steps_of(UNEVEN), UNEVEN).part.correct(spindle)
    with pytest.raises(ValueError, match="correct must be applied once; got error of the spindle"):
        read.correct(spindle).correct(spindle)
    with pytest.raises(TypeError, match="spindle must be a SpindleError"):
        read.correct(spindle.harmonics)
    with pytest.raises(ValueError, match=r"harmonics must be from 2 upr on; got 1\.0"):
        SpindleError(Harmonics([1, 2], [1e-4, 1e-4], [0.0, 0.0]))


def test_filtered_profiles_are_separated_as_unfiltered_ones():
    whole = multistep(steps_of(UNEVEN, noise=1e-5, rng=3), UNEVEN)
    first = multistep([each.filter(upr=50) for each in steps_of(UNEVEN, noise=1e-5, rng=3)], UNEVEN)
    after = whole.part.filter(upr=50)
    np.testing.assert_allclose(first.part.deviation, after.deviation, atol=units.um(1e-5))
    assert first.part.noise_sd == pytest.approx(after.noise_sd, rel=0.1)  # noise of other harmonics
    assert first.part.roundness().filter == after.roundness().filter


def test_a_separation_is_saved_and_told(tmp_path):
    found = multistep(steps_of(UNEVEN), UNEVEN)
    found.save(tmp_path / "separation.nc")
    again = Separation.from_file(tmp_path / "separation.nc")
    assert again == found and again.part == found.part and repr(again) == repr(found)
    assert repr(found).startswith(
        "Separation(7 setups: part 1.568 µm, spindle 0.3089 µm from peak to valley;"
    )
    assert "lost 36, 72, 108, ... 324 upr" in repr(found) and "lost 36" in repr(found.spindle)
    corrected = steps_of([0.0])[0].correct(found.spindle)
    corrected.save(tmp_path / "corrected.nc")
    assert sdpgrind.load(tmp_path / "corrected.nc") == corrected


def test_picture_of_a_separation():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    part, spindle, singular = multistep(steps_of(UNEVEN), UNEVEN).plot().axes
    assert part.get_title() == "part: 1.57 µm from peak to valley"
    assert spindle.get_title() == "spindle: 0.309 µm from peak to valley"
    assert singular.get_title() == "lost 36, 72, 108, ... 324 upr"


def rank(places, index, upr_max):
    """Number of lost harmonics, and the largest common sum of the others: the smaller the better."""
    upr = np.arange(2, upr_max + 1)
    size = np.abs(np.exp(-2j * np.pi * np.outer(upr, places) / index).sum(axis=1))
    lost = np.sqrt(np.maximum(len(places) - size, 0.0)) < 0.3
    return int(lost.sum()), float(size[~lost].max(initial=0.0))


@pytest.mark.parametrize(
    ("count", "index", "upr_max"), [(3, 12, 30), (4, 13, 11), (5, 16, 15), (4, 4, 9), (5, 24, 50)]
)
def test_steps_are_the_best_of_all(count, index, upr_max):
    places = np.rint(step_angles(count, index, upr_max) * index / (2 * np.pi)).astype(int)
    assert places[0] == 0 and np.all(np.diff(places) > 0) and places[-1] < index
    best = min(rank((0, *rest), index, upr_max) for rest in combinations(range(1, index), count - 1))
    assert rank(places, index, upr_max) == (best[0], pytest.approx(best[1], abs=1e-9))


def test_seven_steps_of_36_are_not_worse_than_the_published_set():
    places = np.rint(step_angles(7, index=36, upr_max=50) * 18 / np.pi)
    lost, common = rank(places, 36, 50)
    published = rank(UNEVEN * 18 / np.pi, 36, 50)
    assert lost == published[0] == 1 and common <= published[1]
    assert np.sqrt(7 - common) == pytest.approx(1.983, abs=1e-3)  # the best of all 1.6 million sets
    assert np.array_equal(step_angles(7, index=36, upr_max=50), step_angles(7))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"count": 2}, "count must be >= 3; got 2"),
        ({"count": 7, "index": 6}, "index must be >= 7; got 6"),
        ({"count": 7, "upr_max": 1}, "upr_max must be >= 2; got 1"),
    ],
)
def test_searches_that_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        step_angles(**wrong)


def exchanged():
    """Two of seven exchanged: their residuals stand at the harmonics of the part, not in all."""
    angles = step_angles(7, index=36, upr_max=50)
    angle, rng = np.arange(720) * np.pi / 360, np.random.default_rng(0)

    def step(turned):
        part = 1e-3 * np.cos(2 * (angle - turned) - 0.3) + 4e-4 * np.cos(7 * (angle - turned) - 1.1)
        spindle = 1e-4 * np.cos(2 * angle - 1.9)
        return Profile(angle, 30.0 + part + spindle + 1e-5 * rng.normal(size=angle.size))

    steps = [step(each) for each in angles]
    assert not multistep(steps, angles).disagreement
    with pytest.warns(UserWarning, match=r"the steps do not agree: at [27] upr they leave .* exchanged"):
        return multistep([steps[0], steps[2], steps[1], *steps[3:]], angles)


def test_steps_that_do_not_agree_are_on_every_page(tmp_path):
    """The sentence is kept in the file, and no page of the part decides on its RONt."""
    found = exchanged()
    told, limit = found.disagreement, units.um(9.0)
    assert found.report().splitlines()[3].startswith(told)
    found.save(tmp_path / "both.nc")
    again = sdpgrind.load(tmp_path / "both.nc")
    assert again == found and again.disagreement == told
    old = found.dataset
    del old.attrs["disagreement"]
    assert not Separation.restored(old).disagreement
    form = again.part.filter(upr=50).roundness()
    budget = form.budget(Instrument(gain_sd=0.01))
    for page in (form, budget, again, again.part):
        text = page.report(limits={"RONt": limit})
        assert told in text and "limit 9 µm: not decided, the steps do not agree" in text
    assert told in form.remarks and form.conforms(limit) == budget.conforms(limit) == "not decided"
    assert form.interval().high < limit  # it would be accepted
