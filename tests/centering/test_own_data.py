"""Profiles of own arrays and tables: even turns, closing points, deviations, sections, what is refused."""

from pathlib import Path

import numpy as np
import pytest
from measured_rings import turn

import sdpgrind
from centering.roundness import Profile, Sections
from centering.setup import Stock, plan_changeover
from sdpgrind import units

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
EVEN = turn(1, 3600)
WAVES = ((2, 1.0, 0.3), (7, 0.4, 1.1), (33, 0.15, 2.0), (120, 0.08, 0.5))
FORM = units.um(sum(size * np.cos(n * EVEN - phase) for n, size, phase in WAVES))


def ring(angle, offset=0.3, noise=0.0, rng=0):
    """Readings of a ring off the axis, mm, with three lobes."""
    form = 40 + offset * np.cos(angle - 0.7) + 1e-3 * np.cos(3 * angle)
    return form + noise * np.random.default_rng(rng).normal(size=angle.size)


def test_deviations_without_a_radius():
    """RONt of the table to its last digit, through save and load; the circle of the assumed radius."""
    profile = Profile.from_deviation(FORM, radius=None, centred=True)
    assert profile.radius is None and "radius not known" in repr(profile)
    found = [
        (profile.roundness(kind).ron_t, profile.filter(upr=50).roundness(kind).ron_t)
        for kind in ("LSC", "MZC")
    ]
    truth = [(3.044219, 2.819363), (2.946272, 2.725858)]
    assert np.array(found) == pytest.approx(units.um(np.array(truth)), abs=units.um(1e-6))


@pytest.mark.parametrize("radius", [5.0, 30.0, 400.0])
def test_the_radius_hardly_matters(radius):
    """Off the axis by e the form changes by e^2/(2 R) at most; here 5e-3 mm, that is 2.5 um/R."""
    off = FORM + 5e-3 * np.cos(EVEN)
    known, large = (Profile.from_deviation(off, radius=each, centred=True) for each in (radius, None))
    assert known.radius == pytest.approx(radius, abs=1e-5)
    assert abs(known.roundness().ron_t - large.roundness().ron_t) < (5e-3) ** 2 / (2 * radius) * 2


def test_a_radius_that_is_not_known_stays_so(tmp_path):
    profile = Profile.from_deviation(FORM, radius=None, centred=True)
    filtered = profile.filter(upr=50)
    filtered.save(tmp_path / "ring.nc")
    assert filtered.radius is None and sdpgrind.load(tmp_path / "ring.nc").radius is None
    assert "radius not known" in filtered.plot()._suptitle.get_text()
    machine = {"finish_radius": 30.0, "gap": 0.01, "approach_rate": 0.026}
    stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004)
    for call in (
        lambda: profile.radii,
        profile.largest_radius,
        profile.remove_roller_error,
        lambda: plan_changeover(profile, stock, **machine),
    ):
        with pytest.raises(
            ValueError, match=r"needs the radius \(mm\), which deviations from the tester's own"
        ):
            call()


def test_deviations_that_are_refused():
    with pytest.raises(ValueError, match=r"radius must be the nominal radius \(mm\), or centred=True"):
        Profile.from_deviation(FORM, radius=None)
    with pytest.raises(ValueError, match=r"at most 10 % of the radius .*; got 3\.04422 mm: units\.um"):
        Profile.from_deviation(1e3 * FORM, radius=30.0)
    with pytest.raises(ValueError, match=r"tip_radius must be 0 where the radius is not known"):
        Profile.from_deviation(FORM, radius=None, centred=True, tip_radius=1.0)
    for wrong in (lambda: Profile(EVEN, FORM), lambda: Profile(FORM)):
        with pytest.raises(ValueError, match=r"these are deviations: give them to Profile\.from_deviation\("):
            wrong()


