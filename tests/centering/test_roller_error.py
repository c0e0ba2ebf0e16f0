import numpy as np
import pytest
from circle_inside import Basis, harmonic_rows
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from measured_rings import LOBES, RADIUS, TIP, measured, phases, turn, vector
from scipy.stats import kstest

import hwsim
from centering.roundness import Profile, RollerError
from sdpgrind.base.stored import decode, encode

TONE = 1.5e-3  # mm
RATIO = RADIUS / TIP  # 16.517


def scan(
    turns=4.0, *, points=360, offset=3.6, seed=0, noise=1e-4, tip=TIP, amplitude=TONE, phase=0.6, **told
):
    angle = turn(turns, points)
    runout = (amplitude, RADIUS / tip, phase)
    reading = measured(
        angle, offset=offset, lobes=phases(seed), tip=tip, runout=runout, noise=noise, rng=seed, **told
    )
    return Profile(angle, reading, tip_radius=TIP)


@pytest.mark.parametrize("offset", [0.0, 0.3, 3.6])
def test_harmonics_and_runout_of_four_turns(offset):
    """At noise of 0.1 um 99.7 % of all amplitudes, each harmonic's and the runout's, are within 15 nm.

    No estimate can do better than a sd of 0.1 µm sqrt(2/1440) = 3.7 nm: of 50 harmonics one is beyond 15 nm
    in two scans of 100."""
    profile, errors = scan(offset=offset, noise=0.0), []
    for seed in range(6):
        noise = 1e-4 * np.random.default_rng(seed).normal(size=profile.angle.size)
        clean = Profile(profile.angle, profile.reading + noise, tip_radius=TIP).remove_roller_error()
        errors.extend(
            np.abs(clean.harmonics(50).amplitude[1:] - [LOBES.get(upr, 0.0) for upr in range(2, 51)])
        )
        errors.append(abs(clean.roller_error.amplitude - TONE))
    assert np.quantile(errors, 0.997) < 15e-6
    assert np.sqrt(np.mean(np.square(errors))) < 1.1 * np.sqrt(2) * 1e-4 * np.sqrt(
        2 / 1440
    )  # of two parts where there is no lobe


@pytest.mark.parametrize("lobe", [{80: (5e-3, 0.4)}, {95: (1e-3, 0.4), 160: (2e-3, 1.0)}])
def test_fast_form_is_no_noise(lobe):
    angle = turn(4, 360)
    reading = measured(angle, offset=3.6, lobes=phases(0) | lobe, runout=(TONE, RATIO, 0.6), noise=1e-4)
    profile = Profile(angle, reading, tip_radius=TIP)
    clean = profile.remove_roller_error()
    assert clean.roller_error.upr_max == 170  # an offset ring has its points unevenly
    assert clean.noise_sd == pytest.approx(1e-4, rel=0.07)
    assert clean.roller_error.amplitude_sd == pytest.approx(1e-4 * np.sqrt(2 / 1440), rel=0.1)
    assert profile.remove_roller_error(upr_max=50).noise_sd > 6e-4


@pytest.mark.parametrize(
    ("offset", "tip"), [(0.0, 3.75), (3.6, 3.75), (3.6, 3.765), (-3.6, 3.735), (30.0, 3.75)]
)
def test_without_noise_all_is_exact(offset, tip):
    clean = scan(offset=offset, tip=tip, noise=0.0).remove_roller_error()
    found = clean.harmonics(60)
    for upr in range(2, 61):
        amplitude, angle = phases(0).get(upr, (0.0, 0.0))
        assert abs(vector(found, upr) - amplitude * np.exp(1j * angle)) < 1e-10
    assert clean.roller_error.amplitude == pytest.approx(TONE, abs=1e-10)
    assert clean.roller_error.phase == pytest.approx(0.6, abs=1e-7)
    assert clean.tip_radius == clean.roller_error.tip_radius == pytest.approx(tip, abs=1e-9)
    assert (clean.circle.radius, clean.circle.offset) == pytest.approx((RADIUS, abs(offset)), abs=1e-9)
    assert not clean.roller_error.slipped
    assert np.abs(clean.residuals).max() < 1e-10


