"""Reference circles against brute force, Voronoi diagrams, Welzl's way, linear and cone programs, and
published forms.
"""

import numpy as np
import pytest
from circle_twins import (
    SAMPLINGS,
    brute_circumscribed,
    brute_inscribed,
    brute_zone,
    cone_circle,
    distances,
    linear_zone,
    on_rays,
    random_profile,
    smooth_profile,
    voronoi_inscribed,
    voronoi_zone,
    welzl,
)
from scipy.optimize import least_squares

from centering.roundness import reference_circle

EXACT = 1e-9  # mm, where only rounding and the slack of a search (1e-12 of the radius) are between
ROUNDING = 1e-12  # mm, of distances of 60 mm


def profiles(count, smallest=5, largest=11):
    """Small profiles of all samplings, with forms from a ten-thousandth of the radius to a fifth."""
    rng = np.random.default_rng(181)
    for k in range(count):
        yield random_profile(
            rng, int(rng.integers(smallest, largest)), SAMPLINGS[k % 5], 10 ** rng.uniform(-4, -0.7)
        )


def covers(points):
    """Whether the points are on half a turn about their circle, as the circles ask."""
    try:
        reference_circle(points, "LSC")
    except ValueError:
        return False
    return True


SMALL = [points for points in profiles(230) if covers(points)]


def test_there_are_enough_small_profiles():
    assert len(SMALL) >= 200


def test_zone_equals_brute_force():
    for points in SMALL:
        found = reference_circle(points, "MZC")
        least = brute_zone(points, found.center, 0.4 * found.radius)
        assert found.value == pytest.approx(least, abs=EXACT)
        assert found.bound == pytest.approx(found.value, abs=EXACT)
        assert found.bound <= found.value + ROUNDING


def test_circumscribed_equals_brute_force():
    for points in SMALL:
        assert reference_circle(points, "MCC").radius == pytest.approx(
            brute_circumscribed(points), abs=ROUNDING
        )


def test_inscribed_equals_brute_force_or_is_refused_where_nothing_holds_it():
    refused = 0
    for points in SMALL:
        inside, border = brute_inscribed(points)
        if border > inside + EXACT:
            refused += 1
            with pytest.raises(ValueError, match=r"from all sides; one of .* mm can leave by a gap"):
                reference_circle(points, "MIC")
        else:
            found = reference_circle(points, "MIC")
            assert found.radius == pytest.approx(inside, abs=EXACT)
            assert found.bound == pytest.approx(found.radius, abs=EXACT)
    assert refused < 10


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_zone_equals_linear_programs(sampling):
    points = smooth_profile(np.random.default_rng(5), 180, sampling, noise=2e-4)
    assert reference_circle(points, "MZC").value == pytest.approx(linear_zone(points), abs=EXACT)


@pytest.mark.parametrize("n", [24, 40])
def test_zone_and_inscribed_equal_voronoi_diagrams(n):
    points = smooth_profile(np.random.default_rng(n), n, "uneven", form=0.02, noise=0.3)
    zone = reference_circle(points, "MZC")
    assert zone.value == pytest.approx(voronoi_zone(points, zone.center, 20.0), abs=EXACT)
    assert reference_circle(points, "MIC").radius == pytest.approx(voronoi_inscribed(points), abs=EXACT)


def test_inscribed_of_many_points_equals_the_voronoi_diagram():
    points = smooth_profile(np.random.default_rng(8), 3000, noise=1e-4)
    assert reference_circle(points, "MIC").radius == pytest.approx(voronoi_inscribed(points), abs=EXACT)


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_circumscribed_equals_welzl_and_a_cone_program(sampling):
    rng = np.random.default_rng(9)
    points = smooth_profile(rng, 300, sampling, noise=1e-4)
    found = reference_circle(points, "MCC")
    assert found.radius == pytest.approx(welzl(points, rng), abs=ROUNDING)
    # the solver's tolerance is of 1 in scaled units
    assert found.radius == pytest.approx(cone_circle(points), abs=2e-6)


