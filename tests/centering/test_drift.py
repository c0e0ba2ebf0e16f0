"""Drift over parts: run lengths two ways, detected steps, alarms, gaps, learned noise, refusals."""

import numpy as np
import pytest
from circle_inside import (
    FEWEST,
    REFERENCE,
    Cusum,
    Innovation,
    cusum_detection,
    cusum_limit,
    cusum_run_length,
    ewma_run_length,
    ewma_sd,
    learned_widening,
    likely_step,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtri, stdtr
from scipy.stats import norm

import sdpgrind
from centering.monitoring import DriftTrack
from sdpgrind.identify import random_walk_gain

BOTH = {"stroke_offset": 0.002, "mu_kinetic": 0.004}


def run_lengths(reference, limit, series, rng, steps=20_000):
    """Values until each of many sums alarms, by plain steps; a sum that has alarmed is left out."""
    up, down, left, lengths = np.zeros(series), np.zeros(series), np.arange(series), np.zeros(series)
    for k in range(steps):
        z = rng.standard_normal(left.size)
        up, down = np.maximum(0, up + z - reference), np.maximum(0, down - z - reference)
        out = np.maximum(up, down) > limit
        if out.any():
            lengths[left[out]] = k + 1
            up, down, left = up[~out], down[~out], left[~out]
        if left.size == 0:
            return lengths
    raise AssertionError("a sum has not alarmed")


def innovations(readings, walk):
    """Standardised innovations of the settled filter, (series, n); the level starts at the truth, 0."""
    gain = random_walk_gain(walk**2, 1.0)
    level, out = np.zeros(len(readings)), []
    for column in readings.T:
        out.append((column - level) * np.sqrt(1 - gain))
        level = level + gain * (column - level)
    return np.array(out).T


@pytest.mark.parametrize(("reference", "limit", "published"), [(0.5, 4.0, 168.0), (0.5, 5.0, 465.0)])
def test_run_lengths_of_the_books(reference, limit, published):
    """Two-sided sums of Montgomery's table."""
    assert cusum_run_length(reference, limit) == pytest.approx(published, abs=0.9)


@pytest.mark.parametrize(
    ("weight", "sigmas", "published"), [(0.4, 3.054, 500.0), (0.2, 2.962, 500.0), (0.1, 2.814, 500.0)]
)
def test_run_lengths_of_averages(weight, sigmas, published):
    """Lucas and Saccucci's table."""
    assert ewma_run_length(weight, sigmas * ewma_sd(weight)) == pytest.approx(published, rel=0.005)


def test_a_sum_of_limit_zero_alarms_on_single_values():
    assert cusum_run_length(3.0, 1e-9) == pytest.approx(1 / (2 * norm.sf(3.0)), rel=1e-6)


@given(reference=st.floats(0.3, 2.0), length=st.floats(50.0, 1e6))
@settings(max_examples=30, deadline=None)
def test_limits_give_their_run_length(reference, length):
    assert cusum_run_length(reference, cusum_limit(reference, length)) == pytest.approx(length, rel=1e-6)


def test_run_length_by_drawing():
    limit = cusum_limit(REFERENCE, 300.0)
    lengths = run_lengths(REFERENCE, limit, 8000, np.random.default_rng(3))
    assert lengths.mean() == pytest.approx(300.0, abs=4 * 300 / np.sqrt(8000))


def test_detection_by_drawing_from_where_a_sum_starts():
    limit, means, n = 4.0, [2.9, 2.8, 2.5], 100_000
    z = np.random.default_rng(4).standard_normal((n, 3)) + means
    up, found = np.zeros(n), np.zeros(n, dtype=bool)
    for column in z.T:
        up = np.maximum(0, up + column - REFERENCE)
        found |= up > limit
    probability = cusum_detection(REFERENCE, limit, means)
    assert found.mean() == pytest.approx(probability, abs=4 * np.sqrt(probability * (1 - probability) / n))


def test_this_reference_finds_such_steps_most_often():
    walk = 0.03
    gain = random_walk_gain(walk**2, 1.0)
    means = 3 * np.sqrt(1 - gain) * (1 - gain) ** np.arange(5)
    for length in (1000.0, 4000.0, 1e4):
        found = {
            k: cusum_detection(k, cusum_limit(k, length), means)
            for k in (0.6, 0.75, REFERENCE, 1.05, 1.2, 1.5)
        }
        assert found[REFERENCE] >= max(found.values()) - 1e-4


def test_a_step_of_three_sd_is_flagged_within_five_parts():
    """Probability 0.99 at one false alarm in 2000 parts, by the chain and in 100 000 series; the step comes at part 40."""
    track, n = DriftTrack(BOTH), 100_000
    least = track.detection_probability(step=3.0, within=5)
    assert least == pytest.approx(0.9930, abs=1e-4)
    rng = np.random.default_rng(5)
    readings = rng.standard_normal((n, 45)) + np.cumsum(0.03 * rng.standard_normal((n, 45)), axis=1)
    readings[:, 40:] += 3.0
    z = innovations(readings, 0.03)
    up, down, early, found = np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for k, column in enumerate(z.T):
        up, down = np.maximum(0, up + column - REFERENCE), np.maximum(0, down - column - REFERENCE)
        flagged = np.maximum(up, down) > track.limit
        early |= flagged & (k < 40)
        found |= flagged & (k >= 40)
    share = found[~early].mean()
    assert least - 4e-4 <= share <= least + 3e-3  # sums do not all stand at 0 when the step comes


def test_false_alarms_are_fewer_than_one_in_a_thousand_parts():
    """Two quantities of one track, each half of the rate."""
    track = DriftTrack(BOTH)
    assert cusum_run_length(REFERENCE, track.limit) == pytest.approx(4000.0, rel=1e-6)
    lengths = run_lengths(REFERENCE, track.limit, 1000, np.random.default_rng(6), steps=60_000)
    assert lengths.mean() / 2 == pytest.approx(2000.0, rel=4 / np.sqrt(1000))


def test_more_false_alarms_allowed_find_more():
    often, seldom = (
        DriftTrack(BOTH, parts_per_false_alarm=1000.0),
        DriftTrack(BOTH, parts_per_false_alarm=1e4),
    )
    assert often.detection_probability() > 0.9958 > 0.98 > seldom.detection_probability() > 0.97
    assert often.detection_probability(step=2.0) < often.detection_probability(step=2.0, within=20)
    assert often.detection_probability(step=-3.0) == often.detection_probability()
    assert often.detection_probability(after=5) < often.detection_probability()


def test_the_track_is_filter_and_sum():
    """The same numbers by the settled filter and plain steps of the sum."""
    rng = np.random.default_rng(8)
    readings = 0.15 + 0.002 * rng.standard_normal(400)
    track = DriftTrack({"stroke_offset": 0.002}, parts_per_false_alarm=1e6)
    for reading in readings:
        track.update(stroke_offset=reading)
    level = track.dataset["stroke_offset_level"].values
    gain = random_walk_gain(0.03**2, 1.0)
    np.testing.assert_allclose(
        level[300:], level[299:-1] + gain * (readings[300:] - level[299:-1]), rtol=1e-6
    )
    cusum, sums = Cusum(REFERENCE, np.inf), []
    settled = (readings[1:] - level[:-1]) / 0.002
    for k, value in enumerate(settled):
        spread = np.sqrt(1 / (1 - gain)) if k > 250 else _spread(k + 1)
        cusum.update(value / spread)
        sums.append(cusum.up if cusum.up >= cusum.down else -cusum.down)
    np.testing.assert_allclose(track.dataset["stroke_offset_sum"].values[1:], sums, atol=1e-6)


def _spread(count):
    """Standard deviation of an innovation after `count` readings, for noise of sd 1."""
    variance = 1.0
    for _ in range(count - 1):
        variance = (variance + 0.03**2) / (variance + 0.03**2 + 1)
    return np.sqrt(variance + 0.03**2 + 1)


def stepped(size, *, noise_sd=None, parts=120, rng=11):
    """Track of friction that steps after `parts`, up to its alarm."""
    draw = np.random.default_rng(rng)
    track = DriftTrack({"mu_kinetic": noise_sd})
    for _ in range(parts):
        track.update(mu_kinetic=0.135 + 0.004 * draw.standard_normal())
    assert not track.history
    while not track.alarms:
        track.update(mu_kinetic=0.135 + size + 0.004 * draw.standard_normal())
    return track


@pytest.mark.parametrize("noise_sd", [0.004, None])
@pytest.mark.parametrize("sign", [1, -1])
def test_alarm(sign, noise_sd):
    track = stepped(sign * 0.016, noise_sd=noise_sd)
    (alarm,) = track.alarms
    assert alarm.quantity == "mu_kinetic" and alarm.since == 120 and 120 <= alarm.part <= 124
    assert alarm.upward == (sign > 0) and abs(alarm.size - sign * 0.016) < 3 * alarm.size_sd < 0.01
    way = "up" if sign > 0 else "down"
    assert str(alarm).startswith(f"mu kinetic stepped {way} by 0.01") and "since part 120" in str(alarm)
    assert "material or lubricant changed" in str(alarm) and str(alarm) in repr(track)
    assert str(alarm).endswith(f"(not watched since part {alarm.part}; acknowledge() goes on)")
    assert abs(track.estimate["mu_kinetic"] - (0.135 + sign * 0.016)) < 3 * track.estimate.sd[0] < 0.012


def test_steps_are_flagged_by_the_track_itself():
    """100 tracks, a step of 3 sd after 40 parts: within 5 parts in all but one or two."""
    rng, found = np.random.default_rng(15), 0
    for _ in range(100):
        track = DriftTrack({"stroke_offset": 0.002}, parts_per_false_alarm=4000.0)
        for reading in rng.standard_normal(40):
            track.update(stroke_offset=0.15 + 0.002 * reading)
        for reading in rng.standard_normal(5):
            track.update(stroke_offset=0.156 + 0.002 * reading)
        found += bool(track.alarms)
    assert found >= 97


def test_one_stray_reading_is_told_as_such():
    track = DriftTrack({"mu_kinetic": 0.004})
    for reading in 10 * [0.135] + [0.165]:
        found = track.update(mu_kinetic=reading)
    assert "since part 10, by one reading so far" in str(found[0])


def test_acknowledged_alarms_are_over():
    track = stepped(0.016, noise_sd=0.004)
    for _ in range(20):
        assert track.update(mu_kinetic=0.5) == ()  # not watched
    assert len(track.alarms) == 1
    unwatched, since = np.isnan(track.dataset["mu_kinetic_sum"].values), track.alarms[0].part
    assert unwatched[since + 1 :].all() and not unwatched[: since + 1].any()
    track.acknowledge("mu_kinetic")
    assert "acknowledge" not in repr(track)
    assert track.alarms == () and len(track.history) == 1 and not track.estimate.ok
    for _ in range(10):
        assert track.update(mu_kinetic=0.135) == ()  # a new level, whatever it is
    assert track.estimate["mu_kinetic"] == pytest.approx(0.135)
    assert np.isfinite(track.dataset["mu_kinetic_sum"].values[-10:]).all()
    track.reset()
    assert track.count == 0 and track.history == ()


def test_the_begin_of_a_step_is_found_among_noise():
    off = np.array(
        [stepped(0.012, noise_sd=0.004, rng=seed, parts=60).alarms[0].since - 60 for seed in range(40, 100)]
    )
    assert np.mean(np.abs(off) <= 1) >= 0.9


def test_likely_step_against_least_squares():
    """By brute force: filter runs on unit steps are the regressors."""
    rng = np.random.default_rng(2)
    values, spreads = rng.standard_normal(12), 1 + 0.1 * rng.random(12)
    values[7:] += 2.0
    shocks = [
        Innovation(k, value, spread) for k, (value, spread) in enumerate(zip(values, spreads, strict=True))
    ]
    best = None
    for j in range(12):
        level, row = 0.0, np.zeros(12)
        for k in range(12):
            jump = (1.0 if k >= j else 0.0) - level
            row[k] = jump / spreads[k]
            level += (1 - spreads[k] ** -2) * jump
        size = row @ values / (row @ row)
        rest = np.sum((values - size * row) ** 2)
        if size > 0 and (best is None or rest < best[0]):
            best = rest, j, size, (row @ row) ** -0.5
    np.testing.assert_allclose(likely_step(shocks, 1), best[1:], rtol=1e-12)


def test_units_of_own_quantities():
    track = DriftTrack({"push_force": 1.0, "gap": 0.002, "mu_kinetic": 0.004}, units={"push_force": "N"})
    for force in 10 * [80.0] + 3 * [95.0]:
        track.update(push_force=force)
    assert str(track.history[0]).startswith("push force stepped up by 15 ± ") and " N since part 10" in str(
        track.history[0]
    )
    assert (
        track.estimate.units == ("N", "mm", "1") and track.dataset["push_force_level"].attrs["units"] == "N"
    )


def test_a_trend_alarms_after_as_many_parts_as_is_said():
    """Of 0.02 sd a part: 130 parts on average, by 60 tracks."""
    rng, waits = np.random.default_rng(16), []
    for _ in range(60):
        track = DriftTrack({"gap": 1.0})
        while not track.alarms:
            track.update(gap=0.02 * track.count + rng.standard_normal())
        waits.append(track.count)
    assert np.mean(waits) == pytest.approx(130, abs=4 * np.std(waits) / np.sqrt(len(waits)) + 5)


def learned_alarms(readings, walk, limit, widening):
    """Alarms of many series, (parts, series): filter, Student's distribution, delayed learning, plain sum."""
    parts, n = readings.shape
    level, variance, square, count = np.zeros(n), np.full(n, np.inf), np.zeros(n), np.zeros(n)
    up, down, held, waiting = np.zeros(n), np.zeros(n), np.zeros((n, 10)), np.zeros(n, dtype=int)
    alarms = np.zeros((parts, n), dtype=bool)
    for part, reading in enumerate(readings):
        seen = np.isfinite(variance)
        before = np.where(seen, variance, 0.0) + walk**2
        shock = np.where(seen, (reading - level) / np.sqrt(before + 1), 0.0)
        level = np.where(seen, level + before / (before + 1) * (reading - level), reading)
        variance = np.where(seen, before / (before + 1), 1.0)
        ready = seen & (count >= 20)
        sd, free = np.sqrt(square / np.maximum(count, 1)), np.maximum(count, 1)
        score = np.zeros(n)
        score[ready] = -np.sign(shock[ready]) * ndtri(
            stdtr(free[ready], -np.abs(shock / np.where(sd > 0, sd, 1))[ready])
        )
        up, down = (
            np.where(seen, np.maximum(0, s + sign * score - REFERENCE), s)
            for s, sign in ((up, 1), (down, -1))
        )
        out = ready & (np.maximum(up, down) > limit + widening / free)
        alarms[part] = out
        learn = seen & ~out
        full, place = learn & (waiting >= 10), waiting % 10
        square += np.where(full, held[np.arange(n), place] ** 2, 0.0)
        count += full
        held[learn, place[learn]] = shock[learn]
        waiting = np.where(out, 0, waiting + learn)
        up[out] = down[out] = 0.0
        variance[out] = np.inf
    return alarms


def test_learned_noise_against_plain_steps():
    """The same alarms from the same readings, each acknowledged at once."""
    readings = np.random.default_rng(12).standard_normal((300, 6))
    limit, widening = cusum_limit(REFERENCE, 50.0), learned_widening(REFERENCE, 50.0, FEWEST)
    twin = learned_alarms(readings, 0.03, limit, widening)
    for series, column in enumerate(readings.T):
        track, alarms = DriftTrack({"mu_kinetic": None}, parts_per_false_alarm=50.0), []
        for reading in column:
            alarms.append(bool(track.update(mu_kinetic=0.1 + 0.01 * reading)))
            track.acknowledge()
        assert alarms == twin[:, series].tolist()
    assert twin.sum() > 15


def test_learned_noise_alarms_no_oftener_than_known_noise():
    """From the first possible part on; uncorrected, Student scores alarm 1.5 times as often."""
    limit, widening = cusum_limit(REFERENCE, 500.0), learned_widening(REFERENCE, 500.0, FEWEST)
    rng, n = np.random.default_rng(1), 5000
    readings = rng.standard_normal((300, n)) + np.cumsum(0.03 * rng.standard_normal((300, n)), axis=0)
    alarms = learned_alarms(readings, 0.03, limit, widening).sum(axis=1)
    assert alarms[:31].sum() == 0
    for first, last in ((31, 60), (60, 100), (100, 200), (200, 300)):
        expected = n * (last - first) / 500.0
        assert abs(alarms[first:last].sum() - expected) < 4 * np.sqrt(expected) + 0.05 * expected


@pytest.mark.parametrize("freedom", [20, 60, 300])
def test_widened_limits_by_drawing_what_was_learned(freedom):
    """Sums of values over a standard deviation estimated from other values, each sum with its own."""
    limit = cusum_limit(REFERENCE, 100.0) + learned_widening(REFERENCE, 100.0, 20) / freedom
    rng, series = np.random.default_rng(9), 20_000
    sd = np.sqrt(rng.chisquare(freedom, series) / freedom)
    up, down, alarms = np.zeros(series), np.zeros(series), 0
    for part in range(60):
        value = rng.standard_normal(series) / sd
        score = -np.sign(value) * ndtri(stdtr(freedom, -np.abs(value)))
        up, down = np.maximum(0, up + score - REFERENCE), np.maximum(0, down - score - REFERENCE)
        out = np.maximum(up, down) > limit
        alarms += out.sum() if part >= 20 else 0  # the first ones come later, as sums start at 0
        up[out] = down[out] = 0.0
    expected = series * 40 / 100.0
    assert abs(alarms - expected) < 4 * np.sqrt(expected) + 0.03 * expected


def test_a_step_after_readings_all_alike_is_found():
    """The first change may be one step of the rounding; a lasting one alarms."""
    for step in (0.001, 0.03, -0.03):
        track, found = DriftTrack({"mu_kinetic": None}), []
        for part in range(64):
            found += track.update(mu_kinetic=0.13 + (step if part >= 60 else 0.0))
        assert [alarm.since for alarm in found] == [60] and found[0].part <= 62
    track = DriftTrack({"mu_kinetic": None})
    for part in range(300):  # now and then by one step up, as rounded readings are
        assert track.update(mu_kinetic=0.131 if part % 20 == 7 else 0.13) == ()


@pytest.mark.parametrize("missing", [float("nan"), np.float64("nan"), np.float32("nan"), np.float16("nan")])
def test_nan_of_any_kind_was_not_read(missing):
    track = DriftTrack({"mu_kinetic": 0.004})
    assert track.update(mu_kinetic=0.1) == track.update(mu_kinetic=missing) == ()
    assert track.count == 2 and np.isnan(track.dataset["mu_kinetic"].values[1])


def test_readings_that_do_not_scatter_do_not_alarm():
    track = DriftTrack()
    for _ in range(100):
        assert track.update(stroke_offset=0.15, mu_kinetic=0.1) == ()
    assert track.estimate["stroke_offset"] == 0.15


def test_missing_readings_are_passed_over():
    draw, track = np.random.default_rng(13), DriftTrack({"mu_kinetic": 0.004, "stroke_offset": None})
    for part in range(60):
        track.update(mu_kinetic=np.nan if part % 3 == 0 else 0.135 + 0.004 * draw.standard_normal())
    assert track.alarms == () and track.estimate.sd[0] < 0.002 and np.isinf(track.estimate.sd[1])
    data = track.dataset
    assert data.sizes["part"] == 60 and np.isnan(data["mu_kinetic"].values[::3]).all()
    assert data["mu_kinetic_level"].attrs["units"] == "1" and data["stroke_offset"].attrs["units"] == "mm"


def test_picture():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    track = stepped(0.016, noise_sd=0.004)
    top, low = track.plot().axes
    assert top.get_ylabel() == "mu kinetic" and low.get_xlabel() == "part"
    assert [text.get_text() for text in top.texts] == ["since 120"]
    since = track.alarms[0].part
    assert [text.get_text() for text in low.texts] == [
        f"not watched since part {since}; acknowledge() goes on"
    ]
    track.acknowledge()
    assert not track.plot().axes[1].texts
    assert len(DriftTrack().plot().axes) == 4


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (lambda: DriftTrack({}), TypeError, "noise_sd must be a mapping of names to numbers or None"),
        (
            lambda: DriftTrack({"mu_kinetic": 0.0}),
            ValueError,
            r"noise_sd\['mu_kinetic'\] must be > 0 \(1\); got 0.0",
        ),
        (
            lambda: DriftTrack({"stroke_offset": -1.0}),
            ValueError,
            r"noise_sd\['stroke_offset'\] must be > 0 \(mm\); got -1.0",
        ),
        (
            lambda: DriftTrack({"force": -1.0}, units={"force": "N"}),
            ValueError,
            r"noise_sd\['force'\] must be > 0 \(N\)",
        ),
        (
            lambda: DriftTrack(units={"force": "N"}),
            ValueError,
            "units must be one of stroke_offset, mu_kinetic; got 'force'",
        ),
        (
            lambda: DriftTrack(units={"mu_kinetic": 1}),
            TypeError,
            r"units\['mu_kinetic'\] must be a str; got 1",
        ),
        (lambda: DriftTrack(units="mm"), TypeError, "units must be a mapping of names to units; got 'mm'"),
        (lambda: DriftTrack(walk=0.0), ValueError, r"walk must be > 0 \(1\); got 0.0"),
        (
            lambda: DriftTrack(parts_per_false_alarm=1.0),
            ValueError,
            r"parts_per_false_alarm must be in \[10, 1e\+08\]",
        ),
        (
            lambda: DriftTrack().update(mu=0.1),
            ValueError,
            "readings must be one of stroke_offset, mu_kinetic; got 'mu'",
        ),
        (
            lambda: DriftTrack().update(mu_kinetic="low"),
            TypeError,
            r"mu_kinetic must be a number \(1\); got 'low'",
        ),
        (
            lambda: DriftTrack().update(mu_kinetic=np.inf),
            ValueError,
            r"mu_kinetic must be finite \(1\); got inf",
        ),
        (
            lambda: DriftTrack().acknowledge("force"),
            ValueError,
            "names must be one of stroke_offset, mu_kinetic; got 'force'",
        ),
        (lambda: DriftTrack().detection_probability(within=0), ValueError, "within must be >= 1; got 0"),
    ],
)
def test_refusals(call, error, said):
    with pytest.raises(error, match=said):
        call()


