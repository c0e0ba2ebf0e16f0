"""What a study refuses: the argument, the value, what it must be."""

import numpy as np
import pytest
from finishing_inside import general

from sdpgrind import finishing as fin
from sdpgrind.base import extras
from sdpgrind.finishing.study import OrthogonalArray

WANG = fin.Study.published("wang-2001")
Y = [1.0, 2.0, 3.0, 5.0]
TWO = {"a": (0, 1), "b": (0, 1)}


def l4(factors=None, response=None, **options):
    return fin.Study(
        "L4", TWO if factors is None else factors, Y if response is None else response, **options
    )


def nan_in(runs):
    response = WANG.readings[:, 0].copy()
    response[runs] = np.nan
    return fin.Study("L18", WANG.factors, response, reference=0.01)


def saturated():
    return fin.Study("L4", dict.fromkeys("abc", (0, 1)), Y)


REFUSED = [
    (lambda: fin.study.orthogonal_array("L10"), r"name must be one of L4, .*L36, L4\(2\^3\).*; got 'L10'"),
    (lambda: fin.Study([[0, 0], [0, 1], [1, 0], [1, 0]], TWO, Y), r"must be orthogonal, .* columns 1 and 2.*Study.of_runs"),
    (lambda: fin.Study([[0, 0], [1, 0]], TWO, Y[:2]), r"column 2 must have two or more levels, 0, 1, ... in full; got \[0\]"),
    (lambda: OrthogonalArray("x", [[0, 2], [1, 0]]), r"column 2 must have two or more levels"),
    (lambda: OrthogonalArray("x", [[0.5], [1.0]]), r"table must hold levels counted from 0, whole numbers"),
    (lambda: OrthogonalArray("x", [0, 1]), r"table must be of shape \(runs, columns\) with two runs or more; got \(2,\)"),
    (lambda: l4({"a": (1.0,)}), r"levels of 'a' must be two or more that differ; got \[1.0\]"),
    (lambda: l4({"a": (1.0, 1.0)}), r"levels of 'a' must be two or more that differ; got \[1.0, 1.0\]"),
    (lambda: l4({"a": "xy"}), r"levels of 'a' must be a sequence of numbers or names; got 'xy'"),
    (lambda: l4({"a": (1.0, np.nan)}), r"a level of 'a' must be finite"),
    (lambda: l4({"a": (1.0, None)}), r"a level of 'a' must be a number \(or a name\); got None"),
    (lambda: l4({}), r"factors must be a mapping from names to levels"),
    (lambda: l4({"error": (0, 1)}), r"a factor must have a name without ' x ' that is not 'error' or 'total'; got 'error'"),
    (lambda: l4({"a x b": (0, 1)}), r"a factor must have a name without ' x '"),
    (lambda: l4({"a": (0, 1, 2)}), r"L4\(2\^3\) has no free column of 3 levels for factor 1 of 1"),
    (lambda: l4({"a": (0, 1, 2)}, columns=[1]), r"levels of 'a' must be as many as its column has, 2"),
    (lambda: l4(columns=[1, 1]), r"columns must be without repeats; got 1 twice"),
    (lambda: l4(columns=[1, 4]), r"columns must be columns of the array, 1 to 3; got 4"),
    (lambda: l4(columns=[1]), r"columns must be one for each of the 2 factors; got 1"),
    (lambda: l4(response=Y[:3]), r"response must have one entry for each of the 4 runs; got 3"),
    (lambda: l4(response=[1.0, 2.0, -3.0, 5.0]), r"response must be >= 0 where smaller is better .*; got \[-3.0\] in run 3"),
    (lambda: l4(response=[1.0, 0.0, 3.0, 5.0]), r"response must not be all zeros in a run.*; got \[0.0\] in run 2"),
    (lambda: l4(response=[1.0, 0.0, 3.0, 5.0], ratio="larger"), r"response must be > 0 where larger is better"),
    (lambda: l4(ratio="nominal"), r"two replicates or more where a nominal value is best; got 1"),
    (lambda: l4(response=[[1.0, 1.0]] * 4, ratio="nominal"), r"response must scatter in each run"),
    (lambda: l4(response=["a"] * 4), r"response must be numbers; got \['a', 'a', 'a', 'a'\]"),
    (lambda: l4(response=np.ones((4, 1, 1))), r"response must be of shape \(runs,\) or \(runs, replicates\); got \(4, 1, 1\)"),
    (lambda: l4(response=[1.0, np.inf, 3.0, 5.0]), r"response\[1\] must be finite; got inf"),
    (lambda: l4(response=[[1, 2], [1, np.nan], [1, 2], [1, 2]]), r"NaN in all readings of a missing run; run 2 has both"),
    (lambda: l4(ratio="best"), r"ratio must be one of smaller, larger, nominal, nominal_taguchi, none; got 'best'"),
    (lambda: l4(reference=-1.0), r"reference must be > 0; got -1.0"),
    (lambda: nan_in(slice(0, 9)), r"each level must have a reading; tool_diameter has none at 4.0"),
    (lambda: l4(interactions=[("a", "c")]), r"a factor of an interaction must be one of a, b; got 'c'"),
    (lambda: l4(interactions=["ab"]), r"an interaction must be a pair of two factors; got 'ab'"),
    (lambda: l4(interactions=[("a", "a")]), r"an interaction must be a pair of two factors"),
    (lambda: l4(interactions=[("a", "b"), ("b", "a")]), r"interactions must be without repeats"),
    (
        lambda: fin.Study("L4", dict.fromkeys("abc", (0, 1)), Y, interactions=[("a", "b")]),
        r"effects must be told apart by the runs; those of c, a x b are not",
    ),
    (lambda: fin.Study.of_runs({"a": [0, 0, 1], "b": [5, 5, 6]}, Y[:3]), r"those of a, b are not"),
    (lambda: fin.Study.of_runs({"a": [0, 1, 1], "b": [5, 6]}, Y[:3]), r"settings must be sequences of one length"),
    (lambda: fin.Study.of_runs({"a": [0, 1, 1]}, Y), r"response must have one entry for each of the 3 runs; got 4"),
    (lambda: fin.Study.published("wang-2002"), r"name must be one of wang-2001; got 'wang-2002'"),
    (lambda: fin.Study(None, TWO, Y), r"array must be an OrthogonalArray, the name of one, or a table of levels; got None"),
    (lambda: l4(units={"c": "mm"}), r"units must be one of a, b; got 'c'"),
    (lambda: l4(units="mm"), r"units must be a mapping from factors to their units; got 'mm'"),
    (lambda: WANG.replace(ratios="larger"), r"Study has no field 'ratios'; is ratio meant\?"),
    (lambda: WANG.levels("speed"), r"factor must be one of tool_diameter, pattern, feed_rate, normal_force; got 'speed'"),
    (lambda: WANG.predict({"tool_diameter": 5.0}), r"tool_diameter must be one of its levels, 4, 3; got 5.0"),
    (lambda: WANG.predict({"pattern": "spiral"}), r"pattern must be one of its levels, hilbert5, hilbert4, zigzag"),
    (lambda: WANG.predict({"speed": 5.0}), r"factor must be one of tool_diameter, .*; got 'speed'"),
    (lambda: WANG.predict([4.0]), r"levels must be a mapping from factors to levels, as study.best\(\) gives"),
    (lambda: WANG.predict(WANG.best(), confirm=0), r"confirm must be >= 1; got 0"),
    (lambda: WANG.predict(WANG.best(), confidence=95), r"confidence must be in \(0, 1\) \(1\); got 95"),
    (lambda: WANG.anova(pool="feed_rate"), r'pool must be None, "F<1" or a sequence of names of effects; got \'feed_rate\''),
    (lambda: WANG.anova(pool=["speed"]), r"pool must be one of tool_diameter, .*; got 'speed'"),
    (lambda: l4(interactions=[("a", "b")]).anova(pool=["a"]), r"pool must name 'a x b' too where it names 'a'"),
    (lambda: WANG.anova()["speed"], r"source must be one of tool_diameter, .*, error, total; got 'speed'"),
    (lambda: WANG.best(alpha=5), r"alpha must be in \(0, 1\) \(1\); got 5"),
    (lambda: l4(ratio="none").best(), r"ratio must say what is better"),
    (lambda: WANG.level_means()["speed"], r"factor must be one of"),
    (lambda: saturated().power(), r"the study must leave an error to test with; it is saturated"),
    (lambda: saturated().next_runs(2, pool=None), r"an error for a response surface of 4 coefficients; got 4"),
    (lambda: WANG.power(runs=0), r"runs must be >= 1; got 0"),
    (lambda: WANG.power(model=3), r"model must be a RoughnessModel or a function of settings, rng= and runs=; got 3"),
    (lambda: WANG.power(runs=5, model=lambda s, rng, runs: np.ones((runs, 3))), r"must be of shape \(5, 18, 1\); got \(5, 3\)"),
    (lambda: WANG.power(runs=5, model=lambda s, **_: np.full((5, 18), np.nan)), r"readings of the model\[0\] must be finite"),
    (lambda: WANG.power(rng=-1), r"rng must be an int >= 0"),
    (lambda: WANG.power(rng=0, runs=10).beats("normal_force", 1.667, 9.0), r"level must be one of 0.556, 1.111, 1.667; got 9.0"),
    (lambda: WANG.next_runs(0), r"number must be >= 1; got 0"),
    (lambda: l4(interactions=[("a", "b")]).next_runs(1), r"a study without interactions"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "message"), REFUSED, ids=[message[:48] for _, message in REFUSED])
