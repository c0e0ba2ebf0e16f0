"""Pictures of a fit and of where the centre has been: what is drawn is what was measured."""

import numpy as np
import pytest

from centering.circle import CircleEstimate, circle_reading, fit_circle, plot_centers

ANGLE = np.radians(np.arange(20.0, 200.0))
READ = circle_reading(ANGLE, 61.94, 3.6, 0.7) + np.random.default_rng(0).normal(0, 0.01, 180)
CIRCLE = fit_circle(ANGLE, READ)


@pytest.fixture
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    return pyplot


def line(axis, label):
    (found,) = [each for each in axis.lines if each.get_label() == label]
    return found.get_xdata(), found.get_ydata()


def test_readings_model_and_residuals(pyplot):
    figure = CIRCLE.plot(ANGLE, READ)
    above, below = figure.axes
    x, y = line(above, "180 readings")
    assert x == pytest.approx(np.arange(20, 200)) and np.array_equal(y, READ)
    x, y = line(above, "exact model")
    assert y == pytest.approx(CIRCLE.reading(np.radians(x)))
    assert (x.min(), x.max()) == (pytest.approx(20), pytest.approx(199))
    left = below.lines[-1].get_ydata()
    assert left == pytest.approx(1e3 * (READ - CIRCLE.reading(ANGLE)), abs=1e-9)
    assert below.patches[0].get_height() == pytest.approx(4e3 * CIRCLE.noise_sd)
    assert (above.get_ylabel(), below.get_ylabel(), below.get_xlabel()) == (
        "reading [mm]",
        "residual [µm]",
        "spindle angle [deg]",
    )
    assert above.get_title().startswith("radius 61.9") and "direction not known" not in above.get_title()
    figure.canvas.draw()


def test_a_centred_part_has_no_direction(pyplot):
    turn = np.radians(np.arange(360.0))
    circle = fit_circle(turn, 61.94 + np.random.default_rng(1).normal(0, 0.01, 360))
    assert "direction not known" in circle.plot(turn, np.full(360, 61.94)).axes[0].get_title()


CENTERS = np.array([[-18.0, 9.0], [0.3, -0.4], [0.0006, 0.0008], [0.0, 0.0]])


def test_history_of_the_centre(pyplot):
    """Equal factors of the offset are equal distances; the middle holds what is nothing."""
    axis = plot_centers(CENTERS, 0.0025).axes[0]
    angle, height = axis.lines[1].get_data()
    assert angle[:3] == pytest.approx(np.arctan2(CENTERS[:3, 1], CENTERS[:3, 0]))
    assert height[0] - height[1] == pytest.approx(np.log10(np.hypot(18, 9) / 0.5))
    assert height[1] - height[2] == pytest.approx(np.log10(0.5 / 0.001))
    assert height[3] == 0.0 and height.max() < axis.get_rmax()
    _, ring = line(axis, "tolerance 2.5 µm")
    assert np.ptp(ring) == 0 and ring[0] - height[2] == pytest.approx(np.log10(2.5))
    labels = dict(zip((tick.get_text() for tick in axis.get_yticklabels()), axis.get_yticks(), strict=True))
    assert labels["1 mm"] - labels["10 µm"] == pytest.approx(2.0)
    assert labels["1 µm"] == pytest.approx(height[2])
    assert [each.get_text() for each in axis.texts] == ["0", "1", "2", "3"]
    axis.figure.canvas.draw()


def test_charts_of_a_film_have_one_scale(pyplot):
    """What is shown ends with its last centre; rings, rim and their names are those of the whole history."""
    whole = plot_centers(CENTERS, 0.0025).axes[0]
    for count in (1, 2, 3):
        axis = plot_centers(CENTERS, 0.0025, shown=count).axes[0]
        (angle,), (height,) = axis.lines[-1].get_data()
        assert (angle, height) == tuple(line[count - 1] for line in whole.lines[1].get_data())
        assert axis.get_rmax() == whole.get_rmax() and axis.get_yticks() == pytest.approx(whole.get_yticks())
        assert axis.get_rlabel_position() == whole.get_rlabel_position()
        assert [each.get_text() for each in axis.texts] == ["0", "1", "2", "3"][:count]


def test_rings_are_named_where_the_path_is_not(pyplot):
    """Never in the direction from which the path comes to the middle."""
    for degrees in (22.5, 112.5, 247.5):
        direction = np.radians(degrees) + np.array([0.1, -0.1, 0.1])
        offset = np.array([10.0, 0.3, 0.003])
        axis = plot_centers(
            np.column_stack([offset * np.cos(direction), offset * np.sin(direction)]), 0.0025
        ).axes[0]
        apart = np.radians(axis.get_rlabel_position() - degrees)
        assert np.cos(apart) < np.cos(np.radians(40.0))


def test_estimates_are_drawn_with_their_scatter(pyplot):
    wide = CircleEstimate(np.array([61.94, 0.01, 0.0]), np.diag([1e-6, 25e-6, 25e-6]))
    axis = plot_centers([CIRCLE, wide], 0.0025, ax=pyplot.figure().add_subplot(projection="polar")).axes[0]
    (bars,) = axis.collections[1].get_segments()[1:]
    low, high = bars[:, 1]
    assert high - low == pytest.approx(np.log10(0.015 / 0.005))


@pytest.mark.parametrize(
    ("centers", "tolerance", "message"),
    [
        (
            np.zeros((0, 2)),
            0.0025,
            r"centers must be of shape \(n, 2\), at least one centre \(mm\); got \(0, 2\)",
        ),
        ([[1.0, 2.0, 3.0]], 0.0025, r"centers must be of shape \(n, 2\)"),
        ([[1.0, np.nan]], 0.0025, r"centers\[1\] must be finite \(mm\); got nan"),
        (CENTERS, 0.0, r"tolerance must be > 0 \(mm\); got 0\.0"),
    ],
)
def test_bad_input(centers, tolerance, message):
    with pytest.raises(ValueError, match=message):
        plot_centers(centers, tolerance)


def test_bad_readings():
    with pytest.raises(
        ValueError,
        match=r"angle and reading must be one-dimensional of one length; got shapes \(180,\) and \(3,\)",
    ):
        CIRCLE.plot(ANGLE, READ[:3])
    with pytest.raises(ValueError, match=r"reading\[0\] must be finite \(mm\); got nan"):
        CIRCLE.plot([0.0], [np.nan])
