"""Asperities: dust found and kept apart, good readings left, the contact with the grinder, files, refusals."""

import numpy as np
import pytest
from circle_inside import robust_gaussian
from measured_rings import turn

import sdpgrind
from centering.roundness import Harmonics, Profile, SpindleError
from centering.setup import Stock, plan_changeover
from sdpgrind import units

SPINDLE = SpindleError(Harmonics([2], [1e-4], [1.9], [1e-6]), np.array([36]))
DUST = ((1.0, 0.003, 0.05), (6.281, 0.004, 0.01), (4.0, 0.002, 0.003))
"""Places (rad), widths (sd, rad) and heights (mm); the second lies across the end of the turn."""


def readings(angle, offset=0.0, dust=DUST, internal=False, noise=1e-4, rng=0):
    """Exact readings of a part off the axis, mm, centres along one line; dust stands on the material's free side."""
    form = 1e-3 * np.cos(2 * angle - 0.3) + 4e-4 * np.cos(7 * angle - 1.1) + 1.5e-4 * np.cos(33 * angle - 2)
    form += noise * np.random.default_rng(rng).normal(size=angle.size)
    for place, width, height in dust:
        apart = np.mod(angle - place + np.pi, 2 * np.pi) - np.pi
        form += (-1 if internal else 1) * height * np.exp(-0.5 * (apart / width) ** 2)
    return offset * np.cos(angle - 0.5) + np.sqrt((30 + form) ** 2 - (offset * np.sin(angle - 0.5)) ** 2)


def um(profile):
    return profile.filter(upr=50).roundness().ron_t / units.um(1.0)


@pytest.mark.parametrize(
    ("turns", "points", "offset", "internal"),
    [(1, 1024, 0, False), (1, 1024, 0.5, False), (3, 1024, 0, False), (1, 2048, 0.3, True)],
)
def test_dust_is_taken_out_and_nothing_else(turns, points, offset, internal):
    """RONt as without dust within 0.02 um: 8 of 1024 readings fewer, noise of 0.027 um in each deviation."""
    angle = turn(turns, points)
    dusty, clean = (
        Profile(angle, readings(angle, offset, dust, internal), internal=internal) for dust in (DUST, ())
    )
    found = dusty.remove_asperities()
    assert um(dusty) > um(clean) + 1 and um(found) == pytest.approx(um(clean), abs=0.02)
    assert f"of {3 * turns} asperities more than 6 sd" in found.steps[-1]
    near = [
        min(abs(np.angle(np.exp(1j * (place - each)))) for place, _, _ in DUST) for each, _ in found.removed
    ]
    assert max(near) < 0.03 and found.removed[:, 1].max() == pytest.approx(0.05, rel=0.06)
    assert found.angle.size + len(found.removed) == angle.size
    assert found.filter(upr=50).angle.size == points and found.nyquist == points / 2


def test_good_readings_stay():
    """Twenty turns of noise lose none: the chance of a normal reading above 6 sd is 1e-9."""
    for rng in range(20):
        profile = Profile(readings(turn(1, 512), dust=(), rng=rng))
        found = profile.remove_asperities(both=True)
        assert found.steps[-1].startswith("no asperity more than 6 sd (0.") and not len(found.removed)
        assert np.array_equal(found.reading, profile.reading) and found.circle == profile.circle


def test_by_straight_loops():
    """Grown on the closed turn from each reading above six sd to the last one above two."""
    profile = Profile(readings(turn(1, 720)))
    found = profile.remove_asperities()
    tall = {round(angle, 9) for angle, _, _ in found._origin.removed}
    from_form = profile.deviation - robust_gaussian(profile.deviation, 36)
    sd, out = 1.4826 * np.median(np.abs(from_form)), set()
    for k in np.flatnonzero(from_form > 6 * sd):
        for way in (1, -1):
            j = k
            while abs(from_form[j]) >= 2 * sd:
                out.add(j)
                j = (j + way) % 720
    assert {round(profile.angle[j], 9) for j in out} == tall


def test_pits_and_width():
    angle = turn(1, 2048)
    profile = Profile(2 * 30 - readings(angle))
    assert not len(profile.remove_asperities().removed)
    pits = profile.remove_asperities(both=True)
    assert pits.removed[:, 1].min() == pytest.approx(-0.05, rel=0.06) and "up to -" in pits.steps[-1]
    # the tall one is 0.003 rad (sd) wide at its foot of 2 sd, that is +- 0.0095 rad
    narrow = profile.remove_asperities(both=True, width=0.017)
    assert 0 < len(narrow.removed) < len(pits.removed) and narrow.removed[:, 1].min() > -0.02


def test_saved_drawn_and_reported(tmp_path):
    profile = Profile(readings(turn(1, 1024))).remove_asperities()
    filtered = profile.filter(upr=50)
    filtered.save(tmp_path / "ring.nc")
    again = sdpgrind.load(tmp_path / "ring.nc")
    assert again == filtered and np.array_equal(again.removed, filtered.removed)
    assert filtered.removed == pytest.approx(profile.removed, abs=1e-6)
    with pytest.warns(UserWarning, match="leaves .* upr sure"):
        assert "8 readings of 3 asperities more than 6 sd" in profile.report()
    named = [text.get_text() for text in filtered.plot().axes[0].get_legend().get_texts()]
    assert named == ["8 readings taken out, up to 49.9 µm"]


