"""Analysis of variance of published data sets: equal to statsmodels, and to the sums of squares that were
published.
"""

from itertools import product

import numpy as np
import pandas
import pytest
import statsmodels.formula.api as formulas
from finishing_inside import analysed
from hypothesis import given, settings
from hypothesis import strategies as st
from published_sets import CARS, PEAS, PHADKE_FACTORS, PHADKE_RATIO, PHADKE_SQUARES, SETS, WARP_BREAKS
from scipy import stats
from statsmodels.stats.anova import anova_lm

from sdpgrind import finishing as fin

TABLES = ("L4", "L8", "L9", "L12", "L16", "L16(4^5)", "L18", "L27", "L36")


def study_of(data, **changes):
    return fin.Study.of_runs(
        data.settings, data.response, ratio="none", interactions=data.interactions, **changes
    )


def codes_of(study):
    """Which level each factor has in each run."""
    return np.transpose(
        [[study.levels(name).index(level) for level in levels] for name, levels in study.settings.items()]
    )


def peer(study):
    """The same table by statsmodels, type II, from a formula of its own."""
    data = {f"x{k}": pandas.Categorical(values) for k, values in enumerate(study.settings.values())}
    names = list(study.factors)
    terms = {name: f"C(x{k})" for k, name in enumerate(names)}
    terms |= {f"{a} x {b}": f"C(x{names.index(a)}):C(x{names.index(b)})" for a, b in study.interactions}
    frame = pandas.DataFrame(data | {"y": study.readings[:, 0]})
    table = anova_lm(formulas.ols("y ~ " + " + ".join(terms.values()), frame).fit(), typ=2)
    return {name: table.loc[term] for name, term in terms.items()} | {"error": table.loc["Residual"]}