def test_readings_alone_are_an_even_turn():
    profile = Profile(ring(EVEN))
    assert profile == Profile(np.linspace(0, 2 * np.pi, 3600, endpoint=False), ring(EVEN))
    assert profile == Profile(reading=ring(EVEN))
    assert profile.turns == pytest.approx(1) and not profile.steps
    with pytest.raises(TypeError, match="reading must be given"):
        Profile()


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("late", [-0.2, 0.0, 0.2])
def test_a_closing_point_is_dropped(way, late):
    angle = way * np.append(turn(1, 360), 2 * np.pi + late * 2 * np.pi / 360)
    for noise in (0.0, 2e-4):
        profile = Profile(angle, ring(angle, noise=noise))
        assert profile.angle.size == 360 and "closing point at" in profile.steps[0]
        assert profile.filter(upr=15).angle.size == 360
    restarting = Profile(np.mod([*angle[:360], 0.0], way * 2 * np.pi), ring(np.append(angle[:360], 0.0)))
    assert restarting.angle.size == 360


def test_what_is_no_closing_point_stays():
    step = 2 * np.pi / 360
    for last in (2 * np.pi - 0.3 * step, 2 * np.pi + 0.3 * step):
        angle = np.append(turn(1, 360), last)
        assert Profile(angle, ring(angle)).angle.size == 361
    assert Profile(turn(2, 360), ring(turn(2, 360))).angle.size == 720


def test_a_drift_is_told():
    """Ten standard deviations of a reading: three pass, thirty do not."""
    angle, sd = np.append(turn(1, 360), 2 * np.pi), 2e-4
    reading = ring(angle, noise=sd)
    reading[-1] = ring(angle)[-1] + 3 * sd
    assert Profile(angle, reading).angle.size == 360
    reading[-1] = ring(angle)[-1] + 30 * sd
    with pytest.raises(
        ValueError, match=r"reading must close: .* at 360 degrees.*got a step of [56]\.\d+ µm: drift"
    ):
        Profile(angle, reading)


