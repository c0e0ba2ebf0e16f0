"""The picture of a run on the probe: what is drawn is what is in the log."""

import math

import numpy as np
import pytest

import hwsim
import sdpgrind
from centering.circle import circle_reading

RING = hwsim.Ring(61.94, 3.6, 0.5)
PROBE = hwsim.Probe(RING, truth=lambda rng: RING.replace(offset=rng.uniform(1.0, 3.0)))
UM = 1000.0


class Guess:
    """Stops after half a turn; says that the centre is 2 um off the ring of the problem along x, give or take
    5 um.
    """

    tier, period = "probe", None

    def __init__(self, error=0.002, silent=False):
        self.error, self.silent = error, silent
        self.reports = dict.fromkeys(("radius", "center_x", "center_y", "band"), "mm")

    def reset(self):
        pass

    def step(self, *, angle, **others):
        self.angle = angle
        return {"stop": 1.0} if angle > math.pi else {}

    def report(self):
        if self.silent or self.angle < 0.1:
            return {}
        return {
            "radius": 61.94,
            "center_x": RING.center_x + self.error,
            "center_y": RING.center_y,
            "band": 0.005,
        }


@pytest.fixture(autouse=True)
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")


def lines(axis):
    return {
        line.get_label(): (np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in axis.lines
    }


def test_shows_readings_model_residuals_and_how_the_centre_came_to_be_known():
    log = hwsim.run(PROBE.replace(truth=None, errors=None), Guess())
    reading, residual, history, parts = log.plot().axes
    table = log["probe"]
    turns, read = lines(reading)["read"]
    assert np.array_equal(read, table.reading) and turns[-1] == pytest.approx(0.5, abs=0.004)
    x, y = RING.center_x + 0.002, RING.center_y
    over, model = lines(reading)["model at the end"]
    guessed = 61.94, math.hypot(x, y), math.atan2(y, x), 3.75
    assert np.abs(model - circle_reading(2 * math.pi * over, *guessed)).max() < 1e-12
    left = residual.lines[0].get_ydata()
    assert (
        np.abs(left - UM * (table.reading.values - circle_reading(table.angle.values, *guessed))).max() < 1e-9
    )
    drawn = lines(history)
    assert drawn["from the true centre"][1] == pytest.approx(2.0)
    assert next(line for label, line in drawn.items() if label.startswith("band"))[1] == pytest.approx(5.0)
    assert parts.lines[0].get_ydata() == pytest.approx([0.4])


def test_marks_parts_that_were_further_off_than_was_said():
    log = hwsim.run(PROBE.replace(truth=None), Guess(error=0.006), parts=2)
    right, wrong = log.plot().axes[3].lines[:2]
    assert right.get_xdata().size == 0 and wrong.get_ydata() == pytest.approx([1.2, 1.2])
    assert wrong.get_color() == "tab:red"
    assert log.plot().get_suptitle() == "2 parts: 0.50 turns and 1.51 s each"


def test_a_controller_that_reports_nothing_has_its_readings_drawn():
    log = hwsim.run(PROBE, Guess(silent=True), parts=3)
    reading, residual, history, _ = log.plot().axes
    assert set(lines(reading)) == {"read"} and len(residual.lines) == 1 and not history.lines


def test_from_a_file(tmp_path):
    log = hwsim.run(PROBE, Guess(), parts=2)
    log.save(tmp_path / "run.nc")
    again = sdpgrind.load(tmp_path / "run.nc").plot()
    for one, other in zip(log.plot().axes, again.axes, strict=True):
        assert all(
            np.array_equal(a.get_xydata(), b.get_xydata(), True)
            for a, b in zip(one.lines, other.lines, strict=True)
        )
