"""Cylinders, median line, total run-out: published figures, linear programs over all points, duality."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares, linprog

from centering.roundness import Cylinder, Profile, Sections, reference_circle
from centering.roundness import _cylinder_surface as surfaces
from centering.roundness import _cylinder_zone as zones
from centering.roundness._median_line import least_squares_tube, smallest_tube
from sdpgrind import units
from sdpgrind.base.stored import decode, encode

UM = units.um(1.0)
HEIGHTS = np.array([0.0, 10.0, 20.0, 30.0])


def read_about_spindle(angle, x, y, radius):
    """Readings of a ring of a radius over the spindle angle, about a centre."""
    across = x * np.sin(angle) - y * np.cos(angle)
    return x * np.cos(angle) + y * np.sin(angle) + np.sqrt(radius**2 - across**2)


@cache
def printed():
    """Part with published figures."""
    angle, profiles = np.arange(120) * 2 * np.pi / 120, []
    for z in HEIGHTS:
        x = z / 30
        waves = np.cos(3 * angle - 0.4 - 0.5 * x) + 0.5 * np.cos(2 * angle - 1 - 0.9 * x)
        place = 5 * UM + 1e-4 * z + 4 * UM * x * (1 - x), 2 * UM + 5e-5 * z
        profiles.append(Profile(angle, read_about_spindle(angle, *place, 20 + UM * (1.2 * x + waves))))
    return Sections(profiles, HEIGHTS)


@cache
def found_of(kind):
    """Cylinder of the published part."""
    return printed().cylinder(kind)


def part(seed, sections=7, size=360):
    """A part with form, noise, bent median line and uneven radius, and its sections."""
    rng = np.random.default_rng(seed)
    radius, length, form = rng.uniform(8, 60), rng.uniform(20, 120), 10 ** rng.uniform(-0.5, 1) * UM
    place, tilt = rng.normal(size=2) * 5 * UM, rng.normal(size=2) * 1e-4
    angle, profiles = np.arange(size) * 2 * np.pi / size, []
    heights = np.linspace(0, length, sections)
    for z in heights:
        waves = sum(rng.normal() / n * np.cos(n * angle - rng.uniform(0, 6)) for n in range(2, 12))
        x, y = place + tilt * z + 0.3 * form * rng.normal(size=2)
        rough = form * (waves + 0.2 * rng.normal(size=size) + 0.3 * rng.normal())
        profiles.append(Profile(angle, read_about_spindle(angle, x, y, radius + rough)))
    return Sections(profiles, heights)


def from_axis(points, axis):
    """Distances |(P - c) x d|/|d|."""
    along = np.array([axis[2], axis[3], 1.0])
    return np.linalg.norm(np.cross(points - [axis[0], axis[1], 0.0], along), axis=1) / np.linalg.norm(along)


def differences(points, axis, step):
    """Slopes of the distances over the axis, by differences."""
    rows = [(from_axis(points, axis + each) - from_axis(points, axis - each)) / 2 for each in np.diag(step)]
    return np.array(rows).T / step


def program(points, axis, sides, box):
    """Width of the linear program of all points about an axis, its ends within a box (mm)."""
    distance, length = from_axis(points, axis), np.ptp(points[:, 2])
    slope = differences(points, axis, np.array([1e-3, 1e-3, 1e-3 / length, 1e-3 / length]))
    tilted = np.array([1.0, 1.0, 2 / length, 2 / length])
    middle = points[:, 2].mean()  # even heights
    slope[:, 2:] -= middle * slope[:, :2]  # the axis turns about its middle
    unit, level, rows, limits = np.ptp(distance), distance.mean(), [], []
    height, ones, none = (distance - level) / unit, np.ones(distance.size), np.zeros(distance.size)
    if sides.outer:
        rows, limits = [*rows, np.c_[slope * tilted, -ones, none]], [*limits, -height]
    if sides.inner:
        rows, limits = [*rows, np.c_[-slope * tilted, none, ones]], [*limits, height]
    cost = [0, 0, 0, 0, float(sides.outer), -float(sides.inner)]
    free = [(None, None) if each else (0, 0) for each in sides]
    bounds = [(-box / unit, box / unit)] * 4 + free
    found = linprog(cost, np.vstack(rows), np.concatenate(limits), bounds=bounds, method="highs-ds")
    return unit * found.fun + level * (sides.outer - sides.inner)


# ------------------------------------------------------------------------------------ published figures


def test_published_cylinders():
    sections = printed()
    fit = sections.cylinder()
    assert fit.cyl_t == pytest.approx(4.454508 * UM, abs=1e-6 * UM)
    assert sections.cylinder("MZC").cyl_t == pytest.approx(3.649739 * UM, abs=1e-6 * UM)
    np.testing.assert_allclose(fit.axis, [5.44466e-3, 2.00006e-3, 9.99868e-5, 5.00004e-5], rtol=0, atol=1e-8)


def test_published_run_outs():
    sections = printed()
    runouts = [profile.radial_runout() / UM for profile in sections.profiles]
    np.testing.assert_allclose(runouts, [12.580938, 16.583974, 18.855227, 19.454266], rtol=0, atol=1e-6)
    assert sections.total_runout() == pytest.approx(19.470428 * UM, abs=1e-6 * UM)
    twice = [profile.concentricity() / UM for profile in sections.profiles]
    np.testing.assert_allclose(twice, [10.77046, 14.65713, 16.88025, 17.46435], rtol=0, atol=1e-5)
    assert sections.coaxiality() == pytest.approx(max(twice) * UM, abs=1e-12)


def test_taper_is_that_of_the_part_about_any_axis():
    """1.2 um over 30 mm; waves and offset add less than 0.1 %."""
    sections = printed()
    for kind in ("LSC", "MZC", "MCC", "MIC"):
        assert sections.cylinder(kind).taper == pytest.approx(1.2 * UM / 30, rel=1e-3)


# -------------------------------------------------------------------------------------- true distances


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_distances_and_slopes(seed, tilt):
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.normal(size=(30, 2)) * 20, rng.uniform(-30, 50, 30)])
    axis = np.concatenate([rng.normal(size=2), rng.normal(size=2) * tilt])
    surface = surfaces.CylinderPoints.of(points)
    place = surface.place_of(axis)
    np.testing.assert_allclose(surface.axis_of(place), axis, rtol=0, atol=1e-13)
    distance, slope = surfaces.slopes(surface, place)
    np.testing.assert_allclose(distance, from_axis(points, axis), rtol=1e-12)
    np.testing.assert_array_equal(distance, surfaces.distances(surface, place))
    step = 1e-5
    for k, each in enumerate(np.eye(4) * step):
        one, other = (from_axis(points, surface.axis_of(place + sign * each)) for sign in (1, -1))
        bent = 1 / np.minimum(distance, 1.0) ** 2  # the third derivative of a distance r grows as 1/r^2
        assert np.all(np.abs((one - other) / (2 * step) - slope[:, k]) < 1e-8 * bent + 1e-9)


def test_least_squares_by_another_solver():
    sections = part(3)
    fit = sections.cylinder()

    def residuals(q):
        return 1e3 * (from_axis(sections.points, q[:4]) - q[4])

    start = [0.0, 0.0, 0.0, 0.0, fit.radius + 0.01]
    scale = [1e-3, 1e-3, 1e-5, 1e-5, 1e-3]
    other = least_squares(residuals, start, x_scale=scale, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    np.testing.assert_allclose(fit.axis, other[:4], rtol=0, atol=1e-8)
    assert fit.radius == pytest.approx(other[4], abs=1e-9)
    assert np.mean(fit.deviation) == pytest.approx(0.0, abs=1e-13)


def test_a_perfect_cylinder_far_off_and_tilted():
    """Through a ball of 1 mm outside and inside: the centre of the tip is exactly that much farther."""
    axis, radius = np.array([1.5, -0.7, 0.02, -0.01]), 20.0
    along = np.array([*axis[2:], 1.0]) / np.linalg.norm([*axis[2:], 1.0])
    first = np.cross(along, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    turn, up = np.arange(400) * 0.1, np.linspace(0, 40, 400)
    for tip, internal in ((1.0, False), (1.0, True)):
        far = radius + (-tip if internal else tip)
        normal = np.outer(np.cos(turn), first) + np.outer(np.sin(turn), np.cross(along, first))
        points = [axis[0], axis[1], 0.0] + np.outer(up, along) + far * normal
        reading = np.hypot(points[:, 0], points[:, 1]) + (tip if internal else -tip)
        helix = Sections.from_points(
            np.arctan2(points[:, 1], points[:, 0]), points[:, 2], reading, tip_radius=tip, internal=internal
        )
        for kind in ("LSC", "MZC", "MCC", "MIC"):
            found = helix.cylinder(kind)
            assert found.radius == pytest.approx(radius, abs=1e-11) and found.cyl_t < 1e-11
            np.testing.assert_allclose(found.axis, axis, rtol=0, atol=1e-11)


# ------------------------------------------------------------------------------------- extreme cylinders


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["MZC", "MCC", "MIC"])
def test_extreme_cylinders_against_the_program_of_all_points(seed, kind):
    """Slopes by differences, distances by cross products, no generation of constraints."""
    sections = part(seed, size=180)
    found, sides = sections.cylinder(kind), zones.SIDES[kind]
    width = sides.width(from_axis(sections.points, found.axis))
    best = program(sections.points, found.axis, sides, found.reach)
    assert width == pytest.approx(best, abs=1e-9)  # HiGHS stops at 1e-7 of some 10 um
    assert found.bound == pytest.approx(abs(best), abs=1e-9)
    assert "local" in found.certificate and f"{1e3 * found.reach:.3g} µm" in found.certificate


@pytest.mark.parametrize("seed", range(4))
def test_no_random_start_ends_lower(seed):
    rng, sections = np.random.default_rng(seed), part(seed + 20, size=180)
    found, surface = sections.cylinder("MZC"), surfaces.CylinderPoints.of(sections.points)
    fit = surface.place_of(sections.cylinder().axis)
    for _ in range(5):
        start = fit + np.concatenate([3 * UM * rng.normal(size=2), 1e-4 * surface.half * rng.normal(size=2)])
        place = zones.zone(surface, start, "MZC").place
        assert np.ptp(surfaces.distances(surface, place)) == pytest.approx(found.cyl_t, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["MZC", "MCC", "MIC"])
def test_one_section_holds_the_cylinder(seed, kind):
    """Its contacts leave the tilt free to first order: curved distances decide."""
    rng, angle = np.random.default_rng(seed), np.arange(180) * np.pi / 90
    form = np.array([0.3, 0.3, 3.0, 0.3, 0.3])[:, np.newaxis] * UM
    waves = sum(rng.normal(size=(5, 1)) / n * np.cos(n * angle - rng.uniform(0, 6)) for n in range(2, 12))
    rough = form * (waves + 0.1 * rng.normal(size=(5, 180)))
    sections = Sections([Profile(angle, 25.0 + each) for each in rough], np.arange(5) * 10.0)
    found = sections.cylinder(kind)
    width = zones.SIDES[kind].width(from_axis(sections.points, found.axis))
    assert abs(width) == pytest.approx(found.bound, abs=2e-9)


@given(st.integers(0, 2**32 - 1))
def test_bound_holds_within_reach(seed):
    """Of any axis within reach, to the second order that the certificate allows."""
    rng = np.random.default_rng(seed)
    surface = surfaces.CylinderPoints.of(printed().points)
    for kind, sides in zones.SIDES.items():
        found = found_of(kind)
        low, high = (
            rng.uniform(0, found.reach) * np.array([np.cos(a), np.sin(a)]) for a in rng.uniform(0, 7, 2)
        )
        moved = surface.place_of(found.axis) + np.concatenate([(low + high) / 2, (high - low) / 2])
        width, bound = sides.width(surfaces.distances(surface, moved)), found.bound
        assert width >= (-bound if kind == "MIC" else bound) - zones.CURVED


@pytest.mark.parametrize("seed", range(3))
def test_order_of_cylinders(seed):
    sections = part(seed + 40, size=90)
    found = {kind: sections.cylinder(kind) for kind in ("LSC", "MZC", "MCC", "MIC")}
    assert all(found["MZC"].cyl_t <= each.cyl_t + 1e-12 for each in found.values())
    assert found["LSC"].cyl_q <= min(each.cyl_q for each in found.values()) + 1e-15
    assert found["MIC"].radius < found["LSC"].radius < found["MCC"].radius
    assert abs(found["MCC"].cyl_p) < 1e-11 and abs(found["MIC"].cyl_v) < 1e-11
    zone = found["MZC"]
    assert zone.cyl_p == pytest.approx(zone.cyl_v, abs=1e-12)
    heights = zone.deviation[zone.contacts]
    np.testing.assert_allclose(heights, np.where(zone.outer, zone.cyl_p, -zone.cyl_v), rtol=0, atol=1e-11)


@pytest.mark.parametrize("seed", range(3))
def test_no_section_seen_along_the_axis_is_less_round(seed):
    sections = part(seed + 60, size=120)
    for kind in ("LSC", "MZC", "MCC", "MIC"):
        found = sections.cylinder(kind)
        along = np.array([*found.axis[2:], 1.0]) / np.linalg.norm([*found.axis[2:], 1.0])
        first = np.cross([0.0, 1.0, 0.0], along) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], along))
        seen = (sections.points - [*found.axis[:2], 0.0]) @ np.column_stack([first, np.cross(along, first)])
        for z in sections.heights:
            ring = reference_circle(seen[sections.points[:, 2] == z], "MZC")
            assert ring.ron_t <= found.cyl_t + 1e-12


# ------------------------------------------------------------------------------ median line and run-out


def straight(centers):
    """Sections of perfect rings about centres, (m, 3), mm."""
    angle = np.arange(36) * 2 * np.pi / 36
    rings = [Profile(angle, read_about_spindle(angle, x, y, 20.0)) for x, y, _ in centers]
    return Sections(rings, centers[:, 2])


@pytest.mark.parametrize("size", [3, 4, 5, 7, 12])
def test_thinnest_tube_by_linear_programs(size):
    """Each program, of distances in some directions only, is a lower bound; the true tube closes the gap."""
    rng = np.random.default_rng(size)
    centers = np.column_stack([rng.normal(size=(size, 2)) * 5, np.linspace(0, 2, size)])
    rows = np.kron(np.eye(2), np.column_stack([np.ones(size), centers[:, 2] - 1.0]))
    turn = np.tile(np.arange(8) * np.pi / 4, (size, 1))
    for _ in range(80):
        one, other = np.cos(turn)[..., None], np.sin(turn)[..., None]
        seen = (one * rows[:size, None] + other * rows[size:, None]).reshape(-1, 4)
        height = (one[..., 0] * centers[:, :1] + other[..., 0] * centers[:, 1:2]).ravel()
        found = linprog(
            [0, 0, 0, 0, 1], np.c_[-seen, -np.ones(len(seen))], -height, bounds=[(None, None)] * 5
        )
        left = centers[:, :2].T.ravel() - rows @ found.x[:4]
        if np.hypot(left[:size], left[size:]).max() <= found.fun * (1 + 1e-9):
            break
        turn = np.column_stack([turn, np.arctan2(left[size:], left[:size])])
    scaled = centers * [UM, UM, 40.0]  # tilted by some um over 80 mm
    assert np.hypot(left[:size], left[size:]).max() == pytest.approx(found.fun, rel=1e-6)
    assert smallest_tube(scaled) == pytest.approx(2 * UM * found.fun, rel=2e-6)
    assert smallest_tube(scaled) <= least_squares_tube(scaled)


def test_a_bow_of_three_sections():
    """Two centres on a line and the middle one 4 um off it: a tube of 4 um; about the LS line 16/3 um."""
    bow = straight(np.array([[0.0, 0.0, 0.0], [4 * UM, 0.0, 15.0], [0.0, 0.0, 30.0]]))
    assert bow.straightness() == pytest.approx(4 * UM, abs=1e-10)
    assert bow.straightness("ls") == pytest.approx(16 / 3 * UM, abs=1e-10)


def test_datum_of_a_cylinder():
    sections = printed()
    found = sections.cylinder("MZC")
    assert sections.total_runout(found) == pytest.approx(found.cyl_t, abs=1e-12)
    twice = [
        profile.concentricity(found.at(z)) for profile, z in zip(sections.profiles, HEIGHTS, strict=True)
    ]
    assert sections.coaxiality(found) == pytest.approx(max(twice), rel=1e-7)
    assert sections.total_runout((0.0, 0.0)) == sections.total_runout()
    assert sections.total_runout() >= max(profile.radial_runout() for profile in sections.profiles)
    moved = sections.coaxiality((5 * UM, 2 * UM))
    assert moved == pytest.approx(
        max(2 * np.hypot(*(sections.centers[:, :2] - [5 * UM, 2 * UM]).T)), abs=1e-15
    )


# --------------------------------------------------------------------------------- own data, files, errors


def table(sections):
    """Sections as a tester's table, degrees and um."""
    angle = np.concatenate([np.degrees(profile.angle) for profile in sections.profiles])
    deviation = np.concatenate([(profile.reading - 20.0) / UM for profile in sections.profiles])
    heights = np.repeat(sections.heights, [profile.angle.size for profile in sections.profiles])
    return {"angle (deg)": angle, "dev (um)": deviation, "z (mm)": heights}


