"""Reference circles: what is refused and how, uncertainty, saving, pictures."""

import matplotlib as mpl
import numpy as np
import pytest
from circle_inside import polar_axes, polar_scale
from circle_twins import on_rays, random_profile

from centering import Profile
from centering.roundness import Roundness, reference_circle
from sdpgrind.base import stored

pytestmark = pytest.mark.filterwarnings("ignore:Roundness.value_:DeprecationWarning")

mpl.use("Agg")
TURN = np.radians(np.arange(0.0, 360.0, 5.0))
ROUND = on_rays(TURN, 30.0 + 0.002 * np.cos(3 * TURN) + 0.001 * np.cos(2 * TURN + 1))


@pytest.mark.parametrize(
    ("points", "kind", "message"),
    [
        (ROUND[:3], "MZC", "points must be at least 4; got 3"),
        (ROUND[:2], "LSC", "points must be at least 3; got 2"),
        (ROUND.T, "LSC", r"points must be of shape \(n, 2\) \(mm\); got \(2, 72\)"),
        (
            np.where(np.arange(72)[:, np.newaxis] == 5, np.nan, ROUND),
            "MCC",
            r"points\[10\] must be finite \(mm\); got nan",
        ),
        (np.column_stack([TURN, 2 * TURN]), "LSC", "points must go around a circle; they lie on a line"),
        (np.ones((10, 2)), "MZC", "points must go around a circle; they lie on a line"),
        (ROUND[:30], "LSC", r"points must cover at least 180 deg about their circle; they cover 14\d"),
        (ROUND[:30], "MIC", "points must cover at least 180 deg"),
        (ROUND, "MMC", "kind must be one of LSC, MCC, MIC, MZC; got 'MMC'"),
    ],
)
def test_points_that_are_refused(points, kind, message):
    with pytest.raises(ValueError, match=message):
        reference_circle(points, kind)


def test_other_values_that_are_refused():
    with pytest.raises(
        ValueError,
        match=r"tip_radius must be < 30, the radius of the circle of the tip's centre \(mm\); got 31",
    ):
        reference_circle(ROUND, tip_radius=31.0)
    with pytest.raises(ValueError, match=r"noise_sd must be >= 0 \(mm\); got -0.1"):
        reference_circle(ROUND, noise_sd=-0.1)
    with pytest.raises(
        ValueError, match=r"noise_sd must be one number or one for each of 72 points \(mm\); got \(3,\)"
    ):
        reference_circle(ROUND, noise_sd=[1.0, 2.0, 3.0])
    with pytest.raises(TypeError, match=r"points must be numbers \(mm\); got 'circle'"):
        reference_circle("circle")


def test_a_circle_that_leaves_by_a_gap_is_refused():
    angle = np.radians(np.arange(-85.0, 96.0, 10.0))
    points = on_rays(angle, 30 + 0.2 * np.abs(np.sin(angle)))
    with pytest.raises(ValueError, match=r"circle from all sides; one of 30\.01\d* mm can leave by a gap"):
        reference_circle(points, "MIC")


def test_half_a_turn_is_one_rule_for_points_and_profiles():
    """Of a ring without form 179 deg are refused, whatever the step; 180 deg are enough."""
    for step in (1.0, 0.1):
        short, enough = (
            np.radians(np.arange(0.0, 179.0 + step / 2, step)),
            np.radians(np.arange(0.0, 180.0 + step / 2, step)),
        )
        for kind in ("LSC", "MCC", "MIC", "MZC"):
            with pytest.raises(
                ValueError, match="points must cover at least 180 deg about their circle; they cover 179 deg"
            ):
                reference_circle(on_rays(short, 30.0), kind)
            with pytest.raises(
                ValueError, match="points must cover at least 180 deg about their circle; they cover 179 deg"
            ):
                Profile(short, np.full(short.size, 30.0)).roundness(kind)
            assert reference_circle(on_rays(enough, 30.0), kind).radius == pytest.approx(30.0, abs=1e-9)
            assert Profile(enough, np.full(enough.size, 30.0)).roundness(kind).radius == pytest.approx(
                30.0, abs=1e-9
            )


def test_the_axis_may_lie_outside_the_points():
    far = reference_circle(ROUND + np.array([500.0, 0.0]), "MZC")
    assert far.value == pytest.approx(reference_circle(ROUND, "MZC").value, abs=1e-11)


