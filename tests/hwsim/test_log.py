"""Logs: saved and loaded bit for bit, drawn."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from hwsim_fakes import Drain, Tank, noisy_tank
from hwsim_inside import same

import hwsim
import sdpgrind
from sdpgrind import weldbead


class Scanner(Drain):
    """Commands text and reports an array beside numbers."""

    def report(self):
        return {"profile": np.arange(3.0) + self.level, "end": self.level}


class Thrice:
    """A policy: three passes of a third each."""

    problem = weldbead.preset("P5").replace(height_max=5.0)

    def value(self, height, time_left):
        return 0.1

    def action(self, height, time_left):
        return SimpleNamespace(
            stop=height < 0.3, duration=10.0, feed_rate=6.25, normal_force=35.0, mean_cut=0.45, gap=0.0
        )


LOGS = {
    "one part": lambda: hwsim.run(Tank(), Drain()),
    "periodic": lambda: hwsim.run(noisy_tank(), Drain(period=1 / 60), parts=3),
    "compared": lambda: hwsim.compare(noisy_tank(), {"a": Drain(period=0.5), "b": Drain(3.0)}, parts=2),
    "arrays": lambda: hwsim.run(noisy_tank(), Scanner(), parts=2),
    "weld bead": lambda: hwsim.run(
        hwsim.WeldBeadStand(Thrice.problem, height=1.5), weldbead.SequenceController(Thrice()), parts=4
    ),
}


@pytest.mark.parametrize("name", LOGS)
def test_saved_log_is_loaded_bit_for_bit(tmp_path, name):
    log = LOGS[name]()
    log.save(tmp_path / "run.nc")
    loaded = sdpgrind.load(tmp_path / "run.nc")
    assert isinstance(loaded, hwsim.Log) and same(loaded, log) and repr(loaded) == repr(log)
    loaded.save(tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "run.nc").read_bytes()


def test_logs_that_differ_in_the_last_bit_are_not_the_same():
    one, other = hwsim.run(Tank(), Drain()), hwsim.run(Tank(level=np.nextafter(10.0, 11.0)), Drain())
    assert same(one, one) and not same(one, other)
    assert not same(one, hwsim.run(Tank(), SimpleTier()))


class SimpleTier(Drain):
    tier = "other"


@pytest.mark.parametrize("name", LOGS)
def test_every_log_can_be_drawn(name):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    figure = LOGS[name]().plot()
    try:
        labelled = [axis.get_xlabel() or axis.get_ylabel() or axis.get_title() for axis in figure.axes]
        assert all(labelled)
        figure.canvas.draw()
    finally:
        pyplot.close(figure)


def test_picture_of_beads_says_what_an_engineer_asks():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    log = LOGS["weld bead"]()
    figure = log.plot()
    try:
        heights, penalties, *_ = figure.axes
        words = {text.get_text() for text in heights.texts}
        assert {"target", "deadline", "overground"} <= words
        assert heights.get_ylabel() == "height of the bead [mm]" and heights.get_xlabel() == "time [s]"
        told = [text.get_text() for text in penalties.get_legend().get_texts()]
        assert told[0].startswith(f"realised {float(log.outcome.penalty.mean()):.4f}")
        assert told[1].startswith("planned 0.1000")
    finally:
        pyplot.close(figure)


def test_nothing_to_draw():
    class Blind(Drain):
        def step(self, **measured):
            return {"close": 1.0}

        report = None

    class Dark(Tank):
        def start(self, rng):
            machine = super().start(rng)
            machine.step = lambda command, ticks: type(machine).step(machine, command, ticks) and {}
            return machine

    log = hwsim.run(Dark(), Blind())
    assert set(log["tap"].data_vars) == {"level", "temperature", "close_command"}
    pytest.importorskip("matplotlib")
    log.plot()


def test_text_in_a_table_is_kept(tmp_path):
    class Talking(Drain):
        def report(self):
            return {"phase": "rough" if self.level > 5 else "fine"}

        def step(self, **measured):
            super().step(**measured)
            return {"flow": 2.0}

    log = hwsim.run(Tank(), Talking(), parts=2, journal=tmp_path / "run.db")
    assert log["tap"].phase_planned.values.tolist() == ["rough", "fine", "nan"] * 2
    assert log.outcome.phase_planned.values.tolist() == ["rough"] * 2
    log.save(tmp_path / "run.nc")
    assert same(sdpgrind.load(tmp_path / "run.nc"), log)
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert same(journal.log(), log)


class Judging(Drain):
    """Says how many steps it made, and claims the level and the time of the plant."""

    reports: ClassVar = {"steps": "1/s", "end": "s"}

    def verdict(self):
        return {"steps": float(self.steps), "level": -1.0}


def test_what_a_controller_says_of_a_part_that_is_done_stands_in_the_outcome(tmp_path):
    log = hwsim.run(noisy_tank(), Judging(period=0.5), parts=3)
    rows = np.bincount(log["tap"].part.values[np.isfinite(log["tap"].flow_command.values)])
    assert log.outcome.steps.values.tolist() == rows.tolist() and log.outcome.steps.units == "1/s"
    # what the plant says stands: at most 2.5 mm/s of flow, ticks of 0.1 s
    assert np.all(log.outcome.level.values >= -0.25)
    log.save(tmp_path / "run.nc")
    assert same(sdpgrind.load(tmp_path / "run.nc"), log)
    both = hwsim.compare(
        noisy_tank(), {"says": Judging(period=0.5), "does not": Drain(period=0.5)}, parts=3
    ).outcome
    assert both.steps.sel(controller="says").values.tolist() == rows.tolist()
    assert np.isnan(both.steps.sel(controller="does not")).all()


def test_comparison_is_drawn_as_differences_on_the_same_parts():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    log = hwsim.compare(noisy_tank(), {"slow": Drain(1.0), "fast": Drain(3.0)}, parts=4, rng=2)
    figure = log.plot()
    titles = {axis.get_title(): axis for axis in figure.axes}
    axis = titles["time less that of slow [s]"]
    shown = axis.lines[1].get_ydata()
    np.testing.assert_allclose(
        shown, log.outcome.time.sel(controller="fast") - log.outcome.time.sel(controller="slow")
    )
    assert [tick.get_text() for tick in axis.get_xticklabels()] == ["fast"]
    pyplot.close(figure)