@pytest.mark.parametrize("internal", [False, True])
def test_the_grinder_meets_what_was_taken_out(internal):
    """The largest radius, in a bore the smallest, is that with the dust."""
    angle = turn(4, 360)
    profile = Profile(
        angle, readings(angle, internal=internal, dust=((np.radians(58), 0.006, 0.05),)), internal=internal
    )
    found = profile.remove_asperities()
    stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004)
    machine = {"finish_radius": 30.15 if internal else 29.85, "gap": 0.01, "approach_rate": 0.026}
    before, after = (plan_changeover(each, stock, **machine).largest_radius for each in (profile, found))
    assert abs(after - 30) > 0.045 and after == pytest.approx(before, abs=1e-3)
    if not internal:
        assert found.largest_radius() == profile.largest_radius() > 30.045
        assert found.filter(upr=50).largest_radius() == pytest.approx(profile.largest_radius(), abs=1e-5)


def test_what_is_refused():
    profile, rough = Profile(readings(turn(1, 1024))), readings(turn(1, 1024), dust=())
    rough[100:150] += 0.005 * (-1.0) ** np.arange(50)
    with pytest.raises(
        ValueError, match=r"at most 2 % of its points in asperities; got 2\.4 % .*that is form"
    ):
        Profile(rough).remove_asperities()
    with pytest.raises(
        ValueError, match=r"remove_asperities must come before a filter .* got Gaussian low-pass"
    ):
        profile.filter(upr=50).remove_asperities()
    with pytest.raises(ValueError, match="at least 64 samples for remove_asperities; got 60"):
        Profile(readings(turn(1, 60))).remove_asperities()
    with pytest.raises(ValueError, match=r"sigmas must be > 2, where an asperity ends; got 1\.0"):
        profile.remove_asperities(1.0)


@pytest.mark.filterwarnings(
    "ignore:the robust filter still moves:UserWarning"
)  # its weights have no noise to settle on
@pytest.mark.parametrize("points", [360, 512, 720, 1024])
@pytest.mark.parametrize("upr", [2, 3])
def test_form_without_noise_has_no_asperities(points, upr):
    """What the robust form leaves of a wave is curvature; taken as noise it made 4 to 14 % of points stand out."""
    profile = Profile(30.0 + 1e-3 * np.cos(upr * (turn(1, points) - 1.0)))
    assert profile.remove_asperities().steps[0].startswith("no asperity more than 6 sd")


def slotted(points, width, noise, dust=()):
    """A ring with a keyway 20 um deep, width in degrees, across the start of the turn or past it."""
    angle = turn(1, points)
    form = 1e-3 * np.cos(2 * angle - 0.3) + noise * np.random.default_rng(0).normal(size=points)
    form[np.abs(np.angle(np.exp(1j * (angle - 0.02)))) < np.radians(width / 2)] -= 0.02
    for place, height in dust:
        form[round(place * points)] += height
    return Profile(30.0 + form)


@pytest.mark.filterwarnings("ignore:the robust filter still moves:UserWarning")
@pytest.mark.parametrize("width", [2, 5, 10, 20])
@pytest.mark.parametrize(("points", "noise"), [(360, 1e-4), (720, 0), (1024, 0), (1024, 3e-4), (3600, 3e-4)])
def test_edges_of_a_slot_are_no_asperities(points, noise, width):
    """Past an edge the robust form is wrong by up to 15 um; the readings go on level on one side of it."""
    ring = slotted(points, width, noise)
    found = ring.remove_asperities()
    assert not len(found.removed) and "no asperity" in found.steps[-1] and not ring._suspects


@pytest.mark.parametrize("noise", [1e-4, 3e-4])
@pytest.mark.parametrize("width", [2, 5, 10])
def test_dust_beside_a_slot_is_found(width, noise):
    """At a quarter turn, and 15 degrees from the rim of the slot, past the window of the form; the slot stays."""
    near = (width / 2 + 16) / 360
    found = slotted(1024, width, noise, ((0.25, 0.01), (near, 0.01))).remove_asperities()
    places = np.mod(found.removed[:, 0], 2 * np.pi) / (2 * np.pi)
    assert found.removed[:, 1].min() > 2 * noise and len(places) <= 8
    assert min(abs(places - 0.25)) < 1e-3 and min(abs(places - near)) < 1e-3
    assert np.all((abs(places - 0.25) < 0.005) | (abs(places - near) < 0.005))


