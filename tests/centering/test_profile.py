import copy
import pickle
import re

import numpy as np
import pytest
from circle_inside import from_part, into_part, supported, turns_of, unwrapped_turns, widest_gap
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_rings import RADIUS, TIP, form, measured, phases, turn

from centering.roundness import Profile
from sdpgrind.base import records

BEFORE = measured(turn(4, 360), offset=3.6, lobes=phases(0), runout=(1.5e-3, RADIUS / TIP, 0.6), noise=1e-4)


@pytest.fixture(scope="module")
def profiles():
    """As measured, without runout, filtered."""
    first = Profile(turn(4, 360), BEFORE, tip_radius=TIP)
    second = first.remove_roller_error()
    return first, second, second.filter("gaussian", upr=50)


@settings(max_examples=50)
@given(
    offset=st.floats(0, 0.95),
    direction=st.floats(-np.pi, np.pi),
    tip=st.floats(0, 10),
    angles=st.lists(st.floats(-30, 30), min_size=1, max_size=20),
)
def test_into_the_part_and_back(offset, direction, tip, angles):
    center = 50 * offset * np.array([np.cos(direction), np.sin(direction)])
    part_angle = np.array(angles)
    angle, reading = from_part(part_angle, np.full(part_angle.size, 50 + tip), tip, center)
    back, distance = into_part(angle, reading, tip, center)
    assert back == pytest.approx(part_angle, abs=1e-12)
    assert distance == pytest.approx(50 + tip, abs=1e-12)
    assert np.abs(angle - part_angle).max() < np.pi / 2


@pytest.mark.parametrize("offset", [0.0, 0.1, 3.6, 0.5 * RADIUS, 0.95 * RADIUS])
def test_a_circle_is_a_circle(offset):
    angle = turn(1, 360)
    profile = Profile(angle, measured(angle, offset=offset, direction=2.0), tip_radius=TIP)
    assert np.abs(profile.deviation).max() < 1e-10
    assert profile.radii == pytest.approx(RADIUS, abs=1e-10)


def test_lobes_are_seen_at_their_angle_about_the_part():
    angle, lobes = turn(2, 720), {2: (1e-3, 0.3), 9: (1e-3, 1.0)}
    profile = Profile(angle, measured(angle, offset=3.6, lobes=lobes), tip_radius=TIP)
    near = form(profile.part_angle, lobes)
    # the circle fitted to readings is not quite the form's own
    assert profile.deviation == pytest.approx(near, abs=2e-4)
    clean = profile.filter(upr=100)
    passed = {n: (a * 0.5 ** ((n / 100) ** 2), p) for n, (a, p) in lobes.items()}
    assert clean.deviation == pytest.approx(form(clean.part_angle, passed), abs=1e-9)
    assert profile.points == pytest.approx(
        (profile.reading + TIP)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    )
    assert np.ptp(profile.part_angle) == pytest.approx(np.ptp(angle), abs=0.1)


def test_turns_points_and_gaps():
    angle = turn(4, 360)
    profile = Profile(angle, measured(angle))
    assert (profile.turns, profile.points_per_turn, profile.nyquist) == pytest.approx((4.0, 360.0, 180.0))
    assert turns_of(np.random.default_rng(0).permutation(angle)) == pytest.approx(4.0)
    assert widest_gap(angle) == pytest.approx(np.pi / 180)
    assert widest_gap(angle[10:350]) == pytest.approx(21 * np.pi / 180)
    assert (supported(2 * np.pi / 360), supported(2 * np.pi / 361), supported(2 * np.pi)) == (179, 180, 0)
    assert Profile(-angle, measured(-angle)).turns == pytest.approx(4.0)


