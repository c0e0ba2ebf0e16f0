"""Before and after grinding: rotation, removed form, chance that RONt fell by two ways, files, refusals."""

from hashlib import sha256

import numpy as np
import pytest
from circle_inside import chance_below
from measured_rings import form, turn
from scipy.special import ndtri

from centering.roundness import FormChange, Profile, RoundnessInterval
from sdpgrind import units

BEFORE = {2: (2e-3, 0.3), 3: (1e-3, 1.1), 7: (4e-4, 2.0), 12: (3e-4, 0.0)}
KEPT = {2: 0.15, 3: 0.6, 7: 0.875, 12: 1 / 3}
ANGLE = turn(1, 1024)


def ring(lobes, by=0.0, noise=0.0, rng=0, offset=0.0, radius=30.0):
    """A part that was turned by an angle, rad, and lies off the axis, mm."""
    high = radius + form(ANGLE - by, lobes)
    read = offset * np.cos(ANGLE - 0.5) + np.sqrt(high**2 - (offset * np.sin(ANGLE - 0.5)) ** 2)
    return Profile(read + noise * np.random.default_rng(rng).normal(size=ANGLE.size))


def ground(lobes=BEFORE):
    return {upr: (KEPT[upr] * size, phase) for upr, (size, phase) in lobes.items()}


@pytest.mark.parametrize("by", [0.0, 1.234, -3.0, np.pi])
def test_the_form_that_was_removed(by):
    """What is left has the phases of before: 15 to 87.5 % of each wave, of another radius."""
    change = ring(ground(), by, radius=29.9).compare(ring(BEFORE))
    assert np.angle(np.exp(1j * (change.rotation - by))) == pytest.approx(0.0, abs=1e-9)
    table = change.to_dataframe()
    passed = np.exp2(-((table.index.to_numpy() / 50) ** 2))
    for upr, (size, phase) in BEFORE.items():
        row = table.loc[upr]
        assert row["ratio"] == pytest.approx(KEPT[upr], abs=1e-6)
        assert row["change"] == pytest.approx(size * (KEPT[upr] - 1) * passed[upr - 2], abs=1e-9)
        assert np.angle(np.exp(1j * (change.removed.phase[upr - 2] - phase))) == pytest.approx(0, abs=1e-6)
    both = {upr: (BEFORE[upr][0], ground()[upr][0]) for upr in BEFORE}
    norms = np.sqrt(sum(np.array(pair) ** 2 * passed[upr - 2] ** 2 for upr, pair in both.items()))
    cross = sum(b * a * passed[upr - 2] ** 2 for upr, (b, a) in both.items())
    assert change.correlation == pytest.approx(cross / norms.prod(), abs=1e-6)
    assert change.ron_t_before == pytest.approx(ring(BEFORE).filter(upr=50).roundness().ron_t, abs=1e-12)


def test_rotation_by_brute_force():
    """The highest correlation of noisy forms on a grid of 1e-5 rad."""
    before, after = ring(BEFORE, noise=2e-4, rng=1), ring(ground(), 0.7, noise=2e-4, rng=2, offset=0.1)
    found = after.compare(before, upr=15).rotation
    one, other = (each.filter(upr=15).harmonics() for each in (before, after))
    size = min(one.upr.size, other.upr.size)
    at = np.arange(0.6, 0.8, 1e-5)
    shared = (one.amplitude[:size] * other.amplitude[:size])[:, None]
    phases = (one.phase[:size] - other.phase[:size])[:, None] + np.outer(one.upr[:size], at)
    best = at[np.argmax(np.sum(shared * np.cos(phases), axis=0))]
    assert found == pytest.approx(best, abs=2e-5)


