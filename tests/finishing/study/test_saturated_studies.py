"""Runs of any kind that leave no error: sums of squares, and that the rest is not available."""

import sys

import numpy as np
import pytest

from sdpgrind import finishing as fin

RUNS = {"A": ["a", "a", "b", "b"], "B": ["x", "y", "z", "x"]}
LACKING = [1.0, 2.0, 3.0, np.nan, 5.0, 6.0, np.nan, 8.0, 9.0]
DUMMIES = {"a": (1, 2, 3), "b": (1, 2, 3), "c": (1, 2, 1), "d": (1, 2, 1)}
STUDIES = {
    "free runs": fin.Study.of_runs(RUNS, [1.0, 2.0, 4.0, 3.0]),
    "free runs, no ratio": fin.Study.of_runs(RUNS, [1.0, 2.0, 4.0, 3.0], ratio="none"),
    "missing runs and dummy levels": fin.Study("L9", DUMMIES, LACKING),
    "as they are in the model": fin.Study.of_runs({"A": ["a", "a", "b"]}, [1.0, 1.0, 3.0], ratio="none"),
}


@pytest.mark.parametrize("name", STUDIES)
def test_nothing_to_judge_by(name):
    study = STUDIES[name]
    table = study.anova()
    assert "type II" in table.method or table.method.startswith("orthogonal")
    assert table.error.ss == 0 and table.error.ms is None
    for row in table.effects:
        assert row.F is None and row.p is None and row.pure_ss is None and np.isfinite(row.ss)
    assert "not available" in study.report() and "nan" not in repr(table)
    if study.ratio != "none":
        assert not study.best().judged and study.predict(study.best()).ci_mean is None
        with pytest.raises(ValueError, match="an error"):
            study.next_runs(3, pool=None)
        with pytest.raises(ValueError, match="cannot be judged without an error"):
            study.next_runs(3)


def left(y, *columns):
    """Sum of squares that dummies leave."""
    x = np.column_stack([np.ones(y.size), *(np.equal.outer(c, np.unique(c)).astype(float) for c in columns)])
    return float(np.sum((y - x @ np.linalg.lstsq(x, y, rcond=None)[0]) ** 2))


@pytest.mark.parametrize("name", ["free runs", "free runs, no ratio", "missing runs and dummy levels"])
def test_sums_of_squares_are_what_each_effect_adds(name):
    study = STUDIES[name]
    y, there = study.sn_ratio, ~np.isnan(study.readings[:, 0])
    columns = {factor: values[there] for factor, values in study.settings.items()}
    for factor in columns:
        others = [values for other, values in columns.items() if other != factor]
        assert study.anova()[factor].ss == pytest.approx(left(y, *others), rel=1e-9)


def test_a_fit_without_error_asks_for_no_statsmodels(monkeypatch):
    monkeypatch.setitem(sys.modules, "statsmodels.stats.anova", None)
    assert "statsmodels" not in STUDIES["free runs"].anova().method
    y = [1.0, 1.0, 2.0, 2.0, 2.0, 5.0]
    exact = fin.Study.of_runs({"A": ["a", "a", "b", "b", "b", "c"]}, y, ratio="none").anova()
    assert exact.error.df == 3 and exact["A"].F is None
    assert exact["A"].ss == pytest.approx(np.var(y) * 6, rel=1e-12)