def test_angles_that_start_again():
    angle = turn(3, 100)
    assert unwrapped_turns(np.mod(angle, 2 * np.pi)) == pytest.approx(angle)
    assert unwrapped_turns(-np.mod(angle, 2 * np.pi)) == pytest.approx(-angle)
    for kept in (
        angle,
        np.random.default_rng(0).permutation(angle),
        np.array([0.0, 3.5, 7.0, 10.5]),
        np.array([0.1, 0.1, 4.0]),
    ):
        assert unwrapped_turns(kept) is kept


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("tremble", [2e-3, 2e-2])
def test_an_encoder_that_trembles(way, tremble):
    """Some steps go backwards, also across the zero: four turns are four turns all the same."""
    angle = way * (turn(4, 360) + tremble * np.random.default_rng(0).normal(size=1440))
    assert np.any(way * np.diff(angle) < 0) or tremble < 1e-2
    once = np.array([*turn(3, 100)[:150], turn(3, 100)[148], *turn(3, 100)[150:]])  # a single step back
    for true in (angle, once):
        profile = Profile(np.mod(true, 2 * np.pi), measured(true))
        assert profile.turns == pytest.approx(np.ptp(true) / (2 * np.pi), rel=0.01)
        assert np.diff(profile.angle) == pytest.approx(np.diff(true), abs=1e-12)


def test_shuffled_readings_stay_as_they_are():
    for seed in range(50):
        rng = np.random.default_rng(seed)
        angle = rng.uniform(0, 2 * np.pi, rng.integers(8, 400))
        assert np.ptp(unwrapped_turns(angle)) < 2 * np.pi
    tremble = turn(1, 90) + 0.1 * np.random.default_rng(0).normal(size=90)
    assert unwrapped_turns(tremble) is tremble


def test_turns_of_what_steps_have_made(profiles):
    _, second, third = profiles
    assert second.nyquist != 180.0  # by rounding
    with pytest.raises(
        ValueError, match=r"upr_max must ask for waves that .* got 180 upr .*: up to 170 upr are sure"
    ):
        second.harmonics(180)  # not that it must be <= 180
    assert third.turns == pytest.approx(1.0, abs=1e-12)
    assert third.points_per_turn == pytest.approx(360, abs=1e-9)


def test_unsorted_and_repeated_angles_are_legal():
    angle = np.random.default_rng(0).permutation(np.concatenate([turn(2, 180), turn(2, 180)[:40]]))
    profile = Profile(angle, measured(angle, offset=2.0), tip_radius=TIP)
    assert profile.circle.offset == pytest.approx(2.0, abs=1e-9)
    assert profile.roundness("MZC").value < 1e-9


def test_the_snippet(tmp_path, profiles):
    profile, _, _ = profiles
    clean = profile.remove_roller_error().filter("gaussian", upr=50)
    assert 0 < clean.roundness("MZC").value < 1.2e-3
    assert clean.harmonics(upr_max=60).upr[-1] == 60
    clean.plot()
    clean.save(tmp_path / "ring.nc")
    assert Profile.from_file(tmp_path / "ring.nc") == clean


def test_roundness_by_all_four(profiles):
    _, _, clean = profiles
    found = {kind: clean.roundness(kind) for kind in ("LSC", "MCC", "MIC", "MZC")}
    assert all(found["MZC"].value <= circle.value + 1e-12 for circle in found.values())
    assert np.ptp(clean.deviation) == pytest.approx(
        found["LSC"].value, abs=1e-9
    )  # the harmonics' centre is that of least squares
    for circle in found.values():
        assert circle.filter == "Gaussian low-pass, 50 upr"
        assert circle.tip_radius == clean.tip_radius
        # a circle that is farther off would leave more than that on one side
        height = np.ptp(clean.deviation)
        assert circle.center == pytest.approx(clean.circle.value[1:], abs=height)
        assert circle.radius == pytest.approx(clean.circle.radius, abs=height)