@pytest.mark.parametrize("size", [128, 361])
@pytest.mark.parametrize("offset", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("kind", ["gaussian", "spline", "2rc", "robust"])
def test_even_points_keep_their_number(size, offset, kind):
    profile = Profile(ring(turn(1, size), offset=offset, noise=2e-4))
    assert profile.filter(kind, upr=15).angle.size == size


def table(**more):
    degrees = np.arange(0.0, 360.0, 2.0)
    return {"dev (um)": 3 * np.cos(np.radians(3 * degrees)), **more}


def test_a_table_without_angles():
    profile = Profile.read(table(), deviation="dev", radius=25.0)
    assert profile.angle == pytest.approx(turn(1, 180)) and "an even turn that begins at 0" in str(
        profile.source
    )
    holes = table()
    holes["dev (um)"][7] = np.nan
    left = Profile.read(holes, deviation="dev", radius=25.0)
    assert left.angle == pytest.approx(np.delete(turn(1, 180), 7))  # a gap, not a shift
    free = Profile.read(table(), deviation="dev", centred=True)
    assert free.radius is None and free.roundness().ron_t == pytest.approx(6e-3, rel=1e-3)
    assert "radius that is not known" in str(free.source) and free.steps == (free.source.notes[-2],)


def test_angles_that_are_there_must_be_named():
    with pytest.raises(ValueError, match=r'angle="angle"; ring_degrees\.csv has \'angle \(deg\)\''):
        Profile.read(SAMPLES / "ring_degrees.csv", deviation="deviation", radius=40.0)
    with pytest.raises(ValueError, match=r'angle must be named.*angle="phi"'):
        Profile.read(table(phi=np.arange(180.0)), deviation="dev", radius=25.0)
    with pytest.raises(ValueError, match=r"at most 10 % of the radius"):
        Profile.read({"dev (mm)": 1.9 * np.cos(turn(1, 180))}, deviation="dev", radius=25.0)


LEVELS = np.repeat([20.0, 0.0, 10.0], 90)
SHAFT = {
    "nr": np.repeat([3, 1, 2], 90),
    "z (mm)": LEVELS + 0.01 * np.random.default_rng(1).uniform(-1, 1, 270),
    "dev (um)": np.tile(2 * np.cos(3 * turn(1, 90)), 3) + np.repeat([4.0, 0.0, 1.0], 90),
}


def test_sections_by_name():
    shaft = Sections.read(SHAFT, height="z", section="nr", deviation="dev", radius=25.0)
    assert shaft.heights == pytest.approx([0.0, 10.0, 20.0], abs=0.005)
    assert [each.angle.size for each in shaft.profiles] == [90] * 3
    sizes = [each.circle.radius - 25.0 for each in shaft.profiles]
    assert sizes == pytest.approx(units.um(np.array([0.0, 1.0, 4.0])), abs=1e-6)
    with pytest.raises(ValueError, match="height must be the same for all readings of a section"):
        Sections.read(SHAFT, height="z", deviation="dev", radius=25.0)
    helix = SHAFT | {"z (mm)": np.linspace(0, 20, 270)}
    with pytest.raises(ValueError, match=r"up to 6\.617 mm within one of 3 sections, 6\.691 mm apart"):
        Sections.read(helix, height="z", section="nr", deviation="dev", radius=25.0)


@pytest.mark.parametrize("wanted", [2, 2.0, "2"])
def test_one_section_of_a_file(wanted):
    profile = Profile.read(SHAFT, section=("nr", wanted), deviation="dev", radius=25.0)
    assert profile.circle.radius == pytest.approx(25.001, abs=1e-6) and profile.angle.size == 90
    assert "section 2: 90 of 270 rows" in str(profile.source)


def test_sections_that_are_refused():
    call = {"deviation": "dev", "radius": 25.0}
    with pytest.raises(ValueError, match=r"section must be one of '3', '1', '2'; got '4'"):
        Profile.read(SHAFT, section=("nr", 4), **call)
    with pytest.raises(TypeError, match=r'section must be header and section, as \("section", 3\)'):
        Profile.read(SHAFT, section="nr", **call)
    with pytest.raises(ValueError, match=r"ring\.x3p holds one section"):
        Profile.read(SAMPLES / "ring.x3p", radius=40.0, section=("nr", 1))


def test_a_text_of_deviations_alone_is_an_even_turn(tmp_path):
    path = tmp_path / "ring.csv"
    path.write_text("deviation (um)\n" + "\n".join(f"{1e3 * each:.9f}" for each in FORM))
    profile = Profile.read(path, deviation="deviation", radius=30.0)
    np.testing.assert_allclose(profile.reading, 30.0 + FORM, atol=1e-12)
    np.testing.assert_allclose(profile.angle, EVEN, atol=1e-12)


def test_sections_need_the_radius():
    """That of each was assumed from its own largest deviation: together they would be metres apart."""
    profiles = [Profile.from_deviation(k * FORM, radius=None, centred=True) for k in (1.0, 1.1, 1.2, 1.3)]
    with pytest.raises(ValueError, match="profiles needs the radius"):
        Sections(profiles, [0.0, 10.0, 20.0, 30.0])


@pytest.mark.parametrize("closed", [0, 1])
def test_sections_that_are_read_as_turns_are_warned_of(closed):
    """With a closing point in each section, from any angle on, and without an angle in a row."""
    place = np.degrees(0.7 + np.arange(360 + closed) * np.pi / 180) % 360
    table = {
        "angle (deg)": np.append(np.tile(place, 2), np.nan),
        "dev (um)": np.append(np.tile(np.cos(np.radians(3 * place)), 2), 0.0),
        "nr": np.append(np.repeat([1.0, 2.0], place.size), 2.0),
    }
    with pytest.warns(UserWarning, match="'nr' is one word in each turn and another in the next"):
        Profile.read(table, angle="angle", deviation="dev", radius=30.0)
    one = Profile.read(table, angle="angle", deviation="dev", radius=30.0, section=("nr", 2))
    assert one.turns == pytest.approx(1.0, abs=0.01)


def test_a_word_for_no_reading_takes_no_angle_away():
    """`missing=["0"]` dropped the row of 0 degrees, too: 0.9986 turns, whose direction was "not known"."""
    angle = np.arange(0.0, 360.0, 0.5)
    deviation = np.where(np.isin(angle, (50.0, 70.0)), 0.0, 2.0 + np.cos(np.radians(angle)))
    table = {"angle [deg]": angle, "dev [um]": deviation}
    asked = {"angle": "angle", "deviation": "dev", "radius": 30.0, "plausible": False}
    with pytest.raises(
        ValueError, match=r"angle must be told where a reading is; it is not in 1 rows, as missing="
    ):
        Profile.read(table, missing=["0"], **asked)
    table["dev [um]"] = np.where(deviation == 0.0, np.nan, deviation)
    assert Profile.read(table, **asked).reading.size == 718
