"""The log-polar chart in the terminal, and the film strip of a part."""

import io
from math import pi

import numpy as np
import pytest
from centering_machine_inside import Chart, FilmStrip, LiveView, fingerprint, same, watched

import centering
import hwsim
from centering import preset

PROBLEM = preset("printed").replace(part=centering.push.Part(0.8, 61.95), pushes_max=4)
ROWS, COLUMNS = 21, 43


class Terminal(io.StringIO):
    """What is written to it, and whether it is a terminal."""

    def __init__(self, terminal=True):
        super().__init__()
        self._terminal = terminal

    def isatty(self):
        return self._terminal


@pytest.fixture(scope="module")
def machine():
    return hwsim.CenteringMachine(PROBLEM, start_offset=2.0)


@pytest.fixture(scope="module")
def log(machine):
    return hwsim.run(machine, centering.PrintedController(PROBLEM), rng=0)


def place_of(lines, sign):
    """Column and row of a sign from the middle, up and right positive."""
    found = [(x, y) for y, line in enumerate(lines) for x, each in enumerate(line) if each == sign]
    assert len(found) == 1
    return found[0][0] - (COLUMNS - 1) // 2, (ROWS - 1) // 2 - found[0][1]


def test_the_chart_is_log_polar():
    chart = Chart(0.0025, 10.0)
    for offset in (10.0, 1.0, 0.1, 0.01):
        share = (np.log10(offset) - np.log10(0.0025) + 0.5) / (np.log10(10.0 / 0.0025) + 0.5)
        for angle, (right, up) in ((0.0, (1, 0)), (pi / 2, (0, 1)), (pi, (-1, 0)), (-pi / 2, (0, -1))):
            x, y = place_of(chart.drawn([(offset, angle)]), "@")
            assert x == pytest.approx(right * share * (COLUMNS - 1) / 2, abs=0.51)
            assert y == pytest.approx(up * share * (ROWS - 1) / 2, abs=0.51)


def test_what_is_within_tolerance_is_inside_its_ring():
    lines = Chart(0.0025, 10.0).drawn([(3.0, 1.0), (0.002, 1.0)])
    assert sum(line.count("o") for line in lines) > 6
    x, y = place_of(lines, "@")
    assert abs(x) <= 4 and abs(y) <= 2
    assert place_of(lines, "1")[0] > 0 and place_of(lines, "1")[1] > 0


def test_a_chart_forgets_what_was_drawn_before():
    chart = Chart(0.0025, 10.0)
    chart.drawn([(3.0, 1.0)])
    assert not any("@" in line for line in chart.drawn([]))


def test_frames_show_every_push_and_the_end(machine, log):
    terminal, waited = Terminal(), []
    controller = watched(centering.PrintedController(PROBLEM), LiveView(PROBLEM, terminal, waited.append))
    assert same(hwsim.run(machine, controller, rng=0), log)
    written = terminal.getvalue()
    frames = written.split(f"\x1b[{ROWS + 1}A")
    assert len(frames) >= float(log.outcome.time[0]) / 0.1 * 0.9
    assert f"push {int(log.outcome.pushes[0]):2d}" in frames[-1]
    assert all(frame.count("\n") == ROWS + 1 for frame in frames)
    assert len(waited) == len(frames) - 1 or len(waited) == len(frames)
    assert max(waited) > 0.0  # the machine takes longer than its simulation


def test_silent_where_nobody_looks(machine, log):
    elsewhere = Terminal(terminal=False)
    view = LiveView(PROBLEM, elsewhere, lambda seconds: pytest.fail("waits for nobody"))
    assert same(hwsim.run(machine, watched(centering.PrintedController(PROBLEM), view), rng=0), log)
    assert elsewhere.getvalue() == ""


def test_a_watched_controller_is_the_same_to_a_journal():
    controller = centering.PrintedController(PROBLEM)
    seen = watched(controller, LiveView(PROBLEM, Terminal()))
    assert fingerprint(seen) == fingerprint(controller) and type(seen).__name__ == "PrintedController"
    assert isinstance(seen, centering.PrintedController) and type(controller) is centering.PrintedController


def test_a_film_strip_has_a_chart_and_a_push_each(log):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    figure = FilmStrip(log).plot()
    pushes = int(log.outcome.pushes[0])
    charts = [axis for axis in figure.axes if axis.name == "polar"]
    assert len(charts) == pushes and len(figure.axes) == 2 * pushes
    x, y = log.outcome.center_x.values[0], log.outcome.center_y.values[0]
    for k, chart in enumerate(charts):
        angle, _ = (float(np.squeeze(each)) for each in chart.lines[-1].get_data())
        assert angle == pytest.approx(np.arctan2(y[k + 1], x[k + 1]))
        assert chart.get_rmax() == charts[0].get_rmax()
    pyplot.close(figure)