def wandering(seed, parts=240):
    """Readings of both quantities with two steps, some rounded, some missing; and the acknowledgements."""
    rng = np.random.default_rng(seed)
    level = np.cumsum(rng.normal(0.0, 1e-4, parts)) + np.where(np.arange(parts) > 90, 0.02, 0.0)
    rows = [{"stroke_offset": float(np.round(x + e, 4)), "mu_kinetic": 0.135 + f} for x, e, f in
            zip(level, rng.normal(0.0, 2e-3, parts), rng.normal(0.0, 4e-3, parts), strict=True)]  # fmt: skip
    for part in range(150, parts):
        rows[part]["mu_kinetic"] += 0.03
    rows[7].pop("mu_kinetic")
    rows[11]["stroke_offset"] = np.nan
    return rows, {120: ("stroke_offset",), 180: ("mu_kinetic", "stroke_offset")}


def run(track, rows, acknowledged, first, last):
    """New alarms of each part."""
    found = []
    for part in range(first, last):
        found.append(track.update(**rows[part]))
        if part in acknowledged:
            track.acknowledge(*acknowledged[part])
    return found


@pytest.mark.parametrize("noise", [None, BOTH], ids=["learned", "known"])
@pytest.mark.parametrize("parts", [0, 25, 60, 91, 121, 160, 181])
def test_a_loaded_track_goes_on(tmp_path, noise, parts):
    """Bit-equal, saved while the noise is learned, between step and alarm, after one and two alarms."""
    rows, acknowledged = wandering(4)
    whole, path = DriftTrack(noise, walk=0.05, parts_per_false_alarm=700.0), tmp_path / "track.nc"
    run(whole, rows, acknowledged, 0, parts)
    whole.save(path)
    loaded = sdpgrind.load(path)
    assert type(loaded) is DriftTrack and loaded.history == whole.history and loaded.alarms == whole.alarms
    assert run(loaded, rows, acknowledged, parts, 240) == run(whole, rows, acknowledged, parts, 240)
    assert {alarm.quantity for alarm in whole.history} == set(BOTH) and loaded.history == whole.history
    assert loaded.dataset.identical(whole.dataset) and repr(loaded) == repr(whole)
    np.testing.assert_array_equal(loaded.estimate.covariance, whole.estimate.covariance)


def test_names_and_units_in_a_file(tmp_path):
    """Names unusual for variables; noise known of one quantity only; acknowledgements without parts
    between.
    """
    track = DriftTrack({"a/b c": None, "part": 0.5, "part_level": 0.1}, units={"a/b c": "", "part": "N"})
    track.update(part=1.0)
    track.acknowledge("part", "a/b c")
    track.acknowledge("part")
    track.save(tmp_path / "track.nc")
    loaded = DriftTrack.from_file(tmp_path / "track.nc")
    assert loaded.estimate.units == ("", "N", "mm") and loaded.estimate.names == track.estimate.names
    assert loaded.count == 1 and np.isinf(loaded.estimate.sd).all()
    loaded.save(tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "track.nc").read_bytes()


def test_what_was_forgotten_is_not_saved(tmp_path):
    rows, acknowledged = wandering(4)
    track = DriftTrack(BOTH)
    run(track, rows, acknowledged, 0, 200)
    track.reset()
    track.save(tmp_path / "track.nc")
    loaded = sdpgrind.load(tmp_path / "track.nc")
    assert loaded.count == 0 and loaded.history == () and repr(loaded) == repr(DriftTrack(BOTH))
