"""Arrays in what is immutable: copies that cannot be changed, equality and hash by value."""

import dataclasses
from math import nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sdpgrind.base.arrays import ByValue, lasting, same
from sdpgrind.base.frozen import Frozen


@dataclasses.dataclass(frozen=True, eq=False)
class Thing(Frozen, ByValue):
    value: Any
    name: str = ""
    seen: Any = dataclasses.field(default=None, compare=False)


@dataclasses.dataclass(frozen=True, eq=False)
class Other(ByValue):
    value: Any
    name: str = ""


def test_a_lasting_array_is_a_copy_that_cannot_be_changed():
    own = np.array([1.0, 2.0])
    kept = lasting(own)
    own[0] = 5.0
    assert kept.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 5.0
    assert own.flags.writeable and lasting(kept) is not kept


def test_dtypes_of_lasting_arrays():
    assert lasting([1, 2]).dtype == np.float64
    assert lasting([1.0, 2.0], np.int64).dtype == np.int64
    assert lasting([0, 1], bool).tolist() == [False, True]


def test_equal_by_value():
    thing = Thing(np.array([1.0, 2.0]), "a")
    assert thing == Thing(np.array([1.0, 2.0]), "a") and thing == thing.replace()
    assert thing != thing.replace(name="b")
    assert thing != thing.replace(value=np.array([1.0, 2.5]))
    assert thing != thing.replace(value=np.array([[1.0, 2.0]])), "of another shape"
    assert thing != Other(thing.value, "a"), "of another class"
    assert thing != 3


def test_a_field_that_is_not_compared():
    thing = Thing(1.0)
    assert thing.replace(seen=np.ones(3)) == thing and hash(thing.replace(seen=np.ones(3))) == hash(thing)


def test_what_there_is_not_equals_what_there_is_not():
    assert same(nan, float("nan")) and same(np.array([1.0, nan]), np.array([1.0, nan]))
    assert not same(nan, 1.0) and not same(np.array([nan, 1.0]), np.array([1.0, nan]))
    assert not same(np.ones(1), None) and not same(None, np.ones(1)) and not same(1.0, "1.0")


ROWS = hnp.arrays(
    np.float64,
    hnp.array_shapes(max_dims=2, max_side=3),
    elements=st.sampled_from([0.0, -0.0, 1.0, nan, np.inf]),
)


@given(one=ROWS, other=ROWS)
def test_equal_things_have_equal_hashes(one, other):
    first, second = Thing(one), Thing(other)
    assert (first == second) == np.array_equal(one, other, equal_nan=True)
    if first == second:
        assert hash(first) == hash(second)


@pytest.mark.parametrize("value", [nan, np.array([-nan, -0.0]), np.array([1, 2]), np.array([True])])
def test_hashes_of_copies_and_of_other_dtypes(value):
    assert hash(Thing(value)) == hash(Thing(np.array(value, dtype=float) if np.ndim(value) else float("nan")))
    assert len({Thing(value), Thing(value), Thing(7.0)}) == 2