def test_noise_is_told_at_every_step(profiles):
    first, second, third = profiles
    assert first.noise_sd > 5e-4  # the runout is still in it
    assert second.noise_sd == pytest.approx(1e-4, rel=4 / np.sqrt(2 * (1440 - 2 * 170 - 4)))
    clean = measured(turn(1, 360), offset=3.6, lobes=phases(0))
    exact = Profile(turn(1, 360), clean, tip_radius=TIP).filter(upr=50).deviation
    # of one draw of the 100 coefficients that mostly pass
    true = np.sqrt(np.mean((third.deviation - exact) ** 2))
    assert third.noise_sd == pytest.approx(true, rel=4 / np.sqrt(2 * 100))
    assert Profile(turn(1, 4), measured(turn(1, 4))).noise_sd == np.inf


@pytest.mark.parametrize("upr", [60, 95, 150])
@pytest.mark.parametrize("turns", [1.0, 1.3, 3.0])
def test_fast_form_is_no_noise(upr, turns):
    angle = turn(turns, 360)
    found = [
        Profile(
            angle, measured(angle, offset=1.0, lobes={upr: (1e-3, 0.5)}, noise=1e-5, rng=seed), tip_radius=TIP
        ).noise_sd
        for seed in range(4)
    ]
    assert np.mean(found) == pytest.approx(1e-5, rel=0.15)


def test_very_many_points():
    angle = turn(1, 20_000)
    profile = Profile(angle, measured(angle, offset=1.0, lobes={3: (1e-3, 0.2)}, noise=1e-5), tip_radius=TIP)
    found = profile.harmonics()
    assert found.upr[-1] == 1500  # the highest cut-off of the standard, where nothing else is asked for
    assert found.nyquist == pytest.approx(10_000)
    assert found.amplitude[2] == pytest.approx(1e-3, abs=4e-7)
    assert profile.noise_sd == pytest.approx(1e-5, rel=0.03)


def test_residuals_are_what_the_last_step_leaves(profiles):
    first, second, third = profiles
    assert first.residuals == pytest.approx(first.reading - first.circle.reading(first.angle), abs=1e-13)
    freedom = second.angle.size - 2 * second.roller_error.upr_max - 4
    assert np.linalg.norm(second.residuals) / np.sqrt(freedom) == pytest.approx(
        1e-4, rel=4 / np.sqrt(2 * freedom)
    )
    assert third.residuals.size == second.angle.size


@pytest.mark.parametrize("about", [(0.0, 0.0), (2.7, 2.4), (0.5, -0.3)])
def test_the_largest_radius_of_a_filtered_profile_is_that_between_samples_too(profiles, about):
    *_, clean = profiles
    spectrum = clean.harmonics()

    def far(beta):
        away = clean.circle.radius + clean.tip_radius + spectrum.deviation(beta)
        x, y = away * np.array([np.cos(beta), np.sin(beta)])
        return (
            np.hypot(x + clean.circle.center_x - about[0], y + clean.circle.center_y - about[1])
            - clean.tip_radius
        )

    coarse = turn(1, 4000)
    height, step = far(coarse), np.linspace(-1.0, 1.0, 201) * 2 * np.pi / 4000
    # 1 um of 40 upr is 1e-6 mm lower a step from its top
    fine = coarse[height > height.max() - 1e-5, None] + step
    assert clean.largest_radius(about) == pytest.approx(far(fine.ravel()).max(), abs=1e-9)
    sampled = np.hypot(*(clean.points - np.array(about)).T).max() - clean.tip_radius
    assert clean.largest_radius(about) >= sampled
    assert clean.largest_radius(about) <= clean.largest_radius(about, upr=179)


def test_the_largest_radius_as_measured(profiles):
    first, *_ = profiles
    assert first.largest_radius() == pytest.approx(first.reading.max(), abs=1e-12)
    far = np.hypot(*(first.points - [3.0, 2.0]).T).max() - TIP
    assert first.largest_radius((3.0, 2.0)) == pytest.approx(far, abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 40), st.integers(0, 10**6))