def test_a_rotation_that_is_given():
    change = ring(ground(), 0.3).compare(ring(BEFORE), rotation=0.3)
    assert change.rotation == 0.3 and np.nanmax(np.abs(change.ratio[[0, 1, 5]] - [0.15, 0.6, 0.875])) < 1e-6
    with pytest.warns(UserWarning, match="hardly tell how the part was turned .*: 3 rotations fit alike"):
        ring({3: (1e-3, 0.3)}).compare(ring({3: (2e-3, 0.1)}))
    with pytest.warns(UserWarning, match=r"hardly tell .*: the best correlation is 0\.\d+"):
        ring({5: (1e-3, 0.3), 2: (2e-4, 0.0), 3: (2e-4, 0.0)}).compare(
            ring({4: (2e-3, 0.1), 2: (3e-4, 0.0), 3: (3e-4, 0.0)})
        )
    with pytest.raises(TypeError, match=r"rotation must be a number \(rad\)"):
        ring(ground()).compare(ring(BEFORE), rotation="0")


def drawn(ends, size, rng):
    """RONt drawn as it is taken: half of the draws on each side of the value, mm."""
    score = rng.normal(size=size)
    return ends.value + score * np.where(score < 0, ends.value - ends.low, ends.high - ends.value) / 1.959964


@pytest.mark.parametrize("pair", [((1.9, 2.1, 2.0), (1.95, 2.3, 2.05)), ((0.0, 0.4, 0.3), (0.2, 0.5, 0.25))])
def test_the_chance_by_monte_carlo(pair):
    """A million draws: standard deviation of at most 5e-4."""
    one, other = (RoundnessInterval(*units.um(np.array(ends)), 0.95, "calibrated") for ends in pair)
    rng = np.random.default_rng(0)
    below = np.mean(drawn(one, 1_000_000, rng) < drawn(other, 1_000_000, rng))
    assert chance_below(one, other) == pytest.approx(below, abs=2e-3)
    assert chance_below(one, other) + chance_below(other, one) == pytest.approx(1.0, abs=1e-3)
    sure = RoundnessInterval(*[units.um(2.0)] * 3, 0.95, "calibrated")
    assert chance_below(sure, sure) == 0.5
    assert chance_below(sure, RoundnessInterval(3e-3, 3e-3, 3e-3, 0.95, "calibrated")) == 1.0


def test_without_noise_known_there_is_no_chance(tmp_path):
    pair = [each.filter("robust", upr=50) for each in (ring(ground(), noise=1e-5), ring(BEFORE, noise=1e-5))]
    change = pair[0].compare(pair[1])
    assert change.probability is None and "probability" not in repr(change)
    change.save(tmp_path / "change.nc")
    assert FormChange.from_file(tmp_path / "change.nc") == change


def test_saved_drawn_and_reported(tmp_path):
    change = ring(ground(), 0.4, noise=5e-5, rng=1).compare(ring(BEFORE, noise=5e-5))
    change.save(tmp_path / "change.nc")
    again = FormChange.from_file(tmp_path / "change.nc")
    assert again == change and again.probability == change.probability > 0.999
    told = change.report()
    assert "fell with probability above 0.9999; turned by 22.8" in told and "after/before" in told
    rows = told[told.index("Largest undulations") :].partition("\n\n")[0].splitlines()[2:]
    assert [int(row.split()[0]) for row in rows] == [2, 3, 7, 12]
    change.report(tmp_path / "grinding.html")
    assert (tmp_path / "grinding.html").read_text().count("<svg") == 1
    before, after = (each.get_label() for each in change.plot().axes[1].collections)
    assert (before, after) == ("before", "after")


def test_profiles_that_are_refused():
    before, after = ring(BEFORE), ring(ground())
    with pytest.raises(
        ValueError, match="before must be filtered as this profile, not at all; got 'Gaussian"
    ):
        after.compare(before.filter(upr=50))
    with pytest.raises(ValueError, match="upr must be left out where both profiles are filtered"):
        after.filter(upr=50).compare(before.filter(upr=50), upr=15)
    with pytest.raises(TypeError, match="before must be a Profile"):
        after.compare(before.harmonics())
    bore = Profile(ANGLE, before.reading, internal=True)
    with pytest.raises(ValueError, match="before must be of one side, internal=False; got True"):
        after.compare(bore)
    assert after.filter("spline", upr=50).compare(before.filter("spline", upr=50)).filter.startswith("spline")


