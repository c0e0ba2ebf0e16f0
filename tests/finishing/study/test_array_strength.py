"""Orthogonal arrays: strength 2, Taguchi's tables, interaction columns."""

from itertools import combinations

import numpy as np
import pytest
from finishing_inside import TABLES, assigned, confounding
from hypothesis import given
from hypothesis import strategies as st

from sdpgrind.finishing.study import OrthogonalArray, orthogonal_array

SHORT = ("L4", "L8", "L9", "L12", "L16", "L18", "L27", "L36")
NAMES = (*TABLES, *SHORT)


def counted(one, other):
    """How often each pair of levels comes, by counting pairs."""
    pairs = list(zip(one.tolist(), other.tolist(), strict=True))
    return {pair: pairs.count(pair) for pair in pairs}


@pytest.mark.parametrize("name", NAMES)
def test_strength_two(name):
    array = orthogonal_array(name)
    assert array.runs == int(array.name.partition("(")[0][1:])
    for i, j in combinations(range(len(array.levels)), 2):
        counts = counted(array.matrix[:, i], array.matrix[:, j])
        assert len(counts) == array.levels[i] * array.levels[j]
        assert len(set(counts.values())) == 1, (i, j)


@pytest.mark.parametrize("name", TABLES)
def test_levels_are_as_many_as_the_name_says(name):
    said = []
    for part in name.partition("(")[2].rstrip(")").split():
        base, power = map(int, part.split("^"))
        said += [base] * power
    assert list(orthogonal_array(name).levels) == said


@pytest.mark.parametrize("name", [name for name in TABLES if name not in ("L36(2^3 3^13)", "L18(2^1 3^7)")])
def test_the_others_are_saturated(name):
    array = orthogonal_array(name)
    assert sum(n - 1 for n in array.levels) == array.runs - 1


@pytest.mark.parametrize(("name", "left"), [("L18", 2), ("L36(2^3 3^13)", 6)])
def test_two_leave_degrees_of_freedom(name, left):
    array = orthogonal_array(name)
    assert array.runs - 1 - sum(n - 1 for n in array.levels) == left


# Rows of Taguchi's tables, levels from 1.
PRINTED = {
    "L8": {3: "1221122", 6: "2122121", 8: "2212112"},
    "L9": {6: "2312", 8: "3213"},
    "L12": {4: "12122122112", 12: "22112121221"},
    "L16(4^5)": {6: "22143", 9: "31342"},
    "L18": {5: "12223311", 10: "21133221", 16: "23132312", 18: "23321231"},
    "L27": {4: "1222111222333", 10: "2123123123123"},
    "L36": {7: "11222111222112312331223", 34: "22112121221131232312231"},
}


@pytest.mark.parametrize("name", PRINTED)
def test_rows_of_the_printed_tables(name):
    matrix = orthogonal_array(name).matrix
    for run, row in PRINTED[name].items():
        assert "".join(map(str, matrix[run - 1] + 1)) == row


def test_short_names_mean_the_usual_arrays():
    assert orthogonal_array("L16") == orthogonal_array("L16(2^15)")
    assert orthogonal_array("L36") == orthogonal_array("L36(2^11 3^12)")


def of(name, *columns):
    return confounding(orthogonal_array(name), {str(k): k for k in columns})


@pytest.mark.parametrize(("pair", "third"), [((1, 2), 3), ((1, 4), 5), ((2, 4), 6), ((3, 4), 7), ((5, 6), 3)])
def test_interaction_columns_of_the_l8(pair, third):
    found = of("L8", *pair, third)
    assert (str(pair[0]), str(pair[1]), str(third)) in found.whole


@pytest.mark.parametrize(
    ("pair", "both"), [((1, 2), (3, 4)), ((1, 5), (6, 7)), ((2, 5), (8, 11)), ((3, 5), (9, 13))]
)
def test_interaction_columns_of_the_l27(pair, both):
    for third in range(1, 14):
        if third not in pair:
            share = of("L27", *pair, third).shares.get((str(pair[0]), str(pair[1]), str(third)), 0.0)
            assert share == pytest.approx(1.0 if third in both else 0.0, abs=1e-12)


def test_the_l12_spreads_each_interaction_evenly():
    found = of("L12", *range(1, 12))
    assert len(found.shares) == 55 * 9
    assert set(np.round(list(found.shares.values()), 12)) == {round(1 / 9, 12)}
    assert not found.whole


def test_the_l18_hides_three_columns_behind_each_other():
    """Column 5 is column 4 plus 0, 1 or 2 by column 2, modulo 3: the one triple of the array that is not
    spread.
    """
    matrix = orthogonal_array("L18").matrix
    np.testing.assert_array_equal(matrix[:, 4], (matrix[:, 3] + matrix[:, 1]) % 3)
    assert {frozenset(names) for names in of("L18", *range(1, 9)).whole} == {frozenset("245")}
    assert assigned(orthogonal_array("L18"), (2, 3, 3, 3, 3, 3)) == (1, 2, 3, 4, 6, 7)


def test_one_interaction_of_the_l18_is_free():
    found = of("L18", *range(1, 9))
    assert not [names for names in found.shares if set(names[:2]) == {"1", "2"}]


def test_shares_are_those_of_regression_on_products():
    """The second way: R^2 of the third's contrasts regressed on dummies of the pair's cells, mains taken out."""
    matrix = orthogonal_array("L18").matrix
    cells = np.eye(9)[3 * matrix[:, 2] + matrix[:, 3]]
    mains = np.column_stack([np.ones(18), np.eye(3)[matrix[:, 2]], np.eye(3)[matrix[:, 3]]])
    interaction = cells - mains @ np.linalg.lstsq(mains, cells, rcond=None)[0]
    third = np.eye(3)[matrix[:, 1]] - 1 / 3
    fitted = interaction @ np.linalg.lstsq(interaction, third, rcond=None)[0]
    share = np.sum(fitted**2) / np.sum(third**2)
    assert of("L18", 2, 3, 4).shares["3", "4", "2"] == pytest.approx(share, abs=1e-12)


def test_assignment_keeps_clear_of_interactions_where_it_can():
    assert assigned(orthogonal_array("L8"), (2, 2, 2, 2)) == (1, 2, 4, 7)
    assert assigned(orthogonal_array("L16"), (2,) * 8) == (1, 2, 4, 7, 8, 11, 13, 14)
    assert assigned(orthogonal_array("L18"), (2, 3, 3, 3)) == (1, 2, 3, 4)
    assert of("L16", 1, 2, 4, 7, 8, 11, 13, 14).clear


@given(st.lists(st.integers(0, 2), min_size=9, max_size=9))
def test_what_is_not_orthogonal_is_refused(column):
    table = np.column_stack([orthogonal_array("L9").matrix[:, 0], column])
    balanced = all(sorted(np.array(column)[table[:, 0] == k]) == [0, 1, 2] for k in range(3))
    if balanced:
        assert OrthogonalArray("mine", table).levels == (3, 3)
    else:
        with pytest.raises(ValueError, match=r"must be orthogonal|two or more levels"):
            OrthogonalArray("mine", table)


def test_an_array_is_saved_and_loaded():
    from sdpgrind.base.stored import decode, encode

    array = orthogonal_array("L9")
    assert decode(encode(array)) == array