def test_nothing_rises_higher_between_samples(upr, seed):
    rng = np.random.default_rng(seed)
    lobes = {
        n: (float(rng.normal() * 1e-3), float(rng.uniform(0, 6)))
        for n in {upr, *rng.integers(1, upr + 1, 3).tolist()}
        if n > 1
    }
    angle, fine = np.sort(rng.uniform(0, 2 * np.pi, 400)) if seed % 2 else turn(1, 100), turn(1, 4000)
    if widest_gap(angle) * upr / 2 > 1.5:
        return
    reading = measured(angle, offset=1.0, lobes=lobes)
    profile = Profile(angle, reading, tip_radius=TIP)
    true = measured(fine, offset=1.0, lobes=lobes)
    assert true.max() <= profile.largest_radius(upr=upr) + 1e-9
    heights = form(fine, lobes)
    assert (
        np.abs(heights).max()
        <= profile.rise_between_samples(upr) * np.abs(form(profile.part_angle, lobes)).max() + 1e-7
    )


def test_the_rise_of_even_turns():
    profile = Profile(turn(1, 360), measured(turn(1, 360)), tip_radius=TIP)
    assert profile.rise_between_samples(50) == pytest.approx(1.103, abs=1e-3)
    assert profile.rise_between_samples(150) == pytest.approx(3.86, abs=5e-3)
    assert profile.rise_between_samples(0) == 1.0
    with pytest.raises(ValueError, match=r"upr must be < 180 for a gap of 1 degrees \(upr\); got 180.0"):
        profile.rise_between_samples(180)
    worst = np.cos(60 * (turn(1, 360) - np.pi / 360))  # every crest lies in the middle between two samples
    assert 1 / worst.max() == pytest.approx(profile.rise_between_samples(60), rel=1e-9)


def test_saved_and_read_at_every_step(tmp_path, profiles):
    for k, profile in enumerate(profiles):
        profile.save(tmp_path / f"{k}.nc")
        back = Profile.from_file(tmp_path / f"{k}.nc")
        assert back == profile
        assert hash(back) == hash(profile)
        assert (back.steps, back.roller_error, back.circle) == (
            profile.steps,
            profile.roller_error,
            profile.circle,
        )
        assert np.array_equal(back.residuals, profile.residuals)
        assert records.read(tmp_path / f"{k}.nc").attrs["kind"] == "centering.profile"
        assert back.harmonics(40) == profile.harmonics(40)
    first, second, third = profiles
    assert first != second != third
    assert first != 1


def test_labelled(profiles):
    for profile in profiles:
        for name, column in profile.dataset.items():
            assert column.attrs["units"] == ("rad" if "angle" in name else "mm")
            assert column.attrs["long_name"]
    assert "4 turns, radius 61.94" in repr(profiles[0])
    assert "as measured" in repr(profiles[0])
    assert "Gaussian low-pass, 50 upr" in repr(profiles[2])