def test_sections_are_read_in_any_order():
    sections = printed()
    data = table(sections)
    backward = {name: values[::-1] for name, values in data.items()}
    for each in (data, backward):
        read = Sections.read(each, height="z", angle="angle", deviation="dev", radius=20.0)
        np.testing.assert_array_equal(read.heights, HEIGHTS)
        assert read.cylinder("MZC").cyl_t == pytest.approx(3.649739 * UM, abs=1e-6 * UM)
        assert read.profiles[1].source.columns[-1].name == "height"


def test_bad_tables():
    data = table(printed())
    told = {"height": "z", "angle": "angle", "deviation": "dev", "radius": 20.0}
    with pytest.raises(ValueError, match=r"480 heights in 480 rows: Sections\.from_points takes readings"):
        Sections.read(data | {"z (mm)": np.linspace(0, 30, 480)}, **told)
    half = {name: values[np.r_[0:60, 120:480]] for name, values in data.items()}
    with pytest.raises(ValueError, match=r"height 0 mm: angles must go round the ring; got 0\.49 of a turn"):
        Sections.read(half, **told)
    assert len(Sections.read(half, **told, plausible=False).profiles) == 4
    with pytest.raises(ValueError, match=r"shaft.x3p holds one section"):
        Sections.read("shaft.x3p", height="z", radius=20.0)
    with pytest.raises(ValueError, match="profiles must be at least 3 sections; got 2"):
        Sections.read({name: values[:240] for name, values in data.items()}, **told)


