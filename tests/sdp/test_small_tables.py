"""Small tables: unrounded the bits of the full ones; rounded within half a step, in order, within the interval."""

import numba
import numpy as np
import pytest
from sdp_inside import (
    PRECISIONS,
    Rounding,
    narrowed,
    small_kernels,
    small_of,
    small_tables,
    small_tables_module,
)

from sdpgrind import sdp
from sdpgrind.base.compiling.compiled import opened


@pytest.fixture(scope="module")
def bend():
    """Blows of any size, or of two listed ones, up to three times; the action changes within many cells."""
    blow = sdp.Shift("error", lambda s, c: sdp.Normal(c.by, 0.1 * c.by))
    tap = sdp.Shift("error", lambda s, c: sdp.Normal(0.3 * c.hits, 0.05 + 0.0 * c.hits))
    moves = [
        sdp.Move("bend", {"by": sdp.Levels(0.0, 5.0, 51)}, blow),
        sdp.Move("tap", {"hits": [1.0, 2.0], "kind": [5.0, 7.0]}, tap, charge=0.01),
    ]
    stop = sdp.Stop("done", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(4.0)))
    axis = sdp.Axis("error", -3.0, 3.0, 121, "mm", below="stop", above="stop")
    return sdp.plan(sdp.Problem([axis], moves, [stop], sdp.Stages(3, 1.0, "hits_left", "")))


def states(count=400):
    rng = np.random.default_rng(0)
    return zip(rng.uniform(0.0, 3.0, count).tolist(), rng.uniform(-3.2, 3.2, count).tolist(), strict=True)


def told_of(small, time, x):
    out = np.zeros(small.told.kind.size)
    small_kernels.tell_small_at(*small.wide, 0, time, x, 0.0, 0.0, out)
    return out


def test_unrounded_tables_have_the_bits_of_the_full_ones(bend):
    small, codes = small_of(bend, "double", ("gap", "value")), [(0, 0), (1, 0), (1, 1)]
    assert bend.kinks.act.size > 20
    for time, x in states():
        found, move, entry, control, gap = bend.single.act(time, x)
        state, code, own = small_kernels.act_small_at(small.wide[0], 0, time, x, 0.0, 0.0)
        assert state == found
        assert code == move if move < 0 else codes[code] == (move, entry)
        assert np.array_equal(own, control if move == 0 else np.nan, equal_nan=True)
        told, value = told_of(small, time, x), bend.single.value(time, x)
        assert told[0] == gap and (told[1] == value if value is not None else np.isnan(told[1]))


@pytest.mark.parametrize("precision", ["int16", "float32"])
def test_rounded_controls(bend, precision):
    """Off by half a step at most, and within the interval of the plan's own controls."""
    small, chosen = small_of(bend, precision), bend.table.best == 0
    exact, rounded = bend.table.control[chosen], small.control[chosen]
    step = small.table.coding[0, 1] if precision == "int16" else np.spacing(np.float32(exact)).astype(float)
    assert 0.0 < np.max(np.abs(rounded - exact) / step) <= 0.5 + 1e-6
    every = np.append(exact, bend.kinks.control[bend.kinks.act == 0])
    low, high = every.min(), every.max()
    assert np.all((low <= rounded) & (rounded <= high)) or precision == "float32"
    assert np.isnan(small.control[bend.table.best != 0]).all()


def test_half_to_even():
    coding = np.broadcast_to([10.0, 2.0], (5, 2))
    assert Rounding("int16").stored(np.array([9.0, 11.0, 13.0, 15.0, 12.9]), coding).tolist() == [
        0,
        0,
        2,
        2,
        1,
    ]


def test_the_ends_of_a_range_are_not_left():
    rng = np.random.default_rng(1)
    for _ in range(300):
        numbers = rng.normal(scale=rng.choice([1e-3, 1.0, 1e6])) + rng.random(3)
        coding = Rounding("int16").coding([numbers])[0]
        reached = coding[0] + coding[1] * np.array([-32767, 32767])
        assert numbers.min() <= reached[0] and reached[1] <= numbers.max()
        assert reached[1] - reached[0] >= np.ptp(numbers) * (1.0 - 1e-6) - 1e-9


def test_a_number_out_of_range_is_refused():
    with pytest.raises(ValueError, match="precision must be float32 or double for this policy"):
        Rounding("int16").stored(np.array([4.0]), np.array([[0.0, 1e-4]]))