def close(found, wanted):
    return found == pytest.approx(wanted, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("name", SETS)
def test_equal_to_statsmodels(name):
    study = study_of(SETS[name])
    table, other = study.anova(), peer(study)
    for row in table.rows[:-1]:
        assert row.df == other[row.source].df
        assert close(row.ss, other[row.source].sum_sq), row.source
        if row.source != "error":
            assert close(row.F, other[row.source].F)
            assert close(row.p, other[row.source]["PR(>F)"])


@pytest.mark.parametrize("name", SETS)
def test_the_published_sums_of_squares(name):
    table = study_of(SETS[name]).anova()
    for source, square in SETS[name].squares.items():
        assert table[source].ss == pytest.approx(square, abs=1.0001 * SETS[name].tolerance), source


def test_cars_by_cylinders_alone():
    """One-way, as R prints it: 824.8 and 301.3, F = 39.7, p = 4.98e-09."""
    study = fin.Study.of_runs({"cylinders": CARS.settings["cylinders"]}, CARS.response, ratio="none")
    table = study.anova()
    assert table["cylinders"].ss == pytest.approx(824.8, abs=0.05) and table.error.ss == pytest.approx(
        301.3, abs=0.05
    )
    assert abs(table["cylinders"].F - 39.7) < 0.05 and table["cylinders"].p == pytest.approx(
        4.98e-9, rel=2e-3
    )


def test_which_of_them_are_orthogonal():
    assert study_of(WARP_BREAKS).anova().method.startswith("orthogonal")
    assert study_of(PEAS).anova().method.startswith("orthogonal")
    assert "general linear model, sums of squares of type II" in study_of(CARS).anova().method
    assert "general linear model" in str(study_of(CARS).anova())


def rest(y, *columns):
    """Sum of squares that dummies leave."""
    x = np.column_stack([np.ones(y.size), *(np.equal.outer(c, np.unique(c)).astype(float) for c in columns)])
    return float(np.sum((y - x @ np.linalg.lstsq(x, y, rcond=None)[0]) ** 2))


def test_type_two_by_what_each_effect_adds():
    """The second way: differences of what two models leave."""
    study = study_of(CARS)
    y = study.readings[:, 0]
    one, other = (codes_of(study)[:, k] for k in (0, 1))
    cells = 10 * one + other
    wanted = {
        "cylinders": rest(y, other) - rest(y, one, other),
        "C": rest(y, one) - rest(y, one, other),
        "cylinders x C": rest(y, one, other) - rest(y, cells),
        "error": rest(y, cells),
    }
    table = study.anova()
    for source, square in wanted.items():
        assert table[source].ss == pytest.approx(square, rel=1e-10)
    projected = analysed(study).model.squares(y)
    np.testing.assert_allclose(projected, [row.ss for row in table.effects], rtol=1e-10)


def phadke():
    return fin.Study("L9", PHADKE_FACTORS, PHADKE_RATIO, ratio="none")


def test_the_saturated_l9_of_phadke():
    table = phadke().anova()
    for name, square in PHADKE_SQUARES.items():
        assert table[name].ss == pytest.approx(square, rel=1e-12)
        assert table[name].F is None and table[name].p is None and table[name].pure_ss is None
    assert table.total.ss == pytest.approx(3800, rel=1e-12)
    assert table.error.df == 0 and table.error.ms is None
    text = str(table)
    assert "not available" in text and "saturated" in text and "nan" not in text and "inf" not in text


def test_phadke_pools_two_factors_by_name():
    table = phadke().anova(pool=("settling", "cleaning"))
    assert (table.error.ss, table.error.df, table.error.ms) == (pytest.approx(400), 4, pytest.approx(100))
    assert close(table["temperature"].F, 12.25)
    assert close(table["pressure"].F, 4.75)
    assert table["temperature"].p == pytest.approx(stats.f.sf(12.25, 2, 4), rel=1e-10)


def test_significance_that_only_pooling_made_is_not_counted():
    table = phadke().anova(pool=("settling", "cleaning"))
    assert table["temperature"].p < 0.05
    assert table.pooling.only_after == ("temperature",) and table["temperature"].note == "only after pooling"
    assert table.significant() == ()
    assert "significant only after pooling, not counted" in str(table)


def test_saturated_studies_predict_without_intervals():
    study = fin.Study("L9", PHADKE_FACTORS, 10 ** (-PHADKE_RATIO / 20), ratio="smaller")
    found = study.predict(study.best())
    assert found.ci_mean is None and found.response_mean is None and found.error_df == 0
    assert "not available" in repr(found) and "not available" in repr(study.best())
    assert all(row.half_width is None for row in study.level_means().rows)
    assert "not available" in study.report()
    with pytest.raises(ValueError, match="cannot be judged without an error"):
        study.anova(pool="F<1")


def test_readings_without_any_error():
    codes = fin.study.orthogonal_array("L8").matrix[:, :2]
    y = 3.0 * codes[:, 0] + 0.1 * codes[:, 1] + 7.3
    table = fin.Study("L8", {"a": (0, 1), "b": (0, 1)}, y, ratio="none", columns=(1, 2)).anova()
    assert table.error.df == 5 and table.error.ss == 0.0 and table["a"].F is None
    assert table["a"].ss == pytest.approx(18.0, rel=1e-12)
    flat = fin.Study("L8", {"a": (0, 1), "b": (0, 1)}, np.full(8, 2.0), ratio="none").anova()
    assert flat["a"].contribution is None and "nan" not in str(flat)


def test_a_missing_run_is_analysed_by_type_two():
    whole = fin.Study.published("wang-2001")
    lacking = whole.readings[:, 0].copy()
    lacking[6] = np.nan
    study = fin.Study("L18", whole.factors, lacking, reference=0.01, unit="mm")
    assert study.missing == (7,) and study.sn_ratio.size == 17
    table = study.anova()
    assert "type II" in table.method and table.error.df == 9
    y, codes = study.sn_ratio, np.delete(codes_of(whole), 6, axis=0)
    for k, name in enumerate(study.factors):
        others = [codes[:, j] for j in range(4) if j != k]
        assert table[name].ss == pytest.approx(rest(y, *others) - rest(y, *others, codes[:, k]), rel=1e-9)


def test_a_dummy_level_keeps_the_array_orthogonal():
    factors = {"a": (1.0, 2.0, 1.0), "b": (1.0, 2.0, 3.0), "c": (1.0, 2.0, 3.0)}
    y = np.random.default_rng(3).normal(5.0, 1.0, 9)
    study = fin.Study("L9", factors, y, ratio="none")
    table = study.anova()
    assert table["a"].df == 1 and table.error.df == 3
    codes = codes_of(study)
    assert np.bincount(codes[:, 0]).tolist() == [6, 3]
    for k, name in enumerate(factors):
        others = [codes[:, j] for j in range(3) if j != k]
        assert table[name].ss == pytest.approx(rest(y, *others) - rest(y, *others, codes[:, k]), rel=1e-9)
    assert study.level_means()["a"][1.0] == pytest.approx(y[codes[:, 0] == 0].mean(), rel=1e-12)


def test_interaction_columns_hold_the_interaction():
    """In an L8 the interaction of columns 1 and 2 is column 3: two ways to one number."""
    y = np.random.default_rng(5).normal(0.0, 1.0, 8)
    by_name = fin.Study(
        "L8", {"a": (0, 1), "b": (0, 1)}, y, ratio="none", columns=(1, 2), interactions=[("a", "b")]
    ).anova()
    column = {"a": (0, 1), "b": (0, 1), "ab": (0, 1)}
    by_column = fin.Study("L8", column, y, ratio="none", columns=(1, 2, 3)).anova()
    assert by_name["a x b"].ss == pytest.approx(by_column["ab"].ss, rel=1e-12)


def test_the_best_of_factors_that_interact_is_found_together():
    """Alone, a = 1 and b = 1 would be best; together they are worst."""
    gain = {(0, 0): 0.0, (0, 1): 4.0, (1, 0): 5.0, (1, 1): 2.0}
    codes = fin.study.orthogonal_array("L8").matrix[:, :2]
    noise = 0.05 * np.random.default_rng(1).normal(size=8)
    y = 10 ** (-np.array([gain[tuple(row)] for row in codes.tolist()]) / 20 + noise / 20)
    study = fin.Study("L8", {"a": (0, 1), "b": (0, 1)}, y, columns=(1, 2), interactions=[("a", "b")])
    assert dict(study.best()) == {"a": 1.0, "b": 0.0}
    plain = fin.Study("L8", {"a": (0, 1), "b": (0, 1)}, y, columns=(1, 2))
    assert dict(plain.best()) == {"a": 1.0, "b": 1.0}
    assert study.predict(study.best()).mean == pytest.approx(study.sn_ratio[[4, 5]].mean(), rel=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(TABLES), st.integers(0, 2**32 - 1))
def test_sums_of_squares_add_up_in_every_array(name, seed):
    array = fin.study.orthogonal_array(name)
    factors = {f"f{k}": tuple(range(n)) for k, n in enumerate(array.levels)}
    y = np.random.default_rng(seed).normal(size=array.runs)
    study = fin.Study(array, factors, y, ratio="none", columns=tuple(range(1, len(factors) + 1)))
    table = study.anova()
    assert sum(row.ss for row in table.rows[:-1]) == pytest.approx(table.total.ss, rel=1e-10)
    assert table.total.ss == pytest.approx(np.sum((y - y.mean()) ** 2), rel=1e-12)
    for k, source in enumerate(factors):
        column = array.matrix[:, k]
        means = np.array([y[column == level].mean() for level in range(array.levels[k])])
        per_level = array.runs / array.levels[k]
        assert table[source].ss == pytest.approx(
            per_level * np.sum((means - y.mean()) ** 2), rel=1e-9, abs=1e-12
        )


@settings(max_examples=20, deadline=None)
@given(st.permutations(range(18)), st.floats(-50.0, 50.0), st.floats(0.1, 10.0))
def test_order_origin_and_scale_do_not_matter(order, shift, scale):
    study = fin.Study.published("wang-2001")
    runs = {name: values[list(order)].tolist() for name, values in study.settings.items()}
    changed = fin.Study.of_runs(runs, scale * study.sn_ratio[list(order)] + shift, ratio="none")
    for row in study.anova().effects:
        assert abs(changed.anova()[row.source].F / row.F - 1) < 1e-9


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_rule_pools_what_is_below_one_and_nothing_else(seed):
    y = np.random.default_rng(seed).normal(size=18)
    study = fin.Study("L18", fin.Study.published("wang-2001").factors, y, ratio="none")
    table = study.anova(pool="F<1")
    below = {row.source for row in table.unpooled.effects if row.F < 1}
    assert set(table.pooling.names) == below
    assert {row.source for row in table.effects} == set(study.factors) - below
    late = {row.source for row in table.effects if row.p < 0.05 <= table.unpooled[row.source].p}
    assert set(table.pooling.only_after) == late
    assert not late & set(table.significant())


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_best_of_a_chain_of_interactions_is_the_best_of_all(seed):
    factors = dict.fromkeys("abcd", (0, 1))
    y = np.exp(np.random.default_rng(seed).normal(size=16))
    study = fin.Study("L16", factors, y, columns=(1, 2, 4, 8), interactions=[("a", "b"), ("b", "c")])
    every = [
        study.predict(dict(zip("abcd", levels, strict=True))).mean for levels in product((0, 1), repeat=4)
    ]
    assert study.predict(study.best()).mean == pytest.approx(max(every), rel=1e-9)
