"""The picture of a path: its line, its ends, its words."""

import numpy as np
import pytest

from sdpgrind.finishing import hilbert, zigzag
from sdpgrind.finishing.surface import flat_surface, nominal_surface


def test_line_ends_and_title(pyplot):
    path = hilbert(nominal_surface(), 2)
    figure = path.plot()
    axes, bar = figure.axes
    line = next(each for each in axes.collections if type(each).__name__ == "Line3DCollection")
    assert line.get_array().max() == pytest.approx(path.length) and line.norm.vmax == pytest.approx(
        path.length
    )
    dot, square = (each for each in axes.lines if each.get_marker() in "os")
    np.testing.assert_allclose(np.ravel(dot.get_data_3d()), path.points[0], rtol=1e-9)
    np.testing.assert_allclose(np.ravel(square.get_data_3d()), path.points[-1], rtol=1e-9)
    assert axes.get_title() == f"hilbert2, equal area: {path.length:.4g} mm, mean pitch {path.pitch:.3g} mm"
    assert bar.get_ylabel().endswith("[mm]")


def test_into_given_axes(pyplot):
    axes = pyplot.figure().add_subplot(projection="3d")
    path = zigzag(flat_surface(8.0), 1.0)
    assert path.plot(axes) is axes.figure
    assert axes.get_title().startswith("zigzag: 63 mm")
    with pytest.raises(TypeError, match=r"^ax must be 3-D axes"):
        path.plot(pyplot.figure().add_subplot())