@pytest.mark.parametrize(
    ("ratio", "turns", "told"), [(16.517, 1, 122), (16.517, 2, 1.45), (16.05, 1, 803), (16.05, 4, 5.8)]
)
def test_conditions(ratio, turns, told):
    angle = turn(turns, 360)
    profile = Profile(angle, measured(angle, runout=(TONE, ratio, 0.0)), tip_radius=TIP)
    found = profile.remove_roller_error(ratio, refine=False, upr_max=50).roller_error
    assert found.condition == pytest.approx(told, rel=0.01)
    waves = [wave(k * angle) for k in range(1, 51) for wave in (np.cos, np.sin)]
    columns = np.column_stack([np.ones_like(angle), *waves, np.cos(ratio * angle), np.sin(ratio * angle)])
    assert found.condition == pytest.approx(np.linalg.cond(columns), rel=1e-6)
    assert (found.ratio, found.ratio_sd, found.tip_radius_sd) == (ratio, 0.0, 0.0)


def test_the_fit_equals_dense_least_squares():
    profile = scan(2, offset=3.6)
    clean = profile.remove_roller_error(RATIO, refine=False, upr_max=60)
    center = clean.circle.value[1:]
    x, y = (profile.points - center).T
    angle, deviation = np.unwrap(np.arctan2(y, x)), np.hypot(x, y) - TIP - clean.circle.radius
    waves = [wave(k * angle) for k in range(1, 61) for wave in (np.cos, np.sin)]
    columns = np.column_stack([np.ones_like(angle), *waves, np.cos(RATIO * angle), np.sin(RATIO * angle)])
    solution, left, _, _ = np.linalg.lstsq(columns, deviation, rcond=None)
    covariance = left[0] / (angle.size - 123) * np.linalg.inv(columns.T @ columns)
    assert np.abs(solution[:3]).max() < 1e-9  # the centre and the radius are those that leave nothing of it
    assert clean.roller_error.value[:2] == pytest.approx(solution[-2:], abs=1e-11)
    assert clean.roller_error.covariance[:2, :2] == pytest.approx(covariance[-2:, -2:], rel=1e-5)
    assert clean.circle.covariance == pytest.approx(covariance[:3, :3], rel=1e-4, abs=1e-16)
    assert clean.noise_sd == pytest.approx(np.sqrt(left[0] / (angle.size - 123)), rel=1e-6)
    assert clean.harmonics(60).amplitude[1:] == pytest.approx(
        np.hypot(solution[3:-2:2], solution[4:-2:2]), abs=1e-10
    )


def test_it_is_as_sure_as_it_says():
    found = [scan(2, points=180, seed=seed).remove_roller_error(upr_max=50) for seed in range(80)]
    errors = {
        "amplitude": [(p.roller_error.amplitude - TONE) / p.roller_error.amplitude_sd for p in found],
        "phase": [(p.roller_error.phase - 0.6) / p.roller_error.phase_sd for p in found],
        "tip_radius": [(p.roller_error.tip_radius - TIP) / p.roller_error.tip_radius_sd for p in found],
        "center_x": [
            (p.circle.center_x - 3.6 * np.cos(0.7)) / np.sqrt(p.circle.covariance[1, 1]) for p in found
        ],
    }
    for name, values in errors.items():
        assert kstest(values, "norm").pvalue > 1e-3, name
    assert np.mean([p.noise_sd for p in found]) == pytest.approx(1e-4, rel=0.02)
    assert sum(p.roller_error.slipped for p in found) <= 1


def test_harmonics_of_one_turn_say_how_little_they_know():
    """One turn: condition 122. What is not known of the runout is not known of the harmonics beside it."""
    errors, told = [], []
    for seed in range(60):
        spectrum = (
            scan(1, offset=0.0, seed=seed, noise=2e-5).remove_roller_error(RATIO, refine=False).harmonics(50)
        )
        lobes = {upr: phases(seed).get(upr, (0.0, 0.0)) for upr in (3, 16, 17)}
        errors.append([abs(vector(spectrum, upr) - a * np.exp(1j * p)) for upr, (a, p) in lobes.items()])
        told.append([spectrum.sd[upr - 1] for upr in lobes])
    # two parts each
    assert np.mean(np.square(errors), axis=0) == pytest.approx(2 * np.mean(np.square(told), axis=0), rel=0.5)
    known, *others = np.mean(told, axis=0)
    assert min(others) > 5 * known


