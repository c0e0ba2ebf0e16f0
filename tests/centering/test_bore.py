"""A bore, read from within with a round tip: radius, form and centre are exact at any offset, against a tip
laid in by hand.
"""

import numpy as np
import pytest

import sdpgrind
from centering.roundness import Profile, Sections

RADIUS, TIP, LOBES, WAY = 30.0, 3.75, {3: (0.002, 0.4)}, 0.7
TURN = np.arange(360) * 2 * np.pi / 360


def bore_reading(angle, offset, *, tip=TIP, lobes=LOBES):
    """Farthest that the tip's centre gets along the probe's line before it touches any of the surface, plus
    the tip's radius.
    """
    first, half, place = angle - 0.4, 0.8, None
    for points in (401, 401, 401, 401):
        beta = first[:, None] + half * np.linspace(0, 1, points)
        radius = RADIUS + sum(size * np.cos(n * beta - phase) for n, (size, phase) in lobes.items())
        x, y = offset * np.cos(WAY) + radius * np.cos(beta), offset * np.sin(WAY) + radius * np.sin(beta)
        along = x * np.cos(angle)[:, None] + y * np.sin(angle)[:, None]
        across = y * np.cos(angle)[:, None] - x * np.sin(angle)[:, None]
        reach = np.where(np.abs(across) <= tip, along - np.sqrt(np.maximum(tip**2 - across**2, 0.0)), np.inf)
        best = reach.argmin(axis=1)
        place = reach[np.arange(angle.size), best]
        half, first = half / 100, beta[np.arange(angle.size), best] - half / 200
    return place + tip


@pytest.fixture(scope="module", params=[0.3, 1.0, 3.6])
def bore(request):
    return request.param, Profile(TURN, bore_reading(TURN, request.param), tip_radius=TIP, internal=True)


def test_radius_centre_and_roundness_are_exact(bore):
    offset, profile = bore
    # even turns are uneven about the part
    circle, uneven = profile.roundness("LSC"), 0.002 * (offset / (RADIUS - TIP)) ** 2
    assert circle.value == pytest.approx(0.004, abs=2e-6 + 2 * uneven)
    assert circle.radius == pytest.approx(
        RADIUS, abs=1e-6 + uneven
    ) and profile.circle.radius == pytest.approx(RADIUS, abs=uneven)
    assert circle.center == pytest.approx([offset * np.cos(WAY), offset * np.sin(WAY)], abs=1e-5 + uneven)
    # samples lie beside the lobes
    assert profile.roundness("MIC").radius == pytest.approx(RADIUS - 0.002, abs=2e-6)
    assert profile.harmonics(20).largest(1)[0] == pytest.approx((3.0, 0.002), abs=1e-6)
    slant = (
        0.002 * (offset / (RADIUS - TIP)) ** 2 / 2
    )  # along the probe's line form is larger by 1/cos of its angle with the normal
    assert profile.residuals == pytest.approx(profile.deviation, abs=1.02 * slant)
    assert profile.circle.tip_radius == -TIP


def test_extreme_radii_about_the_spindle(bore):
    """Where a reading is extreme, the tip touches on the probe's line."""
    offset, profile = bore
    beta = np.linspace(0, 2 * np.pi, 200_001)
    radius = RADIUS + LOBES[3][0] * np.cos(3 * beta - LOBES[3][1])
    true = np.hypot(
        offset * np.cos(WAY) + radius * np.cos(beta), offset * np.sin(WAY) + radius * np.sin(beta)
    )
    # samples lie a degree apart
    assert profile.largest_radius() == pytest.approx(true.max(), abs=1.3e-4 * offset)
    filtered = profile.filter("gaussian", upr=50)
    assert filtered.largest_radius() == pytest.approx(true.max(), abs=2e-5)  # the filter takes 1e-5 of it


def test_read_as_a_part_a_bore_is_wrong():
    """What the switch is for: a false 2 upr of d^2 rho/(2 (R^2 - rho^2))."""
    (upr, amplitude), (_, lobes) = (
        Profile(TURN, bore_reading(TURN, 3.6), tip_radius=TIP).harmonics(6).largest(2)
    )
    assert (upr, amplitude) == pytest.approx(
        (2.0, 3.6**2 * TIP / (2 * (RADIUS**2 - TIP**2))), rel=(3.6 / RADIUS) ** 2
    )
    assert amplitude > 7 * lobes