@pytest.mark.parametrize("form", [1e-5, 1e-2, 0.2])
def test_least_squares_equals_scipy(form):
    points = smooth_profile(np.random.default_rng(3), 200, "uneven", form=form)
    found = reference_circle(points, "LSC")
    # of first order, slopes leave 1.5e-7 mm
    tight = {"jac": "3-point", "xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    best = least_squares(lambda c: distances(points, c[:2])[0] - c[2], [3, -2, 60], **tight)
    assert [*found.center, found.radius] == pytest.approx(best.x, abs=1e-7)
    assert found.ron_q**2 * 200 <= 2 * best.cost * (1 + 1e-12)
    away = points - found.center
    level = (found.deviation / np.hypot(*away.T)) @ away
    assert "rises in every direction" in found.certificate
    assert np.abs([*level, found.deviation.sum()]).max() < 1e-9  # mm, of sums of 200 of rounding 1e-14


@pytest.mark.parametrize("kind", ["LSC", "MCC", "MIC", "MZC"])
def test_points_of_a_circle_have_no_roundness(kind):
    found = reference_circle(on_rays(np.radians(np.arange(0, 360.0, 0.7)), 61.94, (3.6, -1.0)), kind)
    assert found.value < ROUNDING
    assert [*found.center, found.radius] == pytest.approx([3.6, -1.0, 61.94], abs=ROUNDING)
    assert abs(found.bound) < ROUNDING or found.bound == pytest.approx(61.94, abs=ROUNDING)


def test_two_lobes_have_a_circle_on_a_diameter():
    angle = np.radians(np.arange(0.0, 360.0, 0.25))
    found = reference_circle(on_rays(angle, 30 + 0.01 * np.cos(2 * angle - 0.5)), "MCC")
    assert found.contacts.size == 2 and found.outer.all()
    # the samples next to the crests are at most 0.125 deg off
    assert found.radius == pytest.approx(30.01, abs=1e-7)
    assert found.value == pytest.approx(0.02, abs=1e-6)
    assert "ends of a diameter" in found.certificate


@pytest.mark.parametrize("upr", [2, 3, 5, 8])
def test_lobes_lie_between_their_crests_and_troughs(upr):
    angle = np.arange(720) * 2 * np.pi / 720
    points = on_rays(angle, 30 + 0.01 * np.cos(upr * angle))
    found = reference_circle(points, "MZC")
    assert found.value == pytest.approx(np.ptp(np.hypot(*points.T)), abs=ROUNDING if upr > 2 else 1e-7)
    assert [*found.center] == pytest.approx([0, 0], abs=1e-4)


def test_a_spike_in_one_of_many_turns_is_found():
    angle = np.tile(np.radians(np.arange(360.0)), 4)
    radius = np.full(angle.size, 61.94)
    radius[500], radius[900] = 61.95, 61.93
    found = reference_circle(on_rays(angle, radius, (2.0, 1.0)), "MZC")
    assert found.value < 0.0201 and {500, 900} <= set(found.contacts.tolist())


def test_alternatives_of_one_direction_bound_the_width():
    """Readings of one direction that differ by 6 um in two turns: no centre helps, and every one within a
    region is as good.
    """
    angle = np.tile(np.radians(np.arange(0.0, 360.0, 10.0)), 2)
    radius = np.full(angle.size, 61.94)
    radius[4], radius[40] = 61.943, 61.937
    found = reference_circle(on_rays(angle, radius), "MZC")
    assert found.value == pytest.approx(0.006, abs=1e-9)
    assert found.bound == pytest.approx(found.value, abs=EXACT)


def test_two_optima_of_an_inscribed_circle_are_told_apart():
    """Across two lobes the circle slides along the trough to either side: of two local optima the larger is
    given.
    """
    angle = np.radians(np.arange(0.0, 360.0, 3.0)) + 0.01
    points = on_rays(angle, 30 * (1 + 0.08 * np.cos(2 * angle)))
    points[20] *= 0.999
    inside, border = brute_inscribed(points[::3])
    assert inside > border
    assert reference_circle(points[::3], "MIC").radius == pytest.approx(inside, abs=EXACT)


def test_half_a_turn_is_enough():
    rng = np.random.default_rng(2)
    angle = np.radians(np.arange(0.0, 181.0, 12.0))
    points = on_rays(angle, 60 + rng.uniform(-0.01, 0.01, angle.size), (3.0, -2.0))
    zone = reference_circle(points, "MZC")
    assert zone.value == pytest.approx(brute_zone(points, zone.center, 0.4 * zone.radius), abs=EXACT)
    assert reference_circle(points, "MCC").radius == pytest.approx(brute_circumscribed(points), abs=ROUNDING)


def test_a_standing_spindle_does_not_lead_astray():
    rng = np.random.default_rng(4)
    angle = np.concatenate([np.full(3000, 1.0), np.radians(np.arange(0.0, 360.0, 5.0))])
    points = on_rays(angle, 60 + 1e-3 * rng.normal(size=angle.size))
    assert reference_circle(points, "MZC").value == pytest.approx(linear_zone(points), abs=EXACT)


def test_three_directions_many_times():
    rng = np.random.default_rng(6)
    points = on_rays(np.repeat(np.radians([0.0, 110.0, 240.0]), 40), 60 + 0.01 * rng.uniform(-1, 1, 120))
    found = reference_circle(points, "MZC")
    spread = np.ptp(np.hypot(*points.T).reshape(3, 40), axis=1).max()
    assert found.value == pytest.approx(spread, abs=EXACT)
    assert found.bound == pytest.approx(found.value, abs=EXACT)


def racetrack(n, noise=0.0):
    """Two flats of 6 mm, 60 mm apart, between half circles."""
    along, turn = np.linspace(-3, 3, n), np.linspace(-np.pi / 2, np.pi / 2, n)
    ends = [side * on_rays(turn, 30.0, (3.0, 0.0)) for side in (1, -1)]
    flats = [np.column_stack([along, np.full(n, side * 30.0)]) for side in (1, -1)]
    return np.vstack(flats + ends) + noise * np.random.default_rng(1).normal(size=(4 * n, 2))


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4])
def test_an_inscribed_circle_between_flats_is_bounded(noise):
    """All centers along the flats are as good: there are as many optima as points. The search ends in time,
    and tells.
    """
    points = racetrack(1024, noise)
    found = reference_circle(points, "MIC")
    assert found.radius == pytest.approx(30.0, abs=5 * noise + 1e-6)
    assert found.radius <= found.bound <= found.radius + 5e-4
    assert found.bound >= voronoi_inscribed(points[::4]) - 0.05
    if noise < 1e-5:
        assert "are as good to 4e-06 mm, so that nothing fixes the centre" in found.certificate


