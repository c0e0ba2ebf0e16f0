"""Tables with exact slopes: cubics are exact, errors fall with the fourth power, ends clamp, and Koren's
locus is met to 1e-7.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from locus_inside import ABOVE, BELOW, INSIDE, NO_KEY, LocusTable, pack
from scipy.interpolate import CubicHermiteSpline

from sdpgrind.locus.kernels import look_up


def waves(key):
    return LocusTable(
        key, np.column_stack([np.sin(key), np.exp(-key)]), np.column_stack([np.cos(key), -np.exp(-key)])
    )


def koren(x):
    """Koren's locus in closed form, keyed by P_b: u and v with their slopes."""
    whole = 1 + x**2
    u, v = (x**2 + 4 * x - 1) / whole, (4 + 2 * x) / whole
    u_x, v_x = ((2 * x + 4) - 2 * x * u) / whole, (2 - 2 * x * v) / whole
    limit, limit_x = 17 + u - 4 * v, u_x - 4 * v_x
    return limit, np.column_stack([u, v]), np.column_stack([u_x, v_x]) / limit_x[:, None]


@st.composite
def keys(draw):
    """Nodes whose distances differ by up to nine powers of ten."""
    steps = draw(st.lists(st.floats(-8, 1), min_size=1, max_size=60))
    rising = np.cumsum([draw(st.floats(-5, 5)), *(10.0**s for s in steps)])
    return rising if draw(st.booleans()) else rising[::-1]


@settings(max_examples=150, deadline=None)
@given(keys(), st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_everywhere_the_hermite_cubic_of_scipy(key, places):
    table = waves(key)
    rising = slice(None, None, 1 if key[-1] > key[0] else -1)
    reference = CubicHermiteSpline(key[rising], table.columns[rising], table.slopes[rising])
    at = np.concatenate([table.low + (table.high - table.low) * np.array(places), key])
    np.testing.assert_allclose(
        table.at(at), reference(np.clip(at, table.low, table.high)), rtol=1e-9, atol=1e-13
    )


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=4, max_size=4), st.lists(st.floats(-3, 3), min_size=1, max_size=9))
def test_cubics_are_exact(coefficients, places):
    cubic = np.polynomial.Polynomial(coefficients)
    key = np.array([-3.0, -2.9, -1.0, 0.4, 0.41, 3.0])
    table = LocusTable(key, cubic(key)[:, None], cubic.deriv()(key)[:, None])
    np.testing.assert_allclose(table.at(places)[:, 0], cubic(np.array(places)), rtol=0, atol=1e-13)


def test_nodes_are_met_to_the_last_bit():
    key = np.cumsum(np.random.default_rng(4).exponential(1, 50))
    table = waves(key)
    np.testing.assert_array_equal(table.at(key), table.columns)


def test_errors_fall_with_the_fourth_power():
    at = np.linspace(0, 4, 4001)
    errors = [np.abs(waves(np.linspace(0, 4, n)).at(at)[:, 0] - np.sin(at)).max() for n in (11, 21, 41, 81)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4, atol=0.15)


def test_what_a_table_says_of_its_errors_is_what_it_errs_by():
    at = np.linspace(0, 4, 4001)
    table = waves(np.linspace(0, 4, 41))
    real = np.abs(table.at(at) - np.column_stack([np.sin(at), np.exp(-at)])).max(axis=0)
    np.testing.assert_allclose(table.errors(), real, rtol=0.1)
    assert np.all(np.isinf(waves(np.array([0.0, 1.0])).errors()))


@pytest.mark.parametrize("x", [np.geomspace(0.5, 20, 1000), 0.5 + 19.5 * np.linspace(0, 1, 4000) ** 2])
def test_two_hundred_points_of_the_locus_of_koren(x):
    table = LocusTable(*koren(x)).thinned(200)
    assert 150 <= table.key.size <= 200
    at, exact, _ = koren(np.geomspace(0.5, 20, 30001))
    error = np.abs(table.at(at) - exact).max()
    # measured with as many points elsewhere: 3.1e-8 with Hermite, 1.4e-6 with PCHIP
    assert error < 1e-8
    assert error < 1.3 * table.errors().max()


def test_thinning_keeps_ends_and_spreads_the_error():
    full = LocusTable(*koren(np.geomspace(0.5, 20, 1000)))
    thin = full.thinned(60)
    assert (thin.low, thin.high) == (full.low, full.high)
    even = np.linspace(full.low, full.high, 60)
    # nodes at equal steps of the key, with slopes from differences of a table 1e4 times finer
    blunt = full.at(even)
    slopes = (full.at(even + 1e-6) - full.at(even - 1e-6)) / 2e-6
    slopes[[0, -1]] = full.slopes[[0, -1]]
    assert LocusTable(even, blunt, slopes).errors().max() > 5 * thin.errors().max()
    assert full.thinned(1000) is full


def test_thinning_a_straight_line_and_falling_keys():
    key = np.linspace(5, 0, 100)
    line = LocusTable(
        key, np.column_stack([3 * key, 0 * key]), np.column_stack([3 + 0 * key, 0 * key])
    ).thinned(10)
    assert 2 <= line.key.size <= 10
    np.testing.assert_allclose(line.at([0.0, 1.234, 5.0]), [[0, 0], [3.702, 0], [15, 0]], atol=1e-12)


