"""Further runs: no two alike, levels that tie among them, and the law of one reading."""

import numpy as np
import pytest
from finishing_inside import law_of_a_reading
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import finishing as fin
from sdpgrind import sdp

ARRAY = fin.study.orthogonal_array("L9")


def study_of(gain, **changes):
    """An L9 of a and b with these dB at the levels of each, and a little scatter."""
    noise = 0.4 * np.random.default_rng(1).standard_normal(9)
    ratio = sum(np.array(gain[name])[ARRAY.matrix[:, k]] for k, name in enumerate("ab")) + noise
    return fin.Study(
        ARRAY, {"a": (1.0, 2.0, 4.0), "b": ("x", "y", "z")}, 10 ** (-ratio / 20), columns=(1, 2), **changes
    )


def test_a_number_that_ties_is_tried():
    study = study_of({"a": (6.0, 0.0, 5.9), "b": (9.0, 0.0, 3.0)})
    tied = {study.best()["a"], *(tie.level for tie in study.best().ties)}
    assert tied == {1.0, 4.0}
    runs = study.next_runs(2)
    assert {run.settings["a"] for run in runs} == {1.0, 4.0} and {run.settings["b"] for run in runs} == {"x"}
    assert runs[0].mean >= runs[1].mean and "as good, as far as the data say" in runs[1].why


def test_fewer_where_no_others_are_as_good():
    runs = study_of({"a": (9.0, 0.0, 5.0), "b": (9.0, 0.0, 3.0)}).next_runs(3)
    assert len(runs) == 1 and runs[0].settings == {"a": 1.0, "b": "x"}
    assert runs.notes[-1] == "1 of 3 runs: no other levels are as good, as far as the data say"


def test_none_where_all_is_pooled():
    study = study_of({"a": (9.0, 0.0, 5.0), "b": (9.0, 0.0, 3.0)})
    runs = study.next_runs(3, pool=["a", "b"])
    assert len(runs) == 0
    assert repr(runs) == "no factor shows an effect: no further run is worth more than another"


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from([None, "F<1"]))
def test_no_two_runs_are_alike(seed, number, pool):
    y = np.exp(0.3 * np.random.default_rng(seed).standard_normal(9))
    factors = {"a": (1.0, 2.0, 4.0), "b": ("x", "y", "z"), "c": (-1.0, 0.0, 3.0)}
    found = fin.Study(ARRAY, factors, y).next_runs(number, pool=pool)
    assert len(found) == len({tuple(run.settings.items()) for run in found}) <= number
    if len(found) < number:
        assert (
            "as good, as far as the data say" in found.notes[-1]
            or "no factor shows an effect" in found.notes[-1]
        )


@pytest.mark.parametrize("ratio", ["smaller", "larger"])
@pytest.mark.parametrize("repeats", [2, 8])
def test_the_law_is_that_of_one_reading(ratio, repeats):
    """Of very many runs with median 1.7, 30 % scatter within and 10 % from run to run: that of the readings
    themselves.
    """
    rng = np.random.default_rng(0)
    level = np.log(1.7) + 0.1 * rng.standard_normal((40000, 1))
    study = fin.Study.of_runs(
        {"a": [0, 1] * 20000}, np.exp(level + 0.3 * rng.standard_normal((40000, repeats))), ratio=ratio
    )
    law = law_of_a_reading(study, float(study.sn_ratio.mean()), float(study.sn_ratio.std()))
    square = np.log1p((float(law.sd) / float(law.mean)) ** 2)
    assert square == pytest.approx(0.3**2 + 0.1**2, rel=0.03)
    assert float(law.mean) == pytest.approx(study.readings.mean(), rel=0.01)


def test_more_replicates_do_not_make_a_reading_surer():
    rng = np.random.default_rng(3)
    gain = np.array([0.0, 1.0, 0.6])[ARRAY.matrix[:, :1]]
    y = np.exp(-gain + 0.3 * rng.standard_normal((9, 8)))
    run = fin.Study(ARRAY, {"a": (1.0, 2.0, 4.0)}, y, columns=(1,)).next_runs(1)[0]
    assert isinstance(run.law, sdp.LogNormal)
    assert 0.25 < float(run.law.sd) / float(run.law.mean) < 0.36
    assert run.sd < 2.0, "of the ratio, dB: that of the root mean square of all eight"


def test_a_reading_of_zero_has_a_law_too():
    y = np.array([[0.0, 1.0, 2.0], [1.0, 2.0, 3.0], [5.0, 6.0, 7.0], [6.0, 7.0, 8.0]])
    law = law_of_a_reading(fin.Study.of_runs({"a": [0, 0, 1, 1]}, y), -3.0, 1.0)
    assert 0 < float(law.sd) < np.inf and 0 < float(law.mean) < 10 ** (3 / 20) * 1.1