def test_dust_is_noticed_unasked(tmp_path):
    """Until it is taken out, or looked for; the same words about the circle, on its sheet, and of a profile."""
    noise = 1e-4 * np.random.default_rng(0).normal(size=720)
    noise[[200, 400, 401]] += 0.02
    dusty = Profile(30.0 + noise)
    told = "3 readings look like asperities; profile.remove_asperities() takes them out"
    for circle in (
        dusty.roundness(),
        dusty.filter(upr=50).roundness("MCC"),
        dusty.correct(SPINDLE).roundness(),
    ):
        assert told in circle.remarks and told in str(circle) and told in circle.report()
    assert told in dusty.report() and len(dusty.remove_asperities().removed) == 3
    dusty.filter(upr=50).roundness().save(tmp_path / "circle.nc")
    assert told in sdpgrind.load(tmp_path / "circle.nc").remarks
    clean = dusty.remove_asperities()
    assert not any("look" in each for each in clean.filter(upr=50).roundness().remarks)
    assert not dusty.filter("robust", upr=50).roundness().remarks


def test_nothing_is_noticed_in_noise():
    """None of 100 turns: the chance of a normal reading above 6 sd is 1e-9."""
    rngs = np.random.default_rng(7).spawn(100)
    turns = [Profile(30.0 + 1e-4 * rng.normal(size=360)) for rng in rngs]
    assert not any(profile.roundness().origin.suspects for profile in turns)


def test_a_perfect_circle_has_none():
    """Its heights are rounding."""
    perfect = Profile(np.full(360, 30.0))
    assert not perfect.roundness().origin.suspects and not len(perfect.remove_asperities().removed)


def milled(points, slots, rng, width=3.0, dust=(), drift=0.0):
    """A ring of 0.1 um noise with slots 20 um deep at these places and dust on readings (degrees, mm)."""
    angle = turn(1, points)
    form = 1e-3 * np.cos(2 * angle - 0.3) + 4e-4 * np.cos(7 * angle - 1.1) + drift * angle / (2 * np.pi)
    form += 1e-4 * np.random.default_rng(rng).normal(size=points)
    for place in slots:
        form[np.abs(np.angle(np.exp(1j * (angle - np.radians(place))))) < np.radians(width / 2)] -= 0.02
    for place, height in dust:
        form[round(place / 360 * points)] += height
    return Profile(30.0 + form)


@pytest.mark.parametrize("land", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("count", [2, 4])
def test_a_land_between_slots_is_no_asperity(land, count):
    """The robust form follows the floor of the slots; the land is level with what is beyond them."""
    for rng in range(3):
        first = 40.0 + 71.3 * rng
        ring = milled(3600, [first + k * (3.0 + land) for k in range(count)], rng)
        assert "no asperity" in ring.remove_asperities().steps[-1] and not ring._suspects


@pytest.mark.parametrize("height", [0.005, 0.015, 0.03])
@pytest.mark.parametrize("place", [90.0, 94.5, 200.0])
def test_dust_on_the_floor_of_a_slot_and_on_a_land_is_found(place, height):
    """In the middle of the slot at 90 degrees, on a land of 6 degrees beside it, and far away."""
    found = milled(3600, [90.0, 99.0], 0, dust=[(place, height)]).remove_asperities()
    assert np.degrees(found.removed[:, 0]) == pytest.approx(place, abs=0.5) and len(found.removed)


def test_the_step_of_a_drift_is_no_asperity():
    """Of 30 turns with a step of 10 sd at their end 11 had one; noise of 4.5 sd beside a step is left to chance."""
    found = [milled(720, (), rng, drift=1e-3)._suspects > 0 for rng in range(30)]
    assert sum(found) <= 2


def test_dust_on_a_steep_slope_is_found():
    """15 sd high on lobes of 20 um, which rise by 5 sd a reading: beside it the slope of the form counts."""
    angle, missed = turn(1, 720), 0
    for rng in np.random.default_rng(1).spawn(20):
        form = 0.02 * np.cos(3 * angle) + 1e-4 * rng.normal(size=720)
        form[place := int(rng.integers(720))] += 1.5e-3
        found = Profile(30.0 + form).remove_asperities()._origin.removed
        missed += [round(each[0] / angle[1]) for each in found] != [place]
    assert missed <= 1


@pytest.mark.parametrize("points", [360, 1024, 3600])
def test_noise_with_tails_is_not_dust_but_dust_is(points):
    """Laplace noise has a reading above 6 sd in 43 to 100 of 100 turns; unasked, its tails raise the least height."""
    form = 30.0 + 1e-3 * np.cos(2 * turn(1, points))
    for rng in np.random.default_rng(3).spawn(15):
        noise = 7e-5 * rng.laplace(size=points)
        assert not Profile(form + noise)._suspects
        noise[points // 3] += 2e-3
        assert Profile(form + noise)._suspects >= 1  # with a high neighbour in some turns


@pytest.mark.parametrize("slots", [(), (90.0,), (90.0, 200.0)])
def test_slots_do_not_hide_dust(slots):
    """What the form leaves beside their edges is no noise."""
    found = [milled(1024, slots, rng, 5.0, dust=[(300.0, 1.5e-3)])._suspects for rng in range(8)]
    assert found == [1] * 8