@pytest.mark.parametrize("kept", ["filter", "file", "runout"])
def test_steps_and_files_keep_it_a_bore(kept, tmp_path):
    angle = np.arange(4 * 360) * 2 * np.pi / 360
    readings = np.tile(bore_reading(TURN, 1.0), 4)
    first = Profile(angle, readings, tip_radius=TIP, internal=True)
    if kept == "runout":
        tip, rolled = 3.65, 3.66
        readings = np.tile(bore_reading(TURN, 1.0, tip=tip), 4)
        first = Profile(angle, readings, tip_radius=tip, internal=True)
        tone = 1.5e-3 * np.cos(RADIUS / rolled * first.part_angle - 1.0)
        found = Profile(angle, readings + tone, tip_radius=tip, internal=True).remove_roller_error()
        assert found.roller_error.amplitude == pytest.approx(
            1.5e-3, rel=0.01
        ) and found.tip_radius == pytest.approx(rolled, abs=2e-3)
    elif kept == "filter":
        found = first.filter("gaussian", upr=50)
    else:
        first.save(tmp_path / "bore.nc")
        found = Profile.from_file(tmp_path / "bore.nc")
        assert found == first and found != Profile(angle, readings, tip_radius=TIP)
    assert found.internal and found.roundness("LSC").value == pytest.approx(0.004, abs=3e-5)


def test_a_point_reads_bores_and_parts_alike():
    readings = bore_reading(TURN, 1.0)
    bore, part = (Profile(TURN, readings, internal=internal) for internal in (True, False))
    assert bore.roundness("MZC").value == part.roundness("MZC").value and bore != part


@pytest.mark.parametrize("tip", [0.0, TIP])
def test_a_narrow_place_of_a_bore_is_a_peak(tip, tmp_path):
    """A ridge 2 um high and a pit 5 um deep in a bore of otherwise constant radius (ISO 12181-1)."""
    reading = np.full(720, 30.0)
    reading[100], reading[400] = 30.0 - 0.002, 30.0 + 0.005  # the ridge is nearer to the axis
    bore, shaft = (Profile(reading, tip_radius=tip, internal=internal) for internal in (True, False))
    inside, outside = bore.roundness(), shaft.roundness()
    assert (inside.ron_p, inside.ron_v) == pytest.approx((0.002, 0.005), abs=5e-5)
    assert (inside.ron_p, inside.ron_v) == pytest.approx((outside.ron_v, outside.ron_p), abs=1e-9)
    zero = {kind: bore.roundness(kind) for kind in ("MCC", "MIC")}
    assert zero["MCC"].ron_v == 0 == zero["MIC"].ron_p and zero["MCC"].ron_p == zero["MCC"].ron_t > 0.004
    inside.save(tmp_path / "bore.nc")
    again = sdpgrind.load(tmp_path / "bore.nc")
    assert again.internal and (again.ron_p, again.ron_v) == (inside.ron_p, inside.ron_v)
    tube = Sections([bore] * 3, [0.0, 10.0, 20.0])
    found = {kind: tube.cylinder(kind) for kind in ("LSC", "MCC", "MIC")}
    assert (found["LSC"].cyl_p, found["LSC"].cyl_v) == pytest.approx((0.002, 0.005), abs=5e-5)
    assert found["MCC"].cyl_v == 0 == found["MIC"].cyl_p
    assert f"{1e3 * inside.ron_p:.4g}" in inside.report() and inside.plot() is not None


def test_the_step_on_asperities_says_which_way_they_stand():
    noise = 1e-4 * np.random.default_rng(0).normal(size=1440)
    reading = 30.0 + 1e-3 * np.cos(3 * np.arange(1440) * np.pi / 720) + noise
    reading[200] -= 0.05
    told = Profile(reading, internal=True).remove_asperities().steps[-1]
    assert (
        told.startswith("1 reading of 1 asperity") and "above the form, towards the axis of the bore" in told
    )
    assert "no asperity" in Profile(reading).remove_asperities().steps[-1]


def test_refusals():
    with pytest.raises(
        ValueError, match=r"tip_radius must be < 29\.\d+, the smallest reading in a bore \(mm\); got 35"
    ):
        Profile(TURN, 30.0 + 0.1 * np.cos(TURN), tip_radius=35.0, internal=True)
    with pytest.raises(ValueError, match=r"tip_radius must be >= 0 \(mm\); got -3.75"):
        Profile(TURN, 30.0 + 0.1 * np.cos(TURN), tip_radius=-3.75, internal=True)
    with pytest.raises(TypeError, match="internal must be a bool; got 1"):
        Profile(TURN, 30.0 + 0.1 * np.cos(TURN), internal=1)
