"""Series after series: the same as single runs, in any order, and what is read of a log without labels."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import hwsim
from sdpgrind import plunge
from sdpgrind.base.rng import children

PROBLEM = plunge.preset("simulation")
GRINDER = hwsim.PlungeGrinder(PROBLEM, contact_zero_sd=0.01)
CONTROLLER = plunge.CycleController(PROBLEM.replace(wear_flat_area=0.0234), safety_margin=0.05)


def again(**changes):
    return hwsim.repeat(
        GRINDER, CONTROLLER, series=3, parts=4, rng=7, adapt=plunge.adaptation(PROBLEM), **changes
    )


def test_each_series_is_a_run_with_its_own_child():
    outcome = again()
    for k, rng in enumerate(children(7, 3)):
        single = hwsim.run(GRINDER, CONTROLLER, parts=4, rng=rng, adapt=plunge.adaptation(PROBLEM)).outcome
        assert single.identical(outcome.isel(series=k, drop=True).assign_coords(part=single.part))


def test_threads_give_the_same_bits():
    with ThreadPoolExecutor(2) as executor:
        assert again(executor=executor).identical(again())


def test_progress_and_units():
    told = []
    outcome = again(progress=lambda share, text: told.append((share, text)))
    assert told == [(k / 3, f"series {k} of 3") for k in (1, 2, 3)]
    assert outcome.time.dims == ("series", "part") and outcome.roundness.units == "mm"


def test_what_is_no_number_of_series():
    with pytest.raises(ValueError, match="series must be >= 1; got 0"):
        hwsim.repeat(GRINDER, CONTROLLER, series=0)


def test_columns_without_labels_are_those_with(tmp_path):
    log = hwsim.run(GRINDER, CONTROLLER, parts=2)
    log.save(tmp_path / "run.nc")
    for each in (log, hwsim.Log.from_file(tmp_path / "run.nc")):
        np.testing.assert_array_equal(each.column("controller", "size"), log["controller"]["size"].values)
        np.testing.assert_array_equal(each.figure("time"), log.outcome.time.values)
    with pytest.raises(KeyError):
        log.column("controller", "sise")