def test_what_grew_is_told_and_has_no_ratio_where_nothing_was(tmp_path):
    """5 upr were not there before, 3 upr grew by 0.5 um; amplitudes of 1e-5 sqrt(2/1024) mm are noise."""
    before = ring({2: (2e-3, 0.3), 3: (1e-3, 1.1)}, noise=1e-5)
    after = ring({2: (1e-3, 0.3), 3: (1.5e-3, 1.1), 5: (3e-4, 0.0)}, noise=1e-5, rng=1)
    change = after.compare(before, rotation=0.0)
    table = change.to_dataframe()
    assert table.loc[[2, 3, 5], "change"].tolist() == pytest.approx([-1e-3, 5e-4, 3e-4], rel=0.02)
    assert table.loc[[2, 3], "ratio"].tolist() == pytest.approx([0.5, 1.5], rel=0.01)
    assert np.isnan(table.loc[5, "ratio"])
    assert change.remarks[0] == "grew: 3 upr by 0.5 µm, 5 upr by 0.3 µm"
    assert change.remarks[0] in change.report() and "removed" not in change.report()
    assert change.remarks[0] in after.filter(upr=50).roundness().report(change=change)


def test_files_and_steps_of_both_are_on_the_page(tmp_path):
    """Dust before: taken out, it is a step; left there, a remark."""
    files = [tmp_path / f"{name}.csv" for name in ("before", "after")]
    for file, lobes in zip(files, (BEFORE, ground()), strict=True):
        read = 1e3 * (ring(lobes, noise=1e-4).reading - 30.0)
        read[100] += 40.0 if file.stem == "before" else 0.0
        rows = [f"{each:.4f},{dev:.4f}" for each, dev in zip(np.degrees(ANGLE), read, strict=True)]
        file.write_text("\n".join(["phi (deg),dev (um)", *rows]))
    dusty, after = (Profile.read(each, angle="phi", deviation="dev", radius=30.0) for each in files)
    found = after.compare(dusty), after.compare(dusty.remove_asperities())
    told = ["before: 1 reading looks like an asperity", "before: step: 1 reading of 1 asperity more than 6"]
    for change, remark in zip(found, told, strict=True):
        change.save(tmp_path / "change.nc")
        again = FormChange.from_file(tmp_path / "change.nc")
        for page in (change.report(), again.report(), after.filter(upr=50).roundness().report(change=change)):
            assert all(sha256(each.read_bytes()).hexdigest() in page and each.name in page for each in files)
            assert remark in page
    old = change.dataset
    del old.attrs["origin_before"], old.attrs["origin_after"]
    assert not FormChange.restored(old).remarks


def test_the_chance_is_as_often_right():
    """Of one part read twice the normal score of the chance is normal about 0: 20 pairs, 3.3 sd.

    Longer: 5 forms of 1024 points, 40 pairs each, none above 97.5 and 2 % below 2.5 %; of parts ground by -10
    to 10 % those said to fall with 60 to 80 % fell in 69 %, with 80 to 95 % in 82 %.
    """
    rng = np.random.default_rng(5)
    pairs = [
        [ring({3: (1e-3, 0.4), 7: (4e-4, 2.0)}, noise=3e-4, rng=rng) for _ in range(2)] for _ in range(30)
    ]
    chances = [after.compare(before, upr=15, rotation=0.0).probability for before, after in pairs]
    score = ndtri(chances)
    assert abs(score.mean()) < 3.3 / np.sqrt(20)
    assert 0.48 < np.sqrt(np.mean(score**2)) < 1.52  # 3.3 sd of 1/sqrt(40) about 1


def test_a_rotation_in_degrees_is_refused_and_a_wrong_one_warns():
    before, after = ring(BEFORE).filter(upr=50), ring(ground(), by=1.0).filter(upr=50)
    with pytest.raises(
        ValueError, match=r"rotation must be within a turn; units.deg\(...\) for degrees .*got 57"
    ):
        after.compare(before, rotation=57.3)
    with pytest.warns(
        UserWarning, match="contradict each other, turned by 2.571 rad: their correlation is -"
    ):
        after.compare(before, rotation=1.0 + np.pi / 2)
