"""The picture of a run on the adaptive grinder."""

import numpy as np
import pytest
from adaptive_fakes import NOMINAL, PROBLEM, Learned, Printed

import hwsim
from sdpgrind import physics

GRINDER = hwsim.AdaptiveGrinder(PROBLEM)


@pytest.fixture(scope="module")
def nominal():
    return hwsim.run(GRINDER, Printed(), parts=5, adapt=Learned())


@pytest.fixture
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")


def labelled(axis):
    return {line.get_label(): line for line in axis.lines}


def test_the_picture_shows_what_the_log_holds(nominal, pyplot):
    figure = nominal.plot()
    axes = {axis.get_ylabel(): axis for axis in figure.axes}
    assert list(axes) == [
        "slack [W]",
        "infeed rate [µm/s]",
        "power [W]",
        "work speed [mm/s]",
        "least slack [W]",
        "converged [s]",
    ]
    out = nominal.outcome
    first = np.isfinite(out.sample_time.values[0])
    rate = labelled(axes["infeed rate [µm/s]"])["true infeed"]
    np.testing.assert_array_equal(rate.get_ydata(), 1e3 * out.true_infeed_rate.values[0][first])
    np.testing.assert_array_equal(axes["converged [s]"].lines[0].get_ydata(), out.convergence_time)
    np.testing.assert_array_equal(axes["least slack [W]"].lines[0].get_ydata(), out.slack)
    slack = labelled(axes["slack [W]"])["burning less grinding power"].get_ydata()
    np.testing.assert_allclose(slack, (out.burning_power - out.true_grinding_power).values[0][first][1:])
    begins = [
        line.get_xdata()[0] for line in axes["infeed rate [µm/s]"].lines if line.get_linestyle() == "--"
    ]
    np.testing.assert_allclose(begins, [0, *np.cumsum(out.time.values)[:-1]], atol=1e-9)
    assert figure.get_suptitle() == "5 parts: 25.1 s each, 4 burned; wear flat area 0.0065 in the end"


def test_commands_lie_on_the_locus_that_is_drawn(nominal, pyplot):
    axis = next(axis for axis in nominal.plot().axes if axis.get_ylabel().startswith("work speed"))
    lines = labelled(axis)
    order = np.argsort(lines["command"].get_xdata())
    x, y = lines["command"].get_xdata()[order], lines["command"].get_ydata()[order]
    np.testing.assert_allclose(
        y, np.interp(x, lines["locus"].get_xdata(), lines["locus"].get_ydata()), rtol=5e-3
    )


def test_what_burns_is_shaded(nominal, pyplot):
    slack = nominal.plot().axes[0]
    lowest = [path.vertices[:, 1].min() for shade in slack.collections for path in shade.get_paths()]
    assert min(lowest) == pytest.approx(nominal.outcome.slack.values.min(), abs=0.1) and len(lowest) == 4
    assert slack.get_ylim()[0] < nominal.outcome.slack.values.min()


def test_another_law_and_a_part_without_commands_are_drawn_too(pyplot):
    class Mine(physics.DongSliding):
        pass

    class Rest:
        period = 1.0

        def reset(self):
            pass

        def step(self, **measured):
            return {}

    process = NOMINAL.replace(power=physics.GrindingPower(sliding=Mine()))
    for problem in (PROBLEM, PROBLEM.replace(model=process)):
        log = hwsim.run(hwsim.AdaptiveGrinder(problem, max_time=5.0), Rest())
        assert log.outcome.timed_out.values == 1.0 and log.plot()
    known = NOMINAL.replace(power=physics.GrindingPower(sliding=physics.DongSliding()))
    log = hwsim.run(
        hwsim.AdaptiveGrinder(PROBLEM.replace(model=known), wear_flat_area=0.02),
        Printed(0.01, factor=0.0),
        parts=6,
    )
    assert "locus" not in labelled(log.plot().axes[3])
    assert any(axis.get_title("left") == "The first 5 parts" for axis in log.plot().axes)


def test_controllers_are_compared_in_a_picture(pyplot):
    log = hwsim.compare(GRINDER, {"hold": Printed(0.0145), "none": Printed(0.0145, hold=0.0)}, parts=2)
    assert any("slack" in axis.get_title() for axis in log.plot().axes)
    np.testing.assert_allclose(log.outcome.true_wear_flat_area, [[0.0061, 0.0062]] * 2, rtol=2e-5)
