"""Signal-to-noise ratios against their formulas, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdpgrind import finishing as fin

Y = np.array([[2.0, 3.0, 4.0], [1.0, 1.5, 1.7]])
RATIOS = ("smaller", "larger", "nominal", "nominal_taguchi", "none")
positive = st.lists(st.floats(0.01, 100.0), min_size=2, max_size=6)


def by_hand(ratio, y, reference=1.0):
    n, mean = len(y), sum(y) / len(y)
    variance = sum((x - mean) ** 2 for x in y) / (n - 1)
    return {
        "smaller": lambda: -10 * np.log10(sum((x / reference) ** 2 for x in y) / n),
        "larger": lambda: -10 * np.log10(sum((reference / x) ** 2 for x in y) / n),
        "nominal": lambda: 10 * np.log10(mean**2 / variance),
        "nominal_taguchi": lambda: 10 * np.log10((n * mean**2 - variance) / (n * variance)),
        "none": lambda: mean,
    }[ratio]()


@pytest.mark.parametrize("ratio", ["smaller", "larger", "nominal", "nominal_taguchi", "none"])
def test_formulas(ratio):
    wanted = [by_hand(ratio, row, 2.0) for row in Y.tolist()]
    np.testing.assert_allclose(fin.study.sn_ratio(Y, ratio, reference=2.0), wanted, rtol=1e-12)


@given(positive, st.floats(0.1, 10.0))
def test_the_reference_only_shifts(y, reference):
    shift = 20 * np.log10(reference)
    assert fin.study.sn_ratio(y, "smaller", reference=reference) == pytest.approx(
        fin.study.sn_ratio(y, "smaller") + shift, abs=1e-9
    )
    assert fin.study.sn_ratio(y, "larger", reference=reference) == pytest.approx(
        fin.study.sn_ratio(y, "larger") - shift, abs=1e-9
    )


@given(positive)
def test_smaller_and_larger_mirror_each_other(y):
    assert fin.study.sn_ratio(1 / np.array(y), "larger") == pytest.approx(
        fin.study.sn_ratio(y, "smaller"), abs=1e-9
    )


@given(st.floats(0.01, 100.0))
def test_a_single_reading_is_only_another_scale(y):
    assert fin.study.sn_ratio([y]) == pytest.approx(-20 * np.log10(y), abs=1e-9)


@given(positive.filter(lambda y: np.ptp(y) > 1e-3), st.floats(0.1, 10.0))
def test_a_nominal_ratio_has_no_scale(y, scale):
    assert fin.study.sn_ratio(scale * np.array(y), "nominal") == pytest.approx(
        fin.study.sn_ratio(y, "nominal"), abs=1e-6
    )


@pytest.mark.parametrize("scale", [1e-305, 1e-200, 1e200, 1e305])
@pytest.mark.parametrize("ratio", RATIOS)
def test_very_small_and_very_large_readings(ratio, scale):
    """Squares of them are no numbers, their ratios are."""
    shift = {"smaller": -20 * np.log10(scale), "larger": 20 * np.log10(scale)}.get(ratio, 0.0)
    factor = scale if ratio == "none" else 1.0
    wanted = factor * fin.study.sn_ratio(Y, ratio, reference=2.0) + shift
    np.testing.assert_allclose(fin.study.sn_ratio(scale * Y, ratio, reference=2.0), wanted, rtol=1e-12)
    if ratio in ("smaller", "larger"):
        np.testing.assert_allclose(
            fin.study.sn_ratio(scale * Y, ratio, reference=2.0 * scale), wanted - shift, rtol=1e-9
        )


def test_readings_far_apart():
    assert fin.study.sn_ratio([1e-200, 1e200]) == pytest.approx(-4000 + 10 * np.log10(2))
    assert fin.study.sn_ratio([1e-200, 1e200], "larger") == pytest.approx(-4000 + 10 * np.log10(2))
    assert fin.study.sn_ratio([1e308, 1.5e308], "none") == pytest.approx(1.25e308)


def test_one_zero_among_readings_is_none_too_small():
    assert fin.study.sn_ratio([0.0, 1.0]) == pytest.approx(10 * np.log10(2))


REFUSED = [
    (
        [[1.0, 2.0], [1.0, -2.0]],
        "smaller",
        r"response must be >= 0 where smaller is better .*; got \[1.0, -2.0\] in run 2",
    ),
    ([[0.0, 0.0]], "smaller", r"response must not be all zeros in a run: .*; got \[0.0, 0.0\] in run 1"),
    ([[1.0, 0.0]], "larger", r"response must be > 0 where larger is better; got \[1.0, 0.0\] in run 1"),
    ([[1.0, -1.0]], "larger", r"response must be > 0 where larger is better"),
    ([[1.0]], "nominal", r"two replicates or more where a nominal value is best; got 1"),
    ([[1.0]], "nominal_taguchi", r"two replicates or more where a nominal value is best; got 1"),
    (
        [[1.0, 2.0], [3.0, 3.0]],
        "nominal",
        r"response must scatter in each run \(s > 0\).*; got \[3.0, 3.0\] in run 2",
    ),
    ([[0.1 + 0.2, 0.3]], "nominal", r"response must scatter in each run"),
    ([[-1.0, 1.0]], "nominal", r"response must have a mean != 0"),
    ([[-1.0, 1.5]], "nominal_taguchi", r"response must have a mean further from 0 than its standard error"),
    ([[np.nan]], "smaller", r"response\[0\] must be finite"),
    (["a"], "smaller", r"response must be numbers; got \['a'\]"),
    *(
        ([], ratio, r"response must have a reading or more in each run; got the shape \(0,\)")
        for ratio in RATIOS
    ),
    (3.0, "smaller", r"response must have an axis of replicates"),
    (
        [[1.0]],
        "biggest",
        r"ratio must be one of smaller, larger, nominal, nominal_taguchi, none; got 'biggest'",
    ),
]


@pytest.mark.parametrize(("response", "ratio", "message"), REFUSED)
def test_refusals(response, ratio, message):
    with pytest.raises((ValueError, TypeError), match=message):
        fin.study.sn_ratio(response, ratio)


def test_a_reference_is_positive():
    with pytest.raises(ValueError, match=r"reference must be > 0; got 0.0"):
        fin.study.sn_ratio([1.0], reference=0.0)