def test_refused(call, message):
    with pytest.raises((ValueError, TypeError), match=message):
        call()


def test_unbalanced_studies_say_what_to_install(monkeypatch):
    def gone(name):
        raise ImportError(name)

    monkeypatch.setattr(extras, "import_module", gone)
    assert general.need is extras.need
    with pytest.raises(ImportError, match=r"pip install 'sdpgrind\[statsmodels\]'"):
        nan_in([3]).anova()
    assert WANG.anova().error.df == 10  # an orthogonal array asks for nothing


def test_numbers_of_a_level_may_be_whole_or_nearly_so():
    same = [WANG.predict({"tool_diameter": value}).mean for value in (4, 4.0, np.float64(4), 4 * (1 + 1e-12))]
    assert len(set(same)) == 1
    study = l4()
    for value in (True, np.True_):
        with pytest.raises(ValueError, match=f"a must be one of its levels, 0, 1; got {value!r}"):
            study.predict({"a": value})
    found = WANG.power(rng=0, runs=10)
    assert found.beats("normal_force", 1.667 * (1 + 1e-12), 1.111) == found.beats(
        "normal_force", 1.667, 1.111
    )
    with pytest.raises(ValueError, match=r"level must be one of 0\.0, 1\.0; got True"):
        study.power(rng=0, runs=10, pool=None).beats("a", True, 0)