def test_it_does_not_change(profiles):
    first, *_ = profiles
    own = BEFORE.copy()
    kept = Profile(turn(4, 360), own, tip_radius=TIP)
    own += 1.0
    assert kept == first
    assert copy.deepcopy(first) is first
    assert pickle.loads(pickle.dumps(first)) == first
    for array in (
        first.angle,
        first.reading,
        first.part_angle,
        first.radii,
        first.deviation,
        first.points,
        first.residuals,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    with pytest.raises(AttributeError):
        first.tip_radius = 1.0


def test_pictures(profiles):
    for profile in profiles:
        figure = profile.plot()
        polar, spectrum = figure.axes
        assert polar.name == "polar"
        assert "upr" in spectrum.get_xlabel()
        assert "RONt (LSC)" in figure.get_suptitle()
    assert "roller runout removed: 1.5" in spectrum.texts[-1].get_text()


@pytest.mark.parametrize(("offset", "arc"), [(40.0, 360), (3.6, 220)])
def test_the_title_is_the_roundness(offset, arc):
    """About the circle of the points, not that of the readings; the two differ where points lie unevenly
    about the part.
    """
    angle = np.radians(np.arange(0.0, arc))
    lobes = {2: (5e-3, 0.2), 3: (2e-3, 0.4), 4: (1e-3, 1.0)}
    profile = Profile(angle, measured(angle, offset=offset, lobes=lobes), tip_radius=TIP)
    told = float(profile.plot().get_suptitle().split("RONt (LSC) ")[1].split()[0])
    assert told == pytest.approx(1e3 * profile.roundness("LSC").value, rel=5e-3)
    assert offset < 40 or told != pytest.approx(1e3 * np.ptp(profile.deviation), rel=5e-3)
    short = Profile(angle[:100], measured(angle[:100], lobes=lobes), tip_radius=TIP)
    assert "from peak to valley of an arc" in short.plot().get_suptitle()


@pytest.mark.parametrize(
    ("angle", "reading", "tip", "said"),
    [
        ([0, 1, 2, 3], [50, 50, 50], 0.0, "angle and reading must be one-dimensional of one length"),
        ([0, 1, np.nan, 3], [50] * 4, 0.0, r"angle\[2\] must be finite"),
        ([0, 1, 2, 3], [50, -1, 50, 50], 0.0, r"reading\[1\] must be > 0 \(mm\); got -1.0"),
        ([0, 1, 0, 1], [50] * 4, 0.0, "angle must be at least 4 different angles"),
        ([0, 1, 2, 3], [50] * 4, -1.0, r"tip_radius must be >= 0 \(mm\); got -1.0"),
        (np.arange(720.0), [50] * 720, 0.0, "smells of degrees"),
    ],
)
def test_bad_readings(angle, reading, tip, said):
    with pytest.raises(ValueError, match=said):
        Profile(angle, reading, tip_radius=tip)


@pytest.mark.parametrize(
    ("radius", "meant"), [(0.03, "=30 (m)"), (30000.0, "=30 (um)")], ids=["metres", "micrometres"]
)
def test_a_radius_in_another_unit_is_refused_as_by_read(radius, meant):
    form = 1e-5 * radius * np.cos(3 * turn(1, 360))
    rule = rf"must be 1 \.\.\. 3000 mm; got {radius:g} mm; if given in another unit: "
    with pytest.raises(ValueError, match=f"^reading {rule}reading{re.escape(meant)}"):
        Profile(radius + form)
    with pytest.raises(ValueError, match=f"^radius {rule}radius{re.escape(meant)}"):
        Profile.from_deviation(form, radius=radius)
    with pytest.raises(ValueError, match=r"tip_radius must be 0.001 \.\.\. 50 mm; got 3750 mm"):
        Profile(turn(1, 360), 30.0 + form / radius, tip_radius=3750.0)
    as_it_is = Profile(radius + form, plausible=False)
    other = Profile.from_deviation(form, radius=radius, plausible=False)
    assert as_it_is.radius == pytest.approx(radius) and other.radius == pytest.approx(radius)


def test_a_form_in_micrometres_warns():
    """1.4 um taken for mm is 2.8 mm of form on 30 mm; a slot of 10 mm and an offset of 1 mm are none."""
    angle = turn(1, 360)
    with pytest.warns(
        UserWarning, match=r"deviation is 2.\d+ mm from valley to peak .* % of the radius: units.um"
    ):
        Profile.from_deviation(1.4 * np.sin(3 * angle), radius=30.0)
    slot = np.where(angle < 0.2, -1.5, 0.0)
    Profile.from_deviation(slot + np.cos(angle), radius=30.0)
    Profile.from_deviation(1.4 * np.sin(3 * angle), radius=30.0, plausible=False)


def test_bad_axes(profiles):
    with pytest.raises(ValueError, match=r"about must be \(x, y\) \(mm\); got 3.0"):
        profiles[0].largest_radius(3.0)
