"""What holds of reference circles whatever the profile: order, moves, what lies between, certificates."""

import numpy as np
import pytest
from circle_twins import on_rays, random_profile
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from centering.roundness import reference_circle

pytestmark = pytest.mark.filterwarnings("ignore:Roundness.value_:DeprecationWarning")

KINDS = ("LSC", "MCC", "MIC", "MZC")
PLACES = st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000))
ROUNDING = 1e-10  # mm, of profiles of 10 to 100 mm moved by up to 1 m


@st.composite
def profiles(draw):
    """Points around a circle of 50 mm, uneven, off by up to a tenth, each radius of its own."""
    n = draw(st.integers(8, 40))
    jitter = draw(st.lists(st.floats(0, 0.9), min_size=n, max_size=n))
    form = draw(st.sampled_from([1e-5, 1e-3, 1e-2, 0.1]))
    radius = draw(st.lists(st.floats(-0.5, 0.5), min_size=n, max_size=n))
    angle = (np.arange(n) + np.array(jitter)) * 2 * np.pi / n
    return on_rays(angle, 50 * (1 + form * np.array(radius)))


def held(points, kind):
    """The circle, where there is one: with few points an inscribed one can leave."""
    try:
        return reference_circle(points, kind)
    except ValueError:
        assume(kind != "MIC")
        raise


def away(points, found):
    return np.hypot(*(points - found.center).T)


@settings(deadline=None)  # the first call loads the kernels
@given(profiles())
def test_the_minimum_zone_is_the_narrowest(points):
    least = reference_circle(points, "MZC").value
    for kind in KINDS[:3]:
        assert least <= held(points, kind).value + ROUNDING


@settings(deadline=None)  # the first call loads the kernels
@given(profiles(), st.sampled_from(KINDS))
def test_values_are_those_of_the_points(points, kind):
    found = held(points, kind)
    distance = away(points, found)
    assert found.value == pytest.approx(np.ptp(distance), abs=1e-12)
    assert found.ron_p == pytest.approx(distance.max() - found.radius, abs=1e-12)
    assert found.ron_v == pytest.approx(found.radius - distance.min(), abs=1e-12)
    assert found.ron_q == pytest.approx(np.sqrt(np.mean((distance - found.radius) ** 2)), abs=1e-12)
    nothing = {"MCC": found.ron_p, "MIC": found.ron_v, "MZC": found.ron_p - found.ron_v}
    assert nothing.get(kind, 0.0) == pytest.approx(0, abs=1e-12)


@settings(deadline=None)  # the first call loads the kernels
@given(profiles())
def test_contacts_of_the_circumscribed_circle_prove_it(points):
    """On the circle, none outside, and the center in their hull: so no smaller circle holds them."""
    found = reference_circle(points, "MCC")
    assert away(points, found).max() <= found.radius + 1e-12
    contacts = points[found.contacts] - found.center
    assert np.hypot(*contacts.T) == pytest.approx(found.radius, abs=1e-11)
    weights, rest, *_ = np.linalg.lstsq(
        np.vstack([contacts.T / 50, np.ones(len(contacts))]), [0, 0, 1], rcond=None
    )
    assert weights.min() > -1e-9 and np.all(rest < 1e-18)
    assert found.bound == pytest.approx(found.radius, abs=1e-12) and found.outer.all()


@settings(deadline=None)  # the first call loads the kernels
@given(profiles())
def test_contacts_of_the_inscribed_circle_hold_it(points):
    found = held(points, "MIC")
    assert away(points, found).min() >= found.radius - 1e-12
    assert away(points, found)[found.contacts] == pytest.approx(found.radius, abs=1e-11)
    gaps = np.diff(np.sort(found.contact_angles), append=np.min(found.contact_angles) + 2 * np.pi)
    assert gaps.max() <= np.pi + 1e-9 and not found.outer.any()
    assert found.radius <= found.bound <= found.radius + 1e-9


@settings(deadline=None)  # the first call loads the kernels
@given(profiles())
def test_contacts_of_the_minimum_zone_alternate(points):
    found = reference_circle(points, "MZC")
    assume(found.contacts.size == 4)
    distance = away(points, found)[found.contacts]
    assert distance[found.outer] == pytest.approx(found.radius + found.value / 2, abs=1e-11)
    assert distance[~found.outer] == pytest.approx(found.radius - found.value / 2, abs=1e-11)
    order = found.outer[np.argsort(found.contact_angles)]
    assert order[0] == order[2] != order[1] == order[3]
    assert found.value - 1e-9 <= found.bound <= found.value + 1e-12


@settings(deadline=None)  # the first call loads the kernels
@given(profiles(), st.sampled_from(KINDS), st.floats(-np.pi, np.pi), PLACES, st.floats(0.2, 2), st.booleans())
def test_moving_turning_scaling_and_mirroring_change_nothing_else(points, kind, turn, place, scale, mirror):
    found = held(points, kind)
    turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) * scale
    moved = held((points * [1, -1] if mirror else points) @ turned + np.array(place), kind)
    assert moved.value == pytest.approx(scale * found.value, abs=ROUNDING)
    # about a flat optimum the centre is looser
    assert moved.radius == pytest.approx(scale * found.radius, abs=100 * ROUNDING)


@settings(deadline=None)  # the first call loads the kernels
@given(profiles(), st.sampled_from(KINDS[1:]), st.randoms(use_true_random=False))
def test_order_copies_and_points_between_change_nothing(points, kind, random):
    found = held(points, kind)
    low, high = found.radius - found.ron_v, found.radius + found.ron_p
    angle = np.array([random.uniform(0, 7) for _ in range(20)])
    between = found.center + on_rays(
        angle, low + (high - low) * np.array([random.uniform(0.1, 0.9) for _ in range(20)])
    )
    more = np.concatenate([points, between, points[:3]])
    again = held(more[random.sample(range(len(more)), len(more))], kind)
    assert again.value == pytest.approx(found.value, abs=ROUNDING)
    assert again.radius == pytest.approx(found.radius, abs=100 * ROUNDING)


@settings(deadline=None)  # the first call loads the kernels
@given(profiles(), st.floats(0, 10))
def test_a_tip_changes_the_radius_alone(points, tip):
    for kind in KINDS:
        bare, felt = held(points, kind), reference_circle(points, kind, tip_radius=tip)
        assert felt.radius == pytest.approx(bare.radius - tip, abs=1e-12)
        assert felt.value == pytest.approx(bare.value, abs=1e-12)
        assert felt.deviation == pytest.approx(bare.deviation, abs=1e-12)
        shift = tip if kind in ("MCC", "MIC") else 0.0
        assert felt.bound == pytest.approx(bare.bound - shift, abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(5))
def test_uncertainty_is_that_of_small_noise(kind, seed):
    """Against the change of the value as readings change one by one, by far less than what makes other points
    contacts.
    """
    points = random_profile(np.random.default_rng(seed), 16, "uneven", 1e-4)
    found = reference_circle(points, kind, noise_sd=1e-7)
    out = (points - found.center) / away(points, found)[:, np.newaxis]
    changes = 1e-7 * np.eye(len(points))[:, :, np.newaxis] * out
    slopes = [
        (reference_circle(points + e, kind).value - reference_circle(points - e, kind).value) / 2e-7
        for e in changes
    ]
    assert 1e-7 * np.linalg.norm(slopes) == pytest.approx(
        found.value_sd, rel=0.2
    )  # of 64 draws each slope is exact, their sum is not
    assert abs(found.value_bias) < 1e-3 * found.value_sd