@pytest.mark.parametrize(("turns", "told"), [(1.0, False), (1.02, False), (1.5, True), (3.0, True)])
def test_a_ratio_that_the_turns_do_not_tell_is_kept(turns, told):
    clean = scan(turns).remove_roller_error()
    assert (clean.roller_error.ratio_sd > 0) is told
    assert (clean.tip_radius != TIP) is told
    assert abs(clean.roller_error.amplitude - TONE) < 4 * clean.roller_error.amplitude_sd


def test_why_the_angle_about_the_part():
    """Fitted over the spindle's angle the runout of an offset ring is too small, and its side bands take the
    43 upr line.
    """
    angle = turn(4, 360)
    reading = measured(angle, offset=3.6, lobes=phases(0), runout=(TONE, RATIO, 0.6))
    profile = Profile(angle, reading, tip_radius=TIP)
    waves = [wave(k * angle) for k in range(1, 51) for wave in (np.cos, np.sin)]
    columns = np.column_stack([np.ones_like(angle), *waves, np.cos(RATIO * angle), np.sin(RATIO * angle)])
    solution = np.linalg.lstsq(columns, profile.deviation, rcond=None)[0]
    assert 1e3 * np.hypot(*solution[-2:]) == pytest.approx(1.20, abs=0.02)
    assert 1e3 * np.hypot(*solution[85:87]) < 0.02  # of 0.235


@pytest.mark.parametrize("slid", [0.4, 1.0])
def test_a_roller_that_slips(slid):
    angle = turn(4, 360)
    reading = measured(
        angle, offset=1.0, lobes=phases(0), runout=(TONE, RATIO, 0.6), slip=(4 * np.pi, slid), noise=3e-5
    )
    clean = Profile(angle, reading, tip_radius=TIP).remove_roller_error()
    assert clean.roller_error.slipped
    assert 0.2 * slid < clean.roller_error.slip < slid  # part of it is taken for another ratio
    assert "the roller slipped" in clean.steps[0]
    assert "SLIPPED" in repr(clean.roller_error)
    assert (
        Profile(angle, reading, tip_radius=TIP).remove_roller_error(RATIO, refine=False).roller_error.slipped
    )


@pytest.mark.parametrize(
    ("turns", "points", "offset", "told"),
    [(2, 90, 1.0, {}), (1.5, 90, 1.0, {}), (1.5, 120, 3.6, {"refine": False}), (3, 60, 3.6, {})],
)
def test_without_slip_its_probability_is_uniform(turns, points, offset, told):
    angle = turn(turns, points)
    clean = measured(angle, offset=offset, lobes=phases(0), runout=(TONE, RATIO, 0.6))
    noise = [1e-4 * np.random.default_rng(seed).normal(size=angle.size) for seed in range(60)]
    found = [
        Profile(angle, clean + each, tip_radius=TIP).remove_roller_error(**told).roller_error.slip_probability
        for each in noise
    ]
    assert kstest(found, "uniform").statistic < 0.19
    assert min(found) > 1e-4


def test_one_turn_tells_no_slip():
    """What is read once the harmonics take for form."""
    assert scan(1.0).remove_roller_error(RATIO, refine=False).roller_error.slip_probability == 1.0


def test_an_offset_ring_needs_the_tip_radius():
    """Without it the phase of a roller would be wrong by offset over radius: it would seem to slip."""
    angle = turn(4, 360)
    reading = measured(angle, offset=3.6, lobes=phases(0), runout=(TONE, RATIO, 0.6))
    with pytest.raises(
        ValueError, match=r"tip_radius must be > 0 \(mm\) for a ring that is 3.6 mm off the spindle, .* 0.002"
    ):
        Profile(angle, reading).remove_roller_error(RATIO)
    assert not Profile(angle, reading, tip_radius=TIP).remove_roller_error(RATIO).roller_error.slipped