def test_lines_keep_their_order(bend, monkeypatch):
    """Costs of lines in cells whose order rounding would change are kept in more digits."""
    monkeypatch.setattr(small_tables_module, "LARGEST", 100)  # coarse enough for both
    table = small_of(bend, "int16").table
    assert (table.place < 0).any() and (table.place >= 0).any()
    coding = table.cost_coding[table.line_code + 1]
    narrow = coding[:, :1] + coding[:, 1:] * table.cost[np.maximum(table.place, 0)]
    kept = np.where(table.place[:, None] >= 0, narrow, table.wide[np.maximum(-1 - table.place, 0)])
    exact = bend.kinks.cost
    for a, b in zip(table.start[:-1], table.start[1:], strict=True):
        near = np.abs(kept[a:b] - exact[a:b]).max() < 2.0**-24 * np.abs(exact[a:b]).max()
        orders = [np.sign(cost[:, None] - cost[None]) for cost in (exact[a:b], kept[a:b])]
        assert near or np.array_equal(*orders)


@pytest.mark.parametrize("precision", ["int16", "float32"])
def test_no_gap_is_infinite(bend, precision):
    """At the deadline there is nothing but to stop."""
    small = small_of(bend, precision, ("gap",))
    assert told_of(small, 0.0, 1.0)[0] == np.inf
    assert told_of(small, 2.0, 1.03)[0] == pytest.approx(bend.action(hits_left=2, error=1.03).gap, abs=1e-3)


def test_kernels_are_compiled_once_for_all_precisions(bend):
    """Wide tables have the types of one another, and the numbers that C has."""
    kinds = set()
    for precision in PRECISIONS:
        small = small_of(bend, precision, ("gap", "value"))
        kinds.add(tuple(map(numba.typeof, small.wide)))
        for one, other in zip(small.law, small.wide, strict=True):
            assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))
    assert len(kinds) == 1


def test_cells_are_found_by_bisection(bend):
    """Each cell of the dense list by its number, all others not at all."""
    table, dense = small_of(bend, "double").table, bend.kinks.at[:, 0]
    find = opened(small_kernels._numbered)
    found = [[find(table.first, table.cells, row, cell) for cell in range(120)] for row in range(4)]
    assert np.array_equal(found, dense) and (dense >= 0).any()


def test_the_fewest_bytes():
    (one,) = narrowed(1, np.array([-128, 127]))
    two, empty = narrowed(1, np.array([128]), np.array([], dtype=int))
    assert (one.dtype, two.dtype, empty.dtype, empty.size) == (np.int8, np.int16, np.int16, 1)
    assert (
        narrowed(2, np.array([1]))[0].dtype == np.int16
        and narrowed(1, np.array([40_000]))[0].dtype == np.int32
    )


def test_the_smallest_form_that_keeps_the_value(bend, monkeypatch):
    """Whole numbers, unless they lose too much; then more digits; then a refusal that says what the finest loses.

    One between the smallest and the finest that loses too much is not followed to its end.
    """
    small, notes = small_tables(bend, "double", 1.0)
    assert small.precision == notes["precision"] == "int16" and notes["lost"]["all_stages"] <= 1.0
    monkeypatch.setattr(small_tables_module, "LARGEST", 7)  # coarse: 16 bits are as good as floats here
    coarse, fine = (small_tables(bend, form, None)[1]["lost"]["all_stages"] for form in ("int16", "float32"))
    assert fine < coarse
    assert small_tables(bend, "double", 0.5 * (coarse + fine))[1]["precision"] == "float32"
    told = []
    finest = r"must be >= .*, what tables in .* lose \(double loses .*: the plan's own error of its search"
    with pytest.raises(ValueError, match=finest):
        small_tables(bend, "double", 0.0, tell=lambda share, text: told.append((share, text)))
    stages = [sum(form in text for _, text in told) for form in ("int16", "float32", "double")]
    assert stages[1] < stages[0] == stages[2] == len(bend.table.value) and [
        each for each, _ in told
    ] == sorted(dict(told))
    with pytest.raises(ValueError, match=r"what tables in int16 lose \(\$\); got"):
        small_tables(bend, "int16", 0.5 * coarse)
    assert small_tables(bend, "double", None)[1] == {"precision": "double"}


def test_a_plan_without_its_problem_cannot_be_evaluated(bend):
    loaded = sdp.Policy.from_dataset(bend.dataset, None)
    assert small_tables(loaded, "double", None)[0].precision == "double"
    with pytest.raises(ValueError, match="the value lost by rounding needs the problem"):
        small_tables(loaded, "int16", None)