def test_files(tmp_path):
    sections = printed()
    mixed = Sections([sections.profiles[0].filter(upr=15), *sections.profiles[1:]], HEIGHTS)
    turn = np.linspace(0, 12 * np.pi, 700)
    helix = Sections.from_points(
        turn, turn / 2, 20.0 + 2 * UM * np.cos(3 * turn), tip_radius=0.5, internal=True
    )
    for each in (sections, mixed, helix):
        each.save(tmp_path / "sections.nc")
        again = Sections.from_file(tmp_path / "sections.nc")
        assert again == each and repr(again) == repr(each)
        assert again.cylinder("MZC") == each.cylinder("MZC")
    np.testing.assert_array_equal(
        mixed.profiles[0].residuals, Sections.restored(mixed.dataset).profiles[0].residuals
    )
    found = sections.cylinder("MZC")
    assert decode(encode(found)) == found and isinstance(found, Cylinder)


def test_bad_sections():
    sections = printed()
    one, *others = sections.profiles
    with pytest.raises(ValueError, match="profiles must be at least 3 sections; got 2"):
        Sections([one, one], [0.0, 1.0])
    with pytest.raises(
        ValueError, match=r"heights must be different: one height fixes no axis \(mm\); got 5.0"
    ):
        Sections([one] * 3, [5.0] * 3)
    with pytest.raises(ValueError, match=r"heights must be one for each of 3 profiles \(mm\); got \(2,\)"):
        Sections([one] * 3, [5.0] * 2)
    bore, ball = (Profile(one.angle, one.reading, **way) for way in ({"internal": True}, {"tip_radius": 0.5}))
    with pytest.raises(
        ValueError, match=r"one internal; got False of profiles\[0\] and True of profiles\[1\]"
    ):
        Sections([one, bore, *others], [0, 1, 2, 3, 4])
    with pytest.raises(
        ValueError, match=r"one tip_radius; got 0.0 of profiles\[0\] and 0.5 of profiles\[1\]"
    ):
        Sections([one, ball, *others], [0, 1, 2, 3, 4])
    with pytest.raises(TypeError, match="profiles must be a Profile; got 3"):
        Sections([3], [0])
    with pytest.raises(ValueError, match="kind must be one of LSC, MCC, MIC, MZC; got 'mzc'"):
        sections.cylinder("mzc")
    with pytest.raises(ValueError, match="method must be one of MZC, ls; got 'LSC'"):
        sections.straightness("LSC")
    with pytest.raises(
        ValueError, match=r"datum must be \(x, y\) \(mm\), a Cylinder, or two of .*; got \(0.0,\)"
    ):
        sections.total_runout((0.0,))