def test_a_round_roller_loses_nothing():
    profile = scan(amplitude=0.0)
    clean = profile.remove_roller_error()
    assert clean.roller_error.ratio == pytest.approx(profile.circle.radius / TIP)
    assert clean.tip_radius == TIP
    assert clean.roller_error.amplitude < 4 * clean.roller_error.amplitude_sd
    assert clean.harmonics(50).amplitude == pytest.approx(
        [LOBES.get(upr, 0.0) for upr in range(1, 51)], abs=15e-6
    )


def test_a_ring_felt_by_a_round_tip():
    """Another simulation, in which the tip touches the lobes where it does, not where its centre is: 0.1 nm
    apart at most.
    """
    ring = hwsim.Ring(RADIUS, 3.6, 0.7, lobes=phases(0))
    quiet = hwsim.ProbeErrors(
        probe_quantum=0.0, slide_quantum=0.0, noise_sd=0.0, runout=TONE, runout_phase=0.6
    )
    read = hwsim.Probe(ring, tip_radius=TIP, samples_per_turn=400, errors=quiet).scan(turns=4.0, rng=0)
    clean = Profile(read.angle, read.reading, tip_radius=TIP).remove_roller_error()
    found = clean.harmonics(60)
    for upr in range(2, 61):
        amplitude, angle = phases(0).get(upr, (0.0, 0.0))
        assert abs(vector(found, upr) - amplitude * np.exp(1j * angle)) < 1e-7
    assert clean.roller_error.amplitude == pytest.approx(TONE, rel=2e-3)
    assert clean.tip_radius == pytest.approx(TIP, abs=1e-5)


def test_the_samples_stay():
    profile = scan(noise=0.0)
    clean = profile.remove_roller_error()
    assert clean.angle == pytest.approx(profile.angle, abs=1e-5)
    assert clean.turns == pytest.approx(4.0, abs=1e-4)
    plain = measured(profile.angle, offset=3.6, lobes=phases(0))
    assert np.interp(profile.angle, clean.angle, clean.reading) == pytest.approx(plain, abs=1e-6)
    assert clean.steps == (clean.steps[0],)
    assert clean.steps[0].startswith("roller runout of 1.5 ± ")


def test_an_oval_roller_is_taken_off_in_two():
    angle = turn(4, 360)
    second = 4e-4 * np.cos(2 * RATIO * angle - 1.0)
    reading = measured(angle, lobes=phases(0), runout=(TONE, RATIO, 0.6)) + second
    clean = Profile(angle, reading, tip_radius=TIP).remove_roller_error().remove_roller_error(2 * RATIO)
    assert clean.roller_error.amplitude == pytest.approx(4e-4, rel=1e-3)
    assert len(clean.steps) == 2
    assert clean.harmonics(50).amplitude == pytest.approx(
        [LOBES.get(upr, 0.0) for upr in range(1, 51)], abs=1e-6
    )


def test_a_second_wave_near_a_whole_number_keeps_its_ratio():
    """33.03 upr: refined, its amplitude would be 8 times less sure, and drift."""
    angle = turn(4, 360)
    second = 4e-4 * np.cos(2 * RATIO * angle - 1.0)
    clean = measured(angle, lobes=phases(0), runout=(TONE, RATIO, 0.6)) + second
    for seed in range(2):
        reading = clean + 1e-4 * np.random.default_rng(seed).normal(size=angle.size)
        once = Profile(angle, reading, tip_radius=TIP).remove_roller_error()
        twice = once.remove_roller_error(2 * once.roller_error.ratio)
        assert twice.roller_error.ratio == 2 * once.roller_error.ratio
        assert twice.roller_error.amplitude == pytest.approx(4e-4, abs=5 * 1.6e-5)
        assert twice.roller_error.amplitude_sd < 2e-5
        assert abs(twice.harmonics(50).amplitude[32]) < 8e-5


@pytest.mark.parametrize("ratio", [0.01, 7.3, None])
def test_a_runout_that_is_not_seen_is_left(ratio):
    profile = scan(amplitude=0.0, offset=0.0, seed=1)
    clean = profile.remove_roller_error(ratio)
    assert not clean.roller_error.seen
    assert np.array_equal(clean.reading, profile.reading) and clean.circle == profile.circle
    assert "is not told from noise: the readings are left as they are" in clean.steps[0]
    assert clean.noise_sd == pytest.approx(1e-4, rel=0.06)
    assert all("removed" not in text.get_text() for text in clean.plot().axes[1].texts)