@pytest.mark.parametrize("way", [1, -1])
def test_kinks_stay_and_are_no_errors(way):
    left, right = np.linspace(0, 1, 100), np.concatenate([[1 + 1e-13], np.linspace(1, 2, 80)[1:]])
    key = np.concatenate([left, right])
    columns = np.concatenate([np.sin(left), np.sin(1) + 3 * (right - 1)])[:, None]
    slopes = np.concatenate([np.cos(left), np.full(80, 3.0)])[:, None]
    table = LocusTable(key[::way], columns[::way], slopes[::way])
    np.testing.assert_allclose(table.errors(), np.sin(1) / 99**4 / 384, rtol=0.1)
    thin = table.thinned(20)
    assert {1.0, 1 + 1e-13, 0.0, 2.0} <= set(thin.key)
    at = np.linspace(0, 2, 2001)
    exact = np.where(at < 1, np.sin(at), np.sin(1) + 3 * (at - 1))
    np.testing.assert_allclose(thin.at(at)[:, 0], exact, rtol=0, atol=1e-7)  # (1/15)^4/384 is 5e-8
    np.testing.assert_array_equal(LocusTable(key[98:102], columns[98:102], slopes[98:102]).errors(), [np.inf])


def test_a_falling_key_gives_the_same():
    key, columns, slopes = koren(np.geomspace(0.5, 20, 30))
    one, other = LocusTable(key, columns, slopes), LocusTable(key[::-1], columns[::-1], slopes[::-1])
    at = np.linspace(1, 19, 500)
    np.testing.assert_array_equal(one.at(at), other.at(at))
    np.testing.assert_array_equal(other.columns, columns[::-1])


def test_outside_the_end_is_given_and_flagged():
    table = waves(np.array([0.0, 1.0, 3.0]))
    for key, end, flag in ((-0.1, 0, BELOW), (-np.inf, 0, BELOW), (3.1, 2, ABOVE), (np.inf, 2, ABOVE)):
        out = np.empty(2)
        assert look_up(table.packed, key, out) == flag
        np.testing.assert_array_equal(out, table.columns[end])
        np.testing.assert_array_equal(table.at(key), out)
        assert table.clamped(key) is True
    for key in (0.0, 0.5, 3.0):
        assert look_up(table.packed, key, np.empty(2)) == INSIDE
        assert table.clamped(key) is False
    np.testing.assert_array_equal(table.clamped([-1.0, 1.0, 4.0]), [True, False, True])


def test_one_key_or_many():
    table = waves(np.linspace(0, 3, 7))
    many = table.at(np.array([[0.1, 0.2], [1.5, 2.5]]))
    assert many.shape == (2, 2, 2)
    for index in np.ndindex(2, 2):
        key = [[0.1, 0.2], [1.5, 2.5]][index[0]][index[1]]
        np.testing.assert_array_equal(many[index], table.at(key))
        np.testing.assert_array_equal(many[index], table.at(np.float64(key)))
    assert table.at(1).shape == (2,)


def test_nodes_too_close_to_be_told_apart_by_the_guide():
    key = np.array([0.0, 1e-310, 3e-310, 4e-310])
    packed = pack(key, np.array([[1.0], [2.0], [3.0], [4.0]]), np.zeros((4, 1)), 8)
    out = np.empty(1)
    assert look_up(packed, 3e-310, out) == INSIDE
    assert out == 3.0


@pytest.mark.parametrize(
    ("key", "columns", "slopes", "message"),
    [
        ([0, 1, 1, 2], (4, 1), (4, 1), r"key must rise or fall strictly; key\[1\] and key\[2\] are 1 and 1"),
        (
            [0, 1, 2, 1.5],
            (4, 1),
            (4, 1),
            r"key must rise or fall strictly; key\[2\] and key\[3\] are 2 and 1.5",
        ),
        (
            [2, 1, 0, 1.5],
            (4, 1),
            (4, 1),
            r"key must rise or fall strictly; key\[2\] and key\[3\] are 0 and 1.5",
        ),
        ([0, 0, 1], (3, 1), (3, 1), r"key must rise or fall strictly; key\[0\] and key\[1\] are 0 and 0"),
        ([0, np.nan], (2, 1), (2, 1), r"key\[1\] must be finite; got nan"),
        ([0], (1, 1), (1, 1), r"key must be a row of 2 numbers or more; got \(1,\)"),
        ([0, 1], (3, 1), (3, 1), r"columns must be of shape \(2, n\); got \(3, 1\)"),
        ([0, 1], (2,), (2,), r"columns must be of shape \(2, n\); got \(2,\)"),
        ([0, 1], (2, 2), (2, 1), r"slopes must be of shape \(2, 2\); got \(2, 1\)"),
    ],
)
def test_tables_that_are_refused(key, columns, slopes, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        LocusTable(np.array(key), np.zeros(columns), np.zeros(slopes))


def test_a_key_that_is_no_number_is_refused():
    table = waves(np.array([0.0, 1.0, 3.0]))
    for key in (np.nan, np.float64(np.nan)):
        with pytest.raises(ValueError, match=r"^key must be a number, no NaN; got nan$"):
            table.at(key)
    with pytest.raises(ValueError, match=r"^key\[1\] must be a number, no NaN; got nan$"):
        table.at([0.0, np.nan, np.nan])
    assert look_up(table.packed, np.nan, np.empty(2)) == NO_KEY


def test_a_table_does_not_change_with_what_it_was_made_of():
    key, columns, slopes = koren(np.geomspace(0.5, 20, 30))
    table = LocusTable(key, columns, slopes)
    before = table.at(7.0)
    columns[:] = 0.0
    np.testing.assert_array_equal(table.at(7.0), before)
    with pytest.raises(ValueError, match="read-only"):
        table.columns[0] = 1.0


def test_columns_are_put_where_they_are_wanted():
    key = np.array([0.0, 1.0, 3.0])
    table = LocusTable(key, np.column_stack([key**3, key]), np.column_stack([3 * key**2, np.ones(3)]))
    out = np.full(2, np.nan)
    assert table.at(2.0, out=out) is out
    np.testing.assert_allclose(out, table.at(2.0), rtol=0)