def test_optima_of_an_oval_are_not_told_as_equally_good():
    angle = np.arange(4096) * 2 * np.pi / 4096
    found = reference_circle(
        on_rays(angle, 30 + 0.03 * np.cos(2 * angle + 0.3) + 1e-3 * np.cos(3 * angle)), "MIC"
    )
    assert "as good" not in found.certificate and found.bound == pytest.approx(found.radius, abs=EXACT)


@pytest.mark.parametrize("n", [3, 4, 5, 16, 40])
def test_points_on_a_centre_and_many_ties(n):
    """A grid: one point lies on the centre that exchanges start from, others on those of squares that are
    searched.
    """
    points = np.array([(i, j) for i in range(n) for j in range(n)], dtype=float)
    inside, zone = reference_circle(points, "MIC"), reference_circle(points, "MZC")
    assert inside.radius == pytest.approx(np.sqrt(0.5), abs=1e-9)
    assert inside.radius <= inside.bound <= reference_circle(points, "MCC").radius + 1e-9
    assert 0 <= zone.bound <= zone.value + ROUNDING
    assert zone.value <= reference_circle(points, "LSC").value + ROUNDING


def test_a_zone_is_proved_within_half_its_inner_radius_and_no_further():
    """Of half a turn of a profile with high lobes, centers far off can be better: nothing is claimed of them."""
    angle = np.linspace(0, np.radians(200), 40)
    found = reference_circle(on_rays(angle, 30 * (1 + 0.15 * np.cos(3 * angle))), "MZC")
    inner = found.radius - found.value / 2
    told = f"{inner / 2:.3g} mm, half the inner radius,"
    assert told in found.certificate and "beyond" not in found.certificate