def test_an_encoder_that_starts_again():
    profile = scan()
    wrapped = Profile(np.mod(profile.angle, 2 * np.pi), profile.reading, tip_radius=TIP)
    assert wrapped.turns == pytest.approx(4.0)
    assert wrapped.remove_roller_error().roller_error.amplitude == pytest.approx(
        profile.remove_roller_error().roller_error.amplitude, rel=1e-9
    )
    backwards = Profile(-profile.angle, profile.reading, tip_radius=TIP)
    assert backwards.remove_roller_error().roller_error.amplitude == pytest.approx(
        profile.remove_roller_error().roller_error.amplitude, rel=1e-6
    )


def test_as_many_harmonics_as_samples_allow():
    assert scan(points=72).remove_roller_error().roller_error.upr_max == 35
    wide = Profile(
        turn(3, 360), measured(turn(3, 360), tip=1.1, runout=(TONE, RADIUS / 1.1, 0.0)), tip_radius=1.1
    )
    assert wide.remove_roller_error().roller_error.upr_max == 179
    once = Profile(
        turn(1, 360), measured(turn(1, 360), tip=1.1, runout=(TONE, RADIUS / 1.1, 0.0)), tip_radius=1.1
    )
    assert once.remove_roller_error(refine=False).roller_error.upr_max == 67
    assert wide.remove_roller_error().roller_error.amplitude == pytest.approx(TONE, abs=1e-9)


def test_a_ratio_without_a_tip_radius():
    angle = turn(4, 360)
    profile = Profile(angle, measured(angle, tip=0.0, runout=(TONE, 9.31, 0.2), lobes=phases(1)))
    clean = profile.remove_roller_error(9.3)
    assert clean.roller_error.ratio == pytest.approx(9.31, abs=1e-8)
    assert clean.roller_error.amplitude == pytest.approx(TONE, abs=1e-9)
    assert clean.tip_radius == 0.0


def test_more_turns_as_advised_do():
    angle = turn(1, 360)
    profile = Profile(angle, measured(angle, runout=(TONE, 16.03, 0.0)), tip_radius=TIP)
    with pytest.raises(
        ValueError, match=r"angle must cover enough turns .* 16.03 upr .*with 1 turns; about 0.5 turns more"
    ):
        profile.remove_roller_error(16.03, refine=False)
    longer = turn(1.5, 360)
    profile = Profile(longer, measured(longer, runout=(TONE, 16.03, 0.0)), tip_radius=TIP)
    assert profile.remove_roller_error(16.03, refine=False).roller_error.amplitude == pytest.approx(
        TONE, rel=1e-6
    )


def test_a_bare_part_of_the_turn():
    angle = turn(4, 360)
    angle = angle[np.mod(angle, 2 * np.pi) > 1.5]
    with pytest.raises(
        ValueError,
        match=r"a gap of 8[67].* degrees or the offset leaves part of the turn bare: upr_max must be lower",
    ):
        Profile(angle, measured(angle), tip_radius=TIP).remove_roller_error()


@pytest.mark.parametrize(
    ("tip", "asked", "said"),
    [
        (0.0, {}, r"tip_radius must be > 0 \(mm\) to know how fast the roller turns; got 0.0"),
        (TIP, {"ratio": -1.0}, r"ratio must be > 0 \(1\); got -1.0"),
        (TIP, {"ratio": 16.01}, r"ratio must be at least 0.02 from a whole number; got 16.01: .* 16 upr"),
        (RADIUS / 16, {}, "ratio must be at least 0.02 from a whole number; got 16"),
        (TIP, {"upr_max": 46}, "upr_max must be <= 45, half of the points of one turn"),
        (
            TIP,
            {"upr_max": 45, "ratio": 7.4},
            "reading must have at least 93 samples for 45 harmonics and the runout; got 90",
        ),
        (TIP, {"upr_max": 0}, "upr_max must be >= 1; got 0"),
    ],
)
def test_what_is_refused(tip, asked, said):
    angle = turn(1, 90)
    with pytest.raises(ValueError, match=said):
        Profile(angle, measured(angle, tip=tip), tip_radius=tip).remove_roller_error(**asked)


