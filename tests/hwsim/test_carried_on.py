"""What a part leaves behind for the next one: `after` of a plant, in runs, journals, comparisons and series."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hwsim_fakes import Drain, Faster, Tank
from hwsim_inside import same

import hwsim
from sdpgrind.base.rng import children


@dataclass(frozen=True)
class Rusting(Tank):
    """A tank whose leak grows with each part, by what leaked."""

    leak: float = 0.5

    def after(self, outcome):
        return replace(self, leak=1.1 * float(outcome["leak"]) + 0.1)

    def with_tick(self, tick):
        return replace(self, tick=tick)


def leaks(rng, parts):
    """The hidden leaks of a series, worked out by hand."""
    leak, found = 0.5, []
    for each in children(rng, parts):
        found.append(leak * each.random())
        leak = 1.1 * found[-1] + 0.1
    return found


class PowerCut(Exception):
    pass


def cut_after(parts):
    def progress(share, text):
        if text.startswith(f"part {parts} "):
            raise PowerCut

    return progress


def test_each_part_finds_the_plant_as_the_part_before_left_it():
    tank = Rusting()
    log = hwsim.run(tank, Drain(), parts=4, rng=2)
    np.testing.assert_array_equal(log.outcome.leak, leaks(2, 4))
    assert tank == Rusting()


def test_another_tick_stays():
    assert hwsim.run(Rusting(), Drain(period=0.25), parts=2)["tap"].time.values[1] == 0.25


@pytest.mark.parametrize("adapt", [None, Faster()], ids=["alone", "adapting"])
def test_a_cut_series_is_resumed(tmp_path, adapt):
    arguments = {"parts": 5, "rng": 3, "adapt": adapt}
    with pytest.raises(PowerCut):
        hwsim.run(Rusting(), Drain(), **arguments, journal=tmp_path / "run.db", progress=cut_after(3))
    resumed = hwsim.run(Rusting(), Drain(), **arguments, journal=tmp_path / "run.db")
    assert same(resumed, hwsim.run(Rusting(), Drain(), **arguments))


def test_controllers_that_are_compared_have_a_plant_each():
    log = hwsim.compare(Rusting(), {"slow": Drain(1.0), "fast": Drain(4.0)}, parts=3, rng=2)
    np.testing.assert_array_equal(log.outcome.leak, [leaks(2, 3)] * 2)


def test_series_begin_with_the_same_plant_on_any_number_of_workers():
    with ThreadPoolExecutor(2) as executor:
        outcome = hwsim.repeat(Rusting(), Drain(), series=3, parts=3, rng=5, executor=executor)
    np.testing.assert_array_equal(outcome.leak, [leaks(rng, 3) for rng in children(5, 3)])


def test_parts_in_parallel_are_refused():
    with ThreadPoolExecutor(1) as executor:
        for work in (
            hwsim.run,
            lambda plant, tap, executor: hwsim.compare(plant, {"tap": tap}, executor=executor),
        ):
            with pytest.raises(
                ValueError, match=r"executor must be None on a Rusting, which each part leaves changed"
            ):
                work(Rusting(), Drain(), executor=executor)


@dataclass(frozen=True)
class Careless(Rusting):
    """One whose `after` changes what it was given."""

    def after(self, outcome):
        leak = outcome["leak"]
        found, leak = float(leak), np.multiply(leak, 0.0, out=leak if isinstance(leak, np.ndarray) else None)
        return replace(self, leak=1.1 * found + 0.1)


def test_what_a_plant_does_with_an_outcome_leaves_the_log_alone():
    log = hwsim.run(Careless(), Drain(), parts=4, rng=2)
    np.testing.assert_array_equal(log.outcome.leak, leaks(2, 4))


def test_an_adaptation_is_no_class():
    with pytest.raises(
        TypeError, match=r"adapt must be an adaptation, not its class: Faster\(\); got Faster"
    ):
        hwsim.run(Rusting(), Drain(), parts=2, adapt=Faster)


def test_controllers_that_are_compared_learn_each_by_its_own():
    """Each is the run of its own, bit for bit; the adaptations that were given do not change."""
    taps, learns = {"learns": Drain(1.0), "stays": Drain(1.0)}, Faster()
    log = hwsim.compare(Rusting(), taps, parts=4, rng=2, adapt={"learns": learns})
    alone = hwsim.run(Rusting(), Drain(1.0), parts=4, rng=2, adapt=Faster())
    np.testing.assert_array_equal(log.outcome.sel(controller="learns").leak, alone.outcome.leak)
    assert not np.array_equal(
        *(log["tap"].flow_command.where(log["tap"].controller == name).dropna("row") for name in taps)
    )
    assert learns.total == 0.0


@pytest.mark.parametrize(
    ("adapt", "error", "message"),
    [
        ({"other": Faster()}, ValueError, "adapt must be one of tap; got 'other'"),
        (Faster(), TypeError, "adapt must be a mapping from names of controllers to adaptations"),
        ({"tap": 3}, TypeError, r"adapt\['tap'\] must be None or an adaptation"),
    ],
)
def test_adaptations_of_a_comparison_that_are_none(adapt, error, message):
    with pytest.raises(error, match=message):
        hwsim.compare(Tank(), {"tap": Drain()}, adapt=adapt)
