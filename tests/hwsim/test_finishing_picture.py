"""The picture of the finishing cell shows what was true: force, feed, height, the way from above, roughness."""

import numpy as np
import pytest
from finishing_fakes import Steady, controller, motion, problem

import hwsim
from sdpgrind import finishing

pyplot = pytest.importorskip("matplotlib.pyplot")


@pytest.fixture(scope="module")
def zigzag():
    path = finishing.zigzag(finishing.surface.flat_surface(6.4), pitch=1.6)
    return finishing.FinishingProblem(path)


@pytest.fixture(scope="module")
def log(zigzag):
    plant = hwsim.FinishingCell(zigzag, scatter=hwsim.CellScatter(), target_force=1.11)
    return hwsim.run(plant, controller(zigzag), parts=3, rng=1)


@pytest.fixture
def drawn():
    yield lambda log: log.plot()
    pyplot.close("all")


def test_it_shows_what_was_true(log, drawn):
    height, force, feed, above, colours, parts = drawn(log).axes
    out = log.outcome.isel(part=2)
    np.testing.assert_array_equal(force.lines[0].get_ydata(), out.true_normal_force)
    np.testing.assert_array_equal(feed.lines[0].get_ydata(), out.true_feed)
    np.testing.assert_array_equal(height.lines[0].get_ydata(), 1e3 * out.height_error)
    assert force.lines[1].get_ydata()[0] == 1.11 and feed.lines[1].get_ydata()[0] == 25.0
    np.testing.assert_array_equal(parts.lines[0].get_ydata(), 1e3 * log.outcome.roughness_ra)
    places = above.collections[0].get_offsets()
    assert (
        set(map(tuple, places)) <= set(zip(out.true_x.values, out.true_y.values, strict=True))
        and len(places) > 100
    )
    labels = [axis.get_ylabel() for axis in (force, feed, height, above, parts, colours)]
    assert labels == [
        "force [N]",
        "feed [mm/s]",
        "height error [µm]",
        "y [mm]",
        "roughness Ra [µm]",
        "normal force [N]",
    ]


def test_its_title_says_the_main_thing(log, drawn):
    mean = float(log.outcome.normal_force.mean())
    title = drawn(log).get_suptitle()
    assert title.startswith(f"3 parts, zigzag: force {mean:.3f} N for 1.110 N, ") and title.endswith(" mm/s")


def test_what_is_not_known_is_not_shown(drawn):
    """No force that is wanted, and a path that the model of roughness does not know."""
    one = hwsim.run(hwsim.FinishingCell(problem()), controller(problem()))
    figure = drawn(one)
    assert len(figure.axes[1].lines) == 2 and " for " not in figure.get_suptitle()
    assert "1 of 1 part: beyond the roughness model" in [text.get_text() for text in figure.axes[5].texts]


def test_roughness_beyond_its_model_is_not_drawn(zigzag, drawn):
    of = zigzag.replace(tool_diameter=6.0)
    one = hwsim.run(hwsim.FinishingCell(of), controller(of))
    (axis,) = [each for each in drawn(one).axes if each.get_ylabel() == "roughness Ra [µm]"]
    assert np.isfinite(one.outcome.roughness_ra).all() and np.isnan(axis.lines[0].get_ydata()).all()
    assert [text.get_text() for text in axis.texts] == ["1 of 1 part: beyond the roughness model"]
    side = hwsim.compare(hwsim.FinishingCell(of), {kind: controller(of, kind) for kind in ("damped", "lqg")})
    assert not any("roughness" in axis.get_title() for axis in drawn(side).axes)


def test_a_part_without_contact_or_motion_is_drawn_too(drawn):
    for found in (Steady(0.0, 0.0), Steady(0.0, 1.0, motion(problem()).profile)):
        drawn(hwsim.run(hwsim.FinishingCell(problem(), max_time=0.2), found))


def test_controllers_side_by_side(zigzag, drawn):
    plant = hwsim.FinishingCell(zigzag, scatter=hwsim.CellScatter())
    kinds = {kind: controller(zigzag, kind) for kind in ("constant", "pidff", "lqg")}
    figure = drawn(hwsim.compare(plant, kinds, parts=5, rng=0))
    titles = [axis.get_title().replace("\n", " ") for axis in figure.axes]
    assert (
        "normal force sd less that of constant [N]" in titles and "lift off less that of constant" in titles
    )


def test_compared_controllers_leave_their_roughness_in_um(zigzag):
    controllers = {kind: controller(zigzag, kind=kind) for kind in ("damped", "lqg")}
    compared = hwsim.compare(
        hwsim.FinishingCell(zigzag, scatter=hwsim.CellScatter()), controllers, parts=3, rng=1
    )
    panels = {axis.get_title().replace("\n", " "): axis for axis in compared.plot().axes}
    gained = compared.outcome.roughness_ra.sel(controller="lqg") - compared.outcome.roughness_ra.sel(
        controller="damped"
    )
    panel = panels["roughness ra less that of damped [µm]"]
    marks = [
        *(line.get_ydata() for line in panel.lines),
        *(dots.get_offsets()[:, 1] for dots in panel.collections if len(dots.get_offsets())),
    ]
    assert any(
        len(y) == 3 and np.allclose(np.sort(y), np.sort(1e3 * gained.values), rtol=1e-9) for y in marks
    )
    assert "normal force less that of damped [N]" in panels
    pyplot.close("all")