@pytest.mark.parametrize("kind", ["LSC", "MCC", "MIC", "MZC"])
def test_uncertainty_against_simulated_noise(kind):
    """Noise of a millionth of the form, so that contacts stay as they are."""
    rng = np.random.default_rng(7)
    points = random_profile(rng, 15, "uneven", 0.01)
    found = reference_circle(points, kind, noise_sd=1e-6)
    out = (points - found.center) / np.hypot(*(points - found.center).T)[:, np.newaxis]
    values = [
        reference_circle(points + 1e-6 * rng.normal(size=(15, 1)) * out, kind).value for _ in range(2000)
    ]
    assert np.std(values) == pytest.approx(found.value_sd, rel=0.2)  # of 64 draws and 2000
    assert np.mean(values) == pytest.approx(found.value, abs=5 * found.value_sd / np.sqrt(2000))


def test_what_is_given_along_is_passed_on():
    found = reference_circle(ROUND, "MZC", tip_radius=3.75, filter="gaussian, 50 upr")
    assert (found.filter, found.tip_radius, found.value_sd) == ("gaussian, 50 upr", 3.75, None)
    assert "gaussian, 50 upr" in repr(found)


@pytest.mark.parametrize("kind", ["LSC", "MCC", "MIC", "MZC"])
def test_saved_and_read_it_is_the_same(kind):
    found = reference_circle(ROUND, kind, noise_sd=1e-4, noise_upr=[0.0, 0.0, 1.0, 0.5])
    again = stored.decode(stored.encode(found))
    assert again == found and hash(again) == hash(found) and isinstance(again, Roundness)
    assert (again.value_sd, again.value_bias) == (found.value_sd, found.value_bias)
    assert again != found.replace(radius=1.0) and found != "circle"


def test_what_is_found_cannot_be_changed():
    found = reference_circle(ROUND, "MZC")
    for array in (found.points, found.center, found.contacts, found.outer, found.deviation):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("kind", ["LSC", "MCC", "MIC", "MZC"])
def test_the_picture_shows_profile_circles_and_contacts(kind):
    found = reference_circle(ROUND, kind)
    (ax,) = found.plot().axes
    scale = polar_scale(found.deviation)
    profile, *others = ax.lines
    assert profile.get_ydata()[:-1] == pytest.approx(scale.base + 1000 * found.deviation)
    assert profile.get_ydata()[-1] == profile.get_ydata()[0]  # closed
    circles = [line for line in others if line.get_xdata().size == 361]
    heights = {round(float(line.get_ydata()[0] - scale.base), 9) for line in circles}
    assert {round(1000 * found.ron_p, 9) + 0.0, round(-1000 * found.ron_v, 9) + 0.0} <= heights
    marks = [line for line in others if line.get_xdata().size == 1]
    assert len(marks) == (found.contacts.size or 2)
    assert f"{scale.division:g} µm/div" in [text.get_text() for text in ax.texts]


@pytest.mark.parametrize("height", [0.002, 0.5])
def test_the_scale_stands_clear_of_the_directions(height):
    profile = Profile(TURN, 30.0 + height * np.cos(3 * TURN))
    for figure in (profile.plot(), profile.roundness("MZC").plot()):
        figure.draw_without_rendering()
        ax = figure.axes[0]
        told = next(text for text in ax.texts if "µm/div" in text.get_text()).get_window_extent()
        assert not any(label.get_window_extent().overlaps(told) for label in ax.get_xticklabels())
        assert told.x0 >= 0 and told.y0 >= 0


def test_a_line_is_broken_where_nothing_was_measured():
    found = reference_circle(np.delete(ROUND, slice(10, 30), axis=0))
    (ax,) = found.plot().axes
    assert np.isnan(ax.lines[0].get_ydata()).sum() == 1


@pytest.mark.parametrize("height", [1e-8, 0.0013, 0.12, 2.0])
def test_scale_is_one_two_or_five(height):
    deviation = np.array([-0.4, 0.6]) * height
    scale = polar_scale(deviation)
    lead = scale.division / 10.0 ** np.floor(np.log10(scale.division) + 1e-9)
    assert min(abs(lead - step) for step in (1, 2, 5)) < 1e-9
    assert 0.19 < scale.division / (1000 * height) * 1.2 < 0.51  # three to six divisions
    assert scale.height(deviation).min() >= 6 * scale.division * (1 - 1e-9)
    assert polar_axes(scale, deviation).get_rmax() > scale.height(deviation).max()
