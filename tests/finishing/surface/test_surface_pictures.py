"""A surface drawn, kept in a file, and made again."""

import numpy as np
import pytest

from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing.surface import (
    cylinder_surface,
    flat_surface,
    nominal_surface,
    sphere_surface,
    uneven_surfaces,
)

SURFACES = {
    "nominal": nominal_surface(),
    "flat": flat_surface(50.0),
    "ball": sphere_surface(20.0),
    **uneven_surfaces(),
}


@pytest.mark.parametrize("name", SURFACES)
def test_encoded_and_back(name):
    surface = SURFACES[name].replace(outward=-1)
    again = decode(encode(surface))
    assert again == surface and hash(again) == hash(surface) and again.outward == -1
    np.testing.assert_array_equal(again.point(0.3, 0.7), surface.point(0.3, 0.7))


def test_knot_lines_are_drawn_where_they_are(pyplot):
    surface = uneven_surfaces()["steep"]
    (axes,) = surface.plot().axes
    lines = [np.stack(line.get_data_3d(), axis=-1) for line in axes.lines]
    at = np.unique(surface.knots[0])
    assert len(lines) == 2 * len(at) == 12
    fine = np.linspace(0.0, 1.0, len(lines[0]))
    np.testing.assert_allclose(lines[2], surface.point(at[2], fine), atol=1e-12)
    np.testing.assert_allclose(lines[8], surface.point(fine, at[2]), atol=1e-12)
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()) == ("x [mm]", "y [mm]", "z [mm]")


@pytest.mark.parametrize("name", SURFACES)
def test_to_one_scale_and_all_of_it(pyplot, name):
    (axes,) = SURFACES[name].plot().axes
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    points = SURFACES[name].grid(np.linspace(0, 1, 61), np.linspace(0, 1, 61)).point.reshape(-1, 3)
    assert (points.min(axis=0) >= limits[:, 0] - 1e-9).all() and (
        points.max(axis=0) <= limits[:, 1] + 1e-9
    ).all()
    scale = np.ptp(limits, axis=1) / axes._box_aspect
    np.testing.assert_allclose(scale, scale[0], rtol=1e-12)


@pytest.mark.parametrize("inside", [False, True])
def test_seen_from_the_tools_side(pyplot, inside):
    groove = cylinder_surface(20.0, 50.0, inside=inside)
    (axes,) = groove.plot().axes
    height, around = np.radians(axes.elev), np.radians(axes.azim)
    eye = np.array([np.cos(height) * np.cos(around), np.cos(height) * np.sin(around), np.sin(height)])
    assert eye @ groove.normal(0.5, 0.5) > 0.8


@pytest.mark.parametrize("outward", [1, -1])
def test_light_falls_on_the_tools_side(pyplot, outward):
    (axes,) = nominal_surface().replace(outward=outward).plot().axes
    axes.figure.draw_without_rendering()
    brightness = axes.collections[0].get_facecolor()[:, :3].mean(axis=1)
    assert np.median(brightness) > 0.6  # in the dark it would be 0.3


def test_into_axes_that_are_there(pyplot):
    figure = pyplot.figure()
    axes = figure.add_subplot(projection="3d")
    assert nominal_surface().plot(axes) is figure and len(figure.axes) == 1 and len(axes.lines) == 8
    with pytest.raises(
        TypeError, match=r"^ax must be 3-D axes of matplotlib, as add_subplot\(projection='3d'\) gives; got"
    ):
        nominal_surface().plot(pyplot.figure().add_subplot())
