"""A factor whose levels are names and numbers: all give back what the user gave."""

import numpy as np

from sdpgrind import finishing as fin

GAP = ("auto", 1.0, 2.0)
STUDY = fin.Study(
    "L9", {"gap": GAP, "b": (1, 2, 3)}, [1.0, 2.0, 3.0, 3.0, 5.0, 6.0, 2.0, 8.0, 9.0], unit="mm"
)


def test_settings_are_what_was_given():
    gap = STUDY.settings["gap"]
    assert gap.tolist() == [level for level in GAP for _ in range(3)]
    assert [type(level) for level in gap[::3]] == [str, float, float]
    assert STUDY.settings["b"].dtype == float
    free = fin.Study.of_runs({"gap": ["auto", 2.0, 1.0, 2.0]}, [1.0, 2.0, 3.0, 4.0])
    assert free.settings["gap"].tolist() == ["auto", 2.0, 1.0, 2.0]


def test_further_runs_and_reports_have_them():
    least = fin.Study("L9", {"gap": GAP, "b": (1, 2, 3)}, [3.0, 5.0, 6.0, 1.0, 2.0, 3.0, 2.0, 8.0, 9.0])
    assert least.best()["gap"] == 1.0 and isinstance(least.next_runs(1)[0].settings["gap"], float)
    assert STUDY.next_runs(3)[0].settings == {"gap": "auto", "b": 1.0}
    assert "gap is best at" not in repr(least.next_runs(3)), "a factor with a name has no end"
    assert "auto" in STUDY.report() and "1.0" not in STUDY.report().split("Ratio")[0]
    assert STUDY.predict({"gap": 1}).levels == {"gap": 1.0}


def test_a_model_of_ones_own_is_given_them():
    seen = []

    def drawn(settings, rng, runs):
        seen.extend(settings["gap"])
        return rng.lognormal(np.zeros((runs, 9)))

    STUDY.power(model=drawn, runs=10)
    assert seen == STUDY.settings["gap"].tolist() and isinstance(seen[3], float)