def test_bad_scans():
    turn = np.linspace(0, 12 * np.pi, 700)
    with pytest.raises(
        ValueError, match=r"height must be different: one height fixes no axis \(mm\); got 2.0"
    ):
        Sections.from_points(turn, np.full(700, 2.0), np.full(700, 20.0))
    with pytest.raises(ValueError, match=r"height must be one for each of 700 readings \(mm\); got \(3,\)"):
        Sections.from_points(turn, [1.0, 2.0, 3.0], np.full(700, 20.0))
    helix = Sections.from_points(turn, turn, np.full(700, 20.0))
    for name in ("straightness", "coaxiality"):
        with pytest.raises(
            ValueError, match=f"{name} must be asked of profiles .* got 700 readings of no section"
        ):
            getattr(helix, name)()
    arc = Sections.from_points(turn / 16, np.tile(np.arange(7.0), 100), np.full(700, 20.0))
    with pytest.raises(
        ValueError, match="must cover at least 180 deg about their cylinder; they cover 135 deg"
    ):
        arc.cylinder()
    lines = Sections.from_points(np.repeat([0.0, 2.0], 350), np.tile(np.arange(350.0), 2), np.full(700, 20.0))
    with pytest.raises(ValueError, match="readings must go around the part at several heights"):
        lines.cylinder()


def test_an_inscribed_cylinder_that_nothing_holds():
    """Arcs of 150 deg, on one side at one end and on the other side at the other: it leaves by tilting."""
    arc = np.radians(np.linspace(15, 165, 200))
    scan = Sections.from_points(
        np.append(arc, arc + np.pi), np.repeat([0.0, 100.0], 200), 20.0 + UM * np.cos(3 * np.tile(arc, 2))
    )
    with pytest.raises(ValueError, match="readings must hold the cylinder from all sides"):
        scan.cylinder("MIC")


def test_picture():
    pytest.importorskip("matplotlib").use("agg")
    found = printed().cylinder("MZC")
    (axis,) = found.plot().axes
    drawn = [line for line in axis.lines if line.get_linestyle() == "-" and len(line.get_xdata()) == 120]
    assert len(drawn) == 4 and axis.get_title().startswith("MZC: CYLt 3.65 µm; deviations ")
    spread = np.concatenate([line.get_ydata() - z for line, z in zip(drawn, HEIGHTS, strict=True)])
    assert np.ptp(spread) == pytest.approx(8.0)  # 0.8 of the distance of two sections
    assert sum(line.get_marker() == "o" for line in axis.lines) == 6