def test_a_ratio_near_a_whole_number_where_that_is_told():
    angle = turn(30, 120)
    profile = Profile(angle, measured(angle, runout=(TONE, 16.01, 0.3)), tip_radius=TIP)
    found = profile.remove_roller_error(16.01, near_integer=True, upr_max=30).roller_error
    assert found.amplitude == pytest.approx(TONE, rel=1e-6)
    with pytest.raises(ValueError, match=r"from a whole number; got 16.01, found near 16.03: runout"):
        profile.remove_roller_error(16.03)


def test_a_separation_that_does_not_settle(monkeypatch):
    profile = scan(1.5, noise=1e-3)
    profile.remove_roller_error()
    monkeypatch.setattr("centering.roundness._roller_fit._STEPS", 1)
    with pytest.raises(
        ValueError, match=r"circle and ratio; after 1 steps the ratio still goes from 16\.517"
    ):
        profile.remove_roller_error()


def test_another_roller_than_told():
    with pytest.raises(
        ValueError,
        match=r"got 16.5173 \(61.94 mm over a tip_radius of 3.75 mm\), and the runout is strongest at the edge",
    ):
        scan(tip=3.72).remove_roller_error()


def test_a_filtered_profile_has_no_turns():
    with pytest.raises(
        ValueError, match="remove_roller_error must come before a filter, which keeps no turns"
    ):
        scan().filter(upr=50).remove_roller_error()


def test_a_runout_is_frozen_and_equal_by_value():
    runout = scan().remove_roller_error().roller_error
    assert decode(encode(runout)) == runout
    assert hash(decode(encode(runout))) == hash(runout)
    assert runout != runout.replace(slip=1.0)
    assert runout != 1
    place = np.linspace(0, 7, 15)
    assert runout.deviation(place) == pytest.approx(
        runout.amplitude * np.cos(runout.ratio * place - runout.phase), abs=1e-15
    )
    step = np.array([1e-8, 1e-8, 1e-6])
    for k in range(3):
        ahead, behind = (
            RollerError(runout.value + s * step * (np.arange(3) == k), runout.covariance).deviation(place)
            for s in (1, -1)
        )
        assert runout.derivatives(place)[:, k] == pytest.approx((ahead - behind) / (2 * step[k]), abs=1e-8)
    none = RollerError(np.array([0.0, 0.0, 16.5]), np.diag([1e-12, 1e-12, 0.0]))
    assert none.phase_sd == np.inf


@given(
    angle=hnp.arrays(float, st.integers(1, 40), elements=st.floats(-30.0, 30.0)), upr_max=st.integers(1, 12)
)
def test_products_of_harmonics_are_sums_of_harmonics(angle, upr_max):
    """Each entry sums n products <= 1, each addition rounds; powers multiplied up 2 upr_max times are off by
    as much.
    """
    basis, rows = Basis.of(angle, upr_max), harmonic_rows(angle, upr_max)
    assert np.abs(basis.gram - rows @ rows.T).max() <= (4 * upr_max + angle.size) * angle.size * 2**-52
    waves = [wave(k * angle) for k in range(1, upr_max + 1) for wave in (np.cos, np.sin)]
    # k angle is rounded, too
    assert np.abs(rows - np.vstack([np.ones_like(angle), *waves])).max() <= 30 * upr_max * 2**-52


def test_what_harmonics_leave_of_further_rows():
    rng = np.random.default_rng(3)
    angle, further = rng.uniform(0.0, 20.0, 90), rng.standard_normal((2, 90))
    basis = Basis.of(angle, 7)
    left = further - np.linalg.lstsq(basis.rows.T, further.T)[0].T @ basis.rows
    np.testing.assert_allclose(basis.beyond(further), left, atol=1e-13)
    rows = np.vstack([basis.rows, further])
    np.testing.assert_allclose(basis.bordered(further), rows @ rows.T, atol=1e-12)
